"""A worm turns its wheel by a tooth in each turn: a thread and teeth as meshes, no gear joint.   python examples/worm_gear.py [PICTURE.png]"""

import sys

import numpy as np
import tumble

MODULE, TEETH, PLAY, ALPHA = 0.004, 30, 0.0003, np.radians(20)  # m, -, m, rad
PITCH, R1, R2 = np.pi * MODULE, 5 * MODULE, MODULE * TEETH / 2


def solid(rings, low, high):
    """A closed mesh of rings of points, each above the one before, with caps at two heights on the axis."""
    m, n = rings.shape[:2]
    i, j = (index.ravel() for index in np.meshgrid(np.arange(m - 1), np.arange(n), indexing="ij"))
    a, b, c, d = (x * n + y % n for x, y in ((i, j), (i, j + 1), (i + 1, j + 1), (i + 1, j)))
    k, after = np.arange(n), (np.arange(n) + 1) % n
    caps = [(after, k, 0 * k + m * n), ((m - 1) * n + k, (m - 1) * n + after, 0 * k + m * n + 1)]
    faces = [np.stack(face, 1) for face in [(a, b, c), (a, c, d), *caps]]
    return tumble.Mesh(np.concatenate([rings.reshape(-1, 3), [(0, 0, low), (0, 0, high)]]), np.concatenate(faces))


def polar(radius, angle, height):
    return np.stack(np.broadcast_arrays(radius * np.cos(angle), radius * np.sin(angle), height), -1)


def worm(length, around=32, per_pitch=32):
    """A thread whose flanks stand at 20 degrees: in an axial section the rack of the wheel."""
    z, angle = np.linspace(-length / 2, length / 2, int(length / PITCH * per_pitch) + 1)[:, None], 2 * np.pi * np.arange(around) / around
    phase = np.abs((z - PITCH * angle / (2 * np.pi)) / PITCH % 1 - 0.5)  # of a pitch, from the middle of the thread
    crest = np.clip((0.25 - phase) * PITCH / np.tan(ALPHA), -1.0787 * MODULE, 1.0787 * MODULE)
    ends = np.abs(z) < length / 2 - 1e-9
    return solid(polar(np.where(ends, R1 + crest, R1 - 1.0787 * MODULE), angle, z), -length / 2, length / 2)


def wheel(width, sections=5):
    """Involute teeth that follow the thread."""
    base, tip, root = R2 * np.cos(ALPHA), R2 + MODULE, R2 - 1.25 * MODULE
    roll = np.linspace(np.sqrt(max(root / base, 1) ** 2 - 1), np.sqrt((tip / base) ** 2 - 1), 6)
    half = np.pi / 2 / TEETH - PLAY / 2 / R2 + np.tan(ALPHA) - ALPHA - (roll - np.arctan(roll))  # half a tooth
    radius, angle = base * np.hypot(1, roll), -half
    radius = np.concatenate([[root], radius, radius[::-1], [root]])
    angle = np.concatenate([[angle[0] - 0.06 / TEETH], angle, -angle[::-1], [0.06 / TEETH - angle[0]]])
    radius, angle = np.tile(radius, TEETH), (angle + 2 * np.pi * np.arange(TEETH)[:, None] / TEETH).ravel()
    z = np.linspace(-width / 2, width / 2, sections)[:, None]
    return solid(polar(radius, angle + MODULE / (2 * R1) / R2 * z, z), -width / 2, width / 2)


world = tumble.World(dt=1 / 240, gravity=(0, 0, 0))
steel = {"density": 7800, "friction": 0.05}
screw = world.add_rigid("worm", worm(5 * PITCH), **steel)
half = 0.5**0.5
# a gap of the thread faces the tooth on the x axis of the wheel, which points to the worm; its own axis is y
gear = world.add_rigid("wheel", wheel(0.012), position=(R1 + R2, 0, 0), orientation=(0, half, half, 0), **steel)
screw.color, gear.color = (0.75, 0.55, 0.25), (0.55, 0.6, 0.65)
axles = [world.add_joint("revolute", screw), world.add_joint("revolute", gear, axis=(0, 1, 0), damping=0.01)]
axles[0].set_drive(velocity=4 * np.pi)

turns, last = np.zeros(2), np.zeros(2)
for _ in range(2 * 240):
    world.step()
    now = np.array([axle.position for axle in axles])
    turns += (now - last + np.pi) % (2 * np.pi) - np.pi
    last = now
print(f"the worm turned by {turns[0]:.3f} rad, the wheel by {turns[1]:.4f}, by theory {-turns[0] / TEETH:.4f}")
print(f"play allows {2 * PLAY / R2:.4f} rad")
if len(sys.argv) > 1:
    tumble.save_png(sys.argv[1], world.render(1280, 720, camera=((0.0, -0.2, 0.08), (0.035, 0.0, 0))))
