"""Tasks of few joints: a pendulum on a cart, and an arm that reaches for a point. Observations and rewards are those of gymnasium's environments of the
same names, version 5; contacts, limits and the models' files are this library's.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

import tumble
from tumble.gym.task import Flags, Floats, Infos, State, Task


@dataclass
class InvertedPendulumTask(Task):
    """A pole of 0.6 m on a cart, to be kept within 0.2 rad of upright by forces on the cart.

    Observation: position of the cart, m, angle, rad, their rates; shape (4,). Action: force in 100 N, within 3. Reward: 1 unless the episode ends.
    """

    reset_noise_scale: float = 0.01

    MODEL: ClassVar[str] = "inverted_pendulum.xml"
    MOTORS: ClassVar = (("slider", 100.0),)
    REACH: ClassVar[float] = 3.0
    FRAME_SKIP: ClassVar[int] = 2
    OBSERVATION: ClassVar[int] = 4

    def start(self, rng: np.random.Generator, q: Floats, v: Floats) -> tuple[Floats, Floats]:
        scale = self.reset_noise_scale
        return q + rng.uniform(-scale, scale, 2), v + rng.uniform(-scale, scale, 2)

    def observe(self, state: State) -> Floats:
        return np.concatenate([state.q, state.v], axis=1)

    def reward(self, before: State, state: State, actions: NDArray[np.float64], dt: float) -> tuple[Floats, Infos]:
        alive = (~self.terminated(state)).astype(np.float64)
        return alive, {"reward_survive": alive}

    def terminated(self, state: State) -> Flags:
        over: Flags = np.abs(state.q[:, 1]) > 0.2
        return over


@dataclass
class ReacherTask(Task):
    """An arm of two links of 0.1 m in a plane, whose end is to reach a point.

    Observation: cosines and sines of the two angles, the point, m, the two rates, and the way from the point to the end of the arm, m; shape (10,).
    Action: torques in 200 N·m, within 1. Reward: minus the distance, minus the sum of the squared actions, with weights.
    """

    reward_dist_weight: float = 1.0
    reward_control_weight: float = 1.0

    MODEL: ClassVar[str] = "reacher.xml"
    MOTORS: ClassVar = (("shoulder", 200.0), ("elbow", 200.0))
    FRAME_SKIP: ClassVar[int] = 2
    OBSERVATION: ClassVar[int] = 10

    def start(self, rng: np.random.Generator, q: Floats, v: Floats) -> tuple[Floats, Floats]:
        q = q + rng.uniform(-0.1, 0.1, 4)
        goal = rng.uniform(-0.2, 0.2, 2)
        while np.linalg.norm(goal) >= 0.2:
            goal = rng.uniform(-0.2, 0.2, 2)
        v = v + rng.uniform(-0.005, 0.005, 4)
        q[2:], v[2:] = goal, 0
        return q, v

    def way(self, q: Floats) -> Floats:
        """From the point to the end of the arm, shape (n, 2)."""
        first, second = q[:, 0], q[:, 0] + q[:, 1]
        tip = np.stack([0.1 * np.cos(first) + 0.11 * np.cos(second), 0.1 * np.sin(first) + 0.11 * np.sin(second)], axis=1)
        way: Floats = tip - q[:, 2:]
        return way

    def observe(self, state: State) -> Floats:
        angles = state.q[:, :2]
        return np.concatenate([np.cos(angles), np.sin(angles), state.q[:, 2:], state.v[:, :2], self.way(state.q)], axis=1)

    def reward(self, before: State, state: State, actions: NDArray[np.float64], dt: float) -> tuple[Floats, Infos]:
        distance = -np.linalg.norm(self.way(state.q), axis=1) * self.reward_dist_weight
        effort = -np.square(actions).sum(axis=1) * self.reward_control_weight
        return distance + effort, {"reward_dist": distance, "reward_ctrl": effort}

    def camera(self, q: Floats) -> tumble.Camera:
        return tumble.Camera((0, -0.3, 0.7), (0, 0, 0))
