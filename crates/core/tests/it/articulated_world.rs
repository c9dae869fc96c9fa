//! Shared parts of the tests of articulated bodies in a world.

use tumble_core::collide::{Mat3, Pose, Shape, Vec3};
use tumble_core::{
    ArticulatedBody, Collider, Integrator, Joint, LinkMass, Model, ModelBuilder, Settings, World, stepper_by_name,
};

/// A uniform thin rod of `length` m along −z from its joint.
pub fn rod(mass: f64, length: f64) -> LinkMass {
    let i = mass * length * length / 12.0;
    LinkMass {
        mass,
        center: Vec3::new(0.0, 0.0, -0.5 * length),
        inertia: Mat3::from_diagonal(&Vec3::new(i, i, 1e-3 * i)),
    }
}

/// Equal links in a chain of revolute joints about y, each `length` m below the previous one; `link
/// 0` is the first.
pub fn hinged(links: usize, length: f64, mass: LinkMass) -> Model {
    let mut builder = ModelBuilder::new();
    let mut parent = None;
    for i in 0..links {
        let placement = if i == 0 { Pose::identity() } else { Pose::translation(0.0, 0.0, -length) };
        parent = Some(builder.link(format!("link {i}"), parent, Joint::revolute(Vec3::y()), placement, mass));
    }
    builder.build().unwrap()
}

/// Rods of 0.2 m and 1 kg, the first turned out by `angle`.
pub fn chain(links: usize, angle: f64) -> ArticulatedBody {
    let mut q = vec![0.0; links];
    q[0] = angle;
    ArticulatedBody::new("chain", hinged(links, 0.2, rod(1.0, 0.2))).with_positions(&q).unwrap()
}

/// A floating chain of capsules joined by spherical joints, along x, its middle at `center`; its
/// links are 0.1 m long, 2 cm thick and of 50 g.
pub fn loose_chain(links: usize, center: Vec3, friction: f64) -> ArticulatedBody {
    let (length, radius, mass) = (0.1, 0.02, 0.05);
    let shape = Shape::capsule(radius, length - 2.0 * radius).unwrap();
    let along = Pose::new(Vec3::new(0.5 * length, 0.0, 0.0), Vec3::new(0.0, std::f64::consts::FRAC_PI_2, 0.0));
    let solid = shape.mass_properties(1.0).unwrap();
    let unit = LinkMass { mass, center: Vec3::zeros(), inertia: solid.inertia * (mass / solid.mass) };
    let mut builder = ModelBuilder::new();
    let mut parent = None;
    for i in 0..links {
        let (joint, x) = if i == 0 { (Joint::Floating, 0.0) } else { (Joint::Spherical, length) };
        parent = Some(builder.link(
            format!("link {i}"),
            parent,
            joint,
            Pose::translation(x, 0.0, 0.0),
            unit.seen_from(&along),
        ));
    }
    let start = Pose::translation(center.x - 0.5 * links as f64 * length, center.y, center.z);
    let mut body = ArticulatedBody::new("chain", builder.build().unwrap()).with_pose(start);
    for i in 0..links {
        let mut collider = Collider::new(shape.clone(), along);
        collider.material.friction = friction;
        body.add_collider(&format!("link {i}"), collider).unwrap();
    }
    body
}

/// An empty world with gravity along −z.
pub fn world(dt: f64, stepper: &str, integrator: Integrator) -> World {
    let mut world = World::new(Settings::default().with_dt(dt).with_integrator(integrator)).unwrap();
    world.set_stepper(stepper_by_name(stepper).unwrap());
    world
}

/// The adaptive integrator in the backtracking stepper.
pub fn adaptive(dt: f64, tolerance: f64) -> World {
    let mut world = world(dt, "backtracking", Integrator::DormandPrince);
    world.set_settings(world.settings().with_integrator_tolerance(tolerance)).unwrap();
    world
}

/// Steps for the given time.
pub fn run(world: &mut World, seconds: f64) {
    for _ in 0..(seconds / world.settings().dt).round() as usize {
        world.step().unwrap();
    }
}
