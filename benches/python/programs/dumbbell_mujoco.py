"""The program ``examples/dumbbell.py`` with MuJoCo.

    target/python/bin/python benches/python/programs/dumbbell_mujoco.py

Both are within 6.5e-12 rad/s: MuJoCo by RK4 with ten steps to a frame, ours by a tolerance. It holds angular velocities of free bodies in their own axes, so it needs no gyroscope.
"""

import mujoco
import numpy as np

END, ARM, ROD = 2.0, 0.3, 0.02  # two points of 2 kg, each 0.3 m from the middle of a rod; its inertia about itself, kg·m²
across = 2 * END * ARM**2
BELL = f'<body><freejoint/><inertial pos="0 0 0" mass="{2 * END}" diaginertia="{across} {across} {ROD}"/></body>'
OPTION = f'<option gravity="0 0 0" timestep="{1 / 2400}" integrator="RK4"/>'
model = mujoco.MjModel.from_xml_string(f"<mujoco>{OPTION}<worldbody>{BELL}</worldbody></mujoco>")
data = mujoco.MjData(model)
spin = np.array([0.5, 0.0, 8.0])  # rad/s, along the axes of the body: z is the rod
data.qvel[3:] = spin

rate, errors = (ROD - across) / across * spin[2], []  # I₁ω̇₁ = (I₂ - I₃)ω₂ω₃ of a body with I₁ = I₂
for _ in range(480):
    mujoco.mj_step(model, data, 10)
    there = spin[0] * np.cos(rate * data.time), spin[0] * np.sin(rate * data.time), spin[2]
    errors.append(np.abs(data.qvel[3:] - there).max())
print(f"precession of {rate:.3f} rad/s in the body: within {max(errors):.1e} rad/s for {data.time:.0f} s")
