"""Unknown keyword arguments of functions written in Python: the error names the nearest known one, as for those of the compiled module."""

from __future__ import annotations

import difflib
import functools
import inspect
from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeVar

_Function = TypeVar("_Function", bound=Callable[..., Any])
_Class = TypeVar("_Class", bound=type)


def refuse_unknown(place: str, words: Iterable[str], known: Sequence[str]) -> None:
    """Raises ``TypeError`` for the first word that is not known. place: what was called."""
    for word in words:
        if word not in known:
            near = difflib.get_close_matches(word, known, 1, 0.6)
            hint = f"did you mean '{near[0]}'?" if near else f"there are {', '.join(known)}"
            raise TypeError(f"{place}() got an unexpected keyword argument '{word}'; {hint}")


def hinted(function: _Function) -> _Function:
    """Decorates a function or method without ``**words``."""
    place = function.__qualname__.removesuffix(".__new__")
    known = [p.name for p in inspect.signature(function).parameters.values() if p.kind in (p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY)]
    of_a_method = "." in function.__qualname__
    known = known[1:] if of_a_method else known

    @functools.wraps(function)
    def call(*args: Any, **words: Any) -> Any:
        refuse_unknown(place, words, known)
        return function(*args, **words)

    return call  # type: ignore[return-value]


def hinted_fields(cls: _Class) -> _Class:
    """Decorates a class of named fields."""
    new = cls.__new__
    new.__qualname__ = f"{cls.__name__}.__new__"
    cls.__new__ = hinted(new)  # type: ignore[method-assign]
    return cls
