"""A recording as an animation for a notebook, which plays without a kernel, and as a page.   python examples/notebook_animation.py"""

import tumble

world = tumble.World(dt=1 / 240)
world.add_static("floor", tumble.HalfSpace(), restitution=0.8)
ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=1, position=(0, 0, 1.1), restitution=0.8)
with tumble.Recorder("bounce.mcap") as recorder:
    recorder.run(world, 480, every=4)
recording = tumble.read("bounce.mcap")
camera = tumble.Camera((3, -3, 1.2), (0, 0, 0.5))
animation = recording.animation(world, width=240, height=180, fps=15, camera=camera)  # the last line of a cell shows it
animation.save("bounce.html")
animation.save("bounce.png")  # an animated PNG
print(animation)
