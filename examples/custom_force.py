"""A force of one's own: a spring to the origin and drag, for all bodies at once.   python examples/custom_force.py"""

import numpy as np
import tumble

SPRING, DRAG = 40.0, 0.6  # N/m, N·s/m


class Tether(tumble.Force):
    def apply(self, view):  # one row for each body
        view.force += -SPRING * view.position - DRAG * view.velocity


world = tumble.World(gravity=(0, 0, 0), dt=1 / 2000, stepper="backtracking", integrator="rk4")
masses = np.array([0.5, 1.0, 2.0])
bodies = [world.add_rigid(tumble.Sphere(0.1), mass=m, position=(1, 3 * k, 0), collidable=False) for k, m in enumerate(masses)]
world.add_force("tether", Tether())
world.step(4000)
decay, rate = DRAG / (2 * masses), np.sqrt(SPRING / masses - (DRAG / (2 * masses)) ** 2)
expected = np.exp(-decay * world.time) * (np.cos(rate * world.time) + decay / rate * np.sin(rate * world.time))  # released at rest, 1 m away
error = np.abs([body.position[0] for body in bodies] - expected).max()
print(f"three oscillators after {world.time:.0f} s: within {error:.1e} m of the closed form")
