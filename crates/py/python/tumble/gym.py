"""An environment for gymnasium, the extra ``gym``: ``pip install ".[gym]"`` in a clone. ``gymnasium.make("tumble/CartPole-v0")`` finds it after ``import tumble.gym``.

The model is that of Barto, Sutton and Anderson (1983): a cart on a rail with a uniform pole on a revolute joint. The library's articulated bodies
provide its equations of motion.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

import tumble

try:
    import gymnasium
except ImportError as _missing:
    raise ImportError("tumble.gym needs the package gymnasium: pip install gymnasium", name="gymnasium") from _missing

_SCENE = """
[world]
dt_s = 0.005

[materials.steel]
color = "#77787c"
metallic = 1.0
roughness = 0.35

[[articulated]]
name = "cart_pole"
collides = false

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
collides = false

[ground]
height_m = -1.0

[camera]
eye_m = [0, -5.5, 1.0]
target_m = [0, 0, 0.3]
"""


class CartPole(gymnasium.Env[NDArray[np.float32], np.int64]):
    """A pole of 0.1 kg and 1 m on a cart of 1 kg, to be kept upright by forces on the cart.

    Observation: position of the cart, m, its velocity, m/s, angle of the pole from upright, rad, positive towards +x, its rate, rad/s; float32,
    shape (4,). Action: 0 pushes with 10 N towards -x, 1 towards +x, for 0.02 s. Reward: 1 for every step. Terminated beyond 2.4 m or 12 degrees.
    ``gymnasium.make`` truncates after 500 steps.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 50}

    PUSH_N = 10.0
    FARTHEST_M = 2.4
    TILT_RAD = float(np.radians(12.0))
    SUBSTEPS = 4

    def __init__(self, render_mode: str | None = None) -> None:
        if render_mode not in (None, "rgb_array"):
            raise tumble.InvalidValueError(f"render_mode is {render_mode!r}; there is 'rgb_array'")
        self.render_mode = render_mode
        most = np.array([2 * self.FARTHEST_M, np.inf, 2 * self.TILT_RAD, np.inf], np.float32)
        self.observation_space = gymnasium.spaces.Box(-most, most, dtype=np.float32)
        self.action_space = gymnasium.spaces.Discrete(2)
        self.world = tumble.World.parse(_SCENE)
        self.body: tumble.Articulation = self.world["cart_pole"]
        self._start = self.world.save()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Starts a new episode near the upright rest position: all four numbers are uniform within 0.05."""
        super().reset(seed=seed)
        self.world.restore(self._start)
        x, v, angle, rate = self.np_random.uniform(-0.05, 0.05, 4)
        self.body.q, self.body.qd = (x, angle), (v, rate)
        return self._observation(), {}

    def step(self, action: np.int64) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Pushes for 0.02 s."""
        if not self.action_space.contains(action):
            raise tumble.InvalidValueError(f"action is {action!r}; it must be 0 or 1")
        self.body.tau = (self.PUSH_N if action else -self.PUSH_N, 0.0)
        self.world.step(self.SUBSTEPS)
        observation = self._observation()
        fallen = bool(abs(observation[0]) > self.FARTHEST_M or abs(observation[2]) > self.TILT_RAD)
        return observation, 1.0, fallen, False, {}

    def render(self) -> NDArray[np.uint8] | None:
        """Returns an image, shape (400, 600, 3), if ``render_mode`` is ``"rgb_array"``."""
        return None if self.render_mode is None else self.world.render(600, 400)[..., :3]

    def _observation(self) -> NDArray[np.float32]:
        (x, angle), (v, rate) = self.body.q, self.body.qd
        return np.array([x, v, angle, rate], np.float32)


if "tumble/CartPole-v0" not in gymnasium.registry:
    gymnasium.register("tumble/CartPole-v0", entry_point="tumble.gym:CartPole", max_episode_steps=500)
