"""The shipped tasks: gymnasium's own check, observations and rewards by their definitions written out again, and beside gymnasium's own environments with
MuJoCo where that is installed."""

import ast
import copy
import dataclasses
import pickle
import re
import warnings
from pathlib import Path

import numpy as np
import pytest

import tumble

gymnasium = pytest.importorskip("gymnasium", reason="SKIPPED: gymnasium is not installed")
tumble_gym = pytest.importorskip("tumble.gym")

NAMES = ["InvertedPendulum", "InvertedDoublePendulum", "Reacher", "Pusher", "Swimmer", "Hopper", "Walker2d", "HalfCheetah", "Ant", "Humanoid", "HumanoidStandup"]
FREE = ("Ant", "Humanoid", "HumanoidStandup")  # those with a floating root


@pytest.fixture(scope="module")
def adapter():
    """Whether pictures can be taken."""
    try:
        tumble.World().render(8, 8)
    except tumble.PictureError:
        return False
    return True


@pytest.mark.parametrize("name", NAMES)
def test_gymnasium_s_own_check_passes(name, adapter):
    from gymnasium.utils.env_checker import check_env

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # that numbers have no bounds is meant
        warnings.filterwarnings("ignore", message=".*Box observation space (minimum|maximum) value is")
        # motors of more than one unit are the definition's
        warnings.filterwarnings("ignore", message=".*For Box action spaces, we recommend using a symmetric and normalized space")
        check_env(gymnasium.make(f"tumble/{name}-v0").unwrapped, skip_render_check=not adapter)


def after(name, steps=30, **parameters):
    """An environment some steps into an episode: itself, q and v before and after the last step, its action, and what it returned."""
    env = tumble_gym.Env(name, **parameters)
    env.reset(seed=3)
    env.action_space.seed(4)
    for _ in range(steps):
        q, v = env.runs.batch.q[0].copy(), env.runs.batch.v[0].copy()
        action = env.action_space.sample()
        out = env.step(action)
    return env, (q, v), (env.runs.batch.q[0], env.runs.batch.v[0]), action, out


def test_inverted_pendulum():
    env, _, (q, v), _, (seen, reward, over, cut, info) = after("InvertedPendulum", 3)
    assert env.runs.dt == pytest.approx(0.04)
    assert seen.tolist() == [*q, *v] and reward == 1 - over == info["reward_survive"] and not cut
    env.runs.batch.reset(q=[0, 0.21], v=[0, 0])
    _, reward, over, _, _ = env.step(np.zeros(1))
    assert over and reward == 0


def test_reacher():
    env, _, (q, v), action, (seen, reward, over, _, info) = after("Reacher")
    tip, target = (env.world.articulation(body).link_pose(link)[:2] for body, link in (("arm", "fingertip"), ("target", "target")))
    assert seen == pytest.approx([*np.cos(q[:2]), *np.sin(q[:2]), *q[2:], *v[:2], *(tip - target)], abs=1e-12)
    assert info["reward_dist"] == pytest.approx(-np.hypot(*(tip - target))) and info["reward_ctrl"] == pytest.approx(-(action**2).sum())
    assert reward == info["reward_dist"] + info["reward_ctrl"] and not over
    assert np.linalg.norm(q[2:]) < 0.2 and (v[2:] == 0).all()


@pytest.mark.parametrize(
    ("name", "dt", "cost", "bonus", "limit"), [("Hopper", 0.008, 1e-3, 1.0, 10.0), ("Walker2d", 0.008, 1e-3, 1.0, 10.0), ("HalfCheetah", 0.05, 0.1, 0.0, np.inf)]
)
def test_those_in_a_plane(name, dt, cost, bonus, limit):
    env, (before, _), (q, v), action, (seen, reward, over, _, info) = after(name, 8)
    assert env.runs.dt == pytest.approx(dt)
    assert seen.tolist() == [*q[1:], *np.clip(v, -limit, limit)]
    speed = (q[0] - before[0]) / dt
    assert reward == pytest.approx(speed - cost * (action**2).sum() + bonus * (not over))
    assert info["x_velocity"] == pytest.approx(speed) and info["x_position"] == q[0]
    assert info["reward_ctrl"] == pytest.approx(-cost * (action**2).sum())
    whole = tumble_gym.Env(name, exclude_current_positions_from_observation=False)
    first, start = whole.reset(seed=0)
    assert first[0] == start["x_position"] and whole.observation_space.contains(first) and len(first) == len(seen) + 1


@pytest.mark.parametrize(
    ("name", "q", "over"),
    [
        ("Hopper", [0, 0.69, 0, 0, 0, 0], True),
        ("Hopper", [0, 1.3, 0.21, 0, 0, 0], True),
        ("Hopper", [0, 1.3, 0.19, 0, 0, 0], False),
        ("Walker2d", [0, 0.79, 0, 0, 0, 0, 0, 0, 0], True),
        ("Walker2d", [0, 2.01, 0, 0, 0, 0, 0, 0, 0], True),
        ("Walker2d", [0, 1.5, 0.99, 0, 0, 0, 0, 0, 0], False),
        ("Walker2d", [0, 1.5, -1.01, 0, 0, 0, 0, 0, 0], True),
        ("HalfCheetah", [0, 5, 3, 0, 0, 0, 0, 0, 0], False),
    ],
)
def test_when_an_episode_ends(name, q, over):
    env = tumble_gym.Env(name)
    env.reset(seed=0)
    env.runs.batch.reset(q=q, v=np.zeros(len(q)))
    assert env.task.terminated(tumble_gym.State.of(env.runs.batch)).tolist() == [over]


def test_ant():
    env, (before, _), (q, v), action, (seen, reward, over, _, info) = after("Ant", 27)
    x, y, z, w = q[3:7]
    turn = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])  # fmt: skip
    assert seen[:13] == pytest.approx([q[2], w, x, y, z, *q[7:]])
    assert seen[13:27] == pytest.approx([*v[3:6], *(turn.T @ v[:3]), *v[6:]])
    assert ((env.world.articulation("torso").qd[3:6]) == v[3:6]).all()
    # contacts, added up one by one
    world = env.world
    body, contacts = world.articulation("torso"), world.contacts
    forces = np.zeros((13, 6))
    for contact in contacts:
        side = [world.bodies[b].name for b in contact["bodies"]].index("torso")
        force = contact["force"] * (1, -1)[side]
        row = env.task.BODIES.index(body.link_names[contact["parts"][side]])
        forces[row] += [*np.cross(contact["point"] - body.center_of_mass(), force), *force]
    assert len(contacts) > 0 and abs(forces).max() > 1
    assert seen[27:].reshape(13, 6) == pytest.approx(np.clip(forces, -1, 1), abs=1e-9)
    speed = (q[0] - before[0]) / 0.05
    parts = [speed, -0.5 * (action**2).sum(), 1.0 * (not over), -5e-4 * (np.clip(forces, -1, 1) ** 2).sum()]
    assert [info[key] for key in ("reward_forward", "reward_ctrl", "reward_survive", "reward_contact")] == pytest.approx(parts)
    assert reward == pytest.approx(sum(parts)) and info["distance_from_origin"] == pytest.approx(np.hypot(*q[:2]))
    short = tumble_gym.Env("Ant", include_cfrc_ext_in_observation=False)
    assert short.reset(seed=0)[0].shape == (27,) == short.observation_space.shape


def test_inverted_double_pendulum():
    env, (before, _), (q, v), action, (seen, reward, over, _, info) = after("InvertedDoublePendulum", 4)
    assert env.runs.dt == pytest.approx(0.05)
    assert seen == pytest.approx([q[0], *np.sin(q[1:]), *np.cos(q[1:]), *np.clip(v, -10, 10), 0])
    pose = env.body.link_pose("upper")
    assert pose[0] == pytest.approx(q[0] + 0.6 * np.sin(q[1]))
    x, z = q[0] + 0.6 * (np.sin(q[1]) + np.sin(q[1] + q[2])), 0.6 * (np.cos(q[1]) + np.cos(q[1] + q[2]))
    assert over == (z <= 1) and info["reward_survive"] == 10 * (not over)
    assert reward == pytest.approx(10 * (not over) - 0.01 * x**2 - (z - 2) ** 2 - 1e-3 * v[1] ** 2 - 5e-3 * v[2] ** 2)


def test_the_end_of_the_rail_pushes_back():
    """A cart that is pressed against the end, its poles hanging at rest: the force is that of the motor."""
    env = tumble_gym.Env("InvertedDoublePendulum")
    env.reset(seed=0)
    env.runs.batch.reset(q=[1.0, np.pi, 0.0], v=np.zeros(3))
    for _ in range(3):
        seen, *_ = env.step(np.array([0.01]))  # 5 N
    assert seen[8] == pytest.approx(-5.0, abs=1e-3) and seen[0] == pytest.approx(1.0, abs=1e-6)
    assert env.step(np.array([1.0]))[0][8] == -10
    assert env.reset(seed=1)[0][8] == 0


def test_pusher():
    env, _, (q, v), action, (seen, reward, over, _, info) = after("Pusher", 5)
    gripper = env.world.articulation("shoulder").link_pose("gripper")[:3]
    disk, goal = (env.world.articulation(name).link_poses()[-1, :3] for name in ("object", "goal"))
    assert seen == pytest.approx([*q[:7], *v[:7], *gripper, *disk, *goal], abs=1e-12)
    near, far = np.linalg.norm(disk - gripper), np.linalg.norm(disk - goal)
    assert np.linalg.norm(q[7:9]) > 0.17 and (q[9:] == 0).all() and not over
    assert [info[key] for key in ("reward_near", "reward_dist", "reward_ctrl")] == pytest.approx([-near / 2, -far, -0.1 * (action**2).sum()])
    assert reward == pytest.approx(-near / 2 - far - 0.1 * (action**2).sum())


def test_the_gripper_pushes_the_cylinder():
    env = tumble_gym.Env("Pusher")
    env.reset(seed=0)
    q = np.zeros(11)
    q[1], q[7], q[8] = 0.45, -0.6, 0.36  # the arm is lowered, the cylinder lies beside the gripper
    env.runs.batch.reset(q=q, v=np.zeros(11))
    for _ in range(20):
        env.step(np.array([2.0, 0, 0, 0, 0, 0, 0]))
    assert env.runs.batch.q[0, 7] > -0.55


def test_swimmer():
    env, (before, _), (q, v), action, (seen, reward, over, _, info) = after("Swimmer", 20)
    assert env.runs.dt == pytest.approx(0.04) and seen.tolist() == [*q[2:], *v] and not over
    speed = (q[:2] - before[:2]) / 0.04
    assert reward == pytest.approx(speed[0] - 1e-4 * (action**2).sum()) and info["y_velocity"] == pytest.approx(speed[1])
    assert info["distance_from_origin"] == pytest.approx(np.hypot(*q[:2]))


def test_the_fluid_slows_a_swimmer():
    """Straight along its axis: m dv/dt = -(6 b π s + 2 d r_y r_z v) v for each of the three links, and the armature moves with them."""

    class Fine(tumble_gym.SwimmerTask):  # a force that depends on velocities is integrated to first order
        FRAME_SKIP = 160

        def world(self):
            world = super().world()
            world.dt = 0.04 / self.FRAME_SKIP
            return world

    env = tumble_gym.Env(Fine())
    env.reset(seed=0)
    env.runs.batch.reset(q=np.zeros(5), v=[2.0, 0, 0, 0, 0])
    from tumble.gym.swimmer import half_sizes

    x, y, z = half_sizes()
    linear, square = 3 * 6 * 0.1 * np.pi * (x + y + z) / 3, 3 * 2 * 4000 * y * z
    mass = env.world.articulation("front").mass + 0.1
    for k in range(1, 6):
        env.step(np.zeros(2))
        decay = np.exp(-linear / mass * 0.04 * k)
        assert env.runs.batch.v[0, 0] == pytest.approx(2 * decay / (1 + 2 * square / linear * (1 - decay)), rel=1e-3)
    assert abs(env.runs.batch.v[0, 1:]).max() < 1e-9


def test_the_drag_is_mujoco_s():
    for package in ("mujoco", "imageio"):
        pytest.importorskip(package, reason=f"SKIPPED: {package} is not installed; `make references` installs it")
    from tumble.gym.swimmer import LINKS, drag

    theirs, body, rng = gymnasium.make("Swimmer-v5").unwrapped, tumble_gym.Env("Swimmer").world.articulation("front"), np.random.default_rng(5)
    theirs.reset(seed=0)
    for _ in range(10):
        q, v = rng.uniform(-1, 1, 5), rng.normal(0, 2, 5)
        theirs.set_state(q, v)
        found = np.zeros(5)
        for link, middle in zip(LINKS, (1.0, -0.5, -0.5)):
            pose, jacobian = body.link_pose(link, q), body.jacobian(link, q)
            angle = 2 * np.arctan2(pose[5], pose[6])
            away = middle * np.array([np.cos(angle), np.sin(angle), 0])
            jacobian[3:] += np.cross(jacobian[:3].T, away).T  # at the center of mass
            twist = jacobian @ v
            force, torque = drag(pose[None, 3:], twist[None, 3:], twist[None, :3])
            found += jacobian[3:].T @ force[0] + jacobian[:3].T @ torque[0]
        assert abs(found).max() > 1 and found == pytest.approx(theirs.data.qfrc_passive, rel=1e-9, abs=1e-9)


def test_humanoid():
    env, (before, _), (q, v), action, (seen, reward, over, _, info) = after("Humanoid", 12)
    body = env.world.articulation("torso")
    jacobians = {name: body.jacobian(name) for name in env.task.names}
    # the masses give the total, the first moments the center of mass, the velocities the momentum of the whole
    inertias = seen[45:175].reshape(13, 10)
    assert inertias[:, 9].sum() == pytest.approx(body.mass) and inertias[:, 6:9].sum(axis=0) == pytest.approx(np.zeros(3), abs=1e-9)
    velocities = seen[175:253].reshape(13, 6)
    assert velocities[:, :3] == pytest.approx(np.array([jacobian[:3] @ v for jacobian in jacobians.values()]))
    momentum = (inertias[:, 9:] * velocities[:, 3:] + np.cross(velocities[:, :3], inertias[:, 6:9])).sum(axis=0)
    step = 1e-6
    moved = q.copy()
    moved[:3] += step * v[3:6]
    moved[7:] += step * v[6:]
    turned = np.concatenate([step / 2 * v[:3], [1.0]])  # a small turn before the orientation
    (ax, ay, az, aw), (bx, by, bz, bw) = turned, q[3:7]
    moved[3:7] = [aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx, aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz]
    moved[3:7] /= np.linalg.norm(moved[3:7])
    assert momentum == pytest.approx(body.mass * (body.center_of_mass(moved) - body.center_of_mass(q)) / step, abs=2e-3)
    torques = np.zeros(23)
    names = [*body.joint_names]
    for (joint, gear), a in zip(env.task.MOTORS, action):
        torques[names.index(joint) + 5] = gear * a
    assert seen[253:270] == pytest.approx(torques[6:])
    speed = (body.center_of_mass(q) - body.center_of_mass(before))[0] / 0.015
    contact = min(5e-7 * (seen[270:] ** 2).sum(), 10)
    assert reward == pytest.approx(1.25 * speed + 5 * (not over) - 0.1 * (action**2).sum() - contact)
    assert over == (not 1 < q[2] < 2) and info["x_velocity"] == pytest.approx(speed)
    short = tumble_gym.Env("Humanoid", include_cinert_in_observation=False, include_cvel_in_observation=False, include_qfrc_actuator_in_observation=False,
                           include_cfrc_ext_in_observation=False, exclude_current_positions_from_observation=False)  # fmt: skip
    assert short.reset(seed=0)[0].shape == (47,) == short.observation_space.shape


def test_humanoid_standup():
    env, _, (q, v), action, (seen, reward, over, _, info) = after("HumanoidStandup", 20)
    forces = seen[270:].reshape(13, 6)
    weight = 9.81 * env.world.articulation("torso").mass
    assert forces[:, 5].sum() > 0.2 * weight  # it lies on the floor
    assert reward == pytest.approx(q[2] / 0.003 - 0.1 * (action**2).sum() - min(0.5e-6 * (forces**2).sum(), 10) + 1) and not over
    assert info["z_distance_from_origin"] == pytest.approx(q[2] - 0.105)


@pytest.mark.parametrize("name", NAMES)
def test_beside_gymnasium_s_own_environment(name):
    """Masses, and observation, reward and end at the same state, which gymnasium's environment is put into."""
    for package in ("mujoco", "imageio"):  # gymnasium's environments need both
        pytest.importorskip(package, reason=f"SKIPPED: {package} is not installed; `make references` installs it")
    own = tumble_gym.Env(name)
    theirs = gymnasium.make(f"{name}-v5").unwrapped
    body = next(b for b in own.world.bodies if isinstance(b, tumble.Articulation))
    assert own.runs.dt == pytest.approx(theirs.dt) and own.action_space == theirs.action_space and own.observation_space == theirs.observation_space
    data, rng = theirs.data, np.random.default_rng(2)
    theirs.reset(seed=0), own.reset(seed=0)
    for _ in range(10):
        q, v = own.runs.batch.q[0] + rng.uniform(-0.1, 0.1, len(own.runs.q)), rng.normal(0, 1, len(own.runs.v))
        qpos, qvel = q.copy(), v.copy()
        if name in FREE:
            q[3:7] /= np.linalg.norm(q[3:7])
            qpos[3:7], qvel[:3] = q[[6, 3, 4, 5]], v[3:6]
            own.runs.batch.reset(q=q, v=v)
            first = 16 if name == "Ant" else 25
            qvel[3:6] = own.task.observe(tumble_gym.State.of(own.runs.batch))[0, first : first + 3]
        own.runs.batch.reset(q=q, v=v)
        theirs.set_state(qpos, qvel)
        state = tumble_gym.State.of(own.runs.batch)
        seen, wanted = own.task.observe(state)[0], theirs._get_obs()
        n = 27 if name == "Ant" else len(wanted)
        assert seen[:n] == pytest.approx(wanted[:n], abs=1e-9)
        if hasattr(theirs, "is_healthy"):
            assert own.task.healthy(state)[0] == bool(theirs.is_healthy)
        if name != "Reacher":
            import mujoco

            inertia = np.zeros((theirs.model.nv, theirs.model.nv))
            mujoco.mj_fullM(theirs.model, data, inertia)
            rows = slice(6, None) if name in FREE else slice(body.dof)
            inertia = inertia[: body.dof, : body.dof]
            assert body.mass_matrix(q[: body.nq])[rows, rows] == pytest.approx(inertia[rows, rows], rel=1e-6, abs=1e-6)


PICTURES = {"xml_file", "default_camera_config"}  # parameters of gymnasium's environments that are of files and pictures alone


@pytest.mark.parametrize("name", NAMES)
def test_parameters_are_those_of_gymnasium(name):
    """Read from the source, which needs no MuJoCo."""
    folder = Path(gymnasium.__file__).parent / "envs" / "mujoco"
    stem = "humanoidstandup" if name == "HumanoidStandup" else re.sub("(?<=[a-z])(?=[A-Z])", "_", name).lower()
    tree = ast.parse((folder / f"{stem}_v5.py").read_text(encoding="utf-8"))
    (start,) = (each for each in ast.walk(tree) if isinstance(each, ast.FunctionDef) and each.name == "__init__")
    arguments = start.args.args[1:]
    theirs = {each.arg: ast.unparse(default) for each, default in zip(arguments, start.args.defaults, strict=True)}
    task = getattr(tumble_gym, f"{name}Task")()
    own = {each.name: getattr(task, each.name) for each in dataclasses.fields(task)}
    assert theirs.keys() - own.keys() == PICTURES
    own["frame_skip"] = task.steps
    for parameter, default in theirs.items():
        if parameter not in PICTURES:
            assert own[parameter] == eval(default, {"np": np}), parameter


@pytest.mark.parametrize(
    ("name", "parameters", "q", "over"),
    [
        ("Hopper", {"healthy_z_range": (0.5, 2.0)}, [0, 0.69, 0, 0, 0, 0], False),
        ("Hopper", {"healthy_z_range": (0.5, 2.0)}, [0, 2.1, 0, 0, 0, 0], True),
        ("Hopper", {"healthy_angle_range": (-0.1, 0.3)}, [0, 1.3, 0.25, 0, 0, 0], False),
        ("Hopper", {"healthy_angle_range": (-0.1, 0.3)}, [0, 1.3, -0.15, 0, 0, 0], True),
        ("Hopper", {"healthy_state_range": (-0.5, 100)}, [0, 1.3, 0, 0, -0.6, 0], True),
        ("Hopper", {"healthy_state_range": (-0.7, 100)}, [0, 1.3, 0, 0, -0.6, 0], False),
        ("Walker2d", {"healthy_z_range": (0.5, 1.0)}, [0, 1.5, 0, 0, 0, 0, 0, 0, 0], True),
        ("Walker2d", {"healthy_angle_range": (-2, 1)}, [0, 1.5, -1.01, 0, 0, 0, 0, 0, 0], False),
        ("Ant", {"healthy_z_range": (0.1, 0.2)}, [0, 0, 0.21, 0, 0, 0, 1, *[0.0] * 8], True),
        ("Ant", {"healthy_z_range": (0.1, 0.2)}, [0, 0, 0.15, 0, 0, 0, 1, *[0.0] * 8], False),
    ],
)
def test_ranges_say_when_an_episode_ends(name, parameters, q, over):
    env = tumble_gym.Env(name, **parameters)
    env.reset(seed=0)
    env.runs.batch.reset(q=q, v=np.zeros(env.runs.batch.dof))
    assert env.task.terminated(tumble_gym.State.of(env.runs.batch)).tolist() == [over]


def test_frame_skip_is_that_many_steps_of_the_world():
    once, twice = tumble_gym.Env("HalfCheetah", frame_skip=3), tumble_gym.Env("HalfCheetah", frame_skip=6)
    once.reset(seed=1), twice.reset(seed=1)
    action = np.linspace(-1, 1, 6)
    once.step(action)
    assert (once.step(action)[0] == twice.step(action)[0]).all()
    assert once.runs.dt == pytest.approx(0.03)
    assert once.metadata["render_fps"] == 33


def test_the_ant_s_main_body_and_range_of_forces():
    thigh, torso = after("Ant", 27, main_body="thigh_2", contact_force_range=(-3.0, 2.0)), after("Ant", 27)
    env, (before, _), (q, _), _, (seen, _, _, _, info) = thigh
    body = env.world.articulation("torso")
    way = body.link_pose("thigh_2", q)[:2] - body.link_pose("thigh_2", before)[:2]
    assert [info["x_velocity"], info["y_velocity"]] == pytest.approx(list(way / 0.05)) and info["x_position"] == q[0]
    assert info["x_velocity"] != torso[-1][-1]["x_velocity"] and (torso[2][0] == q).all()
    wide = seen[27:]
    assert wide.max() == 2.0 and -3 <= wide.min() < -1 and (np.clip(wide, -1, 1) == torso[-1][0][27:]).all()
    assert info["reward_contact"] == pytest.approx(-5e-4 * (wide**2).sum())
    assert tumble_gym.AntTask(main_body=6).BODIES[5] == "thigh_2"
    assert after("Ant", 27, main_body=6)[-1][-1]["x_velocity"] == info["x_velocity"]


@pytest.mark.parametrize(
    ("name", "parameters", "error", "words"),
    [
        ("Hopper", {"healthy_rewrd": 1}, TypeError, "did you mean 'healthy_reward'"),
        ("Hopper", {"xml_file": "hopper.xml"}, TypeError, "'xml_file'; there are .*healthy_z_range"),
        ("Hopper", {"frame_skip": 0}, ValueError, "frame_skip is 0; it must be a whole number of at least 1"),
        ("Hopper", {"frame_skip": 1.5}, ValueError, "frame_skip is 1.5"),
        ("Hopper", {"healthy_z_range": (2, 1)}, ValueError, r"healthy_z_range is \(2, 1\); it must be a pair of numbers, the lower one first"),
        ("Walker2d", {"healthy_angle_range": 3}, ValueError, "healthy_angle_range is 3; it must be a pair"),
        ("Ant", {"main_body": 0}, ValueError, "main_body is 0; it must be 1 to 13, or one of torso"),
        ("Ant", {"main_body": "head"}, ValueError, "main_body is 'head'"),
    ],
)
def test_wrong_parameters_are_refused(name, parameters, error, words):
    for make in (tumble_gym.Env, tumble_gym.VectorEnv):
        with pytest.raises(error, match=words):
            make(name, **parameters)


def test_a_made_task_takes_no_parameters():
    with pytest.raises(TypeError, match="frame_skip: the task is made already; give its parameters to HopperTask"):
        tumble_gym.Env(tumble_gym.HopperTask(), frame_skip=2)


def test_an_unknown_motor_is_refused():
    class Lost(tumble_gym.HopperTask):
        MOTORS = (("wheel", 1.0),)

    with pytest.raises(KeyError, match="'torso' has no joint named 'wheel'; there are x, z, turn, hip"):
        tumble_gym.Env(Lost)


@pytest.mark.parametrize("name", NAMES)
def test_a_pickled_environment_goes_on_alike(name):
    env = after(name, 3)[0]
    action = env.action_space.sample()
    copies = pickle.loads(pickle.dumps(env)), copy.deepcopy(env)
    seen, reward, *_ = env.step(action)
    for each in copies:
        again = each.step(action)
        assert (again[0] == seen).all() and again[1] == reward
