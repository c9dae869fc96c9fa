"""A custom behavior: a flock by Reynolds's three rules (Flocks, Herds, and Schools, 1987).

    python examples/boids.py
"""

import numpy as np

import tumble


class Flock(tumble.Behavior):
    """Each boid keeps apart from the near, flies as its neighbors do, and towards the middle of them."""

    def __init__(self, sight: float = 3.0, room: float = 0.6, speed: float = 2.0) -> None:
        self.sight, self.room, self.speed = sight, room, speed

    def act(self, view: tumble.View, rows: np.ndarray) -> None:
        x, v = view.position[rows], view.velocity[rows]
        away = x[:, None] - x  # (k, k, 3): from the second to the first
        distance = np.linalg.norm(away, axis=2) + 1e-9
        near = (distance < self.sight) & ~np.eye(len(x), dtype=bool)
        count = np.maximum(near.sum(axis=1, keepdims=True), 1)
        apart = (away * (near * np.maximum(self.room / distance - 1.0, 0.0))[..., None]).sum(axis=1)
        alike = (near[..., None] * (v - v[:, None])).sum(axis=1) / count
        together = -(near[..., None] * away).sum(axis=1) / count
        pace = np.linalg.norm(v, axis=1, keepdims=True) + 1e-9
        cruise = v * (self.speed / pace - 1.0)
        view.force[rows] += view.mass[rows, None] * (6.0 * apart + 2.0 * alike + 0.5 * together + cruise)


def order(velocities: np.ndarray) -> float:
    """1 where all fly the same way, near 0 where each flies its own."""
    return float(np.linalg.norm((velocities / np.linalg.norm(velocities, axis=1, keepdims=True)).mean(axis=0)))


rng = np.random.default_rng(7)
world = tumble.World(gravity=(0, 0, 0), dt=1 / 60)
boids = [
    world.add_rigid(f"boid_{k}", tumble.Sphere(0.1), mass=0.2, position=rng.uniform(-2, 2, 3), velocity=rng.normal(0, 1, 3)) for k in range(40)
]
world.add_behavior("flock", Flock(), boids)

for second in range(11):
    velocities = np.array([boid.velocity for boid in boids])
    speed = np.linalg.norm(velocities, axis=1).mean()
    print(f"{second:2} s: order {order(velocities):.3f}, mean speed {speed:.2f} m/s")
    world.step(60)
assert order(np.array([boid.velocity for boid in boids])) > 0.95
