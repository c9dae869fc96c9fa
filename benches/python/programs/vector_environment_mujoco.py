"""The program ``examples/vector_environment.py`` with MuJoCo, by its module ``rollout``.

    target/python/bin/python benches/python/programs/vector_environment_mujoco.py

A thousand pendulums stand upright in both. Observations and states are the same array here, with the time in front; each pendulum has a motor of its own, since a rollout takes
controls, and there are as many instances of the data as threads.
"""

import os
import mujoco
import mujoco.rollout
import numpy as np

N, LENGTH = 1000, 0.5
ROD = f'<body><joint name="rod" axis="0 1 0"/><inertial pos="0 0 {-LENGTH}" mass="1" diaginertia="1e-9 1e-9 1e-9"/></body>'
XML = f'<worldbody>{ROD}</worldbody><actuator><motor joint="rod"/></actuator>'
model = mujoco.MjModel.from_xml_string(f'<mujoco><option timestep="0.005"/>{XML}</mujoco>')
threads, rng = [mujoco.MjData(model) for _ in range(os.cpu_count())], np.random.default_rng(0)
states = np.zeros((N, 3))  # time, position, velocity
states[:, 1] = rng.uniform(-np.pi, np.pi, N)
angle, rate, total = states[:, 1], states[:, 2], np.zeros(N)
for _ in range(1400):  # Åström and Furuta: torque along the motion while the energy is below that of standing upright
    energy = 0.5 * LENGTH**2 * rate**2 - 9.81 * LENGTH * np.cos(angle) - 9.81 * LENGTH
    away = np.angle(-np.exp(1j * angle))  # from upright
    swing = np.clip(-2 * energy * np.where(rate < 0, -1, 1), -1.5, 1.5)
    torque = np.where(np.abs(away) < 0.5, -20 * away - 4 * rate, swing)
    states = mujoco.rollout.rollout(model, threads, states, torque[:, None, None], persistent_pool=True)[0][:, 0]
    angle, rate = states[:, 1], states[:, 2]
    total -= away**2
upright = np.abs(np.angle(-np.exp(1j * angle))) < 0.05
print(f"{upright.sum()} of {N} stand upright after {states[0, 0]:.0f} s; mean return {total.mean():.0f}")
