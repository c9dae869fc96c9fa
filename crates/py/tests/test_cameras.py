"""Depth and segmentation cameras and shapes of signed distances, from Python and scene files."""

import copy
import pickle

import numpy as np
import pytest

import tumble


def seen(world):
    return {name: np.array(world.sensors[name]) for name in ("depth", "parts")}


def room():
    world = tumble.World()
    world.add_static("ground", tumble.HalfSpace())
    world.add_rigid("ball", tumble.Sphere(0.5), mass=1, position=(0, 0, 0.5))
    arm = tumble.ArticulationBuilder("arm")
    arm.add_link("upper", shape=tumble.Box((0.2, 0.2, 1)), shape_position=(0, 0, 0.5), mass=1, axis=(0, 1, 0))
    arm.add_link("lower", "upper", shape=tumble.Box((0.2, 0.2, 1)), shape_position=(0, 0, 0.5), position=(0, 0, 1), mass=1, axis=(0, 1, 0))
    world.add_articulation(arm, base=(1.2, 0, 0.01))
    eye = {"position": (0, 0, 4), "orientation": (1, 0, 0, 0), "resolution": (60, 40), "vertical_fov": 1.0}
    world.add_sensor("depth", name="depth", **eye)
    world.add_sensor("segmentation", name="parts", **eye)
    return world


def test_images_have_the_depth_of_a_sphere_and_name_bodies_and_links():
    world = room()
    images = seen(world)
    assert images["depth"].shape == (40, 60) and images["parts"].shape == (40, 60, 2) and images["parts"].dtype == np.int32
    focal = 20 / np.tan(0.5)
    column, row = np.meshgrid(np.arange(60) + 0.5 - 30, np.arange(40) + 0.5 - 20)
    # from the eye at (0, 0, 4), z down: the ball is at 3.5 m, of 0.5 m
    x, y = column / focal, row / focal
    a, b, c = x**2 + y**2 + 1, 3.5, 3.5**2 - 0.25
    root = b**2 - a * c
    names = [body.name for body in world.bodies]
    ball = images["parts"][..., 0] == names.index("ball")
    assert (ball == (root >= 0)).all() and ball.sum() > 50
    assert images["depth"][ball] == pytest.approx(((b - np.sqrt(root[ball])) / a[ball]), abs=1e-12)
    ground = images["parts"][..., 0] == names.index("ground")
    assert images["depth"][ground] == pytest.approx(4, abs=1e-12)
    arm = images["parts"][..., 0] == names.index("arm")
    links = world["arm"].link_names
    assert {links[k] for k in np.unique(images["parts"][arm][:, 1])} == {"lower"} or "upper" in {links[k] for k in np.unique(images["parts"][arm][:, 1])}
    assert arm.sum() > 5


def test_images_follow_the_state_in_copies_saved_scenes_replays_and_forks(tmp_path):
    world = room()
    with tumble.Recorder(tmp_path / "run.mcap") as recorder:
        for _ in range(20):
            world.step()
            recorder.frame(world)
    images = seen(world)
    world.save_scene(tmp_path / "room.toml")
    for other in (copy.deepcopy(world), pickle.loads(pickle.dumps(world)), world.fork(), tumble.World.load(tmp_path / "room.toml")):
        assert all((seen(other)[name] == image).all() for name, image in images.items())
    world.threads = 2
    assert all((seen(world)[name] == image).all() for name, image in images.items())
    assert list(world.sensors) == ["depth", "parts"] and [image.shape for image in world.sensors.values()] == [(40, 60), (40, 60, 2)]
    handle = world.sensors.handle("depth")
    assert handle.kind == "depth" and (handle.value == images["depth"]).all()
    world.remove("ball")
    assert not (world.sensors["depth"] == images["depth"]).all()


def test_noise_of_a_camera_and_wrong_arguments():
    world = tumble.World()
    world.add_static("ground", tumble.HalfSpace())
    eye = {"position": (0, 0, 2), "orientation": (1, 0, 0, 0), "resolution": (100, 100)}
    world.add_sensor("depth", name="eye", deviation=0.01, seed=5, **eye)
    image = world.sensors["eye"]
    assert np.std(image) == pytest.approx(0.01, rel=0.05) and (world.sensors["eye"] == image).all()
    world.step()
    assert not (world.sensors["eye"] == image).all()
    world.add_sensor("depth", name="short", cutoff=1.5, **eye)
    assert (world.sensors["short"] == -1).all()
    for arguments, why in [
        ({"kind": "depth", "resolution": (0, 5)}, "number of pixels"),
        ({"kind": "depth", "vertical_fov": 4.0}, "angle of view"),
        ({"kind": "depth", "resolution": (1000, 1000), "delay": 5}, "pixels that its delay keeps is 5000000; it must be at most 4194304"),
        ({"kind": "segmentation", "deviation": 0.1}, "no noise"),
        ({"kind": "segmentation", "bias_walk": 0.1}, "it may have a delay"),
        ({"kind": "gyroscope", "resolution": (5, 5)}, "only cameras"),
    ]:
        with pytest.raises(ValueError, match=why):
            world.add_sensor(**arguments)
    with pytest.raises(ValueError, match="camera"):
        tumble.Batch(world, 2).sensor("eye")


@pytest.mark.parametrize("kind", ["depth", "color", "segmentation"])
def test_images_that_are_late_and_have_a_bias(kind, tmp_path):
    noise = {} if kind == "segmentation" else {"deviation": 0.01, "bias_walk": 0.5, "seed": 7}
    worlds = []
    for delay in (0, 2):
        world = tumble.World()
        world.add_static("ground", tumble.HalfSpace())
        world.add_rigid("ball", tumble.Sphere(0.2), mass=1, position=(0, 0, 2))
        eye = {"position": (0, 0, 3), "orientation": (1, 0, 0, 0), "resolution": (20, 15)}
        world.add_sensor(kind, name="eye", delay=delay, **noise, **eye)
        worlds.append(world)
    prompt, late = worlds
    images = [prompt.sensors["eye"]]
    for _ in range(40):
        prompt.step()
        late.step()
        images.append(prompt.sensors["eye"])
        assert (late.sensors["eye"] == images[max(len(images) - 3, 0)]).all()
    assert (images[-1] != images[0]).any()
    late.save_scene(tmp_path / "late.toml")
    assert "delay = 2" in (tmp_path / "late.toml").read_text()
    copies = [late.fork(), pickle.loads(pickle.dumps(late)), tumble.World.load(tmp_path / "late.toml")]
    late.step(5)
    for copied in copies:
        copied.step(5)
        assert (copied.sensors["eye"] == late.sensors["eye"]).all()


def test_a_scene_with_cameras(tmp_path):
    scene = tmp_path / "scene.toml"
    text = """
[[body]]
name = "ground"
mode = "static"
shape = { type = "half_space" }
[[sensor]]
name = "eye"
type = "depth"
position_m = [0, 0, 3]
orientation_xyzw = [1, 0, 0, 0]
resolution = [32, 16]
vertical_fov_deg = 60
deviation = 0.001
seed = 4
"""
    scene.write_text(text)
    world = tumble.World.load(scene)
    assert world.sensors["eye"].shape == (16, 32) and world.sensors["eye"] == pytest.approx(3, abs=0.01)
    for wrong, why in [("resolution = [32, 0]", "resolution"), ("resolution = [1e5, 1e5]", "resolution"), ("resolution = [2.5, 2]", "resolution")]:
        scene.write_text(text.replace("resolution = [32, 16]", wrong))
        with pytest.raises(tumble.SceneError, match=why):
            tumble.World.load(scene)


def ring(cells=41):
    axis = np.linspace(-0.5, 0.5, cells)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    # not symmetric: a ring about z, shifted along x
    return np.hypot(np.hypot(x - 0.05, y) - 0.3, z) - 0.1


def test_a_signed_distance_is_a_solid_in_python_and_in_scene_files(tmp_path):
    values, corners = ring(), {"low": (-0.5, -0.5, -0.5), "high": (0.5, 0.5, 0.5)}
    shape = tumble.Sdf(values, **corners)
    # cells of 25 mm cut the corners of a ring of 0.1 m by a hundredth
    assert shape.volume == pytest.approx(2 * np.pi**2 * 0.3 * 0.01, rel=0.015)
    assert shape.center_of_mass == pytest.approx([0.05, 0, 0], abs=1e-3) and "41 x 41 x 41" in repr(shape)
    for kind in ("<f8", "<f4"):
        for order in ("C", "F"):
            np.save(tmp_path / "ring.npy", np.asarray(values, dtype=kind, order=order))
            assert tumble.Sdf(tmp_path / "ring.npy", **corners).volume == pytest.approx(shape.volume, rel=1e-6)
    np.save(tmp_path / "ring.npy", values)
    scene = tmp_path / "scene.toml"
    text = """
[meshes.ring]
type = "sdf"
file = "ring.npy"
low_m = [-0.5, -0.5, -0.5]
high_m = [0.5, 0.5, 0.5]
[[body]]
name = "ground"
mode = "static"
shape = { type = "half_space" }
[[body]]
name = "ring"
shape = { type = "mesh", mesh = "ring" }
density_kg_per_m3 = 1000
position_m = [0, 0, 0.2]
"""
    scene.write_text(text)
    loaded, made = tumble.World.load(scene), tumble.World()
    made.add_static("ground", tumble.HalfSpace())
    made.add_rigid("ring", shape, density=1000, position=(0, 0, 0.2))
    for world in (loaded, made):
        world.step(240)
        assert world["ring"].mass == pytest.approx(1000 * shape.volume, rel=1e-9)
        assert world["ring"].position[2] == pytest.approx(0.1, abs=2e-3)
    assert type(pickle.loads(pickle.dumps(shape))) is tumble.Sdf
    scene.write_text(text.replace("ring.npy", "other.npy"))
    with pytest.raises(tumble.SceneError, match="other.npy"):
        tumble.World.load(scene)
    scene.write_text(text.replace("low_m = [-0.5, -0.5, -0.5]", "low_m = [0.5, -0.5, -0.5]"))
    with pytest.raises(tumble.SceneError, match="above 0"):
        tumble.World.load(scene)


def test_damaged_grids_are_refused_with_a_message(tmp_path):
    corners = {"low": (-0.5, -0.5, -0.5), "high": (0.5, 0.5, 0.5)}
    path = tmp_path / "grid.npy"
    np.save(path, ring(11))
    whole = path.read_bytes()
    rng = np.random.default_rng(0)
    cases = [b"", b"\x93NUMPY", whole[:9], whole[:100], whole[:-8], whole + b"1234", b"x" + whole]
    cases += [bytes(rng.integers(0, 256, 200, dtype=np.uint8)) for _ in range(100)]
    for _ in range(300):
        damaged = bytearray(whole[:400])
        for _ in range(3):
            damaged[rng.integers(0, 128)] = rng.integers(0, 256)
        cases.append(bytes(damaged))
    for case in cases:
        path.write_bytes(case)
        with pytest.raises(ValueError, match=r"grid\.npy"):
            tumble.Sdf(path, **corners)
    for array, why in [(np.zeros((4, 4)), "axes"), (np.zeros((4, 4, 4), dtype=int), "descr|numbers"), (np.ones((4, 4, 4)), "inside")]:
        np.save(path, array)
        with pytest.raises(ValueError, match=why):
            tumble.Sdf(path, **corners)
    with pytest.raises(ValueError, match="shape"):
        tumble.Sdf(np.zeros((4, 4)), **corners)
    with pytest.raises(ValueError, match="surround"):
        tumble.Sdf(-np.ones((4, 4, 4)), **corners)
    with pytest.raises(ValueError, match="above 0"):
        tumble.Sdf(np.ones((4, 4, 4)), low=(0, 0, 0), high=(0, 1, 1))
