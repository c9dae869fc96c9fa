"""What Python costs: stepping against the command line, rollouts on two cores against one, views, property reads.

    cargo build --release -p tumble && target/py-tests/bin/python benches/python/costs.py

Needs the package installed (`scripts/test_python.sh` leaves it in target/py-tests). Everything is a ratio within one run.
"""

import os
import resource
import subprocess
import tempfile
import time
from pathlib import Path
from statistics import median

import numpy as np

import tumble

ROOT = Path(__file__).resolve().parents[2]
GRID = """
description = "100 balls on a floor"
[world]
seconds = 2.0
[[body]]
name = "floor"
mode = "static"
shape = { type = "half_space" }
[[grid]]
name = "ball"
count = [10, 10, 1]
spacing_m = [0.3, 0.3, 0.3]
shape = { type = "sphere", radius_m = 0.1 }
mass_kg = 1.0
position_m = [0, 0, 0.1]
"""
STEPS = 480


def cpu(call):
    """Seconds of processor time of this process that a call takes."""
    begun = time.process_time()
    call()
    return time.process_time() - begun


def stepping():
    """100 bodies: one call per step from Python, against one call for all steps, which is Rust's own loop."""
    world = tumble.World.parse(GRID)
    world.step(240)
    one_by_one, together = [], []
    for _ in range(9):
        a, b = world.fork(), world.fork()

        def each():
            for _ in range(STEPS):
                a.step()

        one_by_one.append(cpu(each))
        together.append(cpu(lambda: b.step(STEPS)))
        assert a.save() == b.save()
    ratio = min(one_by_one) / min(together)
    print(f"100 bodies: {1e6 * min(together) / STEPS:.1f} µs a step in Rust's loop; {100 * (ratio - 1):+.2f} % from a loop in Python")


def stepping_with_a_view():
    """The same while Python holds a view of the state, which is then written after every call."""
    world = tumble.World.parse(GRID)
    world.step(240)
    plain, viewed = [], []
    for _ in range(9):
        a, b = world.fork(), world.fork()
        view = b.state

        def each(w):
            for _ in range(STEPS):
                w.step()

        plain.append(cpu(lambda: each(a)))
        viewed.append(cpu(lambda: each(b)))
        assert view.any()
    print(f"the same with a live view of the state: {100 * (min(viewed) / min(plain) - 1):+.2f} %")


def against_the_command():
    """1440 steps by the command, as processor time of a run of 8 s less that of one of 2 s, against as many calls from Python."""
    program = Path(os.environ.get("TUMBLE_COMMAND", ROOT / "target" / "release" / "tumble"))
    if not program.is_file():
        print(f"{program} is not built; not compared with the command")
        return
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "scene.toml"
        scene.write_text(GRID)

        def command(seconds):
            before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
            subprocess.run([program, "run", scene, "--quiet", "--seconds", str(seconds)], check=True)
            return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before

        python, rust = [], []
        for _ in range(7):
            rust.append(command(8) - command(2))
            world = tumble.World.load(scene)
            world.step(480)

            def each():
                for _ in range(1440):
                    world.step()

            python.append(cpu(each))
        print(f"against `tumble run`: {100 * (median(python) / median(rust) - 1):+.2f} % (processor time, median of 7)")


def rollouts():
    """256 forks of the shipped robot on one thread and on two. Other work on the machine spoils the ratio of wall times, and not that of processor
    times: what two threads take more than one in all is what they lose."""
    world = tumble.World.load("robot")
    world.step(10)
    controls = np.zeros((256, 20, world["arm"].dof))
    walls, cpus = {1: [], 2: []}, {1: [], 2: []}
    for _ in range(5):
        for threads in (1, 2):
            begun = time.perf_counter()
            cpus[threads].append(cpu(lambda: world.rollout(controls, threads=threads, every=20)))
            walls[threads].append(time.perf_counter() - begun)
    ratio, share = min(walls[1]) / min(walls[2]), 2 * min(cpus[1]) / min(cpus[2])
    print(f"rollout of 256 forks, 20 steps each, 2 threads against 1: {ratio:.2f} times by wall time, {share:.2f} by processor time")


def reads():
    world = tumble.World.parse(GRID)
    ball = world.bodies[1]
    count = 200_000
    for name, call in [("body.position", lambda: ball.position), ("body.mass", lambda: ball.mass), ("world.state", lambda: world.state)]:
        print(f"{name}: {1e9 * cpu(lambda: [call() for _ in range(count)] and None) / count:.0f} ns")


if __name__ == "__main__":
    stepping()
    stepping_with_a_view()
    against_the_command()
    rollouts()
    reads()
