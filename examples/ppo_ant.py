"""PPO of stable-baselines3 (`pip install stable-baselines3`) on the ant of `tumble.gym`, all worlds of a vector environment side by side.

    python examples/ppo_ant.py [Ant 3000000]    # without words a few turns, to see that it runs
"""

import sys

import numpy as np
import tumble.gym

try:
    from stable_baselines3 import PPO
    from stable_baselines3.common.vec_env import VecEnv, VecMonitor
except ImportError:
    sys.exit("SKIPPED: stable-baselines3 is not installed; `pip install stable-baselines3` installs it")


class Worlds(VecEnv):
    """A `tumble.gym.VectorEnv` in the interface of stable-baselines3."""

    def __init__(self, task: str, num_envs: int, max_episode_steps: int = 1000) -> None:
        self.env = tumble.gym.VectorEnv(task, num_envs, max_episode_steps=max_episode_steps, autoreset_mode="SameStep")
        super().__init__(num_envs, self.env.single_observation_space, self.env.single_action_space)

    def reset(self):
        seen, _ = self.env.reset(seed=self._seeds)
        self._reset_seeds()
        return seen

    def step_async(self, actions):
        self.result = self.env.step(actions)

    def step_wait(self):
        seen, reward, terminated, truncated, info = self.result
        infos = [{"TimeLimit.truncated": bool(late and not fallen)} for late, fallen in zip(truncated, terminated)]
        for k in np.flatnonzero(terminated | truncated):
            infos[k]["terminal_observation"] = info["final_obs"][k]
        return seen, reward.astype(np.float32), terminated | truncated, infos

    def close(self):
        self.env.close()

    def get_attr(self, attr_name, indices=None):  # the worlds share their attributes
        return [getattr(self.env, attr_name)] * len(list(self._get_indices(indices)))

    def set_attr(self, attr_name, value, indices=None):
        raise NotImplementedError("the worlds share their attributes")

    def env_method(self, method_name, *args, indices=None, **kwargs):
        raise NotImplementedError("the worlds are one environment, `env`")

    def env_is_wrapped(self, wrapper_class, indices=None):
        return [False] * len(list(self._get_indices(indices)))


if __name__ == "__main__":
    task, steps = sys.argv[1:] if len(sys.argv) == 3 else ("Ant", 8192)
    model = PPO("MlpPolicy", VecMonitor(Worlds(task, 16)), n_steps=128, batch_size=256, seed=0, device="cpu").learn(int(steps))
    ends = [episode["r"] for episode in model.ep_info_buffer]
    print(f"{task} after {model.num_timesteps} steps: {len(ends)} episodes, mean return {np.mean(ends):.0f}")
