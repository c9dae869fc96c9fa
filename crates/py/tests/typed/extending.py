"""What a typed program writes that extends the library: checked by mypy --strict, and run."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import tumble


class Wind(tumble.Force):
    """Drag towards still air."""

    def apply(self, view: tumble.View) -> None:
        view.force -= 0.1 * view.velocity


class Rise(tumble.Behavior):
    """Twice its weight, upwards."""

    def act(self, view: tumble.View, rows: NDArray[np.int64]) -> None:
        view.force[rows] -= 2.0 * view.mass[rows, None] * view.gravity


def record(path: Path) -> NDArray[np.float64]:
    """Where a rising ball was."""
    world = tumble.World()
    ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=1.0)
    world.add_force("wind", Wind())
    world.add_behavior("rise", Rise(), [ball])
    with tumble.Recorder(path) as recorder:
        recorder.run(world, 24)
    run: tumble.Recording = tumble.read(path)
    forces: dict[str, tumble.Force] = world.forces
    assert list(forces) == ["wind"] and run.names == ["ball"]
    return run.position("ball")


def balls(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The finest level of a tree."""
    tree = tumble.SphereTree.build(vertices, faces, method="grid", depth=1)
    centers, radii = tree.levels[-1]
    return centers, radii


def picture(world: tumble.World) -> NDArray[np.uint8]:
    """From above."""
    return world.render(64, 48, camera=tumble.Camera(eye=(0, 0, 5), target=(0, 0, 0), up=(0, 1, 0)))
