"""Intersection tests written in Python."""

import pickle

import numpy as np
import pytest

import tumble


class Torus(tumble.Intersect):
    """A ring about z with a tube, against spheres."""

    def __init__(self, ring, tube):
        self.ring, self.tube = ring, tube

    def contacts(self, own, other, margin):
        if not isinstance(other.shape, tumble.Sphere):
            return None
        radius = other.shape.bounding_radius
        local = own.rotation.T @ (other.position - own.position)
        flat = np.array([local[0], local[1], 0.0])
        away = np.linalg.norm(flat)
        if away < 1e-9:
            return []
        line = local - self.ring * flat / away
        distance = np.linalg.norm(line)
        gap = distance - self.tube - radius
        if gap > margin:
            return []
        normal = own.rotation @ (-line / distance)  # from the sphere to the ring
        point = other.position + normal * (radius + gap / 2)
        return [(point, normal, gap, 0, self.tube, radius)]


def ring_and_ball(x, **settings):
    world = tumble.World(**settings)
    world.add_static("ring", tumble.Cylinder(1.3, 0.6), intersect=Torus(1.0, 0.3))
    ball = world.add_rigid("ball", tumble.Sphere(0.2), mass=1, position=(x, 0, 2), angular_velocity=(0, 0, 0))
    return world, ball


def test_a_ball_falls_through_the_hole_and_lands_on_the_tube():
    world, ball = ring_and_ball(0.0)
    world.step(240)
    assert ball.position[2] == pytest.approx(2 - 9.81 / 2, abs=0.03)  # free fall through the hole
    world, ball = ring_and_ball(1.0)
    world.step(480)
    assert ball.position == pytest.approx([1, 0, 0.5], abs=1e-3)  # on the top of the tube: 0.3 + 0.2
    (contact,) = world.contacts
    assert np.abs(contact["force"][2]) == pytest.approx(9.81, rel=1e-6)


def test_copies_have_the_test_and_the_same_bits():
    world, ball = ring_and_ball(0.9)
    world.step(150)
    copies = [pickle.loads(pickle.dumps(world)), world.fork()]
    world.step(150)
    for copy in copies:
        copy.step(150)
        assert (copy.state == world.state).all()
    assert ball.position[2] > -5
    with pytest.raises(tumble.InvalidValueError, match="intersection tests"):
        world.model()
    world.remove("ring")
    world.step()


class Filter(tumble.Intersect):
    """Lets the left board, and all that is called ghost, pass."""

    def contacts(self, own, other, margin):
        assert own.name == "shelf" and own.link == "lower" and other.link is None
        return [] if own.shape_name == "left" or other.name.startswith("ghost") else None


def shelf_and_balls():
    board = tumble.Box((1, 1, 0.1))
    builder = tumble.ArticulationBuilder("shelf")
    builder.add_link("lower", joint="fixed", position=(0, 0, 0.5))
    builder.add_shape("lower", board.named("left"), position=(-0.5, 0, 0))
    builder.add_shape("lower", board.named("right"), position=(0.5, 0, 0))
    world = tumble.World()
    shelf = world.add_articulation(builder)
    for name, x in (("left ball", -0.5), ("right ball", 0.3), ("ghost", 0.7)):
        world.add_rigid(name, tumble.Sphere(0.1), mass=1, position=(x, 0, 1))
    return world, shelf


def held(world):
    world.step(240)
    return [bool(world[name].position[2] > 0.6) for name in ("left ball", "right ball", "ghost")]


def test_a_link_or_one_of_its_shapes_has_a_filter():
    world, shelf = shelf_and_balls()
    assert held(world) == [True, True, True]
    for shape, expected in ((None, [False, True, False]), ("right", [True, True, False]), (0, [False, True, True])):
        world, shelf = shelf_and_balls()
        shelf.set_intersect("lower", Filter(), shape)
        copies = [world.fork(), pickle.loads(pickle.dumps(world))]
        assert held(world) == expected
        for copy in copies:
            copy.step(240)
            assert (copy.state == world.state).all()
    world, shelf = shelf_and_balls()
    shelf.set_intersect("lower", Filter())
    shelf.set_intersect("lower", None, "left")
    assert held(world.fork()) == held(world) == [True, True, False]
    shelf.set_intersect("lower", None)
    world.model()


def test_filters_of_links_that_are_not_there_are_refused():
    world, shelf = shelf_and_balls()
    with pytest.raises(tumble.UnknownNameError, match="middle"):
        shelf.set_intersect("middle", Filter())
    with pytest.raises(tumble.InvalidValueError, match="no shape 2; it has 2"):
        shelf.set_intersect("lower", Filter(), 2)
    with pytest.raises(TypeError, match="Intersect"):
        shelf.set_intersect("lower", 3)
    shelf.set_intersect("lower", Wrong(KeyError("here")))
    with pytest.raises(KeyError, match="here"):
        world.step(240)


class Wrong(tumble.Intersect):
    def __init__(self, answer):
        self.answer = answer

    def contacts(self, own, other, margin):
        if isinstance(self.answer, Exception):
            raise self.answer
        return self.answer


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        ([(1, 2)], "3 to 6 entries"),
        ([((0, 0, 0), (0, 0, 0), 0.1)], "without length"),
        ([((0, 0, 0), (0, 0, 1), float("nan"))], "not finite"),
        ([3], "contact 0 is 3; expected a tuple"),
    ],
)
def test_wrong_contacts_are_errors_and_nothing_moves(answer, message):
    world = tumble.World()
    world.add_static("a", tumble.Sphere(1), intersect=Wrong(answer))
    ball = world.add_rigid("b", tumble.Sphere(1), mass=1, position=(0, 0, 1.5))
    with pytest.raises(tumble.InvalidValueError, match=message):
        world.step()
    assert world.frame == 0 and ball.position[2] == 1.5


def test_exceptions_of_a_test_are_raised_and_none_means_the_shapes():
    world = tumble.World()
    world.add_static("a", tumble.Sphere(1), intersect=Wrong(KeyError("here")))
    world.add_rigid("b", tumble.Sphere(1), mass=1, position=(0, 0, 1.5))
    with pytest.raises(KeyError, match="here"):
        world.step()
    plain, tested = tumble.World(), tumble.World()
    plain.add_static("a", tumble.Sphere(1))
    tested.add_static("a", tumble.Sphere(1), intersect=Wrong(None))
    for world in (plain, tested):
        world.add_rigid("b", tumble.Sphere(1), mass=1, position=(0.1, 0, 2.1))
        world.step(200)
    assert (plain.state == tested.state).all()
    with pytest.raises(TypeError, match="tumble.Intersect"):
        tested.add_static("c", tumble.Sphere(1), intersect=3)
    assert "c" not in tested.bodies
