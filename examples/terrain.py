"""A block slides down a hillside of a height field: a = g (sin α - µ cos α).   python examples/terrain.py"""

import numpy as np
import tumble

SLOPE, FRICTION, DT = np.radians(25), 0.2, 1 / 240
x = np.linspace(-10, 10, 81)
heights = np.tile(-np.tan(SLOPE) * x, (41, 1))  # rows along x, from the smallest y on
world = tumble.World(dt=DT, combine_friction="min")
hill = world.add_static("hill", tumble.HeightField(heights, (20, 10)), friction=1)
down, up = np.array([np.cos(SLOPE), 0, -np.sin(SLOPE)]), np.array([np.sin(SLOPE), 0, np.cos(SLOPE)])
turn = (0, np.sin(SLOPE / 2), 0, np.cos(SLOPE / 2))
start = -6 * down + 0.15 * up
block = world.add_rigid("block", tumble.Box((0.6, 0.4, 0.3)), density=800, position=start, orientation=turn, friction=FRICTION)

slid, above = [], []
for _ in range(480):
    world.step()
    slid.append((block.position - start) @ down)
    above.append((block.position - start) @ up)
expected = 0.5 * 9.81 * (np.sin(SLOPE) - FRICTION * np.cos(SLOPE)) * (np.arange(1, 481) * DT) ** 2
print(f"slid {slid[-1]:.4f} m of {expected[-1]:.4f} m in 2 s, and left the hill by at most {np.abs(above).max():.1e} m")
