"""Three contact problems with known answers, in tumble and in MuJoCo, at 240 Hz: a box that slides to rest, a box on a slope, a heavy cube on a light one.

    make references                                                           # installs MuJoCo once
    scripts/test_python.sh crates/py/tests/test_package.py                    # installs tumble beside it
    target/py-tests/bin/python benches/python/beside_mujoco.py

MuJoCo runs with its default contacts, and with elliptic cones, stiff contacts and its no-slip iterations. Its contacts are soft by design: what is measured
here is what that design costs where rigid bodies are meant.
"""

import numpy as np

import tumble

try:
    import mujoco
except ImportError:
    mujoco = None

G, DT, MU = 9.81, 1 / 240, 0.5
SLOPE = np.radians(20)
STIFF = 'solref="0.004 1" solimp="0.99 0.999 0.0001"'


def mujoco_world(bodies: str, stiff: bool, gravity=(0, 0, -G)):
    """A floor and bodies, each ``(size, mass, position)`` of a cube; the model and its data."""
    option = 'cone="elliptic" impratio="100" noslip_iterations="10"' if stiff else ""
    model = mujoco.MjModel.from_xml_string(f"""<mujoco>
        <option timestep="{DT}" gravity="{gravity[0]} {gravity[1]} {gravity[2]}" iterations="200" tolerance="1e-14" {option}/>
        <default><geom friction="{MU} 0 0" {STIFF if stiff else ""}/></default>
        <worldbody><geom type="plane" size="50 50 1"/>{bodies}</worldbody></mujoco>""")
    data = mujoco.MjData(model)
    return lambda n: mujoco.mj_step(model, data, n), data


def mujoco_cube(edge: float, mass: float, z: float) -> str:
    half = edge / 2
    return f'<body pos="0 0 {z}"><freejoint/><geom type="box" size="{half} {half} {half}" mass="{mass}"/></body>'


def tumble_world(cubes, gravity=(0, 0, -G)):
    """A floor and cubes, each ``(edge, mass, z)``."""
    world = tumble.World(gravity=gravity, dt=DT)
    world.add_static("floor", tumble.HalfSpace(), friction=MU)
    return world, [world.add_rigid(f"cube_{k}", tumble.Box((edge,) * 3), mass=mass, position=(0, 0, z), friction=MU) for k, (edge, mass, z) in enumerate(cubes)]


def slide(engine: str) -> tuple[float, float]:
    """A cube of 0.2 m that rests and is set to 5 m/s: where it stops, m, and how far it was lifted, m."""
    heights = []
    if engine == "tumble":
        world, (cube,) = tumble_world([(0.2, 1, 0.1)])
        world.step(240)
        cube.velocity, rest = (5, 0, 0), cube.position[2]
        for _ in range(480):
            world.step()
            heights.append(cube.position[2] - rest)
        return cube.position[0], max(0.0, *heights)
    step, data = mujoco_world(mujoco_cube(0.2, 1, 0.1), engine == "stiff")
    step(240)
    data.qvel[:], rest, start = (5, 0, 0, 0, 0, 0), data.qpos[2], data.qpos[0]
    for _ in range(480):
        step(1)
        heights.append(data.qpos[2] - rest)
    return data.qpos[0] - start, max(0.0, *heights)


def creep(engine: str) -> float:
    """A cube at rest on a slope of 20 degrees for five seconds, the first left out: its speed down the slope, m/s."""
    gravity = (G * np.sin(SLOPE), 0, -G * np.cos(SLOPE))
    if engine == "tumble":
        world, (cube,) = tumble_world([(0.2, 1, 0.1)], gravity)
        world.step(240)
        start = cube.position[0]
        world.step(960)
        return (cube.position[0] - start) / 4
    step, data = mujoco_world(mujoco_cube(0.2, 1, 0.1), engine == "stiff", gravity)
    step(240)
    start = data.qpos[0]
    step(960)
    return (data.qpos[0] - start) / 4


def sink(engine: str) -> float:
    """A cube of 1000 kg on one of 1 g, both of 0.2 m, after two seconds: how far the light one is squeezed or sunk into, m."""
    if engine == "tumble":
        world, (_, heavy) = tumble_world([(0.2, 1e-3, 0.1), (0.2, 1e3, 0.3)])
        world.step(480)
        return 0.3 - heavy.position[2]
    step, data = mujoco_world(mujoco_cube(0.2, 1e-3, 0.1) + mujoco_cube(0.2, 1e3, 0.3), engine == "stiff")
    step(480)
    return 0.3 - data.qpos[9]


ENGINES = {"tumble": "tumble", "default": "MuJoCo, defaults", "stiff": "MuJoCo, stiff, no slip"}

print(f"{'':24}{'stops after, m':>16}{'lifted, mm':>12}{'creeps, m/s':>13}{'1000 kg sinks by, mm':>22}")
print(f"{'exact':24}{25 / (2 * MU * G):16.6f}{0:12.4f}{0:13.1e}{0:22.6f}")
found = {engine: (*slide(engine), creep(engine), sink(engine)) for engine in (ENGINES if mujoco else ["tumble"])}
for engine, (way, lift, speed, depth) in found.items():
    print(f"{ENGINES[engine]:24}{way:16.6f}{1e3 * lift:12.4f}{speed:13.1e}{1e3 * depth:22.6f}")
if mujoco is None:
    print("MuJoCo is not installed; `make references` installs it")
