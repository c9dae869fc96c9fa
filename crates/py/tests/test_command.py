"""The same run gives the same bytes as the command line."""

import json
import subprocess

import pytest

import tumble


@pytest.mark.parametrize("scene", ["stack", "billiards", "chain", "robot"])
def test_python_and_the_command_end_in_the_same_bytes(command, tmp_path, scene):
    saved, summary = tmp_path / "end.state", tmp_path / "end.json"
    subprocess.run([command, "run", scene, "--duration", "0.5", "--save", saved, "--summary", summary, "--quiet"], check=True, timeout=120)
    world = tumble.World.load(scene)
    world.step(round(0.5 / world.dt))
    assert world.save() == saved.read_bytes()
    end = json.loads(summary.read_text())
    assert end["end"]["kinetic_energy_j"] == world.energy().kinetic
    assert end["stepper"] == world.stepper and end["solver"] == world.solver
    world.step(3)
    world.restore(saved.read_bytes())
    assert world.save() == saved.read_bytes()


def test_a_path_and_a_name_are_the_same_scene(root):
    by_name, by_path = tumble.World.load("stack"), tumble.World.load(root / "scenes" / "stack")
    by_name.step(20)
    by_path.step(20)
    assert by_name.save() == by_path.save()
