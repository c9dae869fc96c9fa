"""Policies inside the steps of a batch, and constants of bodies by world: each beside a loop over single worlds."""

import copy
import pickle

import numpy as np
import pytest

import tumble
import tumble.distributed


@pytest.fixture
def arm(root):
    world = tumble.World(dt=1 / 240)
    world.add_articulation(root / "scenes" / "robot" / "arm.urdf")
    return world


def layers(rng, widths, several=None):
    lead = () if several is None else (several,)
    pairs = zip(widths[1:], widths, strict=False)
    return [(rng.normal(size=(*lead, o, i)), rng.normal(size=(*lead, o))) for o, i in pairs]


@pytest.mark.parametrize("several", [None, 6])
@pytest.mark.parametrize("hidden", [[], [16], [8, 8]])
@pytest.mark.parametrize("threads", [1, 2])
def test_a_policy_in_a_batch_is_a_loop_over_worlds(arm, several, hidden, threads):
    rng, n, steps = np.random.default_rng(3), 6, 40
    body = arm.bodies[0]
    dof = body.dof
    policy = tumble.Policy(layers(rng, [2 * dof, *hidden, dof], several), activation="relu" if len(hidden) == 2 else "tanh")
    batch = tumble.Batch(arm, n, threads=threads)
    start = rng.uniform(-0.5, 0.5, (n, dof))
    batch.reset(q=start)
    batch.step(policy=policy, substeps=steps)
    for i in range(n):
        world = arm.fork()
        one = world.bodies[0]
        one.q = start[i]
        for _ in range(steps):
            one.tau = policy(np.concatenate([one.q, one.qd]), i if several else 0)
            world.step()
        assert (batch.state[i] == world.state).all()


def test_a_policy_is_the_product_of_its_layers():
    rng = np.random.default_rng(1)
    (w, b), (w2, b2) = given = layers(rng, [5, 7, 2])
    x = rng.normal(size=5)
    assert np.allclose(tumble.Policy(given)(x), w2 @ np.tanh(w @ x + b) + b2, rtol=1e-13, atol=1e-13)
    assert np.allclose(tumble.Policy([(w, None)])(x), w @ x, rtol=1e-13)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ([], "1 to 16"),
        ([(np.ones(3), None)], "expected shape (outputs, inputs)"),
        ([(np.ones((2, 3)), np.ones(3))], "offsets of layer 0"),
        ([(np.ones((2, 3)), None), (np.ones((1, 3)), None)], "layer 1 has 3 inputs"),
        ([(np.full((2, 3), np.nan), None)], "finite"),
    ],
)
def test_wrong_layers_are_refused(given, words):
    with pytest.raises(tumble.InvalidValueError) as error:
        tumble.Policy(given)
    assert words in str(error.value)


def test_a_policy_that_does_not_fit_is_refused(arm):
    batch = tumble.Batch(arm, 3)
    dof = batch.dof
    with pytest.raises(tumble.InvalidValueError, match="it has 2 inputs"):
        batch.step(policy=tumble.Policy([(np.ones((1, 2)), None)]))
    with pytest.raises(tumble.InvalidValueError, match="2 policies for 3 worlds"):
        batch.step(policy=tumble.Policy([(np.ones((2, dof, 2 * dof)), None)]))
    with pytest.raises(tumble.InvalidValueError, match="give one of them"):
        batch.step(np.zeros(dof), policy=tumble.Policy([(np.ones((dof, 2 * dof)), None)]))
    with pytest.raises(tumble.UnknownNameError):
        tumble.Policy([(np.ones((1, 2)), None)], activation="sine")


def test_constants_of_a_body_by_world_are_a_loop_over_worlds():
    world = tumble.World()
    world.add_static("ground", tumble.HalfSpace(), friction=0.5, restitution=0.2)
    world.add_rigid("box", tumble.Box((0.2, 0.2, 0.2)), mass=1, position=(0, 0, 0.12), velocity=(1, 0, 0))
    masses, frictions, bounces = np.array([0.5, 1.0, 4.0]), np.array([0.1, 0.4, 0.9]), 0.3
    batch = tumble.Batch(world, 3)
    batch.set_body("box", mass=masses, friction=frictions, restitution=bounces)
    batch.step(substeps=100)
    for i in range(3):
        one = world.fork()
        box = one.bodies["box"]
        box.mass, box.friction, box.restitution = masses[i], frictions[i], bounces
        for _ in range(100):
            one.step()
        assert (batch.state[i] == one.state).all()
    with pytest.raises(tumble.InvalidValueError, match="world 1"):
        batch.set_body("box", mass=np.array([1.0, -1.0, 1.0]))
    with pytest.raises(tumble.UnknownNameError, match="bax"):
        batch.set_body("bax", mass=1.0)
    with pytest.raises(tumble.InvalidValueError, match="shape \\(3,\\)"):
        batch.set_body("box", friction=np.ones(2))


@pytest.mark.parametrize("several", [None, 3])
@pytest.mark.parametrize("activation", ["tanh", "relu"])
def test_a_pickled_policy_is_the_same_map(several, activation):
    rng = np.random.default_rng(5)
    policy = tumble.Policy([*layers(rng, [4, 6], several), (layers(rng, [6, 2], several)[0][0], None)], activation=activation)
    for other in (pickle.loads(pickle.dumps(policy)), copy.deepcopy(policy)):
        for i in range(several or 1):
            seen = rng.normal(size=4)
            assert (other(seen, i) == policy(seen, i)).all()
        assert pickle.dumps(other) == pickle.dumps(policy)


def test_a_policy_is_a_job(tmp_path):
    job = tumble.Policy([(np.ones((1, 2)), None)])
    other = tumble.Policy([(np.ones((1, 2)), None)], activation="relu")
    assert tumble.distributed.key(sums, job) == tumble.distributed.key(sums, copy.copy(job)) != tumble.distributed.key(sums, other)
    assert tumble.distributed.map(sums, [job, job], store=tmp_path) == [3.0, 3.0]


def sums(policy):
    return float(policy([1.0, 2.0])[0])
