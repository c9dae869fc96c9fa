//! Impacts of sharp convex bodies: without friction the impulse acts along the normal of the distance of the two, whatever
//! the step.

use crate::common::{no_gravity, velocity};
use nalgebra::UnitQuaternion;
use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::*;

/// Rates of `time_stepping`, Hz, and the largest angle of its impulse to that at the time of the impact, rad: the normal is
/// that of the start of the step, from which the bodies turn by some 3 rad/s.
const RATES: [(f64, f64); 2] = [(240.0, 0.15), (960.0, 0.05)];

/// A generator of numbers from -1 to 1: Knuth's linear congruence.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn vector(&mut self) -> Vec3 {
        Vec3::from_fn(|_, _| self.next())
    }
}

fn shape(name: &str) -> Shape {
    let octahedron: Vec<Vec3> = (0..3).flat_map(|k| [Vec3::ith(k, 0.3), Vec3::ith(k, -0.3)]).collect();
    match name {
        "hull" => Shape::convex_hull(&octahedron).unwrap(),
        "cylinder" => Shape::cylinder(0.25, 0.5).unwrap(),
        "cone" => Shape::cone(0.3, 0.6).unwrap(),
        _ => Shape::cuboid(Vec3::new(0.5, 0.4, 0.6)).unwrap(),
    }
}

/// Returns the change of velocity of the second body at the first strike of two, if they strike within 0.3 s.
fn first_impulse(names: [&str; 2], seed: u64, (stepper, integrator): (&str, Integrator), dt: f64) -> Option<Vec3> {
    let mut world = no_gravity(crate::common::world(stepper, dt));
    if stepper == "backtracking" {
        let settings = world.settings().with_integrator(integrator);
        world.set_settings(settings).unwrap();
    }
    let mut random = Numbers(seed);
    (0..8).for_each(|_| {
        random.next();
    });
    let elastic = Material { restitution: 1.0, friction: 0.0, ..Material::default() };
    let mut add = |name: &str, part: &str, mass: f64, at: Vec3, speed: Vec3| {
        let turn = UnitQuaternion::from_scaled_axis(3.0 * random.vector());
        let body = RigidBody::new(shape(name)).with_mass(mass).with_material(elastic).with_name(part);
        let body = body.with_pose(Pose::from_parts((at + 0.1 * random.vector()).into(), turn));
        world.add(body.with_velocity(speed).with_angular_velocity(3.0 * random.vector())).unwrap()
    };
    add(names[0], "a", 2.0, Vec3::zeros(), Vec3::zeros());
    let start = Vec3::new(0.3, -0.2, -4.0);
    let id = add(names[1], "b", 1.0, Vec3::z() * 1.05, start);
    for _ in 0..(0.3 / dt).round() as usize {
        world.step().unwrap();
        let change = velocity(&world, id) - start;
        if change.norm() > 1e-6 {
            return Some(change);
        }
    }
    None
}

/// Hulls, cylinders, cones and boxes that strike with edges, rims and corners: `time_stepping` at two steps gives the
/// direction that `backtracking` finds at the time of the impact.
#[test]
fn sharp_bodies_strike_along_the_normal_of_their_distance() {
    let seeds = if std::env::var_os("TUMBLE_SLOW").is_some() { 100 } else { 12 };
    let (mut strikes, mut wrong) = (0, Vec::new());
    for names in [
        ["hull", "cone"],
        ["hull", "cylinder"],
        ["cone", "cylinder"],
        ["cylinder", "cylinder"],
        ["cone", "cone"],
        ["box", "hull"],
        ["hull", "hull"],
        ["box", "cone"],
    ] {
        for seed in 0..seeds {
            let exact = first_impulse(names, seed, ("backtracking", Integrator::DormandPrince), 1.0 / 480.0);
            let Some(exact) = exact else { continue };
            for (hertz, most) in RATES {
                let Some(found) = first_impulse(names, seed, ("time_stepping", Integrator::Verlet), 1.0 / hertz) else {
                    continue;
                };
                strikes += 1;
                let off = found.cross(&exact).norm().atan2(found.dot(&exact));
                if off > most {
                    wrong.push(format!("{names:?}, seed {seed}, {hertz} Hz: {off:.2} rad"));
                }
            }
        }
    }
    assert!(strikes > 8 * seeds as usize, "{strikes} strikes");
    assert!(wrong.is_empty(), "{} of {strikes}:\n{}", wrong.len(), wrong.join("\n"));
}
