"""What a typed program writes: checked by mypy --strict, and run."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import tumble


def fall(seconds: float, gravity: tuple[float, float, float] = (0.0, 0.0, -9.81)) -> NDArray[np.float64]:
    """Where a ball is after some time."""
    world = tumble.World(gravity=gravity, dt=1 / 240)
    ball: tumble.RigidBody = world.add_rigid("ball", tumble.Sphere(0.1), mass=1.0, position=[0, 0, 1])
    world.step(round(seconds * 240))
    energy: float = world.energy().total
    assert np.isfinite(energy)
    return ball.position


def accelerations(urdf: Path) -> NDArray[np.float64]:
    """What an arm does when it is let go."""
    arm = tumble.Articulation.from_urdf(urdf)
    names: list[str] = arm.joint_names
    return arm.forward_dynamics(np.zeros(arm.nq), np.zeros(len(names)), np.zeros(arm.dof))


def why(path: str) -> str | None:
    """What is wrong with a scene, if anything."""
    try:
        tumble.World.load(path)
    except tumble.SceneError as error:
        return str(error)
    return None


def together(model: str) -> NDArray[np.float64]:
    """The positions of 16 worlds after a second."""
    batch = tumble.Batch(tumble.World.load(model), 16, configure=lambda world, k: world.set_pair_material("a", "b", friction=k / 16))
    for _ in range(240):
        batch.step(-batch.v, targets=np.zeros(batch.dof), mask=~batch.failed)
    found = tumble.simulate(batch.world(0).model(), None, np.zeros((4, batch.dof)))
    return np.concatenate([batch.q, found["q"]])
