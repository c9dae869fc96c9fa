//! The trait of objects with an intersection test of their own (thesis §V.B.5).

use super::Object;
use tumble_collide::{Contact, Pose, Shape};

/// A part that takes part in an intersection test.
#[derive(Clone, Copy)]
pub struct IntersectPart<'a> {
    /// Its object; `(object as &dyn std::any::Any).downcast_ref` returns it as its own type.
    pub object: &'a dyn Object,
    /// Its number in the object.
    pub part: usize,
    /// Its shape in the frame of the part.
    pub shape: &'a Shape,
    /// Its pose in the world.
    pub pose: &'a Pose,
}

impl<'a> IntersectPart<'a> {
    /// Returns the name of its object; empty for one that the world named.
    pub fn name(&self) -> &'a str {
        self.object.name()
    }

    /// Returns the name of the link whose shape it is, as its user named it; `None` for all but articulated bodies.
    pub fn link(&self) -> Option<&'a str> {
        self.object.collidable()?.part_name(self.part)
    }

    /// Returns the [name](super::Collidable::shape_name) of its shape; of a compound, which has several, that of the first.
    pub fn shape_name(&self) -> Option<&'a str> {
        self.object.collidable()?.shape_name(self.part, 0)
    }
}

/// An intersection test of an object's own: the narrow phase of all pairs with a part of it.
///
/// [`Collidable::shape`](super::Collidable::shape) then is a solid around the true surface. The broad phase,
/// sphere casts, rays, distances, particles and pictures see that shape; contacts, sensors and overlaps of bodies are
/// those of the test.
pub trait Intersect: Send + Sync {
    /// Appends all contacts between its part `own` and a part of any object, whose gap is at most `margin`, m.
    /// `own` is side A of them: normals point from `other` towards `own`. Features that stay in contact
    /// keep their [`Contact::feature`], which differs between the contacts of a pair. Depends on the arguments alone.
    ///
    /// Returns false, and appends nothing, if it has no test for the other part: that part's own test is made, or
    /// else the contacts are those of the two shapes.
    fn contacts(&self, own: &IntersectPart, other: &IntersectPart, margin: f64, out: &mut Vec<Contact>) -> bool;
}
