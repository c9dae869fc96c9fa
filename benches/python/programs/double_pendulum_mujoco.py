"""The program ``examples/double_pendulum.py`` with MuJoCo.

    target/python/bin/python benches/python/programs/double_pendulum_mujoco.py

A point has to have an inertia. Steps have one length: ten to a frame, by RK4, give the modes to 2e-11 rad as ours do, and the energy of the wild swing to 1e-5 J,
where ours, with a tolerance instead, is within 2e-8 J.
"""

import mujoco
import numpy as np

ROD = '<joint axis="0 1 0"/><inertial pos="0 0 -1" mass="1" diaginertia="1e-14 1e-14 1e-14"/>'  # a point of 1 kg, 1 m from a hinge
OPTION = f'<option timestep="{1 / 2400}" integrator="RK4"><flag energy="enable"/></option>'
ARM = f'<worldbody><body>{ROD}<body pos="0 0 -1">{ROD}</body></body></worldbody>'
model = mujoco.MjModel.from_xml_string(f"<mujoco>{OPTION}{ARM}</mujoco>")
data, errors, energies = mujoco.MjData(model), [], []
for root in (2**0.5, -(2**0.5)):  # the lower rod leans by ±√2 of the upper; qpos holds the upper's angle and the one between them
    mujoco.mj_resetData(model, data)
    data.qpos = 1e-4, 1e-4 * (root - 1)
    for _ in range(480):
        mujoco.mj_step(model, data, 10)
        errors.append(data.qpos[0] - 1e-4 * np.cos(np.sqrt((2 - root) * 9.81) * data.time))
mujoco.mj_resetData(model, data)
data.qpos = 2.5, 1.0
for _ in range(2400):
    mujoco.mj_step(model, data, 10)
    energies.append(data.energy.sum())
modes, drift = np.abs(errors).max(), np.ptp(energies)
print(f"modes within {modes:.1e} rad of the closed form; energy of the wild swing within {drift:.1e} J")
