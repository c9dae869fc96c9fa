#!/usr/bin/env python3
"""Rewrites scene, cave and Python files of tumble 0.1 with the names that keys, values and functions have now.

usage: scripts/migrate_0_1.py [--check] FILE_OR_FOLDER ...

Takes files that end in .toml or .py, and folders with all such files in them. Only names change: comments, order and layout stay.
Scenes within strings of Python programs are rewritten too. Each change is printed as `file:line: old -> new`. A second run changes nothing.

--check   shows what would change and writes nothing.

Exit codes:
0   every file is up to date now; with --check: nothing would change
1   with --check: at least one file would change
2   a file could not be read, written or understood, or the command line is wrong; other files are handled all the same
"""

from __future__ import annotations

import re
import sys
from bisect import bisect_right
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

# Keys of scenes: path, with `*` for a name of the user's and `|` between alternatives, and the new name. Keys of caves have not changed.
_OBJECT = "body|grid|articulated"
SCENE_KEYS: list[tuple[str, str]] = [
    ("closure", "loop_joint"),
    ("world/seconds", "duration_s"),
    ("meshes/*/sphere_tree_error", "sphere_tree_max_error"),
    (f"{_OBJECT}/alive", "enabled"),
    (f"{_OBJECT}/collides", "collidable"),
    ("articulated/link/collides", "collidable"),
    ("articulated/link/shape|shapes/collides", "collidable"),
    (f"ground|{_OBJECT}/quality", "detail"),
    ("materials/*/quality", "detail"),
    ("articulated/link/quality", "detail"),
    ("articulated/link/shape|shapes/quality", "detail"),
    ("body|grid/camera/ahead", "forward"),
    ("articulated/link/camera/ahead", "forward"),
    ("articulated/keep_apart", "exclude_collisions"),
    ("articulated/start", "initial_positions"),
    ("articulated/link/turned", "initial_rotation"),
    ("articulated/joint/turned", "initial_rotation"),
    ("articulated/link|joint/drive/limit_n_m", "max_torque_n_m"),
    ("articulated/link|joint/drive/limit_n", "max_force_n"),
]
# Values of scenes: the path of the key, the old and the new text.
SCENE_VALUES: list[tuple[str, str, str]] = [
    ("closure|loop_joint/type", old, new)
    for old, new in [("point", "spherical"), ("hinge", "revolute"), ("slider", "prismatic"), ("weld", "fixed")]
]
# Names of the Python module wherever they stand after a dot, or by themselves in a program that imports tumble.
PYTHON_ATTRIBUTES = {
    "alive": "enabled",
    "Behaviour": "Behavior",
    "add_behaviour": "add_behavior",
    "behaviours": "behaviors",
    "out_of_reach": "unreachable_joint",
    "out_of_reach_distance": "unreachable_distance",
}
# Names that are too common to be changed after anything but these words: the variables of tumble's own examples.
PYTHON_MEMBERS = {("view", "push"): "apply_force", ("tree", "branch"): "branching"}
# Keyword arguments: the end of the function's name, the old and the new name.
PYTHON_ARGUMENTS = {
    ("set_drive", "limit"): "max_force",
    ("SphereTree.build", "branch"): "branching",
    ("SphereTree.build", "error"): "max_error",
    ("plot_energy", "seconds"): "duration",
    ("plot_paths", "seconds"): "duration",
    ("add_behaviour", "behaviour"): "behavior",
}


class Change(NamedTuple):
    """A stretch of a text that becomes another."""

    start: int
    end: int
    new: str


class NotToml(Exception):
    """A text is not TOML from a place on."""


class _Toml:
    """Finds the keys and the one-line strings of a TOML text, each with its path."""

    def __init__(self, text: str, start: int = 0, end: int | None = None) -> None:
        self.text, self.at, self.end = text, start, len(text) if end is None else end
        self.keys: list[tuple[int, int, tuple[str, ...]]] = []
        self.strings: list[tuple[int, int, tuple[str, ...]]] = []

    def read(self) -> _Toml:
        section: tuple[str, ...] = ()
        while self.blank(lines=True):
            if self.text[self.at] == "[":
                double = self.text.startswith("[[", self.at)
                self.at += 2 if double else 1
                section = self.key(())
                self.expect("]]" if double else "]")
            elif self.text[self.at] == "\0":
                self.at += 1
            else:
                self.pair(section)
        return self

    def peek(self) -> str:
        return self.text[self.at] if self.at < self.end else ""

    def blank(self, lines: bool) -> bool:
        """Skips blanks and, with `lines`, line ends and comments; whether anything follows."""
        while self.at < self.end:
            c = self.text[self.at]
            if c in " \t" or (lines and c in "\r\n"):
                self.at += 1
            elif lines and c == "#":
                line_end = self.text.find("\n", self.at, self.end)
                self.at = self.end if line_end < 0 else line_end
            else:
                return True
        return False

    def expect(self, what: str) -> None:
        self.blank(lines=False)
        if not self.text.startswith(what, self.at):
            raise NotToml(f"expected {what!r}")
        self.at += len(what)

    def key(self, path: tuple[str, ...]) -> tuple[str, ...]:
        """A key, dotted or not: its whole path."""
        while True:
            self.blank(lines=False)
            start = self.at
            if self.peek() in "\"'" and self.peek():
                self.string()
                path += (self.text[start + 1 : self.at - 1],)
                self.keys.append((start + 1, self.at - 1, path))
            else:
                match = re.compile(r"[\w-]+").match(self.text, self.at, self.end)
                if not match:
                    raise NotToml("expected a key")
                self.at = match.end()
                path += (match.group(),)
                self.keys.append((start, self.at, path))
            self.blank(lines=False)
            if self.peek() != ".":
                return path
            self.at += 1

    def pair(self, section: tuple[str, ...]) -> None:
        path = self.key(section)
        self.expect("=")
        self.value(path)

    def value(self, path: tuple[str, ...]) -> None:
        self.blank(lines=True)
        c = self.peek()
        if c in "\"'" and c:
            start = self.at
            if self.string():
                self.strings.append((start + 1, self.at - 1, path))
        elif c == "[":
            self.list(path, "]", lambda: self.value(path))
        elif c == "{":
            self.list(path, "}", lambda: self.pair(path))
        else:
            match = re.compile(r"[^\s,\]}#]+").match(self.text, self.at, self.end)
            if not match:
                raise NotToml("expected a value")
            self.at = match.end()

    def list(self, path: tuple[str, ...], close: str, entry: object) -> None:
        self.at += 1
        while self.blank(lines=True):
            if self.peek() == close:
                self.at += 1
                return
            if self.peek() in ",\0":  # \0: a replacement field of an f-string
                self.at += 1
            else:
                entry()  # type: ignore[operator]
        raise NotToml(f"expected {close!r}")

    def string(self) -> bool:
        """Skips a string; whether it is one of a single line."""
        quote = self.text[self.at]
        long = self.text.startswith(3 * quote, self.at)
        mark = 3 * quote if long else quote
        self.at += len(mark)
        while self.at < self.end:
            if self.text.startswith(mark, self.at):
                self.at += len(mark)
                return not long
            if self.text[self.at] == "\n" and not long:
                break
            self.at += 2 if self.text[self.at] == "\\" and quote == '"' else 1
        raise NotToml("a string without an end")


def _matches(pattern: str, path: tuple[str, ...]) -> bool:
    parts = pattern.split("/")
    return len(parts) == len(path) and all(part == "*" or name in part.split("|") for part, name in zip(parts, path))


def scene_changes(text: str, start: int = 0, end: int | None = None) -> list[Change]:
    """What changes in a scene or a cave; `NotToml` where the text is neither."""
    found = _Toml(text, start, end).read()
    changes = [
        Change(at, to, new)
        for at, to, path in found.keys
        for pattern, new in SCENE_KEYS
        if _matches(pattern.rsplit("/", 1)[0] if "/" in pattern else "", path[:-1] or ("",)) and path[-1] == pattern.rsplit("/", 1)[-1]
    ]
    for at, to, path in found.strings:
        changes += [Change(at, to, new) for pattern, old, new in SCENE_VALUES if _matches(pattern, path) and text[at:to] == old]
    return changes


_STRING = re.compile(r"(?P<prefix>(?:\b[rRbBuUfF]{1,2})?)(?P<quote>\"\"\"|'''|\"|')")
_SCENE = re.compile(r"^\s*(\[{1,2}[a-z]+[\w.]*\]{1,2}|[a-z_]+ = [\[{])", re.MULTILINE)


class _Python:
    """The names and the strings of a Python program."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.names: list[tuple[int, int]] = []
        self.literals: list[tuple[int, int, bool]] = []
        at = 0
        token = re.compile(r"#[^\n]*|[^\W\d]\w*|[\"']")
        while match := token.search(text, at):
            literal = _STRING.match(text, match.start())
            if literal and match.group()[0] != "#":
                end = self._end(literal)
                self.literals.append((literal.end(), end, "f" in literal["prefix"].lower()))
                at = end + len(literal["quote"])
            else:
                if match.group()[0] != "#":
                    self.names.append(match.span())
                at = match.end()

    def _end(self, literal: re.Match[str]) -> int:
        at, quote = literal.end(), literal["quote"]
        while at < len(self.text) and not self.text.startswith(quote, at):
            at += 2 if self.text[at] == "\\" else 1
        return at

    def calls(self) -> Iterator[tuple[int, int, str]]:
        """Keyword arguments: the place of each name, and the dotted name of the function."""
        inside = {k for start, end, _ in self.literals for k in range(start, end)}
        stack: list[str] = []
        starts = {start: end for start, end in self.names}
        for at, c in enumerate(self.text):
            if at in inside:
                continue
            if c in "([{":
                before = re.search(r"[\w.]+\s*$", self.text[max(0, at - 200) : at]) if c == "(" else None
                stack.append(before.group().strip() if before else "")
            elif c in ")]}" and stack:
                stack.pop()
            elif at in starts and stack and re.compile(r"\s*=(?!=)").match(self.text, starts[at]):
                yield at, starts[at], stack[-1]


def python_changes(text: str) -> list[Change]:
    """What changes in a Python program; nothing in one that does not import tumble."""
    if not re.search(r"^\s*(import|from)\s+tumble\b", text, re.MULTILINE):
        return []
    program, changes = _Python(text), []
    for start, end in program.names:
        name, before = text[start:end], re.search(r"(\w*)\s*\.\s*$", text[max(0, start - 80) : start])
        if name in PYTHON_ATTRIBUTES and (before or name == "Behaviour"):
            changes.append(Change(start, end, PYTHON_ATTRIBUTES[name]))
        elif before and (before[1], name) in PYTHON_MEMBERS:
            changes.append(Change(start, end, PYTHON_MEMBERS[before[1], name]))
    for start, end, function in program.calls():
        for (suffix, old), new in PYTHON_ARGUMENTS.items():
            if text[start:end] == old and f".{function}".endswith(f".{suffix}"):
                changes.append(Change(start, end, new))
    for start, end, formatted in program.literals:
        if "\n" in text[start:end] and _SCENE.search(text, start, end):
            try:
                changes += scene_changes(_masked(text, start, end) if formatted else text, start, end)
            except NotToml:
                pass  # a text of several lines that is no scene
    return changes


def _masked(text: str, start: int, end: int) -> str:
    """An f-string as TOML, character by character: `{{` as `{ `, and replacement fields as `\\0`."""
    body = text[start:end].replace("{{", "{\1").replace("}}", "\1}")
    body = re.sub(r"\{(?!\x01)[^{}]*(?<!\x01)\}", lambda field: "\0" * len(field.group()), body)
    return text[:start] + body.replace("\1", " ") + text[end:]


def migrated(text: str, changes: list[Change]) -> str:
    """The text with its changes."""
    for start, end, new in sorted(changes, reverse=True):
        text = text[:start] + new + text[end:]
    return text


def _files(given: list[str]) -> Iterator[Path]:
    for name in given:
        path = Path(name)
        yield from sorted(p for p in path.rglob("*") if p.suffix in (".toml", ".py")) if path.is_dir() else [path]


def main(arguments: list[str]) -> int:
    check, given = "--check" in arguments, [a for a in arguments if a != "--check"]
    if not given or any(a.startswith("-") for a in given):
        print(__doc__, file=sys.stderr)
        return 2
    changed = failed = False
    for path in _files(given):
        try:
            text = path.read_bytes().decode("utf-8")
            changes = python_changes(text) if path.suffix == ".py" else scene_changes(text)
            lines = [k for k, c in enumerate(text) if c == "\n"]
            for start, end, new in sorted(changes):
                print(f"{path}:{1 + bisect_right(lines, start)}: {text[start:end]} -> {new}")
            if changes and not check:
                path.write_bytes(migrated(text, changes).encode("utf-8"))
            changed |= bool(changes)
        except (OSError, UnicodeDecodeError, NotToml) as error:
            print(f"{path}: left as it is: {error}", file=sys.stderr)
            failed = True
    return 2 if failed else int(check and changed)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
