"""Names and surfaces of the shapes of bodies and links, and armatures of joints in motion."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest
import tumble


def bar() -> tumble.Compound:
    ball = tumble.Sphere(0.1)
    return tumble.Compound([(ball, (0, 0, 0)), (ball.named("left"), (-1, 0, 0)), (ball.named("right"), (1, 0, 0))])


def named_world() -> tumble.World:
    world = tumble.World()
    world.add_static("floor", tumble.HalfSpace().named("surface"))
    world.add_rigid("bar", bar(), position=(0, 0, 0.1))
    return world


def arm() -> tumble.ArticulationBuilder:
    builder = tumble.ArticulationBuilder("arm")
    ball = tumble.Sphere(0.1)
    builder.add_link("stand", joint="fixed", shape=ball.named("pad"))
    builder.add_link("upper", "stand", axis=(0, 1, 0), shape=ball.named("pad"), shape_position=(1, 0, 0), mass=1)
    builder.add_shape("upper", tumble.Compound([(ball.named("inner"), (0, 0, 0.3)), (ball, (0, 0, -0.3))]), (2, 0, 0))
    builder.add_link("hand", "upper", joint="fixed", position=(3, 0, 0), shape=ball.named("pad"), mass=1)
    return builder


def check_contacts(world: tumble.World) -> None:
    contacts = world.contacts
    assert len(contacts) == 3
    for contact in contacts:
        names = {world.shape_name(contact["bodies"][k], contact["parts"][k], contact["shapes"][k]) for k in range(2)}
        assert names == {"surface", {-1: "left", 0: None, 1: "right"}[round(contact["point"][0])]}


def test_contacts_hits_and_events_say_the_names_of_shapes() -> None:
    world = named_world()
    world.step()
    body = world["bar"]
    assert body.shape_names == [None, "left", "right"] and world["floor"].shape_names == ["surface"]
    assert [body.shape_number(name) for name in ("left", "right")] == [1, 2]
    for each in (world, world.fork(), pickle.loads(pickle.dumps(world))):
        check_contacts(each)
        hit = each.cast_rays((1, 0, 5), (0, 0, -1))[0]
        assert each.shape_name(hit["body"], hit["part"], hit["shape"]) == each.shape_name("bar", 0, 2) == "right"
    event = world.events[0]
    assert event.kind == "contact_begin" and event.shape_names[0] == "surface"
    assert event.shape_names[1] == body.shape_names[event.shapes[1]] and event.shapes[0] == 0
    with pytest.raises(KeyError, match="no shape named 'middle'; there are left, right"):
        body.shape_number("middle")
    with pytest.raises(ValueError, match="has no shape 3; it has 3"):
        world.shape_name("bar", 0, 3)
    with pytest.raises(ValueError, match="the world has 2 bodies"):
        world.shape_name(7, 0, 0)


def test_names_are_saved_in_scenes_and_recordings_have_numbers(tmp_path: Path) -> None:
    world = named_world()
    world.save_scene(tmp_path / "s.toml")
    text = (tmp_path / "s.toml").read_text() + "# edited\n"
    (tmp_path / "s.toml").write_text(text)
    read = tumble.World.load(tmp_path / "s.toml")
    read.step()
    check_contacts(read)
    with tumble.Recorder(tmp_path / "r.mcap") as recorder:
        recorder.run(world, 2)
    events = [event for events in tumble.read(tmp_path / "r.mcap").events for event in events]
    assert events and all(event.shapes[0] == 0 and event.shapes[1] in (0, 1, 2) for event in events)


def test_shapes_of_links_have_names_by_their_links() -> None:
    world = tumble.World()
    assert arm().build().shape_names == [["pad"], ["pad", "inner", None], ["pad"]]
    body = world.add_articulation(arm(), (0, 0, 5))
    assert body.shape_names == [["pad"], ["pad", "inner", None], ["pad"]]
    assert body.shape_number("upper", "inner") == 1
    assert body.shape_number("hand", "pad") == 0
    hit = world.cast_rays((2, 0, 9), (0, 0, -1))[0]
    assert world.shape_name(hit["body"], hit["part"], hit["shape"]) == "inner"
    assert body.shape_names[hit["part"]][hit["shape"]] == "inner"
    with pytest.raises(KeyError, match="link 'stand' has no shape named 'inner'; there are pad"):
        body.shape_number("stand", "inner")
    with pytest.raises(KeyError):
        body.shape_number("nothing", "pad")
    with pytest.raises(ValueError, match="part is 9"):
        world.shape_name("arm", 9, 0)


def test_wrong_names_are_errors() -> None:
    ball = tumble.Sphere(0.1)
    named = ball.named("pad")
    assert (ball.name, named.name, type(named), named.volume) == (None, "pad", tumble.Sphere, ball.volume)
    assert pickle.loads(pickle.dumps(named)).name == "pad"
    with pytest.raises(ValueError, match="parts 1 and 3 of a compound are both named 'pad'"):
        tumble.Compound([(named, (0, 0, 0)), (ball, (1, 0, 0)), (named, (2, 0, 0))])
    with pytest.raises(ValueError, match="is no Compound"):
        bar().named("whole")
    with pytest.raises(ValueError, match="not empty"):
        ball.named("")
    builder = arm()
    builder.add_shape("upper", named)
    with pytest.raises(ValueError, match="shapes 0 and 3 are both named 'pad'"):
        builder.build()


def slid(collides: str, friction: float | None) -> float:
    """Loss of speed in half a second of a load of 2 kg on a carriage of 1 kg whose second ball touches the floor."""
    world = tumble.World(dt=1 / 500)
    world.add_static("floor", tumble.HalfSpace(), friction=1)
    builder = tumble.ArticulationBuilder("sled")
    unit = {"center_of_mass": (0, 0, 0), "inertia": (1, 1, 1)}
    builder.add_link("carriage", joint="prismatic", axis=(1, 0, 0), mass=1, qd=20, **unit)
    builder.add_link("load", "carriage", joint="prismatic", axis=(0, 0, 1), position=(0, 0, 0.1), mass=2, friction=0.81, **unit)
    ball = tumble.Sphere(0.1)
    builder.add_shape("load", tumble.Compound([(ball, (-0.5, 0, 0.3)), (ball.named("runner"), (0.5, 0, 0))]))
    body = world.add_articulation(builder)
    assert body.shape_material("load", 1)["friction"] == 0.81
    if friction is not None:
        body.set_shape_material("load", "runner" if collides == "name" else 1, friction=friction**2)
        body.set_shape_material("load", 0, friction=1)
        assert body.shape_material("load", "runner")["friction"] == friction**2
    world.step(250)
    return 20 - float(body.qd[0])


@pytest.mark.parametrize("which", ["name", "number"])
def test_a_part_of_a_link_brakes_with_its_own_friction(which: str) -> None:
    for friction in (0.2, None):
        wanted = 0.5 * (0.9 if friction is None else friction) * 2 * 9.81 / 3
        assert abs(slid(which, friction) - wanted) < 1e-6


def test_wrong_surfaces_of_shapes_of_links_are_errors() -> None:
    world = tumble.World()
    body = world.add_articulation(arm())
    with pytest.raises(ValueError, match="link 'upper' has no shape 4; it has 3 that collide"):
        body.set_shape_material("upper", 4, friction=1)
    with pytest.raises(ValueError, match="friction is -1"):
        body.set_shape_material("upper", "inner", friction=-1)
    body.set_shape_material("upper", "inner", friction=0.125)
    body.set_shape_material("upper", "inner")
    assert body.shape_material("upper", "inner")["friction"] == 0.5
    with pytest.raises(ValueError, match="not in a world"):
        arm().build().set_shape_material("upper", 0, friction=1)


def test_a_one_sided_shape_of_a_link_is_entered_from_below() -> None:
    heights = {}
    for one_way in ((0, 0, 1), None):
        world = tumble.World(dt=1 / 500)
        builder = tumble.ArticulationBuilder("lift")
        builder.add_link("platform", joint="fixed", position=(0, 0, 1), mass=1, center_of_mass=(0, 0, 0), inertia=(1, 1, 1))
        builder.add_shape("platform", tumble.Box((2, 2, 0.1)), one_way=one_way)
        builder.add_link("lamp", "platform", mass=1, center_of_mass=(0, 0, 0), inertia=(1, 1, 1))
        world.add_articulation(builder)
        ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=0.1, velocity=(0, 0, 6))
        heights[one_way] = []
        for _ in range(1000):
            world.step()
            heights[one_way].append(float(ball.position[2]))
    assert abs(max(heights[(0, 0, 1)]) - 6**2 / (2 * 9.81)) < 1e-4
    assert abs(heights[(0, 0, 1)][-1] - 1.15) < 1e-4
    assert max(heights[None]) < 0.86


def test_armature_follows_what_is_set() -> None:
    world = tumble.World(dt=0.01)
    builder = tumble.ArticulationBuilder("slider")
    builder.add_link("weight", joint="prismatic", axis=(0, 0, 1), mass=2, center_of_mass=(0, 0, 0), inertia=(1, 1, 1), armature=1)
    body = world.add_articulation(builder)
    assert body.armature.tolist() == [1]
    world.step(50)
    body.armature = 4
    assert body.armature.tolist() == world["slider"].armature.tolist() == [4]
    fork = world.fork()
    world.step(30)
    wanted = -2 * 9.81 * (0.5 / 3 + 0.3 / 6)
    assert abs(body.qd[0] - wanted) < 1e-12
    fork.step(30)
    assert fork["slider"].qd.tolist() == body.qd.tolist()
    # the dynamics are those of the present armature
    assert np.allclose(body.mass_matrix(), [[6]], rtol=1e-15)
    assert np.allclose(body.forward_dynamics(), [-2 * 9.81 / 6], rtol=1e-15)
    assert np.allclose(body.inverse_dynamics(qdd=[1]), [6 + 2 * 9.81], rtol=1e-15)
    for value, words in ((-1, "the armature of its joint is -1"), ([1, 2], "expected a number or shape"), (float("nan"), "armature")):
        with pytest.raises(ValueError, match=words):
            body.armature = value
    assert body.armature.tolist() == [4]
    with pytest.raises(ValueError, match="not in a world"):
        builder.build().armature = 1


def test_armature_of_floating_and_spherical_joints() -> None:
    world = tumble.World()
    builder = tumble.ArticulationBuilder("robot")
    builder.add_link("trunk", joint="floating", shape=tumble.Sphere(0.2), mass=3)
    builder.add_link("head", "trunk", joint="spherical", position=(0, 0, 1), shape=tumble.Sphere(0.1), mass=1)
    body = world.add_articulation(builder)
    body.armature = 0.5
    assert body.armature.tolist() == [0] * 6 + [0.5] * 3
    with pytest.raises(ValueError, match="only revolute, prismatic and spherical joints"):
        body.armature = [1] * 9
    with pytest.raises(ValueError, match="expected the same"):
        body.armature = [0] * 6 + [1, 2, 3]
    body.armature = [0] * 6 + [0.25] * 3
    assert body.armature[-1] == 0.25


def test_armature_of_a_saved_scene(tmp_path: Path) -> None:
    world = tumble.World()
    body = world.add_articulation(arm())
    body.armature = 0.75
    world.save_scene(tmp_path / "s.toml")
    (tmp_path / "s.toml").write_text((tmp_path / "s.toml").read_text() + "# edited\n")
    assert tumble.World.load(tmp_path / "s.toml")["arm"].armature.tolist() == [0.75]
