//! Regression tests of articulated bodies, each with the numbers that showed the fault.

use crate::articulated_world::{chain, loose_chain, rod, world};
use crate::common::no_gravity;
use std::f64::consts::{FRAC_PI_2, PI};
use tumble_core::collide::{Mat3, Pose, Shape, Vec3};
use tumble_core::*;

/// Returns a floating chain of elastic, frictionless capsules in arbitrary motion, whose links do
/// not collide with each other.
fn elastic_chain(links: usize) -> ArticulatedBody {
    let model = loose_chain(links, Vec3::zeros(), 0.0).model().clone();
    let velocities: Vec<f64> =
        (0..model.dof()).map(|i| ((i * 7 + 3) % 5) as f64 - 2.0 + 0.3 * i as f64 / model.dof() as f64).collect();
    let mut body = ArticulatedBody::new("chain", model).with_pose(Pose::translation(-0.05 * links as f64, 0.0, 0.0));
    body.self_collision = false;
    for i in 0..links {
        let along = Pose::new(Vec3::new(0.05, 0.0, 0.0), Vec3::new(0.0, FRAC_PI_2, 0.0));
        let mut collider = Collider::new(Shape::capsule(0.02, 0.06).unwrap(), along);
        (collider.material.restitution, collider.material.friction) = (1.0, 0.0);
        body.add_collider(&format!("link {i}"), collider).unwrap();
    }
    body.with_velocities(&velocities).unwrap()
}

#[test]
fn a_chain_that_bounces_in_a_box_gains_no_energy() {
    // the impact was applied in the configuration at its own time, with the mass matrix of the
    // middle of the step: 0.3 J became 55 J in 10 s
    for links in [1, 2, 6] {
        let mut world = no_gravity(world(1.0 / 240.0, "time_stepping", Integrator::Verlet));
        let turns = [(0.0, 0.0), (PI, 0.0), (FRAC_PI_2, 0.0), (-FRAC_PI_2, 0.0), (0.0, FRAC_PI_2), (0.0, -FRAC_PI_2)];
        for (k, (x, y)) in turns.into_iter().enumerate() {
            let rotation = Pose::rotation(Vec3::new(x, y, 0.0)).rotation;
            let wall = RigidBody::fixed(Shape::half_space()).with_name(format!("wall{k}")).with_material(Material {
                restitution: 1.0,
                friction: 0.0,
                ..Material::default()
            });
            world
                .add_static(wall.with_pose(Pose::from_parts((rotation * Vec3::new(0.0, 0.0, -0.6)).into(), rotation)))
                .unwrap();
        }
        world.add(elastic_chain(links)).unwrap();
        let start = world.energy().kinetic;
        let (mut most, mut passes): (f64, u32) = (0.0, 0);
        for _ in 0..2400 {
            passes += world.step().unwrap().impact_passes;
            most = most.max(world.energy().kinetic / start - 1.0);
        }
        assert!(passes > 10 && most < 1e-9, "{links} links: {passes} passes, energy grew by {most:e}");
    }
}

#[test]
fn a_kinematic_joint_goes_past_its_limit_freely() {
    // the limit cannot push a kinematic body: every frame reached the maximum number of tries
    let mut world = no_gravity(world(1.0 / 60.0, "backtracking", Integrator::Verlet));
    let mut body = chain(2, 0.0).with_velocities(&[1.0, 0.0]).unwrap();
    body.set_dof(0, DofSettings { limits: Some([-0.1, 0.1]), ..DofSettings::default() }).unwrap();
    let id = world.add_boxed(Box::new(body), Mode::Kinematic).unwrap();
    for _ in 0..30 {
        let report = *world.step().unwrap();
        assert!(report.tries == 1 && report.floor_hits == 0, "{report:?}");
    }
    assert!((world.state_of(id).unwrap()[0] - 0.5).abs() < 1e-12);
}

#[test]
fn a_link_is_kept_apart_from_the_base() {
    let mut builder = ModelBuilder::new();
    let base = builder.link("base", None, Joint::Fixed, Pose::identity(), LinkMass::none());
    let upper = builder.link("upper", Some(base), Joint::revolute(Vec3::y()), Pose::identity(), rod(1.0, 0.4));
    builder.link("lower", Some(upper), Joint::revolute(Vec3::y()), Pose::translation(0.0, 0.0, -0.4), rod(1.0, 0.4));
    let mut body = ArticulatedBody::new("arm", builder.build().unwrap());
    for link in ["base", "lower"] {
        body.add_collider(link, Collider::new(Shape::sphere(0.1).unwrap(), Pose::identity())).unwrap();
    }
    let meet = |body: &ArticulatedBody| body.collidable().unwrap().parts_collide(3, 4);
    assert!(meet(&body));
    body.exclude_collisions("base", "lower").unwrap();
    assert!(!meet(&body));
}

#[test]
fn a_box_on_a_turning_kinematic_arm_stays_on_its_circle() {
    // 1 rad/s at 0.6 m, held by friction: the support's centripetal acceleration was left out, and
    // the box crept out by 5 mm in 2 s
    let mut world = world(1.0 / 240.0, "backtracking", Integrator::Verlet);
    let mut builder = ModelBuilder::new();
    let mass = LinkMass { mass: 1.0, center: Vec3::zeros(), inertia: Mat3::identity() };
    builder.link("table", None, Joint::revolute(Vec3::z()), Pose::identity(), mass);
    let mut table = ArticulatedBody::new("table", builder.build().unwrap()).with_velocities(&[1.0]).unwrap();
    let mut plate = Collider::new(Shape::cuboid(Vec3::new(1.0, 1.0, 0.1)).unwrap(), Pose::translation(0.6, 0.0, 0.0));
    plate.material.friction = 1.0;
    table.add_collider("table", plate).unwrap();
    world.add_boxed(Box::new(table), Mode::Kinematic).unwrap();
    let cube = RigidBody::new(Shape::cuboid(Vec3::repeat(0.1)).unwrap())
        .with_name("box")
        .with_mass(1.0)
        .with_material(Material { friction: 1.0, ..Material::default() });
    let at = cube
        .with_pose(Pose::translation(0.6, 0.0, 0.1))
        .with_velocity(Vec3::new(0.0, 0.6, 0.0))
        .with_angular_velocity(Vec3::z());
    let id = world.add(at).unwrap();
    for _ in 0..480 {
        world.step().unwrap();
    }
    let place = world.part_state(id, 0).unwrap().position();
    let (creep, behind) = (place.xy().norm() - 0.6, place.y.atan2(place.x) - 2.0);
    assert!(creep.abs() < 1e-4 && behind.abs() < 1e-3, "{creep:e} m, {behind:e} rad");
}

#[test]
fn a_floating_chain_that_is_struck_keeps_its_linear_momentum() {
    // displacing links with their joint rates held, and scaling those for the energy, lost 0.43 of
    // 5 N·s in two impacts
    let mut world = no_gravity(world(1.0 / 240.0, "time_stepping", Integrator::Verlet));
    let mass = LinkMass {
        mass: 1.0,
        center: Vec3::new(0.02, 0.0, -0.15),
        inertia: Mat3::from_diagonal(&Vec3::new(0.008, 0.008, 0.002)),
    };
    let mut builder = ModelBuilder::new();
    let mut parent = None;
    for i in 0..3 {
        let (joint, z) =
            if i == 0 { (Joint::Floating, 0.0) } else { (Joint::revolute(Vec3::new(0.2 * i as f64, 1.0, 0.1)), -0.3) };
        parent = Some(builder.link(format!("link {i}"), parent, joint, Pose::translation(0.0, 0.0, z), mass));
    }
    let mut body = ArticulatedBody::new("chain", builder.build().unwrap());
    for i in 0..3 {
        let mut collider = Collider::new(Shape::capsule(0.03, 0.24).unwrap(), Pose::translation(0.0, 0.0, -0.15));
        (collider.material.restitution, collider.material.friction) = (1.0, 0.3);
        body.add_collider(&format!("link {i}"), collider).unwrap();
    }
    world.add(body.with_velocities(&[0.0, 2.0, 1.0, 0.0, 0.0, 0.0, 1.0, -2.0]).unwrap()).unwrap();
    let ball = RigidBody::new(Shape::sphere(0.05).unwrap()).with_name("ball").with_mass(0.5).with_material(Material {
        restitution: 1.0,
        friction: 0.3,
        ..Material::default()
    });
    world.add(ball.with_pose(Pose::translation(1.0, 0.01, -0.1)).with_velocity(Vec3::new(-4.0, 0.0, 0.0))).unwrap();
    let (start, mut passes) = (world.momentum().linear, 0);
    for _ in 0..240 {
        passes += world.step().unwrap().impact_passes;
    }
    let lost = (world.momentum().linear - start).norm() / start.norm();
    assert!(passes > 0 && lost < 1e-4, "{passes} passes, lost {lost:e}");
}

#[test]
fn a_step_after_one_that_failed_is_that_of_a_world_where_none_failed() {
    // a stage of the failed step, which was not finite, was read with a weight of 0
    let mut world = world(1.0 / 240.0, "time_stepping", Integrator::Verlet);
    let id = world.add(chain(3, 0.4)).unwrap();
    world.step().unwrap();
    let mut other = world.fork();
    world.apply_generalized(id, &[1e300, 0.0, 0.0]).unwrap();
    assert!(world.step().is_err());
    world.clear_applied();
    for _ in 0..3 {
        world.step().unwrap();
        other.step().unwrap();
        assert_eq!(world.save(), other.save());
    }
}
