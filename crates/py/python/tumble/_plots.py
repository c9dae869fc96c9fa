"""Plots on matplotlib, the extra ``plot``: ``pip install ".[plot]"`` in a clone."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from tumble._errors import InvalidValueError

if TYPE_CHECKING:
    from tumble._native import World

# Largest number of points of a curve: more than a figure has pixels.
_POINTS = 1000


def energy(world: World, duration: float, ax: Any) -> Any:
    """Plots kinetic, potential and total energy of a fork over time."""
    times, rows = _follow(world, duration, lambda fork: tuple(fork.energy()))
    ax = _axes(ax, "World.plot_energy")
    for curve, label in zip(np.array(rows).T, ("kinetic", "potential", "total")):
        ax.plot(times, curve, label=label)
    ax.set(xlabel="time, s", ylabel="energy, J")
    ax.legend()
    return ax


def paths(world: World, duration: float, bodies: Any, along: str, ax: Any) -> Any:
    """Plots paths of bodies of a fork, seen along an axis."""
    views = {"x": (1, 2), "y": (0, 2), "z": (0, 1)}
    if along not in views:
        raise InvalidValueError(f"along is {along!r}; it must be 'x', 'y' or 'z'")
    moving = [body.name for body in world.bodies if getattr(body, "mode", "") == "dynamic"]
    given = [bodies] if isinstance(bodies, str) or hasattr(bodies, "name") else bodies
    names = moving if given is None else [getattr(body, "name", body) for body in given]
    _, rows = _follow(world, duration, lambda fork: [fork[name].position for name in names])
    ax = _axes(ax, "World.plot_paths")
    across, up = views[along]
    for name, path in zip(names, np.array(rows).reshape(len(rows), len(names), 3).transpose(1, 2, 0)):
        ax.plot(path[across], path[up], label=name)
    ax.set(xlabel=f"{'xyz'[across]}, m", ylabel=f"{'xyz'[up]}, m", aspect="equal")
    if 0 < len(names) <= 10:
        ax.legend()
    return ax


def _follow(world: World, duration: float, ask: Any) -> tuple[list[float], list[Any]]:
    """Steps a fork and samples it, at most ``_POINTS`` times."""
    if not (np.isfinite(duration) and duration > 0.0):
        raise InvalidValueError(f"duration is {duration}; it must be finite and above 0")
    fork = world.fork()
    steps = max(1, round(duration / fork.dt))
    every = -(-steps // _POINTS)
    times, rows = [fork.time], [ask(fork)]
    for _ in range(steps // every):
        fork.step(every)
        times.append(fork.time)
        rows.append(ask(fork))
    return times, rows


def _axes(ax: Any, name: str) -> Any:
    if ax is not None:
        return ax
    try:
        from matplotlib import pyplot
    except ImportError as error:
        raise ImportError(f"{name} needs the package matplotlib: pip install matplotlib", name="matplotlib") from error
    return pyplot.subplots()[1]
