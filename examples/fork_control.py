"""Control by forks (MPC): at each step 61 futures of a cart are tried in forks of its world, and the first push of the best is made. Least time: 2 √(m d/F).

    python examples/fork_control.py
"""

import numpy as np
import tumble

CART = 'name = "cart", joint = "prismatic", axis = [1, 0, 0], mass_kg = 1, center_m = [0, 0, 0], inertia_kg_m2 = [1, 1, 1]'
world = tumble.World.parse(f'world = {{ dt_s = 0.02 }}\n[[articulated]]\nname = "cart"\nlink = [{{ {CART} }}]')
cart = world.articulation("cart")

plans = 4.0 * np.where(np.arange(60) < np.arange(61)[:, None], 1, -1)[..., None]  # N, (futures, steps, joints): forward, then back
while world.frame < 50:
    misses = np.linalg.norm(world.rollout(plans) - (1, 0), axis=2)  # of rest at 1 m: states are (position, velocity)
    cart.tau = plans[misses.min(axis=1).argmin(), 0]
    world.step()
print(f"after {world.time:.2f} s: {cart.q[0]:.9f} m, {cart.qd[0]:.1e} m/s")
