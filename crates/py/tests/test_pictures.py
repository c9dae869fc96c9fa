"""Pictures and plots. Those that need a graphics adapter are skipped, visibly, where there is none."""

import builtins
import struct
import sys
import zlib

import numpy as np
import pytest

import tumble


@pytest.fixture
def drawn():
    """A red ball before a plane, or a skip."""
    world = tumble.World()
    world.add_static("ground", tumble.HalfSpace())
    world.add_rigid("ball", tumble.Sphere(0.5), mass=1.0, position=(0, 0, 0.5)).color = (0.9, 0.05, 0.05)
    try:
        world.render(8, 8)
    except tumble.PictureError as error:
        pytest.skip(f"SKIPPED: {error}")
    return world


def red(picture):
    return (picture[..., 0] > 1.8 * picture[..., 1]) & (picture[..., 0] > 60)


def test_a_ball_is_where_perspective_puts_it(drawn):
    picture = drawn.render(200, 100, camera=tumble.Camera(eye=(0, -5, 0.5), target=(0, 0, 0.5), fov_deg=40))
    assert picture.shape == (100, 200, 4) and picture.dtype == np.uint8 and (picture[..., 3] == 255).all()
    drawn["ball"].enabled = False
    empty = drawn.render(200, 100, camera=tumble.Camera(eye=(0, -5, 0.5), target=(0, 0, 0.5), fov_deg=40))
    drawn["ball"].enabled = True
    # the eye is as high as the ball's middle, which is the horizon's: against the sky nothing else differs
    columns = np.nonzero((picture != empty).any(axis=2)[46:49].any(axis=0))[0]
    # tan of the ball's half angle over that of the picture's: asin(0.5/5) seen in 20 degrees
    radius = 50 * np.tan(np.arcsin(0.5 / 5)) / np.tan(np.radians(20))
    assert columns.mean() == pytest.approx(99.5, abs=0.6) and np.ptp(columns) + 1 == pytest.approx(2 * radius, abs=1.2)
    moved = drawn.render(200, 100, camera=((1, -5, 0.5), (1, 0, 0.5)))
    assert np.nonzero(red(moved))[1].mean() == pytest.approx(99.5 - 50 / (5 * np.tan(np.radians(20))), abs=2.0)


def test_the_same_world_gives_the_same_bytes_and_is_left_alone(drawn):
    before = drawn.save()
    assert (drawn.render(64, 48) == drawn.render(64, 48)).all()
    assert drawn.save() == before


def test_a_facet_has_the_size_its_cave_says(drawn, root, tmp_path):
    text = (root / "caves" / "cube4.toml").read_text()
    size = next(line for line in text.splitlines() if line.startswith("size_px"))
    width, height = (int(n) for n in size.split("[")[1].split("]")[0].split(","))
    assert drawn.render(facet="cube4:front").shape == (height, width, 4)
    unfolded = drawn.render(90, 90, cave="cube4")
    assert unfolded.shape[0] <= 90 and unfolded.shape[1] == 90


@pytest.mark.parametrize(
    "words, error, said",
    [
        ({"facet": "front"}, ValueError, "CAVE:NAME"),
        ({"facet": "cube4:front", "width": 9}, ValueError, "size_px"),
        ({"facet": "cube4:back"}, KeyError, "`front`, `left`"),
        ({"cave": "cube5"}, FileNotFoundError, "cube4"),
        ({"cave": "cube4", "facet": "cube4:front"}, ValueError, "one of camera, facet and cave"),
        ({"camera": 3}, ValueError, "eye, target"),
        ({"camera": ((0, 0, 0), (0, 0, 0))}, ValueError, "away from the eye"),
        ({"camera": ((0, 0, np.nan), (0, 0, 0))}, ValueError, "finite"),
        ({"overlays": "ghosts"}, ValueError, "no overlay 'ghosts'"),
        ({"width": 0}, ValueError, "0 x 480"),
    ],
)
def test_objects_that_cannot_be_drawn_are_reported(drawn, words, error, said):
    with pytest.raises(error, match=said):
        drawn.render(**words)


def decode(png):
    """A PNG of 8-bit RGBA with filter 2 throughout, by the standard's own words."""
    assert png[:8] == b"\x89PNG\r\n\x1a\n"
    at, chunks = 8, {}
    while at < len(png):
        length, kind = struct.unpack(">I4s", png[at : at + 8])
        body = png[at + 8 : at + 8 + length]
        assert struct.unpack(">I", png[at + 8 + length : at + 12 + length])[0] == zlib.crc32(kind + body)
        chunks[kind], at = body, at + 12 + length
    width, height, depth, color = struct.unpack(">IIBB", chunks[b"IHDR"][:10])
    rows = np.frombuffer(zlib.decompress(chunks[b"IDAT"]), np.uint8).reshape(height, 1 + 4 * width)
    assert (depth, color) == (8, 6) and (rows[:, 0] == 2).all() and b"IEND" in chunks
    return np.cumsum(rows[:, 1:], axis=0, dtype=np.uint8).reshape(height, width, 4)


def test_a_saved_picture_is_a_png_of_the_same_pixels(tmp_path):
    picture = np.random.default_rng(2).integers(0, 256, (7, 5, 4), dtype=np.uint8)
    tumble.save_png(tmp_path / "noise.png", picture)
    assert (decode((tmp_path / "noise.png").read_bytes()) == picture).all()
    with pytest.raises(ValueError, match=r"expected uint8 of shape"):
        tumble.save_png(tmp_path / "noise.png", picture.astype(float))


def test_a_notebook_shows_a_world(drawn):
    assert (decode(drawn._repr_png_()) == drawn.render(640, 400)).all()


def test_colors_are_kept_and_checked():
    world = tumble.World()
    ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=1.0)
    ball.color = (0.25, 0.5, 1.0)
    assert ball.color.tolist() == [0.25, 0.5, 1.0]
    with pytest.raises(ValueError, match="1.5 is not from 0 to 1"):
        ball.color = (1.5, 0, 0)


def test_energy_is_plotted_from_a_fork():
    pytest.importorskip("matplotlib", reason="SKIPPED: matplotlib is not installed")
    world = tumble.World()
    world.add_rigid("ball", tumble.Sphere(0.1), mass=2.0, position=(0, 0, 3))
    ax = world.plot_energy(duration=0.5)
    kinetic, potential, total = (line.get_ydata() for line in ax.get_lines())
    times = ax.get_lines()[0].get_xdata()
    assert world.time == 0.0 and times[-1] == pytest.approx(0.5) and ax.get_ylabel() == "energy, J"
    assert kinetic == pytest.approx(9.81**2 * times**2, rel=1e-9) and total == pytest.approx(np.full(len(times), 2 * 9.81 * 3))
    assert potential == pytest.approx(total - kinetic)


def test_paths_are_plotted_as_seen_along_an_axis():
    pytest.importorskip("matplotlib", reason="SKIPPED: matplotlib is not installed")
    world = tumble.World()
    world.add_rigid("ball", tumble.Sphere(0.1), mass=2.0, velocity=(1, 2, 3))
    across, up = world.plot_paths(duration=1.0).get_lines()[0].get_data()
    assert across[-1] == pytest.approx(1.0) and up[-1] == pytest.approx(3 - 9.81 / 2)
    across, up = world.plot_paths(duration=1.0, bodies="ball", along="z").get_lines()[0].get_data()
    assert (across[-1], up[-1]) == pytest.approx((1.0, 2.0))
    with pytest.raises(ValueError, match="'x', 'y' or 'z'"):
        world.plot_paths(along="w")
    with pytest.raises(ValueError, match="finite and above 0"):
        world.plot_energy(duration=-1)


def test_without_matplotlib_the_error_names_it(monkeypatch):
    usual = builtins.__import__

    def none(name, *rest, **words):
        if name.startswith("matplotlib"):
            raise ImportError(name)
        return usual(name, *rest, **words)

    for name in [name for name in sys.modules if name.startswith("matplotlib")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setattr(builtins, "__import__", none)
    with pytest.raises(ImportError, match=r"World.plot_energy needs the package matplotlib"):
        tumble.World().plot_energy(duration=0.1)
