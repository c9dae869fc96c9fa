"""Tasks of moving forward: hopper, walker, cheetah and ant. Observations and rewards are those of gymnasium's environments of the same names, version 5;
contacts, limits and the models' files are this library's.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

import tumble
from tumble.gym.task import Flags, Floats, Infos, State, Task


@dataclass
class _Runner(Task):
    """What all have in common: a reward for the velocity along x, less the squared actions, and one for being upright."""

    forward_reward_weight: float = 1.0
    ctrl_cost_weight: float = 1e-3
    healthy_reward: float = 1.0
    terminate_when_unhealthy: bool = True
    reset_noise_scale: float = 5e-3
    exclude_current_positions_from_observation: bool = True

    PLACES: ClassVar[int] = 1
    """How many positions say only where it is."""

    HEIGHT_M: ClassVar[float] = 0.0
    """Height at which ``z_distance_from_origin`` is 0."""

    def observation_space(self) -> spaces.Box:
        more = 0 if self.exclude_current_positions_from_observation else self.PLACES
        return spaces.Box(-np.inf, np.inf, (self.OBSERVATION + more,), np.float64)

    def healthy(self, state: State) -> Flags:
        """Returns whether it is upright, shape (n,)."""
        return np.ones(len(state.q), np.bool_)

    def terminated(self, state: State) -> Flags:
        return ~self.healthy(state) & self.terminate_when_unhealthy

    def reward(self, before: State, state: State, actions: NDArray[np.float64], dt: float) -> tuple[Floats, Infos]:
        speed = self.velocity(before, state, dt)[:, 0]
        forward, effort = self.forward_reward_weight * speed, self.ctrl_cost_weight * np.square(actions).sum(axis=1)
        alive = self.healthy_reward * self.healthy(state)
        parts = {"reward_forward": forward, "reward_ctrl": -effort, "reward_survive": alive}
        return forward + alive - effort, {**self.reset_info(state), "x_velocity": speed, **parts}

    def place(self, state: State) -> Floats:
        """Returns the place whose velocity counts, m, shape (n, PLACES)."""
        return state.q[:, : self.PLACES]

    def velocity(self, before: State, state: State, dt: float) -> Floats:
        """Returns the mean velocity of ``place`` over a step, m/s, shape (n, PLACES)."""
        return (self.place(state) - self.place(before)) / dt

    def reset_info(self, state: State) -> Infos:
        return {"x_position": state.q[:, 0], "z_distance_from_origin": state.q[:, 1] - self.HEIGHT_M}

    def start(self, rng: np.random.Generator, q: Floats, v: Floats) -> tuple[Floats, Floats]:
        scale = self.reset_noise_scale
        return q + rng.uniform(-scale, scale, len(q)), v + rng.uniform(-scale, scale, len(v))

    def observe(self, state: State) -> Floats:
        first = self.PLACES if self.exclude_current_positions_from_observation else 0
        return np.concatenate([state.q[:, first:], self.rates(state)], axis=1)

    def rates(self, state: State) -> Floats:
        """Returns the velocities of the observation."""
        return np.clip(state.v, -10, 10)

    def camera(self, q: Floats) -> tumble.Camera:
        return tumble.Camera((q[0], -4.0, 1.4), (q[0], 0.0, 0.8))


@dataclass
class HopperTask(_Runner):
    """One leg of four links in a plane, to hop along x.

    Observation: height, m, angles of torso, thigh, leg and foot, rad, and all six velocities within 10; shape (11,). Action: torques of the three joints
    in 200 N·m, within 1. Terminated when the torso's height, m, its tilt, rad, or another position or velocity is not within its range.
    """

    healthy_state_range: tuple[float, float] = (-100.0, 100.0)
    healthy_z_range: tuple[float, float] = (0.7, float("inf"))
    healthy_angle_range: tuple[float, float] = (-0.2, 0.2)

    MODEL: ClassVar[str] = "hopper.xml"
    MOTORS: ClassVar = (("hip", 200.0), ("knee", 200.0), ("ankle", 200.0))
    FRAME_SKIP: ClassVar[int] = 4
    OBSERVATION: ClassVar[int] = 11
    HEIGHT_M: ClassVar[float] = 1.25

    def healthy(self, state: State) -> Flags:
        numbers = np.concatenate([state.q[:, 2:], state.v], axis=1)
        upright: Flags = within(state.q[:, 1], self.healthy_z_range) & within(state.q[:, 2], self.healthy_angle_range)
        upright &= within(numbers, self.healthy_state_range).all(axis=1)
        return upright


@dataclass
class Walker2dTask(_Runner):
    """Two legs in a plane, to walk along x.

    Observation: height, m, angles of torso, right and left thigh, leg and foot, rad, and all nine velocities within 10; shape (17,). Action: torques of the
    six joints in 100 N·m, within 1. Terminated when the torso's height, m, or its tilt, rad, is not within its range.
    """

    healthy_z_range: tuple[float, float] = (0.8, 2.0)
    healthy_angle_range: tuple[float, float] = (-1.0, 1.0)

    MODEL: ClassVar[str] = "walker2d.xml"
    MOTORS: ClassVar = tuple((f"{joint}_{side}", 100.0) for side in ("right", "left") for joint in ("hip", "knee", "ankle"))
    FRAME_SKIP: ClassVar[int] = 4
    OBSERVATION: ClassVar[int] = 17
    HEIGHT_M: ClassVar[float] = 1.25

    def healthy(self, state: State) -> Flags:
        return within(state.q[:, 1], self.healthy_z_range) & within(state.q[:, 2], self.healthy_angle_range)


@dataclass
class HalfCheetahTask(_Runner):
    """A trunk with a front and a back leg in a plane, to run along x.

    Observation: height, m, angles of trunk, back thigh, shin and foot, and front ones, rad, and all nine velocities; shape (17,). Action: torques of the six
    joints in 120, 90, 60, 120, 60 and 30 N·m, within 1. Never terminated.
    """

    ctrl_cost_weight: float = 0.1
    reset_noise_scale: float = 0.1
    healthy_reward: float = 0.0

    MODEL: ClassVar[str] = "half_cheetah.xml"
    MOTORS: ClassVar = tuple(zip(("back_hip", "back_knee", "back_ankle", "front_hip", "front_knee", "front_ankle"), (120.0, 90.0, 60.0, 120.0, 60.0, 30.0), strict=True))
    FRAME_SKIP: ClassVar[int] = 5
    OBSERVATION: ClassVar[int] = 17

    def start(self, rng: np.random.Generator, q: Floats, v: Floats) -> tuple[Floats, Floats]:
        scale = self.reset_noise_scale
        return q + rng.uniform(-scale, scale, len(q)), v + scale * rng.standard_normal(len(v))

    def rates(self, state: State) -> Floats:
        return state.v

    def reward(self, before: State, state: State, actions: NDArray[np.float64], dt: float) -> tuple[Floats, Infos]:
        total, info = super().reward(before, state, actions, dt)
        del info["reward_survive"]
        return total, info

    def reset_info(self, state: State) -> Infos:
        return {"x_position": state.q[:, 0]}


@dataclass
class AntTask(_Runner):
    """A body with four legs, to walk along x.

    Observation: height, m, orientation of the torso (w, x, y, z), eight angles, rad; velocity of the torso, world axes, m/s, angular velocity, its own axes,
    rad/s, eight rates; then the contact forces on the 13 bodies, each torque about the ant's center of mass and force, world axes, clipped to ``contact_force_range``;
    shape (105,). A leg's first part is fixed to the torso, so its contacts count as the torso's. Action: torques of hip and ankle of each leg in 150 N·m,
    within 1, in the order of the joints, the last leg first. Terminated when the torso's height, m, is outside its range. It starts with ankles bent by 1 rad.
    main_body: the body whose velocity counts, by its name in ``BODIES`` or its number there from 1, the torso.
    """

    ctrl_cost_weight: float = 0.5
    contact_cost_weight: float = 5e-4
    reset_noise_scale: float = 0.1
    include_cfrc_ext_in_observation: bool = True
    main_body: int | str = 1
    healthy_z_range: tuple[float, float] = (0.2, 1.0)
    contact_force_range: tuple[float, float] = (-1.0, 1.0)

    MODEL: ClassVar[str] = "ant.xml"
    KEYFRAME: ClassVar[str] = "standing"
    BODIES: ClassVar = ("torso", *(f"{part}_{leg}" for leg in (1, 2, 3, 4) for part in ("root", "thigh", "shin")))
    MOTORS: ClassVar = tuple((f"{joint}_{leg}", 150.0) for leg in (4, 1, 2, 3) for joint in ("hip", "ankle"))
    FRAME_SKIP: ClassVar[int] = 5
    OBSERVATION: ClassVar[int] = 105
    PLACES: ClassVar[int] = 2

    def observation_space(self) -> spaces.Box:
        (width,) = super().observation_space().shape
        less = 0 if self.include_cfrc_ext_in_observation else 6 * len(self.BODIES)
        return spaces.Box(-np.inf, np.inf, (width - less,), np.float64)

    def start(self, rng: np.random.Generator, q: Floats, v: Floats) -> tuple[Floats, Floats]:
        scale = self.reset_noise_scale
        q = q + rng.uniform(-scale, scale, len(q))
        q[3:7] /= np.linalg.norm(q[3:7])
        return q, v + scale * rng.standard_normal(len(v))

    def healthy(self, state: State) -> Flags:
        low, high = self.healthy_z_range
        upright: Flags = (state.q[:, 2] >= low) & (state.q[:, 2] <= high)
        return upright

    def contact_forces(self, state: State) -> Floats:
        """Returns torques about the center of mass and forces on each body, clipped, shape (n, 13, 6)."""
        return np.clip(contact_wrenches(state, self.body)[:, self.order], *self.contact_force_range)

    def world(self) -> tumble.World:
        world = super().world()
        self.body = world.articulation("torso")
        self.order = [self.body.link_names.index(name) for name in self.BODIES]
        return world

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.main_body not in (*range(1, len(self.BODIES) + 1), *self.BODIES):
            raise tumble.InvalidValueError(f"main_body is {self.main_body!r}; it must be 1 to {len(self.BODIES)}, or one of {', '.join(self.BODIES)}")

    def place(self, state: State) -> Floats:
        """Place of the main body, m, shape (n, 2)."""
        name = self.BODIES[self.main_body - 1] if isinstance(self.main_body, int) else self.main_body
        if name == self.BODIES[0]:
            return state.q[:, :2]
        place: Floats = self.body.link_pose(name, state.q).reshape(-1, 7)[:, :2]
        return place

    def observe(self, state: State) -> Floats:
        first = self.PLACES if self.exclude_current_positions_from_observation else 0
        quaternion = state.q[:, [6, 3, 4, 5]]
        position = np.concatenate([state.q[:, :3], quaternion, state.q[:, 7:]], axis=1)[:, first:]
        velocity = np.concatenate([state.v[:, 3:6], into(quaternion, state.v[:, :3]), state.v[:, 6:]], axis=1)
        contact = [self.contact_forces(state).reshape(len(state.q), -1)] if self.include_cfrc_ext_in_observation else []
        return np.concatenate([position, velocity, *contact], axis=1)

    def reward(self, before: State, state: State, actions: NDArray[np.float64], dt: float) -> tuple[Floats, Infos]:
        total, info = super().reward(before, state, actions, dt)
        contact = self.contact_cost_weight * np.square(self.contact_forces(state)).reshape(len(state.q), -1).sum(axis=1)
        return total - contact, {**info, "y_velocity": self.velocity(before, state, dt)[:, 1], "reward_contact": -contact}

    def reset_info(self, state: State) -> Infos:
        x, y = state.q[:, :2].T
        return {"x_position": x, "y_position": y, "distance_from_origin": np.hypot(x, y)}

    def camera(self, q: Floats) -> tumble.Camera:
        return tumble.Camera((q[0], q[1] - 4.0, 2.5), (q[0], q[1], 0.3))


def within(numbers: Floats, bounds: tuple[float, float]) -> Flags:
    """Whether numbers are between two others, and equal neither."""
    inside: Flags = (numbers > bounds[0]) & (numbers < bounds[1])
    return inside


def contact_wrenches(state: State, body: tumble.Articulation) -> Floats:
    """Torques about the body's center of mass and forces of contacts on each link, world axes, shape (n, links, 6)."""
    wrenches = state.batch.link_contact_forces.copy()
    center = np.atleast_2d(body.center_of_mass(state.q))
    wrenches[..., :3] -= np.cross(center[:, None], wrenches[..., 3:])
    return wrenches


def into(quaternion: Floats, vector: Floats) -> Floats:
    """Vectors of world axes in the axes of orientations (w, x, y, z)."""
    w, axis = quaternion[:, :1], -quaternion[:, 1:]
    turned = 2 * np.cross(axis, vector)
    rotated: Floats = vector + w * turned + np.cross(axis, turned)
    return rotated
