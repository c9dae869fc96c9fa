"""Batches that are pickled: the same bits go on, and `reset` goes back to the same starts."""

import copy
import multiprocessing
import pickle

import numpy as np
import pytest

import tumble


class Push(tumble.Force):
    """A steady force along x."""

    def apply(self, view):
        view.force[:, 0] += 0.5

    def fork(self):
        return self


def again(value):
    return pickle.loads(pickle.dumps(value))


def model(root):
    world = tumble.World()
    world.add_static("floor", tumble.HalfSpace(offset=-0.2))
    world.add_articulation(root / "scenes" / "robot" / "arm.urdf", name="arm")
    world.add_rigid("ball", tumble.Sphere(0.1), mass=1.0, position=(0.5, 0, 0.3), restitution=0.3)
    return world


def vary(world, k):
    world.body("ball").mass = 1.0 + k
    world["arm"].q = np.full(6, 0.1 * k)


def same(one, other):
    for name in ("time", "state", "q", "v", "contact_forces", "contact_counts", "positions"):
        assert getattr(one, name).tobytes() == getattr(other, name).tobytes(), name
    assert (one.failed == other.failed).all()


@pytest.mark.parametrize("configure", [None, vary])
def test_it_goes_on_with_the_same_bits(root, configure):
    batch = tumble.Batch(model(root), 4, configure=configure, threads=2)
    rng = np.random.default_rng(0)
    batch.set_drives(stiffness=20, damping=2)
    batch.step(rng.normal(0, 5, (4, 6)), 150, targets=np.full(6, 0.2))
    assert batch.contact_counts.sum() > 0  # in the middle of contacts, whose forces start the next solve
    other = again(batch)
    assert len(other) == 4 and other.threads == 2 and other.dof == 6
    for _ in range(5):
        same(batch, other)
        controls = rng.normal(0, 5, (4, 6))
        batch.step(controls, 20)
        other.step(controls, 20)
    same(batch, other)
    mask = np.array([True, False, True, False])
    for each in (batch, other):
        each.reset(mask)
        each.step(np.zeros(6), 10)
    same(batch, other)
    assert [w.body("ball").mass for w in other.worlds] == [w.body("ball").mass for w in batch.worlds]


def test_efforts_and_starts_are_kept(root):
    world = model(root)
    world["arm"].tau = np.arange(6.0)  # a start with forces
    batch = tumble.Batch(world, 2)
    batch.step(np.ones(6), 30)
    other = copy.deepcopy(batch)
    for each in (batch, other):
        each.step()  # under the forces of the last step
    same(batch, other)
    for each in (batch, other):
        each.reset()
        each.step(substeps=20)  # under those of the start
    same(batch, other)
    world.step(20)
    assert other.state[1].tobytes() == world.state.tobytes()


def test_chosen_articulations_and_changed_worlds(root):
    world = tumble.World()
    for name in ("first", "second"):
        world.add_articulation(root / "scenes" / "robot" / "arm.urdf", name=name)
    batch = tumble.Batch(world, 3, articulations=["second"])
    batch.world(1)["second"].set_drive("elbow", target=0.5, stiffness=100, damping=5)
    batch.step(np.ones(6), 10)
    other = again(batch)
    batch.step(np.ones(6), 30)
    other.step(np.ones(6), 30)
    same(batch, other)
    assert other.dof == 6 and (other.q[0] != other.q[1]).any()
    one, within = pickle.loads(pickle.dumps((batch, batch.world(2))))
    within["first"].q = np.full(6, 0.25)
    assert (one.state[2] == within.state).all()  # still its own world


def test_forces_in_python_go_with_it():
    world = tumble.World(gravity=(0, 0, 0))
    world.add_rigid("ball", tumble.Sphere(0.1), mass=1.0)
    world.add_force("push", Push())
    batch = tumble.Batch(world, 2)
    batch.step(substeps=5)
    other = again(batch)
    for each in (batch, other):
        each.step(substeps=5)
    same(batch, other)
    assert other.velocities[0, 0, 0] == pytest.approx(0.5 * 10 / 240)
    other.reset()
    assert (other.velocities == 0).all()


def advance(batch):
    batch.step(np.ones(6), 50)
    return batch


def test_another_process_steps_it(root):
    batch = tumble.Batch(model(root), 2)
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        there = pool.apply_async(advance, (batch,)).get(timeout=120)
    same(advance(batch), there)


def test_what_is_no_batch_is_refused(root):
    batch = tumble.Batch(model(root), 2)
    make, parts = batch.__reduce__()
    worlds, starts, driven, *rest = parts
    other = tumble.World()
    for bad in (([], starts, driven, *rest), (worlds, starts, [99], *rest), (worlds, [other], driven, *rest), (worlds, starts * 3, driven, *rest), ([worlds[0], other], starts, driven, *rest)):
        with pytest.raises(tumble.InvalidValueError):
            make(*bad)
