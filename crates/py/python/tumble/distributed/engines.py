"""Where jobs run: this process, an executor of ``concurrent.futures``, Ray, Dask. An engine schedules; this file says how it is asked."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import Executor
from typing import Any, TypeAlias

from tumble._errors import InvalidValueError
from tumble._keywords import hinted
from tumble.distributed.calls import Outcome, call

STOP_S = 5.0  # the longest wait for an engine that stops
Results = list[tuple[int, Outcome]]


class Session:
    """The jobs of one function at an engine."""

    slots = 1
    """How many jobs are given to the engine ahead."""
    retries_itself = True
    """Whether the engine tries a job again whose worker was lost."""

    def submit(self, number: int, job: Any) -> None:
        """Gives a job to the engine."""
        raise NotImplementedError

    def finished(self, timeout_s: float) -> Results:
        """Waits until a job is finished, and returns all that are; none after ``timeout_s``."""
        raise NotImplementedError

    def cancel(self) -> None:
        """Takes back the jobs that are not finished."""


class Engine:
    """Where jobs run: what ``connect`` returns, or a class of a program for another engine. A ``with`` block closes it."""

    def session(self, function: Callable[[Any], Any], retries: int) -> Session:
        """Prepares for the jobs of a function. retries: how often the engine tries a job again whose worker was lost, if it does.

        Where it does, another session with ``retries`` 0 follows for the jobs that were lost nevertheless, one at a time; the one before is empty then.
        """
        raise NotImplementedError

    def close(self) -> None:
        """Stops what ``connect`` started."""

    def __enter__(self) -> Engine:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class Serial(Engine):
    """This process, one job after the other."""

    def session(self, function: Callable[[Any], Any], retries: int) -> Session:
        return _SerialSession(function)


class _SerialSession(Session):
    def __init__(self, function: Callable[[Any], Any]) -> None:
        self.function = function
        self.waiting: list[tuple[int, Any]] = []

    def submit(self, number: int, job: Any) -> None:
        self.waiting.append((number, job))

    def finished(self, timeout_s: float) -> Results:
        if not self.waiting or timeout_s <= 0:
            return []
        number, job = self.waiting.pop(0)
        return [(number, call(self.function, job))]

    def cancel(self) -> None:
        self.waiting.clear()


EngineLike: TypeAlias = Engine | Executor | Callable[[], Executor] | str | Any | None


@hinted
def connect(engine: EngineLike = None, *, workers: int | None = None) -> Engine:
    """Returns an engine to use for several calls of ``map``; close it, or use it in a ``with`` block.

    engine: ``None``: this process. ``"ray"``: Ray as the program has started it; otherwise the cluster that ``RAY_ADDRESS`` names, or a new one of this
    machine. ``"dask"``: the present client; otherwise the scheduler that ``DASK_SCHEDULER_ADDRESS`` names, or a new cluster of this machine. An address
    ``"ray://…"``, ``"tcp://…"`` or ``"tls://…"``, or a ``distributed.Client``. An ``Executor`` of ``concurrent.futures``, or a function that makes one:
    then a pool that broke because a worker died is made anew. workers: number of processes of a new cluster, by default one for each core. Only what is
    started here is stopped.
    """
    if workers is not None and not 1 <= workers <= 4096:
        raise InvalidValueError(f"workers is {workers}; it must be 1 to 4096")
    if engine is None:
        return Serial()
    if isinstance(engine, Engine):
        return engine
    if isinstance(engine, str):
        return _named(engine, workers or os.cpu_count() or 1)
    if hasattr(engine, "submit") and hasattr(engine, "scheduler_info"):
        from tumble.distributed.on_dask import Dask

        return Dask(engine)
    if isinstance(engine, Executor) or callable(engine):
        from tumble.distributed.executors import Executors

        return Executors(engine)
    raise InvalidValueError(f"engine is {engine!r}; expected None, 'ray', 'dask', an address, an Executor, a function that makes one, or a Client of Dask")


def _named(name: str, workers: int) -> Engine:
    if name == "ray" or name.startswith("ray://"):
        from tumble.distributed.on_ray import open_ray

        return open_ray(None if name == "ray" else name, workers)
    if name == "dask" or name.startswith(("tcp://", "tls://")):
        from tumble.distributed.on_dask import open_dask

        return open_dask(None if name == "dask" else name, workers)
    raise InvalidValueError(f"engine is {name!r}; by name there are 'ray', 'dask' and addresses that begin with ray://, tcp:// or tls://")
