"""What a job costs beside its own work, on each engine that is installed: two workers on this machine.

    target/py-tests/bin/python benches/python/clusters.py
"""

import concurrent.futures
import functools
import importlib.util
import multiprocessing
import tempfile
import time

import numpy as np

import tumble
import tumble.distributed

TURNS = 3


def nothing(_):
    return None


def give(megabytes):
    return np.zeros(int(megabytes * 125_000))


def work(_):
    """A fifth of a second of this processor."""
    end = time.process_time() + 0.2
    while time.process_time() < end:
        pass


def seconds(call):
    """The best of some turns."""
    best = np.inf
    for _ in range(TURNS):
        start = time.perf_counter()
        call()
        best = min(best, time.perf_counter() - start)
    return best


def pool():
    return concurrent.futures.ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn"))


def main():
    print("engine   start, s   a job, ms   a MB of result, ms   20 jobs of 0.2 s on 2 workers, s")
    engines = {"none": None, "pool": pool, "dask": "dask", "ray": "ray"}
    for name, kind in engines.items():
        if name in ("dask", "ray") and importlib.util.find_spec({"dask": "distributed"}.get(name, name)) is None:
            print(f"{name:8} not installed")
            continue
        start = time.perf_counter()
        with tumble.distributed.connect(kind, workers=2) as engine:
            tumble.distributed.map(nothing, range(8), engine=engine)
            started = time.perf_counter() - start
            run = functools.partial(tumble.distributed.map, engine=engine, timeout_s=300)
            job = seconds(lambda: run(nothing, range(500))) / 500
            large = (seconds(lambda: run(give, [8.0] * 20)) / 20 - job) / 8
            busy = seconds(lambda: run(work, range(20)))
            print(f"{name:8} {started:8.2f} {1e3 * job:11.2f} {1e3 * large:20.2f} {busy:18.2f}", flush=True)
    with tempfile.TemporaryDirectory() as store:
        tumble.distributed.map(nothing, range(500), store=store)
        print(f"a look-up in the store: {1e3 * seconds(lambda: tumble.distributed.map(nothing, range(500), store=store)) / 500:.2f} ms")
    world = tumble.World()
    world.add_articulation("scenes/robot/arm.urdf", name="arm")
    model, snapshot, torques = world.model(), world.save(), np.zeros((240, 6))
    call = seconds(lambda: [tumble.simulate(model, snapshot, torques[:1]) for _ in range(100)]) / 100
    whole = seconds(lambda: [tumble.simulate(model, snapshot, torques, every=240) for _ in range(10)]) / 10
    print(f"simulate: {1e3 * call:.2f} ms for a call of one step, {1e3 * whole:.1f} ms for a second of an arm; the model has {len(model) / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
