//! Edges between shapes of which a body meets only some: what it passes through covers no edge, and what it meets on both
//! sides has none.

use crate::common::*;
use tumble_core::collide::{CompoundPart, CompoundShape, Pose, Quat, Shape, TreeSettings, TriMesh, Vec3};
use tumble_core::*;

fn group(n: u8) -> CollisionGroup {
    CollisionGroup::new(n).unwrap()
}

fn of_group(n: u8) -> ShapeFilter {
    ShapeFilter { group: group(n), ..ShapeFilter::default() }
}

fn smooth() -> Material {
    Material { friction: 0.0, restitution: 0.0, ..Material::default() }
}

/// How the halves of a floor are made.
#[derive(Clone, Copy, Debug)]
enum Make {
    Box,
    Hull,
    Mesh,
}

impl Make {
    fn shape(self, size: Vec3) -> Shape {
        match self {
            Make::Box => Shape::cuboid(size).unwrap(),
            Make::Hull => Shape::convex_hull(&TriMesh::cuboid(size).vertices).unwrap(),
            Make::Mesh => Shape::mesh(TriMesh::cuboid(size), &TreeSettings::octree()).unwrap(),
        }
    }
}

const MAKES: [Make; 3] = [Make::Box, Make::Hull, Make::Mesh];

/// A floor of two halves that meet at x = 0, z = 0; its left half is in group 1.
#[derive(Clone, Copy, Debug)]
enum Halves {
    /// One body with a filter of its left shape.
    Shapes,
    /// One body with a material of its left shape, which the ball ignores.
    Materials,
    /// Two bodies.
    Bodies,
    /// Two bodies of two shapes, of which the lower ones have filters.
    Compounds,
}

const SIZE: Vec3 = Vec3::new(1.0, 1.0, 0.2);
/// Material that the ball ignores.
const IGNORED: u32 = 7;

fn apart() -> PairMaterial {
    PairMaterial { collides: Some(false), ..PairMaterial::default() }
}

fn add_floor(world: &mut World, halves: Halves, make: Make, sides: &[f64]) {
    let at = |side: f64| Pose::translation(0.5 * side, 0.0, -0.1);
    let left = |side: f64| if side < 0.0 { 1 } else { 0 };
    match halves {
        Halves::Shapes | Halves::Materials => {
            let parts = sides.iter().map(|side| CompoundPart::new(make.shape(SIZE), at(*side))).collect();
            let mut body = RigidBody::fixed(Shape::compound(parts).unwrap()).with_material(smooth());
            for (n, _) in sides.iter().enumerate().filter(|(_, side)| **side < 0.0) {
                body = match halves {
                    Halves::Materials => body.with_shape_material(n, Material { id: IGNORED, ..smooth() }),
                    _ => body.with_shape_filter(n, of_group(1)),
                };
            }
            world.add_static(body).unwrap();
        }
        Halves::Bodies => {
            for side in sides {
                let body = RigidBody::fixed(make.shape(SIZE)).with_material(smooth()).with_pose(at(*side));
                world.add_static(body.with_groups(group(left(*side)), u64::MAX)).unwrap();
            }
        }
        Halves::Compounds => {
            for side in sides {
                let low = CompoundPart::new(make.shape(SIZE), Pose::translation(0.0, 0.0, -1.0));
                let shape =
                    CompoundShape::new(vec![CompoundPart::new(make.shape(SIZE), Pose::identity()), low]).unwrap();
                // the pose of a body is that of its shape's frame
                let body = RigidBody::fixed(Shape::Compound(shape.into())).with_material(smooth()).with_pose(at(*side));
                let body = body.with_groups(group(left(*side)), u64::MAX);
                world.add_static(body.with_shape_filter(1, of_group(5))).unwrap();
            }
        }
    }
}

/// Runs a ball that starts to the left of the edge for a while.
fn ball(world: &mut World, start: Vec3, v: Vec3, mask: u64, seconds: f64) -> Vec<(Vec3, Vec3)> {
    let body = RigidBody::new(sphere(0.1)).with_material(smooth()).with_groups(group(0), mask);
    let id = world.add(body.with_pose(Pose::from_parts(start.into(), Quat::identity())).with_velocity(v)).unwrap();
    world.set_pair_material(PairSide::Material(IGNORED), PairSide::Object(id), apart()).unwrap();
    let mut path = Vec::new();
    while world.time() < seconds {
        world.step().unwrap();
        path.push((position(world, id), velocity(world, id)));
    }
    path
}

/// A ball that passes through the left half strikes the edge of the right one as if the left one were not there, and a ball
/// that slides on the right half falls off its end there.
#[test]
fn what_a_ball_passes_through_covers_no_edge() {
    let mask = !(1 << 1);
    for halves in [Halves::Shapes, Halves::Materials, Halves::Bodies, Halves::Compounds] {
        for make in MAKES {
            for stepper in STEPPERS {
                let cases = [
                    ("against", Vec3::new(-0.3, 0.1, 0.05), Vec3::new(1.0, 0.0, 0.0)),
                    ("below", Vec3::new(-0.3, 0.1, -0.07), Vec3::new(1.0, 0.0, 0.0)),
                    ("off", Vec3::new(0.1, 0.1, 0.1), Vec3::new(-0.5, 0.0, 0.0)),
                ];
                for (name, start, v) in cases {
                    let run = |sides: &[f64]| {
                        let mut world = world(stepper, 1.0 / 240.0);
                        if name != "off" {
                            world = no_gravity(world);
                        }
                        add_floor(&mut world, halves, make, sides);
                        ball(&mut world, start, v, mask, 0.5)
                    };
                    let (with, without) = (run(&[-1.0, 1.0]), run(&[1.0]));
                    let place = format!("{halves:?} {make:?} {stepper} {name}");
                    for (n, ((x, v), (y, w))) in with.iter().zip(&without).enumerate() {
                        assert!(
                            (x - y).norm() < if matches!(make, Make::Box) { 1e-8 } else { 1e-4 },
                            "{place}, step {n}: at {x:?} instead of {y:?}"
                        );
                        assert!(
                            (v - w).norm() < if matches!(make, Make::Box) { 1e-6 } else { 1e-3 },
                            "{place}, step {n}: {v:?} instead of {w:?}"
                        );
                    }
                    let (end, last) = with[with.len() - 1];
                    match name {
                        // the edge takes the velocity along the line to the center, which is 60° from the motion, or 0.04 rad of the
                        // way of a step more
                        "against" => {
                            let n = Vec3::new(-0.75f64.sqrt(), 0.0, 0.5);
                            let after = v - n * n.dot(&v);
                            assert!((last - after).norm() < 4e-2, "{place}: {last:?} instead of {after:?}");
                        }
                        "below" => {
                            assert!(last.norm() < 1e-6 && (end.x + 0.1).abs() < 1e-3, "{place}: {end:?} {last:?}")
                        }
                        _ => assert!(end.z < 0.0, "{place}: {end:?} does not fall"),
                    }
                }
            }
        }
    }
}

/// A runner on the left half alone carries a ball that meets the right half alone: the ball strikes its edge, although the
/// left half, on which the runner slides, covers it.
#[test]
fn a_shape_strikes_what_the_support_of_another_shape_covers() {
    for (make, by_material) in MAKES.into_iter().flat_map(|make| [(make, false), (make, true)]) {
        let run = |gap: f64| {
            let mut world = world("time_stepping", 1.0 / 240.0);
            for (n, x) in [(1, -0.5 - gap), (2, 0.5)] {
                let half = RigidBody::fixed(make.shape(SIZE)).with_material(smooth());
                let half = half.with_pose(Pose::translation(x, 0.0, -0.1)).with_groups(group(n), u64::MAX);
                let half = world.add_static(half).unwrap();
                // the shape with this material ignores this half
                world.set_pair_material(PairSide::Material(u32::from(n)), PairSide::Object(half), apart()).unwrap();
            }
            let at = |x: f64, z: f64| CompoundPart::new(sphere(0.1), Pose::translation(x, 0.0, z));
            let shape = Shape::compound(vec![at(-0.3, 0.1), at(0.0, 0.05)]).unwrap();
            let only = |n: u8| ShapeFilter { mask: 1 << n, ..ShapeFilter::default() };
            let body = RigidBody::new(shape).with_mass(1.0).with_material(smooth());
            let of_material = |id: u32| Material { id, ..smooth() };
            let body = match by_material {
                true => body.with_shape_material(0, of_material(2)).with_shape_material(1, of_material(1)),
                false => body.with_shape_filter(0, only(1)).with_shape_filter(1, only(2)),
            };
            let body = body
                .with_locked(LockedAxes { rotation: [true; 3], ..LockedAxes::default() })
                .with_pose(Pose::translation(-0.3, 0.0, 0.0));
            let id = world.add(body.with_velocity(Vec3::new(1.0, 0.0, 0.0))).unwrap();
            let mut path = Vec::new();
            while world.time() < 0.4 {
                world.step().unwrap();
                path.push((position(&world, id), velocity(&world, id)));
            }
            path
        };
        let (flush, apart) = (run(0.0), run(1e-3));
        for (n, ((x, v), (y, w))) in flush.iter().zip(&apart).enumerate() {
            assert!(
                (x - y).norm() < 1e-9 && (v - w).norm() < 1e-7,
                "{make:?} {by_material}, step {n}: {x:?} instead of {y:?}"
            );
        }
        assert!(flush[flush.len() - 1].1.x < 0.3, "{make:?} {by_material}: {:?}", flush[flush.len() - 1]);
    }
}

/// Bodies with a shape of its own filter slide and roll over flush tiles that have one too as over a half-space.
#[test]
fn filtered_shapes_make_no_ghost_collisions_on_flush_tiles() {
    let movers: [(&str, Shape, bool); 3] =
        [("ball", sphere(0.1), true), ("box", cube(0.2), false), ("capsule", Shape::capsule(0.1, 0.2).unwrap(), false)];
    for make in MAKES {
        for (name, shape, rolls) in &movers {
            // friction of a ball that slips magnifies the rounding of contacts with hulls and meshes
            let rolls = *rolls && matches!(make, Make::Box);
            for (tiles_filtered, mover_filtered) in [(true, false), (false, true), (true, true)] {
                let run = |tiles: bool| {
                    let mut world = world("time_stepping", 1.0 / 240.0);
                    let material = if rolls { Material { friction: 0.5, ..smooth() } } else { smooth() };
                    if tiles {
                        for k in 0..16 {
                            let pose =
                                Pose::translation(0.25 * f64::from(k % 8) - 0.4, 0.6 * f64::from(k / 8) - 0.3, -0.1);
                            let tile = make.shape(Vec3::new(0.25, 0.6, 0.2));
                            let low = CompoundPart::new(tile.clone(), Pose::translation(0.0, 0.0, 0.1));
                            let both =
                                Shape::compound(vec![CompoundPart::new(tile.clone(), Pose::identity()), low]).unwrap();
                            let body =
                                RigidBody::fixed(if tiles_filtered { both } else { tile }).with_material(material);
                            let body = body.with_pose(pose);
                            // a shape that stands above the floor, and that nothing meets
                            let body = if tiles_filtered {
                                body.with_shape_filter(1, ShapeFilter { mask: 0, ..of_group(7) })
                            } else {
                                body
                            };
                            world.add_static(body).unwrap();
                        }
                    } else {
                        world.add_static(RigidBody::fixed(Shape::half_space()).with_material(material)).unwrap();
                    }
                    let part = |z: f64| CompoundPart::new(shape.clone(), Pose::translation(0.0, 0.0, z));
                    // the ghost is as heavy above the middle as another one below it, so the center stays
                    let own = Shape::compound(vec![part(0.0), part(0.05), part(-0.05)]).unwrap();
                    let mut body = RigidBody::new(if mover_filtered { own } else { shape.clone() }).with_mass(1.0);
                    if mover_filtered {
                        for n in [1, 2] {
                            body = body.with_shape_filter(n, ShapeFilter { mask: 0, ..ShapeFilter::default() });
                        }
                    }
                    let spin = if rolls { Vec3::y() * 20.0 } else { Vec3::zeros() };
                    let body = body.with_material(material).with_pose(Pose::translation(0.013, 0.007, 0.1));
                    let body = body.with_velocity(Vec3::new(2.0, 0.4, 0.0)).with_angular_velocity(spin);
                    let id = world.add(body).unwrap();
                    let mut path = Vec::new();
                    while world.time() < 0.4 {
                        world.step().unwrap();
                        path.push((position(&world, id), velocity(&world, id)));
                    }
                    path
                };
                let (on_tiles, on_plane) = (run(true), run(false));
                // a seam takes 5e-3 of the speed
                let bound = if matches!(make, Make::Box) { 1e-6 } else { 1e-4 };
                for (n, ((x, v), (y, w))) in on_tiles.iter().zip(&on_plane).enumerate() {
                    let place = format!(
                        "{make:?} {name}, filters of tiles {tiles_filtered}, of the mover {mover_filtered}, {x:?} {y:?}"
                    );
                    assert!(
                        (v - w).norm() / 2.0 < bound && (x - y).norm() < bound,
                        "{place}, step {n}: {v:?} instead of {w:?}"
                    );
                }
            }
        }
    }
}

/// Two compounds that both have filters: a ball with a ghost inside, and a plate of flush tiles of two groups, both of which the
/// ball meets and one the ghost. Whichever of them moves, it moves as without any filter.
#[test]
fn seams_between_filters_of_one_body_are_hidden_from_a_body_with_filters_too() {
    let tiles = (0..8).map(|k| {
        let pose = Pose::translation(0.25 * f64::from(k) - 0.4, 0.0, -0.1);
        CompoundPart::new(Shape::cuboid(Vec3::new(0.25, 1.0, 0.2)).unwrap(), pose)
    });
    let plate = Shape::compound(tiles.collect()).unwrap();
    let inside = CompoundPart::new(sphere(0.03), Pose::identity());
    let ball = Shape::compound(vec![CompoundPart::new(sphere(0.1), Pose::identity()), inside]).unwrap();
    for plate_moves in [false, true] {
        let run = |filtered: bool| {
            let mut world = no_gravity(world("time_stepping", 1.0 / 240.0));
            let mut plate = RigidBody::new(plate.clone()).with_name("plate").with_mass(1.0).with_material(smooth());
            let mut ball = RigidBody::new(ball.clone()).with_name("ball").with_mass(1.0).with_material(smooth());
            if filtered {
                for k in 0..8 {
                    plate = plate.with_shape_filter(k, of_group(1 + (k % 2) as u8));
                }
                ball = ball.with_shape_filter(1, ShapeFilter { mask: 1 << 1, ..ShapeFilter::default() });
            }
            let (v, press) = (Vec3::new(2.0, 0.3, 0.0), Vec3::new(0.0, 0.0, -9.81));
            ball = ball.with_pose(Pose::translation(-0.3, 0.01, 0.1));
            let (moving, push) = if plate_moves {
                world.add_static(ball).unwrap();
                let locked = LockedAxes { rotation: [true; 3], ..LockedAxes::default() };
                (world.add(plate.with_locked(locked).with_velocity(-v)).unwrap(), -press)
            } else {
                world.add_static(plate).unwrap();
                (world.add(ball.with_velocity(v)).unwrap(), press)
            };
            let mut path = Vec::new();
            while world.time() < 0.4 {
                world.apply_force(moving, 0, push, &position(&world, moving)).unwrap();
                world.step().unwrap();
                path.push((position(&world, moving), velocity(&world, moving)));
            }
            path
        };
        let (with, without) = (run(true), run(false));
        for (n, ((x, v), (y, w))) in with.iter().zip(&without).enumerate() {
            let place = format!("the plate moves: {plate_moves}, step {n}");
            assert!((x - y).norm() < 1e-9 && (v - w).norm() < 1e-9, "{place}: {v:?} instead of {w:?}");
        }
        let (_, last) = with[with.len() - 1];
        let along = if plate_moves { -last } else { last };
        assert!((along.x - 2.0).abs() < 1e-6 && along.z.abs() < 1e-6, "the plate moves: {plate_moves}, {last:?}");
    }
}
