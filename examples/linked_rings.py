"""A ring hangs in another, as links of a chain do: concave meshes collide without hulls or decomposition.   python examples/linked_rings.py"""

import numpy as np
import tumble

R, r, AROUND, ACROSS = 0.05, 0.01, 48, 24  # m; 2304 triangles

u, v = np.meshgrid(2 * np.pi * np.arange(AROUND) / AROUND, 2 * np.pi * np.arange(ACROSS) / ACROSS, indexing="ij")
points = np.stack([(R + r * np.cos(v)) * np.cos(u), (R + r * np.cos(v)) * np.sin(u), r * np.sin(v)], axis=-1).reshape(-1, 3)
i, j = (index.ravel() for index in np.meshgrid(np.arange(AROUND), np.arange(ACROSS), indexing="ij"))
a, b, c, d = (x % AROUND * ACROSS + y % ACROSS for x, y in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)))
ring = tumble.Mesh(points, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]))

world = tumble.World(dt=1 / 240)
world.add_static("upper", ring, orientation=(0.5**0.5, 0, 0, 0.5**0.5))  # its axis along y
lower = world.add_rigid("lower", ring, density=1000, position=(0, 0, -0.079), orientation=(0, 0.5**0.5, 0, 0.5**0.5))  # along x
world.step(2 * 240)
contacts = world.contacts
held = abs(contacts["force"][:, 2].sum())
print(f"hangs {1000 * -lower.position[2]:.4f} mm below, by theory {2000 * (R - r):.4f}; held by {held:.6f} N, weighs {lower.mass * 9.81:.6f} N")
