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
