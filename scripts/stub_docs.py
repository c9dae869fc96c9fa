#!/usr/bin/env python3
"""Writes the docstrings of the compiled module into its stub, crates/py/python/tumble/_native.pyi, so that editors show them.

    scripts/stub_docs.py [--check]

Needs the package installed: `target/py-tests/bin/python scripts/stub_docs.py` after scripts/test_python.sh. Signatures stay as the stub has them.
`--check` writes nothing and exits with 1 where docstrings are out of step.
"""

from __future__ import annotations

import ast
import inspect
import sys
from pathlib import Path
from typing import Any

STUB = Path(__file__).resolve().parents[1] / "crates/py/python/tumble/_native.pyi"


def documented(source: str, module: Any) -> str:
    """Returns the stub's text with the docstrings of the module."""
    lines = source.splitlines()
    for node, doc in reversed(definitions(ast.parse(source), module)):
        first = node.body[0]
        written = quoted(doc, node.col_offset + 4)
        if isinstance(node, ast.ClassDef):
            present = slice(first.lineno - 1, first.end_lineno) if is_docstring(first) else slice(node.lineno, node.lineno)
            lines[present] = written
            continue
        inline = lines[first.lineno - 1][: first.col_offset].strip() != ""
        head = lines[node.lineno - 1 : first.lineno - (not inline)]
        if inline:
            head[-1] = head[-1][: first.col_offset]
        head[-1] = head[-1].rstrip() + ("" if written else " ...")
        lines[node.lineno - 1 : node.body[-1].end_lineno] = head + written
    return "\n".join(lines) + "\n"


def definitions(tree: ast.AST, owner: Any) -> list[tuple[ast.ClassDef | ast.FunctionDef, str | None]]:
    """Classes and functions in the order of the text, each with its docstring, if it has one to show."""
    found: list[tuple[ast.ClassDef | ast.FunctionDef, str | None]] = []
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.ClassDef):
            value = getattr(owner, node.name)
            found += [(node, value.__doc__), *definitions(node, value)]
        elif isinstance(node, ast.FunctionDef):
            special = node.name.startswith("__") or any(isinstance(d, ast.Attribute) for d in node.decorator_list)
            found.append((node, None if special else getattr(owner, node.name).__doc__))
    return found


def is_docstring(node: ast.stmt) -> bool:
    """Whether a statement is a bare string."""
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)


def quoted(doc: str | None, indent: int) -> list[str]:
    """The lines of a docstring; none of no docstring."""
    if not doc:
        return []
    margin = " " * indent
    first, *rest = inspect.cleandoc(doc).replace("\\", "\\\\").replace('"""', r"\"\"\"").splitlines()
    body = [margin + line if line else "" for line in rest]
    if not body:
        return [f'{margin}"""{first}"""']
    return [f'{margin}"""{first}', *body, f'{margin}"""']


def main() -> int:
    """Writes the stub, or compares it."""
    import tumble._native

    source = STUB.read_text(encoding="utf-8")
    wanted = documented(source, tumble._native)
    if "--check" in sys.argv[1:]:
        return int(source != wanted)
    STUB.write_text(wanted, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
