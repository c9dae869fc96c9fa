#!/usr/bin/env python3
"""Attacks on `tumble cave`: what a careless or hostile neighbor may do to a run, and whether it is unharmed.

usage: scripts/cave_attacks.py [--times N] [ATTACK ...]

Without names all run that this machine allows: twins, full_disk (root), long_freeze, clock (a C compiler), killed_in_recording, tokens, reloads, many_facets.
Ends with 1 if a run is harmed. Nothing is left behind but out/cave_attacks.
"""

import argparse
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
os.environ.setdefault("OUT", str(ROOT / "out/cave_attacks"))
sys.path.insert(0, str(ROOT / "scripts"))
from cave_trial import FACETS, OUT, TUMBLE, alive, end, facets_of, last_line, log, same_states, shown_after, small_cave, start, tumble, wait_for  # noqa: E402

CALM = "ready_timeout_ms = 1000\ndrop_timeout_ms = 5000\nconnect_timeout_ms = 60000"


def begun(folder):
    wait_for(lambda: all((last_line(folder, facet) or {"frame": 0})["frame"] > 20 for facet in FACETS))


def wrong(summary):
    return sum(facet[key] for facet in summary["facets"] for key in ["torn", "mismatched", "refused"])


def twins(options):
    """Two runs of one cave file begin at the same moment: one of them goes on, the other one is refused and says which one runs."""
    cave, fine, said = small_cave("twins", sync=CALM), 0, set()
    for k in range(options.times):
        command = [TUMBLE, "cave", "billiards", "--cave", cave, "--no-pictures", "--duration", "1", "--no-realtime", "--quiet", "--log-dir"]
        runs = [subprocess.Popen([*map(str, command), str(OUT / f"twins_{k}_{side}")], stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True) for side in "ab"]
        ends = [(run.communicate(timeout=120)[1], run.returncode) for run in runs]
        codes = sorted(code for _, code in ends)
        refused = [text for text, code in ends if code != 0]
        named = all("process" in text or "pid" in text for text in refused)
        # the second one may also begin after the first has ended
        fine += codes in ([0, 1], [0, 0]) and named
        said.update(line for text in refused for line in text.splitlines()[:1])
        for side in "ab":
            shutil.rmtree(OUT / f"twins_{k}_{side}", ignore_errors=True)
    print(f"twins: {options.times} times two runs at once, {fine} times one was shown and the other one, if it met it, refused by name; for example: {min(said, default='never met')}", flush=True)
    return fine == options.times


def full_disk(options):
    """The disk becomes full in the middle, for the recording, the frames, the logs and the summary: the run goes on to its end, and says what is missing."""
    if os.geteuid() != 0:
        sys.exit("error: full_disk: needs root, to mount a small disk")
    disk, harmed = OUT / "disk", []
    disk.mkdir()
    cave = small_cave("full_disk", sync=CALM)
    for what in ["recording", "logs", "pictures", "summary"]:
        subprocess.run(["mount", "-t", "tmpfs", "-o", "size=256k", "tmpfs", disk], check=True)
        try:
            picture = ["--offscreen", "--quality", "fastest", "--frames-dir", disk / "frames"] if what == "pictures" else ["--no-pictures"]
            other = {"recording": ["--record", disk / "run.mcap"], "logs": ["--log-dir", disk / "logs"], "summary": ["--summary", disk / "summary.json"]}.get(what, [])
            if what == "summary":
                (disk / "filler").write_bytes(b"0" * 256 * 1024)
            command = [TUMBLE, "cave", "billiards", "--cave", cave, "--duration", "20", "--no-realtime", "--quiet", "--connect-timeout", "60", *picture, *other]
            done = subprocess.run([*map(str, command)], capture_output=True, text=True, timeout=300)
            text = done.stderr + done.stdout
            recovered = True
            if what == "recording":
                # what is there can be read
                mended = OUT / "mended.mcap"
                found = subprocess.run([TUMBLE, "recover", disk / "run.mcap", "-o", mended], capture_output=True, text=True)
                recovered = re.search(r"(\d+) frames in", found.stdout) is not None
            if done.returncode != 1 or "No space" not in text and "space" not in text or not recovered or "panicked" in text:
                harmed.append((what, done.returncode, recovered, text[-600:]))
        finally:
            subprocess.run(["umount", disk], check=True)
    print(f"full_disk: recording, logs, pictures and summary on a disk of 256 kB: {'each named, exit code 1, the recording readable' if not harmed else harmed}", flush=True)
    return not harmed


def long_freeze(options):
    """A facet stands still for 20 s (SIGSTOP): it is dropped, the others stall once, and it is in step again within a second after it goes on."""
    folder = OUT / "long_freeze"
    cave = small_cave("long_freeze", sync="ready_timeout_ms = 200\ndrop_timeout_ms = 2000\nconnect_timeout_ms = 60000")
    run = start("cave", "billiards", "--cave", cave, "--no-pictures", "--log-dir", folder, "--quiet", "--summary", OUT / "long_freeze.json")
    try:
        begun(folder)
        pid = facets_of(run.pid)["left"]
        os.kill(pid, signal.SIGSTOP)
        stopped, shown = time.time(), last_line(folder, "front")["frame"]
        time.sleep(20)
        others = last_line(folder, "front")["frame"] - shown
        os.kill(pid, signal.SIGCONT)
        went_on = time.time()
        back = shown_after(folder, "left", went_on + 0.02) - went_on
        time.sleep(1)
    finally:
        [code] = end(run)
    summary = json.loads((OUT / "long_freeze.json").read_text())
    dropped = {facet["name"]: facet["dropped"] for facet in summary["facets"]}
    front = [line["shown_unix_us"] * 1e-6 for line in log(folder, "front")]
    still = max(b - a for a, b in zip(front, front[1:]) if stopped - 0.5 < a < went_on)
    fine = same_states(folder) and wrong(summary) == 0 and code == 0 and dropped == {"front": 0, "left": 1, "right": 0, "floor": 0} and back < 1
    print(f"long_freeze: the others showed {others} frames meanwhile and stood still for {still * 1e3:.0f} ms once; back after {back * 1e3:.0f} ms; dropped {dropped}, exit code {code}", flush=True)
    return fine


SHIM = r"""
#define _GNU_SOURCE
#include <dlfcn.h>
#include <time.h>
#include <sys/time.h>
#include <unistd.h>
#include <sys/syscall.h>
/* the wall clock goes back by an hour, again and again */
static long back(void) {
    struct timespec now;
    syscall(SYS_clock_gettime, CLOCK_MONOTONIC, &now);
    return now.tv_sec % 2 ? 3600 : 0;
}
int clock_gettime(clockid_t id, struct timespec *out) {
    int done = syscall(SYS_clock_gettime, id, out);
    if (id == CLOCK_REALTIME) out->tv_sec -= back();
    return done;
}
int gettimeofday(struct timeval *out, void *zone) {
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    out->tv_sec = now.tv_sec; out->tv_usec = now.tv_nsec / 1000;
    return 0;
}
time_t time(time_t *out) {
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    if (out) *out = now.tv_sec;
    return now.tv_sec;
}
"""


def clock(options):
    """The wall clock of all processes is set back by an hour and forward again every second: frames, barrier and states do not notice."""
    compiler = shutil.which("cc")
    if not compiler:
        sys.exit("error: clock: needs a C compiler")
    shim, source = OUT / "clock.so", OUT / "clock.c"
    source.write_text(SHIM)
    subprocess.run([compiler, "-shared", "-fPIC", "-O", "-o", shim, source, "-ldl"], check=True)
    harmed = []
    for transport in ["shared_memory", "udp"]:
        folder = OUT / f"clock_{transport}"
        cave = small_cave(f"clock_{transport}", sync=f'transport = "{transport}"\n{CALM}')
        run = start("cave", "billiards", "--cave", cave, "--no-pictures", "--log-dir", folder, "--quiet", "--record", OUT / "clock.mcap", "--duration", "8",
                    "--summary", OUT / "clock.json", env={**os.environ, "LD_PRELOAD": str(shim)})
        code = run.wait(timeout=120)
        summary = json.loads((OUT / "clock.json").read_text())
        shown = [line["shown_unix_us"] for line in log(folder, "front")]
        turned = sum(b < a for a, b in zip(shown, shown[1:]))
        # in real time 8 s are shown in 8 s, or the run says how much it is behind
        fine = code == 0 and same_states(folder) and wrong(summary) == 0 and turned >= 2 and sum(facet["dropped"] for facet in summary["facets"]) == 0 and summary["wall_s"] < 12 + summary["behind_s"]
        if not fine:
            harmed.append((transport, code, turned, summary["wall_s"], summary["behind_s"]))
        (OUT / "clock.mcap").unlink()
    print(f"clock: set back by an hour every other second, over shared memory and UDP: {'unharmed' if not harmed else harmed}", flush=True)
    return not harmed


def killed_in_recording(options):
    """A facet is killed with kill -9 while the run is recorded and pictures are written: the recording is whole, no picture is half, and it is shown again bit by bit."""
    folder, file = OUT / "killed", OUT / "killed.mcap"
    cave = small_cave("killed", sync=CALM)
    run = start("cave", "billiards", "--cave", cave, "--offscreen", "--quality", "fastest", "--frames-dir", folder, "--restart", "--record", file, "--quiet", "--summary", OUT / "killed.json",
                "--duration", "6", "--no-realtime", "--connect-timeout", "120")
    begun(folder)
    for victim in ["left", "floor"]:
        os.kill(facets_of(run.pid)[victim], signal.SIGKILL)
        time.sleep(0.7)
    code = run.wait(timeout=600)
    summary = json.loads((OUT / "killed.json").read_text())
    half = [picture for picture in folder.rglob("*.png") if not picture.read_bytes().endswith(b"IEND\xaeB`\x82")]
    again = OUT / "killed_again.json"
    tumble("replay", file, "billiards", "--cave", cave, "--no-realtime", "--offscreen", "--quality", "fastest", "--quiet", "--connect-timeout", "120", "--summary", again)
    replay = json.loads(again.read_text())["replay"]
    fine = code == 0 and not half and wrong(summary) == 0 and same_states(folder) and replay["different"] == 0 and replay["same"] > 0
    print(f"killed_in_recording: exit code {code}, {summary['frames']} frames, {len(half)} half pictures, shown again: {replay}", flush=True)
    return fine


def http(at, text):
    try:
        with socket.create_connection(at, timeout=10) as stream:
            stream.sendall(text.encode())
            return stream.recv(65536).decode(errors="replace")
    except OSError as error:
        return f"failed: {error}"


def tokens(options):
    """The console gets 10,000 wrong tokens, by eight clients at once: none is let in, the right one still is, memory and threads stay, and no frame is late."""
    folder, at, token = OUT / "tokens", ("127.0.0.1", 47953), "a-right-token-of-this-run"
    (OUT / "token").write_text(token)
    (OUT / "token").chmod(0o600)
    run = start("cave", "billiards", "--cave", small_cave("tokens", sync=CALM), "--no-pictures", "--log-dir", folder, "--quiet", "--console", f"{at[0]}:{at[1]}", "--console-token", OUT / "token",
                "--summary", OUT / "tokens.json")
    counts = {}
    try:
        begun(folder)
        read = lambda word: int(re.search(word + r":\s+(\d+)", Path(f"/proc/{run.pid}/status").read_text())[1])
        before = read("VmRSS"), read("Threads")

        def guess(first):
            for k in range(first, 10000, 8):
                wrong_token = token[:-1] + chr(33 + k % 60) if k % 60 != ord("n") - 33 else token + "x"
                answer = http(at, f"POST /api/stop HTTP/1.1\r\nHost: {at[0]}:{at[1]}\r\nAuthorization: Bearer {wrong_token}\r\n\r\n")
                counts[answer[9:12]] = counts.get(answer[9:12], 0) + 1

        guessing = [threading.Thread(target=guess, args=(k,)) for k in range(8)]
        began = time.time()
        [thread.start() for thread in guessing]
        [thread.join() for thread in guessing]
        took, after = time.time() - began, (read("VmRSS"), read("Threads"))
        right = http(at, f"GET /api/status HTTP/1.1\r\nHost: {at[0]}:{at[1]}\r\nAuthorization: Bearer {token}\r\n\r\n")[9:12]
        going = run.poll() is None
    finally:
        [code] = end(run)
    summary = json.loads((OUT / "tokens.json").read_text())
    late = sum(facet["late"] for facet in summary["facets"])
    grown = (after[0] - before[0]) / 1024
    fine = set(counts) == {"401"} and right == "200" and going and code == 0 and grown < 4 and after[1] <= before[1] + 16 and wrong(summary) == 0
    print(f"tokens: 10,000 wrong ones in {took:.0f} s: answers {counts}, then the right one {right}; memory grew by {grown:.1f} MiB, threads {before[1]} to {after[1]}, {late} late", flush=True)
    return fine


def reloads(options):
    """A page of a facet is loaded again 100 times, and its connection begun and cut: it is served each time, memory and threads stay, and the other facets miss nothing."""
    folder, port, key = OUT / "reloads", 47954, "k" * 32
    (OUT / "webkey").write_text(key)
    (OUT / "webkey").chmod(0o600)
    run = start("cave", "billiards", "--cave", small_cave("reloads", sync=CALM), "--quality", "fastest", "--log-dir", folder, "--quiet", "--web", f"127.0.0.1:{port}", "--web-facets", "left", "--web-key", OUT / "webkey",
                "--offscreen", "--connect-timeout", "120", "--summary", OUT / "reloads.json")
    pages = upgraded = 0
    try:
        begun(folder)
        pid = facets_of(run.pid)["left"]
        read = lambda word: int(re.search(word + r":\s+(\d+)", Path(f"/proc/{pid}/status").read_text())[1])
        for k in range(100):
            if k == 20:
                before = read("VmRSS"), read("Threads")
            pages += http(("127.0.0.1", port), f"GET /{key}/ HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n").startswith("HTTP/1.1 200")
            with socket.create_connection(("127.0.0.1", port), timeout=10) as stream:
                stream.sendall(f"GET /{key}/socket HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nOrigin: http://127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                               f"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n".encode())
                upgraded += stream.recv(4096).startswith(b"HTTP/1.1 101")
        wait_for(lambda: read("Threads") <= before[1] + 2, 40)
        after = read("VmRSS"), read("Threads")
        alive_still = alive(pid)
    finally:
        [code] = end(run)
    summary = json.loads((OUT / "reloads.json").read_text())
    grown = (after[0] - before[0]) / 1024
    fine = pages == upgraded == 100 and alive_still and code == 0 and grown < 16 and same_states(folder) and wrong(summary) == 0 and sum(facet["dropped"] for facet in summary["facets"]) == 0
    print(f"reloads: the page came {pages} times of 100, the link was taken {upgraded} times and cut; memory of the facet grew by {grown:.1f} MiB, threads {before[1]} to {after[1]}, exit code {code}", flush=True)
    return fine


def many_facets(options):
    """A cave of 64 facets: with a process each without pictures, and with all in one process with small pictures. All frames are on all facets, with the same states."""
    harmed, said = [], []
    facets = "".join(f'[[screen]]\nname = "s{k}"\nlower_left_m = [{k % 8 - 4}, 2, {k // 8 * 0.5}]\nlower_right_m = [{k % 8 - 3}, 2, {k // 8 * 0.5}]\nupper_left_m = [{k % 8 - 4}, 2, {k // 8 * 0.5 + 0.5}]\n'
                     f'[[facet]]\nname = "f{k}"\nscreen = "s{k}"\nsize_px = [64, 32]\n' for k in range(64))
    cave = OUT / "many.toml"
    cave.write_text(f'[[user]]\nname = "u"\neye_m = [0, 0, 1.7]\n{facets}[sync]\nready_timeout_ms = 60000\ndrop_timeout_ms = 60000\nconnect_timeout_ms = 300000\n')
    for name, more, frames in [("processes", ["--no-pictures"], 60), ("one_process", ["--one-process", "--offscreen", "--quality", "fastest"], 10)]:
        folder, began = OUT / f"many_{name}", time.time()
        tumble("cave", "billiards", "--cave", cave, "--no-realtime", "--duration", frames / 60, "--log-dir", folder, "--quiet", "--summary", OUT / "many.json", *more, timeout=900)
        logs = [[(line["frame"], line["state"]) for line in log(folder, f"f{k}")] for k in range(64)]
        summary = json.loads((OUT / "many.json").read_text())
        faults = wrong(summary) + sum(facet[key] for facet in summary["facets"] for key in ["late", "missing", "dropped"])
        said.append(f"{name} {summary['barrier']['p50_ms']:.0f} ms at the barrier, {time.time() - began:.0f} s in all")
        if any(lines != logs[0] for lines in logs) or len(logs[0]) != frames + 1 or faults:
            harmed.append((name, faults, [len(lines) for lines in logs]))
    print(f"many_facets: 64 facets on {os.cpu_count()} cores ({'; '.join(said)}): {'all frames on all, the same states' if not harmed else harmed}", flush=True)
    return not harmed


ATTACKS = [twins, full_disk, long_freeze, clock, killed_in_recording, tokens, reloads, many_facets]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--times", type=int, default=10, help="pairs of `twins`")
    parser.add_argument("attacks", nargs="*", help=", ".join(attack.__name__ for attack in ATTACKS))
    options = parser.parse_args()
    named = {attack.__name__: attack for attack in ATTACKS}
    unknown = [name for name in options.attacks if name not in named]
    if unknown:
        parser.error(f"there is no attack {', '.join(unknown)}; there are {', '.join(named)}")
    possible = lambda attack: not (attack is full_disk and os.geteuid() != 0 or attack is clock and not shutil.which("cc"))
    attacks = [named[name] for name in options.attacks] or [attack for attack in ATTACKS if possible(attack)]
    shutil.rmtree(OUT, ignore_errors=True)
    OUT.mkdir(parents=True)
    shown = [attack(options) for attack in attacks]
    sys.exit(0 if all(shown) else 1)


if __name__ == "__main__":
    main()
