"""Articulated bodies: algorithms against closed forms and each other, batches, motion in a world."""

import numpy as np
import pytest

import tumble

PENDULUM = """<robot name="pendulum">
  <link name="base"/>
  <link name="bob"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
    <inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="hinge" type="revolute"><parent link="base"/><child link="bob"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2.5" effort="10" velocity="10"/></joint>
</robot>"""


@pytest.fixture
def pendulum(tmp_path):
    path = tmp_path / "pendulum.urdf"
    path.write_text(PENDULUM)
    return tumble.Articulation.from_urdf(path)


@pytest.fixture
def arm(root):
    return tumble.Articulation.from_urdf(root / "scenes" / "robot" / "arm.urdf")


def test_a_pendulum_accelerates_as_the_textbook_says(pendulum):
    # 2 kg on 0.5 m: q̈ = −g/l sin q + τ/(m l²)
    assert pendulum.joint_names == ["hinge"] and pendulum.link_names == ["base", "bob"]
    q = np.linspace(-3, 3, 50)
    expected = -9.81 / 0.5 * np.sin(q) + 0.7 / (2 * 0.25)
    got = pendulum.forward_dynamics(q[:, None], np.zeros((50, 1)), [0.7])
    assert got.shape == (50, 1) and got[:, 0] == pytest.approx(expected, abs=1e-12)
    assert pendulum.forward_dynamics([q[7]], [0.0], [0.7]) == pytest.approx(expected[7], abs=1e-12)
    assert pendulum.mass_matrix([1.0]) == pytest.approx(np.array([[2 * 0.25]]))
    assert pendulum.limits == pytest.approx(np.array([[-2, 2.5]]))
    assert pendulum.center_of_mass([np.pi / 2]) == pytest.approx([-0.5, 0, 0])


def test_gravity_of_a_description_can_be_set(pendulum):
    pendulum.gravity = (0, 0, -1.62)
    assert pendulum.forward_dynamics([0.3], [0.0], [0.0])[0] == pytest.approx(-1.62 / 0.5 * np.sin(0.3))


def test_a_joint_without_inertia_is_an_error_of_forward_dynamics_too():
    builder = tumble.ArticulationBuilder("stack")
    builder.add_link("yaw", axis=(0, 0, 1))
    builder.add_link("pitch", "yaw", axis=(0, 1, 0))
    builder.add_link("roll", "pitch", axis=(0, 0, 1), shape=tumble.Box(0.1, 0.2, 0.3), mass=1)
    stack = builder.build()
    message = "of row 7 is singular: the joint of link 'yaw' moves no inertia in this pose"
    q = np.tile([0.1, 0.4, 0.2], (40, 1))
    for call in (stack.forward_dynamics, stack.forward_dynamics_derivatives):
        assert np.isfinite(call(q, np.zeros(3), np.ones(3))).all()
        locked = q.copy()
        locked[[7, 12], 1] = 0
        for count in (8, 9, 40):  # in lanes, the last register full or not
            with pytest.raises(tumble.InvalidValueError, match=message):
                call(locked[:count], np.zeros(3), np.ones(3))
        with pytest.raises(tumble.InvalidValueError, match="at the positions is singular: the joint of link 'yaw'"):
            call([0, 0, 0], np.zeros(3), np.ones(3))
    # the next neighbor has an acceleration
    assert stack.mass_matrix([0, 1e-3, 0]) @ stack.forward_dynamics([0, 1e-3, 0], np.zeros(3), [1, 0, 0]) == pytest.approx([1, 0, 0], abs=1e-6)
    point = tumble.ArticulationBuilder("point")
    point.add_link("bead", axis=(0, 0, 1), mass=1, center_of_mass=(0, 0, 1), inertia=(0, 0, 0))
    with pytest.raises(tumble.InvalidValueError, match="the joint of link 'bead' moves no inertia"):
        point.build().forward_dynamics([0.0], [0.0], [1.0])


def random_states(arm, count, seed=1):
    rng = np.random.default_rng(seed)
    return [rng.uniform(-1.5, 1.5, (count, arm.dof)) for _ in range(3)]


def test_inverse_dynamics_undoes_forward_dynamics(arm):
    q, qd, tau = random_states(arm, 40)
    qdd = arm.forward_dynamics(q, qd, 10 * tau)
    assert arm.inverse_dynamics(q, qd, qdd) == pytest.approx(10 * tau, abs=1e-9)


def test_a_batch_has_the_bits_of_its_rows(arm):
    # 1001 rows of 6: threads share them, and the last register of lanes is not full
    q, qd, tau = random_states(arm, 1001)
    whole = arm.forward_dynamics(q, qd, tau)
    one_by_one = np.array([arm.forward_dynamics(*row) for row in zip(q, qd, tau)])
    assert (whole == one_by_one).all()
    assert (arm.link_poses(q)[5] == arm.link_poses(q[5])).all()
    assert (arm.mass_matrix(q)[5] == arm.mass_matrix(q[5])).all()


def test_the_mass_matrix_is_the_slope_of_inverse_dynamics(arm):
    q, _, _ = random_states(arm, 1)
    still = np.zeros(arm.dof)
    rest = arm.inverse_dynamics(q[0], still)
    columns = [arm.inverse_dynamics(q[0], still, unit) - rest for unit in np.eye(arm.dof)]
    assert arm.mass_matrix(q[0]) == pytest.approx(np.array(columns).T, abs=1e-10)


def test_derivatives_are_slopes(arm):
    q, qd, tau = (row[0] for row in random_states(arm, 1, seed=3))
    h, unit = 1e-5, np.eye(arm.dof)

    def slopes(of):
        return np.array([(of(h * e) - of(-h * e)) / (2 * h) for e in unit]).T

    by_q, by_qd, by_tau = arm.forward_dynamics_derivatives(q, qd, tau)
    assert by_q == pytest.approx(slopes(lambda d: arm.forward_dynamics(q + d, qd, tau)), rel=1e-6, abs=1e-5)
    assert by_qd == pytest.approx(slopes(lambda d: arm.forward_dynamics(q, qd + d, tau)), rel=1e-6, abs=1e-5)
    assert by_tau @ arm.mass_matrix(q) == pytest.approx(unit, abs=1e-9)
    qdd = arm.forward_dynamics(q, qd, tau)
    by_q, by_qd, mass = arm.inverse_dynamics_derivatives(q, qd, qdd)
    assert by_q == pytest.approx(slopes(lambda d: arm.inverse_dynamics(q + d, qd, qdd)), rel=1e-6, abs=1e-6)
    assert by_qd == pytest.approx(slopes(lambda d: arm.inverse_dynamics(q, qd + d, qdd)), rel=1e-6, abs=1e-6)
    assert mass == pytest.approx(arm.mass_matrix(q), abs=1e-12)


def test_derivatives_of_a_batch_have_the_bits_of_its_rows(arm):
    q, qd, tau = random_states(arm, 60)
    whole = arm.forward_dynamics_derivatives(q, qd, tau)
    assert whole.shape == (60, 3, arm.dof, arm.dof)
    assert (whole[7] == arm.forward_dynamics_derivatives(q[7], qd[7], tau[7])).all()
    assert (arm.inverse_dynamics_derivatives(q, qd[0])[9] == arm.inverse_dynamics_derivatives(q[9], qd[0])).all()


def test_jacobians_are_differences_of_poses(arm):
    q, qd, _ = random_states(arm, 1)
    h = 1e-6
    for link in ["wrist", arm.link_names[-1]]:
        if link not in arm.link_names:
            continue
        before, after = (arm.link_pose(link, q[0] + s * h * qd[0]) for s in (-1, 1))
        velocity = (after[:3] - before[:3]) / (2 * h)
        assert (arm.jacobian(link, q[0]) @ qd[0])[3:] == pytest.approx(velocity, abs=1e-7)
        turn = (after[3:] - before[3:]) / (2 * h)  # q̇ = ½ ω q
        x, y, z, w = arm.link_pose(link, q[0])[3:]
        rates = 2 * np.array([[w, z, -y, -x], [-z, w, x, -y], [y, -x, w, -z]]) @ turn
        # of a turn about world axes: ω = 2 q̇ q*
        rates = 2 * np.array([w * turn[0] - x * turn[3] - (turn[1] * z - turn[2] * y), w * turn[1] - y * turn[3] - (turn[2] * x - turn[0] * z),
                              w * turn[2] - z * turn[3] - (turn[0] * y - turn[1] * x)])
        assert (arm.jacobian(link, q[0]) @ qd[0])[:3] == pytest.approx(rates, abs=1e-7)


def test_a_pendulum_in_a_world_keeps_its_energy(pendulum):
    world = tumble.World(dt=1 / 1000, stepper="backtracking", integrator="rk4")
    placed = world.add_articulation(pendulum, base=(0, 0, 3))
    placed.q = [1.0]
    before = world.energy().total
    assert before == pytest.approx(2 * 9.81 * (3 - 0.5 * np.cos(1.0)))
    world.step(2000)
    assert world.energy().total == pytest.approx(before, abs=1e-8)
    assert placed.link_pose("bob")[:3] == pytest.approx([0, 0, 3])


def test_tau_acts_until_it_is_set_anew(pendulum):
    world = tumble.World(gravity=(0, 0, 0))
    placed = world.add_articulation(pendulum)
    placed.tau = [0.5]
    world.step(240)
    assert placed.qd[0] == pytest.approx(0.5 / (2 * 0.25), rel=1e-9)
    assert world.fork().bodies[0].tau == pytest.approx([0.5])
    placed.tau = [0.0]
    world.step(10)
    assert placed.qd[0] == pytest.approx(0.5 / (2 * 0.25), rel=1e-9)


def test_a_drive_brings_its_joint_to_its_target(pendulum):
    world = tumble.World()
    placed = world.add_articulation(pendulum, name="driven")
    placed.set_drive("hinge", target=0.8, stiffness=1e4, damping=200)
    world.step(2 * 240)
    # what is left is what the spring needs to carry the weight
    assert placed.q[0] == pytest.approx(0.8 - 2 * 9.81 * 0.5 * np.sin(0.8) / 1e4, abs=1e-5)
    with pytest.raises(KeyError, match="there is no joint named 'elbow'; there are hinge"):
        placed.set_drive("elbow", target=1.0, stiffness=1.0)


def test_two_of_one_description_stand_in_one_world(pendulum):
    world = tumble.World()
    world.add_articulation(pendulum, base=(0, 0, 1), name="a")
    world.add_articulation(pendulum, base=(1, 0, 1, 0, 0, np.sin(0.5), np.cos(0.5)), name="b")
    assert world.bodies.names() == ["a", "b"]
    assert world["b"].link_pose("bob") == pytest.approx([1, 0, 1, 0, 0, np.sin(0.5), np.cos(0.5)])
    with pytest.raises(ValueError, match="already in the world"):
        world.add_articulation(pendulum, name="a")


def test_a_floating_body_falls(root):
    arm = tumble.Articulation.from_urdf(root / "scenes" / "robot" / "arm.urdf", floating=True)
    assert (arm.nq, arm.dof) == (13, 12)
    world = tumble.World()
    placed = world.add_articulation(arm, base=(0, 0, 5))
    start = placed.center_of_mass()
    assert start == pytest.approx(arm.center_of_mass() + [0, 0, 5])
    world.step(24)
    assert placed.center_of_mass() - start == pytest.approx([0, 0, -0.5 * 9.81 * 0.1**2], abs=1e-6)
    with pytest.raises(ValueError, match="quaternion of link 'base' in row 0 has length 0"):
        arm.forward_dynamics(np.zeros(13), np.zeros(12), np.zeros(12))


def test_a_shipped_robot_is_found_by_name():
    world = tumble.World.load("robot")
    arm = world["arm"]
    assert arm.joint_names == ["turn", "shoulder", "elbow", "forearm_roll", "wrist", "flange"] or len(arm.joint_names) == arm.dof
    before = arm.q
    world.step(120)
    assert np.abs(arm.q - before).max() > 1e-3


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (([0.0] * 5, [0.0] * 6, [0.0] * 6), r"q: expected shape \(6,\) or \(batch, 6\), got \(5,\)"),
        (([0.0] * 6, np.zeros((3, 6)), np.zeros((4, 6))), r"tau: shape \(4, 6\) in a batch of 3"),
        (([np.nan] * 6, [0.0] * 6, [0.0] * 6), "q: number 0 is NaN"),
        (("no", [0.0] * 6, [0.0] * 6), "q: expected numbers, not 'no'"),
    ],
)
def test_wrong_arguments_are_value_errors(arm, arguments, words):
    with pytest.raises(ValueError, match=words) as caught:
        arm.forward_dynamics(*arguments)
    assert isinstance(caught.value, tumble.TumbleError)


def test_a_missing_urdf_is_a_missing_file(tmp_path):
    with pytest.raises(FileNotFoundError, match="nowhere.urdf"):
        tumble.Articulation.from_urdf(tmp_path / "nowhere.urdf")
    (tmp_path / "bad.urdf").write_text("<robot name='r'><link/></robot>")
    with pytest.raises(ValueError, match="bad.urdf:1"):
        tumble.Articulation.from_urdf(str(tmp_path / "bad.urdf"))


def test_saved_worlds_go_on_under_the_same_torques(root):
    def arm_world():
        world = tumble.World()
        world.add_static("ground", tumble.HalfSpace())
        return world, world.add_articulation(root / "scenes" / "robot" / "arm.urdf", base=(0, 0, 1), name="arm")

    world, arm = arm_world()
    plain = world.save()
    arm.tau = np.zeros(arm.dof)
    assert world.save() == plain  # none and zeros are the same
    arm.tau = (3.0, -20.0, 5.0, 0.25, 1.0, 0.0)
    world.step(20)
    saved = world.save()
    world.step(30)
    other, twin = arm_world()
    twin.tau = (9.0,) * 6
    other.restore(saved)
    assert (twin.tau == arm.tau).all() and other.save() == saved
    other.step(30)
    assert other.save() == world.save()
    other.restore(plain)  # saved without torques: there are none
    assert (twin.tau == 0).all() and other.save() == plain
    # what is damaged or of another world changes nothing
    before = other.save()
    numbers = bytearray(saved)
    numbers[-20:-12] = b"\xff" * 8  # the last torque: no number
    count = bytearray(saved)
    count[-64:-60] = (7).to_bytes(4, "little")
    for bad in (bytes(numbers), bytes(count), saved[: len(plain)][:-9] + saved[-12:], saved[-12:], b"tumbleT1"):
        with pytest.raises(tumble.SnapshotError):
            other.restore(bad)
    with pytest.raises(tumble.SnapshotError, match="of another world"):
        tumble.World().restore(saved)
    assert other.save() == before
