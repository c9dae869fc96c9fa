"""Articulated bodies made in code: the double pendulum by its textbook equations, the same robot by a file, copies, errors."""

import copy
import pickle

import numpy as np
import pytest

import tumble


def double_pendulum(lengths=(0.7, 1.1), masses=(1.5, 0.8), **words):
    builder = tumble.ArticulationBuilder("pendulum")
    builder.add_link("upper", axis=(0, 1, 0), mass=masses[0], center_of_mass=(0, 0, -lengths[0]), **words)
    builder.add_link("lower", "upper", axis=(0, 1, 0), position=(0, 0, -lengths[0]), mass=masses[1], center_of_mass=(0, 0, -lengths[1]), **words)
    return builder


def test_a_double_pendulum_accelerates_as_lagrange_says():
    (l1, l2), (m1, m2), g = (0.7, 1.1), (1.5, 0.8), 9.81
    pendulum = double_pendulum().build()
    assert pendulum.joint_names == pendulum.link_names == ["upper", "lower"] and pendulum.mass == m1 + m2
    rng = np.random.default_rng(3)
    q, qd, tau = (rng.uniform(-2, 2, (200, 2)) for _ in range(3))
    got = pendulum.forward_dynamics(q, qd, tau)
    for (a, b), (va, vb), torque, qdd in zip(q, qd, tau, got, strict=True):
        # angles of the textbook are against the vertical: φ1 = a, φ2 = a + b
        c, s = np.cos(b), np.sin(b)
        mass = np.array([[m1 * l1**2 + m2 * (l1**2 + l2**2 + 2 * l1 * l2 * c), m2 * (l2**2 + l1 * l2 * c)], [m2 * (l2**2 + l1 * l2 * c), m2 * l2**2]])
        coriolis = m2 * l1 * l2 * s * np.array([-vb * (2 * va + vb), va**2])
        weight = g * np.array([(m1 + m2) * l1 * np.sin(a) + m2 * l2 * np.sin(a + b), m2 * l2 * np.sin(a + b)])
        assert qdd == pytest.approx(np.linalg.solve(mass, torque - coriolis - weight), abs=1e-9)


SCENE = """
[[articulated]]
name = "arm"
position_m = [0, 0, 2]
[[articulated.link]]
name = "upper"
joint = "revolute"
axis = [0, 1, 0]
limits_rad = [-0.3, 2]
damping_n_m_s_per_rad = 0.2
friction_n_m = 0.1
armature_kg_m2 = 0.05
spring = { stiffness_n_m_per_rad = 3, rest_rad = 0.5 }
shape = { type = "capsule", radius_m = 0.05, length_m = 0.8, position_m = [0, 0, -0.5] }
mass_kg = 2
friction = 0.7
[[articulated.link]]
name = "lower"
parent = "upper"
position_m = [0, 0, -1]
joint = "prismatic"
axis = [0, 0, 1]
displacement_m = 0.1
rate_m_per_s = 0.2
armature_kg = 0.3
drive = { type = "position", stiffness_n_per_m = 500, damping_n_s_per_m = 20, target_m = 0.2, max_force_n = 40 }
shapes = [ { type = "box", size_m = [0.1, 0.1, 0.3] }, { type = "sphere", radius_m = 0.1, position_m = [0, 0, -0.2] } ]
density_kg_per_m3 = 500
"""


def arm():
    builder = tumble.ArticulationBuilder("arm")
    builder.add_link(
        "upper", axis=(0, 1, 0), limits=(-0.3, 2), joint_damping=0.2, joint_friction=0.1, armature=0.05, stiffness=3, rest=0.5,
        shape=tumble.Capsule(0.05, 0.8), shape_position=(0, 0, -0.5), mass=2, friction=0.7,
    )
    builder.add_link(
        "lower", "upper", joint="prismatic", armature=0.3, position=(0, 0, -1), q=0.1, qd=0.2, shape=tumble.Box((0.1, 0.1, 0.3)), density=500,
        drive={"target": 0.2, "stiffness": 500, "damping": 20, "max_force": 40},
    )
    builder.add_shape("lower", tumble.Sphere(0.1), (0, 0, -0.2))
    return builder


def test_it_is_the_body_of_a_scene_file():
    file, code = tumble.World.parse(SCENE + "[world]\ndt_s = 0.005\n"), tumble.World(dt=0.005)
    ours = code.add_articulation(arm(), base=(0, 0, 2))
    theirs = file.articulation("arm")
    assert ours.mass == theirs.mass and ours.name == "arm"
    for world in (file, code):
        world.add_static("ground", tumble.HalfSpace())
        world.add_rigid("ball", tumble.Sphere(0.2), density=300, position=(0.05, 0, 0.2))
    for _ in range(400):
        file.step()
        code.step()
    assert len(code.contacts) > 0
    # the mass of the upper link is rounded in another order
    assert ours.q == pytest.approx(theirs.q, abs=1e-9) and ours.qd == pytest.approx(theirs.qd, abs=1e-9) and abs(ours.q).max() > 0.1


def test_armature_is_on_the_diagonal_of_the_mass_matrix():
    def matrix(armature):
        builder = tumble.ArticulationBuilder("arm")
        builder.add_link("upper", axis=(0, 1, 0), shape=tumble.Sphere(0.1), shape_position=(0, 0, -1), mass=2, armature=armature[0])
        builder.add_link("lower", "upper", joint="prismatic", position=(0, 0, -1), shape=tumble.Sphere(0.1), mass=1, armature=armature[1])
        builder.add_link("hand", "lower", joint="spherical", position=(0, 0, -1), shape=tumble.Sphere(0.1), mass=1, armature=armature[2])
        return builder.build().mass_matrix()

    assert matrix((0.5, 3, 0.2)) - matrix((0, 0, 0)) == pytest.approx(np.diag([0.5, 3, 0.2, 0.2, 0.2]), abs=1e-12)
    for wrong in ((-1, 0, 0), (0, 0, -1)):
        with pytest.raises(tumble.TumbleError, match="armature"):
            matrix(wrong)


def test_copies_of_a_description_and_of_its_world():
    description = arm().build()
    description.q = (0.4, 0.2)
    for other in (pickle.loads(pickle.dumps(description)), copy.deepcopy(description)):
        assert (other.q == description.q).all() and other.joint_names == description.joint_names
        assert (other.mass_matrix() == description.mass_matrix()).all() and (other.limits == description.limits).all()
    world = tumble.World()
    world.add_articulation(pickle.loads(pickle.dumps(description)), name="one")
    world.add_articulation(description, base=(3, 0, 0), name="two")
    copies = [world.fork(), pickle.loads(pickle.dumps(world))]
    for each in (world, *copies):
        each.step(100)
    assert all(other.save() == world.save() for other in copies)
    assert (world["one"].q == world["two"].q).all()


def test_a_floating_root_falls_and_a_coupled_joint_follows():
    builder = tumble.ArticulationBuilder("robot", self_collision=False)
    builder.add_link("trunk", joint="floating", position=(0, 0, 1), shape=tumble.Box(0.3), mass=5)
    for name, side in (("left", 1), ("right", -1)):
        builder.add_link(name, "trunk", axis=(0, 1, 0), position=(0, 0.2 * side, 0), shape=tumble.Sphere(0.05), shape_position=(0, 0, -0.2), mass=1)
    builder.mimic("left", "right", -1, 0)
    builder.exclude_collisions("left", "right")
    world = tumble.World()
    robot = world.add_articulation(builder, base=(1, 0, 2))
    assert robot.q[:3] == pytest.approx([1, 0, 3])
    robot.apply_impulse("right", (0.5, 0, 0))
    world.step(120)
    assert robot.center_of_mass()[2] == pytest.approx(3 - 0.2 * 2 / 7 - 0.5 * 9.81 * 0.25, abs=1e-6)
    left, right = robot.q[7:]
    assert abs(right) > 0.01 and left == pytest.approx(-right, abs=1e-8)


def test_what_is_wrong_is_named():
    builder = double_pendulum()
    for words, wrong in [
        (dict(name="upper"), "there is a link named 'upper' already"),
        (dict(name="x", parent="uper"), "no link named 'uper'; there are upper, lower"),
        (dict(name="x", joint="hinge"), "joint: `hinge` is not known"),
        (dict(name="x", mass=1, density=2), "a mass or a density"),
        (dict(name="x", inertia=(1, 1, 1)), "need a mass"),
        (dict(name="x", drive={"stifness": 1}), "`stifness` is not known"),
        (dict(name="x", limits=(1, 2, 3)), r"expected \(lower, upper\)"),
        (dict(name="x", axis=(1, np.nan, 0)), "finite"),
    ]:
        with pytest.raises(tumble.TumbleError, match=wrong):
            builder.add_link(**words)
    assert builder.build().dof == 2, "a wrong link is not added"
    builder.add_link("x", mass=-1, center_of_mass=(0, 0, 0))
    with pytest.raises(tumble.InvalidValueError, match="link 'x': mass is -1"):
        builder.build()
    with pytest.raises(tumble.UnknownNameError, match="there are none yet"):
        tumble.ArticulationBuilder().add_shape("x", tumble.Sphere(1))
    with pytest.raises(tumble.InvalidValueError, match="no link"):
        tumble.World().add_articulation(tumble.ArticulationBuilder())
    assert repr(double_pendulum()) == """<tumble.ArticulationBuilder ["upper", "lower"]>"""
