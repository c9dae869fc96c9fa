"""What Python costs: stepping against the command line, rollouts on two cores against one, views, property reads.

    cargo build --release -p tumble && target/py-tests/bin/python benches/python/costs.py

Needs the package installed (`scripts/test_python.sh` leaves it in target/py-tests). Everything is a ratio within one run.
"""

import json
import os
import subprocess
import tempfile
import time
from pathlib import Path

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


def wall(call):
    begun = time.perf_counter()
    call()
    return time.perf_counter() - begun


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
    """The time that the command itself reports for its steps, if it is built."""
    program = Path(os.environ.get("TUMBLE_COMMAND", ROOT / "target" / "release" / "tumble"))
    if not program.is_file():
        print(f"{program} is not built; not compared with the command")
        return
    with tempfile.TemporaryDirectory() as folder:
        scene, summary = Path(folder) / "scene.toml", Path(folder) / "end.json"
        scene.write_text(GRID)
        python, command = [], []
        for _ in range(7):
            subprocess.run([program, "run", scene, "--quiet", "--summary", summary], check=True)
            command.append(json.loads(summary.read_text())["wall_s"])
            world = tumble.World.load(scene)

            def each():
                for _ in range(STEPS):
                    world.step()

            python.append(wall(each))
        print(f"against `tumble run`: {100 * (min(python) / min(command) - 1):+.2f} % (wall time of the steps, best of 7)")


def rollouts():
    """256 forks of the shipped robot on one thread and on two."""
    world = tumble.World.load("robot")
    world.step(10)
    controls = np.zeros((256, 20, world["arm"].dof))
    one, two = [], []
    for _ in range(3):
        one.append(wall(lambda: world.rollout(controls, threads=1, every=20)))
        two.append(wall(lambda: world.rollout(controls, threads=2, every=20)))
    print(f"rollout of 256 forks, 20 steps each: {min(one):.2f} s on 1 thread, {min(two):.2f} s on 2: {min(one) / min(two):.2f} times")


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
