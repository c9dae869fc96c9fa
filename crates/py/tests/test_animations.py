"""Recordings as videos, animated PNG and pages: their structure, pixels, and errors."""

import base64
import html.parser
import json
import os
import re
import select
import shutil
import stat
import struct
import subprocess
import time
import zlib

import numpy as np
import pytest

import tumble
from tumble._animations import Shot, animated_png, instants, patches, png

CHROMIUM = next((program for program in ("chromium", "chromium-browser", "google-chrome") if shutil.which(program)), None)


@pytest.fixture(scope="module")
def swing(tmp_path_factory):
    path = tmp_path_factory.mktemp("swing") / "swing.mcap"
    world = tumble.World.load("pendulum")
    with tumble.Recorder(path) as recorder:
        recorder.run(world, 120, every=2)
    return tumble.read(path)


def drawing_or_skip():
    try:
        tumble.World().render(8, 8)
    except tumble.PictureError as error:
        pytest.skip(f"SKIPPED: {error}")


def chunks(data):
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at = 8
    while at < len(data):
        (length,), kind = struct.unpack_from(">I", data, at), data[at + 4 : at + 8]
        body = data[at + 8 : at + 8 + length]
        assert struct.unpack_from(">I", data, at + 8 + length)[0] == zlib.crc32(kind + body)
        yield kind, body
        at += 12 + length


def pixels(data, width, height):
    """Undoes the filter `up`."""
    rows = np.frombuffer(zlib.decompress(data), np.uint8).reshape(height, 1 + 3 * width)
    assert (rows[:, 0] == 2).all()
    return np.cumsum(rows[:, 1:], axis=0, dtype=np.uint8).reshape(height, width, 3)


def test_instants_are_those_of_a_clock():
    times = np.arange(11) * 0.1
    assert instants(times, 10, 1) == list(range(11))
    assert instants(times, 5, 1) == [0, 2, 4, 6, 8, 10]
    assert instants(times, 20, 1) == [k // 2 for k in range(21)]
    assert instants(times, 10, 2) == [0, 2, 4, 6, 8, 10]
    for fps, speed in ((0, 1), (10, -1), (float("nan"), 1)):
        with pytest.raises(ValueError, match="above 0"):
            instants(times, fps, speed)
    with pytest.raises(ValueError, match="no frames"):
        instants(times[:0], 10, 1)


def test_an_animated_png_has_every_pixel_of_every_image():
    rng = np.random.default_rng(0)
    images = [rng.integers(0, 256, (20, 30, 4), np.uint8)]
    for k in range(6):  # a moving rectangle; one image is the same again
        image = images[-1].copy()
        image[k : k + 5, 2 * k : 2 * k + 4] = rng.integers(0, 256, (5, 4, 4), np.uint8) if k != 3 else image[k : k + 5, 2 * k : 2 * k + 4]
        images.append(image)
    parts = [part for _, part in patches(Shot(0.1 * k, image) for k, image in enumerate(images))]
    found = list(chunks(animated_png(parts, 12.5)))
    kinds = [kind for kind, _ in found]
    assert kinds[:3] == [b"IHDR", b"sRGB", b"acTL"] and kinds[-1] == b"IEND"
    assert struct.unpack(">II", found[2][1]) == (len(images), 0)
    canvas, sequence, frame = np.zeros((20, 30, 3), np.uint8), [], None
    seen = []
    for kind, body in found:
        if kind == b"fcTL":
            number, *frame = struct.unpack(">IIIIIHHBB", body)
            sequence.append(number)
            assert frame[4] / frame[5] == pytest.approx(0.08)
        elif kind in (b"IDAT", b"fdAT"):
            if kind == b"fdAT":
                sequence.append(struct.unpack(">I", body[:4])[0])
                body = body[4:]
            width, height, x, y = frame[:4]
            canvas[y : y + height, x : x + width] = pixels(body, width, height)
            seen.append(canvas.copy())
    assert sequence == list(range(len(sequence))), "numbers without a gap"
    assert all((a == b[:, :, :3]).all() for a, b in zip(seen, images, strict=True))


class Page(html.parser.HTMLParser):
    """Checks that tags close in order, and keeps what the page holds."""

    VOID = {"meta", "img", "input", "br"}

    def __init__(self, text):
        super().__init__()
        self.open, self.tags, self.scripts, self.iframes = [], [], [], []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] == "script":
            self.scripts.append(data)


def test_a_page_holds_all_of_its_images(swing, tmp_path):
    drawing_or_skip()
    animation = swing.animation(width=120, height=80, fps=10)
    assert animation.size == (120, 80) and animation.times == pytest.approx(np.arange(11) * 0.1, abs=1e-9)
    page = Page(animation.html)
    assert "http:" not in animation.html and "https:" not in animation.html, "nothing is fetched"
    data = json.loads(re.search(r"const data = (\{.*\});", page.scripts[0]).group(1))
    assert len(data["frames"]) == len(data["times"]) == 11 and data["fps"] == 10
    world = tumble.World.load("pendulum")
    canvas = np.zeros((80, 120, 3), np.uint8)
    for at, (x, y, text) in zip(data["times"], data["frames"], strict=True):
        found = dict(chunks(base64.b64decode(text)))
        width, height = struct.unpack(">II", found[b"IHDR"][:8])
        canvas[y : y + height, x : x + width] = pixels(found[b"IDAT"], width, height)
        world.restore(swing.states[int(np.argmin(np.abs(swing.times - at)))])
        assert (canvas == world.render(120, 80)[:, :, :3]).all()
    # in a notebook it is a frame of its own with the same page
    (frame,) = Page(animation._repr_html_()).tags
    assert frame[0] == "iframe" and frame[1]["srcdoc"] == animation.html
    animation.save(tmp_path / "swing.html")
    assert (tmp_path / "swing.html").read_text() == animation.html
    swing.video(tmp_path / "swing.png", width=120, height=80, fps=10)
    assert (tmp_path / "swing.png").read_bytes() == animated_png(animation._parts, 10)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["swing.html", "swing.png"]
    with pytest.raises(ValueError, match="expected the name of an .html, .png or .apng file"):
        animation.save(tmp_path / "swing.gif")
    for write in (animation.save, swing.video):
        with pytest.raises(tumble.UnreadableFileError, match="there is no folder"):
            write(tmp_path / "missing" / "swing.png")
    assert png(canvas)[:8] == b"\x89PNG\r\n\x1a\n"


@pytest.mark.skipif(CHROMIUM is None, reason="SKIPPED: there is no chromium; on Debian: apt-get install chromium")
def test_a_browser_plays_the_page(swing, tmp_path):
    drawing_or_skip()
    swing.animation(width=120, height=80, fps=10).save(tmp_path / "swing.html")
    with Browser(tmp_path) as browser:
        browser.open(f"file://{tmp_path}/swing.html")
        until, seen = time.monotonic() + 60, {None}
        while len(seen) < 4 and time.monotonic() < until:
            seen.add(browser.evaluate("document.body.dataset.shown"))
            time.sleep(0.05)
    # three frames follow each other, whatever the speed of the machine
    assert len(seen) == 4, seen


class Browser:
    """Chromium, directed through its DevTools over two pipes."""

    def __init__(self, folder):
        (theirs, self.requests), (self.answers, ours) = os.pipe(), os.pipe()

        def descriptors():
            for descriptor, number in ((theirs, 3), (ours, 4)):
                os.dup2(descriptor, number)
                os.set_inheritable(number, True)

        options = ["--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-pipe", f"--user-data-dir={folder}/browser"]
        self.process = subprocess.Popen(
            [CHROMIUM, *options], preexec_fn=descriptors, close_fds=False, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        os.close(theirs)
        os.close(ours)
        self.count, self.page, self.bytes = 0, {}, b""

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait(10)
        os.close(self.requests)
        os.close(self.answers)

    def ask(self, method, **params):
        self.count += 1
        request = {"id": self.count, "method": method, "params": params, **self.page}
        os.write(self.requests, json.dumps(request).encode() + b"\0")
        until = time.monotonic() + 60
        while True:
            *whole, self.bytes = self.bytes.split(b"\0")
            for message in map(json.loads, whole):
                if message.get("id") == self.count:
                    return message["result"]
            assert select.select([self.answers], [], [], max(0.0, until - time.monotonic()))[0], f"no answer to {method}"
            self.bytes += os.read(self.answers, 1 << 16)

    def open(self, url):
        pages = [t for t in self.ask("Target.getTargets")["targetInfos"] if t["type"] == "page"]
        target = pages[0]["targetId"] if pages else self.ask("Target.createTarget", url="about:blank")["targetId"]
        self.page = {"sessionId": self.ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]}
        self.ask("Page.navigate", url=url)

    def evaluate(self, expression):
        return self.ask("Runtime.evaluate", expression=expression)["result"].get("value")


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="SKIPPED: there is no ffmpeg")
def test_ffmpeg_makes_a_video(swing, tmp_path):
    drawing_or_skip()
    swing.video(tmp_path / "swing.mp4", width=160, height=120, fps=20)
    probe = ["ffprobe", "-v", "error", "-count_frames", "-show_entries", "stream=nb_read_frames,width,height", "-of", "csv=p=0"]
    assert subprocess.run([*probe, tmp_path / "swing.mp4"], capture_output=True, text=True).stdout.split(",")[:3] == ["160", "120", "21\n"]


def stand_in(folder, script, monkeypatch):
    """Puts a program of the name ffmpeg first."""
    program = folder / "bin" / "ffmpeg"
    program.parent.mkdir()
    program.write_text(f"#!/bin/sh\n{script}\n")
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("PATH", f"{program.parent}{os.pathsep}{os.environ['PATH']}")


def test_frames_go_to_ffmpeg_in_order(swing, tmp_path, monkeypatch):
    drawing_or_skip()
    stand_in(tmp_path, f'for last; do :; done; echo "$@" > {tmp_path}/arguments; cat > "$last"', monkeypatch)
    swing.video(tmp_path / "swing.mp4", width=64, height=48, fps=10)
    raw = np.frombuffer((tmp_path / "swing.mp4").read_bytes(), np.uint8).reshape(-1, 48, 64, 4)
    assert len(raw) == 11 and "-s 64x48 -r 10" in (tmp_path / "arguments").read_text()
    world = tumble.World.load("pendulum")
    world.restore(swing.states[-1])
    assert (raw[-1] == world.render(64, 48)).all()


def test_errors_of_ffmpeg_are_passed_on(swing, tmp_path, monkeypatch):
    drawing_or_skip()
    stand_in(tmp_path, 'cat > /dev/null; echo "no such codec" >&2; exit 1', monkeypatch)
    with pytest.raises(tumble.PictureError, match="ffmpeg failed: no such codec"):
        swing.video(tmp_path / "swing.mp4", width=64, height=48)
    assert not (tmp_path / "swing.mp4").exists() and not list(tmp_path.glob(".*")), "nothing is left"
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(tumble.PictureError, match="there is no ffmpeg"):
        swing.video(tmp_path / "swing.mp4", width=64, height=48)


def test_a_recording_of_a_program_needs_its_world(tmp_path):
    drawing_or_skip()
    world = tumble.World()
    world.add_rigid("ball", tumble.Sphere(0.1), mass=1)
    with tumble.Recorder(tmp_path / "run.mcap") as recorder:
        recorder.run(world, 24)
    recording = tumble.read(tmp_path / "run.mcap")
    with pytest.raises(ValueError, match="pass a world with the same bodies"):
        recording.animation()
    before = world.save()
    assert len(recording.animation(world, width=32, height=32).times) == 2
    assert world.save() == before, "it stays as it is"
