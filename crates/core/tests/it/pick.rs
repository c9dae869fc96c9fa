//! Picking: laws of the damped spring, for any picked body.

use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::{
    ArticulatedBody, Collider, Joint, LinkMass, ModelBuilder, ObjectId, PickForce, RigidBody, Settings, World,
};

const OMEGA: f64 = 10.0;

fn assert_near(what: &str, found: f64, wanted: f64, within: f64) {
    assert!((found - wanted).abs() <= within, "{what} is {found}, not {wanted}");
}

fn world(gravity: f64, dt: f64) -> World {
    World::new(Settings::default().with_gravity(Vec3::new(0.0, 0.0, -gravity)).with_dt(dt)).unwrap()
}

fn held(world: &World, pick: &PickForce) -> Vec3 {
    let part_state = world.part_state(pick.id, pick.part).unwrap();
    part_state.pose.rotation * pick.point + part_state.position()
}

fn drag(world: &mut World, pick: &PickForce, seconds: f64) {
    let steps = (seconds / world.settings().dt).round() as usize;
    for _ in 0..steps {
        pick.apply(world).unwrap();
        world.step().unwrap();
    }
}

fn crate_of(world: &mut World, mass: f64) -> ObjectId {
    let shape = Shape::cuboid(Vec3::new(0.6, 0.4, 0.2)).unwrap();
    world
        .add(RigidBody::new(shape).with_name("crate").with_mass(mass).with_pose(Pose::translation(0.0, 0.0, 5.0)))
        .unwrap()
}

#[test]
fn a_middle_that_is_pulled_follows_the_critically_damped_spring() {
    // d(t) = d₀ (1 + ωt) e^(−ωt), whatever the mass
    for mass in [1e-3, 1e3] {
        let mut world = world(0.0, 1e-3);
        let id = crate_of(&mut world, mass);
        let pick = PickForce { id, part: 0, point: Vec3::zeros(), target: Vec3::new(1.0, 0.0, 5.0), frequency: OMEGA };
        for tenths in 1..=5 {
            drag(&mut world, &pick, 0.1);
            let wt = OMEGA * 0.1 * tenths as f64;
            let left = (pick.target - held(&world, &pick)).x;
            assert!((left - (1.0 + wt) * (-wt).exp()).abs() < 0.01, "{mass} kg: {left} m left at ωt = {wt}");
        }
    }
}

#[test]
fn a_body_hangs_at_rest_below_the_hand_by_g_over_omega_squared() {
    let mut world = world(9.81, 1.0 / 240.0);
    let id = crate_of(&mut world, 20.0);
    // held at a corner: it turns until the corner is straight above the middle
    let corner = Vec3::new(0.3, 0.2, 0.1);
    let pick = PickForce { id, part: 0, point: corner, target: Vec3::new(0.3, 0.2, 5.1), frequency: OMEGA };
    // its swings decay slowly: sideways the corner's effective mass is small, and the spring in
    // proportion
    drag(&mut world, &pick, 150.0);
    let (point, middle) = (held(&world, &pick), world.part_state(id, 0).unwrap().position());
    // the implicit step requires (1 + ωh)² times that distance
    let sag = 9.81 / (OMEGA * OMEGA) * (1.0 + OMEGA / 240.0f64).powi(2);
    assert_near("sag", (pick.target - point).z, sag, 1e-6);
    assert_near("aside", (point - middle).xy().norm(), 0.0, 1e-4);
    assert_near("arm", (point - middle).z, corner.norm(), 1e-6);
    assert!(world.energy().kinetic < 1e-6);
}

#[test]
fn a_pull_is_stable_at_any_length_of_the_step() {
    for dt in [0.001, 1.0 / 60.0, 0.1, 1.0] {
        let mut world = world(0.0, dt);
        let id = crate_of(&mut world, 2.0);
        let pick = PickForce {
            id,
            part: 0,
            point: Vec3::new(0.3, 0.0, 0.0),
            target: Vec3::new(0.0, 2.0, 5.0),
            frequency: OMEGA,
        };
        drag(&mut world, &pick, 200.0 * dt.max(0.05));
        let left = (pick.target - held(&world, &pick)).norm();
        assert!(left < 1e-3, "dt {dt}: {left} m left");
    }
}

#[test]
fn static_bodies_are_not_pulled_and_removed_ones_are_reported() {
    let mut world = world(9.81, 0.01);
    let ground = world.add_static(RigidBody::fixed(Shape::half_space()).with_name("ground")).unwrap();
    let pick =
        PickForce { id: ground, part: 0, point: Vec3::zeros(), target: Vec3::new(0.0, 0.0, 9.0), frequency: OMEGA };
    assert_eq!(pick.apply(&mut world).unwrap().force, Vec3::zeros());
    let id = crate_of(&mut world, 1.0);
    assert!(PickForce { id, part: 1, ..pick }.apply(&mut world).is_err(), "no such part");
    assert!(PickForce { id, target: Vec3::repeat(f64::NAN), ..pick }.apply(&mut world).is_err(), "not finite");
    world.remove(id).unwrap();
    assert!(PickForce { id, ..pick }.apply(&mut world).is_err(), "gone");
}

#[test]
fn a_pendulum_swings_to_the_hand_in_the_plane_in_which_it_can() {
    // a revolute joint about y at the origin, the bob 0.5 m below; the target is 30 degrees off the
    // plane and farther out: the nearest direction in the plane is reached
    let mut world = world(0.0, 1.0 / 240.0);
    let mut builder = ModelBuilder::new();
    let bob =
        LinkMass { inertia: 1e-3 * nalgebra::Matrix3::identity(), ..LinkMass::point(1.0, Vec3::new(0.0, 0.0, -0.5)) };
    builder.link("rod", None, Joint::revolute(Vec3::y()), Pose::identity(), bob);
    let mut body = ArticulatedBody::new("pendulum", builder.build().unwrap());
    body.add_collider("rod", Collider::new(Shape::sphere(0.05).unwrap(), Pose::translation(0.0, 0.0, -0.5))).unwrap();
    let id = world.add(body).unwrap();
    let pick = PickForce {
        id,
        part: 0,
        point: Vec3::new(0.0, 0.0, -0.5),
        target: Vec3::new(0.7, 0.4, -0.7),
        frequency: OMEGA,
    };
    drag(&mut world, &pick, 5.0);
    let point = held(&world, &pick);
    let side = 0.5 * 0.5f64.sqrt();
    assert_near("x", point.x, side, 1e-4);
    assert_near("y", point.y, 0.0, 1e-12);
    assert_near("z", point.z, -side, 1e-4);
}
