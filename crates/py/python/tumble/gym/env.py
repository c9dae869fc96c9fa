"""Environments of gymnasium that run a task: one world, or many."""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Callable, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

import tumble
from tumble._keywords import refuse_unknown
from tumble.gym.task import Flags, Floats, Infos, Runs, Task


def _made(task: Task | type[Task] | str, parameters: dict[str, Any], own: Callable[..., object]) -> Task:
    """The task itself, or of a name or a class with parameters. own: what has parameters beside those of the task."""
    if isinstance(task, str):
        found: type[Task] = getattr(importlib.import_module("tumble.gym"), f"{task}Task", Task)
        if found is Task:
            raise tumble.UnknownNameError(f"tumble.gym has no task named {task!r}")
        task = found
    if isinstance(task, Task):
        if parameters:
            raise TypeError(f"{', '.join(parameters)}: the task is made already; give its parameters to {type(task).__name__}")
        return task
    known, open_ended = _names(task)
    if not open_ended:
        refuse_unknown(task.__name__, parameters, [*known, *_names(own)[0]])
    return task(**parameters)


def _names(function: Callable[..., Any]) -> tuple[list[str], bool]:
    """The parameters' names, and whether there may be others."""
    parameters = inspect.signature(function).parameters.values()
    named = [each.name for each in parameters if each.kind in (each.POSITIONAL_OR_KEYWORD, each.KEYWORD_ONLY)]
    return named, any(each.kind == each.VAR_KEYWORD for each in parameters)


def _checked(render_mode: str | None) -> str | None:
    if render_mode not in (None, "rgb_array"):
        raise tumble.InvalidValueError(f"render_mode is {render_mode!r}; there is 'rgb_array'")
    return render_mode


def _metadata(dt: float) -> dict[str, Any]:
    return {"render_modes": ["rgb_array"], "render_fps": round(1 / dt)}


def _picture(task: Task, world: tumble.World, q: Floats) -> NDArray[np.uint8]:
    return world.render(600, 400, camera=task.camera(q))[..., :3]


class Env(gymnasium.Env[NDArray[Any], Any]):
    """One world of a task.

    task: a ``Task``, its class, or the name of one that is shipped, ``"Hopper"``; parameters: those of the class. A step that fails, for
    instance because a state is not finite, ends the episode and is ``failed`` in the info.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 50}

    def __init__(self, task: Task | type[Task] | str, render_mode: str | None = None, **parameters: Any) -> None:
        self.render_mode = _checked(render_mode)
        self.task = _made(task, parameters, type(self))
        self.runs = Runs(self.task, 1, threads=1)
        self.metadata = _metadata(self.runs.dt)
        self.action_space = self.task.action_space()
        self.observation_space = self.task.observation_space()

    @property
    def world(self) -> tumble.World:
        """The world."""
        return self.runs.batch.world(0)

    @property
    def body(self) -> tumble.Articulation:
        """The first articulated body of the world."""
        return next(body for body in self.world.bodies if isinstance(body, tumble.Articulation))

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[NDArray[Any], dict[str, Any]]:
        """Starts a new episode."""
        super().reset(seed=seed)
        info = self.runs.reset(np.ones(1, np.bool_), [self.np_random])
        return self._observation(), _row(info)

    def step(self, action: Any) -> tuple[NDArray[Any], float, bool, bool, dict[str, Any]]:
        """Steps the world under an action for the length of a step of the environment."""
        reward, terminated, info = self.runs.step(np.asarray(action)[None], np.ones(1, np.bool_))
        return self._observation(), float(reward[0]), bool(terminated[0]), False, _row(info)

    def render(self) -> NDArray[np.uint8] | None:
        """Returns an image, shape (400, 600, 3), if ``render_mode`` is ``"rgb_array"``."""
        return None if self.render_mode is None else _picture(self.task, self.world, self.runs.batch.q[0])

    def _observation(self) -> NDArray[Any]:
        observation: NDArray[Any] = self.runs.observe()[0].astype(self.observation_space.dtype)
        return observation


def _row(infos: Infos) -> dict[str, Any]:
    return {key: values[0].item() for key, values in infos.items()}


class VectorEnv(gymnasium.vector.VectorEnv[NDArray[Any], NDArray[Any], NDArray[Any]]):
    """Many worlds of a task, stepped together on all cores. Observations, rewards and infos are those of gymnasium's ``SyncVectorEnv`` of as
    many ``Env``.

    task, parameters: as in ``Env``. max_episode_steps: after how many steps an episode is truncated; None: never. autoreset_mode: a world
    whose episode is over starts a new one in the next step (``"NextStep"``), in the same step (``"SameStep"``, with ``final_obs`` and
    ``final_info`` in the info), or by ``reset`` with ``options={"reset_mask": mask}`` alone (``"Disabled"``). threads: as in ``Batch``.
    """

    def __init__(
        self,
        task: Task | type[Task] | str,
        num_envs: int = 1,
        *,
        max_episode_steps: int | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        render_mode: str | None = None,
        threads: int | None = None,
        **parameters: Any,
    ) -> None:
        super().__init__()
        self.render_mode = _checked(render_mode)
        self.task = _made(task, parameters, type(self))
        self.runs = Runs(self.task, num_envs, threads)
        self.num_envs = num_envs
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.max_episode_steps = max_episode_steps
        self.metadata = _metadata(self.runs.dt) | {"autoreset_mode": self.autoreset_mode}
        self.single_action_space = self.task.action_space()
        self.single_observation_space = self.task.observation_space()
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self._rngs: list[np.random.Generator | None] = [None] * num_envs
        self._steps = np.zeros(num_envs, np.int64)
        self._over = np.zeros(num_envs, np.bool_)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[Any], dict[str, Any]]:
        """Starts new episodes. seed: world i takes ``seed + i``, or ``seed[i]``. options: ``reset_mask``, booleans of shape (num_envs,): the worlds
        that start anew; by default all."""
        mask = (options or {}).get("reset_mask", np.ones(self.num_envs, np.bool_))
        if not isinstance(mask, np.ndarray) or mask.shape != (self.num_envs,) or mask.dtype != np.bool_ or not mask.any():
            raise tumble.InvalidValueError(f"reset_mask: expected booleans, shape ({self.num_envs},), one of them True")
        seeds = [None if seed is None else seed + k for k in range(self.num_envs)] if seed is None or isinstance(seed, int) else list(seed)
        if len(seeds) != self.num_envs:
            raise tumble.InvalidValueError(f"seed: expected {self.num_envs} seeds, got {len(seeds)}")
        for k in np.flatnonzero(mask):
            if seeds[k] is not None or self._rngs[k] is None:
                self._rngs[k] = seeding.np_random(seeds[k])[0]
        infos: dict[str, Any] = {}
        self._start(mask, infos)
        return self._observations(), infos

    def step(self, actions: NDArray[Any]) -> tuple[NDArray[Any], Floats, Flags, Flags, dict[str, Any]]:
        """Steps the worlds under their actions; those whose episode is over as ``autoreset_mode`` says."""
        actions = np.asarray(actions)
        if len(actions) != self.num_envs:
            raise tumble.InvalidValueError(f"actions: expected {self.num_envs} rows, got {len(actions)}")
        infos: dict[str, Any] = {}
        stepped = ~self._over
        if not stepped.all():
            if self.autoreset_mode == AutoresetMode.DISABLED:
                raise tumble.InvalidValueError("episodes are over; start new ones by reset(options={'reset_mask': mask})")
            self._start(~stepped, infos)
        reward, terminated, info = self.runs.step(actions, stepped)
        reward, terminated = np.where(stepped, reward, 0.0), terminated & stepped
        self._steps[stepped] += 1
        late = self._steps >= self.max_episode_steps if self.max_episode_steps is not None else np.zeros_like(stepped)
        truncated = stepped & late
        over = terminated | truncated
        if self.autoreset_mode == AutoresetMode.SAME_STEP and over.any():
            self._finish(over, info, infos)
            _add(infos, info, stepped & ~over)
        else:
            self._over = over
            _add(infos, info, stepped)
        return self._observations(), reward, terminated, truncated, infos

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """Returns an image of each world, shape (400, 600, 3), if ``render_mode`` is ``"rgb_array"``."""
        if self.render_mode is None:
            return None
        return tuple(_picture(self.task, world, q) for world, q in zip(self.runs.batch.worlds, self.runs.batch.q, strict=True))

    def _start(self, mask: Flags, infos: dict[str, Any]) -> None:
        """Starts new episodes in the worlds of a mask."""
        rngs = [rng if rng is not None else seeding.np_random()[0] for rng in self._rngs]
        self._rngs = [*rngs]
        _add(infos, self.runs.reset(mask, rngs), mask)
        self._steps[mask], self._over[mask] = 0, False

    def _finish(self, over: Flags, info: Infos, infos: dict[str, Any]) -> None:
        """Keeps the ends of episodes in the info, and starts new ones."""
        last, final = np.full(self.num_envs, None, object), self._observations()
        for k in np.flatnonzero(over):
            last[k] = final[k]
        final_info: dict[str, Any] = {}
        _add(final_info, info, over)
        infos |= {"final_obs": last, "_final_obs": over.copy(), "final_info": final_info, "_final_info": over.copy()}
        self._start(over, infos)

    def _observations(self) -> NDArray[Any]:
        return self.runs.observe().astype(self.single_observation_space.dtype)


def _add(infos: dict[str, Any], info: Infos, mask: Flags) -> None:
    """Adds the values of the worlds of a mask, with the mask, as gymnasium's vector environments write them."""
    if not mask.any():
        return
    for key, values in info.items():
        known, known_mask = infos.get(key, np.zeros_like(values)), infos.get(f"_{key}", np.zeros_like(mask))
        infos[key], infos[f"_{key}"] = np.where(mask, values, known), mask | known_mask
