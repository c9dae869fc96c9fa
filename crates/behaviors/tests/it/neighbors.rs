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
