"""A window on a world: a process of its own draws the frames that this one sends."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING

from tumble._errors import BusyError, InvalidValueError, PictureError
from tumble._keywords import hinted
from tumble._native import _show_window, _WindowFeed

if TYPE_CHECKING:
    from tumble._native import World

_INTERVAL = 1.0 / 60.0
"""Time between two frames, s."""
_LAG = 0.1
"""Longest time that a blocking window catches up with at once, s."""
_OPENING = 60.0
"""Longest time that a window takes to open, s."""


class Window:
    """A window that follows a world while the program goes on.

    Drag with the left button to turn, with the right one to move, use the wheel for the distance; Home returns, C shows contacts, Q or Escape closes. It
    closes with the program.
    """

    def __init__(self, world: World, title: str, width: int, height: int) -> None:
        self._world = world
        self._feed = _WindowFeed()
        opening = self._feed.opening(world, title, (width, height))
        # the window's own session: Ctrl-C in the terminal is for the program
        command = [sys.executable, "-c", "from tumble._window import main; main()"]
        paths = [str(Path(__file__).resolve().parents[1]), os.environ.get("PYTHONPATH", "")]
        own = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in paths if path)}
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, start_new_session=True, env=own)
        self._messages = b""
        self._ending = threading.Event()
        self._opened = threading.Event()
        self._is_shown = False
        self._error: Exception | None = None
        works = (self._listen, self._await_opening, lambda: self._send(opening))
        self._threads = [threading.Thread(target=work, daemon=True) for work in works]
        for thread in self._threads:
            thread.start()
        try:
            self._open()
        except BaseException:
            self._process.kill()
            self.close()
            raise

    def _open(self) -> None:
        """Waits until it is open; raises ``PictureError`` where it cannot be."""
        if not self._opened.wait(_OPENING):
            raise PictureError(f"the window: it did not open within {_OPENING:.0f} s")
        if not self._is_shown:  # its process ends
            self._process.wait(5.0)
        _ = self.is_open

    @property
    def is_open(self) -> bool:
        """Whether it is open. A window that could not be opened, or that failed, raises ``PictureError``."""
        code = self._process.poll()
        if self._error is not None:
            error, self._error = self._error, None
            raise error
        if code not in (None, 0) and not self._ending.is_set():
            self._ending.set()
            self._threads[0].join(1.0)
            lines = self._messages.decode(errors="replace").strip().splitlines()
            raise PictureError(f"the window: {lines[-1] if lines else f'its process ended with {code}'}")
        return code is None

    @hinted
    def wait(self, timeout: float | None = None) -> bool:
        """Waits until the window is closed, at most ``timeout`` s; returns whether it is closed."""
        end = None if timeout is None else time.monotonic() + timeout
        while self.is_open:
            if end is not None and time.monotonic() >= end:
                return False
            time.sleep(_INTERVAL)
        return True

    def close(self) -> None:
        """Closes the window."""
        self._ending.set()
        try:
            self._process.wait(5.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        for thread in self._threads:
            if thread is not threading.current_thread():
                thread.join(5.0)

    def __enter__(self) -> Window:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<tumble.Window, {'open' if self._process.poll() is None else 'closed'}>"

    def _listen(self) -> None:
        assert self._process.stderr is not None
        while piece := self._process.stderr.read(1024):
            self._messages = (self._messages + piece)[-4096:]
        self._process.stderr.close()

    def _await_opening(self) -> None:
        """Waits for the line that the window's process writes when it is open, or for its end."""
        assert self._process.stdout is not None
        self._is_shown = bool(self._process.stdout.readline())
        self._opened.set()
        while self._process.stdout.read(1024):
            pass
        self._process.stdout.close()

    def _send(self, message: bytes) -> None:
        pipe = self._process.stdin
        assert pipe is not None
        try:
            while not self._ending.is_set():
                pipe.write(message)
                pipe.flush()
                message = b""
                while not message and not self._ending.wait(_INTERVAL):
                    if self._process.poll() is not None:
                        return
                    try:
                        message = self._feed.frame(self._world)
                    except BusyError:  # another thread steps it; its next state is shown
                        continue
        except OSError:  # the window was closed
            pass
        except Exception as error:
            self._error = error
        finally:
            try:
                pipe.close()
            except OSError:
                pass


def view(world: World, *, block: bool = False, title: str | None = None, width: int = 1280, height: int = 720) -> Window:
    """Opens a window; see ``World.view``."""
    if not (0 < width <= 16384 and 0 < height <= 16384):
        raise InvalidValueError(f"width, height: expected 1 to 16384 pixels, got {width} x {height}")
    window = Window(world, "tumble" if title is None else title, width, height)
    if not block:
        return window
    try:
        last = time.monotonic()
        due = 0.0
        while window.is_open:
            now = time.monotonic()
            due, last = min(due + now - last, _LAG), now
            steps = int(due / world.dt)
            world.step(steps)
            due -= steps * world.dt
            time.sleep(max(0.0, min(_INTERVAL, world.dt) - (time.monotonic() - now)))
    finally:
        window.close()
    return window


def main() -> None:
    """Draws the messages of stdin; the process of a window."""
    try:
        _show_window()
    except Exception as error:
        print(error, file=sys.stderr)
        sys.exit(1)
