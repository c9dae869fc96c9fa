"""What goes wrong is a Python exception with the library's words: never an abort, never a deadlock."""

import gc
import signal
import threading

import numpy as np
import pytest

import tumble


@pytest.fixture
def world():
    world = tumble.World()
    world.add_static("ground", tumble.HalfSpace())
    world.add_rigid("ball", tumble.Sphere(0.1), mass=1.0, position=(0, 0, 1))
    return world


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda w: tumble.Sphere(-1.0), "radius of a sphere is -1, but must be a finite length above 0 m"),
        (lambda w: tumble.Sphere(float("nan")), "radius of a sphere is NaN"),
        (lambda w: tumble.Box((1, 2)), r"size: expected 3 numbers, shape \(3,\), got shape \(2,\)"),
        (lambda w: tumble.Box((1, 2, 0)), "an edge of 0 m"),
        (lambda w: tumble.Capsule(0.1, 0.0), "length is 0"),
        (lambda w: tumble.HalfSpace((0, 0, 0)), "no direction"),
        (lambda w: tumble.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]), "the mesh is open"),
        (lambda w: tumble.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 7]]), "faces: 7 is not an index of 3 vertices"),
        (lambda w: tumble.World(dt=0.0), "dt is 0; it must be above 0 and at most 1 s"),
        (lambda w: tumble.World(gravity=(0, 0, float("inf"))), "gravity: number 2 is inf"),
        (lambda w: tumble.World(solver="newton"), "solver: `newton` is not known"),
        (lambda w: tumble.World(stepper="backtrack"), "stepper: `backtrack` is not known; did you mean `backtracking`"),
        (lambda w: w.add_rigid("b", tumble.Sphere(1), mass=1.0, density=2.0), "body 'b': expected a mass or a density, not both"),
        (lambda w: w.add_rigid("b", tumble.Sphere(1), mass=-2.0), "body 'b': mass is -2 kg"),
        (lambda w: w.add_rigid("b", tumble.Sphere(1), mass=1.0, position=(0, 0, np.nan)), "position: number 2 is NaN"),
        (lambda w: w.add_rigid("b", tumble.Sphere(1), mass=1.0, orientation=(0, 0, 0, 2)), "has length 2; it must be 1"),
        (lambda w: w.add_rigid("b", tumble.Sphere(1), mass=1.0, restitution=1.5), "body 'b': restitution is 1.5; it must be between 0 and 1"),
        (lambda w: w.add_rigid("ball", tumble.Sphere(1), mass=1.0), "an object named 'ball' is already in the world"),
        (lambda w: w.add_rigid("b", tumble.HalfSpace(), mass=1.0), "unbounded"),
        (lambda w: w.step(-1), "n is -1; it must be at least 0"),
        (lambda w: setattr(w["ball"], "position", [1, 2]), r"position: expected 3 numbers, shape \(3,\), got shape \(2,\)"),
        (lambda w: setattr(w["ball"], "velocity", [1, 2, "x"]), "velocity: expected numbers"),
        (lambda w: setattr(w["ball"], "friction", -1.0), "friction is -1; it must be at least 0"),
        (lambda w: setattr(w["ball"], "mode", "floating"), "mode: `floating` is not known"),
        (lambda w: setattr(w["ground"], "mode", "dynamic"), "has no mass"),
        (lambda w: w["ball"].apply_force([0, 0, np.nan]), "force: number 2 is NaN"),
        (lambda w: w.restore(b"nonsense"), "not a snapshot of tumble"),
        (lambda w: w.restore(tumble.World().save()), "the snapshot is of another world"),
        (lambda w: tumble.World.parse("[world]\ndt = 1"), "scene.toml:2:1: unknown key `dt`"),
        (lambda w: tumble.World().remove(w["ball"]), "'ball' belongs to another world"),
    ],
)
def test_bad_values_are_value_errors(world, call, words):
    before = world.save()
    with pytest.raises(ValueError, match=words) as caught:
        call(world)
    assert isinstance(caught.value, tumble.TumbleError)
    assert world.save() == before


@pytest.mark.parametrize("call", [lambda w: tumble.Sphere("big"), lambda w: w.add_rigid("b", 3, mass=1.0), lambda w: w.remove(7), lambda w: w.bodies[1.5]])
def test_wrong_types_are_type_errors(world, call):
    with pytest.raises(TypeError):
        call(world)


def test_names_that_nothing_has_are_key_errors(world):
    with pytest.raises(KeyError) as caught:
        world["bal"]
    assert str(caught.value) == "the world has no body named 'bal'; there are ground, ball"
    with pytest.raises(IndexError):
        world.bodies[2]
    assert "ball" in world.bodies and world["ball"] in world.bodies and "bal" not in world.bodies


def test_handles_of_removed_bodies_say_so(world):
    ball = world["ball"]
    world.remove(ball)
    other = world.add_rigid("ball", tumble.Sphere(0.1), mass=5.0)
    assert other.mass == 5.0 and other != ball and not ball.exists and ball not in world.bodies
    uses = [
        lambda: ball.position,
        lambda: ball.mass,
        lambda: setattr(ball, "velocity", (0, 0, 0)),
        lambda: ball.apply_impulse((0, 0, 1)),
        lambda: ball.mode,
        lambda: world.remove(ball),
    ]
    for use in uses:
        with pytest.raises(ReferenceError, match="'ball' was removed from its world") as caught:
            use()
        assert isinstance(caught.value, tumble.TumbleError)
    assert "removed" in repr(ball)


def test_handles_keep_their_world():
    def make():
        world = tumble.World()
        return world.add_rigid("ball", tumble.Sphere(0.1), mass=1.0, position=(1, 2, 3))

    ball = make()
    gc.collect()
    assert (ball.position == [1, 2, 3]).all()


def test_a_step_that_fails_leaves_the_world_as_it_was(world):
    world.step(10)
    saved, before = world.save(), world.state.copy()
    world["ball"].apply_force((1e308, 0, 0))
    world["ball"].apply_force((1e308, 0, 0))
    applied = world.save()
    with pytest.raises(RuntimeError, match=r"'ball' at t = .* is not finite") as caught:
        world.step()
    assert isinstance(caught.value, tumble.StepError)
    assert (world.state == before).all() and world.time == pytest.approx(10 / 240)
    assert world.save() == applied, "every byte, the applied forces too"
    world.restore(saved)
    world.step()


def test_two_threads_on_one_world_get_an_error_and_no_deadlock():
    world = tumble.World.load("stack")
    busy, others, done = [], [], threading.Event()

    def step():
        try:
            world.step(400)
        finally:
            done.set()

    stepper = threading.Thread(target=step)
    stepper.start()
    while not done.wait(0.0005):
        for use in (lambda: world.energy(), lambda: world.step(), lambda: world.bodies[0].position, lambda: world.state):
            try:
                use()
            except tumble.BusyError as error:
                busy.append(str(error))
            except Exception as error:  # noqa: BLE001
                others.append(error)
    stepper.join(timeout=60)
    assert not stepper.is_alive() and not others
    assert busy and all("being stepped by another thread" in text for text in busy)
    assert world.frame >= 400
    world.step()


def test_ctrl_c_ends_a_long_step_between_two_frames():
    world = tumble.World.load("stack")
    # where the tests run in the background, Python finds SIGINT ignored and leaves it so
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(0.2, signal.raise_signal, [signal.SIGINT])
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            world.step(100_000)
    finally:
        timer.join(timeout=60)
        signal.signal(signal.SIGINT, before)
    stopped = world.frame
    assert 0 < stopped < 100_000 and world.time == pytest.approx(stopped * world.dt)
    world.step()
    assert world.frame == stopped + 1


def test_worlds_of_their_own_run_in_threads_of_their_own():
    worlds = [tumble.World.load("pendulum") for _ in range(4)]
    threads = [threading.Thread(target=world.step, args=(200,)) for world in worlds]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(timeout=60)
    assert len({world.save() for world in worlds}) == 1 and worlds[0].frame == 200


def test_views_hold_what_they_showed_when_their_world_is_gone():
    world = tumble.World()
    world.add_rigid("ball", tumble.Sphere(0.1), mass=1.0, position=(1, 2, 3))
    state, part = world.state, world.state[:3]
    del world
    gc.collect()
    assert (state[:3] == [1, 2, 3]).all() and (part == [1, 2, 3]).all()
    with pytest.raises(ValueError, match="read-only"):
        state[0] = 5.0


def test_a_scene_with_problems_reports_all_of_them(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text('[world]\ndt = 0.1\n\n[[body]]\nname = "a"\nshape = { type = "ball" }\n')
    with pytest.raises(tumble.SceneError) as caught:
        tumble.World.load(path)
    assert f"{path}:2:1: unknown key `dt`" in str(caught.value) and f"{path}:6:" in str(caught.value)
