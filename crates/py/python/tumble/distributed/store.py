"""Results in a folder, each named by the hash of what it is the result of."""

from __future__ import annotations

import contextlib
import dis
import functools
import hashlib
import importlib
import os
import tempfile
import time
import types
from collections.abc import Callable
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np

import tumble
from tumble._errors import InvalidValueError

MAGIC = b"tumble result 1\n"
DEEPEST = 100  # levels of values within values
STALE_S = 86400.0  # age of a file that nobody finishes any more
LOADS = ("LOAD_GLOBAL", "LOAD_NAME", "LOAD_FROM_DICT_OR_GLOBALS")  # instructions that may read a global


class Store:
    """Results in a folder, each in a file of its own that is complete or absent. A file that was damaged counts as absent.

    folder: made where it is missing. Files that a run left unfinished are removed here after a day. Its files are pickles: use no folder that others can write
    to.
    """

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self.folder = Path(folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        for left in self.folder.glob("unfinished-*"):
            with contextlib.suppress(OSError):  # another program removed it
                if time.time() - left.stat().st_mtime > STALE_S:
                    left.unlink()

    def path(self, key: str) -> Path:
        """Returns the file of a key."""
        return self.folder / key[:2] / key[2:]

    def get(self, key: str) -> bytes | None:
        """Returns the pickled result of a key; None if there is none."""
        try:
            data = self.path(key).read_bytes()
        except FileNotFoundError:
            return None
        head = len(MAGIC) + hashlib.sha256().digest_size
        digest, payload = data[len(MAGIC) : head], data[head:]
        return payload if data.startswith(MAGIC) and hashlib.sha256(payload).digest() == digest else None

    def put(self, key: str, payload: bytes) -> None:
        """Keeps the pickled result of a key."""
        path = self.path(key)
        path.parent.mkdir(exist_ok=True)
        handle, name = tempfile.mkstemp(dir=self.folder, prefix="unfinished-")
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(MAGIC + hashlib.sha256(payload).digest() + payload)
            os.replace(name, path)
        except BaseException:
            Path(name).unlink(missing_ok=True)
            raise

    def __len__(self) -> int:
        return sum(1 for _ in self.folder.glob("??/*"))


def key(function: Callable[[Any], Any], job: object, version: str = "") -> str:
    """Returns the content hash of a job, as 64 hexadecimal digits: of the function, the job, ``version``, and this build of the library.

    Of a function written in Python the code counts, its defaults and what it closes over, and with it all functions, classes and values of its module that it
    names; of a class its methods and attributes. What lies in other modules counts by name only: change ``version`` when it changes. Raises
    ``InvalidValueError`` for what does not pickle.
    """
    digest = hashlib.sha256()
    _Feed(digest.update).value((_library(), version, function, job), 0)
    return digest.hexdigest()


_builds: dict[str, str] = {}  # the hash of the compiled module, which does not change while it is loaded


def _library() -> str:
    file = str(importlib.import_module("tumble._native").__file__)
    if file not in _builds:
        _builds[file] = hashlib.sha256(Path(file).read_bytes()).hexdigest()
    return f"{tumble.__version__} {_builds[file]}"


class _Feed:
    """Writes values as bytes that depend on nothing but the values."""

    def __init__(self, write: Callable[[bytes], object], known: dict[int, int] | None = None) -> None:
        self.write = write
        self.known = dict(known or {})  # functions and classes, which may refer to each other

    def part(self, tag: str, data: bytes) -> None:
        self.write(f"{tag} {len(data)} ".encode() + data)

    def value(self, value: Any, depth: int) -> None:
        if depth > DEEPEST:
            raise InvalidValueError(f"a job has values within values, more than {DEEPEST} deep")
        if value is None or isinstance(value, (bool, int, float, complex, str)) and type(value).__module__ == "builtins":
            self.part(type(value).__name__, repr(value).encode("utf-8", "surrogatepass"))
        elif isinstance(value, (bytes, bytearray)):
            self.part(type(value).__name__, bytes(value))
        elif isinstance(value, (np.ndarray, np.generic)) and not value.dtype.hasobject:
            self.part("array", f"{type(value).__name__} {value.dtype.descr} {value.shape}".encode())
            self.part("data", value.tobytes())
        elif type(value) in (list, tuple):
            self.many(type(value).__name__, value, depth)
        elif isinstance(value, (set, frozenset)):
            self.many(type(value).__name__, sorted(self.digest(each, depth) for each in value), depth)
        elif type(value) is dict:
            self.many("dict", [part for pair in value.items() for part in pair], depth)
        elif isinstance(value, types.CodeType):
            own = (value.co_name, value.co_code, value.co_consts, value.co_names, value.co_varnames, value.co_freevars)
            self.many("code", own, depth)
        elif isinstance(value, (types.FunctionType, type)):
            self.named(value, depth)
        elif isinstance(value, (types.BuiltinFunctionType, types.ModuleType)):
            self.part("name", f"{getattr(value, '__module__', '')}.{value.__name__}".encode())
        else:
            self.reduced(value, depth)

    def many(self, tag: str, values: Any, depth: int) -> None:
        self.part(tag, str(len(values)).encode())
        for each in values:
            self.value(each, depth + 1)

    def digest(self, value: Any, depth: int) -> bytes:
        digest = hashlib.sha256()
        _Feed(digest.update, self.known).value(value, depth + 1)
        return digest.digest()

    def named(self, value: Any, depth: int) -> None:
        """A function or class: its name, and what it is made of if it is that of a program."""
        self.part("name", f"{value.__module__}.{value.__qualname__}".encode())
        if id(value) in self.known:
            self.part("known", str(self.known[id(value)]).encode())
            return
        self.known[id(value)] = len(self.known)
        if isinstance(value, types.FunctionType):
            cells = [_content(cell) for cell in value.__closure__ or ()]
            self.many("function", (value.__code__, value.__defaults__, value.__kwdefaults__, cells), depth)
            if not _installed(value.__module__):
                self.globals(value.__code__, value.__globals__, value.__module__, depth)
        elif not _installed(value.__module__):
            self.many("class", [value.__bases__, *(part for name, entry in _entries(value) for part in (name, *_inner(entry)))], depth)

    def globals(self, code: types.CodeType, names: dict[str, Any], module: str, depth: int) -> None:
        """What a function names in its module; modules, and what was imported from others, by name."""
        for name in sorted(_names(code) & names.keys()):
            found = names[name]
            own = getattr(found, "__module__", module) == module
            if isinstance(found, (types.FunctionType, type)) and not own:
                self.part("name", f"{name} {found.__module__}.{found.__qualname__}".encode())
            else:
                self.many("global", (name, found), depth)

    def reduced(self, value: Any, depth: int) -> None:
        """Any other value: what pickle makes it of."""
        try:
            made = value.__reduce_ex__(4)
        except Exception as error:
            raise InvalidValueError(f"a {type(value).__name__} has no content that can be hashed: {error}") from error
        if isinstance(made, str):
            self.part("name", f"{value.__module__}.{made}".encode())
            self.value(getattr(value, "__wrapped__", None), depth + 1)  # the function of functools.cache
            return
        parts = [list(part) if number > 2 and part is not None else part for number, part in enumerate(made)]
        self.many(f"object {type(value).__module__}.{type(value).__qualname__}", parts, depth)


@functools.lru_cache(maxsize=4096)
def _names(code: types.CodeType) -> frozenset[str]:
    """The names of globals in a function and the functions and classes within it."""
    own = (each.argval for each in dis.get_instructions(code) if each.opname in LOADS)
    return frozenset(own).union(*(_names(const) for const in code.co_consts if isinstance(const, types.CodeType)))


def _content(cell: Any) -> Any:
    try:
        return cell.cell_contents
    except ValueError:  # not set yet
        return None


def _entries(owner: type) -> list[tuple[str, Any]]:
    """What a class defines itself, by name: attributes and methods, without what Python adds to every class."""
    entries = [(name, entry) for name, entry in vars(owner).items() if name != "_abc_impl"]
    return sorted((each for each in entries if not _is_dunder(each[0]) or isinstance(_inner(each[1])[-1], types.FunctionType)), key=itemgetter(0))


def _is_dunder(name: str) -> bool:
    return name.startswith("__") and name.endswith("__")


def _inner(entry: Any) -> tuple[Any, ...]:
    """What an entry of a class is made of: its kind and functions if it is a method of a kind or a property, otherwise itself."""
    if isinstance(entry, (classmethod, staticmethod)):
        return type(entry).__name__, entry.__func__
    if isinstance(entry, property):
        return "property", entry.fset, entry.fdel, entry.fget
    if isinstance(entry, functools.cached_property):
        return "cached_property", entry.func
    return (entry,)


@functools.lru_cache(maxsize=4096)
def _installed(module: str) -> bool:
    """Whether a module is installed, and not a program's own. One that cannot be imported, such as that of a named tuple's methods, is not."""
    if module == "__main__":
        return False
    try:
        file = getattr(importlib.import_module(module), "__file__", None) if module else None
    except Exception:
        return False
    parts = Path(file).parts if file else ()
    return not file or "site-packages" in parts or "dist-packages" in parts or Path(os.__file__).parent in Path(file).parents
