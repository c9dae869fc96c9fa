//! Towers and walls at rest: every solve converges and nothing moves.

use crate::common::{cube, ground, position, world};
use tumble_collide::{Pose, Quat, Shape, Vec3};
use tumble_core::{Material, ObjectId, RigidBody, STEPPERS, World};

/// Steps for `seconds`. Asserts that every solve converges; returns the largest displacement of any
/// body, m.
fn moved(world: &mut World, bodies: &[ObjectId], seconds: f64) -> f64 {
    let start: Vec<Vec3> = bodies.iter().map(|b| position(world, *b)).collect();
    for _ in 0..(seconds / world.settings().dt).round() as usize {
        let report = world.step().unwrap();
        assert!(report.unconverged == 0 && report.residual <= 1e-8, "{report:?}");
    }
    bodies.iter().zip(start).map(|(b, start)| (position(world, *b) - start).norm()).fold(0.0, f64::max)
}

fn add(world: &mut World, shape: Shape, at: [f64; 3]) -> ObjectId {
    let body = RigidBody::new(shape).with_material(Material::default());
    world.add(body.with_pose(Pose::translation(at[0], at[1], at[2]))).unwrap()
}

/// Towers of 10, 30 and 100 equal boxes for two seconds.
#[test]
fn towers_stand_still() {
    for count in [10, 30, 100] {
        let mut world = world("time_stepping", 1.0 / 60.0);
        ground(&mut world, 0.0, 0.5);
        let bodies: Vec<_> =
            (0..count).map(|i| add(&mut world, cube(0.4), [0.0, 0.0, 0.4 * (i as f64 + 0.5)])).collect();
        let moved = moved(&mut world, &bodies, 2.0);
        assert!(moved < 1e-6, "{count} boxes: {moved} m");
    }
}

/// A wall of 210 boxes, 20 rows, 20 mm between neighbors, for a second.
#[test]
fn a_wall_of_210_boxes_stands_still() {
    let mut world = world("time_stepping", 1.0 / 60.0);
    ground(&mut world, 0.0, 0.5);
    let mut bodies = Vec::new();
    for row in 0..20 {
        for i in 0..20 - row {
            let x = (i as f64 - 0.5 * (19 - row) as f64) * 0.42;
            bodies.push(add(&mut world, cube(0.4), [x, 0.0, 0.4 * (row as f64 + 0.5)]));
        }
    }
    let moved = moved(&mut world, &bodies, 1.0);
    assert!(moved < 1e-6, "{moved} m");
}

/// Sixteen towers of twelve boxes of various sizes at 240 Hz.
#[test]
fn towers_of_various_boxes_stand_still() {
    let mut world = world("time_stepping", 1.0 / 240.0);
    ground(&mut world, 0.0, 0.5);
    let mut bodies = Vec::new();
    for tower in 0..16 {
        let mut height = 0.0;
        for i in 0..12 {
            let size = |k: usize| 0.08 + 0.12 * ((tower * 131 + i * 37 + k * 17) % 101) as f64 / 100.0;
            let size = Vec3::new(size(0), size(1), size(2));
            bodies.push(add(&mut world, Shape::cuboid(size).unwrap(), [tower as f64, 0.0, height + 0.5 * size.z]));
            height += size.z;
        }
    }
    let moved = moved(&mut world, &bodies, 0.5);
    assert!(moved < 1e-6, "{moved} m");
}

/// Fifty boxes of various sizes fall into a bin and come to rest.
#[test]
fn boxes_that_fall_into_a_bin_come_to_rest() {
    let mut world = world("time_stepping", 1.0 / 60.0);
    ground(&mut world, 0.0, 0.5);
    let size = |i: usize, k: usize| 0.08 + 0.12 * ((i * 37 + k * 53) % 101) as f64 / 100.0;
    let place = |i: usize| -0.45 + 0.3 * (i % 4) as f64;
    let bodies: Vec<_> = (0..48)
        .map(|i| {
            let shape = Shape::cuboid(Vec3::new(size(i, 0), size(i, 1), size(i, 2))).unwrap();
            add(&mut world, shape, [place(i), place(i / 4), 0.2 + 0.325 * (i / 16) as f64])
        })
        .collect();
    for _ in 0..120 {
        world.step().unwrap();
        assert!(world.report().max_penetration < 1e-6, "{:?}", world.report());
    }
    assert!(moved(&mut world, &bodies, 1.0) < 1e-6);
}

/// A house of cards of 0.4 × 0.25 m × 2 mm: pairs that lean on each other by 25° under level cards, `storeys` high.
fn house_of_cards(stepper: &str, storeys: usize) -> (World, Vec<ObjectId>) {
    let (half, thin, depth, lean) = (0.2, 0.001, 0.25, 25_f64.to_radians());
    let (s, c) = lean.sin_cos();
    // distances from the middle of a card to its ends, sideways and in height
    let (aside, high) = (half * s + thin * c, half * c + thin * s);
    let spacing = 4.0 * aside + 0.002;
    let mut world = world(stepper, 1.0 / 60.0);
    let material = Material { friction: 0.7, ..Material::default() };
    world.add(RigidBody::fixed(Shape::half_space()).with_material(material)).unwrap();
    let mut bodies = Vec::new();
    let mut card = |size: Vec3, at: Vec3, turn: f64| {
        let pose = Pose::from_parts(at.into(), Quat::from_axis_angle(&Vec3::y_axis(), turn));
        let body = RigidBody::new(Shape::cuboid(size).unwrap()).with_material(material);
        bodies.push(world.add(body.with_pose(pose)).unwrap());
    };
    for storey in 0..storeys {
        let pairs = storeys - storey;
        let floor = storey as f64 * (2.0 * high + 2.0 * thin);
        let top = |i: usize| (i as f64 - 0.5 * (pairs - 1) as f64) * spacing;
        for (i, side) in (0..pairs).flat_map(|i| [(i, -1.0), (i, 1.0)]) {
            let at = Vec3::new(top(i) + side * aside, 0.0, floor + high);
            card(Vec3::new(2.0 * thin, depth, 2.0 * half), at, -side * lean);
        }
        for i in 1..pairs {
            let at = Vec3::new(0.5 * (top(i - 1) + top(i)), 0.0, floor + 2.0 * high + thin);
            card(Vec3::new(spacing - 0.0005, depth, 2.0 * thin), at, 0.0);
        }
    }
    (world, bodies)
}

/// Houses of cards of three, four and five storeys for two seconds.
#[test]
fn houses_of_cards_stand_still() {
    for (stepper, storeys) in STEPPERS.into_iter().flat_map(|stepper| [3, 4, 5].map(|storeys| (stepper, storeys))) {
        let (mut world, bodies) = house_of_cards(stepper, storeys);
        let moved = moved(&mut world, &bodies, 2.0);
        assert!(moved < 1e-6, "{stepper}, {storeys} storeys: {moved} m");
    }
}

/// Walls of cubes that touch each other on all sides, 465 of them for a second; with `TUMBLE_SLOW` 5050 of them.
#[test]
fn walls_of_cubes_that_touch_stand_still_full_length() {
    let slow = std::env::var_os("TUMBLE_SLOW").is_some_and(|v| v == "1");
    for base in [30, 100].into_iter().take(if slow { 2 } else { 1 }) {
        let mut world = world("time_stepping", 1.0 / 60.0);
        ground(&mut world, 0.0, 0.5);
        let rows = (0..base).flat_map(|row| (0..base - row).map(move |i| (row, i, base - row)));
        let at = |(row, i, count): (i32, i32, i32)| [i as f64 - 0.5 * (count - 1) as f64, 0.0, row as f64 + 0.5];
        let bodies: Vec<_> = rows.map(|of| add(&mut world, cube(1.0), at(of))).collect();
        let moved = moved(&mut world, &bodies, 1.0);
        assert!(moved < 1e-6, "{base} in the lowest row: {moved} m");
    }
}
