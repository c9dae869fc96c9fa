"""The program ``examples/custom_force.py`` with MuJoCo.

    target/python/bin/python benches/python/programs/custom_force_mujoco.py

Both are within 1.2e-11 m, by RK4. The function is one for all models of the process, until ``mujoco.set_mjcb_passive(None)``, and keeps rollouts from using more than one core;
it acts on the coordinates, which here are seven numbers and six velocities of each body.
"""

import mujoco
import numpy as np

SPRING, DRAG = 40.0, 0.6  # N/m, N·s/m


def tether(model, data):
    pull = SPRING * data.qpos.reshape(-1, 7)[:, :3] + DRAG * data.qvel.reshape(-1, 6)[:, :3]
    data.qfrc_passive.reshape(-1, 6)[:, :3] -= pull


BODY = '<body pos="1 {} 0"><freejoint/><geom size="0.1" mass="{}" contype="0" conaffinity="0"/></body>'
OPTION = '<option gravity="0 0 0" timestep="0.0005" integrator="RK4"/>'
masses = np.array([0.5, 1.0, 2.0])
bodies = "".join(BODY.format(3 * k, mass) for k, mass in enumerate(masses))
model = mujoco.MjModel.from_xml_string(f"<mujoco>{OPTION}<worldbody>{bodies}</worldbody></mujoco>")
data = mujoco.MjData(model)
mujoco.set_mjcb_passive(tether)
mujoco.mj_step(model, data, 4000)
decay, rate = DRAG / (2 * masses), np.sqrt(SPRING / masses - (DRAG / (2 * masses)) ** 2)
expected = np.exp(-decay * data.time) * (np.cos(rate * data.time) + decay / rate * np.sin(rate * data.time))  # released at rest
error = np.abs(data.qpos[::7] - expected).max()
print(f"three oscillators after {data.time:.0f} s: within {error:.1e} m of the closed form")
