"""A run recorded to a file that Foxglove opens, read back as arrays, and stepped on from its middle.

    python examples/recording.py [FILE.mcap]
"""

import sys

import numpy as np

import tumble

path = sys.argv[1] if len(sys.argv) > 1 else "stack.mcap"
world = tumble.World.load("stack")
world["crate_10"].apply_impulse((0, 200.0, 0))  # N·s on 50 kg: the top one is knocked off

with tumble.Recorder(path) as recorder:
    recorder.run(world, 360, every=4)  # 60 frames a second, and the beginning

run = tumble.read(path)
print(run)
path_of_top = run.position("crate_10")  # (n, 3)
landed = np.argmax(path_of_top[:, 2] < 0.6)
print(f"the top crate is down after {run.times[landed]:.2f} s, {np.linalg.norm(path_of_top[landed, :2]):.2f} m away")

# as worlds: anything can be asked of them, and each could be drawn
energies = [each.energy().total for each in tumble.replay(path)]
print(f"energy {energies[0]:.1f} J at first, {energies[-1]:.1f} J at last, after {len(energies)} frames")

# the file holds the exact state: from the middle the future is the same to the last bit
again = tumble.World.load("stack")
again.restore(run.states[30])
again.step(360 - 30 * 4)
assert (again.state == world.state).all()
print(f"stepped on from {run.times[30]:.2f} s: the same end, bit for bit")
