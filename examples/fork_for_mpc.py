"""Control by trial: a fork of the world takes each candidate into the future, and the best one acts.   python examples/fork_for_mpc.py"""

import numpy as np
import tumble

builder = tumble.ArticulationBuilder("crane")  # a trolley with a load on a rod of 1 m
builder.add_link("trolley", joint="prismatic", axis=(1, 0, 0), mass=2)
builder.add_link("load", "trolley", axis=(0, 1, 0), mass=1, center_of_mass=(0, 0, -1))
world = tumble.World(dt=1 / 100)
crane, path, predicted = world.add_articulation(builder), [], []
GOAL, PUSHES, AHEAD = 1.5, np.linspace(-12, 12, 13), 60  # m, N, steps


def cost(future: tumble.World, push: float) -> float:
    """Pushes for 0.2 s, lets go, and adds up how far trolley and load are from rest at the goal."""
    other, total = future.articulation("crane"), 0.0
    for k in range(AHEAD):
        other.tau = push if k < 20 else -4 * other.qd[0], 0
        future.step()
        total += (other.q[0] - GOAL) ** 2 + 0.3 * other.qd[0] ** 2 + 0.5 * other.q[1] ** 2 + 0.1 * other.qd[1] ** 2
    return total


for _ in range(60):
    crane.tau = PUSHES[np.argmin([cost(world.fork(), push) for push in PUSHES])], 0
    world.step(10)
    path.append((*crane.q, *crane.qd))
print(f"after 6 s: {abs(path[-1][0] - GOAL):.3f} m from the goal, the load swings by {np.degrees(abs(np.array(path[-8:])[:, 1]).max()):.2f} degrees")
assert abs(path[-1][0] - GOAL) < 0.05 and np.abs(np.array(path)[-8:, 1]).max() < np.radians(3)
