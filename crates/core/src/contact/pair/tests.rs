//! Skipped queries must not matter: separated pairs, followed along their motion.

use super::{CachedContacts, MotionBounds, NarrowPhaseCache, PairQuery, PredictionMode};
use crate::contact::own_tests::OwnTests;
use crate::contact::time_of_impact::{MovingPair, pose_after_free_motion};
use crate::object::part_state::PartState;
use tumble_collide::{ContactMode, Pose, Shape, Vec3, contacts};

const H: f64 = 1.0 / 60.0;

/// A repeatable number within ±1.
fn random(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

fn vector(seed: &mut u64, size: f64) -> Vec3 {
    Vec3::from_fn(|_, _| size * random(seed))
}

fn motion_bounds(shape: &Shape, part_state: &PartState) -> MotionBounds {
    let tight = shape.aabb(&part_state.pose);
    let around = (tight.max - part_state.position()).sup(&(part_state.position() - tight.min));
    MotionBounds::new(part_state, shape.bounding_radius(), around, H)
}

/// Bodies that fly and spin: pairs separated at the start touch at no time of the step, by the
/// exact contacts of boxes, spheres and half-spaces.
#[test]
fn separated_pairs_do_not_touch_during_the_step() {
    let (mut seed, mut recorded, mut touched) = (3, 0, 0);
    let shapes = [
        Shape::cuboid(Vec3::new(1.0, 0.2, 0.4)).unwrap(),
        Shape::sphere(0.2).unwrap(),
        Shape::cuboid(Vec3::new(0.1, 0.6, 0.6)).unwrap(),
        Shape::half_space(),
    ];
    for n in 0..4000 {
        let pair = [&shapes[n % 3], &shapes[(n / 3) % 4]];
        let mut part_state = |size: f64| PartState {
            pose: Pose::new(vector(&mut seed, size), vector(&mut seed, 3.0)),
            velocity: vector(&mut seed, 6.0),
            angular_velocity: vector(&mut seed, 10.0),
            acceleration: vector(&mut seed, 20.0),
            ..PartState::default()
        };
        let part_states = [part_state(1.0), part_state(0.2)];
        let part_states = if n % 12 >= 9 {
            [part_states[0], PartState { velocity: Vec3::zeros(), angular_velocity: Vec3::zeros(), ..part_states[1] }]
        } else {
            part_states
        };
        let motion_bounds = [0, 1].map(|k| motion_bounds(pair[k], &part_states[k]));
        let moments = (0..=40).map(|k| H * f64::from(k) / 40.0);
        let mut meets = moments.map(|t| {
            let mut found = Vec::new();
            contacts(
                pair[0],
                &pose_after_free_motion(&part_states[0], t),
                pair[1],
                &pose_after_free_motion(&part_states[1], t),
                0.0,
                &mut found,
            );
            !found.is_empty()
        });
        let meets = meets.any(|m| m);
        for prediction in [PredictionMode::Relative, PredictionMode::Each] {
            let queries = PairQuery {
                parts: MovingPair {
                    mode: ContactMode::Surface,
                    tests: OwnTests::NONE,
                    filtered: None,
                    shapes: pair,
                    part_states: [&part_states[0], &part_states[1]],
                    plane: None,
                    skipped: &[],
                },
                motion_bounds,
                near: 1e-4,
                prediction,
            };
            let are_separated = queries.is_separated();
            assert!(!(are_separated && meets), "{n}, {prediction:?}: separated, and they meet");
            recorded += usize::from(are_separated);
        }
        touched += usize::from(meets);
    }
    assert!(recorded > 1000 && touched > 200, "{recorded} separated, {touched} met");
}

/// The second query at the same poses is not made, gives the same contacts, and a wider one is.
#[test]
fn contacts_of_pairs_that_did_not_move_are_cached() {
    let (cylinder, block) = (Shape::cylinder(0.1, 0.4).unwrap(), Shape::cuboid(Vec3::repeat(1.0)).unwrap());
    let at = |z: f64| PartState { pose: Pose::translation(0.0, 0.0, z), ..PartState::default() };
    let part_states = [at(0.7001), at(0.0)];
    let pair = |near: f64| PairQuery {
        parts: MovingPair {
            mode: ContactMode::Surface,
            tests: OwnTests::NONE,
            filtered: None,
            shapes: [&cylinder, &block],
            part_states: [&part_states[0], &part_states[1]],
            plane: None,
            skipped: &[],
        },
        motion_bounds: [MotionBounds::default(); 2],
        near,
        prediction: PredictionMode::Relative,
    };
    let mut narrow_phase_cache = NarrowPhaseCache::default();
    let query = |near: f64, narrow_phase_cache: &mut NarrowPhaseCache| {
        let mut found = Vec::new();
        let mut cached = CachedContacts::default();
        let mut known = narrow_phase_cache.from([4, 7]);
        pair(near).contacts([4, 7], H, (&mut known, &mut cached), &mut found);
        narrow_phase_cache.replace([&mut cached].into_iter());
        found
    };
    let first = query(1e-3, &mut narrow_phase_cache);
    assert!(first.len() >= 4 && first.iter().all(|c| (c.gap - 1e-4).abs() < 1e-9), "{first:?}");
    // the stored contacts are returned
    narrow_phase_cache.last.contacts.iter_mut().for_each(|c| c.core_b = 42.0);
    let again = query(1e-3, &mut narrow_phase_cache);
    assert!(again.len() == first.len() && again.iter().all(|c| c.core_b == 42.0), "queried again: {again:?}");
    assert!(query(1e-5, &mut narrow_phase_cache).is_empty(), "further away than the margin");
    assert_eq!(query(1e-3, &mut narrow_phase_cache), again, "a narrower query has dropped what the wider one found");
    assert_eq!(query(2e-3, &mut narrow_phase_cache), first, "a wider query is a new one");
}
