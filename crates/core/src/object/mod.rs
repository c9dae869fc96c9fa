//! The interfaces of the thesis (§IV.A), as traits.
//!
//! Objects are open: a new kind of behavior is a new type in anybody's crate that answers some of these. All that changes with time lives in
//! the world's flat state `X`; an object is a model that says how to read its slice, so that saving, forking and integrator stages are
//! copies of a slice.

pub(crate) mod collidable;
pub(crate) mod mounts;
pub(crate) mod part_state;
pub(crate) mod sync;
pub(crate) mod visual;

use crate::constraint::builder::RowBuilder;
use crate::constraint::rows::RowSet;
use crate::derived::Cache;
use crate::object::collidable::Collidable;
use crate::object::mounts::{CameraCarrier, Detail, LightCarrier};
use crate::object::part_state::{ForceSlice, Forces, PartState, StateRange, StateSizes};
use crate::object::visual::Visual;
use crate::world::view::{ObjectId, WorldView};
use std::any::Any;
use std::path::Path;
use std::sync::Arc;
use tumble_collide::Vec3;

/// Everything the world holds. One accessor per interface; the default answer is "not I" (the thesis's
/// `ImplementsInterface`, §IV.B.1).
pub trait Object: Any + Send + Sync {
    /// Returns the name that the object is to have in a world, of any length. By default it is empty, and the world makes one:
    /// [`World::name`](crate::World::name) returns the name in the world.
    fn name(&self) -> &str {
        ""
    }
    /// An independent copy.
    fn fork(&self) -> Box<dyn Object>;
    /// Makes the memory for a [`refresh`](Self::refresh) and for the calls that are given a cache; nothing by default.
    fn new_cache(&self) -> Cache {
        Cache::default()
    }
    /// Writes the poses and velocities of its sites and its cache from its slice of the state; pure functions of `x` (thesis
    /// `UpdateState`). Accelerations are left to [`Integratable::accelerations`].
    fn refresh(&self, x: &[f64], cache: &mut Cache, part_states: &mut [PartState]) {
        let _ = (x, cache, part_states);
    }
    /// Whether it has a state that the integrator advances.
    fn integratable(&self) -> Option<&dyn Integratable> {
        None
    }
    /// Whether it has parts that collide.
    fn collidable(&self) -> Option<&dyn Collidable> {
        None
    }
    /// Whether it constrains itself or others.
    fn constraint(&self) -> Option<&dyn Constraint> {
        None
    }
    /// Whether it acts on others: "live" but not necessarily integrated (thesis §IV.B.2).
    fn force(&self) -> Option<&dyn ForceGenerator> {
        None
    }
    /// Whether it can be drawn.
    fn renderable(&self) -> Option<&dyn Renderable> {
        None
    }
    /// Whether it carries points of view.
    fn camera(&self) -> Option<&dyn CameraCarrier> {
        None
    }
    /// Whether it carries lights.
    fn light(&self) -> Option<&dyn LightCarrier> {
        None
    }
    /// Whether it can be kept in step with copies of itself in other processes.
    fn net_sync(&self) -> Option<&dyn NetSync> {
        None
    }
}

/// An object with a state (thesis `Integratable` and `SimulationState`, §IV.A.1–2).
///
/// `x` is always the object's own slice of the state, `v`, `dp`, `u` its `dof` numbers: generalized velocity, generalized force (or impulse),
/// and whitened velocity `u = L·v` where the mass matrix is `M = LᵀL`. `cache` is of the object's [`new_cache`](Object::new_cache): the
/// maps hold at the state for which it was last refreshed.
pub trait Integratable {
    /// How many numbers it needs.
    fn state_sizes(&self) -> StateSizes;
    /// Writes its state at time 0.
    fn write_initial(&self, x: &mut [f64]);
    /// Whether these numbers, as many as its state has, are a state of it: finite, orientations of unit length.
    fn accepts(&self, x: &[f64]) -> bool {
        x.iter().all(|x| x.is_finite())
    }
    /// Adds the forces that it feels of itself (gravity, damping) to its own rows of the force table.
    fn accumulate_forces(&self, me: &StateRange, view: &WorldView, out: &mut Forces);
    /// Generalized velocity at `x`.
    fn velocity(&self, x: &[f64], v: &mut [f64]);
    /// Changes the momentum in `x` so that the generalized velocity there is `v`: the inverse of [`velocity`](Self::velocity).
    fn write_velocity(&self, x: &mut [f64], v: &[f64]);
    /// Rate of what [`kick`](Self::kick) changes under the forces `f`: the thesis's derivative. That is momentum, or velocity for an object
    /// whose state holds velocities; `dp` names it either way.
    fn derivative(&self, cache: &mut Cache, x: &[f64], f: &ForceSlice, dp: &mut [f64]);
    /// Why the state at the last refresh has no motion (a singular mass matrix), if so. The step then ends with this as its error.
    fn singularity(&self, cache: &mut Cache) -> Option<String> {
        let _ = cache;
        None
    }
    /// Writes the accelerations of its sites for a rate of momentum `dp`.
    fn accelerations(&self, cache: &mut Cache, x: &[f64], dp: &[f64], part_states: &mut [PartState]);
    /// Writes `dp − M·v̇`: what of the rate of momentum changes the velocity's direction in the body and not its size (`ω × L` of a rigid
    /// body, Coriolis terms). Rows at the acceleration level need `v̇`. Zero where the mass matrix is constant.
    fn gyroscopic(&self, x: &[f64], out: &mut [f64]) {
        let _ = x;
        out.fill(0.0);
    }
    /// Momentum (or velocity, as [`derivative`](Self::derivative) says) changes by `h·dp`; positions stay.
    fn kick(&self, x: &mut [f64], dp: &[f64], h: f64);
    /// Free motion for `h` seconds with the momentum held: exact or symmetric of second order at least.
    fn free_motion(&self, cache: &mut Cache, x: &mut [f64], h: f64);
    /// Positions move with generalized velocity `v` for `h` seconds; exact on rotations. Momentum stays.
    fn integrate_positions(&self, x: &mut [f64], v: &[f64], h: f64);
    /// Positions move by `h·v`, a displacement and no motion: kinetic energy stays, and linear momentum to second order at least. [`integrate_positions`](Self::integrate_positions)
    /// where the mass matrix is constant; a rigid body that is turned scales its angular momentum, and an object whose state holds velocities carries them
    /// along parallel to themselves.
    fn displace(&self, cache: &mut Cache, x: &mut [f64], v: &[f64], h: f64) {
        let _ = cache;
        self.integrate_positions(x, v, h);
    }
    /// Turns a velocity `v` at the displacement `displacement` from some state into the rate of that displacement: the inverse of the
    /// differential of [`integrate_positions`](Self::integrate_positions)'s exponential map. Coordinates that simply add up leave `v` as it is, the default.
    fn pull_back(&self, displacement: &[f64], v: &mut [f64]) {
        let _ = (displacement, v);
    }
    /// Writes `u = L·v`.
    fn mul_l(&self, cache: &mut Cache, v: &[f64], u: &mut [f64]);
    /// Writes `v = L⁻¹·u`.
    fn solve_l(&self, cache: &mut Cache, u: &[f64], v: &mut [f64]);
    /// Writes `y = L⁻ᵀ·j`: the whitened response to a generalized impulse `j`.
    fn solve_lt(&self, cache: &mut Cache, j: &[f64], y: &mut [f64]);
    /// Writes `j = Lᵀ·u`: the generalized impulse of a change of `u`.
    fn mul_lt(&self, cache: &mut Cache, u: &[f64], j: &mut [f64]);
    /// Writes the whitened velocity `u = L·v` of the state. An object that has the momentum at hand may write `L⁻ᵀ·p`, the same with less rounding.
    fn whitened_velocity(&self, cache: &mut Cache, x: &[f64], u: &mut [f64]) {
        let mut v = vec![0.0; u.len()];
        self.velocity(x, &mut v);
        self.mul_l(cache, &v, u);
    }
    /// Returns which quantity of motion the state holds.
    fn momentum_kind(&self) -> MomentumKind {
        MomentumKind::Conjugate
    }
    /// Writes the part of [`derivative`](Self::derivative) that [`free_motion`](Self::free_motion) applies by itself: zero if free motion keeps the numbers
    /// that [`kick`](Self::kick) changes; the acceleration without forces of an object whose state holds velocities.
    fn free_motion_rate(&self, cache: &mut Cache, x: &[f64], out: &mut [f64]) {
        let _ = (cache, x);
        out.fill(0.0);
    }
    /// Whether it may be left out of the steps while it lies still (see [`Sleep`](crate::Sleep)): nothing that it feels of itself changes with time.
    fn may_sleep(&self) -> bool {
        false
    }
    /// Called once per committed step, for what must be put right after integration.
    fn stabilize(&self, x: &mut [f64], h: f64) {
        let _ = (x, h);
    }
    /// Kinetic energy, and potential energy in uniform gravity (zero at the world's origin), J.
    fn energy(&self, x: &[f64], gravity: &Vec3) -> Energy;
    /// Linear momentum, N·s, and angular momentum about the world's origin, N·m·s.
    fn momentum(&self, x: &[f64]) -> Momentum;
}

/// The quantity of motion that a state holds, and that [`Integratable::kick`] changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MomentumKind {
    /// The generalized momentum `p = M·v`. An impulse acts where it meets the object.
    Conjugate,
    /// The generalized velocity `v`: for objects whose mass matrix turns with their pose. `time_stepping` evaluates all that pushes such an object (mass
    /// matrix, rows, the velocity before the push) in the middle of the step.
    Velocity,
}

/// The maps between a change of the state's quantity of motion and a change of whitened velocity.
impl dyn Integratable + '_ {
    /// Returns whether the state holds velocities.
    pub(crate) fn holds_velocity(&self) -> bool {
        self.momentum_kind() == MomentumKind::Velocity
    }

    /// Writes the change `du` of whitened velocity for a change `dp` of the state: `L⁻ᵀ·dp` of a momentum, `L·dp` of a velocity.
    pub(crate) fn whiten_change(&self, cache: &mut Cache, dp: &[f64], du: &mut [f64]) {
        match self.momentum_kind() {
            MomentumKind::Conjugate => self.solve_lt(cache, dp, du),
            MomentumKind::Velocity => self.mul_l(cache, dp, du),
        }
    }

    /// Writes the change `dp` of the state for a change `du` of whitened velocity: the inverse of [`whiten_change`](Self::whiten_change).
    pub(crate) fn unwhiten_change(&self, cache: &mut Cache, du: &[f64], dp: &mut [f64]) {
        match self.momentum_kind() {
            MomentumKind::Conjugate => self.mul_lt(cache, du, dp),
            MomentumKind::Velocity => self.solve_l(cache, du, dp),
        }
    }
}

/// Mechanical energy, J.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energy {
    /// Of motion.
    pub kinetic: f64,
    /// In uniform gravity, zero at the world's origin.
    pub potential: f64,
}

impl Energy {
    /// Kinetic and potential.
    pub fn total(&self) -> f64 {
        self.kinetic + self.potential
    }
}

/// Momentum of an object or a world, world axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Momentum {
    /// Linear, N·s.
    pub linear: Vec3,
    /// Angular about the world's origin, N·m·s.
    pub angular: Vec3,
}

impl Default for Momentum {
    fn default() -> Momentum {
        Momentum { linear: Vec3::zeros(), angular: Vec3::zeros() }
    }
}

/// Acts on others without a state of its own: wind, springs, a flock (thesis §IV.A.2).
pub trait ForceGenerator {
    /// Adds forces, at the view's state and time.
    fn apply(&self, me: &StateRange, view: &WorldView, out: &mut Forces);
}

/// At which level rows are asked for: the thesis's two `Evaluate…Constraints` (§IV.A.4).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Level {
    /// Impulses that mend velocities over a step of `h` seconds.
    Velocity {
        /// Length of the step, s.
        h: f64,
    },
    /// Forces that mend accelerations.
    Acceleration,
}

/// Constrains itself or others: joint limits, loop closures, rods (thesis §IV.A.4). Its rows are solved together with all contacts.
pub trait Constraint {
    /// Adds its rows. See [`RowBuilder`] for how a row is made. The view shows the state that free motion makes by the middle of the step to
    /// come: directions are right there to second order. Errors are those of that state too; the stepper takes them back to the present. Where there
    /// are rigid equality rows they are asked for several times in a step, at its start, middle and end: rows are a function of the view alone.
    fn rows(&self, me: &StateRange, view: &WorldView, level: Level, out: &mut RowBuilder);
    /// Appends the errors of its one-sided rows ([`RowSet::HalfLine`]) at the view's state, one per row and in the order of the rows. What is told
    /// here `backtracking` locates in time as it does contacts: the step ends where the limit is reached, and the limit acts from there on. Of a
    /// constraint that tells nothing the limits act over the whole of the step in which they are reached.
    fn gaps(&self, me: &StateRange, view: &WorldView, out: &mut Vec<f64>) {
        let _ = (me, view, out);
    }
    /// Appends all objects that its rows can take hold of; `false` where it does not say, and then nothing in the world falls asleep.
    fn partners(&self, out: &mut Vec<ObjectId>) -> bool {
        let _ = out;
        false
    }
    /// Whether its rows act on nothing but itself. They are left out while impulses do not move it: what is led may pass its own limits.
    fn on_itself(&self) -> bool {
        false
    }
}

/// One row of a [`Constraint`]: what it may do and how far off it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RowTarget {
    /// What the multiplier may be.
    pub set: RowSet,
    /// Position error of the row (meters or radians): the equality's drift, or the one-sided row's gap (negative where violated).
    pub error: f64,
    /// Velocity that the row aims at (0 except for motors), m/s or rad/s.
    pub velocity: f64,
    /// The part of the row's acceleration that is there without any force or change of velocity (`J̇·v`); 0 where the row's direction stays.
    pub bias_acceleration: f64,
    /// Compliance `R` of the row, at least 0: it gives way by `R` times its multiplier, `w = c + (K + R)·λ`. In (m/s)/(N·s); at the
    /// acceleration level (m/s²)/N. 0 is rigid. A soft row is a spring: no impact and no position projection knows it.
    ///
    /// An implicit PD drive `F = kp·(q* − q⁺) + kd·(v* − v⁺)` with `q⁺ = q + h·v⁺` is `compliance = 1/(h·(kd + h·kp))` with the target
    /// velocity `(kp·(q* − q) + kd·v*)/(kd + h·kp)`; the same at the acceleration level, for a sub-step of `h`.
    pub compliance: f64,
}

impl RowTarget {
    /// A rigid row at rest with the given set and position error.
    pub fn new(set: RowSet, error: f64) -> RowTarget {
        RowTarget { set, error, velocity: 0.0, bias_acceleration: 0.0, compliance: 0.0 }
    }
}

/// Can be kept in step over a network (thesis §IV.A.6): one side writes a message, the other applies it. The frame around the message (names,
/// sizes, time) is not the object's business.
pub trait NetSync {
    /// Appends what the other side needs to show this object as it is in the view.
    fn get_data(&self, me: &StateRange, view: &WorldView, out: &mut Vec<u8>);
    /// Applies such a message to the object's slice of a state. `data` comes from outside and is not trusted: on an error `x` is unchanged.
    fn read_data(&self, data: &[u8], x: &mut [f64]) -> Result<(), SyncError>;
}

/// Why a message was not applied.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SyncError {
    /// Wrong length.
    #[error("the message has {got} bytes; this object's has {wanted}")]
    Length {
        /// Bytes in the message.
        got: usize,
        /// Bytes that it must have.
        wanted: usize,
    },
    /// A number in it is not finite, or a quaternion not of unit length.
    #[error("the message holds a number that is not finite, or an orientation that is not of unit length")]
    Value,
}

/// Can be drawn (thesis `Renderable` and `SidRenderable`, §IV.A.5): says what, never how.
pub trait Renderable {
    /// Its pictures.
    fn visuals(&self) -> &[Visual];
}

/// How a surface looks: a shader by name and its properties, as the thesis's shader attributes.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Appearance {
    /// Base color, sRGB, each 0 to 1.
    pub color: [f32; 3],
    /// 0 is a mirror, 1 is chalk.
    pub roughness: f32,
    /// 0 or 1, or between for mixtures.
    pub metallic: f32,
    /// Name of the surface's pattern, `plain` where none.
    pub shader: String,
    /// Named properties of the shader, in the order given.
    pub properties: Vec<(String, f64)>,
    /// A picture (PNG) over the base color; opened by who draws.
    #[serde(with = "texture")]
    pub texture: Option<Arc<Path>>,
    /// How much of it is drawn.
    pub detail: Detail,
}

impl Default for Appearance {
    fn default() -> Appearance {
        Appearance {
            color: [0.7, 0.7, 0.72],
            roughness: 0.5,
            metallic: 0.0,
            shader: "plain".into(),
            properties: Vec::new(),
            texture: None,
            detail: Detail::Full,
        }
    }
}

/// The path of a texture in archives: a string, which a path that is not UTF-8 cannot be.
mod texture {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};
    use std::path::{Path, PathBuf};
    use std::sync::Arc;

    pub fn serialize<S: Serializer>(path: &Option<Arc<Path>>, serializer: S) -> Result<S::Ok, S::Error> {
        path.as_deref().serialize(serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Arc<Path>>, D::Error> {
        Ok(Option::<PathBuf>::deserialize(deserializer)?.map(Arc::from))
    }
}
