"""Whole numbers among the arguments: one that does not fit is a value error that names the argument, the number and what would be right."""

import re

import pytest

import tumble

FAR = 2**70


def ball(world, name="ball"):
    return world.add_rigid(name, tumble.Sphere(0.1), mass=1)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda w: w.add_sensor("gyroscope", ball(w), delay=-1), "delay is -1; expected a whole number of steps from 0 to 10000"),
        (lambda w: w.add_sensor("gyroscope", ball(w), seed=-1), "seed is -1; expected a whole number from 0 to 2**64 - 1"),
        (lambda w: w.add_sensor("gyroscope", ball(w)).seed(-1), "seed is -1; expected a whole number from 0 to 2**64 - 1"),
        (lambda w: w.add_sensor("depth", ball(w), resolution=(-1, 4)), "resolution is (-1, 4); expected two whole numbers of pixels"),
        (lambda w: w.add_rigid("a", tumble.Sphere(0.1), mass=1, group=-1), "group is -1; expected a group from 0 to 63"),
        (lambda w: setattr(ball(w), "group", -1), "group is -1; expected a group from 0 to 63"),
        (
            lambda w: w.add_rigid("a", tumble.Compound([(tumble.Sphere(0.1), (0, 0, 0))]), mass=1).set_shape_filter(0, group=-1),
            "group is -1; expected a group from 0 to 63",
        ),
        (
            lambda w: w.add_rigid("a", tumble.Compound([(tumble.Sphere(0.1), (0, 0, 0))]), mass=1).set_shape_filter(0, mask=-1),
            "mask is -1; expected the bits of an integer from 0 to 2**64 - 1",
        ),
        (lambda w: links().add_shape("a", tumble.Sphere(0.1), group=-1), "group is -1; expected a group from 0 to 63"),
        (lambda w: setattr(w, "substeps", -1), "substeps is -1; expected a whole number from 1 to 1000"),
        (lambda w: setattr(w, "budget", -1), "budget is -1; expected a whole number from 1 to 4000000000, or None"),
        (lambda w: tumble.World(budget=-1), "budget is -1"),
        (lambda w: tumble.World(iterations=FAR), f"iterations is {FAR}; expected a whole number from 1 to 1000000"),
        (lambda w: tumble.World.load("stack", threads=-1), "threads is -1; expected a whole number from 0 to 4294967295"),
        (lambda w: tumble.Batch(w, -1), "n is -1; expected a whole number"),
        (lambda w: tumble.Batch(w, 1, threads=-1), "threads is -1; expected a whole number"),
        (lambda w: w.step(FAR), f"n is {FAR}; expected a whole number"),
        (lambda w: w.add_cloth(nodes=(-1, 4)), "nodes is (-1, 4); expected two whole numbers"),
        (lambda w: w.add_jelly(nodes=(2, 2, -1)), "nodes is (2, 2, -1); expected three whole numbers"),
        (lambda w: w.add_joint("gear", ball(w), teeth=(FAR, 1), second_point=(0, 0, 0)), f"teeth is ({FAR}, 1); expected two whole numbers"),
        (lambda w: w.render(-1, 10), "width is -1; expected a whole number"),
    ],
)
def test_a_number_that_does_not_fit_is_named(call, said):
    with pytest.raises(tumble.InvalidValueError, match=re.escape(said)):
        call(tumble.World())


def test_what_is_no_number_at_all_is_a_type_error():
    with pytest.raises(TypeError):
        tumble.World().add_rigid("a", tumble.Sphere(0.1), mass=1, group="first")
    assert len(tumble.World(budget=None).bodies) == 0


def links():
    builder = tumble.ArticulationBuilder("arm")
    builder.add_link("a", joint="spherical", shape=tumble.Sphere(0.1), mass=1)
    return builder


def test_an_axis_has_a_length_and_a_cone_is_at_most_half_a_turn():
    world = tumble.World()
    for joint in ("spherical", "revolute", "prismatic"):
        with pytest.raises(tumble.InvalidValueError, match=re.escape("axis is [0, 0, 0]; expected a direction")):
            tumble.ArticulationBuilder("arm").add_link("a", joint=joint, axis=(0, 0, 0))
    with pytest.raises(tumble.InvalidValueError, match="axis"):
        world.add_joint("spherical", ball(world), axis=(0, 0, 0), point=(0, 0, 0))
    joint = world.add_joint("spherical", ball(world, "other"), point=(0, 0, 0), cone=3.1)
    for wrong in (3.15, -0.1, float("inf")):
        with pytest.raises(tumble.InvalidValueError, match=f"the cone is {wrong}; it must be 0 to π rad"):
            joint.cone = wrong
    assert joint.cone == 3.1
    builder = tumble.ArticulationBuilder("arm")
    builder.add_link("a", joint="spherical", shape=tumble.Sphere(0.1), mass=1, cone=3.15)
    with pytest.raises(tumble.InvalidValueError, match="the cone"):
        world.add_articulation(builder)


SURFACE = {"friction": 0.3, "restitution": 0.2, "static_friction": 0.4, "stribeck_speed": 0.02, "rolling_friction": 0.01, "torsional_friction": 0.02}
SURFACE |= {"tangential_restitution": 0.1, "adhesion": 2.0}


def test_links_shapes_and_materials_have_the_same_constants_of_surfaces():
    builder = tumble.ArticulationBuilder("arm")
    builder.add_link("a", shape=tumble.Sphere(0.1), mass=1, friction_scale=(1, 2, 3), surface_velocity=(1, 0, 0), **SURFACE)
    builder.add_link("b", "a", shape=tumble.Sphere(0.1), mass=1, position=(0, 0, 1), adhesion=None)
    builder.add_shape("b", tumble.Sphere(0.2), (0, 0, 1), friction_scale=(1, 2, 3), surface_velocity=(1, 0, 0), **SURFACE)
    arm = tumble.World().add_articulation(builder)
    arm.set_shape_material("b", 0, restitution=0.7)
    found = [arm.shape_material("a", 0), arm.shape_material("b", 1)]
    for constants in found:
        assert {name: constants[name] for name in SURFACE} == SURFACE
        assert list(constants["friction_scale"]) == [1, 2, 3] and list(constants["surface_velocity"]) == [1, 0, 0]
    plain = arm.shape_material("b", 0)
    assert (plain["friction"], plain["restitution"], plain["adhesion"]) == (0.5, 0.7, 0.0)
    with pytest.raises(TypeError, match=r"add_shape\(\) got an unexpected keyword argument 'fricton'"):
        builder.add_shape("b", tumble.Sphere(0.2), fricton=0.3)
    with pytest.raises(TypeError, match=r"add_link\(\) got an unexpected keyword argument 'fricton'"):
        builder.add_link("c", fricton=0.3)
    with pytest.raises(TypeError, match=r"set_shape_material\(\) got an unexpected keyword argument 'fricton'"):
        arm.set_shape_material("b", 0, fricton=0.3)
    with pytest.raises(TypeError, match="adhesion: "):
        builder.add_link("c", adhesion="much")
