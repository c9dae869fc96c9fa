"""What articulations and their links have like rigid bodies: modes, switches, collision filters, contacts, masses."""

import numpy as np
import pytest

import tumble


def pendulum(mass=1.0, bob=0.5):
    """A rod on a revolute joint, and a bob that is fixed to it."""
    builder = tumble.ArticulationBuilder("pendulum")
    builder.add_link("rod", axis=(0, 1, 0), mass=mass, center_of_mass=(0, 0, -0.5), inertia=(0.02 * mass, 0.02 * mass, 0.001 * mass), q=0.3)
    builder.add_link("bob", "rod", joint="fixed", position=(0, 0, -1), mass=bob, center_of_mass=(0, 0.1, 0), inertia=(0.01 * bob,) * 3)
    return builder


def test_masses_set_in_a_world_are_those_of_a_body_built_with_them():
    world, built = tumble.World(), tumble.World()
    arm = world.add_articulation(pendulum())
    built.add_articulation(pendulum(2.5, 1.75))
    arm.link("rod").mass, arm.link("bob").mass = 2.5, 1.75
    assert [link.mass for link in arm.links] == [2.5, 1.75] and arm.mass == 4.25
    assert arm.link("rod").inertia == pytest.approx(np.diag([0.05, 0.05, 0.0025]), abs=1e-15)
    assert arm.inverse_dynamics() == built.articulation("pendulum").inverse_dynamics()
    world.step(200)
    built.step(200)
    assert (world.state == built.state).all()


def test_center_and_inertia_of_a_link():
    world = tumble.World()
    bob = world.add_articulation(pendulum()).link("bob")
    bob.center_of_mass, bob.inertia = (0.2, 0, 0), (1, 2, 3 - 1e-9)
    assert bob.center_of_mass.tolist() == [0.2, 0, 0] and bob.inertia.tolist() == np.diag([1, 2, 3 - 1e-9]).tolist()
    # about the joint: the rod's 0.02 + 1·0.5², the bob's 2 + 0.5·(1² + 0.2²)
    assert bob.articulation.mass_matrix().item() == pytest.approx(0.02 + 0.25 + 2 + 0.5 * 1.04, abs=1e-12)
    for wrong, words in [(-1, "mass is -1"), (float("nan"), "mass is NaN")]:
        with pytest.raises(ValueError, match=words):
            bob.mass = wrong
    assert bob.mass == 0.5 and repr(bob) == "<tumble.Link 'bob' of 'pendulum'>"
    assert bob == world["pendulum"].link("bob") != world["pendulum"].link("rod") and len({bob, world["pendulum"].link("bob")}) == 1
    with pytest.raises(tumble.UnknownNameError, match="foot"):
        world["pendulum"].link("foot")
    description = pendulum().build()
    assert description.link("bob").mass == 0.5
    with pytest.raises(ValueError, match="not in a world"):
        description.link("bob").mass = 1


def walker():
    """A body of two balls on a slide, the second one a link of its own."""
    builder = tumble.ArticulationBuilder("walker")
    builder.add_link("trunk", joint="floating", shape=tumble.Sphere(0.1), position=(0, 0, 0.1), group=2, mask=[0, 1], contacts="spheres")
    builder.add_link("foot", "trunk", joint="prismatic", axis=(1, 0, 0), position=(0.5, 0, 0), shape=tumble.Sphere(0.1))
    return builder


def test_modes_switches_and_contacts():
    world = tumble.World(sleep_after=0.2)
    floor = world.add_static("floor", tumble.HalfSpace())
    body = world.add_articulation(walker())
    assert (body.mode, body.enabled, body.collidable, body.asleep, body.touching) == ("dynamic", True, True, False, [])
    world.step(240)
    assert body.touching == [floor] and body.asleep
    body.mode = "static"
    assert body.mode == "static" and not body.asleep
    body.mode, body.collidable = "dynamic", False
    height = body.q[2]
    world.step(24)
    assert body.q[2] == pytest.approx(height - 0.5 * 9.81 * 0.1**2, rel=0.06) and body.touching == []
    body.enabled = False
    height = body.q[2]
    world.step(24)
    assert body.q[2] == height
    for name in ("mode", "enabled", "collidable", "asleep", "touching"):
        with pytest.raises(ValueError, match="not in a world"):
            getattr(walker().build(), name)
    with pytest.raises(tumble.InvalidValueError):
        body.mode = "floating"


def test_groups_and_masks():
    description = walker().build()
    assert (description.group, description.mask) == (None, None)
    assert [(link.group, link.mask) for link in description.links] == [(2, 3), (0, 2**64 - 1)]
    world = tumble.World()
    world.add_static("floor", tumble.HalfSpace(), group=5)
    body = world.add_articulation(description)
    body.mask = [5]
    assert (body.group, body.mask, body.link("trunk").group) == (None, 1 << 5, 2)
    body.link("foot").group = 4
    body.group = 7
    assert (body.group, body.link("foot").group, body.mask) == (7, 7, 1 << 5)
    world.step(60)
    assert [floor.name for floor in body.touching] == ["floor"]
    body.link("foot").mask = []
    body.link("trunk").mask = None
    assert (body.mask, body.link("foot").mask) == (None, 0)
    world.step()
    with pytest.raises(ValueError, match="group is 64"):
        body.group = 64


def test_shapes_of_a_link_differ():
    builder = tumble.ArticulationBuilder("sled")
    builder.add_link("sled", joint="prismatic", axis=(1, 0, 0), shape=tumble.Sphere(0.1).named("own"), density=1000, qd=2.0, group=1)
    feeler = tumble.Sphere(0.1).named("feeler")
    builder.add_shape("sled", feeler, (0.5, 0, 0), sensor=True, mass=0, group=3, mask=[0], color=(1, 0, 0), visible=False)
    builder.add_shape("sled", tumble.Box(0.1), (0, 1, 0), density=2000, friction=0.1, restitution=0.3, contacts="spheres")
    with pytest.raises(ValueError, match="a mass or a density"):
        builder.add_shape("sled", feeler, mass=1, density=1)
    world = tumble.World()
    sled = world.add_articulation(builder)
    assert sled.link("sled").mass == pytest.approx(4e3 / 3 * np.pi * 0.1**3 + 2, abs=1e-12)
    assert sled.shape_material("sled", 2)["restitution"] == 0.3 and sled.shape_material("sled", "own")["friction"] == 0.5
    post = world.add_static("post", tumble.Sphere(0.1), position=(1, 0.15, 0))
    kinds = []
    while world.time < 0.35:
        world.step()
        kinds += [(event.kind, event.a, event.b) for event in world.events if "sensor" in event.kind]
    assert kinds == [("sensor_begin", sled, post), ("sensor_end", sled, post)] and sled.qd[0] == 2.0


def test_every_setting_can_be_read_and_changed():
    given = dict(substeps=3, iterations=50, max_relaxations=9, solver_tolerance=1e-7, projection_sweeps=4, stabilize_positions=False)
    given |= dict(contact_tolerance=1e-6, drift_tolerance=2e-4, recovery_speed=1.5, integrator_tolerance=1e-6, sleep_after=0.5, sleep_within=1e-4)
    world, other = tumble.World(**given), tumble.World()
    assert {name: getattr(world, name) for name in given} == given
    for name, value in given.items():
        setattr(other, name, value)
    assert {name: getattr(other, name) for name in given} == given
    other.sleep_after = None
    with pytest.raises(ValueError, match="nothing sleeps"):
        other.sleep_within = 1e-3
    with pytest.raises(ValueError, match="drift tolerance"):
        other.drift_tolerance = 1e-9


def test_every_handle_has_a_switch():
    world = tumble.World()
    ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=1)
    handles = [ball, world.add_cloth("flag", nodes=(3, 3), position=(0, 0, 5)), world.add_particles("dust", [tumble.Emitter(rate=240)])]
    handles += [world.add_flock("flock"), world.add_body_flock("school"), world.add_sensor("accelerometer", ball, name="imu")]
    handles += [world.add_event("hop", tumble.Trigger.time(0.1), [tumble.Action.push(ball, (0, 0, 1))])]
    assert all(handle.enabled for handle in handles)
    for handle in handles:
        handle.enabled = False
    before = world.state.copy()
    world.step(48)
    assert (world.state == before).all()
    world["dust"].enabled = True
    world.step(24)
    assert len(world["dust"].positions) == pytest.approx(24, abs=1)
