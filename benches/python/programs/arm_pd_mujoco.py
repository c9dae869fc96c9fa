"""The program ``examples/arm_pd.py`` with MuJoCo.

    target/python/bin/python benches/python/programs/arm_pd_mujoco.py [ROBOT.urdf]

Addresses of meshes with package:// are resolved by hand. With steps of 1/240 s, and of 1/1000 s, the small joints of the arm that reach their effort limits swing for ever,
with every integrator: a tenth of a millisecond is needed. It rests within 2e-10 N·m of the loads, ours within 2e-11 N·m.
"""

import sys
from pathlib import Path
import mujoco
import numpy as np

urdf = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parents[3] / "scenes" / "robot" / "arm.urdf")
KP, KD = 2000.0, 200.0  # N·m/rad and N·m·s/rad; of slide joints N/m and N·s/m

spec = mujoco.MjSpec.from_file(str(urdf))
spec.option.timestep, spec.option.integrator = 1e-4, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
for mesh in spec.meshes:
    mesh.file = str(urdf.parents[1] / mesh.file[mesh.file.index("meshes") :])
for joint in spec.joints:
    spec.add_actuator(trntype=mujoco.mjtTrn.mjTRN_JOINT, target=joint.name).set_to_position(kp=KP, kv=KD)
model = spec.compile()
data = mujoco.MjData(model)
goal = model.jnt_range @ (0.4, 0.6)  # a little above the middle of each joint's range
data.ctrl = goal
mujoco.mj_step(model, data, 50000)
sag, data.qvel = goal - data.qpos, 0
mujoco.mj_forward(model, data)
load = data.qfrc_bias.copy()
data.qfrc_applied = load
mujoco.mj_step(model, data, 50000)
far, most, rest = np.abs(sag).max(), np.abs(load / KP).max(), np.abs(goal - data.qpos).max()
print(f"{spec.modelname}: sags by {far:.5f} of {most:.5f} rad, then {rest:.1e} rad from its goal")
