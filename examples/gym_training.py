"""Training in gymnasium's interface: augmented random search (Mania, Guy and Recht 2018) on a linear policy. All tries of a turn run side by side, one in each
world of a vector environment.

    python examples/gym_training.py                    # the pole stays upright for all of 500 steps
    python examples/gym_training.py Hopper 100 1000    # 100 turns with episodes of at most 1000 steps: minutes
"""

import sys

import gymnasium
import numpy as np

import tumble.gym  # noqa: F401  registers the environments

task, turns, longest = (sys.argv[1], *map(int, sys.argv[2:4])) if len(sys.argv) > 3 else ("CartPole", 8, 500)
PAIRS, BEST, SPREAD, RATE = 16, 8, *((0.5, 0.5) if task == "CartPole" else (0.03, 0.02))
env = gymnasium.make_vec(f"tumble/{task}-v0", num_envs=2 * PAIRS, max_episode_steps=longest)
discrete = isinstance(env.single_action_space, gymnasium.spaces.Discrete)
rng, rows = np.random.default_rng(0), 1 if discrete else env.single_action_space.shape[0]
weights = np.zeros((rows, env.single_observation_space.shape[0]))
count, mean, square = 1e-4, np.zeros(weights.shape[1]), np.ones(weights.shape[1])  # of all observations, which are scaled to mean 0 and spread 1


def episodes(tries: np.ndarray, seeds: list[int], learn: bool = False) -> np.ndarray:
    """The return of one episode for each policy, shape (tries,)."""
    global count, mean, square
    seen, _ = env.reset(seed=seeds)
    total, alive = np.zeros(len(tries)), np.ones(len(tries), bool)
    scale, center = 1 / np.sqrt(np.maximum(square - mean**2, 1e-6)), mean
    while alive.any():
        actions = np.einsum("kao,ko->ka", tries, (seen - center) * scale)
        if learn:
            more = alive.sum()
            mean = (count * mean + seen[alive].sum(0)) / (count + more)
            square = (count * square + (seen[alive] ** 2).sum(0)) / (count + more)
            count += more
        seen, reward, fallen, cut, _ = env.step((actions[:, 0] > 0).astype(int) if discrete else np.clip(actions, -1, 1))
        total += reward * alive
        alive &= ~(fallen | cut)
    return total


for turn in range(turns):
    steps = rng.normal(0, 1, (PAIRS, *weights.shape))
    returns = episodes(np.concatenate([weights + SPREAD * steps, weights - SPREAD * steps]), [turn] * 2 * PAIRS, learn=True)
    plus, minus = returns[:PAIRS], returns[PAIRS:]
    best = np.argsort(-np.maximum(plus, minus))[:BEST]
    weights += RATE / (BEST * (np.concatenate([plus[best], minus[best]]).std() + 1e-9)) * np.einsum("k,kao->ao", plus[best] - minus[best], steps[best])
    if turn % 10 == 0:
        print(f"turn {turn}: the mean return of the tries is {returns.mean():.0f}")
final = episodes(np.repeat(weights[None], 2 * PAIRS, axis=0), seeds=list(range(1000, 1000 + 2 * PAIRS)))
print(f"{task} after {turns} turns of {2 * PAIRS} tries: returns of {final.min():.0f} to {final.max():.0f} in new episodes")
