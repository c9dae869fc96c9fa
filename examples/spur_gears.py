"""Two spur gears as meshes drive each other by their teeth alone: no gear joint.   python examples/spur_gears.py [PICTURE.png]"""

import sys

import numpy as np
import tumble

MODULE, PLAY, ALPHA = 0.004, 0.0002, np.radians(20)  # m, m, rad


def outline(teeth):
    """Radius and angle along the involute teeth of a gear, counter-clockwise."""
    pitch = MODULE * teeth / 2
    base, tip, root = pitch * np.cos(ALPHA), pitch + MODULE, pitch - 1.25 * MODULE
    roll = np.linspace(np.sqrt(max(root / base, 1) ** 2 - 1), np.sqrt((tip / base) ** 2 - 1), 8)
    half = np.pi / 2 / teeth - PLAY / 2 / pitch + np.tan(ALPHA) - ALPHA - (roll - np.arctan(roll))  # half a tooth
    radius, angle = base * np.hypot(1, roll), -half
    radius = np.concatenate([[root], radius, radius[::-1], [root]])
    angle = np.concatenate([[angle[0] - 0.06 / teeth], angle, -angle[::-1], [0.06 / teeth - angle[0]]])
    return np.tile(radius, teeth), (angle + 2 * np.pi * np.arange(teeth)[:, None] / teeth).ravel()


def gear(teeth, width):
    radius, angle = outline(teeth)
    n, rim = len(radius), np.stack([radius * np.cos(angle), radius * np.sin(angle)], 1)
    points = [(x, y, z) for z in (-width / 2, width / 2) for x, y in rim] + [(0, 0, -width / 2), (0, 0, width / 2)]
    k, after = np.arange(n), (np.arange(n) + 1) % n
    sides = [(k, after, n + after), (k, n + after, n + k), (after, k, k * 0 + 2 * n), (n + k, n + after, k * 0 + 2 * n + 1)]
    return tumble.Mesh(points, np.concatenate([np.stack(side, 1) for side in sides]))


world = tumble.World(dt=1 / 240, gravity=(0, 0, 0))
pinion = world.add_rigid("pinion", gear(20, 0.020), density=7800, friction=0.1)
place = {"position": (MODULE * 25, 0, 0), "orientation": (0, 0, np.cos(np.pi / 60), -np.sin(np.pi / 60))}
wheel = world.add_rigid("wheel", gear(30, 0.018), density=7800, friction=0.1, **place)
axles = [world.add_joint("revolute", body, damping=damping) for body, damping in ((pinion, 0), (wheel, 0.002))]
axles[0].set_drive(velocity=2 * np.pi)

turns, last = np.zeros(2), np.zeros(2)
for _ in range(3 * 240):
    world.step()
    now = np.array([axle.position for axle in axles])
    turns += (now - last + np.pi) % (2 * np.pi) - np.pi
    last = now
print(f"the pinion turned by {turns[0]:.3f} rad, the wheel by {turns[1]:.3f}, by theory {-turns[0] * 20 / 30:.3f}")
print(f"play allows {2 * PLAY / (MODULE * 15):.4f} rad")
if len(sys.argv) > 1:
    tumble.save_png(sys.argv[1], world.render(1280, 720, camera=((0.05, -0.09, 0.19), (0.05, 0.0, 0))))
