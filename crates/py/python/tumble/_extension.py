"""Forces and behaviours written in Python."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from typing_extensions import Self

    from tumble._native import View


class Force:
    """A force of your own: subclass it, write ``apply``, and give it to ``World.add_force``.

    It is asked at every evaluation of forces: once a step with the default integrator, four times with ``rk4``. It should depend on the view
    alone; what it remembers between calls it must be able to ``fork``.
    """

    def apply(self, view: View) -> None:
        """Adds to ``view.force`` (n, 3), N, and ``view.torque`` (n, 3), N·m: world axes, one row for each rigid body or link.

        What it raises ends the step and reaches its caller; the world is then as it was before that frame. The world itself cannot be used
        meanwhile (``BusyError``).
        """
        raise NotImplementedError(f"{type(self).__name__} must define apply(self, view)")

    def fork(self) -> Self:
        """The force of a fork of the world: by default a deep copy, so that forks share nothing that changes."""
        return copy.deepcopy(self)


class Behaviour:
    """How some bodies act of themselves, as a boid does: subclass it, write ``act``, and give it to ``World.add_behaviour``.

    It is asked once a step, before it; what it does acts during that step.
    """

    def act(self, view: View, rows: NDArray[np.int64]) -> None:
        """Adds to ``view.force`` and ``view.torque``, as a force does. ``rows``: those of the bodies it was given, shape (k,)."""
        raise NotImplementedError(f"{type(self).__name__} must define act(self, view, rows)")

    def fork(self) -> Self:
        """The behaviour of a fork of the world: by default a deep copy."""
        return copy.deepcopy(self)


def check_force(value: object) -> None:
    """A ``TypeError`` for what is no force."""
    _check(Force, value)


def check_behaviour(value: object) -> None:
    """A ``TypeError`` for what is no behaviour."""
    _check(Behaviour, value)


def _check(kind: type[Force] | type[Behaviour], value: object) -> None:
    if not isinstance(value, kind):
        given = f"the class {value.__name__} itself" if isinstance(value, type) else type(value).__name__
        raise TypeError(f"wanted an object of a subclass of tumble.{kind.__name__}, and not {given}")
