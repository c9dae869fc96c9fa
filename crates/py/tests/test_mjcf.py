"""Models of MuJoCo in Python: worlds, descriptions, errors; a whole step beside MuJoCo's own."""

from pathlib import Path

import numpy as np
import pytest
import tumble

MODELS = Path(__file__).parents[2] / "scene" / "tests" / "mjcf"


def test_a_world_is_loaded_from_a_model():
    world = tumble.World.load(MODELS / "cartpole.xml", keyframe="tilted")
    cart = world.articulation("cart")
    assert cart.joint_names == ["slider", "hinge"]
    np.testing.assert_array_equal(cart.q, [0.5, 0.3])
    np.testing.assert_array_equal(cart.qd, [-0.1, 0.2])
    assert world.dt == 0.01


def test_a_description_is_read_and_pickled():
    import pickle

    robot = tumble.Articulation.from_mjcf(MODELS / "humanoid.xml")
    assert (robot.name, robot.dof, robot.nq) == ("torso", 27, 28)
    again = pickle.loads(pickle.dumps(robot))
    np.testing.assert_array_equal(again.mass_matrix(), robot.mass_matrix())
    # The armature of the cart, 0.1 kg, is on the diagonal of the mass matrix with 1 kg and the pole's 0.2 kg.
    cartpole = tumble.Articulation.from_mjcf(MODELS / "cartpole.xml")
    assert cartpole.mass_matrix()[0, 0] == pytest.approx(1.3, abs=1e-12)


def test_errors_have_places():
    with pytest.raises(tumble.SceneError, match="2 articulated bodies"):
        tumble.Articulation.from_mjcf(MODELS / "scene.xml")
    with pytest.raises(tumble.SceneError, match="cartpole.xml:1:1: <mujoco> has no keyframe"):
        tumble.World.load(MODELS / "cartpole.xml", keyframe="upright")
    with pytest.raises(ValueError, match="only a model of MuJoCo"):
        tumble.World.load("stack", keyframe="0")
    with pytest.raises(FileNotFoundError):
        tumble.Articulation.from_mjcf(MODELS / "none.xml")


def test_a_swing_is_that_of_mujoco():
    """The same cart-pole by both engines, with an explicit step small enough that both are exact to 1e-4."""
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_path(str(MODELS / "cartpole.xml"))
    model.opt.timestep, model.opt.integrator = 1e-3, mujoco.mjtIntegrator.mjINT_RK4
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    world = tumble.World.load(MODELS / "cartpole.xml", keyframe="0", dt=1e-3)
    cart = world.articulation("cart")
    for _ in range(1000):
        data.ctrl[0] = 0.1
        mujoco.mj_step(model, data)
        cart.tau = [20 * 0.1, 0.0]
        world.step()
    np.testing.assert_allclose(cart.q, data.qpos, atol=1e-4)


def test_a_world_is_written_and_read_back(tmp_path):
    world = tumble.World()
    world.add_static("floor", tumble.HalfSpace())
    world.add_rigid("ball", tumble.Sphere(0.1), mass=2.0, position=(0, 0, 1), velocity=(1, 0, 0), restitution=0.5)
    arm = world.add_articulation(MODELS / "double_pendulum.xml")
    world.step(20)
    arm.tau = [0.1] + [0.0] * (arm.dof - 1)
    notes = world.save_mjcf(tmp_path / "now.xml")
    assert any("restitution" in note for note in notes), notes
    assert any("generalized forces" in note for note in notes), notes
    again = tumble.World.load(tmp_path / "now.xml", keyframe="now")
    same = again.articulation("upper")
    assert same.joint_names == arm.joint_names
    np.testing.assert_allclose(same.q, arm.q, rtol=0, atol=1e-12)
    np.testing.assert_allclose(same.mass_matrix(), arm.mass_matrix(), rtol=0, atol=1e-12)
    np.testing.assert_allclose(again["ball"].position, world["ball"].position, rtol=0, atol=1e-12)
    np.testing.assert_allclose(again["ball"].velocity, world["ball"].velocity, rtol=0, atol=1e-12)
    with pytest.raises(ValueError, match="expected the name of a .xml or .mjcf file"):
        world.save_mjcf(tmp_path / "now.txt")
    with pytest.raises(FileNotFoundError):
        world.save_mjcf(tmp_path / "none" / "now.xml")


ARM = """<sdf version="1.9"><model name="arm"><link name="a">
<inertial><pose>0 0 -0.4 0 0 0</pose><mass>2</mass><inertia><ixx>0.3</ixx><iyy>0.3</iyy><izz>0.3</izz></inertia></inertial></link>
<joint name="j" type="revolute"><parent>world</parent><child>a</child><axis><xyz>0 1 0</xyz></axis></joint></model></sdf>
"""


def test_an_sdf_file_is_read(tmp_path):
    path = tmp_path / "arm.sdf"
    path.write_text(ARM)
    arm = tumble.Articulation.from_sdformat(path)
    assert (arm.name, arm.joint_names) == ("arm", ["j"])
    assert arm.mass_matrix()[0, 0] == pytest.approx(0.3 + 2 * 0.4**2, abs=1e-12)
    assert tumble.World.load(path).articulation("arm").dof == 1
    world = tumble.World()
    assert world.add_articulation(path, name="left").dof == 1
    path.write_text(ARM.replace("revolute", "screw"))
    with pytest.raises(tumble.SceneError, match='arm.sdf:3:23: `type` of joint "j" is "screw"; expected revolute'):
        tumble.World.load(path)
    with pytest.raises(FileNotFoundError):
        tumble.Articulation.from_sdformat(tmp_path / "none.sdf")
