"""A throw is recorded to a file that Foxglove opens, read back as arrays, continued from its middle, and shown as a video.   python examples/record_and_replay.py [FILE.mcap [VIDEO.mp4]]"""

import sys
import tumble

path = sys.argv[1] if len(sys.argv) > 1 else "throw.mcap"
world = tumble.World(dt=1 / 240)
ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=1, velocity=(3, 0, 5), angular_velocity=(0, 9, 0))
with tumble.Recorder(path) as recorder:
    recorder.run(world, 240, every=4)  # the start and 60 frames

run = tumble.read(path)  # times (n,), and of each body positions (n, 3) and orientations (n, 4)
parabola = 5 * run.times - 9.81 * run.times**2 / 2
error = abs(run.position("ball")[:, 2] - parabola).max()
energies = [each.energy().total for each in tumble.replay(path, world.fork())]  # the world itself at each frame
again = world.fork()
again.restore(run.states[30])  # the exact state of the middle
again.step(120)
same = again.save() == world.save()
if len(sys.argv) > 2:
    run.video(sys.argv[2], world)  # a .png, which is animated, needs no ffmpeg
print(f"{len(run.times)} frames: within {error:.1e} m of the parabola, {energies[0]:.3f} to {energies[-1]:.3f} J, the same end: {same}")
