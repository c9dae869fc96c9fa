"""Ctrl-C ends work that would take hours: `KeyboardInterrupt` is raised, threads end, the world is as it was.

Each program interrupts itself when its work has begun, by a thread that sends the signal; what it prints is compared.
"""

import subprocess
import sys
import textwrap

import pytest

HEAD = """
import os, signal, threading, time
import numpy as np
import tumble

def soon(seconds=0.3):
    def send():
        time.sleep(seconds)
        global sent
        sent = time.perf_counter()
        os.kill(os.getpid(), signal.SIGINT)
    threading.Thread(target=send, daemon=True).start()

def waited():
    return time.perf_counter() - sent

def threads():
    return sum(1 for _ in os.scandir("/proc/self/task"))

def ball(n):
    # a sphere of n by 2 n quadrilaterals, each of two triangles
    rows = [[(np.sin(a) * np.cos(b), np.sin(a) * np.sin(b), np.cos(a)) for b in np.arange(2 * n) * np.pi / n] for a in np.arange(1, n) * np.pi / n]
    points = np.array([(0, 0, 1), (0, 0, -1), *(p for row in rows for p in row)])
    at = lambda i, j: 2 + i * 2 * n + j % (2 * n)
    faces = [(0, at(0, j), at(0, j + 1)) for j in range(2 * n)] + [(1, at(n - 2, j + 1), at(n - 2, j)) for j in range(2 * n)]
    for i in range(n - 2):
        for j in range(2 * n):
            faces += [(at(i, j), at(i + 1, j), at(i + 1, j + 1)), (at(i, j), at(i + 1, j + 1), at(i, j + 1))]
    return points * (1 + 0.1 * np.sin(7 * points)), np.array(faces)
"""


def run(program):
    """What a program of its own prints, with one number: how long it took to end after the signal, s."""
    done = subprocess.run([sys.executable, "-c", HEAD + textwrap.dedent(program)], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    *lines, after = done.stdout.splitlines()
    return lines, float(after)


ROLLOUT = """
world = tumble.World.load("stack")
{force}
before = world.save()
world.rollout(np.zeros((4, 3, 0)))
count = threads()
soon()
try:
    world.rollout(np.zeros((16, 10_000_000, 0)), every=10_000_000{threads})  # days of steps
    print("came to its end")
except KeyboardInterrupt:
    took = waited()
    print("interrupted")
time.sleep(0.1)
print(world.save() == before, threads() <= count)
world.rollout(np.zeros((2, 3, 0)))
world.step()
print(took)
"""


@pytest.mark.parametrize(
    "force", ["", "world.add_force('none', type('N', (tumble.Force,), {'apply': lambda self, view: None})())"], ids=["plain", "force"]
)
@pytest.mark.parametrize("threads", ["", ", threads=3"], ids=["shared pool", "own pool"])
def test_a_rollout_of_hours_ends(force, threads):
    lines, after = run(ROLLOUT.format(force=force, threads=threads))
    assert lines == ["interrupted", "True True"]
    assert after < 10.0  # a fiftieth of that on a machine that does nothing else


@pytest.mark.parametrize("threads", ["None", "1", "3"])
def test_the_steps_of_a_batch_end(threads):
    lines, after = run(f"""
        batch = tumble.Batch(tumble.World.load("stack"), 4, threads={threads})
        start = batch.state.copy()
        batch.step(substeps=3)
        once, count = batch.state.copy(), threads()
        soon()
        try:
            batch.step(substeps=10_000_000)
        except KeyboardInterrupt:
            took = waited()
            print("interrupted")
        print(threads() <= count, (batch.state != once).any())
        batch.reset()
        print((batch.state == start).all())
        batch.step(substeps=3)
        print((batch.state == once).all())
        print(took)
    """)
    assert lines == ["interrupted", "True True", "True", "True"] and after < 10.0


def test_a_rollout_within_a_force_ends():
    lines, after = run("""
        class Plans(tumble.Force):
            def apply(self, view):
                inner.rollout(np.zeros((2, 3_000_000, 0)), every=3_000_000)
            def fork(self):
                return self

        inner = tumble.World.load("stack")
        world = tumble.World()
        world.add_rigid("ball", tumble.Sphere(0.1), mass=1.0)
        world.add_force("plans", Plans())
        soon()
        try:
            world.rollout(np.zeros((4, 10, 0)))
        except KeyboardInterrupt:
            print("interrupted")
        print(waited())
    """)
    assert lines == ["interrupted"] and after < 10.0


@pytest.mark.parametrize("method", ["medial", "hubbard", "grid", "octree"])
def test_the_building_of_a_tree_ends(method):
    lines, after = run(f"""
        mesh = ball(60)
        count = threads()
        soon(1.0)
        try:
            for _ in range(1000):
                tumble.SphereTree.build(*mesh, method="{method}", branching=8, depth=5, max_error=1e-4, cache=False)
        except KeyboardInterrupt:
            print("interrupted")
        took = waited()
        print(threads() - count <= os.cpu_count() + 1)
        print(took)
    """)
    assert lines == ["interrupted", "True"] and after < 10.0


def test_a_signal_that_raises_nothing_lets_work_go_on():
    lines, _ = run("""
        world = tumble.World.load("stack")
        seen = []
        signal.signal(signal.SIGINT, lambda *_: seen.append(1))
        soon(0.2)
        ends = world.rollout(np.zeros((4, 3000, 0)), every=3000)
        while not seen:
            time.sleep(0.05)
        world.step(3000)
        print((ends[0, 0] == world.state).all(), len(seen))
        print(0)
    """)
    assert lines == ["True 1"]


def test_the_number_of_frames_that_a_rollout_did_before_changes_nothing():
    lines, _ = run("""
        world = tumble.World.load("stack")
        whole = world.rollout(np.zeros((3, 50, 0)), every=10)
        soon(0.1)
        try:
            world.rollout(np.zeros((3, 3_000_000, 0)), every=3_000_000)
        except KeyboardInterrupt:
            print((world.rollout(np.zeros((3, 50, 0)), every=10) == whole).all())
        print(0)
    """)
    assert lines == ["True"]
