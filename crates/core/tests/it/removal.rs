//! Joints and sensors go with an object that is removed.

use crate::common::*;
use tumble_core::collide::{Pose, Vec3};
use tumble_core::*;

/// A body with a joint to another one, one to the world, couplings of both, sensors on the body and on a joint, and one
/// against the body; and the same world without the body.
struct Scene {
    world: World,
    body: ObjectId,
    attached: Vec<ObjectId>,
    others: Vec<ObjectId>,
}

fn scene() -> Scene {
    let mut world = world("time_stepping", 1.0 / 240.0);
    let ball = |world: &mut World, name: &str, x: f64| {
        let ball = RigidBody::new(sphere(0.1)).with_name(name).with_mass(1.0);
        world.add(ball.with_pose(Pose::translation(x, 0.0, 1.0))).unwrap()
    };
    let [a, b, c] = [("a", 0.0), ("b", 1.0), ("c", 2.0)].map(|(name, x)| ball(&mut world, name, x));
    let hinge = |world: &mut World, name: &str, a: ObjectId, b: Option<ObjectId>| {
        let at = position(world, a);
        let b = b.map(|b| (b, 0));
        let joint = LoopJoint::revolute_at(name, world, Some((a, 0)), b, at, Vec3::y()).unwrap();
        world.add(joint).unwrap()
    };
    let (between, to_world) = (hinge(&mut world, "between", a, Some(b)), hinge(&mut world, "to world", b, None));
    let other = hinge(&mut world, "other", c, None);
    let joints = [to_world, other].map(JointRef::LoopJoint);
    let mimic = world.add(Mimic::between("mimic", &world, joints, 2.0, 0.0).unwrap()).unwrap();
    let site = |id| Anchor::on(id, 0, Pose::identity());
    let mut sensor = |sensor: Result<Sensor, SensorError>| world.add(sensor.unwrap()).unwrap();
    let on_body = sensor(Sensor::new("on body", SensorKind::Gyroscope, site(b)));
    let on_joint = sensor(Sensor::of_joint("on joint", SensorKind::JointPosition, between));
    let against = sensor(Sensor::new("against", SensorKind::Position, site(c)).and_then(|s| s.relative_to(site(b))));
    let stays = sensor(Sensor::new("stays", SensorKind::Velocimeter, site(c)));
    let attached = vec![between, to_world, mimic, on_body, on_joint, against];
    Scene { world, body: b, attached, others: vec![a, c, other, stays] }
}

#[test]
fn joints_and_sensors_go_with_their_body() {
    for steps in [0, 30] {
        let Scene { mut world, body, attached, others } = scene();
        (0..steps).for_each(|_| _ = world.step().unwrap());
        world.remove(body).unwrap();
        assert!(attached.iter().all(|id| world.object(*id).is_none()));
        assert_eq!(world.ids(), others);
        assert_eq!(world.remove(attached[0]).err(), Some(WorldError::Stale));
        // the bytes of the world read back, and both move on alike
        let mut copy = World::from_archive(&world.archive(&[]).unwrap(), &mut |_| None).unwrap();
        for world in [&mut world, &mut copy] {
            (0..30).for_each(|_| _ = world.step().unwrap());
        }
        assert_eq!(world.save(), copy.save());
    }
}

/// Removing one by one what is attached leaves the same world as removing the body.
#[test]
fn it_is_as_if_they_were_removed_before() {
    let [mut at_once, mut apart] = [scene(), scene()];
    at_once.world.remove(at_once.body).unwrap();
    for id in apart.attached.iter().rev() {
        apart.world.remove(*id).unwrap();
    }
    apart.world.remove(apart.body).unwrap();
    for world in [&mut at_once.world, &mut apart.world] {
        (0..60).for_each(|_| _ = world.step().unwrap());
    }
    assert_eq!(at_once.world.save(), apart.world.save());
}

#[test]
fn couplings_and_sensors_go_with_their_joint() {
    let Scene { mut world, attached, .. } = scene();
    let [between, to_world, mimic, on_body, on_joint, against] = attached[..] else { unreachable!() };
    world.remove(to_world).unwrap();
    assert!(world.object(mimic).is_none() && world.object(between).is_some());
    world.remove(between).unwrap();
    assert!(world.object(on_joint).is_none());
    assert!([on_body, against].iter().all(|id| world.reading(*id).is_some()));
    world.step().unwrap();
}

/// An object of another crate says itself what it belongs to.
#[test]
fn objects_of_other_crates_are_attached_where_they_say_so() {
    #[derive(Clone)]
    struct Label(ObjectId);
    impl Object for Label {
        fn attached_to(&self, other: ObjectId) -> bool {
            self.0 == other
        }
    }
    let mut world = world("time_stepping", 1.0 / 240.0);
    let ball = world.add(RigidBody::new(sphere(0.1)).with_mass(1.0)).unwrap();
    let chain: Vec<ObjectId> = (0..10_000)
        .scan(ball, |on, _| {
            *on = world.add(Label(*on)).unwrap();
            Some(*on)
        })
        .collect();
    let stays = world.add(RigidBody::new(sphere(0.1)).with_mass(1.0)).unwrap();
    world.remove(chain[9_990]).unwrap();
    assert_eq!(world.ids().len(), 2 + 9_990);
    world.remove(chain[9_980]).unwrap();
    assert_eq!((world.ids().len(), world.object(stays).is_some()), (2 + 9_980, true));
}

/// An object without a name has that of the world in its errors.
#[test]
fn errors_name_objects_that_the_world_named() {
    let mut world = world("time_stepping", 1.0 / 240.0);
    let ball = world.add(RigidBody::new(sphere(0.1)).with_mass(1.0)).unwrap();
    let side = Some((ball, 0));
    let joint = LoopJoint::revolute_at("", &world, side, None, Vec3::zeros(), Vec3::z()).unwrap();
    let unnamed = joint.clone().with_limits([1.0, 0.0]).unwrap_err().to_string();
    assert!(unnamed.starts_with("the new loop joint: the lower limit is 1"), "{unnamed}");
    let joint = world.add(joint).unwrap();
    let named = world.get::<LoopJoint>(joint).unwrap().clone().with_limits([1.0, 0.0]).unwrap_err().to_string();
    assert!(named.starts_with("loop joint 'joint 1': the lower limit is 1"), "{named}");
    let sensor = Sensor::new("", SensorKind::Gyroscope, Anchor::on(ball, 0, Pose::identity())).unwrap();
    let unnamed = sensor.clone().with_cutoff(-1.0).unwrap_err().to_string();
    assert_eq!(unnamed, "the new sensor: the cutoff is -1; it must be above 0; infinite for none");
    let sensor = world.add(sensor).unwrap();
    let named = world.get::<Sensor>(sensor).unwrap().clone().with_cutoff(-1.0).unwrap_err().to_string();
    assert!(named.starts_with("sensor 'sensor 2': the cutoff"), "{named}");
}
