"""Results of a world that have more than one number."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from tumble._native import Articulation, Joint, RigidBody, ScriptedEvent, Shape
    from tumble.typing import EventKind


class Energy(NamedTuple):
    """Mechanical energy of everything that moves, J. ``energy["kinetic"]`` works too."""

    kinetic: float
    """Kinetic energy, J."""
    potential: float
    """Potential energy in the world's gravity, zero at the origin, and of springs, J."""
    total: float
    """Sum of the two, J."""

    def __getitem__(self, key: Any) -> Any:
        return _item(self, key)


class Momentum(NamedTuple):
    """Momentum of everything that moves, world axes. ``momentum["linear"]`` works too."""

    linear: NDArray[np.float64]
    """Linear momentum, shape (3,), N·s."""
    angular: NDArray[np.float64]
    """Angular momentum about the world's origin, shape (3,), N·m·s."""

    def __getitem__(self, key: Any) -> Any:
        return _item(self, key)


def _item(values: tuple[Any, ...], key: Any) -> Any:
    if isinstance(key, str) and key in values._fields:  # type: ignore[attr-defined]
        return getattr(values, key)
    return tuple.__getitem__(values, key)


class Event(NamedTuple):
    """An event of the last step: see ``World.events``."""

    kind: EventKind
    """What happened."""
    a: RigidBody | Articulation | Joint | ScriptedEvent
    """The body that was added first, the sensor, the body that fell asleep or woke, the joint that broke, or the scripted event that fired."""
    b: RigidBody | Articulation | None
    """The other body; None for sleep and joints."""
    parts: tuple[int, int]
    """For articulations the indices of the touched links in their ``link_names``, which may be fixed ones, else 0."""
    impulse: NDArray[np.float64]
    """Impulse on ``a`` over the step, world axes, shape (3,), N·s; zero for all but contacts that begin or persist."""
    point: NDArray[np.float64]
    """The contact point with the largest impulse, world, shape (3,), m; zero like the impulse."""
    shapes: tuple[int, int]
    """The numbers of the shapes that touch at the point, as in ``World.contacts``; 0 like the impulse."""
    shape_names: tuple[str | None, str | None]
    """The names of these shapes; None for those without one, and without an impulse."""
    links: tuple[str | None, str | None]
    """The names of the touched links of articulations, which may be fixed ones; None for other bodies."""


class Firing(NamedTuple):
    """What made an event fire, for a callable of ``World.add_event``."""

    event: str
    """Name of the event."""
    other: str | None
    """Name of the body that made it fire: the visitor of a sensor, the second side of a contact, or the one that fell asleep or woke."""
    time: float
    """Simulated time, s."""
    impulse: NDArray[np.float64]
    """Impulse of the contact on the other body over the step, world axes, shape (3,), N·s; zero without a contact."""
    point: NDArray[np.float64]
    """The contact point with the largest impulse, world, shape (3,), m; zero without a contact."""


class IntersectPart(NamedTuple):
    """A part that takes part in an intersection test of Python: see ``Intersect``."""

    name: str
    """Name of its object, empty if the world made it."""
    part: int
    """Its number in the object."""
    position: NDArray[np.float64]
    """Origin of its frame in the world, shape (3,), m: for a rigid body the center of mass of its uniform shape."""
    orientation: NDArray[np.float64]
    """Part to world, unit quaternion (x, y, z, w)."""
    rotation: NDArray[np.float64]
    """The same as a matrix, shape (3, 3)."""
    shape: Shape
    """Its shape in its frame."""
    link: str | None
    """Name of the link whose shape it is; None for all but articulations."""
    shape_name: str | None
    """Name of its shape, if it has one; of a compound that of the first part."""


class LinkSpheres(NamedTuple):
    """The spheres of a link of a :class:`SphereRobot`, in the axes of the link."""

    centers: NDArray[np.float64]
    """Centers, shape (n, 3), m."""
    radii: NDArray[np.float64]
    """Radii, shape (n,), m."""
    outward: NDArray[np.float64]
    """Upper bounds of the distances by which they reach outside the shapes of the link, shape (n,), m."""
    coverage: float
    """Share of the outer surface, by area, that is proved to lie inside."""
    shapes: int
    """Number of collision elements that the link had."""
    mean_outward: float
    """Mean by area of the distance by which the exposed surface of the spheres is outside the shapes, m. Sampled."""
    volume: float
    """Volume of the union of the shapes, m³. Sampled."""
    volume_outside: float
    """Volume of the union of the spheres outside the shapes, m³. Sampled."""


class SphereLevel(NamedTuple):
    """The spheres of one level of a :class:`SphereTree`, in the axes of its mesh."""

    centers: NDArray[np.float64]
    """Centers, shape (n, 3), m."""
    radii: NDArray[np.float64]
    """Radii, shape (n,), m."""
