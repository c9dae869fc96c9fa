"""Jobs on Ray, the extra ``ray``."""

from __future__ import annotations

import importlib
import os
from collections.abc import Callable
from typing import Any

from tumble._errors import InvalidValueError
from tumble.distributed.calls import Outcome, call_packed, pack
from tumble.distributed.engines import Engine, Results, Session


def open_ray(address: str | None, workers: int) -> Ray:
    """Returns Ray as it runs; otherwise connects to an address, or to that of ``RAY_ADDRESS``, or starts a cluster of this machine."""
    try:
        ray = importlib.import_module("ray")
    except ImportError as missing:
        raise ModuleNotFoundError("engine 'ray' needs the package ray: pip install ray", name="ray") from missing
    if ray.is_initialized():
        if address is not None:
            raise InvalidValueError(f"Ray already runs; engine 'ray' uses it, {address!r} would be another")
        return Ray(ray, started=False)
    address = address or os.environ.get("RAY_ADDRESS")
    if address in (None, "local"):
        os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
        ray.init(address="local", num_cpus=workers, include_dashboard=False, configure_logging=True, logging_level="error", log_to_driver=False)
    else:
        ray.init(address=address, logging_level="error", log_to_driver=False)
    return Ray(ray, started=True)


class Ray(Engine):
    """Ray: tasks of one core each, which it tries again by itself after the loss of a worker or a machine."""

    def __init__(self, ray: Any, started: bool) -> None:
        self.ray, self.started = ray, started

    def session(self, function: Callable[[Any], Any], retries: int) -> Session:
        return _Session(self.ray, function, retries)

    def close(self) -> None:
        if self.started:
            self.ray.shutdown()
            self.started = False


class _Session(Session):
    def __init__(self, ray: Any, function: Callable[[Any], Any], retries: int) -> None:
        self.ray = ray
        self.slots = max(64, 4 * int(ray.cluster_resources().get("CPU", 1)))
        self.function = ray.put(pack(function))  # once for all jobs
        self.task = ray.remote(call_packed).options(max_retries=retries, retry_exceptions=False, num_cpus=1)
        self.running: dict[Any, int] = {}

    def submit(self, number: int, job: Any) -> None:
        self.running[self.task.remote(self.function, pack(job))] = number

    def finished(self, timeout_s: float) -> Results:
        if not self.running:
            return []
        done, _ = self.ray.wait(list(self.running), num_returns=1, timeout=max(timeout_s, 0))
        if done:
            done, _ = self.ray.wait(list(self.running), num_returns=len(self.running), timeout=0)
        return [(self.running.pop(reference), self._outcome(reference)) for reference in done]

    def cancel(self) -> None:
        for reference in self.running:
            self.ray.cancel(reference, force=True)
        self.running.clear()

    def _outcome(self, reference: Any) -> Outcome:
        try:
            return Outcome(*self.ray.get(reference, timeout=60))
        except self.ray.exceptions.RayError as error:
            return Outcome(False, None, f"its worker was lost: {type(error).__name__}: {error}")
