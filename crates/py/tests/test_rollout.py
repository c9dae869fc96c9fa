"""Many futures of one world."""

import numpy as np
import pytest

import tumble


@pytest.fixture
def arm_world(root):
    world = tumble.World()
    world.add_articulation(root / "scenes" / "robot" / "arm.urdf", name="arm")
    world.step(5)
    return world


def controls(world, forks, steps):
    return np.random.default_rng(3).normal(0, 20, (forks, steps, world["arm"].dof))


def test_a_rollout_is_what_forks_do_one_by_one(arm_world):
    tau = controls(arm_world, 5, 12)
    before = arm_world.save()
    states = arm_world.rollout(tau, every=3)
    assert states.shape == (5, 4, len(arm_world.state))
    assert arm_world.save() == before
    for k in range(5):
        fork = arm_world.fork()
        for frame in range(12):
            fork["arm"].tau = tau[k, frame]
            fork.step()
            if frame % 3 == 2:
                assert (states[k, frame // 3] == fork.state).all()


def test_the_number_of_threads_changes_no_bit(arm_world):
    tau = controls(arm_world, 9, 10)
    assert (arm_world.rollout(tau, threads=1) == arm_world.rollout(tau, threads=4)).all()


def test_forks_may_start_elsewhere(arm_world):
    states = np.tile(arm_world.state, (3, 1))
    states[:, 0] += [0.0, 0.1, 0.2]
    ends = arm_world.rollout(np.zeros((3, 1, 6)), states=states)[:, 0]
    for start, end in zip(states, ends):
        fork = arm_world.fork()
        fork.state = start
        fork.step()
        assert (fork.state == end).all()


def test_a_world_without_articulations_rolls_out_without_controls():
    world = tumble.World.load("stack")
    states = world.rollout(np.zeros((2, 3, 0)))
    world.step(3)
    assert (states[0, -1] == world.state).all() and (states[1, -1] == world.state).all()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"controls": np.zeros((2, 6))}, r"controls: expected shape \(forks, steps, 6\), got \(2, 6\)"),
        ({"controls": np.zeros((2, 3, 5))}, r"controls: expected 6 numbers per step"),
        ({"controls": np.full((1, 1, 6), np.inf)}, "controls: number 0 is inf"),
        ({"controls": np.zeros((2, 3, 6)), "every": 2}, "every is 2; it must divide the 3 steps"),
        ({"controls": np.zeros((2, 3, 6)), "states": np.zeros(3)}, r"states: expected shape \(12,\) or \(2, 12\), got \(3,\)"),
        ({"controls": np.zeros((2, 3, 6)), "articulations": ["leg"]}, "no body named 'leg'"),
        ({"controls": np.zeros((2, 3, 6)), "threads": 0}, "threads is 0"),
    ],
)
def test_wrong_plans_are_refused(arm_world, arguments, words):
    with pytest.raises(tumble.TumbleError, match=words):
        arm_world.rollout(**arguments)


def test_a_fork_that_fails_says_which(arm_world):
    tau = controls(arm_world, 4, 3)
    tau[2, 1, 0] = 1e300
    with pytest.raises(tumble.StepError, match=r"fork 2, frame 1: 'arm' at t = "):
        arm_world.rollout(tau)
