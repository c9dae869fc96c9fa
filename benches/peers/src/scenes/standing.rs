//! Structures of thin parts that stand by friction.

use super::{large, scene};
use crate::scene::{Body, Scene, Shape};

pub(super) fn all() -> Vec<Scene> {
    vec![cards(3), cards(4), cards(5), kapla_tower(30), large(kapla_tower(100)), masonry()]
}

/// Returns storeys of cards of 0.4 × 0.25 × 0.002 m: pairs that lean on each other by 25°, under
/// level cards from top to top. Friction 0.7.
fn cards(storeys: usize) -> Scene {
    let (half, thin, depth, lean) = (0.2, 0.001, 0.25, 25_f64.to_radians());
    let (s, c) = lean.sin_cos();
    // distances from the middle of a card to its ends, sideways and in height
    let (aside, high) = (half * s + thin * c, half * c + thin * s);
    let spacing = 4.0 * aside + 0.002;
    let mut bodies = Vec::new();
    for storey in 0..storeys {
        let pairs = storeys - storey;
        let floor = storey as f64 * (2.0 * high + 2.0 * thin);
        let top = |i: usize| (i as f64 - 0.5 * (pairs - 1) as f64) * spacing;
        for i in 0..pairs {
            for side in [-1.0, 1.0] {
                let card =
                    Body::new(Shape::Box([2.0 * thin, depth, 2.0 * half]), [top(i) + side * aside, 0.0, floor + high]);
                bodies.push(Body { turn: -side * lean, ..card });
            }
        }
        for i in 1..pairs {
            let center = [0.5 * (top(i - 1) + top(i)), 0.0, floor + 2.0 * high + thin];
            bodies.push(Body::new(Shape::Box([spacing - 0.0005, depth, 2.0 * thin]), center));
        }
    }
    Scene { friction: 0.7, measured: [0.0, 10.0], ..scene(format!("cards-{storeys}"), bodies) }
}

/// Returns a square tower of planks of 120 × 24 × 8 mm on their narrow sides, two in a layer, across
/// those below.
fn kapla_tower(layers: usize) -> Scene {
    let [length, height, width] = [0.12, 0.024, 0.008];
    let plank = |i: usize| {
        let layer = i / 2;
        let offset = (0.5 * length - 0.02) * if i.is_multiple_of(2) { -1.0 } else { 1.0 };
        let z = height * (layer as f64 + 0.5);
        match layer % 2 {
            0 => Body::new(Shape::Box([length, width, height]), [0.0, offset, z]),
            _ => Body::new(Shape::Box([width, length, height]), [offset, 0.0, z]),
        }
    };
    let bodies = (0..2 * layers).map(plank).collect();
    Scene { measured: [0.0, 10.0], ..scene(format!("kapla-tower-{layers}"), bodies) }
}

/// Returns a wall of ten rows of ten bricks of 0.25 × 0.12 × 0.065 m in running bond, with halves at
/// the ends of every other row, and 2 mm between the bricks of a row.
fn masonry() -> Scene {
    let [length, width, height] = [0.25, 0.12, 0.065];
    let joint = 0.002;
    let mut bodies = Vec::new();
    for row in 0..10 {
        let z = height * (row as f64 + 0.5);
        let whole = |i: f64| Body::new(Shape::Box([length, width, height]), [i * (length + joint), 0.0, z]);
        if row % 2 == 0 {
            bodies.extend((0..10).map(|i| whole(i as f64 + 0.5)));
            continue;
        }
        bodies.extend((1..10).map(|i| whole(i as f64)));
        let half = 0.5 * (length - joint);
        let ends = [0.5 * half, 10.0 * (length + joint) - joint - 0.5 * half];
        bodies.extend(ends.map(|x| Body::new(Shape::Box([half, width, height]), [x + 0.5 * joint, 0.0, z])));
    }
    Scene { measured: [0.0, 10.0], ..scene("masonry-10x10".into(), bodies) }
}
