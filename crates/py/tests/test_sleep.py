"""Sleep: what lies still is left out of the steps, and what is done to it wakes it."""

import pytest
import tumble


def bed() -> tuple[tumble.World, tumble.RigidBody]:
    world = tumble.World(dt=1 / 60, sleep_after=0.5)
    world.add_static("ground", tumble.HalfSpace(), restitution=0)
    box = world.add_rigid("box", tumble.Box((0.2, 0.2, 0.2)), mass=1.0, position=(0, 0, 0.1), restitution=0)
    world.step(60)
    return world, box


def test_a_box_at_rest_sleeps_and_costs_no_contacts() -> None:
    world, box = bed()
    assert box.asleep and world.report.asleep == 1 and world.report.contacts == 0
    assert world.energy().kinetic == 0
    assert world.energy().potential == pytest.approx(9.81 * 0.1, rel=1e-6)


def test_a_push_wakes_it() -> None:
    world, box = bed()
    box.apply_impulse((0, 0, 2.0))
    assert not box.asleep
    world.step(6)
    assert box.velocity[2] == pytest.approx(2.0 - 9.81 * 0.1, rel=1e-9)


def test_nobody_sleeps_unless_asked_for() -> None:
    world = tumble.World()
    ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=1.0)
    world.gravity = (0, 0, 0)
    world.step(480)
    assert not ball.asleep


def test_a_checkpointed_sleeper_is_asleep_again() -> None:
    world, box = bed()
    saved = world.save()
    box.velocity = (1, 0, 0)
    assert not box.asleep
    world.restore(saved)
    assert box.asleep


@pytest.mark.parametrize("after", [0.0, -1.0, float("nan")])
def test_a_time_that_is_none_is_refused(after: float) -> None:
    with pytest.raises(ValueError, match="sleep"):
        tumble.World(sleep_after=after)
