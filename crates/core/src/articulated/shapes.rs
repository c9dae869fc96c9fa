//! The shapes of a link: their numbers, names and surface constants.
//!
//! The shapes of a link are numbered over its colliders in the order of their parts, where the parts of a compound count
//! one by one. A fixed link has shapes of its own, although they move with the link into which it is folded.

use super::body::{ArticulatedBody, ArticulatedError};
use super::collider::Collider;
use crate::BodyError;
use crate::object::{Intersect, Material, ShapeFilter};
use crate::rigid::check_shape_name;
use std::sync::Arc;
use tumble_collide::{Shape, Vec3};

impl ArticulatedBody {
    /// Returns the shapes of a link, an index in [`Model::frames`](super::Model::frames), by their numbers: part, index in a
    /// compound and name.
    pub fn shapes_of(&self, link: usize) -> impl Iterator<Item = (usize, usize, Option<&str>)> {
        let first = self.model.links().len() + 1;
        let own = self.colliders.iter().enumerate().filter(move |(_, found)| found.frame == link);
        own.flat_map(move |(k, found)| {
            let collider = &found.collider;
            (0..collider.shape.part_count()).map(move |shape| (first + k, shape, name_of(collider, shape)))
        })
    }

    /// Returns the number of a shape on its link, for the part and the index that contacts report.
    pub fn shape_number(&self, part: usize, shape: usize) -> usize {
        let own = self.collider(part).map(|found| self.shapes_of(found.frame));
        own.and_then(|mut own| own.position(|(p, s, _)| (p, s) == (part, shape))).unwrap_or(shape)
    }

    /// Returns the part and the index of the shape of that name on a link, which may be a fixed one; `None` without one.
    pub fn shape_named(&self, link: &str, name: &str) -> Option<(usize, usize)> {
        let found = self.shapes_of(self.model.frame_index(link)?).find(|(_, _, own)| *own == Some(name));
        found.map(|(part, shape, _)| (part, shape))
    }

    /// Returns the surface constants of a shape, for the part and the index that contacts report; `None` if there is none.
    pub fn shape_material(&self, part: usize, shape: usize) -> Option<Material> {
        let collider = &self.collider(part)?.collider;
        let own = collider.shape_materials.get(shape);
        (shape < collider.shape.part_count()).then(|| own.unwrap_or(collider.material))
    }

    /// Sets the surface constants of a shape: those of a part of a compound, where `None` gives it those of the compound
    /// again, or those of a whole collider, which `None` leaves.
    ///
    /// # Errors
    /// [`ArticulatedError::Collider`] if there is no such shape, or a constant is out of its range. Nothing is changed then.
    pub fn set_shape_material(
        &mut self,
        part: usize,
        shape: usize,
        material: Option<Material>,
    ) -> Result<(), ArticulatedError> {
        let frame = self.frame_of(part).and_then(|frame| self.model.frames().get(frame));
        let (body, link) = (self.name.clone(), frame.map(|frame| frame.name.clone()).unwrap_or_default());
        let wrong = |why| ArticulatedError::Collider { body, link, why };
        if let Some((what, value, expected)) = material.and_then(|material| material.validate().err()) {
            return Err(wrong(BodyError::Range { what, value, expected }));
        }
        let Some(found) = self.collider_mut(part).filter(|found| shape < found.collider.shape.part_count()) else {
            let expected = "below the number of parts of a collider of the body";
            return Err(wrong(BodyError::Range { what: "index of a shape", value: shape as f64, expected }));
        };
        match (is_compound(&found.collider.shape), material) {
            (true, material) => found.collider.shape_materials.set(shape, material),
            (false, Some(material)) => found.collider.material = material,
            (false, None) => {}
        }
        Ok(())
    }

    /// Returns what a shape collides with, for the part and the index that contacts report; `None` if there is none.
    pub fn shape_filter(&self, part: usize, shape: usize) -> Option<ShapeFilter> {
        let collider = &self.collider(part)?.collider;
        let whole = ShapeFilter { group: collider.group, mask: collider.mask, sensor: collider.sensor };
        let own = collider.shape_filters.get(shape);
        (shape < collider.shape.part_count()).then(|| own.unwrap_or(whole))
    }

    /// Sets what a shape collides with: a part of a compound, where `None` gives it the filter of the compound again, or a
    /// whole collider, which `None` leaves.
    ///
    /// # Errors
    /// [`ArticulatedError::Collider`] if there is no such shape, or it is a part of a compound that collides on one side only.
    /// Nothing is changed then.
    pub fn set_shape_filter(
        &mut self,
        part: usize,
        shape: usize,
        filter: Option<ShapeFilter>,
    ) -> Result<(), ArticulatedError> {
        let frame = self.frame_of(part).and_then(|frame| self.model.frames().get(frame));
        let (body, link) = (self.name.clone(), frame.map(|frame| frame.name.clone()).unwrap_or_default());
        let fits = |collider: &Collider| {
            let whole = !is_compound(&collider.shape) || collider.one_way.is_none();
            shape < collider.shape.part_count() && whole
        };
        let Some(found) = self.collider_mut(part).filter(|found| fits(&found.collider)) else {
            let expected = "below the number of parts of a collider that collides on all sides";
            let why = BodyError::Range { what: "index of a shape", value: shape as f64, expected };
            return Err(ArticulatedError::Collider { body, link, why });
        };
        let collider = &mut found.collider;
        match (is_compound(&collider.shape), filter) {
            (true, filter) => collider.shape_filters.set(shape, filter),
            (false, Some(ShapeFilter { group, mask, sensor })) => {
                (collider.group, collider.mask, collider.sensor) = (group, mask, sensor);
            }
            (false, None) => {}
        }
        Ok(())
    }

    /// Sets or removes an intersection test of its own of a shape of a link, by its number among the shapes of the link (a
    /// part of a compound stands for the whole compound), or of all of them for `None`. The link may be a fixed one: the
    /// shapes of others that are fixed to it are not meant. A test that makes no contacts is a filter: it decides with what
    /// the link collides. An archive does not have it.
    ///
    /// ```
    /// use std::sync::Arc;
    /// use tumble_core::collide::Contact;
    /// use tumble_core::{ArticulationBuilder, Intersect, IntersectPart, Joint, LinkBuilder, prelude::*};
    /// /// Whatever is named "ghost" passes through.
    /// struct Solid;
    /// impl Intersect for Solid {
    ///     fn contacts(&self, own: &IntersectPart, other: &IntersectPart, _: f64, _: &mut Vec<Contact>) -> bool {
    ///         assert_eq!((own.name(), own.link(), own.shape_name()), ("shelf", Some("lower"), Some("board")));
    ///         other.name() == "ghost" // no contacts: they do not collide; false leaves the pair to the shapes
    ///     }
    /// }
    /// let board = Shape::cuboid(Vec3::new(2.0, 2.0, 0.1))?;
    /// let mut shelf = ArticulationBuilder::new("shelf");
    /// for (name, height) in [("lower", 0.5), ("upper", 1.5)] {
    ///     let link = LinkBuilder::new(name, Joint::Fixed).with_pose(Pose::translation(0.0, 0.0, height));
    ///     shelf = shelf.link(link.with_shape(board.clone(), Pose::identity()).with_shape_name("board"));
    /// }
    /// let mut shelf = shelf.build()?;
    /// shelf.set_intersect("lower", None, Some(Arc::new(Solid)))?;
    /// let mut world = World::default();
    /// world.add(shelf)?;
    /// let mut drop = |name: &str, x: f64, z: f64| {
    ///     let ball = RigidBody::new(Shape::sphere(0.1)?).with_name(name).with_mass(1.0);
    ///     Ok::<_, Box<dyn std::error::Error>>(world.add(ball.with_pose(Pose::translation(x, 0.0, z)))?)
    /// };
    /// let (ghost, ball) = (drop("ghost", 0.0, 1.0)?, drop("ball", 0.5, 1.0)?);
    /// while world.time() < 1.0 {
    ///     world.step()?;
    /// }
    /// assert!(world.body(ghost)?.position().z < -1.0 && (world.body(ball)?.position().z - 0.65).abs() < 1e-3);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`ArticulatedError::NoLink`], [`ArticulatedError::Collider`] if the link has no such shape.
    pub fn set_intersect(
        &mut self,
        link: &str,
        shape: Option<usize>,
        test: Option<Arc<dyn Intersect>>,
    ) -> Result<(), ArticulatedError> {
        let frame = self.model.frame_index(link).ok_or_else(|| self.no_link(link))?;
        let meant = |(number, _): &(usize, usize)| shape.is_none_or(|shape| shape == *number);
        let parts: Vec<usize> =
            self.shapes_of(frame).map(|(part, ..)| part).enumerate().filter(meant).map(|(_, part)| part).collect();
        if parts.is_empty() {
            let (what, value) = ("number of a shape", shape.unwrap_or(0) as f64);
            let why = BodyError::Range { what, value, expected: "below the number of shapes of the link" };
            return Err(ArticulatedError::Collider { body: self.name.clone(), link: link.into(), why });
        }
        for part in parts {
            if let Some(found) = self.collider_mut(part) {
                found.intersect.clone_from(&test);
            }
        }
        Ok(())
    }

    /// Returns whether a shape of it has an [intersection test of its own](Self::set_intersect).
    pub fn has_intersect(&self) -> bool {
        self.colliders.iter().any(|found| found.intersect.is_some())
    }

    /// Checks a collider that is added to a link, an index in the model's frames.
    pub(super) fn check_collider(&self, link: usize, collider: &Collider) -> Result<(), BodyError> {
        if let Some(name) = &collider.name {
            check_shape_name(name, &collider.shape)?;
        }
        let count = collider.shape.part_count();
        let before = self.shapes_of(link).count();
        for (shape, name) in (0..count).filter_map(|shape| Some((shape, name_of(collider, shape)?))) {
            if let Some(first) = self.shapes_of(link).position(|(_, _, own)| own == Some(name)) {
                return Err(BodyError::ShapeNames { first, second: before + shape, name: name.into() });
            }
        }
        if let Some((shape, _)) = collider.shape_materials.as_slice().last()
            && (*shape >= count || !is_compound(&collider.shape))
        {
            let (what, expected) = ("index of a shape with a material", "below the number of parts of a compound");
            return Err(BodyError::Range { what, value: *shape as f64, expected });
        }
        if let Some((shape, _)) = collider.shape_filters.as_slice().last() {
            let fine = *shape < count && is_compound(&collider.shape) && collider.one_way.is_none();
            let expected = "below the number of parts of a compound that collides on all sides";
            if !fine {
                return Err(BodyError::Range {
                    what: "index of a shape with a filter",
                    value: *shape as f64,
                    expected,
                });
            }
        }
        let own = collider.shape_materials.as_slice().iter().map(|(_, own)| own);
        for material in std::iter::once(&collider.material).chain(own) {
            material.validate().map_err(|(what, value, expected)| BodyError::Range { what, value, expected })?;
        }
        match collider.one_way.map(|direction: Vec3| direction.norm()) {
            Some(length) if !(length.is_finite() && length > 0.0) => {
                let (what, expected) = ("length of the one-way direction", "above 0");
                Err(BodyError::Range { what, value: length, expected })
            }
            _ => Ok(()),
        }
    }
}

fn is_compound(shape: &Shape) -> bool {
    matches!(shape, Shape::Compound(_))
}

/// Returns the name of a shape of a collider.
pub(super) fn name_of(collider: &Collider, shape: usize) -> Option<&str> {
    collider.name.as_deref().filter(|_| shape == 0).or_else(|| collider.shape.part_name(shape))
}
