"""What programs say about joints of links, shapes of compounds and links, drives in events and filters of queries."""

import numpy as np
import pytest

import tumble


def quaternion(vector):
    angle = np.linalg.norm(vector)
    return np.array([*(np.sin(angle / 2) / angle * np.asarray(vector)), np.cos(angle / 2)])


def rotation_vector(q):
    sine = np.linalg.norm(q[:3])
    return np.asarray(q[:3]) * (2 * np.arctan2(sine, q[3]) / max(sine, 1e-300))


def lamp(**words):
    builder = tumble.ArticulationBuilder("lamp")
    words = {"joint": "spherical", "mass": 1, "center_of_mass": (0, 0, 0), "inertia": (0.5, 0.5, 0.5)} | words
    builder.add_link("head", **words)
    return builder


def test_a_spherical_joint_of_a_link_is_driven_to_an_orientation():
    world = tumble.World(gravity=(0, 0, 0))
    start, target = np.array([0.4, -0.2, 0.9]), np.array([-0.3, 0.8, 0.1])
    body = world.add_articulation(lamp(q=quaternion(start), qd=(0.1, 0.2, 0.3), joint_damping=0.1))
    assert np.allclose(rotation_vector(body.q), start) and np.allclose(body.qd, (0.1, 0.2, 0.3))
    body.set_drive("head", target=target, stiffness=1e9, damping=1e7)
    world.step(480)
    assert np.allclose(rotation_vector(body.q), target, atol=1e-6)
    body.set_drive("head", velocity=(0, 0, 2), max_force=50)
    world.step(240)
    assert np.allclose(body.qd, (0, 0, 2), atol=1e-6)
    with pytest.raises(ValueError, match=r"target: expected a number, or shape \(3,\)"):
        body.set_drive("head", target=(1, 2), stiffness=1)


def test_springs_cones_and_twists_of_a_link_are_those_of_a_loop_joint():
    world = tumble.World(gravity=(0, 0, 0), dt=1 / 480)
    spin = (1.5, -0.5, 2)
    settings = {"cone": 0.6, "twist_limits": (-0.3, 0.4), "stiffness": 3}
    body = world.add_articulation(lamp(axis=(0, 0, 1), rest=(0.1, 0, 0.2), joint_damping=0.05, qd=spin, **settings))
    ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=1, inertia=(0.5, 0.5, 0.5), angular_velocity=spin, collidable=False)
    dofs = [{"rest": rest, "stiffness": 3} for rest in (0.1, 0, 0.2)]
    world.add_joint("spherical", ball, axis=(0, 0, 1), second_axis=(1, 0, 0), dofs=dofs, damping=0.05, **settings)
    assert np.allclose(body.stiffness, 3) and np.allclose(body.rest, (0.1, 0, 0.2))
    assert np.allclose(body.limits[2], (0, 0.6)) and np.allclose(body.twist_limits[2], (-0.3, 0.4))
    assert np.isinf(body.twist_limits[:2]).all()
    for _ in range(960):
        world.step()
        assert np.allclose(rotation_vector(body.q), rotation_vector(ball.orientation), atol=2e-3)
        assert 2 * np.arctan2(body.q[2], body.q[3]) < 0.4 + 1e-6
    body.twist_limits = [(-np.inf, np.inf), (-np.inf, np.inf), (-0.1, 0.1)]
    assert np.allclose(body.twist_limits[2], (-0.1, 0.1))
    with pytest.raises(ValueError, match="3π/2"):
        body.twist_limits = [(-np.inf, np.inf), (-np.inf, np.inf), (-3, 3)]


def test_every_joint_type_has_an_initial_position():
    builder = tumble.ArticulationBuilder("robot")
    ball = {"shape": tumble.Sphere(0.1), "mass": 1}
    builder.add_link("trunk", joint="floating", q=(1, 2, 3, 0, 0, 0, 1), qd=(0, 0, 1, 4, 5, 6), **ball)
    builder.add_link("arm", "trunk", axis=(0, 1, 0), position=(1, 0, 0), q=0.5, qd=0.25, **ball)
    builder.add_link("slide", "arm", joint="prismatic", axis=(1, 0, 0), position=(1, 0, 0), q=[0.75], qd=-1, **ball)
    builder.add_link("hand", "slide", joint="spherical", position=(1, 0, 0), q=quaternion((0, 0, 1)), **ball)
    body = tumble.World(gravity=(0, 0, 0)).add_articulation(builder)
    assert np.allclose(body.q, [1, 2, 3, 0, 0, 0, 1, 0.5, 0.75, *quaternion((0, 0, 1))])
    assert np.allclose(body.qd, [0, 0, 1, 4, 5, 6, 0.25, -1, 0, 0, 0])
    with pytest.raises(ValueError, match="position at time 0 with another count"):
        lamp(q=0.5).build()
    with pytest.raises(ValueError, match="unit length"):
        lamp(q=(0, 0, 0, 2)).build()


def test_links_and_shapes_have_all_constants_of_surfaces():
    builder = tumble.ArticulationBuilder("cart")
    laws = {
        "static_friction": 0.9,
        "stribeck_speed": 0.1,
        "friction_scale": (1, 0.5, 1),
        "rolling_friction": 0.01,
        "torsional_friction": 0.02,
        "tangential_restitution": 0.3,
        "adhesion": 40,
        "surface_velocity": (1, 0, 0),
    }
    builder.add_link("bed", joint="floating", shape=tumble.Box(1), friction=0.6, restitution=0.1, **laws)
    builder.add_shape("bed", tumble.Sphere(0.5), position=(2, 0, 0), rolling_friction=0.05, surface_velocity=(0, 2, 0))
    cart = tumble.World().add_articulation(builder)
    first, second = cart.shape_material("bed", 0), cart.shape_material("bed", 1)
    for name, value in laws.items():
        assert np.allclose(first[name], value), name
    assert first["friction"] == second["friction"] == 0.6 and second["restitution"] == 0.1
    assert second["rolling_friction"] == 0.05 and np.allclose(second["surface_velocity"], (0, 2, 0)) and second["adhesion"] == 40
    with pytest.raises(ValueError, match="rolling friction"):
        lamp(shape=tumble.Sphere(0.1), rolling_friction=-1).build()


def test_a_belt_on_a_link_carries_what_lies_on_it():
    world = tumble.World()
    builder = tumble.ArticulationBuilder("conveyor")
    builder.add_link("belt", joint="fixed", shape=tumble.Box((4, 1, 0.2)), surface_velocity=(0.5, 0, 0), friction=1)
    builder.add_link("arm", joint="prismatic", position=(0, 0, -5), shape=tumble.Sphere(0.1), limits=(-1e-3, 1e-3))
    world.add_articulation(builder)
    crate = world.add_rigid("crate", tumble.Box(0.2), mass=1, position=(0, 0, 0.2))
    world.step(240)
    assert crate.velocity[0] == pytest.approx(0.5, abs=1e-6)


def test_shapes_of_a_compound_have_filters():
    world = tumble.World(gravity=(0, 0, 0))
    ball = tumble.Sphere(0.2)
    pair = world.add_rigid("pair", tumble.Compound([(ball.named("left"), (-1, 0, 0)), (ball.named("right"), (1, 0, 0))]), mass=1, group=2)
    assert pair.shape_filter("left") == {"group": 2, "mask": 2**64 - 1, "sensor": False}
    pair.set_shape_filter("left", mask=[1], sensor=True)
    pair.set_shape_filter(1, group=4)
    assert pair.shape_filter(0) == {"group": 2, "mask": 2, "sensor": True} and pair.shape_filter("right")["group"] == 4
    hits = world.cast_rays([(-1, 0, 3), (1, 0, 3)], (0, 0, -1))
    assert np.isinf(hits["distance"][0]) and hits["shape"][1] == 1
    assert np.isinf(world.cast_rays((1, 0, 3), (0, 0, -1), mask=[2])["distance"]).all()
    read = tumble.World()
    for copy in (world.fork(), __import__("copy").deepcopy(world)):
        assert copy["pair"].shape_filter("left")["sensor"]
    pair.set_shape_filter("left")
    assert pair.shape_filter("left") == {"group": 2, "mask": 2**64 - 1, "sensor": False}
    with pytest.raises(ValueError, match="64"):
        pair.set_shape_filter(0, group=64)
    assert len(read.bodies) == 0


def test_filters_of_shapes_are_saved_with_the_scene(tmp_path):
    world = tumble.World()
    ball = tumble.Sphere(0.2)
    pair = world.add_rigid("pair", tumble.Compound([(ball, (-1, 0, 0)), (ball, (1, 0, 0))]), mass=1)
    pair.set_shape_filter(1, group=4, mask=[0, 5], sensor=True)
    world.save_scene(tmp_path / "pair.toml")
    text = (tmp_path / "pair.toml").read_text()
    (tmp_path / "pair.toml").write_text(text + "# edited\n")
    read = tumble.World.load(tmp_path / "pair.toml")
    assert read["pair"].shape_filter(1) == {"group": 4, "mask": 33, "sensor": True}


def test_an_event_drives_the_degree_of_freedom_that_it_names(tmp_path):
    world = tumble.World(gravity=(0, 0, 0))
    ball = world.add_rigid("ball", tumble.Sphere(0.2), mass=1)
    drive = {"target": 0, "stiffness": 40, "damping": 9}
    joint = world.add_joint("universal", ball, name="cardan", axis=(0, 0, 1), second_axis=(1, 0, 0), dofs=[{}, {"drive": drive}])
    body = world.add_articulation(lamp(position=(3, 0, 0), drive=drive))
    action = tumble.Action.drive
    deeds = [action(joint, 0.5, dof=1), action("lamp/head", 0.3, dof=2), action((body, "head"), -0.2, dof=0)]
    world.add_event("go", tumble.Trigger.time(0.1), deeds)
    world.save_scene(tmp_path / "event.toml")
    read = tumble.World.load(tmp_path / "event.toml")
    for each in (world, read):
        each.step(960)
        assert [dof.position for dof in each.joint("cardan").dofs] == pytest.approx([0, 0.5], abs=1e-4)
        assert np.allclose(rotation_vector(each.articulation("lamp").q), (-0.2, 0, 0.3), atol=1e-4)
    with pytest.raises(ValueError, match="no degree of freedom 3"):
        world.add_event("no", tumble.Trigger.time(1), [action("lamp/head", 1, dof=3)])


def test_limits_are_infinite_on_one_side():
    world = tumble.World(gravity=(0, 0, 0))
    wheel = world.add_rigid("wheel", tumble.Sphere(0.2), mass=1, angular_velocity=(0, 0, -20))
    axle = world.add_joint("revolute", wheel, axis=(0, 0, 1), limits=(-np.inf, 1))
    builder = tumble.ArticulationBuilder("arm")
    builder.add_link("arm", axis=(0, 0, 1), limits=(-np.inf, 1), q=-40, qd=30, mass=1, center_of_mass=(0, 0, 0), inertia=(1, 1, 1))
    arm = world.add_articulation(builder)
    world.step(240)
    assert axle.position == pytest.approx(-20) and axle.limits == (-np.inf, 1)
    wheel.angular_velocity = (0, 0, 20)
    world.step(480)
    assert axle.position == pytest.approx(1, abs=1e-6) and arm.q[0] == pytest.approx(1, abs=1e-6)
    with pytest.raises(ValueError, match="infinite on one side"):
        axle.limits = (-7, 7)


def test_queries_ignore_links_and_act_as_a_body():
    world = tumble.World(gravity=(0, 0, 0))
    builder = tumble.ArticulationBuilder("robot")
    builder.add_link("arm", shape=tumble.Box(0.4), mass=1)
    builder.add_link("tip", "arm", joint="fixed", position=(1, 0, 0), shape=tumble.Box(0.4), mass=1)
    robot = world.add_articulation(builder)
    red = world.add_rigid("red", tumble.Box(0.4), mass=1, position=(2, 0, 0))
    blue = world.add_rigid("blue", tumble.Box(0.4), mass=1, position=(3, 0, 0))
    origins = [(x, 0, 2) for x in range(4)]

    def seen(**words):
        return np.isfinite(world.cast_rays(origins, (0, 0, -1), **words)["distance"]).tolist()

    assert seen() == [True] * 4
    assert seen(ignore="robot/tip") == [True, False, True, True]
    assert seen(ignore=[(robot, "arm"), red]) == [False, True, False, True]
    assert seen(as_body=red) == [True, True, False, True]
    assert seen(as_body="robot/tip") == [False, False, True, True]
    world.set_pair_material(red, "robot/tip", collides=False)
    assert seen(as_body=red) == [True, False, False, True]
    assert seen(as_body=(robot, "arm")) == [False, False, True, True]
    assert world.overlaps(tumble.Sphere(0.3), position=(1, 0, 0), as_body=red)["body"].tolist() == []
    blue.mask = [5]
    assert seen(as_body=red) == [True, False, False, False]
    with pytest.raises(Exception, match="foot"):
        seen(ignore="robot/foot")


def test_a_joint_and_its_first_degree_of_freedom_are_one():
    world = tumble.World(gravity=(0, 0, 0))
    ball = world.add_rigid("ball", tumble.Sphere(0.2), mass=1)
    joint = world.add_joint("cylindrical", ball, axis=(0, 0, 1))
    other = world.add_joint("spherical", world.add_rigid("eye", tumble.Sphere(0.2), mass=1, position=(2, 0, 0)))
    for name, value in {"damping": 0.5, "friction": 0.25, "stiffness": 3, "rest": 0.125, "effort": 9, "max_velocity": 2, "armature": 0.75}.items():
        setattr(joint, name, value)
        assert getattr(joint, name) == getattr(joint.dofs[0], name) == value and getattr(joint.dofs[1], name) != value
        setattr(joint.dofs[1], name, 2 * value)
        assert getattr(joint, name) == value and getattr(joint.dofs[1], name) == 2 * value
        setattr(other, name, value)
        assert [getattr(dof, name) for dof in other.dofs] == [value] * 3
    joint.limits = (-1, np.inf)
    assert joint.dofs[0].limits == (-1, np.inf) and joint.dofs[1].limits is None
    with pytest.raises(ValueError):
        joint.damping = -1
    assert joint.damping == 0.5


def test_shapes_of_links_have_filters_in_a_world(tmp_path):
    builder = tumble.ArticulationBuilder("arm")
    parts = tumble.Compound([(tumble.Sphere(0.1), (0.5, 0, 0)), (tumble.Sphere(0.1), (-0.5, 0, 0))])
    builder.add_link("l", axis=(0, 1, 0), shape=parts, mass=1)
    builder.add_shape("l", tumble.Sphere(0.1), (0, 0.5, 0))
    world = tumble.World(gravity=(0, 0, 0))
    arm = world.add_articulation(builder)
    assert arm.shape_filter("l", 0) == {"group": 0, "mask": 2**64 - 1, "sensor": False}
    arm.set_shape_filter("l", 0, sensor=True)
    arm.set_shape_filter("l", 2, group=3, mask=[1])
    assert arm.shape_filter("l", 0)["sensor"] and not arm.shape_filter("l", 1)["sensor"]
    assert arm.shape_filter("l", 2) == {"group": 3, "mask": 2, "sensor": False}
    down = [world.cast_rays((x, y, 1), (0, 0, -1))["body"] for x, y in ((0.5, 0), (-0.5, 0), (0, 0.5))]
    assert [bool(np.all(found >= 0)) for found in down] == [False, True, False]
    world.save_scene(tmp_path / "s.toml")
    for copy in (world.fork(), tumble.World.load(tmp_path / "s.toml")):
        assert [copy["arm"].shape_filter("l", n) for n in range(3)] == [arm.shape_filter("l", n) for n in range(3)]
    arm.set_shape_filter("l", 0)
    assert not arm.shape_filter("l", 0)["sensor"]
    with pytest.raises(ValueError, match="no shape 3"):
        arm.set_shape_filter("l", 3, sensor=True)
    box = world.add_rigid("pair", parts, mass=1, position=(5, 0, 0))
    for wrong in (lambda: box.set_shape_filter(2, sensor=True), lambda: box.shape_filter(2)):
        with pytest.raises(ValueError, match="no part 2"):
            wrong()
    for shape in (-1, 1.5, None, 10**30):
        with pytest.raises(ValueError, match="shape: expected a name or a number from 0, got"):
            box.set_shape_filter(shape)


def test_a_spherical_joint_takes_vectors():
    world = tumble.World(gravity=(0, 0, 0))
    ball = world.add_rigid("ball", tumble.Sphere(0.1), mass=1)
    joint = world.add_joint("spherical", ball, rest=(0.1, 0.2, 0.3), stiffness=2, drive={"target": (0.3, 0.2, 0.1), "stiffness": 3})
    assert [dof.rest for dof in joint.dofs] == [0.1, 0.2, 0.3]
    assert [dof.stiffness for dof in joint.dofs] == [2, 2, 2]
    for wrong in ({"rest": (1, 2)}, {"drive": {"target": (1, 2), "stiffness": 1}}):
        with pytest.raises(ValueError, match="shape"):
            world.add_joint("spherical", ball, stiffness=1, **wrong)
    with pytest.raises(ValueError, match="rest: expected a number"):
        world.add_joint("revolute", ball, stiffness=1, rest=(1, 2, 3))


def test_turns_of_a_hinge_are_in_the_text_of_a_scene(tmp_path):
    world = tumble.World(gravity=(0, 0, 0))
    wheel = world.add_rigid("wheel", tumble.Cylinder(0.2, 0.3), mass=4, angular_velocity=(0, 0, -15))
    hinge = world.add_joint("revolute", wheel, limits=(-np.inf, 1), name="hinge")
    world.step(480)
    assert hinge.position == pytest.approx(-30, abs=1e-6)
    world.save_scene(tmp_path / "s.toml")
    text = (tmp_path / "s.toml").read_text()
    (tmp_path / "s.toml").write_text("# changed\n" + text)
    assert tumble.World.load(tmp_path / "s.toml").joint("hinge").position == pytest.approx(-30, abs=1e-6)
    other = tumble.World()
    body = other.add_rigid("b", tumble.Sphere(0.1), mass=1)
    assert other.add_joint("revolute", body, limits=(-np.inf, 1), angle=-30).position == pytest.approx(-10 * np.pi)
    with pytest.raises(ValueError, match="angle: expected"):
        other.add_joint("revolute", body, limits=(-1, 1), angle=-30)


@pytest.mark.parametrize("moments", [(1, 1, 5), (1, -1, 1)])
def test_an_inertia_that_no_link_has_is_refused(moments):
    builder = tumble.ArticulationBuilder("arm")
    with pytest.raises(ValueError, match="principal moments"):
        builder.add_link("l", mass=1, center_of_mass=(0, 0, 0), inertia=moments)
    builder.add_link("l", mass=1, center_of_mass=(0, 0, 0), inertia=(0, 1, 1))
    arm = tumble.World().add_articulation(builder)
    with pytest.raises(ValueError, match="principal moments"):
        arm.link("l").inertia = moments
