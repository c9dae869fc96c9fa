"""Recordings as videos, animated images and pages that play by themselves."""

from __future__ import annotations

import base64
import html
import json
import os
import struct
import subprocess
import threading
import zlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tumble._errors import InvalidValueError, PictureError, UnreadableFileError
from tumble._keywords import hinted

if TYPE_CHECKING:
    from tumble._native import World
    from tumble._pictures import Camera

_TIMEOUT = 60.0
"""Longest time that ffmpeg may take for one frame, or to end, s."""

Image = NDArray[np.uint8]


class Shot(NamedTuple):
    """A frame of an animation."""

    time: float
    """Simulated time, s."""
    image: Image
    """Shape (height, width, 4)."""


def instants(times: NDArray[np.float64], fps: float, speed: float) -> list[int]:
    """Returns the indices of the recorded frames that are shown at each multiple of ``1/fps`` s, at ``speed`` times real time."""
    for name, value in (("fps", fps), ("speed", speed)):
        if not 0.0 < value < float("inf"):
            raise InvalidValueError(f"{name} is {value}; it must be finite and above 0")
    if len(times) == 0:
        raise InvalidValueError("the recording has no frames")
    begin, end = float(times[0]), float(times[-1])
    count = int((end - begin) / speed * fps + 1e-9) + 1
    wanted = begin + np.arange(count) * speed / fps
    # the frame at or just before each time; times of frames are sums of steps
    return [int(k) for k in np.searchsorted(times, wanted + 1e-9, side="right") - 1]


def in_a_folder(path: str | PathLike[str]) -> Path:
    """Returns the path of a file to write, whose folder must be there."""
    target = Path(path)
    if not target.parent.is_dir():
        raise UnreadableFileError(f"{path}: cannot write it: there is no folder {target.parent}")
    return target


def write_video(path: str | PathLike[str], shots: Iterable[Shot], fps: float) -> None:
    """Encodes images as a video by the program ffmpeg; the extension of the path sets the format."""
    target = in_a_folder(path)
    part = target.with_name(f".{target.stem}.{os.getpid()}.unfinished{target.suffix}")
    video: _Ffmpeg | None = None
    try:
        for shot in shots:
            if video is None:
                height, width = shot.image.shape[:2]
                video = _Ffmpeg(part, width, height, fps)
            video.add(shot.image)
        if video is not None:
            video.finish()
            os.replace(part, target)
    finally:
        if video is not None:
            video.end()
        with suppress(FileNotFoundError):
            part.unlink()


def of_world(
    world: World, duration: float, size: tuple[int, int], fps: float, speed: float, camera: Camera | None, control: Callable[[World], object] | None
) -> Animation:
    """Returns an animation of a fork of a world."""
    return Animation(_ahead(world, duration, size, fps, speed, camera, control), fps, "a world")


def video_of_world(
    world: World,
    path: str | PathLike[str],
    duration: float,
    size: tuple[int, int],
    fps: float,
    speed: float,
    camera: Camera | None,
    control: Callable[[World], object] | None,
) -> None:
    """Writes a video of a fork of a world."""
    shots = _ahead(world, duration, size, fps, speed, camera, control)
    if Path(path).suffix.lower() in (".png", ".apng"):
        Animation(shots, fps, "a world").save(in_a_folder(path))
    else:
        write_video(path, shots, fps)


def _ahead(
    world: World, duration: float, size: tuple[int, int], fps: float, speed: float, camera: Camera | None, control: Callable[[World], object] | None
) -> Iterator[Shot]:
    """Returns the images of a fork that is stepped for ``duration`` seconds."""
    if not 0.0 < duration < float("inf"):
        raise InvalidValueError(f"duration is {duration}; it must be finite and above 0")
    if control is not None and not callable(control):
        raise InvalidValueError(f"control is {control!r}; expected a function of a world")
    fork = world.fork()
    steps = max(1, round(duration / fork.dt))
    chosen = instants(np.arange(steps + 1, dtype=np.float64) * fork.dt, fps, speed)
    return _steps(fork, chosen, size, camera, control)


def _steps(fork: World, chosen: list[int], size: tuple[int, int], camera: Camera | None, control: Callable[[World], object] | None) -> Iterator[Shot]:
    step = 0
    for k in chosen:
        while step < k:
            if control is not None:
                control(fork)
            fork.step()
            step += 1
        yield Shot(fork.time, fork.render(*size, camera=camera))


class _Ffmpeg:
    """A running ffmpeg; it is killed if it does not take a frame in time."""

    def __init__(self, path: Path, width: int, height: int, fps: float) -> None:
        options = ["-hide_banner", "-nostdin", "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgba"]
        size = ["-s", f"{width}x{height}", "-r", repr(fps), "-i", "pipe:0"]
        # even sides, and the pixel format that players support
        output = ["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p", "-movflags", "+faststart", "--", str(path)]
        try:
            self.process = subprocess.Popen(["ffmpeg", *options, *size, *output], stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        except FileNotFoundError:
            message = "the video: there is no ffmpeg; on Debian and Ubuntu: apt-get install ffmpeg; or write an animated PNG: video('run.png')"
            raise PictureError(message) from None
        self.messages = b""
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()

    def _read(self) -> None:
        assert self.process.stderr is not None
        while piece := self.process.stderr.read(1024):
            self.messages = (self.messages + piece)[-4096:]

    def add(self, image: Image) -> None:
        assert self.process.stdin is not None
        late = threading.Timer(_TIMEOUT, self.process.kill)
        late.start()
        try:
            self.process.stdin.write(np.ascontiguousarray(image).data)
        except OSError:
            raise self._failed() from None
        finally:
            late.cancel()

    def finish(self) -> None:
        assert self.process.stdin is not None
        late = threading.Timer(_TIMEOUT, self.process.kill)
        late.start()
        try:
            with suppress(OSError):  # its exit code says why
                self.process.stdin.close()
            code = self.process.wait()
        finally:
            late.cancel()
        if code != 0:
            raise self._failed()

    def _failed(self) -> PictureError:
        self.end()
        text = self.messages.decode(errors="replace").strip()
        return PictureError(f"the video: ffmpeg failed: {text or 'without a message, or it did not answer'}")

    def end(self) -> None:
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        self.reader.join()
        for pipe in (self.process.stdin, self.process.stderr):
            if pipe is not None:
                with suppress(OSError):
                    pipe.close()


class Patch(NamedTuple):
    """The part of an image that differs from the image before."""

    x: int
    y: int
    pixels: Image
    """Shape (height, width, 3)."""


def patches(shots: Iterable[Shot]) -> Iterator[tuple[float, Patch]]:
    """Returns time and changed rectangle of each image; the first is whole, and one that is the same is one pixel."""
    before: Image | None = None
    for time, image in shots:
        now = image[:, :, :3]
        if before is None:
            yield time, Patch(0, 0, now)
        else:
            changed = np.any(now != before, axis=2)
            rows, columns = np.flatnonzero(changed.any(axis=1)), np.flatnonzero(changed.any(axis=0))
            top, bottom = (rows[0], rows[-1] + 1) if len(rows) else (0, 1)
            left, right = (columns[0], columns[-1] + 1) if len(columns) else (0, 1)
            yield time, Patch(int(left), int(top), now[top:bottom, left:right])
        before = now.copy()


def _compressed(pixels: Image) -> bytes:
    """Returns RGB pixels as the content of a PNG; each row begins with its filter: 2, the difference to the row above."""
    height, width, _ = pixels.shape
    above = np.vstack([np.zeros_like(pixels[:1]), pixels[:-1]])
    rows = np.empty((height, 1 + 3 * width), np.uint8)
    rows[:, 0] = 2
    rows[:, 1:] = (pixels - above).reshape(height, 3 * width)
    return zlib.compress(rows.tobytes(), 6)


def _chunk(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


_SIGNATURE = b"\x89PNG\r\n\x1a\n"


def _header(width: int, height: int) -> bytes:
    return _SIGNATURE + _chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)) + _chunk(b"sRGB", b"\0")


def png(pixels: Image) -> bytes:
    """Returns RGB pixels as a PNG file."""
    height, width, _ = pixels.shape
    return _header(width, height) + _chunk(b"IDAT", _compressed(pixels)) + _chunk(b"IEND", b"")


def animated_png(parts: list[Patch], fps: float) -> bytes:
    """Returns images as an animated PNG that repeats (PNG, third edition, chunks acTL, fcTL and fdAT)."""
    height, width, _ = parts[0].pixels.shape
    delay = (round(1000 / fps), 1000) if fps > 0.02 else (65535, 1000)
    out, number = [_header(width, height), _chunk(b"acTL", struct.pack(">II", len(parts), 0))], 0
    for k, (x, y, pixels) in enumerate(parts):
        high, wide, _ = pixels.shape
        out.append(_chunk(b"fcTL", struct.pack(">IIIIIHHBB", number, wide, high, x, y, *delay, 0, 0)))
        number += 1
        if k == 0:
            out.append(_chunk(b"IDAT", _compressed(pixels)))
        else:
            out.append(_chunk(b"fdAT", struct.pack(">I", number) + _compressed(pixels)))
            number += 1
    return b"".join([*out, _chunk(b"IEND", b"")])


class Animation:
    """Images of a recording that play in a notebook or a browser, without a kernel and without a network."""

    def __init__(self, shots: Iterable[Shot], fps: float, title: str) -> None:
        parts = list(patches(shots))
        self.fps = fps
        """Images per second."""
        self.times = np.array([time for time, _ in parts])
        """Simulated time of each image, shape (n,), s."""
        self.title = title
        """What is shown."""
        self._parts = [patch for _, patch in parts]

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, pixels."""
        height, width, _ = self._parts[0].pixels.shape
        return width, height

    @property
    def html(self) -> str:
        """A page of HTML with all images in it: play, pause, and a slider."""
        width, height = self.size
        data: list[tuple[int, int, str]] = [(p.x, p.y, base64.b64encode(png(p.pixels)).decode()) for p in self._parts]
        values = {
            "@TITLE@": html.escape(self.title),
            "@WIDTH@": str(width),
            "@HEIGHT@": str(height),
            "@LAST@": str(len(data) - 1),
            "@FIRST@": data[0][2],
            "@DATA@": json.dumps({"fps": self.fps, "times": [round(float(t), 6) for t in self.times], "frames": data}),
        }
        page = _PAGE
        for name, value in values.items():
            page = page.replace(name, value)
        return page

    @hinted
    def save(self, path: str | PathLike[str]) -> None:
        """Writes the page (``.html``) or an animated PNG (``.png``, ``.apng``)."""
        kind = Path(path).suffix.lower()
        if kind not in (".html", ".png", ".apng"):
            raise InvalidValueError(f"{path}: expected the name of an .html, .png or .apng file")
        data = self.html.encode() if kind == ".html" else animated_png(self._parts, self.fps)
        target = in_a_folder(path)
        part = target.with_name(f".{target.name}.{os.getpid()}.unfinished")
        try:
            part.write_bytes(data)
            os.replace(part, target)
        finally:
            part.unlink(missing_ok=True)

    def _repr_html_(self) -> str:
        width, height = self.size
        page = html.escape(self.html, quote=True)
        return f'<iframe srcdoc="{page}" width="{width + 18}" height="{height + 62}" style="border:0" title="{html.escape(self.title, quote=True)}"></iframe>'

    def __repr__(self) -> str:
        width, height = self.size
        return f"<tumble.Animation of {self.title}: {len(self.times)} images of {width} x {height} pixels>"


_PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<title>@TITLE@</title>
<style>
body { margin: 8px; font: 13px system-ui, sans-serif; color: #333; background: transparent; }
canvas { display: block; }
form { display: flex; gap: 8px; align-items: center; width: @WIDTH@px; margin-top: 6px; }
input { flex: 1; }
button { width: 5em; }
output { width: 5em; text-align: right; font-variant-numeric: tabular-nums; }
</style>
</head>
<body>
<canvas id="picture" width="@WIDTH@" height="@HEIGHT@"></canvas>
<noscript><img alt="@TITLE@" src="data:image/png;base64,@FIRST@"></noscript>
<form onsubmit="return false">
<button type="button" id="play">Pause</button>
<input type="range" id="at" min="0" max="@LAST@" value="0" aria-label="time">
<output id="time"></output>
</form>
<script>
"use strict";
const data = @DATA@;
const get = (id) => document.getElementById(id);
const pen = get("picture").getContext("2d");
let shown = -1, playing = true, begin = 0;

// each image is what differs from the one before
function show(images, k) {
  if (k < shown) shown = -1;
  while (shown < k) {
    shown += 1;
    pen.drawImage(images[shown], data.frames[shown][0], data.frames[shown][1]);
  }
  get("at").value = k;
  get("time").textContent = data.times[k].toFixed(2) + " s";
  document.body.dataset.shown = k;
}

function play(on, now) {
  playing = on;
  get("play").textContent = on ? "Pause" : "Play";
  begin = now - 1000 * shown / data.fps;
}

function load([, , bytes]) {
  const image = new Image();
  image.src = "data:image/png;base64," + bytes;
  return image.decode().then(() => image);
}

Promise.all(data.frames.map(load)).then((images) => {
  show(images, 0);
  play(true, performance.now());
  get("play").onclick = () => play(!playing, performance.now());
  get("at").oninput = () => { show(images, Number(get("at").value)); play(false, performance.now()); };
  requestAnimationFrame(function turn(now) {
    if (playing) {
      // a short rest on the last image
      const k = Math.max(0, Math.floor((now - begin) * data.fps / 1000)) % (images.length + Math.ceil(data.fps / 2));
      if (k < images.length && k !== shown) show(images, k);
    }
    requestAnimationFrame(turn);
  });
});
</script>
</body>
</html>
"""
