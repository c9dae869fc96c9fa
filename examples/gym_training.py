"""Training in gymnasium's interface: hill climbing on the four weights of a linear policy balances the pole for all of 500 steps."""

import gymnasium
import numpy as np
import tumble.gym  # noqa: F401  registers tumble/CartPole-v0

env, rng = gymnasium.make("tumble/CartPole-v0"), np.random.default_rng(0)


def episode(weights: np.ndarray, seed: int) -> float:
    (state, _), total, over = env.reset(seed=seed), 0.0, False
    while not over:
        state, reward, fallen, cut, _ = env.step(int(weights @ state > 0))
        total, over = total + float(reward), fallen or cut
    return total


best, history = np.zeros(4), [episode(np.zeros(4), seed=0)]
while history[-1] < 500:
    trial = best + rng.normal(0, 1, 4)
    score = np.mean([episode(trial, seed) for seed in range(3)])
    best, history = (trial, history + [score]) if score > history[-1] else (best, history + [history[-1]])
print(f"{history[0]:.0f} steps untrained, {history[-1]:.0f} after {len(history) - 1} trials; in new episodes {[episode(best, seed) for seed in range(100, 110)]}")
