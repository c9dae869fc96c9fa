"""Tasks of a person: to walk, and to stand up. Observations and rewards are those of gymnasium's environments of the same names, version 5; contacts, limits
and the models' files are this library's.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar
from xml.etree import ElementTree

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

import tumble
from tumble.gym.runners import contact_wrenches, into
from tumble.gym.task import Flags, Floats, Infos, State, Task

_DENSITY = 1000.0  # kg/m³, that of a model that names none


@dataclass
class _Humanoid(Task):
    """What both have in common: a person of 13 bodies with 17 joints, and what is seen of it."""

    ctrl_cost_weight: float = 0.1
    reset_noise_scale: float = 1e-2
    exclude_current_positions_from_observation: bool = True
    include_cinert_in_observation: bool = True
    include_cvel_in_observation: bool = True
    include_qfrc_actuator_in_observation: bool = True
    include_cfrc_ext_in_observation: bool = True

    MOTORS: ClassVar = (
        *(("abdomen_y", 100.0), ("abdomen_z", 100.0), ("abdomen_x", 100.0)),
        *((f"{joint}_{side}", gear) for side in ("right", "left") for joint, gear in (("hip_x", 100.0), ("hip_z", 100.0), ("hip_y", 300.0), ("knee", 200.0))),
        *((f"{joint}_{side}", 25.0) for side in ("right", "left") for joint in ("shoulder_1", "shoulder_2", "elbow")),
    )
    REACH: ClassVar[float] = 0.4
    FRAME_SKIP: ClassVar[int] = 5
    OBSERVATION: ClassVar[int] = 348

    def world(self) -> tumble.World:
        world = super().world()
        self.body = world.articulation("torso")
        parts = _parts(Path(__file__).parent / "models" / self.MODEL)
        self.names = list(parts)
        self.order = [self.body.link_names.index(name) for name in parts]
        self.masses = np.array([mass for mass, _, _ in parts.values()])
        self.centers = np.array([center for _, center, _ in parts.values()])
        self.inertias = np.array([inertia for _, _, inertia in parts.values()])
        return world

    def observation_space(self) -> spaces.Box:
        left_out = (
            130 * (not self.include_cinert_in_observation)
            + 78 * (not self.include_cvel_in_observation)
            + 17 * (not self.include_qfrc_actuator_in_observation)
            + 78 * (not self.include_cfrc_ext_in_observation)
            - 2 * (not self.exclude_current_positions_from_observation)
        )
        return spaces.Box(-np.inf, np.inf, (self.OBSERVATION - left_out,), np.float64)

    def start(self, rng: np.random.Generator, q: Floats, v: Floats) -> tuple[Floats, Floats]:
        scale = self.reset_noise_scale
        q, v = q + rng.uniform(-scale, scale, len(q)), v + rng.uniform(-scale, scale, len(v))
        q[3:7] /= np.linalg.norm(q[3:7])
        return q, v

    def observe(self, state: State) -> Floats:
        first = 2 if self.exclude_current_positions_from_observation else 0
        quaternion = state.q[:, [6, 3, 4, 5]]
        position = np.concatenate([state.q[:, :3], quaternion, state.q[:, 7:]], axis=1)[:, first:]
        velocity = np.concatenate([state.v[:, 3:6], into(quaternion, state.v[:, :3]), state.v[:, 6:]], axis=1)
        parts = [position, velocity]
        if self.include_cinert_in_observation:
            parts.append(self.spatial_inertias(state.q))
        if self.include_cvel_in_observation:
            parts.append(self.spatial_velocities(state))
        if self.include_qfrc_actuator_in_observation:
            parts.append(state.controls[:, 6:])
        if self.include_cfrc_ext_in_observation:
            parts.append(self.contact_forces(state))
        return np.concatenate([part.reshape(len(state.q), -1) for part in parts], axis=1)

    def spatial_inertias(self, q: Floats) -> Floats:
        """About the person's center of mass, world axes: xx, yy, zz, xy, xz, yz of the inertia, kg·m², mass times center of mass, kg·m, and mass, kg, of
        each body; shape (n, 13, 10)."""
        rotations, centers = self.frames(q)
        away = centers - np.atleast_2d(self.body.center_of_mass(q))[:, None]
        inertia = rotations @ self.inertias @ rotations.swapaxes(-1, -2)
        square = np.einsum("nbk,nbk->nb", away, away)[..., None, None] * np.eye(3) - away[..., :, None] * away[..., None, :]
        inertia = inertia + self.masses[:, None, None] * square
        masses = np.broadcast_to(self.masses[:, None], (*away.shape[:2], 1))
        return np.concatenate([inertia[..., [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]], masses * away, masses], axis=-1)

    def spatial_velocities(self, state: State) -> Floats:
        """Angular velocity of each body, and velocity of its point at the person's center of mass, world axes; shape (n, 13, 6)."""
        n = len(state.q)
        jacobians = np.stack([self.body.jacobian(name, state.q).reshape(n, 6, -1) for name in self.names], axis=1)
        twists: Floats = np.einsum("nbij,nj->nbi", jacobians, state.v)
        origins = self.body.link_poses(state.q).reshape(n, -1, 7)[:, self.order, :3]
        away = np.atleast_2d(self.body.center_of_mass(state.q))[:, None] - origins
        twists[..., 3:] += np.cross(twists[..., :3], away)
        return twists

    def contact_forces(self, state: State) -> Floats:
        """Torques about the person's center of mass and forces of contacts on each body, world axes; shape (n, 13, 6)."""
        return contact_wrenches(state, self.body)[:, self.order]

    def frames(self, q: Floats) -> tuple[Floats, Floats]:
        """Rotations, shape (n, 13, 3, 3), and centers of mass, shape (n, 13, 3), of the bodies."""
        poses = self.body.link_poses(q).reshape(len(q), -1, 7)[:, self.order]
        x, y, z, w = np.moveaxis(poses[..., 3:], -1, 0)
        rows = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
        rotations = np.moveaxis(np.array(rows), (0, 1), (-2, -1))
        return rotations, poses[..., :3] + np.einsum("nbij,bj->nbi", rotations, self.centers)

    def contact_cost(self, state: State, weight: float, bounds: tuple[float, float]) -> Floats:
        """Of the squared contact forces, within bounds, shape (n,)."""
        cost: Floats = np.clip(weight * np.square(self.contact_forces(state)).reshape(len(state.q), -1).sum(axis=1), *bounds)
        return cost

    def camera(self, q: Floats) -> tumble.Camera:
        return tumble.Camera((q[0], q[1] - 4.0, 1.6), (q[0], q[1], 0.8))


@dataclass
class HumanoidTask(_Humanoid):
    """A person, to walk along x.

    Observation: height, m, orientation of the torso (w, x, y, z), 17 angles, rad; velocity of the torso, world axes, m/s, angular velocity, its own axes,
    rad/s, 17 rates; then for each of the 13 bodies the spatial inertia about the person's center of mass (10 numbers) and its velocity there (6), the
    torques of the 17 motors, and the contact forces (6 for each body); shape (348,). Feet are fixed to the shins, so their contacts count as the shins'.
    Action: torques of the joints in their gears, within 0.4. Terminated when the torso is not between 1 and 2 m high.
    """

    forward_reward_weight: float = 1.25
    contact_cost_weight: float = 5e-7
    contact_cost_range: tuple[float, float] = (-np.inf, 10.0)
    healthy_reward: float = 5.0
    terminate_when_unhealthy: bool = True
    healthy_z_range: tuple[float, float] = (1.0, 2.0)

    MODEL: ClassVar[str] = "humanoid.xml"

    def healthy(self, state: State) -> Flags:
        """Returns whether it is upright, shape (n,)."""
        low, high = self.healthy_z_range
        upright: Flags = (state.q[:, 2] > low) & (state.q[:, 2] < high)
        return upright

    def terminated(self, state: State) -> Flags:
        return ~self.healthy(state) & self.terminate_when_unhealthy

    def reward(self, before: State, state: State, actions: NDArray[np.float64], dt: float) -> tuple[Floats, Infos]:
        x, y = (np.atleast_2d(self.body.center_of_mass(state.q) - self.body.center_of_mass(before.q)) / dt)[:, :2].T
        forward, alive = self.forward_reward_weight * x, self.healthy_reward * self.healthy(state)
        effort = self.ctrl_cost_weight * np.square(actions).sum(axis=1)
        contact = self.contact_cost(state, self.contact_cost_weight, self.contact_cost_range)
        parts = {"reward_survive": alive, "reward_forward": forward, "reward_ctrl": -effort, "reward_contact": -contact}
        return forward + alive - effort - contact, {**self.reset_info(state), "x_velocity": x, "y_velocity": y, **parts}

    def reset_info(self, state: State) -> Infos:
        x, y = state.q[:, :2].T
        return {"x_position": x, "y_position": y, "distance_from_origin": np.hypot(x, y)}


@dataclass
class HumanoidStandupTask(_Humanoid):
    """A person lying on the back, to stand up.

    Observation and action as in ``HumanoidTask``. Reward: height of the torso over the length of a step of the world, 0.003 s, less squared actions and
    contact forces, and 1. Never terminated.
    """

    uph_cost_weight: float = 1.0
    impact_cost_weight: float = 0.5e-6
    impact_cost_range: tuple[float, float] = (-np.inf, 10.0)

    MODEL: ClassVar[str] = "humanoid_lying.xml"
    HEIGHT_M: ClassVar[float] = 0.105

    def reward(self, before: State, state: State, actions: NDArray[np.float64], dt: float) -> tuple[Floats, Infos]:
        up = self.uph_cost_weight * state.q[:, 2] / (dt / self.steps)
        effort = self.ctrl_cost_weight * np.square(actions).sum(axis=1)
        impact = self.contact_cost(state, self.impact_cost_weight, self.impact_cost_range)
        parts = {"reward_linup": up, "reward_quadctrl": -effort, "reward_impact": -impact}
        return up - effort - impact + 1, {**self.reset_info(state), **parts}

    def reset_info(self, state: State) -> Infos:
        return {"x_position": state.q[:, 0], "y_position": state.q[:, 1], "z_distance_from_origin": state.q[:, 2] - self.HEIGHT_M}


def _parts(file: Path) -> dict[str, tuple[float, Floats, Floats]]:
    """Mass, center of mass and inertia about it of each body of a model of spheres and capsules, in the body's frame."""
    found = {}
    for body in ElementTree.parse(file).getroot().iter("body"):
        solids = [_solid(geom) for geom in body.findall("geom")]
        mass = sum(each[0] for each in solids)
        center = sum((each[0] * each[1] for each in solids), np.zeros(3)) / mass
        inertia = sum((each[2] + each[0] * _square(each[1] - center) for each in solids), np.zeros((3, 3)))
        found[body.attrib["name"]] = (mass, center, inertia)
    return found


def _solid(geom: ElementTree.Element) -> tuple[float, Floats, Floats]:
    """Mass, center and inertia of a sphere, or a capsule with its ends."""
    radius = float(geom.attrib["size"])
    ball = _DENSITY * 4 / 3 * np.pi * radius**3
    if geom.get("type") == "sphere":
        return ball, np.array(geom.attrib["pos"].split(), float), 0.4 * ball * radius**2 * np.eye(3)
    start, end = np.array(geom.attrib["fromto"].split(), float).reshape(2, 3)
    length = float(np.linalg.norm(end - start))
    axis = (end - start) / length
    rod = _DENSITY * np.pi * radius**2 * length
    along = rod * radius**2 / 2 + 0.4 * ball * radius**2
    across = rod * (radius**2 / 4 + length**2 / 12) + ball * (0.4 * radius**2 + length**2 / 4 + 3 / 8 * length * radius)
    inertia = across * np.eye(3) + (along - across) * np.outer(axis, axis)
    return rod + ball, (start + end) / 2, inertia


def _square(away: Floats) -> Floats:
    """The inertia of a unit mass at a place."""
    square: Floats = away @ away * np.eye(3) - np.outer(away, away)
    return square
