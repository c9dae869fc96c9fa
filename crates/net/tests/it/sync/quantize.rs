//! A pose in 20 bytes stays within the stated error.

use crate::support::Dice;
use tumble_core::collide::{Pose, Quat, Vec3};
use tumble_net::sync::Mirror;
use tumble_net::sync::quantize::{POSE_BYTES, POSITION_ERROR_M, ROTATION_ERROR_RAD, put_pose};

/// Returns the pose that arrives after a whole message: a world of one body, published and
/// mirrored.
fn through(pose: Pose) -> Pose {
    use tumble_core::{RigidBody, Settings, World, collide::Shape};
    let world = |pose| {
        let mut world = World::new(Settings::default().with_dt(1.0 / 60.0)).unwrap();
        world.add(RigidBody::new(Shape::sphere(1.0).unwrap()).with_name("b").with_mass(1.0).with_pose(pose)).unwrap();
        world
    };
    let (there, mut publisher) = (world(pose), tumble_net::sync::Publisher::new(&world(Pose::identity()), false, 0));
    // the id of the base's body equals that of the world's body: both are the first of their world
    let published = publisher.publish(&there, &Default::default(), 1).unwrap();
    let mut mirror = Mirror::new(world(Pose::identity()));
    mirror.apply_snapshot(&publisher.snapshot()).unwrap();
    mirror.apply_state(1, there.time(), &published.state).unwrap();
    assert_eq!(mirror.hash(), published.hash);
    let body = mirror.world().find("b").unwrap();
    mirror.world().part_state(body, 0).unwrap().pose
}

fn random(dice: &mut Dice) -> Pose {
    let mut unit = || dice.below(2_000_001) as f64 / 1e6 - 1.0;
    let q = nalgebra::Quaternion::new(unit(), unit(), unit(), unit());
    let p = Vec3::new(unit(), unit(), unit()) * 30_000.0;
    Pose::from_parts(p.into(), Quat::from_quaternion(if q.norm() > 0.1 { q } else { nalgebra::Quaternion::identity() }))
}

/// Returns the angle between two rotations, from the chord of their quaternions: an arc cosine
/// would lose small angles.
fn angle(a: &Quat, b: &Quat) -> f64 {
    let (a, b) = (a.coords, b.coords);
    4.0 * ((a - b).norm().min((a + b).norm()) / 2.0).asin()
}

#[test]
fn the_error_of_a_pose_is_within_what_is_stated() {
    let (mut dice, mut worst) = (Dice(5), [0.0f64; 2]);
    for _ in 0..2000 {
        let pose = random(&mut dice);
        let sent = through(pose);
        worst[0] = worst[0].max((pose.translation.vector - sent.translation.vector).amax());
        worst[1] = worst[1].max(angle(&pose.rotation, &sent.rotation));
        assert!((sent.rotation.norm() - 1.0).abs() < 1e-15);
    }
    assert!(worst[0] <= POSITION_ERROR_M && worst[1] <= ROTATION_ERROR_RAD, "{worst:?}");
    assert!(
        worst[0] > 0.9 * POSITION_ERROR_M && worst[1] > 0.3 * ROTATION_ERROR_RAD,
        "the bound is far from what happens: {worst:?}"
    );
}

/// If components are equal, one bit decides which one is left out; if three are equal, the error is
/// largest.
#[test]
fn corners_of_the_range_are_within_it_too() {
    for signs in 0..16 {
        for zeros in 0..15 {
            let set_partitioned = |k: u32| {
                if zeros >> k & 1 == 1 {
                    0.0
                } else if signs >> k & 1 == 1 {
                    -1.0
                } else {
                    1.0
                }
            };
            let rotation = Quat::from_quaternion(nalgebra::Quaternion::new(
                set_partitioned(0),
                set_partitioned(1),
                set_partitioned(2),
                set_partitioned(3),
            ));
            let sent = through(Pose::from_parts(Vec3::zeros().into(), rotation));
            assert!(angle(&rotation, &sent.rotation) <= ROTATION_ERROR_RAD, "{rotation:?}");
        }
    }
    assert_eq!(through(Pose::identity()), Pose::identity());
    assert_eq!(
        through(Pose::translation(-1.5, 2.25, 1000.0 + 1.0 / 65536.0)).translation.vector,
        Vec3::new(-1.5, 2.25, 1000.0 + 1.0 / 65536.0)
    );
}

#[test]
fn what_is_far_away_saturates_and_says_so() {
    let mut out = Vec::new();
    assert!(put_pose(&mut out, &Pose::translation(32_767.0, -32_767.0, 0.0)));
    assert!(!put_pose(&mut out, &Pose::translation(0.0, -1e9, 0.0)));
    assert_eq!(out.len(), 2 * POSE_BYTES);
    assert_eq!(&out[24..28], i32::MIN.to_le_bytes());
}
