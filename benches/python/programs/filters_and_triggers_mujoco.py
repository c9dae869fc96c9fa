"""The program ``examples/filters_and_triggers.py`` with MuJoCo.

    target/python/bin/python benches/python/programs/filters_and_triggers_mujoco.py

MuJoCo has no triggers and no events. The gate is a geom whose contacts are found at a depth of 0 and would act at 1 m only, and the program looks through all contacts after each step. The ball lands a step late,
since contacts are those of the start of a step, and its blow is spread over many steps. Times are within 1.4 ms, ours within 0.5 ms, with steps of 1 ms.
"""

import mujoco
import numpy as np

model = mujoco.MjModel.from_xml_string("""<mujoco><option timestep="0.001"/><worldbody><geom type="plane" size="9 9 1"/>
<geom name="gate" type="box" pos="0 0 2" size="4.5 4.5 0.01" margin="-1" gap="1"/>
<body name="crate" pos="0 0 0.25"><freejoint/><geom name="crate" type="box" size="0.25 0.25 0.25" mass="5"/></body>
<body name="ball" pos="0 0 4"><freejoint/><geom name="ball" size="0.1" mass="1"/></body>
<body name="ghost" pos="0.22 0 5"><freejoint/><geom name="ghost" size="0.1" mass="1" contype="8" conaffinity="9"/></body>
<body name="shade" pos="2 0 6"><freejoint/><geom name="shade" size="0.1" mass="1" contype="8" conaffinity="8"/></body></worldbody>
<contact><exclude body1="ghost" body2="crate"/></contact></mujoco>""")
data, force, passed, blows = mujoco.MjData(model), np.empty(6), {}, []
for _ in range(2000):
    mujoco.mj_step(model, data)
    for k, contact in enumerate(data.contact):
        pair = {model.geom(geom).name for geom in contact.geom}
        if "gate" in pair:
            passed.setdefault(*(pair - {"gate"}), data.time)
        elif pair == {"ball", "crate"}:
            mujoco.mj_contactForce(model, data, k, force)
            blows.append((data.time, force[0] * model.opt.timestep))
print({name: round(time, 3) for name, time in passed.items()}, f"the ball lands at {blows[0][0]:.3f} s")
