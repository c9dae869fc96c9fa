"""A robot under PD control: it rests where its gains balance gravity, and at its goal once gravity is fed forward.

    python examples/arm_pd.py [ROBOT.urdf]
"""

import sys
from pathlib import Path
import numpy as np
import tumble

urdf = sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parents[1] / "scenes" / "robot" / "arm.urdf"
KP, KD = 2000.0, 200.0  # N·m/rad and N·m·s/rad; of prismatic joints N/m and N·s/m

world = tumble.World(dt=1 / 240)
arm = world.add_articulation(urdf)
goal = arm.limits @ (0.4, 0.6)  # a little above the middle of each joint's range
for joint, angle in zip(arm.joint_names, goal):
    arm.set_drive(joint, target=angle, stiffness=KP, damping=KD)
world.step(5 * 240)
sag, load = goal - arm.q, arm.inverse_dynamics(qd=np.zeros(arm.dof), qdd=np.zeros(arm.dof))
arm.tau = load
world.step(5 * 240)
print(f"{arm.name}: sags by {np.abs(sag).max():.5f} of {np.abs(load / KP).max():.5f} rad, then {np.abs(goal - arm.q).max():.1e} rad from its goal")
