"""The program ``examples/notebook_animation.py`` with MuJoCo, by Pillow.

    MUJOCO_GL=egl target/python/bin/python benches/python/programs/notebook_animation_mujoco.py

MuJoCo has no animations: the page is written by hand, and has no controls. (mediapy, which needs ffmpeg, would make two lines of the last four before the output.) It has no coefficient of
restitution either: the damping of contacts that bounce with 0.8 follows from their stiffness, in steps of a tenth of ours. After 2 s the ball is within 4 mm of the closed form; ours within 1e-15 m.
"""

import base64
from pathlib import Path
import mujoco
from PIL import Image

XML = """<mujoco><option timestep="{}"/><default><geom solref="-50000 -31.8"/></default><worldbody><geom type="plane" size="5 5 0.1"/>
<body pos="0 0 1.1"><freejoint/><geom size="0.1" mass="1" rgba="0.9 0.4 0.1 1"/></body></worldbody></mujoco>"""
model = mujoco.MjModel.from_xml_string(XML.format(1 / 2400))
data, camera, images = mujoco.MjData(model), mujoco.MjvCamera(), []
camera.lookat, camera.distance, camera.azimuth, camera.elevation = (0, 0, 0.5), 4.3, 135, -9
with mujoco.Renderer(model, height=180, width=240) as renderer:
    for frame in range(31):
        mujoco.mj_step(model, data, 160 if frame else 1)
        renderer.update_scene(data, camera)
        images.append(Image.fromarray(renderer.render()))
images[0].save("bounce.png", save_all=True, append_images=images[1:], duration=1000 / 15)  # an animated PNG
page = base64.b64encode(Path("bounce.png").read_bytes()).decode()
Path("bounce.html").write_text(f'<!DOCTYPE html><img src="data:image/png;base64,{page}">')
print(f"{len(images)} images of {images[0].width} x {images[0].height} pixels")
