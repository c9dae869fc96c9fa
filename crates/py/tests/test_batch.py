"""Many worlds of one model, stepped together."""

import gc
import threading
import weakref

import numpy as np
import pytest

import tumble


@pytest.fixture
def arm_world(root):
    """An arm, and a ball that falls on a floor."""
    world = tumble.World()
    world.add_static("floor", tumble.HalfSpace(offset=-1.0))
    world.add_articulation(root / "scenes" / "robot" / "arm.urdf", name="arm")
    world.add_rigid("ball", tumble.Sphere(0.1), mass=1.0, position=(2, 0, -0.88), restitution=0.3)
    world.step(5)
    return world


def pushes(worlds, steps):
    return np.random.default_rng(3).normal(0, 20, (steps, worlds, 6))


def alone(world, tau, substeps):
    """What one fork does by itself."""
    fork = world.fork()
    for row in tau:
        fork["arm"].tau = row
        fork.step(substeps)
    return fork


@pytest.mark.parametrize("threads", [None, 1, 2, 3])
def test_each_world_moves_as_it_would_alone(arm_world, threads):
    before, batch, tau = arm_world.save(), tumble.Batch(arm_world, 5, threads=threads), pushes(5, 20)
    state, q, v, time = batch.state, batch.q, batch.v, batch.time
    for row in tau:
        batch.step(row, substeps=3)
    assert arm_world.save() == before
    for k in range(5):
        one = alone(arm_world, tau[:, k], 3)
        assert state[k].tobytes() == one.state.tobytes()
        assert (q[k] == one["arm"].q).all() and (v[k] == one["arm"].qd).all() and time[k] == one.time
        assert (batch.positions[k] == one.positions).all() and (batch.orientations[k] == one.orientations).all()
        assert (batch.velocities[k] == one.velocities).all() and (batch.angular_velocities[k] == one.angular_velocities).all()
        assert batch.contact_counts[k] == len(one.contacts) > 0
        assert batch.worlds[k].save() == one.save()


def test_arrays_are_the_same_ones_and_read_only(arm_world):
    batch = tumble.Batch(arm_world, 2)
    q = batch.q
    before = q.copy()
    batch.step(np.full((2, 6), 5.0))
    assert batch.q is q and (q != before).any()
    with pytest.raises(ValueError, match="read-only"):
        q[0] = 0


def test_controls_stay_until_they_are_set_again_and_one_row_serves_all(arm_world):
    tau = pushes(1, 1)[0, 0]
    batch = tumble.Batch(arm_world, 3)
    batch.step(tau)
    batch.step()
    for k in range(3):
        assert (batch.state[k] == alone(arm_world, [tau], 2).state).all()


def test_a_mask_selects_worlds(arm_world):
    batch, mask = tumble.Batch(arm_world, 4), np.array([True, False, True, False])
    start = batch.state.copy()
    batch.step(pushes(4, 1)[0], mask=mask)
    assert ((batch.state != start).any(axis=1) == mask).all()
    batch.reset(mask=[True, False, False, False])
    assert (batch.state[0] == start[0]).all() and (batch.state[2] != start[2]).any()
    assert batch.time[0] == arm_world.time < batch.time[2]


def test_reset_goes_back_to_the_start_and_its_future(arm_world):
    arm_world["arm"].tau = [1, 2, 3, 4, 5, 6]
    batch = tumble.Batch(arm_world, 3)
    batch.step(substeps=7)
    first = batch.state.copy()
    batch.step(pushes(3, 1)[0], substeps=9)
    batch.reset()
    assert (batch.state == arm_world.state).all()
    batch.step(substeps=7)
    assert batch.state.tobytes() == first.tobytes()


def test_reset_to_given_states(arm_world):
    batch = tumble.Batch(arm_world, 3)
    batch.step(pushes(3, 1)[0], substeps=4)
    states = np.tile(arm_world.state, (3, 1))
    states[:, 0] += [0.0, 0.1, 0.2]
    batch.reset(state=states)
    assert (batch.state == states).all()
    q, v = np.random.default_rng(0).normal(0, 0.3, (2, 3, 6))
    batch.reset(q=q, v=v)
    assert (batch.q == q).all() and (batch.v == v).all()
    batch.step(np.zeros(6))
    fork = arm_world.fork()
    fork["arm"].q, fork["arm"].qd, fork["arm"].tau = q[1], v[1], np.zeros(6)
    fork.step()
    assert (batch.state[1] == fork.state).all()


def test_worlds_may_differ(arm_world):
    def configure(world, k):
        world.body("ball").mass = 1 + k
        world.body("ball").position = (2, 0, k)

    batch = tumble.Batch(arm_world, 3, configure=configure)
    assert [world.body("ball").mass for world in batch.worlds] == [1, 2, 3]
    ball = [body.name for body in arm_world.bodies].index("ball")
    assert batch.positions[:, ball, 2] == pytest.approx([0, 1, 2])
    batch.step(substeps=10)
    batch.reset()
    assert batch.positions[:, ball, 2] == pytest.approx([0, 1, 2])


def test_drives_in_bulk_are_those_of_the_joints(arm_world):
    batch, names = tumble.Batch(arm_world, 2), arm_world["arm"].joint_names
    targets = np.random.default_rng(1).uniform(-0.5, 0.5, (2, 6))
    batch.set_drives(target=0.0, stiffness=[[300.0] * 6, [500.0] * 6], damping=20.0, max_force=400.0)
    batch.step(targets=targets, substeps=6)
    for k, stiffness in enumerate((300.0, 500.0)):
        fork = arm_world.fork()
        for name, target in zip(names, targets[k]):
            fork["arm"].set_drive(name, target=target, stiffness=stiffness, damping=20.0, max_force=400.0)
        fork.step(6)
        assert (batch.state[k] == fork.state).all()
    batch.reset()
    batch.set_drives()
    batch.step(targets=targets)
    assert (batch.state == alone(arm_world, [np.zeros(6)], 1).state).all()


def test_drives_of_spherical_joints_and_of_robots_with_a_floating_root():
    builder = tumble.ArticulationBuilder("arm")
    builder.add_link("body", joint="floating", shape=tumble.Sphere(0.1), mass=5)
    builder.add_link("upper", "body", joint="spherical", shape=tumble.Sphere(0.1), shape_position=(0, 0, -1), mass=2)
    builder.add_link("lower", "upper", axis=(0, 1, 0), position=(0, 0, -1), shape=tumble.Sphere(0.1), mass=1)
    world = tumble.World(gravity=(0, 0, 0))
    world.add_articulation(builder.build(), name="arm")

    def driven(ball, hinge):
        fork = world.fork()
        fork["arm"].set_drive("upper", target=ball, stiffness=50, damping=5)
        fork["arm"].set_drive("lower", target=hinge, stiffness=50, damping=5)
        return fork

    batch = tumble.Batch(world, 2)
    batch.set_drives(target=[0.0] * 6 + [0.3, -0.2, 0.4, 0.1], stiffness=50, damping=5)
    batch.step(substeps=40)
    fork = driven((0.3, -0.2, 0.4), 0.1)
    fork.step(40)
    assert (batch.state == fork.state).all() and abs(fork["arm"].q[-5:]).max() > 0.05
    # targets are no state: those of the last step stay after a reset
    batch.reset()
    batch.step(targets=[0.0] * 6 + [0.1, 0.2, -0.3, 0.5])
    batch.reset()
    batch.step(substeps=10)
    fork = driven((0.1, 0.2, -0.3), 0.5)
    fork.step(10)
    assert (batch.state == fork.state).all()
    with pytest.raises(tumble.InvalidValueError, match="world 0: .*'body'.*only revolute, prismatic and spherical joints have them"):
        batch.set_drives(stiffness=[50.0] * 10)


def test_contact_forces_carry_the_weight():
    world = tumble.World()
    world.add_static("floor", tumble.HalfSpace())
    world.add_rigid("box", tumble.Box((0.2,) * 3), mass=2.0, position=(0, 0, 0.1))
    batch = tumble.Batch(world, 2)
    batch.step(substeps=240)
    assert batch.contact_forces[:, 1] == pytest.approx(np.tile([0, 0, 2 * 9.81], (2, 1)), abs=1e-6)
    assert batch.contact_forces[:, 0] == pytest.approx(np.tile([0, 0, -2 * 9.81], (2, 1)), abs=1e-6)


def test_forces_on_links_are_the_sums_of_contacts():
    world = tumble.World()
    world.add_static("floor", tumble.HalfSpace())
    builder = tumble.ArticulationBuilder("two")
    builder.add_link("low", joint="floating", shape=tumble.Sphere(0.2), mass=3.0)
    builder.add_link("high", "low", axis=(0, 1, 0), position=(0.5, 0, 0), shape=tumble.Sphere(0.2), mass=1.0)
    world.add_articulation(builder, base=(1, 0, 0.2), name="two")
    batch = tumble.Batch(world, 1)
    batch.step(substeps=10)
    contacts, links = batch.world(0).contacts, world["two"].link_names
    expected = np.zeros((len(links), 6))
    for c in contacts:
        side = 1 if c["bodies"][1] == 1 else 0
        sign = -1 if side else 1
        expected[c["parts"][side]] += sign * np.concatenate([np.cross(c["point"], c["force"]), c["force"]])
    assert len(contacts) > 0 and abs(expected).max() > 10
    assert batch.link_contact_forces[0] == pytest.approx(expected)


def test_a_world_that_fails_is_named_and_the_others_step(arm_world):
    batch, tau = tumble.Batch(arm_world, 4), pushes(4, 1)[0]
    start = batch.state.copy()
    tau[2, 0] = 1e300
    with pytest.raises(tumble.StepError, match=r"^world 2: 'arm' at t = "):
        batch.step(tau, substeps=2)
    assert batch.failed.tolist() == [False, False, True, False]
    assert (batch.state[2] == start[2]).all()
    for k in (0, 1, 3):
        assert (batch.state[k] == alone(arm_world, [tau[k]], 2).state).all()
    batch.reset(batch.failed)
    tau[2] = tau[3] = 1
    batch.step(tau)  # what is left of the numbers that were not finite plays no part
    assert not batch.failed.any()
    assert (batch.state[2] == alone(arm_world, [tau[2]], 1).state).all()
    tau[1:, 0] = 1e300
    with pytest.raises(tumble.StepError, match=r"^world 1: .* \(3 of 4 worlds failed\)$"):
        batch.step(tau)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda b: b.step(np.zeros((2, 6))), r"controls: expected shape \(6,\) or \(3, 6\), got \(2, 6\)"),
        (lambda b: b.step([np.nan] * 6), "controls: number 0 is NaN"),
        (lambda b: b.step(targets=np.zeros(5)), r"targets: expected shape \(6,\) or \(3, 6\), got \(5,\)"),
        (lambda b: b.step(substeps=-1), r"substeps is -1; expected a whole number from 0 to 2\*\*40"),
        (lambda b: b.step(substeps=2**40 + 1), r"substeps is 1099511627777; expected a whole number from 0 to 2\*\*40"),
        (lambda b: b.step(mask=[True]), r"mask: expected booleans, shape \(3,\)"),
        (lambda b: b.reset(np.zeros((3, 1), bool)), r"mask: expected booleans"),
        (lambda b: b.reset(state=np.zeros(3)), r"state: expected shape \(38,\) or \(3, 38\)"),
        (lambda b: b.set_drives(stiffness=-1.0), "world 0: .*stiffness"),
        (lambda b: b.world(3), "world 3 of a batch of 3"),
    ],
)
def test_wrong_arguments_are_refused(arm_world, call, words):
    batch = tumble.Batch(arm_world, 3)
    with pytest.raises((tumble.TumbleError, IndexError), match=words):
        call(batch)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"n": 0}, "n is 0"),
        ({"n": 2, "threads": 0}, "threads is 0"),
        ({"n": 2, "articulations": ["ball"]}, "expected articulations"),
        ({"n": 2, "articulations": ["leg"]}, "no body named 'leg'"),
        ({"n": 2, "articulations": ["arm", "arm"]}, "articulations: number 1 is there twice"),
        ({"n": 2, "configure": lambda world, k: world.remove("ball")}, "bodies or joints were added .* or removed"),
    ],
)
def test_wrong_batches_are_refused(arm_world, arguments, words):
    with pytest.raises(tumble.TumbleError, match=words):
        tumble.Batch(arm_world, **arguments)


def test_an_exception_of_configure_is_raised(arm_world):
    with pytest.raises(ZeroDivisionError):
        tumble.Batch(arm_world, 2, configure=lambda world, k: 1 / k)


def test_a_changed_world_counts_at_once(arm_world):
    batch = tumble.Batch(arm_world, 2)
    q, world = batch.q, batch.world(-1)
    world["arm"].q = [0.1] * 6
    assert (batch.q[1] == 0.1).all() and batch.q is q
    view = world.state
    batch.step()
    assert (view == batch.state[1]).all()
    world.remove("ball")
    with pytest.raises(tumble.InvalidValueError, match="world 1: bodies or joints were added"):
        batch.step()


class Wind(tumble.Force):
    def __init__(self, strength=0.0):
        self.strength = strength

    def apply(self, view):
        view.force[:, 0] += self.strength

    def fork(self):
        return Wind(self.strength)


class Broken(tumble.Force):
    def apply(self, view):
        raise RuntimeError("no wind")

    def fork(self):
        return self


@pytest.mark.parametrize("threads", [None, 1])
def test_forces_in_python_act_in_each_world(arm_world, threads):
    arm_world.add_force("wind", Wind(0.5))
    batch = tumble.Batch(arm_world, 3, threads=threads)
    for k, world in enumerate(batch.worlds):
        world.forces["wind"].strength = float(k)
    batch.step(substeps=4)
    for k in range(3):
        fork = arm_world.fork()
        fork.forces["wind"].strength = float(k)
        fork.step(4)
        assert (batch.state[k] == fork.state).all()


def test_an_exception_of_a_force_is_raised_and_says_where(arm_world):
    batch = tumble.Batch(arm_world, 2)
    batch.world(1).add_force("broken", Broken())
    with pytest.raises(RuntimeError, match="no wind") as caught:
        batch.step()
    assert batch.failed.tolist() == [False, True]
    if hasattr(caught.value, "__notes__"):
        assert caught.value.__notes__ == ["in world 1 of the batch"]


def test_another_thread_is_told_that_it_is_busy(arm_world):
    batch, refused, begun = tumble.Batch(arm_world, 2), [], threading.Event()

    def other():
        begun.wait(10)
        for _ in range(1000):
            try:
                batch.step()
            except tumble.BusyError as error:
                refused.append(error)
                return

    thread = threading.Thread(target=other)
    thread.start()
    begun.set()
    for _ in range(20):
        try:
            batch.step(substeps=200)
        except tumble.BusyError:
            pass
        if refused:
            break
    thread.join(30)
    assert refused


def test_a_cycle_through_a_force_is_collected(arm_world):
    batch = tumble.Batch(arm_world, 1)
    force = Wind()
    force.batch = batch
    batch.world(0).add_force("wind", force)
    gone = weakref.ref(force)
    del batch, force
    gc.collect()
    gc.collect()
    assert gone() is None
