//! Sweep and prune against brute force.

use crate::rng::Rng;
use tumble_collide::{Aabb, BroadPhase, BruteForce, SweepAndPrune, Vec3};

/// Both broad phases with the same operations.
#[derive(Default)]
struct Both {
    sweep: SweepAndPrune,
    brute: BruteForce,
    /// Handles in both, box, moving.
    stored: Vec<(u32, u32, Aabb, bool)>,
}

impl Both {
    fn insert(&mut self, bounds: Aabb, moving: bool) {
        self.stored.push((self.sweep.insert(&bounds, moving), self.brute.insert(&bounds, moving), bounds, moving));
    }

    fn set(&mut self, n: usize, bounds: Aabb, moving: bool) {
        let stored = &mut self.stored[n];
        (stored.2, stored.3) = (bounds, moving);
        self.sweep.set(stored.0, &bounds, moving);
        self.brute.set(stored.1, &bounds, moving);
    }

    fn remove(&mut self, n: usize) {
        let (here, there, ..) = self.stored.swap_remove(n);
        self.sweep.remove(here);
        self.brute.remove(there);
    }

    /// Checks that both return the pairs of the same boxes. Returns their number.
    fn check(&mut self, what: &str) -> usize {
        let (mut found, mut expected) = (Vec::new(), Vec::new());
        self.sweep.pairs(&mut found);
        self.brute.pairs(&mut expected);
        assert!(found.is_sorted() && found.iter().all(|[i, j]| i < j), "{what}: not in order");
        // handles can differ between the two
        let mut names = vec![u32::MAX; self.stored.iter().map(|f| f.1 as usize + 1).max().unwrap_or(0)];
        self.stored.iter().for_each(|f| names[f.1 as usize] = f.0);
        for pair in &mut expected {
            *pair = pair.map(|there| names[there as usize]);
            pair.sort_unstable();
        }
        expected.sort_unstable();
        assert_eq!(found, expected, "{what}");
        found.len()
    }
}

fn box_around(center: Vec3, half: Vec3) -> Aabb {
    Aabb { min: center - half, max: center + half }
}

/// Returns mostly ordinary boxes; sometimes a huge one, a flat one, a point, one with infinite
/// sides, with NaN, or inverted.
fn any_box(rng: &mut Rng, space: f64) -> Aabb {
    let (center, half) = (rng.vec(space), rng.vec(0.5).abs());
    let mut b = box_around(center, half);
    let k = rng.below(3);
    match rng.below(24) {
        0 => b = box_around(center, half * 20.0),
        1 => b = box_around(center, Vec3::new(20.0, 20.0, 0.01)),
        2 => b = box_around(center, Vec3::zeros()),
        3 => (b.min, b.max[k]) = (Vec3::repeat(f64::NEG_INFINITY), f64::INFINITY),
        4 => b.max[k] = f64::INFINITY,
        5 => b.min[k] = f64::NAN,
        6 => b.max[k] = f64::NAN,
        7 => std::mem::swap(&mut b.min, &mut b.max),
        8 => b = box_around(center * 1e300, Vec3::repeat(1e300)),
        9 => b = box_around(center * 1e-300, Vec3::repeat(1e-310)),
        10 => b = Aabb::around([]),
        _ => {}
    }
    b
}

fn moved(b: &Aabb, by: Vec3) -> Aabb {
    Aabb { min: b.min + by, max: b.max + by }
}

#[test]
fn equals_brute_force_over_random_histories() {
    let mut total = 0;
    for seed in 0..40 {
        let mut rng = Rng::new(seed);
        let mut both = Both::default();
        let space = [2.0, 4.0, 8.0][rng.below(3)];
        let most = [3, 30, 300][rng.below(3)];
        for step in 0..120 {
            // calm phases, where few boxes leave their fat boxes, and wild ones
            let speed = [0.0, 0.002, 0.02, 1.0][step / 8 % 4];
            for n in 0..both.stored.len() {
                let (_, _, bounds, moving) = both.stored[n];
                match rng.below(200) {
                    0 => both.set(n, any_box(&mut rng, space), moving),
                    1 => both.set(n, bounds, !moving),
                    _ if moving => both.set(n, moved(&bounds, rng.vec(speed)), moving),
                    _ => {}
                }
            }
            for _ in 0..rng.below(most / 8 + 2) {
                if both.stored.len() < most {
                    let moving = rng.below(3) > 0;
                    both.insert(any_box(&mut rng, space), moving);
                }
            }
            for _ in 0..rng.below(3) {
                if !both.stored.is_empty() {
                    both.remove(rng.below(both.stored.len()));
                }
            }
            if rng.below(60) == 0 {
                (0..both.stored.len()).rev().for_each(|n| both.remove(n));
            }
            if rng.below(4) > 0 {
                total += both.check(&format!("seed {seed}, step {step}"));
            }
        }
    }
    assert!(total > 100_000, "only {total} overlaps were met");
}

#[test]
fn a_crowd_that_travels_is_followed() {
    // cells are split and left behind: 4,000 boxes that move 30 times their own size
    let mut rng = Rng::new(7);
    let mut both = Both::default();
    (0..4000).for_each(|_| both.insert(box_around(rng.vec(4.0), Vec3::repeat(0.15)), true));
    let mut total = 0;
    for step in 0..60 {
        // one in ten at a time: too few for a rebuild
        for n in (0..4000).filter(|n| n % 10 == step % 10) {
            let bounds = moved(&both.stored[n].2, Vec3::new(1.5, 0.2, 0.0));
            both.set(n, bounds, true);
        }
        if step % 6 == 5 {
            total += both.check(&format!("step {step}"));
        }
    }
    assert!(total > 10_000, "only {total} overlaps were met");
}

#[test]
fn many_coincident_boxes_all_overlap() {
    let mut both = Both::default();
    (0..200).for_each(|_| both.insert(box_around(Vec3::zeros(), Vec3::repeat(0.5)), true));
    assert_eq!(both.check("all at once"), 200 * 199 / 2);
    (0..100).for_each(|_| both.insert(box_around(Vec3::repeat(0.1), Vec3::repeat(0.5)), true));
    assert_eq!(both.check("more of them"), 300 * 299 / 2);
    (0..250).for_each(|_| both.remove(0));
    assert_eq!(both.check("fewer"), 50 * 49 / 2);
}

#[test]
fn touching_boxes_are_a_pair_unless_both_are_fixed() {
    let mut both = Both::default();
    for x in 0..100 {
        both.insert(box_around(Vec3::new(f64::from(x), 0.0, 0.0), Vec3::repeat(0.5)), x % 3 == 0);
    }
    // 99 neighbors touch; of them those between x = 1 and 2, 4 and 5 and so on do not move: 33
    assert_eq!(both.check("a row"), 99 - 33);
}

#[test]
fn the_result_does_not_depend_on_the_history() {
    let mut rng = Rng::new(3);
    let mut old = SweepAndPrune::default();
    let mut boxes: Vec<Aabb> = (0..500).map(|_| any_box(&mut rng, 4.0)).collect();
    for b in &boxes {
        old.insert(b, true);
    }
    let (mut found, mut fresh) = (Vec::new(), Vec::new());
    for step in 0..50 {
        for (i, b) in boxes.iter_mut().enumerate() {
            *b = moved(b, rng.vec(0.01));
            old.set(i as u32, b, true);
        }
        old.pairs(&mut found);
        let mut new = SweepAndPrune::default();
        for b in &boxes {
            new.insert(b, true);
        }
        new.pairs(&mut fresh);
        assert_eq!(found, fresh, "step {step}");
        assert!(found.len() > 100);
    }
}

#[test]
fn empty_input_and_unknown_handles() {
    let mut sweep = SweepAndPrune::default();
    let mut found = vec![[0, 1]];
    sweep.pairs(&mut found);
    assert!(found.is_empty());
    let b = box_around(Vec3::zeros(), Vec3::repeat(1.0));
    sweep.remove(3);
    sweep.set(3, &b, true);
    let (first, second) = (sweep.insert(&b, true), sweep.insert(&b, true));
    sweep.pairs(&mut found);
    assert_eq!(found, [[first, second]]);
    sweep.remove(first);
    sweep.remove(first);
    sweep.set(first, &b, true);
    sweep.pairs(&mut found);
    assert!(found.is_empty());
    // removed and inserted again before a query
    sweep.remove(second);
    let (third, fourth) = (sweep.insert(&b, false), sweep.insert(&b, true));
    sweep.pairs(&mut found);
    assert_eq!(found, [[third.min(fourth), third.max(fourth)]]);
}
