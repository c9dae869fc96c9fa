#!/usr/bin/env python3
"""Checks a wheel of which the installed package was made: `scripts/wheel.sh` calls it.

Its tag, its metadata, its licenses and its list of hashes are those of a wheel to hand on, no file holds a path of this machine, and the package runs.
"""

import base64
import hashlib
import sys
import zipfile
from email.parser import Parser
from pathlib import Path

import tumble


def problems(wheel: Path) -> list[str]:
    """What is wrong with it, a sentence each."""
    found = []
    with zipfile.ZipFile(wheel) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    info = next(name.split("/")[0] for name in files if ".dist-info/" in name)
    metadata = Parser().parsestr(files[f"{info}/METADATA"].decode())
    tags = Parser().parsestr(files[f"{info}/WHEEL"].decode()).get_all("Tag") or []
    if not tags or not all("-abi3-manylinux_" in tag for tag in tags):
        found.append(f"its tags are {tags}; expected abi3 and manylinux")
    for license in metadata.get_all("License-File") or ["LICENSE-MIT"]:
        if f"{info}/licenses/{license}" not in files:
            found.append(f"{license} is not in it")
    if len(metadata.get_all("Classifier") or []) < 5:
        found.append("its metadata has no classifiers")
    for line in files[f"{info}/RECORD"].decode().splitlines():
        name, hashed, size = line.rsplit(",", 2)
        digest = base64.urlsafe_b64encode(hashlib.sha256(files[name]).digest()).rstrip(b"=").decode()
        if hashed and (hashed != f"sha256={digest}" or int(size) != len(files[name])):
            found.append(f"RECORD has another hash of {name}")
    for folder in [Path.home() / ".cargo", Path(__file__).resolve().parents[1]]:
        found += [f"{name} holds the path {folder}" for name, data in files.items() if str(folder).encode() in data]
    return found


def runs() -> bool:
    """Whether a ball falls as it should."""
    world = tumble.World()
    ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=1.0)
    world.step(240)
    return abs(float(ball.position[2]) + 0.5 * 9.81) < 1e-6


if __name__ == "__main__":
    wrong = problems(Path(sys.argv[1])) + ([] if runs() else ["a ball does not fall by g t²/2"])
    for sentence in wrong:
        print(f"error: {sys.argv[1]}: {sentence}", file=sys.stderr)
    sys.exit(bool(wrong))
