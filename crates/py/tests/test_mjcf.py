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
