"""Several robots in one world: the parallel interface of PettingZoo."""

from __future__ import annotations

import contextlib
import importlib
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
from gymnasium import spaces
from gymnasium.utils import seeding
from numpy.typing import NDArray

import tumble
from tumble.gym.task import columns, motor_columns

_Base: Any = object
with contextlib.suppress(ModuleNotFoundError):  # the interface itself needs nothing of it
    _Base = importlib.import_module("pettingzoo.utils.env").ParallelEnv

Floats = NDArray[np.float64]


class Team:
    """Several agents in one world, each an articulated body: observation, reward and end of an episode for each of them.

    A subclass sets the class variables and defines ``world``, ``observe`` and ``reward``. Motors are ``(joint, gear)`` of every agent: an action in
    ``-reach`` to ``reach`` for each, the torque is gear times action.
    """

    AGENTS: ClassVar[Sequence[str]]
    """Names of the articulated bodies that are agents."""
    MOTORS: ClassVar[Sequence[tuple[str, float]]] = ()
    REACH: ClassVar[float] = 1.0
    FRAME_SKIP: ClassVar[int] = 1
    """Steps of the world for each step of the environment."""
    OBSERVATION: ClassVar[int]
    """Length of an observation."""

    def world(self) -> tumble.World:
        """Returns a new world with all agents, as it is at the start."""
        raise NotImplementedError

    def start(self, world: tumble.World, rng: np.random.Generator) -> None:
        """Changes the start of an episode."""

    def observe(self, world: tumble.World, agent: str) -> Floats:
        """Returns what an agent sees, shape (OBSERVATION,)."""
        raise NotImplementedError

    def reward(self, world: tumble.World, agent: str, action: Floats, dt: float) -> float:
        """Returns the reward of an agent for the last step. dt: length of a step of the environment, s."""
        raise NotImplementedError

    def terminated(self, world: tumble.World, agent: str) -> bool:
        """Returns whether the episode is over for an agent. Its body stays, without torques."""
        return False

    def info(self, world: tumble.World, agent: str) -> dict[str, Any]:
        """Returns what the info of an agent says."""
        return {}

    def action_space(self, agent: str) -> spaces.Box:
        """Returns the space of an agent's actions."""
        return spaces.Box(-self.REACH, self.REACH, (len(self.MOTORS),), np.float32)

    def observation_space(self, agent: str) -> spaces.Box:
        """Returns the space of an agent's observations."""
        return spaces.Box(-np.inf, np.inf, (self.OBSERVATION,), np.float64)


class ParallelEnv(_Base):  # type: ignore[misc]
    """One world with a team: PettingZoo's ``ParallelEnv``.

    team: a ``Team``. max_cycles: after how many steps an episode is truncated; None: never. An agent whose episode is over is in ``agents`` no more. A step that
    fails ends the episode of all, and is ``failed`` in their infos.
    """

    def __init__(self, team: Team, *, max_cycles: int | None = 1000, render_mode: str | None = None) -> None:
        if render_mode not in (None, "rgb_array"):
            raise tumble.InvalidValueError(f"render_mode is {render_mode!r}; there is 'rgb_array'")
        self.team, self.max_cycles, self.render_mode = team, max_cycles, render_mode
        self.world = team.world()
        self.possible_agents = list(team.AGENTS)
        self.agents: list[str] = []
        self.dt = self.world.dt * team.FRAME_SKIP
        self.metadata = {"name": type(team).__name__, "render_modes": ["rgb_array"], "render_fps": round(1 / self.dt), "is_parallelizable": True}
        self.observation_spaces = {agent: team.observation_space(agent) for agent in self.possible_agents}
        self.action_spaces = {agent: team.action_space(agent) for agent in self.possible_agents}
        self._bodies = {agent: self.world.articulation(agent) for agent in self.possible_agents}
        self._columns = {agent: motor_columns(columns(body), team.MOTORS, repr(body.name)) for agent, body in self._bodies.items()}
        self._start, self._cycles = self.world.save(), 0
        self._rng: np.random.Generator | None = None

    def __getstate__(self) -> dict[str, Any]:
        return {key: value for key, value in self.__dict__.items() if key != "_bodies"}  # a body belongs to its world

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._bodies = {agent: self.world.articulation(agent) for agent in self.possible_agents}

    def observation_space(self, agent: str) -> spaces.Box:
        """Returns the space of an agent's observations."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Box:
        """Returns the space of an agent's actions."""
        return self.action_spaces[agent]

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[dict[str, Floats], dict[str, dict[str, Any]]]:
        """Starts a new episode of all agents."""
        if seed is not None or self._rng is None:
            self._rng = seeding.np_random(seed)[0]
        self.world.restore(self._start)
        self.team.start(self.world, self._rng)
        self.agents, self._cycles = list(self.possible_agents), 0
        return self._observations(self.agents), {agent: self.team.info(self.world, agent) for agent in self.agents}

    def step(
        self, actions: dict[str, NDArray[Any]]
    ) -> tuple[dict[str, Floats], dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]]:
        """Steps the world under the actions of all agents that are in ``agents``."""
        acting = self.agents
        if set(actions) != set(acting):
            raise tumble.InvalidValueError(f"actions: expected those of {acting}, got {list(actions)}")
        for agent, body in self._bodies.items():
            body.tau = self._torques(agent, actions[agent]) if agent in actions else np.zeros(body.dof)
        failed = False
        try:
            self.world.step(self.team.FRAME_SKIP)
        except tumble.StepError:
            failed = True
        self._cycles += 1
        late = self.max_cycles is not None and self._cycles >= self.max_cycles
        rewards = {agent: float(self.team.reward(self.world, agent, np.asarray(actions[agent], np.float64), self.dt)) for agent in acting}
        over = {agent: failed or bool(self.team.terminated(self.world, agent)) for agent in acting}
        infos = {agent: self.team.info(self.world, agent) | ({"failed": True} if failed else {}) for agent in acting}
        self.agents = [] if late else [agent for agent in acting if not over[agent]]
        return self._observations(acting), rewards, over, dict.fromkeys(acting, late), infos

    def state(self) -> Floats:
        """Returns the state of the whole world, ``World.state``."""
        return self.world.state.copy()

    def render(self) -> NDArray[np.uint8] | None:
        """Returns an image, shape (400, 600, 3), if ``render_mode`` is ``"rgb_array"``."""
        return None if self.render_mode is None else self.world.render(600, 400)[..., :3]

    def close(self) -> None:
        """Does nothing: a world holds no window and no process."""

    def _observations(self, agents: Sequence[str]) -> dict[str, Floats]:
        return {agent: np.asarray(self.team.observe(self.world, agent), np.float64) for agent in agents}

    def _torques(self, agent: str, action: NDArray[Any]) -> Floats:
        action = np.asarray(action, np.float64)
        if action.shape != (len(self.team.MOTORS),):
            raise tumble.InvalidValueError(f"action of {agent}: expected shape ({len(self.team.MOTORS)},), got {action.shape}")
        torques = np.zeros(self._bodies[agent].dof)
        torques[self._columns[agent]] = np.clip(action, -self.team.REACH, self.team.REACH) * [gear for _, gear in self.team.MOTORS]
        return torques
