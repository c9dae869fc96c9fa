"""Results of a world that have more than one number."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray


class Energy(NamedTuple):
    """Mechanical energy of everything that moves, J. ``energy["kinetic"]`` works too."""

    kinetic: float
    """Kinetic energy, J."""
    potential: float
    """Potential energy in the world's gravity, zero at the origin, J."""
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


class SphereLevel(NamedTuple):
    """The spheres of one level of a :class:`SphereTree`, in the axes of its mesh."""

    centers: NDArray[np.float64]
    """Centers, shape (n, 3), m."""
    radii: NDArray[np.float64]
    """Radii, shape (n,), m."""
