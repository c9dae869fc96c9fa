"""Every example runs as a newcomer runs it, in a folder of its own; so does the notebook."""

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
SHORT = {script for script in (ROOT / "examples").glob("*.py") if len(script.read_text().splitlines()) < 25}  # test_programs.py runs those
EXAMPLES = sorted({*(ROOT / "examples").glob("*.py")} - SHORT)
NEEDS = {"cart_pole": "gymnasium", "gym_training": "gymnasium", "ppo_ant": "stable_baselines3"}
WORDS = {  # what must stand in the output, beside what each script asserts itself
    "arm_dynamics": "a batch of accelerations: (1000, 6)",
    "bouncing_ball": "off the closed form",
    "boids": "10 s: order 1.0",
    "cart_pole": "episode 2: 500 steps upright",
    "gym_training": "returns of 500 to 500 in new episodes",
    "pin_lock": "and turns the plug by 1.8",
    "pendulum_energy": "period by theory            2.152875 s",
    "ppo_ant": "Ant after 8192 steps: ",
    "rollout_control": "touched: False",
    "sphere_tree": "level 2: 64 balls",
    "worm_gear": "by theory -0.8378",
    "zipper": "closed: slider at 199 mm, tapes 1.0 mm apart, hooks of 5.0 mm\npulled: slider at 199 mm, tapes 1.0 mm apart",
    "wind_force": "falling at 0.981 m/s",
}


def run(words, folder):
    settings = {**os.environ, "MPLBACKEND": "Agg"}
    done = subprocess.run([sys.executable, *words], cwd=folder, env=settings, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_they_are_listed_and_short():
    listed = (ROOT / "examples" / "README.md").read_text()
    for script in {*EXAMPLES, *SHORT}:
        assert len(script.read_text().splitlines()) <= 60, script.name
        assert f"({script.name})" in listed


@pytest.mark.parametrize("script", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_runs(script, tmp_path):
    if script.stem in NEEDS and importlib.util.find_spec(NEEDS[script.stem]) is None:
        pytest.skip(f"SKIPPED: {NEEDS[script.stem]} is not installed")
    if script.stem == "cave_pictures":
        probe = "import tumble; tumble.World().render(8, 8)"
        if subprocess.run([sys.executable, "-c", probe], capture_output=True, timeout=120).returncode:
            pytest.skip("SKIPPED: no graphics adapter")
    said = run([script], tmp_path)
    assert WORDS.get(script.stem, "") in said and said


def test_a_hopper_learns_to_stay_up(tmp_path):
    pytest.importorskip("gymnasium", reason="SKIPPED: gymnasium is not installed")
    first, *_, last = run([ROOT / "examples" / "gym_training.py", "Hopper", "6", "200"], tmp_path).splitlines()
    untrained, least = float(first.split()[-1]), float(last.split("returns of ")[1].split()[0])
    assert untrained < 70 and least > 2 * untrained


def test_an_example_without_its_package_says_so(tmp_path):
    if importlib.util.find_spec("stable_baselines3") is not None:
        pytest.skip("SKIPPED: stable-baselines3 is installed")
    done = subprocess.run([sys.executable, ROOT / "examples" / "ppo_ant.py"], cwd=tmp_path, capture_output=True, text=True, timeout=100)
    assert done.returncode == 1 and "SKIPPED: stable-baselines3 is not installed" in done.stderr


def test_the_notebook_runs(tmp_path):
    nbclient = pytest.importorskip("nbclient", reason="SKIPPED: nbclient is not installed")
    nbformat = pytest.importorskip("nbformat", reason="SKIPPED: nbformat is not installed")
    pytest.importorskip("ipykernel", reason="SKIPPED: ipykernel is not installed")
    path = ROOT / "examples" / "tour.ipynb"
    notebook = nbformat.read(path, as_version=4)
    # it is kept without outputs, so that a change of it can be read
    kept = json.loads(path.read_text())
    assert all(not cell.get("outputs") and not cell.get("execution_count") for cell in kept["cells"])
    # this interpreter, whatever kernels the machine has
    spec = tmp_path / "kernels" / "python3"
    spec.mkdir(parents=True)
    start = [sys.executable, "-m", "ipykernel_launcher", "-f", "{connection_file}"]
    (spec / "kernel.json").write_text(json.dumps({"argv": start, "display_name": "Python 3", "language": "python"}))
    nbclient.NotebookClient(notebook, timeout=120, startup_timeout=180, kernel_name="python3", resources={"metadata": {"path": str(tmp_path)}}, **client(tmp_path)).execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    assert not [output for output in outputs if output.output_type == "error"]
    shown = [output for output in outputs if "image/png" in output.get("data", {})]
    assert len(shown) >= 2


def client(folder):
    """A kernel manager that knows our kernel alone."""
    from jupyter_client import AsyncKernelManager
    from jupyter_client.kernelspec import KernelSpecManager

    manager = AsyncKernelManager(kernel_name="python3", kernel_spec_manager=KernelSpecManager(kernel_dirs=[str(folder / "kernels")]))
    return {"km": manager}
