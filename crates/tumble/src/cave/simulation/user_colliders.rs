//! Kinematic colliders of the users (`--user-colliders`): an upright capsule from the floor to the
//! head, and two hands. They push dynamic bodies and are not pushed back.
//!
//! ```text
//! a step moves a collider by at most  v_max · scale · dt  towards its target
//! ```
//!
//! So a tracker that jumps does not hit bodies at an enormous speed.

use crate::failure::Failure;
use tumble::collide::{Pose, Shape, Vec3};
use tumble::dynamics::{Mode, ObjectId, RigidBody, World, WorldError};
use tumble::net::sync::{User, Viewer};

/// Radius of the capsule, m.
const RADIUS_M: f64 = 0.25;
/// Radius of a hand, m.
const HAND_RADIUS_M: f64 = 0.06;
/// Maximum speed of a tracked collider, and of a hand moved by keys, meters of the cave per second.
/// Walking counts for the latter.
const MAX_SPEED_M_PER_S: f64 = 10.0;
const KEY_HAND_SPEED_M_PER_S: f64 = 3.0;
/// Offset from the head to the side, ahead and up: of a hand at rest (within the capsule), and of
/// an extended one.
const AT_REST_M: [f64; 3] = [0.15, 0.0, -0.7];
const EXTENDED_M: [f64; 3] = [0.15, 0.7, -0.25];
/// Left and right.
const SIDES: [(&str, f64); 2] = [("left", -1.0), ("right", 1.0)];

/// Target of a hand.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Hand {
    #[default]
    AtRest,
    /// Extended by a key.
    Extended,
    /// Tracked, in the cave's frame.
    Tracked(Pose),
}

/// Colliders of one user.
struct Colliders {
    capsule: ObjectId,
    hands: [ObjectId; 2],
}

/// Colliders of all users; empty without `--user-colliders`.
#[derive(Default)]
pub struct UserColliders(Vec<Colliders>);

impl UserColliders {
    /// Adds the colliders of each user to the world.
    pub fn add(viewer: &Viewer, world: &mut World) -> Result<UserColliders, Failure> {
        let failed = |e: &dyn std::fmt::Display| Failure::run("a user's body", e);
        let mut all = UserColliders::default();
        for (k, user) in viewer.users.iter().enumerate() {
            let mut add = |name: String, shape: Shape, pose: Pose, drawn: bool| {
                let body = RigidBody::fixed(shape).with_name(name).with_pose(pose);
                // the capsule is not drawn, because the user stands in it
                let body = if drawn { body } else { body.with_visuals(Vec::new()) };
                world.add_boxed(Box::new(body), Mode::Kinematic).map_err(|e| failed(&e))
            };
            let capsule = Shape::capsule(RADIUS_M * viewer.scale, 2.0 * half_length(user) * viewer.scale)
                .map_err(|e| failed(&e))?;
            let capsule = add(format!("user {k}"), capsule, upright(viewer, user), false)?;
            let mut hand = |side: usize| {
                let ball = Shape::sphere(HAND_RADIUS_M * viewer.scale).map_err(|e| failed(&e))?;
                add(
                    format!("user {k} {} hand", SIDES[side].0),
                    ball,
                    in_scene(viewer, &target_pose(user, side, Hand::AtRest)),
                    true,
                )
            };
            all.0.push(Colliders { capsule, hands: [hand(0)?, hand(1)?] });
        }
        Ok(all)
    }

    /// Returns whether an object is one of the colliders.
    pub fn contains(&self, id: ObjectId) -> bool {
        self.0.iter().any(|colliders| colliders.capsule == id || colliders.hands.contains(&id))
    }

    /// Moves the colliders towards their targets for the next step of `dt` seconds. `hands` returns
    /// the targets by user.
    pub fn follow_users(
        &self,
        viewer: &Viewer,
        hands: impl Fn(usize) -> [Hand; 2],
        world: &mut World,
        dt: f64,
    ) -> Result<(), WorldError> {
        for (k, (colliders, user)) in self.0.iter().zip(&viewer.users).enumerate() {
            advance(world, colliders.capsule, upright(viewer, user), MAX_SPEED_M_PER_S * viewer.scale * dt)?;
            for (side, hand) in hands(k).into_iter().enumerate() {
                let max = if matches!(hand, Hand::Tracked(_)) { MAX_SPEED_M_PER_S } else { KEY_HAND_SPEED_M_PER_S };
                advance(
                    world,
                    colliders.hands[side],
                    in_scene(viewer, &target_pose(user, side, hand)),
                    max * viewer.scale * dt,
                )?;
            }
        }
        Ok(())
    }
}

fn advance(world: &mut World, id: ObjectId, target_pose: Pose, max: f64) -> Result<(), WorldError> {
    let at = world.pose(id, 0).ok_or(WorldError::Stale)?.translation.vector;
    let by = target_pose.translation.vector - at;
    let to = at + by * (max / by.norm().max(max));
    world.move_to(id, Pose::from_parts(to.into(), target_pose.rotation))
}

fn in_scene(viewer: &Viewer, pose: &Pose) -> Pose {
    let at = viewer.cave * nalgebra::Point3::from(pose.translation.vector * viewer.scale);
    Pose::from_parts(at.coords.into(), viewer.cave.rotation * pose.rotation)
}

/// Returns the target of a hand in the cave's frame.
fn target_pose(user: &User, side: usize, hand: Hand) -> Pose {
    let [aside, ahead, above] = match hand {
        Hand::Tracked(pose) => return pose,
        Hand::AtRest => AT_REST_M,
        Hand::Extended => EXTENDED_M,
    };
    let head = &user.head;
    // an extended hand follows the direction of view; a hand at rest hangs down
    let offset = match hand {
        Hand::Extended => head.rotation * Vec3::new(SIDES[side].1 * aside, ahead, above),
        _ => {
            let right = head.rotation * Vec3::x();
            let level = Vec3::new(right.x, right.y, 0.0);
            level * (SIDES[side].1 * aside / level.norm().max(1e-3))
                + Vec3::new(0.0, 0.0, above.max(0.1 - head.translation.z))
        }
    };
    Pose::from_parts((head.translation.vector + offset).into(), head.rotation)
}

/// Returns half the length of the straight part of a user's capsule, from the floor to the head,
/// meters of the cave.
fn half_length(user: &User) -> f64 {
    (0.5 * user.head.translation.z - RADIUS_M).max(0.01)
}

/// Returns the target of a user's capsule.
fn upright(viewer: &Viewer, user: &User) -> Pose {
    let mut at = user.head.translation.vector;
    at.z = half_length(user) + RADIUS_M;
    in_scene(viewer, &Pose::from_parts(at.into(), nalgebra::UnitQuaternion::identity()))
}
