"""A quadruped stands on position drives: its four feet carry its weight.   python examples/quadruped.py"""

import numpy as np
import tumble

LEGS = {"front_left": (0.25, 0.15), "front_right": (0.25, -0.15), "rear_left": (-0.25, 0.15), "rear_right": (-0.25, -0.15)}
THIGH = dict(axis=(0, 1, 0), shape=tumble.Capsule(0.02, 0.2), shape_position=(0, 0, -0.1), mass=0.8, q=np.radians(40))
SHANK = dict(axis=(0, 1, 0), shape=tumble.Sphere(0.025), shape_position=(0, 0, -0.2), mass=0.2, q=np.radians(-80))
world, builder = tumble.World(), tumble.ArticulationBuilder("dog")
builder.add_link("trunk", joint="floating", shape=tumble.Box((0.6, 0.3, 0.1)), mass=10)
for leg, (x, y) in LEGS.items():
    builder.add_link(f"{leg}_thigh", "trunk", position=(x, y, 0), **THIGH)
    builder.add_link(f"{leg}_shank", f"{leg}_thigh", position=(0, 0, -0.2), **SHANK)
world.add_static("ground", tumble.HalfSpace())
dog = world.add_articulation(builder, base=(0, 0, 0.4))
for joint, angle in zip(dog.joint_names[1:], dog.q[7:]):
    dog.set_drive(joint, target=angle, stiffness=300, damping=10)
soles = {leg: world.add_sensor("touch", (dog, f"{leg}_shank")) for leg in LEGS}
world.step(3 * 240)
forces = {leg: float(foot.value[0]) for leg, foot in soles.items()}
feet = ", ".join(f"{leg} {force:.3f} N" for leg, force in forces.items())
print(f"{feet}; sum {sum(forces.values()):.4f} N, weight {dog.mass * 9.81:.4f} N")
