"""Content hashes of jobs: equal for equal jobs in any process, different for anything that may change a result."""

import abc
import enum
import functools
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Generic, NamedTuple, TypeVar

import numpy as np
import pytest

import tumble
from tumble.distributed import key

FACTOR = 2.0


def helper(x):
    return FACTOR * x


def function(x, y=1):
    return helper(x) + y


@dataclass
class Setting:
    mass: float
    names: tuple = ("a", "b")


class Run:
    def __init__(self, gain):
        self.gain = gain

    def __call__(self, x):
        return self.gain * x


def of(source, name="f", **more):
    """A function of a module's text."""
    space = {"__name__": "__main__", "np": np, **more}
    exec(source, space)
    return space[name]


def test_equal_jobs_have_equal_hashes():
    array = np.arange(6.0).reshape(2, 3)
    for one, other in [
        (array, array.copy()),
        (array[:, ::2], array[:, ::2].copy()),
        ({"a": 1, "b": [array]}, {"a": 1, "b": [array.copy()]}),
        ({"x", "y", "z"}, {"z", "y", "x"}),
        (Setting(1.0), Setting(1.0)),
        (Path("a/b"), Path("a") / "b"),
    ]:
        assert key(function, one) == key(function, other)
    assert key(Run(2.0), 1) == key(Run(2.0), 1) and len(key(function, 1)) == 64


def test_whatever_may_change_a_result_changes_the_hash():
    array = np.arange(4.0)
    jobs = [1, 1.0, True, None, "1", b"1", (1,), [1], {1}, {1: None}, -0.0, 0.0, float("nan"), array, array.astype(np.float32), array.reshape(2, 2), array + 1e-15,
            Setting(1.0), Setting(2.0), Setting(1.0, ("a",)), [[1], 2], [1, [2]], ["ab", "c"], ["a", "bc"], np.float64(1.0), {"a": 1, "b": 2}, 10**30]  # fmt: skip
    functions = [function, helper, functools.partial(function, y=2), functools.partial(function, y=3), Run(1.0), Run(2.0), Run(1.0).__call__, lambda x: x, lambda x: x + 1,
                 tumble.simulate, functools.partial(tumble.simulate, b"model")]  # fmt: skip
    keys = [key(function, job) for job in jobs] + [key(each, 7) for each in functions] + [key(function, 1, "2")]
    assert len(set(keys)) == len(keys)


def test_code_counts_with_what_it_names_in_its_module():
    base = "A = 1\ndef g(x):\n    return x + A\nclass C:\n    def m(self): return 1\ndef f(x):\n    return g(x) + C().m()\n"
    keys = [key(of(text), 1) for text in (base, base.replace("A = 1", "A = 2"), base.replace("x + A", "x - A"), base.replace("return 1", "return 2"), base.replace("g(x) +", "g(x) -"))]
    assert len(set(keys)) == 5
    assert key(of(base), 1) == keys[0] == key(of("\n\n# a comment\n" + base), 1)
    base = "class D:\n    GAIN = 1\n    TABLE = {'a': [1]}\n    def get(self): return 3\n    def put(self, x): self.x = 4\n    p = property(get, put)\n    m = staticmethod(max)\ndef f(x):\n    return D()\n"
    changes = ("GAIN = 1", "GAIN = 2"), ("[1]", "[2]"), ("return 3", "return 5"), ("self.x = 4", "self.x = 5"), ("(get, put)", "(get)"), ("(max)", "(min)"), ("staticm", "classm")
    assert len({key(of(text), 1) for text in [base, *(base.replace(*change) for change in changes)]}) == 8
    setter = "class P:\n    @property\n    def p(self): return 1\n    @p.setter\n    def p(self, x): self.x = 2\ndef f(x):\n    return P()\n"
    assert key(of(setter), 1) == key(of(setter), 1) != key(of(setter.replace("= 2", "= 3")), 1)
    cached = "import functools\n@functools.cache\ndef g(x):\n    return 1\nclass C:\n    @functools.cached_property\n    def p(self): return 2\ndef f(x):\n    return g(x), C\n"
    assert len({key(of(text), 1) for text in (cached, cached.replace("return 1", "return 3"), cached.replace("return 2", "return 3"))}) == 3
    kept = "def f(x):\n    return [a, np.sin(x), tumble.World]\n"
    assert len({key(of(kept, a=a, tumble=tumble), 1) for a in (1, 2, [1], {"b": 1}, {"b": 2}, tumble.World(), tumble.World(dt=1 / 60))}) == 7
    recursive = "def f(x):\n    return x and g(x - 1)\ndef g(x):\n    return x and f(x - 1)\n"
    assert key(of(recursive), 1) == key(of(recursive), 1) != key(of(recursive.replace("and g(x - 1)", "and g(x - 2)")), 1)


class Kind(enum.Enum):
    SMALL = 1
    LARGE = 2


class Point(NamedTuple):
    x: float
    y: float = 0.0


class Base(abc.ABC, Generic[TypeVar("T")]):
    kinds: ClassVar = {Kind.SMALL}

    @abc.abstractmethod
    def p(self): ...


@dataclass(frozen=True, slots=True)
class Slots:
    point: Point = Point(1.0)


def test_classes_of_the_standard_kinds_have_hashes():
    Base.owners = {Base}  # a class that refers to itself in a set
    jobs = [Kind, Kind.SMALL, Kind.LARGE, Point, Point(1.0), Point(2.0), Base, Slots, Slots(), Slots(Point(2.0))]
    assert len({key(function, job) for job in jobs}) == len(jobs)
    assert key(function, Slots(Point(2.0))) == key(function, Slots(Point(2.0)))


def test_an_attribute_is_no_global_of_its_name():
    text = "import threading\nlock = threading.Lock()\nA = 1\ndef f(x):\n    return x.lock, x.A\n"
    assert key(of(text), 1) == key(of(text.replace("A = 1", "A = 2")), 1)
    with pytest.raises(ValueError, match="a lock has no content"):
        key(of(text.replace("x.lock", "lock")), 1)
    within = "A = 1\ndef f(x):\n    class C:\n        B = A\n    return [lambda: C.B]\n"
    assert key(of(within), 1) != key(of(within.replace("A = 1", "A = 2")), 1)


def test_a_function_of_a_module_that_cannot_be_imported_counts_with_its_code():
    text = "A = 1\ndef f(x):\n    return x + A\n"
    keys = [key(of(each, __name__="made.up"), 1) for each in (text, text, text.replace("A = 1", "A = 2"))]
    assert keys[0] == keys[1] != keys[2]


def test_a_closure_counts():
    def make(a):
        return lambda x: a * x

    assert key(make(1), 0) == key(make(1), 0) != key(make(2), 0)


def test_a_world_counts_by_its_content():
    def world(mass):
        made = tumble.World()
        made.add_rigid("ball", tumble.Sphere(0.1), mass=mass)
        return made

    assert key(function, world(1.0)) == key(function, world(1.0)) != key(function, world(2.0))


def test_another_process_has_the_same_hash():
    program = (
        "import sys; sys.path.insert(0, sys.argv[1]); import test_distributed_keys as t; import numpy as np; "
        "from tumble.distributed import key; print(key(t.function, [{'b', 'a', 'c'}, t.Setting(1.5), np.eye(3), 'x']))"
    )
    here = key(function, [{"a", "b", "c"}, Setting(1.5), np.eye(3), "x"])
    if __name__ != "test_distributed_keys":
        pytest.skip("SKIPPED: the tests are a package here")
    for seed in "12":
        command = [sys.executable, "-c", program, str(Path(__file__).parent)]
        done = subprocess.run(command, env={"PYTHONHASHSEED": seed}, capture_output=True, text=True, timeout=60)
        assert done.stdout.strip() == here, done.stderr


def test_what_has_no_content_is_refused():
    values = []
    values.append(values)
    with pytest.raises(ValueError, match="more than 100 deep"):
        key(function, values)
    with pytest.raises(ValueError, match="a generator has no content that can be hashed"):
        key(function, (x for x in range(3)))
