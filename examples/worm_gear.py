"""A worm turns its wheel by a tooth in each turn: a thread and teeth as meshes, no gear joint.   python examples/worm_gear.py [PICTURE.png]"""

import sys

import numpy as np
import tumble

MODULE, TEETH, PLAY, ALPHA = 0.004, 30, 0.0003, np.radians(20)
PITCH, R1, R2 = np.pi * MODULE, 5 * MODULE, MODULE * TEETH / 2


def solid(radius, angle, z):
    """A closed mesh of rings of points about z, with a cap at each end."""
    rings = np.stack(np.broadcast_arrays(radius * np.cos(angle), radius * np.sin(angle), z), -1)
    m, n = rings.shape[:2]
    i, j = (index.ravel() for index in np.meshgrid(np.arange(m - 1), np.arange(n), indexing="ij"))
    a, b, c, d = (x * n + y % n for x, y in ((i, j), (i, j + 1), (i + 1, j + 1), (i + 1, j)))
    k, after, top = np.arange(n), (np.arange(n) + 1) % n, (m - 1) * n
    caps = [(after, k, 0 * k + m * n), (top + k, top + after, 0 * k + m * n + 1)]
    faces = [np.stack(face, 1) for face in [(a, b, c), (a, c, d), *caps]]
    return tumble.Mesh(np.concatenate([rings.reshape(-1, 3), [(0, 0, z[0, 0]), (0, 0, z[-1, 0])]]), np.concatenate(faces))


def worm(length, around=32, per_pitch=32):
    """A thread whose flanks stand at 20 degrees: in an axial section the rack of the wheel."""
    z, angle = np.linspace(-length / 2, length / 2, int(length / PITCH * per_pitch) + 1)[:, None], 2 * np.pi * np.arange(around) / around
    phase = np.abs((z - PITCH * angle / (2 * np.pi)) / PITCH % 1 - 0.5)  # of a pitch, from the middle of the thread
    crest = np.where(np.abs(z) < length / 2, np.clip((0.25 - phase) * PITCH / np.tan(ALPHA), -1.0787 * MODULE, 1.0787 * MODULE), -1.0787 * MODULE)
    return solid(R1 + crest, angle, z)


def wheel(width, sections=5):
    """Involute teeth that follow the thread."""
    base, tip, root = R2 * np.cos(ALPHA), R2 + MODULE, R2 - 1.25 * MODULE
    roll = np.linspace(np.sqrt(max(root / base, 1) ** 2 - 1), np.sqrt((tip / base) ** 2 - 1), 6)
    half = np.pi / 2 / TEETH - PLAY / 2 / R2 + np.tan(ALPHA) - ALPHA - (roll - np.arctan(roll))  # half a tooth
    radius, angle = base * np.hypot(1, roll), -half
    radius = np.tile(np.concatenate([[root], radius, radius[::-1], [root]]), TEETH)
    angle = np.concatenate([[angle[0] - 0.06 / TEETH], angle, -angle[::-1], [0.06 / TEETH - angle[0]]])
    angle = (angle + 2 * np.pi * np.arange(TEETH)[:, None] / TEETH).ravel()
    z = np.linspace(-width / 2, width / 2, sections)[:, None]
    return solid(radius, angle + MODULE / (2 * R1) / R2 * z, z)


world = tumble.World(dt=1 / 240, gravity=(0, 0, 0))
screw = world.add_rigid("worm", worm(5 * PITCH), density=7800, friction=0.05)
# a gap of the thread faces the tooth on the x axis of the wheel, which points to the worm; its own axis is y
place = {"position": (R1 + R2, 0, 0), "orientation": (0, 0.5**0.5, 0.5**0.5, 0)}
gear = world.add_rigid("wheel", wheel(0.012), density=7800, friction=0.05, **place)
axles = [world.add_joint("revolute", screw), world.add_joint("revolute", gear, axis=(0, 1, 0), damping=0.01)]
axles[0].set_drive(velocity=4 * np.pi)

turns = np.zeros(2)
for _ in range(2 * 240):
    world.step()
    turns += (np.array([axle.position for axle in axles]) - turns + np.pi) % (2 * np.pi) - np.pi
print(f"the worm turned by {turns[0]:.3f} rad, the wheel by {turns[1]:.4f}, by theory {-turns[0] / TEETH:.4f}")
print(f"play allows {2 * PLAY / R2:.4f} rad")
if len(sys.argv) > 1:
    tumble.save_png(sys.argv[1], world.render(1280, 720, camera=((0.0, -0.2, 0.08), (0.035, 0.0, 0))))
