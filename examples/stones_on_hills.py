"""Stones and spheres on hills: convex hulls of points on a height field, as a picture.

    python examples/stones_on_hills.py [FOLDER]
"""

import sys
from pathlib import Path

import numpy as np

import tumble

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
folder.mkdir(parents=True, exist_ok=True)

# heights[j, i] at y[j], x[i]
x, y = np.meshgrid(np.linspace(-4, 4, 65), np.linspace(-4, 4, 65))
heights = 0.35 * np.sin(1.3 * x) * np.cos(y) + 0.03 * y

world = tumble.World()
world.add_static("hills", tumble.HeightField(heights, size=(8, 8)), friction=0.7)
random = np.random.default_rng(2)
for n in range(14):
    stone = tumble.ConvexHull(random.normal(size=(24, 3)) * random.uniform(0.08, 0.2, 3))
    world.add_rigid(f"stone {n}", stone, density=2600, position=(*random.uniform(-2.5, 2.5, 2), 1.2), friction=0.7)
for n in range(8):
    world.add_rigid(f"sphere {n}", tumble.Sphere(0.15), mass=1, position=(*random.uniform(-2.5, 2.5, 2), 1.0))
world.step(480)

lowest = min(float(point[2]) for point in world.contacts["point"])
print(f"after {world.time:.1f} s: {len(world.contacts['point'])} contacts, the lowest at {lowest:.2f} m")
try:
    camera = tumble.Camera(eye=(5.5, -6, 4), target=(0, 0, 0))
    tumble.save_png(folder / "stones_on_hills.png", world.render(640, 400, camera=camera))
except tumble.PictureError as error:
    print(f"no picture: {error}")
