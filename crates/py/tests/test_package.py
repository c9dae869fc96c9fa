"""The package as it is installed."""

import importlib.metadata
import inspect
import runpy
from pathlib import Path

import numpy as np
import pytest

import tumble
import tumble._native


def installed():
    """Whether this is the package of a wheel, and not that of the sources."""
    return "site-packages" in Path(tumble.__file__).parts


def test_the_library_holds_no_path_of_its_builder(root):
    if not installed():
        pytest.skip("SKIPPED: the package is not that of a wheel")
    code = Path(tumble._native.__file__).read_bytes()
    for folder in [root, Path.home() / ".cargo"]:
        assert str(folder).encode() not in code
    assert b"crates/py/src/" in code  # where panics come from is still said


def test_the_metadata_says_what_it_is(root):
    if not installed():
        pytest.skip("SKIPPED: the package is not that of a wheel")
    metadata = importlib.metadata.metadata("tumble")
    classifiers = metadata.get_all("Classifier")
    assert {"Topic :: Scientific/Engineering :: Physics", "Typing :: Typed", "Programming Language :: Rust"} <= set(classifiers)
    assert metadata["License-Expression"] == "MIT OR Apache-2.0"
    files = {Path(str(file)).name: file.locate() for file in importlib.metadata.files("tumble") if "licenses" in file.parts}
    assert sorted(metadata.get_all("License-File")) == sorted(files) == ["LICENSE-APACHE", "LICENSE-MIT"]
    assert all(Path(copy).read_bytes() == (root / name).read_bytes() for name, copy in files.items())


def public():
    for name in tumble.__all__:
        value = getattr(tumble, name)
        yield name, value
        if inspect.isclass(value):
            yield from ((f"{name}.{part}", own) for part, own in vars(value).items() if not part.startswith("_"))


@pytest.mark.parametrize(("name", "value"), [(name, value) for name, value in public() if not isinstance(value, str)])
def test_everything_public_has_a_docstring(name, value):
    assert (inspect.getdoc(value) or "").strip(), name


def test_exceptions_are_what_programs_expect():
    expected = {
        tumble.InvalidValueError: ValueError,
        tumble.SceneError: ValueError,
        tumble.SnapshotError: ValueError,
        tumble.MissingFileError: FileNotFoundError,
        tumble.UnreadableFileError: OSError,
        tumble.UnknownNameError: KeyError,
        tumble.RemovedError: ReferenceError,
        tumble.StepError: RuntimeError,
        tumble.BusyError: RuntimeError,
        tumble.InternalError: RuntimeError,
    }
    for own, usual in expected.items():
        assert issubclass(own, tumble.TumbleError) and issubclass(own, usual)


def test_a_typed_program_runs(root):
    program = runpy.run_path(str(root / "crates" / "py" / "tests" / "typed" / "user.py"))
    # from 1 m the ball reaches the height 1 − g t²/2
    assert program["fall"](0.25) == pytest.approx([0, 0, 1 - 0.5 * 9.81 * 0.25**2], abs=1e-9)
    assert np.isfinite(program["accelerations"](root / "scenes" / "robot" / "arm.urdf")).all()
