"""What Python makes with its defaults alone is what a scene makes of its required keys alone: the same names, the same defaults."""

import tomllib

import pytest

import tumble

CHOICES = tumble._native._choices()

# Of each table the keys that a scene requires, or that say where something is; colors are given by Python in turn.
REQUIRED = {
    "world": set(),
    "body": {"name", "shape", "mode", "mass_kg", "position_m", "color", "second_color", "pattern", "pattern_scale_m", "roughness"},
    "template": {"name", "shape", "mass_kg", "color", "max"},
    "event": {"name", "when", "do"},
    "loop_joint": {
        *("name", "type", "a", "b", "anchor_a", "anchor_b", "length_m", "stiffness_n_per_m", "teeth", "radius_m", "pitch_m"),
        *("ground_position_m", "second_ground_position_m", "reference_a", "reference_b"),
    },
    "mimic": {"name", "joint", "of"},
    "sensor": {"name", "kind", "type", "on", "body", "joint", "axis"},
    "cloth": {"name", "color"},
    "jelly": {"name", "color"},
    "particle_system": {"name", "color", "emitter"},
    "particle_system.emitter": set(),
    "flock": {"name", "group"},
    "flock.group": {"name", "color"},
    "body_flock": {"name", "bodies"},
    "field": {"name", "type", "strength_m3_per_s2", "impulse_n_s", "panel"},
    "field.panel": {"body", "area_m2"},
    "articulated": {"name", "link", "floating"},
    "articulated.link": {"name", "parent", "joint", "axis", "mass_kg", "center_m", "inertia_kg_m2", "shapes"},
    "articulated.link.shapes": {"type", "radius_m", "color"},
}

JOINTS = {
    "distance": {"second_point": (1, 0, 0)},
    "rope": {"second_point": (1, 0, 0)},
    "spring": {"second_point": (1, 0, 0), "stiffness": 10},
    "gear": {"teeth": (1, 2)},
    "rack": {"radius": 1, "second_axis": (1, 0, 0)},
    "screw": {"pitch": 1},
    "pulley": {"second_point": (1, 0, 0), "ground": [(0, 0, 1), (1, 0, 1)]},
    "universal": {"second_axis": (1, 0, 0)},
}


def joined(kind):
    def make(world):
        a, b = balls(world)
        world.add_joint(kind, a, b, name="j", point=(0, 0, 0), **JOINTS.get(kind, {}))

    return make


def balls(world):
    return [world.add_rigid(name, tumble.Sphere(0.1), mass=1, position=(x, 0, 0)) for name, x in (("a", 0), ("b", 1))]


def coupled(world):
    a, b = balls(world)
    first, second = world.add_joint("revolute", a, b, name="j", point=(0, 0, 0)), world.add_joint("revolute", b, name="k", point=(1, 0, 0))
    world.add_mimic(second, first, name="m")


def arm(world):
    builder = tumble.ArticulationBuilder("arm")
    for joint in sorted(set(CHOICES["JointType"]) - {"floating"}):
        axis = {"axis": (0, 0, 1)} if joint in ("revolute", "prismatic") else {}
        builder.add_link(joint, joint=joint, shape=tumble.Sphere(0.1), mass=1, **axis)
    return world.add_articulation(builder)


def float_alone(world):
    builder = tumble.ArticulationBuilder("kite")
    builder.add_link("root", joint="floating", shape=tumble.Sphere(0.1), mass=1)
    world.add_articulation(builder)


def sensing(kind):
    def make(world):
        if kind in ("force", "torque", "joint_position", "joint_velocity", "drive_force"):
            arm(world)
            world.add_sensor(kind, ("arm", "revolute"), name="s")
        else:
            world.add_sensor(kind, balls(world)[0], name="s")

    return make


def field(made):
    return lambda world: world.add_field("f", made)


def panels(world):
    balls(world)
    world.add_field("f", tumble.Field.panels([tumble.Panel("a", 1.0)]))


def event(world):
    balls(world)
    world.add_event("e", tumble.Trigger.contact("a"), tumble.Action.disable("b"))


CASES = {
    "world": lambda world: None,
    "body": balls,
    "static body": lambda world: world.add_static("b", tumble.HalfSpace()),
    **{f"joint {kind}": joined(kind) for kind in CHOICES["JointKind"]},
    "mimic": coupled,
    "articulation": arm,
    "floating articulation": float_alone,
    **{f"sensor {kind}": sensing(kind) for kind in CHOICES["SensorKind"]},
    "cloth": lambda world: world.add_cloth("c"),
    "jelly": lambda world: world.add_jelly("c"),
    "particles": lambda world: world.add_particles("p"),
    "emitter": lambda world: world.add_particles("p", emitters=[tumble.Emitter()]),
    "flock": lambda world: world.add_flock("f").add("b"),
    "body flock": lambda world: world.add_body_flock("f").add(balls(world)[0]),
    "wind": field(tumble.Field.wind((0, 0, 0))),
    "attractor": field(tumble.Field.attractor((0, 0, 0), 1)),
    "explosion": field(tumble.Field.explosion((0, 0, 0), 1)),
    "buoyancy": field(tumble.Field.buoyancy()),
    "panels": panels,
    "template": lambda world: world.add_template("t", tumble.Sphere(0.1), mass=1, max=3),
    "event": event,
}


def without_options(table, path=""):
    """A table with its required keys alone."""
    kept = {}
    for key, value in table.items():
        if path and key not in REQUIRED[path]:
            continue
        inner = f"{path}.{key}" if path else key
        if inner in REQUIRED and isinstance(value, dict):
            value = without_options(value, inner)
        elif inner in REQUIRED and isinstance(value, list):
            value = [without_options(one, inner) for one in value]
        kept[key] = value
    return kept


def toml(value):
    """A value as TOML on one line."""
    if isinstance(value, dict):
        return "{" + ", ".join(f'"{key}" = {toml(inner)}' for key, inner in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    if isinstance(value, bool):
        return "true" if value else "false"
    return f'"{value}"' if isinstance(value, str) else repr(value)


def saved(world, path):
    world.save_scene(path)
    text = tomllib.loads(path.read_text())
    text.pop("saved_world", None)
    return text


def alike(one, other, path):
    if isinstance(one, dict):
        assert isinstance(other, dict) and one.keys() == other.keys(), f"{path}: {sorted(one)} and {sorted(other)}"
        for key in one:
            alike(one[key], other[key], f"{path}.{key}")
    elif isinstance(one, list):
        assert len(one) == len(other), path
        for n, pair in enumerate(zip(one, other)):
            alike(*pair, f"{path}[{n}]")
    elif isinstance(one, float):
        assert one == pytest.approx(other, rel=1e-12, abs=1e-15), path
    else:
        assert one == other, path


@pytest.mark.parametrize("case", list(CASES))
def test_a_default_of_python_is_that_of_scenes(case, tmp_path):
    world = tumble.World()
    CASES[case](world)
    full = saved(world, tmp_path / "full.toml")
    needed = without_options(full)
    bare = tmp_path / "bare.toml"
    bare.write_text("".join(f'"{key}" = {toml(value)}\n' for key, value in needed.items()))
    again = tumble.World.load(bare)
    alike(full, saved(again, tmp_path / "again.toml"), case)
