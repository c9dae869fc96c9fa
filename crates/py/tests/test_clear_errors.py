"""Calls that have no effect, or another one than asked for, are errors that say what would be right."""

import numpy as np
import pytest

import tumble
from tumble import InvalidValueError, RemovedError, UnknownNameError

KINDS = ["fixed", "revolute", "prismatic", "spherical", "cylindrical", "universal", "planar", "distance", "rope", "spring", "gear", "rack", "screw", "pulley"]
TURNING = ["revolute", "prismatic", "cylindrical", "universal", "planar", "screw"]
LENGTHS = ["distance", "rope", "spring", "pulley"]
MOVING = [*TURNING, "spherical", *LENGTHS]
# each parameter of add_joint that not all kinds have: a value, and the kinds that take it
TAKEN = {
    "second_point": ((5, 0, 1), LENGTHS),
    "second_axis": ((1, 0, 0), ["universal", "planar", "spherical", "gear", "rack"]),
    "length": (7.0, LENGTHS),
    "teeth": ((1, 2), ["gear"]),
    "radius": (0.1, ["rack"]),
    "pitch": (0.1, ["screw"]),
    "ratio": (2.0, ["pulley"]),
    "ground": ([(0, 0, 3), (5, 0, 3)], ["pulley"]),
    "cone": (0.5, ["spherical"]),
    "twist_limits": ((-1, 1), ["spherical"]),
    "limits": ((0, 6), [kind for kind in MOVING if kind != "spherical"]),
    "drive": ({"velocity": 1, "max_force": 1}, MOVING),
    "stiffness": (2.0, MOVING),
    "rest": (0.25, MOVING),
    "damping": (0.1, MOVING),
    "friction": (0.1, MOVING),
    "max_velocity": (1.0, MOVING),
    "effort": (1.0, MOVING),
    "armature": (0.1, [*TURNING, "spherical"]),
    "dofs": ([{}], MOVING),
    "angle": (0.1, ["revolute"]),
}
NEEDED = {
    "universal": {"second_axis": (1, 0, 0)},
    "rack": {"second_axis": (1, 0, 0), "radius": 0.2},
    "gear": {"teeth": (3, 4)},
    "screw": {"pitch": 0.2},
    "pulley": {"ground": [(0, 0, 4), (5, 0, 4)]},
}


def pair():
    world = tumble.World(gravity=(0, 0, 0))
    ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=1, position=(0, 0, 1))
    wall = world.add_static("wall", tumble.Box((1, 1, 1)), position=(5, 0, 1))
    return world, ball, wall


@pytest.mark.parametrize("kind", KINDS)
def test_a_joint_takes_the_parameters_of_its_kind_alone(kind):
    for name, (value, kinds) in TAKEN.items():
        world, ball, wall = pair()
        given = {"point": (0, 0, 1), **NEEDED.get(kind, {}), name: value}
        if kind == "rope":
            given["length"] = 7.0
        if name == "limits":  # about the length that a distance keeps; an angle turns less
            given["limits"] = (0, 0.5) if kind in TURNING else (0, 6)
        if name == "angle":
            given["limits"] = (-3, 3)
            if kind not in TAKEN["limits"][1]:
                del given["limits"]
        if kind in kinds:
            assert world.add_joint(kind, ball, wall, **given).kind == kind, name
            continue
        with pytest.raises(InvalidValueError) as caught:
            world.add_joint(kind, ball, wall, name="j", **given)
        if (kind, name) == ("spherical", "limits"):
            assert "a spherical joint has a cone and twist_limits" in str(caught.value)
            continue
        says = str(caught.value)
        assert says.startswith(f"loop joint 'j': a {kind} joint has no {name}; kinds with it: "), says
        assert sorted(says.split("kinds with it: ")[1].split(", ")) == sorted(kinds), says
        assert len(world.joints) == 0


def test_a_rest_position_without_a_spring_is_kept_for_one():
    world, ball, _ = pair()
    joint = world.add_joint("prismatic", ball, rest=0.25)
    joint.stiffness = 40
    joint.damping = 8
    world.step(2400)
    assert joint.position == pytest.approx(0.25, abs=1e-6)


def test_only_kinematic_bodies_move_to_a_pose():
    world, ball, wall = pair()
    before = world.save()
    for body, mode in ((ball, "dynamic"), (wall, "static")):
        with pytest.raises(InvalidValueError, match=f"body '{body.name}' is {mode}, and move_to is for kinematic bodies: set `position`.*`kinematic=True`"):
            body.move_to((1, 0, 1))
    assert world.save() == before
    ball.mode = "kinematic"
    ball.move_to((1, 0, 1))
    world.step()
    assert ball.position == pytest.approx([1, 0, 1])


def test_static_bodies_take_no_velocity():
    world, ball, wall = pair()
    before = world.save()
    for name in ("velocity", "angular_velocity"):
        with pytest.raises(InvalidValueError, match="body 'wall' is static and has no velocity"):
            setattr(wall, name, (1, 0, 0))
    for name in ("velocities", "angular_velocities"):
        with pytest.raises(InvalidValueError, match="body 'wall' is static and has no velocity"):
            setattr(world, name, [(1, 2, 3), (1, 0, 0)])
    assert world.save() == before, "nothing is written on an error"
    wall.velocity = (0, 0, 0)
    world.velocities = [(1, 2, 3), (0, 0, 0)]
    assert ball.velocity == pytest.approx([1, 2, 3])


def test_arrays_of_all_bodies_cannot_be_written():
    world, ball, _ = pair()
    for name in ("positions", "orientations", "velocities", "angular_velocities"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(world, name)[0] = 0
        assert getattr(world, name).copy().flags.writeable
    world.positions = world.positions + [(0, 0, 1), (0, 0, 0)]
    assert ball.position == pytest.approx([0, 0, 2])


def attached():
    """A world with joints, couplings and sensors of a body, and one of each of other bodies."""
    world = tumble.World()
    a, b, c = (world.add_rigid(name, tumble.Sphere(0.1), mass=1, position=(x, 0, 1)) for x, name in enumerate("abc"))
    between = world.add_joint("revolute", a, b, name="between")
    world.add_joint("revolute", b, name="to world")
    world.add_joint("revolute", c, name="other")
    world.add_mimic("to world", "other", name="mimic")
    world.add_sensor("gyroscope", b, name="on body")
    world.add_sensor("joint_position", between, name="on joint")
    world.add_sensor("position", c, relative_to=b, name="against")
    world.add_sensor("velocimeter", c, name="stays")
    return world


@pytest.mark.parametrize("steps", [0, 20])
def test_a_world_is_saved_after_a_body_with_joints_and_sensors_was_removed(tmp_path, steps):
    world = attached()
    world.step(steps)
    gone = [world.joint("between"), world.joint("to world"), world.sensors.handle("on body"), world.sensors.handle("against")]
    world.remove("b")
    assert [joint.name for joint in world.joints] == ["other"]
    assert list(world.sensors) == ["stays"] and len(world.mimics) == 0
    for handle in gone:
        assert not handle.exists
        with pytest.raises(RemovedError, match="was removed from its world"):
            _ = handle.kind
    file = tmp_path / "now.toml"
    assert world.save_scene(file) == []
    read = tumble.World.load(file)
    assert read.save() == world.save(), "the same bits"
    # the text alone: the same objects
    file.write_text(file.read_text() + "\n")
    text = tumble.World.load(file)
    assert [body.name for body in text.bodies] == ["a", "c"] and list(text.sensors) == ["stays"]
    for other in (world, read):
        other.step(20)
    assert read.save() == world.save()


def test_flocks_and_fields_of_removed_bodies_are_saved(tmp_path):
    world = tumble.World()
    for x, name in enumerate("ab"):
        world.add_rigid(name, tumble.Sphere(0.1), mass=1, position=(x, 0, 1))
    flock = world.add_body_flock("flock")
    flock.add("a"), flock.add("b")
    world.add_field("wind", tumble.Field.wind((1, 0, 0)), targets=["a", "b"])
    for name, left in (("a", ["b"]), ("b", [])):
        world.remove(name)
        assert world.save_scene(tmp_path / "now.toml") == []
        read = tumble.World.load(tmp_path / "now.toml")
        assert read.save() == world.save() and [body.name for body in read.bodies] == left
        for other in (world, read):
            other.step(10)
        assert read.save() == world.save()


def test_a_coupling_names_joints():
    world, _, _ = pair()
    with pytest.raises(UnknownNameError, match="joint: the world has no joint named 'nope'; it has none that add_joint made; a joint of an artic"):
        world.add_mimic("nope", "neither")
    hinge = world.add_joint("revolute", "ball", name="hinge")
    with pytest.raises(UnknownNameError, match="of: the world has no joint named 'nope'; there are hinge; a joint of"):
        world.add_mimic(hinge, "nope")
    with pytest.raises(UnknownNameError, match="no joint named 'nope'; there are hinge"):
        world.joint("nope")
    with pytest.raises(InvalidValueError, match="expected a link that a revolute or prismatic joint .* got 'ball'"):
        world.add_mimic("ball", hinge)
    with pytest.raises(InvalidValueError, match="the new mimic couples a joint to itself"):
        world.add_mimic(hinge, hinge)


def test_no_error_has_an_empty_name():
    world, ball, wall = pair()
    calls = [
        lambda: world.add_sensor("gyroscope", ball, cutoff=-1),
        lambda: world.add_sensor("gyroscope", ball, resolution=(3, 3)),
        lambda: world.add_sensor("touch"),
        lambda: world.add_joint("revolute", ball, wall, limits=(1, -1)),
        lambda: world.add_joint("revolute", ball, ball),
        lambda: world.add_joint("revolute", ball, wall, pitch=1),
        lambda: setattr(world.add_joint("revolute", ball), "limits", (1, -1)),
        lambda: world.add_rigid(tumble.Sphere(0.1), mass=-1),
        lambda: world.add_rigid(tumble.Sphere(0.1), mass=1, density=1),
        lambda: world.add_static(tumble.Sphere(0.1), friction=-1),
        lambda: world.add_event("", tumble.Trigger.time(-1), []),
    ]
    for call in calls:
        with pytest.raises((InvalidValueError, TypeError)) as caught:
            call()
        assert "''" not in str(caught.value) and '""' not in str(caught.value), str(caught.value)


def test_none_is_no_number():
    world, ball, _ = pair()
    for name in ("velocity", "position", "angular_velocity"):
        for value in (None, (0, None, 0)):
            with pytest.raises(InvalidValueError, match=f"{name}: expected numbers, not .*None"):
                setattr(ball, name, value)
    with pytest.raises(InvalidValueError, match="velocity: number 1 is NaN; all must be finite"):
        ball.velocity = (0, float("nan"), 0)
    with pytest.raises(InvalidValueError, match="positions: expected numbers, not .*None"):
        world.positions = [(0, 0, None), (5, 0, 1)]


def test_parts_of_a_compound_count_from_1_in_all_errors():
    ball = tumble.Sphere(0.1)
    for wrong in (3, (tumble.HalfSpace(), (0, 0, 0))):
        with pytest.raises(InvalidValueError, match="part 1 of a compound"):
            tumble.Compound([wrong, (ball, (0, 0, 0))])
        with pytest.raises(InvalidValueError, match="part 2 of a compound"):
            tumble.Compound([(ball, (0, 0, 0)), wrong])


def test_a_range_of_heights_is_for_images(tmp_path):
    heights = np.zeros((3, 3))
    with pytest.raises(InvalidValueError, match="height_range: expected heights of a PNG, got an array"):
        tumble.HeightField(heights, size=(2, 2), height_range=(0, 1))
    text = tmp_path / "heights.txt"
    text.write_text("0 0 0\n0 1 0\n0 0 0\n")
    with pytest.raises(InvalidValueError, match="height_range: expected heights of a PNG, got .*heights.txt"):
        tumble.HeightField(text, size=(2, 2), height_range=(0, 1))
    tumble.HeightField(text, size=(2, 2))


@pytest.mark.parametrize(
    ("returned", "says"),
    [
        (True, "`contacts` returned True; expected a list of tuples (point, normal, gap), empty if nothing touches, or None"),
        (0.5, "`contacts` returned 0.5; expected a list of tuples"),
        ([True], "contact 0 is True; expected a tuple (point, normal, gap)"),
        ([((0, 0, 0), (0, 0, 1), "deep")], "gap of contact 0 is 'deep'; expected a number"),
        ([((0, 0, 0), (0, 0, 1), 0.0, -1)], "feature of contact 0 is -1; expected a whole number from 0"),
    ],
)
def test_an_intersection_test_says_what_it_must_return(returned, says):
    class Returns(tumble.Intersect):
        def contacts(self, own, other, margin):
            return returned

    world = tumble.World()
    world.add_static("ground", tumble.HalfSpace())
    world.add_rigid("ring", tumble.Sphere(0.2), mass=1, position=(0, 0, 0.15), intersect=Returns())
    before = world.save()
    with pytest.raises(InvalidValueError) as caught:
        world.step()
    assert str(caught.value).startswith("the intersection test of 'ring': ") and says in str(caught.value)
    assert world.save() == before


def test_a_recording_of_a_changed_world_asks_for_it(tmp_path):
    changed = tumble.World.load("pendulum")
    changed.add_rigid("more", tumble.Sphere(0.1), mass=1)
    made = tumble.World()
    made.add_rigid("ball", tumble.Sphere(0.1), mass=1)
    text = tumble.World.parse('[[body]]\nname = "a"\nshape = { type = "sphere", radius_m = 0.1 }\nmass_kg = 1\n')
    for name, world, error, says in [
        ("changed", changed, tumble.SnapshotError, "the recorded world had other objects than scenes/pendulum/scene.toml: pass a world"),
        ("made", made, InvalidValueError, "made by a program and not from a scene; pass a world with the same bodies as `world`"),
        ("text", text, tumble.MissingFileError, "or pass a world with the same bodies as `world`"),
    ]:
        with tumble.Recorder(tmp_path / f"{name}.mcap") as recorder:
            recorder.run(world, 8, every=4)
        recording = tumble.read(tmp_path / f"{name}.mcap")
        for show in (lambda: recording.video(tmp_path / "out.png", width=32, height=32), lambda: list(tumble.replay(tmp_path / f"{name}.mcap"))):
            with pytest.raises(error, match=says):
                show()
        assert len(list(tumble.replay(tmp_path / f"{name}.mcap", world.fork()))) == 3
