//! A flock of rigid and articulated bodies, steered by forces and torques: bodies fly nose first, bank into turns, and are turned by
//! collisions like any other body.
//!
//! ```text
//! f* = v/|v|      ω* = v × F/(m·|v|²)      φ* = −½π·clamp(B·(ω*·u), −1, 1)
//! R* = Rot(f*, φ*)·[f*, u × f*, u],  u = up − (up·f*)·f*, normalized
//! e = log(R*·Rᵀ)                τ = I·α + ω × I·ω,  α = cap(k²·e + 2·k·(ω* − ω))
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `F` | force of the flock on the body's center of mass ([`super::steering`]) |
//! | `v`, `ω`, `R`, `m`, `I` | velocity in the air, angular velocity, orientation, mass, and inertia in world axes |
//! | `f*`, `R*` | wanted nose and orientation; x forward, y to the left, z up |
//! | `ω*` | turn rate that `F` commands |
//! | `φ*`, `B` | bank about the nose, negative in turns to the left; time that turns a rate into a share of a quarter turn |
//! | `e` | rotation vector from the orientation to the wanted one, at most π |
//! | `k`, `α` | agility; angular acceleration, at most `max_angular_acceleration` |
//!
//! The error of the orientation is critically damped with the rate `k`. `ω*` is added in advance, so in a steady turn
//! the nose has no lag, and the body turns at the commanded rate. The torque has no part along the momentum of the center of mass: in a
//! collision the bodies of a flock keep it, whatever they do with their noses. It depends on velocities, so it is constant
//! over a step `h`: keep `k·h` below ¼. Without speed there is no course; the torque then only stops the spin.
//!
//! An articulated body is steered by its floating root, such as the torso of a bird: `F` acts on the root at the center of mass of the
//! whole, `R` and `ω` are those of the root, and `m` and `I` those of all links in their present poses. How its joints move is its own
//! affair.
//!
//! This is the steering by torques that appendix A of the thesis leaves open.

use crate::error::{BehaviorError, check};
use crate::fields::check_vector;
use crate::record;
use crate::steering::{Flyer, Search, Sorted, Steering};
use nalgebra::Unit;
use std::f64::consts::FRAC_PI_2;
use tumble_collide::{Mat3, Quat, Vec3};
use tumble_core::archive::{ObjectIndices, ObjectRecord};
use tumble_core::articulated::Joint;
use tumble_core::{
    ArticulatedBody, ForceGenerator, Forces, Object, ObjectId, PartState, RigidBody, StateRange, WorldView,
};

/// Speed below which a body has no course, m/s.
const SLOWEST: f64 = 1e-3;
/// Least number of bodies on a thread.
const PIECE: usize = 64;

/// How a body turns to its course.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Helm {
    /// Rate at which the orientation approaches the wanted one, 1/s, at least 0.
    pub agility: f64,
    /// Largest angular acceleration, rad/s², at least 0.
    pub max_angular_acceleration: f64,
    /// Time that turns a rate of turn (rad/s) into a share of a quarter turn of bank, s, at least 0.
    pub bank_time: f64,
    /// The direction that is up for a body without bank; any length above 0.
    pub up: Vec3,
    /// Velocity of the air, m/s. Speeds and courses of the flock are those in the air; the boundary stands still.
    pub wind: Vec3,
}

impl Default for Helm {
    /// A quarter of a second to turn, up along z, in still air.
    fn default() -> Helm {
        Helm { agility: 8.0, max_angular_acceleration: 100.0, bank_time: 1.0, up: Vec3::z(), wind: Vec3::zeros() }
    }
}

/// A flock of rigid bodies, and of articulated ones with a floating root, in one world. It is a force: it has no state, and bodies of
/// any shape can join it.
///
/// ```
/// # use tumble_core::prelude::*;
/// # use tumble_behaviors::Steering;
/// # let mut world = World::default();
/// use tumble_behaviors::{BodyFlock, Helm};
/// let mut school = BodyFlock::new("school", Steering::default(), Helm::default())?;
/// let fish = RigidBody::new(Shape::cuboid(Vec3::new(0.4, 0.1, 0.2))?).with_gravity_scale(0.0);
/// school.push(world.add(fish.with_velocity(Vec3::x()))?);
/// world.add(school)?;
/// # world.step()?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct BodyFlock {
    name: String,
    steering: Steering,
    helm: Helm,
    pub(crate) search: Search,
    bodies: Vec<ObjectId>,
}

impl BodyFlock {
    /// Makes a flock without bodies.
    ///
    /// # Errors
    /// As [`Steering::validate`]; [`BehaviorError::Range`] names a constant of the helm that is out of its range.
    pub fn new(name: impl Into<String>, steering: Steering, helm: Helm) -> Result<BodyFlock, BehaviorError> {
        steering.validate()?;
        helm.validate()?;
        Ok(BodyFlock { name: name.into(), steering, helm, search: Search::Grid, bodies: Vec::new() })
    }
    /// Sets how neighbors are found; the forces have the same bits.
    pub fn with_search(self, search: Search) -> BodyFlock {
        BodyFlock { search, ..self }
    }
    /// Adds a rigid body, or an articulated one whose root floats, of the flock's world. Its gravity acts beside the flock: set
    /// [`RigidBody::with_gravity_scale`] to 0 for a body without wings that carry it.
    pub fn push(&mut self, body: ObjectId) {
        self.bodies.push(body);
    }
    /// Removes a body from the flock; it stays in the world. Returns whether it was in it.
    pub fn release(&mut self, body: ObjectId) -> bool {
        let before = self.bodies.len();
        self.bodies.retain(|id| *id != body);
        self.bodies.len() < before
    }
    /// Returns the constants of the forces.
    pub fn steering(&self) -> &Steering {
        &self.steering
    }
    /// Returns how bodies turn to their course.
    pub fn helm(&self) -> &Helm {
        &self.helm
    }
    /// Changes the constants from the next step on.
    ///
    /// # Errors
    /// As [`new`](BodyFlock::new). The constants then stay as they are.
    pub fn set_constants(&mut self, steering: Steering, helm: Helm) -> Result<(), BehaviorError> {
        steering.validate()?;
        helm.validate()?;
        (self.steering, self.helm) = (steering, helm);
        Ok(())
    }
    /// Returns whether an object can be steered: a rigid body, or an articulated body whose first link floats.
    pub fn steers(object: &dyn Object) -> bool {
        let object: &dyn std::any::Any = object;
        object.is::<RigidBody>() || object.downcast_ref().is_some_and(floats)
    }
    /// Returns the ids of the bodies, in the order in which they were added. Those that are not enabled, or that
    /// [`steers`](BodyFlock::steers) refuses, are ignored.
    pub fn bodies(&self) -> &[ObjectId] {
        &self.bodies
    }
}

impl Helm {
    /// Checks all constants.
    ///
    /// # Errors
    /// [`BehaviorError::Range`] names one that is out of its range.
    pub fn validate(&self) -> Result<(), BehaviorError> {
        check("agility", self.agility, self.agility >= 0.0, "at least 0")?;
        let most = self.max_angular_acceleration;
        check("max_angular_acceleration", most, most >= 0.0, "at least 0")?;
        check("bank_time", self.bank_time, self.bank_time >= 0.0, "at least 0")?;
        check_vector("wind", &self.wind)?;
        check_vector("up", &self.up)?;
        check("the length of up", self.up.norm(), self.up.norm() > 0.0, "above 0")
    }

    /// Returns the angular acceleration that a force calls for which accelerates the center of mass by `a`, m/s², at the velocity
    /// `v`, m/s; rad/s².
    pub fn angular_acceleration(&self, state: &PartState, v: &Vec3, a: &Vec3) -> Vec3 {
        let spin = state.angular_velocity;
        let wanted = match self.course(v, &(v.cross(a) / v.norm_squared())) {
            Some((orientation, turn)) => {
                let off = (orientation * state.pose.rotation.inverse()).scaled_axis();
                self.agility * self.agility * off + 2.0 * self.agility * (turn - spin)
            }
            None => -2.0 * self.agility * spin,
        };
        let size = wanted.norm();
        if size > self.max_angular_acceleration { wanted * (self.max_angular_acceleration / size) } else { wanted }
    }

    /// Returns the wanted orientation at a velocity and a turn rate, and that rate; `None` without speed.
    fn course(&self, velocity: &Vec3, turn: &Vec3) -> Option<(Quat, Vec3)> {
        let nose = velocity.try_normalize(SLOWEST)?;
        let up = self.up.normalize();
        // straight up or down any direction across is level
        let level = (up - up.dot(&nose) * nose).try_normalize(1e-6).unwrap_or_else(|| across(&nose));
        let axes = Mat3::from_columns(&[nose, level.cross(&nose), level]);
        let bank = -FRAC_PI_2 * (self.bank_time * turn.dot(&level)).clamp(-1.0, 1.0);
        let orientation = nalgebra::Rotation3::from_matrix_unchecked(axes);
        Some((
            Quat::from_axis_angle(&Unit::new_unchecked(nose), bank) * Quat::from_rotation_matrix(&orientation),
            *turn,
        ))
    }
}

/// Returns a unit vector across another one.
fn across(axis: &Vec3) -> Vec3 {
    axis.cross(&Vec3::ith(axis.iamin(), 1.0)).normalize()
}

impl Object for BodyFlock {
    fn record(&self, indices: &ObjectIndices) -> Option<ObjectRecord> {
        record::body_flock(self, indices)
    }
    fn name(&self) -> &str {
        &self.name
    }
    fn force(&self) -> Option<&dyn ForceGenerator> {
        Some(self)
    }
}

impl ForceGenerator for BodyFlock {
    fn apply(&self, _me: &StateRange, view: &WorldView, out: &mut Forces) {
        let (mut members, mut flyers) = (Vec::new(), Vec::new());
        for &id in self.bodies.iter().filter(|id| view.status(**id).is_some_and(|status| status.enabled)) {
            let Some(range) = view.state_range(id) else { continue };
            let states = &view.part_states[range.parts.clone()];
            let member = match (view.get::<RigidBody>(id), view.get::<ArticulatedBody>(id)) {
                (Some(body), _) => Member::rigid(body, &states[0]),
                (None, Some(body)) if floats(body) => Member::articulated(body, states),
                _ => continue,
            };
            let Member { position, mass, .. } = member;
            let velocity = member.velocity - self.helm.wind;
            let forward = states[0].pose.rotation * Vec3::x();
            members.push((range.parts.start, member));
            flyers.push(Flyer { position, velocity, forward, mass });
        }
        let mut sorted = Sorted::default();
        self.steering.forces_by(self.search, &flyers, &mut sorted, |forces, work| {
            view.each_piece(forces, PIECE, work);
        });
        for (((row, member), flyer), force) in members.iter().zip(&flyers).zip(&sorted.forces) {
            let (state, inertia) = (&view.part_states[*row], &member.inertia);
            let spin = state.angular_velocity;
            let acceleration = self.helm.angular_acceleration(state, &flyer.velocity, &(force / member.mass));
            out.add_at(*row, state, *force, &member.position);
            out.wrenches[*row].torque += inertia * acceleration + spin.cross(&(inertia * spin));
        }
    }
}

/// A body of a flock as a whole.
struct Member {
    /// Center of mass, m, and its velocity, m/s.
    position: Vec3,
    velocity: Vec3,
    /// Mass, kg.
    mass: f64,
    /// Inertia about the center of mass, world axes, kg·m².
    inertia: Mat3,
}

impl Member {
    fn rigid(body: &RigidBody, state: &PartState) -> Member {
        let position = state.pose.transform_point(&body.center_in_part().into()).coords;
        let (velocity, inertia) = (state.velocity_at(&position), turned(body.inertia(), state));
        Member { position, velocity, mass: body.mass(), inertia }
    }

    /// `I = Σ Iᵢ + mᵢ·(|dᵢ|²·1 − dᵢ·dᵢᵀ)` over the links, `dᵢ` from the center of mass of the whole to theirs.
    fn articulated(body: &ArticulatedBody, states: &[PartState]) -> Member {
        let links = || body.model().links().iter().map(|link| &link.mass).zip(states);
        let (mut mass, mut moment, mut momentum) = (0.0, Vec3::zeros(), Vec3::zeros());
        for (link, state) in links() {
            let center = state.pose.transform_point(&link.center.into()).coords;
            mass += link.mass;
            moment += link.mass * center;
            momentum += link.mass * state.velocity_at(&center);
        }
        let (position, velocity) = (moment / mass, momentum / mass);
        let mut inertia = Mat3::zeros();
        for (link, state) in links() {
            let arm = state.pose.transform_point(&link.center.into()).coords - position;
            let steiner = Mat3::from_diagonal_element(arm.norm_squared()) - arm * arm.transpose();
            inertia += turned(&link.inertia, state) + link.mass * steiner;
        }
        Member { position, velocity, mass, inertia }
    }
}

/// Returns an inertia of a part in world axes.
fn turned(inertia: &Mat3, state: &PartState) -> Mat3 {
    let axes = state.pose.rotation.to_rotation_matrix();
    axes.matrix() * inertia * axes.matrix().transpose()
}

/// Returns whether the first link of a body floats, and has a mass.
fn floats(body: &ArticulatedBody) -> bool {
    body.model().links().first().is_some_and(|root| matches!(root.joint, Joint::Floating) && root.mass.mass > 0.0)
}
