"""Joints between bodies from Python and scene files: each kind's physics, forces, settings while running, breaking, copies, errors."""

import copy
import pickle

import numpy as np
import pytest

import tumble

POINT = {"shape": tumble.Sphere(0.1), "mass": 2, "inertia": np.full(3, 1e-6), "collidable": False}


def test_a_rope_holds_a_weight_and_a_distance_a_pendulum():
    world = tumble.World()
    ball = world.add_rigid("ball", **POINT)
    rope = world.add_joint("rope", ball, second_point=(0, 0, 0.5), length=1)
    assert (rope.kind, rope.length, rope.a, rope.b, rope.position) == ("rope", 1, ball, None, 0.5)
    world.step(480)
    assert ball.position == pytest.approx([0, 0, -0.5], abs=1e-6)
    assert rope.force == pytest.approx([0, 0, 2 * 9.81], abs=1e-6)
    rope.length = 1.2
    world.step(240)
    assert ball.position[2] == pytest.approx(-0.7, abs=1e-6)
    world.remove(rope)
    assert not rope.exists and world.joints == []
    with pytest.raises(tumble.RemovedError):
        _ = rope.length
    bar = world.add_joint("distance", "ball", second_point=(0, 0, 0), name="bar")
    assert bar.length == pytest.approx(0.7, abs=1e-6) and world.joint("bar") == bar and bar in {bar}
    ball.velocity = (0.01, 0, 0)
    # small swings: ω² = g/l
    omega = np.sqrt(9.81 / 0.7)
    for _ in range(240):
        world.step()
    assert ball.position[0] == pytest.approx(0.01 / omega * np.sin(omega), abs=2e-5)


def test_a_door_with_limits_a_drive_and_a_spring():
    world = tumble.World(gravity=(0, 0, 0))
    door = world.add_rigid("door", tumble.Box((0.8, 0.04, 2)), mass=12, position=(0.4, 0, 0))
    hinge = world.add_joint("revolute", door, None, (0, 0, 0), (0, 0, 1), (-1, 1.5), dict(target=1.2, stiffness=200, damping=60), name="hinge")
    world.step(960)
    assert hinge.position == pytest.approx(1.2, abs=1e-4) and hinge.limits == (-1, 1.5)
    hinge.set_drive(velocity=2, max_force=50)
    world.step(480)
    assert hinge.position == pytest.approx(1.5, abs=1e-6) and hinge.velocity == pytest.approx(0, abs=1e-6)
    hinge.set_drive()
    hinge.limits, hinge.stiffness, hinge.rest = None, 30, 0.5
    # inertia about the hinge of a plate
    inertia = 12 * (0.8**2 + 0.04**2) / 12 + 12 * 0.16
    world.step()
    start, omega = hinge.position, np.sqrt(30 / inertia)
    speed = hinge.velocity
    world.step(240)
    expected = 0.5 + (start - 0.5) * np.cos(omega) + speed / omega * np.sin(omega)
    assert hinge.position == pytest.approx(expected, abs=2e-3)
    assert hinge.error == pytest.approx((0, 0), abs=1e-7)
    hinge.damping, hinge.friction = 4, 0.1
    world.step(2400)
    assert abs(hinge.position - 0.5) * 30 <= 0.1 + 1e-9 and abs(hinge.velocity) < 1e-9


def test_a_joint_breaks_once_and_can_be_mended():
    for stepper in ("time_stepping", "backtracking"):
        world = tumble.World(stepper=stepper)
        ball = world.add_rigid("ball", **POINT)
        joint = world.add_joint("fixed", ball, breaking_force=25)
        broken = []
        for k in range(240):
            ball.apply_force((0, 0, -10 * world.time))  # 2 g + 10 t
            world.step()
            broken += [(k, event) for event in world.events if event.kind == "joint_broken"]
        [(k, event)] = broken
        assert event.a == joint and event.b is None and isinstance(event.a, tumble.Joint)
        assert k / 240 == pytest.approx((25 - 2 * 9.81) / 10, abs=2 / 240)
        assert not joint.enabled and ball.position[2] < 0 and (joint.force == 0).all()
        joint.enabled, joint.breaking_force = True, np.inf
        world.step(600)
        assert np.abs(ball.position).max() < 1e-6


def test_links_and_bodies_are_joined_and_copies_go_alike():
    world = tumble.World()
    arm = tumble.ArticulationBuilder("arm")
    rod = {"axis": (0, 1, 0), "shape": tumble.Capsule(0.03, 0.9), "shape_position": (0, 0, -0.5), "mass": 1}
    arm.add_link("upper", **rod)
    arm.add_link("lower", "upper", position=(0, 0, -1), **rod)
    arm = world.add_articulation(arm)
    load = world.add_rigid("load", tumble.Sphere(0.1), mass=1, position=(0, 0, -2.3))
    one = world.add_joint("spherical", "arm/lower", load, (0, 0, -2))
    two = world.add_joint("spring", (arm, "upper"), point=(0, 0, -1), second_point=(1, 0, -1), stiffness=50, damping=1, length=0.5)
    assert one.a == arm and one.b == load and two.b is None
    copies = [world.fork(), copy.deepcopy(world), pickle.loads(pickle.dumps(world))]
    for each in (world, *copies):
        each.step(200)
    assert all(other.save() == world.save() for other in copies)
    assert [joint.kind for joint in copies[2].joints] == ["spherical", "spring"]
    assert copies[2].joint(one.name).force == pytest.approx(one.force, abs=0)
    assert one.error[0] < 1e-7 and two.position < 1
    with pytest.raises(tumble.InvalidValueError, match='name a link of it: "arm/LINK"'):
        world.add_joint("fixed", arm)
    with pytest.raises(tumble.UnknownNameError, match="no link named 'hand'"):
        world.add_joint("fixed", "arm/hand")


SCENE = """
[world]
gravity_m_per_s2 = [0, 0, -9.81]
[[body]]
name = "a"
shape = { type = "sphere", radius_m = 0.1 }
mass_kg = 2
[[body]]
name = "b"
shape = { type = "sphere", radius_m = 0.1 }
mass_kg = 1
position_m = [1, 0, 0]
[[loop_joint]]
name = "hinge"
type = "revolute"
a = "a"
position_m = [0, 0, 0.5]
axis = [0, 1, 0]
limits_deg = [-30, 30]
damping_n_m_s_per_rad = 0.2
friction_n_m = 0.1
spring = { stiffness_n_m_per_rad = 2, rest_rad = 0.1 }
drive = { type = "velocity", target_rad_per_s = 0.3, max_torque_n_m = 0.5 }
breaking_force_n = 500
breaking_torque_n_m = 300
[[loop_joint]]
name = "spring"
type = "spring"
a = "a"
b = "b"
position_m = [0.1, 0, 0]
second_position_m = [0.9, 0, 0]
stiffness_n_per_m = 40
damping_n_s_per_m = 0.5
length_m = 0.6
[[loop_joint]]
name = "rope"
type = "rope"
a = "b"
position_m = [1, 0, 0]
second_position_m = [1, 0, 1]
length_m = 1.1
[[loop_joint]]
name = "slider"
type = "prismatic"
a = "b"
position_m = [1, 0, 0]
axis = [0, 0, 1]
limits_m = [-0.3, 0.2]
drive = { type = "position", stiffness_n_per_m = 30, damping_n_s_per_m = 3 }
"""


def test_the_words_of_scene_files():
    file, code = tumble.World.parse(SCENE), tumble.World()
    a = code.add_rigid("a", tumble.Sphere(0.1), mass=2)
    b = code.add_rigid("b", tumble.Sphere(0.1), mass=1, position=(1, 0, 0))
    code.add_joint(
        "revolute", a, None, (0, 0, 0.5), (0, 1, 0), np.radians((-30, 30)), dict(velocity=0.3, max_force=0.5), 500,
        name="hinge", damping=0.2, friction=0.1, stiffness=2, rest=0.1, breaking_torque=300,
    )
    code.add_joint("spring", a, b, (0.1, 0, 0), second_point=(0.9, 0, 0), stiffness=40, damping=0.5, length=0.6, name="spring")
    code.add_joint("rope", b, point=(1, 0, 0), second_point=(1, 0, 1), length=1.1, name="rope")
    code.add_joint("prismatic", b, point=(1, 0, 0), limits=(-0.3, 0.2), drive=dict(target=0, stiffness=30, damping=3), name="slider")
    for world in (file, code):
        world.step(500)
    assert file.save() == code.save()
    properties = ("kind", "limits", "damping", "friction", "stiffness", "rest", "breaking_force", "breaking_torque", "drive_force")
    for ours, theirs in zip(code.joints, file.joints, strict=True):
        assert [getattr(ours, name) for name in properties] == [getattr(theirs, name) for name in properties]
    for wrong, words in [
        (SCENE.replace("limits_m = [-0.3, 0.2]", "limits_rad = [-0.3, 0.2]"), "unknown key `limits_rad`"),
        (SCENE.replace("stiffness_n_per_m = 40\n", ""), "`stiffness_n_per_m`"),
        (SCENE.replace("second_position_m = [1, 0, 1]\n", ""), "`second_position_m`"),
        (SCENE.replace("breaking_force_n = 500", "breaking_force_n = -5"), "`breaking_force_n`"),
        (SCENE.replace('"rope"\na', '"cord"\na'), "cord"),
        (SCENE.replace("limits_deg = [-30, 30]", "limits_deg = [-300, 300]"), "at most 2π"),
    ]:
        with pytest.raises(tumble.SceneError, match=words):
            tumble.World.parse(wrong)


def test_kinds_of_joints_leave_their_motion_free():
    # a push and a torque along every axis, and which of the six motions of a body they cause
    free = {
        "fixed": "", "revolute": "C", "prismatic": "z", "spherical": "ABC", "cylindrical": "zC", "universal": "AC", "planar": "xyC",
    }
    for kind, motions in free.items():
        for k, motion in enumerate("xyzABC"):
            world = tumble.World(gravity=(0, 0, 0))
            body = world.add_rigid("body", tumble.Box(0.2), mass=1, inertia=(1, 1, 1))
            joint = world.add_joint(kind, body, second_axis=(1, 0, 0) if kind in ("universal", "planar") else None)
            for _ in range(24):
                push = np.eye(3)[k % 3]
                body.apply_force(push) if k < 3 else body.apply_torque(push)
                world.step()
            moved = np.concatenate([body.velocity, body.angular_velocity])
            assert moved == pytest.approx(0.1 * np.eye(6)[k] * (motion in motions), abs=1e-3), (kind, motion)
            assert np.abs(np.concatenate([joint.force, joint.torque])).max() == pytest.approx(float(motion not in motions), abs=2e-2)


def test_what_is_wrong_is_named():
    world, other = tumble.World(), tumble.World()
    ball = world.add_rigid("ball", **POINT)
    for words, wrong in [
        (dict(kind="hinge", a=ball), "kind: `hinge` is not known; there are fixed, revolute"),
        (dict(kind="fixed", a=None), "a body on one side"),
        (dict(kind="fixed", a=ball, b=ball), "joins a part to itself"),
        (dict(kind="rope", a=ball), "second_point: expected"),
        (dict(kind="universal", a=ball), "second_axis: expected"),
        (dict(kind="universal", a=ball, second_axis=(0, 0, 1)), "its two axes are parallel"),
        (dict(kind="revolute", a=ball, axis=(0, 0, 0)), "the axis has length 0"),
        (dict(kind="revolute", a=ball, limits=(1, 0)), "the lower limit is 1"),
        (dict(kind="fixed", a=ball, limits=(0, 1)), "a fixed joint has no limits"),
        (dict(kind="fixed", a=ball, length=1), "a fixed joint has no length"),
        (dict(kind="fixed", a=ball, breaking_force=-1), "the breaking force is -1"),
        (dict(kind="revolute", a=ball, drive=dict(speed=1)), "`speed` is not known"),
        (dict(kind="fixed", a="ball2"), "no body named 'ball2'"),
        (dict(kind="fixed", a=other.add_static("wall", tumble.HalfSpace())), "belongs to another world"),
        (dict(kind="fixed", a=ball, name="ball"), "ball"),
    ]:
        with pytest.raises(tumble.TumbleError, match=wrong):
            world.add_joint(**words)
        assert world.joints == []
    joint = world.add_joint("fixed", ball)
    with pytest.raises(tumble.InvalidValueError, match="a fixed joint, which has no position"):
        _ = joint.position
    with pytest.raises(tumble.InvalidValueError, match="a fixed joint has no limits"):
        joint.damping = 1
    world.remove(joint)
    joint = world.add_joint("planar", ball)
    with pytest.raises(tumble.InvalidValueError, match="a planar joint has no length"):
        joint.length = 1
    with pytest.raises(tumble.InvalidValueError, match="a planar joint has no cone"):
        world.add_joint("planar", ball, cone=1)
    with pytest.raises(tumble.InvalidValueError, match="there is no degree of freedom 3; a planar joint has 3"):
        world.add_joint("planar", ball, dofs=[{}, {}, {}, {}])
    with pytest.raises(tumble.InvalidValueError, match="`frictoin` is not known"):
        world.add_joint("planar", ball, dofs=[dict(frictoin=1)])
    with pytest.raises(tumble.InvalidValueError, match="the armature is -1"):
        joint.dofs[1].armature = -1
    with pytest.raises(tumble.InvalidValueError, match="at most 3π/2"):
        joint.dofs[2].limits = (-3, 3)
    with pytest.raises(tumble.UnknownNameError, match="no joint named 'ball'"):
        world.joint("ball")
    assert repr(joint) == f"<tumble.Joint '{joint.name}', planar>"


def test_every_degree_of_freedom_has_settings_of_its_own(tmp_path):
    world = tumble.World(gravity=(0, 0, 0))
    body = world.add_rigid("body", tumble.Box(0.2), mass=2, inertia=(0.5, 0.5, 0.5), collidable=False)
    dofs = [dict(limits=(-1, 0.5), damping=0.5), dict(stiffness=8, armature=3), dict(effort=2, drive=dict(velocity=9), max_velocity=3, friction=0)]
    table = world.add_joint("planar", body, dofs=dofs, name="table")
    x, y, turn = table.dofs
    assert (x, repr(y)) == (table.dofs[0], "<tumble.JointDof 1 of 'table'>") and len({x, y, turn, table.dofs[2]}) == 3
    body.velocity = (2, 0.4, 0)
    world.step(240)
    # y: ω² = 8/(2 + 3); the velocity is that of the body, which has 2 kg of the 5
    assert y.position == pytest.approx(0.4 / np.sqrt(8 / 5) * np.sin(np.sqrt(8 / 5)), abs=2e-4)
    assert x.position == pytest.approx(0.5, abs=1e-6) and turn.velocity == pytest.approx(3, abs=1e-9)
    assert turn.position == pytest.approx(3 - 0.5 * 9 / 4, abs=1e-2)
    assert world.energy().kinetic == pytest.approx(0.5 * 5 * y.velocity**2 + 0.5 * 0.5 * 9, rel=1e-9)
    turn.set_drive(velocity=0)
    world.step()
    assert turn.drive_force == pytest.approx(-2) and table.drive_force == 0
    turn.limits, x.rest, x.stiffness, y.effort = (-1, 3), 0.1, 4, 7
    names = ("limits", "damping", "friction", "stiffness", "rest", "max_velocity", "effort", "armature")
    world.save_scene(tmp_path / "table.toml")
    (tmp_path / "table.toml").write_text((tmp_path / "table.toml").read_text() + "# edited\n")
    others = (copy.deepcopy(world), pickle.loads(pickle.dumps(world)), tumble.World.load(tmp_path / "table.toml"))
    for other in others:
        for ours, theirs in zip(table.dofs, other.joint("table").dofs, strict=True):
            assert [getattr(ours, name) for name in names] == [getattr(theirs, name) for name in names]
        other.step(30)
        assert other.joint("table").dofs[2].velocity == pytest.approx(3 - 2 / 0.5 * 31 / 240, abs=1e-9)
    kept = world.save()
    turn.set_drive(velocity=1), y.set_drive(velocity=1)
    world.restore(kept)
    world.step(30)
    assert world.state == pytest.approx(others[0].state, abs=0)
    world.remove(table)
    with pytest.raises(tumble.RemovedError):
        _ = x.position


def test_armature_effort_and_twist_are_settings_of_joints():
    file = tumble.World.parse("""
[world]
gravity_m_per_s2 = [0, 0, 0]
[[body]]
name = "a"
shape = { type = "sphere", radius_m = 0.1 }
mass_kg = 2
angular_velocity_rad_per_s = [0, 0, 2]
[[loop_joint]]
name = "j"
type = "spherical"
a = "a"
position_m = [0, 0, 0]
twist_limits_rad = [-1, 0.5]
armature_kg_m2 = 0.1
effort_n_m = 0.02
drive = { type = "velocity", target_rad_per_s = 0 }
""")
    code = tumble.World(gravity=(0, 0, 0))
    a = code.add_rigid("a", tumble.Sphere(0.1), mass=2, angular_velocity=(0, 0, 2))
    j = code.add_joint("spherical", a, name="j", twist_limits=(-1, 0.5), armature=0.1, effort=0.02, drive=dict(velocity=0))
    assert (j.twist_limits, j.armature, j.effort, j.cone, j.limits) == ((-1, 0.5), 0.1, 0.02, None, None)
    speed = a.angular_velocity[2]
    code.step(24)
    assert speed - a.angular_velocity[2] == pytest.approx(0.02 / (0.4 * 2 * 0.01 + 0.1) * 0.1, abs=1e-9)
    code.step(100)
    assert 2 * np.arctan2(a.orientation[2], a.orientation[3]) == pytest.approx(0.5, abs=1e-6)
    file.step(124)
    assert file.save() == code.save()
    j.armature, j.effort, j.twist_limits = 0.2, 3, None
    j.set_drive(target=(0.3, -0.2, 0.1), stiffness=50, damping=8)
    code.step(1200)
    assert [dof.position for dof in j.dofs] == pytest.approx([0.3, -0.2, 0.1], abs=1e-6)
    j.set_drive(velocity=(0, 0, 1))
    code.step(240)
    assert a.angular_velocity == pytest.approx([0, 0, 1], abs=1e-9)
    with pytest.raises(tumble.InvalidValueError, match=r"target: expected a number, or shape \(3,\) with one for each degree of freedom, got \(2,\)"):
        j.set_drive(target=(1, 2), stiffness=1)
    assert [(dof.armature, dof.effort) for dof in j.dofs] == [(0.2, 3)] * 3 and j.twist_limits is None


def test_a_pulley_without_a_length_keeps_its_rope_taut():
    world = tumble.World()
    a, b = (world.add_rigid(name, **POINT, position=(x, 0, 0)) for name, x in (("a", 0), ("b", 1)))
    pulley = world.add_joint("pulley", a, b, ground=[(0, 0, 2), (1, 0, 3)])
    assert pulley.length == 5
    pulley.ratio = 2
    assert pulley.length == 8
    pulley.length = 8
    pulley.ratio = 1
    assert pulley.length == 8


TRANSMISSIONS = """
[[body]]
name = "a"
shape = { type = "sphere", radius_m = 0.1 }
mass_kg = 2
angular_velocity_rad_per_s = [0, 0, 1]
[[body]]
name = "b"
shape = { type = "sphere", radius_m = 0.1 }
mass_kg = 1
position_m = [1, 0, 0]
[[body]]
name = "c"
shape = { type = "sphere", radius_m = 0.1 }
mass_kg = 1
position_m = [2, 0, 0]
[[loop_joint]]
name = "gear"
type = "gear"
a = "a"
b = "b"
position_m = [0, 0, 0]
axis = [0, 0, 1]
second_axis = [0, 1, 1]
teeth = [20, -45]
[[loop_joint]]
name = "rack"
type = "rack"
a = "a"
b = "c"
position_m = [0, 0, 0]
axis = [0, 0, 1]
second_axis = [1, 0, 0]
radius_m = -0.3
[[loop_joint]]
name = "screw"
type = "screw"
a = "c"
position_m = [2, 0, 0]
axis = [1, 0, 0]
pitch_m = 0.4
limits_m = [-0.2, 0.1]
[[loop_joint]]
name = "pulley"
type = "pulley"
a = "b"
b = "c"
position_m = [1, 0, 0]
second_position_m = [2, 0, 0]
ground_position_m = [1, 0, 2]
second_ground_position_m = [2, 0, 3]
ratio = 2
length_m = 8.1
"""


def test_gears_racks_screws_and_pulleys():
    file, code = tumble.World.parse(TRANSMISSIONS), tumble.World()
    a = code.add_rigid("a", tumble.Sphere(0.1), mass=2, angular_velocity=(0, 0, 1))
    b = code.add_rigid("b", tumble.Sphere(0.1), mass=1, position=(1, 0, 0))
    c = code.add_rigid("c", tumble.Sphere(0.1), mass=1, position=(2, 0, 0))
    gear = code.add_joint("gear", a, b, (0, 0, 0), second_axis=(0, 1, 1), teeth=(20, -45), name="gear")
    rack = code.add_joint("rack", a, c, (0, 0, 0), second_axis=(1, 0, 0), radius=-0.3, name="rack")
    screw = code.add_joint("screw", c, None, (2, 0, 0), (1, 0, 0), (-0.2, 0.1), pitch=0.4, name="screw")
    pulley = code.add_joint("pulley", b, c, (1, 0, 0), second_point=(2, 0, 0), ground=[(1, 0, 2), (2, 0, 3)], ratio=2, length=8.1, name="pulley")
    for world in (file, code):
        world.step(300)
    # the file's axes are normalized twice
    assert file.state == pytest.approx(code.state, abs=1e-6) and abs(code.state).max() > 0.1
    assert (gear.teeth, rack.radius, screw.pitch, pulley.ratio, pulley.length) == ((20, -45), -0.3, 0.4, 2, 8.1)
    gear.teeth, rack.radius, screw.pitch, pulley.ratio = (1, 2), 0.5, -0.1, 1
    assert (gear.teeth, rack.radius, screw.pitch, pulley.ratio) == ((1, 2), 0.5, -0.1, 1)
    for joint, name, value, words in [
        (gear, "teeth", (0, 2), "the number of teeth of a is 0"),
        (gear, "pitch", 1, "a gear joint, and not a screw"),
        (rack, "radius", 0, "the radius is 0"),
        (pulley, "ratio", -1, "the ratio is -1"),
    ]:
        with pytest.raises(tumble.InvalidValueError, match=words):
            setattr(joint, name, value)
    for words, wrong in [
        (dict(kind="gear", b=b), "teeth: a gear needs it"),
        (dict(kind="gear", teeth=(1, 2)), "a gear joins two parts"),
        (dict(kind="rack", b=b, radius=1), "second_axis: a rack needs it"),
        (dict(kind="screw"), "pitch: a screw needs it"),
        (dict(kind="screw", pitch=0), "the pitch is 0"),
        (dict(kind="pulley", b=b), "ground: a pulley needs it"),
        (dict(kind="pulley", b=b, ground=(1, 2)), r"shape \(2, 3\), got \(2,\)"),
    ]:
        with pytest.raises(tumble.TumbleError, match=wrong):
            code.add_joint(a=a, **words)
    for wrong, words in [
        (TRANSMISSIONS.replace("teeth = [20, -45]", "teeth = [20, 4.5]"), "whole numbers"),
        (TRANSMISSIONS.replace("pitch_m = 0.4", "pitch_m = 0"), "other than 0"),
        (TRANSMISSIONS.replace("radius_m = -0.3\n", ""), "no `radius_m`"),
        (TRANSMISSIONS.replace('type = "screw"', 'type = "fixed"'), "unknown key"),
    ]:
        with pytest.raises(tumble.SceneError, match=words):
            tumble.World.parse(wrong)
