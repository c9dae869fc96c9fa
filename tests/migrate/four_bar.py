"""A parallelogram of three bars on two ground pins: the loop stays closed, and it swings like a pendulum of 0.375 m.   python examples/four_bar.py"""

import numpy as np
import tumble

HINGE = 'joint = "revolute", axis = [0, 1, 0], mass_kg = 1, inertia_kg_m2 = [0, 0, 0]'  # each bar is a point of 1 kg at its middle
SCENE = f"""
closure = [{{ name = "ground", type = "point", a = "linkage/rocker", position_m = [1, 0, 0] }}]
[[articulated]]
name = "linkage"
link = [
    {{ name = "crank", {HINGE}, angle_deg = 40, center_m = [0, 0, -0.25] }},
    {{ name = "coupler", parent = "crank", position_m = [0, 0, -0.5], {HINGE}, angle_deg = -40, center_m = [0.5, 0, 0] }},
    {{ name = "rocker", parent = "coupler", position_m = [1, 0, 0], {HINGE}, angle_deg = 40, center_m = [0, 0, 0.25] }},
    {{ name = "pin", parent = "rocker", joint = "fixed", position_m = [0, 0, 0.5] }},
]"""
world = tumble.World.parse(SCENE)
linkage, gaps, angles = world.articulation("linkage"), [], [np.radians(40)]
for _ in range(2400):
    world.step()
    angles.append(linkage.q[0])
    gaps.append(np.linalg.norm(linkage.link_pose("pin")[:3] - (1, 0, 0)))
crossings = [world.dt * (k + a / (a - b)) for k, (a, b) in enumerate(zip(angles, angles[1:])) if a > 0 >= b]
print(f"open by at most {max(gaps):.1e} m in 10 s; period {np.diff(crossings).mean():.6f} s")
