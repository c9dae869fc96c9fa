"""Velocity and effort limits, cones and resistance of spherical joints, forces of joints asleep, from Python and scene files."""

import copy
import pickle

import numpy as np
import pytest

import tumble

URDF = """<robot name="arm"><link name="base"/>
<link name="upper"><inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="elbow" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
<limit lower="-9" upper="9" effort="0.5" velocity="3"/></joint></robot>"""


@pytest.fixture
def urdf(tmp_path):
    path = tmp_path / "arm.urdf"
    path.write_text(URDF)
    return path


def test_the_effort_of_a_urdf_limits_drives_that_name_no_force(urdf):
    world = tumble.World(gravity=(0, 0, 0))
    arm = world.add_articulation(tumble.Articulation.from_urdf(urdf))
    assert arm.effort == pytest.approx([0.5]) and np.isinf(arm.max_velocity).all()
    arm.set_drive("elbow", velocity=100)
    world.step(24)
    # the torque of 0.5 N·m turns 0.1 kg·m²
    assert arm.qd[0] == pytest.approx(0.5 / 0.1 * world.time, rel=1e-9)
    arm.set_drive("elbow", velocity=100, max_force=2)
    before = arm.qd[0]
    world.step(24)
    assert arm.qd[0] - before == pytest.approx(2 / 0.1 * 24 / 240, rel=1e-9)
    arm.effort = 1.0
    arm.set_drive("elbow", velocity=0)
    before = arm.qd[0]
    world.step(12)
    assert before - arm.qd[0] == pytest.approx(1 / 0.1 * 12 / 240, rel=1e-9)
    with pytest.raises(ValueError, match="effort"):
        arm.effort = -1
    batch = tumble.Batch(world, 2)
    batch.set_drives(velocity=100.0)
    start = batch.v.copy()
    batch.step(substeps=12)
    assert (batch.v - start).ravel() == pytest.approx([1 / 0.1 * 12 / 240] * 2, rel=1e-9)


def test_velocity_limits_of_a_urdf_hold_if_asked(urdf, tmp_path):
    scene = tmp_path / "scene.toml"
    scene.write_text('[world]\ngravity_m_per_s2 = [0, 0, 0]\n[[articulated]]\nname = "arm"\nurdf = "arm.urdf"\nvelocity_limits = true\n')
    made = tumble.World(gravity=(0, 0, 0))
    description = tumble.Articulation.from_urdf(urdf, velocity_limits=True)
    made.add_articulation(pickle.loads(pickle.dumps(description)), name="arm")
    for number, world in enumerate((made, tumble.World.load(scene))):
        arm = world["arm"]
        assert arm.max_velocity == pytest.approx([3])
        for _ in range(48):
            arm.tau = [2.0]
            world.step()
            assert arm.qd[0] == pytest.approx(min(2 / 0.1 * world.time, 3), abs=1e-9)
        copied = copy.deepcopy(world)
        saved = tmp_path / f"saved_{number}.toml"
        copied.save_scene(saved)
        for other in (copied, pickle.loads(pickle.dumps(world)), world.fork(), tumble.World.load(saved)):
            assert (other["arm"].max_velocity == [3]).all() and (other["arm"].effort == [0.5]).all()
        arm.max_velocity = np.inf
        arm.tau = [2.0]
        world.step(12)
        assert arm.qd[0] > 3.5
        with pytest.raises(ValueError, match="velocity limit"):
            arm.max_velocity = [0.0]
        with pytest.raises(ValueError, match="shape"):
            arm.max_velocity = [1.0, 2.0]


def test_a_builder_sets_both_and_a_link_keeps_them():
    builder = tumble.ArticulationBuilder("wheel")
    builder.add_link("wheel", shape=tumble.Box((0.2, 0.2, 0.2)), mass=2, max_velocity=3, effort=0.5, drive={"velocity": -9})
    world = tumble.World(gravity=(0, 0, 0))
    wheel = world.add_articulation(builder)
    world.step(12)
    inertia = 2 * 0.2**2 / 6
    assert wheel.qd[0] == pytest.approx(-0.5 / inertia * world.time, rel=1e-9)
    world.step(120)
    assert wheel.qd[0] == pytest.approx(-3, abs=1e-9)


def test_a_cone_friction_and_a_velocity_limit_of_a_loop_joint(tmp_path):
    world = tumble.World()
    lamp = world.add_rigid("lamp", tumble.Sphere(0.1), mass=2, position=(0, 0, -0.5))
    arm = world.add_joint("spherical", lamp, point=(0, 0, 0), axis=(0, 0, -1), cone=0.4, friction=0.05, name="arm")
    assert (arm.cone, arm.friction, arm.max_velocity, arm.limits) == (0.4, 0.05, np.inf, None)
    lamp.velocity = (3, 0, 0)
    swings = []
    for _ in range(120):
        world.step()
        swings.append(arm.position)
    assert max(swings) == pytest.approx(0.4, abs=1e-4)
    world.save_scene(tmp_path / "lamp.toml")
    for other in (copy.deepcopy(world), tumble.World.load(tmp_path / "lamp.toml")):
        assert (other.joint("arm").cone, other.joint("arm").friction) == (0.4, 0.05)
        fork = world.fork()
        other.step(30)
        fork.step(30)
        assert (other.state == fork.state).all()
    # without a cone it swings through, and stops at the friction of 0.05 N·m
    arm.cone = None
    assert arm.cone is None
    arm.max_velocity = 0.5
    world.step(240)
    assert np.abs(lamp.angular_velocity).max() <= 0.5 + 1e-9
    with pytest.raises(ValueError, match="cone"):
        world.add_joint("revolute", lamp, point=(0, 0, 0), cone=0.4)
    with pytest.raises(ValueError, match="a spherical joint has a cone"):
        world.add_joint("spherical", lamp, point=(0, 0, 0), limits=(0, 1))


def test_a_scene_with_a_cone(tmp_path):
    scene = tmp_path / "scene.toml"
    text = """
[[body]]
name = "lamp"
shape = { type = "sphere", radius_m = 0.1 }
mass_kg = 2
position_m = [0, 0, -0.5]
velocity_m_per_s = [3, 0, 0]
[[loop_joint]]
name = "arm"
type = "spherical"
a = "lamp"
position_m = [0, 0, 0]
axis = [0, 0, -1]
cone_deg = 20
damping_n_m_s_per_rad = 0.1
max_velocity_rad_per_s = 50
"""
    scene.write_text(text)
    world = tumble.World.load(scene)
    arm = world.joint("arm")
    assert (arm.cone, arm.damping, arm.max_velocity) == (np.radians(20), 0.1, 50)
    scene.write_text(text.replace("cone_deg = 20", "cone_deg = -20"))
    with pytest.raises(tumble.SceneError, match="cone_deg.*from 0 to 180"):
        tumble.World.load(scene)


def test_a_joint_asleep_keeps_the_force_that_holds_its_body():
    world = tumble.World(sleep_after=0.5)
    lamp = world.add_rigid("lamp", tumble.Sphere(0.1), mass=2, position=(0, 0, 1))
    hook = world.add_joint("fixed", lamp)
    world.step(300)
    assert lamp.asleep and hook.force == pytest.approx([0, 0, 2 * 9.81], abs=1e-6)
    assert pickle.loads(pickle.dumps(world)).joints[0].force == pytest.approx([0, 0, 2 * 9.81], abs=1e-6)


def test_a_urdf_without_joints_is_a_table(tmp_path):
    path = tmp_path / "table.urdf"
    box = '<geometry><box size="1 1 0.1"/></geometry>'
    path.write_text(
        f'<robot name="table"><link name="top"><inertial><mass value="9"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
        f'<collision><origin xyz="0 0 0.7"/>{box}</collision><visual><origin xyz="0 0 0.7"/>{box}</visual></link>'
        f'<link name="leg"/><joint name="glue" type="fixed"><parent link="top"/><child link="leg"/></joint></robot>'
    )
    world = tumble.World()
    table = world.add_articulation(tumble.Articulation.from_urdf(path), base=(0, 0, 0.2))
    ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=1, position=(0.1, 0.2, 1.2))
    world.step(240)
    assert ball.position == pytest.approx([0.1, 0.2, 1.05], abs=1e-6) and ball in world.bodies
    assert (table.dof, table.q.shape, table.link_names) == (0, (0,), ["top", "leg"])
    assert world.positions[0] == pytest.approx([0, 0, 0.2], abs=1e-12) and world.cast_rays((0, 0, 3), (0, 0, -1))["body"].tolist() == [0]
    world.save_scene(tmp_path / "scene.toml")
    for other in (copy.deepcopy(world), pickle.loads(pickle.dumps(world)), tumble.World.load(tmp_path / "scene.toml")):
        fork = world.fork()
        other.step(60)
        fork.step(60)
        assert (other.state == fork.state).all()


def test_constants_of_joints_are_set_while_they_move():
    """A wheel of 0.1 kg·m²: free, braked by damping and by dry friction, swinging on a spring, stopped by a limit."""
    builder = tumble.ArticulationBuilder("wheel")
    builder.add_link("wheel", axis=(0, 0, 1), mass=1, center_of_mass=(0, 0, 0), inertia=(0.1, 0.1, 0.1), joint_damping=0.05, stiffness=2, rest=0.3)
    world = tumble.World(gravity=(0, 0, 0), dt=1 / 1000, stepper="backtracking", integrator="dormand_prince", integrator_tolerance=1e-10)
    wheel = world.add_articulation(builder)
    constants = wheel.joint_damping, wheel.joint_friction, wheel.stiffness, wheel.rest
    assert np.ravel(constants).tolist() == [0.05, 0, 2, 0.3]
    wheel.stiffness, wheel.rest, wheel.qd = 0, 0, [5]
    world.step(500)
    assert wheel.qd[0] == pytest.approx(5 * np.exp(-0.5 * 0.05 / 0.1), rel=1e-6)
    wheel.joint_damping, wheel.joint_friction, wheel.qd = 0, 0.2, [5]
    world.step(500)
    assert wheel.qd[0] == pytest.approx(5 - 0.5 * 0.2 / 0.1, rel=1e-6)
    wheel.joint_friction, wheel.stiffness, wheel.rest = 0, 40, 1.0
    wheel.q, wheel.qd = [1.2], [0]
    copies = [world.fork(), pickle.loads(pickle.dumps(world))]
    world.step(500)
    assert wheel.q[0] == pytest.approx(1.0 + 0.2 * np.cos(np.sqrt(40 / 0.1) * 0.5), abs=1e-5)
    for other in copies:
        other.step(500)
        assert (other.state == world.state).all()
    wheel.stiffness = 0
    wheel.limits = [(-np.inf, 1.5)]
    wheel.q, wheel.qd = [1.4], [3]
    world.step(200)
    assert wheel.q[0] == pytest.approx(1.5, abs=1e-5)
    wheel.limits = [(-np.inf, np.inf)]
    wheel.qd = [3]
    world.step(200)
    assert wheel.q[0] == pytest.approx(1.5 + 3 * 0.2, abs=1e-5)
    for name, value, words in [("limits", [(1, 0)], "limit"), ("limits", (0, 1), "shape"), ("joint_damping", -1, "damping"), ("stiffness", [1, 2], "shape")]:
        with pytest.raises(ValueError, match=words):
            setattr(wheel, name, value)
