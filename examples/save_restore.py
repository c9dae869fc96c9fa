"""A snapshot taken in mid-fall: restored in the same world, a fork, a pickled copy and a new world, its future has the same bits.

    python examples/save_restore.py
"""

import pickle
import tumble


def build() -> tumble.World:
    world = tumble.World(dt=1 / 240)
    world.add_static("ground", tumble.HalfSpace(), restitution=0.5)
    for k in range(8):
        world.add_rigid(f"box_{k}", tumble.Box((0.4, 0.3, 0.2)), density=500, position=(0.1 * k, 0, 1 + 0.5 * k), restitution=0.5)
    return world


world = build()
world.step(100)
snapshot = world.save()  # bytes: all that the next step reads; the shapes come with the world it is restored into
for each in (world, world, world.fork(), pickle.loads(pickle.dumps(world)), build()):
    each.restore(snapshot)
    each.step(400)
    print(f"frame {each.frame}: {each.energy().total!r} J, the same bytes: {each.save() == world.save()}")
