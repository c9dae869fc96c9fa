//! A link of an [`ArticulationBuilder`](super::ArticulationBuilder).

use super::builder_error::ArticulationError;
use super::collider::Collider;
use super::model::LinkMass;
use super::model::dof::{DofSettings, Drive, Spring};
use super::model::joint::Joint;
use crate::RigidBody;
use crate::object::collidable::CollisionGroup;
use crate::object::{Appearance, Material};
use nalgebra::Translation3;
use tumble_collide::{ContactMode, Pose, Quat, Shape, Vec3};

/// The mass of a link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Mass {
    /// The own densities of compounds, and that of water of other shapes.
    Usual,
    /// kg/m³, of all shapes.
    Density(f64),
    /// kg, distributed over the volumes of all shapes.
    Total(f64),
    /// In numbers.
    Given(LinkMass),
}

/// The purpose of a shape of a link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Use {
    /// It is only drawn and has mass.
    Drawn,
    /// It collides with the surface of its link.
    Collides,
    /// It collides with a surface of its own.
    HasSurface,
}

/// A shape of a link.
#[derive(Clone, Debug)]
pub(super) struct LinkShape {
    pub collider: Collider,
    pub purpose: Use,
    pub visible: bool,
    /// Its own; that of the link for `None`.
    pub appearance: Option<Appearance>,
    /// Its own, kg or kg/m³; that of the link for `None`.
    pub mass: Option<Mass>,
}

/// A link of an [`ArticulationBuilder`](super::ArticulationBuilder): its joint, its shapes and its mass.
///
/// A link with shapes has by default the density of water, or those of the parts of a compound, as a body; a link without
/// shapes has no mass.
#[derive(Clone, Debug)]
#[must_use]
pub struct LinkBuilder {
    pub(super) name: String,
    pub(super) parent: Option<String>,
    pub(super) joint: Joint,
    pub(super) pose: Pose,
    pub(super) shapes: Vec<LinkShape>,
    pub(super) mass: Mass,
    pub(super) dof: DofSettings,
    pub(super) armature: f64,
    pub(super) cone: Option<(usize, f64)>,
    pub(super) twist_limits: Option<(usize, [f64; 2])>,
    /// Settings of single degrees of freedom, instead of `dof`.
    pub(super) dofs: Vec<(usize, DofSettings)>,
    pub(super) appearance: Appearance,
    pub(super) material: Material,
    pub(super) contact_mode: ContactMode,
    pub(super) groups: (CollisionGroup, u64),
    pub(super) positions: Option<Vec<f64>>,
    pub(super) velocities: Option<Vec<f64>>,
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
            mass: Mass::Usual,
            dof: DofSettings::default(),
            armature: 0.0,
            cone: None,
            twist_limits: None,
            dofs: Vec::new(),
            appearance: Appearance::default(),
            material: Material::default(),
            contact_mode: ContactMode::default(),
            groups: (CollisionGroup::default(), u64::MAX),
            positions: None,
            velocities: None,
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
    pub fn with_shape(self, shape: Shape, pose: Pose) -> Self {
        self.with(Collider::new(shape, pose), Use::Collides)
    }

    /// Adds a shape that collides and is drawn, with surface constants, groups and a name of its own.
    pub fn with_collider(self, collider: Collider) -> Self {
        self.with(collider, Use::HasSurface)
    }

    /// Sets the name of the shape that was added last.
    pub fn with_shape_name(mut self, name: impl Into<String>) -> Self {
        if let Some(shape) = self.shapes.last_mut() {
            shape.collider.name = Some(name.into());
        }
        self
    }

    /// Sets the mass of the shape that was added last, kg, instead of that of the link's density.
    pub fn with_shape_mass(mut self, mass: f64) -> Self {
        self.shapes.last_mut().into_iter().for_each(|shape| shape.mass = Some(Mass::Total(mass)));
        self
    }

    /// Sets the density of the shape that was added last, kg/m³, instead of that of the link.
    pub fn with_shape_density(mut self, density: f64) -> Self {
        self.shapes.last_mut().into_iter().for_each(|shape| shape.mass = Some(Mass::Density(density)));
        self
    }

    /// Sets the appearance of the shape that was added last, instead of that of the link.
    pub fn with_shape_appearance(mut self, appearance: Appearance) -> Self {
        self.shapes.last_mut().into_iter().for_each(|shape| shape.appearance = Some(appearance.clone()));
        self
    }

    /// Sets whether the shape that was added last is drawn; by default it is.
    pub fn with_shape_visible(mut self, visible: bool) -> Self {
        self.shapes.last_mut().into_iter().for_each(|shape| shape.visible = visible);
        self
    }

    /// Makes the shape that was added last a [sensor](Collider::with_sensor).
    pub fn with_sensor(mut self, sensor: bool) -> Self {
        self.shapes.last_mut().into_iter().for_each(|shape| shape.collider.sensor = sensor);
        self
    }

    /// Adds a shape that is drawn and has mass, and does not collide.
    pub fn with_visual_shape(self, shape: Shape, pose: Pose) -> Self {
        self.with(Collider::new(shape, pose), Use::Drawn)
    }

    /// Makes the shape that was added last collide on one side only: with what comes against `direction` (any length above
    /// 0, the frame of the shape).
    pub fn with_one_way(mut self, direction: Vec3) -> Self {
        self.shapes.last_mut().into_iter().for_each(|shape| shape.collider.one_way = Some(direction));
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

    /// Sets the largest swing of its spherical joint, rad, 0 to π: the half angle of a cone about axis 0, 1 or 2 (x, y or z) of the
    /// joint's frame, in which the same axis of the link stays.
    pub fn with_cone(mut self, axis: usize, angle: f64) -> Self {
        self.cone = Some((axis, angle));
        self
    }

    /// Sets the limits of the twist of its spherical joint, rad: of the turn of the link about its axis 0, 1 or 2 (x, y or z), after
    /// the shortest turn of that axis of the joint's frame to it. At most 3π/2 apart and within 2π of 0.
    pub fn with_twist_limits(mut self, axis: usize, limits: [f64; 2]) -> Self {
        self.twist_limits = Some((axis, limits));
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

    /// Sets a spring of its joint: stiffness, N·m/rad or N/m, and rest position, rad or m; of a spherical joint each component of its
    /// rotation vector.
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

    /// Sets the settings of degree of freedom `k` of its joint instead of those of [`with_dof`](Self::with_dof): rest position and
    /// target of a spherical joint are component `k` of a rotation vector.
    pub fn with_dof_at(mut self, k: usize, dof: DofSettings) -> Self {
        self.dofs.push((k, dof));
        self
    }

    /// Returns the settings of degree of freedom `k` of its joint.
    pub(super) fn settings_of(&self, k: usize) -> DofSettings {
        let own = self.dofs.iter().rev().find(|(own, _)| *own == k).map_or(&self.dof, |(_, dof)| dof);
        let cone = self.cone.filter(|(axis, _)| *axis == k).map(|(_, cone)| [0.0, cone]);
        let twist = self.twist_limits.filter(|(axis, _)| *axis == k).map(|(_, limits)| limits);
        DofSettings { limits: own.limits.or(cone), twist_limits: own.twist_limits.or(twist), ..own.clone() }
    }

    /// Sets the position of a revolute or prismatic joint at time 0, rad or m.
    pub fn with_position(self, position: f64) -> Self {
        self.with_positions(&[position])
    }

    /// Sets the velocity of a revolute or prismatic joint at time 0, rad/s or m/s.
    pub fn with_velocity(self, velocity: f64) -> Self {
        self.with_velocities(&[velocity])
    }

    /// Sets the position of a joint of any type at time 0: as many numbers as [`Joint`] lists.
    pub fn with_positions(mut self, positions: &[f64]) -> Self {
        self.positions = Some(positions.to_vec());
        self
    }

    /// Sets the velocity of a joint of any type at time 0: as many numbers as [`Joint`] lists.
    pub fn with_velocities(mut self, velocities: &[f64]) -> Self {
        self.velocities = Some(velocities.to_vec());
        self
    }

    /// Sets the rotation of a spherical joint at time 0: of the link in the frame of the joint.
    pub fn with_rotation(self, rotation: Quat) -> Self {
        self.with_positions(rotation.coords.as_slice())
    }

    /// Sets the surface constants of its shapes.
    pub fn with_material(mut self, material: Material) -> Self {
        self.material = material;
        self
    }

    /// Sets collision group and mask, one bit for each group, of its shapes, as those of a
    /// [body](crate::RigidBody::with_groups).
    pub fn with_groups(mut self, group: CollisionGroup, mask: u64) -> Self {
        self.groups = (group, mask);
        self
    }

    /// Sets how its meshes and cylinders collide.
    pub fn with_contact_mode(mut self, mode: ContactMode) -> Self {
        self.contact_mode = mode;
        self
    }

    /// Sets the appearance of its shapes.
    pub fn with_appearance(mut self, appearance: Appearance) -> Self {
        self.appearance = appearance;
        self
    }

    /// Returns the settings of its joint: of all degrees of freedom without settings of their own.
    pub fn dof(&self) -> &DofSettings {
        &self.dof
    }

    /// Returns its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns a collider with the surface, the groups and the contact mode of the link, to change some of them for
    /// [`with_collider`](Self::with_collider).
    pub fn collider(&self, shape: Shape, pose: Pose) -> Collider {
        let (group, mask) = self.groups;
        let collider = Collider::new(shape, pose).with_material(self.material).with_groups(group, mask);
        collider.with_contact_mode(self.contact_mode)
    }

    fn with(mut self, collider: Collider, purpose: Use) -> Self {
        self.shapes.push(LinkShape { collider, purpose, visible: true, appearance: None, mass: None });
        self
    }

    /// Returns mass, center of mass and inertia, link frame.
    pub(super) fn link_mass(&self, body: &str) -> Result<LinkMass, ArticulationError> {
        let names = || (body.to_string(), self.name.clone());
        let own = self.shapes.iter().any(|shape| shape.mass.is_some());
        let usual = match self.mass {
            Mass::Given(_) | Mass::Total(_) if own => {
                let (body, link) = names();
                return Err(ArticulationError::TwoMasses { body, link });
            }
            Mass::Given(mass) => return Ok(mass),
            Mass::Usual | Mass::Density(_) => self.mass,
            Mass::Total(_) if self.shapes.is_empty() => {
                let (body, link) = names();
                return Err(ArticulationError::NoShape { body, link });
            }
            // the mass is scaled below, where its value is checked
            Mass::Total(_) => Mass::Density(1.0),
        };
        let mut sum = LinkMass::none();
        for LinkShape { collider, mass, .. } in &self.shapes {
            let properties = match mass.unwrap_or(usual) {
                Mass::Usual => {
                    let density = collider.shape.own_density().unwrap_or(RigidBody::DEFAULT_DENSITY);
                    collider.shape.mass_properties(density)
                }
                Mass::Density(density) => collider.shape.mass_properties(density),
                Mass::Total(mass) => collider.shape.mass_properties(1.0).map(|unit| unit.with_mass(mass)),
                Mass::Given(_) => continue,
            };
            let own = properties.map_err(|why| {
                let (body, link) = names();
                ArticulationError::Shape { body, link, why }
            })?;
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
