"""Drives in ``World.save``: what the program set comes back, and without it what the body was added with."""

import copy
import pickle

import numpy as np
import pytest

import tumble


def machine():
    world = tumble.World(gravity=(0, 0, 0))
    builder = tumble.ArticulationBuilder("arm")
    rod = {"mass": 1, "center_of_mass": (0, 0, -0.5), "inertia": (0.1, 0.1, 0.1)}
    builder.add_link("upper", joint="revolute", axis=(0, 1, 0), drive={"velocity": 1}, **rod)
    builder.add_link("lower", "upper", joint="revolute", axis=(0, 1, 0), position=(0, 0, -1), **rod)
    arm = world.add_articulation(builder.build())
    wheel = world.add_rigid("wheel", tumble.Sphere(0.1), mass=1, position=(3, 0, 0), collidable=False)
    return world, arm, world.add_joint("revolute", wheel, name="axle")


def test_drives_that_the_program_set_are_saved_and_restored():
    world, arm, axle = machine()
    plain = world.save()
    arm.set_drive("lower", target=0.7, stiffness=50, damping=5, max_force=30)
    axle.set_drive(velocity=3, max_force=4)
    world.step(10)
    saved = world.save()
    assert len(saved) > len(plain) and b"tumbleD2" in saved and b"tumbleD2" not in plain
    world.step(100)
    expected = world.state.copy()
    # another program has set other drives meanwhile
    arm.set_drive("upper", target=-1, stiffness=10)
    arm.set_drive("lower")
    axle.set_drive(velocity=-9)
    world.step(7)
    world.restore(saved)
    world.step(100)
    assert (world.state == expected).all()
    for other in (world.fork(), copy.deepcopy(world), pickle.loads(pickle.dumps(world)), machine()[0]):
        other.restore(saved)
        other.step(100)
        assert (other.state == expected).all()
    # a snapshot from before has the drives with which the bodies were added, in a pickled copy too
    other = pickle.loads(pickle.dumps(world))
    assert other.save() == world.save()
    other.restore(plain)
    other.step(240)
    world.restore(plain)
    world.step(240)
    assert arm.qd[0] == pytest.approx(1, abs=1e-6) and axle.velocity == 0
    assert world.save() == other.save() and axle.drive_force == 0


def test_damaged_drives_change_nothing():
    world, arm, axle = machine()
    arm.set_drive("lower", velocity=2, max_force=3)
    saved, before = world.save(), world.save()
    place = saved.index(np.float64(3).tobytes(), len(saved) - 60)
    damaged = [
        saved[: place] + np.float64(-3).tobytes() + saved[place + 8 :],
        saved[: place] + np.float64(np.nan).tobytes() + saved[place + 8 :],
        saved[:-1],
        saved + b"x",
        saved.replace(b"tumbleD2", b"tumbleD3"),
        saved + b"tumbleD1",
    ]
    for bad in damaged:
        with pytest.raises(tumble.SnapshotError):
            world.restore(bad)
        assert world.save() == before
    with pytest.raises(tumble.SnapshotError):
        tumble.World().restore(saved)
