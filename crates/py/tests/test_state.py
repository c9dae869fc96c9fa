"""`world.state` is the world's own memory: nothing is copied until bodies come or go, and old views stay valid on the old memory."""

import gc
import threading
import time

import numpy as np
import pytest

import tumble

METHODS = [
    ("time_stepping", "verlet"),
    ("time_stepping", "rk4"),
    ("backtracking", "verlet"),
    ("backtracking", "rk4"),
    ("backtracking", "dormand_prince"),
]


def address(array):
    return array.__array_interface__["data"][0]


def thrown(**words):
    world = tumble.World(**words)
    world.add_static("ground", tumble.HalfSpace())
    ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=2.0, position=(0, 0, 0.5), velocity=(1, 0, 0))
    return world, ball


@pytest.mark.parametrize("scene", ["stack", "chain", "piston", "skeleton", "robot", "billiards"])
@pytest.mark.parametrize("stepper, integrator", METHODS)
def test_steps_write_where_the_view_looks(scene, stepper, integrator):
    world = tumble.World.load(scene, stepper=stepper, integrator=integrator)
    other = world.fork()
    state = world.state
    place = address(state)
    for _ in range(5):
        world.step()
        other.step()
        assert address(world.state) == place and (state == other.state.copy()).all()
    assert world.save() == other.save()


def test_nothing_moves_it_but_bodies_that_come_or_go():
    world, ball = thrown()
    state, saved = world.state, world.save()
    place = address(state)
    ball.position = (1, 2, 3)
    assert (state[13:16] == [1, 2, 3]).all()
    ball.apply_impulse((0, 0, 2.0))
    assert state[13 + 9] == 2.0  # momentum along z: it is a flat view of the numbers
    world.restore(saved)
    assert state[15] == 0.5
    x = state.copy()
    x[13] = 7.0
    world.state = x
    world.dt, world.gravity = 0.01, (0, 0, -1)
    applied = world.save()
    ball.apply_force((1e308, 0, 0))
    ball.apply_force((1e308, 0, 0))
    with pytest.raises(tumble.StepError):
        world.step()
    assert state[13] == 7.0
    world.restore(applied)
    assert state[13] == 7.0
    world.add_force("none", type("None_", (tumble.Force,), {"apply": lambda self, view: None})())
    world.remove("none")
    assert address(world.state) == place == address(state)
    with pytest.raises(ValueError, match="already in the world"):
        world.add_rigid("ball", tumble.Sphere(1.0), mass=1.0)
    world.step()
    assert address(world.state) == place


def test_old_views_stay_on_the_old_memory():
    world, _ = thrown()
    first = world.state
    world.step(3)
    shown = first.copy()
    other = world.add_rigid("other", tumble.Sphere(0.1), mass=1.0, position=(5, 5, 5))
    second = world.state
    assert not np.shares_memory(first, second) and (second[:26] == first).all()
    world.step(5)
    assert (first == shown).all() and not (second[:26] == first).all()
    world.remove(other)
    kept = second.copy()
    third = world.state
    world.step(5)
    assert (first == shown).all() and (second == kept).all() and third.shape == (26,)
    del world, _
    gc.collect()
    filler = [np.full(26, 7.0) for _ in range(2000)]  # would write over memory that had been given back
    assert (first == shown).all() and (second == kept).all() and third[13] > shown[13] and filler


def test_a_world_without_bodies_has_an_empty_state():
    world = tumble.World()
    state = world.state
    world.step()
    world.add_rigid("ball", tumble.Sphere(0.1), mass=1.0)
    world.step()
    assert state.shape == (0,) and world.state.shape == (13,)
    world.remove("ball")
    world.step()
    assert world.state.shape == (0,)


def test_a_view_cannot_be_made_to_be_written():
    world, _ = thrown()
    state = world.state
    for change in (lambda: state.__setitem__(0, 1.0), lambda: state.setflags(write=True), lambda: state.sort(), lambda: state.fill(0)):
        with pytest.raises(ValueError, match="read-only|WRITEABLE"):
            change()
    with pytest.raises(ValueError, match="WRITEABLE"):
        state.base.setflags(write=True)
    state.shape = (2, 13)
    assert world.state.shape == (26,)


def test_a_callback_sees_the_state_before_the_step():
    world, _ = thrown()
    state, seen = world.state, []

    class Looks(tumble.Force):
        def apply(self, view):
            seen.append(state.copy())

    world.add_force("looks", Looks())
    before = state.copy()
    world.step(2)
    assert len(seen) == 2 and all((one == before).all() for one in seen)
    assert not (state == before).all() and (state == world.state).all() and address(state) == address(world.state)


def test_other_threads_have_their_turn_while_a_view_is_held():
    world = tumble.World.load("stack")
    state, counted, done = world.state, [0], threading.Event()

    def count():
        while not done.is_set():
            counted[0] += 1
            time.sleep(0)

    counter = threading.Thread(target=count)
    counter.start()
    during = 0
    for _ in range(500):  # at most; some tens are enough on a machine that is not busy
        before = counted[0]
        world.step(20)
        during += counted[0] - before
        if during > 3:
            break
    done.set()
    counter.join(timeout=60)
    assert during > 3 and state.shape == world.state.shape


def test_setting_the_state_of_many_bodies_is_all_or_nothing():
    world = tumble.World(gravity=(0, 0, 0))
    for k in range(300):
        world.add_rigid(f"ball{k}", tumble.Sphere(0.1), mass=1.0, position=(k, 0, 0))
    x = world.state.copy()
    x.reshape(300, 13)[:, 1] = np.arange(300)
    world.state = x
    assert (world.state == x).all() and (world["ball299"].position == [299, 299, 0]).all()
    wrong = x.copy()
    wrong[0], wrong[299 * 13 + 3 : 299 * 13 + 7] = 9.0, 0.0
    with pytest.raises(ValueError, match="ball299"):
        world.state = wrong
    assert (world.state == x).all()
