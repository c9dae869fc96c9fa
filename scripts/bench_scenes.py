#!/usr/bin/env python3
"""Times every shipped scene with both steppers and prints a Markdown table: `make bench-scenes`.

    scripts/bench_scenes.py [--seconds 10] [--at-once 1] [SCENE...]     all scenes, or the named ones

Each run is one process of target/release/tumble on one thread without pictures. A cell is: how many times faster than real time it ran, the longest
frame (99 % and all, ms), solves that did not converge, and the largest residual, m/s. A run that takes longer than two minutes of the clock is
"over 120 s".
"""

import argparse
import json
import os
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
TUMBLE = Path(os.environ.get("TUMBLE", ROOT / os.environ.get("CARGO_TARGET_DIR", "target") / "release/tumble"))
STEPPERS = ["time_stepping", "backtracking"]
TIME_OUT = 120  # seconds of a run


def cell(scene, stepper, seconds):
    """Runs a scene and returns its cell of the table."""
    with tempfile.NamedTemporaryFile(suffix=".json") as summary:
        words = ["run", ROOT / "scenes" / scene, "--duration", seconds, "--stepper", stepper, "--threads", 1, "--summary", summary.name, "--quiet"]
        try:
            subprocess.run([str(TUMBLE), *map(str, words)], check=True, timeout=TIME_OUT, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        except subprocess.TimeoutExpired:
            return f"over {TIME_OUT} s"
        except subprocess.CalledProcessError as error:
            return f"exit code {error.returncode}"
        s = json.loads(Path(summary.name).read_text(encoding="utf-8"))
    factor, residual = s["real_time_factor"], s["solver_residual_max_m_per_s"]
    times = f"{factor:.0f} x" if factor >= 10 else f"{factor:.1f} x"
    return f"{times}, {s['frame_p99_ms']:.1f} / {s['frame_max_ms']:.1f} ms, {s['unconverged_solves']}, {residual:.0e}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=10, help="simulated time of a run, s")
    parser.add_argument("--at-once", type=int, default=1, help="runs at once; more than one only where cores are idle")
    parser.add_argument("scenes", nargs="*")
    options = parser.parse_args()
    scenes = options.scenes or sorted(path.parent.name for path in ROOT.glob("scenes/*/scene.toml"))
    print("| scene | `time_stepping` | `backtracking` |\n|---|---|---|")
    with ThreadPoolExecutor(options.at_once) as pool:
        cells = {(scene, stepper): pool.submit(cell, scene, stepper, options.seconds) for scene in scenes for stepper in STEPPERS}
        for scene in scenes:
            print(f"| {scene} | " + " | ".join(cells[scene, stepper].result() for stepper in STEPPERS) + " |", flush=True)


if __name__ == "__main__":
    main()
