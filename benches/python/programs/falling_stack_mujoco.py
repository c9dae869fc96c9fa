"""The program ``examples/falling_stack.py`` with MuJoCo.

    target/python/bin/python benches/python/programs/falling_stack_mujoco.py

Loads are within 2e-9 of the weights; ours within 1e-14. Its crates sink into each other by up to half a millimeter, and the forces of a pair are added up
by hand, as here: contacts come one by one, in frames of their own.
"""

import mujoco
import numpy as np

CRATES, MASS, G = 5, 10.0, 9.81

CRATE = '<body pos="0 0 {}"><freejoint/><geom type="box" size="0.25 0.25 0.25" mass="{}"/></body>'
crates = "".join(CRATE.format(0.3 + 0.55 * k, MASS) for k in range(CRATES))
WORLD = f'<worldbody><geom type="plane" size="5 5 1"/>{crates}</worldbody>'  # geom 0 is the ground
model = mujoco.MjModel.from_xml_string(f'<mujoco><option timestep="{1 / 240}"/>{WORLD}</mujoco>')
data = mujoco.MjData(model)
mujoco.mj_step(model, data, 2 * 240)

loads, points, force = np.zeros(CRATES), np.zeros(CRATES, int), np.empty(6)
for k, contact in enumerate(data.contact):
    mujoco.mj_contactForce(model, data, k, force)  # along the normal first
    loads[contact.geom.max() - 1] += force[0]
    points[contact.geom.max() - 1] += 1
for k in range(CRATES):
    weight = MASS * G * (CRATES - k)
    print(f"under crate {k + 1}: {loads[k]:.4f} N at {points[k]} points; the weight above is {weight:.4f} N")
