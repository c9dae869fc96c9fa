"""Sphere trees: what is promised of them, by numpy."""

import subprocess

import numpy as np
import pytest

import tumble

CUBE = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
SIDES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
)


@pytest.fixture(scope="module", params=["medial", "hubbard", "grid", "octree"])
def tree(request):
    return tumble.SphereTree.build(CUBE, SIDES, method=request.param, depth=2, cache=False)


def test_every_level_covers_the_surface(tree):
    rng = np.random.default_rng(5)
    corners = CUBE[SIDES[rng.integers(0, 12, 4000)]]
    weights = rng.dirichlet((1, 1, 1), 4000)
    points = np.einsum("nk,nkd->nd", weights, corners)
    for level in tree.levels:
        away = np.linalg.norm(points[:, None] - level.centers, axis=2) - level.radii
        assert away.min(axis=1).max() <= 1e-9


def test_children_lie_inside_their_parents(tree):
    for k in range(1, len(tree)):
        above, below, parents = tree.levels[k - 1], tree.levels[k], tree.parents[k]
        far = np.linalg.norm(below.centers - above.centers[parents], axis=1) + below.radii
        assert (far <= above.radii[parents] + 1e-9).all()
    assert tree.parents[0].tolist() == [-1]


def test_balls_reach_out_no_further_than_the_bound(tree):
    # directions all around each ball; the cube's signed distance in closed form, outside of it
    rng = np.random.default_rng(6)
    directions = rng.normal(size=(500, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    last = tree.levels[-1]
    points = last.centers[:, None] + last.radii[:, None, None] * directions
    outside = np.linalg.norm(np.maximum(np.abs(points) - 0.5, 0.0), axis=2)
    assert 0.0 < outside.max() <= tree.outward_error + 1e-12


def test_the_branch_and_the_method_are_those_asked_for(tree):
    assert tree.branching == 8 and tree.depth == 2 and f": {tree.method}, " in repr(tree)
    for parents in tree.parents[1:]:
        assert np.bincount(parents).max() <= 8


def test_a_file_brings_the_same_tree_back(tree, tmp_path):
    tree.save(tmp_path / "cube.json")
    again = tumble.SphereTree.load(tmp_path / "cube.json")
    assert again.to_json() == tree.to_json() and again.report() == tree.report()
    assert all((a.centers == b.centers).all() and (a.radii == b.radii).all() for a, b in zip(again.levels, tree.levels))


def test_the_report_is_the_command_s(command, tmp_path):
    mesh = tmp_path / "cube.obj"
    lines = [f"v {x} {y} {z}" for x, y, z in CUBE] + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in SIDES]
    mesh.write_text("\n".join(lines) + "\n")
    words = ["spheretree", mesh, "--method", "octree", "--depth", "2", "--no-cache", "-o", tmp_path / "theirs.json"]
    said = subprocess.run([command, *words], capture_output=True, text=True, timeout=60, check=True).stdout
    tree = tumble.SphereTree.build(mesh, method="octree", depth=2, cache=False)
    assert tree.report() and tree.report() in said
    assert tree.to_json() == (tmp_path / "theirs.json").read_text()


def test_an_object_with_vertices_and_faces_is_a_mesh():
    trimesh = pytest.importorskip("trimesh", reason="SKIPPED: trimesh is not installed")
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.5)
    tree = tumble.SphereTree.build(ball, method="grid", depth=1, cache=False)
    root = tree.levels[0]
    assert np.allclose(root.centers, 0, atol=0.02) and 0.5 <= root.radii[0] < 0.52
    # volume of a ball over that of the mesh in it
    assert tree.quality["volume_ratio"][0] == pytest.approx(4 / 3 * np.pi * root.radii[0] ** 3 / ball.volume, rel=0.01)


@pytest.mark.parametrize(
    "words, said",
    [
        ({"method": "best"}, "medial, hubbard, grid, octree"),
        ({"branching": 1}, "2 to 64"),
        ({"depth": 10}, "1 to 9"),
        ({"max_error": 2.0}, "0.0001 to 1"),
    ],
)
def test_settings_out_of_range_are_value_errors(words, said):
    with pytest.raises(ValueError, match=said):
        tumble.SphereTree.build(CUBE, SIDES, **words)


def test_what_is_no_closed_mesh_is_refused(tmp_path):
    with pytest.raises(ValueError, match="open|boundary|closed|edge"):
        tumble.SphereTree.build(CUBE, SIDES[:-1])
    with pytest.raises(ValueError, match=r"vertices: expected shape \(n, 3\)"):
        tumble.SphereTree.build(CUBE[:, :2], SIDES)
    with pytest.raises(FileNotFoundError):
        tumble.SphereTree.build(tmp_path / "none.obj")
    (tmp_path / "tree.json").write_text('{"format": "something else"}')
    with pytest.raises(tumble.InvalidValueError, match="tree.json"):
        tumble.SphereTree.load(tmp_path / "tree.json")


ROBOT = """<robot name="two"><link name="a"><collision><origin xyz="0 0 0.5"/><geometry><box size="0.2 0.2 1"/></geometry></collision></link>
<joint name="j" type="prismatic"><parent link="a"/><child link="b"/><axis xyz="1 0 0"/><limit lower="0" upper="2" effort="1" velocity="1"/></joint>
<link name="b"><collision><geometry><sphere radius="0.25"/></geometry></collision></link></robot>"""


def test_links_of_a_robot_are_covered_by_spheres(tmp_path):
    file = tmp_path / "two.urdf"
    file.write_text(ROBOT)
    robot = tumble.SphereRobot.from_urdf(file, spheres=12, spheres_of={"a": 20}, cache=False)
    assert robot.name == "two" and list(robot.links) == ["a", "b"] and robot.notes == []
    a, b = robot.links["a"], robot.links["b"]
    assert np.array_equal(b.centers, [[0, 0, 0]]) and b.radii == [0.25] and b.outward == [0]
    assert a.coverage == 1 and a.shapes == 1 and 12 < len(a.radii) <= 20 == robot.urdf.count("<sphere") - 1
    # points of the box's surface lie in a sphere, and no sphere reaches further out than it says
    points = np.random.default_rng(1).uniform(-1, 1, (2000, 3))
    points[np.arange(2000), np.abs(points).argmax(axis=1)] = np.sign(points[np.arange(2000), np.abs(points).argmax(axis=1)])
    points = points * [0.1, 0.1, 0.5] + [0, 0, 0.5]
    assert (np.linalg.norm(points[:, None] - a.centers, axis=2) - a.radii).min(axis=1).max() <= 0
    beyond = np.abs(a.centers - [0, 0, 0.5]) - [0.1, 0.1, 0.5]
    assert ((beyond + a.radii[:, None]).max(axis=1) <= a.outward + 1e-12).all()
    # the sphere leaves the box at 0.35, and their spheres no later than by what those of the box reach out
    assert [pair[:2] + pair[3:] for pair in robot.overlaps()] == [("a", "b", True)]
    assert robot.overlaps({"j": 0.36 + a.outward.max()}) == []
    assert robot.ignored_pairs(sample_poses=10) == [("a", "b")]
    loose = tumble.SphereRobot.from_urdf(file, spheres=12, coverage_of={"a": 0.8}, cache=False).links["a"]
    assert 0.8 <= loose.coverage < 1 and loose.outward.max() < a.outward.max()


def test_a_weight_trades_coverage_for_volume_outside(tmp_path):
    file = tmp_path / "two.urdf"
    file.write_text(ROBOT)
    sets = [tumble.SphereRobot.from_urdf(file, spheres=4, weight_of={"a": weight}, cache=False).links for weight in (0, 0.3, 0.6, 1)]
    covered = [links["a"].coverage for links in sets]
    outside = [links["a"].volume_outside / links["a"].volume for links in sets]
    assert covered == sorted(covered) and outside == sorted(outside) and len(set(covered)) == 4
    assert covered[-1] == 1 and outside[0] == 0 and all(links["b"].coverage == 1 for links in sets)
    full = tumble.SphereRobot.from_urdf(file, spheres=4, cache=False).links["a"]
    assert (full.centers == sets[-1]["a"].centers).all() and full.volume == pytest.approx(0.04, rel=5e-3)
    assert 0 < full.mean_outward < full.outward.max()
    least = tumble.SphereRobot.from_urdf(file, spheres=4, weight=0, coverage=0.9, cache=False).links["a"]
    assert least.coverage >= 0.9 and least.volume_outside < full.volume_outside


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ({"spheres": 0}, "0 spheres for a link; expected 1 to 10000"),
        ({"spheres_of": {"c": 3}}, 'no link "c" with collision geometry; the links are a, b'),
        ({"coverage": 1.5}, "a coverage of 1.5"),
        ({"weight": 1.5}, "a weight of 1.5; expected 0"),
        ({"weight_of": {"c": 0.5}}, 'no link "c" with collision geometry'),
        ({"max_error": 0.0}, "max_error is 0"),
    ],
)
def test_wrong_words_for_a_robot_of_spheres_are_named(tmp_path, words, said):
    (tmp_path / "two.urdf").write_text(ROBOT)
    with pytest.raises(ValueError, match=said):
        tumble.SphereRobot.from_urdf(tmp_path / "two.urdf", cache=False, **words)


def test_a_joint_that_does_not_exist_is_named(tmp_path):
    (tmp_path / "two.urdf").write_text(ROBOT)
    robot = tumble.SphereRobot.from_urdf(tmp_path / "two.urdf", cache=False)
    with pytest.raises(tumble.InvalidValueError, match='no joint "k" to set; the joints are j'):
        robot.overlaps({"k": 1.0})
