//! An articulated body from links with shapes, in code.

use super::body::{ArticulatedBody, ArticulatedError};
use super::builder_error::ArticulationError;
use super::collider::Collider;
use super::model::dof::{Coupling, DofSettings, Drive, Spring};
use super::model::joint::Joint;
use super::model::{LinkMass, ModelBuilder};
use crate::RigidBody;
use crate::object::visual::Visual;
use crate::object::{Appearance, Material};
use nalgebra::Translation3;
use tumble_collide::{Pose, Shape, Vec3};

/// The mass of a link.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Mass {
    /// kg/m³, of all shapes.
    Density(f64),
    /// kg, distributed over the volumes of all shapes.
    Total(f64),
    /// In numbers.
    Given(LinkMass),
}

/// The purpose of a shape of a link.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Use {
    /// It is only drawn and has mass.
    Drawn,
    /// It collides with the surface of its link.
    Collides,
    /// It collides with a surface of its own.
    HasSurface,
}

/// A link of an [`ArticulationBuilder`]: its joint, its shapes and its mass.
///
/// A link with shapes has by default the density of water; a link without shapes has no mass.
#[derive(Clone, Debug)]
#[must_use]
pub struct LinkBuilder {
    name: String,
    parent: Option<String>,
    joint: Joint,
    pose: Pose,
    shapes: Vec<(Collider, Use)>,
    mass: Mass,
    dof: DofSettings,
    armature: f64,
    cone: Option<(usize, f64)>,
    appearance: Appearance,
    material: Material,
    position: Option<f64>,
    velocity: Option<f64>,
}

impl LinkBuilder {
    /// Makes a link that a joint attaches to the base.
    pub fn new(name: impl Into<String>, joint: Joint) -> LinkBuilder {
        LinkBuilder {
            name: name.into(),
            parent: None,
            joint,
            pose: Pose::identity(),
            shapes: Vec::new(),
            mass: Mass::Density(RigidBody::DEFAULT_DENSITY),
            dof: DofSettings::default(),
            armature: 0.0,
            cone: None,
            appearance: Appearance::default(),
            material: Material::default(),
            position: None,
            velocity: None,
        }
    }

    /// Attaches it to a link that was added before, instead of the base.
    pub fn with_parent(mut self, parent: impl Into<String>) -> Self {
        self.parent = Some(parent.into());
        self
    }

    /// Sets the frame of the joint in the frame of the parent link, or of the base: m. With the joint
    /// at zero it is also the frame of the link.
    pub fn with_pose(mut self, pose: Pose) -> Self {
        self.pose = pose;
        self
    }

    /// Adds a shape that collides and is drawn, at a pose in the frame of the link.
    pub fn with_shape(mut self, shape: Shape, pose: Pose) -> Self {
        self.shapes.push((Collider::new(shape, pose), Use::Collides));
        self
    }

    /// Adds a shape that collides and is drawn, with surface constants, groups and a name of its own.
    pub fn with_collider(mut self, collider: Collider) -> Self {
        self.shapes.push((collider, Use::HasSurface));
        self
    }

    /// Sets the name of the shape that was added last.
    pub fn with_shape_name(mut self, name: impl Into<String>) -> Self {
        if let Some((collider, _)) = self.shapes.last_mut() {
            collider.name = Some(name.into());
        }
        self
    }

    /// Adds a shape that is drawn and has mass, and does not collide.
    pub fn with_visual_shape(mut self, shape: Shape, pose: Pose) -> Self {
        self.shapes.push((Collider::new(shape, pose), Use::Drawn));
        self
    }

    /// Makes the shape that was added last collide on one side only: with what comes against `direction` (any length above
    /// 0, the frame of the shape).
    pub fn with_one_way(mut self, direction: Vec3) -> Self {
        if let Some((collider, _)) = self.shapes.last_mut() {
            collider.one_way = Some(direction);
        }
        self
    }

    /// Distributes a mass, kg, over the volumes of its shapes.
    pub fn with_mass(mut self, mass: f64) -> Self {
        self.mass = Mass::Total(mass);
        self
    }

    /// Sets the density of its shapes, kg/m³.
    pub fn with_density(mut self, density: f64) -> Self {
        self.mass = Mass::Density(density);
        self
    }

    /// Sets mass, center of mass and inertia in numbers, in the frame of the link.
    pub fn with_mass_properties(mut self, mass: LinkMass) -> Self {
        self.mass = Mass::Given(mass);
        self
    }

    /// Sets the limits of the position of its joint, rad or m.
    pub fn with_limits(mut self, limits: [f64; 2]) -> Self {
        self.dof.limits = Some(limits);
        self
    }

    /// Sets the viscous damping of its joint, N·m·s/rad or N·s/m.
    pub fn with_joint_damping(mut self, damping: f64) -> Self {
        self.dof.damping = damping;
        self
    }

    /// Sets the dry friction of its joint, N·m or N.
    pub fn with_joint_friction(mut self, friction: f64) -> Self {
        self.dof.friction = friction;
        self
    }

    /// Sets the largest swing of its spherical joint, rad: the half angle of a cone about axis 0, 1 or 2 (x, y or z) of the
    /// joint's frame, in which the same axis of the link stays.
    pub fn with_cone(mut self, axis: usize, angle: f64) -> Self {
        self.cone = Some((axis, angle));
        self
    }

    /// Sets the largest speed of its joint, rad/s or m/s; infinite for none.
    pub fn with_max_velocity(mut self, max_velocity: f64) -> Self {
        self.dof.max_velocity = max_velocity;
        self
    }

    /// Sets the force of its motor, N·m or N, the limit of drives that name none; infinite if it is not known.
    pub fn with_effort(mut self, effort: f64) -> Self {
        self.dof.effort = effort;
        self
    }

    /// Sets the inertia of the rotor that drives its revolute, prismatic or spherical joint, as the joint meets it, kg·m² or kg:
    /// [`Link::armature`](crate::articulated::Link::armature).
    pub fn with_armature(mut self, armature: f64) -> Self {
        self.armature = armature;
        self
    }

    /// Sets a spring of its joint: stiffness, N·m/rad or N/m, and rest position, rad or m.
    pub fn with_spring(mut self, stiffness: f64, rest: f64) -> Self {
        self.dof.spring = Some(Spring { stiffness, rest });
        self
    }

    /// Sets the drive of its joint.
    pub fn with_drive(mut self, drive: Drive) -> Self {
        self.dof.drive = drive;
        self
    }

    /// Sets all settings of its joint.
    pub fn with_dof(mut self, dof: DofSettings) -> Self {
        self.dof = dof;
        self
    }

    /// Sets the position of a revolute or prismatic joint at time 0, rad or m.
    pub fn with_position(mut self, position: f64) -> Self {
        self.position = Some(position);
        self
    }

    /// Sets the velocity of a revolute or prismatic joint at time 0, rad/s or m/s.
    pub fn with_velocity(mut self, velocity: f64) -> Self {
        self.velocity = Some(velocity);
        self
    }

    /// Sets the surface constants of its shapes.
    pub fn with_material(mut self, material: Material) -> Self {
        self.material = material;
        self
    }

    /// Sets the appearance of its shapes.
    pub fn with_appearance(mut self, appearance: Appearance) -> Self {
        self.appearance = appearance;
        self
    }

    /// Returns its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    fn mass(&self, body: &str) -> Result<LinkMass, ArticulationError> {
        let names = || (body.to_string(), self.name.clone());
        let shape_error = |why| {
            let (body, link) = names();
            ArticulationError::Shape { body, link, why }
        };
        let density = match self.mass {
            Mass::Given(mass) => return Ok(mass),
            Mass::Density(density) => density,
            Mass::Total(_) if self.shapes.is_empty() => {
                let (body, link) = names();
                return Err(ArticulationError::NoShape { body, link });
            }
            // the mass is scaled below, where its value is checked
            Mass::Total(_) => 1.0,
        };
        let mut sum = LinkMass::none();
        for (collider, _) in &self.shapes {
            let own = collider.shape.mass_properties(density).map_err(shape_error)?;
            let center = Pose::from(Translation3::from(collider.shape.center_of_mass()));
            let own = LinkMass { mass: own.mass, center: own.center_of_mass, inertia: own.inertia };
            sum = sum.with(&own.seen_from(&(collider.pose * center)));
        }
        if let Mass::Total(mass) = self.mass {
            sum.inertia *= mass / sum.mass;
            sum.mass = mass;
        }
        Ok(sum)
    }
}

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
            let number = model.link(&link.name, parent, link.joint, link.pose, link.mass(name)?);
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
                    && link.cone.is_none()
                    && link.position.is_none()
                    && link.velocity.is_none()
                {
                    true => continue,
                    false => return Err(self.wrong_joint(link, "it has settings of a joint")),
                }
            };
            let spherical = link.joint == Joint::Spherical;
            if link.cone.is_some() && !spherical {
                return Err(self.wrong_joint(link, "it has a cone, which only spherical joints have"));
            }
            if spherical && link.dof.limits.is_some() {
                return Err(self.wrong_joint(link, "it has limits of one angle; a spherical joint has a cone"));
            }
            if link.cone.is_some_and(|(axis, _)| axis > 2) {
                return Err(self.wrong_joint(link, "the axis of its cone is not 0, 1 or 2"));
            }
            for (k, index) in (v..v + link.joint.dof()).enumerate() {
                let cone = link.cone.filter(|(axis, _)| *axis == k).map(|(_, cone)| [0.0, cone]);
                body.set_dof(index, DofSettings { limits: link.dof.limits.or(cone), ..link.dof.clone() })?;
            }
            for (value, index) in [(link.position, q), (link.velocity, velocities + v)] {
                let Some(value) = value else { continue };
                if link.joint.dof() != 1 {
                    return Err(self.wrong_joint(link, "it has a position or a velocity, which needs one"));
                }
                start[index] = value;
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
    for (collider, kind) in &link.shapes {
        let center = Translation3::from(collider.shape.center_of_mass());
        let visual = Visual::shape(0, collider.pose * center, collider.shape.clone(), link.appearance.clone());
        body.add_visual(&link.name, visual)?;
        let collider = match kind {
            Use::Drawn => continue,
            Use::Collides => collider.clone().with_material(link.material),
            Use::HasSurface => collider.clone(),
        };
        body.add_collider(&link.name, collider)?;
    }
    Ok(())
}
