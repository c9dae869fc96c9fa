"""The short programs of ``examples/`` against closed forms that they do not compute, or compute in another way."""

import runpy
import sys
from pathlib import Path

import numpy as np
import pytest

import tumble

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
PROGRAMS = (
    "falling_stack double_pendulum four_bar arm_pd quadruped random_search domain_randomization record_and_replay save_restore "
    "heavy_on_light linked_rings lidar dumbbell filters_and_triggers terrain custom_force vector_environment notebook_animation "
    "fork_control"
).split()
G = 9.81


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Runs an example in a folder of its own and gives its names."""
    monkeypatch.chdir(tmp_path)

    def program(name, *words):
        monkeypatch.setattr("sys.argv", [name, *map(str, words)])
        return runpy.run_path(str(EXAMPLES / f"{name}.py"), run_name="__main__")

    return program


def test_the_programs_under_25_lines_are_those_tested_here():
    assert sorted(PROGRAMS) == sorted(script.stem for script in EXAMPLES.glob("*.py") if len(script.read_text().splitlines()) < 25)


def test_each_face_of_a_stack_carries_what_is_above_it(run):
    names = run("falling_stack")
    weights = [10.0 * G * k for k in (5, 4, 3, 2, 1)]
    assert names["loads"] == pytest.approx(weights, rel=1e-6)
    heights = [names["world"][f"crate_{k}"].position[2] for k in range(1, 6)]
    assert heights == pytest.approx([0.25, 0.75, 1.25, 1.75, 2.25], abs=1e-6)


def test_a_double_pendulum_has_its_modes_and_keeps_its_energy(run):
    names = run("double_pendulum")
    # amplitude³/16 bounds what the small-angle form leaves out in 2 s
    assert np.abs(names["errors"]).max() < 1e-8 and len(names["errors"]) == 960
    depth = (np.cos(2.5) + np.cos(2.5) + np.cos(3.5)) * G  # let go at rest: minus the heights of both points
    assert names["energies"] == pytest.approx(np.full(2400, -depth), abs=1e-6)


def test_a_parallelogram_stays_closed_and_has_its_period(run):
    names = run("four_bar")
    assert max(names["gaps"]) < 3e-9
    # a pendulum of length I/(m d) = (2·0.25² + 0.5²)/(2·0.25 + 0.5), let go at 40 degrees: T = 2π√(l/g)/M(1, cos 20°)
    a, b = 1.0, np.cos(np.radians(20))
    for _ in range(6):
        a, b = (a + b) / 2, np.sqrt(a * b)
    assert np.diff(names["crossings"]).mean() == pytest.approx(2 * np.pi * np.sqrt(0.375 / G) / a, rel=1e-6)


PANDA = "cmeel.prefix/share/example-robot-data/robots/panda_description/urdf/panda.urdf"
FOUND = next((Path(folder) / PANDA for folder in sys.path if (Path(folder) / PANDA).is_file()), None)
NO_PANDA = pytest.mark.skipif(FOUND is None, reason="SKIPPED: example-robot-data is not installed; `make references` installs it")


@pytest.mark.parametrize("robot", [pytest.param(None, id="arm"), pytest.param(FOUND, id="panda", marks=NO_PANDA)])
def test_a_robot_rests_where_gains_and_gravity_balance(run, robot):
    names = run("arm_pd", *([robot] if robot else []))
    assert np.abs(names["load"]).max() > 1.0, "gravity pulls at it"
    over = names["KP"] * names["sag"] - names["load"]
    if robot:  # the second finger mimics the first: what is left balances between the two
        over[7:] = over[7:].sum()
    assert over == pytest.approx(np.zeros_like(over), abs=1e-3)
    assert np.abs(names["goal"] - names["arm"].q).max() < 0.1 * np.abs(names["sag"]).max()


def test_the_feet_of_a_quadruped_carry_its_weight(run):
    names = run("quadruped")
    forces = names["forces"]
    assert len(forces) == 4 and min(forces.values()) > 10
    assert sum(forces.values()) == pytest.approx(14.0 * G, rel=1e-6)
    left = [force for foot, force in forces.items() if "left" in foot]
    assert sum(left) == pytest.approx(7.0 * G, rel=1e-6), "it is the same on both sides"


def test_random_search_comes_near_the_best_there_is(run):
    names = run("random_search")
    mean, cart = names["mean"], names["world"]["cart"]
    # held for 0.1 s each, the cheapest pushes that go 1 m and stop: of least norm under two linear conditions
    conditions = np.array([0.1 * (0.95 - 0.1 * np.arange(10)), np.full(10, 0.1)])
    best = np.linalg.lstsq(conditions, np.array([1.0, 0.0]), rcond=None)[0]
    cheapest = (best**2).mean()
    assert cheapest == pytest.approx(12, rel=0.02)
    assert cart.q[0] == pytest.approx(1, abs=0.005) and cart.qd[0] == pytest.approx(0, abs=0.005)
    assert (mean**2).mean() < 1.02 * cheapest
    assert [cart.q[0], cart.qd[0]] == pytest.approx(conditions @ mean, abs=1e-9)


def test_forks_find_the_least_time(run):
    names = run("fork_control")
    # bang-bang: 1 m with 4 N on 1 kg takes 2 √(m d/F) = 1 s, and 50 steps of 0.02 s hit it
    assert names["world"].time == pytest.approx(1.0) and names["cart"].q == pytest.approx([1.0], abs=1e-9)
    assert names["cart"].qd == pytest.approx([0.0], abs=1e-9)


def test_blocks_stop_by_their_friction_whatever_their_mass(run):
    names = run("domain_randomization")
    assert len(names["errors"]) == 200 and np.abs(names["errors"]).max() < 1e-3


def test_a_throw_is_recorded_and_gone_on_with(run):
    names = run("record_and_replay")
    assert names["error"] < 1e-12 and names["same"]
    ball, turning = 0.5 * (3**2 + 5**2), 0.5 * 0.4 * 0.1**2 * 9**2
    assert names["energies"] == pytest.approx([ball + turning] * 61, rel=1e-12)


def test_a_throw_is_shown_as_a_video(run, tmp_path):
    try:
        tumble.World().render(8, 8)
    except tumble.PictureError as error:
        pytest.skip(f"SKIPPED: {error}")
    run("record_and_replay", "throw.mcap", "throw.png")
    assert (tmp_path / "throw.png").read_bytes().count(b"fcTL") == 31, "images of a second at 30 in a second, the first included"


def test_a_snapshot_has_one_future(run, capsys):
    names = run("save_restore")
    lines = capsys.readouterr().out.splitlines()
    assert len(set(lines)) == 1 and len(lines) == 5
    assert lines[0].endswith("True") and names["each"] is not names["world"]


def test_a_heavy_cube_does_not_sink_into_a_light_one(run):
    names = run("heavy_on_light")
    assert abs(names["sinks"]) < 1e-6
    assert abs(names["load"]) == pytest.approx(1000.001 * G, rel=1e-6)


def test_contact_beside_mujoco_is_as_the_readme_says():
    found = runpy.run_path(str(EXAMPLES.parent / "benches" / "python" / "beside_mujoco.py"))["found"]
    way, lift, speed, sunk = found["tumble"]
    assert way == pytest.approx(25 / (2 * 0.5 * G), abs=5e-5)
    assert lift < 1e-7 and abs(speed) < 1e-15 and abs(sunk) < 1e-7
    if len(found) == 1:
        pytest.skip("SKIPPED: MuJoCo is not installed; `make references` installs it")
    assert found["default"] == pytest.approx((2.5385, 0.0389, 1.8e-3, 0.200), rel=0.05)
    assert found["stiff"][:2] == pytest.approx((2.6510, 0.2058), rel=0.05) and found["stiff"][3] == pytest.approx(0.2, rel=0.05)


def test_a_ring_hangs_in_a_ring(run):
    names = run("linked_rings")
    # facets lie within R(1 − cos(π/48)) + r(1 − cos(π/24)) of the torus, on both rings
    facets = 2 * (0.06 * (1 - np.cos(np.pi / 48)) + 0.01 * (1 - np.cos(np.pi / 24)))
    assert -names["lower"].position[2] == pytest.approx(0.08, abs=facets)
    assert names["held"] == pytest.approx(names["lower"].mass * G, rel=1e-3)


def test_every_beam_of_a_lidar_meets_what_is_there(run):
    names = run("lidar")
    assert names["error"] < 1e-9 and names["hits"] == (names["column"] < names["wall"]).sum() > 50


def test_a_dumbbell_precesses_as_euler_says(run):
    names = run("dumbbell")
    assert names["rate"] == pytest.approx((0.02 - 0.36) / 0.36 * 8.0) and len(names["errors"]) == 480
    assert max(names["errors"]) < 1e-6
    # its axis keeps its angle to the angular momentum
    assert names["world"].energy().total == pytest.approx(0.5 * (0.36 * 0.5**2 + 0.02 * 8**2), rel=1e-8)


def test_groups_pairs_and_gates_do_what_they_say(run):
    names = run("filters_and_triggers")
    fall = {"ball": 4 - 2.11, "ghost": 5 - 2.11}  # to the upper face of the gate, by the lower side of the sphere
    assert names["passed"] == pytest.approx({name: np.sqrt(2 * height / G) for name, height in fall.items()}, abs=2e-3), "the shade passes unseen"
    times, impulses = np.transpose(names["blows"])
    assert times[0] == pytest.approx(np.sqrt(2 * 3.4 / G), abs=2e-3)  # onto the crate of 0.5 m
    # 1 kg without rebound; the impact may end in the step after the one in which it begins
    assert impulses[:2].sum() == pytest.approx(np.sqrt(2 * G * 3.4), rel=5e-3)
    assert impulses[-1] == pytest.approx(G * 1e-3, rel=1e-5)  # then its weight, over each step
    assert names["ghost"].position[2] == pytest.approx(0.1, abs=1e-4)  # through the crate, onto the floor
    assert names["shade"].position[2] < -5


def test_a_block_slides_down_a_hill(run):
    names = run("terrain")
    assert names["slid"][-1] == pytest.approx(names["expected"][-1], rel=2e-3)
    assert np.abs(names["above"]).max() < 1e-4


def test_a_force_in_python_makes_damped_oscillations(run):
    names = run("custom_force")
    assert len(names["bodies"]) == 3 and names["error"] < 1e-9


def test_a_thousand_pendulums_stand_up(run):
    names = run("vector_environment")
    assert names["upright"].all() and names["batch"].q.shape == (1000, 1)
    # a world of the batch moves as it would alone
    world, batch = names["world"].fork(), names["batch"]
    batch.reset()
    for _ in range(50):
        batch.step(np.full((1000, 1), 0.7))
    pendulum = world.articulation("pendulum")
    pendulum.tau = [0.7]
    world.step(50)
    assert (batch.q[::333] == pendulum.q).all()


def test_an_animation_is_a_page_and_a_picture(run):
    try:
        tumble.World().render(8, 8)
    except tumble.PictureError as error:
        pytest.skip(f"SKIPPED: {error}")
    names = run("notebook_animation")
    assert names["animation"].size == (240, 180) and len(names["animation"].times) == 31
    heights = names["recording"].position("ball")[:, 2]
    fall = np.arange(0, 1.0, 0.1)
    falling = fall < np.sqrt(2 / G)
    times = names["recording"].times
    assert np.interp(fall[falling], times, heights) == pytest.approx(1.1 - G * fall[falling] ** 2 / 2, abs=2e-3)
    assert Path("bounce.html").read_text().startswith("<!DOCTYPE html>") and Path("bounce.png").stat().st_size > 5000
