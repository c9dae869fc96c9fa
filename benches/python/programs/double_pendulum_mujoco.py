"""The program ``examples/double_pendulum.py`` with MuJoCo.

    target/python/bin/python benches/python/programs/double_pendulum_mujoco.py

A point has to have an inertia. Steps have one length: ten to a frame, by RK4, give the modes to 2e-11 rad as ours do, and the energy of the wild swing to 1e-5 J,
where ours, with a tolerance instead, is within 2e-8 J.
"""

import mujoco
import mujoco.rollout
import numpy as np

ROD = '<joint axis="0 1 0"/><inertial pos="0 0 -1" mass="1" diaginertia="1e-14 1e-14 1e-14"/>'  # a point of 1 kg, 1 m from a hinge
model = mujoco.MjModel.from_xml_string(f"""<mujoco><option timestep="{1 / 2400}" integrator="RK4"><flag energy="enable"/></option>
<worldbody><body>{ROD}<body pos="0 0 -1">{ROD}</body></body></worldbody></mujoco>""")
data, errors, energies = mujoco.MjData(model), [], []
for root in (2**0.5, -(2**0.5)):  # the lower rod leans by ±√2 of the upper; qpos holds the upper's angle and the one between them
    states, _ = mujoco.rollout.rollout(model, data, np.array([0, 1e-4, 1e-4 * (root - 1), 0, 0]), nstep=4800)
    times, angles = states[0, 9::10, :2].T
    errors.extend(angles - 1e-4 * np.cos(np.sqrt((2 - root) * 9.81) * times))
mujoco.mj_resetData(model, data)
data.qpos = 2.5, 1.0
for _ in range(2400):
    mujoco.mj_step(model, data, 10)
    energies.append(data.energy.sum())
print(f"modes within {np.abs(errors).max():.1e} rad; energy of the wild swing within {np.ptp(energies):.1e} J")
