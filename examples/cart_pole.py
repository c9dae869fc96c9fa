"""A pole balanced on a cart, by a regulator worked out from the derivatives of forward dynamics. Needs gymnasium (``pip install ".[gym]"`` in a clone).

    python examples/cart_pole.py
"""

import gymnasium
import numpy as np

import tumble.gym  # noqa: F401  registers tumble/CartPole-v0

env = gymnasium.make("tumble/CartPole-v0")
body = env.unwrapped.body


def linear_model() -> tuple[np.ndarray, np.ndarray]:
    """z' = A z + B u about upright rest, z = (x, θ, x', θ')."""
    by_q, by_qd, by_tau = body.forward_dynamics_derivatives(np.zeros(2), np.zeros(2), np.zeros(2))
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [by_q, by_qd]])
    return A, np.concatenate([np.zeros(2), by_tau[:, 0]])


def regulator(A: np.ndarray, B: np.ndarray, dt: float = 0.02) -> np.ndarray:
    """Gains of the discrete linear-quadratic regulator, by iterating Riccati's equation."""
    Ad, Bd = np.eye(4) + dt * A, (dt * B)[:, None]
    Q, R, P = np.diag([1.0, 10.0, 0.1, 0.1]), 0.01, np.eye(4)
    for _ in range(2000):
        K = np.linalg.solve(R + Bd.T @ P @ Bd, Bd.T @ P @ Ad)
        P = Q + Ad.T @ P @ (Ad - Bd @ K)
    return K[0]


gains = regulator(*linear_model())
print(f"gains on (x, angle, speed, rate): {np.array2string(gains, precision=2)}")
for episode in range(3):
    (x, v, angle, rate), _ = env.reset(seed=episode)
    total, over = 0.0, False
    while not over:
        push = -gains @ (x, angle, v, rate)
        (x, v, angle, rate), reward, fallen, cut, _ = env.step(int(push > 0))  # all or nothing, towards the desired side
        total, over = total + reward, fallen or cut
    print(f"episode {episode}: {total:.0f} steps upright, the cart {x:+.2f} m from the middle")
    assert total == 500
