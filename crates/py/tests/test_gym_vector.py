"""Vector environments: the same numbers as gymnasium's `SyncVectorEnv` of single ones, in all autoreset modes; errors; a task of one's own."""

from dataclasses import dataclass

import numpy as np
import pytest

import tumble

gymnasium = pytest.importorskip("gymnasium", reason="SKIPPED: gymnasium is not installed")
tumble_gym = pytest.importorskip("tumble.gym")

from gymnasium.vector import AutoresetMode, SyncVectorEnv  # noqa: E402

NAMES = ["CartPole", "InvertedPendulum", "InvertedDoublePendulum", "Reacher", "Pusher", "Swimmer", "Hopper", "Walker2d", "HalfCheetah", "Ant", "Humanoid", "HumanoidStandup"]


def same(one, other, path="info"):
    """Compares two infos, arrays in which a mask says what counts."""
    assert one.keys() == other.keys(), path
    for key, value in one.items():
        if isinstance(value, dict):
            same(value, other[key], f"{path}.{key}")
        elif not key.startswith("_"):
            mask = one[f"_{key}"]
            assert (mask == other[f"_{key}"]).all(), f"{path}._{key}"
            for a, b, counts in zip(value, other[key], mask):
                assert not counts or (np.asarray(a) == np.asarray(b)).all(), f"{path}.{key}"


def pair(name, mode, steps, count=3):
    """Both kinds of vector environments."""
    ours = gymnasium.make_vec(f"tumble/{name}-v0", num_envs=count, max_episode_steps=steps, autoreset_mode=mode)
    makers = [lambda: gymnasium.make(f"tumble/{name}-v0", max_episode_steps=steps, disable_env_checker=True)] * count
    return ours, SyncVectorEnv(makers, autoreset_mode=mode)


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
@pytest.mark.parametrize("name", NAMES)
def test_it_gives_what_gymnasium_s_own_gives(name, mode):
    ours, theirs = pair(name, mode, steps=9)
    assert isinstance(ours.unwrapped, tumble_gym.VectorEnv) and ours.metadata["autoreset_mode"] == mode
    assert ours.observation_space == theirs.observation_space and ours.action_space == theirs.action_space
    (first, info), (expected, expected_info) = ours.reset(seed=5), theirs.reset(seed=5)
    assert first.tobytes() == expected.tobytes() and first.dtype == expected.dtype
    same(expected_info, info)
    ours.action_space.seed(1)
    ended = 0
    for _ in range(25):
        actions = ours.action_space.sample()
        got, wanted = ours.step(actions), theirs.step(actions)
        for a, b in zip(got[:4], wanted[:4]):
            assert a.tobytes() == b.tobytes() and a.dtype == b.dtype
        same(wanted[4], got[4])
        ended += (got[2] | got[3]).sum()
    assert ended >= 6


def test_without_autoreset_a_mask_starts_episodes_anew():
    ours, theirs = pair("CartPole", AutoresetMode.DISABLED, steps=200)
    ours.reset(seed=2), theirs.reset(seed=2)
    actions, over = np.array([0, 1, 1]), np.zeros(3, bool)
    for _ in range(60):
        if over.any():
            with pytest.raises(ValueError, match="episodes are over"):
                ours.step(actions)
            a, b = ours.reset(options={"reset_mask": over})[0], theirs.reset(options={"reset_mask": over})[0]
            assert a.tobytes() == b.tobytes()
        got, wanted = ours.step(actions), theirs.step(actions)
        assert all(a.tobytes() == b.tobytes() for a, b in zip(got[:4], wanted[:4]))
        over = got[2] | got[3]
    assert ours.reset(seed=[7, 8, 9])[0].tobytes() == theirs.reset(seed=[7, 8, 9])[0].tobytes()


@pytest.mark.parametrize("name", ["Hopper", "Ant"])
def test_the_number_of_threads_changes_no_bit(name):
    def run(threads):
        env = tumble_gym.VectorEnv(name, 5, threads=threads)
        seen = [env.reset(seed=0)[0]]
        env.action_space.seed(0)
        return np.array(seen + [env.step(env.action_space.sample())[0] for _ in range(8)]).tobytes()

    assert run(1) == run(2) == run(None)


def test_wrong_arguments_are_refused():
    env = tumble_gym.VectorEnv("Hopper", 2)
    with pytest.raises(ValueError, match="reset_mask: expected booleans"):
        env.reset(options={"reset_mask": [True, False]})
    with pytest.raises(ValueError, match="seed: expected 2 seeds, got 3"):
        env.reset(seed=[1, 2, 3])
    env.reset(seed=0)
    with pytest.raises(ValueError, match="actions: expected 2 rows, got 3"):
        env.step(np.zeros((3, 3)))
    with pytest.raises(ValueError, match=r"action: expected shape \(3,\), got \(2,\)"):
        env.step(np.zeros((2, 2)))
    with pytest.raises(ValueError, match="NaN"):
        env.step(np.full((2, 3), np.nan))
    with pytest.raises(ValueError, match="rgb_array"):
        tumble_gym.VectorEnv("Hopper", 2, render_mode="human")
    with pytest.raises(KeyError, match="no task named 'Dragon'"):
        tumble_gym.Env("Dragon")


@dataclass
class Ball(tumble_gym.Task):
    """A task of a program: a weight on a vertical slide, which a force is to hold at 1 m."""

    mass: float = 2.0
    MOTORS = (("slide", 1.0),)
    OBSERVATION = 2

    def action_space(self):
        return gymnasium.spaces.Box(-np.inf, np.inf, (1,), np.float64)

    def controls(self, actions, columns, dof):
        return actions

    def world(self):
        world = tumble.World(dt=0.01)
        builder = tumble.ArticulationBuilder("lift")
        builder.add_link("slide", joint="prismatic", axis=(0, 0, 1), mass=self.mass, center_of_mass=(0, 0, 0), inertia=(1, 1, 1))
        world.add_articulation(builder)
        return world

    def start(self, rng, q, v):
        return rng.uniform(0.9, 1.1, 1), v

    def observe(self, state):
        return np.concatenate([state.q, state.v], axis=1)

    def reward(self, before, state, actions, dt):
        return -np.abs(state.q[:, 0] - 1), {"speed": (state.q[:, 0] - before.q[:, 0]) / dt}

    def terminated(self, state):
        return state.q[:, 0] < 0


def test_a_task_of_a_program():
    env = tumble_gym.VectorEnv(Ball(mass=3.0), 3)
    start, _ = env.reset(seed=1)
    seen, reward, *_, info = env.step(np.full((3, 1), 3.0 * 9.81))
    assert seen[:, 0] == pytest.approx(start[:, 0]) and reward == pytest.approx(-abs(start[:, 0] - 1))
    assert info["speed"] == pytest.approx(0, abs=1e-12) and info["_speed"].all()
    _, _, over, _, _ = tumble_gym.Env(Ball, mass=1.0).unwrapped.reset(seed=0) and env.step(np.zeros((3, 1)))
    assert not over.any()


def test_a_step_that_fails_ends_that_episode_alone():
    env = tumble_gym.VectorEnv(Ball(mass=1e-3), 3, autoreset_mode=AutoresetMode.SAME_STEP)
    start, _ = env.reset(seed=1)
    actions = np.full((3, 1), 1e-3 * 9.81)
    actions[1] = 1e307
    seen, reward, over, cut, info = env.step(actions)
    assert over.tolist() == [False, True, False] and not cut.any()
    assert info["final_info"]["failed"].tolist() == [False, True, False]
    assert seen[[0, 2]] == pytest.approx(start[[0, 2]]) and np.isfinite(seen).all()
    assert not env.step(np.full((3, 1), 1e-3 * 9.81))[2].any()
    one = tumble_gym.Env(Ball(mass=1e-3))
    one.reset(seed=1)
    _, _, over, _, info = one.step(np.array([1e307]))
    assert over and info["failed"]
