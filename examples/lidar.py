"""A lidar in a square room: every beam against the wall or the column that it meets.   python examples/lidar.py"""

import numpy as np
import tumble

HALF, RADIUS, AWAY = 4.0, 0.5, 2.0  # half a side of the room; the column and its distance, m
world = tumble.World()
for k, (x, y) in enumerate(((HALF + 0.5, 0), (-HALF - 0.5, 0), (0, HALF + 0.5), (0, -HALF - 0.5))):
    world.add_static(f"wall_{k}", tumble.Box((1, 10, 3) if x else (10, 1, 3)), position=(x, y, 1.5))
world.add_static("column", tumble.Cylinder(RADIUS, 3), position=(AWAY, 0, 1.5))

angles = np.linspace(-np.pi, np.pi, 720, endpoint=False)
beams = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(720)])
scan = world.cast_rays((0, 0, 1), beams, max_distance=20.0)  # all at once: distance, body, part, shape, face, normal

wall = HALF / np.abs(beams[:, :2]).max(axis=1)  # a square, seen from its center
inside = AWAY**2 * beams[:, 0] ** 2 - AWAY**2 + RADIUS**2  # of the root in |d·t - c|² = r²
column = np.where((inside > 0) & (beams[:, 0] > 0), AWAY * beams[:, 0] - np.sqrt(np.maximum(inside, 0)), np.inf)
error = np.abs(scan["distance"] - np.minimum(wall, column)).max()
hits = int((scan["body"] == 4).sum())  # the number of the column in world.bodies
print(f"720 beams, {hits} of them on the column: within {error:.1e} m")
