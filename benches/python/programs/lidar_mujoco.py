"""The program ``examples/lidar.py`` with MuJoCo.

    target/python/bin/python benches/python/programs/lidar_mujoco.py

Both are within 2e-15 m. Its rays start at one point, and run on one core.
"""

import mujoco
import numpy as np

HALF, RADIUS, AWAY = 4.0, 0.5, 2.0  # half a side of the room; the column and its distance, m
WALL = '<geom type="box" pos="{} {} 1.5" size="{} {} 1.5"/>'
FAR = HALF + 0.5
walls = "".join(WALL.format(x, y, *((0.5, 5) if x else (5, 0.5))) for x, y in ((FAR, 0), (-FAR, 0), (0, FAR), (0, -FAR)))
COLUMN = f'<geom type="cylinder" pos="{AWAY} 0 1.5" size="{RADIUS} 1.5"/>'
model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{walls}{COLUMN}</worldbody></mujoco>")
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)

angles = np.linspace(-np.pi, np.pi, 720, endpoint=False)
beams = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(720)])
geoms, distances = np.empty(720, np.int32), np.empty(720)
mujoco.mj_multiRay(model, data, (0, 0, 1), beams.ravel(), None, True, -1, geoms, distances, None, 720, 20.0)

wall = HALF / np.abs(beams[:, :2]).max(axis=1)  # a square, seen from its center
inside = AWAY**2 * beams[:, 0] ** 2 - AWAY**2 + RADIUS**2  # of the root in |d·t - c|² = r²
column = np.where((inside > 0) & (beams[:, 0] > 0), AWAY * beams[:, 0] - np.sqrt(np.maximum(inside, 0)), np.inf)
error = np.abs(distances - np.minimum(wall, column)).max()
hits = int((geoms == 4).sum())
print(f"720 beams, {hits} of them on the column: within {error:.1e} m")
