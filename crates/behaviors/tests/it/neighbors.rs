//! The grid gives the bits of brute force.

use crate::Numbers;
use tumble_behaviors::{Flyer, Search, Steering};
use tumble_core::prelude::*;

fn crowd(numbers: &mut Numbers, count: usize, size: f64) -> Vec<Flyer> {
    let one = |_| {
        let velocity = numbers.vector(10.0);
        let mass = 1.0 + 0.5 * numbers.number();
        Flyer { position: numbers.vector(size), velocity, forward: velocity.normalize(), mass }
    };
    (0..count).map(one).collect()
}

fn bits(forces: &[Vec3]) -> Vec<[u64; 3]> {
    forces.iter().map(|f| [f.x.to_bits(), f.y.to_bits(), f.z.to_bits()]).collect()
}

fn check(steering: &Steering, flyers: &[Flyer]) -> usize {
    let [grid, all] = [Search::Grid, Search::BruteForce].map(|search| steering.forces(search, flyers));
    assert_eq!(bits(&grid), bits(&all));
    grid.iter().filter(|force| force.norm() > 0.0).count()
}

#[test]
fn random_crowds_have_the_same_bits() {
    let mut numbers = Numbers(1);
    for size in [1.0, 8.0, 30.0, 100.0, 3000.0] {
        for reach in [0.3, 5.0, 12.0, 1e4] {
            let steering = Steering {
                visibility_distance: reach,
                inner_visibility_distance: 0.5 * reach,
                max_force: 1e3,
                speed_rate: 0.0,
                boundary_stiffness: 0.0,
                ..Steering::default()
            };
            let pushed = check(&steering, &crowd(&mut numbers, 300, size));
            assert!(reach < 1e4 || pushed == 300, "each sees another one");
        }
    }
}

#[test]
fn boids_on_the_faces_of_cells_have_the_same_bits() {
    let steering = Steering { visibility_distance: 1.0, inner_visibility_distance: 1.0, ..Steering::default() };
    let mut flyers = Vec::new();
    for k in 0..1000 {
        let place = |k: i32| f64::from(k % 10 - 5) * [1.0, 1.0 - 1e-16, 1.0 + 1e-6, 0.5][(k / 3) as usize % 4];
        let position = Vec3::new(place(k), place(k / 10), place(k / 100));
        flyers.push(Flyer { position, velocity: Vec3::x(), forward: Vec3::y(), mass: 1.0 });
    }
    assert!(check(&steering, &flyers) > 900);
}

#[test]
fn boids_very_far_out_have_the_same_bits() {
    let mut numbers = Numbers(7);
    let steering = Steering { boundary_stiffness: 0.0, ..Steering::default() };
    for far in [1e7, 1e10, 1e15, 1e300] {
        let mut flyers = crowd(&mut numbers, 100, 6.0);
        flyers.iter_mut().for_each(|flyer| flyer.position += Vec3::new(far, -far, 0.5 * far));
        check(&steering, &flyers);
    }
    assert!(steering.forces(Search::Grid, &[]).is_empty());
}

/// The sums of the head of `steering.rs`, term by term.
fn plain(steering: &Steering, flyers: &[Flyer], me: usize) -> Vec3 {
    let own = &flyers[me];
    let fade = |s: f64, inner: f64, outer: f64| ((outer - s) / (outer - inner)).clamp(0.0, 1.0);
    let others = flyers.iter().enumerate().filter(|(other, _)| *other != me).map(|(_, other)| other);
    let [mut a, mut v, mut c] = [Vec3::zeros(); 3];
    for other in others {
        let (d, u) = ((other.position - own.position).norm(), (other.position - own.position).normalize());
        let angle = u.dot(&own.forward).clamp(-1.0, 1.0).acos();
        let w = fade(d, steering.inner_visibility_distance, steering.visibility_distance)
            * fade(angle, steering.inner_visibility_angle, steering.visibility_angle);
        a -= w * u / d;
        v += w * (other.velocity - own.velocity);
        c += w * d * u;
    }
    own.mass * (steering.avoidance * a + steering.matching * v + steering.clustering * c)
}

#[test]
fn the_forces_are_the_sums_of_the_appendix() {
    let mut numbers = Numbers(11);
    let free = Steering { max_force: 1e9, speed_rate: 0.0, boundary_stiffness: 0.0, ..Steering::default() };
    let wide = Steering { visibility_angle: 4.0, inner_visibility_angle: 3.5, ..free };
    for (steering, count) in [(free, 400), (wide, 57), (free, 1), (free, 9)] {
        let flyers = crowd(&mut numbers, count, 12.0);
        for (me, force) in steering.forces(Search::Grid, &flyers).iter().enumerate() {
            let expected = plain(&steering, &flyers, me);
            assert!((force - expected).norm() < 1e-11 * (1.0 + expected.norm()), "{force} is not {expected}");
        }
    }
}
