"""A swimmer of three links. Observation and reward are those of gymnasium's environment of the same name, version 5; limits and the model's file are this
library's.

The drag is that of MuJoCo's model of inertia boxes (its documentation, "Fluid forces"): a body counts as the box of its mass and inertia, of half sizes r
along its axes. With the mean size s of r, the fluid's density d and viscosity b, force and torque along axis i are

    -6 b π s v_i - 2 d r_j r_k |v_i| v_i        and        -8 b π s³ w_i - d/2 r_i (r_j⁴ + r_k⁴) |w_i| w_i

for the velocity v of the center of mass and the angular velocity w in the body's axes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

import tumble
from tumble.gym.task import Floats, Infos, State, Task

LINKS = ("front", "middle", "back")
RADIUS_M, LENGTH_M = 0.1, 1.0  # of each link, a capsule
DENSITY, VISCOSITY = 4000.0, 0.1  # of the fluid, kg/m³ and Pa·s


class Drag(tumble.Force):
    """The drag of the fluid on the links of a swimmer."""

    def __init__(self) -> None:
        self.rows: list[int] = []

    def apply(self, view: tumble.View) -> None:
        self.rows = self.rows or [view.row("front", link) for link in LINKS]
        force, torque = drag(view.orientation[self.rows], view.velocity[self.rows], view.angular_velocity[self.rows])
        view.force[self.rows] += force
        view.torque[self.rows] += torque


def half_sizes() -> Floats:
    """Half sizes of the box of a link's mass and inertia, shape (3,), m. Its density is that of water; the mass does not matter."""
    ball, rod = 4 / 3 * np.pi * RADIUS_M**3, np.pi * RADIUS_M**2 * LENGTH_M
    along = rod * RADIUS_M**2 / 2 + 0.4 * ball * RADIUS_M**2
    across = rod * (RADIUS_M**2 / 4 + LENGTH_M**2 / 12) + ball * (0.4 * RADIUS_M**2 + LENGTH_M**2 / 4 + 3 / 8 * LENGTH_M * RADIUS_M)
    squares = 1.5 / (ball + rod) * np.array([2 * across - along, along, along])
    sizes: Floats = np.sqrt(squares)
    return sizes


_BOX = half_sizes()
_SIDES = 2 * DENSITY * np.array([_BOX[1] * _BOX[2], _BOX[2] * _BOX[0], _BOX[0] * _BOX[1]])
_EDGES = DENSITY / 2 * _BOX * (np.sum(_BOX**4) - _BOX**4)
_LINEAR, _TURNING = 6 * VISCOSITY * np.pi * _BOX.mean(), 8 * VISCOSITY * np.pi * _BOX.mean() ** 3


def drag(orientations: Floats, velocities: Floats, angular_velocities: Floats) -> tuple[Floats, Floats]:
    """Returns forces and torques at the centers of mass of links, world axes, each of shape (n, 3).

    orientations: quaternions (x, y, z, w), shape (n, 4); the links' long axis is x. velocities, angular_velocities: world axes, shape (n, 3).
    """
    x, y, z, w = orientations.T
    to_world = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    v, turn = np.einsum("ijn,ni->nj", to_world, velocities), np.einsum("ijn,ni->nj", to_world, angular_velocities)
    force, torque = -(_LINEAR + _SIDES * np.abs(v)) * v, -(_TURNING + _EDGES * np.abs(turn)) * turn
    return np.einsum("ijn,nj->ni", to_world, force), np.einsum("ijn,nj->ni", to_world, torque)


@dataclass
class SwimmerTask(Task):
    """Three links of 1 m in a row in a viscous fluid, to swim along x.

    Observation: angle of the first link and of the two joints, rad, and all five velocities; shape (8,). Action: torques of the joints in 150 N·m, within 1.
    Reward: velocity of the first link along x, less squared actions. Never terminated.
    """

    forward_reward_weight: float = 1.0
    ctrl_cost_weight: float = 1e-4
    reset_noise_scale: float = 0.1
    exclude_current_positions_from_observation: bool = True

    MODEL: ClassVar[str] = "swimmer.xml"
    MOTORS: ClassVar = (("front_bend", 150.0), ("back_bend", 150.0))
    FRAME_SKIP: ClassVar[int] = 4
    OBSERVATION: ClassVar[int] = 8

    def world(self) -> tumble.World:
        world = super().world()
        world.add_force("drag", Drag())
        return world

    def observation_space(self) -> spaces.Box:
        more = 0 if self.exclude_current_positions_from_observation else 2
        return spaces.Box(-np.inf, np.inf, (self.OBSERVATION + more,), np.float64)

    def start(self, rng: np.random.Generator, q: Floats, v: Floats) -> tuple[Floats, Floats]:
        scale = self.reset_noise_scale
        return q + rng.uniform(-scale, scale, 5), v + rng.uniform(-scale, scale, 5)

    def observe(self, state: State) -> Floats:
        first = 2 if self.exclude_current_positions_from_observation else 0
        return np.concatenate([state.q[:, first:], state.v], axis=1)

    def reward(self, before: State, state: State, actions: NDArray[np.float64], dt: float) -> tuple[Floats, Infos]:
        x, y = ((state.q[:, :2] - before.q[:, :2]) / dt).T
        forward, effort = self.forward_reward_weight * x, self.ctrl_cost_weight * np.square(actions).sum(axis=1)
        parts = {"x_velocity": x, "y_velocity": y, "reward_forward": forward, "reward_ctrl": -effort}
        return forward - effort, {**self.reset_info(state), **parts}

    def reset_info(self, state: State) -> Infos:
        x, y = state.q[:, :2].T
        return {"x_position": x, "y_position": y, "distance_from_origin": np.hypot(x, y)}

    def camera(self, q: Floats) -> tumble.Camera:
        return tumble.Camera((q[0], q[1] - 4.0, 4.0), (q[0], q[1], 0.0))
