"""Several robots in one world: PettingZoo's own test, what agents see of each other, ends, errors."""

import copy
import pickle
import warnings

import numpy as np
import pytest

import tumble

pytest.importorskip("gymnasium", reason="SKIPPED: gymnasium is not installed")
tumble_gym = pytest.importorskip("tumble.gym")


class Duel(tumble_gym.Team):
    """Two carts on one rail, 2 m apart, each to be pushed off its place by the other."""

    AGENTS = ("left", "right")
    MOTORS = (("cart", 20.0),)
    FRAME_SKIP = 4
    OBSERVATION = 4
    MASS = 2.0

    def world(self):
        world = tumble.World(gravity=(0, 0, 0), dt=0.01)
        for name, x in (("left", -1.0), ("right", 1.0)):
            builder = tumble.ArticulationBuilder(name)
            builder.add_link("cart", joint="prismatic", axis=(1, 0, 0), position=(x, 0, 0), shape=tumble.Box((0.4, 0.4, 0.4)), mass=self.MASS)
            world.add_articulation(builder)
        return world

    def start(self, world, rng):
        for name in self.AGENTS:
            world.articulation(name).q = rng.uniform(-0.1, 0.1, 1)

    def observe(self, world, agent):
        other = world.articulation(self.AGENTS[agent == "left"])
        own = world.articulation(agent)
        return np.array([own.q[0], own.qd[0], other.q[0], other.qd[0]])

    def reward(self, world, agent, action, dt):
        return -abs(world.articulation(agent).q[0]) - 0.01 * float(action @ action)

    def terminated(self, world, agent):
        return abs(world.articulation(agent).q[0]) > 1.5

    def info(self, world, agent):
        return {"contacts": len(world.contacts)}


def test_pettingzoo_s_own_test_passes():
    pytest.importorskip("pettingzoo", reason="SKIPPED: pettingzoo is not installed")
    from pettingzoo import ParallelEnv
    from pettingzoo.test import parallel_api_test, parallel_seed_test

    env = tumble_gym.ParallelEnv(Duel())
    assert isinstance(env, ParallelEnv)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        parallel_api_test(env, num_cycles=300)
        parallel_seed_test(lambda: tumble_gym.ParallelEnv(Duel()), num_cycles=20)


def test_agents_meet_in_one_world():
    env = tumble_gym.ParallelEnv(Duel())
    seen, infos = env.reset(seed=3)
    assert (seen["left"][:2] == seen["right"][2:]).all() and infos["left"] == {"contacts": 0} and abs(seen["left"][0]) <= 0.1
    touched = False
    for cycle in range(1, 200):
        before = seen
        seen, rewards, over, cut, infos = env.step({"left": np.array([1.0]), "right": np.array([0.0])})
        if cycle == 1:  # alone: v = F t / m
            assert seen["left"][1] == pytest.approx(20 / 2 * 0.04) and seen["right"][1] == 0
            assert rewards["left"] == pytest.approx(-abs(seen["left"][0]) - 0.01) and rewards["right"] == pytest.approx(-abs(before["right"][0]))
        touched |= infos["left"]["contacts"] > 0
        if any(over.values()):
            break
    assert touched and over == {"left": False, "right": True} or over == {"left": True, "right": False}
    assert env.agents == [name for name in ("left", "right") if not over[name]] and not any(cut.values())
    # the other goes on alone; the body of the first stays, without a torque
    (rest,) = env.agents
    more = env.step({rest: np.array([0.0])})
    assert [list(part) for part in more] == [[rest]] * 5
    assert env.state().tolist() == env.world.state.tolist()


def test_an_episode_ends_in_time_and_starts_anew():
    env = tumble_gym.ParallelEnv(Duel(), max_cycles=3)
    first = env.reset(seed=1)[0]
    still = dict.fromkeys(env.agents, np.zeros(1))
    for _ in range(3):
        *_, cut, _ = env.step(still)
    assert cut == {"left": True, "right": True} and env.agents == []
    again = env.reset(seed=1)[0]
    assert all((first[name] == again[name]).all() for name in first) and env.world.time == 0
    assert (env.reset()[0]["left"] != first["left"]).any()


def test_a_step_that_fails_ends_the_episode_of_all():
    class Wild(Duel):
        MOTORS, MASS = (("cart", 1e308),), 1e-3

    env = tumble_gym.ParallelEnv(Wild())
    env.reset(seed=0)
    _, _, over, _, infos = env.step(dict.fromkeys(env.agents, np.ones(1)))
    assert over == {"left": True, "right": True} and infos["left"]["failed"] and env.agents == []
    assert np.isfinite(env.reset(seed=0)[0]["left"]).all()


def test_wrong_arguments_are_refused():
    env = tumble_gym.ParallelEnv(Duel())
    env.reset(seed=0)
    with pytest.raises(ValueError, match=r"actions: expected those of \['left', 'right'\], got \['left'\]"):
        env.step({"left": np.zeros(1)})
    with pytest.raises(ValueError, match=r"action of left: expected shape \(1,\), got \(2,\)"):
        env.step({"left": np.zeros(2), "right": np.zeros(1)})
    with pytest.raises(ValueError, match="rgb_array"):
        tumble_gym.ParallelEnv(Duel(), render_mode="human")

    class Lost(Duel):
        MOTORS = (("wheel", 1.0),)

    with pytest.raises(KeyError, match="'left' has no joint named 'wheel'"):
        tumble_gym.ParallelEnv(Lost())


def test_a_pickled_environment_goes_on_alike():
    env = tumble_gym.ParallelEnv(Duel(), max_cycles=5)
    env.reset(seed=2)
    actions = {"left": np.array([0.5]), "right": np.array([-1.0])}
    env.step(actions)
    copies = pickle.loads(pickle.dumps(env)), copy.deepcopy(env)
    seen, rewards, *_ = env.step(actions)
    for each in copies:
        again = each.step(actions)
        assert again[1] == rewards and all((again[0][agent] == seen[agent]).all() for agent in Duel.AGENTS)
        assert (each.reset()[0]["left"] != seen["left"]).any() and each.world is not env.world
