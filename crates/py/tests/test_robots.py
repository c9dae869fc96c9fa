"""Robots from files: what they cost, and what is to be said of them."""

import os
import pathlib
import sys
import sysconfig

import pytest

import tumble

BALL = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\n"  # a tetrahedron without its last face


def urdf(collision, visual):
    """A hinge whose link has a collision and a visual geometry."""
    return f"""<robot name="r"><link name="a"/>
      <joint name="j" type="revolute"><parent link="a"/><child link="b"/><limit lower="-1" upper="2" effort="5" velocity="1"/></joint>
      <link name="b"><inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1"/></inertial>
        <collision><geometry>{collision}</geometry></collision>
        <visual><geometry><mesh filename="{visual}"/></geometry></visual></link></robot>"""


def test_a_description_needs_no_mesh(tmp_path):
    path = tmp_path / "r.urdf"
    path.write_text(urdf('<mesh filename="nowhere.stl"/>', "nowhere.dae"))
    robot = tumble.Articulation.from_urdf(path)
    assert (robot.joint_names, robot.dof) == (["j"], 1)
    assert [list(bounds) for bounds in robot.limits] == [[-1, 2]]
    # no gravity about a vertical axis, and 1 kg·m² about it
    robot.gravity = (0, 0, 0)
    assert robot.forward_dynamics([0.5], [0], [3]) == pytest.approx([3])
    with pytest.raises(tumble.SceneError, match="nowhere.stl"):
        tumble.World().add_articulation(robot)


def test_notes_of_a_robot_reach_the_world(tmp_path):
    path = tmp_path / "r.urdf"
    path.write_text(urdf('<mesh filename="open.obj"/>', "garbage.obj"))
    (tmp_path / "open.obj").write_text(BALL)
    (tmp_path / "garbage.obj").write_bytes(b"f 1 2 3\n")
    world = tumble.World()
    assert world.notes == []
    world.add_articulation(path, name="first")
    [hull] = world.notes
    assert hull.startswith('articulated "first": ')
    assert hull.endswith("open.obj: its surface is not closed, so its convex hull is used")
    world.add_articulation(path, (3, 0, 0), name="second")
    assert [note.split('"')[1] for note in world.notes] == ["first", "second"]
    copy = world.fork()
    assert copy.notes == world.notes
    # a recording draws it
    with tumble.Recorder(tmp_path / "r.mcap") as recording:
        recording.frame(world)
    assert [note for note in world.notes if "garbage.obj" in note and "left out" in note]


def test_bodies_that_overlap_at_the_start_are_reported():
    world = tumble.World()
    world.add_static("ground", tumble.HalfSpace())
    for name, x in [("left", 0.0), ("right", 0.8)]:
        world.add_rigid(name, tumble.Sphere(0.5), mass=1, position=(x, 0, 0.5))
    assert world.notes == ["left and right overlap by 2.00e-1 m at the start"]
    world.step()
    assert world.notes == ["left and right overlap by 2.00e-1 m at the start"]
    moved = tumble.World()
    for name, x in [("left", 0.0), ("right", 0.8)]:
        moved.add_rigid(name, tumble.Sphere(0.5), mass=1, position=(x, 0, 0.5))
    moved["right"].position = (2, 0, 0.5)
    assert moved.notes == []


def robots():
    """The folder of example_robot_data, or a visible skip."""
    below = pathlib.Path("cmeel.prefix/share/example-robot-data/robots")
    folder = os.environ.get("TUMBLE_ROBOTS")
    paths = [pathlib.Path(folder)] if folder else [pathlib.Path(p) / below for p in [sysconfig.get_paths()["purelib"], *sys.path]]
    found = next((path for path in paths if path.is_dir()), None)
    return found or pytest.skip("SKIPPED: no robots; pip install example-robot-data, or set TUMBLE_ROBOTS to its folder `robots`")


@pytest.mark.parametrize("path", ["panda_description/urdf/panda.urdf", "a1_description/urdf/a1.urdf", "anymal_b_simple_description/robots/anymal.urdf"])
def test_a_stock_robot_falls(path):
    robot = tumble.Articulation.from_urdf(robots() / path, floating=True)
    assert robot.limits.shape == (robot.dof, 2)
    world = tumble.World()
    placed = world.add_articulation(robot, (0, 0, 5))
    height = placed.center_of_mass()[2]
    world.step(24)
    # 0.1 s of free fall, whatever its joints do
    assert placed.center_of_mass()[2] - height == pytest.approx(-0.5 * 9.81 * 0.1**2, abs=2e-3)
