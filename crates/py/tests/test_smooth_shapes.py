"""Ellipsoids, cones and rounded shapes: sizes, masses, pickling, recordings, queries and scene files."""

import math
import pickle

import numpy as np
import pytest

import tumble

SHAPES = [
    tumble.Ellipsoid((0.2, 0.3, 0.4)),
    tumble.Cone(radius=0.1, height=0.3),
    tumble.Box((0.2, 0.3, 0.4), rounding=0.05),
    tumble.Cylinder(0.1, 0.4, rounding=0.03),
]
LOWEST = [0.2, 0.075, 0.2, 0.2]


def test_volumes_are_closed_forms():
    ellipsoid, cone, box, cylinder = SHAPES
    assert ellipsoid.volume == pytest.approx(math.pi / 6 * 0.2 * 0.3 * 0.4)
    assert cone.volume == pytest.approx(math.pi * 0.1**2 * 0.3 / 3)
    a, r = np.array([0.05, 0.1, 0.15]), 0.05
    steiner = 8 * a.prod() + 8 * r * (a[0] * a[1] + a[1] * a[2] + a[2] * a[0]) + 2 * math.pi * r**2 * a.sum()
    assert box.volume == pytest.approx(steiner + 4 / 3 * math.pi * r**3)
    assert 0.9 * tumble.Cylinder(0.1, 0.4).volume < cylinder.volume < tumble.Cylinder(0.1, 0.4).volume


@pytest.mark.parametrize("shape", SHAPES)
def test_a_pickled_shape_has_the_same_class_and_words(shape):
    copy = pickle.loads(pickle.dumps(shape))
    assert type(copy) is type(shape) and repr(copy) == repr(shape) and copy.volume == shape.volume
    again = eval(repr(shape), vars(tumble))
    assert again.volume == shape.volume


def scene():
    world = tumble.World()
    world.add_static("ground", tumble.Plane())
    for k, (shape, low) in enumerate(zip(SHAPES, LOWEST, strict=True)):
        world.add_rigid(f"b{k}", shape, density=500, position=(k, 0, low + 0.02))
    return world


def test_they_fall_onto_the_ground_and_a_pickled_world_goes_on_alike():
    world = scene()
    world.step(60)
    copy = pickle.loads(pickle.dumps(world))
    world.step(60)
    copy.step(60)
    assert world.state.tobytes() == copy.state.tobytes()
    for k, low in enumerate(LOWEST):
        assert world[f"b{k}"].position[2] == pytest.approx(low, abs=2e-3)


def test_rays_hit_their_tops():
    world = scene()
    tops = [0.4, 0.3, 0.4, 0.4]
    origins = [(k, 0, 2) for k in range(4)]
    found = world.cast_rays(origins, np.tile((0, 0, -1.0), (4, 1)))["distance"]
    np.testing.assert_allclose(found, [2 - top - 0.02 for top in tops], atol=1e-9)


def test_a_recording_has_them(tmp_path):
    path = tmp_path / "a.mcap"
    world = scene()
    with tumble.Recorder(path) as recorder:
        for _ in range(3):
            world.step()
            recorder.frame(world)
    run = tumble.read(path)
    assert len(run) == 3 and run.names == ["ground", "b0", "b1", "b2", "b3"]
    assert run.position("b1")[-1] == pytest.approx(world["b1"].position)


def test_a_scene_file_has_the_same_shapes(tmp_path):
    specs = [
        '{ type = "ellipsoid", size_m = [0.2, 0.3, 0.4] }',
        '{ type = "cone", radius_m = 0.1, height_m = 0.3 }',
        '{ type = "box", size_m = [0.2, 0.3, 0.4], rounding_m = 0.05 }',
        '{ type = "cylinder", radius_m = 0.1, length_m = 0.4, rounding_m = 0.03 }',
    ]
    body = '[[body]]\nname = "b{}"\nshape = {}\ndensity_kg_per_m3 = 500\nposition_m = [{}, 0, {}]\n'
    text = "".join(body.format(k, spec, k, low + 0.02) for k, (spec, low) in enumerate(zip(specs, LOWEST, strict=True)))
    path = tmp_path / "scene.toml"
    path.write_text(text)
    world = tumble.World.load(path)
    for k, shape in enumerate(SHAPES):
        assert world[f"b{k}"].mass == 500 * shape.volume


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: tumble.Ellipsoid((0.1, 0, 0.1)), "above 0"),
        (lambda: tumble.Ellipsoid((1, 1, 1e-7)), "100,000 times"),
        (lambda: tumble.Cone(0.1, -1), "above 0"),
        (lambda: tumble.Box(1, rounding=0.5), "less than 0.5 m"),
        (lambda: tumble.Cylinder(0.1, 1, rounding=-0.01), "less than 0.1 m"),
    ],
)
def test_wrong_sizes_are_value_errors(make, text):
    with pytest.raises(ValueError, match=text):
        make()
