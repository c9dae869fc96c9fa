"""The environment of gymnasium."""

import sys
import warnings

import numpy as np
import pytest

import tumble

gymnasium = pytest.importorskip("gymnasium", reason="SKIPPED: gymnasium is not installed")
tumble_gym = pytest.importorskip("tumble.gym")


@pytest.fixture(scope="module")
def adapter():
    """Whether pictures can be taken."""
    try:
        tumble.World().render(8, 8)
    except tumble.PictureError:
        return False
    return True


def test_gymnasium_s_own_check_passes(adapter):
    from gymnasium.utils.env_checker import check_env

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # that speeds have no bounds is meant
        warnings.filterwarnings("ignore", message=".*Box observation space (minimum|maximum) value is")
        check_env(gymnasium.make("tumble/CartPole-v0").unwrapped, skip_render_check=not adapter)


def test_accelerations_are_those_of_barto_sutton_and_anderson():
    env = tumble_gym.CartPole()
    rng = np.random.default_rng(4)
    m_cart, m_pole, half, g = 1.0, 0.1, 0.5, 9.81
    for _ in range(50):
        (x, angle), (v, rate), push = rng.uniform(-2, 2, 2), rng.uniform(-3, 3, 2), rng.uniform(-10, 10)
        sin, cos, total = np.sin(angle), np.cos(angle), m_cart + m_pole
        common = (push + m_pole * half * rate**2 * sin) / total
        turn = (g * sin - cos * common) / (half * (4 / 3 - m_pole * cos**2 / total))
        go = common - m_pole * half * turn * cos / total
        assert env.body.forward_dynamics([x, angle], [v, rate], [push, 0]) == pytest.approx([go, turn], rel=1e-9, abs=1e-9)


def test_the_same_seed_gives_the_same_episode():
    def episode():
        env = gymnasium.make("tumble/CartPole-v0")
        seen = [env.reset(seed=11)[0]]
        for k in range(60):
            observation, reward, fallen, _, _ = env.step(k % 3 == 0)
            seen.append(observation)
            assert reward == 1.0
            if fallen:
                break
        return np.array(seen)

    first = episode()
    assert (first == episode()).all() and abs(first[-1, 2]) > np.radians(12)


def test_what_is_no_action_is_refused():
    env = tumble_gym.CartPole()
    env.reset(seed=0)
    with pytest.raises(ValueError, match="must be 0 or 1"):
        env.step(2)
    with pytest.raises(ValueError, match="rgb_array"):
        tumble_gym.CartPole(render_mode="human")


def test_a_picture_has_the_shape_it_says(adapter):
    if not adapter:
        pytest.skip("SKIPPED: no graphics adapter")
    env = tumble_gym.CartPole(render_mode="rgb_array")
    env.reset(seed=0)
    picture = env.render()
    assert picture.shape == (400, 600, 3) and picture.dtype == np.uint8
    # the pole's ochre stands upright in the middle
    ochre = (picture[..., 0] > 1.6 * picture[..., 2].astype(float)) & (picture[..., 0] > 120)
    rows, columns = np.nonzero(ochre)
    assert np.ptp(rows) > 3 * np.ptp(columns) and columns.mean() == pytest.approx(300, abs=30)


def test_without_gymnasium_the_error_names_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "gymnasium", None)
    monkeypatch.delitem(sys.modules, "tumble.gym", raising=False)
    with pytest.raises(ImportError, match="needs the package gymnasium: pip install gymnasium"):
        import tumble.gym  # noqa: F401
