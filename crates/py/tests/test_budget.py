"""A budget bounds the work of a step."""

import pickle

import pytest
import tumble


def tower() -> tumble.World:
    world = tumble.World(budget=4000)
    world.add_static("ground", tumble.HalfSpace(), restitution=0)
    for i in range(40):
        velocity = (0.1 * (i % 3), 0.1 * (i % 5), 0)
        world.add_rigid(f"box {i}", tumble.Box((0.4, 0.4, 0.4)), mass=1.0, position=(0, 0, 0.4 * i + 0.2), velocity=velocity)
    return world


def test_the_work_of_a_step_is_within_the_budget() -> None:
    world = tower()
    assert world.budget == 4000
    for _ in range(20):
        world.step()
        assert 0 < world.report.relaxations <= 4000
    assert world.report.unconverged > 0
    world.budget = None
    world.step()
    assert world.budget is None and world.report.relaxations > 4000


def test_a_pickled_world_keeps_its_budget_and_its_future() -> None:
    world = tower()
    world.step(5)
    other = pickle.loads(pickle.dumps(world))
    assert other.budget == 4000
    world.step(5)
    other.step(5)
    assert (other.state == world.state).all()


def test_a_budget_of_nothing_is_an_error() -> None:
    with pytest.raises(ValueError, match="budget is 0; it must be above 0"):
        tumble.World(budget=0)
