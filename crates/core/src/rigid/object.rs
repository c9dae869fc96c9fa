//! The traits of objects for the rigid body.

use super::rotation;
use super::state::{add, orientation, vec3, write_orientation, write6};
use super::{LockedAxes, RigidBody};
use crate::derived::Cache;
use crate::object::collidable::CollisionGroup;
use crate::object::mounts::{CameraMount, LightMount};
use crate::object::net_sync;
use crate::object::part_state::{ForceSlice, Forces, PartPoint, PartState, PointLoad, StateRange, StateSizes, Wrench};
use crate::object::visual::Visual;
use crate::object::{
    CameraCarrier, Collidable, Energy, Integratable, Intersect, LightCarrier, Material, Momentum, MomentumKind,
    NetSync, Object, Renderable, ShapeFilter, SyncError,
};
use crate::world::view::WorldView;
use nalgebra::{ComplexField, Translation3, Unit};
use tumble_collide::{ContactMode, Mat3, Pose, Quat, Shape, Vec3};

/// Blocks of the maps at one orientation.
pub(super) struct BodyCache {
    /// Angular block of `L⁻ᵀ`: `I^{-½}·Rᵀ`, or that of the free axes.
    solve_lt: Mat3,
    /// Angular block of `Lᵀ`: `R·I^½`, or that of the free axes.
    mul_lt: Mat3,
    /// The resistance of a body to turning in this step: its maps are those of `I + added`.
    pub(super) resistance: Option<Box<Resistance>>,
}

/// The resistance to turning in a step (`step/resistance.rs`): the state still holds the momentum of the body's own inertia `I`.
pub(super) struct Resistance {
    /// kg·m², body axes.
    added: Mat3,
    /// From angular momentum to whitened velocity, `L·I⁻¹`.
    from_momentum: Mat3,
    /// From a change of whitened velocity to one of angular momentum, `I·L⁻¹`.
    to_momentum: Mat3,
}

impl Resistance {
    pub fn new(added: Mat3) -> Resistance {
        Resistance { added, from_momentum: Mat3::identity(), to_momentum: Mat3::identity() }
    }
}

impl BodyCache {
    /// Replaces the maps of an inertia, world axes, in an orientation `r` by those of `inertia + added`.
    fn add_resistance(&mut self, inertia: &Mat3, r: &Mat3) {
        let Some(resistance) = &mut self.resistance else { return };
        let whole = inertia + r * resistance.added * r.transpose();
        let Some(factor) = whole.cholesky() else { return self.resistance = None };
        let lower = factor.l();
        let Some(inverse) = lower.try_inverse() else { return self.resistance = None };
        resistance.from_momentum = lower.transpose() * (self.solve_lt.transpose() * self.solve_lt);
        resistance.to_momentum = inertia * inverse.transpose();
        (self.solve_lt, self.mul_lt) = (inverse, lower);
    }
}

impl RigidBody {
    /// Returns twice the kinetic energy of rotation, J.
    fn spinning(&self, x: &[f64]) -> f64 {
        if !self.locked.rotates_freely() {
            let l = vec3(&x[10..]);
            return l.dot(&self.omega(&orientation(x), &l));
        }
        let m = orientation(x).inverse_transform_vector(&vec3(&x[10..]));
        m.dot(&(self.inertia.inverse * m))
    }

    /// Returns the angular velocity for an orientation and an angular momentum, world axes.
    pub(super) fn omega(&self, q: &Quat, l: &Vec3) -> Vec3 {
        if !self.locked.rotates_freely() {
            return self.locked.inverse(&self.world_inertia(q)) * l;
        }
        q * (self.inertia.inverse * q.inverse_transform_vector(l))
    }

    /// Returns the inertia in world axes.
    pub(super) fn world_inertia(&self, q: &Quat) -> Mat3 {
        let r = q.to_rotation_matrix().into_inner();
        r * self.inertia.tensor * r.transpose()
    }

    /// Returns the inertia about the center of mass in a state, world axes, kg·m²; `None` if axes are locked.
    pub(crate) fn free_inertia(&self, x: &[f64]) -> Option<Mat3> {
        (self.locked == LockedAxes::default()).then(|| self.world_inertia(&orientation(x)))
    }

    /// Returns the angular momentum of the state for an orientation and an angular velocity, world
    /// axes.
    fn angular_momentum(&self, q: &Quat, omega: &Vec3) -> Vec3 {
        let omega = self.locked.free_rotation(omega);
        self.locked.free_rotation(&(q * (self.inertia.tensor * q.inverse_transform_vector(&omega))))
    }

    /// Returns the velocity of the center of mass, world axes.
    fn center_velocity(&self, x: &[f64]) -> Vec3 {
        (vec3(&x[7..]) / self.mass).component_mul(&self.locked.free_translation())
    }

    /// Returns the rate of the angular momentum that turns the body without a change of its angular
    /// velocity, `ω × I·ω`, about the free axes.
    fn turning(&self, q: &Quat, omega: &Vec3, l: &Vec3) -> Vec3 {
        match self.locked.rotates_freely() {
            true => omega.cross(l),
            false => self.locked.free_rotation(&omega.cross(&(self.world_inertia(q) * omega))),
        }
    }

    /// Returns the vector from the center of mass to the origin of the part, world axes.
    pub(super) fn part_arm(&self, q: &Quat) -> Vec3 {
        -(q * self.offset)
    }

    /// Returns the lever arm of a point about the center of mass, world axes.
    fn arm(&self, at: &PartPoint) -> Vec3 {
        match self.offset == Vec3::zeros() {
            true => at.arm(),
            false => at.arm() + self.part_arm(&at.part_state.pose.rotation),
        }
    }

    /// Turns the body for `h` seconds at constant angular momentum about the free axes: exactly if
    /// one is free, else by the implicit midpoint rule, which is symmetric and of second order.
    fn turn_locked(&self, q: &Quat, l: &Vec3, h: f64) -> Quat {
        let mut omega = self.omega(q, l);
        for _ in 0..MIDPOINT_ITERATIONS {
            let middle = self.omega(&rotation::turn(q, &omega, 0.5 * h), l);
            let change = (middle - omega).norm();
            omega = middle;
            if change <= 1e-15 * omega.norm() {
                break;
            }
        }
        rotation::turn(q, &omega, h)
    }
}

/// Maximum number of iterations of the midpoint rule.
const MIDPOINT_ITERATIONS: usize = 30;

/// Returns the mean of `exp(−z·s)` for `s` from 0 to 1, `(1 − exp(−z))/z`.
fn mean_decay(z: f64) -> f64 {
    if z == 0.0 { 1.0 } else { -ComplexField::exp_m1(-z) / z }
}

impl Object for RigidBody {
    fn name(&self) -> &str {
        &self.name
    }

    fn new_cache(&self) -> Cache {
        let (solve_lt, mul_lt) = (self.inertia.inverse_root, self.inertia.root);
        Cache::new(BodyCache { solve_lt, mul_lt, resistance: None })
    }

    fn refresh(&self, x: &[f64], cache: &mut Cache, part_states: &mut [PartState]) {
        let cache: &mut BodyCache = cache.get();
        let q = orientation(x);
        let r = q.to_rotation_matrix().into_inner();
        if self.locked.rotates_freely() {
            cache.solve_lt = self.inertia.inverse_root * r.transpose();
            cache.mul_lt = r * self.inertia.root;
        } else {
            let roots = self.locked.roots(&(r * self.inertia.tensor * r.transpose()));
            (cache.solve_lt, cache.mul_lt) = (roots.inverse_root, roots.root);
        }
        let part_state = &mut part_states[0];
        part_state.pose = Pose::from_parts(Translation3::from(vec3(x)), q);
        part_state.velocity = self.center_velocity(x);
        part_state.angular_velocity = cache.solve_lt.tr_mul(&(cache.solve_lt * vec3(&x[10..])));
        if self.offset != Vec3::zeros() {
            let (arm, omega) = (self.part_arm(&q), part_state.angular_velocity);
            part_state.pose.translation.vector += arm;
            part_state.velocity += omega.cross(&arm);
            part_state.bias_acceleration = omega.cross(&omega.cross(&arm));
        } else {
            part_state.bias_acceleration = Vec3::zeros();
        }
        if cache.resistance.is_some() {
            cache.add_resistance(&self.world_inertia(&q), &r);
        }
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

/// The whole state, 13 little-endian `f64`: exact, for replicas. A process that only draws needs
/// less.
impl NetSync for RigidBody {
    fn get_data(&self, me: &StateRange, view: &WorldView, out: &mut Vec<u8>) {
        net_sync::write_state(&view.x[me.x.clone()], out);
    }

    fn read_data(&self, data: &[u8], x: &mut [f64]) -> Result<(), SyncError> {
        net_sync::read_state(data, x, |state| self.accepts(state))
    }
}

impl Integratable for RigidBody {
    fn state_sizes(&self) -> StateSizes {
        StateSizes { x: 13, dof: 6, parts: 1 }
    }

    fn write_initial(&self, x: &mut [f64]) {
        let (q, at) =
            (Unit::new_normalize(self.initial_pose.rotation.into_inner()), self.center_pose_of(&self.initial_pose));
        let l = self.angular_momentum(&q, &self.initial_angular_velocity);
        x[..3].copy_from_slice(at.translation.vector.as_slice());
        write_orientation(x, &q);
        let velocity = self.initial_velocity.component_mul(&self.locked.free_translation());
        x[7..10].copy_from_slice((self.mass * velocity).as_slice());
        x[10..13].copy_from_slice(l.as_slice());
    }

    fn part_mass(&self, _part: usize) -> f64 {
        self.mass
    }

    fn part_center(&self, _part: usize) -> Vec3 {
        self.offset
    }

    fn momentum_kind(&self) -> MomentumKind {
        MomentumKind::Conjugate
    }

    fn turning_rate(
        &self,
        _cache: &mut Cache,
        part_states: &[PartState],
        _gravity: &Vec3,
        loads: &mut dyn Iterator<Item = PointLoad>,
    ) -> (usize, f64) {
        (0, self.fastest_turn(&part_states[0].pose, loads))
    }

    fn accepts(&self, x: &[f64]) -> bool {
        let norm: f64 = x[3..7].iter().map(|q| q * q).sum();
        x.iter().all(|x| x.is_finite()) && (norm - 1.0).abs() < 1e-9
    }

    fn accumulate_forces(&self, me: &StateRange, view: &WorldView, out: &mut Forces) {
        let x = &view.x[me.x.clone()];
        let wrench = &mut out.wrenches[me.parts.start];
        let force = (self.mass * self.gravity_scale) * view.gravity - self.linear_damping * vec3(&x[7..]);
        wrench.force += force;
        wrench.torque -= self.angular_damping * vec3(&x[10..]);
        if self.offset != Vec3::zeros() {
            // both act at the center of mass, and the table is about the origin of the part
            wrench.torque -= self.part_arm(&orientation(x)).cross(&force);
        }
    }

    fn velocity(&self, x: &[f64], v: &mut [f64]) {
        write6(v, &self.omega(&orientation(x), &vec3(&x[10..])), &self.center_velocity(x));
    }

    fn write_velocity(&self, x: &mut [f64], v: &[f64]) {
        let q = orientation(x);
        let l = self.angular_momentum(&q, &vec3(v));
        let velocity = vec3(&v[3..]).component_mul(&self.locked.free_translation());
        x[7..10].copy_from_slice((self.mass * velocity).as_slice());
        x[10..13].copy_from_slice(l.as_slice());
    }

    fn derivative(&self, _cache: &mut Cache, x: &[f64], f: &ForceSlice, dp: &mut [f64]) {
        let Wrench { mut torque, force } = f.wrenches[0];
        if self.offset != Vec3::zeros() {
            torque += self.part_arm(&orientation(x)).cross(&force);
        }
        write6(dp, &torque, &force);
        dp.iter_mut().zip(f.generalized).for_each(|(dp, f)| *dp += f);
        if self.locked != LockedAxes::default() {
            let (angular, linear) = (vec3(dp), vec3(&dp[3..]));
            let linear = linear.component_mul(&self.locked.free_translation());
            write6(dp, &self.locked.free_rotation(&angular), &linear);
        }
    }

    fn mean_rate(&self, h: f64, dp: &mut [f64]) {
        let (angular, linear) = dp.split_at_mut(3);
        for (dp, damping) in [(angular, self.angular_damping), (linear, self.linear_damping)] {
            let mean = mean_decay(damping * h);
            dp.iter_mut().for_each(|dp| *dp *= mean);
        }
    }

    fn accelerations(&self, _cache: &mut Cache, x: &[f64], dp: &[f64], part_states: &mut [PartState]) {
        let (q, l, part_state) = (orientation(x), vec3(&x[10..]), &mut part_states[0]);
        part_state.acceleration = vec3(&dp[3..]) / self.mass;
        // α = I⁻¹(τ − ω × H)
        let omega = part_state.angular_velocity;
        part_state.angular_acceleration = self.omega(&q, &(vec3(dp) - self.turning(&q, &omega, &l)));
        if self.offset != Vec3::zeros() {
            part_state.acceleration +=
                part_state.angular_acceleration.cross(&self.part_arm(&q)) + part_state.bias_acceleration;
        }
    }

    fn gyroscopic(&self, x: &[f64], out: &mut [f64]) {
        let (q, l) = (orientation(x), vec3(&x[10..]));
        write6(out, &self.turning(&q, &self.omega(&q, &l), &l), &Vec3::zeros());
    }

    fn kick(&self, x: &mut [f64], dp: &[f64], h: f64) {
        add(&mut x[10..13], &vec3(dp), h);
        add(&mut x[7..10], &vec3(&dp[3..]), h);
    }

    fn free_motion(&self, _cache: &mut Cache, x: &mut [f64], h: f64) {
        let (p, l) = (vec3(&x[7..]).component_mul(&self.locked.free_translation()), vec3(&x[10..]));
        add(&mut x[..3], &p, h / self.mass);
        if !self.locked.rotates_freely() {
            let turned = self.turn_locked(&orientation(x), &l, h);
            write_orientation(x, &turned);
        } else if l != Vec3::zeros() {
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

    fn difference(&self, from: &[f64], to: &[f64], v: &mut [f64]) {
        let turned = orientation(to) * orientation(from).inverse();
        write6(v, &turned.scaled_axis(), &(vec3(to) - vec3(from)));
    }

    fn displace(&self, _cache: &mut Cache, x: &mut [f64], v: &[f64], h: f64) {
        let before = self.spinning(x);
        self.integrate_positions(x, v, h);
        let after = self.spinning(x);
        if before != after && after > 0.0 {
            // a rotation under constant angular momentum changes the energy
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
        let linear = (vec3(&x[7..]) / self.root_mass).component_mul(&self.locked.free_translation());
        let angular = cache.resistance.as_ref().map_or(&cache.solve_lt, |resistance| &resistance.from_momentum);
        write6(u, &(angular * vec3(&x[10..])), &linear);
    }

    fn jacobian(&self, _cache: &mut Cache, at: &PartPoint, j: &mut [f64]) {
        let r = self.arm(at);
        for (axis, j) in at.axes.iter().zip(j.chunks_exact_mut(6)) {
            add(&mut j[..3], &r.cross(axis), 1.0);
            add(&mut j[3..], axis, 1.0);
        }
    }

    fn test_impulse(&self, cache: &mut Cache, at: &PartPoint, sign: f64, y: &mut [f64]) {
        self.test_impulse_shared(cache, at, sign, y);
    }

    fn test_impulse_shared(&self, cache: &Cache, at: &PartPoint, sign: f64, y: &mut [f64]) -> bool {
        let cache: &BodyCache = cache.read();
        let r = self.arm(at);
        let linear = self.locked.free_translation() * (sign / self.root_mass);
        for (axis, y) in at.axes.iter().zip(y.chunks_exact_mut(6)) {
            let angular = cache.solve_lt * r.cross(axis);
            for k in 0..3 {
                y[k] += sign * angular[k];
                y[k + 3] += linear[k] * axis[k];
            }
        }
        true
    }

    fn mul_l(&self, cache: &mut Cache, v: &[f64], u: &mut [f64]) {
        let cache: &mut BodyCache = cache.get();
        write6(
            u,
            &cache.mul_lt.tr_mul(&vec3(v)),
            &(self.root_mass * vec3(&v[3..])).component_mul(&self.locked.free_translation()),
        );
    }

    fn solve_l(&self, cache: &mut Cache, u: &[f64], v: &mut [f64]) {
        let cache: &mut BodyCache = cache.get();
        write6(
            v,
            &cache.solve_lt.tr_mul(&vec3(u)),
            &(vec3(&u[3..]) / self.root_mass).component_mul(&self.locked.free_translation()),
        );
    }

    fn solve_lt(&self, cache: &mut Cache, j: &[f64], y: &mut [f64]) {
        let cache: &mut BodyCache = cache.get();
        write6(
            y,
            &(cache.solve_lt * vec3(j)),
            &(vec3(&j[3..]) / self.root_mass).component_mul(&self.locked.free_translation()),
        );
    }

    fn mul_lt(&self, cache: &mut Cache, u: &[f64], j: &mut [f64]) {
        let cache: &mut BodyCache = cache.get();
        write6(
            j,
            &(cache.mul_lt * vec3(u)),
            &(self.root_mass * vec3(&u[3..])).component_mul(&self.locked.free_translation()),
        );
    }

    fn momentum_change(&self, cache: &mut Cache, du: &[f64], dp: &mut [f64]) {
        self.mul_lt(cache, du, dp);
        let cache: &mut BodyCache = cache.get();
        if let Some(resistance) = &cache.resistance {
            dp[..3].copy_from_slice((resistance.to_momentum * vec3(du)).as_slice());
        }
    }

    fn may_sleep(&self) -> bool {
        true
    }

    fn energy(&self, x: &[f64], gravity: &Vec3) -> Energy {
        let (p, l) = (vec3(&x[7..]), vec3(&x[10..]));
        let kinetic = 0.5 * (p.norm_squared() / self.mass + l.dot(&self.omega(&orientation(x), &l)));
        Energy { kinetic, potential: -(self.mass * self.gravity_scale) * gravity.dot(&vec3(x)) }
    }

    fn momentum(&self, x: &[f64]) -> Momentum {
        let (p, mut l) = (vec3(&x[7..]), vec3(&x[10..]));
        if !self.locked.rotates_freely() {
            let q = orientation(x);
            l = self.world_inertia(&q) * self.omega(&q, &l);
        }
        Momentum { linear: p, angular: l + vec3(x).cross(&p) }
    }
}

impl Collidable for RigidBody {
    fn shape(&self, _part: usize) -> Option<&Shape> {
        Some(&self.shape)
    }

    fn material(&self, _part: usize) -> Material {
        self.material
    }

    fn shape_materials(&self, _part: usize) -> &[(usize, Material)] {
        self.shape_materials.as_slice()
    }

    fn shape_filters(&self, _part: usize) -> &[(usize, ShapeFilter)] {
        self.shape_filters.as_slice()
    }

    fn shape_name(&self, _part: usize, shape: usize) -> Option<&str> {
        self.shape_name(shape)
    }

    fn collision_group(&self, _part: usize) -> CollisionGroup {
        self.group
    }

    fn is_sensor(&self, _part: usize) -> bool {
        self.sensor
    }

    fn contact_mode(&self, _part: usize) -> ContactMode {
        self.contact_mode
    }

    fn collides_with(&self, _part: usize, other: CollisionGroup) -> bool {
        self.mask & other.bit() != 0
    }

    fn intersect(&self, _part: usize) -> Option<&dyn Intersect> {
        self.intersect.as_deref()
    }

    fn one_way(&self, _part: usize) -> Option<Vec3> {
        self.one_way?.try_normalize(0.0)
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
