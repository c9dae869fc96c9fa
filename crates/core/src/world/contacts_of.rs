//! Queries of contacts.

use super::{ContactPoint, World};
use crate::world::view::ObjectId;
use tumble_collide::Vec3;

impl World {
    /// Returns the contacts of an object in the last sub-step, on either side; none if it was
    /// removed.
    pub fn contacts_of(&self, id: ObjectId) -> impl Iterator<Item = &ContactPoint> + use<'_> {
        self.contacts().iter().filter(move |contact| contact.a == id || contact.b == id)
    }
}

impl ContactPoint {
    /// Makes a contact that is only shown: between two shapes, each as object, part and number, with point (m), normal from
    /// `b` to `a`, depth (m) and force on `a` (N). Velocity and impulse are zero.
    pub fn shown(
        [(a, part_a, shape_a), (b, part_b, shape_b)]: [(ObjectId, usize, usize); 2],
        point: Vec3,
        normal: Vec3,
        depth: f64,
        force: Vec3,
    ) -> ContactPoint {
        let (velocity, impulse) = (Vec3::zeros(), Vec3::zeros());
        ContactPoint { a, part_a, shape_a, b, part_b, shape_b, point, normal, depth, velocity, impulse, force }
    }

    /// Returns whether the surfaces touch: they overlap or an impulse acts. Contacts are also
    /// detected within a margin, before surfaces touch.
    pub fn is_touching(&self) -> bool {
        self.depth >= 0.0 || self.impulse != Vec3::zeros()
    }

    /// Returns the other object of the contact; `None` if `id` is on neither side.
    pub fn other(&self, id: ObjectId) -> Option<ObjectId> {
        match id {
            id if id == self.a => Some(self.b),
            id if id == self.b => Some(self.a),
            _ => None,
        }
    }
}
