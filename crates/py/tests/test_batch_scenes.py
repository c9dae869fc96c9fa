"""Worlds of every shipped scene in a batch, each from another state: the bytes of each are those of the world alone, whatever the others do."""

import numpy as np
import pytest

import tumble

STEPS = 12


def scenes():
    from pathlib import Path

    folder = Path(__file__).resolve().parents[3] / "scenes"
    return sorted(path.parent.name for path in folder.glob("*/scene.toml"))


@pytest.mark.parametrize("name", scenes())
def test_a_batch_of_a_scene(name):
    world = tumble.World.load(name)
    heights = np.random.default_rng(1).uniform(0, 1e-3, 4)

    def configure(fork, k):
        for body in fork.bodies:
            if isinstance(body, tumble.RigidBody) and body.mode == "dynamic":
                body.velocity = np.asarray(body.velocity) + (0.1 * k, 0, heights[k])

    alone = [world.fork() for _ in heights]
    for k, fork in enumerate(alone):
        configure(fork, k)
    batch = tumble.Batch(world, len(heights), threads=2, configure=configure)
    for _ in range(STEPS):
        batch.step()
    for k, fork in enumerate(alone):
        fork.step(STEPS)
        assert batch.world(k).save() == fork.save()
        assert batch.world(k).contacts.tobytes() == fork.contacts.tobytes()
        assert len(batch.world(k).events) == len(fork.events)
