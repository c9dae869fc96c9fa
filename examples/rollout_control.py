"""Control by sampling: a pendulum is swung up by a motor too weak to lift it, by trying many futures at each turn.

    python examples/rollout_control.py

Model predictive path integral control (Williams et al., 2017). The futures are forks of the world that run on all cores.
"""

import numpy as np

import tumble

ROD = """
[world]
dt_s = 0.01

[[articulated]]
name = "pendulum"

[[articulated.link]]
name = "bob"
joint = "revolute"
axis = [0, 1, 0]
mass_kg = 1
center_m = [0, 0, -1]
inertia_kg_m2 = [0, 0, 0]   # a point, 1 m below the hinge
shape = { type = "sphere", radius_m = 0.1, position_m = [0, 0, -1] }
"""
FORKS, HORIZON, HOLD = 64, 25, 5  # futures, controls in each, steps that each control holds
STRONGEST = 0.4 * 1.0 * 9.81 * 1.0  # N·m: four tenths of what holds the bob out level

world = tumble.World.parse(ROD)
pendulum = world["pendulum"]
rng = np.random.default_rng(0)


def cost(states: np.ndarray) -> np.ndarray:
    """Of futures, shape (forks, kept, 2): q is 0 when it hangs, π upright; less height and more speed cost more."""
    q, qd = states[..., 0], states[..., 1]
    return ((1 + np.cos(q)) ** 2 + 0.02 * qd**2 * (np.cos(q) < -0.7)).sum(axis=1)


plan = np.zeros(HORIZON)
for turn in range(100):
    controls = np.clip(plan + rng.normal(0, 0.5 * STRONGEST, (FORKS, HORIZON)), -STRONGEST, STRONGEST)
    futures = world.rollout(np.repeat(controls, HOLD, axis=1)[..., None], every=HOLD)
    costs = cost(futures)
    weights = np.exp(-(costs - costs.min()) / (0.1 * costs.std() + 1e-9))
    plan = weights @ controls / weights.sum()
    pendulum.tau = plan[:1]
    world.step(HOLD)
    plan = np.append(plan[1:], 0.0)
    if turn % 20 == 19:
        height = -np.cos(pendulum.q[0])
        print(f"{world.time:.1f} s: the bob is {height:+.2f} m above the hinge, {pendulum.qd[0]:+.2f} rad/s")
assert -np.cos(pendulum.q[0]) > 0.9
