"""A custom force: a wind that blows harder higher up, on balls of three masses.

    python examples/wind_force.py
"""

import numpy as np

import tumble


class Wind(tumble.Force):
    """Linear drag towards the air, which moves along x: ``speed`` m/s at 10 m, and with the seventh root of the height elsewhere."""

    def __init__(self, speed: float, drag: float) -> None:
        self.speed, self.drag = speed, drag

    def air(self, height: np.ndarray) -> np.ndarray:
        velocity = np.zeros((len(height), 3))
        velocity[:, 0] = self.speed * (np.maximum(height, 0.0) / 10.0) ** (1 / 7)
        return velocity

    def apply(self, view: tumble.View) -> None:
        # one row for each body: no loop; static bodies are not affected
        view.force += self.drag * (self.air(view.position[:, 2]) - view.velocity)


world = tumble.World()
world.add_static("ground", tumble.HalfSpace())
masses = {"feather": 0.005, "shuttlecock": 0.05, "stone": 1.0}
for k, (name, mass) in enumerate(masses.items()):
    world.add_rigid(name, tumble.Sphere(0.05), mass=mass, position=(0, k, 10.0))
world.add_force("wind", Wind(speed=5.0, drag=0.05))

while world["stone"].position[2] > 0.06:
    world.step()
print(f"after {world.time:.2f} s the stone is down")
for name in masses:
    x, _, z = world[name].position
    print(f"{name:<12} has drifted {x:6.3f} m and is {z:6.3f} m up, falling at {-world[name].velocity[2]:.3f} m/s")

# where drag and weight balance, v = m·g/c
terminal = masses["feather"] * 9.81 / 0.05
assert abs(-world["feather"].velocity[2] - terminal) < 1e-6
