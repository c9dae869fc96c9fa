"""Forces, behaviors and intersection tests written in Python."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from typing_extensions import Self

    from tumble._native import View
    from tumble._values import IntersectPart


class Force:
    """Base class of custom forces: define ``apply`` and pass an object to ``World.add_force``.

    It is called at every evaluation of forces: once per step with the default integrator, four times with ``rk4``. It should depend on the view
    only. ``fork`` must copy any data that it keeps between calls.
    """

    def apply(self, view: View) -> None:
        """Adds to ``view.force`` (n, 3), N, and ``view.torque`` (n, 3), N·m: world axes, one row for each rigid body or link.

        An exception ends the step and is raised there; the world then has its state before that step. The world cannot be used within the call
        (``BusyError``).
        """
        raise NotImplementedError(f"{type(self).__name__} must define apply(self, view)")

    def fork(self) -> Self:
        """Returns the force for a fork of the world: by default a deep copy, so forks share no data that changes."""
        return copy.deepcopy(self)


class Behavior:
    """Base class of behaviors, such as those of boids: define ``act`` and pass an object to ``World.add_behavior``.

    It is called once before each step. Its forces act during that step.
    """

    def act(self, view: View, rows: NDArray[np.int64]) -> None:
        """Adds to ``view.force`` and ``view.torque``, as a force does. rows: the rows of its bodies, shape (k,)."""
        raise NotImplementedError(f"{type(self).__name__} must define act(self, view, rows)")

    def fork(self) -> Self:
        """Returns the behavior for a fork of the world: by default a deep copy."""
        return copy.deepcopy(self)


class Intersect:
    """Base class of intersection tests of a body's own: define ``contacts`` and pass an object as ``intersect`` of ``World.add_rigid``, or to
    ``Articulation.set_intersect`` for a link.

    It is the narrow phase of all pairs with that body or link. The shape of the body surrounds the true surface: the broad phase, rays, distances,
    particles and pictures see the shape. The object is called on any thread, by forks too, and must not change.
    """

    def contacts(self, own: IntersectPart, other: IntersectPart, margin: float) -> Iterable[Sequence[object]] | None:
        """Returns all contacts between the body and another part whose gap is at most ``margin``, m; None leaves the pair to the shapes.

        A contact is ``(point, normal, gap)``: midway between the surfaces, shape (3,), m; unit vector from the other part towards the own one;
        distance, m, negative for overlap. Behind them may stand ``feature``, a whole number that the same features keep while they touch (by
        default the number in the list), and ``core_own``, ``core_other``: radii of curvature there, m, 0 (the default) for a flat side, whose
        normal turns with its body. An exception ends the step and is raised there; the world then has its state before that step.
        """
        raise NotImplementedError(f"{type(self).__name__} must define contacts(self, own, other, margin)")


def check_force(value: object) -> None:
    """Raises ``TypeError`` for anything but a force."""
    _check(Force, value)


def check_behavior(value: object) -> None:
    """Raises ``TypeError`` for anything but a behavior."""
    _check(Behavior, value)


def check_intersect(value: object) -> None:
    """Raises ``TypeError`` for anything but an intersection test."""
    _check(Intersect, value)


def _check(kind: type[Force] | type[Behavior] | type[Intersect], value: object) -> None:
    if not isinstance(value, kind):
        given = f"the class {value.__name__} itself" if isinstance(value, type) else type(value).__name__
        raise TypeError(f"expected an object of a subclass of tumble.{kind.__name__}, not {given}")
