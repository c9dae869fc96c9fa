"""Queries: rays, overlaps, distances and points in numpy arrays, against closed forms."""

import numpy as np
import pytest

import tumble


def scene():
    world = tumble.World()
    world.add_static("ground", tumble.HalfSpace())
    world.add_rigid("ball", tumble.Sphere(0.5), mass=1, position=(0, 0, 2))
    world.add_rigid("crate", tumble.Box((1, 1, 1)), mass=1, position=(3, 0, 0.5))
    return world


def test_rays_hit_a_ball_where_the_quadratic_equation_says():
    world = tumble.World()
    world.add_rigid("ball", tumble.Sphere(0.7), mass=1, position=(1, 2, 3))
    rng = np.random.default_rng(1)
    origins, directions = rng.uniform(-5, 5, (10_000, 3)), rng.normal(size=(10_000, 3))
    directions = (1, 2, 3) + 0.5 * directions - origins
    hits = world.cast_rays(origins, directions)
    unit = directions / np.linalg.norm(directions, axis=1)[:, None]
    off = origins - (1, 2, 3)
    along = -np.einsum("ij,ij->i", off, unit)
    left = 0.7**2 - np.einsum("ij,ij->i", off, off) + along**2
    hit = (left >= 0) & (along - np.sqrt(np.maximum(left, 0)) >= 0)
    assert (hit == (hits["body"] == 0)).all() and hit.sum() > 3000
    wanted = along[hit] - np.sqrt(left[hit])
    assert hits["distance"][hit] == pytest.approx(wanted, abs=1e-12)
    assert hits["normal"][hit] == pytest.approx((off[hit] + unit[hit] * wanted[:, None]) / 0.7, abs=1e-12)
    assert np.isinf(hits["distance"][~hit]).all() and (hits["body"][~hit] == -1).all() and (hits["face"][~hit] == -1).all()
    world.threads = 3
    assert (world.cast_rays(origins, directions) == hits).all()


def test_one_origin_or_one_direction_serves_all():
    world = scene()
    down = world.cast_rays([(0, 0, 9), (3, 0, 9)], (0, 0, -1))
    assert down["distance"] == pytest.approx([6.5, 8.0]) and down["face"].tolist() == [0, 5]
    fan = world.cast_rays((0, 0, 9), [(0, 0, -1), (3, 0, -8)])
    assert fan["body"].tolist() == [1, 2] and fan["distance"][1] == pytest.approx(np.hypot(3, 8))
    short = world.cast_rays([(0, 0, 9), (3, 0, 9)], (0, 0, -1), [6.4, 8.1])
    assert short["body"].tolist() == [-1, 2]
    assert world.cast_rays(np.zeros((0, 3)), np.zeros((0, 3))).shape == (0,)


def test_wrong_arguments_are_refused():
    world = scene()
    for call, words in [
        (lambda: world.cast_rays([(0, 0)], (0, 0, 1)), "origins: expected shape"),
        (lambda: world.cast_rays(np.zeros((3, 3)), np.ones((2, 3))), "3 origins and 2 directions"),
        (lambda: world.cast_rays((0, 0, 0), (0, 0, 0)), "has no length"),
        (lambda: world.cast_rays((0, 0, 0), (0, 0, 1), -1.0), "max_distance is -1"),
        (lambda: world.cast_rays((0, 0, 0), (0, 0, 1), group=64), "0 to 63"),
        (lambda: world.cast_rays((0, 0, np.nan), (0, 0, 1)), "finite"),
        (lambda: world.cast_shape(tumble.Sphere(1), (0, 0, 0), 1), "no length"),
        (lambda: world.cast_shape(tumble.Sphere(1), (0, 0, 1), np.inf), "finite"),
        (lambda: world.closest_points("ball"), "b is missing"),
    ]:
        with pytest.raises(tumble.InvalidValueError, match=words):
            call()
    with pytest.raises(tumble.UnknownNameError):
        world.cast_rays((0, 0, 0), (0, 0, 1), ignore="nobody")


def test_shapes_and_points():
    world = scene()
    ball, crate = world["ball"], world["crate"]
    found = world.overlaps(tumble.Sphere(1.0), position=(2.2, 0, 1.5))
    assert found["body"].tolist() == [2]
    assert found["depth"] == pytest.approx(1 - np.hypot(0.3, 0.5))
    pair = world.closest_points(ball, "crate")
    assert pair["distance"] == pytest.approx(np.hypot(2.5, 1.0) - 0.5) and pair["bodies"].tolist() == [1, 2]
    assert pair["normal"] == pytest.approx(np.array([-2.5, 0, 1]) / np.hypot(2.5, 1))
    assert np.linalg.norm(pair["points"][0] - pair["points"][1]) == pytest.approx(pair["distance"])
    near = world.closest_points(tumble.Box((0.2, 0.2, 0.2)), position=(3, 0, 1.4))
    assert near["distance"] == pytest.approx(0.3) and near["bodies"].tolist() == [-1, 2]
    only = world.closest_points(tumble.Box((0.2, 0.2, 0.2)), ball, position=(0, 0, 4))
    assert only["distance"] == pytest.approx(1.4) and only["bodies"].tolist() == [-1, 1]
    assert world.contains((3, 0, 0.25)).tolist() == [2] and world.contains((0, 0, -1)).tolist() == [0]
    depth = world.point_depth([(0, 0, 2.2), (0, 0, 3), (3, 0, 0.9)])
    assert depth["depth"] == pytest.approx([0.3, -0.5, 0.1]) and depth["body"].tolist() == [1, 1, 2]
    assert world.point_depth((0, 0, 2.2))["normal"] == pytest.approx([0, 0, 1])
    hit = world.cast_shape(tumble.Capsule(0.1, 1.0), (0, 0, -1), 10, position=(0, 0, 9))
    assert hit["distance"] == pytest.approx(9 - 0.6 - 2.5, abs=1e-8) and hit["body"] == 1
    assert world.cast_shape(tumble.Sphere(0.1), (0, 0, 1), 10, position=(0, 0, 9)) is None
    # the other body only, by a list of handles and names
    assert world.cast_rays((0, 0, 9), (0, 0, -1), ignore=[ball, "crate"])["body"].tolist() == [0]
    assert tumble.World().point_depth((0, 0, 0))["depth"] == -np.inf
    crate.position = (0, 0, 5)
    assert world.cast_rays((0, 0, 9), (0, 0, -1))["distance"] == pytest.approx([3.5])


def test_a_mesh_is_placed_by_the_frame_of_its_vertices():
    corners = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float)
    faces = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
    wedge = tumble.Mesh(corners, faces)
    world = tumble.World()
    world.add_rigid("wedge", wedge, mass=1, position=(5, 0, 0))
    assert world.cast_rays((5.1, 0.1, 3), (0, 0, -1))["distance"] == pytest.approx([3 - 0.8])
    assert world.overlaps(wedge, position=(5, 0, 0.99))["body"].tolist() == [0]
    assert len(world.overlaps(wedge, position=(5, 0, 1.01))) == 0


def test_a_link_of_an_arm_is_named():
    world = tumble.World()
    arm = world.add_articulation("scenes/robot/arm.urdf", name="arm")
    hits = world.cast_rays(arm.link_poses()[:, :3] + (0, 0, 3), (0, 0, -1))
    named = {arm.link_names[part] for part in hits["part"][hits["body"] == 0]}
    assert len(named) >= 2


def test_results_name_the_shape_of_a_compound_and_of_a_link():
    compound = tumble.Compound([(tumble.Box(0.4), (-1, 0, 0)), (tumble.Sphere(0.2), (0, 0, 0)), (tumble.Cylinder(0.2, 0.4), (1, 0, 0))])
    world = tumble.World(gravity=(0, 0, 0))
    world.add_rigid("row", compound, mass=1)
    links = tumble.ArticulationBuilder("arm")
    links.add_link("upper", joint="fixed", shape=tumble.Box(0.4))
    links.add_shape("upper", compound, (0, 2, 0))
    links.add_shape("upper", tumble.Sphere(0.2), (0, 4, 0))
    links.add_link("lower", "upper", axis=(1, 0, 0), position=(0, 6, 0), shape=tumble.Sphere(0.2))
    world.add_articulation(links, base=(0, 10, 0))
    xs, ys = [-1, 0, 1, 0, -1, 0, 1, 0, 0], [0, 0, 0, 10, 12, 12, 12, 14, 16]
    hits = world.cast_rays(np.column_stack([xs, ys, np.full(9, 5.0)]), (0, 0, -1))
    assert hits["body"].tolist() == [0] * 3 + [1] * 6
    assert hits["part"].tolist() == [0] * 8 + [1]
    # the parts of the compound count one by one among the shapes of the link
    assert hits["shape"].tolist() == [0, 1, 2, 0, 1, 2, 3, 4, 0]
    assert hits["face"].tolist() == [5, 0, 2, 5, 5, 0, 2, 0, 0]
    probe = tumble.Sphere(0.1)
    for shape, x in enumerate([-1.0, 0.0, 1.0]):
        assert world.overlaps(probe, position=(x, 0, 0.25))["shape"].tolist() == [shape]
        assert world.closest_points(probe, position=(x, 0, 1))["shapes"].tolist() == [-1, shape]
        assert world.cast_shape(probe, (0, 0, -1), 3, position=(x, 0, 2))["shape"] == shape
        assert world.point_depth((x, 0, 0.1))["shape"] == shape
    assert world.cast_rays((9, 9, 9), (0, 0, 1))["shape"].tolist() == [-1]


def test_contacts_name_the_part_of_a_compound():
    table = [(tumble.Box((1.2, 1.2, 0.1)), (0, 0, 0.5))] + [(tumble.Sphere(0.1), (x, y, 0.1)) for x in (-0.5, 0.5) for y in (-0.5, 0.5)]
    world = tumble.World()
    world.add_static("ground", tumble.HalfSpace())
    world.add_rigid("table", tumble.Compound(table), mass=5)
    world.step(10)
    assert sorted(world.contacts["shapes"].tolist()) == [[0, 1], [0, 2], [0, 3], [0, 4]]
    assert (world.fork().contacts["shapes"] == world.contacts["shapes"]).all()


def test_closest_points_take_links():
    builder = tumble.ArticulationBuilder("arm")
    builder.add_link("upper", axis=(0, 1, 0), shape=tumble.Sphere(0.5), mass=1)
    builder.add_link("lower", "upper", axis=(0, 1, 0), position=(3, 0, 0), shape=tumble.Sphere(0.5), mass=1)
    builder.add_link("hand", "lower", joint="fixed", position=(2, 0, 0), shape=tumble.Sphere(0.25), mass=1)
    world = tumble.World()
    arm = world.add_articulation(builder)
    ball = world.add_rigid("ball", tumble.Sphere(0.5), mass=1, position=(0, 0, 4))
    for upper in (arm.link("upper"), "arm/upper", (arm, "upper")):
        for hand in (arm.link("hand"), "arm/hand", (arm, "hand")):
            pair = world.closest_points(upper, hand)
            assert pair["distance"] == pytest.approx(4.25) and pair["points"].round(9).tolist() == [[0.5, 0, 0], [4.75, 0, 0]]
    assert world.closest_points("arm/lower", ball)["distance"] == pytest.approx(4.0)
    assert world.closest_points(ball, arm)["distance"] == pytest.approx(3.0)
    # a shape and a link: not the nearer links
    probe = tumble.Sphere(0.1)
    assert world.closest_points(probe, arm.link("hand"), position=(0, 0, 2))["distance"] == pytest.approx(29**0.5 - 0.35)
    assert world.closest_points(probe, arm, position=(0, 0, 2))["distance"] == pytest.approx(1.4)
    assert [row["body"] for row in world.overlaps(tumble.Sphere(1), ignore=arm.link("upper"))] == []
    hit = world.cast_shape(probe, (1, 0, 0), 10, (-2, 0, 0), ignore=[arm.link("upper"), arm.link("lower")])
    assert hit["distance"] == pytest.approx(6.65) and arm.link_names[hit["part"]] == "hand", "of the lower link only the hand is left"
    with pytest.raises((tumble.UnknownNameError, tumble.InvalidValueError), match="foot"):
        world.closest_points("arm/foot", ball)
