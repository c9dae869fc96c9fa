"""Jobs on Dask, the extra ``dask``."""

from __future__ import annotations

import asyncio
import importlib
import itertools
import logging
import time
import uuid
from collections.abc import Callable
from typing import Any

from tumble._errors import InvalidValueError
from tumble.distributed.calls import Outcome, call_packed, pack
from tumble.distributed.engines import STOP_S, Engine, Results, Session

FETCH_S = 60.0  # the longest wait for results that are finished
LARGE = 1 << 18  # bytes of a function that is not sent with each job: jobs that share a value are not spread as evenly


def open_dask(address: str | None, workers: int) -> Dask:
    """Returns the present client; otherwise connects to an address, or to that of ``DASK_SCHEDULER_ADDRESS``, or starts a cluster of this machine."""
    try:
        dask, distributed = importlib.import_module("dask"), importlib.import_module("distributed")
    except ImportError as missing:
        raise ModuleNotFoundError("engine 'dask' needs the package distributed: pip install dask distributed", name="distributed") from missing
    if address is None:
        try:
            return Dask(distributed.default_client())
        except ValueError:
            address = dask.config.get("scheduler-address", None)
    if address is not None:
        return Dask(distributed.Client(address, set_as_default=False, timeout=60), started=True)
    cluster = distributed.LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None, silence_logs=logging.CRITICAL)
    try:
        return Dask(distributed.Client(cluster, set_as_default=False, timeout=60), cluster, started=True)
    except BaseException:
        cluster.close(timeout=STOP_S)
        raise


class Dask(Engine):
    """A client of Dask. The scheduler gives the jobs of a lost worker to others by itself.

    client: ``distributed.Client``. cluster: of this machine, to be closed too. started: whether ``close`` closes the client.
    """

    def __init__(self, client: Any, cluster: Any = None, started: bool = False) -> None:
        self.client, self.cluster, self.started = client, cluster, started

    def session(self, function: Callable[[Any], Any], retries: int) -> Session:
        if self.client.status in ("closed", "closing"):
            raise InvalidValueError("engine: this client of Dask is closed; open another")
        if self.cluster is not None:
            self.cluster.scheduler.allowed_failures = retries  # of a cluster elsewhere its configuration counts
        return _Session(self.client, function)

    def close(self) -> None:
        if self.started:
            self.started = False
            try:
                self.client.close(timeout=STOP_S)
            finally:
                if self.cluster is not None:
                    self.cluster.close(timeout=STOP_S)


class _Session(Session):
    def __init__(self, client: Any, function: Callable[[Any], Any]) -> None:
        self.client, self.name = client, f"tumble-{uuid.uuid4().hex}"
        self.distributed = importlib.import_module("distributed")
        self.slots = max(64, 4 * sum(client.nthreads().values()))
        self.function: Any = pack(function)
        if len(self.function) > LARGE:  # once for all jobs; a task and no scattered value, so that it is made again where its worker is lost
            self.function = client.submit(bytes, self.function, key=f"function-{uuid.uuid4().hex}", pure=False)
        self.running: dict[Any, int] = {}
        self.count = itertools.count()  # of keys: a job that is given once more has another

    def submit(self, number: int, job: Any) -> None:
        future = self.client.submit(call_packed, self.function, pack(job), key=f"{self.name}-{next(self.count)}", pure=False)
        self.running[future] = number

    def finished(self, timeout_s: float) -> Results:
        if not self.running:
            return []
        end = time.monotonic() + timeout_s
        done = self._done(timeout_s)
        while done is None and time.monotonic() < end:
            time.sleep(0.02)
            done = self._done(end - time.monotonic())
        done = done or []
        whole = [future for future in done if future.status == "finished"]
        fetched = dict(zip(whole, self._fetched(whole), strict=True))
        return [(self.running.pop(future), fetched.get(future) or self._outcome(future)) for future in done]

    def cancel(self) -> None:
        self.client.cancel(list(self.running), force=True)
        self.running.clear()

    def _done(self, timeout_s: float) -> list[Any] | None:
        """Waits for futures; None if one was canceled elsewhere and none is known to be done yet."""
        try:
            with self.client.as_current():
                return list(self.distributed.wait(list(self.running), timeout=max(timeout_s, 0.01), return_when="FIRST_COMPLETED").done)
        except (TimeoutError, self.distributed.TimeoutError):
            return []
        except self.distributed.CancelledError:
            return [future for future in self.running if future.done()] or None

    def _fetched(self, futures: list[Any]) -> list[Outcome | None]:
        """The results of many in one message; none where a worker was lost meanwhile."""

        async def gather() -> Any:
            return await asyncio.wait_for(self.client.gather(futures, asynchronous=True), FETCH_S)

        try:
            return [Outcome(*each) for each in self.client.sync(gather)]
        except (Exception, self.distributed.CancelledError):
            return [None] * len(futures)

    def _outcome(self, future: Any) -> Outcome:
        try:
            return Outcome(*future.result(timeout=FETCH_S))
        except (Exception, self.distributed.CancelledError) as error:
            return Outcome(False, None, f"{type(error).__name__}: {error}")
