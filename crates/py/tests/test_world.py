"""Worlds: stepping against closed forms, state, saving, forking, errors."""

import math
import pathlib
import pickle

import numpy as np
import pytest

import tumble


def ball_world(**settings):
    world = tumble.World(**settings)
    world.add_static("ground", tumble.HalfSpace())
    ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=2.0, position=(0, 0, 10))
    return world, ball


def test_a_thrown_ball_follows_its_parabola():
    world = tumble.World(gravity=(0.0, 0.0, -9.81), dt=1 / 240)
    ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=1.0, position=(1, 2, 3), velocity=(2, 0, 5))
    world.step(240)
    assert world.time == pytest.approx(1.0, abs=1e-12)
    assert ball.position == pytest.approx([3.0, 2.0, 3.0 + 5.0 - 0.5 * 9.81], abs=1e-9)
    assert ball.velocity == pytest.approx([2.0, 0.0, 5.0 - 9.81], abs=1e-9)


def test_energy_and_momentum_of_one_body_are_those_of_the_textbook():
    world = tumble.World(gravity=(0, 0, -10))
    world.add_rigid("box", tumble.Box((1, 2, 3)), mass=12.0, position=(0, 0, 4), velocity=(3, 0, 0), angular_velocity=(0, 0, 2))
    energy, momentum = world.energy(), world.momentum()
    spin = 12.0 * (1**2 + 2**2) / 12.0  # of a block about z: m (a² + b²) / 12
    assert energy.kinetic == pytest.approx(0.5 * 12 * 9 + 0.5 * spin * 4)
    assert energy.potential == pytest.approx(12 * 10 * 4)
    assert energy.total == energy["total"] == energy.kinetic + energy.potential
    assert momentum.linear == pytest.approx([36, 0, 0])
    assert momentum["angular"] == pytest.approx([0, 4 * 36, spin * 2])  # r × p + I ω


def test_a_ball_comes_to_rest_on_the_ground():
    world, ball = ball_world()
    world.step(3 * 240)
    assert ball.position[2] == pytest.approx(0.1, abs=1e-6)
    contacts = world.contacts
    assert len(contacts) == 1
    assert contacts["normal"][0] == pytest.approx(np.array([0, 0, 1.0]) * (1 if contacts["bodies"][0][0] == 1 else -1))
    assert abs(contacts["force"][0][2]) == pytest.approx(2.0 * 9.81, rel=1e-6)


def test_the_first_example_of_the_book_bounces():
    text = (pathlib.Path(__file__).parents[3] / "docs" / "python.md").read_text()
    names: dict[str, object] = {}
    exec(text.split("```python\n")[1].split("```")[0], names)
    # 0.9 m down, up and down again with half the speed, and up once more with a quarter of it, all in one second
    fall = math.sqrt(2 * 0.9 / 9.81)
    left = 1.0 - 2 * fall
    speed = 0.25 * 9.81 * fall
    assert names["ball"].position[2] == pytest.approx(0.1 + speed * left - 4.905 * left**2, abs=2e-3)
    assert names["ball"].velocity[2] == pytest.approx(speed - 9.81 * left, abs=1e-2)


def rebound(world, ball, height):
    """How high a ball rises that falls from ``height``: from its energy a little after the impact."""
    while world.time < math.sqrt(2 * height / 9.81) + 0.01:
        world.step()
    return ball.position[2] - 0.1 + ball.velocity[2] ** 2 / (2 * 9.81)


@pytest.mark.parametrize(
    ("rule", "restitution"), [(None, 0.8), ("min", 0.2), ("max", 0.8), ("average", 0.5), ("product", 0.16), ("geometric_mean", 0.4)]
)
def test_each_rule_gives_its_bounce(rule, restitution):
    world = tumble.World(**({} if rule is None else {"combine_restitution": rule}))
    assert world.combine_restitution == rule or (rule is None and world.combine_restitution == "max")
    ground = world.add_static("ground", tumble.HalfSpace(), restitution=0.2)
    ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=1.0, position=(0, 0, 1), restitution=0.8)
    assert world.pair_material(ground, "ball") == pytest.approx((restitution, 0.5))
    assert rebound(world, ball, 0.9) == pytest.approx(restitution**2 * 0.9, abs=1e-3)


def test_the_number_of_threads_changes_no_bit():
    def run(threads):
        world = tumble.World(threads=threads)
        assert world.threads == world.fork().threads == threads
        world.add_static("ground", tumble.HalfSpace())
        for i in range(100):
            world.add_rigid(f"b{i}", tumble.Box((0.1, 0.1, 0.1)), mass=1.0, position=(0.3 * (i // 4), 0, 0.05 + 0.11 * (i % 4)))
        world.step(30)
        assert pickle.loads(pickle.dumps(world)).threads == 1
        return world.state.copy()

    alone = run(1)
    for threads in (2, 3, 0):
        assert (run(threads) == alone).all()
    world = tumble.World.load("stack", threads=2)
    assert world.threads == 2
    world.threads = 1
    assert world.threads == 1
    with pytest.raises(ValueError, match="threads is 257; it must be 0 to 256"):
        world.threads = 257


def test_a_pair_has_restitution_and_friction_of_its_own():
    world = tumble.World(combine_friction="min")
    assert world.combine_friction == "min"
    ground = world.add_static("ground", tumble.HalfSpace(), friction=0.2)
    ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=1.0, position=(0, 0, 1))
    world.set_pair_material("ball", ground, restitution=0.6)
    fork = world.fork()
    assert fork.pair_material(ball.name, "ground") == (0.6, 0.2)
    assert pickle.loads(pickle.dumps(world)).pair_material("ground", "ball") == (0.6, 0.2)
    assert rebound(world, ball, 0.9) == pytest.approx(0.36 * 0.9, abs=1e-3)
    world.set_pair_material(ground, ball)
    assert world.pair_material(ball, ground) == (0.0, 0.2)
    world.combine_friction = "max"
    assert world.pair_material(ball, ground) == (0.0, 0.5)
    with pytest.raises(ValueError, match="restitution of a pair is 1.5; it must be 0 to 1"):
        world.set_pair_material(ball, ground, restitution=1.5)
    with pytest.raises(ValueError, match="combine_friction: `mim` is not known; did you mean `min`"):
        tumble.World(combine_friction="mim")


def test_a_link_has_a_pair_of_its_own():
    world = tumble.World()
    arm = world.add_articulation(str(pathlib.Path(__file__).parents[3] / "scenes" / "robot" / "arm.urdf"), name="arm")
    world.add_static("ground", tumble.HalfSpace(offset=-9))
    world.set_pair_material(arm, "ground", restitution=0.1)
    world.set_pair_material("arm/paddle", "ground", restitution=0.7)
    assert world.pair_material("ground", "arm/paddle")[0] == 0.7
    assert world.pair_material("ground", arm)[0] == 0.1
    with pytest.raises(KeyError, match="'arm' has no link named 'tail'"):
        world.set_pair_material("arm/tail", "ground", friction=0.1)


@pytest.mark.parametrize(
    ("shape", "volume"),
    [
        (tumble.Sphere(2.0), 4 / 3 * math.pi * 8),
        (tumble.Box((1, 2, 3)), 6.0),
        (tumble.Box(2.0), 8.0),
        (tumble.Capsule(0.5, 2.0), math.pi * 0.25 * 2.0 + 4 / 3 * math.pi * 0.125),
        (tumble.Cylinder(0.5, 2.0), math.pi * 0.25 * 2.0),
        (tumble.Compound([(tumble.Box(1), (0, 0, 0)), (tumble.Box(2), (9, 0, 0))]), 9.0),
    ],
)
def test_sizes_of_shapes_are_full_lengths(shape, volume):
    assert shape.volume == pytest.approx(volume)


def test_a_compound_has_the_densities_of_its_parts():
    world = tumble.World()
    parts = [(tumble.Sphere(0.1), (0, 0, 0), None, 1000), (tumble.Sphere(0.1), (0.4, 0, 0), (0, 0, 0, 1), 3000)]
    bell = tumble.Compound(parts)
    assert repr(bell) == "Compound(2 parts)"
    assert bell.center_of_mass == pytest.approx([0.3, 0, 0])
    body = world.add_rigid("bell", bell, position=(0, 0, 2))
    volume = 4 / 3 * math.pi * 0.1**3
    assert body.mass == pytest.approx(4000 * volume)
    assert body.position == pytest.approx([0, 0, 2])
    assert world.add_rigid("even", tumble.Compound([part[:2] for part in parts])).mass == pytest.approx(2000 * volume)
    assert world.cast_rays((0.4, 0, 9), (0, 0, -1))["shape"].tolist() == [1]


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        ([], "a compound of 0 parts; it must have 1 to 4096"),
        ([tumble.Sphere(1)], r"part 1 of a compound: expected \(shape, position\)"),
        ([(tumble.Sphere(1), (0, 0, 0)), (1, (0, 0, 0))], "part 2 of a compound: expected"),
        ([(tumble.Sphere(1), (0, 0, 0), None, -1)], "density is -1, but must be finite and above 0"),
        ([(tumble.HalfSpace(), (0, 0, 0))], "part 1 of a compound is a half-space"),
        ([(tumble.Sphere(1), (0, 0, 0)), (tumble.Sphere(1), (0, 0, 0), None, 5)], "part 2 of a compound has a density, unlike part 1"),
        ([(tumble.Sphere(1), (0, 0, math.nan))], "position"),
    ],
)
def test_wrong_compounds(parts, message):
    with pytest.raises(ValueError, match=message):
        tumble.Compound(parts)


def test_capsules_and_cylinders_lie_along_z():
    world = tumble.World()
    for name, shape in [("capsule", tumble.Capsule(0.1, 2.0)), ("cylinder", tumble.Cylinder(0.1, 2.0))]:
        inertia = world.add_rigid(name, shape, mass=1.0).inertia
        assert inertia[2, 2] < 0.1 * inertia[0, 0] and inertia[0, 0] == pytest.approx(inertia[1, 1])
    assert world["cylinder"].inertia[2, 2] == pytest.approx(0.5 * 0.1**2)


@pytest.mark.parametrize("normal", [(0, 0, 1), (0, 0, -1), (1, 0, 0), (3, -4, 12)])
def test_a_ball_rests_where_its_half_space_ends(normal):
    n = np.array(normal) / np.linalg.norm(normal)
    world = tumble.World(gravity=-9.81 * n)
    world.add_static("wall", tumble.HalfSpace(normal, 0.5))
    ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=1.0, position=2 * n)
    world.step(480)
    assert ball.position == pytest.approx(0.6 * n, abs=1e-6)


def corner_cube():
    """A cube of edge 1 whose corner is the origin of its vertices."""
    corners = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return corners, tumble.Mesh(corners, [t for a, b, c, d in sides for t in ((a, b, c), (a, c, d))])


def test_a_mesh_keeps_the_frame_of_its_vertices(tmp_path):
    corners, cube = corner_cube()
    assert cube.vertices == pytest.approx(np.array(corners), abs=1e-15)
    assert cube.center_of_mass == pytest.approx([0.5, 0.5, 0.5])
    world = tumble.World(gravity=(0, 0, 0))
    quarter = (0, 0, math.sqrt(0.5), math.sqrt(0.5))  # about z: (x, y, z) -> (-y, x, z)
    body = world.add_rigid("cube", cube, mass=2.0, position=(3, -2, 5), orientation=quarter, angular_velocity=(0, 0, 2))
    assert body.position == pytest.approx([3, -2, 5], abs=1e-14)
    assert body.center_of_mass == pytest.approx([0.5, 0.5, 0.5])
    assert body.world_center_of_mass == pytest.approx([2.5, -1.5, 5.5], abs=1e-14)
    assert world.state[:3] == pytest.approx(body.world_center_of_mass)
    for corner in corners:
        assert body.to_world(corner) == pytest.approx([3 - corner[1], -2 + corner[0], 5 + corner[2]], abs=1e-14)
    momentum = world.momentum()
    with tumble.Recorder(tmp_path / "run.mcap") as recorder:
        recorder.frame(world)
        world.step(240)
        recorder.frame(world)
    # the middle stands still, and the corner goes round it at 2 rad/s
    assert body.world_center_of_mass == pytest.approx([2.5, -1.5, 5.5], abs=1e-12)
    s, c = math.sin(2.0), math.cos(2.0)
    assert body.position == pytest.approx([2.5 + 0.5 * c + 0.5 * s, -1.5 + 0.5 * s - 0.5 * c, 5], abs=1e-9)
    assert world.momentum().angular == pytest.approx(momentum.angular, abs=1e-12)
    recorded = tumble.read(tmp_path / "run.mcap").position("cube")
    assert recorded[0] == pytest.approx([3, -2, 5], abs=1e-14) and (recorded[1] == body.position).all()
    body.position = (1, 1, 1)
    assert body.position == pytest.approx([1, 1, 1], abs=1e-14)
    body.orientation = (0, 0, 0, 1)
    assert body.position == pytest.approx([1, 1, 1], abs=1e-14)
    assert body.world_center_of_mass == pytest.approx([1.5, 1.5, 1.5], abs=1e-14)


def test_a_mesh_stands_where_its_frame_is_put():
    world = tumble.World()
    world.add_static("ground", tumble.HalfSpace())
    body = world.add_rigid("cube", corner_cube()[1], mass=1.0)  # its lowest face lies in z = 0
    world.step(240)
    assert body.position == pytest.approx([0, 0, 0], abs=1e-6)
    text = (
        '[meshes.cone]\ntype = "lathe"\nprofile_m = [[0, 0], [1, 0], [0, 1]]\n'
        '[[body]]\nname = "cone"\nshape = { type = "mesh", mesh = "cone" }\nmass_kg = 1\nposition_m = [1, 2, 3]\n'
    )
    cone = tumble.World.parse(text)["cone"]
    assert cone.position == pytest.approx([1, 2, 3], abs=1e-14)
    assert cone.world_center_of_mass == pytest.approx([1, 2, 3.25], abs=1e-9)  # a quarter of its height up


def test_a_pair_goes_by_spheres_if_either_asks_for_it():
    """A cube of triangles that just touches the ground: by its surface the gap is 0, by the balls of its tree they overlap by what those reach beyond it."""
    corners = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    cube = tumble.Mesh(corners, [t for a, b, c, d in sides for t in ((a, b, c), (a, c, d))])

    def depth(body, ground):
        world = tumble.World(gravity=(0, 0, 0))
        world.add_static("ground", tumble.HalfSpace(), contacts=ground)
        world.add_rigid("cube", cube, mass=1.0, position=(0, 0, 1 - 1e-9), contacts=body)
        world.step()
        return world.contacts["depth"].max()

    assert depth("surface", "surface") < 1e-6
    for modes in [("spheres", "surface"), ("surface", "spheres"), ("spheres", "spheres")]:
        assert depth(*modes) > 1e-3, modes
    with pytest.raises(ValueError, match="contacts: `balls` is not known; there are surface, spheres"):
        tumble.World().add_static("ground", tumble.HalfSpace(), contacts="balls")


def test_state_is_a_view_that_follows_until_bodies_come_or_go():
    world, ball = ball_world()
    state = world.state
    assert np.shares_memory(state, world.state)
    assert not state.flags.writeable and state.shape == (26,)
    world.step(10)
    assert state[13 + 2] == ball.position[2] < 10
    world.add_rigid("other", tumble.Sphere(1.0), mass=1.0, position=(5, 5, 5))
    kept = state.copy()
    world.step(10)
    assert (state == kept).all() and world.state.shape == (39,)
    assert not np.shares_memory(state, world.state)


def test_setting_the_state_moves_the_bodies():
    world, ball = ball_world()
    x = world.state.copy()
    x[13:16] = [1, 2, 3]
    world.state = x
    assert (ball.position == [1, 2, 3]).all()
    x[13 + 3 : 13 + 7] = 0  # no quaternion
    with pytest.raises(ValueError, match="ball"):
        world.state = x
    assert (ball.position == [1, 2, 3]).all()


def test_saved_and_forked_worlds_have_the_same_future():
    world, _ = ball_world()
    world.step(100)
    saved, fork = world.save(), world.fork()
    world.step(200)
    fork.step(200)
    assert fork.save() == world.save()
    world.restore(saved)
    assert world.time == pytest.approx(100 / 240)
    world.step(200)
    assert fork.save() == world.save()


def test_a_missing_scene_is_a_missing_file():
    for path in ["nowhere/scene.toml", "no_such_scene"]:
        with pytest.raises(FileNotFoundError, match="no") as caught:
            tumble.World.load(path)
        assert isinstance(caught.value, tumble.TumbleError)


def test_names_are_optional_and_of_any_length():
    world = tumble.World()
    ground = world.add_static(tumble.HalfSpace())
    ball = world.add_rigid(tumble.Sphere(0.1), mass=1.0, position=(0, 0, 1))
    keyword = world.add_rigid(shape=tumble.Sphere(0.1), mass=1.0, position=(3, 0, 1))
    long = world.add_rigid("x" * 200, tumble.Sphere(0.1), 1.0, position=(6, 0, 1))
    assert [body.name for body in world.bodies] == ["body 0", "body 1", "body 2", "x" * 200] == [b.name for b in (ground, ball, keyword, long)]
    assert world["body 1"] == ball
    world.step(10)
    saved = world.save()
    world.step(10)
    world.restore(saved)
    assert world.save() == saved == pickle.loads(pickle.dumps(world)).save()
    with pytest.raises(tumble.InvalidValueError, match="an object named 'body 1' is already in the world"):
        world.add_rigid("body 1", tumble.Sphere(0.1), mass=1.0)
    with pytest.raises(TypeError, match="a shape is missing"):
        world.add_rigid("ball")
    with pytest.raises(TypeError):
        world.add_rigid(tumble.Sphere(0.1), tumble.Sphere(0.2))
