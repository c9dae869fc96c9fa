"""Forces and behaviors written in Python."""

import copy
import threading
import traceback

import numpy as np
import pytest

import tumble

STEPPERS = [("time_stepping", "verlet"), ("backtracking", "rk4"), ("backtracking", "dormand_prince"), ("time_stepping", "explicit_euler")]


class Wind(tumble.Force):
    """Drag towards the air's velocity."""

    def __init__(self, velocity, drag):
        self.velocity, self.drag = np.array(velocity, float), drag

    def apply(self, view):
        view.force += self.drag * (self.velocity - view.velocity)


class Spring(tumble.Force):
    """To the origin, on what moves."""

    def __init__(self, stiffness):
        self.stiffness = stiffness

    def apply(self, view):
        view.force[view.moves] -= self.stiffness * view.position[view.moves]


class Raises(tumble.Force):
    """Raises from some time on."""

    def __init__(self, at, error):
        self.at, self.error = at, error

    def apply(self, view):
        if view.time >= self.at:
            raise self.error


def one_ball(**words):
    world = tumble.World(gravity=(0, 0, 0), **words)
    return world, world.add_rigid("ball", tumble.Sphere(0.1), mass=2.0, position=(1, 0, 0))


def test_wind_brings_a_ball_to_its_speed():
    world, ball = one_ball(stepper="backtracking", integrator="rk4")
    world.add_force("wind", Wind((3, 0, 0), 4.0))
    world.step(240)
    # m·v' = c·(w − v)
    assert ball.velocity == pytest.approx([3 * (1 - np.exp(-2)), 0, 0], abs=1e-9)


@pytest.mark.parametrize("stepper, integrator", STEPPERS[:3])
def test_a_spring_oscillates_as_its_closed_form(stepper, integrator):
    world, ball = one_ball(stepper=stepper, integrator=integrator)
    world.add_force("spring", Spring(2.0 * 4.0 * np.pi**2))  # one turn a second
    for _ in range(4):
        world.step(60)
        assert ball.position == pytest.approx([np.cos(2 * np.pi * world.time), 0, 0], abs=1e-3)


def test_the_view_shows_what_the_handles_show(root):
    world = tumble.World.load("robot")
    world.step(3)
    seen = {}

    class Look(tumble.Behavior):
        def act(self, view, rows):
            assert len(view) == len(view.names) == len(view.position)
            for name in set(view.names):
                rows_of = view.rows(name)
                seen[name] = [view.position[rows_of].copy(), view.orientation[rows_of].copy(), view.velocity[rows_of].copy(), view.mass[rows_of]]
            seen["time"], seen["gravity"], seen["rows"] = view.time, view.gravity, rows
            seen["moves"] = dict(zip(view.names, view.moves))

    rigid = [body for body in world.bodies if isinstance(body, tumble.RigidBody)]
    wanted = {body.name: (body.position, body.orientation, body.velocity, body.mass, body.mode) for body in rigid}
    world.add_behavior("look", Look(), rigid[-1])
    time = world.time
    world.step()
    assert seen["time"] == time and (seen["gravity"] == world.gravity).all() and len(seen["rows"]) == 1
    for name, (position, orientation, velocity, mass, mode) in wanted.items():
        assert (seen[name][0] == position).all() and (seen[name][1] == orientation).all() and (seen[name][2] == velocity).all()
        assert seen["moves"][name] == (mode == "dynamic")
        assert seen[name][3] == (0 if mode == "static" else mass)


def test_what_is_only_shown_cannot_be_written_and_the_view_ends_with_the_call():
    world, _ = one_ball()
    kept = {}

    class Keep(tumble.Force):
        def apply(self, view):
            kept["view"], kept["position"], kept["force"] = view, view.position, view.force
            with pytest.raises(ValueError, match="read-only"):
                view.position[0] = 7.0

        def fork(self):
            return self

    world.add_force("keep", Keep())
    world.step()
    with pytest.raises(tumble.RemovedError, match="has returned"):
        _ = kept["view"].position
    before = world.state.copy()
    kept["force"][:] = 1e9  # a dead copy
    world.step()
    assert kept["position"][0] == pytest.approx([1, 0, 0]) and (world.state == before).all()


def test_a_push_off_center_turns_the_body():
    world = tumble.World(gravity=(0, 0, 0), dt=1e-3)
    box = world.add_rigid("box", tumble.Box((1, 1, 1)), mass=6.0)

    class Push(tumble.Force):
        def apply(self, view):
            view.apply_force(view.row("box"), (0, 0, 3.0), (0.5, 0, 0))

    world.add_force("push", Push())
    world.step()
    # I = m·a²/6 = 1; torque r × F = (0, −1.5, 0)
    assert box.angular_velocity == pytest.approx([0, -1.5e-3, 0], abs=1e-12)
    assert box.velocity == pytest.approx([0, 0, 0.5e-3], abs=1e-15)


@pytest.mark.parametrize("stepper, integrator", STEPPERS)
def test_an_error_reaches_the_caller_and_the_world_goes_back(stepper, integrator):
    world = tumble.World(stepper=stepper, integrator=integrator)
    world.add_static("ground", tumble.HalfSpace())
    world.add_rigid("ball", tumble.Sphere(0.1), mass=1.0, position=(0, 0, 0.15), restitution=0.5)
    mine = KeyError("mine")
    world.add_force("raises", Raises(10.4 * world.dt, mine))
    world.step(10)
    before = world.save()
    with pytest.raises(KeyError) as caught:
        world.step(10)
    assert caught.value is mine
    assert "self.error" in "".join(traceback.format_tb(caught.value.__traceback__))
    assert world.save() == before and world.frame == 10
    world.remove("raises")
    world.step(10)
    assert world.frame == 20


def test_an_error_also_puts_back_a_world_in_which_nothing_moves():
    world = tumble.World()
    world.add_static("ground", tumble.HalfSpace())
    world.add_force("raises", Raises(0.0, RuntimeError("no")))
    with pytest.raises(RuntimeError, match="no"):
        world.step()
    assert (world.frame, world.time) == (0, 0.0)


def test_applied_forces_are_there_again_after_an_error():
    world, ball = one_ball()
    error = Raises(0.0, RuntimeError("once"))
    world.add_force("raises", error)
    ball.apply_force((240.0, 0, 0))
    with pytest.raises(RuntimeError):
        world.step()
    error.at = np.inf
    world.step()
    assert ball.velocity == pytest.approx([0.5, 0, 0])


def test_a_callback_that_uses_its_world_gets_an_error_and_no_deadlock():
    world, ball = one_ball()
    said = []

    class Meddles(tumble.Force):
        def apply(self, view):
            for call in (world.step, world.save, world.fork, lambda: ball.position, lambda: world.remove("meddles"), world.render):
                with pytest.raises(tumble.BusyError) as caught:
                    call()
                said.append(str(caught.value))

    world.add_force("meddles", Meddles())
    world.step()
    assert len(said) == 6 and all("within that step" in text for text in said)


def test_another_thread_gets_an_error_while_a_callback_runs():
    world, _ = one_ball()
    inside, leave = threading.Event(), threading.Event()

    class Waits(tumble.Force):
        def apply(self, view):
            inside.set()
            leave.wait(10)

        def fork(self):
            return self

    world.add_force("waits", Waits())
    stepping = threading.Thread(target=world.step)
    stepping.start()
    assert inside.wait(10)
    with pytest.raises(tumble.BusyError, match="another thread"):
        world.step()
    leave.set()
    stepping.join(10)
    assert not stepping.is_alive() and world.frame == 1


@pytest.mark.parametrize(
    "act, error, said",
    [
        (lambda view: view.force, ValueError, "must return None"),
        (lambda view: view.force.fill(np.nan), ValueError, "force on 'ball' is NaN"),
        (lambda view: view.torque.fill(np.inf), ValueError, "torque on 'ball' is inf"),
        (lambda view: view.row("bat"), KeyError, "no body named 'bat'; there are ball"),
        (lambda view: view.apply_force(5, (0, 0, 1), (0, 0, 0)), ValueError, "row is 5; there are 1"),
        (lambda view: setattr(view, "force", np.zeros((7, 3))), ValueError, "broadcast"),
    ],
)
def test_faults_of_a_callback_are_reported(act, error, said):
    world, _ = one_ball()

    class Wrong(tumble.Force):
        def apply(self, view):
            return act(view)

    world.add_force("wrong", Wrong())
    with pytest.raises(error, match=said):
        world.step()
    assert world.frame == 0


def test_what_is_no_force_is_refused():
    world, ball = one_ball()
    with pytest.raises(TypeError, match="subclass of tumble.Force, not function"):
        world.add_force("wind", lambda view: None)
    with pytest.raises(TypeError, match="the class Wind itself"):
        world.add_force("wind", Wind)
    with pytest.raises(ValueError, match="must be unique"):
        world.add_force("ball", Spring(1.0))
    with pytest.raises(KeyError, match="no body named 'bat'"):
        world.add_behavior("flock", tumble.Behavior(), ["ball", "bat"])
    world.add_force("nothing", tumble.Force())
    with pytest.raises(NotImplementedError, match="Force must define apply"):
        world.step()


def test_forks_have_forces_of_their_own():
    class Counts(tumble.Force):
        calls = 0

        def apply(self, view):
            self.calls += 1

    world, _ = one_ball()
    world.add_force("counts", Counts())
    world.step(3)
    fork = world.fork()
    fork.step(4)
    assert world.forces["counts"].calls == 3 and fork.forces["counts"].calls == 7


def test_a_force_that_cannot_be_copied_says_so_when_forked():
    class Locked(tumble.Force):
        def __init__(self):
            self.lock = threading.Lock()

        def apply(self, view):
            pass

    world, _ = one_ball()
    world.add_force("locked", Locked())
    with pytest.raises(TypeError, match="lock"):
        world.fork()
    world.step()


def test_rollouts_run_python_s_forces_in_every_fork():
    world = tumble.World.load("robot")
    world.add_force("wind", Wind((0, 1, 0), 0.3))
    arms = [body for body in world.bodies if isinstance(body, tumble.Articulation)]
    tau = np.random.default_rng(1).normal(0, 5, (4, 3, sum(arm.dof for arm in arms)))
    states = world.rollout(tau)
    for k in range(4):
        fork = world.fork()
        for frame in range(3):
            at = 0
            for arm in arms:
                fork[arm.name].tau = tau[k, frame, at : at + arm.dof]
                at += arm.dof
            fork.step()
        assert (states[k, -1] == fork.state).all()


def test_an_error_in_a_rollout_reaches_the_caller():
    world = tumble.World.load("robot")
    world.add_force("raises", Raises(0.0, ZeroDivisionError("mine")))
    with pytest.raises(ZeroDivisionError, match="mine"):
        world.rollout(np.zeros((3, 2, sum(arm.dof for arm in world.bodies if isinstance(arm, tumble.Articulation)))))


def test_a_behavior_is_asked_once_a_step_and_holds_through_it():
    class Steers(tumble.Behavior):
        def __init__(self):
            self.rows = []

        def act(self, view, rows):
            self.rows.append(rows.tolist())
            view.force[rows] = (4.0, 0, 0)

    world = tumble.World(gravity=(0, 0, 0), dt=0.01, stepper="backtracking", integrator="rk4")
    world.add_static("wall", tumble.Box(1.0), position=(9, 9, 9))
    balls = [world.add_rigid(f"ball{k}", tumble.Sphere(0.1), mass=2.0, position=(0, k, 0)) for k in range(3)]
    world.add_behavior("steers", Steers(), [balls[0], "ball2"])
    world.step(10)
    # ½·a·t² with a = F/m = 2
    assert balls[0].position == pytest.approx([0.01, 0, 0]) and balls[2].velocity == pytest.approx([0.2, 0, 0])
    assert (balls[1].velocity == 0).all()
    assert world.behaviors["steers"].rows == [[1, 3]] * 10
    world.remove("ball0")
    world.step()
    assert world.behaviors["steers"].rows[-1] == [2]
    world.remove("steers")
    world.step()
    assert world.behaviors == {}


def test_a_behavior_s_error_leaves_the_world_before_the_frame():
    class Raises2(tumble.Behavior):
        def act(self, view, rows):
            view.force[rows] = 1e6
            raise OSError("lost")

    calls = []

    class Counts(tumble.Force):
        def apply(self, view):
            calls.append(view.time)

    world, ball = one_ball()
    world.add_behavior("raises", Raises2(), ball)
    world.add_force("counts", Counts())
    before = world.save()
    with pytest.raises(OSError, match="lost"):
        world.step(5)
    assert world.save() == before and calls == []


def test_the_same_forces_give_the_same_bits_and_survive_a_restore():
    def run(split):
        world, _ = one_ball()
        world.add_force("wind", Wind((1, 2, 3), 0.7))
        world.add_force("spring", Spring(5.0))
        world.step(split)
        saved = world.save()
        world.step(60)
        world.restore(saved)
        world.step(100 - split)
        return world.save()

    assert run(10) == run(73)


def test_a_force_written_in_python_does_what_gravity_does():
    class Gravity(tumble.Force):
        def apply(self, view):
            view.force += view.mass[:, None] * np.array((0, 0, -9.81))

    def run(world):
        for k in range(3):
            world.add_rigid(f"box{k}", tumble.Box((0.2, 0.3, 0.1)), mass=1.0 + k, position=(0, k, 1), angular_velocity=(1, 2, 3))
        world.step(100)
        return world.state.copy()

    ours = tumble.World(gravity=(0, 0, 0))
    ours.add_force("gravity", Gravity())
    assert run(ours) == pytest.approx(run(tumble.World()), abs=1e-12)


def test_ten_thousand_calls_leak_nothing():
    import gc
    import sys

    world, _ = one_ball()
    spring = Spring(1.0)
    world.add_force("spring", spring)
    world.step(100)
    gc.collect()
    before, references = sys.getallocatedblocks(), sys.getrefcount(spring)
    world.step(10_000)
    gc.collect()
    assert sys.getallocatedblocks() - before < 200 and sys.getrefcount(spring) == references
    assert copy.copy(spring).stiffness == 1.0


def test_a_typed_program_that_extends_the_library_runs(root, tmp_path):
    import runpy

    program = runpy.run_path(str(root / "crates" / "py" / "tests" / "typed" / "extending.py"))
    heights = program["record"](tmp_path / "run.mcap")[:, 2]
    # 2 g up against g down, less a little drag: z' = g t − c z'/m
    t = np.arange(25) / 240
    assert heights == pytest.approx(9.81 * (t / 0.1 - (1 - np.exp(-0.1 * t)) / 0.01), abs=1e-4)
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    sides = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
    centers, radii = program["balls"](corners, np.array(sides))
    assert centers.shape == (len(radii), 3) and len(radii) == 8
