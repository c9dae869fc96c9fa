"""Reading properties leaks nothing."""

import gc
from pathlib import Path

import pytest

import tumble


def resident_bytes():
    """Memory that this process holds now."""
    return 4096 * int(Path("/proc/self/statm").read_text().split()[1])


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="SKIPPED: no /proc on this system")
def test_a_million_reads_leak_nothing():
    world = tumble.World()
    ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=1.0)

    def read(times):
        for _ in range(times):
            ball.position, ball.mass, world.state, world.bodies, world.energy(), world.contacts, world["ball"], world.report

    read(5_000)
    gc.collect()
    before = resident_bytes()
    read(125_000)  # eight properties each
    gc.collect()
    # the smallest object here has 16 bytes: leaking one per read would take 16 MB
    assert resident_bytes() - before < 2_000_000


def test_worlds_that_are_dropped_are_freed():
    def make():
        world = tumble.World.load("stack")
        world.step(2)
        return world.state

    make()
    gc.collect()
    before = resident_bytes()
    for _ in range(200):
        make()
    gc.collect()
    assert resident_bytes() - before < 4_000_000
