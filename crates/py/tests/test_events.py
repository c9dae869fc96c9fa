"""Events, sensors, groups and ignored pairs, in Python and in scene files."""

import pickle
from pathlib import Path

import numpy as np
import pytest

import tumble
from tumble import Trigger


def bouncing():
    world = tumble.World()
    world.add_static("ground", tumble.HalfSpace())
    ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=2, position=(0, 0, 0.6), restitution=0.5)
    return world, ball


def kinds(world, steps):
    found = []
    for _ in range(steps):
        world.step()
        found += [(event.kind, event.a.name, event.b and event.b.name) for event in world.events]
    return found


def test_a_bounce_begins_and_ends():
    world, ball = bouncing()
    found = kinds(world, 120)
    assert found[0] == ("contact_begin", "ground", "ball")
    assert ("contact_end", "ground", "ball") in found
    assert {kind for kind, *_ in found} <= {"contact_begin", "contact_persist", "contact_end"}
    world.step(240 * 3)
    (event,) = world.events
    assert event.kind == "contact_persist" and event.parts == (0, 0)
    assert event.impulse == pytest.approx([0, 0, -2 * 9.81 / 240], rel=1e-6)
    assert event.point == pytest.approx([0, 0, 0], abs=1e-4)
    assert [body.name for body in ball.touching] == ["ground"]
    world.event_impulse = 1.0
    assert world.event_impulse == 1.0
    world.step(2)
    assert world.events == [] and ball.touching == []
    with pytest.raises(tumble.InvalidValueError, match="event impulse"):
        world.event_impulse = -1.0


def test_events_go_on_in_copies():
    world, _ = bouncing()
    world.step(100)
    copy, fork, restored = pickle.loads(pickle.dumps(world)), world.fork(), bouncing()[0]
    restored.restore(world.save())
    listed = kinds(world, 100)
    assert listed and listed == kinds(copy, 100) == kinds(fork, 100) == kinds(restored, 100)


def test_groups_masks_and_sensors_can_be_set_at_any_time():
    world = tumble.World(gravity=(0, 0, 0))
    gate = world.add_static("gate", tumble.Sphere(1.0), sensor=True, group=3, mask=[4, 5])
    ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=1, group=4)
    assert (gate.group, gate.mask, gate.sensor) == (3, 0b110000, True)
    assert (ball.group, ball.mask, ball.sensor) == (4, 2**64 - 1, False)
    assert kinds(world, 1) == [("sensor_begin", "gate", "ball")]
    assert gate.touching == [ball] and ball.touching == []
    ball.group = 6
    assert kinds(world, 1) == [("sensor_end", "gate", "ball")]
    gate.mask = None
    assert kinds(world, 1) == [("sensor_begin", "gate", "ball")]
    ball.mask = 0b1
    assert kinds(world, 1) == [("sensor_end", "gate", "ball")]
    gate.sensor = False
    ball.mask = None
    world.step()
    assert len(world.contacts) == 1
    for wrong in (64, -1):
        with pytest.raises(tumble.InvalidValueError):
            ball.group = wrong
    for wrong in ([64], "a", -1, 2**64):
        with pytest.raises(tumble.InvalidValueError, match="mask|group"):
            ball.mask = wrong


def test_a_pair_that_does_not_collide():
    world = tumble.World()
    world.add_static("ground", tumble.HalfSpace())
    ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=1, position=(0, 0, 0.1))
    world.set_pair_material("ball", "ground", collides=False)
    world.step(240)
    assert ball.position[2] == pytest.approx(0.1 - 0.5 * 9.81, abs=1e-9)


def test_the_words_of_scene_files():
    text = """
    [world]
    event_impulse_n_s = 0.25
    [[body]]
    name = "ground"
    mode = "static"
    shape = { type = "half_space" }
    [[body]]
    name = "gate"
    mode = "static"
    sensor = true
    group = 7
    mask = [0, 2]
    shape = { type = "sphere", radius_m = 1 }
    [[body]]
    name = "ball"
    mass_kg = 1
    position_m = [0, 0, 0.05]
    shape = { type = "sphere", radius_m = 0.1 }
    [[pair]]
    a = "ball"
    b = "ground"
    collides = false
    """
    world = tumble.World.parse(text)
    gate = world["gate"]
    assert world.event_impulse == 0.25
    assert (gate.group, gate.mask, gate.sensor) == (7, 0b101, True)
    assert kinds(world, 1) == [("sensor_begin", "gate", "ball")]
    assert len(world.contacts) == 0
    for wrong, words in [("mask = 3", "a list of collision groups"), ("mask = [64]", "from 0 to 63"), ("group = 64", "from 0 to 63")]:
        with pytest.raises(tumble.SceneError, match=words):
            tumble.World.parse(text.replace("mask = [0, 2]", wrong).replace("group = 7", "") if "group" in wrong else text.replace("mask = [0, 2]", wrong))


def test_a_sleeping_body_is_reported_once():
    world = tumble.World(sleep_after=0.1, sleep_within=1e-4)
    world.add_static("ground", tumble.HalfSpace())
    world.add_rigid("crate", tumble.Box((0.2, 0.2, 0.2)), mass=1, position=(0, 0, 0.1))
    found = kinds(world, 240)
    assert [event for event in found if event[0] in ("asleep", "awake")] == [("asleep", "crate", None)]
    assert np.allclose([event.impulse for event in world.events], 0)


def standing_leg() -> tumble.World:
    """A leg on a slider that stands on its foot, which a fixed joint holds on the calf."""
    world = tumble.World(dt=1 / 240)
    world.add_static("ground", tumble.HalfSpace().named("soil"))
    builder = tumble.ArticulationBuilder("leg")
    builder.add_link("calf", joint="prismatic", axis=(0, 0, 1), position=(0, 0, 0.5), shape=tumble.Sphere(0.05), mass=1)
    builder.add_link("foot", "calf", joint="fixed", position=(0, 0, -0.4), shape=tumble.Sphere(0.1).named("sole"), mass=1)
    world.add_articulation(builder)
    return world


def test_contacts_events_and_touch_sensors_name_the_fixed_link_of_the_user(tmp_path: Path) -> None:
    world = standing_leg()
    felt = {link: world.add_sensor("touch", f"leg/{link}", name=link) for link in ("calf", "foot")}
    with tumble.Recorder(tmp_path / "leg.mcap") as recorder:
        recorder.run(world, 60)
    (contact,) = world.contacts
    sides = sorted(zip(contact["bodies"].tolist(), contact["parts"].tolist(), contact["shapes"].tolist()))
    assert sides == [(0, 0, 0), (1, 1, 0)]
    assert world["leg"].link_names[1] == "foot" and world.shape_name("leg", 1, 0) == "sole"
    (event,) = world.events
    assert (event.kind, event.parts, event.links, event.shape_names) == ("contact_persist", (0, 1), (None, "foot"), ("soil", "sole"))
    assert felt["calf"].value[0] == 0 and felt["foot"].value[0] == pytest.approx(2 * 9.81, abs=1e-6)
    recording = tumble.read(tmp_path / "leg.mcap")
    assert recording.names == ["ground", "leg/calf", "leg/foot"]
    assert recording.position("leg/foot")[-1] == pytest.approx([0, 0, 0.1], abs=1e-6)
    (recorded,) = recording.events[-1]
    assert (recorded.a, recorded.b, recorded.bodies) == ("ground", "leg/foot", ("ground", "leg"))
    assert (recorded.links, recorded.shapes, recorded.shape_names) == ((None, "foot"), (0, 0), ("soil", "sole"))
    found = recording.contacts[-1][0]
    assert sorted(zip(found["bodies"].tolist(), found["shapes"].tolist())) == [(0, 0), (2, 0)]


def test_every_kind_of_event_has_a_trigger() -> None:
    world = tumble.World(dt=1 / 240, sleep_after=0.5)
    world.add_static("ground", tumble.HalfSpace())
    block = world.add_rigid("block", tumble.Box((0.4, 0.4, 0.4)), mass=10, position=(0, 0, 0.2))
    world.add_rigid("ball", tumble.Sphere(0.1), mass=2, position=(0, 0, 4.5))
    fired: dict[str, list[tuple[float, str | None]]] = {}

    def note(view: tumble.View, firing: tumble.Firing) -> None:
        fired.setdefault(firing.event, []).append((firing.time, firing.other))

    triggers = {
        "begin": Trigger.contact("ground", block),
        "persist": Trigger.touching("ground", block),
        "asleep": Trigger.asleep([block]),
        "awake": Trigger.awake(),
    }
    for name, trigger in triggers.items():
        world.add_event(name, trigger, [note])
    persisted = 0
    for _ in range(240):
        world.step()
        persisted += sum(event.kind == "contact_persist" and event.a.name == "ground" and event.b is not None and event.b.name == "block" for event in world.events)
    assert len(fired["begin"]) == len(fired["asleep"]) == len(fired["awake"]) == 1
    assert len(fired["persist"]) == persisted > 100
    # half a second of rest; and the fall of the ball by 4 m
    assert fired["asleep"][0][0] == pytest.approx(0.5, abs=0.01) and fired["awake"][0][0] == pytest.approx((8 / 9.81) ** 0.5, abs=0.01)
    assert {other for firings in fired.values() for _, other in firings} == {"block"}
