"""The program ``examples/quadruped.py`` with MuJoCo.

    target/python/bin/python benches/python/programs/quadruped_mujoco.py

With steps of 1/240 s it hops on the spot for ever, so they are 1 ms. At rest its feet carry the weight within 3e-9 of it; ours within 2e-14. They sink into the ground.
"""

import mujoco
import numpy as np

LEGS = {"front_left": (0.25, 0.15), "front_right": (0.25, -0.15), "rear_left": (-0.25, 0.15), "rear_right": (-0.25, -0.15)}
LEG = """<body pos="{1} {2} 0"><joint name="{0}_hip"/><geom type="capsule" fromto="0 0 0 0 0 -0.2" size="0.02" mass="0.8"/><body pos="0 0 -0.2">
<joint name="{0}_knee"/><geom pos="0 0 -0.2" size="0.025" mass="0.2"/><site name="{0}" pos="0 0 -0.2" size="0.03"/></body></body>"""
legs = "".join(LEG.format(leg, x, y) for leg, (x, y) in LEGS.items())
drives = "".join(f'<position joint="{leg}_hip"/><position joint="{leg}_knee"/>' for leg in LEGS)
sensors = "".join(f'<touch site="{leg}"/>' for leg in LEGS)
model = mujoco.MjModel.from_xml_string(f"""<mujoco><option timestep="0.001" integrator="implicitfast"/>
<default><joint axis="0 1 0"/><position kp="300" kv="10"/></default><worldbody><geom type="plane" size="5 5 1"/>
<body pos="0 0 0.4"><freejoint/><geom type="box" size="0.3 0.15 0.05" mass="10"/>{legs}</body></worldbody>
<actuator>{drives}</actuator><sensor>{sensors}</sensor></mujoco>""")
data = mujoco.MjData(model)
data.qpos[7:] = data.ctrl = np.radians([40, -80] * 4)
mujoco.mj_step(model, data, 3000)
forces, weight = dict(zip(LEGS, data.sensordata)), model.body_mass.sum() * 9.81
feet = ", ".join(f"{foot} {force:.3f} N" for foot, force in forces.items())
print(f"{feet}; sum {sum(forces.values()):.4f} N, weight {weight:.4f} N")
