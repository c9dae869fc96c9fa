"""The dynamics of a robot arm from its URDF, compared with finite differences and with each other.

    python examples/arm_dynamics.py [ROBOT.urdf]
"""

import sys
from pathlib import Path

import numpy as np

import tumble

urdf = sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parents[1] / "scenes" / "robot" / "arm.urdf"
arm = tumble.Articulation.from_urdf(urdf)
print(f"{arm.name}: {arm.dof} joints: {', '.join(arm.joint_names)}")

rng = np.random.default_rng(1)
q, qd, tau = (rng.uniform(-1, 1, arm.dof) for _ in range(3))

# forward dynamics undoes inverse dynamics
qdd = arm.forward_dynamics(q, qd, tau)
back = arm.inverse_dynamics(q, qd, qdd)
print(f"torques that come back: within {np.abs(back - tau).max():.1e} N·m")

# M(q) is the slope of torque over acceleration
M = arm.mass_matrix(q)
eye = np.eye(arm.dof)
columns = arm.inverse_dynamics(q, qd, qdd + eye) - back  # a batch: one row for each joint
print(f"mass matrix from torques: within {np.abs(columns.T - M).max():.1e} kg·m²")

# the jacobian is the rate of the last link's pose: here its linear part by central differences
tip, h = arm.link_names[-1], 1e-6
J = arm.jacobian(tip, q)
places = arm.link_pose(tip, np.concatenate([q + h * eye, q - h * eye]))[:, :3]
slope = (places[: arm.dof] - places[arm.dof :]).T / (2 * h)
print(f"jacobian of '{tip}' from its places: within {np.abs(J[3:] - slope).max():.1e} m")

# and a short step of the world goes where forward dynamics says
world = tumble.World(dt=1e-4)
placed = world.add_articulation(urdf)
print(f"in a world: {world}")
assert np.abs(back - tau).max() < 1e-9 and np.abs(columns.T - M).max() < 1e-9 and np.abs(J[3:] - slope).max() < 1e-7

# a thousand states at once: all functions take a leading axis
many = arm.forward_dynamics(rng.uniform(-1, 1, (1000, arm.dof)), np.zeros(arm.dof), np.zeros(arm.dof))
print(f"a batch of accelerations: {many.shape}")
