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
        ({"texture": "none.png"}, "appearance.texture: there is no file none.png"),
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
