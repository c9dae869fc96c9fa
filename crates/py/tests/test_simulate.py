"""The pure function: what a world does by itself, in this process and in another; chains; errors."""

import multiprocessing
import pickle

import numpy as np
import pytest

import tumble


@pytest.fixture
def world(root):
    world = tumble.World()
    world.add_static("floor", tumble.HalfSpace(offset=-1.0))
    world.add_articulation(root / "scenes" / "robot" / "arm.urdf", name="arm")
    world.add_rigid("ball", tumble.Sphere(0.1), mass=1.0, position=(2, 0, -0.88), restitution=0.3)
    world["arm"].set_drive("elbow", target=0.4, stiffness=50, damping=5)
    return world


TAU = np.random.default_rng(3).normal(0, 20, (12, 6))


def test_it_does_what_the_world_does(world):
    world.step(3)
    before = world.save()
    found = tumble.simulate(world.model(), None, TAU, every=4)
    assert world.save() == before
    for frame, tau in enumerate(TAU):
        world["arm"].tau = tau
        world.step()
        if frame % 4 == 3:
            row = {key: values[frame // 4] for key, values in found.items() if key != "snapshot"}
            assert row["time"] == world.time and row["contact_counts"] == len(world.contacts)
            assert (row["state"] == world.state).all() and (row["q"] == world["arm"].q).all() and (row["v"] == world["arm"].qd).all()
            for key in ("positions", "orientations", "velocities", "angular_velocities"):
                assert (row[key] == getattr(world, key)).all()
    assert found["snapshot"].tobytes() == world.save()


def test_two_calls_in_a_chain_are_one(world):
    model = world.model()
    whole, first = tumble.simulate(model, world.save(), TAU), tumble.simulate(model, None, TAU[:5])
    rest = tumble.simulate(model, first["snapshot"].tobytes(), TAU[5:])
    assert (np.concatenate([first["state"], rest["state"]]) == whole["state"]).all()
    assert rest["snapshot"].tobytes() == whole["snapshot"].tobytes()


def test_another_process_gives_the_same_bytes(world):
    jobs = [(world.model(), world.save(), TAU * k, 3) for k in range(3)]
    jobs = pickle.loads(pickle.dumps(jobs))
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        there = pool.starmap_async(tumble.simulate, jobs).get(timeout=120)
    for one, other in zip(there, [tumble.simulate(*job) for job in jobs], strict=True):
        assert one.keys() == other.keys()
        assert all(one[key].tobytes() == other[key].tobytes() for key in one)


def test_a_world_without_articulations():
    world = tumble.World.load("stack")
    found = tumble.simulate(world.model(), None, np.zeros((4, 0)))
    world.step(4)
    assert (found["state"][-1] == world.state).all() and found["q"].shape == (4, 0)


class Wind(tumble.Force):
    def apply(self, view):
        pass

    def fork(self):
        return self


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        ({"controls": np.zeros(6)}, ValueError, r"controls: expected shape \(steps, 6\), got \(6,\)"),
        ({"controls": np.zeros((2, 5))}, ValueError, r"controls: expected shape \(steps, 6\), got \(2, 5\)"),
        ({"every": 5}, ValueError, "every is 5; it must divide the 12 steps"),
        ({"every": 0}, ValueError, "every is 0"),
        ({"model": b"nothing"}, tumble.SnapshotError, "."),
        ({"snapshot": b"nothing"}, tumble.SnapshotError, "."),
        ({"controls": np.full((1, 6), 1e300)}, tumble.StepError, "'arm' at t = "),
    ],
)
def test_wrong_arguments_are_refused(world, change, error, words):
    with pytest.raises(error, match=words):
        tumble.simulate(**{"model": world.model(), "snapshot": None, "controls": TAU} | change)


def test_a_world_with_forces_in_python_has_no_model(world):
    world.add_force("wind", Wind())
    with pytest.raises(ValueError, match="pickle the world instead"):
        world.model()
    with pytest.raises(ValueError, match="has forces written in Python"):
        tumble.simulate(world.__reduce__()[1][0], None, TAU)
