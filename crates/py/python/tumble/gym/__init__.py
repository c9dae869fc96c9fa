"""Environments for gymnasium, the extra ``gym``: ``pip install ".[gym]"`` in a clone. ``gymnasium.make("tumble/CartPole-v0")`` and
``gymnasium.make_vec("tumble/Hopper-v0", num_envs=64)`` find them after ``import tumble.gym``.

An environment is a ``Task``: a model, and observation, reward and end of an episode as functions of arrays. ``Env`` runs one world of it,
``VectorEnv`` many in one ``tumble.Batch``; both give the same numbers. A ``Team`` is several robots in one world, for PettingZoo.
"""

try:
    import gymnasium
except ImportError as _missing:
    raise ImportError("tumble.gym needs the package gymnasium: pip install gymnasium", name="gymnasium") from _missing

from tumble.gym.arms import InvertedDoublePendulumTask, InvertedPendulumTask, PusherTask, ReacherTask
from tumble.gym.cart_pole import CartPole, CartPoleTask
from tumble.gym.env import Env, VectorEnv
from tumble.gym.humanoids import HumanoidStandupTask, HumanoidTask
from tumble.gym.parallel import ParallelEnv, Team
from tumble.gym.runners import AntTask, HalfCheetahTask, HopperTask, Walker2dTask
from tumble.gym.swimmer import SwimmerTask
from tumble.gym.task import State, Task

__all__ = [
    "AntTask",
    "CartPole",
    "CartPoleTask",
    "Env",
    "HalfCheetahTask",
    "HopperTask",
    "HumanoidStandupTask",
    "HumanoidTask",
    "InvertedDoublePendulumTask",
    "InvertedPendulumTask",
    "ParallelEnv",
    "PusherTask",
    "ReacherTask",
    "State",
    "SwimmerTask",
    "Task",
    "Team",
    "VectorEnv",
    "Walker2dTask",
]

for _task, _steps in (
    ("CartPole", 500),
    ("InvertedPendulum", 1000),
    ("InvertedDoublePendulum", 1000),
    ("Reacher", 50),
    ("Pusher", 100),
    ("Swimmer", 1000),
    ("Hopper", 1000),
    ("Walker2d", 1000),
    ("HalfCheetah", 1000),
    ("Ant", 1000),
    ("Humanoid", 1000),
    ("HumanoidStandup", 1000),
):
    if f"tumble/{_task}-v0" not in gymnasium.registry:
        gymnasium.register(
            f"tumble/{_task}-v0",
            entry_point="tumble.gym:Env",
            vector_entry_point="tumble.gym:VectorEnv",
            max_episode_steps=_steps,
            kwargs={"task": _task},
        )
