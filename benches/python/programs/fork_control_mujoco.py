"""The program ``examples/fork_control.py`` with MuJoCo, as short as its own module ``rollout`` allows.

    target/python/bin/python benches/python/programs/fork_control_mujoco.py

Both end within 1e-15 of rest at 1 m. With one instance of the data its forks run on one core; the state is copied out of the data before each rollout.
"""

import mujoco
import mujoco.rollout
import numpy as np

CART = '<body><joint name="cart" type="slide" axis="1 0 0"/><geom size="0.1" mass="1"/></body>'
ACTUATOR = '<actuator><motor joint="cart"/></actuator>'
model = mujoco.MjModel.from_xml_string(f'<mujoco><option timestep="0.02"/><worldbody>{CART}</worldbody>{ACTUATOR}</mujoco>')
data, fork = mujoco.MjData(model), mujoco.MjData(model)
full = mujoco.mjtState.mjSTATE_FULLPHYSICS
state = np.empty(mujoco.mj_stateSize(model, full))

plans = 4.0 * np.where(np.arange(60) < np.arange(61)[:, None], 1, -1)[..., None]  # N, (futures, steps, actuators): forward, then back
for _ in range(50):
    mujoco.mj_getState(model, data, state, full)
    states, _ = mujoco.rollout.rollout(model, fork, state, plans)
    misses = np.linalg.norm(states[:, :, 1:3] - (1, 0), axis=2)  # of rest at 1 m: states are (time, position, velocity)
    data.ctrl = plans[misses.min(axis=1).argmin(), 0]
    mujoco.mj_step(model, data)
print(f"after {data.time:.2f} s: {data.qpos[0]:.9f} m, {data.qvel[0]:.1e} m/s")
