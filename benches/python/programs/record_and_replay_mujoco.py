"""The program ``examples/record_and_replay.py`` with MuJoCo.

    target/python/bin/python benches/python/programs/record_and_replay_mujoco.py [FILE.npz [VIDEO.png]]

Both are within 2e-14 m of the parabola. MuJoCo has no format for recordings and no writer of videos: states are an array in a file of numpy, which no viewer opens and which
has no names, and images go to Pillow. Without a display it needs MUJOCO_GL=egl.
"""

import sys
import mujoco
import numpy as np
from PIL import Image

path = sys.argv[1] if len(sys.argv) > 1 else "throw.npz"
OPTION = f'<option timestep="{1 / 240}" integrator="RK4"><flag energy="enable"/></option>'
BALL = '<worldbody><body name="ball"><freejoint/><geom size="0.1" mass="1"/></body></worldbody>'
model = mujoco.MjModel.from_xml_string(f"<mujoco>{OPTION}{BALL}</mujoco>")
data, full = mujoco.MjData(model), mujoco.mjtState.mjSTATE_INTEGRATION
data.qvel = 3, 0, 5, 0, 9, 0
states = np.empty((61, mujoco.mj_stateSize(model, full)))
mujoco.mj_getState(model, data, states[0], full)
for state in states[1:]:
    mujoco.mj_step(model, data, 4)
    mujoco.mj_getState(model, data, state, full)
np.savez(path, states=states)

run, again, energies, images = np.load(path)["states"], mujoco.MjData(model), [], []
times, heights = run[:, 0], run[:, 3]  # the time, position and quaternion of the ball, and more
error = abs(heights - 5 * times + 9.81 * times**2 / 2).max()
for state in run:
    mujoco.mj_setState(model, again, state, full)
    mujoco.mj_forward(model, again)
    energies.append(again.energy.sum())

mujoco.mj_setState(model, again, run[30], full)  # the exact state of the middle
mujoco.mj_step(model, again, 120)
end = np.empty_like(run[60])
mujoco.mj_getState(model, again, end, full)
same = bool((end == run[60]).all())
if len(sys.argv) > 2:
    with mujoco.Renderer(model, height=360, width=640) as renderer:
        for state in run[::2]:
            mujoco.mj_setState(model, again, state, full)
            mujoco.mj_forward(model, again)
            renderer.update_scene(again)
            images.append(Image.fromarray(renderer.render()))
    images[0].save(sys.argv[2], save_all=True, append_images=images[1:], duration=1000 / 30)
print(f"{len(times)} frames: within {error:.1e} m of the parabola, {energies[0]:.3f} to {energies[-1]:.3f} J, the same end: {same}")
