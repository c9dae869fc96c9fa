"""Worlds written as scene files, and read back to the same bits."""

import copy
import pickle

import pytest

import tumble


def made():
    """A world of a program: bodies, an articulation, a joint, a pair."""
    world = tumble.World(dt=1 / 120, substeps=2)
    world.add_static("floor", tumble.HalfSpace(), friction=0.8)
    world.add_rigid("box", tumble.Box((0.2, 0.3, 0.4)), mass=2, position=(0, 0, 0.6), angular_velocity=(1, 2, 3))
    parts = [(tumble.Sphere(0.1), (0, 0, 0.2)), (tumble.Cylinder(0.05, 0.3), (0, 0.1, 0))]
    world.add_rigid("tool", tumble.Compound(parts), mass=1, position=(1, 0, 0.4), inertia=(0.1, 0.2, 0.15), center_of_mass=(0.1, 0, 0))
    builder = tumble.ArticulationBuilder("arm")
    builder.add_link("upper", axis=(0, 1, 0), position=(3, 0, 2), mass=1, center_of_mass=(0, 0, -0.5), shape=tumble.Capsule(0.05, 0.5), drive={"stiffness": 30, "damping": 3})
    builder.add_link("lower", "upper", axis=(0, 1, 0), position=(0, 0, -1), mass=1, center_of_mass=(0, 0, -0.5), limits=(-1, 2))
    arm = world.add_articulation(builder)
    arm.q = 0.4, -0.2
    world.add_joint("distance", "box", "tool", point=(0, 0, 0.6), second_point=(1, 0, 0.4), name="rod")
    world.set_pair_material("box", "floor", friction=0.1)
    return world


@pytest.mark.parametrize("name", ["stack", "robot", "made"])
def test_a_saved_world_goes_on_with_the_same_bits(name, tmp_path):
    world = made() if name == "made" else tumble.World.load(name)
    world.step(60)
    assert world.save_scene(tmp_path / "now.toml") == []
    again = tumble.World.load(tmp_path / "now.toml")
    assert again.save() == world.save() and again.notes == world.notes == []
    world.step(240)
    again.step(240)
    assert again.save() == world.save()
    assert (again.time, again.dt, [body.name for body in again.bodies]) == (world.time, world.dt, [body.name for body in world.bodies])


def test_joints_keep_their_names_and_drives(tmp_path, root):
    world = tumble.World()
    arm = world.add_articulation(root / "scenes" / "robot" / "arm.urdf", name="arm")
    arm.set_drive(arm.joint_names[1], target=0.3, stiffness=200, damping=20)
    world.step(10)
    world.save_scene(tmp_path / "now.toml")
    again = tumble.World.load(tmp_path / "now.toml")
    assert again.articulation("arm").joint_names == arm.joint_names
    assert f'joint_name = "{arm.joint_names[1]}"' in (tmp_path / "now.toml").read_text()
    world.step(100)
    again.step(100)
    assert (again.articulation("arm").q == arm.q).all()


def test_a_missing_folder_is_named(tmp_path):
    for write, name in [(tumble.World().save_scene, "world.toml"), (made().save_mjcf, "world.xml")]:
        with pytest.raises(tumble.MissingFileError, match=f"there is no folder {tmp_path / 'none'}"):
            write(tmp_path / "none" / name)


def test_settings_of_load_count(tmp_path):
    made().save_scene(tmp_path / "now.toml")
    again = tumble.World.load(tmp_path / "now.toml", dt=0.002, stepper="backtracking")
    assert (again.dt, again.stepper) == (0.002, "backtracking")


def test_an_edited_text_counts(tmp_path):
    world = made()
    world.save_scene(tmp_path / "now.toml")
    text = (tmp_path / "now.toml").read_text()
    (tmp_path / "now.toml").write_text(text.replace("size_m = [0.2, 0.3, 0.4]", "size_m = [0.2, 0.3, 0.8]"))
    again = tumble.World.load(tmp_path / "now.toml")
    assert "edited after it was saved" in again.notes[0]
    # the text has all poses: what was not edited is where it was
    assert again["box"].position == pytest.approx(world["box"].position, abs=1e-12)
    assert again.articulation("arm").q == pytest.approx(world.articulation("arm").q, abs=1e-12)


class Push(tumble.Force):
    def apply(self, view):
        view.force[:, 0] += 1


def test_what_a_scene_cannot_say_is_named(tmp_path):
    world = made()
    world.add_force("gust", Push())
    with pytest.raises(ValueError, match='"gust", an object of a type of its own'):
        world.save_scene(tmp_path / "now.toml")
    assert list(tmp_path.iterdir()) == [], "nothing is written"
    world = made()
    world.articulation("arm").tau = 1, 0
    (note,) = world.save_scene(tmp_path / "now.toml")
    assert note.startswith("'arm': its generalized forces are not written")
    with pytest.raises(ValueError, match="expected the name of a .toml file"):
        world.save_scene(tmp_path / "now.txt")
    with pytest.raises(FileNotFoundError):
        world.save_scene(tmp_path / "no folder" / "now.toml")


def everything(world):
    """Adds each behavior to a world."""
    world.add_static("floor", tumble.HalfSpace())
    flag = world.add_cloth("flag", nodes=(6, 4), size=(0.6, 0.4), pins=["x_min"], position=(0, 0, 2), node_radius=0.02)
    world.add_jelly("jelly", nodes=(3, 3, 3), size=(0.3, 0.3, 0.3), position=(3, 0, 0.5), node_radius=0.04)
    ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=1, position=(1, 0, 1))
    world.add_field("breeze", tumble.Field.wind((3, 1, 0), drag=0.002), targets=[flag])
    world.add_field("sea", tumble.Field.buoyancy((0, 0, 0.05), drag=1.0))
    world.add_particles("sparks", [tumble.Emitter((0, 0, 1), speed=(1, 3), lifetime=2, burst=50, rate=100)], capacity=300, seed=4)
    world.add_particles("smoke", [tumble.Emitter(rate=50)], opacity=(0.5, 0.25), scale=3, end_color=(0, 0.5, 1), glow=True)
    flock = world.add_flock("flock", desired_speed=6, visibility_angle=2.0)
    for k in range(4):
        flock.add(position=(k, 0, 5), velocity=(1, 0, 0), color=(0.1 * k, 0.5, 0.5))
    shard = world.add_template("shard", tumble.Sphere(0.05), 3, mass=0.1, reuse=True)
    world.add_event("drop", tumble.Trigger.every(0.2), [tumble.Action.spawn(shard, (2, 2, 1), velocity=(0, 1, 0))])
    world.add_event("hit", tumble.Trigger.contact("floor", [ball, shard]), [tumble.Action.push("other", (0, 0, 0.1))], times=3)
    world.add_sensor("accelerometer", ball, name="imu", deviation=0.1)
    return world


def test_a_world_with_every_behavior_is_pickled_copied_and_written(tmp_path):
    world = everything(tumble.World())
    world.step(100)
    path = tmp_path / "now.toml"
    assert world.save_scene(path) == []
    text = path.read_text()
    assert all(line in text for line in ("opacity = [0.5, 0.25]", "scale = [3", "end_color = [0", "glow = true"))
    copies = {"pickle": pickle.loads(pickle.dumps(world)), "copy": copy.copy(world), "scene": tumble.World.load(path)}
    world.step(140)
    for name, other in copies.items():
        assert other.frame == 100, name
        other.step(140)
        assert (other.state == world.state).all(), name
        assert len(other["flock"]) == 4 and other["flag"].positions.shape == (24, 3), name
        assert other["drop"].fired == world["drop"].fired > 4, name
        assert (other.sensors["imu"] == world.sensors["imu"]).all(), name
    flock = copies["pickle"]["flock"]
    flock.remove(flock.boids[0])
    copies["pickle"].step()
    assert len(flock) == 3


def test_callables_have_no_words_in_scenes(tmp_path):
    world = tumble.World()
    world.add_rigid("ball", tumble.Sphere(0.1), mass=1)
    world.add_event("now", tumble.Trigger.time(1), [len])
    with pytest.raises(tumble.InvalidValueError, match="'now'"):
        world.save_scene(tmp_path / "now.toml")
    world = tumble.World()
    world.add_rigid("ball", tumble.Sphere(0.1), mass=1, intersect=tumble.Intersect())
    with pytest.raises(tumble.TumbleError, match="ball"):
        world.save_scene(tmp_path / "now.toml")
    assert list(tmp_path.iterdir()) == []


def test_flocks_of_bodies_are_saved(tmp_path):
    world = tumble.World()
    world.add_body_flock("school")
    world.save_scene(tmp_path / "now.toml")
    assert tumble.World.load(tmp_path / "now.toml")["school"].name == "school"
