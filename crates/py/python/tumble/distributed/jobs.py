"""Many jobs of one function."""

from __future__ import annotations

import contextlib
import itertools
import os
import pickle
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence, Sized
from typing import Any, Literal

from tumble._errors import InvalidValueError
from tumble._keywords import hinted
from tumble.distributed.calls import JobError, Outcome, error_of
from tumble.distributed.engines import Engine, EngineLike, Session, connect
from tumble.distributed.progress import Count, Progress
from tumble.distributed.store import Store
from tumble.distributed.store import key as key_of


@hinted
def map(
    function: Callable[[Any], Any],
    jobs: Iterable[Any],
    *,
    engine: EngineLike = None,
    workers: int | None = None,
    store: Store | str | os.PathLike[str] | None = None,
    version: str = "",
    retries: int = 3,
    timeout_s: float = 3600.0,
    progress: Callable[[Progress], object] | bool | None = None,
    errors: Literal["raise", "return"] = "raise",
) -> list[Any]:
    """Calls a function for each job, on an engine. Returns the results in the order of the jobs.

    function: pure, of one argument: the same job gives the same result in any process, where ``tumble`` and what it imports are installed.
    ``functools.partial(tumble.simulate, model, snapshot)`` is one. engine, workers: as in ``connect``; what is not an ``Engine`` yet and is started here is
    stopped at the end. store: a folder of results by content hash: a job whose result is there is not run again, equal jobs run once, and results are there
    as soon as they arrive, so a run that was interrupted goes on where it was. version: counts in the hash, see ``key``. retries: how often at most a job is tried again
    after its worker died; a Dask cluster that was not started here counts by its own ``allowed-failures``; exceptions of the function are not tried again.
    timeout_s: longest time without any job that finishes, s; without effect in this process, ``engine=None``. progress: ``True`` for a bar on a terminal, or
    a function that is called with a ``Progress`` after each job.

    A job without result raises ``JobError`` after all others are finished, or stands as one in the results with ``errors="return"``. Raises
    ``TimeoutError`` after ``timeout_s``.
    """
    if errors not in ("raise", "return"):
        raise InvalidValueError(f"errors is {errors!r}; it must be 'raise' or 'return'")
    found = dict(
        as_completed(
            function, jobs, engine=engine, workers=workers, store=store, version=version, retries=retries, timeout_s=timeout_s, progress=progress
        )
    )
    results = [found[number] for number in range(len(found))]
    failed = [result for result in results if isinstance(result, JobError)]
    if failed and errors == "raise":
        if len(failed) > 1:
            failed[0].args = (f"{failed[0]}\nand {len(failed) - 1} more of {len(results)} jobs have no result", failed[0].number)
        raise failed[0]
    return results


@hinted
def as_completed(
    function: Callable[[Any], Any],
    jobs: Iterable[Any],
    *,
    engine: EngineLike = None,
    workers: int | None = None,
    store: Store | str | os.PathLike[str] | None = None,
    version: str = "",
    retries: int = 3,
    timeout_s: float = 3600.0,
    progress: Callable[[Progress], object] | bool | None = None,
) -> Iterator[tuple[int, Any]]:
    """Calls a function for each job as ``map`` does, and yields ``(number, result)`` as jobs finish; the result of one that failed is a ``JobError``.

    ``jobs`` may be endless: they are taken as workers are free.
    """
    if retries < 0:
        raise InvalidValueError(f"retries is {retries}; it must be at least 0")
    if not timeout_s > 0:
        raise InvalidValueError(f"timeout_s is {timeout_s}; it must be positive")
    run = _Run(function, engine, workers, retries, timeout_s, Count(progress, len(jobs) if isinstance(jobs, Sized) else None))
    run.store = store if isinstance(store, Store) or store is None else Store(store)
    run.version = version
    try:
        for number, job in enumerate(jobs):
            known = run.look_up(number, job)
            if known is not None:
                yield number, pickle.loads(known)
                continue
            if not run.waits_for_equal(number):
                run.submit(number, job)
            while run.full():
                yield from run.arrived()
            if run.many_lost():
                yield from run.rest()
        yield from run.rest()
    except BaseException:
        with contextlib.suppress(Exception):  # the first error is the one to see
            run.close()
        raise
    run.close()


class _Run:
    """The jobs of one call."""

    store: Store | None
    version: str

    def __init__(
        self, function: Callable[[Any], Any], engine: EngineLike, workers: int | None, retries: int, timeout_s: float, count: Count
    ) -> None:
        self.function, self.given, self.workers, self.retries, self.timeout_s, self.count = function, engine, workers, retries, timeout_s, count
        self.engine: Engine | None = None
        self.session: Session | None = None
        self.running: dict[int, Any] = {}
        self.keys: dict[int, str] = {}
        self.first: dict[str, int] = {}
        """The job with a key that has no result yet."""
        self.equal: dict[int, list[int]] = {}
        """Later jobs with the key of such a one, which get its result."""
        self.waiting = 0
        """How many those are."""
        self.lost: deque[tuple[int, Any]] = deque()
        """Jobs whose workers died: they may have died of another job, so each of them is tried alone."""
        self.deaths: dict[int, int] = {}
        """How often each of them was lost alone."""

    def look_up(self, number: int, job: Any) -> bytes | None:
        """Returns the result of a job from the store."""
        if self.store is None:
            return None
        key = key_of(self.function, job, self.version)
        known = self.store.get(key)
        if known is None:
            self.keys[number] = key
        else:
            self.count.add(looked_up=True)
        return known

    def waits_for_equal(self, number: int) -> bool:
        """Whether an equal job has no result yet; then this one is not run, and gets that result."""
        key = self.keys.get(number)
        if key is None or self.first.setdefault(key, number) == number:
            return False
        self.equal.setdefault(self.first[key], []).append(number)
        self.waiting += 1
        del self.keys[number]
        return True

    def submit(self, number: int, job: Any) -> None:
        if self.session is None:  # nothing is started for jobs that are all known
            self.engine = connect(self.given, workers=self.workers)
            self.begin(max(self.retries - 1, 0))  # the last try is alone
        assert self.session is not None
        self.running[number] = job
        self.session.submit(number, job)

    def begin(self, retries: int) -> None:
        """Goes on with another session, of an engine that tries lost jobs again by itself."""
        assert self.engine is not None and not self.running
        if self.session is None or self.session.retries_itself:
            self.session = self.engine.session(self.function, retries)

    def full(self) -> bool:
        return self.session is not None and len(self.running) > 0 and len(self.running) + self.waiting >= self.session.slots

    def many_lost(self) -> bool:
        return self.session is not None and len(self.lost) > 0 and len(self.lost) + self.waiting > self.session.slots

    def rest(self) -> Iterator[tuple[int, Any]]:
        """Waits for all jobs at the engine, then tries the lost ones alone."""
        while self.running:
            yield from self.arrived()
        if not self.lost:
            return
        self.begin(0)
        while self.lost:
            self.submit(*self.lost.popleft())
            yield from self.arrived(alone=True)
        self.begin(max(self.retries - 1, 0))

    def arrived(self, alone: bool = False) -> Iterator[tuple[int, Any]]:
        """Waits, and yields the results that arrive."""
        assert self.session is not None
        outcomes = self.session.finished(self.timeout_s)
        if not outcomes:
            raise TimeoutError(f"no job finished within {self.timeout_s} s; {len(self.running)} are at the engine")
        ready: list[tuple[int, Any, bool]] = []
        for number, outcome in outcomes:
            job = self.running.pop(number)
            if outcome.payload is None and self.again(number, alone):
                self.lost.append((number, job))
            else:
                ready += [(each, result, each != number) for each, result in self.keep(number, outcome)]
        for number, result, equal in ready:
            ok = not isinstance(result, JobError)
            self.count.add(ok=ok, looked_up=ok and equal)
            yield number, result

    def again(self, number: int, alone: bool) -> bool:
        """Whether a job whose worker died is tried again. The first loss is among others, and is one of several where the engine tries again by itself."""
        assert self.session is not None
        self.deaths[number] = self.deaths.get(number, 0) + alone
        return self.deaths[number] < (min(self.retries, 1) if self.session.retries_itself else self.retries)

    def keep(self, number: int, outcome: Outcome) -> list[tuple[int, Any]]:
        """Returns the result of a job, which is put into the store, or its error: for it, and for all equal ones that wait for it."""
        key, equal = self.keys.pop(number, None), self.equal.pop(number, [])
        self.waiting -= len(equal)
        if key is not None:
            self.first.pop(key, None)
        if not outcome.ok or outcome.payload is None:
            return [(each, error_of(each, outcome)) for each in (number, *equal)]
        if self.store is not None and key is not None:
            self.store.put(key, outcome.payload)
        return [(each, pickle.loads(outcome.payload)) for each in (number, *equal)]

    def close(self) -> None:
        try:
            if self.session is not None and self.running:  # interrupted: what is there is kept
                with contextlib.suppress(Exception):
                    for number, outcome in self.session.finished(0):
                        self.keep(number, outcome)
                self.session.cancel()
        finally:
            if self.engine is not None and self.engine is not self.given:
                self.engine.close()


def grid(**values: Sequence[Any]) -> list[dict[str, Any]]:
    """Returns the jobs of a parameter sweep: a dict for each combination of values, the last name running fastest."""
    return [dict(zip(values, row, strict=True)) for row in itertools.product(*values.values())]
