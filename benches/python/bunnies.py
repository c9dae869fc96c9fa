"""Step times of piles of bunnies as raw meshes: 100 of 1,500 triangles, and 10 of 6,600 beside 10 of about 60,000.

python benches/python/bunnies.py FOLDER      a folder with bunny.obj and low/bunny1500.obj: the public meshes
"""

import sys
import time
from pathlib import Path

import numpy as np
import tumble


def read(path):
    lines = [line.split() for line in path.read_text().splitlines()]
    vertices = np.array([line[1:4] for line in lines if line[:1] == ["v"]], float)
    faces = np.array([[corner.split("/")[0] for corner in line[1:4]] for line in lines if line[:1] == ["f"]], int) - 1
    return vertices, faces


def finer(vertices, faces, count):
    """Halves the longest edges until there are at least ``count`` triangles: the same surface, more memory."""
    while len(faces) < count:
        ends = np.sort(np.stack([faces, np.roll(faces, -1, 1)], 2), 2)
        length = np.linalg.norm(vertices[ends[..., 0]] - vertices[ends[..., 1]], axis=2)
        edges, index = np.unique(ends.reshape(-1, 2), axis=0, return_inverse=True)
        index = index.reshape(faces.shape)
        # an edge is halved if it is the longest of both of its triangles; those share no other edge that is
        longest = np.bincount(index[np.arange(len(faces)), length.argmax(1)], minlength=len(edges)) == 2
        chosen = np.flatnonzero(longest)
        number = np.full(len(edges), -1)
        number[chosen] = len(vertices) + np.arange(len(chosen))
        vertices = np.concatenate([vertices, vertices[edges[chosen]].mean(1)])
        at = longest[index]
        split, side = at.any(1), at.argmax(1)
        rolled = np.take_along_axis(faces, (side[:, None] + np.arange(3)) % 3, 1)[split]
        middle = number[index[np.arange(len(faces)), side]][split]
        halves = [np.stack([rolled[:, 0], middle, rolled[:, 2]], 1), np.stack([middle, rolled[:, 1], rolled[:, 2]], 1)]
        faces = np.concatenate([faces[~split], *halves])
    return vertices, faces


def pile(name, mesh, count, seconds=2.0):
    """Drops bunnies in a box and returns the mean time of a step in the last second, ms of the processor."""
    world = tumble.World(dt=1 / 240)
    world.add_static("ground", tumble.HalfSpace())
    side = 4 if count > 20 else 2
    spacing = 0.5
    for x, y, angle in ((1, 0, 0), (-1, 0, 0), (0, 1, 1), (0, -1, 1)):
        size = (0.1, spacing * (side + 1), 4) if angle == 0 else (spacing * (side + 1), 0.1, 4)
        world.add_static(tumble.Box(size), position=(x * spacing * side * 0.55, y * spacing * side * 0.55, 2))
    rng = np.random.default_rng(1)
    for k in range(count):
        q = rng.normal(size=4)
        place = np.array([k % side - (side - 1) / 2, k // side % side - (side - 1) / 2, k // side**2 + 0.6]) * spacing
        world.add_rigid(f"bunny {k}", mesh, density=500, position=place, orientation=q / np.linalg.norm(q))
    times = []
    for _ in range(int(seconds * 240)):
        start = time.process_time()
        world.step()
        times.append(1000 * (time.process_time() - start))
    times = np.array(times)
    print(f"{name}: {times.mean():.1f} ms a step on the average, {times[:240].mean():.1f} in the first second, {times[-240:].mean():.1f} in the last, {len(world.contacts)} contacts at the end")
    return times[-240:].mean()


folder = Path(sys.argv[1])
vertices, faces = read(folder / "bunny.obj")
scale = 0.4 / np.ptp(vertices, axis=0).max()
low = read(folder / "low" / "bunny1500.obj")
pile(f"100 bunnies of {len(low[1])} triangles", tumble.Mesh(low[0] * scale, low[1]), 100)
coarse = pile(f"10 bunnies of {len(faces)} triangles", tumble.Mesh(vertices * scale, faces), 10)
fine = finer(vertices, faces, 60_000)
print(f"ratio {pile(f'10 bunnies of {len(fine[1])} triangles', tumble.Mesh(fine[0] * scale, fine[1]), 10) / coarse:.2f}")
