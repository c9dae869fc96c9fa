"""Constants of bodies, set at any time and in scene files, and arrays of all bodies."""

import math
import pickle

import numpy as np
import pytest

import tumble


def test_mass_inertia_and_center_can_be_set_at_any_time():
    world = tumble.World(gravity=(0, 0, 0))
    body = world.add_rigid("body", tumble.Box((0.2, 0.2, 0.2)), mass=2, velocity=(1, 0, 0), angular_velocity=(0, 0, 3))
    moment = 2 * (0.2**2 + 0.2**2) / 12
    assert np.diag(body.inertia) == pytest.approx([moment] * 3)
    body.mass = 6
    assert body.mass == 6 and np.diag(body.inertia) == pytest.approx([3 * moment] * 3)
    assert body.velocity == pytest.approx([1, 0, 0]) and world.momentum().linear == pytest.approx([6, 0, 0])
    body.inertia = (1, 2, 2.5)
    assert body.inertia == pytest.approx(np.diag([1, 2, 2.5]))
    assert world.momentum().angular == pytest.approx([0, 0, 2.5 * 3])
    body.inertia = [[1, 0.1, 0], [0.1, 2, 0], [0, 0, 2.5]]
    assert body.inertia[0, 1] == 0.1
    body.center_of_mass = (0.5, 0, 0)
    assert body.center_of_mass == pytest.approx([0.5, 0, 0]) and body.position == pytest.approx([0, 0, 0])
    assert body.world_center_of_mass == pytest.approx([0.5, 0, 0])
    assert body.velocity == pytest.approx([1, 1.5, 0])  # v + ω × r
    copy = pickle.loads(pickle.dumps(world))
    world.step(100)
    copy.step(100)
    assert world.save() == copy.save()
    assert body.world_center_of_mass == pytest.approx(np.array([0.5, 0, 0]) + np.array([1, 1.5, 0]) * 100 / 240, abs=1e-9)
    for name, wrong in [("mass", 0), ("mass", math.inf), ("inertia", (1, 1, 3)), ("inertia", (1, 2)), ("center_of_mass", (0, 0))]:
        before = world.save()
        with pytest.raises(ValueError):
            setattr(body, name, wrong)
        assert world.save() == before
    ground = world.add_static("ground", tumble.HalfSpace())
    with pytest.raises(tumble.InvalidValueError, match="'ground' has no mass"):
        ground.mass = 1


def test_damping_gravity_scale_and_locks():
    for dt in (1 / 30, 1 / 240):
        world = tumble.World(dt=dt)
        damped = world.add_rigid("damped", tumble.Sphere(0.1), mass=1, linear_damping=2.0, velocity=(3, 0, 0))
        light = world.add_rigid("light", tumble.Sphere(0.1), mass=1, position=(5, 0, 0), gravity_scale=0.5)
        rail = world.add_rigid("rail", tumble.Sphere(0.1), mass=1, position=(9, 0, 0), locked=["z", "rotation_x"], velocity=(0, 1, 0))
        assert (light.gravity_scale, rail.locked, damped.locked) == (0.5, ("z", "rotation_x"), ())
        world.step(round(1 / dt))
        assert damped.velocity == pytest.approx([3 * math.exp(-2), 0, -9.81 / 2 * (1 - math.exp(-2))], abs=1e-12)
        assert light.position == pytest.approx([5, 0, -9.81 / 4], abs=1e-9)
        assert rail.position == pytest.approx([9, 1, 0], abs=1e-9)
        rail.locked = []
        light.gravity_scale = 0
        world.step(round(1 / dt))
        assert rail.position[2] == pytest.approx(-9.81 / 2, abs=1e-9)
        assert light.velocity[2] == pytest.approx(-9.81 / 2, abs=1e-9)
        rail.locked = "y"
        assert rail.locked == ("y",)
        rail.locked = ("y", "z")
        assert rail.velocity == pytest.approx([0, 0, 0])
    with pytest.raises(tumble.InvalidValueError, match="locked: `w` is not known"):
        rail.locked = ["w"]
    with pytest.raises(tumble.InvalidValueError, match="gravity scale"):
        rail.gravity_scale = math.nan


SCENE = """
[[body]]
name = "body"
mass_kg = 3
center_m = [0.1, 0, 0]
inertia_kg_m2 = [0.3, 0.4, 0.5, 0.01, 0, 0]
gravity_scale = 0.5
locked = ["y", "rotation_z"]
linear_damping_per_s = 1.5
surface_velocity_m_per_s = [1, 0, 0]
shape = { type = "box", size_m = [0.2, 0.2, 0.2] }
"""


def test_the_words_of_scene_files():
    body = tumble.World.parse(SCENE)["body"]
    other = tumble.World().add_rigid(
        "body",
        tumble.Box((0.2, 0.2, 0.2)),
        mass=3,
        center_of_mass=(0.1, 0, 0),
        inertia=[[0.3, 0.01, 0], [0.01, 0.4, 0], [0, 0, 0.5]],
        gravity_scale=0.5,
        locked=["y", "rotation_z"],
        linear_damping=1.5,
    )
    assert body.surface_velocity.tolist() == [1, 0, 0] and other.surface_velocity.tolist() == [0, 0, 0]
    for name in ("mass", "gravity_scale", "locked", "linear_damping"):
        assert getattr(body, name) == getattr(other, name)
    assert (body.inertia == other.inertia).all() and (body.center_of_mass == other.center_of_mass).all()
    for wrong, words in [
        (SCENE.replace('"y"', '"w"'), "rotation_x"),
        (SCENE.replace("mass_kg = 3", 'mode = "kinematic"'), "no mass"),
        (SCENE.replace("0.3, 0.4, 0.5", "0.3, 0.4, 0.9"), "moment"),
    ]:
        with pytest.raises(tumble.SceneError, match=words):
            tumble.World.parse(wrong)


def test_arrays_of_all_bodies():
    world = tumble.World(sleep_after=0.1)
    world.add_static("ground", tumble.HalfSpace())
    arm = world.add_articulation("scenes/robot/arm.urdf", base=(3, 0, 0), name="arm")
    balls = [world.add_rigid(tumble.Sphere(0.1), mass=1, position=(k, 0, 1)) for k in range(3)]
    assert world.positions.shape == (5, 3) and world.orientations.shape == (5, 4)
    assert world.positions[2:] == pytest.approx(np.array([ball.position for ball in balls]))
    assert arm.name == "arm" and np.isfinite(world.positions[1]).all()
    positions = world.positions.copy()
    positions[2:] += (0, 1, 0)
    world.positions = positions
    assert balls[2].position == pytest.approx([2, 1, 1])
    velocities = world.velocities.copy()
    velocities[3] = (1, 2, 3)
    world.velocities = velocities
    assert balls[1].velocity == pytest.approx([1, 2, 3]) and balls[0].velocity == pytest.approx([0, 0, 0])
    spins = world.angular_velocities.copy()
    spins[4] = (0, 0, 7)
    world.angular_velocities = spins
    assert balls[2].angular_velocity == pytest.approx([0, 0, 7])
    turned = world.orientations.copy()
    turned[2] = (0, 0, 1, 0)
    world.orientations = turned
    assert balls[0].orientation == pytest.approx([0, 0, 1, 0])
    before = world.save()
    with pytest.raises(tumble.InvalidValueError, match=r"positions: expected shape \(5, 3\), got \(4, 3\)"):
        world.positions = np.zeros((4, 3))
    moved = world.positions.copy()
    moved += 1
    with pytest.raises(tumble.InvalidValueError, match="'arm' is an articulation"):
        world.positions = moved
    turned[3] = (0, 0, 2, 0)
    with pytest.raises(tumble.InvalidValueError, match="row 3 has length 2; a quaternion has 1"):
        world.orientations = turned
    with pytest.raises(tumble.InvalidValueError, match="finite"):
        world.velocities = np.full((5, 3), np.nan)
    assert world.save() == before, "nothing is written on an error"


def sled(world):
    runner = tumble.Capsule(0.05, 0.8)
    turn = (0, np.sqrt(0.5), 0, np.sqrt(0.5))
    shape = tumble.Compound([(tumble.Box((0.6, 0.9, 0.06)), (0, 0, 0.12)), (runner, (0, 0.5, 0.05), turn), (runner, (0, -0.5, 0.05), turn)])
    return world.add_rigid("sled", shape, mass=2, velocity=(20, 0, 0), friction=0.3)


def test_parts_have_surface_constants_of_their_own(tmp_path):
    world = tumble.World()
    world.add_static("ground", tumble.HalfSpace(), friction=1)
    body = sled(world)
    body.set_shape_material(1, friction=0.01, adhesion=2)
    body.set_shape_material(1, restitution=0.5)
    body.set_shape_material(2, friction_scale=(1, 2, 1), surface_velocity=(0.1, 0, 0))
    assert [body.shape_material(k)["friction"] for k in range(3)] == [0.3, 0.01, 0.3]
    assert (body.shape_material(1)["adhesion"], body.shape_material(1)["restitution"]) == (2, 0.5)
    assert body.shape_material(2)["friction_scale"].tolist() == [1, 2, 1]
    world.save_scene(tmp_path / "sled.toml")
    copies = [world.fork(), tumble.World.load(tmp_path / "sled.toml"), pickle.loads(pickle.dumps(world))]
    for other in [world, *copies]:
        other.step(60)
        assert (other.state == world.state).all()
    assert abs(float(body.angular_velocity[2])) > 0.01
    body.set_shape_material(1)
    assert body.shape_material(1)["friction"] == 0.3 and body.shape_material(1)["adhesion"] == 0
    for call, words in [
        (lambda: body.set_shape_material(3, friction=1), "index of a shape"),
        (lambda: body.set_shape_material(1, friction=-1), "friction"),
        (lambda: body.set_shape_material(1, friction_scale=(1, 2)), "friction_scale"),
    ]:
        with pytest.raises(ValueError, match=words):
            call()


def test_a_one_way_body_collides_from_one_side(tmp_path):
    world = tumble.World()
    platform = world.add_static("platform", tumble.Box((1, 1, 0.1)), position=(0, 0, 1), one_way=(0, 0, 2))
    assert platform.one_way.tolist() == [0, 0, 2]
    ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=1, position=(0, 0, 0.2), velocity=(0, 0, 6))
    world.save_scene(tmp_path / "platform.toml")
    copies = [world.fork(), tumble.World.load(tmp_path / "platform.toml"), pickle.loads(pickle.dumps(world))]
    heights = []
    for _ in range(480):
        world.step()
        heights.append(float(ball.position[2]))
    assert max(heights) == pytest.approx(0.2 + 36 / (2 * 9.81), abs=2e-3) and heights[-1] == pytest.approx(1.15, abs=1e-3)
    for other in copies:
        other.step(480)
        assert (other.state == world.state).all()
    platform.one_way = None
    assert platform.one_way is None
    with pytest.raises(ValueError, match="one-way direction"):
        platform.one_way = (0, 0, 0)
