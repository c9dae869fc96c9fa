"""Jobs on an executor of ``concurrent.futures``, or on one that is made anew when it broke."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, ThreadPoolExecutor, wait
from typing import Any

from tumble.distributed.calls import Outcome, call, call_packed, pack
from tumble.distributed.engines import STOP_S, Engine, Results, Session


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

    def drop(self, broken: Executor) -> bool:
        """Gives a broken executor up, if that is still the present one. Returns whether there will be another."""
        if self.make is not None and broken is self.executor:
            self.close()
        return self.make is not None

    def close(self) -> None:
        """Stops the executor if it was made here, within twice ``STOP_S``."""
        if self.make is None or self.executor is None:
            return
        executor, abandoned = self.executor, self.abandoned
        self.executor, self.abandoned = None, False
        processes = list((getattr(executor, "_processes", None) or {}).values())
        if abandoned:
            for process in processes:
                process.terminate()
        stopping = threading.Thread(target=executor.shutdown, kwargs={"wait": True, "cancel_futures": True}, daemon=True)
        stopping.start()
        stopping.join(STOP_S)
        if stopping.is_alive():
            for process in processes:
                process.kill()
            stopping.join(STOP_S)


class _Session(Session):
    """A pool whose worker dies is broken and has lost all its jobs: all of them are reported as lost, and the next job gets a new pool."""

    retries_itself = False

    def __init__(self, engine: Executors, function: Callable[[Any], Any]) -> None:
        self.engine = engine
        self.slots = 4 * int(getattr(engine.present(), "_max_workers", None) or os.cpu_count() or 1)
        self.threads = isinstance(engine.present(), ThreadPoolExecutor)
        self.function: Any = function if self.threads else pack(function)
        self.running: dict[Future[Any], tuple[int, Executor]] = {}  # and the executor that it was given to

    def submit(self, number: int, job: Any) -> None:
        executor = self.engine.present()
        try:
            future = self._submit(executor, job)
        except BrokenExecutor as error:
            if self.engine.drop(executor):  # it broke just now; the jobs in it learn of it by themselves
                executor = self.engine.present()
                future = self._submit(executor, job)
            else:
                future = Future()
                future.set_exception(error)
        self.running[future] = number, executor

    def finished(self, timeout_s: float) -> Results:
        done, _ = wait(self.running, max(timeout_s, 0), FIRST_COMPLETED)
        outcomes = []
        for future in done:
            number, executor = self.running.pop(future)
            outcomes.append((number, self._outcome(future)))
            if _broke(future):
                self.engine.drop(executor)
        return outcomes

    def cancel(self) -> None:
        self.engine.abandoned |= not all(future.cancel() or future.done() for future in list(self.running))
        self.running.clear()

    def _submit(self, executor: Executor, job: Any) -> Future[Any]:
        if self.threads:
            return executor.submit(call, self.function, job)
        return executor.submit(call_packed, self.function, pack(job))

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
