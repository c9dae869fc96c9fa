"""A slider closes a zipper of 20 teeth, which then holds against 50 N, and opens it.   python examples/zipper.py [PICTURE.png]"""

import sys

import numpy as np
import tumble

# m: pitch of a tape, radii of heads and of ends at the tape, half widths of necks, half thickness, plays; half the distance between tapes
PITCH, HEAD, BASE, NECK, HALF, PLAY, WALL, LID, APART = 0.020, 0.0055, 0.0075, 0.0033, 0.005, 0.0002, 0.0008, 0.001, 0.0114
BEND, ANGLE, END, TEETH, DT = 0.080, np.pi / 6, 0.030, 10, 1 / 240  # bend of a tape in the slider, straight ends of the slider; teeth of a tape
REACH = APART + (HOOK := np.sqrt((2 * HEAD + PLAY) ** 2 - (PITCH / 2) ** 2)) / 2  # closed tapes part by HOOK until their heads are beside each other

def tooth():  # a closed mesh along x: a round end at the tape, a neck and a round head
    ends = (0, BASE, 0.25, np.pi - np.arcsin(NECK / BASE)), (REACH, HEAD, np.arcsin(NECK / HEAD), np.pi - 0.25)
    profile = [(x - r * np.cos(angle), r * np.sin(angle)) for x, r, a, b in ends for angle in np.linspace(a, b, 7)]
    points = [(x, y * a, HALF * b) for x, y in profile for a, b in ((-1, 1), (1, 1), (1, -1), (-1, -1))]
    sides = [(k + a, k + b, k + b + 4, k + a + 4) for k in range(0, 52, 4) for a, b in ((0, 1), (1, 2), (2, 3), (3, 0))]
    return tumble.Mesh(points, [(f[0], *f[k : k + 2]) for f in [(3, 2, 1, 0), *sides, (52, 53, 54, 55)] for k in (1, 2)])

def line(s):  # place and direction of the left tape in the slider at an arc length
    angle, beyond = np.clip(s / BEND, 0, ANGLE), np.where(s < 0, s, np.maximum(s - BEND * ANGLE, 0))
    return np.array([-APART - BEND * (1 - np.cos(angle)) - beyond * np.sin(angle), BEND * np.sin(angle) + beyond * np.cos(angle)]), angle

def slider():  # a closed mesh of the filled cells of a grid: a plate, the walls that close the tapes, the wedge that opens them
    (x, y), angle = line(np.array([-END, *BEND * ANGLE * np.linspace(0, 1, 23), BEND * ANGLE + END]))
    wall, wedge = [np.array([x + off * np.cos(angle), y + off * np.sin(angle)]) for off in (-BASE - WALL, REACH + HEAD + WALL)]
    left = np.array([[0 * x + wall[0, -1] - 0.006, wall[1]], wall, [np.minimum(wedge[0], -0.0015), wedge[1]]])
    points = np.array([[[(*at, z) for z in (-0.01, -HALF - LID, HALF)] for at in row] for row in np.concatenate([left, left[::-1] * [[-1], [1]]]).transpose(2, 0, 1)])
    full, faces = np.pad(np.ones((24, 5, 2), int), 1), []
    full[1:-1, [2, 4], 2], full[1:-1, 3, 2] = 0, wedge[0, :-1] < -0.0015
    for axis, inner in enumerate([np.s_[:, 1:-1, 1:-1], np.s_[1:-1, :, 1:-1], np.s_[1:-1, 1:-1]]):
        change, (u, v) = np.diff(full[inner], axis=axis), np.eye(3, dtype=int)[[(axis + 1) % 3, (axis + 2) % 3]]
        for place in np.argwhere(change):
            faces += [*(quad := (np.array([0 * u, u, u + v, v]) + place)[:: change[tuple(place)]])[:3], *quad[[0, 2, 3]]]
    used, index = np.unique(faces, axis=0, return_inverse=True)
    return tumble.Mesh(points[tuple(used.T)], index.reshape(-1, 3))

world, teeth, tapes, overlap, height = tumble.World(gravity=(0, 0, 0)), tooth(), [], 0.0, 0.03
for side, foot, turned, color in ((-1, 0.0, (0, 0, 0, 1), (0.8, 0.6, 0.2)), (1, -PITCH / 2, (0, 1, 0, 0), (0.3, 0.5, 0.8))):
    chain = tumble.ArticulationBuilder(f"tape {side}", self_collision=False)
    for k, lean in enumerate(np.diff(-side * line(PITCH * (np.arange(TEETH) + 0.5) + foot - height)[1], prepend=0)):
        at = {"position": (0, PITCH, 0) if k else (side * APART, foot, 0), "shape_position": (0, PITCH / 2, 0), "shape_orientation": turned}
        chain.add_link(f"tooth {k}", f"tooth {k - 1}" if k else None, **at, shape=teeth, density=7800, joint_damping=0.002, friction=0.1, q=lean, color=color)
    tapes.append((side, world.add_articulation(chain)))
pull = world.add_rigid("slider", slider(), position=(0, height, 0), density=7800, friction=0.1)
world.add_joint("prismatic", pull, point=(0, 0, 0), axis=(0, 1, 0))
for state, seconds, height, tension in (("closed", 1.25, 0.2, 0.2), ("pulled", 0.25, None, 5.0), ("opened", 0.75, 0.1, 0.2), ("pulled", 0.1, None, 5.0)):
    for _ in range(round(seconds / DT)):
        if height:
            pull.apply_force((0, 200 * (np.clip(8 * (height - pull.position[1]), -0.2, 0.2) - pull.velocity[1]), 0), pull.position)
        for side, tape in tapes:  # every tooth is pulled outwards at its middle
            up = np.stack([-np.sin(angles := np.cumsum(tape.q)), np.cos(angles), 0 * angles], 1)
            for name, point in zip(tape.link_names, tape.link_poses()[:, :3] + PITCH / 2 * up, strict=True):
                tape.apply_force(name, (side * tension, 0, 0), point)
        world.step()
        overlap = max(overlap, world.report.max_penetration)
    print(f"{state}: slider at {1e3 * pull.position[1]:.0f} mm, tapes {1e3 * np.subtract(*[tape.link_poses()[1:9, 0] for _, tape in tapes[::-1]]).max() - 2e3 * APART:.1f} mm apart, hooks of {1e3 * HOOK:.1f} mm")
    if len(sys.argv) > 1 and state == "opened":
        tumble.save_png(sys.argv[1], world.render(1280, 720, camera=((0.08, -0.02, 0.36), (0, 0.1, 0))))
print(f"largest overlap {overlap:.0e} m")
