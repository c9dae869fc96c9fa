//! Queries of contacts.

use super::{ContactPoint, World, WorldError};
use crate::world::view::ObjectId;
use tumble_collide::Vec3;

impl World {
    /// Returns the contacts of an object in the last sub-step, on either side; none if it was
    /// removed.
    pub fn contacts_of(&self, id: ObjectId) -> impl Iterator<Item = &ContactPoint> + use<'_> {
        self.contacts().iter().filter(move |contact| contact.a == id || contact.b == id)
    }

    /// Returns the sum of the contact forces of `a` on `b` in the last sub-step, N, world axes, without impacts; zero if they do not
    /// touch. The sum of `b` on `a` is the opposite.
    ///
    /// # Errors
    /// [`WorldError::Stale`] if an object was removed.
    ///
    /// ```
    /// use tumble_core::prelude::*;
    /// let mut world = World::default();
    /// let ground = world.add_static(RigidBody::fixed(Shape::half_space()).with_name("ground"))?;
    /// let ball = RigidBody::new(Shape::sphere(0.1)?).with_name("ball").with_mass(2.0);
    /// let ball = world.add(ball.with_pose(Pose::translation(0.0, 0.0, 0.1)))?;
    /// world.step()?;
    /// assert!((world.contact_force(ground, ball)?.z - 2.0 * 9.81).abs() < 1e-6);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn contact_force(&self, a: ObjectId, b: ObjectId) -> Result<Vec3, WorldError> {
        self.contact_force_of((a, None), (b, None))
    }

    /// As [`contact_force`](Self::contact_force), between some parts of each, such as [those of a
    /// link](crate::ArticulatedBody::parts_of_link), also of one object; `None` stands for all.
    ///
    /// # Errors
    /// [`WorldError::Stale`] if an object was removed.
    pub fn contact_force_of(
        &self,
        a: (ObjectId, Option<&[usize]>),
        b: (ObjectId, Option<&[usize]>),
    ) -> Result<Vec3, WorldError> {
        for (id, _) in [a, b] {
            self.object(id).ok_or(WorldError::Stale)?;
        }
        let of = |(id, parts): (ObjectId, Option<&[usize]>), other: ObjectId, part: usize| {
            id == other && parts.is_none_or(|parts| parts.contains(&part))
        };
        Ok(self.contacts().iter().fold(Vec3::zeros(), |mut sum, c| {
            if of(b, c.a, c.part_a) && of(a, c.b, c.part_b) {
                sum += c.force;
            }
            if of(a, c.a, c.part_a) && of(b, c.b, c.part_b) {
                sum -= c.force;
            }
            sum
        }))
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
