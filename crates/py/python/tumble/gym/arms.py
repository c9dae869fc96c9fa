"""Tasks of few joints: pendulums on a cart, an arm that reaches for a point, and one that pushes a cylinder. Observations and rewards are those of gymnasium's environments of the
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
class InvertedDoublePendulumTask(Task):
    """Two poles of 0.6 m, one on the other, on a cart, to be kept upright by forces on the cart.

    Observation: position of the cart, m, sines and cosines of the two angles, the rates of all within 10, and the mean force of the rail's end on the cart
    over the last step, within 10 N; shape (9,). Action: force in 500 N, within 1. Reward: ``healthy_reward`` unless the episode ends, less the distance of
    the tip from 2 m above the middle, less the rates of the poles. Terminated when the tip is at most 1 m high.
    """

    healthy_reward: float = 10.0
    reset_noise_scale: float = 0.1

    MODEL: ClassVar[str] = "inverted_double_pendulum.xml"
    MOTORS: ClassVar = (("slider", 500.0),)
    FRAME_SKIP: ClassVar[int] = 5
    OBSERVATION: ClassVar[int] = 9
    POLE_M: ClassVar[float] = 0.6
    NEAR_M: ClassVar[float] = 0.99
    """Beyond this the cart may be at an end of its rail, 1 m."""

    def world(self) -> tumble.World:
        world = super().world()
        self.body = world.articulation("cart")
        return world

    def start(self, rng: np.random.Generator, q: Floats, v: Floats) -> tuple[Floats, Floats]:
        scale = self.reset_noise_scale
        return q + rng.uniform(-scale, scale, 3), v + scale * rng.standard_normal(3)

    def tip(self, q: Floats) -> tuple[Floats, Floats]:
        """Place along the rail and height of the upper end, each of shape (n,)."""
        first, second = q[:, 1], q[:, 1] + q[:, 2]
        return q[:, 0] + self.POLE_M * (np.sin(first) + np.sin(second)), self.POLE_M * (np.cos(first) + np.cos(second))

    def limit_forces(self, before: State, state: State, dt: float) -> Floats:
        """What changes the momentum along the rail beside motor, damping and gravity. Nothing depends on the cart's position, so this is exact."""
        momentum = [np.einsum("nk,nk->n", self.body.mass_matrix(each.q)[:, 0], each.v) for each in (before, state)]
        travel = state.q[:, 0] - before.q[:, 0]
        force = (momentum[1] - momentum[0] + 0.05 * travel) / dt - state.controls[:, 0] - self.body.mass * self.body.gravity[0]
        found: Floats = np.where(np.maximum(abs(before.q[:, 0]), abs(state.q[:, 0])) > self.NEAR_M, force, 0.0)
        return found

    def observe(self, state: State) -> Floats:
        angles, force = state.q[:, 1:], np.clip(state.limit_forces, -10, 10)
        return np.concatenate([state.q[:, :1], np.sin(angles), np.cos(angles), np.clip(state.v, -10, 10), force[:, None]], axis=1)

    def reward(self, before: State, state: State, actions: NDArray[np.float64], dt: float) -> tuple[Floats, Infos]:
        x, z = self.tip(state.q)
        alive = self.healthy_reward * ~self.terminated(state)
        away = 0.01 * x**2 + (z - 2) ** 2
        fast = 1e-3 * state.v[:, 1] ** 2 + 5e-3 * state.v[:, 2] ** 2
        return alive - away - fast, {"reward_survive": alive, "distance_penalty": -away, "velocity_penalty": -fast}

    def terminated(self, state: State) -> Flags:
        over: Flags = self.tip(state.q)[1] <= 1
        return over


@dataclass
class PusherTask(Task):
    """An arm of seven joints over a table, that is to push a cylinder to a place.

    Observation: seven angles, rad, and rates, places of gripper, cylinder and goal, m; shape (23,). Action: torques in N·m, within 2. Reward: minus the
    distance of cylinder and goal, of gripper and cylinder, and the sum of the squared actions, with weights.
    """

    reward_near_weight: float = 0.5
    reward_dist_weight: float = 1.0
    reward_control_weight: float = 0.1

    MODEL: ClassVar[str] = "pusher.xml"
    MOTORS: ClassVar = tuple(
        (joint, 1.0) for joint in ("shoulder_pan", "shoulder_lift", "upper_arm_roll", "elbow_flex", "forearm_roll", "wrist_flex", "wrist_roll")
    )
    REACH: ClassVar[float] = 2.0
    FRAME_SKIP: ClassVar[int] = 5
    OBSERVATION: ClassVar[int] = 23

    def world(self) -> tumble.World:
        world = super().world()
        self.body = world.articulation("shoulder")
        return world

    def start(self, rng: np.random.Generator, q: Floats, v: Floats) -> tuple[Floats, Floats]:
        place = np.zeros(2)
        while np.linalg.norm(place) <= 0.17:
            place = np.array([rng.uniform(-0.3, 0), rng.uniform(-0.2, 0.2)])
        v = v + rng.uniform(-0.005, 0.005, 11)
        q[7:9], q[9:], v[7:] = place, 0, 0
        return q, v

    def places(self, q: Floats) -> tuple[Floats, Floats, Floats]:
        """Of gripper, cylinder and goal, each of shape (n, 3)."""
        gripper = self.body.link_pose("gripper", q[:, :7])[:, :3]
        disks = [np.array([0.45, -0.05, height]) + np.stack([y_x[:, 1], y_x[:, 0], np.zeros(len(q))], axis=1) for height, y_x in ((-0.275, q[:, 7:9]), (-0.323, q[:, 9:]))]
        return gripper, disks[0], disks[1]

    def observe(self, state: State) -> Floats:
        return np.concatenate([state.q[:, :7], state.v[:, :7], *self.places(state.q)], axis=1)

    def reward(self, before: State, state: State, actions: NDArray[np.float64], dt: float) -> tuple[Floats, Infos]:
        gripper, disk, goal = self.places(state.q)
        near = -np.linalg.norm(disk - gripper, axis=1) * self.reward_near_weight
        distance = -np.linalg.norm(disk - goal, axis=1) * self.reward_dist_weight
        effort = -np.square(actions).sum(axis=1) * self.reward_control_weight
        return distance + effort + near, {"reward_dist": distance, "reward_ctrl": effort, "reward_near": near}

    def camera(self, q: Floats) -> tumble.Camera:
        return tumble.Camera((1.6, -1.6, 1.2), (0.3, -0.3, -0.2))


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
