"""Every fenced block of the README and of the book: commands run, programs run and print what stands beside them, files are read.

How a page says what comes out:

- a statement of Python that ends in ``# -> TEXT`` prints TEXT, or has it as its ``repr``;
- the lines of an ``output`` block stand, in that order, in what the commands of the block above it print;
- ``…`` in either stands for anything.

Commands that are not run here stand in ``NOT_RUN`` with the reason (`…` again for anything); any other runs. A page's blocks share one folder and one namespace, from its top to its end.
"""

import ast
import contextlib
import io
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import pytest

import tumble

ROOT = Path(__file__).resolve().parents[3]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")), *(ROOT / name / "README.md" for name in ("scenes", "caves", "examples"))]
SLOW = os.environ.get("TUMBLE_SLOW") == "1"

NOT_RUN = {
    "make demo": "builds everything; the tests of the Python module, this one too, run behind it",
    "make test": "runs this test",
    "python3 -m venv .venv && . .venv/bin/activate": "scripts/test_python.sh makes an environment in the same way",
    "pip install .": "scripts/test_python.sh installs the package so, and these tests use it",
    "tumble view …": "opens a window: crates/tumble/tests/it/view_windows.rs and view_sliders.rs",
    "tumble cave bowling --cave cube4": "opens windows: crates/tumble/tests/it/cave_windows.rs",
    "tumble cave billiards --cave cube4": "opens windows: crates/tumble/tests/it/cave_windows.rs",
    "tumble relay --cave my.toml --to 10.0.0.1:47200": "another machine: crates/tumble/tests/it/cave_relay.rs",
    "tumble relay --cave my.toml --to 10.0.0.1:47200 --listen 10.0.1.2:47200 --from 10.0.1.7": "other machines: crates/tumble/tests/it/cave_relay.rs",
    "tumble calibrate …": "a camera: crates/tumble/tests/it/calibrate.rs",
    "tumble check measured/cave.toml": "a camera: crates/tumble/tests/it/calibrate.rs",
    "tumble cave billiards --cave wall3 --web …": "browsers: crates/tumble/tests/it/cave_web.rs",
    "tumble cave billiards --cave cube4 --vrpn …": "a tracker: crates/tumble/src/cave/tracker/vrpn_client.rs",
    "tumble cave billiards --cave cube4 --openxr viewer": "a headset: crates/tumble/tests/it/cave_openxr.rs",
    "tumble console 127.0.0.1:47300 …": "a run beside it: crates/tumble/tests/it/cave_console.rs",
    "rustup target add …": "installs what crates/tumble/tests/it/page.rs needs, where a page can be made",
    "scripts/page.sh": "builds for another target: crates/tumble/tests/it/page.rs",
    "sudo scripts/netns.sh --frames 6000": "root, 100 s",
    "cargo build --release --locked -p tumble --features foxglove": "another build of everything",
}
LONG = {  # run where TUMBLE_SLOW=1
    "examples/link_trial --transport shm --facets 6 --bytes 65536 --rate 500 --frames 2000": "seven processes that want cores of their own",
}
DRAWS = ("--screenshot", "--frames-dir", "--pattern", "tumble cave ")
# Tests of Rust run in their own stage; that one of the name is there is looked up here.
RUST_TEST = re.compile(r"cargo test --release (?:--workspace|-p ([\w-]+))((?: (?!--\s)--?[\w-]+(?: it)?)*)(?: --(?: --nocapture)?)?(?: ([a-z_:0-9]+))?")
RUST_EXAMPLE = re.compile(r"cargo run --release (?:-p ([\w-]+) )?--example (\w+)")
PYTHON_PROGRAM = re.compile(r"python3? ((?:examples|benches)/[a-z_/]+\.py)")


class Block(NamedTuple):
    page: str
    line: int  # of the first line within the fence
    language: str
    text: str


def blocks(path):
    """The fenced blocks of a page."""
    found, fence = [], None
    for number, line in enumerate(path.read_text().splitlines(), 1):
        if fence is None and line.lstrip().startswith("```"):
            fence = Block(path.relative_to(ROOT).as_posix(), number + 1, line.strip()[3:], "")
        elif fence is not None and line.strip() == "```":
            found.append(fence)
            fence = None
        elif fence is not None:
            fence = fence._replace(text=fence.text + line + "\n")
    assert fence is None, f"{path}: a fence is not closed"
    return found


def matches(said, wanted):
    """Whether a text is what a page says, with `…` for anything and any number of blanks for one."""
    pattern = ".*".join(re.escape(part) for part in " ".join(wanted.split()).split("…"))
    return re.fullmatch(pattern, " ".join(said.split()), re.S) is not None


def run_python(block, names):
    """Runs a block statement by statement and holds each to its `# -> TEXT`."""
    lines = block.text.splitlines()
    for statement in ast.parse(block.text).body:
        wanted = lines[statement.end_lineno - 1].partition("# -> ")[2]
        where = f"{block.page}:{block.line + statement.end_lineno - 1}"
        ast.increment_lineno(statement, block.line - 1)
        value, out = None, io.StringIO()
        with contextlib.redirect_stdout(out):
            if isinstance(statement, ast.Expr):
                value = eval(compile(ast.Expression(statement.value), block.page, "eval"), names)
            else:
                exec(compile(ast.Module([statement], []), block.page, "exec"), names)
        said = out.getvalue().strip() or repr(value)
        assert not wanted or matches(said, wanted), f"{where}: the page says {wanted!r}, and it prints {said!r}"


def commands(block):
    """The commands of a block, without their comments, as they are run here: the built command instead of cargo."""
    for line in block.text.replace("\\\n", " ").splitlines():
        line = re.sub(r"(^|\s)#\s.*$", "", line).strip()
        line = re.sub(r"^cargo run --release -- ", "tumble ", line)
        line = re.sub(r"^cargo run --release -p [\w-]+ --example (\w+)(?: -- )?", r"examples/\1 ", line).strip()
        if line:
            yield line


def run_commands(block, folder, adapter):
    """Runs the commands of a block and gives what they print, and why some were left out."""
    said, skipped = "", []
    for line in commands(block):
        if any(matches(line, wanted) for wanted in NOT_RUN) or RUST_TEST.search(line):
            continue
        program = line.split()[0]
        if line in LONG and not SLOW:
            skipped.append(f"{line}: {LONG[line]}; TUMBLE_SLOW=1 runs it")
        elif any(word in line for word in DRAWS) and not adapter:
            skipped.append(f"{line}: no graphics adapter")
        elif program.startswith("examples/") and not (folder / program).is_file():
            skipped.append(f"{line}: not built; `cargo build --release --workspace --examples` builds it")
        else:
            path = f"{folder}:{Path(sys.executable).parent}:{os.environ['PATH']}"
            own = {"PATH": path, "MPLBACKEND": "Agg", "XDG_RUNTIME_DIR": str(folder / "run")}  # a cave of the same name may run beside
            done = subprocess.run(["bash", "-c", line], cwd=folder, env={**os.environ, **own}, capture_output=True, text=True, timeout=300)
            said += done.stdout + done.stderr
            assert done.returncode == 0, f"{block.page}:{block.line}: {line}\n{done.stdout}{done.stderr}"
    return said, skipped


def check_output(block, said):
    """Holds what commands printed to the lines of an `output` block."""
    lines = iter(said.splitlines())
    for wanted in filter(str.strip, block.text.splitlines()):
        assert any(matches(line, wanted) for line in lines), f"{block.page}: nothing printed is {wanted!r} (in this order):\n{said}"


CAVE_OF_MACHINES = '\n[sync]\ntransport = "udp"\n[security]\nkey_file = "cave.key"\n'


def run_toml(block, folder, command):
    """A scene is checked and run for a tenth of a second; a piece of a cave is checked within `cube4`."""
    path = folder / "page.toml"
    of_cave = re.search(r"^\[+(node|tracker|sync|security|screen|facet|user)\b", block.text, re.M)
    cave = re.sub(r"^\[sync\]\n[^\[]*", "", (ROOT / "caves" / "cube4.toml").read_text(), flags=re.M) + CAVE_OF_MACHINES
    path.write_text((cave if of_cave else "") + block.text)
    for words in (["check", path],) if of_cave else (["check", path], ["run", path, "--duration", "0.1", "--quiet"]):
        done = subprocess.run([command, *words], cwd=folder, capture_output=True, text=True, timeout=60)
        assert done.returncode == 0, f"{block.page}:{block.line}: {done.stdout}{done.stderr}"


def read_json(block, folder):
    """Parses; a sphere tree is read as one."""
    path = folder / "page.json"
    path.write_text(block.text)
    if json.loads(block.text).get("format") == "tumble sphere tree":
        tumble.SphereTree.load(path)


ARM = """<robot name="robot"><link name="base"/>
<link name="upper"><inertial><mass value="1"/><origin xyz="0 0 0.2"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><origin xyz="0 0 0.2"/><geometry><cylinder radius="0.04" length="0.4"/></geometry></collision></link>
<link name="fore"><inertial><mass value="1"/><origin xyz="0 0 0.2"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><origin xyz="0 0 0.2"/><geometry><box size="0.06 0.06 0.3"/></geometry></collision></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="50" velocity="3"/></joint>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0 0 0.4"/><axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="50" velocity="3"/></joint>
</robot>
"""


@pytest.fixture
def folder(tmp_path, command, monkeypatch):
    """A folder with what a reader has: the clone's scenes and caves, the command, and files of their own."""
    (tmp_path / "tumble").symlink_to(command)
    for name in ("scenes", "caves", "docs"):
        (tmp_path / name).symlink_to(ROOT / name)
    if (command.parent / "examples").is_dir():
        (tmp_path / "examples").symlink_to(command.parent / "examples")
    (tmp_path / "run").mkdir(mode=0o700)
    (tmp_path / "my").mkdir()
    shutil.copy(ROOT / "scenes" / "stack" / "scene.toml", tmp_path / "my" / "scene.toml")
    (tmp_path / "robot.urdf").write_text(ARM)
    shutil.copy(ROOT / "crates" / "scene" / "tests" / "mjcf" / "cartpole.xml", tmp_path / "my")
    tree = tmp_path / "bunny.obj"  # a cube stands for it
    corners = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    sides = "013 032 467 475 045 051 237 276 026 064 157 173".split()
    tree.write_text("".join(f"v {x} {y} {z}\n" for x, y, z in corners) + "".join("f " + " ".join(str(int(k) + 1) for k in side) + "\n" for side in sides))
    key = tmp_path / "cave.key"
    key.touch(0o600)
    key.write_text("5a" * 32 + "\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(scope="session")
def adapter():
    """Whether there is a graphics adapter."""
    probe = "import tumble; tumble.World().render(8, 8)"
    return subprocess.run([sys.executable, "-c", probe], capture_output=True, timeout=120).returncode == 0


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_what_a_page_says_happens(page, folder, command, adapter, monkeypatch):
    monkeypatch.setattr("time.sleep", lambda _seconds: None)
    names, said, skipped = {"__name__": "__main__"}, "", []
    for block in blocks(page):
        where = f"{block.page}:{block.line}"
        if block.language == "python":
            try:
                run_python(block, names)
            except (tumble.PictureError, ModuleNotFoundError) as error:
                if isinstance(error, ModuleNotFoundError) and error.name not in ("gymnasium", "matplotlib", "distributed", "pettingzoo"):
                    raise
                skipped.append(f"{where}: {error}")
        elif block.language == "sh":
            said, missing = run_commands(block, folder, adapter)
            skipped += missing
        elif block.language == "output":
            skipped or check_output(block, said)
        elif block.language == "toml":
            run_toml(block, folder, command)
        elif block.language == "json":
            read_json(block, folder)
        elif block.language == "xml":
            ElementTree.fromstring(block.text)
        else:  # Rust is compiled where it stands in a crate's documentation: scripts/check_docs.py
            assert block.language in ("rust", "text"), f"{where}: a block of no known language: {block.language!r}"
    if skipped:
        pytest.skip("SKIPPED: " + "; ".join(skipped))


def test_tests_and_programs_that_pages_name_are_there():
    """In text as in blocks: a test of Rust by any part of its path, an example of a crate, a program in Python."""
    folders = {"tumble-" + path.name: path for path in (ROOT / "crates").iterdir()} | {"tumble": ROOT / "crates" / "tumble"}
    for page in [*PAGES, ROOT / "CONTRIBUTING.md", *(ROOT / "benches").glob("*/README.md"), *(ROOT / "scenes").glob("*/README.md")]:
        text = page.read_text()
        for crate, _, wanted in RUST_TEST.findall(text):
            sources = (folders[crate] if crate else ROOT / "crates").rglob("*.rs")
            name = (wanted or "").split("::")[-1]
            assert any(name in found for path in sources for found in [path.stem, path.parent.name, *re.findall(r"fn (\w+)", path.read_text())]), f"{page}: no test {wanted} in {crate}"
        for crate, name in RUST_EXAMPLE.findall(text):
            examples = folders[crate or "tumble"] / "examples"
            assert (examples / f"{name}.rs").is_file() or (examples / name).is_dir(), f"{page}: no example {name}"
        for program in PYTHON_PROGRAM.findall(text):
            assert (ROOT / program).is_file(), f"{page}: no program {program}"


FOREIGN = set(  # of other programs, and of other engines
    "taskset openusd openusd_schemas UsdPhysics manylinux_2_35 compinit zfunc zshrc GLIBC_TUNABLES glibc malloc hugetlb timehist strace rustfmt mj_forward "
    "PhysicsSystem PxCombineMode SetCombineFriction SetCombineRestitution b2MixFriction b2MixRestitution btManifoldResult calculateCombinedRestitution BoxShape round_cuboid "
    "UDisplayClusterPlayerInput cluster_display cluster_operation Documentation troubleshooting unity distortionMap "
    "franka franka_panda panda_collision panda_spherized robot_cfg NV_swap_group PFD_STEREO VK_KHR_present_wait "
    "VK_GOOGLE_display_timing VK_KHR_present_id VK_NV_present_barrier VULKAN_GOOGLE_DISPLAY_TIMING open_with_callback raw_native_swapchain "
    "set_next_present_time texture_from_raw vkQueuePresentKHR vulkaninfo display_timing MESA_SHADER_CACHE_DIR camera_id camera_name max_geom visual_options".split()
)
STAND_INS = set("x1080 RECORDING now_files frame_000042 tumble_UID tumble_UID_ pin_k name_count my_wall ARCHIVE".split())


def test_words_in_backticks_stand_in_the_sources():
    """A type, key, option or test that a page names is there, whole or in part."""
    endings = (".rs", ".py", ".pyi", ".toml", ".sh", ".wgsl", ".json", ".urdf", "Makefile")
    listing = subprocess.run(["git", "ls-files", "--cached", "--others", "--exclude-standard"], cwd=ROOT, capture_output=True, text=True)
    if listing.returncode:
        pytest.skip("SKIPPED: not a clone")
    words = set()
    for name in listing.stdout.split("\n"):
        if name.endswith(endings) and (ROOT / name).is_file():
            words.update(re.findall(r"[A-Za-z_][A-Za-z_0-9]{4,}", (ROOT / name).read_text(errors="ignore").replace("-", "_")))
    missing = []
    known = "\n".join(words) + "\n".join([name for name in listing.stdout.split("\n")])
    pages = [page for page in PAGES if page.name != "glossary.md"]  # which lists names of other engines and words that are ruled out
    for page in [*pages, ROOT / "ARCHITECTURE.md", ROOT / "CONTRIBUTING.md"]:
        prose = re.sub(r"^ *```.*?^ *```", "", page.read_text(), flags=re.S | re.M)
        if page.name == "features.md":  # names of other engines, except in its columns "here" and "shown in"
            prose = "\n".join(" ".join(line.split("|")[6:]) for line in prose.split("\n"))
        named = {word for code in re.findall(r"`([^`\n]+)`", prose) for word in re.findall(r"[A-Za-z_][A-Za-z_0-9]{4,}", code.replace("--", " ").replace("-", "_"))}
        missing += [f"{page.relative_to(ROOT)}: {word}" for word in sorted(named - FOREIGN - STAND_INS) if word not in known]
    assert not missing, f"in no source, and not in FOREIGN or STAND_INS here: {missing}"


def test_what_is_not_run_still_stands_in_a_page():
    written = {line for page in PAGES for block in blocks(page) if block.language == "sh" for line in commands(block)}
    assert not [wanted for wanted in (*NOT_RUN, *LONG) if not any(matches(line, wanted) for line in written)]


def test_a_page_that_says_something_else_fails():
    block = Block("page.md", 1, "python", "x = 1\nprint(x + 1)  # -> 3\n")
    with pytest.raises(AssertionError, match="page.md:2: the page says '3', and it prints '2'"):
        run_python(block, {})
    run_python(block._replace(text="print(0.25, 'N')  # -> 0.2… N\n[1, 2]  # -> [1, 2]\n"), {})
    with pytest.raises(AssertionError, match="nothing printed"):
        check_output(block._replace(text="b\na\n"), "a\nb\n")
    assert list(commands(block._replace(text="cargo run --release -- run stack   # by name\ntumble check \\\n  x#y\n"))) == ["tumble run stack", "tumble check    x#y"]
