"""Measuring sensors in Python: closed forms, state, recordings, errors. The physics is tested in crates/core/tests/it/sensors.rs."""

import pickle

import numpy as np
import pytest

import tumble
from tumble.typing import SensorKind

G = 9.81


def pendulum():
    """A world with a rod on a hinge, a ball on a rope, and a noisy sensor of each kind of place."""
    world = tumble.World()
    builder = tumble.ArticulationBuilder("arm")
    builder.add_link("rod", None, joint="revolute", axis=(0, 1, 0), mass=1, center_of_mass=(0, 0, -0.5), inertia=(0.1, 0.1, 0.01))
    builder.add_link("tip", "rod", joint="fixed", position=(0, 0, -1))
    arm = world.add_articulation(builder.build())
    arm.q = [0.6]
    ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=2, position=(3, 0, 1))
    hook = world.add_joint("fixed", ball, name="hook", point=(3, 0, 1.5))
    world.add_sensor("position", "arm/tip", name="tip")
    world.add_sensor("velocimeter", (arm, "tip"), name="speed")
    world.add_sensor("joint_position", "arm/rod", name="angle")
    world.add_sensor("joint_velocity", (arm, "rod"), name="rate", deviation=0.1, bias_walk=0.01, delay=2, seed=9)
    world.add_sensor("force", hook, name="pull")
    world.add_sensor("torque", "hook", name="turn")
    return world


def test_links_and_joints_are_read_by_handle_and_by_name():
    world = pendulum()
    arm = world.articulation("arm")
    # read at the addition, before any step
    assert world.sensors["angle"][0] == 0.6
    np.testing.assert_allclose(world.sensors["tip"], [-np.sin(0.6), 0, -np.cos(0.6)], atol=1e-12)
    world.step(50)
    assert world.sensors["angle"][0] == arm.q[0]
    np.testing.assert_allclose(np.linalg.norm(world.sensors["speed"]), abs(arm.qd[0]), rtol=1e-12)
    np.testing.assert_allclose(world.sensors["pull"], [0, 0, 2 * G], atol=1e-7)
    np.testing.assert_allclose(world.sensors["turn"], [0, 0, 0], atol=1e-7)


def test_sensors_are_a_mapping_and_a_structured_record():
    world = pendulum()
    world.step()
    sensors = world.sensors
    assert list(sensors) == sensors.keys() == ["tip", "speed", "angle", "rate", "pull", "turn"]
    assert len(sensors) == 6 and "tip" in sensors and "arm" not in sensors and 3 not in sensors
    record = sensors.record()
    for name, value in sensors.items():
        np.testing.assert_array_equal(record[name], value)
    assert [len(value) for value in sensors.values()] == [3, 3, 1, 1, 3, 3]
    rate = sensors.handle("rate")
    assert (rate.name, rate.kind, rate.exists) == ("rate", "joint_velocity", True)
    with pytest.raises(tumble.UnknownNameError, match="no measuring sensor named 'arm'"):
        sensors["arm"]


def test_forks_pickles_and_snapshots_have_the_same_noise():
    world = pendulum()
    world.step(20)
    snapshot, fork, copy = world.save(), world.fork(), pickle.loads(pickle.dumps(world))

    def run(world):
        rates = []
        for _ in range(30):
            world.step()
            rates.append(world.sensors["rate"][0])
        return rates

    rates = run(world)
    assert run(fork) == rates and run(copy) == rates
    world.restore(snapshot)
    assert run(world) == rates
    world.restore(snapshot)
    world.sensors.handle("rate").seed(10)
    assert run(world) != rates


def test_a_batch_has_the_readings_of_its_worlds():
    world = pendulum()
    world.step(3)
    batch = tumble.Batch(world, 2)
    batch.world(1).sensors.handle("rate").seed(1)
    for _ in range(4):
        batch.step()
        world.step()
    for name, value in world.sensors.items():
        np.testing.assert_array_equal(batch.sensor(name)[0], value)
        assert (batch.sensor(name)[1] == value).all() == (name != "rate")
    with pytest.raises(tumble.UnknownNameError):
        batch.sensor("arm")


def test_recordings_have_readings_and_events(tmp_path):
    world = tumble.World()
    world.add_static("ground", tumble.HalfSpace())
    ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=2, position=(0, 0, 0.3))
    world.add_sensor("touch", ball, name="felt")
    expected, events = [], []
    with tumble.Recorder(tmp_path / "ball.mcap") as recorder:
        recorder.frame(world)
        expected.append(world.sensors["felt"])
        for k in range(120):
            if k == 60:
                world.add_sensor("velocimeter", ball, name="late")
            world.step()
            recorder.frame(world)
            expected.append(world.sensors["felt"])
            events += [(event.kind, event.a.name, event.b.name) for event in world.events]
    recording = tumble.read(tmp_path / "ball.mcap")
    np.testing.assert_array_equal(recording.sensors["felt"], expected)
    assert recording.sensors["late"].shape == (121, 3)
    assert np.isnan(recording.sensors["late"][:61]).all() and np.isfinite(recording.sensors["late"][61:]).all()
    assert [(event.kind, event.a, event.b) for frame in recording.events for event in frame] == events
    assert events[0] == ("contact_begin", "ground", "ball")
    # half a second, from rest to rest: the ground has given back what the weight gave
    assert abs(sum(event.impulse[2] for frame in recording.events for event in frame) + 2 * G * 0.5) < 1e-6


def test_what_cannot_be_read_is_an_error():
    world = pendulum()
    ball = world.body("ball")
    with pytest.raises(tumble.InvalidValueError, match="kind: `gyro` is not known"):
        world.add_sensor("gyro", ball)
    with pytest.raises(tumble.InvalidValueError, match="name a link of it"):
        world.add_sensor("gyroscope", "arm")
    with pytest.raises(tumble.UnknownNameError, match="no link named 'hand'"):
        world.add_sensor("gyroscope", ("arm", "hand"))
    with pytest.raises(tumble.InvalidValueError, match="a link of an articulated body that a joint moves"):
        world.add_sensor("force", ball)
    with pytest.raises(tumble.InvalidValueError, match="the standard deviation is -1"):
        world.add_sensor("gyroscope", ball, deviation=-1)
    with pytest.raises(tumble.InvalidValueError, match="volume"):
        world.add_sensor("gyroscope", ball, volume=tumble.Sphere(0.1))
    with pytest.raises(tumble.InvalidValueError, match="'tip' is already"):
        world.add_sensor("gyroscope", ball, name="tip")
    gyro = world.add_sensor("gyroscope", ball)
    other = tumble.World()
    with pytest.raises(tumble.InvalidValueError, match="another world"):
        other.remove(gyro)
    world.remove(ball)
    with pytest.raises(tumble.RemovedError):
        gyro.value.sum()
    assert not gyro.exists
    world.step()


def test_the_kinds_are_those_of_the_types():
    world = tumble.World()
    ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=1)
    assert len(SensorKind.__args__) == 19
    for kind in SensorKind.__args__:
        if kind not in ("force", "torque", "joint_position", "joint_velocity", "drive_force"):
            sensor = world.add_sensor(kind, ball, name=kind)
            assert sensor.kind == kind


def test_sensors_and_limits_that_cannot_be_are_refused_with_what_would_be_right():
    world = tumble.World()
    builder = tumble.ArticulationBuilder("arm")
    builder.add_link("stand", joint="fixed")
    builder.add_link("lift", "stand", joint="prismatic", axis=(0, 0, 1), mass=1, center_of_mass=(0, 0, 0), inertia=(1, 1, 1))
    builder.add_link("hand", "lift", joint="fixed", mass=1, center_of_mass=(0, 0, 0), inertia=(1, 1, 1))
    world.add_articulation(builder)
    for link in ("stand", "hand"):
        with pytest.raises(ValueError, match=f"on: expected a link that a revolute or prismatic joint .* got 'arm/{link}'"):
            world.add_sensor("joint_position", f"arm/{link}")
    with pytest.raises(ValueError, match="at a link of an articulated body that a joint moves, or at a loop joint"):
        world.add_sensor("force", "arm/stand")
    world.add_sensor("force", "arm/hand")
    x, y = (world.add_rigid(name, tumble.Sphere(0.1), mass=1, position=(at, 0, 0)) for name, at in (("x", 0), ("y", 1)))
    gear = world.add_joint("gear", x, y, (0, 0, 0), (0, 0, 1), teeth=(2, 3))
    with pytest.raises(ValueError, match="gear"):
        world.add_sensor("joint_position", gear)
    with pytest.raises(ValueError, match="gear"):
        world.add_joint("gear", x, y, (0, 0, 0), (0, 0, 1), teeth=(2, 3), drive={"velocity": 1})
    ends = {"point": (0, 0, 0), "second_point": (1, 0, 0)}
    with pytest.raises(ValueError, match="the lower limit of its length is 2; it must be at most the length of the joint"):
        world.add_joint("distance", x, y, **ends, limits=(2, 3))
    world.add_joint("distance", x, y, **ends, limits=(1, 3))
