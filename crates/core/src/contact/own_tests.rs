//! Intersection tests of objects' own ([`Intersect`]) instead of those of shapes, and parts that collide on one side
//! only.

use crate::object::Object;
use crate::object::intersect::{Intersect, IntersectPart};
use tumble_collide::{Contact, ContactMode, NormalFrom, Pose, Shape, Vec3, contacts_in_mode};

/// Depth, in bounding radii of the other part, below which a part has passed one that collides on one side only.
const PASSED: f64 = 0.1;

/// A part, and its own test if it has one.
#[derive(Clone, Copy)]
struct Side<'a> {
    object: &'a dyn Object,
    part: usize,
    test: Option<&'a dyn Intersect>,
    /// Unit direction in the frame of a part that collides on one side only.
    one_way: Option<Vec3>,
}

/// The own tests of a pair of parts, A first; `None` for nearly all pairs.
#[derive(Clone, Copy)]
pub(crate) struct OwnTests<'a>(Option<[Side<'a>; 2]>);

impl<'a> OwnTests<'a> {
    /// No tests.
    #[cfg(test)]
    pub const NONE: OwnTests<'static> = OwnTests(None);

    /// Returns the tests of two parts of objects.
    pub fn of(sides: [(&'a dyn Object, usize); 2]) -> OwnTests<'a> {
        let sides = sides.map(|(object, part)| {
            let body = object.collidable();
            let (test, one_way) =
                (body.and_then(|body| body.intersect(part)), body.and_then(|body| body.one_way(part)));
            Side { object, part, test, one_way }
        });
        OwnTests(sides.iter().any(|side| side.test.is_some() || side.one_way.is_some()).then_some(sides))
    }

    /// Returns whether a part has a test.
    pub fn any(&self) -> bool {
        self.0.is_some()
    }

    /// Appends the contacts of two shapes, or those of the tests, within a margin, m.
    pub fn contacts(
        &self,
        mode: ContactMode,
        shapes: [&Shape; 2],
        poses: [&Pose; 2],
        margin: f64,
        out: &mut Vec<Contact>,
    ) {
        let start = out.len();
        let tested = self.0.as_ref().is_some_and(|sides| by_tests(sides, shapes, poses, margin, out));
        if !tested {
            contacts_in_mode(mode, shapes[0], poses[0], shapes[1], poses[1], margin, out);
        }
        if let Some(sides) = &self.0 {
            keep_one_side(sides, shapes, poses, start, out);
        }
    }
}

/// Removes the contacts from `start` on that are on the open side of a part: those without a component of the outward
/// normal along its direction, and those of a part that has passed.
fn keep_one_side(sides: &[Side; 2], shapes: [&Shape; 2], poses: [&Pose; 2], start: usize, out: &mut Vec<Contact>) {
    // the normal points from B to A
    for (k, outward) in [(0, -1.0), (1, 1.0)] {
        let Some(direction) = sides[k].one_way.map(|direction| poses[k].rotation * direction) else { continue };
        let deepest = PASSED * shapes[1 - k].bounding_radius();
        let mut at = 0;
        out.retain(|contact| {
            at += 1;
            at <= start || outward * contact.normal.dot(&direction) > 0.0 && contact.gap > -deepest
        });
    }
}

/// Asks A's test, then B's. Returns false if neither knows the pair.
fn by_tests(sides: &[Side; 2], shapes: [&Shape; 2], poses: [&Pose; 2], margin: f64, out: &mut Vec<Contact>) -> bool {
    let start = out.len();
    let part =
        |k: usize| IntersectPart { object: sides[k].object, part: sides[k].part, shape: shapes[k], pose: poses[k] };
    let asked = (0..2).find(|&k| sides[k].test.is_some_and(|test| test.contacts(&part(k), &part(1 - k), margin, out)));
    if asked == Some(1) {
        out[start..].iter_mut().for_each(|contact| *contact = exchanged(contact));
    }
    asked.is_some()
}

/// Returns a contact with its sides exchanged.
fn exchanged(contact: &Contact) -> Contact {
    let normal_from = match contact.normal_from {
        NormalFrom::FaceOfA => NormalFrom::FaceOfB,
        NormalFrom::FaceOfB => NormalFrom::FaceOfA,
        NormalFrom::LineOfA(line) => NormalFrom::LineOfB(line),
        NormalFrom::LineOfB(line) => NormalFrom::LineOfA(line),
        both => both,
    };
    let (core_a, core_b) = (contact.core_b, contact.core_a);
    let shapes = [contact.shapes[1], contact.shapes[0]];
    Contact { normal: -contact.normal, core_a, core_b, normal_from, shapes, ..*contact }
}
