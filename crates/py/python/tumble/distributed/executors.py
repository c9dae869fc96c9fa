"""Jobs on an executor of ``concurrent.futures``, or on one that is made anew when it broke."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, ThreadPoolExecutor, wait
from typing import Any

from tumble.distributed.calls import Outcome, call, call_packed, pack
from tumble.distributed.engines import Engine, Results, Session


class Executors(Engine):
    """An executor, or a function that makes one."""

    def __init__(self, given: Executor | Callable[[], Executor]) -> None:
        self.make = None if isinstance(given, Executor) else given
        self.executor: Executor | None = given if isinstance(given, Executor) else None
        self.abandoned = False  # whether jobs may still run that nobody waits for

    def session(self, function: Callable[[Any], Any], retries: int) -> Session:
        return _Session(self, function)

    def present(self) -> Executor:
        """Returns the executor."""
        if self.executor is None:
            assert self.make is not None
            self.executor = self.make()
        return self.executor

    def drop(self) -> bool:
        """Gives a broken executor up. Returns whether there will be another."""
        if self.make is None:
            return False
        self.close()
        return True

    def close(self) -> None:
        if self.make is not None and self.executor is not None:
            if self.abandoned:
                for process in list((getattr(self.executor, "_processes", None) or {}).values()):
                    process.terminate()
            self.executor.shutdown(wait=True, cancel_futures=True)
            self.executor, self.abandoned = None, False


class _Session(Session):
    """A pool whose worker dies is broken and has lost all its jobs: all of them are reported as lost, and the next job gets a new pool."""

    retries_itself = False

    def __init__(self, engine: Executors, function: Callable[[Any], Any]) -> None:
        self.engine = engine
        self.slots = 4 * int(getattr(engine.present(), "_max_workers", None) or os.cpu_count() or 1)
        self.threads = isinstance(engine.present(), ThreadPoolExecutor)
        self.function: Any = function if self.threads else pack(function)
        self.running: dict[Future[Any], int] = {}

    def submit(self, number: int, job: Any) -> None:
        try:
            future = self._submit(job)
        except BrokenExecutor as error:
            if self.engine.drop():  # it broke just now; the jobs in it learn of it by themselves
                future = self._submit(job)
            else:
                future = Future()
                future.set_exception(error)
        self.running[future] = number

    def finished(self, timeout_s: float) -> Results:
        done, _ = wait(self.running, max(timeout_s, 0), FIRST_COMPLETED)
        outcomes = [(self.running.pop(future), self._outcome(future)) for future in done]
        if any(_broke(future) for future in done):
            self.engine.drop()
        return outcomes

    def cancel(self) -> None:
        self.engine.abandoned |= not all(future.cancel() or future.done() for future in list(self.running))
        self.running.clear()

    def _submit(self, job: Any) -> Future[Any]:
        if self.threads:
            return self.engine.present().submit(call, self.function, job)
        return self.engine.present().submit(call_packed, self.function, pack(job))

    def _outcome(self, future: Future[Any]) -> Outcome:
        try:
            return Outcome(*future.result())
        except BrokenExecutor as error:
            more = "" if self.engine.make else "; give a function that makes executors, and another one is made"
            return Outcome(False, None, f"its worker died: {error}{more}")
        except Exception as error:  # the result could not be sent, or the job was canceled elsewhere
            return Outcome(False, None, f"{type(error).__name__}: {error}")


def _broke(future: Future[Any]) -> bool:
    return not future.cancelled() and isinstance(future.exception(), BrokenExecutor)
