"""Control by sampling: a robot arm moves its paddle past a post to a point, by simulating many futures at each turn.

    python examples/rollout_control.py

Model predictive path integral control (Williams et al., 2017). The futures are forks of the world, contacts included, that run on all cores. The
samples are accelerations: inverse dynamics turns them into torques, which also hold the arm against gravity. With torques sampled about zero every
future would sag, and the arm would stall below its goal.
"""

from pathlib import Path

import numpy as np

import tumble

URDF = Path(__file__).parents[1] / "scenes" / "robot" / "arm.urdf"
GOAL, POST = np.array((0.15, 0.45, 0.35)), np.array((0.40, 0.22, 0.40))
FORKS, HORIZON, HOLD = 48, 8, 8  # futures, controls in each, steps that each control holds
STRONGEST = np.array((60, 90, 50, 20, 20, 10))  # N·m, the efforts of the file

world = tumble.World(dt=1 / 120)
post = world.add_static("post", tumble.Cylinder(0.04, 0.8), position=POST)
arm = world.add_articulation(URDF)
arm.q = (-0.6, 0.6, -0.4, 0, 0.6, 0)
start = 13  # of the arm's numbers in the state: the post has 13


def torques(accelerations):
    """Torques of a batch, shape (…, 6), that accelerate the arm from its present position and let its present speed decay within half a second."""
    wanted = (accelerations - 2 * arm.qd).reshape(-1, 6)
    return np.clip(arm.inverse_dynamics(qd=np.zeros(6), qdd=wanted), -STRONGEST, STRONGEST).reshape(accelerations.shape)


def cost(states):
    """Of futures, shape (forks, kept, numbers): far from the goal, fast, or with a link within 10 cm of the post's axis."""
    q, qd = states[..., start : start + 6], states[..., start + 6 :]
    places = arm.link_poses(q.reshape(-1, 6))[..., :3].reshape(*q.shape[:2], -1, 3)
    away = np.linalg.norm(places[:, :, -1] - GOAL, axis=2)
    near = np.linalg.norm(places[..., :2] - POST[:2], axis=3).min(axis=2) < 0.1
    return (away + 2 * near + 0.005 * (qd**2).sum(axis=2)).sum(axis=1) + 4 * away[:, -1]


rng, plan, away, touched = np.random.default_rng(0), np.zeros((HORIZON, 6)), 0.8, False
for turn in range(50):
    samples = plan + rng.normal(0, 1 + 8 * away, (FORKS, HORIZON, 6))
    samples[0] = plan
    costs = cost(world.rollout(np.repeat(torques(samples), HOLD, axis=1), every=HOLD))
    weights = np.exp(-(costs - costs.min()) / (0.1 * costs.std()))
    plan = np.tensordot(weights / weights.sum(), samples, 1)
    arm.tau = torques(plan[0])
    world.step(HOLD)
    plan = np.vstack([plan[1:], np.zeros((1, 6))])
    away = np.linalg.norm(arm.link_pose("paddle")[:3] - GOAL)
    touched |= 0 in world.contacts["bodies"]
    if turn % 10 == 9:
        print(f"{world.time:.1f} s: {1000 * away:3.0f} mm from the goal, fastest joint {np.abs(arm.qd).max():.2f} rad/s, touched: {touched}")
assert away < 0.05 and not touched
