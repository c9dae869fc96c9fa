"""A ball thrown so that it hits a target after a bounce: iLQR, with the derivative of every step, the one with the impact too.

    python examples/ilqr_throw.py
"""

import numpy as np

import tumble

STEPS, HELD, TARGET = 96, 24, np.array([1.5, 0.4, 0.5])  # steps in all, steps in the hand; m
USED = [3, 4, 5, 6, 7, 8, 9, 10, 11]  # of the 12 coordinates: a ball may turn as it likes, but its spin bounces


def start():
    world = tumble.World(dt=1 / 120)
    world.add_static("ground", tumble.HalfSpace(), restitution=0.8, friction=0.4)
    ball = world.add_rigid("ball", tumble.Sphere(0.05), mass=0.2, position=(0, 0, 0.6), restitution=0.8, friction=0.4)
    return world, ball


def fly(law):
    """States, forces and derivatives of a throw; ``law(k, x)`` is the force of the hand in step k."""
    world, ball = start()
    xs, us, slopes, bounces = [], [], [], 0
    for k in range(STEPS):
        xs.append(np.concatenate([ball.position, ball.angular_velocity, ball.velocity]))
        us.append(law(k, xs[-1]) if k < HELD else np.zeros(3))
        ball.apply_force(us[-1], ball.position)
        A, B = world.linearize()
        slopes.append((A[np.ix_(USED, USED)], B[USED, 3:] if k < HELD else np.zeros((9, 3))))
        world.step()
        bounces += world.report.impact_passes > 0
    xs.append(np.concatenate([ball.position, ball.angular_velocity, ball.velocity]))
    return np.array(xs), np.array(us), slopes, bounces


def cost(xs, us):
    return 1e-3 * (us**2).sum() + 1e5 * ((xs[-1, :3] - TARGET) ** 2).sum()


xs, us, slopes, bounces = fly(lambda k, x: np.array([0.5, 0.0, 1.0]))
for turn in range(12):
    print(f"{turn:2d}: {np.linalg.norm(xs[-1, :3] - TARGET):.6f} m from the target, bounces {bounces}, cost {cost(xs, us):.6f}")
    gain, S, s = [None] * STEPS, np.zeros((9, 9)), np.zeros(9)
    S[:3, :3], s[:3] = 2e5 * np.eye(3), 2e5 * (xs[-1, :3] - TARGET)
    for k in reversed(range(STEPS)):  # the value of each state, backwards
        A, B = slopes[k]
        H = 2e-3 * np.eye(3) + B.T @ S @ B
        gain[k] = np.linalg.solve(H, B.T @ S @ A), np.linalg.solve(H, 2e-3 * us[k] + B.T @ s)
        S, s = A.T @ S @ (A - B @ gain[k][0]), A.T @ (s - S @ B @ gain[k][1])
    for size in 0.5 ** np.arange(10):  # along the new forces, as far as they are better
        new = fly(lambda k, x: us[k] - size * gain[k][1] - gain[k][0] @ (x - xs[k]))  # noqa: B023
        if better := cost(*new[:2]) < cost(xs, us) - 1e-9:
            xs, us, slopes, bounces = new
            break
    if not better:
        break
assert bounces == 1 and np.linalg.norm(xs[-1, :3] - TARGET) < 2e-3
