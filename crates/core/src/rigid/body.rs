//! The constants of a rigid body and how it is made.

use super::BodyError;
use super::inertia::Inertia;
use crate::object::Material;
use crate::object::collidable::CollisionGroup;
use crate::object::mounts::{CameraMount, LightMount};
use crate::object::visual::Visual;
use nalgebra::Translation3;
use tumble_collide::{ContactMode, Mat3, Pose, Shape, Vec3};

/// A rigid body. Its mode in the world (static, kinematic or dynamic) is not part of it.
#[derive(Clone)]
pub struct RigidBody {
    pub(super) name: String,
    pub(super) shape: Shape,
    pub(super) mass: f64,
    /// `√m`.
    pub(super) root_mass: f64,
    pub(super) inertia: Inertia,
    /// Surface constants.
    pub material: Material,
    /// Linear damping, 1/s: a force `−c·P`, evaluated at the stage's state like all forces; keep `c·dt` below 1.
    pub linear_damping: f64,
    /// Angular damping, 1/s: a torque `−c·L`.
    pub angular_damping: f64,
    /// How its mesh or cylinder collides.
    pub contact_mode: ContactMode,
    /// Its collision group.
    pub group: CollisionGroup,
    /// Groups that it collides with, one bit each.
    pub mask: u64,
    /// Pose of its frame at time 0.
    pub initial_pose: Pose,
    /// Velocity of the center of mass at time 0, m/s.
    pub initial_velocity: Vec3,
    /// Angular velocity at time 0, rad/s, world axes.
    pub initial_angular_velocity: Vec3,
    fixed: bool,
    /// Center of mass in the body's frame, meters.
    center: Vec3,
    pub(super) visuals: Vec<Visual>,
    pub(super) cameras: Vec<CameraMount>,
    pub(super) lights: Vec<LightMount>,
}

impl RigidBody {
    /// Makes a body of the given mass (kg) and inertia (about the center of mass, body axes, kg·m²). Its frame is the shape's, for a mesh the frame of
    /// its file.
    ///
    /// # Errors
    /// [`BodyError`]: the mass is not positive, or no body has this inertia.
    pub fn new(name: impl Into<String>, shape: Shape, mass: f64, inertia: Mat3) -> Result<RigidBody, BodyError> {
        let name = name.into();
        if !(mass.is_finite() && mass > 0.0) {
            return Err(BodyError::Mass { name, mass });
        }
        let inertia = Inertia::new(&name, inertia)?;
        let visuals = vec![Visual::shape(0, Pose::identity(), shape.clone(), Default::default())];
        Ok(RigidBody {
            name,
            center: shape.center_of_mass(),
            shape,
            mass,
            root_mass: mass.sqrt(),
            inertia,
            material: Material::default(),
            contact_mode: ContactMode::default(),
            linear_damping: 0.0,
            angular_damping: 0.0,
            group: CollisionGroup::default(),
            mask: u64::MAX,
            initial_pose: Pose::identity(),
            initial_velocity: Vec3::zeros(),
            initial_angular_velocity: Vec3::zeros(),
            fixed: false,
            visuals,
            cameras: Vec::new(),
            lights: Vec::new(),
        })
    }

    /// Makes a body of uniform density, kg/m³.
    ///
    /// # Errors
    /// [`BodyError`]: the shape has no mass properties (a half-space), or the density is not positive.
    pub fn with_density(name: impl Into<String>, shape: Shape, density: f64) -> Result<RigidBody, BodyError> {
        let name = name.into();
        let properties = match shape.mass_properties(density) {
            Ok(properties) => properties,
            Err(why) => return Err(BodyError::Shape { name, why: why.to_string() }),
        };
        RigidBody::new(name, shape, properties.mass, properties.inertia)
    }

    /// Makes a uniform body of the given mass, kg.
    ///
    /// # Errors
    /// [`BodyError`]: the mass is not positive, or the shape has no mass properties (a half-space).
    pub fn with_mass(name: impl Into<String>, shape: Shape, mass: f64) -> Result<RigidBody, BodyError> {
        let name = name.into();
        if !(mass.is_finite() && mass > 0.0) {
            return Err(BodyError::Mass { name, mass });
        }
        let unit = RigidBody::with_density(name.clone(), shape.clone(), 1.0)?;
        RigidBody::new(name, shape, mass, unit.inertia.tensor * (mass / unit.mass))
    }

    /// Makes a body that stays static or kinematic. Its mass and inertia are 1 and have no effect, so the shape may be unbounded.
    pub fn fixed(name: impl Into<String>, shape: Shape) -> RigidBody {
        match RigidBody::new(name, shape, 1.0, Mat3::identity()) {
            Ok(body) => RigidBody { fixed: true, ..body },
            Err(_) => unreachable!("unit mass and inertia are valid"),
        }
    }

    /// Returns whether [`fixed`](Self::fixed) made it, so that its mass has no meaning.
    pub fn is_fixed(&self) -> bool {
        self.fixed
    }

    /// Sets the pose of its frame at time 0.
    #[must_use]
    pub fn at(mut self, pose: Pose) -> Self {
        self.initial_pose = pose;
        self
    }

    /// Sets the velocity (m/s) and angular velocity (rad/s, world axes) at time 0.
    #[must_use]
    pub fn moving(mut self, velocity: Vec3, angular_velocity: Vec3) -> Self {
        self.initial_velocity = velocity;
        self.initial_angular_velocity = angular_velocity;
        self
    }

    /// Sets restitution (0 to 1) and friction (at least 0).
    #[must_use]
    pub fn surface(mut self, restitution: f64, friction: f64) -> Self {
        self.material = Material { restitution, friction, ..self.material };
        self
    }

    /// Sets the number of its material, which selects it in pairs of materials (see [`Material::id`]).
    #[must_use]
    pub fn of_material(mut self, id: u32) -> Self {
        self.material.id = id;
        self
    }

    /// Sets how its mesh or cylinder collides.
    #[must_use]
    pub fn colliding_by(mut self, mode: ContactMode) -> Self {
        self.contact_mode = mode;
        self
    }

    /// Sets its visuals; by default its shape in gray.
    #[must_use]
    pub fn drawn_as(mut self, visuals: Vec<Visual>) -> Self {
        self.visuals = visuals;
        self
    }

    /// Adds a camera; its pose is in the body's frame.
    #[must_use]
    pub fn with_camera(mut self, mut camera: CameraMount) -> Self {
        camera.pose = Translation3::from(-self.center) * camera.pose;
        self.cameras.push(camera);
        self
    }

    /// Adds a light; its pose is in the body's frame.
    #[must_use]
    pub fn with_light(mut self, mut light: LightMount) -> Self {
        light.pose = Translation3::from(-self.center) * light.pose;
        self.lights.push(light);
        self
    }

    /// Replaces cameras and lights by others whose poses are in the frame of the part.
    pub(crate) fn carrying(mut self, cameras: Vec<CameraMount>, lights: Vec<LightMount>) -> Self {
        (self.cameras, self.lights) = (cameras, lights);
        self
    }

    /// Returns the mass, kg.
    pub fn mass(&self) -> f64 {
        self.mass
    }

    /// Returns the inertia about the center of mass in body axes, kg·m².
    pub fn inertia(&self) -> &Mat3 {
        &self.inertia.tensor
    }

    /// Returns the center of mass in the body's frame, meters: the origin except for meshes.
    pub fn center_of_mass(&self) -> Vec3 {
        self.center
    }

    /// Returns the pose of the body's frame for a pose of its center of mass (that of the part).
    pub fn frame_of(&self, part_state: &Pose) -> Pose {
        part_state * Translation3::from(-self.center)
    }

    /// Returns the pose of the center of mass (that of the part) for a pose of the body's frame.
    pub fn center_pose_of(&self, frame: &Pose) -> Pose {
        frame * Translation3::from(self.center)
    }

    /// Returns its shape, in the frame of its part.
    pub fn shape(&self) -> &Shape {
        &self.shape
    }

    /// Checks all constants that can be set freely: restitution in 0..=1, friction and damping at least 0, finite pose and velocity.
    ///
    /// # Errors
    /// [`BodyError`] names the first constant that is out of its range.
    pub fn validate(&self) -> Result<(), BodyError> {
        let range = |what, value: f64, right: bool, wanted| {
            if right && value.is_finite() {
                Ok(())
            } else {
                Err(BodyError::Range { name: self.name.clone(), what, value, wanted })
            }
        };
        let (m, unit) = (&self.material, self.initial_pose.rotation.norm());
        range("restitution", m.restitution, (0.0..=1.0).contains(&m.restitution), "between 0 and 1")?;
        range("friction", m.friction, m.friction >= 0.0, "at least 0")?;
        range("linear damping", self.linear_damping, self.linear_damping >= 0.0, "at least 0")?;
        range("angular damping", self.angular_damping, self.angular_damping >= 0.0, "at least 0")?;
        range("norm of the orientation", unit, (unit - 1.0).abs() < 1e-6, "1")?;
        let numbers = [self.initial_pose.translation.vector, self.initial_velocity, self.initial_angular_velocity];
        numbers
            .iter()
            .flat_map(|v| v.iter())
            .try_for_each(|&value| range("a position or velocity", value, true, "finite"))
    }
}
