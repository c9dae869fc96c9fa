"""A key lifts the five pins of a lock to the shear line and turns its plug.   python examples/pin_lock.py [PICTURE.png]"""

import sys

import numpy as np
import tumble

# m: radii of the plug, of the hole it turns in and of the housing; half widths of pin holes and keyway; play to each side
R, BORE, OUTER, WIDE, NARROW, PLAY = 0.060, 0.0605, 0.115, 0.008, 0.004, 0.0003
FLOOR, LEDGE, ROOF = np.sqrt(np.array([0.016, 0.024, 0.040]) ** 2 - NARROW**2)  # of the keyway, of the pins without a key
CUTS, Z = np.array([0.028, 0.036, 0.032, 0.026, 0.034]), 0.026 * (np.arange(5) - 2)  # of the right key: heights, places
PLANES = np.sort([*(Z - WIDE), *(Z + WIDE), -0.075, 0.075])


def solid(heights, filled):  # a closed mesh of the filled cells between rings, whose last three columns are slots, and planes
    start = np.arcsin(WIDE / (radii := np.hypot(heights, NARROW)[:, None]))
    angles = np.hstack([start + 2 * (np.pi - start) * np.linspace(0, 1, 90), np.arcsin(np.array([-NARROW, NARROW]) / radii)])
    rings = radii[:, :, None] * np.stack([np.sin(angles), np.cos(angles)], 2)
    points = np.concatenate([np.repeat(rings[:, :, None], 12, 2), np.broadcast_to(PLANES[:, None], (*angles.shape, 12, 1))], 3)
    full, faces = np.pad(np.pad(filled, ((1, 1), (0, 0), (1, 1))), ((0, 0), (1, 1), (0, 0)), "wrap").astype(int), []
    for axis, inner in enumerate([np.s_[:, 1:-1, 1:-1], np.s_[1:-1, :-1, 1:-1], np.s_[1:-1, 1:-1]]):
        side, (u, v) = np.diff(full[inner], axis=axis), np.eye(3, dtype=int)[[(axis + 1) % 3, (axis + 2) % 3]]
        for place in np.argwhere(side):
            quad = (np.array([0 * u, u, u + v, v]) + place)[:: side[tuple(place)]] % (99, 92, 99)
            faces += [quad[[0, 1, 2]], quad[[0, 2, 3]]]
    used, index = np.unique(np.concatenate(faces), axis=0, return_inverse=True)
    return tumble.Mesh(points[tuple(used.T)], index.reshape(-1, 3))


def loft(z, low, high, half):  # a closed mesh of rectangles from x = -half to half and from low to high at each z
    points = [(x, y, h) for h, a, b in np.broadcast(z, low, high) for x, y in ((-half, a), (half, a), (half, b), (-half, b))]
    sides = [(k + a, k + b, k + b + 4, k + a + 4) for k in range(0, len(points) - 4, 4) for a, b in ((0, 1), (1, 2), (2, 3), (3, 0))]
    return tumble.Mesh(points, [(f[0], *f[k : k + 2]) for f in [(3, 2, 1, 0), *sides, range(len(points) - 4, len(points))] for k in (1, 2)])


def turn(cuts):  # puts a key in, then turns it with 1 N·m for a second
    world, errors, steel, body, core = tumble.World(gravity=(0, -9.81, 0)), [], {"density": 7800, "friction": 0.1}, np.ones((1, 92, 11), bool), np.ones((4, 92, 11), bool)
    body[0, -3:, 1::2] = core[1:3, -2] = core[2:, -3:, 1::2] = False
    world.add_static("housing", solid(np.sqrt(np.square([BORE, OUTER]) - NARROW**2), body), friction=0.1)
    plug = world.add_rigid("plug", solid([0.0092, FLOOR, LEDGE, ROOF, np.sqrt(R**2 - NARROW**2)], core), **steel)
    width, tips = WIDE - PLAY, np.array([PLAY - WIDE, -0.002, 0.002, WIDE - PLAY])
    for k, length in enumerate(R - 0.0001 - CUTS):
        world.add_rigid(f"pin {k}", loft(tips, abs(tips) - 0.002, length, width), position=(0, LEDGE + 0.0002, Z[k]), **steel)
        world.add_rigid(loft(tips, 0, 0.03, width), position=(0, LEDGE + length + 0.0004, Z[k]), **steel)
    z, high = [-0.085, *np.add.outer(Z, [-0.004, 0.004]).ravel(), 0.075, 0.0751, 0.12], [FLOOR + 0.001, *np.repeat(cuts, 2), cuts[-1], 0.05, 0.05]
    key = world.add_rigid("key", loft(z, FLOOR + 0.0005, high, NARROW - PLAY), position=(0, 0, 0.16), **steel)
    _, axle = [world.add_joint(kind, part, point=(0, 0, 0), damping=c) for kind, part, c in (("cylindrical", key, 0), ("revolute", plug, 0.5))]
    for step in range(600):
        key.apply_force((0, 0, -20 - 60 * key.velocity[2]), key.position)
        key.apply_torque((0, 0, -1.0 if step >= 360 else 0.0))
        errors.append([world[f"pin {k}"].position[1] - cut for k, cut in enumerate(cuts)])
        world.step()
    return world, np.abs(errors[360]).max(), axle.position


world, error, angle = turn(CUTS)
print(f"the right key lifts the pins to its cuts within {error:.0e} m, and turns the plug by {-angle:.2f} rad")
if len(sys.argv) > 1:
    tumble.save_png(sys.argv[1], world.render(1280, 720, camera=((0.17, 0.16, 0.33), (0, 0.03, 0.02))))
