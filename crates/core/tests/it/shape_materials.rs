//! Surface constants of single parts of a compound: motions in closed form.

use tumble_core::collide::{CompoundPart, Pose, Quat, Shape, Vec3};
use tumble_core::prelude::*;
use tumble_core::{LockedAxes, ObjectId, PairMaterial, PairSide, QueryFilter, Ray};

const G: f64 = 9.81;

fn of_friction(friction: f64) -> Material {
    Material { friction, ..Material::default() }
}

/// Returns a world with a floor of friction 1.
fn world(stepper: &str) -> World {
    let mut world = World::new(Settings::default().with_dt(1.0 / 500.0)).unwrap();
    world.set_stepper(tumble_core::stepper_by_name(stepper).unwrap());
    world.add_static(RigidBody::fixed(Shape::half_space()).with_material(of_friction(1.0))).unwrap();
    world
}

/// A sled of 2 kg on two round runners along x at y = ±0.5 m, with their friction.
fn sled(frictions: [f64; 2]) -> RigidBody {
    let along_x = Quat::from_axis_angle(&Vec3::y_axis(), std::f64::consts::FRAC_PI_2);
    let runner = |y: f64| {
        let pose = Pose::from_parts(Vec3::new(0.0, y, 0.05).into(), along_x);
        CompoundPart::new(Shape::capsule(0.05, 0.8).unwrap(), pose)
    };
    let deck = CompoundPart::new(Shape::cuboid(Vec3::new(0.6, 0.9, 0.06)).unwrap(), Pose::translation(0.0, 0.0, 0.12));
    let parts = vec![deck, runner(0.5), runner(-0.5)];
    let body = RigidBody::new(Shape::compound(parts).unwrap()).with_mass(2.0).with_velocity(20.0 * Vec3::x());
    let [left, right] = frictions.map(of_friction);
    body.with_shape_material(1, left).with_shape_material(2, right)
}

/// The rule is the geometric mean: a runner of friction μ² slides with μ on the floor of friction 1.
fn squared(frictions: [f64; 2]) -> [f64; 2] {
    frictions.map(|mu| mu * mu)
}

#[test]
fn a_sled_is_braked_by_the_friction_of_each_runner() {
    for stepper in ["time_stepping", "backtracking"] {
        let mut world = world(stepper);
        let locked = LockedAxes { rotation: [false, false, true], ..LockedAxes::default() };
        let id = world.add(sled(squared([0.1, 0.5])).with_locked(locked)).unwrap();
        for _ in 0..500 {
            world.step().unwrap();
        }
        let speed = world.body(id).unwrap().velocity().x;
        let wanted = 20.0 - 0.5 * (0.1 + 0.5) * G;
        assert!((speed - wanted).abs() < 1e-6, "{stepper}: {speed} instead of {wanted}");
    }
}

#[test]
fn a_sled_turns_towards_its_rough_runner() {
    let mut world = world("time_stepping");
    let body = sled(squared([0.1, 0.5]));
    let inertia = body.inertia().m33;
    let id = world.add(body).unwrap();
    let time = 0.05;
    for _ in 0..25 {
        world.step().unwrap();
    }
    // each runner carries half of the weight; lateral sliding by the turn is 1e-3 of the speed
    let turn = 0.5 * 2.0 * G * (0.1 - 0.5) * 0.5 / inertia;
    let found = world.body(id).unwrap().angular_velocity().z;
    assert!(turn < 0.0 && (found / (-turn * time) + 1.0).abs() < 0.01, "{found} instead of {}", turn * time);
}

/// A bar with a ball at each end along x, locked against turning.
fn bar() -> RigidBody {
    let ball = |x: f64| CompoundPart::new(Shape::sphere(0.1).unwrap(), Pose::translation(x, 0.0, 0.0));
    let locked = LockedAxes { rotation: [true; 3], ..LockedAxes::default() };
    RigidBody::new(Shape::compound(vec![ball(-0.5), ball(0.5)]).unwrap()).with_mass(1.0).with_locked(locked)
}

fn height_after(mut world: World, id: ObjectId, seconds: f64) -> f64 {
    for _ in 0..(seconds * 500.0) as usize {
        world.step().unwrap();
    }
    world.body(id).unwrap().position().z
}

#[test]
fn adhesion_of_one_part_holds_a_body_under_a_ceiling() {
    for (adhesion, holds) in [(1.2 * G, true), (0.8 * G, false)] {
        let mut world = World::new(Settings::default().with_dt(1.0 / 500.0)).unwrap();
        let ceiling = RigidBody::fixed(Shape::cuboid(Vec3::new(4.0, 4.0, 0.2)).unwrap());
        world.add_static(ceiling.with_pose(Pose::translation(0.0, 0.0, 2.1))).unwrap();
        let sticky = Material { adhesion, ..Material::default() };
        let body = bar().with_pose(Pose::translation(0.0, 0.0, 1.9)).with_shape_material(1, sticky);
        let id = world.add(body).unwrap();
        let height = height_after(world, id, 0.5);
        assert_eq!((height - 1.9).abs() < 1e-6, holds, "{adhesion} N: {height}");
    }
}

#[test]
fn a_part_may_ignore_what_the_others_touch() {
    let mut world = world("time_stepping");
    let floor = world.ids()[0];
    let ghost = Material { id: 7, ..Material::default() };
    let unlocked = bar().with_locked(LockedAxes::default());
    let id = world.add(unlocked.with_pose(Pose::translation(0.0, 0.0, 0.1)).with_shape_material(1, ghost)).unwrap();
    let apart = PairMaterial { collides: Some(false), ..PairMaterial::default() };
    world.set_pair_material(PairSide::Material(7), PairSide::Object(floor), apart).unwrap();
    for _ in 0..100 {
        world.step().unwrap();
        assert!(world.contacts().iter().all(|contact| contact.shape_b == 0));
    }
    let end = world.body(id).unwrap().pose() * Vec3::new(0.5, 0.0, 0.0);
    assert!(end.z < 0.0, "the end without contacts is below the floor: {end}");
}

#[test]
fn materials_of_parts_are_checked_archived_and_changed() {
    let wrong = |body: RigidBody| body.validate().unwrap_err().to_string();
    assert!(wrong(bar().with_shape_material(2, Material::default())).contains("below the number of parts"));
    assert!(
        wrong(RigidBody::new(Shape::sphere(1.0).unwrap()).with_shape_material(0, of_friction(1.0))).contains("index")
    );
    assert!(wrong(bar().with_shape_material(0, of_friction(-1.0))).contains("friction"));
    let mut world = world("time_stepping");
    let id = world.add(sled(squared([0.1, 0.5]))).unwrap();
    for _ in 0..20 {
        world.step().unwrap();
    }
    let mut copies = [world.fork(), World::from_archive(&world.archive(&[]).unwrap(), &mut |_| None).unwrap()];
    let after = |world: &mut World| {
        for _ in 0..50 {
            world.step().unwrap();
        }
        world.state().to_vec()
    };
    let wanted = after(&mut world);
    assert!(copies.iter_mut().all(|copy| after(copy) == wanted), "the same bits");
    // a change acts from the next step on: without friction nothing brakes
    world
        .change_body(id, |body| {
            (1..3).for_each(|shape| body.set_shape_material(shape, Some(of_friction(0.0))));
        })
        .unwrap();
    let before = world.body(id).unwrap().velocity();
    after(&mut world);
    assert!((world.body(id).unwrap().velocity() - before).xy().norm() < 1e-9);
    let body = world.get::<RigidBody>(id).unwrap();
    assert_eq!((body.shape_material(0), body.shape_material(1).friction), (body.material, 0.0));
}

/// A material of one shape that another body ignores is ignored in overlaps, by sensors, and by queries as that body.
#[test]
fn an_ignored_shape_is_not_found_by_overlaps_sensors_and_queries() {
    for ignored in [false, true] {
        let mut world = World::new(Settings::default().with_gravity(Vec3::zeros())).unwrap();
        let bar = world.add(bar().with_shape_material(1, Material { id: 7, ..Material::default() })).unwrap();
        let at = |x: f64| Pose::translation(x, 0.0, 0.0);
        let probe = RigidBody::fixed(Shape::sphere(0.1).unwrap()).with_pose(at(0.55));
        let probe = world.add_static(probe).unwrap();
        let gate = RigidBody::fixed(Shape::sphere(0.3).unwrap()).with_pose(at(0.5)).with_sensor(true);
        let gate = world.add_static(gate).unwrap();
        if ignored {
            let apart = PairMaterial { collides: Some(false), ..PairMaterial::default() };
            for other in [probe, gate] {
                world.set_pair_material(PairSide::Material(7), PairSide::Object(other), apart).unwrap();
            }
        }
        assert_eq!(world.overlapping_pairs(0.0).len(), usize::from(!ignored));
        let filter = QueryFilter::default().acting_as(probe);
        let hit = |x: f64| {
            let ray = Ray { origin: Vec3::new(x, 0.0, 1.0), direction: -Vec3::z(), max_distance: 2.0 };
            world.cast_ray(&ray, &filter).map(|hit| hit.id)
        };
        assert_eq!([-0.5, 0.5].map(hit), [Some(bar), (!ignored).then_some(bar)]);
        world.step().unwrap();
        assert_eq!(world.touching(gate).len(), usize::from(!ignored));
        assert_eq!(world.contacts().len(), usize::from(!ignored));
    }
}
