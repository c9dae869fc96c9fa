//! When and how bodies that are still apart meet within a step: conservative advancement along free motion.
//!
//! A speculative contact freezes the normal of the step's start. A ball that flies past another would be stopped by it, and one that
//! strikes off center would bounce along the wrong line. So, where bodies are fast, a contact that closes within the step is followed to where the surfaces meet:
//!
//! ```text
//! t ← 0;  repeat   t += root of  gap + v_n·τ + ½·a_n·τ² = 0,   then gap and normal anew by the narrow phase at the poses coasted by t
//! ```
//!
//! Between convex bodies the gap along the present normal closes no later than the bodies meet, so no step overshoots. A contact that never
//! closes is dropped. One that does takes the normal and the lever arms of that moment, and the gap that free motion closes by then.

use crate::contact::detect::ContactConstraint;
use crate::object::collidable::{Collidable, ContactFrame};
use crate::object::part_state::PartState;
use crate::rigid::rotation::turn;
use crate::world::Core;
use nalgebra::Translation3;
use tumble_collide::{Contact, NormalFrom, Pose, Shape, Vec3};

/// A relative displacement of less than this share of the smaller body leaves the normal of the start good enough.
const SHORT: f64 = 0.1;
/// Looks at most between the meeting and the end of the step.
const MAX_SAMPLES: f64 = 32.0;
/// Advances at most; what has not met by then is near enough.
const ADVANCES: u32 = 12;

/// Follows every touch of fast bodies that is apart by more than the drift tolerance and closes within `h`; drops those that miss.
pub(super) fn time_contacts(core: &Core, h: f64, contact_constraints: &mut Vec<ContactConstraint>) {
    let near = core.settings.drift_tolerance;
    let mut found = Vec::new();
    contact_constraints.retain_mut(|constraint| {
        let (a, b) =
            (&core.derived.part_states[constraint.a as usize], &core.derived.part_states[constraint.b as usize]);
        let (Some(shape_a), Some(shape_b)) = (shape(core, constraint.a), shape(core, constraint.b)) else {
            return true;
        };
        let size = shape_a.bounding_radius().min(shape_b.bounding_radius());
        if h * (a.velocity - b.velocity).norm() < SHORT * size {
            return true;
        }
        if closing_time(constraint.contact.gap, &constraint.contact, a, b, 0.0).is_none_or(|t| t > h) {
            return true;
        }
        if shape_a.has_tree() || shape_b.has_tree() {
            return true; // a tree's contacts come and go with its leaves
        }
        let (side_a, side_b) = ((shape_a, a), (shape_b, b));
        let Some((time, contact)) = follow(constraint, side_a, side_b, h, near, &mut found) else { return false };
        let rounded =
            matches!(contact.normal_from, NormalFrom::CorePoints | NormalFrom::LineOfA(_) | NormalFrom::LineOfB(_));
        let samples = (h * (a.velocity - b.velocity).norm() / (SHORT * size)).min(MAX_SAMPLES).ceil();
        let end = if rounded { glance(side_a, side_b, time, h, samples, near, &mut found) } else { None };
        let (time, contact) = end.map_or((time, contact), |end| (h, end));
        if time > 0.0 {
            shift_to_impact(constraint, &contact, a, b, time);
        }
        true
    });
}

/// Where bodies that have met at `time` go on to the end of the step without overlap, as a ball does that rolls over the seam of two boxes, the
/// contact of the end holds: its normal is not that of the edge which the ball never strikes. `None` where they overlap on the way.
fn glance(
    a: (&Shape, &PartState),
    b: (&Shape, &PartState),
    time: f64,
    h: f64,
    samples: f64,
    near: f64,
    found: &mut Vec<Contact>,
) -> Option<Contact> {
    let mut end = None;
    for sample in 1..=samples as u32 {
        let t = time + (h - time) * sample as f64 / samples;
        found.clear();
        tumble_collide::contacts(
            a.0,
            &pose_after_free_motion(a.1, t),
            b.0,
            &pose_after_free_motion(b.1, t),
            near,
            found,
        );
        end = found.iter().min_by(|x, y| x.gap.total_cmp(&y.gap)).copied();
        if end.is_none_or(|contact| contact.gap < -near) {
            return None;
        }
    }
    end
}

fn shape(core: &Core, part_state: u32) -> Option<&Shape> {
    let owner = core.owners[part_state as usize];
    let body: &dyn Collidable = core.table.placed[owner.place as usize].object.collidable()?;
    body.shape(owner.part as usize)
}

/// The moment at which the touch has closed to `near`, and the contact there; `None` where it does not within `h`.
fn follow(
    constraint: &ContactConstraint,
    a: (&Shape, &PartState),
    b: (&Shape, &PartState),
    h: f64,
    near: f64,
    found: &mut Vec<Contact>,
) -> Option<(f64, Contact)> {
    let (mut time, mut contact) = (0.0, constraint.contact);
    for _ in 0..if contact.gap <= near { 0 } else { ADVANCES } {
        // aim at half the distance that counts as near, so that the last advance is not for ever short of it
        time += closing_time(contact.gap - 0.5 * near, &contact, a.1, b.1, time)?;
        if time > h {
            return None;
        }
        let (pose_a, pose_b) = (pose_after_free_motion(a.1, time), pose_after_free_motion(b.1, time));
        found.clear();
        tumble_collide::contacts(a.0, &pose_a, b.0, &pose_b, constraint.contact.gap + near, found);
        let same = found.iter().find(|c| c.feature == constraint.contact.feature);
        let nearest = found.iter().min_by(|x, y| x.gap.total_cmp(&y.gap));
        contact = *same.or(nearest)?;
        if contact.gap <= near {
            break;
        }
    }
    Some((time, contact))
}

/// Time from `t` on until `gap` closes along the contact's normal in free motion.
fn closing_time(gap: f64, contact: &Contact, a: &PartState, b: &PartState, t: f64) -> Option<f64> {
    let spin = |s: &PartState| s.velocity_at(&contact.point) - s.velocity;
    let v = contact.normal.dot(&(a.velocity - b.velocity + t * (a.acceleration - b.acceleration) + spin(a) - spin(b)));
    let acceleration = contact.normal.dot(&(a.acceleration - b.acceleration));
    if gap <= 0.0 {
        return (v < 0.0).then_some(0.0);
    }
    let root = v * v - 2.0 * acceleration * gap;
    let time = 2.0 * gap / (-v + root.max(0.0).sqrt());
    (root >= 0.0 && time > 0.0).then_some(time)
}

/// A pose after `t` seconds of free motion.
pub(crate) fn pose_after_free_motion(part_state: &PartState, t: f64) -> Pose {
    let position = part_state.position() + t * part_state.velocity + 0.5 * t * t * part_state.acceleration;
    Pose::from_parts(Translation3::from(position), turn(&part_state.pose.rotation, &part_state.angular_velocity, t))
}

/// Gives the touch the contact of the moment `t`, seen from the start: lever arms of then, and the gap that free motion closes by then.
pub(crate) fn shift_to_impact(
    constraint: &mut ContactConstraint,
    contact: &Contact,
    a: &PartState,
    b: &PartState,
    t: f64,
) {
    let moved = |s: &PartState| pose_after_free_motion(s, t).translation.vector - s.position();
    let (move_a, move_b): (Vec3, Vec3) = (moved(a), moved(b));
    let closed = contact.normal.dot(&(move_a - move_b));
    constraint.contact = Contact {
        point: contact.point - move_a,
        gap: contact.gap - closed,
        feature: constraint.contact.feature,
        ..*contact
    };
    constraint.offset = move_a - move_b;
    constraint.frame = ContactFrame::new(contact.point, contact.normal);
}
