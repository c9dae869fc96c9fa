"""What hostile or unlucky programs do: each gets a Python exception, and never an abort or a deadlock."""

import copy
import gc
import multiprocessing
import os
import pickle
import subprocess
import sys
import threading
import weakref

import numpy as np
import pytest

import tumble
from tumble._native import _panic


TETRAHEDRON = ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


ARM = """<robot name="arm"><link name="base"><collision><geometry><box size="0.2 0.2 0.02"/></geometry></collision></link>
<link name="upper"><inertial><origin xyz="0 0 0.3"/><mass value="2"/><inertia ixx="0.06" iyy="0.06" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><origin xyz="0 0 0.3"/><geometry><box size="0.05 0.05 0.6"/></geometry></collision></link>
<link name="fore"><inertial><origin xyz="0.1 0 0.2"/><mass value="1"/><inertia ixx="0.02" iyy="0.02" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><box size="0.05 0.05 0.4"/></geometry></collision></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/><limit lower="-1.5" upper="1.5" effort="50" velocity="5"/></joint>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0 0 0.6"/><axis xyz="1 1 0"/><limit lower="-1" upper="1" effort="50" velocity="5"/></joint>
</robot>"""


def two_links(tmp_path):
    path = tmp_path / "arm.urdf"
    path.write_text(ARM)
    return tumble.Articulation.from_urdf(path)


def small():
    world = tumble.World()
    world.add_static("ground", tumble.HalfSpace())
    return world, world.add_rigid("ball", tumble.Sphere(0.1), mass=1.0, position=(0, 0, 1))


def test_a_panic_while_a_world_is_read_is_an_error_and_no_more():
    world, ball = small()
    before = world.save()
    with pytest.raises(tumble.InternalError, match="index out of bounds") as caught:
        _panic(world, "read")
    assert isinstance(caught.value, RuntimeError) and "please report" in str(caught.value)
    assert world.save() == before
    world.step()
    assert ball.position[2] < 1


@pytest.mark.parametrize("during", ["changed", "stepped"])
def test_a_panic_while_a_world_is_changed_ends_that_world_alone(during):
    world, ball = small()
    view, fork, saved = world.state, world.fork(), world.save()
    with pytest.raises(tumble.InternalError, match="index out of bounds"):
        _panic(world, during)
    for use in (world.step, world.save, world.fork, world.energy, lambda: ball.position, lambda: world.state, lambda: world.remove(ball)):
        with pytest.raises(tumble.InternalError, match="make a new one, or continue from a fork or a snapshot"):
            use()
    assert view[15] == 1.0  # views stay valid
    fork.step()
    anew, _ = small()
    anew.restore(saved)
    anew.step()
    assert anew.save() == fork.save()


def test_a_panic_in_another_thread_reaches_that_thread():
    world, _ = small()
    raised = []

    def panic():
        try:
            _panic(world, "stepped")
        except tumble.InternalError as error:
            raised.append(error)

    thread = threading.Thread(target=panic)
    thread.start()
    thread.join(timeout=60)
    assert len(raised) == 1
    with pytest.raises(tumble.InternalError):
        world.step()


@pytest.mark.parametrize(
    "call",
    [
        lambda: small()[0].step(10**30),
        lambda: small()[0].step(-(10**30)),
        lambda: tumble.World(substeps=-1),
        lambda: tumble.SphereTree.build(*TETRAHEDRON, branching=10**30),
        lambda: tumble.SphereTree.build(*TETRAHEDRON, depth=-1),
        lambda: tumble.World(substeps=10**9),
        lambda: tumble.World(threads=-1),
        lambda: tumble.World(threads=257),
        lambda: setattr(tumble.World(), "threads", 257),
        lambda: tumble.World(iterations=2**40),
        lambda: small()[0].render(-1, 10),
        lambda: small()[0].rollout(np.zeros((1, 2, 0)), every=-1),
        lambda: small()[0].rollout(np.zeros((1, 2, 0)), threads=10**30),
        lambda: small()[0].rollout(np.zeros((1, 2, 0)), threads=0),
        lambda: small()[0].rollout(np.zeros((1, 3, 0)), every=2),
        lambda: small()[0].rollout(np.zeros((10**6, 10**6, 0))),
        lambda: small()[0].rollout(np.zeros((2, 2, 1))),
        lambda: small()[0].rollout(np.zeros((2, 2))),
        lambda: small()[0].rollout(np.zeros((2, 2, 0)), states=np.zeros(25)),
        lambda: small()[0].rollout(np.zeros((2, 2, 0)), states=np.full((2, 26), np.nan)),
        lambda: small()[0].rollout(np.zeros((2, 2, 0)), states=np.zeros((2, 26))),
    ],
)
def test_numbers_that_do_not_fit_are_value_errors(call):
    with pytest.raises(ValueError) as caught:
        call()
    assert isinstance(caught.value, tumble.TumbleError)


@pytest.mark.parametrize(
    "value",
    [
        np.float32([1, 2, 3]),
        np.float16([1, 2, 3]),
        np.arange(9.0)[::3] / 3 + 1,
        np.array([3.0, 2.0, 1.0])[::-1],
        np.array([1, 2, 3], ">i4"),
        np.array([1, 2, 3], object),
        range(1, 4),
        np.ma.array([1.0, 2.0, 3.0]),
        np.asfortranarray([[1.0, 2.0, 3.0]])[0],
    ],
)
def test_what_numpy_makes_numbers_of_is_taken(value):
    _, ball = small()
    ball.position = value
    assert (ball.position == [1, 2, 3]).all()


@pytest.mark.parametrize(
    "value",
    [
        np.array(1.0),
        np.array([1j, 2, 3]),
        np.array(["1", "2", "3"]),
        np.array(["2020", "2021", "2022"], "M8[Y]"),
        (x for x in (1, 2, 3)),
        [[1], [2, 3]],
        [10**400, 0, 0],
        None,
        {1, 2, 3},
        [],
        np.zeros((3, 1)),
        np.zeros((0, 3)),
    ],
)
def test_what_are_no_three_numbers_is_refused(value):
    _, ball = small()
    with pytest.raises(ValueError, match="position"):
        ball.position = value
    assert (ball.position == [0, 0, 1]).all()


def test_a_callback_cannot_change_its_world():
    world, ball = small()
    said = []

    class Meddles(tumble.Force):
        def apply(self, view):
            calls = [
                lambda: world.add_rigid("more", tumble.Sphere(0.1), mass=1.0),
                lambda: world.remove("ball"),
                lambda: world.add_force("more", Meddles()),
                lambda: setattr(ball, "velocity", (1, 0, 0)),
                lambda: setattr(world, "state", np.zeros(26)),
                lambda: world.state,
                lambda: world.rollout(np.zeros((1, 1, 0))),
                lambda: world.restore(b""),
                lambda: world.forces,
                lambda: len(world.bodies),
                lambda: repr(world),
            ]
            for call in calls:
                with pytest.raises(tumble.BusyError):
                    call()
                said.append(1)
            gc.collect()

    world.add_force("meddles", Meddles())
    world.step()
    assert len(said) == 11 and world.frame == 1


@pytest.mark.parametrize("hold", [lambda w: w, lambda w: w["ball"], lambda w: w.bodies, lambda w: [w, w["arm"], w.step], lambda w: {"a": (w.bodies, w)}])
@pytest.mark.parametrize("kind", [tumble.Force, tumble.Behavior])
def test_a_force_that_holds_its_world_is_collected_with_it(root, hold, kind):
    def make():
        world, ball = small()
        world.add_articulation(root / "scenes" / "robot" / "arm.urdf", base=(3, 0, 1), name="arm")
        own = type("Own", (kind,), {"apply": lambda self, view: None, "act": lambda self, view, rows: None})()
        own.held = hold(world)
        world.add_force("own", own) if kind is tumble.Force else world.add_behavior("own", own, [ball])
        world.step(2)
        return weakref.ref(world), weakref.ref(own)

    world, own = make()
    gc.collect()
    assert world() is None and own() is None


def test_a_force_is_not_collected_while_its_world_lives():
    world, _ = small()

    class Pulls(tumble.Force):
        def apply(self, view):
            self.calls = getattr(self, "calls", 0) + 1

    pulls = Pulls()
    pulls.world = world
    world.add_force("pulls", pulls)
    known = weakref.ref(pulls)
    body = world["ball"]
    del pulls, world
    for _ in range(3):
        gc.collect()
    assert known() is not None and body.position[2] == 1.0
    known().world.step(3)
    assert known().calls == 3
    bodies = known().world.bodies
    del body
    gc.collect()
    assert known() is not None and len(bodies) == 2
    del bodies
    gc.collect()
    assert known() is None


def test_collections_in_the_middle_of_steps_take_nothing_that_lives():
    def make():
        world, _ = small()

        class Litters(tumble.Force):
            def apply(self, view):
                self.world  # noqa: B018
                circle = []
                circle.append(circle)
                if len(seen) % 7 == 0:
                    gc.collect()
                seen.append(view.time)

        seen = []
        force = Litters()
        force.world = world
        world.add_force("litters", force)
        return world, seen

    runs = [make() for _ in range(3)]
    threads = [threading.Thread(target=world.step, args=(40,)) for world, _ in runs]
    for thread in threads:
        thread.start()
    for _ in range(20):
        gc.collect()
    for thread in threads:
        thread.join(timeout=60)
    assert [len(seen) for _, seen in runs] == [40] * 3
    assert all(world.forces["litters"].world is world for world, _ in runs)


def test_handles_are_not_copied_or_pickled_by_themselves():
    world, ball = small()
    for value in (ball, world.bodies):
        for call in (copy.copy, copy.deepcopy, pickle.dumps):
            with pytest.raises(TypeError, match="pickle"):
                call(value)
    assert pickle.loads(pickle.dumps(world.energy())) == world.energy()
    assert (pickle.loads(pickle.dumps(world.state)) == world.state).all()
    with pytest.raises(TypeError, match="base type"):
        type("Mine", (tumble.World,), {})


def in_a_child(answers):
    world, _ = small()
    world.step(10)
    answers.put(world.save())


@pytest.mark.parametrize("way", ["spawn", "fork"])
@pytest.mark.skipif(not hasattr(os, "fork"), reason="SKIPPED: no fork on this system")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_processes_that_are_spawned_or_forked_step_worlds_of_their_own(way):
    context = multiprocessing.get_context(way)
    answers = context.Queue()
    child = context.Process(target=in_a_child, args=(answers,))
    child.start()
    theirs = answers.get(timeout=120)
    child.join(timeout=60)
    ours, _ = small()
    ours.step(10)
    assert child.exitcode == 0 and theirs == ours.save()


@pytest.mark.parametrize(
    "program",
    [
        "state = world.state; part = state[3:7]; del world",
        "import threading; threading.Thread(target=world.step, args=(10**9,), daemon=True).start()",
        "state = world.state; import threading; threading.Thread(target=world.step, args=(10**9,), daemon=True).start()",
        "class F(tumble.Force):\n    def apply(self, view): self.world\nf = F(); f.world = world; world.add_force('f', f); world.step(3)",
        "import sys; sys.world = world; sys.body = world['ball']; sys.state = world.state",
        "import atexit; atexit.register(lambda: world.step(3)); view = world.state",
        "class D:\n    def __del__(self): world.step(1)\nd = D()",
    ],
)
def test_a_program_ends_whatever_it_still_holds(program):
    head = "import tumble\nworld = tumble.World()\nworld.add_rigid('ball', tumble.Sphere(0.1), mass=1.0)\n"
    done = subprocess.run([sys.executable, "-c", head + program], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0 and "panicked" not in done.stderr, done.stderr


def test_one_recorder_from_two_threads_writes_every_frame(tmp_path):
    world, _ = small()
    path, raised = tmp_path / "run.mcap", []
    with tumble.Recorder(path) as recorder:

        def run():
            for _ in range(40):
                try:
                    world.step()
                    recorder.frame(world)
                except (tumble.BusyError, tumble.InvalidValueError) as error:
                    raised.append(str(error))

        threads = [threading.Thread(target=run) for _ in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(timeout=60)
        frames = recorder.frames
    assert frames > 0 and len(tumble.read(path).times) == frames


@pytest.mark.parametrize("order", ["C", "F"])
def test_arrays_are_read_in_their_own_order(tmp_path, order):
    arm, rng = two_links(tmp_path), np.random.default_rng(1)
    q = rng.uniform(-1, 1, (7, 2))
    given = np.asarray(q, order=order)
    singly = np.array([arm.link_pose("fore", row) for row in q])
    np.testing.assert_array_equal(arm.link_pose("fore", given), singly)
    np.testing.assert_array_equal(arm.link_pose("fore", np.repeat(q, 2, axis=0)[::2]), singly)
    vertices, faces = (np.asarray(part, order=order) for part in TETRAHEDRON)
    assert tumble.SphereTree.build(np.asarray(vertices, float, order=order), faces, depth=1, cache=False).levels[0][1][0] > 0.8


def test_gravity_as_a_force_is_gravity(tmp_path):
    class Weight(tumble.Force):
        def apply(self, view):
            assert len(view) == 4 and view.names == ["ball"] + 3 * ["arm"]
            assert view.mass.tolist() == [1.0, 2.0, 1.0, 0.0] and view.moves.tolist() == [True, True, True, False]
            assert [view.row("arm", link) for link in ("upper", "fore", "base")] == [1, 2, 3]
            view.force[:, 2] -= 9.81 * view.mass

    arm, ends = two_links(tmp_path), []
    for gravity in (9.81, 0.0):
        world = tumble.World(gravity=(0, 0, -gravity))
        ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=1.0, position=(3, 0, 1))
        handle = world.add_articulation(arm)
        handle.q = (0.3, -0.2)
        if gravity == 0.0:
            world.add_force("weight", Weight())
        world.step(48)
        ends.append(np.concatenate([handle.q, handle.qd, ball.position, ball.velocity]))
    assert np.abs(ends[0] - [0.3, -0.2, 0, 0, 3, 0, 1, 0, 0, 0]).max() > 0.1
    np.testing.assert_allclose(ends[1], ends[0], rtol=0, atol=1e-12)


def test_the_touched_link_is_reported(tmp_path):
    world = tumble.World(gravity=(0, 0, 0))
    arm = world.add_articulation(two_links(tmp_path))
    pose = arm.link_poses()[arm.link_names.index("fore")]
    ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=1.0, position=pose[:3] + (0.12, 0, 0.15), velocity=(-1, 0, 0))
    world.step()
    contact = world.contacts[0]
    touched = contact["parts"][list(contact["bodies"]).index(1 - list(world.bodies).index(ball))]
    assert arm.link_names[touched] == "fore"


def test_a_drive_stops_at_a_limit_however_strong_it_is(tmp_path):
    for stepper in ("time_stepping", "backtracking"):
        for limit in ({}, {"max_force": 1e6}, {"max_force": 100.0}):
            world = tumble.World(stepper=stepper, gravity=(0, 0, 0))
            arm = world.add_articulation(two_links(tmp_path))
            arm.set_drive("elbow", velocity=5.0, **limit)
            world.step(240)
            assert arm.q[1] == pytest.approx(1.0, abs=1e-4) and arm.qd[1] == pytest.approx(0.0, abs=1e-6)


def test_damaged_ends_of_snapshots_are_refused(tmp_path):
    world = tumble.World()
    arm = world.add_articulation(two_links(tmp_path))
    arm.tau = (1.0, 2.0)
    saved = world.save()
    for bad in (saved[:-1], saved + b"x", saved[:-1] + b"?", saved[:-5], saved + saved):
        with pytest.raises(tumble.SnapshotError):
            world.restore(bad)
        assert arm.tau.tolist() == [1.0, 2.0]
    world.restore(saved)


def test_a_force_whose_fork_uses_all_cores_does_not_stop_a_rollout(tmp_path):
    arm = two_links(tmp_path)

    class Busy(tumble.Force):
        def apply(self, view):
            pass

        def fork(self):
            arm.mass_matrix(np.zeros((20000, 2)))
            return Busy()

    world, _ = small()
    world.add_force("busy", Busy())
    for _ in range(3):
        assert world.rollout(np.zeros((40, 1, 0)), threads=8).shape == (40, 1, len(world.state))


def test_what_fork_answers_must_be_a_force():
    class Wrong(tumble.Force):
        def apply(self, view):
            pass

        def fork(self):
            return 3

    world, _ = small()
    world.add_force("wrong", Wrong())
    with pytest.raises(tumble.InvalidValueError, match="'wrong': `fork` must return"):
        world.fork().step()


def test_a_force_that_rolls_out_its_own_world_ends():
    class Endless(tumble.Force):
        def __init__(self, world):
            self.world = world

        def apply(self, view):
            self.world.rollout(np.zeros((1, 1, 0)))

        def fork(self):
            return Endless(self.world)

    world, _ = small()
    world.add_force("endless", Endless(world))
    with pytest.raises(RecursionError):
        world.rollout(np.zeros((1, 1, 0)))


def test_a_forked_process_has_threads_of_its_own(tmp_path):
    script = """
import multiprocessing, numpy as np, tumble, sys
arm = tumble.Articulation.from_urdf(sys.argv[1])
work = lambda _=0: float(arm.mass_matrix(np.zeros((50000, 2))).sum())
def child(k): return work()
if __name__ == "__main__":
    work()
    with multiprocessing.get_context("fork").Pool(2) as pool:
        assert pool.map_async(child, range(4)).get(60) == 4 * [work()]
    print("well")
"""
    path = tmp_path / "arm.urdf"
    path.write_text(ARM)
    ran = subprocess.run([sys.executable, "-c", script, path], capture_output=True, text=True, timeout=120)
    assert ran.stdout == "well\n", ran.stderr


def test_arrays_too_large_for_memory_are_memory_errors(tmp_path):
    arm = two_links(tmp_path)
    world, _ = small()
    for call in (
        lambda: arm.mass_matrix(np.broadcast_to(np.zeros(2), (10**10, 2))),
        lambda: tumble.Mesh(np.broadcast_to(np.zeros(3), (10**10, 3)), [[0, 1, 2]]),
        lambda: setattr(world, "state", np.broadcast_to(0.0, 10**11)),
        lambda: world.rollout(np.broadcast_to(np.zeros(1), (10**6, 10**5, 1))),
    ):
        with pytest.raises(MemoryError):
            call()
