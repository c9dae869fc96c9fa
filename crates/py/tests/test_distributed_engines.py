"""Engines that lose jobs, hang or break: lost jobs are tried as often as promised, and engines are closed."""

import multiprocessing
import pickle
import signal
import time
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor

import pytest

import tumble
import tumble.distributed
from tumble.distributed import JobError
from tumble.distributed.calls import Outcome, call


def pool():
    return ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn"))


def divide(number):
    return 12 // number


class Losing(tumble.distributed.Engine):
    """An engine of four slots that loses each job a number of times."""

    def __init__(self, losses, retries_itself=False):
        self.losses, self.retries_itself, self.tries, self.closed = losses, retries_itself, {}, False

    def session(self, function, retries):
        return LosingSession(self, function, retries)

    def close(self):
        self.closed = True


class LosingSession(tumble.distributed.Session):
    slots = 4

    def __init__(self, engine, function, retries):
        self.engine, self.function, self.running = engine, function, []
        self.retries_itself, self.tries = engine.retries_itself, 1 + retries * engine.retries_itself

    def submit(self, number, job):
        self.running.append((number, job))

    def finished(self, timeout_s):
        number, job = self.running.pop(0)
        for _ in range(self.tries):
            self.engine.tries[number] = self.engine.tries.get(number, 0) + 1
            if self.engine.tries[number] > self.engine.losses:
                return [(number, call(self.function, job))]
        return [(number, Outcome(False, None, "lost"))]


@pytest.mark.parametrize("retries_itself", [False, True])
@pytest.mark.parametrize(("retries", "losses"), [(0, 1), (1, 1), (1, 2), (3, 3), (3, 9)])
def test_a_lost_job_is_tried_as_often_as_promised(retries_itself, retries, losses):
    engine = Losing(losses, retries_itself)
    results = tumble.distributed.map(divide, [1, 2, 3], engine=engine, retries=retries, errors="return")
    assert engine.tries == dict.fromkeys(range(3), 1 + min(retries, losses))
    assert results == [12, 6, 4] if retries >= losses else all(isinstance(each, JobError) for each in results)


@pytest.mark.parametrize("retries_itself", [False, True])
def test_lost_jobs_among_endless_ones_are_tried_again(retries_itself):
    def endless():
        yield from range(100)
        pytest.fail("no lost job was tried again")

    found = tumble.distributed.as_completed(lambda n: 2 * n, endless(), engine=Losing(1, retries_itself), retries=1)
    assert dict(next(found) for _ in range(12)) == {number: 2 * number for number in range(12)}


def test_late_news_of_a_broken_pool_leaves_the_new_one_alone():
    made = []

    class Pool(Executor):
        def __init__(self):
            made.append(self)
            self.futures, self.stopped = [], False

        def submit(self, *_):
            self.futures.append(Future())
            return self.futures[-1]

        def shutdown(self, wait=True, *, cancel_futures=False):
            self.stopped = True

    with tumble.distributed.connect(Pool) as engine:
        session = engine.session(divide, 0)
        session.submit(0, 1)
        session.submit(1, 1)
        old = made[0].futures
        old[0].set_exception(BrokenExecutor("gone"))
        assert [number for number, _ in session.finished(5)] == [0] and made[0].stopped
        session.submit(2, 1)
        old[1].set_exception(BrokenExecutor("gone"))
        assert [number for number, _ in session.finished(5)] == [1]
        session.submit(3, 1)
        assert len(made) == 2 and not made[1].stopped and len(made[1].futures) == 2
    assert made[1].stopped


def stubborn(_):
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    time.sleep(600)


def test_processes_that_do_not_end_are_killed(monkeypatch):
    monkeypatch.setattr("tumble.distributed.executors.STOP_S", 0.5)
    made = []

    def make():
        made.append(pool())
        return made[-1]

    with pytest.raises(TimeoutError):
        engine = tumble.distributed.connect(make)
        try:
            tumble.distributed.map(stubborn, range(2), engine=engine, timeout_s=4)
        finally:
            processes = list(made[0]._processes.values())
            engine.close()
    assert len(processes) == 2 and not any(process.is_alive() for process in processes)


class Stuck(Losing):
    """An engine whose jobs never finish and cannot be taken back."""

    def session(self, function, retries):
        session = super().session(function, retries)
        session.finished, session.cancel = lambda timeout_s: [], lambda: 1 // 0
        return session


def test_an_engine_that_cannot_take_jobs_back_is_closed_and_hides_no_error(monkeypatch):
    engine = Stuck(0)
    monkeypatch.setattr("tumble.distributed.jobs.connect", lambda *_, **__: engine)
    with pytest.raises(TimeoutError, match="no job finished within 3 s"):
        tumble.distributed.map(divide, [1], engine="stuck", timeout_s=3)
    assert engine.closed


def test_a_cluster_without_a_client_is_closed(monkeypatch):
    distributed = pytest.importorskip("distributed", reason="SKIPPED: distributed is not installed")
    closed = []

    class Cluster:
        def __init__(self, **_):
            pass

        def close(self, timeout):
            closed.append(timeout)

    def refuse(*_, **__):
        raise OSError("no connection")

    monkeypatch.delenv("DASK_SCHEDULER_ADDRESS", raising=False)
    monkeypatch.setattr(distributed, "LocalCluster", Cluster)
    monkeypatch.setattr(distributed, "Client", refuse)
    monkeypatch.setattr(distributed, "default_client", lambda: (_ for _ in ()).throw(ValueError))
    with pytest.raises(OSError, match="no connection"):
        tumble.distributed.connect("dask")
    assert len(closed) == 1


def test_jobs_that_are_canceled_elsewhere_are_not_taken_for_slow_ones():
    distributed = pytest.importorskip("distributed", reason="SKIPPED: distributed is not installed")
    with tumble.distributed.connect("dask", workers=1) as engine:
        session = engine.session(divide, 0)
        wait, calls = session.distributed.wait, []

        def canceled(*words, **more):
            calls.append(more["timeout"])
            if len(calls) < 3:
                raise distributed.CancelledError
            return wait(*words, **more)

        class Distributed:
            wait, TimeoutError, CancelledError = staticmethod(canceled), distributed.TimeoutError, distributed.CancelledError

        session.distributed = Distributed
        future = engine.client.submit(time.sleep, 0.3, pure=False)  # the one worker is busy: nothing is done at first
        session.submit(0, 2)
        outcomes = session.finished(60)
        assert len(calls) == 3 and [(number, pickle.loads(outcome.payload)) for number, outcome in outcomes] == [(0, 6)]
        future.release()
