#!/usr/bin/env python3
"""Draws the pictures of docs/gallery.md, in docs/images/gallery: one animated WebP for each shipped scene, and the figures of the thesis that
show a cave. `make gallery` runs it.

    scripts/gallery.py [NAME...]     all pictures, or those of the named scenes; a picture of a cave is `cave_` and the scene

It needs target/release/tumble, a Vulkan or OpenGL driver, and Pillow. A run ends after five minutes; a picture above 300 kB is written again with
a lower quality.
"""

import math
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).resolve().parents[1]
TUMBLE = ROOT / "target" / "release" / "tumble"
OUT = ROOT / "docs" / "images" / "gallery"
SIZE = "384x216"
FPS = 12
LIMIT = 300_000  # bytes of a picture
TIME_OUT = 300  # seconds of a run

# Scene: the time at which its picture begins and how long it shows, in seconds of the scene; how many times faster than that it
# runs, if not once.
SCENES = {
    "falling": (0, 3.0),
    "stack": (0, 3.0),
    "billiards": (0, 3.0),
    "bowling": (2.2, 2.0),
    "incline": (0, 1.5),
    "pendulum": (0, 4.0),
    "chain": (0, 3.0),
    "piston": (0, 0.5),
    "skeleton": (0, 3.5),
    "robot": (0, 4.5),
    "dominoes": (0, 3.5),
    "newtons_cradle": (0, 0.9),
    "arch": (1.5, 2.5),
    "card_house": (0, 3.0),
    "wrecking_ball": (0, 3.0),
    "marble_run": (0, 12.0, 3),
    "steam_engine": (5, 1.0),
    "walker": (0, 5.5),
    "flock": (1.5, 3.0),
    "sparks": (0.25, 1.75),
    "campfire": (4.0, 2.5),
    "cloth": (0, 1.8),
    "jelly": (0, 1.2),
    "ball_machine": (0.5, 6.0),
    "bird": (3.0, 1.0),
    "mechanism": (1.0, 3.0),
}

# Figures 27 to 31 of the thesis: scenes in the cave `cube4`, and the time that is shown, whole seconds of the scene.
CAVE = {"flock": 5, "billiards": 1, "bowling": 3, "falling": 2, "chain": 1}
CAVE_FPS = 10
WALL = 256  # side of a wall in the picture, pixels

# Scenes in which nothing should move: the camera goes around its target, and comes back, by that many degrees to each side.
STILL = {"stack": 20, "card_house": 14}


def tumble(*words):
    """Runs the command quietly; an error ends this script."""
    subprocess.run([str(TUMBLE), "run", *map(str, words), "--quiet"], check=True, timeout=TIME_OUT, stdin=subprocess.DEVNULL)


def frames(scene, begin, length, fps, folder):
    """Returns the pictures of a scene between `begin` and `begin + length`, s."""
    file = ROOT / "scenes" / scene
    words = [file, "--duration", length, "--fps", fps, "--size", SIZE, "--frames-dir", folder]
    if begin > 0:
        state = Path(folder) / "state"
        tumble(file, "--duration", begin, "--save", state)
        words += ["--restore", state]
    tumble(*words)
    return [Image.open(path).convert("RGB") for path in sorted(Path(folder).glob("frame_*.png"))]


def around(scene, begin, length, fps, folder):
    """Returns pictures of a still scene from a camera that swings about the vertical through its target; each is of its time of the scene."""
    text = (ROOT / "scenes" / scene / "scene.toml").read_text(encoding="utf-8")
    x, y, z = numbers(text, "eye_m")
    a, b, _ = numbers(text, "target_m")
    pictures = []
    for k in range(round(length * fps)):
        turn = math.radians(STILL[scene]) * math.sin(2 * math.pi * k / round(length * fps))
        east, north = x - a, y - b
        eye = [a + east * math.cos(turn) - north * math.sin(turn), b + east * math.sin(turn) + north * math.cos(turn), z]
        file, picture = Path(folder) / "scene.toml", Path(folder) / f"{k}.png"
        file.write_text(re.sub(r"eye_m = \[.*\]", f"eye_m = {eye}", text), encoding="utf-8")
        tumble(file, "--duration", begin + k / fps, "--size", SIZE, "--screenshot", picture)
        pictures.append(Image.open(picture).convert("RGB"))
    return pictures


def cave(scene, time, folder):
    """Returns what the four facets of a run in a cave show at a time: the walls in a row, the floor below the front wall."""
    words = [ROOT / "scenes" / scene, "--cave", "cube4", "--no-realtime", "--offscreen", "--frames-dir", folder]
    # facets take the server for dead that sends nothing for seconds, so frames are short; the frame after the shown one waits for it
    words += ["--fps", CAVE_FPS, "--duration", time + 1 / CAVE_FPS]
    subprocess.run([str(TUMBLE), "cave", *map(str, words)], check=True, timeout=TIME_OUT, stdin=subprocess.DEVNULL, capture_output=True)
    facets = (("left", (0, 0)), ("front", (1, 0)), ("right", (2, 0)), ("floor", (1, 1)))
    # a facet that is late on a loaded machine leaves frames out
    whole = set.intersection(*({path.name for path in (Path(folder) / facet).glob("frame_*.png")} for facet, _ in facets))
    shown = max((name for name in whole if name <= f"frame_{CAVE_FPS * time:06}.png"), default="")
    if shown < f"frame_{CAVE_FPS * (time - 1):06}.png":
        sys.exit(f"error: no frame of the last second of {scene} was shown by all facets; the machine is too slow or too busy")
    unfolded = Image.new("RGB", (3 * WALL, 2 * WALL), "white")
    for facet, place in facets:
        wall = Image.open(Path(folder) / facet / shown).convert("RGB").resize((WALL, WALL), Image.Resampling.BOX)
        unfolded.paste(wall, tuple(WALL * number for number in place))
    return [unfolded]


def numbers(text, key):
    """Returns the numbers of a key of a scene's camera."""
    return [float(number) for number in re.search(rf"{key} = \[(.*)\]", text).group(1).split(",")]


def write(pictures, path, milliseconds):
    """Writes an animated WebP that repeats, of at most `LIMIT` bytes if a quality of 30 allows it."""
    for quality in (80, 70, 60, 50, 40, 30):
        pictures[0].save(path, save_all=True, append_images=pictures[1:], duration=milliseconds, loop=0, quality=quality, method=6)
        if path.stat().st_size <= LIMIT:
            return


def main():
    shipped = {path.parent.name for path in ROOT.glob("scenes/*/scene.toml")}
    if shipped != set(SCENES):
        sys.exit(f"error: not in both scenes/ and this script: {', '.join(sorted(shipped ^ set(SCENES)))}")
    caves = {f"cave_{scene}": (scene, time) for scene, time in CAVE.items()}
    wanted = sys.argv[1:] or [*SCENES, *caves]
    if unknown := [name for name in wanted if name not in SCENES and name not in caves]:
        sys.exit(f"error: no scene {', '.join(unknown)}")
    OUT.mkdir(parents=True, exist_ok=True)
    for name in wanted:
        if name in caves:
            with tempfile.TemporaryDirectory() as folder:
                write(cave(*caves[name], folder), OUT / f"{name}.webp", 1000)
            continue
        begin, length, *faster = SCENES[name]
        fps = FPS if length > 2 else 2 * FPS
        shown = fps // (faster or [1])[0]
        with tempfile.TemporaryDirectory() as folder:
            pictures = (around if name in STILL else frames)(name, begin, length, shown, folder)
            write(pictures, OUT / f"{name}.webp", 1000 // fps)
        print(f"{name}: {len(pictures)} pictures, {(OUT / f'{name}.webp').stat().st_size / 1000:.0f} kB", flush=True)


if __name__ == "__main__":
    main()
