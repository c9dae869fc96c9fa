"""A dumbbell with its own inertia spins freely: its axis precesses at the rate of Euler's equations.   python examples/dumbbell.py"""

import numpy as np
import tumble

END, ARM, ROD = 2.0, 0.3, 0.02  # two points of 2 kg, each 0.3 m from the middle of a rod; its inertia about itself, kg·m²
across = 2 * END * ARM**2
world = tumble.World(gravity=(0, 0, 0), stepper="backtracking", integrator="dormand_prince", integrator_tolerance=1e-10)
spin = np.array([0.5, 0.0, 8.0])  # rad/s, along the axes of the body: z is the rod
bell = world.add_rigid("bell", tumble.Capsule(0.02, 0.6), mass=2 * END, inertia=(across, across, ROD), angular_velocity=spin)
gyroscope = world.add_sensor("gyroscope", bell)  # the angular velocity in the axes of the body

rate, errors = (ROD - across) / across * spin[2], []  # I₁ω̇₁ = (I₂ - I₃)ω₂ω₃ of a body with I₁ = I₂
for _ in range(480):
    world.step()
    there = spin[0] * np.cos(rate * world.time), spin[0] * np.sin(rate * world.time), spin[2]
    errors.append(np.abs(gyroscope.value - there).max())
print(f"precession of {rate:.3f} rad/s in the body: within {max(errors):.1e} rad/s for {world.time:.0f} s")
