"""Models of MuJoCo as MuJoCo itself reads them, for comparison.

    mujoco_reference.py MODEL COUNT     prints the model and COUNT random states of it (exit 77 where the package is missing, 78 where MuJoCo
                                        itself refuses the model)
    mujoco_reference.py models          prints the paths of all models in installed packages
    mujoco_reference.py sensors MODEL   prints a line `sensor name numbers` for each sensor at the first keyframe
    mujoco_reference.py residuals MODEL prints a line `residual name numbers` for each active equality constraint at the first keyframe

The output is lines `word name numbers`: `joint`, `body`, `site`, `actuator` name the elements in MuJoCo's order; then for each state `qpos`, `qvel`,
`ctrl`, `mass` (the whole matrix), `bias`, `passive`, `actuation`, `xpos` and `xquat` of the bodies, `sites` and `forces` of the actuators. Numbers
are in SI units and MuJoCo's conventions: quaternions w x y z, velocities of free joints [linear in world axes; angular in body axes].
"""

import pathlib
import site
import sys

try:
    import mujoco
    import numpy as np
except ImportError as error:
    print(error)
    sys.exit(77)


def say(word, *numbers):
    print(word, *(repr(float(x)) for part in numbers for x in np.ravel(part)))


def models():
    """Prints the models that installed packages bring."""
    folders = [pathlib.Path(folder) for folder in site.getsitepackages()]
    for path in sorted(path for folder in folders for path in folder.rglob("*.xml")):
        if b"<mujoco" in path.read_bytes()[:100_000]:
            print(path)


def name(model, kind, index):
    return (mujoco.mj_id2name(model, kind, index) or "").replace(" ", "_") or "-"


def describe(model):
    kinds = mujoco.mjtObj
    for j in range(model.njnt):
        body = model.jnt_bodyid[j]
        print("joint", name(model, kinds.mjOBJ_JOINT, j), name(model, kinds.mjOBJ_BODY, body), int(model.jnt_type[j]), model.jnt_qposadr[j], model.jnt_dofadr[j], body)
    for b in range(model.nbody):
        print("body", name(model, kinds.mjOBJ_BODY, b), int(model.body_weldid[b]), repr(float(model.body_mass[b])))
    for s in range(model.nsite):
        print("site", name(model, kinds.mjOBJ_SITE, s), int(model.site_bodyid[s]))
    for a in range(model.nu):
        print("actuator", name(model, kinds.mjOBJ_ACTUATOR, a))


def state(model, data, random):
    mujoco.mj_resetData(model, data)
    mujoco.mj_integratePos(model, data.qpos, random.uniform(-1, 1, model.nv), 1.0)
    data.qvel[:] = random.uniform(-1, 1, model.nv)
    data.ctrl[:] = random.uniform(-1.5, 1.5, model.nu)
    mujoco.mj_forward(model, data)
    mass = np.zeros((model.nv, model.nv))
    if hasattr(data, "qM"):
        mujoco.mj_fullM(model, mass, data.qM)
    else:
        mujoco.mj_fullM(model, data, mass)
    for word, part in (("qpos", data.qpos), ("qvel", data.qvel), ("ctrl", data.ctrl), ("mass", mass), ("bias", data.qfrc_bias)):
        say(word, part)
    say("passive", data.qfrc_spring + data.qfrc_damper)
    say("actuation", data.qfrc_actuator)
    for word, part in (("xpos", data.xpos), ("xquat", data.xquat), ("sites", data.site_xpos), ("forces", data.actuator_force)):
        say(word, part)


def sensors(model):
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    for s in range(model.nsensor):
        first = model.sensor_adr[s]
        say(f"sensor {name(model, mujoco.mjtObj.mjOBJ_SENSOR, s)}", data.sensordata[first : first + model.sensor_dim[s]])


def residuals(model):
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    equality = data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY
    for e in range(model.neq):
        say(f"residual {name(model, mujoco.mjtObj.mjOBJ_EQUALITY, e)}", data.efc_pos[equality & (data.efc_id == e)])


if __name__ == "__main__":
    if sys.argv[1] == "sensors":
        sensors(mujoco.MjModel.from_xml_path(sys.argv[2]))
        sys.exit(0)
    if sys.argv[1] == "residuals":
        residuals(mujoco.MjModel.from_xml_path(sys.argv[2]))
        sys.exit(0)
    if sys.argv[1] == "models":
        models()
        sys.exit(0)
    try:
        model = mujoco.MjModel.from_xml_path(sys.argv[1])
    except ValueError as error:
        print(error)
        sys.exit(78)
    # Bias forces without those of a fluid, and passive ones without gravity compensation.
    model.opt.density, model.opt.viscosity = 0.0, 0.0
    describe(model)
    data, random = mujoco.MjData(model), np.random.default_rng(7)
    for _ in range(int(sys.argv[2])):
        state(model, data, random)
