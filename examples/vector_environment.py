"""A thousand pendulums as one environment: torques in, observations and rewards out, one call per step.   python examples/vector_environment.py"""

import numpy as np
import tumble

N, LENGTH = 1000, 0.5
builder = tumble.ArticulationBuilder("pendulum")
builder.add_link("rod", axis=(0, 1, 0), mass=1, center_of_mass=(0, 0, -LENGTH), inertia=(0, 0, 0))
world = tumble.World(dt=1 / 200)
world.add_articulation(builder)
batch, rng = tumble.Batch(world, N), np.random.default_rng(0)
batch.reset(q=rng.uniform(-np.pi, np.pi, (N, 1)), v=np.zeros((N, 1)))
angle, rate, total = batch.q[:, 0].copy(), batch.v[:, 0].copy(), np.zeros(N)
for _ in range(1400):  # Åström and Furuta: torque along the motion while the energy is below that of standing upright
    energy = 0.5 * LENGTH**2 * rate**2 - 9.81 * LENGTH * np.cos(angle) - 9.81 * LENGTH
    away = np.angle(-np.exp(1j * angle))  # from upright
    torque = np.where(np.abs(away) < 0.5, -20 * away - 4 * rate, np.clip(-2 * energy * np.where(rate < 0, -1, 1), -1.5, 1.5))
    batch.step(torque[:, None])
    angle, rate = batch.q[:, 0].copy(), batch.v[:, 0].copy()
    total -= away**2
upright = np.abs(np.angle(-np.exp(1j * angle))) < 0.05
print(f"{upright.sum()} of {N} stand upright after {batch.time[0]:.0f} s; mean return {total.mean():.0f}")
