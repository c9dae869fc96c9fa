"""The program ``examples/four_bar.py`` with MuJoCo.

    target/python/bin/python benches/python/programs/four_bar_mujoco.py

Joints of a loop are soft. With the settings by default the loop opens by 4e-4 m; at their stiffest, with ten steps to a frame, by 1e-9 m, as much as ours.
The period is within 2e-7 of the closed form; so is ours, with as many steps. A point has to have an inertia.
"""

import mujoco
import numpy as np

HINGE, MASS = '<joint axis="0 1 0"/>', 'mass="1" diaginertia="1e-9 1e-9 1e-9"'  # each bar is a point of 1 kg at its middle
model = mujoco.MjModel.from_xml_string(f"""<mujoco><option timestep="{1 / 2400}"/><worldbody>
<body>{HINGE}<inertial pos="0 0 -0.25" {MASS}/><body pos="0 0 -0.5">{HINGE}<inertial pos="0.5 0 0" {MASS}/>
<body name="rocker" pos="1 0 0">{HINGE}<inertial pos="0 0 0.25" {MASS}/><site name="pin" pos="0 0 0.5"/></body></body></body>
</worldbody><equality><connect body1="rocker" anchor="0 0 0.5" solref="0.0009 1" solimp="0.9999 0.9999 0.001"/></equality></mujoco>""")
data, gaps, angles = mujoco.MjData(model), [], [np.radians(40)]
data.qpos = np.radians((40, -40, 40))
for _ in range(2400):
    mujoco.mj_step(model, data, 10)
    angles.append(data.qpos[0])
    gaps.append(np.linalg.norm(data.site("pin").xpos - (1, 0, 0)))
crossings = [(k + a / (a - b)) / 240 for k, (a, b) in enumerate(zip(angles, angles[1:])) if a > 0 >= b]
print(f"open by at most {max(gaps):.1e} m in 10 s; period {np.diff(crossings).mean():.6f} s")
