#!/usr/bin/env python3
"""Trials of `tumble cave`: the same frames on all facets, kills and freezes at random times, a long run, a recording shown again and cut, nodes with a
launch command in a network namespace.

usage: scripts/cave_trial.py [--long] [--load N] [--seed 1] [--quality default] [--frames N] [--kills N] [--soak N] [--everywhere N] [--bodies N] [--minutes N] [--minute N] [TRIAL ...]

Without names the short ones run that need no root and no other build: frames, kills, freezes, launchers, servers, everywhere, minute, cuts. --long has the full numbers,
and all but `namespace` (root) and `viewers` (a build with --features foxglove).
--load N keeps N processes per core busy meanwhile: what was shown must be whole and the same, however long it takes.
Ends with 1 if a trial does not show what it must. Nothing is left behind but out/cave_trial.
"""

import argparse
import json
import math
import os
import random
import re
import secrets
import selectors
import shutil
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
TUMBLE = Path(os.environ.get("TUMBLE", ROOT / os.environ.get("CARGO_TARGET_DIR", "target") / "release/tumble"))
OUT = Path(os.environ.get("OUT", ROOT / "out/cave_trial"))
FACETS = ["front", "left", "right", "floor"]


# What is read and started.


def log(folder, facet):
    path = folder / facet / "frames.jsonl"
    lines = path.read_text().splitlines() if path.exists() else []
    return [json.loads(line) for line in lines if line.endswith("}")]


def last_line(folder, facet):
    """Without reading all of it."""
    path = folder / facet / "frames.jsonl"
    if not path.exists():
        return None
    with path.open("rb") as file:
        file.seek(max(0, path.stat().st_size - 2000))
        lines = [line for line in file.read().decode().splitlines() if line.startswith("{") and line.endswith("}")]
    return json.loads(lines[-1]) if lines else None


def tumble(*args, timeout=36000):
    done = subprocess.run([TUMBLE, *map(str, args)], timeout=timeout, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"error: tumble {' '.join(map(str, args))} ended with {done.returncode}:\n{done.stderr[-2000:]}")
    return done.stdout


def start(*args, stderr=subprocess.DEVNULL, **more):
    return subprocess.Popen([TUMBLE, *map(str, args)], stderr=stderr, stdout=subprocess.DEVNULL, **more)


def end(*processes):
    for process in processes:
        process.terminate()
    return [process.wait(timeout=30) for process in processes]


def small_cave(name, side=80, sync="", facet="", nodes=""):
    """cube4 with small pictures."""
    text = (ROOT / "caves/cube4.toml").read_text()
    text = re.sub(r"size_px = .*", f"size_px = [{side}, {side}]\n{facet}", text)
    if sync:
        text = re.sub(r"\[sync\][^\[]*", "", text) + f"\n[sync]\n{sync}\n"
    path = OUT / f"{name}.toml"
    path.write_text(text + nodes)
    return path


def writes_frames(pid):
    """Whether a process has the list of its frames open: one that stands by has not."""
    try:
        return any(os.readlink(link).endswith("frames.jsonl") for link in Path(f"/proc/{pid}/fd").iterdir())
    except OSError:
        return False  # it has ended, or a file was closed meanwhile


def facets_of(parent):
    """By name: the processes that draw for a launcher."""
    found = {}
    for child in Path(f"/proc/{parent}/task/{parent}/children").read_text().split():
        words = Path(f"/proc/{child}/cmdline").read_bytes().split(b"\0")
        for facet in FACETS:
            if facet.encode() in words and (b"--stand-by" not in words or writes_frames(child)):
                found[facet] = int(child)
    return found


def alive(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


def memory():
    """What this user's processes have in shared memory."""
    return {file.name for file in Path("/dev/shm").glob(f"tumble_{os.getuid()}_*")}


def others_run():
    """Whether somebody else's run of this user goes on, whose memory is no litter."""
    named = [Path(f"/proc/{pid}/comm") for pid in os.listdir("/proc") if pid.isdigit()]
    return any("tumble" in path.read_text() for path in named if path.exists())


def wait_for(ready, seconds=60):
    until = time.time() + seconds
    while not ready():
        if time.time() > until:
            sys.exit(f"error: it did not come within {seconds} s")
        time.sleep(0.01)


def shown_after(folder, facet, moment):
    """When a facet showed its first frame after a moment, s since 1970; waits for it."""
    wait_for(lambda: (last_line(folder, facet) or {"shown_unix_us": 0})["shown_unix_us"] * 1e-6 > moment)
    return next(line["shown_unix_us"] * 1e-6 for line in log(folder, facet) if line["shown_unix_us"] * 1e-6 > moment)


def same_states(folder):
    """Whether all facets that showed a frame showed the same state, and an undisturbed facet missed none."""
    states = {}
    for facet in FACETS:
        for line in log(folder, facet):
            if states.setdefault(line["frame"], line["state"]) != line["state"]:
                return False
    return True


def spread(values, unit=1e3):
    values = sorted(values)
    return f"{values[len(values) // 2] * unit:.0f} ms (half), {values[-1] * unit:.0f} ms (all)"


class Load:
    """Busy processes, some for each core, that end with this one."""

    BUSY = "import os, sys\nwhile os.getppid() == int(sys.argv[1]):\n    for _ in range(1000000): pass"

    def __init__(self, per_core):
        count = per_core * (os.cpu_count() or 1)
        self.processes = [subprocess.Popen([sys.executable, "-c", Load.BUSY, str(os.getpid())]) for _ in range(count)]
        if count:
            print(f"load: {count} busy processes on {os.cpu_count()} cores, beside the load of {os.getloadavg()[0]:.1f} before", flush=True)

    def end(self):
        for process in self.processes:
            process.kill()
            process.wait()


# The trials.


def frames(options):
    """Five processes, lockstep: 0 missing, duplicated or torn frames; the same numbers and states on all facets."""
    count, folder = options.frames, OUT / "frames"
    said = tumble("cave", "billiards", "--cave", "cube4", "--duration", count / 60, "--no-realtime", "--offscreen", "--quality", options.quality, "--burn-in", "--connect-timeout", 60,
                  "--log-dir", folder, "--quiet", "--summary", OUT / "frames.json")
    logs = [log(folder, facet) for facet in FACETS]
    numbers = [[line["frame"] for line in lines] for lines in logs]
    states = [[line["state"] for line in lines] for lines in logs]
    whole = all(n == list(range(count + 1)) for n in numbers)
    same = all(s == states[0] for s in states)
    summary = json.loads((OUT / "frames.json").read_text())
    faults = sum(facet[key] for facet in summary["facets"] for key in ["late", "missing", "torn", "mismatched", "dropped"])
    print(said, end="")
    print(f"frames: {count + 1} on each of {len(FACETS)} facets: {'all' if whole else 'NOT ALL'} there once and in order, states {'the same' if same else 'DIFFERENT'}, "
          f"{faults} late, missing, torn, mismatched or dropped; barrier {summary['barrier']['p50_ms']:.1f} ms (half), {summary['barrier']['p99_ms']:.1f} ms (99 %), "
          f"skew {summary['skew']['p50_ms']:.2f} ms (half), {summary['skew']['p99_ms']:.2f} ms (99 %)")
    return whole and same and faults == 0


def cube_cave(facets, size, stereo="mono"):
    """A cube with the first screens of cube6, a facet each, on this machine."""
    screens = re.findall(r"\[\[screen\]\][^\[]*(?:\[[^\[]*){3}", (ROOT / "caves/cube6.toml").read_text())[:facets]
    names = [re.search(r'name = "(\w+)"', screen)[1] for screen in screens]
    parts = [f'{screen}\n[[facet]]\nname = "{name}"\nscreen = "{name}"\nsize_px = [{size[0]}, {size[1]}]\nstereo = "{stereo}"\n' for screen, name in zip(screens, names)]
    path = OUT / f"cube_{facets}_{size[0]}_{stereo}.toml"
    sync = "[sync]\nready_timeout_ms = 20000\ndrop_timeout_ms = 20000\nconnect_timeout_ms = 60000\n"
    path.write_text('[[user]]\nname = "viewer"\neye_m = [0, 0, 1.6]\n' + "".join(parts) + sync)
    return path


def rates(options):
    """Frames per second of real caves: one process per facet, in lockstep, as fast as they can. Prints the table of docs/running_a_cave.md."""
    print("rates: frames per second of billiards, one process per facet; in brackets the load before the run")
    whole, drivers, qualities = True, set(), ["fastest", "fast", "default"]
    print("| facets | size | " + " | ".join(f"`{quality}`" for quality in qualities) + " |\n|---|---|" + "---|" * len(qualities), flush=True)
    for size in [(640, 480), (1024, 768)]:
        for facets in [1, 4, 6]:
            line = []
            for quality in qualities:
                load, file = os.getloadavg()[0], OUT / "rates.json"
                tumble("cave", "billiards", "--cave", cube_cave(facets, size), "--duration", options.rates / 60, "--no-realtime", "--offscreen", "--quality", quality, "--quiet",
                       "--summary", file)
                summary = json.loads(file.read_text())
                whole &= all(facet["presented"] == options.rates + 1 for facet in summary["facets"])
                drivers.update(facet["adapter"] for facet in summary["facets"])
                line.append(f"{(summary['frames'] - 1) / summary['wall_s']:.1f} ({load:.1f})")
            print(f"| {facets} | {size[0]} x {size[1]} | {' | '.join(line)} |", flush=True)
    print(f"rates: {options.rates} frames of each run {'on all facets' if whole else 'NOT ON ALL FACETS'}, drawn by {', '.join(sorted(drivers))}")
    return whole


def processes(options):
    """Frames per second and processor time of a frame with a process per facet and with one process for all, alternately. Prints the table of docs/running_a_cave.md."""
    print("processes: billiards, with a process per facet and with --one-process; in brackets the load before the run")
    print("| facets | size | a process each: frames/s | processor ms | one process: frames/s | processor ms |\n|---|---|---|---|---|---|", flush=True)
    whole, drivers = True, set()
    for facets, size, stereo in [(4, (1024, 768), "mono"), (6, (1024, 768), "mono"), (6, (1920, 1080), "side_by_side")]:
        line = []
        for more in [[], ["--one-process"]]:
            load, file, before = os.getloadavg()[0], OUT / "processes.json", os.times()
            tumble("cave", "billiards", "--cave", cube_cave(facets, size, stereo), "--duration", options.rates / 120, "--fps", 120, "--no-realtime", "--offscreen",
                   "--quality", options.quality, "--quiet", "--summary", file, *more)
            after, summary = os.times(), json.loads(file.read_text())
            whole &= all(facet["presented"] == summary["frames"] for facet in summary["facets"])
            drivers.update(facet["adapter"] for facet in summary["facets"])
            spent = after.children_user + after.children_system - before.children_user - before.children_system
            line += [f"{(summary['frames'] - 1) / summary['wall_s']:.1f} ({load:.1f})", f"{1e3 * spent / summary['frames']:.0f}"]
        print(f"| {facets} | {size[0]} x {size[1]}{'' if stereo == 'mono' else ' in stereo'} | {' | '.join(line)} |", flush=True)
    print(f"processes: `{options.quality}`; processor time is that of all processes and threads, with the start; {'all frames on all facets' if whole else 'FRAMES ARE MISSING'}, "
          f"drawn by {', '.join(sorted(drivers))}")
    return whole


def bowling(options):
    """The pin strike: the worst frame."""
    tumble("cave", "bowling", "--cave", "cube4", "--duration", 5, "--no-realtime", "--no-pictures", "--connect-timeout", 60, "--quiet", "--summary", OUT / "bowling.json")
    summary = json.loads((OUT / "bowling.json").read_text())
    for what in ["simulation", "barrier", "frame"]:
        f = summary[what]
        print(f"bowling: {what} {f['p50_ms']:.2f} ms (half), {f['p99_ms']:.2f} ms (99 %), {f['max_ms']:.2f} ms (frame {f['max_at_frame']} at {f['max_at_s']:.2f} s)")
    return True


def kills(options, name="kills", draw=("--no-pictures",), bound=1.0):
    """A facet is killed at random times and started again: the others miss nothing, and it is back within 1 s. One with a process that stands by is killed
    when that is ready."""
    folder, rng, back, waited = OUT / name, random.Random(options.seed), [], []
    cave, said = small_cave(name), OUT / f"{name}.txt"
    run = start("cave", "billiards", "--cave", cave, *draw, "--restart", "--log-dir", folder, "--connect-timeout", 60, "--summary", folder.with_suffix(".json"),
                stderr=said.open("w"))
    ready = lambda facet: said.read_text().count(f"facet {facet}: another process stands by")
    try:
        wait_for(lambda: all(last_line(folder, facet) and last_line(folder, facet)["frame"] > 20 for facet in FACETS))
        for k in range(options.kills):
            # no facet is started more than 5 times in a minute
            time.sleep(rng.uniform(3.2, 4.2))
            victim = FACETS[k % len(FACETS)]
            before = time.time()
            if "--stand-by" in draw:
                wait_for(lambda: ready(victim) > k // len(FACETS))
            waited.append(time.time() - before)
            os.kill(facets_of(run.pid)[victim], signal.SIGKILL)
            killed = time.time()
            back.append(shown_after(folder, victim, killed + 0.02) - killed)
    finally:
        [code] = end(run)
    same, summary = same_states(folder), json.loads(folder.with_suffix(".json").read_text())
    wrong = sum(facet["mismatched"] + facet["torn"] for facet in summary["facets"])
    print(f"{name}: {options.kills} times kill -9 of a facet; back after {spread(back)}"
          f"{', killed when another process had stood by, which took up to ' + format(max(waited), '.1f') + ' s more' if max(waited) > 0.1 else ''}; "
          f"states {'the same' if same else 'DIFFERENT'}, {wrong} mismatched or torn, exit code {code}", flush=True)
    return same and wrong == 0 and code == 0 and max(back) < bound


def drawn_kills(options):
    """The same with small pictures, by processes that stand by."""
    return kills(options, "drawn_kills", ("--offscreen", "--quality", "fastest", "--stand-by"))


def cold_kills(options):
    """The same without processes that stand by. Such a facet compiles its pipelines first, so its time has no bound here."""
    return kills(options, "cold_kills", ("--offscreen", "--quality", "fastest"), math.inf)


def freezes(options):
    """A facet is stopped at random times for longer than it may be silent: it is dropped, the others stand still once and miss nothing, and it is back within 1 s
    when it goes on."""
    folder, rng, back, still = OUT / "freezes", random.Random(options.seed), [], []
    cave = small_cave("freezes", sync="ready_timeout_ms = 200\ndrop_timeout_ms = 1000\nconnect_timeout_ms = 60000")
    run = start("cave", "billiards", "--cave", cave, "--no-pictures", "--log-dir", folder, "--quiet", "--summary", OUT / "freezes.json")
    try:
        wait_for(lambda: all(last_line(folder, facet) and last_line(folder, facet)["frame"] > 20 for facet in FACETS))
        for k in range(options.kills):
            time.sleep(rng.uniform(0.5, 1.5))
            victim = FACETS[k % len(FACETS)]
            pid = facets_of(run.pid)[victim]
            os.kill(pid, signal.SIGSTOP)
            stopped = time.time()
            time.sleep(rng.uniform(2.0, 3.0))
            os.kill(pid, signal.SIGCONT)
            went_on = time.time()
            back.append(shown_after(folder, victim, went_on + 0.02) - went_on)
            other = [line["shown_unix_us"] * 1e-6 for line in log(folder, FACETS[(k + 1) % len(FACETS)])]
            still.append(max(b - a for a, b in zip(other, other[1:]) if stopped - 0.5 < a < went_on))
    finally:
        [code] = end(run)
    same, summary = same_states(folder), json.loads((OUT / "freezes.json").read_text())
    dropped = sum(facet["dropped"] for facet in summary["facets"])
    wrong = sum(facet["mismatched"] + facet["torn"] for facet in summary["facets"])
    print(f"freezes: {options.kills} times SIGSTOP of a facet, SIGCONT after 2 to 3 s; dropped {dropped} times; the others stood still for {spread(still)}; "
          f"back after {spread(back)}; states {'the same' if same else 'DIFFERENT'}, {wrong} mismatched or torn, exit code {code}", flush=True)
    return same and wrong == 0 and code == 0 and dropped == options.kills and max(back) < 1.0


def launchers(options):
    """The launcher, which is the server, is killed at random times: its facets end by themselves, and the next run begins."""
    rng, gone, left, before = random.Random(options.seed), [], 0, memory()
    cave = small_cave("launchers")
    for k in range(options.kills):
        folder = OUT / f"launchers_{k}"
        run = start("cave", "billiards", "--cave", cave, "--no-pictures", "--log-dir", folder, "--quiet", "--connect-timeout", 60)
        wait_for(lambda: all(last_line(folder, facet) for facet in FACETS))
        time.sleep(rng.uniform(0.0, 1.0))
        pids = list(facets_of(run.pid).values())
        run.kill()
        killed = time.time()
        run.wait(timeout=30)
        wait_for(lambda: not any(alive(pid) for pid in pids))
        gone.append(time.time() - killed)
        left += len(pids) != len(FACETS)
        shutil.rmtree(folder)
    shared = memory() - before if not others_run() else set()
    print(f"launchers: {options.kills} times kill -9 of the launcher; all its facets had ended after {spread(gone)}; the next run began each time; "
          f"left in shared memory: {sorted(shared) or 'nothing'}", flush=True)
    return left == 0 and not shared


def servers(options):
    """A server by itself is killed at random times and started again at the same address: facets that were started by hand keep their pictures, and go on with
    the new one."""
    folder, rng, back = OUT / "servers", random.Random(options.seed), []
    cave = small_cave("servers", sync='transport = "udp"\nready_timeout_ms = 200\ndrop_timeout_ms = 1000\nconnect_timeout_ms = 60000')
    serve = lambda: start("serve", "billiards", "--cave", cave, "--quiet", "--listen", "127.0.0.1:47911", "--connect-timeout", 60)
    server = serve()
    facets = [start("facet", "billiards", "--cave", cave, "--facet", facet, "--no-pictures", "--server", "127.0.0.1:47911", "--connect-timeout", 60, "--log-dir", folder)
              for facet in FACETS]
    try:
        for _ in range(options.kills):
            wait_for(lambda: all(last_line(folder, facet) for facet in FACETS))
            time.sleep(rng.uniform(0.2, 1.2))
            server.kill()
            server.wait(timeout=30)
            time.sleep(rng.uniform(0.0, 2.0))
            server, again = serve(), time.time()
            back.append(max(shown_after(folder, facet, again + 0.02) for facet in FACETS) - again)
        held = all(facet.poll() is None for facet in facets)
    finally:
        codes = end(server, *facets)
    print(f"servers: {options.kills} times kill -9 of the server, started again after up to 2 s; all four facets, started once by hand, showed its frames "
          f"{spread(back)} after its start; exit codes {sorted(set(codes))}", flush=True)
    return held and set(codes) == {0}


def resident(pid):
    status = Path(f"/proc/{pid}/status").read_text()
    return int(re.search(r"VmRSS:\s+(\d+)", status).group(1)) / 1024


def soak(options):
    """Half an hour of simulated time, as fast as it goes: memory stays flat, and all facets show the same states."""
    folder = OUT / "soak"
    cave = small_cave("soak")
    began = time.time()
    run = start("cave", options.scene, "--cave", cave, "--no-pictures", "--no-realtime", "--duration", options.soak / 60, "--log-dir", folder, "--quiet", "--connect-timeout", 60,
                "--summary", OUT / "soak.json")
    samples = []
    while run.poll() is None:
        time.sleep(min(1.0, 2 * 108000 / options.soak))
        newest = last_line(folder, "front")
        try:
            pids = [run.pid, *facets_of(run.pid).values()]
            if newest and len(pids) == 1 + len(FACETS):
                samples.append((newest["frame"], [resident(pid) for pid in pids]))
        except (OSError, AttributeError):
            pass  # it is ending
    summary = json.loads((OUT / "soak.json").read_text())
    logs = [log(folder, facet) for facet in FACETS]
    states = [[(line["frame"], line["state"]) for line in lines] for lines in logs]
    whole = [frame for frame, _ in states[0]] == list(range(options.soak + 1))
    same = all(s == states[0] for s in states)
    moving = len({state for _, state in states[0]})
    faults = sum(facet[key] for facet in summary["facets"] for key in ["late", "missing", "torn", "mismatched", "dropped"])
    # what a process starts with is not yet all it needs: from a tenth of the run to its end
    steady = [rss for frame, rss in samples if frame > options.soak / 10]
    grown = [steady[-1][k] - steady[0][k] for k in range(1 + len(FACETS))]
    print(f"soak: {options.soak} frames ({summary['simulated_s']:.0f} s) of {options.scene} in {time.time() - began:.0f} s; {'all' if whole else 'NOT ALL'} frames on each facet, "
          f"states {'the same' if same else 'DIFFERENT'} ({moving} different ones), {faults} faults; memory of the server {steady[0][0]:.1f} MiB after a tenth, "
          f"{steady[-1][0]:.1f} MiB at the end, of facets {', '.join(f'{a:.1f} to {b:.1f}' for a, b in zip(steady[0][1:], steady[-1][1:]))} MiB", flush=True)
    return whole and same and faults == 0 and max(grown) < 2.0


class Lossy:
    """A relay of datagrams that loses some, each way. Every client has a socket of its own towards the server."""

    def __init__(self, server, loss, seed):
        self.server, self.loss, self.random = server, loss, random.Random(seed)
        self.front = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.front.bind(("127.0.0.1", 0))
        self.port = self.front.getsockname()[1]
        self.clients, self.counts = {}, {"taken": 0, "lost": 0}
        self.over = False
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def run(self):
        watch = selectors.DefaultSelector()
        watch.register(self.front, selectors.EVENT_READ, None)
        while not self.over:
            for key, _ in watch.select(0.1):
                data, source = key.fileobj.recvfrom(2048)
                self.counts["taken"] += 1
                if self.random.random() < self.loss:
                    self.counts["lost"] += 1
                elif key.data is not None:
                    self.front.sendto(data, key.data)
                else:
                    if source not in self.clients:
                        self.clients[source] = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
                        watch.register(self.clients[source], selectors.EVENT_READ, source)
                    self.clients[source].sendto(data, self.server)

    def end(self):
        self.over = True
        self.thread.join()


def stacks(bodies):
    """A scene with at least this number of boxes in stacks of four ahead of the user, and that number."""
    side = 2 * math.ceil((bodies / 16) ** 0.5)
    scene = OUT / "stacks.toml"  # without a place of the cave, users begin 4 m before the origin
    scene.write_text(f"""[world]
dt_s = {1 / 60}
sleep_after_s = 0.5
sleep_within_m = 1e-4
[[body]]
name = "floor"
mode = "static"
shape = {{ type = "half_space" }}
[[grid]]
name = "box"
shape = {{ type = "box", size_m = [0.2, 0.2, 0.2] }}
density_kg_per_m3 = 200
position_m = [{-0.3 * (side - 1)}, -2.8, 0.102]
count = [{side}, {side}, 4]
spacing_m = [0.6, 0.6, 0.202]
""")
    return scene, 4 * side ** 2


def walk(seconds):
    """Keys of a user that walks, in each two minutes, 1.2 m ahead, against the first row of stacks, and back, and then 0.45 m to the side."""
    ahead, back, right, left = 0x1A, 0x16, 0x07, 0x04
    tour, t = divmod(seconds, 120)
    aside = left if tour // 8 % 2 else right
    return ahead if t < 0.8 else back if t < 1.6 else aside if t < 1.9 else None


def everywhere(options):
    """`--compute everywhere`: 8 nodes step the world by themselves over datagrams of which 5 % are lost each way, while a tracked user walks through
    the bodies. All states are the same, and a frame takes less than 2 kB per node."""
    nodes, folder, port = 8, OUT / "everywhere", 47951
    scene, bodies = stacks(options.bodies)
    key = OUT / "key"
    key.write_text(secrets.token_hex(32))
    key.chmod(0o600)
    screens = "".join(f'[[screen]]\nname = "s{k}"\nlower_left_m = [{k}, 2, 0]\nlower_right_m = [{k + 1}, 2, 0]\nupper_left_m = [{k}, 2, 1]\n'
                      f'[[facet]]\nname = "f{k}"\nscreen = "s{k}"\nsize_px = [64, 64]\n' for k in range(nodes))
    cave = OUT / "everywhere.toml"
    cave.write_text(f'[[user]]\nname = "u"\neye_m = [0, 0, 1.7]\n{screens}[sync]\ntransport = "udp"\ncompute = "everywhere"\nready_timeout_ms = 60000\n'
                    f'drop_timeout_ms = 60000\nconnect_timeout_ms = 120000\n[security]\nkey_file = "{key}"\n')
    began, load = time.time(), os.getloadavg()[0]
    relay = Lossy(("127.0.0.1", port), 0.05, options.seed)
    server = start("serve", scene, "--cave", cave, "--listen", f"127.0.0.1:{port}", "--no-realtime", "--user-colliders", "--tracker", "127.0.0.1:47952",
                   "--duration", options.everywhere / 60, "--summary", OUT / "everywhere.json", "--quiet")
    facets = [start("facet", scene, "--cave", cave, "--facet", f"f{k}", "--server", f"127.0.0.1:{relay.port}", "--user-colliders", "--no-pictures", "--log-dir", folder,
                    "--connect-timeout", 120) for k in range(nodes)]
    tracker, said, ended = socket.socket(socket.AF_INET, socket.SOCK_DGRAM), 0, False
    pad = lambda text: text.encode().ljust(len(text) // 4 * 4 + 4, b"\0")
    while server.poll() is None:
        frame = (last_line(folder, "f0") or {"frame": 0})["frame"]
        x, y = 0.2 * math.sin(frame / 60), 0.2 * math.sin(frame / 83)
        for address in ["head", "hand/left"]:
            tracker.sendto(pad(f"/tumble/user/u/{address}") + pad(",fffffff") + struct.pack(">7f", x, y, 1.7, 0, 0, 0, 1), ("127.0.0.1", 47952))
        held = walk(frame / 60)
        tracker.sendto(pad("/tumble/user/u/keys") + (pad(",") if held is None else pad(",i") + struct.pack(">i", held)), ("127.0.0.1", 47952))
        if frame // 6000 > said:
            said = frame // 6000
            print(f"everywhere: frame {frame} after {time.time() - began:.0f} s", file=sys.stderr, flush=True)
        if time.time() - began > 60 * options.minutes and not ended:
            server.terminate()  # once: a second signal ends a run at once
            ended = True
        time.sleep(1 / 60)
    [process.wait(timeout=120) for process in facets]
    relay.end()
    summary = json.loads((OUT / "everywhere.json").read_text())
    logs = [[(line["frame"], line["state"]) for line in log(folder, f"f{k}")] for k in range(nodes)]
    same = all(lines == logs[0] for lines in logs)
    frames = summary["frames"]
    whole = [frame for frame, _ in logs[0]] == list(range(frames)) and frames > 1
    moving = len({state for _, state in logs[0]})
    faults = sum(facet[key] for facet in summary["facets"] for key in ["late", "missing", "torn", "mismatched", "dropped"])
    # the world that each node gets at its join counts too
    sent = max(facet["bytes_out"] for facet in summary["facets"]) / frames
    step = summary["simulation"]
    print(f"everywhere: {nodes} nodes, {bodies} bodies, {frames - 1} frames ({summary['simulated_s']:.0f} s) in {time.time() - began:.0f} s (load before {load:.1f}), "
          f"{relay.counts['lost']} of {relay.counts['taken']} datagrams lost: {'all' if whole else 'NOT ALL'} frames on each node, states {'the same' if same else 'DIFFERENT'} "
          f"({moving} different ones), {faults} faults; {sent:.0f} bytes a frame to each node, the world at the join included; simulation of a frame {step['p50_ms']:.1f} ms (half), "
          f"{step['p99_ms']:.1f} ms (99 %), {step['max_ms']:.0f} ms (all)", flush=True)
    # the world at the join has 1 MB for 10,000 bodies: less than 2 kB a frame only where it is shared out over many
    return same and whole and faults == 0 and server.returncode == 0 and (sent < 2000 or frames < 6000)


def minute(options):
    """A recording of a minute, shown twice: the same states and the same pictures, bit by bit."""
    cave, file = small_cave("minute", sync="ready_timeout_ms = 10000\ndrop_timeout_ms = 10000\nconnect_timeout_ms = 60000"), OUT / "minute.mcap"
    common = ["billiards", "--cave", cave, "--no-realtime", "--offscreen", "--quality", "fastest", "--quiet", "--connect-timeout", 60]
    tumble("cave", *common, "--duration", options.minute / 60, "--record", file, "--log-dir", OUT / "minute_run")
    counts = []
    for k in range(2):
        tumble("replay", file, *common, "--log-dir", OUT / f"minute_{k}", "--summary", OUT / f"minute_{k}.json")
        counts.append(json.loads((OUT / f"minute_{k}.json").read_text())["replay"])
    key = lambda line: (line["frame"], line["state"], line["image"])
    first = {facet: [key(line) for line in log(OUT / "minute_run", facet)] for facet in FACETS}
    same = all([key(line) for line in log(OUT / f"minute_{k}", facet)] == first[facet] for k in range(2) for facet in FACETS)
    whole = all(len(lines) == options.minute + 1 for lines in first.values())
    pictures = len({image for lines in first.values() for _, _, image in lines})
    print(f"minute: {options.minute + 1} frames recorded ({file.stat().st_size / 1e6:.1f} MB), shown twice: states and pictures {'the same' if same else 'DIFFERENT'} on all four facets "
          f"({pictures} different pictures); {counts}", flush=True)
    return same and whole and all(c["different"] == 0 and c["not_compared"] == 0 for c in counts)


def records(data):
    """Of an MCAP file: where each record begins and ends, and its opcode."""
    at = 8
    while at + 9 <= len(data) - 8:
        length = struct.unpack_from("<Q", data, at + 1)[0]
        yield at, at + 9 + length, data[at]
        at += 9 + length


def frames_by_chunk(data):
    """Where each chunk ends, and how many frames it holds: by the index behind it, which is not packed."""
    chunks, states = [], None
    for begin, _, opcode in records(data):
        if opcode == 0x04:  # a channel, of those that the summary repeats
            number, _, length = struct.unpack_from("<HHI", data, begin + 9)
            if data[begin + 17:begin + 17 + length] == b"/tumble/state":
                states = number
    for begin, stop, opcode in records(data):
        body = data[begin + 9:stop]
        if opcode == 0x06:  # chunk
            chunks.append([stop, 0])
        elif opcode == 0x07 and struct.unpack_from("<H", body)[0] == states:  # index of messages
            chunks[-1][1] += struct.unpack_from("<I", body, 2)[0] // 16
    return chunks


def cuts(options):
    """A recording cut at every structural boundary, beside it, and at random bytes: all frames of chunks that are whole are saved, and none that is not there."""
    file, cut, mended = OUT / "cuts.mcap", OUT / "cut.mcap", OUT / "mended.mcap"
    tumble("cave", "billiards", "--cave", small_cave("cuts"), "--no-realtime", "--no-pictures", "--quiet", "--connect-timeout", 60, "--duration", 4, "--record", file)
    data, rng = file.read_bytes(), random.Random(options.seed)
    chunks = frames_by_chunk(data)
    points = {p for begin, stop, _ in records(data) for p in (begin, begin + 1, begin + 9, (begin + stop) // 2, stop - 1)}
    points |= {rng.randrange(8, len(data)) for _ in range(options.kills * 10)} | {len(data), len(data) - 1, len(data) - 8}
    points = sorted(p for p in points if p >= 8)
    if len(points) > options.cuts:
        points = sorted(rng.sample(points, options.cuts))
    wrong = []
    for at in points:
        cut.write_bytes(data[:at])
        mended.unlink(missing_ok=True)
        expected = sum(count for stop, count in chunks if stop <= at)
        done = subprocess.run([TUMBLE, "recover", cut, "-o", mended], capture_output=True, text=True)
        found = re.search(r"(\d+) frames in", done.stdout)
        if not found or int(found.group(1)) != expected:
            # before the first record there is nothing to save, which is said
            if expected or done.returncode == 0 and found and int(found.group(1)):
                wrong.append((at, expected, done.stdout + done.stderr))
    print(f"cuts: a recording of {len(data)} bytes, {sum(count for _, count in chunks)} frames in {len(chunks)} chunks, cut at {len(points)} places: "
          f"{len(wrong)} where not all that was flushed was saved {wrong[:2] if wrong else ''}", flush=True)
    return not wrong and sum(count for _, count in chunks) > 0


def namespace(options):
    """Two facets on a machine that is a network namespace, started by the cave file's launch command; nothing of them is left. Needs root."""
    if os.geteuid() != 0 or not shutil.which("ip"):
        sys.exit("error: namespace: needs root and the command ip (on Debian: apt-get install iproute2)")
    space, folder = f"tumble-cave-{os.getpid()}", OUT / "namespace"
    key = OUT / "key"
    key.write_text(secrets.token_hex(32))
    key.chmod(0o600)
    launch = json.dumps(["ip", "netns", "exec", space, str(TUMBLE), "{arguments}"])
    nodes = f'\n[[node]]\nname = "far"\naddress = "10.78.1.2"\nlaunch = {launch}\n[security]\nkey_file = "{key}"\n'
    cave = small_cave("namespace", sync='transport = "udp"\nready_timeout_ms = 1000\ndrop_timeout_ms = 2000\nconnect_timeout_ms = 60000', nodes=nodes)
    text = cave.read_text()
    for facet in ["left", "right"]:
        text = re.sub(rf'(\[\[facet\]\]\nname = "{facet}"\n)', r'\1node = "far"\n', text)
    cave.write_text(text)
    ip = lambda *words: subprocess.run(["ip", *words], check=True)
    ip("netns", "add", space)
    try:
        ip("link", "add", f"tc{os.getpid()}", "type", "veth", "peer", "name", "far0", "netns", space)
        ip("address", "add", "10.78.1.1/24", "dev", f"tc{os.getpid()}")
        ip("link", "set", f"tc{os.getpid()}", "up")
        ip("-n", space, "address", "add", "10.78.1.2/24", "dev", "far0")
        ip("-n", space, "link", "set", "far0", "up")
        said = subprocess.run([TUMBLE, "cave", "billiards", "--cave", cave, "--duration", str(options.frames / 60), "--no-realtime", "--no-pictures", "--log-dir", folder,
                               "--listen", "10.78.1.1:47100", "--connect-timeout", "60"], capture_output=True, text=True, timeout=600)
        logs = {facet: [(line["frame"], line["state"]) for line in log(folder, facet)] for facet in FACETS}
        same = said.returncode == 0 and all(lines == logs["front"] and len(lines) == options.frames + 1 for lines in logs.values())
        inside = lambda: subprocess.run(["ip", "netns", "pids", space], capture_output=True, text=True).stdout.split()
        after_end = inside()
        # and when the launcher dies
        shutil.rmtree(folder)
        run = start("cave", "billiards", "--cave", cave, "--no-pictures", "--log-dir", folder, "--listen", "10.78.1.1:47100", "--connect-timeout", 60)
        wait_for(lambda: all(last_line(folder, facet) for facet in FACETS))
        there = inside()
        run.kill()
        run.wait(timeout=30)
        wait_for(lambda: not inside(), 30)
    finally:
        subprocess.run(["ip", "netns", "del", space])
    print(f"namespace: two facets started by the launch command in a network namespace: {options.frames + 1} frames, states {'the same' if same else 'DIFFERENT'}; processes left there "
          f"{len(after_end)}; of {len(there)} after kill -9 of the launcher none is left {'' if same else said.stderr[-1000:]}", flush=True)
    return same and not after_end and len(there) == 2


def viewers(options):
    """One viewer reads, another never does: the first sees every topic, and the wall keeps its pace. Needs the package websockets and a build with
    `--features foxglove`."""
    from websockets.sync.client import connect

    folder = OUT / "viewers"
    run = start("cave", "billiards", "--cave", small_cave("viewers"), "--no-pictures", "--log-dir", folder, "--quiet", "--connect-timeout", 60, "--foxglove", "127.0.0.1:47865",
                "--summary", OUT / "viewers.json")
    topics, counts = {}, {}
    try:
        wait_for(lambda: all(last_line(folder, facet) for facet in FACETS))
        idle = connect("ws://127.0.0.1:47865", subprotocols=["foxglove.sdk.v1"], max_queue=1)
        with connect("ws://127.0.0.1:47865", subprotocols=["foxglove.sdk.v1"], max_size=None) as live:
            began = time.time()
            while time.time() - began < 5:
                message = live.recv(timeout=5)
                if isinstance(message, str):
                    received = json.loads(message)
                    if received["op"] == "advertise":
                        wanted = [{"id": channel["id"], "channelId": channel["id"]} for channel in received["channels"]]
                        topics.update({channel["id"]: channel["topic"] for channel in received["channels"]})
                        live.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
                        idle.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
                elif message[0] == 1:
                    topic = topics[struct.unpack_from("<I", message, 1)[0]]
                    counts[topic] = counts.get(topic, 0) + 1
    finally:
        [code] = end(run)
    summary = json.loads((OUT / "viewers.json").read_text())
    rate = (summary["frames"] - 1) / summary["wall_s"]
    late = sum(facet["late"] for facet in summary["facets"])
    print(f"viewers: in 5 s one viewer got {counts}, another read nothing; {rate:.1f} frames a second, {late} late, exit code {code}", flush=True)
    return code == 0 and counts.get("/scene", 0) >= 1 and counts.get("/tf", 0) > 30


TRIALS = [frames, rates, processes, bowling, kills, drawn_kills, cold_kills, freezes, launchers, servers, soak, everywhere, minute, cuts, namespace, viewers]
SHORT = [frames, kills, freezes, launchers, servers, everywhere, minute, cuts]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--long", action="store_true", help="the full numbers, and all trials")
    parser.add_argument("--frames", type=int, help="frames of `frames` and `namespace` (30; long 600)")
    parser.add_argument("--rates", type=int, help="frames of each run of `rates` and `processes` (20; long 60)")
    parser.add_argument("--kills", type=int, help="kills and freezes of each kind (2; long 20)")
    parser.add_argument("--soak", type=int, help="frames of `soak` (6,000; long 108,000)")
    parser.add_argument("--everywhere", type=int, help="frames of `everywhere` (300; long 108,000)")
    parser.add_argument("--bodies", type=int, help="bodies of `everywhere`, rounded up to a square of stacks of four (256; long 10,000)")
    parser.add_argument("--minutes", type=float, default=1e9, help="wall time after which `everywhere` ends with the frames that it has (none)")
    parser.add_argument("--minute", type=int, help="frames of `minute` (120; long 3,600)")
    parser.add_argument("--cuts", type=int, help="cuts, at most (100; long all)")
    parser.add_argument("--scene", default="pendulum", help="scene of `soak`")
    parser.add_argument("--quality", default="fastest")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--load", type=int, default=0, help="busy processes per core beside the trials (0)")
    parser.add_argument("trials", nargs="*", help=", ".join(trial.__name__ for trial in TRIALS))
    options = parser.parse_args()
    usual = {"frames": (30, 600), "rates": (20, 60), "kills": (2, 20), "soak": (6000, 108000), "everywhere": (300, 108000), "bodies": (256, 10000), "minute": (120, 3600), "cuts": (100, 1 << 30)}
    for name, numbers in usual.items():
        if getattr(options, name) is None:
            setattr(options, name, numbers[options.long])
    named = {trial.__name__: trial for trial in TRIALS}
    unknown = [name for name in options.trials if name not in named]
    if unknown:
        parser.error(f"there is no trial {', '.join(unknown)}; there are {', '.join(named)}")
    trials = [named[name] for name in options.trials] or ([t for t in TRIALS if t not in (namespace, viewers)] if options.long else SHORT)
    shutil.rmtree(OUT, ignore_errors=True)
    OUT.mkdir(parents=True)
    load = Load(options.load)
    try:
        shown = [trial(options) for trial in trials]
    finally:
        load.end()
    sys.exit(0 if all(shown) else 1)


if __name__ == "__main__":
    main()
