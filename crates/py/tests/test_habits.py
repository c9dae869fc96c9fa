"""What people write by habit: all drives at once, letters of axes, three sizes, forces between two bodies, and messages for typing errors."""

import copy
import inspect
import pickle
import subprocess
import sys

import numpy as np
import pytest

import tumble
import tumble.distributed

G = 9.81


def arm(links=3, floating=False):
    """Rods in a row on hinges about y, without gravity."""
    world = tumble.World(gravity=(0, 0, 0))
    builder = tumble.ArticulationBuilder("arm")
    parent = None
    if floating:
        builder.add_link("base", joint="floating", shape=tumble.Sphere(0.1), mass=1)
        parent = "base"
    for k in range(links):
        builder.add_link(f"rod{k}", parent, axis="y", position=(0.3 if parent else 0, 0, 0), shape=tumble.Box(0.2, 0.05, 0.05), mass=1)
        parent = f"rod{k}"
    return world, world.add_articulation(builder)


# Drives


def test_all_drives_are_set_at_once():
    world, body = arm()
    target, stiffness = np.array([0.3, -0.4, 0.5]), np.array([400.0, 300.0, 200.0])
    body.set_drives(target=target, stiffness=stiffness, damping=60, max_force=[1e3, np.inf, 1e3])
    single, other = arm()
    for k in range(3):
        other.set_drive(f"rod{k}", target=target[k], stiffness=stiffness[k], damping=60, max_force=[1e3, np.inf, 1e3][k])
    world.step(2400)
    single.step(2400)
    assert (body.q == other.q).all()
    assert body.q == pytest.approx(target, abs=1e-6)
    # a target alone is that of the drives that are there
    body.set_drives(target=-target)
    world.step(2400)
    assert body.q == pytest.approx(-target, abs=1e-6)
    # zeros are no drive
    body.set_drives(stiffness=[100, 0, 0], damping=[10, 0, 0])
    with pytest.raises(tumble.InvalidValueError, match="target: degree of freedom 1 has no drive to a position yet"):
        body.set_drives(target=0.1)
    body.set_drives(velocity=[1.0, 0, 0])
    world.step(10)
    assert body.qd[0] == pytest.approx(1, abs=1e-9)


def test_a_number_for_all_drives_leaves_a_floating_base_free():
    world, body = arm(2, floating=True)
    body.set_drives(target=0.2, stiffness=100, damping=20)
    world.step(2400)
    assert body.q[7:] == pytest.approx([0.2, 0.2], abs=1e-6)
    body.set_drives(target=np.r_[np.zeros(6), 0.1, 0.3])
    with pytest.raises(tumble.InvalidValueError, match="only revolute, prismatic and spherical joints have them"):
        body.set_drives(stiffness=np.r_[1.0, np.zeros(5), 5, 5])


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"stiffness": [1, 2]}, r"stiffness: expected a number or shape \(3,\), got \(2,\)"),
        ({"stiffness": -1}, "stiffness is -1"),
        ({"stiffness": 1, "max_force": np.nan}, "NaN"),
        ({"target": 1}, "set its stiffness or damping too"),
    ],
)
def test_wrong_drives_change_nothing(given, message):
    world, body = arm()
    before = world.save()
    with pytest.raises(tumble.InvalidValueError, match=message):
        body.set_drives(**given)
    assert world.save() == before


# Forces between two bodies


def test_the_force_of_one_body_on_another():
    world = tumble.World()
    ground = world.add_static("ground", tumble.Plane())
    low = world.add_rigid("low", tumble.Box(0.2, 0.2, 0.2), mass=3, position=(0, 0, 0.1))
    high = world.add_rigid("high", tumble.Box(0.2, 0.2, 0.2), mass=2, position=(0, 0, 0.3))
    world.step(60)
    for a, b, weight in ((ground, low, 5), (low, high, 2), ("low", "ground", -5), (ground, "high", 0)):
        assert world.contact_force(a, b) == pytest.approx([0, 0, weight * G], abs=1e-6)
    with pytest.raises(tumble.UnknownNameError):
        world.contact_force("nothing", low)
    world.remove(high)
    with pytest.raises(tumble.RemovedError):
        world.contact_force(low, high)


def test_the_force_on_a_link_is_that_on_its_own_shapes():
    world = tumble.World()
    ground = world.add_static("ground", tumble.Plane())
    builder = tumble.ArticulationBuilder("leg")
    builder.add_link("calf", joint="floating", shape=tumble.Box(0.1, 0.1, 0.4), mass=2)
    builder.add_link("foot", "calf", joint="fixed", position=(0, 0, -0.25), shape=tumble.Box(0.3, 0.3, 0.1), mass=1)
    leg = world.add_articulation(builder, base=(0, 0, 0.3))
    world.step(120)
    for foot in (leg.link("foot"), "leg/foot", (leg, "foot")):
        assert world.contact_force(ground, foot) == pytest.approx([0, 0, 3 * G], abs=1e-6)
    assert world.contact_force(ground, leg) == pytest.approx([0, 0, 3 * G], abs=1e-6)
    assert (world.contact_force(ground, leg.link("calf")) == 0).all()


# Axes by letter


def test_axes_have_letters_wherever_a_direction_is_meant():
    def hinge(axis):
        world = tumble.World(gravity=(0, 0, 0))
        body = world.add_rigid("wheel", tumble.Sphere(0.1), mass=1, angular_velocity=(1, 2, 3))
        world.add_joint("revolute", body, axis=axis)
        world.step(10)
        return body.angular_velocity

    for word, axis in {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1), "-x": (-1, 0, 0), "+y": (0, 1, 0), "-z": (0, 0, -1)}.items():
        assert (hinge(word) == hinge(axis)).all()
    world = tumble.World(gravity=(0, 0, 0))
    wall = world.add_static("wall", tumble.HalfSpace("-x", -2.0))
    assert float(world.cast_rays((0, 0, 0), "x")["distance"].item()) == pytest.approx(2)
    assert float(world.cast_shape(tumble.Sphere(0.5), "x", 9)["distance"].item()) == pytest.approx(1.5)
    wall.attach_camera(forward="y", up="z")
    one_way = world.add_rigid("platform", tumble.Box(1, 1, 0.1), mass=1, position=(0, 0, 5), one_way="z")
    assert (one_way.one_way == (0, 0, 1)).all()
    a, b = (world.add_rigid(name, tumble.Sphere(0.1), mass=1, position=(0, 3, 0)) for name in "ab")
    world.add_joint("universal", a, b, axis="x", second_axis="y")
    for call in (lambda: hinge("w"), lambda: tumble.HalfSpace("X"), lambda: world.cast_rays((0, 0, 0), "up")):
        with pytest.raises(tumble.InvalidValueError, match=r"is no axis; expected x, y, z, -x, -y, -z or three numbers"):
            call()


# Sizes one by one


def test_sizes_may_be_given_one_by_one():
    assert repr(tumble.Box(0.4, 0.2, 0.1)) == repr(tumble.Box((0.4, 0.2, 0.1)))
    assert repr(tumble.Box(0.4, 0.2, 0.1, rounding=0.01)) == repr(tumble.Box((0.4, 0.2, 0.1), rounding=0.01))
    assert repr(tumble.Ellipsoid(0.4, 0.2, 0.1)) == repr(tumble.Ellipsoid((0.4, 0.2, 0.1)))
    assert tumble.Ellipsoid(0.4).volume == pytest.approx(4 / 3 * np.pi * 0.2**3)
    expected = r"expected Box\(\(0.4, 0.2, 0.1\)\), Box\(0.4, 0.2, 0.1\) or one number for all three, full sizes in meters"
    for wrong in ((0.4, 0.2), ((0.4, 0.2, 0.1), 1)):
        with pytest.raises(tumble.InvalidValueError, match=expected):
            tumble.Box(*wrong)
    for wrong in (((1, 2, 3), 1, 1), (1, "a", 1), (1, (1, 1), 1)):
        with pytest.raises(tumble.InvalidValueError, match=r"expected Box\(\(0.4, 0.2, 0.1\)\) or Box\(0.4, 0.2, 0.1\)"):
            tumble.Box(*wrong)


# Typing errors


def calls_with_keywords():
    for name in tumble._native.__all__:
        value = getattr(tumble._native, name)
        if not inspect.isclass(value):
            continue
        own = {f"{name}.{part}": getattr(value, part) for part in vars(value) if not part.startswith("_")}
        for place, call in {name: value, **own}.items():
            try:
                parameters = list(inspect.signature(call).parameters.values()) if callable(call) else []
            except ValueError:
                continue
            words = [p.name for p in parameters if p.kind is p.KEYWORD_ONLY]
            needed = [p for p in parameters if p.default is p.empty and p.kind is p.POSITIONAL_OR_KEYWORD]
            if words:
                yield pytest.param(value, place, call, words[-1], needed, id=place)


@pytest.mark.parametrize(("kind", "place", "call", "word", "needed"), list(calls_with_keywords()))
def test_a_keyword_with_a_typing_error_names_the_right_one(kind, place, call, word, needed):
    owners = {
        "World": lambda: tumble.World(),
        "Articulation": lambda: arm()[1],
        "ArticulationBuilder": lambda: built(),
        "RigidBody": lambda: tumble.World().add_rigid("a", tumble.Sphere(1), mass=1),
        "Link": lambda: arm()[1].link("rod0"),
        "Joint": lambda: hinged(),
        "JointDof": lambda: hinged().dofs[0],
        "Batch": lambda: tumble.Batch(arm()[0], 1),
        "Flock": lambda: tumble.World().add_flock("f"),
        "Recorder": lambda: tumble.Recorder("never.mcap"),
        "Soundtrack": lambda: tumble.Soundtrack(tumble.World()),
    }
    filler = {"n": 1, "substeps": 1, "name": "a", "kind": "revolute", "max": 1, "mass": 1.0, "max_distance": 1.0, "joint": "rod0", "link": "rod0", "multiplier": 1.0, "number": 0, "period": 1.0, "area": 1.0, "radius": 1.0, "length": 1.0, "density": 1.0, "target": 1.0, "shape": tumble.Sphere(1), "world": tumble.World(), "strength": 1.0}  # fmt: skip
    given = [filler.get(p.name, (0, 0, 1)) for p in needed if p.name != "self"]
    if place in ("Action.drive", "Action.attach"):
        given = ["arm/rod0", 1.0][: len(given)]
    if place.endswith(("set_shape_filter", "set_shape_material")):
        given = ["rod0", 0][-len(given) :]
    special = {
        "Policy": [[([[1.0]], [0.0])]],
        "Field.explosion": [(0, 0, 0), 1.0],
        "Field.panels": [[]],
        "World.add_field": ["f", tumble.Field.wind((0, 0, 1))],
        "World.add_event": ["e", tumble.Trigger.time(1.0), tumble.Action.disable("f")],
    }
    given = special.get(place, given)
    right = {"duration": 1.0} if place == "Action.force" else {}
    if place != kind.__name__ and kind.__name__ in owners and not isinstance(vars(kind).get(place.split(".")[1]), staticmethod):
        call = getattr(owners[kind.__name__](), place.split(".")[1])
    wrong = word[:-1] + "q" + word[-1]
    with pytest.raises(TypeError, match=rf"^{place}\(\) got an unexpected keyword argument '{wrong}'; did you mean '{word}'\?$"):
        call(*given, **right, **{wrong: 1})


def built():
    builder = tumble.ArticulationBuilder("a")
    builder.add_link("rod0", shape=tumble.Sphere(0.1), mass=1)
    return builder


def hinged():
    world = tumble.World()
    return world.add_joint("revolute", world.add_rigid("door", tumble.Sphere(0.1), mass=1))


def short_calls():
    world = tumble.World()
    body = world.add_rigid("a", tumble.Sphere(1), mass=1)
    return [
        (lambda: body.apply_force((1, 0, 0), pont=(0, 0, 0)), "did you mean 'point'"),
        (lambda: body.move_to(posision=(0, 0, 0)), "did you mean 'position'"),
        (lambda: world.step(number=3), "there are n$"),
        (lambda: arm()[1].mass_matrix(qq=[0, 0, 0]), "did you mean 'q'|there are q"),
        (lambda: tumble.Trigger.asleep(body="a"), "did you mean 'bodies'"),
        (lambda: tumble.Trigger.time(when=1.0), "missing 1 required positional argument: 'at'"),
        (lambda: tumble.Action.remove(bdy="a"), "missing 1 required positional argument: 'body'"),
        (lambda: tumble.Sphere(raduis=1.0), "missing 1 required positional argument: 'radius'"),
        (lambda: world.body(nme="a"), "missing 1 required positional argument: 'name'"),
        (lambda: tumble.Ellipsoid((1, 1, 1), w=2), "there are size, y, z"),
    ]


@pytest.mark.parametrize(("call", "meant"), short_calls())
def test_methods_of_few_arguments_name_the_right_one(call, meant):
    with pytest.raises(TypeError, match=meant):
        call()


def test_a_keyword_that_is_like_no_other_lists_all():
    with pytest.raises(TypeError, match=r"Box\(\) got an unexpected keyword argument 'half_extents'; there are size, y, z, rounding$"):
        tumble.Box(1, half_extents=2)
    with pytest.raises(TypeError, match=r"add_link\(\) got an unexpected keyword argument 'fricton'; did you mean 'friction'\?"):
        tumble.ArticulationBuilder("a").add_link("l", fricton=1)


def written_in_python():
    return [
        (tumble.Camera, ((0, 0, 1), (0, 0, 0)), "fov_dg", "fov_deg", "Camera"),
        (tumble.Camera, (), "targt", "target", "Camera"),
        (tumble.Appearance, (), "roughnes", "roughness", "Appearance"),
        (tumble.save_png, (), "pictur", "picture", "save_png"),
        (tumble.read, (), "pathh", "path", "read"),
        (tumble.replay, ("none.mcap",), "wrld", "world", "replay"),
        (tumble.Recording.video, (None, "a.mp4"), "widht", "width", "Recording.video"),
        (tumble.Recording.animation, (None,), "sped", "speed", "Recording.animation"),
        (tumble.Animation.save, (None,), "pth", "path", "Animation.save"),
        (tumble.Window.wait, (None,), "timeot", "timeout", "Window.wait"),
        (tumble.distributed.map, (abs, [1]), "worker", "workers", "map"),
        (tumble.distributed.as_completed, (abs, [1]), "retry", "retries", "as_completed"),
        (tumble.distributed.connect, (), "worker", "workers", "connect"),
    ]


@pytest.mark.parametrize(("call", "given", "wrong", "word", "place"), written_in_python())
def test_functions_written_in_python_name_the_right_keyword(call, given, wrong, word, place):
    with pytest.raises(TypeError, match=rf"^{place}\(\) got an unexpected keyword argument '{wrong}'; did you mean '{word}'\?$"):
        call(*given, **{wrong: 1})


def test_named_fields_are_pickled_copied_and_replaced_as_before():
    camera = tumble.Camera((0, 0, 1), target=(0, 0, 0))
    assert pickle.loads(pickle.dumps(camera)) == camera == copy.deepcopy(camera)
    assert camera._replace(fov_deg=20).fov_deg == 20 and camera.up == (0.0, 0.0, 1.0)
    with pytest.raises(TypeError, match="missing 1 required positional argument: 'target'"):
        tumble.Camera((0, 0, 1))


@pytest.mark.parametrize(("program", "meant"), [("tumble.World().gravty", "gravity"), ("tumble.Spere", "Sphere"), ("tumble.World().add_rigd", "add_rigid")])
def test_a_program_that_ends_with_an_unknown_attribute_names_the_right_one(program, meant):
    ended = subprocess.run([sys.executable, "-c", f"import tumble\n{program}"], capture_output=True, text=True, timeout=60)
    assert f"Did you mean: '{meant}'?" in ended.stderr


# Rollouts without controls


def test_a_rollout_without_controls_is_the_world_left_alone():
    world, body = arm(2)
    body.tau = [0.3, -0.2]
    states = world.rollout(steps=20, every=5)
    assert states.shape == (1, 4, len(world.state))
    fork = world.fork()
    for k in range(4):
        fork.step(5)
        assert (states[0, k] == fork.state).all()
    starts = np.tile(world.state, (3, 1)) + [[0.0], [0.1], [0.2]]
    assert world.rollout(steps=4, states=starts).shape == (3, 4, len(world.state))
    assert (world.rollout(steps=20, forks=2)[1, -1] == fork.state).all()
    for given, message in (
        ({}, "steps: expected their number, or controls"),
        ({"controls": np.zeros((1, 2, 2)), "steps": 2}, "steps and forks: expected none"),
        ({"steps": 2, "articulations": [body]}, "articulations: expected none"),
        ({"steps": 2, "forks": 2, "states": starts}, r"states: expected shape"),
        ({"steps": -1}, "steps is -1; expected a whole number"),
    ):
        with pytest.raises(tumble.InvalidValueError, match=message):
            world.rollout(**given)


# Animations of a world in memory


def drawing_or_skip():
    try:
        tumble.World().render(8, 8)
    except tumble.PictureError as error:
        pytest.skip(f"SKIPPED: {error}")


def test_a_world_becomes_an_animation_without_a_file(tmp_path):
    drawing_or_skip()
    world = tumble.World(gravity=(0, 0, 0))
    ball = world.add_rigid("ball", tumble.Sphere(0.2), mass=1)
    before = world.save()
    seen = []

    def control(fork):
        seen.append(fork.time)
        fork["ball"].velocity = (0, 1, 0)

    animation = world.animation(0.5, width=64, height=48, fps=10, camera=((3, 0, 0), (0, 0, 0)), control=control)
    assert animation.size == (64, 48)
    assert animation.times == pytest.approx([0, 0.1, 0.2, 0.3, 0.4, 0.5], abs=1e-9)
    assert seen == pytest.approx(np.arange(120) / 240)
    assert world.save() == before and (ball.position == 0).all()
    world.video(tmp_path / "run.png", 0.2, width=32, height=32, fps=10)
    assert (tmp_path / "run.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    for call, message in (
        (lambda: world.animation(0), "duration is 0"),
        (lambda: world.animation(1, fps=0), "fps is 0"),
        (lambda: world.animation(1, control=3), "control is 3; expected a function of a world"),
    ):
        with pytest.raises(tumble.InvalidValueError, match=message):
            call()
