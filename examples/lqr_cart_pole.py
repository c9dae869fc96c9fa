"""A cart-pole that is held upright by a regulator (LQR) from the derivative of the world's own step.

    python examples/lqr_cart_pole.py
"""

import numpy as np

import tumble

SCENE = """
world = { dt_s = 0.01 }
articulated = [{ name = "cart_pole", collidable = false, link = [
    { name = "cart", joint = "prismatic", axis = [1, 0, 0], mass_kg = 1.0, center_m = [0, 0, 0], inertia_kg_m2 = [0.01, 0.01, 0.01] },
    { name = "pole", parent = "cart", joint = "revolute", axis = [0, 1, 0], mass_kg = 0.1, center_m = [0, 0, 0.5],
      inertia_kg_m2 = [0.00833, 0.00833, 0.00001] },
] }]
"""

world = tumble.World.parse(SCENE)
robot = world.bodies["cart_pole"]

# upright rest is an equilibrium: x' = A x + B u about it, x = (cart, angle, and their rates), u = the force on the cart
A, B = world.linearize()
B = B[:, :1]
print(f"free: the largest eigenvalue of a step is {np.abs(np.linalg.eigvals(A)).max():.4f}")

Q, R, P = np.diag([1.0, 10.0, 0.1, 0.1]), np.array([[0.01]]), np.eye(4)
for _ in range(5000):  # Riccati's equation
    K = np.linalg.solve(R + B.T @ P @ B, B.T @ P @ A)
    P = Q + A.T @ P @ (A - B @ K)
print(f"held: {np.abs(np.linalg.eigvals(A - B @ K)).max():.4f}, gains {np.array2string(K[0], precision=2)}")

robot.q = [0.0, 0.4]  # rad: the linear law holds the real world, from far off
cost = x = 0.0
for _ in range(1000):
    x = np.concatenate([robot.q, robot.qd])
    u = -K @ x
    cost += x @ Q @ x + u @ R @ u
    robot.tau = [u[0], 0.0]
    world.step()
print(f"after 10 s: {np.abs(x).max():.1e} off; cost {cost:.1f}, by the linear model {0.4**2 * P[1, 1]:.1f}")
assert np.abs(x).max() < 1e-3
