"""A ball that bounces, beside its closed form: after each bounce it rises to e² of the height before.

    python examples/bouncing_ball.py
"""

import numpy as np

import tumble

RADIUS, HEIGHT, BOUNCE, G = 0.1, 1.0, 0.8, 9.81


def height_by_theory(t: float) -> float:
    """Height of the ball's lowest point, m: parabolas between impacts, each taken e times as fast as the last."""
    fall = np.sqrt(2 * HEIGHT / G)
    if t < fall:
        return HEIGHT - G * t**2 / 2
    t, speed = t - fall, BOUNCE * G * fall
    while t > 2 * speed / G:
        t, speed = t - 2 * speed / G, BOUNCE * speed
    return speed * t - G * t**2 / 2


# backtracking finds the moment of each impact (thesis, Algorithm 4); the other stepper goes in equal steps
for stepper in ("backtracking", "time_stepping"):
    world = tumble.World(gravity=(0, 0, -G), stepper=stepper)
    world.add_static("ground", tumble.HalfSpace(normal=(0, 0, 1)), restitution=BOUNCE)
    ball = world.add_rigid("ball", tumble.Sphere(RADIUS), mass=1.0, position=(0, 0, HEIGHT + RADIUS), restitution=BOUNCE)
    worst = 0.0
    while world.time < 3.0:
        world.step()
        worst = max(worst, abs(ball.position[2] - RADIUS - height_by_theory(world.time)))
    print(f"{stepper:<14} 3 s, {world.frame} steps: at most {1e3 * worst:.4f} mm off the closed form")
    assert worst < 1e-3
