"""Many jobs on real local clusters of several processes: the same bytes as in one process, workers that die, runs that are interrupted, look-ups."""

import functools
import importlib.util
import io
import itertools
import multiprocessing
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import tumble
import tumble.distributed
from tumble.distributed import JobError, Progress, Store

WAIT = {"timeout_s": 120}


def pool():
    return ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn"))


@pytest.fixture(scope="module", params=["ray", "dask", "pool"])
def cluster(request):
    """Two workers of each kind."""
    if request.param == "pool":
        with tumble.distributed.connect(pool) as engine:
            yield engine
        return
    package = {"ray": "ray", "dask": "distributed"}[request.param]
    if importlib.util.find_spec(package) is None:
        pytest.skip(f"SKIPPED: {package} is not installed; `make references` installs Ray, scripts/test_python.sh Dask")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", str(Path(__file__).parent), prepend=os.pathsep)  # workers import the functions of this file
        with tumble.distributed.connect(request.param, workers=2) as engine:
            yield engine


@pytest.fixture
def arm(root):
    world = tumble.World()
    world.add_static("floor", tumble.HalfSpace(offset=-0.2))
    world.add_articulation(root / "scenes" / "robot" / "arm.urdf", name="arm")
    return functools.partial(tumble.simulate, world.model(), world.save(), every=5)


def torques(count):
    return list(np.random.default_rng(0).normal(0, 10, (count, 20, 6)))


def files(folder):
    """Names and bytes of all results of a store."""
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.glob("??/*")}


def test_any_engine_gives_the_bytes_of_one_process(cluster, arm, tmp_path):
    jobs = torques(24)
    alone = tumble.distributed.map(arm, jobs, store=tmp_path / "alone")
    there = tumble.distributed.map(arm, jobs, engine=cluster, store=tmp_path / "there", **WAIT)
    for one, other in zip(alone, there, strict=True):
        assert all(one[key].tobytes() == other[key].tobytes() and one[key].dtype == other[key].dtype for key in one)
    assert len(files(tmp_path / "alone")) == 24 and files(tmp_path / "alone") == files(tmp_path / "there")
    assert there[0]["q"].flags.writeable  # arrays of its own


def test_threads_give_them_too(arm):
    jobs = torques(6)
    with ThreadPoolExecutor(2) as executor:
        there = tumble.distributed.map(arm, jobs, engine=executor, **WAIT)
        assert executor.submit(int, "1").result(10) == 1  # it is left alone
    assert [each["state"].tobytes() for each in there] == [arm(job)["state"].tobytes() for job in jobs]


def here(_):
    time.sleep(0.2)  # so that one worker does not take all
    return os.getpid()


def test_jobs_run_in_several_processes(cluster):
    workers = set(tumble.distributed.map(here, range(8), engine=cluster, **WAIT))
    assert len(workers) == 2 and os.getpid() not in workers


def dies_once(job):
    """Kills its own worker at the first try of one job."""
    folder, number = job
    if number == 5 and not (folder / "died").exists():
        (folder / "died").write_text(str(os.getpid()))
        os.kill(os.getpid(), signal.SIGKILL)
    return np.arange(4.0) * number


def test_a_killed_worker_costs_no_result(cluster, tmp_path):
    jobs = [(tmp_path, number) for number in range(12)]
    results = tumble.distributed.map(dies_once, jobs, engine=cluster, **WAIT)
    died = int((tmp_path / "died").read_text())
    assert [each.tobytes() for each in results] == [(np.arange(4.0) * number).tobytes() for number in range(12)]
    assert died != os.getpid() and died not in tumble.distributed.map(here, range(6), engine=cluster, **WAIT)


def dies(number):
    if number == 2:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def test_a_job_that_kills_every_worker_fails_alone(cluster):
    results = tumble.distributed.map(dies, range(6), engine=cluster, retries=1, errors="return", **WAIT)
    assert isinstance(results[2], JobError) and results[2].number == 2 and str(results[2]).startswith("job 2: ")
    assert results[:2] + results[3:] == [0, 1, 3, 4, 5]


def always_dies(folder):
    (folder / f"{time.monotonic_ns()}-{os.getpid()}").touch()
    os.kill(os.getpid(), signal.SIGKILL)


@pytest.mark.parametrize("retries", [0, 1, 2])
def test_a_killer_is_called_once_and_retries_times_again(cluster, tmp_path, retries):
    results = tumble.distributed.map(always_dies, [tmp_path], engine=cluster, retries=retries, errors="return", **WAIT)
    assert isinstance(results[0], JobError) and len(list(tmp_path.iterdir())) == 1 + retries
    assert tumble.distributed.map(divide, [2], engine=cluster, retries=0, **WAIT) == [6]


def divide(number):
    return 12 // number


def test_an_exception_of_the_function_is_raised_after_all_others(cluster, tmp_path):
    seen = []
    with pytest.raises(JobError, match=r"(?s)job 1: ZeroDivisionError.*in divide.*and 1 more of 4 jobs") as caught:
        tumble.distributed.map(divide, [3, 0, 4, 0], engine=cluster, store=tmp_path, progress=seen.append, **WAIT)
    assert isinstance(caught.value.__cause__, ZeroDivisionError) and caught.value.number == 1
    assert len(files(tmp_path)) == 2 and (seen[-1].done, seen[-1].failed, seen[-1].total) == (4, 2, 4)
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)


def count_up(job):
    folder, number = job
    (folder / f"{number}-{time.monotonic_ns()}").touch()
    return number * number


def test_a_repeated_job_is_a_look_up(cluster, tmp_path):
    ran, seen = tmp_path / "ran", []
    ran.mkdir()
    jobs = [(ran, number) for number in range(6)]
    for _ in range(2):
        assert tumble.distributed.map(count_up, jobs, engine=cluster, store=tmp_path / "store", progress=seen.append, **WAIT) == [0, 1, 4, 9, 16, 25]
    assert len(list(ran.iterdir())) == 6
    assert [(each.done, each.looked_up) for each in seen[-6:]] == [(n, n) for n in range(1, 7)]
    assert tumble.distributed.map(count_up, [*jobs, (ran, 7)], engine=cluster, store=tmp_path / "store", **WAIT)[-1] == 49
    tumble.distributed.map(count_up, jobs, engine=cluster, store=tmp_path / "store", version="2", **WAIT)
    assert len(list(ran.iterdir())) == 13


def test_known_results_start_no_engine(tmp_path):
    tumble.distributed.map(divide, [1, 2], store=tmp_path)
    assert tumble.distributed.map(divide, [2, 1], store=tmp_path, engine=lambda: pytest.fail("an engine was started")) == [6, 12]


def test_a_damaged_result_is_computed_again(tmp_path):
    tumble.distributed.map(divide, [1, 2], store=tmp_path)
    store, name = Store(tmp_path), tumble.distributed.key(divide, 2)
    whole = store.path(name).read_bytes()
    for bad in (whole[:-1], b"", whole[:-1] + b"x", b"other" + whole):
        store.path(name).write_bytes(bad)
        assert store.get(name) is None and tumble.distributed.map(divide, [2], store=store) == [6]
        assert store.path(name).read_bytes() == whole
    assert len(store) == 2


def test_what_was_left_unfinished_is_removed_after_a_day(tmp_path):
    Store(tmp_path).put("ab" * 32, b"result")
    fresh, stale = tmp_path / "unfinished-1", tmp_path / "unfinished-2"
    for file in (fresh, stale):
        file.write_bytes(b"part")
    os.utime(stale, (time.time() - 90000,) * 2)
    store = Store(tmp_path)
    assert fresh.exists() and not stale.exists() and len(store) == 1 and store.get("ab" * 32) == b"result"


SCRIPT = """
import os, signal, sys, time
import tumble.distributed

# where the tests run in the background, Python finds SIGINT ignored and leaves it so
signal.signal(signal.SIGINT, signal.default_int_handler)

def slow(number):
    time.sleep(60 if number >= 12 and "QUICK" not in os.environ else 0)
    return number

if __name__ == "__main__":
    from concurrent.futures import ProcessPoolExecutor
    engine = {"serial": None, "pool": lambda: ProcessPoolExecutor(2)}.get(sys.argv[2], sys.argv[2])
    seen = lambda progress: print(progress.done, progress.looked_up, flush=True)
    found = tumble.distributed.map(slow, range(16), engine=engine, workers=2, store=sys.argv[1], progress=seen)
    assert found == list(range(16))
"""


@pytest.mark.parametrize("engine", ["serial", "pool", "dask", "ray"])
def test_results_of_an_interrupted_run_are_kept(engine, tmp_path):
    if engine in ("ray", "dask") and importlib.util.find_spec({"ray": "ray", "dask": "distributed"}[engine]) is None:
        pytest.skip(f"SKIPPED: {engine} is not installed")
    script, store = tmp_path / "script.py", tmp_path / "store"
    script.write_text(SCRIPT)
    command = [sys.executable, script, store, engine]
    program = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True)
    watch = threading.Timer(120, program.kill)
    watch.start()
    try:
        while not program.stdout.readline().startswith("8 "):
            assert program.poll() is None, program.stderr.read()
        program.send_signal(signal.SIGINT)
        _, said = program.communicate(timeout=50)
        assert program.returncode == -signal.SIGINT or "KeyboardInterrupt" in said, said
    finally:
        watch.cancel()
        if program.poll() is None:
            os.killpg(program.pid, signal.SIGKILL)
            program.communicate(timeout=30)
    kept = len(Store(store))
    assert 8 <= kept <= 12
    again = subprocess.run(command, env={**os.environ, "QUICK": "1"}, capture_output=True, text=True, timeout=120)
    assert again.returncode == 0 and again.stdout.splitlines()[-1] == f"16 {kept}", again.stderr


def forever(_):
    time.sleep(600)


def test_waiting_ends(tmp_path):
    start = time.monotonic()
    with pytest.raises(TimeoutError, match="no job finished within 2 s; 3 are at the engine"):
        tumble.distributed.map(forever, range(3), engine=pool, timeout_s=2)
    assert time.monotonic() - start < 60


def test_an_executor_of_the_program_that_breaks_is_not_replaced():
    with ProcessPoolExecutor(1) as executor:
        results = tumble.distributed.map(dies, range(6), engine=executor, errors="return", **WAIT)
    assert isinstance(results[2], JobError) and "give a function that makes executors" in str(results[2])


def test_results_as_they_finish():
    endless = iter(range(10**9))
    taken = []
    for number, result in tumble.distributed.as_completed(lambda n: 2 * n, endless):
        taken.append((number, result))
        if len(taken) == 3:
            break
    assert taken == [(0, 0), (1, 2), (2, 4)] and next(endless) <= 4


def test_a_bar_is_drawn_on_a_terminal_alone():
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    from tumble.distributed.progress import Bar

    terminal, file = Terminal(), io.StringIO()
    for bar in (Bar(terminal), Bar(file)):
        for done in range(1, 5):
            bar(Progress(done, 1, 0, 4, done * 1.0))
    assert file.getvalue() == ""
    shown = terminal.getvalue().rstrip("\n").split("\r")
    assert shown[2] == f"[{'#' * 15}{'.' * 15}] 2/4, 1 looked up, 2.0 s" and shown[-1].startswith("[" + "#" * 30 + "] 4/4")


def test_a_grid_has_every_combination():
    assert tumble.distributed.grid(mass=[1, 2], friction=[0.1, 0.5]) == [
        {"mass": 1, "friction": 0.1}, {"mass": 1, "friction": 0.5}, {"mass": 2, "friction": 0.1}, {"mass": 2, "friction": 0.5}
    ]  # fmt: skip
    assert tumble.distributed.grid() == [{}]


@pytest.mark.parametrize(
    ("words", "error", "text"),
    [
        ({"engine": "slurm"}, ValueError, "by name there are 'ray', 'dask'"),
        ({"engine": 3}, ValueError, "engine is 3; expected"),
        ({"engine": pool, "workers": 0}, ValueError, "workers is 0"),
        ({"retries": -1}, ValueError, "retries is -1"),
        ({"timeout_s": 0}, ValueError, "timeout_s is 0"),
        ({"timeout_s": float("nan")}, ValueError, "timeout_s is nan"),
        ({"errors": "ignore"}, ValueError, "errors is 'ignore'"),
    ],
)
def test_wrong_arguments_are_refused(words, error, text):
    with pytest.raises(error, match=text):
        tumble.distributed.map(divide, [1, 2], **words)


@pytest.mark.parametrize(("engine", "package"), [("ray", "ray"), ("dask", "distributed")])
def test_without_the_package_the_error_names_it(engine, package, monkeypatch):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(ImportError, match=f"engine '{engine}' needs the package {package}: pip install"):
        tumble.distributed.connect(engine)


@pytest.mark.parametrize("engine", [None, lambda: ThreadPoolExecutor(2)])
def test_equal_jobs_run_once(engine, tmp_path):
    ran, seen = tmp_path / "ran", []
    ran.mkdir()
    jobs = [(ran, number) for number in (3, 4, 3, 3, 4, 3)]
    assert tumble.distributed.map(count_up, jobs, engine=engine, store=tmp_path / "store", progress=seen.append) == [9, 16, 9, 9, 16, 9]
    assert len(list(ran.iterdir())) == 2 and len(seen) == 6 and seen[-1].looked_up == 4


@pytest.mark.parametrize("engine", [None, lambda: ThreadPoolExecutor(2)])
def test_equal_jobs_have_one_error(engine, tmp_path):
    results = tumble.distributed.map(divide, [0, 1, 0], engine=engine, store=tmp_path, errors="return")
    assert results[1] == 12 and [(each.number, type(each.__cause__)) for each in results[::2]] == [(0, ZeroDivisionError), (2, ZeroDivisionError)]


def test_equal_jobs_without_end_are_taken_as_workers_are_free(tmp_path):
    endless = itertools.repeat(2)
    found = tumble.distributed.as_completed(divide, endless, engine=lambda: ThreadPoolExecutor(2), store=tmp_path)
    assert {number: result for number, result in itertools.islice(found, 20)} == dict.fromkeys(range(20), 6)


def test_a_closed_client_of_dask_is_refused():
    pytest.importorskip("distributed", reason="SKIPPED: distributed is not installed; scripts/test_python.sh installs it")
    engine = tumble.distributed.connect("dask", workers=1)
    engine.close()
    with pytest.raises(ValueError, match="this client of Dask is closed"):
        tumble.distributed.map(divide, [1], engine=engine)
