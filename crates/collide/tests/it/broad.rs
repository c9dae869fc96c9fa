//! Sweep and prune against brute force.

use crate::rng::Rng;
use tumble_collide::{Aabb, BroadPhase, BruteForce, SweepAndPrune, Vec3};

#[test]
fn sweep_and_prune_equals_brute_force_over_random_walks() {
    let mut total = 0;
    for seed in 0..20 {
        let mut rng = Rng::new(seed);
        let mut sweep = SweepAndPrune::default();
        let mut world: Vec<(Aabb, bool)> = Vec::new();
        let (mut expected, mut found) = (Vec::new(), Vec::new());
        for _ in 0..150 {
            change(&mut rng, &mut world);
            let boxes: Vec<Aabb> = world.iter().map(|w| w.0).collect();
            let moving: Vec<bool> = world.iter().map(|w| w.1).collect();
            BruteForce.pairs(&boxes, &moving, &mut expected);
            sweep.pairs(&boxes, &moving, &mut found);
            assert_eq!(expected, found, "seed {seed}");
            total += found.len();
        }
    }
    assert!(total > 10_000, "only {total} overlaps were met");
}

fn change(rng: &mut Rng, world: &mut Vec<(Aabb, bool)>) {
    for (b, _) in world.iter_mut() {
        let step = rng.vec(0.2);
        b.min += step;
        b.max += step;
    }
    for _ in 0..rng.below(4) {
        let (center, half) = (rng.vec(4.0), rng.vec(1.0).abs());
        let mut b = Aabb { min: center - half, max: center + half };
        if rng.below(15) == 0 {
            b = Aabb {
                min: Vec3::repeat(f64::NEG_INFINITY),
                max: Vec3::new(f64::INFINITY, f64::INFINITY, rng.vec(3.0).x),
            };
        }
        let place = rng.below(world.len() + 1);
        world.insert(place, (b, rng.below(3) > 0));
    }
    if !world.is_empty() && rng.below(3) == 0 {
        let gone = rng.below(world.len());
        world.swap_remove(gone);
    }
}
