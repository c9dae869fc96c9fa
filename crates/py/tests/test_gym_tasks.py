"""The shipped tasks: gymnasium's own check, observations and rewards by their definitions written out again, and beside gymnasium's own environments with
MuJoCo where that is installed."""

import warnings

import numpy as np
import pytest

import tumble

gymnasium = pytest.importorskip("gymnasium", reason="SKIPPED: gymnasium is not installed")
tumble_gym = pytest.importorskip("tumble.gym")

NAMES = ["InvertedPendulum", "Reacher", "Hopper", "Walker2d", "HalfCheetah", "Ant"]


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
        if name == "Ant":
            q[3:7] /= np.linalg.norm(q[3:7])
            qpos[3:7], qvel[:3] = q[[6, 3, 4, 5]], v[3:6]
            own.runs.batch.reset(q=q, v=v)
            qvel[3:6] = own.task.observe(tumble_gym.State.of(own.runs.batch))[0, 16:19]
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
            rows = slice(6, None) if name == "Ant" else slice(None)
            assert body.mass_matrix(q)[rows, rows] == pytest.approx(inertia[rows, rows], rel=1e-6, abs=1e-6)
