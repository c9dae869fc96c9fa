"""The report names the objects with the largest residual."""

import math

import tumble


def test_the_report_names_the_worst_island() -> None:
    world = tumble.World(iterations=1)
    world.add_static("ground", tumble.HalfSpace(), restitution=0)
    world.add_rigid("quiet", tumble.Box((0.4, 0.4, 0.4)), mass=1.0, position=(-5, 0, 0.2), restitution=0)
    for i in range(30):
        velocity = (math.cos(2.4 * i), math.sin(2.4 * i), 0)
        world.add_rigid(f"tower {i}", tumble.Box((0.4, 0.4, 0.4)), mass=1.0, position=(0, 0, 0.4 * i + 0.2), velocity=velocity)
    world.step()
    report = world.report
    assert report.unconverged == 1 and not report.worst_converged
    assert report.residual > report.worst_tolerance > 0
    assert report.worst_objects and all(name.startswith("tower") for name in report.worst_objects)
    assert report.worst_island_objects == 30 and report.worst_island_rows % 3 == 0


def test_a_world_without_contacts_has_no_worst_objects() -> None:
    world = tumble.World()
    world.add_rigid("ball", tumble.Sphere(0.1), mass=1.0)
    world.step()
    report = world.report
    assert (report.worst_objects, report.worst_island_objects, report.worst_converged) == ([], 0, True)
