//! The constants of a rigid body and how it is made.

use super::inertia::{Inertia, symmetric};
use super::{BodyError, LockedAxes};
use crate::object::collidable::CollisionGroup;
use crate::object::mounts::{CameraMount, LightMount};
use crate::object::visual::Visual;
use crate::object::{Intersect, Material, ShapeFilter, ShapeFilters, ShapeMaterials};
use nalgebra::Translation3;
use std::sync::Arc;
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
    /// Why the mass or inertia that was set is not valid; mass and inertia are then those before.
    error: Option<BodyError>,
    /// Surface constants.
    pub material: Material,
    /// Linear damping, 1/s, at least 0: a force `−c·P`. Without other forces the velocity decays by
    /// `exp(−c·t)`, at any length of a step.
    pub linear_damping: f64,
    /// Angular damping, 1/s, at least 0: a torque `−c·H`.
    pub angular_damping: f64,
    /// Factor of the world's gravity, any finite number; 1 by default.
    pub gravity_scale: f64,
    /// Axes of the world along which it does not move, or about which it does not turn; none by
    /// default. Change it by [`World::change_body`](crate::World::change_body), which clears the
    /// velocity along these axes.
    pub locked: LockedAxes,
    /// How its mesh or cylinder collides.
    pub contact_mode: ContactMode,
    /// Its collision group.
    pub group: CollisionGroup,
    /// Groups that it collides with, one bit each.
    pub mask: u64,
    /// Whether it is a sensor: it has no contacts, and the world reports the bodies that overlap it.
    pub sensor: bool,
    /// Direction, of any length above 0, in the body's frame, of a body that collides on one side only; `None` for all
    /// others. See [`with_one_way`](Self::with_one_way).
    pub one_way: Option<Vec3>,
    /// Pose of its frame at time 0.
    pub initial_pose: Pose,
    /// Velocity of the center of mass at time 0, m/s.
    pub initial_velocity: Vec3,
    /// Angular velocity at time 0, rad/s, world axes.
    pub initial_angular_velocity: Vec3,
    fixed: bool,
    /// Center of mass of the uniform shape in the body's frame, meters: the origin of the part.
    center: Vec3,
    /// Center of mass in the frame of the part, meters.
    pub(super) offset: Vec3,
    pub(super) visuals: Vec<Visual>,
    pub(super) cameras: Vec<CameraMount>,
    pub(super) lights: Vec<LightMount>,
    pub(super) intersect: Option<Arc<dyn Intersect>>,
    /// Constants of parts of its compound, ascending.
    pub(super) shape_materials: ShapeMaterials,
    /// Filters of parts of its compound, ascending.
    pub(super) shape_filters: ShapeFilters,
    /// Name of a shape that is no compound.
    pub(crate) shape_name: Option<String>,
}

impl RigidBody {
    /// Density of a body whose mass is not given, kg/m³: that of water.
    pub const DEFAULT_DENSITY: f64 = 1000.0;

    /// Makes a uniform body with the [default density](Self::DEFAULT_DENSITY), or the densities of
    /// the parts of a compound, and the default [`Material`]. Its frame is the shape's, for a mesh the frame of its file. Methods `with_…`
    /// set its constants:
    ///
    /// ```
    /// use tumble_core::prelude::*;
    /// let mut world = World::default();
    /// let rubber = Material { restitution: 0.8, friction: 0.9, ..Material::default() };
    /// let ball = RigidBody::new(Shape::sphere(0.1)?).with_name("ball").with_mass(2.0).with_material(rubber);
    /// let ball = world.add(ball.with_pose(Pose::translation(0.0, 0.0, 1.0)))?;
    /// assert_eq!(world.body(ball)?.name(), "ball");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// [`World::add`](crate::World::add) checks all constants; [`validate`](Self::validate) does it
    /// before.
    #[must_use]
    pub fn new(shape: Shape) -> RigidBody {
        let density = shape.own_density().unwrap_or(Self::DEFAULT_DENSITY);
        RigidBody::fixed(shape).with_density(density)
    }

    /// Makes a body that stays static or kinematic. Its mass and inertia are 1 and have no effect,
    /// so the shape may be unbounded.
    #[must_use]
    pub fn fixed(shape: Shape) -> RigidBody {
        RigidBody {
            name: String::new(),
            center: shape.center_of_mass(),
            offset: Vec3::zeros(),
            visuals: vec![Visual::shape(0, Pose::identity(), shape.clone(), Default::default())],
            shape,
            mass: 1.0,
            root_mass: 1.0,
            inertia: Inertia::unit(),
            error: None,
            material: Material::default(),
            contact_mode: ContactMode::default(),
            linear_damping: 0.0,
            angular_damping: 0.0,
            gravity_scale: 1.0,
            locked: LockedAxes::default(),
            group: CollisionGroup::default(),
            mask: u64::MAX,
            sensor: false,
            one_way: None,
            initial_pose: Pose::identity(),
            initial_velocity: Vec3::zeros(),
            initial_angular_velocity: Vec3::zeros(),
            fixed: true,
            cameras: Vec::new(),
            lights: Vec::new(),
            intersect: None,
            shape_materials: ShapeMaterials::default(),
            shape_filters: ShapeFilters::default(),
            shape_name: None,
        }
    }

    /// Sets an intersection test of its own, which [`Collidable::intersect`](crate::Collidable::intersect) returns. An archive
    /// does not have it.
    #[must_use]
    pub fn with_intersect(mut self, test: Arc<dyn Intersect>) -> Self {
        self.set_intersect(Some(test));
        self
    }

    /// Sets or removes the intersection test of its own.
    pub fn set_intersect(&mut self, test: Option<Arc<dyn Intersect>>) {
        self.intersect = test;
    }

    /// Returns the intersection test of its own.
    pub fn intersect(&self) -> Option<&Arc<dyn Intersect>> {
        self.intersect.as_ref()
    }

    /// Sets the name, unique in its world and of any length. Without one, the world makes a name.
    #[must_use]
    pub fn with_name(mut self, name: impl Into<String>) -> Self {
        self.name = name.into();
        self
    }

    /// Sets the density, kg/m³, of a uniform body: mass and inertia follow from the shape. The body
    /// is not [fixed](Self::is_fixed) any more.
    #[must_use]
    pub fn with_density(self, density: f64) -> Self {
        let properties = self.shape.mass_properties(density).map_err(|why| BodyError::Shape(why.to_string()));
        self.with_mass_properties(properties.map(|p| (p.mass, p.inertia)))
    }

    /// Sets the mass, kg, of a uniform body: the inertia follows from the shape. The body is not
    /// [fixed](Self::is_fixed) any more.
    #[must_use]
    pub fn with_mass(self, mass: f64) -> Self {
        let properties = match self.shape.mass_properties(1.0) {
            _ if !(mass.is_finite() && mass > 0.0) => Err(BodyError::Mass(mass)),
            Ok(unit) => Ok((mass, symmetric(&unit.inertia) * (mass / unit.mass))),
            Err(why) => Err(BodyError::Shape(why.to_string())),
        };
        self.with_mass_properties(properties)
    }

    /// Sets mass (kg) and inertia (about the center of mass, body axes, kg·m²) of a body that is
    /// not uniform, whatever its shape. The body is not [fixed](Self::is_fixed) any more.
    #[must_use]
    pub fn with_mass_and_inertia(self, mass: f64, inertia: Mat3) -> Self {
        let valid = mass.is_finite() && mass > 0.0;
        self.with_mass_properties(if valid { Ok((mass, inertia)) } else { Err(BodyError::Mass(mass)) })
    }

    /// Sets the inertia about the center of mass (body axes, kg·m²) and keeps the mass.
    #[must_use]
    pub fn with_inertia(self, inertia: Mat3) -> Self {
        let mass = self.mass;
        self.with_mass_properties(Ok((mass, inertia)))
    }

    /// Sets the center of mass, a point of the body's frame, meters. The inertia stays as it is: it
    /// is about the new center. [`World::set_center_of_mass`](crate::World::set_center_of_mass)
    /// changes that of a body in a world.
    #[must_use]
    pub fn with_center_of_mass(mut self, center: Vec3) -> Self {
        self.offset = center - self.center;
        self
    }

    /// Sets the center of mass in the frame of the part, meters.
    pub(crate) fn with_center_in_part(mut self, offset: Vec3) -> Self {
        self.offset = offset;
        self
    }

    /// Sets the factor of the world's gravity.
    #[must_use]
    pub fn with_gravity_scale(mut self, scale: f64) -> Self {
        self.gravity_scale = scale;
        self
    }

    /// Sets linear and angular damping, 1/s.
    #[must_use]
    pub fn with_damping(mut self, linear: f64, angular: f64) -> Self {
        (self.linear_damping, self.angular_damping) = (linear, angular);
        self
    }

    /// Locks axes of the world.
    #[must_use]
    pub fn with_locked(mut self, locked: LockedAxes) -> Self {
        self.locked = locked;
        self
    }

    fn with_mass_properties(mut self, properties: Result<(f64, Mat3), BodyError>) -> Self {
        self.fixed = false;
        match properties.and_then(|(mass, inertia)| Ok((mass, Inertia::new(&inertia)?))) {
            Ok((mass, inertia)) => {
                (self.mass, self.root_mass, self.inertia, self.error) = (mass, mass.sqrt(), inertia, None)
            }
            Err(error) => self.error = Some(error),
        }
        self
    }

    /// Returns whether [`fixed`](Self::fixed) made it, so that its mass has no meaning.
    pub fn is_fixed(&self) -> bool {
        self.fixed
    }

    /// Sets the pose of its frame at time 0.
    #[must_use]
    pub fn with_pose(mut self, pose: Pose) -> Self {
        self.initial_pose = pose;
        self
    }

    /// Sets the velocity of the center of mass at time 0, m/s.
    #[must_use]
    pub fn with_velocity(mut self, velocity: Vec3) -> Self {
        self.initial_velocity = velocity;
        self
    }

    /// Sets the angular velocity at time 0, rad/s, world axes.
    #[must_use]
    pub fn with_angular_velocity(mut self, angular_velocity: Vec3) -> Self {
        self.initial_angular_velocity = angular_velocity;
        self
    }

    /// Sets the constants of its surface.
    #[must_use]
    pub fn with_material(mut self, material: Material) -> Self {
        self.material = material;
        self
    }

    /// Sets the constants of the surface of one shape: the part of its compound with this index, in the order
    /// of [`CompoundShape::parts`](tumble_collide::CompoundShape::parts). The others have those of the body.
    #[must_use]
    pub fn with_shape_material(mut self, shape: usize, material: Material) -> Self {
        self.set_shape_material(shape, Some(material));
        self
    }

    /// Sets the constants of one shape, or removes them. A body in a world is changed by
    /// [`World::change_body`](crate::World::change_body).
    pub fn set_shape_material(&mut self, shape: usize, material: Option<Material>) {
        self.shape_materials.set(shape, material);
    }

    /// Returns the constants of the surface of one shape: its own, or those of the body.
    pub fn shape_material(&self, shape: usize) -> Material {
        self.shape_materials.get(shape).unwrap_or(self.material)
    }

    /// Returns the shapes with constants of their own, ascending.
    pub fn shape_materials(&self) -> &[(usize, Material)] {
        self.shape_materials.as_slice()
    }

    /// Sets what one shape collides with, and whether it is a sensor: the part of its compound with this index. The others have group,
    /// mask and sensor of the body.
    ///
    /// ```
    /// use tumble_core::collide::{CompoundPart, CompoundShape};
    /// use tumble_core::prelude::*;
    /// use tumble_core::{CollisionGroup, ShapeFilter};
    /// let shapes = [0.0, 1.0].map(|x| CompoundPart::new(Shape::sphere(0.1).unwrap(), Pose::translation(x, 0.0, 0.0)));
    /// let body = RigidBody::new(Shape::Compound(CompoundShape::new(shapes.into())?.into()));
    /// let feeler = ShapeFilter { sensor: true, ..ShapeFilter::default() };
    /// let body = body.with_shape_filter(1, feeler);
    /// assert_eq!((body.shape_filter(0).sensor, body.shape_filter(1).sensor), (false, true));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn with_shape_filter(mut self, shape: usize, filter: ShapeFilter) -> Self {
        self.set_shape_filter(shape, Some(filter));
        self
    }

    /// Sets what one shape collides with, or removes it. A body in a world is changed by
    /// [`World::change_body`](crate::World::change_body).
    pub fn set_shape_filter(&mut self, shape: usize, filter: Option<ShapeFilter>) {
        self.shape_filters.set(shape, filter);
    }

    /// Returns what one shape collides with: its own filter, or that of the body.
    pub fn shape_filter(&self, shape: usize) -> ShapeFilter {
        let own = ShapeFilter { group: self.group, mask: self.mask, sensor: self.sensor };
        self.shape_filters.get(shape).unwrap_or(own)
    }

    /// Returns the shapes with filters of their own, ascending.
    pub fn shape_filters(&self) -> &[(usize, ShapeFilter)] {
        self.shape_filters.as_slice()
    }

    /// Sets the name of its shape. A compound has none: its [parts](tumble_collide::CompoundPart::with_name) have.
    #[must_use]
    pub fn with_shape_name(mut self, name: impl Into<String>) -> Self {
        self.shape_name = Some(name.into());
        self
    }

    /// Returns the name of a shape, by the number that contacts report: a part of its compound, or 0.
    pub fn shape_name(&self, shape: usize) -> Option<&str> {
        let own = self.shape_name.as_deref().filter(|_| shape == 0);
        own.or_else(|| self.shape.part_name(shape))
    }

    /// Returns the number of the shape of that name.
    pub fn shape_named(&self, name: &str) -> Option<usize> {
        (0..self.shape.part_count()).find(|&shape| self.shape_name(shape) == Some(name))
    }

    /// Sets how its mesh or cylinder collides.
    #[must_use]
    pub fn with_contact_mode(mut self, mode: ContactMode) -> Self {
        self.contact_mode = mode;
        self
    }

    /// Sets its collision group and the groups that it collides with, one bit each. Two bodies
    /// collide if the group of each is in the mask of the other.
    #[must_use]
    pub fn with_groups(mut self, group: CollisionGroup, mask: u64) -> Self {
        (self.group, self.mask) = (group, mask);
        self
    }

    /// Makes it a sensor: it has no contacts, and the world reports the bodies that overlap it
    /// ([`World::events`](crate::World::events), [`World::touching`](crate::World::touching)).
    #[must_use]
    pub fn with_sensor(mut self, sensor: bool) -> Self {
        self.sensor = sensor;
        self
    }

    /// Makes it collide on one side only, as an open terrain and a platform that is entered from below: with what
    /// comes against `direction` (any length above 0, the body's frame), and not with what comes along it.
    ///
    /// A contact exists if the outward normal of the body has a component along the direction, and the other body is
    /// not in it by more than a tenth of its bounding radius: what came from the other side, or has fallen deeper, passes.
    #[must_use]
    pub fn with_one_way(mut self, direction: Vec3) -> Self {
        self.one_way = Some(direction);
        self
    }

    /// Sets its visuals; by default its shape in gray.
    #[must_use]
    pub fn with_visuals(mut self, visuals: Vec<Visual>) -> Self {
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

    /// Replaces its cameras by others, whose poses are in the body's frame; none removes them.
    pub fn set_cameras(&mut self, cameras: impl IntoIterator<Item = CameraMount>) {
        let to_part = Translation3::from(-self.center);
        self.cameras = cameras.into_iter().map(|mount| CameraMount { pose: to_part * mount.pose, ..mount }).collect();
    }

    /// Adds a light; its pose is in the body's frame.
    #[must_use]
    pub fn with_light(mut self, mut light: LightMount) -> Self {
        light.pose = Translation3::from(-self.center) * light.pose;
        self.lights.push(light);
        self
    }

    /// Replaces its lights by others, whose poses are in the body's frame; none removes them.
    pub fn set_lights(&mut self, lights: impl IntoIterator<Item = LightMount>) {
        let to_part = Translation3::from(-self.center);
        self.lights = lights.into_iter().map(|mount| LightMount { pose: to_part * mount.pose, ..mount }).collect();
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

    /// Returns the center of mass in the body's frame, meters: the origin except for meshes, and
    /// bodies with a center of [their own](Self::with_center_of_mass).
    pub fn center_of_mass(&self) -> Vec3 {
        self.center + self.offset
    }

    /// Returns the center of mass in the frame of the part, meters: zero except for bodies with a
    /// center of [their own](Self::with_center_of_mass).
    pub fn center_in_part(&self) -> Vec3 {
        self.offset
    }

    /// Returns the pose of the body's frame for a pose of its part.
    pub fn frame_of(&self, part_state: &Pose) -> Pose {
        part_state * Translation3::from(-self.center)
    }

    /// Returns the pose of the center of mass, with the axes of the body, for a pose of the body's
    /// frame.
    pub fn center_pose_of(&self, frame: &Pose) -> Pose {
        frame * Translation3::from(self.center_of_mass())
    }

    /// Returns its shape, in the frame of its part.
    pub fn shape(&self) -> &Shape {
        &self.shape
    }

    /// Checks all constants: a positive mass, an inertia that a body can have, restitution in
    /// 0..=1, friction and damping at least 0, finite pose and velocity.
    ///
    /// # Errors
    /// [`BodyError`] names the first constant that is out of its range.
    pub fn validate(&self) -> Result<(), BodyError> {
        if let Some(error) = &self.error {
            return Err(error.clone());
        }
        let range = |what, value: f64, right: bool, expected| {
            if right && value.is_finite() { Ok(()) } else { Err(BodyError::Range { what, value, expected }) }
        };
        let unit = self.initial_pose.rotation.norm();
        let parts = if let Shape::Compound(compound) = &self.shape { compound.parts().len() } else { 0 };
        for material in std::iter::once(&self.material).chain(self.shape_materials().iter().map(|(_, own)| own)) {
            material.validate().map_err(|(what, value, expected)| BodyError::Range { what, value, expected })?;
        }
        if let Some((shape, _)) = self.shape_materials().last() {
            let expected = "below the number of parts of the body's compound";
            range("index of a shape with a material", *shape as f64, *shape < parts, expected)?;
        }
        if let Some((shape, _)) = self.shape_filters().last() {
            let expected = "below the number of parts of the body's compound";
            range("index of a shape with a filter", *shape as f64, *shape < parts, expected)?;
            let own = self.one_way.is_none() && self.intersect.is_none();
            let expected = "0 on a one-sided body and on one with an intersection test of its own";
            range("number of shapes with filters", self.shape_filters().len() as f64, own, expected)?;
        }
        if let Some(name) = &self.shape_name {
            check_shape_name(name, &self.shape)?;
        }
        range("linear damping", self.linear_damping, self.linear_damping >= 0.0, "at least 0")?;
        range("angular damping", self.angular_damping, self.angular_damping >= 0.0, "at least 0")?;
        range("gravity scale", self.gravity_scale, true, "finite")?;
        let length = self.one_way.map_or(1.0, |direction| direction.norm());
        range("length of the one-way direction", length, length > 0.0, "above 0")?;
        self.offset.iter().try_for_each(|&x| range("center of mass", x, true, "finite"))?;
        range("norm of the orientation", unit, (unit - 1.0).abs() < 1e-6, "1")?;
        let numbers = [self.initial_pose.translation.vector, self.initial_velocity, self.initial_angular_velocity];
        numbers
            .iter()
            .flat_map(|v| v.iter())
            .try_for_each(|&value| range("a position or velocity", value, true, "finite"))
    }
}

/// Checks the name of a whole shape.
pub(crate) fn check_shape_name(name: &str, shape: &Shape) -> Result<(), BodyError> {
    let wrong = |expected| Err(BodyError::ShapeName { name: name.into(), expected });
    match shape {
        Shape::Compound(_) => wrong("a compound has no name of its own: name its parts"),
        _ if name.is_empty() => wrong("it must have a letter, or be left out"),
        _ => Ok(()),
    }
}
