"""A double pendulum: its small modes have ω² = (2 ∓ √2) g/l, and a wild swing keeps its energy.   python examples/double_pendulum.py"""

import numpy as np
import tumble

builder = tumble.ArticulationBuilder("arm")
rod = {"axis": (0, 1, 0), "mass": 1, "center_of_mass": (0, 0, -1)}  # a point of 1 kg, 1 m from a hinge
builder.add_link("upper", **rod)
builder.add_link("lower", "upper", position=(0, 0, -1), **rod)
world = tumble.World(stepper="backtracking", integrator="dormand_prince", integrator_tolerance=1e-9)
arm, errors, energies = world.add_articulation(builder), [], []
times = world.dt * np.arange(1, 481)
for root in (2**0.5, -(2**0.5)):  # the lower rod leans by ±√2 of the upper; q holds the upper's angle and the one between them
    angles = world.rollout(np.zeros((1, 480, 2)), states=[(1e-4, 1e-4 * (root - 1), 0, 0)])[0, :, 0]
    errors.extend(angles - 1e-4 * np.cos(np.sqrt((2 - root) * 9.81) * times))
arm.q = 2.5, 1.0
for _ in range(2400):
    energies.append(world.energy().total)
    world.step()
print(f"modes within {np.abs(errors).max():.1e} rad; energy of the wild swing within {np.ptp(energies):.1e} J")
