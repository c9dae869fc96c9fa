"""Worlds that are pickled go on with the same bits; so do copies. Shapes, descriptions and trees pickle too."""

import copy
import multiprocessing
import pickle

import numpy as np
import pytest

import tumble

SCENES = ["stack", "chain", "piston", "skeleton", "robot", "billiards", "bowling", "falling"]
CORNERS = np.array([[x, y, z] for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (-0.1, 0.3)])
SIDES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
)


class Wind(tumble.Force):
    """Drag towards moving air, which remembers how often it was asked."""

    def __init__(self, velocity):
        self.velocity, self.calls = np.array(velocity, float), 0

    def apply(self, view):
        self.calls += 1
        view.force += 0.3 * (self.velocity - view.velocity)


class Holds(tumble.Force):
    """Holds the world that it acts in."""

    def __init__(self, world):
        self.world = world

    def apply(self, view):
        view.force[:, 2] += 0.1


class Rise(tumble.Behavior):
    """Twice its weight, upwards."""

    def act(self, view, rows):
        view.force[rows] -= 2.0 * view.mass[rows, None] * view.gravity


def again(value):
    return pickle.loads(pickle.dumps(value))


def same_future(world, other, steps=100):
    """Whether both have the same bytes now and after every tenth step."""
    assert other.save() == world.save()
    for _ in range(steps // 10):
        world.step(10)
        other.step(10)
        assert other.save() == world.save()


def with_every_shape(**words):
    """All shapes, a robot with drives, friction, damping, a kinematic body and one that was removed."""
    world = tumble.World(**words)
    world.add_static("floor", tumble.HalfSpace((0, 0.05, 1), 0.01), friction=0.8)
    gone = world.add_rigid("gone", tumble.Sphere(0.1), mass=1.0)
    mesh = tumble.Mesh(CORNERS, SIDES)
    shapes = {
        "sphere": tumble.Sphere(0.1),
        "box": tumble.Box((0.2, 0.3, 0.1)),
        "capsule": tumble.Capsule(0.05, 0.2),
        "cylinder": tumble.Cylinder(0.1, 0.2),
        "mesh": mesh,
        "mesh too": mesh,
        "compound": tumble.Compound([(tumble.Box(0.1), (0, 0, 0)), (mesh, (0.2, 0, 0), (0, 0, 1, 0))]),
    }
    for k, (name, shape) in enumerate(shapes.items()):
        body = world.add_rigid(name, shape, density=700.0 + k, position=(0.1 * k, 0, 0.13 + 0.4 * k), angular_velocity=(1, k, 2), restitution=0.1 * k)
        body.linear_damping, body.friction, body.color = 0.01 * k, 0.1 * k, (0.1 * k, 0.5, 0.2)
    world.add_rigid("plate", tumble.Box((1, 1, 0.1)), position=(3, 0, 0), kinematic=True, velocity=(0.1, 0, 0))
    world.remove(gone)
    world.add_rigid("balls", tumble.Sphere(0.2), mass=2.0, position=(0, 2, 1), contacts="spheres", collidable=False)
    return world


def with_robot(root, **words):
    world = with_every_shape(**words)
    arm = tumble.Articulation.from_urdf(root / "scenes" / "robot" / "arm.urdf")
    for k, base in enumerate([(5, 0, 1), (0, 5, 1, 0, 0, 1, 0)]):
        arm.q = np.linspace(0, 0.3 * k, arm.nq)
        placed = world.add_articulation(arm, base=base, name=f"arm{k}")
        placed.set_drive(placed.joint_names[0], target=0.5, stiffness=500, damping=20, max_force=30)
        placed.set_drive(placed.joint_names[1], velocity=0.2)
        placed.tau = 0.1 * np.arange(placed.dof)
    return world


@pytest.mark.parametrize(
    "words",
    [
        {},
        {"stepper": "backtracking", "integrator": "dormand_prince", "gravity": (0, 1, -3)},
        {"solver": "lcp_pyramid", "substeps": 2, "iterations": 50, "dt": 0.002},
    ],
)
def test_a_pickled_world_has_the_same_future(root, words):
    world = with_robot(root, **words)
    same_future(world, again(world), 80)
    world["sphere"].apply_force((3, 0, 0))
    world["arm0"].apply_torque(world["arm0"].link_names[-1], (0, 0, 1))
    other = again(world)
    for name in world.bodies.names():
        if name.startswith("arm"):
            mine, theirs = world[name], other[name]
            assert mine.joint_names == theirs.joint_names and (mine.limits == theirs.limits).all() and (mine.tau == theirs.tau).all()
            assert (mine.forward_dynamics() == theirs.forward_dynamics()).all()
            continue
        for part in ("mass", "inertia", "friction", "restitution", "color", "linear_damping", "mode", "enabled", "collidable", "asleep"):
            assert np.all(getattr(other[name], part) == getattr(world[name], part)), (name, part)
    assert repr(other) == repr(world) and other.bodies.names() == world.bodies.names() and repr(other.report) == repr(world.report)
    assert (other.contacts == world.contacts).all() and len(other.contacts) > 0
    assert (other.dt, other.stepper, other.solver, other.integrator) == (world.dt, world.stepper, world.solver, world.integrator)
    same_future(world, other)


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("stepper", ["time_stepping", "backtracking"])
def test_scenes_pickle(scene, stepper):
    world = tumble.World.load(scene, stepper=stepper)
    world.step(7)
    other = again(world)
    assert other.notes == world.notes and other.energy() == world.energy()
    same_future(world, other, 30)


def test_what_sleeps_goes_on_sleeping():
    world = tumble.World(sleep_after=0.1)
    world.add_static("floor", tumble.HalfSpace())
    for k in range(3):
        world.add_rigid(f"box{k}", tumble.Box(0.2), mass=1.0, position=(0, 0, 0.1 + 0.2 * k))
    world.step(200)
    assert world["box0"].asleep
    other = again(world)
    assert other["box0"].asleep and other.report.asleep == 3
    for each in (world, other):
        each["box1"].apply_impulse((0.5, 0, 0))
    assert not other["box0"].asleep or other.step() is None and not other["box0"].asleep
    if other.frame != world.frame:
        world.step()
    same_future(world, other)


def test_pictures_are_the_same():
    world = tumble.World.load("billiards")
    try:
        assert (again(world).render(64, 48) == world.render(64, 48)).all()
    except tumble.PictureError:
        pytest.skip("SKIPPED: no graphics adapter")


def test_a_pickle_of_a_pickle_is_the_same_bytes(root):
    world = with_robot(root)
    world.step(5)
    assert pickle.dumps(again(world)) == pickle.dumps(world)


def test_forces_and_behaviors_pickle_along():
    world = tumble.World()
    world.add_force("before", Wind((1, 0, 0)))
    for k in range(3):
        world.add_rigid(f"ball{k}", tumble.Sphere(0.1), mass=1.0, position=(k, 0, 1))
    world.add_force("wind", Wind((0, 2, 0)))
    world.add_behavior("rise", Rise(), ["ball0", "ball2"])
    world.step(5)
    other = again(world)
    assert list(other.forces) == list(world.forces) and list(other.behaviors) == ["rise"]
    assert other.forces["wind"].calls == 5 and other.forces["wind"] is not world.forces["wind"]
    same_future(world, other)
    assert other.forces["wind"].calls == world.forces["wind"].calls == 105


def test_a_force_that_holds_its_world_holds_the_pickled_one():
    world = tumble.World()
    world.add_rigid("ball", tumble.Sphere(0.1), mass=1.0)
    world.add_force("holds", Holds(world))
    other = again(world)
    assert other.forces["holds"].world is other
    same_future(world, other)


def test_copies_are_forks():
    world = with_every_shape()
    world.add_force("wind", Wind((1, 0, 0)))
    world.step(3)
    for other in (copy.copy(world), copy.deepcopy(world), copy.deepcopy({"world": [world]})["world"][0]):
        assert other.forces["wind"] is not world.forces["wind"]
        same_future(world.fork(), other, 20)


def job(world, name):
    """In another process."""
    world.step(50)
    return world, world[name].position


def test_worlds_go_to_other_processes_and_come_back(root):
    world = with_robot(root)
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        other, position = pool.apply_async(job, (world, "box")).get(timeout=120)
    world.step(50)
    assert (position == world["box"].position).all()
    same_future(world, other, 20)


def test_snapshots_pickle():
    world = with_every_shape()
    world.step(20)
    saved = again(world.save())
    world.step(20)
    other = again(world)
    other.restore(saved)
    world.restore(saved)
    same_future(world, other, 20)


@pytest.mark.parametrize(
    "shape",
    [
        tumble.Sphere(0.3),
        tumble.Box((1, 2, 3)),
        tumble.Capsule(0.1, 0.5),
        tumble.Cylinder(0.1, 0.5),
        tumble.Compound([(tumble.Sphere(0.1), (0, 0, 0), None, 500.0), (tumble.Box(0.2), (1, 0, 0), (0, 0, 0, 1), 700.0)]),
        tumble.HalfSpace((1, 2, 3), 0.3),
        tumble.Mesh(CORNERS, SIDES),
    ],
    ids=lambda shape: type(shape).__name__,
)
def test_shapes_pickle(shape):
    other = copy.deepcopy(again(shape))
    assert type(other) is type(shape) and repr(other) == repr(shape) and other.volume == shape.volume
    if isinstance(shape, tumble.Mesh):
        assert (other.vertices == shape.vertices).all() and (other.faces == shape.faces).all()
        assert (other.center_of_mass == shape.center_of_mass).all()

    def dropped(of):
        world = tumble.World()
        world.add_static("it", of, position=(0, 0, 0.1))
        world.add_rigid("ball", tumble.Box(0.2), mass=1.0, position=(0.02, 0.01, 3.5), angular_velocity=(1, 2, 3))
        world.step(200)
        return world.save()

    assert dropped(other) == dropped(shape)


def test_descriptions_pickle(root):
    arm = tumble.Articulation.from_urdf(root / "scenes" / "robot" / "arm.urdf", floating=True)
    arm.q = np.linspace(0, 0, arm.nq - 7).tolist() and np.concatenate([[1, 2, 3, 0, 0, 0, 1], 0.1 * np.ones(arm.nq - 7)])
    arm.qd, arm.tau, arm.gravity = 0.1 * np.arange(arm.dof), 0.2 * np.arange(arm.dof), (0, 0, -1.6)
    other = again(arm)
    for part in ("q", "qd", "tau", "gravity", "limits"):
        assert (getattr(other, part) == getattr(arm, part)).all()
    assert repr(other) == repr(arm) and (other.forward_dynamics() == arm.forward_dynamics()).all()


def test_trees_pickle(tmp_path):
    tree = tumble.SphereTree.build(CORNERS, SIDES, method="octree", depth=2, cache=False)
    other = again(tree)
    assert other.to_json() == tree.to_json() and other.report() == tree.report()
    tree.save(tmp_path / "tree.json")
    assert again(tumble.SphereTree.load(tmp_path / "tree.json")).to_json() == tree.to_json()


def test_results_of_steps_pickle():
    world = tumble.World.load("billiards")
    world.step(50)
    fields = [name for name in dir(tumble.StepReport) if not name.startswith("_")]
    assert len(fields) > 15
    for other in (again(world.report), copy.deepcopy(world.report), copy.copy(world.report)):
        assert type(other) is tumble.StepReport
        assert [getattr(other, name) for name in fields] == [getattr(world.report, name) for name in fields]
    resting = tumble.World()
    resting.add_static("floor", tumble.HalfSpace())
    resting.add_rigid("box", tumble.Box(0.2), mass=1.0, position=(0, 0, 0.1))
    resting.step(5)
    step = resting.linearize()
    fields = [name for name in dir(step) if not name.startswith("_")]
    for other in (again(step), copy.deepcopy(step)):
        assert repr(other) == repr(step) and all((x == y).all() for x, y in zip(other, step))
        assert all(np.array_equal(getattr(other, name), getattr(step, name)) for name in {"A", "B"})
        assert all(getattr(other, name) == getattr(step, name) for name in set(fields) - {"A", "B"})
    unpickle, (data,) = step.__reduce__()
    with pytest.raises(tumble.SnapshotError, match="damaged"):
        unpickle(data[:-1])


def test_recordings_pickle(tmp_path):
    world = with_every_shape()
    with tumble.Recorder(tmp_path / "run.mcap") as recorder:
        recorder.run(world, 5)
    run = tumble.read(tmp_path / "run.mcap")
    assert (again(run).positions == run.positions).all() and again(run).states == run.states


def test_handles_say_that_their_world_is_pickled(root):
    world = with_robot(root)
    for name in ("box", "arm0"):
        with pytest.raises(TypeError, match=f"cannot pickle a handle of '{name}' by itself; pickle its world"):
            pickle.dumps(world[name])


def payload(value):
    """The bytes within a pickle, and what makes them an object again."""
    unpickle, (data, *_), *_ = value.__reduce__()
    return unpickle, data


@pytest.mark.parametrize("value", [with_every_shape(), tumble.Mesh(CORNERS, SIDES)], ids=["world", "mesh"])
def test_damaged_and_foreign_bytes_are_refused(value):
    unpickle, data = payload(value)
    changed = data[:100] + bytes([data[100] ^ 1]) + data[101:]
    newer = data[:7] + b"9" + data[8:]
    for wrong, words in [
        (b"", "do not begin with 'tumble"),
        (b"something else altogether", "do not begin with 'tumble"),
        (changed, "damaged: their checksum is another"),
        (data[:-1], "damaged: their checksum is another"),
        (data + b"0", "damaged: their checksum is another"),
        (data[:12], "damaged: they are cut off"),
        (newer, f"have format '{newer[:8].decode()}'; this version of tumble reads '{data[:8].decode()}'"),
    ]:
        with pytest.raises(tumble.SnapshotError, match=words):
            unpickle(wrong)
    assert unpickle(data) is not None


def test_a_force_that_cannot_be_pickled_says_so():
    class Local(tumble.Force):
        def apply(self, view):
            pass

    world = tumble.World()
    world.add_force("local", Local())
    with pytest.raises((AttributeError, pickle.PicklingError), match="Local"):
        pickle.dumps(world)
    world.step()
