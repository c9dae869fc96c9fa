"""Groups, a pair that is ignored, and a gate that counts what falls through it.   python examples/filters_and_triggers.py"""

import tumble

DEBRIS = 3
world = tumble.World(dt=1 / 1000)
floor = world.add_static("floor", tumble.HalfSpace())
gate = world.add_static("gate", tumble.Box((9, 9, 0.02)), position=(0, 0, 2), sensor=True)
crate = world.add_rigid("crate", tumble.Box(0.5), mass=5, position=(0, 0, 0.25))
ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=1, position=(0, 0, 4))  # falls on the crate
ghost = world.add_rigid("ghost", tumble.Sphere(0.1), mass=1, position=(0.22, 0, 5), group=DEBRIS)  # through it, onto the floor
world.set_pair_material("ghost", "crate", collides=False)
shade = world.add_rigid("shade", tumble.Sphere(0.1), mass=1, position=(2, 0, 6), group=DEBRIS, mask=[DEBRIS])  # through all but debris

passed, blows = {}, []
for _ in range(2000):
    world.step()
    for event in world.events:
        if event.kind == "sensor_begin":
            passed[event.b.name] = world.time
        elif event.kind.startswith("contact") and {event.a.name, event.b.name} == {"ball", "crate"}:
            blows.append((world.time, abs(event.impulse[2])))
print({name: round(time, 3) for name, time in passed.items()}, f"the ball lands at {blows[0][0]:.3f} s")
