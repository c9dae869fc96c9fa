"""A pole on a cart.

The model is that of Barto, Sutton and Anderson (1983): a cart on a rail with a uniform pole on a revolute joint. The library's articulated bodies
provide its equations of motion.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

import tumble
from tumble.gym.env import Env
from tumble.gym.task import Flags, Floats, Infos, State, Task

_SCENE = """
[world]
dt_s = 0.005

[materials.steel]
color = "#77787c"
metallic = 1.0
roughness = 0.35

[[articulated]]
name = "cart_pole"
collidable = false

[[articulated.link]]
name = "cart"
joint = "prismatic"
axis = [1, 0, 0]
mass_kg = 1.0
center_m = [0, 0, 0]
inertia_kg_m2 = [0.01, 0.01, 0.01]
shape = { type = "box", size_m = [0.5, 0.3, 0.25], color = "#3d6fa8" }

[[articulated.link]]
name = "pole"
parent = "cart"
joint = "revolute"
axis = [0, 1, 0]
mass_kg = 0.1
center_m = [0, 0, 0.5]
inertia_kg_m2 = [0.008333333333333333, 0.008333333333333333, 0.00001]   # m l^2 / 12
shape = { type = "capsule", radius_m = 0.03, length_m = 1.0, position_m = [0, -0.2, 0.5], color = "#c98b3c" }

[[body]]
name = "rail"
mode = "static"
position_m = [0, 0, -0.16]
material = "steel"
shape = { type = "box", size_m = [6, 0.06, 0.06] }
collidable = false

[ground]
height_m = -1.0

[camera]
eye_m = [0, -5.5, 1.0]
target_m = [0, 0, 0.3]
"""


@dataclass
class CartPoleTask(Task):
    """A pole of 0.1 kg and 1 m on a cart of 1 kg, to be kept upright by forces on the cart.

    Observation: position of the cart, m, its velocity, m/s, angle of the pole from upright, rad, positive towards +x, its rate, rad/s; float32,
    shape (4,). Action: 0 pushes with 10 N towards -x, 1 towards +x, for 0.02 s. Reward: 1 for every step. Terminated beyond 2.4 m or 12 degrees.
    ``gymnasium.make`` truncates after 500 steps. All four numbers are uniform within 0.05 at the start.
    """

    FRAME_SKIP: ClassVar[int] = 4
    PUSH_N: ClassVar[float] = 10.0
    FARTHEST_M: ClassVar[float] = 2.4
    TILT_RAD: ClassVar[float] = float(np.radians(12.0))

    def world(self) -> tumble.World:
        return tumble.World.parse(_SCENE)

    def action_space(self) -> spaces.Space[Any]:
        return spaces.Discrete(2)

    def observation_space(self) -> spaces.Box:
        most = np.array([2 * self.FARTHEST_M, np.inf, 2 * self.TILT_RAD, np.inf], np.float32)
        return spaces.Box(-most, most, dtype=np.float32)

    def controls(self, actions: NDArray[Any], columns: NDArray[np.int64], dof: int) -> Floats:
        wrong = ~np.isin(actions, (0, 1))
        if actions.ndim != 1 or wrong.any():
            raise tumble.InvalidValueError(f"action is {actions[wrong][0] if actions.ndim == 1 else actions!r}; it must be 0 or 1")
        controls = np.zeros((len(actions), dof))
        controls[:, 0] = np.where(actions == 1, self.PUSH_N, -self.PUSH_N)
        return controls

    def start(self, rng: np.random.Generator, q: Floats, v: Floats) -> tuple[Floats, Floats]:
        x, speed, angle, rate = rng.uniform(-0.05, 0.05, 4)
        return np.array([x, angle]), np.array([speed, rate])

    def observe(self, state: State) -> Floats:
        return np.stack([state.q[:, 0], state.v[:, 0], state.q[:, 1], state.v[:, 1]], axis=1)

    def reward(self, before: State, state: State, actions: NDArray[Any], dt: float) -> tuple[Floats, Infos]:
        return np.ones(len(state.q)), {}

    def terminated(self, state: State) -> Flags:
        x, angle = np.abs(self.observe(state)[:, ::2].astype(np.float32)).T
        over: Flags = (x > self.FARTHEST_M) | (angle > self.TILT_RAD)
        return over


class CartPole(Env):
    """One world of ``CartPoleTask``."""

    def __init__(self, render_mode: str | None = None) -> None:
        super().__init__(CartPoleTask(), render_mode)
