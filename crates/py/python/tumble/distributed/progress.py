"""How far many jobs are."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TextIO

WIDTH = 30  # of the bar, characters
INTERVAL_S = 0.1  # between two pictures of the bar


@dataclass(frozen=True)
class Progress:
    """How far many jobs are.

    done: jobs that are finished, with results or not; looked_up: those of them whose results were in the store, or came from an equal job; failed: those
    without result; total: number of all jobs, None while it is not known; elapsed_s: time since the start, s.
    """

    done: int
    looked_up: int
    failed: int
    total: int | None
    elapsed_s: float

    def __str__(self) -> str:
        more = [f"{count} {word}" for count, word in ((self.looked_up, "looked up"), (self.failed, "failed")) if count]
        return ", ".join([f"{self.done}/{'?' if self.total is None else self.total}", *more, f"{self.elapsed_s:.1f} s"])


class Bar:
    """A bar on a terminal; nothing where the stream is none."""

    def __init__(self, stream: TextIO | None = None) -> None:
        self.stream = sys.stderr if stream is None else stream
        self.shown = self.stream.isatty()
        self.last, self.length = -INTERVAL_S, 0

    def __call__(self, progress: Progress) -> None:
        over = progress.done == progress.total
        if not self.shown or not over and progress.elapsed_s < self.last + INTERVAL_S:
            return
        self.last = progress.elapsed_s
        filled = WIDTH * progress.done // progress.total if progress.total else 0
        text = f"[{'#' * filled}{'.' * (WIDTH - filled)}] {progress}"
        self.stream.write("\r" + text.ljust(self.length) + ("\n" if over else ""))
        self.stream.flush()
        self.length = len(text)


class Count:
    """Counts jobs, and calls a callback."""

    def __init__(self, callback: Callable[[Progress], object] | bool | None, total: int | None) -> None:
        self.callback: Callable[[Progress], object] | None = Bar() if callback is True else (callback or None)
        self.start, self.total = time.monotonic(), total
        self.done = self.looked_up = self.failed = 0

    def add(self, *, ok: bool = True, looked_up: bool = False) -> None:
        """Counts a job that is finished."""
        self.done, self.looked_up, self.failed = self.done + 1, self.looked_up + looked_up, self.failed + (not ok)
        if self.callback is not None:
            self.callback(Progress(self.done, self.looked_up, self.failed, self.total, time.monotonic() - self.start))
