"""The program ``examples/random_search.py`` with MuJoCo, by its module ``rollout``.

    target/python/bin/python benches/python/programs/random_search_mujoco.py

The cart is where its pushes bring it within 1e-15 m in both: RK4 is exact for steady forces. With one instance of the data the forks run on one core.
"""

import mujoco
import mujoco.rollout
import numpy as np

CART = '<worldbody><body><joint name="cart" type="slide" axis="1 0 0"/><geom size="0.1" mass="1"/></body></worldbody>'
MOTOR = '<actuator><motor joint="cart"/></actuator>'
model = mujoco.MjModel.from_xml_string(f'<mujoco><option timestep="0.05" integrator="RK4"/>{CART}{MOTOR}</mujoco>')
data, fork = mujoco.MjData(model), mujoco.MjData(model)
full = mujoco.mjtState.mjSTATE_FULLPHYSICS
state = np.empty(mujoco.mj_stateSize(model, full))
mujoco.mj_getState(model, data, state, full)

rng, mean, spread = np.random.default_rng(1), np.zeros(10), 25 * np.eye(10)
for _ in range(40):  # the cross-entropy method: draw, keep the best tenth, draw as they are spread
    pushes = rng.multivariate_normal(mean, spread, 500)
    states, _ = mujoco.rollout.rollout(model, fork, state, np.repeat(pushes, 2, axis=1)[..., None])  # (forks, steps, actuators)
    cost = (pushes**2).mean(axis=1) + 1e4 * ((states[:, -1, 1:3] - (1, 0)) ** 2).sum(axis=1)  # after the time
    best = pushes[np.argsort(cost)[:50]]
    mean, spread = best.mean(axis=0), np.cov(best.T)
for push in mean:
    data.ctrl = push
    mujoco.mj_step(model, data, 2)
print(f"cost {(mean**2).mean():.4f}; the cart ends at {data.qpos[0]:.5f} m with {data.qvel[0]:.5f} m/s")
