"""Handles of links: their motion, and wherever a link is meant."""

import numpy as np
import pytest

import tumble


def arm():
    """An arm of two links in a world, and a tool that is fixed to the second."""
    world = tumble.World(gravity=(0, 0, 0))
    builder = tumble.ArticulationBuilder("arm")
    builder.add_link("upper", joint="revolute", axis=(0, 1, 0), shape=tumble.Capsule(0.05, 0.4), mass=1)
    builder.add_link("lower", "upper", joint="revolute", axis=(0, 1, 0), position=(0.5, 0, 0), shape=tumble.Box((0.3, 0.1, 0.1)), mass=1)
    builder.add_link("tool", "lower", joint="fixed", position=(0.25, 0, 0), shape=tumble.Sphere(0.06), mass=0.2)
    return world, world.add_articulation(builder, (0, 0, 1))


def test_a_link_has_position_and_velocity():
    _, body = arm()
    q, w = np.array([0.3, 0.5]), np.array([0.7, -0.2])
    body.q, body.qd = q, w
    elbow = np.array([0.5 * np.cos(q[0]), 0, 1 - 0.5 * np.sin(q[0])])
    tool = elbow + 0.25 * np.array([np.cos(q.sum()), 0, -np.sin(q.sum())])
    spin = np.array([0, w.sum(), 0])
    velocity = np.cross([0, w[0], 0], elbow - [0, 0, 1]) + np.cross(spin, tool - elbow)
    link = body.link("tool")
    np.testing.assert_allclose(link.position, tool, atol=1e-14)
    np.testing.assert_allclose(link.velocity, velocity, atol=1e-14)
    np.testing.assert_allclose(link.angular_velocity, spin, atol=1e-15)
    np.testing.assert_allclose(np.r_[link.position, link.orientation], body.link_pose("tool"), atol=1e-14)


def test_a_handle_stands_for_a_link_everywhere():
    world, body = arm()
    lower, tool = body.link("lower"), body.link("tool")
    load = world.add_rigid("load", tumble.Sphere(0.05), mass=1, position=(1.0, 0, 1.0))
    world.add_joint("fixed", tool, load)
    touch = world.add_sensor("touch", tool)
    pose = world.add_sensor("position", lower, relative_to=tool)
    world.set_pair_material(lower, "load", friction=0.9)
    assert world.pair_material("arm/lower", load)[1] == 0.9
    world.step()
    np.testing.assert_allclose(pose.value, [-0.25, 0, 0], atol=1e-9)
    assert touch.value == 0
    assert load.position == pytest.approx(tool.position + (1.0 - 0.75, 0, 0), abs=1e-9)


def test_a_link_of_another_world_is_refused():
    world, _ = arm()
    _, other = arm()
    with pytest.raises(ValueError, match="another world"):
        world.add_joint("fixed", other.link("tool"), None, point=(0, 0, 1))
