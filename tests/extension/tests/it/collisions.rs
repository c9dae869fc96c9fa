//! New kinds meet rigid bodies and each other: closed forms of impacts.

use crate::common::*;
use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::{Material, Object, ObjectId, RigidBody, World};
use tumble_extension::Bead;

fn rigid(name: &str, mass: f64, at: Vec3, velocity: Vec3, restitution: f64) -> RigidBody {
    let body = RigidBody::new(sphere(0.1)).with_name(name).with_mass(mass).with_material(Material {
        restitution,
        friction: 0.0,
        ..Material::default()
    });
    body.with_pose(Pose::translation(at.x, at.y, at.z)).with_velocity(velocity)
}

/// Two objects of `ma` and `mb` kg head on along x with restitution `e`: velocities after, by
/// momentum and Newton's law.
fn head_on(ma: f64, mb: f64, va: f64, vb: f64, e: f64) -> (f64, f64) {
    let common = (ma * va + mb * vb) / (ma + mb);
    (common - e * mb / (ma + mb) * (va - vb), common + e * ma / (ma + mb) * (va - vb))
}

fn collide(stepper: &str, a: impl Object, b: impl Object) -> (World, ObjectId, ObjectId) {
    let mut world = world(stepper, false);
    let (a, b) = (world.add(a).unwrap(), world.add(b).unwrap());
    step(&mut world, 120);
    (world, a, b)
}

#[test]
fn a_particle_hits_a_rigid_body_head_on() {
    for stepper in STEPPERS {
        for e in [0.0, 0.5, 1.0] {
            let a = with_material(particle(2.0, 0.1, Vec3::new(-0.5, 0.0, 0.0), Vec3::new(3.0, 0.0, 0.0)), e, 0.0);
            let (world, a, b) = collide(stepper, a, rigid("ball", 3.0, Vec3::zeros(), Vec3::new(-1.0, 0.0, 0.0), e));
            let (va, vb) = head_on(2.0, 3.0, 3.0, -1.0, e);
            let (got_a, got_b) = (velocity(&world, a), velocity(&world, b));
            assert!(
                (got_a - Vec3::new(va, 0.0, 0.0)).norm() < 1e-8,
                "{stepper}, e = {e}: particle at {got_a}, by hand {va}"
            );
            assert!(
                (got_b - Vec3::new(vb, 0.0, 0.0)).norm() < 1e-8,
                "{stepper}, e = {e}: body at {got_b}, by hand {vb}"
            );
        }
    }
}

/// Off the middle, elastic, without friction: all of momentum, angular momentum and energy stays,
/// and equal masses part at a right angle.
#[test]
fn an_oblique_elastic_impact_keeps_everything() {
    for stepper in STEPPERS {
        let a = with_material(particle(2.0, 0.1, Vec3::new(-0.5, 0.08, 0.03), Vec3::new(3.0, 0.0, 0.0)), 1.0, 0.0);
        let (mut world, a, b) = collide(stepper, a, rigid("ball", 2.0, Vec3::zeros(), Vec3::zeros(), 1.0));
        let (va, vb) = (velocity(&world, a), velocity(&world, b));
        assert!(va.norm() > 0.1 && vb.norm() > 0.1 && va.dot(&vb).abs() < 1e-6, "{stepper}: {va} and {vb}");
        let (m, e) = (world.momentum(), world.energy().total());
        // before: P = 2·3 along x; about the origin x × P = (0.08, 0.03) × 6
        assert!((m.linear - Vec3::new(6.0, 0.0, 0.0)).norm() < 1e-12, "{stepper}: momentum {}", m.linear);
        // time_stepping gives the impulse where linear motion meets the surface, backtracking where
        // the surfaces are within 1e-7 m
        let slack = if stepper == "backtracking" { 1e-6 } else { 1e-3 };
        assert!(
            (m.angular - Vec3::new(0.0, 0.18, -0.48)).norm() < slack,
            "{stepper}: angular momentum {:?}",
            m.angular.as_slice()
        );
        assert!((e / 9.0 - 1.0).abs() < 1e-8, "{stepper}: energy {e}");
        step(&mut world, 1);
    }
}

/// At the lowest point the wire is level: along x the bead is a mass of its own, and equal masses
/// swap velocities.
#[test]
fn a_bead_at_the_lowest_point_swaps_velocities_with_a_ball() {
    for stepper in STEPPERS {
        let bead = Bead::new("bead", 2.0, 0.25, sphere(0.1)).with_material(Material {
            restitution: 1.0,
            friction: 0.0,
            ..Material::default()
        });
        let (world, bead, ball) =
            collide(stepper, bead, rigid("ball", 2.0, Vec3::new(0.5, 0.0, 0.0), Vec3::new(-1.5, 0.0, 0.0), 1.0));
        assert!(velocity(&world, ball).norm() < 1e-6, "{stepper}: the ball still has {}", velocity(&world, ball));
        // σ = p/(m·|r'|), the speed along the wire
        let x = world.state_of(bead).unwrap();
        let sigma = x[1] / (2.0 * 2.0 * 0.25 * (0.5 * x[0]).cos());
        assert!((sigma + 1.5).abs() < 1e-6, "{stepper}: the bead has {sigma} m/s");
    }
}

/// A particle rests on the ground under gravity, and the ground carries its weight.
#[test]
fn a_particle_lands_and_rests() {
    for stepper in STEPPERS {
        let mut world = world(stepper, true);
        world.add_static(RigidBody::fixed(Shape::half_space()).with_name("ground")).unwrap();
        let id = world.add(particle(2.0, 0.1, Vec3::new(0.0, 0.0, 0.5), Vec3::zeros())).unwrap();
        step(&mut world, 240);
        assert!(
            (position(&world, id).z - 0.1).abs() < 1e-6 && velocity(&world, id).norm() < 1e-9,
            "{stepper}: at {}",
            position(&world, id)
        );
        let carried: f64 = world.contacts().iter().map(|c| c.force.z.abs()).sum();
        assert!((carried / (2.0 * G) - 1.0).abs() < 1e-6, "{stepper}: {carried} N");
    }
}

/// The new kinds are saved, forked and restored with everything else.
#[test]
fn new_kinds_are_saved_and_restored() {
    for stepper in STEPPERS {
        let build = || {
            let mut world = world(stepper, true);
            let material = Material { restitution: 0.5, friction: 0.3, ..Material::default() };
            world
                .add_static(RigidBody::fixed(Shape::half_space()).with_name("ground").with_material(material))
                .unwrap();
            world.add(with_material(particle(2.0, 0.1, Vec3::new(0.0, 0.05, 0.5), Vec3::zeros()), 0.5, 0.3)).unwrap();
            world.add(Bead::new("bead", 1.0, 0.25, sphere(0.05)).at(1.0, 0.0).stopped_at(1.2)).unwrap();
            world.add(rigid("ball", 1.0, Vec3::new(0.0, 0.0, 0.9), Vec3::zeros(), 0.5)).unwrap();
            world
        };
        let mut whole = build();
        step(&mut whole, 100);
        let saved = whole.save();
        step(&mut whole, 100);
        let mut other = build();
        other.restore(&saved).unwrap();
        step(&mut other, 100);
        assert!(other.save() == whole.save(), "{stepper}: a restored world goes another way");
    }
}
