//! The traits of objects for the rigid body.

use super::RigidBody;
use super::rotation;
use super::state::{add, orientation, vec3, write_orientation, write6};
use crate::derived::Cache;
use crate::object::collidable::CollisionGroup;
use crate::object::mounts::{CameraMount, LightMount};
use crate::object::net_sync;
use crate::object::part_state::{ForceSlice, Forces, PartPoint, PartState, StateRange, StateSizes};
use crate::object::visual::Visual;
use crate::object::{
    CameraCarrier, Collidable, Energy, Integratable, LightCarrier, Material, Momentum, MomentumKind, NetSync, Object,
    Renderable, SyncError,
};
use crate::world::view::WorldView;
use nalgebra::{Translation3, Unit};
use tumble_collide::{ContactMode, Mat3, Pose, Quat, Shape, Vec3};

/// Blocks of the maps at one orientation.
struct BodyCache {
    /// Angular block of `L⁻ᵀ`: `I^{-½}·Rᵀ`.
    solve_lt: Mat3,
    /// Angular block of `Lᵀ`: `R·I^½`.
    mul_lt: Mat3,
}

impl RigidBody {
    /// Returns twice the kinetic energy of rotation, J.
    fn spinning(&self, x: &[f64]) -> f64 {
        let m = orientation(x).inverse_transform_vector(&vec3(&x[10..]));
        m.dot(&(self.inertia.inverse * m))
    }

    /// Returns the angular velocity for an orientation and an angular momentum, world axes.
    fn omega(&self, q: &Quat, l: &Vec3) -> Vec3 {
        q * (self.inertia.inverse * q.inverse_transform_vector(l))
    }
}

impl Object for RigidBody {
    fn name(&self) -> &str {
        &self.name
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
        let l = q * (self.inertia.tensor * q.inverse_transform_vector(&self.initial_angular_velocity));
        x[..3].copy_from_slice(at.translation.vector.as_slice());
        write_orientation(x, &q);
        x[7..10].copy_from_slice((self.mass * self.initial_velocity).as_slice());
        x[10..13].copy_from_slice(l.as_slice());
    }

    fn momentum_kind(&self) -> MomentumKind {
        MomentumKind::Conjugate
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
        // α = I⁻¹(τ − ω × H)
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
        write6(u, &(cache.solve_lt * vec3(&x[10..])), &(vec3(&x[7..]) / self.root_mass));
    }

    fn jacobian(&self, _cache: &mut Cache, at: &PartPoint, j: &mut [f64]) {
        let r = at.arm();
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
        let r = at.arm();
        let linear = sign / self.root_mass;
        for (axis, y) in at.axes.iter().zip(y.chunks_exact_mut(6)) {
            let angular = cache.solve_lt * r.cross(axis);
            for k in 0..3 {
                y[k] += sign * angular[k];
                y[k + 3] += linear * axis[k];
            }
        }
        true
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
