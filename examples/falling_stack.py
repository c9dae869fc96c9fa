"""Five crates fall onto each other; at rest each face carries the weight of all crates above it.

    python examples/falling_stack.py
"""

import tumble

CRATES, MASS, G = 5, 10.0, 9.81

world = tumble.World(gravity=(0, 0, -G), dt=1 / 240)
world.add_static("ground", tumble.HalfSpace())  # body 0
for k in range(CRATES):
    world.add_rigid(f"crate_{k + 1}", tumble.Box((0.5, 0.5, 0.5)), mass=MASS, position=(0, 0, 0.3 + 0.55 * k))
world.step(2 * 240)

contacts, loads = world.contacts, []  # one row per contact point
for k in range(CRATES):
    between = contacts[(contacts["bodies"] == k).any(axis=1) & (contacts["bodies"] == k + 1).any(axis=1)]
    loads.append(abs(between["force"][:, 2].sum()))
    print(f"under crate {k + 1}: {loads[k]:.4f} N at {len(between)} points; the weight above is {MASS * G * (CRATES - k):.4f} N")
