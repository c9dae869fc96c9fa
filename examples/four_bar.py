"""A parallelogram of three bars on two ground pins: the loop stays closed, and it swings like a pendulum of 0.375 m.   python examples/four_bar.py"""

import numpy as np
import tumble

HINGE, LEAN = {"axis": (0, 1, 0), "mass": 1}, np.radians(40)  # each bar is a point of 1 kg at its middle
world, builder = tumble.World(dt=1 / 2400), tumble.ArticulationBuilder("linkage")
builder.add_link("crank", center_of_mass=(0, 0, -0.25), q=LEAN, **HINGE)
builder.add_link("coupler", "crank", position=(0, 0, -0.5), center_of_mass=(0.5, 0, 0), q=-LEAN, **HINGE)
builder.add_link("rocker", "coupler", position=(1, 0, 0), center_of_mass=(0, 0, 0.25), q=LEAN, **HINGE)
builder.add_link("pin", "rocker", joint="fixed", position=(0, 0, 0.5))
linkage, gaps, angles = world.add_articulation(builder), [], [LEAN]
world.add_joint("spherical", (linkage, "rocker"), point=(1, 0, 0))
for _ in range(2400):
    world.step(10)
    angles.append(linkage.q[0])
    gaps.append(np.linalg.norm(linkage.link_pose("pin")[:3] - (1, 0, 0)))
crossings = [(k + a / (a - b)) / 240 for k, (a, b) in enumerate(zip(angles, angles[1:])) if a > 0 >= b]
print(f"open by at most {max(gaps):.1e} m in 10 s; period {np.diff(crossings).mean():.6f} s")
