//! The traits of objects for the articulated body: dynamics, collisions, visuals and
//! synchronization.

use super::body::{ArticulatedBody, BodyCache};
use super::collider::LinkCollider;
use super::shapes::name_of;
use crate::articulated::algorithms::dynamics::Dynamics;
use crate::articulated::algorithms::energy::{energy, momentum};
use crate::articulated::algorithms::kinematics::Kinematics;
use crate::articulated::model::coordinates::{difference, integrate};
use crate::articulated::model::joint::Joint;
use crate::derived::Cache;
use crate::object::collidable::{Collidable, CollisionGroup};
use crate::object::mounts::{CameraCarrier, CameraMount, LightCarrier, LightMount};
use crate::object::net_sync;
use crate::object::part_state::{ForceSlice, Forces, PartPoint, PartState, PointLoad, StateRange, StateSizes, Wrench};
use crate::object::visual::Visual;
use crate::object::{Constraint, Energy, Integratable, Intersect, Momentum, NetSync, Object, Renderable, SyncError};
use crate::object::{Material, ShapeFilter};
use crate::rigid::rotation;
use crate::rigid::vec3;
use crate::world::view::WorldView;
use tumble_collide::{ContactMode, Pose, Shape, Vec3};

impl Object for ArticulatedBody {
    fn name(&self) -> &str {
        &self.name
    }

    fn new_cache(&self) -> Cache {
        Cache::new(BodyCache::new(&self.model))
    }

    fn refresh(&self, x: &[f64], cache: &mut Cache, part_states: &mut [PartState]) {
        let BodyCache { dynamics, zeros, accelerations, free_rate, .. } = cache.get();
        // they may have changed, and a cache may be that of a fork with others
        dynamics.set_inertias(&self.model);
        let (q, v) = x.split_at(self.model.positions());
        if dynamics.refresh_once(q, v) {
            free_rate.clear();
        }
        let links = self.model.links().len();
        let (moving, rest) = part_states.split_at_mut(links);
        dynamics.link_accelerations(zeros, accelerations);
        for (i, part_state) in moving.iter_mut().enumerate() {
            let (angular_velocity, velocity) = dynamics.link_velocity(i);
            (part_state.pose, part_state.angular_velocity, part_state.velocity) =
                (dynamics.link_pose(i), angular_velocity, velocity);
            (part_state.bias_angular_acceleration, part_state.bias_acceleration) = accelerations[i];
        }
        let base = PartState { pose: *self.base(), ..PartState::default() };
        rest[0] = base;
        for (part_state, LinkCollider { link, collider, .. }) in rest[1..].iter_mut().zip(&self.colliders) {
            let carrier = link.map_or(&base, |l| &moving[l]);
            part_state.pose = carrier.pose * collider.pose;
            let (point, spin) = (part_state.position(), carrier.angular_velocity);
            let arm = point - carrier.position();
            (part_state.angular_velocity, part_state.velocity) = (spin, carrier.velocity_at(&point));
            part_state.bias_angular_acceleration = carrier.bias_angular_acceleration;
            part_state.bias_acceleration = carrier.bias_acceleration
                + carrier.bias_angular_acceleration.cross(&arm)
                + spin.cross(&spin.cross(&arm));
        }
    }

    fn integratable(&self) -> Option<&dyn Integratable> {
        Some(self)
    }

    fn collidable(&self) -> Option<&dyn Collidable> {
        Some(self)
    }

    fn constraint(&self) -> Option<&dyn Constraint> {
        self.has_rows().then_some(self)
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

impl ArticulatedBody {
    /// Returns the kinematics at a state.
    fn kinematics(&self, x: &[f64]) -> Kinematics {
        let (q, v) = x.split_at(self.model.positions());
        let mut kinematics = Kinematics::new(&self.model);
        kinematics.refresh(&self.model, q, v);
        kinematics
    }

    /// Sums the wrenches on parts to wrenches on moving links.
    fn gather(&self, dynamics: &Dynamics, parts: &[Wrench], links: &mut [Wrench]) {
        let (moving, rest) = parts.split_at(links.len());
        links.copy_from_slice(moving);
        for (wrench, LinkCollider { link, collider, .. }) in rest[1..].iter().zip(&self.colliders) {
            let Some(link) = *link else { continue };
            let arm = dynamics.link_pose(link).rotation * collider.pose.translation.vector;
            links[link].force += wrench.force;
            links[link].torque += wrench.torque + arm.cross(&wrench.force);
        }
    }
}

impl Integratable for ArticulatedBody {
    fn state_sizes(&self) -> StateSizes {
        StateSizes {
            x: self.model.positions() + self.model.dof(),
            dof: self.model.dof(),
            parts: self.model.links().len() + 1 + self.colliders.len(),
        }
    }

    fn write_initial(&self, x: &mut [f64]) {
        x.copy_from_slice(&self.start);
    }

    fn part_mass(&self, part: usize) -> f64 {
        self.model.links().get(part).map_or(0.0, |link| link.mass.mass)
    }

    fn part_center(&self, part: usize) -> Vec3 {
        self.model.links().get(part).map_or_else(Vec3::zeros, |link| link.mass.center)
    }

    fn accepts(&self, x: &[f64]) -> bool {
        self.is_state(x)
    }

    fn accumulate_forces(&self, me: &StateRange, view: &WorldView, out: &mut Forces) {
        for (i, link) in self.model.links().iter().enumerate().filter(|(_, l)| l.mass.mass > 0.0) {
            let (weight, wrench) = (link.mass.mass * view.gravity, &mut out.wrenches[me.parts.start + i]);
            wrench.force += weight;
            let pose = &view.part_states[me.parts.start + i].pose;
            wrench.torque += (pose.rotation * link.mass.center).cross(&weight);
        }
        self.joint_forces(&view.x[me.x.clone()], view.implicit, view.time, &mut out.generalized[me.v.clone()]);
    }

    fn derivative(&self, cache: &mut Cache, _x: &[f64], f: &ForceSlice, dp: &mut [f64]) {
        let BodyCache { dynamics, scratch, wrenches, .. } = cache.get();
        self.gather(dynamics, f.wrenches, wrenches);
        dynamics.accelerate(scratch, f.generalized, wrenches, dp);
    }

    fn singularity(&self, cache: &mut Cache) -> Option<String> {
        Some(self.model.singularity(cache.get::<BodyCache>().dynamics.singular()?))
    }

    fn accelerations(&self, cache: &mut Cache, _x: &[f64], dp: &[f64], part_states: &mut [PartState]) {
        let BodyCache { dynamics, accelerations, .. } = cache.get();
        dynamics.link_accelerations(dp, accelerations);
        let (moving, rest) = part_states.split_at_mut(self.model.links().len());
        for (part_state, (angular, linear)) in moving.iter_mut().zip(&*accelerations) {
            (part_state.angular_acceleration, part_state.acceleration) = (*angular, *linear);
        }
        for (part_state, LinkCollider { link, .. }) in rest[1..].iter_mut().zip(&self.colliders) {
            (part_state.angular_acceleration, part_state.acceleration) = match link.map(|l| &moving[l]) {
                Some(carrier) => {
                    let point = part_state.position();
                    let velocity = carrier.velocity_at(&point);
                    (carrier.angular_acceleration, carrier.acceleration_following(&point, &velocity))
                }
                None => (Vec3::zeros(), Vec3::zeros()),
            };
        }
    }

    fn turning_rate(
        &self,
        cache: &mut Cache,
        part_states: &[PartState],
        gravity: &Vec3,
        loads: &mut dyn Iterator<Item = PointLoad>,
    ) -> (usize, f64) {
        self.fastest_turn(cache.get(), part_states, gravity, loads)
    }

    fn free_motion_rate(&self, cache: &mut Cache, _x: &[f64], out: &mut [f64]) {
        let BodyCache { dynamics, scratch, zeros, free_rate, .. } = cache.get();
        if free_rate.is_empty() {
            free_rate.resize(out.len(), 0.0);
            dynamics.accelerate(scratch, zeros, &[], free_rate);
        }
        out.copy_from_slice(free_rate);
    }

    fn free_motion(&self, cache: &mut Cache, x: &mut [f64], h: f64) {
        let BodyCache { dynamics, free_motion, .. } = cache.get();
        free_motion.advance(&self.model, dynamics, x, h);
    }

    fn integrate_positions(&self, x: &mut [f64], v: &[f64], h: f64) {
        integrate(&self.model, &mut x[..self.model.positions()], v, h);
    }

    fn difference(&self, from: &[f64], to: &[f64], v: &mut [f64]) {
        difference(&self.model, from, to, v);
    }

    fn displace(&self, cache: &mut Cache, x: &mut [f64], v: &[f64], h: f64) {
        cache.get::<BodyCache>().free_motion.transport(&self.model, x, v, h);
    }

    fn pull_back(&self, displacement: &[f64], v: &mut [f64]) {
        for link in self.model.links() {
            // a link's own axes turn on the right, the world's on the left: the same with both
            // signs reversed
            let sign = match link.joint {
                Joint::Floating => 1.0,
                Joint::Spherical => -1.0,
                _ => continue,
            };
            let rate = rotation::pull_back(&(sign * vec3(&displacement[link.v..])), &vec3(&v[link.v..]));
            v[link.v..link.v + 3].copy_from_slice(rate.as_slice());
        }
    }

    /// `J = (Lᵀ·L⁻ᵀJᵀ)ᵀ`: the whitened response, mapped back.
    fn jacobian(&self, cache: &mut Cache, at: &PartPoint, j: &mut [f64]) {
        let dof = self.model.dof();
        let mut y = vec![0.0; j.len()];
        self.test_impulse(cache, at, 1.0, &mut y);
        let mut row = vec![0.0; dof];
        for (y, j) in y.chunks_exact(dof.max(1)).zip(j.chunks_exact_mut(dof.max(1))) {
            self.mul_lt(cache, y, &mut row);
            j.iter_mut().zip(&row).for_each(|(j, row)| *j += row);
        }
    }

    fn test_impulse(&self, cache: &mut Cache, at: &PartPoint, sign: f64, y: &mut [f64]) {
        let dynamics = &cache.get::<BodyCache>().dynamics;
        let Some(link) = self.link_of(at.part) else { return };
        let carried = self.collider(at.part).map_or(Vec3::zeros(), |p| p.collider.pose.translation.vector);
        let arm = at.arm() + dynamics.link_pose(link).rotation * carried;
        dynamics.point_response(link, &arm, at.axes, sign, y);
    }

    fn mul_l(&self, cache: &mut Cache, v: &[f64], u: &mut [f64]) {
        let BodyCache { dynamics, scratch, .. } = cache.get();
        dynamics.mul_l(scratch, v, u);
    }

    fn solve_l(&self, cache: &mut Cache, u: &[f64], v: &mut [f64]) {
        let BodyCache { dynamics, scratch, .. } = cache.get();
        dynamics.solve_l(scratch, u, v);
    }

    fn solve_lt(&self, cache: &mut Cache, j: &[f64], y: &mut [f64]) {
        let BodyCache { dynamics, scratch, .. } = cache.get();
        dynamics.solve_lt(scratch, j, y);
    }

    fn mul_lt(&self, cache: &mut Cache, u: &[f64], j: &mut [f64]) {
        let BodyCache { dynamics, scratch, .. } = cache.get();
        dynamics.mul_lt(scratch, u, j);
    }

    fn whitened_velocity(&self, cache: &mut Cache, x: &[f64], u: &mut [f64]) {
        self.mul_l(cache, &x[self.model.positions()..], u);
    }

    fn may_sleep(&self) -> bool {
        true
    }

    fn energy(&self, x: &[f64], gravity: &Vec3) -> Energy {
        let sum = energy(&self.model, &self.kinematics(x), gravity);
        Energy { potential: sum.potential + self.spring_energy(x), ..sum }
    }

    fn momentum(&self, x: &[f64]) -> Momentum {
        momentum(&self.model, &self.kinematics(x))
    }
}

impl Collidable for ArticulatedBody {
    fn parts(&self) -> usize {
        self.model.links().len() + 1 + self.colliders.len()
    }

    fn shape(&self, part: usize) -> Option<&Shape> {
        Some(&self.collider(part)?.collider.shape)
    }

    fn material(&self, part: usize) -> Material {
        self.collider(part).map_or(Material::default(), |p| p.collider.material)
    }

    fn shape_materials(&self, part: usize) -> &[(usize, Material)] {
        self.collider(part).map_or(&[], |p| p.collider.shape_materials.as_slice())
    }

    fn shape_filters(&self, part: usize) -> &[(usize, ShapeFilter)] {
        self.collider(part).map_or(&[], |p| p.collider.shape_filters.as_slice())
    }

    fn part_name(&self, part: usize) -> Option<&str> {
        Some(&self.model().frames().get(self.frame_of(part)?)?.name)
    }

    fn shape_name(&self, part: usize, shape: usize) -> Option<&str> {
        name_of(&self.collider(part)?.collider, shape)
    }

    fn intersect(&self, part: usize) -> Option<&dyn Intersect> {
        self.collider(part)?.intersect.as_deref()
    }

    fn one_way(&self, part: usize) -> Option<Vec3> {
        self.collider(part)?.collider.one_way?.try_normalize(0.0)
    }

    fn is_sensor(&self, part: usize) -> bool {
        self.collider(part).is_some_and(|p| p.collider.sensor)
    }

    fn collision_group(&self, part: usize) -> CollisionGroup {
        self.collider(part).map_or(CollisionGroup::default(), |p| p.collider.group)
    }

    fn contact_mode(&self, part: usize) -> ContactMode {
        self.collider(part).map_or(ContactMode::default(), |p| p.collider.contact_mode)
    }

    fn collides_with(&self, part: usize, other: CollisionGroup) -> bool {
        self.collider(part).is_some_and(|p| p.collider.mask & other.bit() != 0)
    }

    fn part_moves(&self, part: usize) -> bool {
        self.link_of(part).is_some()
    }

    fn carrier(&self, part: usize) -> usize {
        self.link_of(part).unwrap_or(part)
    }

    fn parts_collide(&self, part_a: usize, part_b: usize) -> bool {
        self.links_collide(self.link_of(part_a), self.link_of(part_b))
    }
}

impl CameraCarrier for ArticulatedBody {
    fn cameras(&self) -> &[CameraMount] {
        &self.cameras
    }
}

impl LightCarrier for ArticulatedBody {
    fn lights(&self) -> &[LightMount] {
        &self.lights
    }
}

impl Renderable for ArticulatedBody {
    fn visuals(&self) -> &[Visual] {
        &self.visuals
    }
}

/// The state as little-endian `f64`: exact, for replicas.
impl NetSync for ArticulatedBody {
    fn get_data(&self, me: &StateRange, view: &WorldView, out: &mut Vec<u8>) {
        net_sync::write_state(&view.x[me.x.clone()], out);
    }

    fn read_data(&self, data: &[u8], x: &mut [f64]) -> Result<(), SyncError> {
        net_sync::read_state(data, x, |state| self.is_state(state))
    }
}

/// Placement of parts.
impl ArticulatedBody {
    /// Returns the visuals, each with its link, an index in [`Model::frames`](super::Model::frames), which may be a fixed one.
    pub fn visuals_of_links(&self) -> impl Iterator<Item = (usize, &Visual)> {
        self.visual_links.iter().copied().zip(&self.visuals)
    }

    /// Returns the pose of a part's frame in the frame of the link (or base) that carries it.
    pub fn part_pose(&self, part: usize) -> Pose {
        self.collider(part).map_or(Pose::identity(), |p| p.collider.pose)
    }
}
