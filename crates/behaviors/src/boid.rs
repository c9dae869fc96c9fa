//! A boid: a point mass with a nose that points along its velocity, and that banks into turns
//! (thesis appendix A, `Boid::UpdateState`).
//!
//! ```text
//! X = [x, φ, v, φ̇]        m·v̇ = F        φ̈ = (φ* − φ)/T² − 2·φ̇/T
//! R = H(v)·Rx(φ)          φ* = −½π·clamp(B·(H·ŷ)·F/(m·|v|), −1, 1)
//! H(v) = [1 + c; x̂ × v̂]/‖·‖,  c = x̂·v̂: the shortest rotation from x̂ to v̂
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `x`, `v`, `m` | position, velocity, mass |
//! | `F` | sum of all forces on the boid, its weight left out |
//! | `R` | orientation; x forward, y to the left, z up |
//! | `H` | heading: the orientation without bank |
//! | `φ`, `φ*` | bank about the nose, and the bank that the turn calls for; negative in turns to the left |
//! | `B` | time that turns a rate of turn (rad/s) into a share of a quarter turn; 1 s in the thesis |
//! | `T` | time constant of the roll |
//!
//! Departures from the appendix:
//!
//! - `acos` of a number that rounding makes larger than 1 gives NaN there, and `v = −x̂` a zero axis.
//!   `H` needs neither; at `v = −x̂` it is half a turn about z, at `v = 0` no turn.
//! - It banks about z, which turns the nose off the velocity. Here the bank is about the nose.
//! - It divides a force by a speed. Here the mass divides too: the quotient is the rate of turn.
//! - It sets the bank from the last force, which no state holds. Here the bank is a degree of
//!   freedom that follows, critically damped. The division by `(1 + h/T)²` is that of an implicit
//!   step: no length of a step makes the roll unstable.
//! - The wings carry the weight: gravity does not act on a boid.
//!
//! For contacts the boid is a point mass: it has no angular velocity, and nothing but its own turn
//! changes its orientation.

use crate::error::{BehaviorError, check};
use crate::record;
use std::f64::consts::FRAC_PI_2;
use tumble_collide::{Pose, Quat, Shape, Vec3};
use tumble_core::archive::{ObjectIndices, ObjectRecord};
use tumble_core::{
    Cache, Collidable, Energy, ForceSlice, Forces, Integratable, Material, Object, PartPoint, PartState, Renderable,
    StateRange, StateSizes, Visual, WorldView,
};

/// Speed below which a boid has no heading, m/s.
const SLOWEST: f64 = 1e-9;
/// Radius of gyration of the roll, m: it divides generalized forces on the roll, and nothing else.
const GYRATION: f64 = 0.1;

/// A boid. Its state is position (m), bank (rad), velocity (m/s) and rate of bank (rad/s).
#[derive(Clone, Debug)]
pub struct Boid {
    name: String,
    pub(crate) shape: Shape,
    pub(crate) mass: f64,
    pub(crate) material: Material,
    pub(crate) visuals: Vec<Visual>,
    pub(crate) start: [f64; 8],
    pub(crate) bank_time: f64,
    pub(crate) roll_time: f64,
}

impl Boid {
    /// Returns position, m, and velocity, m/s, at time 0.
    pub fn start(&self) -> (Vec3, Vec3) {
        (Vec3::from_column_slice(&self.start[..3]), Vec3::from_column_slice(&self.start[4..7]))
    }
    /// Returns `bank_time` and `roll_time`, s.
    pub fn bank(&self) -> [f64; 2] {
        [self.bank_time, self.roll_time]
    }

    /// Makes a boid of a mass, kg, above 0, at rest at the origin.
    ///
    /// # Errors
    /// [`BehaviorError::Range`] names the mass.
    pub fn new(shape: Shape, mass: f64) -> Result<Boid, BehaviorError> {
        check("the mass of a boid", mass, mass > 0.0, "above 0")?;
        let (name, material, visuals) = (String::new(), Material::default(), Vec::new());
        Ok(Boid { name, shape, mass, material, visuals, start: [0.0; 8], bank_time: 1.0, roll_time: 0.2 })
    }
    /// Sets the name.
    pub fn with_name(self, name: impl Into<String>) -> Boid {
        Boid { name: name.into(), ..self }
    }
    /// Sets the position at time 0, m.
    pub fn with_position(mut self, position: Vec3) -> Boid {
        self.start[..3].copy_from_slice(position.as_slice());
        self
    }
    /// Sets the velocity at time 0, m/s.
    pub fn with_velocity(mut self, velocity: Vec3) -> Boid {
        self.start[4..7].copy_from_slice(velocity.as_slice());
        self
    }
    /// Sets the surface constants.
    pub fn with_material(self, material: Material) -> Boid {
        Boid { material, ..self }
    }
    /// Sets the visuals, in the frame of the boid: x forward, z up.
    pub fn with_visuals(self, visuals: Vec<Visual>) -> Boid {
        Boid { visuals, ..self }
    }
    /// Sets how a boid banks: `bank_time` (s, at least 0) times its rate of turn is the share of a
    /// quarter turn, 1 s by default; `roll_time` (s, above 0) is the time constant of the roll,
    /// 0.2 s by default.
    ///
    /// # Errors
    /// [`BehaviorError::Range`] names the time that is out of its range.
    pub fn with_bank(self, bank_time: f64, roll_time: f64) -> Result<Boid, BehaviorError> {
        check("bank_time", bank_time, bank_time >= 0.0, "at least 0")?;
        check("roll_time", roll_time, roll_time > 0.0, "above 0")?;
        Ok(Boid { bank_time, roll_time, ..self })
    }
    /// Returns the mass, kg.
    pub fn mass(&self) -> f64 {
        self.mass
    }

    /// Returns the shortest rotation from the x axis to a velocity: half a turn about z for a
    /// velocity along −x, and no turn below 1e-9 m/s.
    pub fn heading(velocity: &Vec3) -> Quat {
        let speed = velocity.norm();
        if speed < SLOWEST {
            return Quat::identity();
        }
        let v = velocity / speed;
        let aside = v.y * v.y + v.z * v.z;
        // 1 + c without cancellation where c is near −1
        let w = if v.x >= 0.0 { 1.0 + v.x } else { aside / (1.0 - v.x) };
        let [y, z] = if w * w + aside < 1e-24 { [0.0, 1.0] } else { [-v.z, v.y] };
        let mut heading = Quat::identity().into_inner();
        heading.coords.copy_from_slice(&[0.0, y, z, w]);
        Quat::new_normalize(heading)
    }

    /// Returns the bank that a force (N) calls for at a velocity, rad, from −½π to ½π.
    pub fn wanted_bank(&self, velocity: &Vec3, force: &Vec3) -> f64 {
        let speed = velocity.norm();
        if speed < SLOWEST {
            return 0.0;
        }
        let rate_of_turn = (Boid::heading(velocity) * Vec3::y()).dot(force) / (self.mass * speed);
        -FRAC_PI_2 * (self.bank_time * rate_of_turn).clamp(-1.0, 1.0)
    }

    fn root(&self, dof: usize) -> f64 {
        if dof < 3 { self.mass.sqrt() } else { self.mass.sqrt() * GYRATION }
    }
}

impl Object for Boid {
    fn record(&self, _: &ObjectIndices) -> Option<ObjectRecord> {
        record::boid(self)
    }
    fn name(&self) -> &str {
        &self.name
    }
    fn refresh(&self, x: &[f64], _cache: &mut Cache, part_states: &mut [PartState]) {
        let (position, velocity) = (Vec3::from_column_slice(&x[..3]), Vec3::from_column_slice(&x[4..7]));
        let rotation = Boid::heading(&velocity) * Quat::from_axis_angle(&Vec3::x_axis(), x[3]);
        part_states[0].pose = Pose::from_parts(position.into(), rotation);
        part_states[0].velocity = velocity;
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
}

impl Integratable for Boid {
    fn state_sizes(&self) -> StateSizes {
        StateSizes { x: 8, dof: 4, parts: 1 }
    }
    fn write_initial(&self, x: &mut [f64]) {
        x.copy_from_slice(&self.start);
    }
    fn part_mass(&self, _part: usize) -> f64 {
        self.mass
    }
    fn accumulate_forces(&self, _me: &StateRange, _view: &WorldView, _out: &mut Forces) {}
    fn derivative(&self, _cache: &mut Cache, x: &[f64], f: &ForceSlice, dp: &mut [f64]) {
        let force = f.wrenches[0].force + Vec3::from_column_slice(&f.generalized[..3]);
        dp[..3].copy_from_slice((force / self.mass).as_slice());
        let bank = self.wanted_bank(&Vec3::from_column_slice(&x[4..7]), &force);
        let pull = (bank - x[3]) / self.roll_time - 2.0 * x[7];
        dp[3] = pull / self.roll_time + f.generalized[3] / (self.root(3) * self.root(3));
    }
    fn mean_rate(&self, h: f64, dp: &mut [f64]) {
        let step = 1.0 + h / self.roll_time;
        dp[3] /= step * step;
    }
    fn jacobian(&self, _cache: &mut Cache, at: &PartPoint, j: &mut [f64]) {
        for (axis, j) in at.axes.iter().zip(j.chunks_exact_mut(4)) {
            j.iter_mut().zip(axis.iter()).for_each(|(j, axis)| *j += axis);
        }
    }
    fn mul_l(&self, _cache: &mut Cache, v: &[f64], u: &mut [f64]) {
        (0..4).for_each(|k| u[k] = self.root(k) * v[k]);
    }
    fn solve_l(&self, _cache: &mut Cache, u: &[f64], v: &mut [f64]) {
        (0..4).for_each(|k| v[k] = u[k] / self.root(k));
    }
    fn solve_lt(&self, cache: &mut Cache, j: &[f64], y: &mut [f64]) {
        self.solve_l(cache, j, y);
    }
    fn mul_lt(&self, cache: &mut Cache, u: &[f64], j: &mut [f64]) {
        self.mul_l(cache, u, j);
    }
    // as the provided methods, which take memory for a general Jacobian: a flock has thousands of boids
    fn whitened_velocity(&self, cache: &mut Cache, x: &[f64], u: &mut [f64]) {
        self.mul_l(cache, &x[4..], u);
    }
    fn free_motion(&self, _cache: &mut Cache, x: &mut [f64], h: f64) {
        (0..4).for_each(|k| x[k] += h * x[4 + k]);
    }
    fn accelerations(&self, _cache: &mut Cache, _x: &[f64], dp: &[f64], part_states: &mut [PartState]) {
        part_states[0].acceleration = Vec3::from_column_slice(&dp[..3]);
        part_states[0].angular_acceleration = Vec3::zeros();
    }
    fn energy(&self, x: &[f64], _gravity: &Vec3) -> Energy {
        let kinetic = (0..4).map(|k| 0.5 * (self.root(k) * x[4 + k]).powi(2)).sum();
        Energy { kinetic, potential: 0.0 }
    }
}

impl Collidable for Boid {
    fn shape(&self, _part: usize) -> Option<&Shape> {
        Some(&self.shape)
    }
    fn material(&self, _part: usize) -> Material {
        self.material
    }
}

impl Renderable for Boid {
    fn visuals(&self) -> &[Visual] {
        &self.visuals
    }
}
