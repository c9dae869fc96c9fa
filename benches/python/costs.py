"""The cost of Python: stepping against Rust, forces in Python, rollouts on two cores against one, setting the state, property reads.

    cargo build --release -p tumble --example steps && target/py-tests/bin/python benches/python/costs.py [NAME ...]

Needs the package installed (`scripts/test_python.sh` leaves it in target/py-tests). The programs take turns of some milliseconds, in changing order, measured as
processor time of the thread. Each pair of turns gives a ratio, and each round the median of its ratios. A round begins with new worlds and processes, because the
place of memory matters too. The result is the median of the rounds with its 95 % interval. Other work on the machine changes little.
With NAMEs only the programs that begin with one of them run.
"""

import os
import random
import subprocess
import sys
import tempfile
import time
from math import comb
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
WARM = 240  # steps before
TURN, PAIRS, ROUNDS = 60, 40, 12  # steps of a turn, pairs of turns in a round, rounds
# Between programs: a turn so long that being woken and reading a line (some 50 µs where Python does it) is nothing, and many starts, since a program's speed differs from one to the next.
LONG, FEW, STARTS = 300, 6, 40


def cpu(call):
    """Seconds of processor time of this thread that a call takes."""
    begun = time.thread_time()
    call()
    return time.thread_time() - begun


def paired(begin, rounds=ROUNDS, pairs=PAIRS):
    """How much dearer the first of two kinds of turns is; ``begin`` gives both, and what ends the round. Median less 1, its interval, seconds of the other."""
    order, ratios, plain = random.Random(0), [], []
    for _ in range(rounds):
        one, other, end = begin()
        own = []
        for _ in range(pairs):
            if order.random() < 0.5:
                a, b = one(), other()
            else:
                b, a = other(), one()
            own.append(a / b - 1)
            plain.append(b)
        end()
        ratios.append(median(own))
    ratios.sort()
    # fewer than `out` of all lie below the median, or above it, with 2 * (1 + n + n over 2 + ...) / 2**n
    out = max(k for k in range(1, rounds) if 2 * sum(comb(rounds, i) for i in range(k)) <= 0.05 * 2**rounds)
    return median(ratios), ratios[out - 1], ratios[-out], median(plain)


def report(what, found, steps=TURN):
    ratio, low, high, turn = found
    print(f"{what}: {100 * ratio:+.2f} % ({100 * low:+.2f} to {100 * high:+.2f}; {1e6 * turn / steps:.1f} µs a step)")


def grid():
    world = tumble.World.parse(GRID)
    world.step(WARM)
    return world


def each(world):
    """A turn from Python: one call for each step."""

    def turn():
        for _ in range(TURN):
            world.step()

    return cpu(turn)


def together(world):
    """A turn in Rust's own loop."""
    return cpu(lambda: world.step(TURN))


def of_two(one, other):
    """A round in this process: two worlds, that change places after every turn of both."""

    def begin():
        worlds, taken = [grid(), grid()], []

        def turn(kind, k):
            pair = len(taken) // 2
            taken.append(kind)
            return kind(worlds[(k + pair) % 2])

        return lambda: turn(one, 0), lambda: turn(other, 1), lambda: None

    return begin


def stepping():
    """100 bodies: one call per step, against one call for all steps, which is Rust's own loop in the same library."""
    report("100 bodies, a loop in Python against step(n)", paired(of_two(each, together)))
    report("the same against itself", paired(of_two(together, together)))


class Child:
    """A program that steps a scene on command: in Rust, of the same crates in the same profile, or in Python."""

    def __init__(self, scene, words):
        self.child = subprocess.Popen([*words, scene], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1)
        self.step(WARM)

    def step(self, n):
        self.child.stdin.write(f"{n}\n")
        return int(self.child.stdout.readline())

    def ran(self):
        """Seconds that it was on a processor: exact, since it sleeps now."""
        return int(Path(f"/proc/{self.child.pid}/schedstat").read_text().split()[0]) * 1e-9

    def turn(self):
        begun = self.ran()
        self.step(LONG)
        return self.ran() - begun

    def end(self):
        self.child.stdin.close()
        self.child.wait(timeout=30)


def child(scene, at_once):
    """What the program in Python does: for every line that many steps, by a call each or by one."""
    world = tumble.World.load(scene)
    for line in sys.stdin:
        if at_once:
            world.step(int(line))
        else:
            for _ in range(int(line)):
                world.step()
        print(world.frame, flush=True)


def against_rust():
    """100 bodies: a program in Python against a program in Rust, in turns."""
    rust = [os.environ.get("TUMBLE_STEPS", ROOT / "target" / "release" / "examples" / "steps")]
    if not Path(rust[0]).is_file():
        print(f"{rust[0]} is not built; not compared with a program in Rust")
        return
    loop, once = ([sys.executable, __file__, word] for word in ("--loop", "--once"))
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "scene.toml"
        scene.write_text(GRID)

        def compare(what, one, other):
            def start():
                a, b = Child(scene, one), Child(scene, other)
                return a.turn, b.turn, lambda: (a.end(), b.end())

            report(what, paired(start, STARTS, FEW), LONG)

        compare("100 bodies, a program in Python against one in Rust", loop, rust)
        compare("the same, step(n) against one in Rust", once, rust)
        compare("one in Rust against itself", rust, rust)


def view_held():
    """The same while Python holds a view of the state."""

    def begin():
        a, b = grid(), grid()
        view = a.state
        return lambda: each(a), lambda: each(b), lambda: view.any()

    report("a view of the state held against none", paired(begin))


class Nothing(tumble.Force):
    def apply(self, view):
        pass


class Wind(tumble.Force):
    def apply(self, view):
        view.force += 0.1 * ((1.0, 0.0, 0.0) - view.velocity)


def forces():
    """What a force in Python adds to a step, by number of bodies."""
    for count in (10, 100, 1000):
        worlds = []
        for force in (None, Nothing(), Wind()):
            world = tumble.World(gravity=(0, 0, 0))
            for k in range(count):
                world.add_rigid(f"ball{k}", tumble.Sphere(0.1), mass=1.0, position=(3.0 * k, 0, 0))
            if force is not None:
                world.add_force("force", force)
            world.step(5)
            worlds.append(world)
        steps = max(2, 2000 // count)
        times = [[cpu(lambda: world.step(steps)) / steps for world in worlds] for _ in range(60)]
        none, nothing, wind = (1e6 * median(column) for column in zip(*times))
        print(f"{count} bodies: {none:.1f} µs a step; with a force that does nothing {nothing - none:+.1f} µs, with a wind {wind - none:+.1f} µs")


def setting():
    """Setting the whole state, by number of bodies."""
    for count in (100, 1000, 4000):
        world = tumble.World(gravity=(0, 0, 0))
        for k in range(count):
            world.add_rigid(f"ball{k}", tumble.Sphere(0.1), mass=1.0, position=(3.0 * k, 0, 0))
        x = world.state.copy()
        taken = median(cpu(lambda: setattr(world, "state", x)) for _ in range(40))
        print(f"world.state = x, {count} bodies: {1e6 * taken:.0f} µs")


def rollouts():
    """256 forks of the shipped robot on one thread and on two. Other work on the machine spoils the ratio of wall times, and not that of processor
    times: what two threads take more than one in all is what they lose."""
    world = tumble.World.load("robot")
    world.step(10)
    controls = np.zeros((256, 20, world["arm"].dof))
    walls, cpus = {1: [], 2: []}, {1: [], 2: []}
    for _ in range(5):
        for threads in (1, 2):
            begun, ran = time.perf_counter(), time.process_time()
            world.rollout(controls, threads=threads, every=20)
            walls[threads].append(time.perf_counter() - begun)
            cpus[threads].append(time.process_time() - ran)
    ratio, share = min(walls[1]) / min(walls[2]), 2 * min(cpus[1]) / min(cpus[2])
    print(f"rollout of 256 forks, 20 steps each, 2 threads against 1: {ratio:.2f} times by wall time, {share:.2f} by processor time")


def reads():
    world = tumble.World.parse(GRID)
    ball = world.bodies[1]
    count = 200_000
    for name, call in [("body.position", lambda: ball.position), ("body.mass", lambda: ball.mass), ("world.state", lambda: world.state)]:
        print(f"{name}: {1e9 * cpu(lambda: [call() for _ in range(count)] and None) / count:.0f} ns")


if __name__ == "__main__":
    if sys.argv[1:2] in (["--loop"], ["--once"]):
        child(sys.argv[2], sys.argv[1] == "--once")
        sys.exit()
    asked = sys.argv[1:] or [""]
    for run in (stepping, against_rust, view_held, forces, setting, rollouts, reads):
        if any(run.__name__.startswith(name) for name in asked):
            run()
