"""What an environment is, and the worlds that it runs in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, ClassVar, TypeAlias

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

import tumble

Floats: TypeAlias = NDArray[np.float64]
Flags: TypeAlias = NDArray[np.bool_]
Infos: TypeAlias = dict[str, NDArray[Any]]


@dataclass(frozen=True)
class State:
    """Positions ``q`` and velocities ``v`` of all worlds at one time, one row each, and the batch that they are of.

    controls: the generalized forces of the last step, shape (n, dof), 0 after a start. limit_forces: mean forces of constraints on the first degree of
    freedom in that step, shape (n,), of tasks that ask for them.
    """

    q: Floats
    v: Floats
    batch: tumble.Batch
    controls: Floats
    limit_forces: Floats

    @staticmethod
    def of(batch: tumble.Batch, controls: Floats | None = None, limit_forces: Floats | None = None) -> State:
        """Returns the present."""
        none = np.zeros(len(batch))
        return State(
            batch.q.copy(),
            batch.v.copy(),
            batch,
            np.zeros((len(batch), batch.dof)) if controls is None else controls.copy(),
            none if limit_forces is None else limit_forces.copy(),
        )


@dataclass(eq=False)
class Task:
    """An environment: a model, and observation, reward and end of an episode as functions of arrays with one row for each world.

    A subclass is a dataclass whose fields are its parameters, and sets the class variables. Motors are ``(joint, gear)``: an action in
    ``-reach`` to ``reach`` for each, the torque is gear times action. frame_skip: steps of the world for each step of the environment, at least 1; None:
    ``FRAME_SKIP``. A field whose name ends in ``_range`` is a pair of numbers, the lower one first; another raises ``InvalidValueError``.
    """

    frame_skip: int | None = field(default=None, kw_only=True)

    MODEL: ClassVar[str]
    """File of the model: in the folder ``models``, or anything that ``World.load`` opens."""
    KEYFRAME: ClassVar[str | None] = None
    """Keyframe of the model in which it starts."""
    MOTORS: ClassVar[Sequence[tuple[str, float]]] = ()
    REACH: ClassVar[float] = 1.0
    FRAME_SKIP: ClassVar[int] = 1
    """Steps of the world for each step of the environment, where ``frame_skip`` is None."""
    OBSERVATION: ClassVar[int]
    """Length of an observation."""

    def __post_init__(self) -> None:
        if not isinstance(self.steps, (int, np.integer)) or self.steps < 1:
            raise tumble.InvalidValueError(f"frame_skip is {self.steps!r}; it must be a whole number of at least 1")
        for each in fields(self):
            if each.name.endswith("_range"):
                _check_range(each.name, getattr(self, each.name))

    def __getstate__(self) -> dict[str, Any]:
        kept = {name: value for name, value in self.__dict__.items() if not self._is_handle(name)}
        return kept if len(kept) == len(self.__dict__) else {**kept, "_had_handles": True}

    def __setstate__(self, state: dict[str, Any]) -> None:
        state = dict(state)
        had_handles = state.pop("_had_handles", False)
        self.__dict__.update(state)
        if had_handles:
            self.world()  # sets them
            self.__dict__.update(state)

    def _is_handle(self, name: str) -> bool:
        """Whether an attribute is no parameter and an articulated body, which belongs to a world that is not pickled along."""
        return isinstance(self.__dict__[name], tumble.Articulation) and name not in {each.name for each in fields(self)}

    @property
    def steps(self) -> int:
        """Steps of the world for each step of the environment."""
        return self.FRAME_SKIP if self.frame_skip is None else self.frame_skip

    def world(self) -> tumble.World:
        """Returns the world of the model."""
        shipped = Path(__file__).parent / "models" / self.MODEL
        return tumble.World.load(shipped if shipped.is_file() else self.MODEL, keyframe=self.KEYFRAME)

    def action_space(self) -> spaces.Space[Any]:
        """Returns the space of one world's actions."""
        return spaces.Box(-self.REACH, self.REACH, (len(self.MOTORS),), np.float32)

    def observation_space(self) -> spaces.Box:
        """Returns the space of one world's observations."""
        return spaces.Box(-np.inf, np.inf, (self.OBSERVATION,), np.float64)

    def controls(self, actions: NDArray[Any], columns: NDArray[np.int64], dof: int) -> Floats:
        """Returns the generalized forces of actions. columns: the degrees of freedom of the motors."""
        if actions.shape[1:] != (len(self.MOTORS),):
            raise tumble.InvalidValueError(f"action: expected shape ({len(self.MOTORS)},), got {actions.shape[1:]}")
        controls = np.zeros((len(actions), dof))
        controls[:, columns] = np.clip(actions, -self.REACH, self.REACH) * [gear for _, gear in self.MOTORS]
        return controls

    def start(self, rng: np.random.Generator, q: Floats, v: Floats) -> tuple[Floats, Floats]:
        """Returns positions and velocities at the start of an episode in one world. q, v: those of the model."""
        raise NotImplementedError

    def observe(self, state: State) -> Floats:
        """Returns the observations, shape (n, OBSERVATION)."""
        raise NotImplementedError

    def reward(self, before: State, state: State, actions: NDArray[Any], dt: float) -> tuple[Floats, Infos]:
        """Returns the rewards of a step, shape (n,), and what the info says of it. dt: length of a step of the environment, s."""
        raise NotImplementedError

    def limit_forces(self, before: State, state: State, dt: float) -> Floats:
        """Returns ``State.limit_forces`` of a step, shape (n,)."""
        return np.zeros(len(state.q))

    def terminated(self, state: State) -> Flags:
        """Returns whether the episodes are over, shape (n,)."""
        return np.zeros(len(state.q), np.bool_)

    def reset_info(self, state: State) -> Infos:
        """Returns what the info says of a start."""
        return {}

    def camera(self, q: Floats) -> tumble.Camera | None:
        """Returns the camera of a picture of one world; None for that of the model."""
        return None


class Runs:
    """The worlds of a task, and what is common to ``Env`` and ``VectorEnv``."""

    def __init__(self, task: Task, count: int, threads: int | None) -> None:
        self.task = task
        world = task.world()
        self.batch = tumble.Batch(world, count, threads=threads)
        self.dt = world.dt * task.steps
        self.q, self.v = self.batch.q[0].copy(), self.batch.v[0].copy()
        robots = [body for body in world.bodies if isinstance(body, tumble.Articulation)]
        names = [name for body in robots for name in columns(body)]
        self.controls, self.limit_forces = np.zeros((count, self.batch.dof)), np.zeros(count)
        self.columns = np.array(motor_columns(names, task.MOTORS, " and ".join(repr(body.name) for body in robots) or "the world"), np.int64)

    def reset(self, mask: Flags, rngs: Sequence[np.random.Generator]) -> Infos:
        """Starts new episodes in the worlds of a mask. Returns the infos of all worlds."""
        q, v = (np.tile(row, (len(mask), 1)) for row in (self.q, self.v))
        for k in np.flatnonzero(mask).tolist():
            q[k], v[k] = self.task.start(rngs[k], self.q.copy(), self.v.copy())
        self.batch.reset(mask, q=q, v=v)
        self.controls[mask], self.limit_forces[mask] = 0, 0
        return self.task.reset_info(self.state())

    def state(self) -> State:
        """Returns the present."""
        return State.of(self.batch, self.controls, self.limit_forces)

    def step(self, actions: NDArray[Any], mask: Flags) -> tuple[Floats, Flags, Infos]:
        """Steps the worlds of a mask. Returns rewards, ends and infos, which count for those worlds. A step that fails ends the episode,
        and ``failed`` in the info says so."""
        before, failed = self.state(), np.zeros(len(mask), np.bool_)
        controls = self.task.controls(actions, self.columns, self.batch.dof)
        try:
            self.batch.step(controls, self.task.steps, mask=mask)
        except tumble.StepError:
            failed = self.batch.failed
        self.controls[mask] = controls[mask]
        self.limit_forces[mask] = self.task.limit_forces(before, self.state(), self.dt)[mask]
        state = self.state()
        reward, info = self.task.reward(before, state, actions.astype(np.float64), self.dt)
        if failed.any():
            info["failed"] = failed
        return reward, self.task.terminated(state) | failed, info

    def observe(self) -> Floats:
        """Returns the observations of all worlds."""
        return self.task.observe(self.state())


def _check_range(name: str, given: Any) -> None:
    try:
        low, high = given
        ordered = bool(float(low) <= float(high))
    except (TypeError, ValueError):
        ordered = False
    if not ordered:
        raise tumble.InvalidValueError(f"{name} is {given!r}; it must be a pair of numbers, the lower one first")


def motor_columns(names: Sequence[str], motors: Sequence[tuple[str, float]], owner: str) -> list[int]:
    """Returns the degree of freedom of each motor. names: the joint of each degree of freedom. owner: whose joints they are, for the error."""
    for joint, _ in motors:
        if joint not in names:
            raise tumble.UnknownNameError(f"{owner} has no joint named {joint!r}; there are {', '.join(dict.fromkeys(names))}")
    return [names.index(joint) for joint, _ in motors]


def columns(body: tumble.Articulation) -> list[str]:
    """Returns the joint of each degree of freedom."""
    spare = body.dof - len(body.joint_names)  # a floating root has six, of one joint
    if spare == 5:
        return [body.joint_names[0]] * 6 + body.joint_names[1:]
    return body.joint_names
