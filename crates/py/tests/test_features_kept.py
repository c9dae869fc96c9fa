"""Each feature of a world that a row of the table of features names is in a saved scene, a fork, a pickle and a recording of it."""

import pickle
import tomllib

import pytest

import tumble
from test_features import rows

# Rows without anything in a world to keep: queries and algorithms of a world, files, pictures and programs. Each is shown and run by the example of
# its row (test_features.py).
NOT_IN_A_WORLD = {
    "contact forces, each or the sum between two bodies",
    "contact filter: a function that decides",  # code of the program: no file has it; forks and pickles are in test_intersect.py
    "contact events",
    "URDF",
    "MJCF",
    "MJCF written",
    "SDF",
    "links covered by spheres, for motion planners",
    "forward and inverse dynamics",
    "derivatives of the dynamics",
    "derivative of a step",
    "mass matrix, Jacobian",
    "rays, many at once",
    "moving shapes",
    "queries that find what a body collides with",
    "overlaps",
    "closest points",
    "points in bodies, and their depth",
    "forces of one's own",  # code of the program: forks and pickles are in test_extension.py
    "snapshot of the state",
    "fork",
    "a world as a file to edit",
    "many futures at once",
    "many worlds of one model",
    "worlds of random constants",
    "recordings",
    "videos",
    "animations that play without a kernel",
    "the sound of contacts as a file",
    "the sound of contacts while a scene runs",
    "a window on a program's world",
    "images without a window",
    "several screens around a user",
    "interlaced, checkerboard and single-eye stereo",
    "browsers as screens of a cave",
    "domes, panoramas and curved walls",
    "projectors measured with a camera",
}

TWO = tumble.Compound([(tumble.Box((0.2, 0.2, 0.2)).named("left"), (-0.2, 0, 0)), (tumble.Sphere(0.1).named("right"), (0.2, 0, 0))])
TETRAHEDRON = ([(0, 0, 0), (0.3, 0, 0), (0, 0.3, 0), (0, 0, 0.3)], [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)])


def shaped(*shapes):
    def make(world):
        for n, shape in enumerate(shapes):
            world.add_rigid(f"shape {n}", shape, mass=1, position=(n, 0, 1))

    return make


def fixed(shape):
    return lambda world: world.add_static("ground", shape)


def ball(**words):
    """A ball with properties, given to ``add_rigid`` or set afterwards."""

    def make(world):
        own = {key: value for key, value in words.items() if key in ("linear_damping", "angular_damping", "gravity_scale", "locked", "restitution")}
        body = world.add_rigid("ball", tumble.Sphere(0.1), mass=1, position=(0, 0, 1), **own)
        for key, value in words.items():
            setattr(body, key, value)

    return make


def grid(x, y):
    corners = [(i, j, 0.0) for j in y for i in x]
    n = len(x)
    cells = [(j * n + i, j * n + i + 1, (j + 1) * n + i) for j in range(len(y) - 1) for i in range(n - 1)]
    return corners, cells + [(b, c + 1, c) for _, b, c in cells]


def signed_distance():
    import numpy as np

    line = np.linspace(-0.4, 0.4, 17)
    x, y, z = np.meshgrid(line, line, line, indexing="ij")
    return tumble.Sdf(np.sqrt(x**2 + y**2 + z**2) - 0.3, (-0.4,) * 3, (0.4,) * 3)


def joined(kind, **words):
    def make(world):
        a, b = (world.add_rigid(name, tumble.Sphere(0.1), mass=1, position=(x, 0, 1)) for name, x in (("a", 0), ("b", 0.5)))
        world.add_joint(kind, a, b, name="joint", **words)

    return make


def all_of(*makers):
    def make(world):
        for maker in makers:
            maker(world)

    return make


def linked(joint="revolute", **words):
    def make(world):
        builder = tumble.ArticulationBuilder("arm")
        builder.add_link("upper", joint=joint, shape=tumble.Capsule(0.05, 0.3), mass=1, position=(0, 0, 2), **words)
        return world.add_articulation(builder)

    return make


def driven(joint, **drive):
    def make(world):
        linked(joint)(world).set_drive("upper", **drive)

    return make


def two_bodies(world):
    return [world.add_rigid(name, tumble.Sphere(0.1), mass=1, position=(x, 0, 1)) for name, x in (("a", 0), ("b", 0.5))]


def pair(**words):
    return lambda world: world.set_pair_material(*two_bodies(world), **words)


def belt(world):
    world.add_static("belt", tumble.Box((1, 1, 0.1))).surface_velocity = (0.5, 0, 0)


def filtered(world):
    body = world.add_rigid("body", TWO, mass=1, position=(0, 0, 1))
    body.set_shape_filter("left", group=3, mask=[1, 2])
    body.set_shape_filter("right", sensor=True)


def surfaced(world):
    world.add_rigid("body", TWO, mass=1, position=(0, 0, 1)).set_shape_material("left", friction=0.125, restitution=0.25)


def dumbbell(world):
    world.add_rigid("body", tumble.Sphere(0.1), mass=2, inertia=(0.1, 0.2, 0.25), center_of_mass=(0.01, 0, 0), position=(0, 0, 1))


def moved(world):
    cart = world.add_rigid("cart", tumble.Box((0.2, 0.2, 0.1)), mass=1, kinematic=True, velocity=(0.1, 0, 0))
    world.add_event("go", tumble.Trigger.time(0.05), tumble.Action.move_along(cart, [0, 2], [(0, 0, 0), (1, 0, 0)]))


def couple(world):
    joined("revolute")(world)
    world.add_mimic(world.add_joint("revolute", "b", name="other"), "joint", 2.0, name="coupling")


def rotor(world):
    linked()(world).armature = [0.25]


def sensing(kinds):
    def make(world):
        linked()(world)
        for kind in kinds:
            world.add_sensor(kind, ("arm", "upper"), name=kind, deviation=0.0 if kind == "segmentation" else 0.01, seed=3)

    return make


def fields(world):
    world.add_field("wind", tumble.Field.wind((1, 0, 0)))
    world.add_field("water", tumble.Field.buoyancy(density=900))
    two_bodies(world)


def particles(world):
    world.add_particles("smoke", opacity=0.5, emitters=[tumble.Emitter(rate=100)])


# Feature: what makes it, and words of the scene file that say it.
KEPT = {
    "sphere, box, capsule, cylinder": (shaped(tumble.Sphere(0.1), tumble.Box(0.2, 0.2, 0.2), tumble.Capsule(0.1, 0.2), tumble.Cylinder(0.1, 0.2)), '"cylinder" radius_m length_m'),
    "plane": (fixed(tumble.Plane()), '"half_space"'),
    "several shapes as one body": (shaped(TWO), '"compound" parts'),
    "convex hull": (shaped(tumble.ConvexHull(TETRAHEDRON[0])), '"mesh"'),
    "concave moving mesh, as it is": (shaped(tumble.Mesh(*TETRAHEDRON)), '"mesh"'),
    "height field": (fixed(tumble.HeightField([[0, 0.1], [0.1, 0]], (1, 1))), '"mesh"'),
    "solid of a signed distance": (shaped(signed_distance()), '"mesh"'),
    "ellipsoid, cone": (shaped(tumble.Ellipsoid((0.2, 0.3, 0.4)), tumble.Cone(0.1, 0.2)), '"ellipsoid" "cone" height_m'),
    "rounded boxes and cylinders": (shaped(tumble.Box((0.2, 0.3, 0.4), rounding=0.05), tumble.Cylinder(0.1, 0.2, rounding=0.02)), "rounding_m"),
    "open mesh: rooms, walls, tunnels": (fixed(tumble.OpenMesh(*grid((0, 1, 2), (0, 1)), thickness=0.1)), '"mesh"'),
    "open surface as terrain, two-sided or one-sided": (
        lambda world: world.add_static("ground", tumble.Terrain(*grid((0, 1, 2), (0, 1))), one_way=(0, 0, 1)),
        '"mesh" one_way',
    ),
    "own mass, center and inertia": (dumbbell, "mass_kg center_m inertia_kg_m2"),
    "kinematic bodies": (moved, 'mode "kinematic" move_along'),
    "damping of bodies": (ball(linear_damping=0.5, angular_damping=0.25), "linear_damping_per_s angular_damping_per_s"),
    "gravity by body": (ball(gravity_scale=0.5), "gravity_scale"),
    "locked axes": (ball(locked=("x", "rotation_z")), 'locked "rotation_z"'),
    "Coulomb friction on the exact cone": (ball(friction=0.125), "friction"),
    "restitution": (ball(restitution=0.5), "restitution"),
    "rolling and torsional friction": (ball(rolling_friction=0.01, torsional_friction=0.02), "rolling_friction_m torsional_friction_m"),
    "friction by direction": (ball(friction_scale=(1, 0.5, 1)), "friction_scale"),
    "friction at rest larger than in motion": (ball(static_friction=0.9, stribeck_speed=0.01), "static_friction stribeck_speed_m_per_s"),
    "a spin that bounces back": (ball(tangential_restitution=0.5), "tangential_restitution"),
    "surfaces that stick": (ball(adhesion=2.0), "adhesion_n"),
    "conveyor belts": (belt, "surface_velocity_m_per_s"),
    "constants of a pair": (pair(friction=0.25, restitution=0.75), "[[pair]] friction restitution"),
    "groups and masks": (ball(group=3, mask=[1, 3]), "group mask"),
    "group, mask and trigger of each shape of a body or link": (filtered, "group mask sensor"),
    "ignored pairs": (pair(collides=False), "[[pair]] collides"),
    "one-way platforms, bodies and links": (ball(one_way=(0, 0, 1)), "one_way"),
    "materials of single shapes of a body or a link": (surfaced, "friction restitution"),
    "names of single shapes": (shaped(TWO), '"left" "right"'),
    "triggers": (ball(sensor=True), "sensor"),
    "sleep": (None, "sleep_after_s"),
    "articulations in reduced coordinates": (linked(), "[[articulated]] [[articulated.link]]"),
    "articulations made in code": (linked(), "[[articulated]] [[articulated.link]]"),
    "revolute, prismatic, spherical joint": (all_of(joined("revolute")), '"revolute"'),
    "closed loops": (joined("fixed"), "[[loop_joint]]"),
    "distance, rope": (joined("rope", second_point=(0.5, 0, 1)), '"rope" length_m'),
    "cylindrical, universal, planar joint": (joined("universal", second_axis=(1, 0, 0)), '"universal"'),
    "springs": (joined("spring", second_point=(0.5, 0, 1), stiffness=20), '"spring" stiffness_n_per_m'),
    "gear, mimic": (couple, "[[mimic]] multiplier"),
    "screw, pulley, rack": (joined("screw", pitch=0.1), '"screw" pitch_m'),
    "breaking joints": (joined("revolute", breaking_force=50, breaking_torque=5), "breaking_force_n breaking_torque_n_m"),
    "joint limits, damping, dry friction, armature": (
        linked(limits=(-1, 1), joint_damping=0.5, joint_friction=0.25, armature=0.125),
        "limits_rad damping_n_m_s_per_rad friction_n_m armature_kg_m2",
    ),
    "armature of a joint in motion": (rotor, "armature_kg_m2"),
    "velocity limits that hold": (joined("revolute", max_velocity=2), "max_velocity_rad_per_s"),
    "settings of every free axis of a joint between any bodies: limits, friction, spring, drive, effort, rotor": (
        joined("cylindrical", dofs=[{"limits": (-1, 1), "friction": 0.5}, {"stiffness": 3, "rest": 0.25, "effort": 2, "armature": 0.5, "drive": {"velocity": 1}}]),
        "limits_m friction_n spring effort_n_m armature_kg_m2 drive",
    ),
    "effort limits of motors": (joined("revolute", effort=3), "effort_n_m"),
    "cone, twist, spring and drive of a spherical joint, in articulations too": (
        all_of(joined("spherical", cone=1.0, twist_limits=(-1, 1)), linked("spherical", cone=0.5, stiffness=2, rest=(0.1, 0, 0), drive={"target": 0.1, "stiffness": 5})),
        "cone_rad twist_limits_rad spring drive",
    ),
    "limits of a hinge on one side, over any number of turns": (joined("revolute", limits=(float("-inf"), 1)), "limits_rad"),
    "position and velocity drives": (driven("revolute", target=0.5, stiffness=10, damping=1), "drive target_rad"),
    "recorded motion as a drive": (
        all_of(linked(drive={"times": [0, 1, 2], "values": [0, 0.5, 0], "repeat": True}), joined("prismatic", drive={"times": [0, 1], "values": [0, 0.1], "max_force": 9})),
        '"playback" times_s values_rad values_m repeat max_force_n',
    ),
    "inertial units, force and torque, touch, range finders": (sensing(("accelerometer", "gyroscope", "force", "torque", "touch", "range_finder")), '[[sensor]] "touch"'),
    "depth, segmentation and color cameras": (sensing(("depth", "segmentation", "color")), '[[sensor]] "segmentation"'),
    "wind and buoyancy": (fields, '[[field]] "wind" "buoyancy" density_kg_per_m3'),
    "particles, solid or transparent": (particles, "[[particle_system]] opacity rate_per_s"),
    "cloth": (lambda world: world.add_cloth("sheet", nodes=(4, 4), pins=["corners"]), "[[cloth]] pins"),
}


def made(feature):
    world = tumble.World(sleep_after=0.5) if feature == "sleep" else tumble.World()
    if make := KEPT[feature][0]:
        make(world)
    return world


def test_every_row_is_kept_or_has_nothing_to_keep():
    names = [feature for feature, _, _ in rows()]
    assert sorted(names) == sorted([*KEPT, *NOT_IN_A_WORLD])


@pytest.mark.parametrize("feature", list(KEPT))
def test_a_feature_is_saved_forked_and_pickled(feature, tmp_path):
    world = made(feature)
    world.save_scene(tmp_path / "world.toml")
    text = (tmp_path / "world.toml").read_text()
    missing = [word for word in KEPT[feature][1].split(" ") if word not in text]
    assert not missing, text
    # the archive beside the text is left out: the text alone must say it
    (tmp_path / "text.toml").write_text("\n".join(line for line in text.splitlines() if not line.startswith("saved_world")))
    copies = {
        "fork": world.fork(),
        "pickle": pickle.loads(pickle.dumps(world)),
        "scene": tumble.World.load(tmp_path / "world.toml"),
        "text": tumble.World.load(tmp_path / "text.toml"),
    }
    plain = {name: written(copy, tmp_path / f"{name}.toml") for name, copy in copies.items()}
    for name in ("fork", "pickle", "scene"):
        assert plain[name] == written(world, tmp_path / "again.toml"), name
    assert plain["text"].keys() == plain["fork"].keys()
    world.step(30)
    for name, copy in copies.items():
        copy.step(30)
        # the text lists the objects by their kinds
        assert sorted(copy.state) == pytest.approx(sorted(world.state), rel=1e-9, abs=1e-9) if name == "text" else (copy.state == world.state).all(), name


def written(world, path):
    world.save_scene(path)
    found = tomllib.loads(path.read_text())
    found.pop("saved_world", None)
    # meshes are written beside the scene, by its name
    for mesh in found.get("meshes", {}).values():
        mesh.pop("file", None)
    return found


@pytest.mark.parametrize("feature", [feature for feature in KEPT if feature != "sleep"])
def test_a_feature_is_recorded(feature, tmp_path):
    world = made(feature)
    with tumble.Recorder(tmp_path / "run.mcap") as recorder:
        recorder.run(world, 12, every=4)
    recording = tumble.read(tmp_path / "run.mcap")
    assert len(recording) >= 3
    # a link has the name of its body before it
    assert set(world.bodies.names()) <= {part for name in recording.names for part in (name, name.split("/")[0])}
    for name, positions in zip(recording.names, recording.positions[-1]):
        if name in world.bodies.names() and isinstance(world[name], tumble.RigidBody):
            assert positions == pytest.approx(world[name].position, abs=1e-6), name
    shown = list(tumble.replay(tmp_path / "run.mcap", world.fork()))
    assert len(shown) == len(recording)
