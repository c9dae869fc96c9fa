"""Cloth, jelly, particles, flocks and fields: numbers by hand, handles, errors, pictures, recordings."""

import math

import numpy as np
import pytest
import tumble

G = 9.81


@pytest.fixture
def world():
    return tumble.World()


def test_a_cloth_falls_as_a_point_and_its_pins_stay(world):
    free = world.add_cloth("free", nodes=(5, 4), size=(0.8, 0.6), mass=0.4, position=(0, 0, 2))
    hung = world.add_cloth("hung", nodes=(3, 3), pins=["y_max", 0], position=(2, 0, 2))
    assert free.positions.shape == (20, 3)
    assert free.masses.sum() == pytest.approx(0.4)
    assert list(np.flatnonzero(hung.pinned)) == [0, 6, 7, 8]
    start = hung.positions[hung.pinned]
    world.step(60)
    drop = 0.5 * G * world.time**2
    np.testing.assert_allclose(free.positions[:, 2], 2 - drop, atol=1e-9)
    np.testing.assert_allclose(free.velocities[:, 2], -G * world.time, atol=1e-9)
    np.testing.assert_array_equal(hung.positions[hung.pinned], start)
    assert hung.positions[1, 2] < 2 - 1e-3
    assert free.triangles.shape == (24, 3)
    assert free.triangles.max() == 19


def test_a_jelly_rests_on_the_floor(world):
    world.add_static("floor", tumble.HalfSpace())
    jelly = world.add_jelly("jelly", nodes=(3, 3, 3), size=(0.2, 0.2, 0.2), position=(0, 0, 0.2), node_radius=0.03)
    world.step(480)
    assert jelly.positions[:, 2].min() == pytest.approx(0.03, abs=1e-3)
    assert np.abs(jelly.velocities).max() < 0.05
    force = sum(c["force"][2] * (1 if c["bodies"][0] == -1 else -1) for c in world.contacts)
    assert force == pytest.approx(2.0 * G, rel=0.05)


def test_particles_are_born_fly_and_end(world):
    jet = tumble.Emitter((0, 0, 1), half_angle=0, speed=3, lifetime=0.5, rate=250)
    system = world.add_particles("jet", [jet], capacity=500, collidable=False)
    world.step(60)
    assert len(system) == 62
    assert system.positions[:, 2].max() <= 1 + 3**2 / (2 * G) + 1e-9
    np.testing.assert_array_equal(system.serials, np.arange(62))
    world.step(240)
    assert len(system) == pytest.approx(125, abs=1)
    assert ((system.lives > 0) & (system.lives <= 0.5)).all()
    number = system.spawn((5, 0, 0), (0, 0, 1), 2.0)
    assert number == 312
    assert system.positions[system.serials == number].tolist() == [[5, 0, 0]]


def test_an_emitter_rides_on_a_body(world):
    cart = world.add_rigid("cart", tumble.Sphere(0.1), mass=1, velocity=(2, 0, 0), gravity_scale=0)
    drops = world.add_particles("drops", [tumble.Emitter(body=cart, burst=10, speed=0)], collidable=False)
    world.step(1)
    np.testing.assert_allclose(drops.velocities[:, 0], 2, atol=1e-12)


def test_a_flock_grows_and_shrinks_in_flight(world):
    flock = world.add_flock("flock", desired_speed=5, speed_rate=1)
    first = flock.add("first", (0, 0, 5), (1, 0, 0))
    world.step(240)
    assert first.velocity[0] == pytest.approx(5 - 4 * (1 - 1 / 240) ** 240, abs=1e-9)
    second = flock.add("second", (3, 0.5, 5), (1, 0, 0))
    world.step(60)
    assert len(flock) == 2
    assert flock.boids == [first, second]
    assert world["second"] == second
    flock.remove("first")
    assert len(flock) == 1
    assert not first.exists
    with pytest.raises(tumble.RemovedError):
        _ = first.position
    world.step(10)
    flock.steering = {"desired_speed": 8}
    assert flock.steering["desired_speed"] == 8
    assert flock.steering["speed_rate"] == 1


def test_fields_have_their_closed_forms():
    world = tumble.World(gravity=(0, 0, 0))
    pulled = world.add_rigid("pulled", tumble.Sphere(0.1), mass=2)
    free = world.add_rigid("free", tumble.Sphere(0.1), mass=2, position=(5, 0, 0))
    world.add_field("planet", tumble.Field.attractor((0, 0, -10), 200), targets=[pulled])
    world.step()
    assert pulled.velocity[2] == pytest.approx(-2 / 240, rel=1e-6)
    assert free.velocity.tolist() == [0, 0, 0]
    world.remove("planet")
    speed = pulled.velocity[2]
    world.step()
    assert pulled.velocity[2] == speed


def test_a_ball_floats_and_a_wing_lifts():
    world = tumble.World()
    radius = 0.2
    half = 1000 * 2 / 3 * math.pi * radius**3
    ball = world.add_rigid("ball", tumble.Sphere(radius), mass=half)
    world.add_field("water", tumble.Field.buoyancy(drag=3.0), targets=["ball"])
    world.step(2000)
    assert ball.position[2] == pytest.approx(0, abs=1e-4)
    plate = world.add_rigid("plate", tumble.Box((1, 1, 0.02)), mass=5, position=(0, 0, 10), velocity=(10, 0, -1), gravity_scale=0)
    world.add_field("air", tumble.Field.panels([tumble.Panel(plate, 1.0, drag=0.0)]))
    before = plate.velocity[2]
    world.step()
    # F = ½·ρ·A·|u|·C·(u·n) at u = (−10, 0, 1)
    lift = 0.5 * 1.2 * math.sqrt(101) * 2 * math.pi * 1.0
    assert (plate.velocity[2] - before) * 5 * 240 == pytest.approx(lift, rel=0.02)


def test_handles_by_name_forks_and_removal(world):
    cloth = world.add_cloth("cloth", nodes=(3, 3))
    world.add_particles("smoke")
    world.add_flock("flock").add("boid")
    assert isinstance(world["cloth"], tumble.SpringMesh)
    assert isinstance(world["smoke"], tumble.ParticleSystem)
    assert isinstance(world["flock"], tumble.Flock)
    assert isinstance(world["boid"], tumble.Boid)
    fork = world.fork()
    world.step(5)
    fork.step(5)
    np.testing.assert_array_equal(fork["cloth"].positions, cloth.positions)
    with pytest.raises(tumble.InvalidValueError, match="another world"):
        fork.remove(cloth)
    world.remove(cloth)
    world.remove("smoke")
    assert not cloth.exists
    with pytest.raises(tumble.RemovedError):
        _ = cloth.positions


def test_a_snapshot_has_everything(world):
    world.add_cloth("cloth", nodes=(4, 4), pins=["x_min"])
    world.add_particles("smoke", [tumble.Emitter(rate=500, speed=(1, 2))])
    world.step(30)
    saved = world.save()
    world.step(30)
    state = world.state.copy()
    world.restore(saved)
    world.step(30)
    np.testing.assert_array_equal(world.state, state)


def test_non_spinning(world):
    body = world.add_rigid("b", tumble.Box((1, 1, 1)), mass=1, locked=["x"], non_spinning=True)
    assert set(body.locked) == {"x", "rotation_x", "rotation_y", "rotation_z"}
    body.apply_impulse((0, 1, 0), point=(0.5, 0, 0.5))
    world.step()
    assert body.orientation.tolist() == [0, 0, 0, 1]


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda w: w.add_cloth(nodes=(1, 5)), "nodes of a cloth is 1"),
        (lambda w: w.add_cloth(pins=["top"]), "no side 'top'"),
        (lambda w: w.add_cloth(nodes=(2, 2), pins=[4]), "pinned node is 4"),
        (lambda w: w.add_cloth(mass=0), "mass of a mesh is 0"),
        (lambda w: w.add_cloth(color=(2, 0, 0)), "from 0 to 1"),
        (lambda w: w.add_jelly(node_radius=-1), "radius of a node is -1"),
        (lambda w: w.add_particles(capacity=0), "capacity is 0"),
        (lambda w: w.add_particles(fade=-1), "fade of a particle is -1"),
        (lambda w: w.add_particles(opacity=1.5), "opacity of a particle is 1.5"),
        (lambda w: w.add_particles(opacity=(0.5, -0.5)), "opacity of a particle is -0.5"),
        (lambda w: w.add_particles(scale=(1, -2)), "scale of a particle is -2"),
        (lambda w: w.add_particles(end_color=(1, 2, 0)), "end_color"),
        (lambda w: tumble.Emitter(speed=(2, 1)), "speed of an emitter is 1"),
        (lambda w: w.add_flock(speed=1), "no constant 'speed'"),
        (lambda w: w.add_flock(matching=-1), "matching"),
        (lambda w: tumble.Field.wind((0, 0, math.inf)), "finite"),
        (lambda w: w.add_field("", tumble.Field.buoyancy()), "needs one"),
        (lambda w: w.add_field("f", tumble.Field.buoyancy(), targets=["nobody"]), "nobody"),
    ],
)
def test_errors_say_what_is_wrong(world, call, words):
    with pytest.raises((tumble.InvalidValueError, tumble.UnknownNameError), match=words):
        call(world)
    world.step()


def test_they_are_drawn(world):
    def picture():
        try:
            return world.render(160, 120, camera=((0, -4, 1), (0, 0, 1))).astype(int)
        except tumble.PictureError as why:
            pytest.skip(f"no graphics adapter: {why}")

    empty = picture()
    world.add_cloth("cloth", nodes=(8, 8), orientation=(math.sqrt(0.5), 0, 0, math.sqrt(0.5)), position=(0, 0, 1), color=(1, 0, 0))
    cloth = picture()
    changed = np.abs(cloth - empty).max(axis=2) > 20
    # a sheet of 1 m at 4 m, of a picture that shows 2·4·tan 20° = 2.91 m in 120 rows
    assert changed.sum() == pytest.approx((120 / 2.91) ** 2, rel=0.05)
    world.remove("cloth")
    system = world.add_particles("dot", drawn_radius=0.3, collidable=False)
    system.spawn((0, 0, 1))
    changed = np.abs(picture() - empty).max(axis=2) > 20
    assert changed.sum() == pytest.approx(math.pi * (0.3 * 120 / 2.91) ** 2, rel=0.1)


def test_a_transparent_particle_blends_with_what_is_behind(world):
    def middle():
        try:
            share = world.render(161, 121, camera=((0, -4, 1), (0, 0, 1)))[60, 80, :3] / 255
        except tumble.PictureError as why:
            pytest.skip(f"no graphics adapter: {why}")
        return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)

    behind = middle()
    smoke = world.add_particles("smoke", drawn_radius=0.3, collidable=False, color=(1, 0, 0), glow=True, opacity=(0.8, 0.4), end_color=(0, 0, 1))
    smoke.spawn((0, 0, 1), life=2)
    np.testing.assert_array_equal(smoke.lifetimes, [2])
    np.testing.assert_allclose(middle(), 0.8 * np.array([1, 0, 0]) + 0.2 * behind, atol=0.012)


def test_recordings_have_surfaces_and_particles(world, tmp_path):
    reader = pytest.importorskip("mcap.reader")
    world.add_cloth("cloth", nodes=(4, 3))
    world.add_particles("smoke", [tumble.Emitter(burst=50)])
    path = tmp_path / "run.mcap"
    with tumble.Recorder(path) as recorder:
        recorder.run(world, 10)
    with path.open("rb") as file:
        messages = [(channel.topic, message) for _, channel, message in reader.make_reader(file).iter_messages()]
    topics = [topic for topic, _ in messages]
    assert topics.count("/surfaces") == 11
    assert topics.count("/particles") == 10  # none before the burst
    last = [message for topic, message in messages if topic == "/particles"][-1]
    assert len(last.data) >= 50 * 16
    recording = tumble.read(path)
    assert recording.times.shape == (11,)
