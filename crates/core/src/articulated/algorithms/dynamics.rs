//! Forward dynamics of one model at one state: the sweeps of
//! [`abm`](crate::articulated::algorithms::abm) in `f64`, with results that are kept for several
//! calls.

use crate::articulated::algorithms::abm::{Input, Slot, Sweep, push, spread, three, write_three};
use crate::articulated::algorithms::singular::SingularJoint;
use crate::articulated::model::Model;
use crate::articulated::model::compiled::{Compiled, CompiledLink, JointKind};
use crate::articulated::simd::joint_sin_cos::JointSinCos;
use crate::object::part_state::Wrench;
use crate::spatial::{Force, Motion, Vector};
use crate::step::rate_squared;
use nalgebra::{Rotation3, UnitQuaternion};
use tumble_collide::{Mat3, Pose, Vec3};

/// A model with the quantities derived from `q` and `v`: poses, velocities, bias forces,
/// articulated inertias and their factors. They are undefined before the first
/// [`refresh`](Self::refresh).
///
/// ```
/// use tumble_core::{Joint, LinkMass, ModelBuilder, articulated::Dynamics, collide::{Pose, Vec3}};
/// let mut builder = ModelBuilder::new();
/// builder.link("bob", None, Joint::revolute(Vec3::y()), Pose::identity(), LinkMass::point(2.0, Vec3::new(0.0, 0.0, -0.5)));
/// let model = builder.build()?;
/// let mut dynamics = Dynamics::new(&model);
/// dynamics.refresh(&[0.3], &[0.0]);
/// // A pendulum of length 0.5 m: q̈ = −g/l·sin q.
/// let mut qdd = [0.0];
/// dynamics.accelerate_in(&mut dynamics.scratch(), &Vec3::new(0.0, 0.0, -9.81), &[0.0], &[], &mut qdd);
/// assert!((qdd[0] + 9.81 / 0.5 * f64::sin(0.3)).abs() < 1e-12);
/// // The squared response to an impulse of 1 N·s along x at the bob: 1/m of the point along its circle.
/// let mut y = [0.0];
/// let arm = dynamics.link_pose(0).rotation * Vec3::new(0.0, 0.0, -0.5);
/// dynamics.point_response(0, &arm, &[Vec3::x()], 1.0, &mut y);
/// assert!((y[0] * y[0] - f64::cos(0.3).powi(2) / 2.0).abs() < 1e-12);
/// # Ok::<(), tumble_core::ModelError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Dynamics {
    pub(in crate::articulated) compiled: Compiled,
    pub(in crate::articulated) sweep: Sweep<f64>,
    joint_sin_cos: JointSinCos,
    /// `√D` and `1/√D` (or 0) of each revolute or prismatic joint, by slot.
    pub(in crate::articulated) roots: Vec<[f64; 2]>,
    singular: Option<usize>,
    /// Zeros, one per degree of freedom.
    no_force: Vec<f64>,
    /// `q` and `v` of the last refresh; empty once anything else was done.
    at: Vec<f64>,
}

/// Buffers of one call, for the maps that take `&self`. Made by [`Dynamics::scratch`]; no data is
/// kept between calls.
#[derive(Clone, Debug)]
pub struct Scratch {
    pub(in crate::articulated) motions: Vec<Motion>,
    pub(in crate::articulated) forces: Vec<Force>,
    pub(in crate::articulated) efforts: Vec<Force>,
}

impl Dynamics {
    /// Prepares a model. No later call allocates memory.
    pub fn new(model: &Model) -> Dynamics {
        let compiled = Compiled::new(model);
        let sweep = Sweep::new(&compiled, 0.0);
        Dynamics {
            roots: vec![[0.0; 2]; compiled.bodies.len() + 1],
            joint_sin_cos: JointSinCos::new(&compiled),
            no_force: vec![0.0; compiled.dof],
            at: Vec::with_capacity(compiled.positions + compiled.dof),
            compiled,
            sweep,
            singular: None,
        }
    }

    /// Takes masses and armatures of the model, from the next [`refresh`](Self::refresh) on.
    pub(in crate::articulated) fn set_inertias(&mut self, model: &Model) {
        if self.compiled.set_inertias(model) {
            self.at.clear();
        }
    }

    /// Does what [`refresh`](Self::refresh) does, unless that was the last thing done, at the same bits. Returns whether it did.
    pub(in crate::articulated) fn refresh_once(&mut self, q: &[f64], v: &[f64]) -> bool {
        let moved = !(self.is_at(q) && same(&self.at[q.len()..], v));
        if moved {
            self.refresh(q, v);
        }
        moved
    }

    /// Returns whether the last [`refresh`](Self::refresh) was at these positions, with the present inertias.
    pub(in crate::articulated) fn is_at(&self, q: &[f64]) -> bool {
        self.at.len() > q.len() && same(&self.at[..q.len()], q)
    }

    /// Returns the number of moving links.
    pub fn links(&self) -> usize {
        self.compiled.bodies.len()
    }

    /// Returns the number of degrees of freedom: the length of `v`.
    pub fn dof(&self) -> usize {
        self.compiled.dof
    }

    /// Returns the length of `q`.
    pub fn positions(&self) -> usize {
        self.compiled.positions
    }

    /// Returns buffers for the maps.
    pub fn scratch(&self) -> Scratch {
        let slots = self.sweep.slots.len();
        Scratch {
            motions: vec![Motion::default(); slots],
            forces: vec![Force::default(); slots],
            efforts: vec![Force::default(); slots],
        }
    }

    /// Sets the state. Quaternions in `q` may have any length above 0.
    pub fn refresh(&mut self, q: &[f64], v: &[f64]) {
        let turns = self.joint_sin_cos.take(q);
        self.sweep.place::<true>(&self.compiled, &SingleState { turns, q, v, tau: &[] });
        self.sweep.fold(&self.compiled);
        self.singular = None;
        for (i, body) in self.compiled.bodies.iter().enumerate().rev() {
            let slot = &self.sweep.slots[i + 1];
            let positive = match body.kind {
                JointKind::Revolute | JointKind::Prismatic => {
                    let root = if slot.inverse > 0.0 { slot.pivot.sqrt() } else { 0.0 };
                    self.roots[i + 1] = [root, if root > 0.0 { 1.0 / root } else { 0.0 }];
                    root > 0.0
                }
                JointKind::Spherical(block) => {
                    let block = &mut self.sweep.blocks[block];
                    block.first = block.first.with_roots();
                    block.first.is_positive()
                }
                JointKind::Floating(block) => {
                    let block = &mut self.sweep.blocks[block];
                    (block.first, block.second) = (block.first.with_roots(), block.second.with_roots());
                    block.first.is_positive() && block.second.is_positive()
                }
            };
            if !positive {
                self.singular = Some(i);
            }
        }
        self.at.clear();
        self.at.extend(q.iter().chain(v));
    }

    /// Returns the kinetic energy at a state, J. Afterwards the maps need a [`refresh`](Self::refresh).
    pub(in crate::articulated) fn kinetic_energy(&mut self, q: &[f64], v: &[f64]) -> f64 {
        self.at.clear();
        let turns = self.joint_sin_cos.take(q);
        self.sweep.place_for_energy(&self.compiled, &SingleState { turns, q, v, tau: &[] });
        kinetic_energy_as_placed(&self.compiled, &self.sweep, v)
    }

    /// Writes `q̈` without any force to `qdd`. Afterwards the maps need a [`refresh`](Self::refresh).
    pub(in crate::articulated) fn free_acceleration(&mut self, q: &[f64], v: &[f64], qdd: &mut [f64]) {
        self.at.clear();
        let Dynamics { compiled, sweep, joint_sin_cos, no_force, .. } = self;
        let turns = joint_sin_cos.take(q);
        sweep.run(compiled, &Vec3::zeros(), &SingleState { turns, q, v, tau: no_force }, |k, x| qdd[k] = x);
    }

    /// Returns the first link whose joint meets no inertia at the refreshed state, as in gimbal
    /// lock of stacked revolute joints: `D` along one of its axes is below 1e-12 of the size of its
    /// articulated inertia. The maps then hold that axis and stay finite.
    pub fn singular(&self) -> Option<usize> {
        self.singular
    }

    /// Returns the pose of a link's frame in the world.
    pub fn link_pose(&self, link: usize) -> Pose {
        let slot = &self.sweep.slots[link + 1];
        let rotation = Mat3::from(slot.rotation) * self.compiled.bodies[link].own.transpose();
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
        Pose::from_parts(Vec3::from(slot.position).into(), rotation)
    }

    /// Returns the angular velocity of a link, rad/s, and the velocity of its origin, m/s, world
    /// axes.
    pub fn link_velocity(&self, link: usize) -> (Vec3, Vec3) {
        let slot = &self.sweep.slots[link + 1];
        (slot.angular.into(), slot.linear.into())
    }

    /// Writes the generalized accelerations `q̈`, Coriolis and centrifugal terms included, for
    /// joint forces `tau` (N·m, N) and one wrench per moving link (world axes, torque about the
    /// link's origin; empty for none). Without gravity.
    pub fn accelerate(&self, s: &mut Scratch, tau: &[f64], wrenches: &[Wrench], qdd: &mut [f64]) {
        self.accelerate_in(s, &Vec3::zeros(), tau, wrenches, qdd);
    }

    /// [`accelerate`](Self::accelerate) in uniform gravity `gravity`, m/s², world axes.
    pub fn accelerate_in(&self, s: &mut Scratch, gravity: &Vec3, tau: &[f64], wrenches: &[Wrench], qdd: &mut [f64]) {
        for (p, slot) in s.forces.iter_mut().zip(&self.sweep.slots) {
            *p = slot.bias;
        }
        for (p, wrench) in s.forces[1..].iter_mut().zip(wrenches) {
            *p -= Force::new(wrench.torque.into(), wrench.force.into());
        }
        let Sweep { slots, blocks } = &self.sweep;
        for (i, body) in self.compiled.bodies.iter().enumerate().rev() {
            let slot = &slots[i + 1];
            let passed = push(body, slot, blocks, s.forces[i + 1], |k| tau[k], &mut s.efforts[i + 1]);
            s.forces[body.parent] += passed.from_arm(slot.arm);
        }
        s.motions[0] = Motion::new(Vector::default(), (-gravity).into());
        for (i, body) in self.compiled.bodies.iter().enumerate() {
            let slot = &slots[i + 1];
            let carried = s.motions[body.parent].at(slot.arm);
            s.motions[i + 1] = spread(body, slot, blocks, &s.efforts[i + 1], carried, &mut |k, x| qdd[k] = x);
        }
    }

    /// Writes the angular acceleration of every link, rad/s², and the acceleration of the material
    /// point at its origin, m/s², world axes, for given `qdd`.
    pub fn link_accelerations(&self, qdd: &[f64], out: &mut [(Vec3, Vec3)]) {
        let slots = &self.sweep.slots;
        for (i, body) in self.compiled.bodies.iter().enumerate() {
            let parent =
                body.parent.checked_sub(1).map_or(Motion::default(), |p| Motion::new(out[p].0.into(), out[p].1.into()));
            let a = carried(body, &slots[i + 1], parent, qdd);
            out[i] = (a.angular.into(), a.linear.into());
        }
        for ((angular, linear), slot) in out.iter_mut().zip(&slots[1..]) {
            *angular += Vec3::from(slot.bias_acceleration.angular);
            *linear += Vec3::from(slot.bias_acceleration.linear);
        }
    }

    /// Returns the square of the angular frequency, rad²/s², with which a link turns about its joint, all
    /// links before it held, if a rotation vector `δθ` (world axes) gives a restoring torque `stiffness·δθ`,
    /// N·m/rad; 0 for joints without rotation.
    pub(in crate::articulated) fn joint_rate(&self, link: usize, stiffness: &Mat3) -> f64 {
        let slot = &self.sweep.slots[link + 1];
        match self.compiled.bodies[link].kind {
            JointKind::Revolute => {
                let axis = Vec3::from(slot.rotation.z);
                slot.inverse * axis.dot(&(stiffness * axis)).abs()
            }
            JointKind::Spherical(block) => {
                let factor = &self.sweep.blocks[block].first;
                let torque = |k: usize| stiffness.column(k).into_owned().into();
                let solved = |k: usize| Vec3::from(factor.upper_solve(factor.lower_solve(torque(k))));
                rate_squared(&Mat3::from_columns(&[solved(0), solved(1), solved(2)]))
            }
            JointKind::Prismatic | JointKind::Floating(_) => 0.0,
        }
    }

    /// Writes the motion of every link due to joint rates `v` alone to `s.motions`.
    pub(in crate::articulated) fn propagate_velocities(&self, s: &mut Scratch, v: &[f64]) {
        s.motions[0] = Motion::default();
        for (i, body) in self.compiled.bodies.iter().enumerate() {
            s.motions[i + 1] = carried(body, &self.sweep.slots[i + 1], s.motions[body.parent], v);
        }
    }
}

/// Returns the kinetic energy of the links as they are placed, before inertias are swept inward.
fn kinetic_energy_as_placed(compiled: &Compiled, sweep: &Sweep<f64>, v: &[f64]) -> f64 {
    let of_link = |(body, slot): (&CompiledLink, &Slot<f64>)| {
        let (omega, velocity) = (slot.angular, slot.linear);
        let h = slot.rotation.of_constant(&body.moment);
        let spin = 0.5 * omega.dot(slot.inertia.rotational * omega);
        let rates = &v[body.v..][..if matches!(body.kind, JointKind::Spherical(_)) { 3 } else { 1 }];
        let rotor = match body.armature > 0.0 {
            true => rates.iter().map(|rate| 0.5 * body.armature * rate * rate).sum(),
            false => 0.0,
        };
        spin + 0.5 * body.mass * velocity.dot(velocity) + velocity.dot(omega.cross(h)) + rotor
    };
    compiled.bodies.iter().zip(&sweep.slots[1..]).map(of_link).sum()
}

/// Returns `V = X Vₚ + S v` of a link.
#[inline(always)]
fn carried(body: &CompiledLink, slot: &Slot<f64>, parent: Motion, v: &[f64]) -> Motion {
    let mut motion = parent.at(slot.arm);
    match body.kind {
        JointKind::Revolute => motion.angular += slot.rotation.z * v[body.v],
        JointKind::Prismatic => motion.linear += slot.rotation.z * v[body.v],
        JointKind::Spherical(_) => motion.angular += slot.rotation * load_vector(v, body.v),
        JointKind::Floating(_) => motion = Motion::new(load_vector(v, body.v), load_vector(v, body.v + 3)),
    }
    motion
}

/// Writes `q̈` from `q`, `v` and joint forces `tau` in uniform gravity, in one pass. Afterwards the
/// maps of `d` need a [`Dynamics::refresh`].
///
/// # Errors
/// [`SingularJoint`] if the mass matrix is singular, with the first link that [`Dynamics::singular`] returns. `qdd`
/// is then that with the axes held that meet no inertia.
pub fn forward_dynamics(
    d: &mut Dynamics,
    gravity: &Vec3,
    q: &[f64],
    v: &[f64],
    tau: &[f64],
    qdd: &mut [f64],
) -> Result<(), SingularJoint> {
    d.at.clear();
    let Dynamics { compiled, sweep, joint_sin_cos, .. } = d;
    let turns = joint_sin_cos.take(q);
    sweep.run(compiled, gravity, &SingleState { turns, q, v, tau }, |k, x| qdd[k] = x);
    let mut held = None;
    sweep.inverses(compiled, |link, inverse| {
        if inverse == 0.0 && held.is_none() {
            held = Some(SingularJoint { lane: 0, link });
        }
    });
    held.map_or(Ok(()), Err)
}

/// Returns whether numbers have the same bits.
fn same(a: &[f64], b: &[f64]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits())
}

/// One state as the input of a sweep.
struct SingleState<'a> {
    turns: &'a [(f64, f64)],
    q: &'a [f64],
    v: &'a [f64],
    tau: &'a [f64],
}

impl Input<f64> for SingleState<'_> {
    #[inline(always)]
    fn joint_angle_sin_cos(&self, link: usize, _: usize) -> (f64, f64) {
        self.turns[link]
    }
    #[inline(always)]
    fn q(&self, k: usize) -> f64 {
        self.q[k]
    }
    #[inline(always)]
    fn v(&self, k: usize) -> f64 {
        self.v[k]
    }
    #[inline(always)]
    fn tau(&self, k: usize) -> f64 {
        self.tau[k]
    }
}

/// Returns three numbers of a slice from `k` on.
pub(in crate::articulated) fn load_vector(x: &[f64], k: usize) -> Vector {
    three(|k| x[k], k)
}

/// Writes three numbers of a slice from `k` on.
pub(in crate::articulated) fn store_vector(x: &mut [f64], k: usize, v: Vector) {
    write_three(k, v, &mut |k, x_k| x[k] = x_k);
}
