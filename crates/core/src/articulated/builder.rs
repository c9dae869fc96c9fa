//! An articulated body from links with shapes, in code.

use super::body::{ArticulatedBody, ArticulatedError};
use super::builder_error::ArticulationError;
use super::collider::Collider;
use super::link_builder::{LinkBuilder, Use};
use super::model::ModelBuilder;
use super::model::dof::{Coupling, DofSettings};
use super::model::joint::Joint;
use crate::object::visual::Visual;
use nalgebra::Translation3;

/// Collects links with shapes and makes an [`ArticulatedBody`].
///
/// ```
/// # use tumble_core::prelude::*;
/// # use tumble_core::{ArticulationBuilder, Joint, LinkBuilder};
/// # let mut world = World::default();
/// let (rod, middle) = (Shape::capsule(0.05, 0.9)?, Pose::translation(0.0, 0.0, -0.5));
/// let upper = LinkBuilder::new("upper", Joint::revolute(Vec3::y())).with_shape(rod.clone(), middle).with_mass(1.0);
/// let lower = LinkBuilder::new("lower", Joint::revolute(Vec3::y())).with_shape(rod, middle).with_mass(1.0);
/// let lower = lower.with_parent("upper").with_pose(Pose::translation(0.0, 0.0, -1.0)).with_limits([-1.0, 1.0]);
/// let arm = ArticulationBuilder::new("arm").link(upper).link(lower).build()?;
/// world.add(arm.with_pose(Pose::translation(0.0, 0.0, 2.0)))?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
#[must_use]
pub struct ArticulationBuilder {
    name: String,
    links: Vec<LinkBuilder>,
    mimics: Vec<(String, String, f64, f64)>,
    excluded: Vec<[String; 2]>,
    self_collision: bool,
}

impl ArticulationBuilder {
    /// Makes a builder without links.
    pub fn new(name: impl Into<String>) -> ArticulationBuilder {
        ArticulationBuilder {
            name: name.into(),
            links: Vec::new(),
            mimics: Vec::new(),
            excluded: Vec::new(),
            self_collision: true,
        }
    }

    /// Adds a link. [`build`](Self::build) checks everything.
    pub fn link(mut self, link: LinkBuilder) -> Self {
        self.links.push(link);
        self
    }

    /// Couples the joint of a link to that of another: `q = multiplier·q_of + offset`.
    pub fn mimic(mut self, link: impl Into<String>, of: impl Into<String>, multiplier: f64, offset: f64) -> Self {
        self.mimics.push((link.into(), of.into(), multiplier, offset));
        self
    }

    /// Disables collisions between two links. Links that a joint connects never collide.
    pub fn exclude_collisions(mut self, a: impl Into<String>, b: impl Into<String>) -> Self {
        self.excluded.push([a.into(), b.into()]);
        self
    }

    /// Sets whether links collide with other links of the same body; by default they do.
    pub fn with_self_collision(mut self, self_collision: bool) -> Self {
        self.self_collision = self_collision;
        self
    }

    /// Returns the links added so far.
    pub fn links(&self) -> &[LinkBuilder] {
        &self.links
    }

    /// Returns the link of that name, to change it.
    pub fn link_mut(&mut self, name: &str) -> Option<&mut LinkBuilder> {
        self.links.iter_mut().find(|link| link.name == name)
    }

    /// Builds the body.
    ///
    /// # Errors
    /// [`ArticulationError`] for the first property that is not valid; it names the link.
    pub fn build(&self) -> Result<ArticulatedBody, ArticulationError> {
        let name = &self.name;
        let mut model = ModelBuilder::new();
        for (k, link) in self.links.iter().enumerate() {
            let parent =
                link.parent.as_deref().map(|parent| self.number(&self.links[..k], link, parent)).transpose()?;
            let number = model.link(&link.name, parent, link.joint, link.pose, link.link_mass(name)?);
            model.set_armature(number, link.armature);
        }
        let model = model.build().map_err(|why| ArticulationError::Model { body: name.clone(), why })?;
        let mut body = ArticulatedBody::new(name, model);
        body.self_collision = self.self_collision;
        for link in &self.links {
            add_shapes(&mut body, link)?;
        }
        self.set_joints(&mut body)?;
        for (link, of, multiplier, offset) in &self.mimics {
            let dof = |link: &String| body.dof_of(link).ok_or_else(|| self.no_dof(&body, link));
            let coupling = Coupling { dof: dof(link)?, of: dof(of)?, multiplier: *multiplier, offset: *offset };
            body.couple(coupling)?;
        }
        for [a, b] in &self.excluded {
            body.exclude_collisions(a, b)?;
        }
        Ok(body)
    }

    /// Returns the number of the parent of a link.
    fn number(&self, before: &[LinkBuilder], link: &LinkBuilder, parent: &str) -> Result<usize, ArticulationError> {
        before.iter().position(|other| other.name == parent).ok_or_else(|| {
            let names: Vec<&str> = before.iter().map(|other| other.name.as_str()).take(12).collect();
            let known = match names.is_empty() {
                true => "no link was; without a parent it hangs on the base".into(),
                false => format!("there are {}", names.join(", ")),
            };
            ArticulationError::Parent { body: self.name.clone(), link: link.name.clone(), parent: parent.into(), known }
        })
    }

    /// Sets the settings of all joints, and the state at time 0.
    fn set_joints(&self, body: &mut ArticulatedBody) -> Result<(), ArticulationError> {
        let mut start = body.start.clone();
        let velocities = body.model().positions();
        for link in &self.links {
            let Some((q, v)) =
                body.model().link(&link.name).map(|k| (body.model().links()[k].q, body.model().links()[k].v))
            else {
                match link.dof == DofSettings::default()
                    && link.dofs.is_empty()
                    && link.cone.is_none()
                    && link.twist_limits.is_none()
                    && link.positions.as_ref().is_none_or(Vec::is_empty)
                    && link.velocities.as_ref().is_none_or(Vec::is_empty)
                {
                    true => continue,
                    false => return Err(self.wrong_joint(link, "it has settings of a joint")),
                }
            };
            let spherical = link.joint == Joint::Spherical;
            if link.cone.is_some() && !spherical {
                return Err(self.wrong_joint(link, "it has a cone, which only spherical joints have"));
            }
            if link.twist_limits.is_some() && !spherical {
                return Err(self.wrong_joint(link, "it has limits of a twist, which only spherical joints have"));
            }
            if spherical && link.dof.limits.is_some() {
                return Err(self.wrong_joint(link, "it has limits of one angle; a spherical joint has a cone"));
            }
            if link.cone.is_some_and(|(axis, _)| axis > 2) {
                return Err(self.wrong_joint(link, "the axis of its cone is not 0, 1 or 2"));
            }
            if link.twist_limits.is_some_and(|(axis, _)| axis > 2) {
                return Err(self.wrong_joint(link, "the axis of its twist is not 0, 1 or 2"));
            }
            if link.dofs.iter().any(|(k, _)| *k >= link.joint.dof()) {
                return Err(self.wrong_joint(link, "it has settings of another degree of freedom"));
            }
            for (k, index) in (v..v + link.joint.dof()).enumerate() {
                body.set_dof(index, link.settings_of(k))?;
            }
            let [positions, rates] = [link.joint.positions(), link.joint.dof()];
            for (values, index, count, what) in [
                (
                    &link.positions,
                    q,
                    positions,
                    "it has a position at time 0 with another count of numbers than its joint",
                ),
                (
                    &link.velocities,
                    velocities + v,
                    rates,
                    "it has a velocity at time 0 with another count of numbers than its joint",
                ),
            ] {
                let Some(values) = values else { continue };
                if values.len() != count {
                    return Err(self.wrong_joint(link, what));
                }
                start[index..index + count].copy_from_slice(values);
            }
        }
        if !body.is_state(&start) {
            let expected = start.len();
            let (body, what) = (self.name.clone(), "positions and velocities");
            return Err(ArticulatedError::Start { body, what, expected }.into());
        }
        body.start = start;
        Ok(())
    }

    fn wrong_joint(&self, link: &LinkBuilder, what: &'static str) -> ArticulationError {
        ArticulationError::Joint { body: self.name.clone(), link: link.name.clone(), what, dof: link.joint.dof() }
    }

    fn no_dof(&self, body: &ArticulatedBody, link: &str) -> ArticulationError {
        match self.links.iter().find(|known| known.name == link) {
            Some(link) => self.wrong_joint(link, "it takes part in a coupling, which needs one"),
            None => body.no_link(link).into(),
        }
    }
}

fn add_shapes(body: &mut ArticulatedBody, link: &LinkBuilder) -> Result<(), ArticulatedError> {
    for shape in &link.shapes {
        let collider = &shape.collider;
        if shape.visible {
            let center = Translation3::from(collider.shape.center_of_mass());
            let appearance = shape.appearance.as_ref().unwrap_or(&link.appearance).clone();
            let visual = Visual::shape(0, collider.pose * center, collider.shape.clone(), appearance);
            body.add_visual(&link.name, visual)?;
        }
        let collider = match shape.purpose {
            Use::Drawn => continue,
            Use::Collides => Collider {
                material: link.material,
                contact_mode: link.contact_mode,
                group: link.groups.0,
                mask: link.groups.1,
                ..collider.clone()
            },
            Use::HasSurface => collider.clone(),
        };
        body.add_collider(&link.name, collider)?;
    }
    Ok(())
}
