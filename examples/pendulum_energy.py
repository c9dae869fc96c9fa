"""A pendulum let go at 60 degrees: its period in closed form, and its energy under two integrators.

    python examples/pendulum_energy.py
"""

import numpy as np

import tumble

ROD = """
[world]
dt_s = 0.01

[[articulated]]
name = "pendulum"

[[articulated.link]]
name = "bob"
joint = "revolute"
axis = [0, 1, 0]
angle_deg = 60
mass_kg = 1
center_m = [0, 0, -1]
inertia_kg_m2 = [0, 0, 0]   # a point, 1 m from the hinge
shape = { type = "sphere", radius_m = 0.1, position_m = [0, 0, -1] }
"""


def period_by_theory(amplitude: float, length: float = 1.0, g: float = 9.81) -> float:
    """T = 2π √(l/g) / M(1, cos(θ/2)), by Gauss's arithmetic-geometric mean M."""
    a, b = 1.0, np.cos(amplitude / 2)
    while abs(a - b) > 1e-15:
        a, b = (a + b) / 2, np.sqrt(a * b)
    return 2 * np.pi * np.sqrt(length / g) / a


def swing(integrator: str) -> tuple[float, float]:
    """The mean period over 20 s, and the largest change of energy."""
    text = ROD.replace("dt_s = 0.01", f'dt_s = 0.01\nstepper = "backtracking"\nintegrator = "{integrator}"')
    world = tumble.World.parse(text)
    arm, start = world.articulation("pendulum"), world.energy().total
    times, drift, before = [], 0.0, arm.q[0]
    for _ in range(2000):
        world.step()
        now = arm.q[0]
        if before > 0 >= now:  # through the lowest point: when, by a straight line
            times.append(world.time - world.dt * now / (now - before))
        before, drift = now, max(drift, abs(world.energy().total - start))
    return float(np.mean(np.diff(times))), drift


exact = period_by_theory(np.radians(60))
print(f"period by theory            {exact:.6f} s")
for integrator in ("verlet", "dormand_prince"):
    period, drift = swing(integrator)
    print(f"{integrator:<15} period      {period:.6f} s, energy within {drift:.1e} J")
    assert abs(period - exact) < 1e-4
