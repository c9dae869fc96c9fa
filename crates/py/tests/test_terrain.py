"""Convex hulls, height fields, terrain and planes: their numbers, files, pickles and faults."""

import pickle
import struct
import zlib

import numpy as np
import pytest

import tumble


def gray_png(path, values):
    """Writes a gray PNG of 16 bits; the first row is the upper edge."""
    values = np.asarray(values, dtype=">u2")
    rows, columns = values.shape

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    lines = b"".join(b"\0" + row.tobytes() for row in values)
    head = struct.pack(">IIBBBBB", columns, rows, 16, 0, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(lines)) + chunk(b"IEND", b""))
    return path


def surface(shape, x, y):
    """Height of the surface of static ground below a place."""
    world = tumble.World()
    world.add_static("ground", shape)
    return 50.0 - float(world.cast_rays((x, y, 50.0), (0, 0, -1))["distance"][0])


def test_a_hull_has_the_mass_of_its_solid_and_rests_on_it():
    corners = np.array([[x, y, z] for x in (0, 2) for y in (0, 1) for z in (0, 0.5)], dtype=float)
    points = np.vstack([corners, np.random.default_rng(3).uniform((0, 0, 0), (2, 1, 0.5), (200, 3))])
    hull = tumble.ConvexHull(points)
    assert isinstance(hull, tumble.Mesh)
    assert hull.volume == pytest.approx(1.0, rel=1e-12)
    assert hull.vertices.shape == (8, 3)
    np.testing.assert_allclose(hull.center_of_mass, (1, 0.5, 0.25), atol=1e-12)
    assert repr(hull) == "ConvexHull(8 vertices)"
    world = tumble.World()
    world.add_static("ground", tumble.Plane())
    body = world.add_rigid("hull", hull, density=500, position=(0, 0, 0))
    assert body.mass == pytest.approx(500)
    world.step(60)
    np.testing.assert_allclose(body.position, (0, 0, 0), atol=1e-5)


def test_a_hull_of_a_mesh_and_of_a_file(tmp_path):
    bowl = tmp_path / "open.obj"
    bowl.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 3\nf 1 2 4\nf 2 3 4\n")
    with pytest.raises(ValueError, match="open"):
        tumble.Mesh(bowl)
    assert tumble.ConvexHull(bowl).volume == pytest.approx(0.5)
    assert tumble.ConvexHull(str(bowl), scale=2.0).volume == pytest.approx(4.0)
    hull = tumble.ConvexHull(tumble.Mesh(tumble.ConvexHull(bowl).vertices, tumble.ConvexHull(bowl).faces))
    assert hull.volume == pytest.approx(0.5)


def test_heights_are_those_of_the_array_the_image_and_the_text(tmp_path):
    heights = np.array([[0.0, 0.5, 0.0], [1.0, 0.0, 0.2]])
    # the upper edge of an image has the largest y
    image = gray_png(tmp_path / "map.png", np.round(heights[::-1] * 65535))
    text = tmp_path / "map.txt"
    np.savetxt(text, heights)
    for source, options in [(heights, {}), (image, {}), (text, {}), (image, {"height_range": (0, 1)})]:
        field = tumble.HeightField(source, (4, 2), thickness=0.5, **options)
        assert repr(field) == "HeightField(2 x 3 heights)"
        for (j, i), height in np.ndenumerate(heights):
            x, y = (i - 1) * 1.9999, (j - 0.5) * 1.9999
            assert surface(field, x, y) == pytest.approx(height, abs=1e-3)
    # the lowest height is 0, so the bottom is a tenth of 4 m below it
    flat = tumble.HeightField(np.zeros((3, 3)), (4, 2))
    assert flat.volume == pytest.approx(4 * 2 * 0.4)


def test_a_ball_rolls_on_a_flat_field_as_on_a_plane():
    ways = []
    for ground in (tumble.Plane(), tumble.HeightField(np.zeros((80, 80)), (8, 8))):
        world = tumble.World()
        world.add_static("ground", ground, friction=0.5)
        ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=1, position=(-2, 0.03, 0.1), velocity=(3, 0.2, 0), friction=0.5)
        way = []
        for _ in range(60):
            world.step()
            way.append(np.concatenate([ball.position, ball.velocity]))
        ways.append(np.array(way))
    assert np.abs(ways[0] - ways[1]).max() < 1e-6


def test_terrain_is_solid_below_an_open_surface(tmp_path):
    vertices = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 1], [-1, 1, 1]], dtype=float)
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    for terrain in (tumble.Terrain(vertices, faces), tumble.Terrain(vertices, faces[:, ::-1])):
        assert terrain.volume == pytest.approx(2 * 2 * 0.2)
        assert surface(terrain, 0.3, 0.5) == pytest.approx(0.75)
    file = tmp_path / "roof.obj"
    file.write_text("v -1 -1 0\nv 1 -1 0\nv 1 1 1\nv -1 1 1\nf 1 2 3\nf 1 3 4\n")
    assert tumble.Terrain(file, thickness=0.5, scale=2.0).volume == pytest.approx(4 * 4 * 0.5)


def test_plane_is_the_half_space():
    assert tumble.Plane is tumble.HalfSpace
    assert surface(tumble.Plane(normal=(0, 0, 2), offset=0.7), 1, 2) == pytest.approx(0.7)


def test_pickles_keep_the_class_and_worlds_keep_the_motion():
    rng = np.random.default_rng(5)
    shapes = [
        tumble.ConvexHull(rng.normal(size=(30, 3))),
        tumble.HeightField(rng.uniform(0, 0.3, (8, 9)), (3, 3)),
        tumble.Terrain([[0, 0, 0], [1, 0, 0], [0, 1, 0.2]], [[0, 1, 2]]),
        tumble.OpenMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0.2]], [[0, 1, 2]], centered=True),
    ]
    for shape in shapes:
        again = pickle.loads(pickle.dumps(shape))
        assert type(again) is type(shape)
        assert repr(again) == repr(shape)
        assert again.volume == shape.volume
    world = tumble.World()
    world.add_static("ground", shapes[1])
    world.add_rigid("hull", tumble.ConvexHull(0.1 * rng.normal(size=(30, 3))), position=(0, 0, 0.8))
    world.step(20)
    other = pickle.loads(pickle.dumps(world))
    world.step(20)
    other.step(20)
    assert np.array_equal(world.state, other.state)


def test_an_open_mesh_reaches_behind_its_faces_or_to_both_sides(tmp_path):
    corners = [[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]]
    up, down = [[0, 1, 2], [0, 2, 3]], [[0, 2, 1], [0, 3, 2]]
    for faces, options, top in [(up, {}, 0), (down, {}, 0.2), (up, {"centered": True}, 0.1)]:
        sheet = tumble.OpenMesh(corners, faces, 0.2, **options)
        assert isinstance(sheet, tumble.Mesh)
        assert sheet.volume == pytest.approx(0.4)
        assert surface(sheet, 0.3, 0.4) == pytest.approx(top, abs=1e-12)
    file = tmp_path / "wall.obj"
    file.write_text("v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 3\n")
    assert tumble.OpenMesh(file, thickness=0.1, scale=2.0).volume == pytest.approx(0.2)
    assert repr(tumble.OpenMesh(str(file))) == "OpenMesh(1 triangles)"


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: tumble.ConvexHull([[0, 0, 0], [1, 0, 0], [0, 1, 0]]), "a convex hull of 3 points; it must have 4 to"),
        (lambda: tumble.ConvexHull(np.zeros((5, 2))), r"points: expected shape \(n, 3\), got \(5, 2\)"),
        (lambda: tumble.ConvexHull([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]), "the 4 points of a convex hull lie in one plane"),
        (lambda: tumble.ConvexHull([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, np.nan]]), "NaN|nan"),
        (lambda: tumble.ConvexHull(np.eye(4, 3), scale=-1), "scale is -1"),
        (lambda: tumble.HeightField(np.zeros(4), (1, 1)), r"heights: expected shape \(rows, columns\), got"),
        (lambda: tumble.HeightField(np.zeros((1, 4)), (1, 1)), "4 heights in rows of 4, but needs at least 2 full rows"),
        (lambda: tumble.HeightField([[0, 1], [2, np.inf]], (1, 1)), "inf"),
        (lambda: tumble.HeightField(np.zeros((2, 2)), (1, 0)), "a size y of 0 m"),
        (lambda: tumble.HeightField(np.zeros((2, 2)), (1, 1), thickness=-2), "a thickness of -2 m"),
        (lambda: tumble.HeightField("no such file.png", (1, 1)), "no such file.png"),
        (lambda: tumble.OpenMesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]]), "none of the 1 triangles has an area"),
        (lambda: tumble.OpenMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], thickness=-1), "the thickness is -1 m"),
        (lambda: tumble.OpenMesh("no such file.obj"), "no such file.obj"),
        (lambda: tumble.Terrain([[0, 0, 0], [1, 0, 0], [0, 0, 1]], [[0, 1, 2]]), r"face 1 is turned by 90.0°"),
        (lambda: tumble.Terrain([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], thickness=0.0), "the thickness is 0 m"),
    ],
)
def test_wrong_input_is_one_clear_error(make, words):
    with pytest.raises(ValueError, match=words):
        make()
