"""Couplings of joints, cones of links and color cameras from Python."""

import copy
import pickle

import numpy as np
import pytest

import tumble


def wheels(count=2):
    world = tumble.World(gravity=(0, 0, 0))
    bodies = [world.add_rigid(f"wheel {k}", tumble.Sphere(0.1), mass=1, inertia=np.full(3, 0.5), position=(k, 0, 0), collidable=False) for k in range(count)]
    return world, bodies, [world.add_joint("revolute", body, name=f"hinge {k}") for k, body in enumerate(bodies)]


def test_two_hinges_turn_in_their_ratio():
    world, bodies, hinges = wheels()
    mimic = world.add_mimic(hinges[1], "hinge 0", -2, name="m")
    assert (mimic.joint, mimic.of, mimic.multiplier, mimic.offset, mimic.name) == (hinges[1], hinges[0], -2, 0, "m")
    assert world.mimics == [mimic] and "Mimic 'm': -2" in repr(mimic)
    for _ in range(240):
        bodies[0].apply_torque((0, 0, 2.5))
        world.step()
    # α = τ/(I + 4·I)
    assert hinges[0].position == pytest.approx(0.5, abs=1e-9)
    assert hinges[1].position == pytest.approx(-1, abs=1e-9)
    assert mimic.force == pytest.approx(-1, abs=1e-7) and mimic.error == pytest.approx(0, abs=1e-9)
    mimic.multiplier, mimic.offset = 0.5, -2.0
    world.step(480)
    assert mimic.error == pytest.approx(0, abs=1e-7)
    mimic.enabled = False
    bodies[0].apply_torque((0, 0, 3))
    world.step(10)
    assert not mimic.enabled and mimic.force == 0
    world.remove(mimic)
    assert not mimic.exists and world.mimics == []
    with pytest.raises(tumble.RemovedError):
        _ = mimic.multiplier


def test_a_joint_of_an_articulation_follows_a_loop_joint_in_every_copy():
    world = tumble.World()
    builder = tumble.ArticulationBuilder("lift")
    builder.add_link("carriage", joint="prismatic", mass=3, center_of_mass=(0, 0, 0), inertia=(0.1, 0.1, 0.1))
    lift = world.add_articulation(builder.build())
    drum = world.add_rigid("drum", tumble.Sphere(0.1), mass=1, inertia=np.full(3, 0.02), position=(1, 0, 0), collidable=False)
    hinge = world.add_joint("revolute", drum, axis=(0, 1, 0))
    mimic = world.add_mimic((lift, "carriage"), hinge, 0.05)
    assert mimic.joint == (lift, "carriage") and mimic.of == hinge
    copies = [world.fork(), copy.deepcopy(world), pickle.loads(pickle.dumps(world))]
    world.step(240)
    alpha = -3 * 9.81 * 0.05 / (0.02 + 3 * 0.05**2)
    assert lift.q[0] == pytest.approx(0.5 * alpha * 0.05, abs=1e-9)
    for other in copies:
        other.step(240)
        assert other.save() == world.save() and other.mimics[0].multiplier == 0.05


def test_what_cannot_be_coupled_is_refused():
    world, bodies, hinges = wheels(4)
    with pytest.raises(ValueError, match="to itself"):
        world.add_mimic(hinges[0], hinges[0])
    with pytest.raises(ValueError, match="not 0"):
        world.add_mimic(hinges[0], hinges[1], 0)
    with pytest.raises(ValueError, match="ratio of whole numbers"):
        world.add_mimic(hinges[0], hinges[1], np.sqrt(2))
    ball = world.add_joint("spherical", bodies[2])
    with pytest.raises(ValueError, match="spherical"):
        world.add_mimic(ball, hinges[0])
    between = world.add_joint("prismatic", bodies[2], bodies[3])
    with pytest.raises(ValueError, match="3 dynamic objects"):
        world.add_mimic(hinges[0], between)
    with pytest.raises(ValueError, match="of: expected a link"):
        world.add_mimic(hinges[0], bodies[1])


def test_a_lamp_of_an_articulation_stays_in_its_cone():
    world = tumble.World()
    builder = tumble.ArticulationBuilder("lamp")
    builder.add_link("lamp", joint="spherical", mass=2, center_of_mass=(0, 0, -0.3), inertia=(0.02, 0.02, 0.02), cone=0.5)
    robot = builder.build()
    robot.qd = (3, 1, 0)
    lamp = world.add_articulation(robot)
    swings = []
    for _ in range(480):
        world.step()
        x, y, z, w = lamp.q
        swings.append(np.arccos(1 - 2 * (x * x + y * y)))
    assert max(swings) == pytest.approx(0.5, abs=1e-6)
    with pytest.raises(ValueError, match="axis x, y or z"):
        builder.add_link("other", joint="spherical", axis=(1, 1, 0), cone=0.5)
    arm = tumble.ArticulationBuilder()
    with pytest.raises(ValueError, match="cone"):
        arm.add_link("arm", mass=1, shape=tumble.Sphere(0.1), cone=0.5)
        arm.build()


def test_a_color_camera_of_a_copy_sees_what_events_have_colored():
    world = tumble.World()
    ball = world.add_static("ball", tumble.Sphere(0.5))
    ball.color = (0.2, 0.4, 0.8)
    world.add_event("paint", tumble.Trigger.time(0.01), [tumble.Action.recolor(ball, (1, 0, 0))])
    camera = world.add_sensor("color", name="eye", position=(0, 0, 2), orientation=(1, 0, 0, 0), resolution=(41, 31), vertical_fov=0.8)
    before, first = world.save(), camera.value.copy()
    world.step(10)
    image = camera.value.copy()
    assert (image[15, 20] == [255, 0, 0]).all() and (first[15, 20] != image[15, 20]).any()
    for other in (world.fork(), pickle.loads(pickle.dumps(world))):
        assert (other.sensors["eye"] == image).all()
    after = world.save()
    world.restore(before)
    assert (camera.value == first).all()
    world.restore(after)
    assert (camera.value == image).all()


def test_a_color_camera_sees_its_own_light():
    world = tumble.World()
    world.add_static("ball", tumble.Sphere(0.5)).color = (0.2, 0.4, 0.8)
    camera = world.add_sensor("color", name="eye", position=(0, 0, 2), orientation=(1, 0, 0, 0), resolution=(41, 31), vertical_fov=0.8)
    image = camera.value
    assert image.shape == (31, 41, 3) and image.dtype == np.uint8 and (image == world.sensors["eye"]).all()
    assert image[15, 20] == pytest.approx(np.array([0.2, 0.4, 0.8]) * 255, abs=1)
    assert (image[0, 0] == 0).all() and (image[15, 10] < image[15, 20]).all()
    noisy = world.add_sensor("color", deviation=5, position=(0, 0, 2), orientation=(1, 0, 0, 0), resolution=(41, 31), vertical_fov=0.8).value
    assert (noisy != image).any() and (noisy.astype(int) - image).std() < 5
