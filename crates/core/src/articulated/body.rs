//! The articulated body (thesis §III.B, `KSkeleton` of Fig. 12): one object, exact at its joints,
//! whose links collide like any body.
//!
//! State `x = [q, v]`: the model's positions, then its velocities; [`Joint`](super::Joint) lists
//! the numbers of each joint. Parts, in the order of their rows in the table of part states:
//!
//! - one per moving link, with the link's frame and no shape, in the order of [`Model::links`];
//! - one for the base, which does not move;
//! - one per collider, with its own frame.
//!
//! The generalized velocity is `v`. The articulated inertias give the root of the mass matrix, `M =
//! LᵀL`.

use super::collider::{Collider, LinkCollider};
use super::turning::Carried;
use crate::articulated::algorithms::dynamics::{Dynamics, Scratch};
use crate::articulated::algorithms::free_motion::FreeMotion;
use crate::articulated::model::LinkMass;
use crate::articulated::model::dof::{Coupling, DofSettings};
use crate::articulated::model::{Model, ModelError};
use crate::object::collidable::CollisionGroup;
use crate::object::mounts::{CameraMount, LightMount};
use crate::object::part_state::Wrench;
use crate::object::visual::Visual;
use crate::{Anchor, BodyError, ObjectId};
use nalgebra::{Quaternion, Translation3};
use tumble_collide::{Pose, Quat, Vec3};

/// An invalid articulated body.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ArticulatedError {
    /// The model has no link of that name.
    #[error("articulated body '{body}' has no link named '{link}'")]
    NoLink {
        /// Body.
        body: String,
        /// Name of the link.
        link: String,
    },
    /// A constant of a joint is out of its range.
    #[error("articulated body '{body}', link '{link}': {what} is {value}; it must be {expected}")]
    Range {
        /// Body.
        body: String,
        /// Link moved by the joint.
        link: String,
        /// The name of the constant.
        what: &'static str,
        /// Value given.
        value: f64,
        /// Admissible range.
        expected: &'static str,
    },
    /// A coupling is not valid.
    #[error(
        "articulated body '{body}': the coupling of degree of freedom {dof} to {of}: both must be different degrees of freedom of revolute or prismatic joints below {count}, ratio and offset finite"
    )]
    Coupling {
        /// Body.
        body: String,
        /// Degree of freedom that is coupled.
        dof: usize,
        /// Degree of freedom that it follows.
        of: usize,
        /// Number of degrees of freedom.
        count: usize,
    },
    /// A shape of a link is not valid.
    #[error("articulated body '{body}', link '{link}': {why}")]
    Collider {
        /// Body.
        body: String,
        /// Link.
        link: String,
        /// Reason.
        why: BodyError,
    },
    /// The tree of links is not valid with a constant.
    #[error("articulated body '{body}': {why}")]
    Model {
        /// Body.
        body: String,
        /// Reason.
        why: ModelError,
    },
    /// Numbers are not valid positions or velocities.
    #[error("articulated body '{body}': {what} must be {expected} finite numbers, quaternions of unit length")]
    Start {
        /// Body.
        body: String,
        /// Positions or velocities.
        what: &'static str,
        /// Required number of values.
        expected: usize,
    },
    /// A list has another length than the degrees of freedom.
    #[error("articulated body '{body}': {got} {what}; there must be {expected}, one for each degree of freedom")]
    Length {
        /// Body.
        body: String,
        /// Contents of the list.
        what: &'static str,
        /// Length of the list.
        got: usize,
        /// Degrees of freedom.
        expected: usize,
    },
}

/// A tree of links that moves as one object. See the module for its state.
///
/// ```
/// # use tumble_core::{ArticulatedBody, Collider, DofSettings, Joint, LinkMass, ModelBuilder, Settings, World, collide::{Mat3, Pose, Shape, Vec3}};
/// # let mut world = World::new(Settings::default())?;
/// # let rod = LinkMass { mass: 1.0, center: Vec3::new(0.0, 0.0, -0.5), inertia: Mat3::identity() };
/// let mut builder = ModelBuilder::new();
/// let upper = builder.link("upper", None, Joint::revolute(Vec3::y()), Pose::identity(), rod);
/// builder.link("lower", Some(upper), Joint::revolute(Vec3::y()), Pose::translation(0.0, 0.0, -1.0), rod);
/// let mut arm = ArticulatedBody::new("arm", builder.build()?).with_pose(Pose::translation(0.0, 0.0, 2.0));
/// arm.add_collider("lower", Collider::new(Shape::capsule(0.05, 0.8)?, Pose::translation(0.0, 0.0, -0.5)))?;
/// arm.set_dof(0, DofSettings { limits: Some([-1.0, 1.0]), ..DofSettings::default() })?;
/// world.add(arm)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone)]
pub struct ArticulatedBody {
    pub(super) name: String,
    pub(super) model: Model,
    pub(super) base: Pose,
    pub(super) colliders: Vec<LinkCollider>,
    pub(super) visuals: Vec<Visual>,
    /// The link of each visual, an index in `Model::frames`.
    pub(super) visual_links: Vec<usize>,
    pub(super) cameras: Vec<CameraMount>,
    pub(super) lights: Vec<LightMount>,
    /// Settings of each degree of freedom, in the order of `v`. May change between steps.
    dofs: Vec<DofSettings>,
    pub(super) couplings: Vec<Coupling>,
    /// Whether links collide with other links of the same body. Links joined to each other never
    /// do.
    pub self_collision: bool,
    /// Pairs that do not collide, smaller number first and the base (`None`) before all; sorted.
    pub(super) excluded_pairs: Vec<[Option<usize>; 2]>,
    pub(super) start: Vec<f64>,
}

/// Values that a body derives from one state, and the working memory of its calls.
pub(super) struct BodyCache {
    /// Dynamics at the state of the last refresh.
    pub dynamics: Dynamics,
    pub scratch: Scratch,
    pub free_motion: FreeMotion,
    /// Zero joint forces or accelerations.
    pub zeros: Vec<f64>,
    /// Accelerations without any force at that state; empty until they are asked for.
    pub free_rate: Vec<f64>,
    pub wrenches: Vec<Wrench>,
    pub accelerations: Vec<(Vec3, Vec3)>,
    pub carried: Vec<Carried>,
}

impl BodyCache {
    pub fn new(model: &Model) -> BodyCache {
        let dynamics = Dynamics::new(model);
        BodyCache {
            scratch: dynamics.scratch(),
            free_motion: FreeMotion::new(&dynamics),
            zeros: vec![0.0; model.dof()],
            free_rate: Vec::with_capacity(model.dof()),
            wrenches: vec![Default::default(); model.links().len()],
            accelerations: vec![(Vec3::zeros(), Vec3::zeros()); model.links().len()],
            carried: Vec::with_capacity(model.links().len()),
            dynamics,
        }
    }
}

impl ArticulatedBody {
    /// Makes a body at its zero position and at rest, without colliders and with default dof
    /// settings.
    pub fn new(name: impl Into<String>, model: Model) -> ArticulatedBody {
        let mut start = vec![0.0; model.positions() + model.dof()];
        model.write_zero(&mut start);
        for link in model.links().iter().filter(|l| l.joint == super::Joint::Floating) {
            write_pose(&mut start[link.q..link.q + 7], &link.placement);
        }
        let dofs = vec![DofSettings::default(); model.dof()];
        ArticulatedBody {
            name: name.into(),
            model,
            base: Pose::identity(),
            colliders: Vec::new(),
            visuals: Vec::new(),
            visual_links: Vec::new(),
            cameras: Vec::new(),
            lights: Vec::new(),
            dofs,
            couplings: Vec::new(),
            self_collision: true,
            excluded_pairs: Vec::new(),
            start,
        }
    }

    /// Sets the pose of the base in the world. Everything attached to the base moves along, and so
    /// does the start of every floating root.
    #[must_use]
    pub fn with_pose(mut self, pose: Pose) -> Self {
        let step = pose * self.base.inverse();
        for link in self.model.links().iter().filter(|l| l.joint == super::Joint::Floating) {
            let placed = step * read_pose(&self.start[link.q..link.q + 7]);
            write_pose(&mut self.start[link.q..link.q + 7], &placed);
        }
        self.model.place(&step);
        self.base = pose;
        self
    }

    /// Sets the name. So one description can appear several times in a world.
    #[must_use]
    pub fn with_name(mut self, name: impl Into<String>) -> Self {
        self.name = name.into();
        self
    }

    /// Sets all positions at time 0; [`Joint`](super::Joint) lists the numbers of each joint.
    ///
    /// # Errors
    /// [`ArticulatedError::Start`] for another number of values or values that are no state.
    pub fn with_positions(mut self, q: &[f64]) -> Result<Self, ArticulatedError> {
        let expected = self.model.positions();
        let mut start = self.start.clone();
        if q.len() == expected {
            start[..expected].copy_from_slice(q);
        }
        if q.len() != expected || !self.is_state(&start) {
            return Err(ArticulatedError::Start { body: self.name, what: "positions", expected });
        }
        self.start = start;
        Ok(self)
    }

    /// Sets all velocities at time 0.
    ///
    /// # Errors
    /// [`ArticulatedError::Start`] for another number of values or values that are not finite.
    pub fn with_velocities(mut self, v: &[f64]) -> Result<Self, ArticulatedError> {
        let (expected, n) = (self.model.dof(), self.model.positions());
        if v.len() != expected || v.iter().any(|x| !x.is_finite()) {
            return Err(ArticulatedError::Start { body: self.name, what: "velocities", expected });
        }
        self.start[n..].copy_from_slice(v);
        Ok(self)
    }

    /// Adds a shape to the link of that name, which may be a fixed link that is folded into its
    /// parent. It moves with the parent then; contacts and events still name the link of the shape.
    ///
    /// # Errors
    /// [`ArticulatedError::NoLink`]; [`ArticulatedError::Collider`] for a name that another shape of the link has, surface
    /// constants of a part that the shape does not have, and a one-way direction without a length.
    pub fn add_collider(&mut self, link: &str, mut collider: Collider) -> Result<(), ArticulatedError> {
        let Some(number) = self.model.frame_index(link) else { return Err(self.no_link(link)) };
        self.check_collider(number, &collider).map_err(|why| ArticulatedError::Collider {
            body: self.name.clone(),
            link: link.into(),
            why,
        })?;
        let frame = &self.model.frames()[number];
        let center = Translation3::from(collider.shape.center_of_mass());
        collider.pose = frame.pose * (collider.pose * center);
        self.colliders.push(LinkCollider { intersect: None, link: frame.link, frame: number, collider });
        Ok(())
    }

    /// Adds a visual to a link. Its pose is in the link's frame; its `part` is set here.
    ///
    /// # Errors
    /// [`ArticulatedError::NoLink`].
    pub fn add_visual(&mut self, link: &str, mut visual: Visual) -> Result<(), ArticulatedError> {
        (visual.part, visual.pose) = self.part_of(link, &visual.pose)?;
        self.visuals.push(visual);
        self.visual_links.extend(self.model.frame_index(link));
        Ok(())
    }

    /// Adds a camera to a link. Its pose is in the link's frame; its `part` is set here.
    ///
    /// # Errors
    /// [`ArticulatedError::NoLink`].
    pub fn add_camera(&mut self, link: &str, mut camera: CameraMount) -> Result<(), ArticulatedError> {
        (camera.part, camera.pose) = self.part_of(link, &camera.pose)?;
        self.cameras.push(camera);
        Ok(())
    }

    /// Replaces the cameras of a link, and of the links fixed to it, by others with poses in the link's frame; none removes them.
    ///
    /// # Errors
    /// [`ArticulatedError::NoLink`].
    pub fn set_cameras(
        &mut self,
        link: &str,
        cameras: impl IntoIterator<Item = CameraMount>,
    ) -> Result<(), ArticulatedError> {
        let (part, frame) = self.part_of(link, &Pose::identity())?;
        self.cameras.retain(|camera| camera.part != part);
        self.cameras.extend(cameras.into_iter().map(|mount| CameraMount { part, pose: frame * mount.pose, ..mount }));
        Ok(())
    }

    /// Replaces the lights of a link, and of the links fixed to it, by others with poses in the link's frame; none removes them.
    ///
    /// # Errors
    /// [`ArticulatedError::NoLink`].
    pub fn set_lights(
        &mut self,
        link: &str,
        lights: impl IntoIterator<Item = LightMount>,
    ) -> Result<(), ArticulatedError> {
        let (part, frame) = self.part_of(link, &Pose::identity())?;
        self.lights.retain(|light| light.part != part);
        self.lights.extend(lights.into_iter().map(|mount| LightMount { part, pose: frame * mount.pose, ..mount }));
        Ok(())
    }

    /// Adds a light to a link. Its pose is in the link's frame; its `part` is set here.
    ///
    /// # Errors
    /// [`ArticulatedError::NoLink`].
    pub fn add_light(&mut self, link: &str, mut light: LightMount) -> Result<(), ArticulatedError> {
        (light.part, light.pose) = self.part_of(link, &light.pose)?;
        self.lights.push(light);
        Ok(())
    }

    /// Returns the part that carries a link, and the pose in the part's frame of a pose in the
    /// link's frame.
    fn part_of(&self, link: &str, pose: &Pose) -> Result<(usize, Pose), ArticulatedError> {
        let Some(frame) = self.model.frame(link) else { return Err(self.no_link(link)) };
        Ok((frame.link.unwrap_or(self.model.links().len()), frame.pose * pose))
    }

    /// Returns a frame fixed to a link, which may be a fixed one, for a sensor or a loop joint; `id` is this body in a world.
    /// A touch sensor there reads the contacts of this link's own shapes.
    ///
    /// # Errors
    /// [`ArticulatedError::NoLink`].
    pub fn anchor(&self, id: ObjectId, link: &str, pose: &Pose) -> Result<Anchor, ArticulatedError> {
        let (part, frame) = self.part_of(link, pose)?;
        Ok(Anchor { link: self.model.frame_index(link), ..Anchor::on(id, part, frame) })
    }

    /// Disables collisions between two links. A fixed link stands for the link or base into which
    /// it is folded.
    ///
    /// # Errors
    /// [`ArticulatedError::NoLink`].
    pub fn exclude_collisions(&mut self, a: &str, b: &str) -> Result<(), ArticulatedError> {
        let find = |link: &str| self.model.frame(link).map(|f| f.link).ok_or_else(|| self.no_link(link));
        let (a, b) = (find(a)?, find(b)?);
        let pair = [a.min(b), a.max(b)];
        if let Err(place) = self.excluded_pairs.binary_search(&pair) {
            self.excluded_pairs.insert(place, pair);
        }
        Ok(())
    }

    /// Sets the settings of the degree of freedom `index`, its index in `v`.
    ///
    /// # Errors
    /// [`ArticulatedError::Range`] for a setting out of its range; [`ArticulatedError::NoLink`] for
    /// an index out of range.
    pub fn set_dof(&mut self, index: usize, dof: DofSettings) -> Result<(), ArticulatedError> {
        let Some(link) = self.model.links().iter().find(|l| (l.v..l.v + l.joint.dof()).contains(&index)) else {
            return Err(self.no_link(&format!("of degree of freedom {index}")));
        };
        let fault = match link.joint {
            super::Joint::Spherical => dof.spherical_range_error(),
            joint => dof.range_error(joint.dof() == 1),
        };
        if let Some((what, value, expected)) = fault {
            return Err(ArticulatedError::Range {
                body: self.name.clone(),
                link: link.name.clone(),
                what,
                value,
                expected,
            });
        }
        self.dofs[index] = dof;
        Ok(())
    }

    /// Sets the drives of all degrees of freedom, in the order of `v`. An invalid one changes nothing.
    ///
    /// # Errors
    /// As [`set_dof`](Self::set_dof); [`ArticulatedError::Length`] if there are not as many as degrees of freedom.
    pub fn set_drives(&mut self, drives: &[super::Drive]) -> Result<(), ArticulatedError> {
        let before = self.dofs.clone();
        if drives.len() != before.len() {
            return Err(ArticulatedError::Length {
                body: self.name.clone(),
                what: "drives",
                got: drives.len(),
                expected: before.len(),
            });
        }
        let set = |(index, drive): (usize, &super::Drive)| {
            let drive = drive.clone();
            self.set_dof(index, DofSettings { drive, ..before[index].clone() })
        };
        let outcome = drives.iter().enumerate().try_for_each(set);
        if outcome.is_err() {
            self.dofs = before;
        }
        outcome
    }

    /// Sets the [`armature`](super::Link::armature) of the joint that moves a link, kg·m² or kg. In a world
    /// [`World::set_armature`](crate::World::set_armature) does it.
    ///
    /// # Errors
    /// [`ArticulatedError`]: there is no such moving link, its joint has no armature, or the value is out of its range.
    pub fn with_armature(mut self, link: &str, armature: f64) -> Result<Self, ArticulatedError> {
        let Some(number) = self.model.link(link) else { return Err(self.no_link(link)) };
        match self.model.set_armature(number, armature) {
            Ok(()) => Ok(self),
            Err(why) => Err(ArticulatedError::Model { body: self.name, why }),
        }
    }

    /// Returns mass, center of mass and inertia of a link alone, in its own frame: without those of links that are fixed to
    /// it. A [`Link`](super::Link) has those of all of them together.
    pub fn link_mass(&self, link: &str) -> Option<LinkMass> {
        self.model.frame(link).map(|frame| frame.mass)
    }

    /// Sets mass, center of mass and inertia of a link alone, in its own frame. In a world
    /// [`World::set_link_mass`](crate::World::set_link_mass) does it.
    ///
    /// # Errors
    /// [`ArticulatedError`]: there is no such link, a number is out of its range, or a joint then moves no inertia.
    pub fn with_link_mass(mut self, link: &str, mass: LinkMass) -> Result<Self, ArticulatedError> {
        let Some(frame) = self.model.frames().iter().position(|frame| frame.name == link) else {
            return Err(self.no_link(link));
        };
        match self.model.set_mass(frame, mass) {
            Ok(()) => Ok(self),
            Err(why) => Err(ArticulatedError::Model { body: self.name, why }),
        }
    }

    /// Sets collision group and mask, one bit for each group, of all its shapes.
    pub fn set_groups(&mut self, group: CollisionGroup, mask: u64) {
        self.change_groups(|_, _| (group, mask));
    }

    /// Changes collision group and mask of each of its shapes.
    pub fn change_groups(&mut self, change: impl Fn(CollisionGroup, u64) -> (CollisionGroup, u64)) {
        for collider in self.colliders.iter_mut().map(|part| &mut part.collider) {
            (collider.group, collider.mask) = change(collider.group, collider.mask);
        }
    }

    /// Changes collision group and mask of each shape of a link, and of links that are fixed to it or that it is fixed to: they
    /// are one part.
    ///
    /// # Errors
    /// [`ArticulatedError::NoLink`].
    pub fn change_link_groups(
        &mut self,
        link: &str,
        change: impl Fn(CollisionGroup, u64) -> (CollisionGroup, u64),
    ) -> Result<(), ArticulatedError> {
        let Some(carrier) = self.model.frame(link).map(|frame| frame.link) else { return Err(self.no_link(link)) };
        let own = self.colliders.iter_mut().filter(|part| part.link == carrier).map(|part| &mut part.collider);
        own.for_each(|collider| (collider.group, collider.mask) = change(collider.group, collider.mask));
        Ok(())
    }

    /// Couples one degree of freedom to another.
    ///
    /// # Errors
    /// [`ArticulatedError::Coupling`] unless both are different degrees of freedom of revolute or
    /// prismatic joints and the numbers are finite.
    pub fn couple(&mut self, coupling: Coupling) -> Result<(), ArticulatedError> {
        let Coupling { dof, of, multiplier, offset } = coupling;
        let fine = dof != of
            && [dof, of].iter().all(|&i| self.position_of(i).is_some())
            && multiplier.is_finite()
            && offset.is_finite();
        if !fine {
            return Err(ArticulatedError::Coupling { body: self.name.clone(), dof, of, count: self.model.dof() });
        }
        self.couplings.push(coupling);
        Ok(())
    }

    /// Returns the tree of links.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Returns the settings of each degree of freedom.
    pub fn dofs(&self) -> &[DofSettings] {
        &self.dofs
    }

    /// Returns the pose of the base in the world.
    pub fn base(&self) -> &Pose {
        &self.base
    }

    /// Returns the index in `v` of the joint that moves a link, if that joint has a single degree
    /// of freedom.
    pub fn dof_of(&self, link: &str) -> Option<usize> {
        let link = &self.model.links()[self.model.link(link)?];
        (link.joint.dof() == 1).then_some(link.v)
    }

    /// Returns the index in `q` of the position of a revolute or prismatic degree of freedom.
    pub fn position_of(&self, dof: usize) -> Option<usize> {
        self.model.links().iter().find(|l| l.v == dof && l.joint.dof() == 1).map(|l| l.q)
    }

    /// Returns the moving link that carries a part; `None` for the base and parts fixed to it.
    pub fn link_of(&self, part: usize) -> Option<usize> {
        let links = self.model.links().len();
        if part < links { Some(part) } else { self.collider(part)?.link }
    }

    /// Returns the link of a part as its user named it: an index in [`Model::frames`]. It is the link that a shape was
    /// added to, which may be a fixed one. `None` for the base itself.
    pub fn frame_of(&self, part: usize) -> Option<usize> {
        match self.model.links().get(part) {
            Some(link) => self.model.frame_index(&link.name),
            None => Some(self.collider(part)?.frame),
        }
    }

    /// Returns the parts that are colliders of a moving link and of the links fixed to it, or of the base for `None`.
    pub fn colliders_of(&self, link: Option<usize>) -> impl Iterator<Item = usize> {
        let first = self.model.links().len() + 1;
        self.colliders.iter().enumerate().filter(move |(_, part)| part.link == link).map(move |(k, _)| first + k)
    }

    /// Returns the parts that are the shapes of a link alone, which may be a fixed one: without those of links that are fixed to it.
    ///
    /// # Errors
    /// [`ArticulatedError::NoLink`].
    pub fn parts_of_link(&self, link: &str) -> Result<Vec<usize>, ArticulatedError> {
        let number = self.model.frame_index(link).ok_or_else(|| self.no_link(link))?;
        let first = self.model.links().len() + 1;
        let own = self.colliders.iter().zip(first..).filter(|(part, _)| part.frame == number);
        Ok(own.map(|(_, part)| part).collect())
    }

    /// Returns the collider of a part, if it has one.
    pub(super) fn collider(&self, part: usize) -> Option<&LinkCollider> {
        self.colliders.get(part.checked_sub(self.model.links().len() + 1)?)
    }

    pub(super) fn collider_mut(&mut self, part: usize) -> Option<&mut LinkCollider> {
        self.colliders.get_mut(part.checked_sub(self.model.links().len() + 1)?)
    }

    /// Returns the parent of a link, skipping massless links of stacked joints. `None` is the base.
    fn massive_ancestor(&self, link: usize) -> Option<usize> {
        let mut parent = self.model.links()[link].parent;
        while let Some(p) = parent.filter(|&p| self.model.links()[p].mass == super::LinkMass::none()) {
            parent = self.model.links()[p].parent;
        }
        parent
    }

    /// Returns whether two moving links (or the base, `None`) may collide.
    pub(super) fn links_collide(&self, a: Option<usize>, b: Option<usize>) -> bool {
        let parent = |link: Option<usize>| link.map(|l| self.massive_ancestor(l));
        let grounded = |link: Option<usize>| link.is_none_or(|l| self.model.links()[l].joint != super::Joint::Floating);
        let joined = (parent(a) == Some(b) && grounded(a)) || (parent(b) == Some(a) && grounded(b));
        let kept = self.excluded_pairs.binary_search(&[a.min(b), a.max(b)]).is_ok();
        self.self_collision && a != b && !joined && !kept
    }

    /// Returns whether the numbers are a state: finite, with quaternions of unit length.
    pub(super) fn is_state(&self, x: &[f64]) -> bool {
        let unit = |l: &super::Link| {
            let norm = l.joint.quaternion().map_or(1.0, |k| x[l.q + k..l.q + k + 4].iter().map(|q| q * q).sum::<f64>());
            (norm - 1.0).abs() < 1e-9
        };
        x.len() == self.start.len() && x.iter().all(|x| x.is_finite()) && self.model.links().iter().all(unit)
    }

    pub(super) fn no_link(&self, link: &str) -> ArticulatedError {
        ArticulatedError::NoLink { body: self.name.clone(), link: link.to_string() }
    }
}

pub(super) fn read_pose(q: &[f64]) -> Pose {
    let rotation = Quat::new_unchecked(Quaternion::new(q[6], q[3], q[4], q[5]));
    Pose::from_parts(Vec3::new(q[0], q[1], q[2]).into(), rotation)
}

fn write_pose(q: &mut [f64], pose: &Pose) {
    q[..3].copy_from_slice(pose.translation.vector.as_slice());
    q[3..7].copy_from_slice(pose.rotation.coords.as_slice());
}
