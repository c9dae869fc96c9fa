"""A sphere tree of a mesh that numpy makes: how well each level of spheres approximates the solid.

    python examples/sphere_tree.py [MESH.obj]
"""

import sys

import numpy as np

import tumble


def torus(major: float, minor: float, around: int = 48, across: int = 24) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n, 3) and faces (m, 3) of a ring about z, counter-clockwise seen from outside."""
    u, v = np.meshgrid(2 * np.pi * np.arange(around) / around, 2 * np.pi * np.arange(across) / across, indexing="ij")
    away = major + minor * np.cos(v)
    vertices = np.stack([away * np.cos(u), away * np.sin(u), minor * np.sin(v)], axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    at = lambda i, j: (i % around) * across + j % across  # noqa: E731
    a, b, c, d = at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)
    return vertices, np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)], 2).reshape(-1, 3)


mesh = (sys.argv[1],) if len(sys.argv) > 1 else torus(1.0, 0.3)
tree = tumble.SphereTree.build(*mesh, method="medial", branching=8, depth=2)
print(tree)
print(tree.report())

# the spheres are arrays: for example their total volume without overlap
for k, (centers, radii) in enumerate(tree.levels):
    volume = 4 / 3 * np.pi * (radii**3).sum()
    print(f"level {k}: {len(centers)} balls of {radii.min():.3f} to {radii.max():.3f} m, {volume:.3f} m³ one by one")
print(f"the finest balls reach at most {1e3 * tree.outward_error:.1f} mm outside the solid: a bound that is proved, not sampled")

tree.save("torus_tree.json")
assert tumble.SphereTree.load("torus_tree.json").to_json() == tree.to_json()
