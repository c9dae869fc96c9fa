"""The signatures, defaults and docstrings that `inspect`, editors and type checkers read are those of the library."""

import ast
import importlib.util
import inspect
import subprocess
import sys
import typing

import numpy as np
import pytest

import tumble
import tumble._native
import tumble.typing

BALL = {"name": "ball", "shape": tumble.Sphere(0.1), "mass": 1.0}


def public():
    """Every public function, and of every public class its constructor and methods."""
    for name in tumble.__all__:
        value = getattr(tumble, name)
        if inspect.isclass(value) and issubclass(value, Exception) or isinstance(value, str):
            continue
        if inspect.isclass(value) and "__new__" in vars(value) or inspect.isfunction(value):
            yield name, value
        if inspect.isclass(value):
            own = {part: getattr(value, part) for part in vars(value) if not part.startswith("_")}
            yield from ((f"{name}.{part}", call) for part, call in own.items() if callable(call))


@pytest.fixture(scope="module")
def stub():
    """The parameters of the compiled module's functions by the stub, with their defaults."""
    import pathlib

    text = (pathlib.Path(tumble.__file__).parent / "_native.pyi").read_text(encoding="utf-8")
    found = {}
    for node in ast.parse(text).body:
        if isinstance(node, ast.ClassDef):
            functions = [part for part in node.body if isinstance(part, ast.FunctionDef)]
            found |= {f"{node.name}.{part.name}".removesuffix(".__new__"): part.args for part in functions}
    return found


def defaults_of(arguments):
    """Names and defaults as written."""
    first = [arg.arg for arg in arguments.posonlyargs + arguments.args]
    values = zip(reversed(first), reversed(arguments.defaults))
    keywords = zip((arg.arg for arg in arguments.kwonlyargs), arguments.kw_defaults)
    return {name: ast.literal_eval(value) for name, value in [*values, *keywords] if value is not None}


@pytest.mark.parametrize(("name", "value"), list(public()))
def test_every_signature_shows_its_defaults(name, value, stub):
    signature = inspect.signature(value)
    assert "..." not in str(signature)
    shown = {p.name: p.default for p in signature.parameters.values() if p.default is not p.empty}
    if name in stub:
        assert shown == defaults_of(stub[name])
        names = [arg.arg for arg in stub[name].args + stub[name].kwonlyargs]
        assert list(signature.parameters) == [n for n in names if n not in ("cls", "self")] or "self" in signature.parameters


def shown(call, *without):
    """The defaults that a signature shows."""
    parameters = inspect.signature(call).parameters.values()
    return {p.name: p.default for p in parameters if p.default is not p.empty and p.name not in without}


def filled(**words):
    """A world with a ball, a static block and a mesh, after some steps."""
    world = tumble.World(**words)
    world.add_static("floor", tumble.HalfSpace())
    world.add_rigid(**BALL, position=(0, 0, 0.5), velocity=(1, 0, 0))
    world.step(200)
    return world.save()


def test_defaults_shown_are_defaults_used(root, tmp_path):
    assert filled(**shown(tumble.World)) == filled()
    world = tumble.World()
    given, left_out = (world.fork() for _ in range(2))
    given.add_rigid(**BALL | shown(tumble.World.add_rigid, "name", "shape", "mass"))
    left_out.add_rigid(**BALL)
    given.add_static("floor", tumble.HalfSpace(**shown(tumble.HalfSpace)), **shown(tumble.World.add_static, "name", "shape"))
    left_out.add_static("floor", tumble.HalfSpace())
    urdf = root / "scenes" / "robot" / "arm.urdf"
    arm = tumble.Articulation.from_urdf(urdf, **shown(tumble.Articulation.from_urdf))
    given.add_articulation(arm, **shown(tumble.World.add_articulation)).set_drive("elbow", **shown(tumble.Articulation.set_drive))
    left_out.add_articulation(tumble.Articulation.from_urdf(urdf)).set_drive("elbow")
    given["ball"].apply_force((1, 0, 0), **shown(tumble.RigidBody.apply_force))
    left_out["ball"].apply_force((1, 0, 0))
    for each in (given, left_out):
        each.step(50)
    assert given.save() == left_out.save() and repr(given["ball"].friction) == repr(left_out["ball"].friction)


CHOICES = {
    "Stepper": lambda word: tumble.World(stepper=word),
    "Integrator": lambda word: tumble.World(integrator=word),
    "Solver": lambda word: tumble.World(solver=word),
    "Contacts": lambda word: tumble.World().add_rigid(**BALL, contacts=word),
    "Mode": lambda word: setattr(tumble.World().add_rigid(**BALL), "mode", word),
    "JointKind": lambda word: add_joint(word),
    "JointType": lambda word: tumble.ArticulationBuilder().add_link("link", joint=word),
    "MissingMeshes": lambda word: tumble.Articulation.from_urdf("scenes/robot/arm.urdf", missing_meshes=word),
    "CollisionMeshes": lambda word: tumble.Articulation.from_urdf("scenes/robot/arm.urdf", collision_meshes=word),
    "TreeMethod": lambda word: tumble.SphereTree.build(*cube(), method=word, depth=1, cache=False),
    "Axis": lambda word: tumble.World().plot_paths(0.1, bodies=[], along=word),
}


def add_joint(kind):
    world = tumble.World()
    two = (world.add_rigid(**BALL), world.add_rigid(tumble.Sphere(1), mass=1))
    ends = {"second_point": (0, 0, 1)}
    needed = {
        "universal": {"second_axis": (1, 0, 0)},
        "distance": ends,
        "rope": ends,
        "spring": ends,
        "gear": {"teeth": (1, 2)},
        "rack": {"second_axis": (1, 0, 0), "radius": 1},
        "screw": {"pitch": 1},
        "pulley": {**ends, "ground": np.eye(3)[:2]},
    }
    world.add_joint(kind, *two, point=(0, 0, 0), **needed.get(kind, {}))


def cube():
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    sides = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
    return corners, np.array(sides)


def test_literals_are_the_words_of_the_library():
    literals = {name: list(typing.get_args(value)) for name, value in vars(tumble.typing).items() if typing.get_origin(value) is typing.Literal}
    axis = {"Axis": ["x", "y", "z"]}  # a word of the package alone, tried below
    assert literals == tumble._native._choices() | axis


@pytest.mark.parametrize("name", sorted(CHOICES))
def test_the_library_takes_the_words_of_literals_and_no_others(name, root, monkeypatch):
    monkeypatch.chdir(root)
    if name == "Axis":
        pytest.importorskip("matplotlib")
    for word in typing.get_args(getattr(tumble.typing, name)):
        CHOICES[name](word)
    with pytest.raises(tumble.InvalidValueError):
        CHOICES[name]("anything else")


def test_the_stub_has_the_docstrings_of_the_module(root):
    """`target/py-tests/bin/python scripts/stub_docs.py` writes them."""
    spec = importlib.util.spec_from_file_location("stub_docs", root / "scripts" / "stub_docs.py")
    stub_docs = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(stub_docs)
    source = stub_docs.STUB.read_text(encoding="utf-8")
    assert stub_docs.documented(source, tumble._native) == source, "run target/py-tests/bin/python scripts/stub_docs.py"
    changed = source.replace("Gravity, shape (3,), m/s²", "Something else")
    assert changed != source and stub_docs.documented(changed, tumble._native) == source
    ast.parse(source)


WRONG = """
import tumble
tumble.World(stepper="backtrack")
tumble.World(solver="newton")
tumble.World.load("stack", integrator="euler")
tumble.World().add_rigid("ball", tumble.Sphere(0.1), mass=1.0, contacts="sphere")
tumble.World().body("ball").mode = "floating"
tumble.SphereTree.build("ball.obj", method="best")
tumble.Articulation.from_urdf("arm.urdf", missing_meshes="ignore")
tumble.World().articulation("arm").velocity
"""


def test_mypy_finds_wrong_words(tmp_path):
    pytest.importorskip("mypy", reason="SKIPPED: mypy is not installed")
    program = tmp_path / "wrong.py"
    program.write_text(WRONG)
    found = subprocess.run([sys.executable, "-m", "mypy", "--strict", "--cache-dir", tmp_path, program], capture_output=True, text=True, timeout=300)
    lines = {int(line.split(":")[1]) for line in found.stdout.splitlines() if ": error:" in line}
    assert lines == set(range(3, 3 + WRONG.count("\n") - 2)), found.stdout


def test_bodies_by_kind(root):
    world = tumble.World()
    world.add_rigid(**BALL)
    world.add_articulation(root / "scenes" / "robot" / "arm.urdf", name="arm")
    assert world.body("ball") == world["ball"] and world.articulation("arm") == world["arm"]
    with pytest.raises(tumble.UnknownNameError, match=r"'arm' is an articulation and not a rigid body; world.articulation\('arm'\)"):
        world.body("arm")
    with pytest.raises(tumble.UnknownNameError, match=r"'ball' is a rigid body and not an articulation; world.body\('ball'\)"):
        world.articulation("ball")
    for ask in (world.body, world.articulation):
        with pytest.raises(tumble.UnknownNameError, match="no body named 'cube'; there are ball, arm"):
            ask("cube")
