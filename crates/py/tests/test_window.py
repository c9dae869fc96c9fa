"""Windows on worlds of programs, on a desktop without a screen."""

import shutil
import subprocess
import threading
import time

import numpy as np
import pytest

import tumble

PROGRAMS = ("Xvfb", "xdotool", "import", "convert")


@pytest.fixture
def desktop(monkeypatch):
    missing = [program for program in PROGRAMS if shutil.which(program) is None]
    if missing:
        pytest.skip(f"SKIPPED: there is no {missing[0]}; on Debian: apt-get install xvfb xdotool imagemagick")
    command = ["Xvfb", "-displayfd", "1", "-screen", "0", "1000x700x24", "-nolisten", "tcp", "-noreset"]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    number = server.stdout.readline().strip()
    assert number, "Xvfb did not start"
    monkeypatch.setenv("DISPLAY", f":{number}")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    yield
    server.kill()
    server.wait()
    server.stdout.close()


def until(condition, what, timeout=60.0):
    end = time.monotonic() + timeout
    while time.monotonic() < end:
        if (found := condition()) is not None:
            return found
        time.sleep(0.1)
    raise AssertionError(f"{what} did not come within {timeout} s")


def shown(title):
    """The id of the window of that title."""
    found = subprocess.run(["xdotool", "search", "--name", title], capture_output=True, text=True).stdout.split()
    return found[-1] if found else None


def picture(window, path):
    subprocess.run(["import", "-window", window, str(path)], check=True, capture_output=True)
    size = subprocess.run(["identify", "-format", "%w %h", str(path)], capture_output=True, text=True, check=True).stdout.split()
    pixels = subprocess.run(["convert", str(path), "rgb:-"], capture_output=True, check=True).stdout
    return np.frombuffer(pixels, np.uint8).reshape(int(size[1]), int(size[0]), 3)


def drawn(window, path):
    """A picture once there is one: more than one color."""
    pixels = picture(window, path)
    return pixels if pixels.std() > 5 else None


def other_than(before, window, path):
    """A picture that differs from another one in more than noise."""
    after = picture(window, path)
    return after if np.abs(after.astype(int) - before).max(axis=2).mean() > 2 else None


def falling():
    world = tumble.World()
    world.add_static("floor", tumble.HalfSpace())
    world.add_static("post", tumble.Box((0.2, 0.2, 1)), position=(0.6, 0, 0.5))
    world.add_rigid("ball", tumble.Sphere(0.3), mass=1, position=(0, 0, 2))
    return world


def test_a_window_follows_a_program(desktop, tmp_path):
    world = falling()
    with world.view(title="a falling ball", width=400, height=300) as window:
        assert window.is_open and not window.wait(0.01)
        shows = until(lambda: shown("a falling ball"), "the window")
        before = until(lambda: drawn(shows, tmp_path / "before.png"), "a picture")
        world.step(120)  # the ball is on the floor now
        after = until(lambda: other_than(before, shows, tmp_path / "after.png"), "a picture of the ball on the floor")
        # a body that is added is shown too
        world.add_rigid("wall", tumble.Box((2, 0.1, 2)), mass=1, position=(0, -1, 1))
        until(lambda: other_than(after, shows, tmp_path / "more.png"), "a picture with the wall")
        subprocess.run(["xdotool", "search", "--name", "a falling ball", "windowfocus", "key", "q"], check=True, capture_output=True)
        assert window.wait(30), "the key Q closes it"
    assert not window.is_open


def test_a_window_that_blocks_steps_in_real_time(desktop):
    world = falling()

    def close():
        shows = until(lambda: shown("blocking"), "the window")
        time.sleep(1.0)
        subprocess.run(["xdotool", "windowfocus", shows, "key", "Escape"], check=True, capture_output=True)

    closer = threading.Thread(target=close)
    begin = time.monotonic()
    closer.start()
    world.view(block=True, title="blocking", width=200, height=150)
    passed = time.monotonic() - begin
    closer.join()
    assert 0.5 < world.time <= passed


def test_a_window_without_a_desktop_says_so(monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"):
        monkeypatch.delenv(name, raising=False)
    for block in (True, False):
        begin = time.monotonic()
        with pytest.raises(tumble.PictureError, match="window: .*(DISPLAY|display|desktop)"):
            falling().view(block=block)
        assert time.monotonic() - begin < 30, "at once, up to the start of a process"
    with pytest.raises(ValueError, match="pixels"):
        falling().view(width=0)
