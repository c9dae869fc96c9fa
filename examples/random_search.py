"""Random search by rollouts: the weakest pushes that bring a cart of 1 kg over 1 m in 1 s to rest. The least cost ∫u² dt there is: 12.

    python examples/random_search.py
"""

import numpy as np
import tumble

CART = 'name = "cart", joint = "prismatic", axis = [1, 0, 0], mass_kg = 1, center_m = [0, 0, 0], inertia_kg_m2 = [1, 1, 1]'
world = tumble.World.parse(f'world = {{ dt_s = 0.05 }}\n[[articulated]]\nname = "cart"\nlink = [{{ {CART} }}]')
cart = world.articulation("cart")

rng, mean, spread = np.random.default_rng(1), np.zeros(10), 25 * np.eye(10)
for _ in range(40):  # the cross-entropy method: draw, keep the best tenth, draw as they are spread
    pushes = rng.multivariate_normal(mean, spread, 500)
    ends = world.rollout(np.repeat(pushes, 2, axis=1)[..., None], every=20)[:, -1]  # controls (forks, steps, joints); states (forks, 2)
    cost = (pushes**2).mean(axis=1) + 1e4 * ((ends - (1, 0)) ** 2).sum(axis=1)
    best = pushes[np.argsort(cost)[:50]]
    mean, spread = best.mean(axis=0), np.cov(best.T)
for push in mean:
    cart.tau = [push]
    world.step(2)
print(f"cost {(mean**2).mean():.4f}; the cart ends at {cart.q[0]:.5f} m with {cart.qd[0]:.5f} m/s")
