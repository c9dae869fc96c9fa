"""The table of docs/programs.md: sixteen programs with tumble and with MuJoCo, how long each is and how far off.

    make references                                                           # installs MuJoCo once
    scripts/test_python.sh crates/py/tests/test_package.py                    # installs tumble beside it
    target/py-tests/bin/python benches/python/programs/lengths.py [NAME ...]

Those of tumble are in examples/, those of MuJoCo in this folder. Counted is code: no description, comments and blank lines. A line of more than 120 columns counts as two. Tokens are those of
Python 3.11, where an f-string is one.
"""

import ast
import contextlib
import io
import os
import runpy
import sys
import tempfile
import tokenize
from pathlib import Path
from typing import NamedTuple

import numpy as np

HERE = Path(__file__).resolve().parent
EXAMPLES = HERE.parents[2] / "examples"
COLUMNS, G = 120, 9.81
LAYOUT = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}


class Length(NamedTuple):
    """How long a program is."""

    lines: int
    tokens: int
    characters: int  # of the tokens


def length(source: str) -> Length:
    """The length of the code of a program."""
    tree = ast.parse(source)
    first = tree.body[1].lineno if ast.get_docstring(tree) else 1
    tokens = [t for t in tokenize.generate_tokens(io.StringIO(source).readline) if t.type not in LAYOUT and t.start[0] >= first]
    ends = {}  # the column at which the code of each line ends
    for token in tokens:
        for row, text in enumerate(token.string.splitlines(), token.start[0]):
            ends[row] = max(ends.get(row, 0), (token.start[1] if row == token.start[0] else 0) + len(text))
    return Length(sum(max(1, -(-end // COLUMNS)) for end in ends.values()), len(tokens), sum(len(t.string) for t in tokens))


def program(name: str, peer: bool) -> Path:
    return HERE / f"{name}_mujoco.py" if peer else EXAMPLES / f"{name}.py"


def run(name: str, peer: bool, *words: str) -> dict:
    """Runs a program in a folder of its own, without its output, and gives its names."""
    kept, folder = sys.argv, os.getcwd()
    try:
        with tempfile.TemporaryDirectory() as own, contextlib.redirect_stdout(io.StringIO()):
            os.chdir(own)
            sys.argv = [name, *words]
            return runpy.run_path(str(program(name, peer)), run_name="__main__")
    finally:
        sys.argv = kept
        os.chdir(folder)
        if "mujoco" in sys.modules:  # a force of one program is there for all others
            sys.modules["mujoco"].set_mjcb_passive(None)


def of_stack(names: dict) -> float:
    return np.abs(np.array(names["loads"]) / (10 * G * np.arange(5, 0, -1)) - 1).max()


def of_four_bar(names: dict) -> float:
    a, b = 1.0, np.cos(np.radians(20))  # a pendulum of 0.375 m, let go at 40 degrees: the mean of Gauss
    for _ in range(6):
        a, b = (a + b) / 2, np.sqrt(a * b)
    return abs(np.diff(names["crossings"]).mean() / (2 * np.pi * np.sqrt(0.375 / G) / a) - 1)


def of_arm(names: dict) -> float:
    return np.abs(names["KP"] * names["sag"] - names["load"]).max()


def of_feet(names: dict) -> float:
    return abs(sum(names["forces"].values()) / (14 * G) - 1)


def cart(names: dict) -> tuple:
    """Position and velocity of the cart."""
    return (names["cart"].q[0], names["cart"].qd[0]) if "cart" in names else (names["data"].qpos[0], names["data"].qvel[0])


def of_search(names: dict) -> float:
    held = np.array([0.1 * (0.95 - 0.1 * np.arange(10)), np.full(10, 0.1)])  # what pushes of 0.1 s each do to 1 kg
    return np.abs(cart(names) - held @ names["mean"]).max()


def of_fork(names: dict) -> float:
    return np.abs(np.subtract(cart(names), (1, 0))).max()


def of_bounce(names: dict) -> float:
    """After about two seconds, of a ball that falls by 1 m and rises with 0.8 of its speed."""
    time, height = (names["world"].time, names["ball"].position[2]) if "world" in names else (names["data"].time, names["data"].qpos[2])
    fall, speed = np.sqrt(2 / G), np.sqrt(2 * G)
    time -= fall
    while True:
        speed *= 0.8
        if time < 2 * speed / G:
            return abs(0.1 + speed * time - G * time**2 / 2 - height)
        time -= 2 * speed / G


def of_gate(names: dict) -> float:
    fall = {"ball": 4 - 2.11, "ghost": 5 - 2.11}
    assert names["passed"].keys() == fall.keys()
    times = [names["passed"][name] - np.sqrt(2 * height / G) for name, height in fall.items()]
    return np.abs([*times, names["blows"][0][0] - np.sqrt(2 * 3.4 / G)]).max()


def largest(key: str):
    return lambda names: np.abs(names[key]).max()


# What is wrong, in which unit, and how it is found among the names of either program.
ERRORS = {
    "falling_stack": ("loads, of the weights", of_stack),
    "double_pendulum": ("modes, rad", largest("errors")),
    "four_bar": ("period, of itself", of_four_bar),
    "arm_pd": ("torques at rest, N·m", of_arm),
    "quadruped": ("forces at the feet, of the weight", of_feet),
    "lidar": ("distances, m", largest("error")),
    "random_search": ("end of the cart, m and m/s", of_search),
    "domain_randomization": ("stopping distances, of themselves", largest("errors")),
    "record_and_replay": ("heights, m", largest("error")),
    "notebook_animation": ("height after 2 s, m", of_bounce),
    "vector_environment": ("fallen, of all", lambda names: 1 - names["upright"].mean()),
    "custom_force": ("positions, m", largest("error")),
    "fork_control": ("end of the cart, m and m/s", of_fork),
    "dumbbell": ("angular velocities, rad/s", largest("errors")),
    "filters_and_triggers": ("times, s", of_gate),
    "terrain": ("way, of itself", lambda names: abs(names["slid"][-1] / names["expected"][-1] - 1)),
}


def main() -> None:
    print("| program | lines: tumble, MuJoCo | tokens | characters | error of | tumble | MuJoCo |\n|---|---|---|---|---|---|---|")
    for name in sys.argv[1:] or ERRORS:
        what, error = ERRORS[name]
        ours, theirs = (length(program(name, peer).read_text()) for peer in (False, True))
        off = [f"{error(run(name, peer)):.1e}" for peer in (False, True)]
        both = [f"{a}, {b}" for a, b in zip(ours, theirs, strict=True)]
        print(f"| [{name}](../examples/{name}.py) | [{both[0]}](../benches/python/programs/{name}_mujoco.py) | {both[1]} | {both[2]} | {what} | {off[0]} | {off[1]} |")


if __name__ == "__main__":
    if sys.platform == "linux" and "DISPLAY" not in os.environ:
        os.environ.setdefault("MUJOCO_GL", "egl")
    main()
