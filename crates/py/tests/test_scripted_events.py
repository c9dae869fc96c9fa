"""Scripted events, templates and callables from Python."""

import pickle

import numpy as np
import pytest

import tumble
from tumble import Action, Trigger

STEP = 1 / 240


def weightless(**settings):
    return tumble.World(gravity=(0, 0, 0), dt=STEP, **settings)


def test_python_and_scene_files_have_the_same_bits():
    text = """
[world]
dt_s = 0.004
[[body]]
name = "floor"
mode = "static"
shape = { type = "half_space" }
restitution = 0.5
[[template]]
name = "ball"
max = 3
reuse = true
shape = { type = "sphere", radius_m = 0.1 }
mass_kg = 1
restitution = 0.5
[[event]]
name = "drop"
when = { every_s = 0.3 }
do = [{ spawn = "ball", position_m = [0, 0, 1], velocity_m_per_s = [1, 0, 0] }]
[[event]]
name = "bounce"
when = { contact = ["floor", "ball"], impulse_n_s = 3 }
times = 4
do = [{ push = "other", impulse_n_s = [0, 1, 2] }, { set_velocity = "ball 3", velocity_m_per_s = [0, 0, 1] }]
[[event]]
name = "later"
when = { after = "bounce" }
delay_s = 0.1
do = [{ remove = "other" }, { force = "ball 1", force_n = [1, 0, 0], torque_n_m = [0, 0, 0.1], duration_s = 0.2 }]
"""
    scene = tumble.World.parse(text)
    world = tumble.World(dt=0.004)
    world.add_static("floor", tumble.HalfSpace(), restitution=0.5)
    ball = world.add_template("ball", tumble.Sphere(0.1), 3, mass=1, restitution=0.5, reuse=True)
    world.add_event("drop", Trigger.every(0.3), [Action.spawn(ball, (0, 0, 1), velocity=(1, 0, 0))])
    bounce = world.add_event(
        "bounce",
        Trigger.contact("floor", ball, impulse=3),
        [Action.push("other", (0, 1, 2)), Action.set_velocity("ball 3", (0, 0, 1))],
        times=4,
    )
    world.add_event(
        "later",
        Trigger.after(bounce),
        [Action.remove("other"), Action.force("ball 1", (1, 0, 0), (0, 0, 0.1), duration=0.2)],
        delay=0.1,
    )
    for _ in range(12):
        world.step(50)
        scene.step(50)
        assert (world.state == scene.state).all()
    assert bounce.fired == 4 and ball.spawned == 8 and ball.refused == 0
    assert world["bounce"] == bounce and world["ball"] == ball and scene["bounce"].fired == 4
    assert [body.name for body in ball.bodies] == ["ball 1", "ball 2", "ball 3"]
    fired = [event for event in scene.events if event.kind == "fired"]
    assert all(isinstance(event.a, tumble.ScriptedEvent) for event in fired)


def test_a_push_and_a_force_have_their_momentum():
    world = weightless()
    ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=2)
    push = world.add_event("push", Trigger.time(0.5), [Action.push(ball, (4, 0, 0))])
    world.add_event("force", Trigger.key("f"), [Action.force(ball, (0, 6, 0), duration=0.5)], times=1)
    assert not world.press("g") and world.press("f")
    world.step(240)
    assert push.fired == 1
    assert ball.velocity == pytest.approx([2, 1.5, 0], abs=1e-12)  # J/m, F·t/m
    push.enabled = False
    assert not push.enabled
    world.remove(push)
    assert not push.exists and "removed" in repr(push)


def test_paths_drives_joints_colors_and_sensors():
    world = weightless()
    gate = world.add_static("gate", tumble.Box(0.5), position=(2, 0, 0), sensor=True)
    ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=1, velocity=(2, 0, 0))
    lift = world.add_rigid("lift", tumble.Box(0.2), position=(0, 3, 0), kinematic=True)
    wheel = world.add_rigid("wheel", tumble.Sphere(0.2), mass=1, position=(0, -3, 0))
    axle = world.add_joint("revolute", wheel, axis=(0, 0, 1), drive={"velocity": 0.0, "max_force": 100.0})
    rope = world.add_joint("fixed", ball, lift, name="rope")
    rope.enabled = False
    world.add_event("path", Trigger.time(STEP), [Action.move_along(lift, [0, 1], [(0, 3, 0), (0, 3, 1)])])
    world.add_event("spin", Trigger.time(0.2), [Action.drive(axle, 5.0)])
    world.add_event("seen", Trigger.enters(gate, [ball]), [Action.recolor("other", (1, 0, 0)), Action.attach(rope, here=True)])
    world.step(120)
    assert wheel.angular_velocity[2] == pytest.approx(5.0, abs=1e-3)
    assert not rope.enabled
    world.step(120)
    assert lift.position == pytest.approx([0, 3, 1 - 0.5 * 0], abs=0.02)
    assert rope.enabled and world["seen"].fired == 1
    world.step(60)
    assert lift.position == pytest.approx([0, 3, 1], abs=1e-9)


def explode(view, firing):
    here = view.position[view.row(firing.other)]
    corners = [np.array([x, y, z]) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    shards = [Action.spawn("shard", here + 0.2 * d, velocity=3 * d) for d in corners]
    return [Action.remove("other"), *shards]


def exploding(**settings):
    world = tumble.World(dt=STEP, **settings)
    world.add_static("floor", tumble.HalfSpace())
    world.add_template("shard", tumble.Sphere(0.02), 8, mass=0.1, color=(1, 0.5, 0))
    bomb = world.add_rigid("bomb", tumble.Sphere(0.1), mass=1, position=(0, 0, 1))
    world.add_event("bang", Trigger.contact("floor", [bomb]), [explode])
    return world


def test_a_callable_explodes_a_body_at_its_contact():
    world = exploding()
    world.step(120)
    assert world["bang"].fired == 1 and world["shard"].spawned == 8
    assert not world["bomb"].enabled
    copy, fork = pickle.loads(pickle.dumps(exploding())), exploding().fork()
    copy.step(120)
    fork.step(120)
    assert (copy.state == world.state).all() and (fork.state == world.state).all()


def test_a_firing_says_what_happened():
    seen = []

    def bounce(view, firing):
        seen.append((firing, view.velocity[view.row("ball")].copy()))
        return [Action.push(firing.other, firing.impulse)]

    world = weightless()
    world.add_rigid("wall", tumble.Box(1), kinematic=True)
    ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=2, position=(1, 0, 0), velocity=(-3, 0, 0))
    world.add_event("bounce", Trigger.contact("wall", ball), bounce)
    world.step(60)
    ((firing, velocity),) = seen
    assert (firing.event, firing.other) == ("bounce", "ball")
    assert firing.impulse == pytest.approx([6, 0, 0], rel=1e-9)  # m·v of an inelastic impact
    assert velocity == pytest.approx([0, 0, 0], abs=1e-9)
    assert firing.point == pytest.approx([0.5, 0, 0], abs=0.02)
    assert ball.velocity == pytest.approx([3, 0, 0], rel=1e-9)  # the impulse again: an elastic bounce


def test_a_callable_that_raises_leaves_the_world_before_the_frame():
    def wrong(view, firing):
        raise KeyError("nothing")

    world = weightless()
    world.add_rigid("ball", tumble.Sphere(0.1), mass=1, velocity=(1, 0, 0))
    event = world.add_event("now", Trigger.time(3 * STEP), [wrong])
    with pytest.raises(KeyError, match="nothing"):
        world.step(5)
    assert world.frame == 2 and event.fired == 0
    world.remove("now")
    world.step(5)
    assert world.frame == 7


@pytest.mark.parametrize(
    ("returned", "message"),
    [
        (3, "None or a list of actions"),
        ([3], "None or a list of actions"),
        ([Action.recolor("ball", (1, 0, 0))], "goes on after its firing"),
        ([Action.remove("nobody")], "no object named 'nobody'"),
        ([Action.push("other", (1, 0, 0))], "other body"),
    ],
)
def test_callables_return_actions_that_are_done_at_once(returned, message):
    world = weightless()
    world.add_rigid("ball", tumble.Sphere(0.1), mass=1)
    world.add_event("now", Trigger.time(STEP), lambda view, firing: returned)
    with pytest.raises(tumble.TumbleError, match=message):
        world.step()
    assert world.frame == 0


def test_callables_that_add_forces_and_models_are_refused():
    def pushes(view, firing):
        view.force[0] = 1

    world = weightless()
    world.add_rigid("ball", tumble.Sphere(0.1), mass=1)
    world.add_event("now", Trigger.time(STEP), pushes)
    with pytest.raises(tumble.InvalidValueError, match="adds no forces"):
        world.step()
    with pytest.raises(tumble.InvalidValueError, match="callables"):
        world.model()


def test_a_rollout_runs_callables():
    world = exploding()
    states = world.rollout(np.zeros((2, 120, 0)), every=120, threads=2)
    world.step(120)
    assert (states[0, 0] == world.state).all() and (states[1, 0] == world.state).all()


def test_wrong_arguments():
    world, other = weightless(), weightless()
    ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=1)
    stranger = other.add_rigid("ball", tumble.Sphere(0.1), mass=1)
    with pytest.raises(tumble.InvalidValueError, match="another world"):
        world.add_event("a", Trigger.time(1), [Action.remove(stranger)])
    with pytest.raises(tumble.UnknownNameError, match="no object named 'bal'"):
        world.add_event("a", Trigger.contact("bal"), [Action.remove("other")])
    with pytest.raises(tumble.TumbleError, match="kinematic"):
        world.add_event("a", Trigger.time(1), [Action.move_along(ball, [0, 1], np.zeros((2, 3)))])
    with pytest.raises(tumble.InvalidValueError, match=r"positions: expected shape \(2, 3\)"):
        Action.move_along(ball, [0, 1], [0, 0, 1])
    with pytest.raises(TypeError, match="actions and callables"):
        world.add_event("a", Trigger.time(1), [3])
    with pytest.raises(tumble.TumbleError, match="time of an event is -1"):
        world.add_event("a", Trigger.time(-1), [])
    with pytest.raises(tumble.InvalidValueError, match="number"):
        Action.light(0, intensity=1)
    with pytest.raises(tumble.InvalidValueError, match="name of a camera"):
        Action.camera("scene", eye=(0, 0, 1))
    ball.velocity = (1, 0, 0)
    world.step()


def test_a_recording_with_spawned_bodies_is_replayed(tmp_path):
    def made():
        world = tumble.World(dt=STEP)
        world.add_static("floor", tumble.HalfSpace())
        ball = world.add_template("ball", tumble.Sphere(0.1), 4, mass=1, reuse=True)
        world.add_event("drop", Trigger.every(0.1, first=0.05), [Action.spawn(ball, (0, 0, 0.3), velocity=(1, 0, 0))])
        world.add_event("hit", Trigger.contact("floor", ball), [Action.recolor("other", (1, 0, 0))])
        return world

    world, path = made(), tmp_path / "run.mcap"
    states = []
    with tumble.Recorder(path) as recorder:
        for _ in range(120):
            world.step()
            recorder.frame(world)
            states.append(world.state.copy())
    replayed = 0
    for shown, state in zip(tumble.replay(path, made()), states):
        assert (shown.state == state).all()
        if shown.frame == 60:
            fork = shown.fork()
            fork.step(60)
            assert (fork.state == world.state).all()
        replayed += 1
    assert replayed == 120 and world["ball"].spawned == 5 and world["hit"].fired >= 2
