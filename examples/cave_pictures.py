"""The pictures of the screens of a CAVE: each facet by itself, all of them unfolded, and their difference from a plain camera.

    python examples/cave_pictures.py [FOLDER]
"""

import sys
from pathlib import Path

import numpy as np

import tumble

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
folder.mkdir(parents=True, exist_ok=True)

world = tumble.World.load("stack")
world["crate_10"].apply_impulse((0, 150.0, 0))  # N·s: the top crate is knocked off
world.step(round(0.7 / world.dt))

# a facet's frustum leans from the user's eye to the corners of its screen (Kooima, Generalized Perspective Projection, 2009)
try:
    pictures = {name: world.render(facet=f"cube4:{name}") for name in ("left", "front")}
except tumble.PictureError as error:
    sys.exit(f"no picture: {error}")
for name, picture in pictures.items():
    tumble.save_png(folder / f"{name}.png", picture)
    print(f"{name:<6} {picture.shape[1]} x {picture.shape[0]} pixels")
tumble.save_png(folder / "unfolded.png", world.render(800, 600, cave="cube4"))

# neighboring screens meet at an edge: there both must show the same
left, front = (pictures[name][..., :3].astype(float) for name in ("left", "front"))
seam = np.abs(left[:, -1] - front[:, 0]).mean()
usual = np.abs(left[:, -1] - front[:, front.shape[1] // 2]).mean()
print(f"across the seam of left and front pixels differ by {seam:.1f} of 255; from the middle of the front by {usual:.1f}")
assert seam < usual
