"""The break of a game of pool, as two pictures and as the paths of the balls.

    python examples/billiards_picture.py [FOLDER]
"""

import sys
from pathlib import Path

import tumble

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
folder.mkdir(parents=True, exist_ok=True)

world = tumble.World.load("billiards")  # a shipped scene; a path works as well
try:
    tumble.save_png(folder / "rack.png", world.render(480, 270))
    start = world.energy().kinetic
    world.step(round(2.0 / world.dt))
    tumble.save_png(folder / "break.png", world.render(480, 270))
    # straight down on the table, which lies along x: the top of the picture is +y
    above = tumble.Camera(eye=(0, 0, 3.2), target=(0, 0, 0.8), up=(0, 1, 0))
    tumble.save_png(folder / "from_above.png", world.render(480, 270, camera=above))
    print(f"the break: {start:.1f} J before, {world.energy().kinetic:.1f} J after {world.time:.1f} s; pictures in {folder}")
except tumble.PictureError as error:
    print(f"no picture: {error}")

try:
    ax = tumble.World.load("billiards").plot_paths(duration=2.0, along="z")
    ax.set_title("the first two seconds")
    ax.figure.savefig(folder / "paths.png", dpi=120)
except ImportError as error:
    print(f"no plot: {error}")
