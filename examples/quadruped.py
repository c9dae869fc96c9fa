"""A quadruped stands on position drives: its four feet carry its weight.   python examples/quadruped.py"""

import tumble

LINKS = '{ name = "trunk", shape = { type = "box", size_m = [0.6, 0.3, 0.1] }, mass_kg = 10 },'
DRIVE = '{ type = "position", stiffness_n_m_per_rad = 300, damping_n_m_s_per_rad = 10 }'
LEGS = {"front_left": (0.25, 0.15), "front_right": (0.25, -0.15), "rear_left": (-0.25, 0.15), "rear_right": (-0.25, -0.15)}
for leg, (x, y) in LEGS.items():
    LINKS += f"""
    {{ name = "{leg}_thigh", parent = "trunk", position_m = [{x}, {y}, 0], joint = "revolute", axis = [0, 1, 0], angle_deg = 40, drive = {DRIVE},
       shape = {{ type = "capsule", radius_m = 0.02, length_m = 0.2, position_m = [0, 0, -0.1] }}, mass_kg = 0.8 }},
    {{ name = "{leg}_shank", parent = "{leg}_thigh", position_m = [0, 0, -0.2], joint = "revolute", axis = [0, 1, 0], angle_deg = -80, drive = {DRIVE},
       shape = {{ type = "sphere", radius_m = 0.025, position_m = [0, 0, -0.2] }}, mass_kg = 0.2 }},"""
GROUND = '{ name = "ground", mode = "static", shape = { type = "half_space" } }'
world = tumble.World.parse(f'body = [{GROUND}]\n[[articulated]]\nname = "dog"\nfloating = true\nposition_m = [0, 0, 0.4]\nlink = [\n{LINKS}\n]')

world.step(3 * 240)
dog, forces = world.articulation("dog"), {}
for contact in world.contacts:  # parts are places in link_names; the force is on the first body, which is the dog or the ground
    side = list(contact["bodies"]).index(1)
    foot = dog.link_names[contact["parts"][side]]
    forces[foot] = forces.get(foot, 0.0) + (1 - 2 * side) * contact["force"][2]
print(", ".join(f"{foot} {force:.3f} N" for foot, force in forces.items()), f"; sum {sum(forces.values()):.4f} N, weight {dog.mass * 9.81:.4f} N")
