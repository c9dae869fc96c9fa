"""Two hundred worlds of random mass, friction, step and speed: each block stops after v²/(2µg), whatever its mass.

    python examples/domain_randomization.py
"""

import numpy as np
import tumble

rng, errors = np.random.default_rng(3), []
for _ in range(200):
    mass, speed, dt = 10 ** rng.uniform(-3, 3), rng.uniform(1, 5), 1 / rng.integers(120, 1000)
    friction = rng.uniform(0.2, 1.0)
    world = tumble.World(dt=dt)
    world.add_static("floor", tumble.HalfSpace(), friction=friction)
    block = world.add_rigid("block", tumble.Box((1, 1, 0.2)), mass=mass, position=(0, 0, 0.1), velocity=(speed, 0, 0), friction=friction)
    world.step(int(1.1 * speed / (friction * 9.81) / dt))
    errors.append(block.position[0] / (speed**2 / (2 * friction * 9.81)) - 1)
print(f"{len(errors)} worlds: stopping distances within {np.abs(errors).max():.1e} of v²/(2µg)")
