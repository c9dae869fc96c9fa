"""The program ``examples/domain_randomization.py`` with MuJoCo.

    target/python/bin/python benches/python/programs/domain_randomization_mujoco.py

By its defaults the distances are within 4e-2; with RK4, the elliptic cone and the stiffest contacts that each step allows, within 2.9e-3. Ours are within 4.3e-4.
"""

import mujoco
import numpy as np

XML = """<mujoco><option timestep="{dt}" cone="elliptic" integrator="RK4"/>
<default><geom friction="{friction}" solref="{stiff} 1"/></default><worldbody><geom type="plane" size="20 20 1"/>
<body pos="0 0 0.1"><freejoint/><geom type="box" size="0.5 0.5 0.1" mass="{mass}"/></body></worldbody></mujoco>"""
rng, errors = np.random.default_rng(3), []
for _ in range(200):
    mass, speed, dt = 10 ** rng.uniform(-3, 3), rng.uniform(1, 5), 1 / rng.integers(120, 1000)
    friction = rng.uniform(0.2, 1.0)
    model = mujoco.MjModel.from_xml_string(XML.format(dt=dt, stiff=2 * dt, friction=friction, mass=mass))
    data = mujoco.MjData(model)
    data.qvel[0] = speed
    mujoco.mj_step(model, data, int(1.1 * speed / (friction * 9.81) / dt))
    errors.append(data.qpos[0] / (speed**2 / (2 * friction * 9.81)) - 1)
print(f"{len(errors)} worlds: stopping distances within {np.abs(errors).max():.1e} of v²/(2µg)")
