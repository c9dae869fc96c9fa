//! A tree of links: the constant part of an articulated body [RBDA §4.1–4.4], thesis §III.B.1.
//!
//! A parent has a lower number than its children. Fixed links are folded into their parents when
//! the model is built and remain as [`LinkFrame`]s. Coordinates are ordered by link: `q` has
//! [`Model::positions`] numbers and `v` has [`Model::dof`].

pub(in crate::articulated) mod compiled;
pub(in crate::articulated) mod coordinates;
pub(in crate::articulated) mod dof;
pub(in crate::articulated) mod joint;
pub(in crate::articulated) mod playback;

use self::joint::Joint;
use nalgebra::SymmetricEigen;
use std::collections::BTreeMap;
use std::sync::Arc;
use tumble_collide::{Mat3, Pose, Vec3};

/// Maximum number of links of a model, as a bound for input from files.
pub const MAX_LINKS: usize = 10_000;

/// Why a model is not valid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ModelError {
    /// There is no link. A model whose links are all fixed, such as a table, never moves.
    #[error("the model has no link")]
    Empty,
    /// More links than [`MAX_LINKS`].
    #[error("the model has more than {MAX_LINKS} links")]
    TooMany,
    /// Two links have the same name.
    #[error("two links are named '{0}'; names must be unique within a model")]
    DuplicateName(String),
    /// The parent was not added before the link.
    #[error("link '{link}': its parent, link number {parent}, was not added before it")]
    Parent {
        /// Link.
        link: String,
        /// Number given as the parent.
        parent: usize,
    },
    /// A link with a parent has a floating joint.
    #[error("link '{0}': only a root can have a floating joint")]
    Floating(String),
    /// The joint axis has no direction.
    #[error("link '{link}': its joint axis {axis:?} has no direction; it must be finite and not zero")]
    Axis {
        /// Link.
        link: String,
        /// Axis given.
        axis: [f64; 3],
    },
    /// The placement is not finite, or its rotation is not of unit length.
    #[error("link '{0}': its placement must be finite, with a rotation of unit length")]
    Placement(String),
    /// Mass or inertia is out of its range.
    #[error("link '{link}': {what} is {value}; it must be {expected}")]
    Inertia {
        /// Link.
        link: String,
        /// Which constant.
        what: &'static str,
        /// Value given.
        value: f64,
        /// Admissible range.
        expected: &'static str,
    },
    /// A joint moves no inertia.
    #[error(
        "link '{0}' and its descendants have no inertia about its joint, so their motion has no solution; give mass to one of them"
    )]
    Massless(String),
}

/// Mass properties of a link, in the link's frame. All zero is a massless link, for stacked joints
/// of one degree of freedom each.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct LinkMass {
    /// Mass, kg.
    pub mass: f64,
    /// Center of mass, m, link frame.
    pub center: Vec3,
    /// Inertia about the center of mass, link axes, kg·m².
    pub inertia: Mat3,
}

impl LinkMass {
    /// Returns the properties of a massless link.
    pub fn none() -> LinkMass {
        LinkMass { mass: 0.0, center: Vec3::zeros(), inertia: Mat3::zeros() }
    }

    /// Returns the properties of a point mass of `mass` kg at `center`.
    pub fn point(mass: f64, center: Vec3) -> LinkMass {
        LinkMass { mass, center, inertia: Mat3::zeros() }
    }

    /// Returns the inertia about the link's origin: `I + m(|c|²·1 − c·cᵀ)`.
    pub fn about_origin(&self) -> Mat3 {
        self.inertia
            + self.mass * (self.center.norm_squared() * Mat3::identity() - self.center * self.center.transpose())
    }

    /// Returns the properties of both masses joined; `other` is in the same frame.
    pub fn with(&self, other: &LinkMass) -> LinkMass {
        let mass = self.mass + other.mass;
        if mass == 0.0 {
            return LinkMass { inertia: self.inertia + other.inertia, ..*self };
        }
        let center = (self.mass * self.center + other.mass * other.center) / mass;
        let moved = |m: &LinkMass| LinkMass { center: m.center - center, ..*m }.about_origin();
        LinkMass { mass, center, inertia: moved(self) + moved(other) }
    }

    /// Returns the properties in the frame in which this one's frame has pose `pose`.
    pub fn seen_from(&self, pose: &Pose) -> LinkMass {
        let r = pose.rotation.to_rotation_matrix().into_inner();
        LinkMass {
            mass: self.mass,
            center: pose.transform_point(&self.center.into()).coords,
            inertia: r * self.inertia * r.transpose(),
        }
    }

    fn validate(&self, link: &str) -> Result<(), ModelError> {
        let range_error =
            |what, value, expected| Err(ModelError::Inertia { link: link.to_string(), what, value, expected });
        if !(self.mass.is_finite() && self.mass >= 0.0) {
            return range_error("mass", self.mass, "finite and at least 0 kg");
        }
        if let Some(value) = self.center.iter().copied().find(|x| !x.is_finite()) {
            return range_error("a coordinate of the center of mass", value, "finite");
        }
        if let Some(value) = self.inertia.iter().copied().find(|x| !x.is_finite()) {
            return range_error("an entry of the inertia", value, "finite");
        }
        let size = self.inertia.amax();
        let skew = (self.inertia - self.inertia.transpose()).amax();
        if skew > 1e-9 * size {
            return range_error("the asymmetry of the inertia", skew, "0");
        }
        let moments = SymmetricEigen::new(0.5 * (self.inertia + self.inertia.transpose())).eigenvalues;
        if moments.min() < -1e-12 * size {
            return range_error("the least principal moment of inertia", moments.min(), "at least 0 kg·m²");
        }
        Ok(())
    }
}

/// A moving link.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Link {
    /// Name, unique in the model.
    pub name: String,
    /// Parent link; `None` for a root, which is attached to the world or floats.
    pub parent: Option<usize>,
    /// Joint to the parent; never [`Joint::Fixed`]; axes are unit.
    pub joint: Joint,
    /// The joint's frame in the parent link's frame, or in the world for a root. For a floating
    /// root it is the initial pose only: the pose is in `q`.
    pub placement: Pose,
    /// Mass properties, with those of all fixed links folded in, link frame.
    pub mass: LinkMass,
    /// Index of its first position number.
    pub q: usize,
    /// Index of its first velocity number.
    pub v: usize,
    /// Inertia of the rotor that drives its joint, as the joint meets it: added to the diagonal of
    /// the mass matrix, of a spherical joint to all three of its numbers. kg·m² of a revolute or spherical joint, kg of
    /// a prismatic one, 0 of all others.
    pub armature: f64,
}

/// A named frame that moves with a link. There is one for every link, folded ones included.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct LinkFrame {
    /// Name of the link.
    pub name: String,
    /// Moving link that carries the frame; `None` for the base.
    pub link: Option<usize>,
    /// Pose in that link's frame, or in the base frame.
    pub pose: Pose,
    /// Mass properties of the link alone, its own frame: without those of fixed links.
    pub mass: LinkMass,
}

/// Identity of the inertias of a model: each change makes another one.
#[derive(Clone, Debug, Default)]
pub(in crate::articulated) struct Inertias(Arc<()>);

impl Inertias {
    /// Returns whether nothing was changed between the two.
    pub fn are(&self, others: &Inertias) -> bool {
        Arc::ptr_eq(&self.0, &others.0)
    }
}

impl PartialEq for Inertias {
    /// The numbers are compared, not how they came about.
    fn eq(&self, _: &Inertias) -> bool {
        true
    }
}

/// A tree of links with its coordinates.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Model {
    links: Vec<Link>,
    frames: Vec<LinkFrame>,
    positions: usize,
    dof: usize,
    #[serde(skip)]
    inertias: Inertias,
}

impl Model {
    /// Returns the moving links, parents first.
    pub fn links(&self) -> &[Link] {
        &self.links
    }

    /// Returns all named frames, in the order in which their links were added.
    pub fn frames(&self) -> &[LinkFrame] {
        &self.frames
    }

    /// Returns the frame of that name.
    pub fn frame(&self, name: &str) -> Option<&LinkFrame> {
        self.frames.iter().find(|f| f.name == name)
    }

    /// Returns the index in [`frames`](Self::frames) of the frame of that name.
    pub fn frame_index(&self, name: &str) -> Option<usize> {
        self.frames.iter().position(|f| f.name == name)
    }

    /// Returns the index of the moving link of that name.
    pub fn link(&self, name: &str) -> Option<usize> {
        self.links.iter().position(|l| l.name == name)
    }

    /// Returns the length of `q`.
    pub fn positions(&self) -> usize {
        self.positions
    }

    /// Returns the length of `v`: the number of degrees of freedom.
    pub fn dof(&self) -> usize {
        self.dof
    }

    /// Writes the zero position: unit quaternions, all else 0.
    pub fn write_zero(&self, q: &mut [f64]) {
        q[..self.positions].fill(0.0);
        for link in &self.links {
            if let Some(k) = link.joint.quaternion() {
                q[link.q + k + 3] = 1.0;
            }
        }
    }

    /// Moves the base: the placements of all roots that do not float.
    pub(in crate::articulated) fn place(&mut self, step: &Pose) {
        for link in self.links.iter_mut().filter(|l| l.parent.is_none() && l.joint != Joint::Floating) {
            link.placement = step * link.placement;
        }
    }

    /// Returns the total mass, kg.
    pub fn mass(&self) -> f64 {
        self.links.iter().map(|l| l.mass.mass).sum()
    }
}

/// Collects links and makes a [`Model`].
///
/// ```
/// use tumble_core::{Joint, LinkMass, ModelBuilder, collide::{Mat3, Pose, Vec3}};
/// let rod = LinkMass { mass: 1.0, center: Vec3::new(0.0, 0.0, -0.5), inertia: Mat3::from_diagonal(&Vec3::new(1.0 / 12.0, 1.0 / 12.0, 0.0)) };
/// let mut builder = ModelBuilder::new();
/// let upper = builder.link("upper", None, Joint::revolute(Vec3::y()), Pose::identity(), rod);
/// builder.link("lower", Some(upper), Joint::revolute(Vec3::y()), Pose::translation(0.0, 0.0, -1.0), rod);
/// let model = builder.build()?;
/// assert_eq!(model.dof(), 2);
/// # Ok::<(), tumble_core::ModelError>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct ModelBuilder {
    added: Vec<Added>,
}

#[derive(Clone, Debug)]
struct Added {
    name: String,
    parent: Option<usize>,
    joint: Joint,
    placement: Pose,
    mass: LinkMass,
    armature: f64,
}

impl ModelBuilder {
    /// Makes a builder without links.
    pub fn new() -> ModelBuilder {
        ModelBuilder::default()
    }

    /// Adds a link and returns its number, for its children. `placement` is the joint's frame in
    /// the parent link's frame; with the joint at zero it is also the link's frame.
    /// [`build`](Self::build) checks everything.
    pub fn link(
        &mut self,
        name: impl Into<String>,
        parent: Option<usize>,
        joint: Joint,
        placement: Pose,
        mass: LinkMass,
    ) -> usize {
        self.added.push(Added { name: name.into(), parent, joint, placement, mass, armature: 0.0 });
        self.added.len() - 1
    }

    /// Sets the [`armature`](Link::armature) of the revolute, prismatic or spherical joint of a link that was
    /// added; a number of no link has no effect.
    pub fn set_armature(&mut self, link: usize, armature: f64) {
        if let Some(added) = self.added.get_mut(link) {
            added.armature = armature;
        }
    }

    /// Builds the model: checks everything, folds fixed links into their parents and numbers the
    /// coordinates.
    ///
    /// # Errors
    /// [`ModelError`] for the first property that is not valid.
    pub fn build(self) -> Result<Model, ModelError> {
        if self.added.len() > MAX_LINKS {
            return Err(ModelError::TooMany);
        }
        let mut model =
            Model { links: Vec::new(), frames: Vec::new(), positions: 0, dof: 0, inertias: Inertias::default() };
        let mut names = BTreeMap::new();
        for (number, added) in self.added.into_iter().enumerate() {
            if names.insert(added.name.clone(), number).is_some() {
                return Err(ModelError::DuplicateName(added.name));
            }
            model.add(number, added)?;
        }
        if model.frames.is_empty() {
            return Err(ModelError::Empty);
        }
        model.check_masses()?;
        Ok(model)
    }
}

impl Model {
    /// Sets the [`armature`](Link::armature) of the joint of a moving link, by its number.
    ///
    /// # Errors
    /// [`ModelError`] if the joint has none, the value is out of its range, or nothing that the joint moves has an inertia
    /// without it. Nothing is changed then.
    pub(crate) fn set_armature(&mut self, link: usize, armature: f64) -> Result<(), ModelError> {
        let own = &mut self.links[link];
        check_armature(&own.name, &own.joint, armature)?;
        let before = std::mem::replace(&mut own.armature, armature);
        self.inertias = Inertias::default();
        self.check_masses().inspect_err(|_| self.links[link].armature = before)
    }

    /// Sets the mass properties of a link alone, by the number of its frame; those of links that are fixed to it stay.
    ///
    /// # Errors
    /// [`ModelError`] if they are out of their range, or a joint then moves no inertia. Nothing is changed then.
    pub(crate) fn set_mass(&mut self, frame: usize, mass: LinkMass) -> Result<(), ModelError> {
        mass.validate(&self.frames[frame].name)?;
        let before = std::mem::replace(&mut self.frames[frame].mass, mass);
        let Some(link) = self.frames[frame].link else { return Ok(()) };
        let folded = std::mem::replace(&mut self.links[link].mass, LinkMass::none());
        self.links[link].mass = self.folded_mass(link);
        self.inertias = Inertias::default();
        self.check_masses().inspect_err(|_| (self.links[link].mass, self.frames[frame].mass) = (folded, before))
    }

    /// Returns the mass properties of a moving link with those of all links that are fixed to it, in the order in which they
    /// were added.
    fn folded_mass(&self, link: usize) -> LinkMass {
        let mut frames = self.frames.iter().filter(|frame| frame.link == Some(link));
        let own = frames.next().map_or_else(LinkMass::none, |frame| frame.mass);
        frames.fold(own, |sum, frame| sum.with(&frame.mass.seen_from(&frame.pose)))
    }

    fn add(&mut self, number: usize, added: Added) -> Result<(), ModelError> {
        let Added { name, parent, joint, mut placement, mass, armature } = added;
        if parent.is_some_and(|p| p >= number) {
            return Err(ModelError::Parent { link: name, parent: parent.unwrap_or(number) });
        }
        if joint == Joint::Floating && parent.is_some() {
            return Err(ModelError::Floating(name));
        }
        let unit = (placement.rotation.norm() - 1.0).abs() < 1e-9;
        if !unit || placement.translation.vector.iter().any(|x| !x.is_finite()) {
            return Err(ModelError::Placement(name));
        }
        mass.validate(&name)?;
        check_armature(&name, &joint, armature)?;
        let mut carrier = None;
        if let Some(frame) = parent.map(|p| &self.frames[p]) {
            (carrier, placement) = (frame.link, frame.pose * placement);
        }
        if joint == Joint::Fixed {
            if let Some(link) = carrier {
                let carried = &mut self.links[link].mass;
                *carried = carried.with(&mass.seen_from(&placement));
            }
            self.frames.push(LinkFrame { name, link: carrier, pose: placement, mass });
            return Ok(());
        }
        let joint = unit_axis(joint, &name)?;
        self.frames.push(LinkFrame { name: name.clone(), link: Some(self.links.len()), pose: Pose::identity(), mass });
        let (q, v) = (self.positions, self.dof);
        self.positions += joint.positions();
        self.dof += joint.dof();
        self.links.push(Link { name, parent: carrier, joint, placement, mass, q, v, armature });
        Ok(())
    }

    /// Returns whether parents precede their children, coordinates are contiguous and every joint
    /// moves some inertia. A builder ensures this; a damaged archive may violate it.
    pub(crate) fn is_sound(&self) -> bool {
        let mut ends = (0, 0);
        let armatures = self.links.iter().all(|link| check_armature(&link.name, &link.joint, link.armature).is_ok());
        let links = self.links.iter().enumerate().all(|(i, link)| {
            let starts = std::mem::replace(&mut ends, (link.q + link.joint.positions(), link.v + link.joint.dof()));
            link.parent.is_none_or(|parent| parent < i) && (link.q, link.v) == starts && link.joint.dof() > 0
        });
        let frames = self.frames.iter().all(|frame| {
            frame.link.is_none_or(|link| link < self.links.len()) && frame.mass.validate(&frame.name).is_ok()
        });
        links && armatures && frames && ends == (self.positions, self.dof) && self.check_masses().is_ok()
    }

    /// Checks that every joint moves a link with mass or inertia, or has an armature.
    fn check_masses(&self) -> Result<(), ModelError> {
        let mut heavy: Vec<bool> =
            self.links.iter().map(|l| l.mass.mass > 0.0 || l.mass.inertia.amax() > 0.0).collect();
        for i in (0..self.links.len()).rev() {
            if !heavy[i] && self.links[i].armature == 0.0 {
                return Err(ModelError::Massless(self.links[i].name.clone()));
            }
            if let Some(parent) = self.links[i].parent {
                heavy[parent] |= heavy[i];
            }
        }
        Ok(())
    }
}

fn check_armature(link: &str, joint: &Joint, armature: f64) -> Result<(), ModelError> {
    let has_one = joint.dof() == 1 || *joint == Joint::Spherical;
    if armature.is_finite() && (armature == 0.0 || has_one && armature > 0.0) {
        return Ok(());
    }
    let expected = match has_one {
        true => "finite and at least 0",
        false => "0: only revolute, prismatic and spherical joints have one",
    };
    Err(ModelError::Inertia { link: link.to_string(), what: "the armature of its joint", value: armature, expected })
}

fn unit_axis(joint: Joint, link: &str) -> Result<Joint, ModelError> {
    let unit = |axis: Vec3| {
        let norm = axis.norm();
        let fine = norm.is_finite() && norm > 1e-12;
        if fine {
            Ok(axis / norm)
        } else {
            Err(ModelError::Axis { link: link.to_string(), axis: [axis.x, axis.y, axis.z] })
        }
    };
    Ok(match joint {
        Joint::Revolute { axis } => Joint::Revolute { axis: unit(axis)? },
        Joint::Prismatic { axis } => Joint::Prismatic { axis: unit(axis)? },
        other => other,
    })
}
