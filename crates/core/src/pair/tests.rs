//! What is not asked cannot matter: pairs that are told apart, followed along their motion.

use super::{Pair, Reach, Recalled, Travel};
use crate::site::Site;
use crate::step::coasted;
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

fn travel(shape: &Shape, site: &Site) -> Travel {
    let tight = shape.aabb(&site.pose);
    let around = (tight.max - site.position()).sup(&(site.position() - tight.min));
    Travel::new(site, shape.bounding_radius(), around, H)
}

/// Bodies that fly and spin: whatever is told apart at the start touches at no moment of the step, by the exact contacts of boxes, balls and half-spaces.
#[test]
fn what_is_told_apart_touches_at_no_moment_of_the_step() {
    let (mut seed, mut told, mut touched) = (3, 0, 0);
    let shapes = [
        Shape::cuboid(Vec3::new(0.5, 0.1, 0.2)).unwrap(),
        Shape::sphere(0.2).unwrap(),
        Shape::cuboid(Vec3::new(0.05, 0.3, 0.3)).unwrap(),
        Shape::half_space(),
    ];
    for n in 0..4000 {
        let pair = [&shapes[n % 3], &shapes[(n / 3) % 4]];
        let mut site = |size: f64| Site {
            pose: Pose::new(vector(&mut seed, size), vector(&mut seed, 3.0)),
            velocity: vector(&mut seed, 6.0),
            angular_velocity: vector(&mut seed, 10.0),
            acceleration: vector(&mut seed, 20.0),
            ..Site::default()
        };
        let sites = [site(1.0), site(0.2)];
        let sites = if n % 12 >= 9 {
            [sites[0], Site { velocity: Vec3::zeros(), angular_velocity: Vec3::zeros(), ..sites[1] }]
        } else {
            sites
        };
        let travel = [0, 1].map(|k| travel(pair[k], &sites[k]));
        let moments = (0..=40).map(|k| H * f64::from(k) / 40.0);
        let mut meets = moments.map(|t| {
            let mut found = Vec::new();
            contacts(pair[0], &coasted(&sites[0], t), pair[1], &coasted(&sites[1], t), 0.0, &mut found);
            !found.is_empty()
        });
        let meets = meets.any(|m| m);
        for reach in [Reach::Relative, Reach::Each] {
            let asked = Pair {
                mode: ContactMode::Surface,
                shapes: pair,
                sites: [&sites[0], &sites[1]],
                travel,
                near: 1e-4,
                reach,
            };
            let apart = asked.stays_apart();
            assert!(!(apart && meets), "{n}, {reach:?}: told apart, and they meet");
            told += usize::from(apart);
        }
        touched += usize::from(meets);
    }
    assert!(told > 1000 && touched > 200, "{told} told apart, {touched} met");
}

/// The second query at the same poses is not made, gives the same contacts, and a wider one is.
#[test]
fn what_has_not_moved_is_recalled() {
    let (cylinder, block) = (Shape::cylinder(0.1, 0.2).unwrap(), Shape::cuboid(Vec3::repeat(0.5)).unwrap());
    let at = |z: f64| Site { pose: Pose::translation(0.0, 0.0, z), ..Site::default() };
    let sites = [at(0.7001), at(0.0)];
    let pair = |near: f64| Pair {
        mode: ContactMode::Surface,
        shapes: [&cylinder, &block],
        sites: [&sites[0], &sites[1]],
        travel: [Travel::default(); 2],
        near,
        reach: Reach::Relative,
    };
    let mut recalled = Recalled::default();
    let ask = |near: f64, recalled: &mut Recalled| {
        let mut found = Vec::new();
        recalled.begin();
        pair(near).contacts([4, 7], H, recalled, &mut found);
        recalled.end();
        found
    };
    let first = ask(1e-3, &mut recalled);
    assert!(first.len() >= 4 && first.iter().all(|c| (c.gap - 1e-4).abs() < 1e-9), "{first:?}");
    // what is kept is what is given
    recalled.last.contacts.iter_mut().for_each(|c| c.core_b = 42.0);
    let again = ask(1e-3, &mut recalled);
    assert!(again.len() == first.len() && again.iter().all(|c| c.core_b == 42.0), "asked again: {again:?}");
    assert!(ask(1e-5, &mut recalled).is_empty(), "further away than asked");
    assert_eq!(ask(2e-3, &mut recalled), first, "a wider look is a new one");
}
