"""Appearances, cameras and lights of bodies in Python: as scene files have them, kept by saved scenes, archives and pickles, and seen in pictures."""

import pickle
import struct
import zlib

import numpy as np
import pytest

import tumble

LOOK = tumble.Appearance(
    color=(0.9, 0.2, 0.1), second_color=(0.1, 0.2, 0.3), pattern="checker", pattern_scale=0.05, pattern_offset=0.02, roughness=0.25, metallic=0.75, clearcoat=0.5
)
SCENE = """
[[body]]
name = "box"
shape = { type = "box", size_m = [0.2, 0.2, 0.2] }
mass_kg = 1.0
color = [0.9, 0.2, 0.1]
second_color = [0.1, 0.2, 0.3]
pattern = "checker"
pattern_scale_m = 0.05
pattern_offset_m = 0.02
roughness = 0.25
metallic = 0.75
clearcoat = 0.5
camera = { position_m = [0.0, 0.0, 0.3], forward = [0.0, 1.0, 0.0], vertical_fov_deg = 60.0, near_m = 0.1, far_m = 50.0 }
light = { type = "point", position_m = [0.0, 0.0, 0.2], color = [1.0, 0.5, 0.25], intensity = 3.0, radius_m = 0.02 }
"""


def png(path, color):
    """Writes a picture of one pixel."""
    chunk = lambda kind, body: struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    head = chunk(b"IHDR", struct.pack(">IIBBBBB", 1, 1, 8, 2, 0, 0, 0))
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + head + chunk(b"IDAT", zlib.compress(b"\0" + bytes(color))) + chunk(b"IEND", b""))


def equal(a, b):
    assert a._replace(color=0, second_color=0) == b._replace(color=0, second_color=0)
    assert a.color == pytest.approx(b.color) and a.second_color == pytest.approx(b.second_color)


def test_a_program_says_what_a_scene_says(tmp_path):
    world = tumble.World()
    box = world.add_rigid("box", tumble.Box((0.2, 0.2, 0.2)), mass=1, appearance=LOOK)
    box.attach_camera((0, 0, 0.3), (0, 1, 0), fov_deg=60, near=0.1, far=50)
    box.attach_light(position=(0, 0, 0.2), color=(1, 0.5, 0.25), intensity=3, radius=0.02)
    equal(box.appearance, LOOK)
    read = tumble.World.parse(SCENE)
    equal(read["box"].appearance, LOOK)
    texts = []
    for each in (world, read):
        each.save_scene(tmp_path / "saved.toml")
        texts.append((tmp_path / "saved.toml").read_text())
    lines = [{line.strip() for line in text.splitlines() if "camera" in line or "light" in line or "pattern" in line or "rough" in line} for text in texts]
    assert lines[0] == lines[1] and len(lines[0]) >= 4, lines
    again = tumble.World.load(tmp_path / "saved.toml")
    equal(again["box"].appearance, LOOK)
    equal(pickle.loads(pickle.dumps(world))["box"].appearance, LOOK)
    equal(world.fork()["box"].appearance, LOOK)


def test_an_appearance_can_be_changed_and_reaches_links(tmp_path):
    png(tmp_path / "red.png", (255, 0, 0))
    world = tumble.World()
    ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=1)
    ball.appearance = ball.appearance._replace(texture=tmp_path / "red.png", glow=True, detail="wireframe")
    assert str(ball.appearance.texture) == str(tmp_path / "red.png") and ball.appearance.glow and ball.appearance.detail == "wireframe"
    floor = world.add_static("floor", tumble.HalfSpace(), appearance=LOOK)
    equal(floor.appearance, LOOK)
    builder = tumble.ArticulationBuilder("arm")
    builder.add_link("upper", shape=tumble.Box((0.1, 0.1, 0.4)), mass=1, appearance=LOOK)
    builder.add_shape("upper", tumble.Sphere(0.1), (0, 0, 0.3), appearance=tumble.Appearance(color=(0, 1, 0), pattern="rings"))
    world.add_articulation(builder)
    world.save_scene(tmp_path / "saved.toml")
    text = (tmp_path / "saved.toml").read_text()
    assert text.count("checker") == 2 and 'pattern = "rings"' in text and "red.png" in text and "wireframe" in text
    tumble.World.load(tmp_path / "saved.toml")


def test_a_link_carries_a_camera_and_a_light(tmp_path):
    builder = tumble.ArticulationBuilder("arm")
    builder.add_link("upper", axis=(0, 1, 0), shape=tumble.Box((0.1, 0.1, 0.4)), mass=1, position=(0, 0, 1))
    builder.add_link("hand", "upper", joint="fixed", shape=tumble.Sphere(0.05), mass=0.1, position=(0, 0, -0.3))
    world = tumble.World()
    arm = world.add_articulation(builder)
    arm.link("hand").attach_camera((0, 0, -0.1), (0, 0, -1), (1, 0, 0), fov_deg=60)
    arm.link("upper").attach_light(position=(0.1, 0, 0), intensity=3)
    for again in (lambda: arm.link("upper").attach_camera(), lambda: arm.link("hand").attach_light()):
        with pytest.raises(ValueError, match="at most one"):
            again()

    def carried(world):
        world.save_scene(tmp_path / "saved.toml")
        return [line for line in (tmp_path / "saved.toml").read_text().splitlines() if line.startswith(("camera = ", "light = "))]

    lines = carried(world)
    # the hand is 0.3 m below the link that carries it
    assert len(lines) == 2 and "position_m = [0.0, 0.0, -0.4]" in lines[0] and "intensity = 3.0" in lines[1], lines
    for copy in (tumble.World.load(tmp_path / "saved.toml"), world.fork(), pickle.loads(pickle.dumps(world))):
        assert carried(copy) == lines


@pytest.mark.parametrize("kind", ["body", "link", "fixed link"])
def test_cameras_and_lights_are_read_replaced_and_removed(tmp_path, kind):
    world = tumble.World()
    builder = tumble.ArticulationBuilder("arm")
    builder.add_link("upper", axis=(0, 1, 0), shape=tumble.Box((0.1, 0.1, 0.4)), mass=1, position=(0, 0, 1))
    builder.add_link("hand", "upper", joint="fixed", shape=tumble.Sphere(0.05), mass=0.1, position=(0, 0, -0.3))
    arm = world.add_articulation(builder)
    # its center of mass is not the origin of its frame
    cone = world.add_rigid("cone", tumble.Compound([(tumble.Sphere(0.1), (0, 0, 0.5))]), mass=1)

    def carrier(world):
        return {"body": world["cone"], "link": world["arm"].link("upper"), "fixed link": world["arm"].link("hand")}[kind]

    body = carrier(world)
    assert arm.exists and cone.exists and body.camera is None and body.light is None
    body.attach_camera((0, 0, -0.1), (0, 0, -1), (1, 0, 0), fov_deg=60, near=0.1, far=20)
    body.attach_light(position=(0.1, 0, 0.2), color=(1, 0.5, 0), intensity=3, radius=0.02)

    def both(body):
        camera, light = body.camera, body.light
        return [np.concatenate([np.atleast_1d(np.asarray(v, float)) for k, v in each.items() if k != "kind"]) for each in (camera, light)]

    camera, light = body.camera, body.light
    assert set(camera) == {"position", "forward", "up", "fov_deg", "near", "far"} and light["kind"] == "point"
    expected = [[0, 0, -0.1, 0, 0, -1, 1, 0, 0, 60, 0.1, 20], [0.1, 0, 0.2, 0.02, 1, 0.5, 0, 3, 0]]
    for found, right in zip(both(body), expected):
        assert found == pytest.approx(right, abs=1e-12)
    if kind != "body":
        other = world["arm"].link({"link": "hand", "fixed link": "upper"}[kind])
        offset = {"link": 0.3, "fixed link": -0.3}[kind]
        assert other.camera["position"] == pytest.approx((0, 0, -0.1 + offset)), "the same one in the frame of the other link"
    # what is read can be set
    body.camera, body.light = camera, light
    for found, right in zip(both(body), expected):
        assert found == pytest.approx(right, abs=1e-12)
    body.camera = {**camera, "fov_deg": 75}
    body.light = {"kind": "directional", "direction": (0, 0, -1)}
    assert body.light["casts_shadow"] is True and "position" not in body.light
    world.save_scene(tmp_path / "saved.toml")
    text = (tmp_path / "saved.toml").read_text()
    assert text.count("vertical_fov_deg = ") == 1 and "vertical_fov_deg = 75.0" in text and 'type = "directional"' in text
    for copy in (tumble.World.load(tmp_path / "saved.toml"), world.fork(), pickle.loads(pickle.dumps(world))):
        assert carrier(copy).camera["fov_deg"] == pytest.approx(75) and carrier(copy).light["direction"] == pytest.approx((0, 0, -1))
    for wrong, said in [({"fov_deg": 180}, "fov_deg is 180"), ({"fov": 60}, "camera: unknown argument 'fov'; expected position, forward"), ({"near": "close"}, "camera: near: expected a number")]:
        with pytest.raises(tumble.InvalidValueError, match=said):
            body.camera = wrong
    with pytest.raises(tumble.InvalidValueError, match="light: unknown argument 'tint'"):
        body.light = {"tint": (1, 1, 1)}
    assert body.camera["fov_deg"] == pytest.approx(75), "an error changes nothing"
    body.camera = body.light = None
    assert body.camera is None and body.light is None
    world.save_scene(tmp_path / "saved.toml")
    text = (tmp_path / "saved.toml").read_text()
    assert "camera = " not in text and "light = " not in text
    body.attach_camera()
    body.attach_light()


def test_a_camera_sees_up_to_its_cutoff():
    world = tumble.World()
    world.add_static("near", tumble.Sphere(0.5), position=(0, 0, 3))
    world.add_static("far", tumble.Box((50, 50, 1)), position=(0, 0, 10))
    for kind, nothing in (("color", 0), ("depth", -1), ("segmentation", -1)):
        seen = [world.add_sensor(kind, None, resolution=(8, 8), cutoff=cutoff).value for cutoff in (None, 5.0)]
        assert not (seen[0] == nothing).any() and (seen[1] == nothing).any() and not (seen[1][4, 4] == nothing).all(), kind


def test_a_light_and_a_glow_are_seen():
    world = tumble.World()
    world.add_static("wall", tumble.Box((2, 0.1, 2)), position=(0, 1, 0), appearance=tumble.Appearance(color=(1, 1, 1)))
    lamp = world.add_rigid("lamp", tumble.Sphere(0.05), mass=1, appearance=tumble.Appearance(color=(0, 1, 0), glow=True))
    view = {"camera": tumble.Camera((0, -2, 0), (0, 1, 0))}
    try:
        before = world.render(64, 64, **view).astype(float)
    except tumble.PictureError as error:
        pytest.skip(f"SKIPPED: {error}")
    middle = before[32, 32, :3]
    assert middle[1] > 250 and middle[0] < 10 and middle[2] < 10, "its color as it is"
    lamp.attach_light(position=(0, 0.1, 0), color=(1, 0, 0), intensity=2)
    after = world.render(64, 64, **view).astype(float)
    wall = (slice(20, 26), slice(20, 26))
    red, blue = (after[wall] - before[wall])[..., 0].mean(), (after[wall] - before[wall])[..., 2].mean()
    assert red > 10 > abs(blue) + 5, (red, blue)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"roughness": 1.5}, "appearance.roughness is 1.5; expected 0 to 1"),
        ({"color": (2, 0, 0)}, "appearance.color: 2 is not from 0 to 1"),
        ({"pattern": "dots"}, "appearance.pattern is 'dots'; expected one of plain, checker"),
        ({"pattern_scale": 0.0}, "appearance.pattern_scale is 0; expected a length above 0"),
        ({"detail": "low"}, "appearance.detail is 'low'; expected full, simplified"),
        ({"texture": "none.png"}, "appearance.texture is none.png: there is no such file; expected a PNG file"),
        ({"texture": __file__}, "test_looks.py: the texture is no PNG: .*; expected a PNG file"),
        ({"detail": "sphere_tree=99"}, "appearance.detail is 'sphere_tree=99'; expected full, .*sphere_tree=LEVEL, LEVEL from 0 to 63"),
        ({"clearcoat": np.nan}, "appearance.clearcoat is NaN"),
    ],
)
def test_wrong_appearances_are_named(change, said):
    world = tumble.World()
    with pytest.raises(tumble.InvalidValueError, match=said):
        world.add_rigid("ball", tumble.Sphere(0.1), mass=1, appearance=LOOK._replace(**change))
    assert len(world.bodies) == 0
    with pytest.raises(tumble.InvalidValueError, match="expected a tumble.Appearance"):
        world.add_rigid("ball", tumble.Sphere(0.1), mass=1, appearance="red")


def test_wrong_cameras_and_lights_are_named():
    world = tumble.World()
    ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=1)
    for words, said in [
        ({"forward": (0, 0, 1)}, "not parallel"),
        ({"fov_deg": 180}, "fov_deg is 180; expected 1 to 170"),
        ({"near": 2, "far": 1}, "near is 2 and far is 1"),
    ]:
        with pytest.raises(tumble.InvalidValueError, match=said):
            ball.attach_camera(**words)
    for words, said in [
        ({"kind": "spot"}, "kind is 'spot'; expected 'point' or 'directional'"),
        ({"kind": "directional"}, "a directional light needs one"),
        ({"radius": 0}, "radius is 0"),
        ({"intensity": -1}, "intensity is -1"),
        ({"color": (0, 0, 3)}, "color: 3 is not from 0 to 1"),
    ]:
        with pytest.raises(tumble.InvalidValueError, match=said):
            ball.attach_light(**words)
    ball.attach_camera()
    with pytest.raises(tumble.InvalidValueError, match="'ball' has a camera already"):
        ball.attach_camera()
    ball.attach_light("directional", direction=(0, 0, -1))
    with pytest.raises(tumble.InvalidValueError, match="'ball' has a light already"):
        ball.attach_light()
