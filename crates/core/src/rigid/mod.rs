//! The rigid body (thesis §III.A): state `X = [x, q, P, L]`.
//!
//! | numbers | meaning |
//! |---|---|
//! | 0–2 | position of the center of mass `x`, meters |
//! | 3–6 | orientation `q` as `x, y, z, w` |
//! | 7–9 | linear momentum `P`, N·s |
//! | 10–12 | angular momentum `L` about the center of mass, world axes, N·m·s |
//!
//! Generalized velocity `v = [ω; v]`, world axes at the center of mass; mass matrix `M = diag(R·I·Rᵀ, m·1)`. BodyCache takes
//! `L = diag(I^½·Rᵀ, √m·1)`, with `I^½` the symmetric root of the body inertia, so that `M = LᵀL`.
//!
//! The site is at the center of mass (thesis §III.A.1), with the axes of the body. The body's *frame*, in which users place it, is that of its shape: a mesh
//! keeps the frame of its file, and the center of mass stands at [`RigidBody::center_of_mass`] in it. State, velocities and sites know the center of
//! mass alone; [`World::pose`](crate::World::pose), [`World::set_pose`](crate::World::set_pose) and [`RigidBody::at`] convert.

pub(crate) mod rotation;

use crate::derived::Cache;
use crate::object::collidable::{Collidable, CollisionGroup, Material};
use crate::object::mounts::{CameraCarrier, CameraMount, LightCarrier, LightMount};
use crate::object::part_state::{ForceSlice, Forces, PartState, StateRange, StateSizes};
use crate::object::sync;
use crate::object::visual::Visual;
use crate::object::{Energy, Integratable, Momentum, NetSync, Object, Renderable, SyncError};
use crate::world::view::WorldView;
use nalgebra::{Quaternion, SymmetricEigen, Translation3, Unit};
use tumble_collide::{ContactMode, Mat3, Pose, Quat, Shape, Vec3};

/// What is wrong with the constants of a body.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BodyError {
    /// The mass is not a positive finite number.
    #[error("body '{name}': mass is {mass} kg; it must be finite and above 0")]
    Mass {
        /// Body.
        name: String,
        /// Value given.
        mass: f64,
    },
    /// The inertia is not that of any body.
    #[error(
        "body '{name}': inertia has principal moments {moments:?} kg·m²; each must be finite and above 0, and none above the sum of the other two"
    )]
    Inertia {
        /// Body.
        name: String,
        /// Principal moments of the value given.
        moments: [f64; 3],
    },
    /// A constant is out of its range.
    #[error("body '{name}': {what} is {value}; it must be {wanted}")]
    Range {
        /// Body.
        name: String,
        /// Which constant.
        what: &'static str,
        /// Value given.
        value: f64,
        /// What would be right.
        wanted: &'static str,
    },
    /// The shape has no mass properties of its own.
    #[error("body '{name}': {why}")]
    Shape {
        /// Body.
        name: String,
        /// From the shape.
        why: String,
    },
}

/// A rigid body, or static and kinematic geometry: the mode is the world's switch.
#[derive(Clone)]
pub struct RigidBody {
    name: String,
    shape: Shape,
    mass: f64,
    /// `√m`.
    root_mass: f64,
    inertia: Inertia,
    /// Surface constants.
    pub material: Material,
    /// Linear damping, 1/s: a force `−c·P`, taken at the stage's state like any other; keep `c·dt` below 1.
    pub linear_damping: f64,
    /// Angular damping, 1/s: a torque `−c·L`.
    pub angular_damping: f64,
    /// How its mesh or cylinder collides.
    pub contact_mode: ContactMode,
    /// Its kind, for filtering.
    pub group: CollisionGroup,
    /// Kinds it meets, one bit each.
    pub mask: u64,
    /// Pose of its frame at time 0.
    pub initial_pose: Pose,
    /// Velocity of the center of mass at time 0, m/s.
    pub initial_velocity: Vec3,
    /// Angular velocity at time 0, rad/s, world axes.
    pub initial_angular_velocity: Vec3,
    fixed: bool,
    /// The center of mass in the body's frame, meters.
    center: Vec3,
    visuals: Vec<Visual>,
    cameras: Vec<CameraMount>,
    lights: Vec<LightMount>,
}

/// Body inertia and its roots.
#[derive(Clone)]
struct Inertia {
    tensor: Mat3,
    inverse: Mat3,
    root: Mat3,
    inverse_root: Mat3,
    moments: Vec3,
    principal: Quat,
}

/// Blocks of the maps at one orientation.
struct BodyCache {
    /// Angular block of `L⁻ᵀ`: `I^{-½}·Rᵀ`.
    solve_lt: Mat3,
    /// Angular block of `Lᵀ`: `R·I^½`.
    mul_lt: Mat3,
}

impl RigidBody {
    /// A body of the given mass and inertia (about the center of mass, body axes, kg·m²). Its frame is the shape's, that of its file for a mesh.
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

    /// A body of uniform density, kg/m³.
    pub fn with_density(name: impl Into<String>, shape: Shape, density: f64) -> Result<RigidBody, BodyError> {
        let name = name.into();
        let properties = match shape.mass_properties(density) {
            Ok(properties) => properties,
            Err(why) => return Err(BodyError::Shape { name, why: why.to_string() }),
        };
        RigidBody::new(name, shape, properties.mass, properties.inertia)
    }

    /// A uniform body of the given mass, kg.
    pub fn with_mass(name: impl Into<String>, shape: Shape, mass: f64) -> Result<RigidBody, BodyError> {
        let name = name.into();
        if !(mass.is_finite() && mass > 0.0) {
            return Err(BodyError::Mass { name, mass });
        }
        let unit = RigidBody::with_density(name.clone(), shape.clone(), 1.0)?;
        RigidBody::new(name, shape, mass, unit.inertia.tensor * (mass / unit.mass))
    }

    /// Geometry that is meant to stay static or kinematic: mass and inertia are 1 and never felt, so it may be unbounded.
    pub fn fixed(name: impl Into<String>, shape: Shape) -> RigidBody {
        match RigidBody::new(name, shape, 1.0, Mat3::identity()) {
            Ok(body) => RigidBody { fixed: true, ..body },
            Err(_) => unreachable!("unit mass and inertia are valid"),
        }
    }

    /// Whether it was made as a fixture, with a mass that means nothing.
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

    /// Sets the number of its material, by which pairs of materials are found (see [`Material::id`]).
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

    /// Sets what it looks like; by default its shape in gray.
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

    /// Replaces cameras and lights by others whose poses are in the frame of the site.
    pub(crate) fn carrying(mut self, cameras: Vec<CameraMount>, lights: Vec<LightMount>) -> Self {
        (self.cameras, self.lights) = (cameras, lights);
        self
    }

    /// Mass, kg.
    pub fn mass(&self) -> f64 {
        self.mass
    }

    /// Inertia about the center of mass in body axes, kg·m².
    pub fn inertia(&self) -> &Mat3 {
        &self.inertia.tensor
    }

    /// The center of mass in the body's frame, meters: the origin except for meshes.
    pub fn center_of_mass(&self) -> Vec3 {
        self.center
    }

    /// Pose of the body's frame, for one of its center of mass (the site's).
    pub fn frame_of(&self, part_state: &Pose) -> Pose {
        part_state * Translation3::from(-self.center)
    }

    /// Pose of the center of mass (the site), for one of the body's frame.
    pub fn center_pose_of(&self, frame: &Pose) -> Pose {
        frame * Translation3::from(self.center)
    }

    /// Its geometry, in the frame of its site.
    pub fn shape(&self) -> &Shape {
        &self.shape
    }

    /// Checks everything that can be set freely: restitution in 0..=1, friction and damping at least 0, finite pose and velocity.
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

    /// Twice the kinetic energy of its rotation, J.
    fn spinning(&self, x: &[f64]) -> f64 {
        let m = orientation(x).inverse_transform_vector(&vec3(&x[10..]));
        m.dot(&(self.inertia.inverse * m))
    }

    /// Angular velocity for an orientation and an angular momentum.
    fn omega(&self, q: &Quat, l: &Vec3) -> Vec3 {
        q * (self.inertia.inverse * q.inverse_transform_vector(l))
    }
}

impl Inertia {
    fn new(name: &str, tensor: Mat3) -> Result<Inertia, BodyError> {
        let symmetric = 0.5 * (tensor + tensor.transpose());
        let bad = |moments: [f64; 3]| BodyError::Inertia { name: name.to_string(), moments };
        if symmetric.iter().any(|x| !x.is_finite()) {
            return Err(bad([f64::NAN; 3]));
        }
        let (mut axes, moments) = principal_axes(&symmetric);
        let (sum, largest) = (moments.sum(), moments.max());
        if moments.min() <= 0.0 || 2.0 * largest > sum * (1.0 + 1e-9) {
            return Err(bad([moments.x, moments.y, moments.z]));
        }
        if axes.determinant() < 0.0 {
            axes.column_mut(2).neg_mut();
        }
        let with = |f: fn(f64) -> f64| axes * Mat3::from_diagonal(&moments.map(f)) * axes.transpose();
        let principal = Quat::from_rotation_matrix(&nalgebra::Rotation3::from_matrix_unchecked(axes));
        Ok(Inertia {
            tensor: symmetric,
            inverse: with(|i| 1.0 / i),
            root: with(f64::sqrt),
            inverse_root: with(|i| 1.0 / i.sqrt()),
            moments,
            principal,
        })
    }
}

/// Eigenvectors (columns) and eigenvalues; a diagonal tensor keeps its own axes.
fn principal_axes(tensor: &Mat3) -> (Mat3, Vec3) {
    let off = tensor.m12.abs().max(tensor.m13.abs()).max(tensor.m23.abs());
    if off <= 1e-14 * tensor.diagonal().amax() {
        return (Mat3::identity(), tensor.diagonal());
    }
    let eigen = SymmetricEigen::new(*tensor);
    (eigen.eigenvectors, eigen.eigenvalues)
}

pub(crate) fn vec3(x: &[f64]) -> Vec3 {
    Vec3::new(x[0], x[1], x[2])
}

/// The orientation in a rigid body's slice of the state; kept at unit length by every writer.
pub(crate) fn orientation(x: &[f64]) -> Quat {
    Unit::new_unchecked(Quaternion::new(x[6], x[3], x[4], x[5]))
}

fn write_orientation(x: &mut [f64], q: &Quat) {
    x[3..7].copy_from_slice(q.coords.as_slice());
}

fn add(x: &mut [f64], v: &Vec3, h: f64) {
    x.iter_mut().zip(v.iter()).for_each(|(x, v)| *x += h * v);
}

fn write6(out: &mut [f64], angular: &Vec3, linear: &Vec3) {
    out[..3].copy_from_slice(angular.as_slice());
    out[3..6].copy_from_slice(linear.as_slice());
}

impl Object for RigidBody {
    fn name(&self) -> &str {
        &self.name
    }

    fn fork(&self) -> Box<dyn Object> {
        Box::new(self.clone())
    }

    fn new_cache(&self) -> Cache {
        Cache::new(BodyCache { solve_lt: self.inertia.inverse_root, mul_lt: self.inertia.root })
    }

    fn refresh(&self, x: &[f64], cache: &mut Cache, part_states: &mut [PartState]) {
        let cache: &mut BodyCache = cache.get();
        let q = orientation(x);
        let r = q.to_rotation_matrix().into_inner();
        cache.solve_lt = self.inertia.inverse_root * r.transpose();
        cache.mul_lt = r * self.inertia.root;
        let part_state = &mut part_states[0];
        part_state.pose = Pose::from_parts(Translation3::from(vec3(x)), q);
        part_state.velocity = vec3(&x[7..]) / self.mass;
        part_state.angular_velocity = cache.solve_lt.tr_mul(&(cache.solve_lt * vec3(&x[10..])));
    }

    fn integratable(&self) -> Option<&dyn Integratable> {
        Some(self)
    }

    fn collidable(&self) -> Option<&dyn Collidable> {
        Some(self)
    }

    fn renderable(&self) -> Option<&dyn Renderable> {
        Some(self)
    }

    fn camera(&self) -> Option<&dyn CameraCarrier> {
        (!self.cameras.is_empty()).then_some(self)
    }

    fn light(&self) -> Option<&dyn LightCarrier> {
        (!self.lights.is_empty()).then_some(self)
    }

    fn net_sync(&self) -> Option<&dyn NetSync> {
        Some(self)
    }
}

/// The whole state, 13 little-endian `f64`: exact, for replicas. What only draws can do with less.
impl NetSync for RigidBody {
    fn get_data(&self, me: &StateRange, view: &WorldView, out: &mut Vec<u8>) {
        sync::write_state(&view.x[me.x.clone()], out);
    }

    fn read_data(&self, data: &[u8], x: &mut [f64]) -> Result<(), SyncError> {
        sync::read_state(data, x, |state| self.accepts(state))
    }
}

impl Integratable for RigidBody {
    fn state_sizes(&self) -> StateSizes {
        StateSizes { x: 13, dof: 6, parts: 1 }
    }

    fn write_initial(&self, x: &mut [f64]) {
        let (q, at) =
            (Unit::new_normalize(self.initial_pose.rotation.into_inner()), self.center_pose_of(&self.initial_pose));
        let l = q * (self.inertia.tensor * q.inverse_transform_vector(&self.initial_angular_velocity));
        x[..3].copy_from_slice(at.translation.vector.as_slice());
        write_orientation(x, &q);
        x[7..10].copy_from_slice((self.mass * self.initial_velocity).as_slice());
        x[10..13].copy_from_slice(l.as_slice());
    }

    fn accepts(&self, x: &[f64]) -> bool {
        let norm: f64 = x[3..7].iter().map(|q| q * q).sum();
        x.iter().all(|x| x.is_finite()) && (norm - 1.0).abs() < 1e-9
    }

    fn accumulate_forces(&self, me: &StateRange, view: &WorldView, out: &mut Forces) {
        let x = &view.x[me.x.clone()];
        let wrench = &mut out.wrenches[me.parts.start];
        wrench.force += self.mass * view.gravity - self.linear_damping * vec3(&x[7..]);
        wrench.torque -= self.angular_damping * vec3(&x[10..]);
    }

    fn velocity(&self, x: &[f64], v: &mut [f64]) {
        write6(v, &self.omega(&orientation(x), &vec3(&x[10..])), &(vec3(&x[7..]) / self.mass));
    }

    fn write_velocity(&self, x: &mut [f64], v: &[f64]) {
        let q = orientation(x);
        let l = q * (self.inertia.tensor * q.inverse_transform_vector(&vec3(v)));
        x[7..10].copy_from_slice((self.mass * vec3(&v[3..])).as_slice());
        x[10..13].copy_from_slice(l.as_slice());
    }

    fn derivative(&self, _cache: &mut Cache, _x: &[f64], f: &ForceSlice, dp: &mut [f64]) {
        write6(dp, &f.wrenches[0].torque, &f.wrenches[0].force);
        dp.iter_mut().zip(f.generalized).for_each(|(dp, f)| *dp += f);
    }

    fn accelerations(&self, _cache: &mut Cache, x: &[f64], dp: &[f64], part_states: &mut [PartState]) {
        let (q, l, part_state) = (orientation(x), vec3(&x[10..]), &mut part_states[0]);
        part_state.acceleration = vec3(&dp[3..]) / self.mass;
        // α = I⁻¹(τ − ω × L)
        part_state.angular_acceleration = self.omega(&q, &(vec3(dp) - part_state.angular_velocity.cross(&l)));
    }

    fn gyroscopic(&self, x: &[f64], out: &mut [f64]) {
        let l = vec3(&x[10..]);
        write6(out, &self.omega(&orientation(x), &l).cross(&l), &Vec3::zeros());
    }

    fn kick(&self, x: &mut [f64], dp: &[f64], h: f64) {
        add(&mut x[10..13], &vec3(dp), h);
        add(&mut x[7..10], &vec3(&dp[3..]), h);
    }

    fn free_motion(&self, _cache: &mut Cache, x: &mut [f64], h: f64) {
        let (p, l) = (vec3(&x[7..]), vec3(&x[10..]));
        add(&mut x[..3], &p, h / self.mass);
        if l != Vec3::zeros() {
            let principal = orientation(x) * self.inertia.principal;
            let turned =
                rotation::free_motion(&principal, &l, &self.inertia.moments, h) * self.inertia.principal.inverse();
            write_orientation(x, &turned);
        }
    }

    fn integrate_positions(&self, x: &mut [f64], v: &[f64], h: f64) {
        add(&mut x[..3], &vec3(&v[3..]), h);
        let turned = rotation::turn(&orientation(x), &vec3(v), h);
        write_orientation(x, &turned);
    }

    fn displace(&self, _cache: &mut Cache, x: &mut [f64], v: &[f64], h: f64) {
        let before = self.spinning(x);
        self.integrate_positions(x, v, h);
        let after = self.spinning(x);
        if before != after && after > 0.0 {
            // turned under the momentum that it has, the body has another energy
            x[10..13].iter_mut().for_each(|l| *l *= (before / after).sqrt());
        }
    }

    fn pull_back(&self, displacement: &[f64], v: &mut [f64]) {
        let rate = rotation::pull_back(&vec3(displacement), &vec3(v));
        v[..3].copy_from_slice(rate.as_slice());
    }

    /// `L⁻ᵀ·p`.
    fn whitened_velocity(&self, cache: &mut Cache, x: &[f64], u: &mut [f64]) {
        let cache: &mut BodyCache = cache.get();
        write6(u, &(cache.solve_lt * vec3(&x[10..])), &(vec3(&x[7..]) / self.root_mass));
    }

    fn mul_l(&self, cache: &mut Cache, v: &[f64], u: &mut [f64]) {
        let cache: &mut BodyCache = cache.get();
        write6(u, &cache.mul_lt.tr_mul(&vec3(v)), &(self.root_mass * vec3(&v[3..])));
    }

    fn solve_l(&self, cache: &mut Cache, u: &[f64], v: &mut [f64]) {
        let cache: &mut BodyCache = cache.get();
        write6(v, &cache.solve_lt.tr_mul(&vec3(u)), &(vec3(&u[3..]) / self.root_mass));
    }

    fn solve_lt(&self, cache: &mut Cache, j: &[f64], y: &mut [f64]) {
        let cache: &mut BodyCache = cache.get();
        write6(y, &(cache.solve_lt * vec3(j)), &(vec3(&j[3..]) / self.root_mass));
    }

    fn mul_lt(&self, cache: &mut Cache, u: &[f64], j: &mut [f64]) {
        let cache: &mut BodyCache = cache.get();
        write6(j, &(cache.mul_lt * vec3(u)), &(self.root_mass * vec3(&u[3..])));
    }

    fn may_sleep(&self) -> bool {
        true
    }

    fn energy(&self, x: &[f64], gravity: &Vec3) -> Energy {
        let (p, l) = (vec3(&x[7..]), vec3(&x[10..]));
        let kinetic = 0.5 * (p.norm_squared() / self.mass + l.dot(&self.omega(&orientation(x), &l)));
        Energy { kinetic, potential: -self.mass * gravity.dot(&vec3(x)) }
    }

    fn momentum(&self, x: &[f64]) -> Momentum {
        let p = vec3(&x[7..]);
        Momentum { linear: p, angular: vec3(&x[10..]) + vec3(x).cross(&p) }
    }
}

impl Collidable for RigidBody {
    fn parts(&self) -> usize {
        1
    }

    fn shape(&self, _part: usize) -> Option<&Shape> {
        Some(&self.shape)
    }

    fn material(&self, _part: usize) -> Material {
        self.material
    }

    fn collision_group(&self, _part: usize) -> CollisionGroup {
        self.group
    }

    fn contact_mode(&self, _part: usize) -> ContactMode {
        self.contact_mode
    }

    fn collides_with(&self, _part: usize, other: CollisionGroup) -> bool {
        self.mask & other.bit() != 0
    }

    fn test_impulse(
        &self,
        cache: &mut Cache,
        _part: usize,
        part_state: &PartState,
        point: &Vec3,
        axes: &[Vec3],
        sign: f64,
        y: &mut [f64],
    ) {
        let cache: &mut BodyCache = cache.get();
        let r = point - part_state.position();
        let linear = sign / self.root_mass;
        for (axis, y) in axes.iter().zip(y.chunks_exact_mut(6)) {
            let angular = cache.solve_lt * r.cross(axis);
            for k in 0..3 {
                y[k] += sign * angular[k];
                y[k + 3] += linear * axis[k];
            }
        }
    }
}

impl CameraCarrier for RigidBody {
    fn cameras(&self) -> &[CameraMount] {
        &self.cameras
    }
}

impl LightCarrier for RigidBody {
    fn lights(&self) -> &[LightMount] {
        &self.lights
    }
}

impl Renderable for RigidBody {
    fn visuals(&self) -> &[Visual] {
        &self.visuals
    }
}
