"""`scripts/migrate_0_1.py`: files of version 0.1 mean after it what the shipped ones mean."""

import hashlib
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import tumble

OLD = Path(__file__).resolve().parents[3] / "tests" / "migrate"
SCENES = sorted(path.stem.removeprefix("scene_") for path in OLD.glob("scene_*.toml"))
CAVES = sorted(path.stem.removeprefix("cave_") for path in OLD.glob("cave_*.toml"))


@pytest.fixture
def migrate(root):
    """Runs the script."""
    return lambda *words: subprocess.run([sys.executable, root / "scripts" / "migrate_0_1.py", *words], capture_output=True, text=True, timeout=60)


@pytest.fixture
def old_scene(root, tmp_path):
    """A folder with a scene of 0.1 and the other files of that scene."""

    def copied(name):
        folder = tmp_path / name
        shutil.copytree(root / "scenes" / name, folder, ignore=shutil.ignore_patterns("scene.toml", "*.png", "*.md"))
        shutil.copy(OLD / f"scene_{name}.toml", folder / "scene.toml")
        return folder / "scene.toml"

    return copied


def state_after(world, seconds):
    world.step(round(seconds / world.dt))
    return hashlib.blake2b(world.save()).hexdigest()


def test_there_are_all_scenes_and_caves():
    assert len(SCENES) == 10 and len(CAVES) == 5


@pytest.mark.parametrize("name", SCENES)
def test_an_old_scene_means_what_the_shipped_one_means(name, migrate, old_scene):
    scene = old_scene(name)
    with pytest.raises(tumble.SceneError, match="unknown key `seconds` in .world.; this is now `duration_s`"):
        tumble.World.load(scene)
    before = scene.read_bytes()
    assert migrate("--check", scene).returncode == 1 and scene.read_bytes() == before
    done = migrate(scene)
    assert done.returncode == 0, done.stderr
    assert f"{scene}:" in done.stdout and "seconds -> duration_s" in done.stdout
    assert migrate("--check", scene).returncode == 0

    old, shipped = tumble.World.load(scene), tumble.World.load(name)
    assert old.bodies.names() == shipped.bodies.names() and len(old.notes) == len(shipped.notes)
    assert state_after(old, 1.0) == state_after(shipped, 1.0)


@pytest.mark.parametrize("name", SCENES)
def test_the_command_finds_nothing_wrong_with_a_migrated_scene(name, migrate, old_scene, command):
    scene = old_scene(name)
    assert subprocess.run([command, "check", scene], capture_output=True, timeout=60).returncode != 0
    migrate(scene)
    done = subprocess.run([command, "check", scene], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("name", CAVES)
def test_an_old_cave_is_one_still(name, migrate, root, tmp_path):
    """No key of a cave has another name now: all that matters is that the script leaves it alone."""
    cave = shutil.copy(OLD / f"cave_{name}.toml", tmp_path / "cave.toml")
    done = migrate(cave)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert Path(cave).read_bytes() == (OLD / f"cave_{name}.toml").read_bytes()
    facet = next(line.split('"')[1] for line in (root / "caves" / f"{name}.toml").read_text().split("[[facet]]")[1].splitlines() if line.startswith("name"))
    try:
        picture = tumble.World.load("stack").render(facet=f"{cave}:{facet}")
    except tumble.PictureError:
        pytest.skip("SKIPPED: no graphics adapter")
    assert (picture == tumble.World.load("stack").render(facet=f"{name}:{facet}")).all()


@pytest.mark.parametrize("name", ["four_bar", "boids"])
def test_an_old_program_runs(name, migrate, tmp_path):
    program = shutil.copy(OLD / f"{name}.py", tmp_path)
    run = lambda: subprocess.run([sys.executable, program], capture_output=True, text=True, timeout=120, cwd=tmp_path)
    before = run()
    assert before.returncode != 0 and ("this is now `loop_joint`" in before.stderr or "Behaviour" in before.stderr)
    assert migrate(program).returncode == 0
    after = run()
    assert after.returncode == 0, after.stderr


OLD_PROGRAM = '''import tumble

world.plot_energy(seconds=0.5)  # view.push(…), seconds=0.5
view.push(1, (0, 0, 1), (0, 0, 0)); rows.push(1)
arm.set_drive("elbow",  # a drive
              velocity=5.0, limit=100.0)
body.alive, said = False, "alive, limit=1"
np.build(error=1, branch=2), tumble.SphereTree.build(mesh, branch=8, error=1e-3).depth
SCENE = """
[[articulated]]
name = "start"
start = { start = 1 }  # start = 2
[[articulated.link]]
drive = { type = "velocity", limit_n = 3 }
"""
'''
NEW_PROGRAM = '''import tumble

world.plot_energy(duration=0.5)  # view.push(…), seconds=0.5
view.apply_force(1, (0, 0, 1), (0, 0, 0)); rows.push(1)
arm.set_drive("elbow",  # a drive
              velocity=5.0, max_force=100.0)
body.enabled, said = False, "alive, limit=1"
np.build(error=1, branch=2), tumble.SphereTree.build(mesh, branching=8, max_error=1e-3).depth
SCENE = """
[[articulated]]
name = "start"
initial_positions = { start = 1 }  # start = 2
[[articulated.link]]
drive = { type = "velocity", max_force_n = 3 }
"""
'''


def test_only_names_change(migrate, tmp_path):
    program, other = tmp_path / "program.py", tmp_path / "other.py"
    program.write_bytes(OLD_PROGRAM.encode())
    other.write_bytes(OLD_PROGRAM.replace("import tumble", "import something").encode())
    assert migrate(tmp_path).returncode == 0
    assert program.read_bytes().decode() == NEW_PROGRAM
    assert other.read_bytes().decode() == OLD_PROGRAM.replace("import tumble", "import something")


def test_a_file_that_is_no_toml_is_left_alone_and_the_others_are_not(migrate, tmp_path):
    (tmp_path / "bad.toml").write_text("[world\nseconds = 1\n")
    (tmp_path / "good.toml").write_text("[world]\nseconds = 1\n")
    done = migrate(tmp_path)
    assert done.returncode == 2 and "bad.toml: left as it is" in done.stderr
    assert (tmp_path / "bad.toml").read_text() == "[world\nseconds = 1\n"
    assert (tmp_path / "good.toml").read_text() == "[world]\nduration_s = 1\n"
    assert migrate().returncode == 2 and migrate("--colour", tmp_path).returncode == 2


@pytest.mark.parametrize("text, said", [
    ('[[closure]]\nname = "a"\n', "1:3: unknown key `closure` in the scene; this is now `loop_joint`"),
    ('[[loop_joint]]\nname = "a"\ntype = "point"\n', '3:8: `type` of loop_joint "a" is "point"; this is now `spherical`'),
    ('[[body]]\nname = "a"\nshape = { type = "half_space" }\nmode = "static"\nalive = false\n', "this is now `enabled`"),
    ('[materials.a]\nquality = "full"\n', "this is now `detail`"),
    ('[meshes.a]\ntype = "box"\nsize_m = [1, 1, 1]\nsphere_tree_error = 0.1\n', "this is now `sphere_tree_max_error`"),
])  # fmt: skip
def test_an_old_name_in_a_scene_is_an_error_with_the_new_one(text, said):
    with pytest.raises(tumble.SceneError) as raised:
        tumble.World.parse(text)
    assert said in str(raised.value)
