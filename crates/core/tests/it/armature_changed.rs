//! The armature of a joint that is changed while the body moves: motions in closed form.

use tumble_core::articulated::{DofSettings, LinkMass, ModelBuilder, Spring};
use tumble_core::collide::{Mat3, Pose, Vec3};
use tumble_core::prelude::*;
use tumble_core::{ArticulatedBody, Joint, ObjectId, WorkingMemory, stepper_by_name};

const G: f64 = 9.81;
const MASS: f64 = 2.0;

/// A mass of 2 kg on a prismatic joint along `axis`, with an armature of 1 kg.
fn slider(axis: Vec3) -> ArticulatedBody {
    let mass = LinkMass { mass: MASS, center: Vec3::zeros(), inertia: Mat3::identity() };
    let mut builder = ModelBuilder::new();
    let link = builder.link("weight", None, Joint::Prismatic { axis }, Pose::identity(), mass);
    builder.set_armature(link, 1.0);
    ArticulatedBody::new("slider", builder.build().unwrap())
}

fn world(body: ArticulatedBody, stepper: &str, dt: f64) -> (World, ObjectId) {
    let mut world = World::new(Settings::default().with_dt(dt)).unwrap();
    world.set_stepper(stepper_by_name(stepper).unwrap());
    let id = world.add(body).unwrap();
    (world, id)
}

fn run(world: &mut World, frames: usize) {
    for _ in 0..frames {
        world.step().unwrap();
    }
}

fn velocity(world: &World, id: ObjectId) -> f64 {
    world.state_of(id).unwrap()[1]
}

/// `v̇ = −m g / (m + a)`, at any length of a step.
#[test]
fn a_weight_falls_with_the_armature_of_the_moment() {
    for stepper in ["time_stepping", "backtracking"] {
        let (mut world, id) = world(slider(Vec3::z()), stepper, 0.01);
        run(&mut world, 50);
        let fall = |armature: f64| -MASS * G / (MASS + armature);
        assert!((velocity(&world, id) - 0.5 * fall(1.0)).abs() < 1e-12, "{stepper}");
        world.set_armature(id, "weight", 4.0).unwrap();
        let mut others = [world.fork(), World::from_archive(&world.archive(&[]).unwrap(), &mut |_| None).unwrap()];
        run(&mut world, 30);
        let wanted = 0.5 * fall(1.0) + 0.3 * fall(4.0);
        assert!((velocity(&world, id) - wanted).abs() < 1e-12, "{stepper}: {} {wanted}", velocity(&world, id));
        for other in &mut others {
            run(other, 30);
            assert_eq!(other.state_of(other.ids()[0]), world.state_of(id), "{stepper}");
        }
        world.set_armature(id, "weight", 0.0).unwrap();
        run(&mut world, 20);
        assert!((velocity(&world, id) - wanted - 0.2 * fall(0.0)).abs() < 1e-12, "{stepper}");
    }
}

/// The period on a spring is `2π √((m + a) / k)`: from rest at 1 m, a quarter of it later the weight passes 0.
#[test]
fn the_period_on_a_spring_follows_the_armature() {
    let (stiffness, frames) = (50.0, 2000);
    for armature in [0.0, 1.0, 7.0] {
        let period = std::f64::consts::TAU * ((MASS + armature) / stiffness).sqrt();
        let mut body = slider(Vec3::x()).with_positions(&[1.0]).unwrap();
        let spring = Some(Spring { stiffness, rest: 0.0 });
        body.set_dof(0, DofSettings { spring, ..DofSettings::default() }).unwrap();
        let (mut world, id) = world(body, "time_stepping", period / f64::from(4 * frames));
        world.set_armature(id, "weight", armature).unwrap();
        run(&mut world, frames as usize);
        let [position, speed] = *world.state_of(id).unwrap() else { panic!() };
        assert!(position.abs() < 2e-3, "armature {armature}: {position} m");
        let most = (stiffness / (MASS + armature)).sqrt();
        assert!((speed + most).abs() < 2e-3 * most, "armature {armature}: {speed} m/s instead of {}", -most);
    }
}

/// Forks with other armatures that share working memory keep to their own.
#[test]
fn forks_that_share_memory_have_their_own_armatures() {
    let (world, id) = world(slider(Vec3::z()), "time_stepping", 0.01);
    let mut worlds = [0.5, 3.0, 0.0].map(|armature| {
        let mut fork = world.fork();
        fork.set_armature(id, "weight", armature).unwrap();
        (fork, armature)
    });
    let mut memory = WorkingMemory::default();
    for _ in 0..10 {
        for (world, _) in &mut worlds {
            world.lend_working_memory(&mut memory);
            run(world, 3);
            world.return_working_memory(&mut memory);
        }
    }
    for (world, armature) in &worlds {
        let wanted = -0.3 * MASS * G / (MASS + armature);
        assert!((velocity(world, id) - wanted).abs() < 1e-12, "{armature}");
    }
}

#[test]
fn a_wrong_armature_changes_nothing() {
    let (mut world, id) = world(slider(Vec3::z()), "time_stepping", 0.01);
    let ball = world.add(RigidBody::new(Shape::sphere(0.1).unwrap()).with_name("ball")).unwrap();
    let mut error = |id, link: &str, armature| world.set_armature(id, link, armature).unwrap_err().to_string();
    assert!(error(id, "weight", -1.0).contains("the armature of its joint is -1"), "{}", error(id, "weight", -1.0));
    assert!(error(id, "weight", f64::NAN).contains("NaN"));
    assert!(error(id, "nothing", 1.0).contains("no link named 'nothing'"));
    assert_eq!(error(ball, "weight", 1.0), "'ball' is not an articulated body");
    assert_eq!(world.get::<ArticulatedBody>(id).unwrap().model().links()[0].armature, 1.0);
    // a joint that moves nothing else needs its armature
    let mut builder = ModelBuilder::new();
    let link = builder.link("rotor", None, Joint::Revolute { axis: Vec3::z() }, Pose::identity(), LinkMass::none());
    builder.set_armature(link, 1.0);
    let rotor = ArticulatedBody::new("rotor", builder.build().unwrap());
    assert!(rotor.clone().with_armature("rotor", 2.0).is_ok());
    assert!(rotor.with_armature("rotor", 0.0).err().unwrap().to_string().contains("rotor"));
}
