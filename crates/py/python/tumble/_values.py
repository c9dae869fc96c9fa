"""What a world answers with more than one number."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray


class Energy(NamedTuple):
    """Mechanical energy of everything that moves, J. ``energy["kinetic"]`` works too."""

    kinetic: float
    """Of motion."""
    potential: float
    """In the world's gravity, zero at its origin."""
    total: float
    """The sum of the two."""

    def __getitem__(self, key: Any) -> Any:
        return _item(self, key)


class Momentum(NamedTuple):
    """Momentum of everything that moves, world axes. ``momentum["linear"]`` works too."""

    linear: NDArray[np.float64]
    """Shape (3,), N·s."""
    angular: NDArray[np.float64]
    """Shape (3,), about the world's origin, N·m·s."""

    def __getitem__(self, key: Any) -> Any:
        return _item(self, key)


def _item(values: tuple[Any, ...], key: Any) -> Any:
    if isinstance(key, str) and key in values._fields:  # type: ignore[attr-defined]
        return getattr(values, key)
    return tuple.__getitem__(values, key)


class SphereLevel(NamedTuple):
    """The balls of one level of a :class:`SphereTree`, in the axes of its mesh."""

    centers: NDArray[np.float64]
    """Shape (n, 3), m."""
    radii: NDArray[np.float64]
    """Shape (n,), m."""
