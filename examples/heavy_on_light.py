"""A cube of 1000 kg is set down on one of 1 g: how far the heavy one sinks, and what the ground carries.   python examples/heavy_on_light.py"""

import tumble

world = tumble.World(dt=1 / 240)
world.add_static("ground", tumble.HalfSpace())
light = world.add_rigid("light", tumble.Box((0.2, 0.2, 0.2)), mass=1e-3, position=(0, 0, 0.1))
heavy = world.add_rigid("heavy", tumble.Box((0.2, 0.2, 0.2)), mass=1e3, position=(0, 0, 0.3))
world.step(2 * 240)

sinks = 0.3 - heavy.position[2]
contacts = world.contacts
load = contacts["force"][(contacts["bodies"] == 0).any(axis=1), 2].sum()
print(f"sinks by {1e6 * sinks:.6f} µm; the ground carries {abs(load):.4f} N of {1000.001 * 9.81:.4f} N")
