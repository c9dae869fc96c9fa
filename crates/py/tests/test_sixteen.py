"""Sixteen programs of ``examples/`` beside the same programs with MuJoCo in ``benches/python/programs/``: none is longer, and those of MuJoCo are right within its accuracy."""

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import tumble

ROOT = Path(__file__).resolve().parents[3]
FOLDER = ROOT / "benches" / "python" / "programs"
_spec = importlib.util.spec_from_file_location("lengths", FOLDER / "lengths.py")
lengths = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(lengths)
PROGRAMS = list(lengths.ERRORS)

# Errors of tumble and of MuJoCo, in the units of docs/programs.md, with room for other versions and processors.
BOUNDS = {
    "falling_stack": (1e-9, 1e-6),
    "double_pendulum": (1e-9, 1e-9),
    "four_bar": (1e-6, 1e-6),
    "arm_pd": (1e-6, 1e-6),
    "quadruped": (1e-9, 1e-6),
    "lidar": (1e-12, 1e-12),
    "random_search": (1e-12, 1e-12),
    "domain_randomization": (1e-3, 6e-3),
    "record_and_replay": (1e-12, 1e-12),
    "notebook_animation": (1e-9, 1e-2),
    "vector_environment": (0, 0),
    "custom_force": (1e-10, 1e-10),
    "fork_control": (1e-12, 1e-12),
    "dumbbell": (1e-10, 1e-10),
    "filters_and_triggers": (1e-3, 3e-3),
    "terrain": (1e-9, 4e-3),
}
DRAWN = {"notebook_animation"}


def test_lengths_are_counted():
    source = '"""A program."""\n\nimport numpy  # for numbers\n\n# a comment\nlong = f"""one {numpy.pi}\ntwo"""\n\n\ndef half(x):\n    return x / 2\n'
    assert lengths.length(source).lines == 5
    assert lengths.length("x = 1  # " + 200 * "-" + "\n") == (1, 3, 3)
    for columns, lines in ((120, 1), (121, 2), (240, 2), (241, 3)):
        assert lengths.length(f"x = {'1' * (columns - 4)}\n").lines == lines
    assert lengths.length("x = 1\ny = 2\n") == lengths.length('"""Two."""\nx = (1)\ny = 2\n')._replace(tokens=6, characters=6)


def test_there_are_sixteen():
    assert len(PROGRAMS) == 16 and set(BOUNDS) == set(PROGRAMS)
    assert sorted(PROGRAMS) == sorted(path.stem.removesuffix("_mujoco") for path in FOLDER.glob("*_mujoco.py"))


@pytest.mark.parametrize("name", PROGRAMS)
def test_it_is_no_longer_than_with_mujoco(name):
    ours, theirs = (lengths.length(lengths.program(name, peer).read_text()) for peer in (False, True))
    print(f"{name}: {ours}, with MuJoCo {theirs}")
    assert ours.lines <= theirs.lines


@pytest.mark.parametrize("name", PROGRAMS)
def test_the_page_has_its_length(name):
    (row,) = re.findall(rf"^\| \[{name}\].*$", (ROOT / "docs" / "programs.md").read_text(), re.M)
    ours, theirs = (lengths.length(lengths.program(name, peer).read_text()) for peer in (False, True))
    cells = [tuple(map(int, re.findall(r"(?<![\w.])(\d+), (\d+)(?![\w.])", cell)[0])) for cell in row.split("|")[2:5]]
    assert cells[0] == (ours.lines, theirs.lines)
    if sys.version_info < (3, 12):  # after that an f-string is several tokens
        assert cells[1:] == [(ours.tokens, theirs.tokens), (ours.characters, theirs.characters)]


@pytest.mark.parametrize("name", PROGRAMS)
def test_it_gives_the_known_answer(name):
    if name in DRAWN:
        try:
            tumble.World().render(8, 8)
        except tumble.PictureError as error:
            pytest.skip(f"SKIPPED: {error}")
    assert lengths.ERRORS[name][1](lengths.run(name, peer=False)) <= BOUNDS[name][0]


@pytest.mark.parametrize("name", PROGRAMS)
def test_the_program_with_mujoco_gives_it_too(name):
    if importlib.util.find_spec("mujoco") is None:
        pytest.skip("SKIPPED: MuJoCo is not installed; `make references` installs it")
    if name not in DRAWN:
        assert lengths.ERRORS[name][1](lengths.run(name, peer=True)) <= BOUNDS[name][1]
        return
    # how MuJoCo draws is chosen when it is imported, so in a process of its own
    for command in (["-c", "import mujoco; mujoco.Renderer(mujoco.MjModel.from_xml_string('<mujoco/>'), 8, 8)"], [str(FOLDER / "lengths.py"), name]):
        settings = {"MUJOCO_GL": "egl", **os.environ} if "DISPLAY" not in os.environ else {**os.environ}
        done = subprocess.run([sys.executable, *command], env=settings, capture_output=True, text=True, timeout=300)
        if command[0] == "-c" and done.returncode:
            pytest.skip(f"SKIPPED: MuJoCo draws no pictures here: {done.stderr.splitlines()[-1]}")
    assert done.returncode == 0, done.stderr
    assert float(done.stdout.splitlines()[-1].split("|")[-2]) <= BOUNDS[name][1]
