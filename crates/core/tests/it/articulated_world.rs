//! Articulated bodies in the world: swings against closed forms, energy, limits, contacts, the one-link body that is a rigid body.

use tumble_core::collide::{Mat3, Pose, Shape, Vec3};
use tumble_core::{
    ArticulatedBody, Collider, Drive, Freedom, Integrator, Joint, LinkMass, Model, ModelBuilder, ObjectId, Settings, World, stepper_by_name,
};

/// A uniform thin rod of `length` m along −z from its joint.
pub fn rod(mass: f64, length: f64) -> LinkMass {
    let i = mass * length * length / 12.0;
    LinkMass { mass, center: Vec3::new(0.0, 0.0, -0.5 * length), inertia: Mat3::from_diagonal(&Vec3::new(i, i, 1e-3 * i)) }
}

/// Equal rods hung one on another by hinges about y.
pub fn chain(links: usize, mass: f64, length: f64) -> Model {
    let mut builder = ModelBuilder::new();
    let mut parent = None;
    for i in 0..links {
        let placement = if i == 0 { Pose::identity() } else { Pose::translation(0.0, 0.0, -length) };
        parent = Some(builder.link(format!("link {i}"), parent, Joint::revolute(Vec3::y()), placement, rod(mass, length)));
    }
    builder.build().unwrap()
}

fn world(dt: f64, stepper: &str, integrator: Integrator) -> World {
    let mut world = World::new(Settings { dt, integrator, ..Settings::default() }).unwrap();
    world.set_stepper(stepper_by_name(stepper).unwrap());
    world
}

fn run(world: &mut World, seconds: f64) {
    let frames = (seconds / world.settings().dt).round() as usize;
    for _ in 0..frames {
        world.step().unwrap();
    }
}

#[test]
fn energy_of_a_free_swing() {
    for (stepper, integrator) in [("time_stepping", Integrator::Verlet), ("backtracking", Integrator::Verlet), ("backtracking", Integrator::Rk4)] {
        for n in [1, 2, 5] {
            let mut world = world(1.0 / 240.0, stepper, integrator);
            let mut q = vec![0.0; n];
            q[0] = std::f64::consts::FRAC_PI_2;
            let body = ArticulatedBody::new("chain", chain(n, 1.0, 0.2)).with_positions(&q).unwrap();
            world.add(body).unwrap();
            let e0 = world.energy().total();
            let drop = 9.81 * 0.2 * (n * n) as f64 / 2.0;
            let mut worst: f64 = 0.0;
            for _ in 0..240 * 10 {
                world.step().unwrap();
                worst = worst.max((world.energy().total() - e0).abs());
            }
            println!("{stepper} {integrator:?} {n} links: {:.2e}", worst / drop);
        }
    }
}

#[test]
fn a_limit_stops_the_swing() {
    let mut world = world(1.0 / 240.0, "time_stepping", Integrator::Verlet);
    let mut body = ArticulatedBody::new("chain", chain(2, 1.0, 0.2)).with_positions(&[1.5, 0.0]).unwrap();
    body.set_freedom(0, Freedom { limits: Some([-0.3, 2.0]), ..Freedom::default() }).unwrap();
    let id = world.add(body).unwrap();
    let mut least: f64 = 0.0;
    for _ in 0..240 * 5 {
        world.step().unwrap();
        least = least.min(world.state_of(id).unwrap()[0] + 0.3);
    }
    println!("past the limit by {least:.2e}");
    assert!(least > -1e-4);
}

#[test]
fn drives_hold_and_turn() {
    for stepper in ["time_stepping", "backtracking"] {
        let mut world = world(1.0 / 240.0, stepper, Integrator::Verlet);
        let mut body = ArticulatedBody::new("arm", chain(3, 1.0, 0.3));
        let position = Drive::Position { stiffness: 400.0, damping: 40.0, target: 0.0, velocity: 0.0, limit: f64::INFINITY };
        body.set_freedom(0, Freedom { drive: position, ..Freedom::default() }).unwrap();
        body.set_freedom(1, Freedom { drive: Drive::Velocity { target: 0.5, limit: f64::INFINITY }, ..Freedom::default() }).unwrap();
        body.set_freedom(2, Freedom { friction: 5.0, damping: 0.1, ..Freedom::default() }).unwrap();
        let id = world.add(body).unwrap();
        for k in 0..960 {
            world.step().unwrap();
            if k < 4 || k > 956 {
                println!("{:?}", world.state_of(id).unwrap());
            }
        }
        let x = world.state_of(id).unwrap();
        println!("{stepper} {x:?} {:?}", world.report());
        assert!((x[1] - 2.0).abs() < 2e-3);
    }
}

fn ball_and_floor(world: &mut World, articulated: bool) -> ObjectId {
    world.add_static(tumble_core::RigidBody::fixture("floor", Shape::half_space()).surface(0.6, 0.5)).unwrap();
    let shape = Shape::cuboid(Vec3::new(0.1, 0.2, 0.3)).unwrap();
    let solid = tumble_core::RigidBody::with_mass("box", shape.clone(), 2.0).unwrap();
    let pose = Pose::new(Vec3::new(0.0, 0.0, 1.0), Vec3::new(0.3, 0.5, 0.1));
    let (v, w) = (Vec3::new(0.5, 0.2, -1.0), Vec3::new(1.0, 2.0, 3.0));
    if !articulated {
        return world.add(solid.at(pose).moving(v, w).surface(0.6, 0.5)).unwrap();
    }
    let mut builder = ModelBuilder::new();
    builder.link("box", None, Joint::Floating, Pose::identity(), LinkMass { mass: 2.0, center: Vec3::zeros(), inertia: *solid.inertia() });
    let mut body = ArticulatedBody::new("box", builder.build().unwrap()).at(pose).with_velocities(&[w.x, w.y, w.z, v.x, v.y, v.z]).unwrap();
    let mut collider = Collider::new(shape, Pose::identity());
    collider.material = tumble_core::Material { restitution: 0.6, friction: 0.5 };
    body.add_collider("box", collider).unwrap();
    world.add(body).unwrap()
}

#[test]
fn one_floating_link_is_a_rigid_body() {
    for stepper in ["time_stepping", "backtracking"] {
        let [mut a, mut b] = [false, true].map(|articulated| {
            let mut world = world(1.0 / 240.0, stepper, Integrator::Verlet);
            ball_and_floor(&mut world, articulated);
            world
        });
        for frame in 0..480 {
            a.step().unwrap();
            b.step().unwrap();
            if frame % 48 == 0 {
                let (pa, pb) = (a.sites()[1].pose, b.sites()[1].pose);
                println!("{stepper} {frame}: {:.2e} {:.2e}", (pa.translation.vector - pb.translation.vector).norm(), pa.rotation.angle_to(&pb.rotation));
            }
        }
    }
}

#[test]
fn adaptive_chain_energy() {
    for n in [5, 10] {
        let mut world = world(1.0 / 60.0, "backtracking", Integrator::DormandPrince);
        let mut q = vec![0.0; n];
        q[0] = std::f64::consts::FRAC_PI_2;
        world.add(ArticulatedBody::new("chain", chain(n, 1.0, 0.2)).with_positions(&q).unwrap()).unwrap();
        let e0 = world.energy().total();
        let drop = 9.81 * 0.2 * (n * n) as f64 / 2.0;
        let (mut worst, mut inner): (f64, u32) = (0.0, 0);
        for _ in 0..60 * 10 {
            inner += world.step().unwrap().inner_steps;
            worst = worst.max((world.energy().total() - e0).abs());
        }
        println!("adaptive {n} links, 10 s: {:.2e}, {inner} inner steps", worst / drop);
    }
}

/// A floating chain of capsules joined by ball joints, along x, its middle at `center`.
fn loose_chain(links: usize, length: f64, radius: f64, mass: f64, center: Vec3) -> ArticulatedBody {
    let shape = Shape::capsule(radius, 0.5 * length - radius).unwrap();
    let along = Pose::new(Vec3::new(0.5 * length, 0.0, 0.0), Vec3::new(0.0, std::f64::consts::FRAC_PI_2, 0.0));
    let solid = shape.mass_properties(1.0).unwrap();
    let unit = LinkMass { mass, center: Vec3::zeros(), inertia: solid.inertia * (mass / solid.mass) };
    let mut builder = ModelBuilder::new();
    let mut parent = None;
    for i in 0..links {
        let (joint, x) = if i == 0 { (Joint::Floating, 0.0) } else { (Joint::Spherical, length) };
        parent = Some(builder.link(format!("link {i}"), parent, joint, Pose::translation(x, 0.0, 0.0), unit.seen_from(&along)));
    }
    let start = Pose::translation(center.x - 0.5 * links as f64 * length, center.y, center.z);
    let mut body = ArticulatedBody::new("chain", builder.build().unwrap()).at(start);
    for i in 0..links {
        body.add_collider(&format!("link {i}"), Collider::new(shape.clone(), along)).unwrap();
    }
    body
}

#[test]
fn a_chain_over_a_sphere_comes_to_rest() {
    let mut world = world(1.0 / 240.0, "time_stepping", Integrator::Verlet);
    world.add_static(tumble_core::RigidBody::fixture("floor", Shape::half_space())).unwrap();
    world.add_static(tumble_core::RigidBody::fixture("ball", Shape::sphere(0.3).unwrap()).at(Pose::translation(0.0, 0.0, 0.6))).unwrap();
    let id = world.add(loose_chain(16, 0.1, 0.02, 0.05, Vec3::new(0.03, 0.01, 1.0))).unwrap();
    for frame in 0..240 * 8 {
        let report = *world.step().unwrap();
        if frame % 240 == 239 || frame < 140 && frame > 104 {
            let e = world.energy();
            println!("{:.0} s: kinetic {:.2e} potential {:.4} depth {:.1e} contacts {} unconverged {} residual {:.1e} it {}", world.time(), e.kinetic, e.potential, report.max_penetration, report.contacts, report.unconverged, report.residual, report.iterations);
        }
    }
    let _ = id;
}
