"""Agreement with outside programs, where they are installed: scipy's rotations, Pinocchio's dynamics, MuJoCo's motion."""

import numpy as np
import pytest

import tumble


def reference(name):
    return pytest.importorskip(name, reason=f"SKIPPED: {name} is not installed")


def test_rotations_are_scipys():
    rotation = reference("scipy.spatial.transform").Rotation
    rng = np.random.default_rng(5)
    world = tumble.World(gravity=(0, 0, 0), dt=1 / 1000)
    axis = np.array([1.0, 2.0, -0.5])
    start = rotation.random(random_state=7)
    ball = world.add_rigid("ball", tumble.Sphere(0.3), mass=1.0, orientation=start.as_quat(), angular_velocity=axis)
    point = rng.normal(size=3)
    assert ball.to_world(point) == pytest.approx(start.apply(point), abs=1e-12)
    world.step(1000)
    # a ball turns about a fixed axis: after 1 s by that rotation vector
    ended = rotation.from_rotvec(axis) * start
    assert (rotation.from_quat(ball.orientation) * ended.inv()).magnitude() < 1e-9


def test_accelerations_are_pinocchios(root):
    pin = reference("pinocchio")
    urdf = root / "scenes" / "robot" / "arm.urdf"
    arm = tumble.Articulation.from_urdf(urdf)
    model = pin.buildModelFromUrdf(str(urdf))
    data = model.createData()
    assert list(model.names)[1:] == arm.joint_names
    rng = np.random.default_rng(11)
    for _ in range(50):
        q, qd, tau = (rng.uniform(-1.5, 1.5, arm.dof) for _ in range(3))
        assert arm.forward_dynamics(q, qd, 20 * tau) == pytest.approx(pin.aba(model, data, q, qd, 20 * tau), rel=1e-9, abs=1e-9)
        assert arm.inverse_dynamics(q, qd, tau) == pytest.approx(pin.rnea(model, data, q, qd, tau), rel=1e-9, abs=1e-9)
        mass = pin.crba(model, data, q)
        assert arm.mass_matrix(q) == pytest.approx(np.triu(mass) + np.triu(mass, 1).T, rel=1e-9, abs=1e-9)
        last = model.getFrameId(arm.link_names[-1])
        pin.framesForwardKinematics(model, data, q)
        assert arm.link_pose(arm.link_names[-1], q)[:3] == pytest.approx(data.oMf[last].translation, abs=1e-9)
        theirs = pin.computeFrameJacobian(model, data, q, last, pin.LOCAL_WORLD_ALIGNED)
        assert arm.jacobian(arm.link_names[-1], q) == pytest.approx(np.vstack([theirs[3:], theirs[:3]]), abs=1e-9)


def test_a_pendulum_swings_as_mujocos(tmp_path):
    mujoco = reference("mujoco")
    model = mujoco.MjModel.from_xml_string(
        """<mujoco><option timestep="0.0005" integrator="RK4" gravity="0 0 -9.81"/><worldbody><body>
        <joint type="hinge" axis="0 1 0"/><inertial pos="0 0 -0.5" mass="2" diaginertia="0.01 0.02 0.015"/></body></worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    data.qpos[0] = 1.0
    path = tmp_path / "pendulum.urdf"
    path.write_text(
        """<robot name="p"><link name="base"/><link name="bob"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
        <inertia ixx="0.01" iyy="0.02" izz="0.015" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <joint name="hinge" type="continuous"><parent link="base"/><child link="bob"/><axis xyz="0 1 0"/></joint></robot>"""
    )
    world = tumble.World(dt=0.0005, stepper="backtracking", integrator="rk4")
    pendulum = world.add_articulation(path)
    pendulum.q = [1.0]
    for _ in range(20):
        mujoco.mj_step(model, data, 200)
        world.step(200)
        assert pendulum.q[0] == pytest.approx(data.qpos[0], abs=1e-8)


def test_a_sliding_box_stops_as_mujocos():
    mujoco = reference("mujoco")
    model = mujoco.MjModel.from_xml_string(
        """<mujoco><option timestep="0.001" cone="elliptic" impratio="100" gravity="0 0 -9.81"/><worldbody>
        <geom type="plane" size="10 10 1" friction="0.3 0 0"/><body pos="0 0 0.1"><freejoint/>
        <geom type="box" size="0.2 0.2 0.1" mass="1" friction="0.3 0 0"/></body></worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 500)
    begin = data.qpos[0]
    data.qvel[0] = 2.0
    mujoco.mj_step(model, data, 1500)
    theirs = data.qpos[0] - begin
    world = tumble.World(dt=0.001)
    world.add_static("floor", tumble.HalfSpace(), friction=0.3)
    box = world.add_rigid("box", tumble.Box((0.4, 0.4, 0.2)), mass=1.0, position=(0, 0, 0.1), velocity=(2, 0, 0), friction=0.3)
    world.step(1500)
    # both against v²/(2 μ g), which MuJoCo's soft contact meets within 2 %
    assert box.position[0] == pytest.approx(4 / (2 * 0.3 * 9.81), rel=1e-3)
    assert theirs == pytest.approx(box.position[0], rel=0.02)
