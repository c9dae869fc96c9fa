"""Flocks of rigid bodies, and the sound of a run."""

import pickle
import wave

import numpy as np
import pytest

import tumble


def school():
    world = tumble.World(dt=1 / 120)
    flock = world.add_body_flock("school", desired_speed=3, agility=6, bank_time=0.5)
    for k in range(6):
        name = f"fish {k}"
        fish = world.add_rigid(name, tumble.Box((0.4, 0.1, 0.2)), mass=1, gravity_scale=0, position=(k % 2, k // 2, 0), velocity=(1, 0.1 * k, 0))
        flock.add(fish)
    return world, flock


def test_bodies_of_a_flock_reach_their_speed_and_turn_along_it():
    world, flock = school()
    assert len(flock) == 6 and [body.name for body in flock.bodies][:2] == ["fish 0", "fish 1"]
    world.step(1200)
    velocities = np.array([body.velocity for body in flock.bodies])
    speeds = np.linalg.norm(velocities, axis=1)
    assert speeds == pytest.approx(3, abs=0.5)
    for body, velocity in zip(flock.bodies, velocities):
        x, y, z, w = body.orientation
        nose = np.array([1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)])
        assert nose @ velocity / np.linalg.norm(velocity) > 0.97
    assert flock.steering["agility"] == 6 and flock.steering["desired_speed"] == 3
    flock.steering = {"agility": 2.0, "up": (0, 1, 0), "max_force": 3.0}
    assert flock.steering["agility"] == 2 and flock.steering["max_force"] == 3 and flock.steering["up"][1] == 1
    with pytest.raises(tumble.InvalidValueError, match="agility"):
        flock.steering = {"agility": -1.0}
    with pytest.raises(tumble.UnknownNameError, match="no constant 'agilty'"):
        world.add_body_flock(agilty=3)
    assert world["school"] == flock
    flock.remove("fish 0")
    assert len(flock) == 5
    with pytest.raises(tumble.UnknownNameError, match="not in the flock"):
        flock.remove("fish 0")
    with pytest.raises(tumble.InvalidValueError, match="is in the flock"):
        flock.add("fish 1")
    world.step()


def test_a_copy_of_a_school_swims_on():
    world, _ = school()
    world.step(30)
    copies = [world.fork(), pickle.loads(pickle.dumps(world))]
    world.step(30)
    for copy in copies:
        copy.step(30)
        assert (copy.state == world.state).all()


def test_a_flock_steers_articulations_that_float():
    world = tumble.World.load("bird")
    flock = world["flock"]
    bird = flock.bodies[0]
    assert isinstance(bird, tumble.Articulation) and bird == world["bird"] and len(flock) == 5
    assert flock.steering["wind"].tolist() == [-10, 0, 0]
    flock.steering = {"wind": (-9, 1, 0)}
    assert flock.steering["wind"].tolist() == [-9, 1, 0]
    flock.remove(bird)
    assert all(isinstance(body, tumble.RigidBody) for body in flock.bodies)
    flock.add("bird")
    assert flock.bodies[-1] == bird and repr(flock) == "<tumble.BodyFlock 'flock': 5 bodies>"
    crane = tumble.ArticulationBuilder("crane")
    crane.add_link("jib", shape=tumble.Box((1, 0.1, 0.1)), mass=1)
    world.add_articulation(crane.build())
    with pytest.raises(tumble.InvalidValueError, match="whose first link floats"):
        flock.add("crane")
    world.step()


def test_handles_of_one_object_are_equal():
    world = tumble.World()
    flock = world.add_flock("flock")
    boid = flock.add("boid")
    cloth = world.add_cloth("cloth")
    sparks = world.add_particles("sparks")
    for handle in (flock, boid, cloth, sparks):
        other = world[handle.name]
        assert other == handle and hash(other) == hash(handle) and other is not handle and handle != world["flock" if handle is not flock else "cloth"]
        assert repr(handle).startswith(f"<tumble.{type(handle).__name__} '{handle.name}'")
    world.remove(cloth)
    assert not cloth.exists and repr(cloth) == "<tumble.SpringMesh 'cloth', removed>"
    assert repr(flock) == "<tumble.Flock 'flock': 1 boids>"


def dropped():
    world = tumble.World(dt=1 / 240)
    world.add_static("floor", tumble.HalfSpace())
    world.add_rigid("block", tumble.Box((0.3, 0.05, 0.05)), mass=0.5, position=(2, 0, 0.5))
    return world


def test_the_sound_of_a_run(tmp_path):
    sound = tumble.Soundtrack(dropped(), eye=(0, -3, 1), target=(0, 0, 1), materials={"block": "wood"})
    sound.run(240)
    samples = sound.samples()
    assert samples.shape[1] == 2 and samples.shape[0] >= 48000
    assert sound.impacts >= 1 and sound.left_out == 0
    fall, travel = np.sqrt(2 * (0.5 - 0.025) / 9.81), np.linalg.norm([2, 3, -1]) / 343
    first = np.flatnonzero(np.abs(samples).max(axis=1) > 1e-12)[0] / 48000
    assert first == pytest.approx(fall + travel, abs=1.5 / 240)
    left, right = (samples**2).sum(axis=0)
    assert right > 2 * left  # it falls at the right
    gain = sound.save(tmp_path / "run.wav")
    assert gain * np.abs(samples).max() == pytest.approx(np.sqrt(0.5))
    assert sound.save(tmp_path / "quiet.wav", gain_db=-40) == pytest.approx(0.01)
    with pytest.raises(tumble.InvalidValueError, match="a gain of 200 dB"):
        sound.save(tmp_path / "loud.wav", gain_db=200)
    with pytest.raises(tumble.InvalidValueError, match="ends in .wav"):
        sound.save(tmp_path / "run.mp3")
    with wave.open(str(tmp_path / "run.wav")) as file:
        assert (file.getnchannels(), file.getframerate(), file.getnframes()) == (2, 48000, len(samples))
    again = tumble.Soundtrack(dropped(), eye=(0, -3, 1), target=(0, 0, 1), materials={"block": "wood"})
    again.run(240)
    assert (again.samples() == samples).all()
    with pytest.raises(tumble.InvalidValueError, match="one of wood, rubber"):
        tumble.Soundtrack(dropped(), materials={"block": "cheese"})
