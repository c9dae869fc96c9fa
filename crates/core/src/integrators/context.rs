//! Smooth motion: forces at a stage, and the integrators (thesis §IV.B.2).
//!
//! | integrator | one step of `h` |
//! |---|---|
//! | explicit Euler | `x += h·v(x,p)`, `p += h·f(x,p,t)` |
//! | symplectic Euler | `p += h·f(x,p,t)`, `x += h·v(x,p)` |
//! | Verlet | free motion of `x` over `h/2`, `p += h·f(x,p,t+h/2)`, free motion of `x` over `h/2` |
//! | Dormand–Prince | fifth order, by inner steps that a tolerance chooses: [`crate::integrators`] |
//! | RK4 | classical on `p`; on `x` the commutator-free method of Celledoni, Marthinsen and Owren (2003), two exponentials in the last stage |

use crate::derived::{Cache, Derived};
use crate::each_object::{Numbers, Own, each_object};
use crate::integrators::Adaptive;
use crate::object::part_state::{Forces, PartState, Wrench};
use crate::settings::Integrator;
use crate::threads::Threads;
use crate::world::view::{Entry, Mode, ObjectId, Objects, Table, WorldView};
use crate::world::{ObjectState, StepError};
use smallvec::SmallVec;
use tumble_collide::Vec3;

/// The objects, state and buffers of an integration, borrowed from the world.
pub(crate) struct IntegrationContext<'a> {
    pub table: &'a Table,
    pub states: &'a [ObjectState],
    pub threads: &'a Threads,
    pub x: &'a mut [f64],
    pub derived: &'a mut Derived,
    pub forces: &'a mut Forces,
    pub gravity: Vec3,
    /// See [`WorldView::implicit`].
    pub implicit: bool,
    /// Forces set by the user, per part.
    pub applied: &'a [Wrench],
    /// Generalized forces set by the user, per degree of freedom.
    pub applied_generalized: &'a [f64],
    /// Generalized contact forces that are constant over the sub-step.
    pub held: &'a [f64],
    /// Contact forces on links that are constant over the sub-step, per part; empty for none.
    pub held_wrenches: &'a [Wrench],
}

impl IntegrationContext<'_> {
    /// Writes part states and caches from the state.
    pub fn refresh(&mut self) {
        refresh_all(self.threads, self.table.with(self.states), self.x, self.derived);
    }

    /// Writes part states and cache of one object from the state.
    pub fn refresh_one(&mut self, id: ObjectId) {
        if let Some(entry) = self.table.with(self.states).get(id) {
            let Derived { part_states, caches } = &mut *self.derived;
            let part_states = &mut part_states[entry.state_range.parts.clone()];
            refresh(&entry, &mut caches[entry.place], self.x, part_states);
        }
    }

    /// Returns the objects with their switches.
    pub fn objects(&self) -> Objects<'_> {
        self.table.with(self.states)
    }

    /// Evaluates all forces at the present state and time `t`: writes the rate of momentum of every
    /// object to `dp`, and accelerations to the part states.
    pub fn evaluate(&mut self, t: f64, dp: &mut [f64]) {
        self.refresh();
        let act = || self.objects().iter().any(|e| e.status.enabled && e.object.force().is_some());
        if self.table.walk.is_whole() || act() {
            self.applied.clone_into(&mut self.forces.wrenches); // forces may act on settled objects
        } else {
            self.table.walk.parts.copy(self.applied, &mut self.forces.wrenches);
        }
        for (wrench, held) in self.forces.wrenches.iter_mut().zip(self.held_wrenches) {
            wrench.force += held.force;
            wrench.torque += held.torque;
        }
        self.forces.generalized.clear();
        self.forces
            .generalized
            .extend(self.held.iter().zip(self.applied_generalized).map(|(held, applied)| held + applied));
        let view = WorldView {
            time: t,
            gravity: self.gravity,
            implicit: self.implicit,
            x: self.x,
            part_states: &self.derived.part_states,
            objects: self.table.with(self.states),
            threads: self.threads,
        };
        for entry in self.table.with(self.states).iter().filter(|e| e.status.enabled) {
            if let Some(body) = entry.object.integratable().filter(|_| entry.moves()) {
                body.accumulate_forces(entry.state_range, &view, self.forces);
            }
            if let Some(force) = entry.object.force() {
                force.apply(entry.state_range, &view, self.forces);
            }
        }
        dp.fill(0.0);
        let Derived { part_states, caches } = &mut *self.derived;
        let (objects, x, forces) = (self.table.with(self.states), &*self.x, &*self.forces);
        let numbers = Numbers { caches, v: dp, part_states, ..Numbers::default() };
        each_object(self.threads, objects, numbers, |entry, Own { cache, v: dp, part_states, .. }| {
            let (state_range, Some(body)) = (entry.state_range, entry.object.integratable()) else { return };
            if entry.moves() {
                let forces = forces.slice(state_range, part_states);
                body.derivative(cache, &x[state_range.x.clone()], &forces, dp);
                body.accelerations(cache, &x[state_range.x.clone()], dp, part_states);
            } else {
                // a kinematic object keeps its generalized velocity: a link that turns about
                // another still has its centripetal acceleration
                part_states.iter_mut().for_each(|s| {
                    (s.acceleration, s.angular_acceleration) = (s.bias_acceleration, s.bias_angular_acceleration)
                });
            }
        });
    }

    /// Moves every dynamic object freely for `h`, and every kinematic object with its velocity.
    pub fn free_motion(&mut self, h: f64) {
        let numbers = Numbers { caches: &mut self.derived.caches, x: &mut *self.x, ..Numbers::default() };
        each_object(self.threads, self.table.with(self.states), numbers, |entry, own| {
            free_motion(entry, own.cache, own.x, h);
        });
    }

    /// Subtracts from the rates the part that the free motion of a splitting over `h` already applies, and replaces
    /// them by their means over `h`.
    pub fn split_rates(&mut self, dp: &mut [f64], h: f64) {
        let (x, objects) = (&*self.x, self.table.with(self.states));
        let numbers = Numbers { caches: &mut self.derived.caches, v: dp, ..Numbers::default() };
        each_object(self.threads, objects, numbers, |entry, Own { cache, v: dp, .. }| {
            let Some(body) = entry.object.integratable().filter(|_| entry.moves()) else { return };
            if body.holds_velocity() {
                let mut rate = SmallVec::<[f64; 64]>::from_elem(0.0, dp.len());
                body.free_motion_rate(cache, &x[entry.state_range.x.clone()], &mut rate);
                dp.iter_mut().zip(&rate).for_each(|(dp, c)| *dp -= c);
            }
            body.mean_rate(h, dp);
        });
    }

    /// Replaces the rates of momentum by their means over `h`.
    fn average(&mut self, dp: &mut [f64], h: f64) {
        let numbers = Numbers { caches: &mut self.derived.caches, v: dp, ..Numbers::default() };
        each_object(self.threads, self.table.with(self.states), numbers, |entry, own| {
            if let Some(body) = entry.object.integratable().filter(|_| entry.moves()) {
                body.mean_rate(h, own.v);
            }
        });
    }

    fn kick(&mut self, dp: &[f64], h: f64) {
        for entry in self.table.with(self.states).iter().filter(|e| e.moves()) {
            if let Some(body) = entry.object.integratable() {
                body.kick(&mut self.x[entry.state_range.x.clone()], &dp[entry.state_range.v.clone()], h);
            }
        }
    }

    /// Writes the generalized velocities of all dynamic and kinematic objects; zero elsewhere.
    pub fn velocities(&self, v: &mut [f64]) {
        v.fill(0.0);
        for entry in self.table.with(self.states).iter().filter(|e| e.status.enabled && e.status.mode != Mode::Static) {
            if let Some(body) = entry.object.integratable() {
                body.velocity(&self.x[entry.state_range.x.clone()], &mut v[entry.state_range.v.clone()]);
            }
        }
    }

    fn integrate_positions(&mut self, v: &[f64], h: f64) {
        for entry in self
            .table
            .with(self.states)
            .iter()
            .filter(|e| e.status.enabled && e.status.mode != Mode::Static && !e.asleep)
        {
            let (x, v) = (&mut self.x[entry.state_range.x.clone()], &v[entry.state_range.v.clone()]);
            if let Some(body) = entry.object.integratable() {
                body.integrate_positions(x, v, h);
            }
        }
    }

    /// Integrates over `h` from time `t`, with one step, or with as many inner steps of `adaptive`
    /// as its tolerance requires, which it records. Leaves part states and caches at the new state.
    /// Returns the time integrated, s: `h`, or less if the record is full.
    ///
    /// # Errors
    /// [`StepError`] if the adaptive integrator fails.
    pub fn integrate(
        &mut self,
        integrator: Integrator,
        t: f64,
        h: f64,
        dp: &mut [f64],
        adaptive: &mut Adaptive,
    ) -> Result<f64, StepError> {
        let start = self.x.to_vec();
        match integrator {
            Integrator::Verlet => {
                self.free_motion(0.5 * h);
                self.evaluate(t + 0.5 * h, dp);
                self.split_rates(dp, h);
                self.kick(dp, h);
                self.free_motion(0.5 * h);
            }
            Integrator::SymplecticEuler => {
                self.evaluate(t, dp);
                self.average(dp, h);
                self.kick(dp, h);
                let mut v = vec![0.0; dp.len()];
                self.velocities(&mut v);
                self.integrate_positions(&v, h);
            }
            Integrator::ExplicitEuler => {
                self.evaluate(t, dp);
                let mut v = vec![0.0; dp.len()];
                self.velocities(&mut v);
                self.average(dp, h);
                self.kick(dp, h);
                self.integrate_positions(&v, h);
            }
            Integrator::Rk4 => self.rk4(t, h, dp),
            Integrator::DormandPrince => return adaptive.integrate(self, t, h, dp, true),
        }
        self.restore_kinematic_velocities(&start);
        self.refresh();
        Ok(h)
    }

    fn rk4(&mut self, t: f64, h: f64, dp: &mut [f64]) {
        let n = dp.len();
        let start = self.x.to_vec();
        let (mut v, mut f) = (vec![vec![0.0; n]; 4], vec![vec![0.0; n]; 4]);
        self.stage(t, &mut v[0], &mut f[0]);
        let kinematic = v[0].clone();
        // stages 2 and 3 start from x0 with half a step
        self.kick(&f[0], 0.5 * h);
        self.integrate_positions(&v[0], 0.5 * h);
        let second = self.x.to_vec();
        self.stage(t + 0.5 * h, &mut v[1], &mut f[1]);
        self.keep_kinematic_velocities(&kinematic, &mut v[1]);
        self.x.copy_from_slice(&start);
        self.kick(&f[1], 0.5 * h);
        self.integrate_positions(&v[1], 0.5 * h);
        self.stage(t + 0.5 * h, &mut v[2], &mut f[2]);
        self.keep_kinematic_velocities(&kinematic, &mut v[2]);
        // stage 4: positions from stage 2 by v3 − v1/2, momenta p0 + h·f3
        self.x.copy_from_slice(&second);
        self.kick(&combine(&f, [-0.5, 0.0, 1.0, 0.0]), h);
        self.integrate_positions(&combine(&v, [-0.5, 0.0, 1.0, 0.0]), h);
        self.stage(t + h, &mut v[3], &mut f[3]);
        self.keep_kinematic_velocities(&kinematic, &mut v[3]);
        // the whole step
        self.x.copy_from_slice(&start);
        let sixth = 1.0 / 6.0;
        dp.copy_from_slice(&combine(&f, [sixth, 2.0 * sixth, 2.0 * sixth, sixth]));
        self.kick(dp, h);
        self.integrate_positions(&combine(&v, [3.0 / 12.0, 2.0 / 12.0, 2.0 / 12.0, -1.0 / 12.0]), h);
        self.integrate_positions(&combine(&v, [-1.0 / 12.0, 2.0 / 12.0, 2.0 / 12.0, 3.0 / 12.0]), h);
    }

    fn stage(&mut self, t: f64, v: &mut [f64], f: &mut [f64]) {
        self.evaluate(t, f);
        self.velocities(v);
    }

    /// Resets the velocities of kinematic objects to those at the start of the step.
    fn keep_kinematic_velocities(&self, kinematic: &[f64], v: &mut [f64]) {
        for entry in self.table.with(self.states).iter().filter(|e| e.status.mode == Mode::Kinematic) {
            v[entry.state_range.v.clone()].copy_from_slice(&kinematic[entry.state_range.v.clone()]);
        }
    }

    /// Writes the initial velocity back to kinematic objects, which the stages may have changed.
    fn restore_kinematic_velocities(&mut self, start: &[f64]) {
        for entry in
            self.table.with(self.states).iter().filter(|e| e.status.enabled && e.status.mode == Mode::Kinematic)
        {
            let Some(body) = entry.object.integratable() else { continue };
            let mut v = vec![0.0; entry.state_range.v.len()];
            body.velocity(&start[entry.state_range.x.clone()], &mut v);
            body.write_velocity(&mut self.x[entry.state_range.x.clone()], &v);
        }
    }
}

/// Writes part states and caches from a state. Static and disabled objects are at rest, whatever
/// momentum they store.
pub(crate) fn refresh_all(threads: &Threads, objects: Objects, x: &[f64], derived: &mut Derived) {
    let Derived { part_states, caches } = derived;
    let numbers = Numbers { caches, part_states, ..Numbers::default() };
    each_object(threads, objects, numbers, |entry, own| refresh(entry, own.cache, x, own.part_states));
}

/// Writes the cache and the part states of one object.
fn refresh(entry: &Entry, cache: &mut Cache, x: &[f64], part_states: &mut [PartState]) {
    entry.object.refresh(&x[entry.state_range.x.clone()], cache, part_states);
    if entry.status.mode == Mode::Static || !entry.status.enabled {
        part_states.iter_mut().for_each(|s| *s = PartState { pose: s.pose, ..PartState::default() });
    }
}

/// Moves one object over `h`: freely if dynamic, with its given velocity if kinematic, not at all
/// if static.
pub(crate) fn free_motion(entry: &Entry, cache: &mut Cache, x: &mut [f64], h: f64) {
    let Some(body) = entry.object.integratable().filter(|_| entry.status.enabled && !entry.asleep) else { return };
    match entry.status.mode {
        Mode::Static => {}
        Mode::Dynamic => body.free_motion(cache, x, h),
        Mode::Kinematic => {
            let mut v = vec![0.0; entry.state_range.v.len()];
            body.velocity(x, &mut v);
            body.integrate_positions(x, &v, h);
            body.write_velocity(x, &v);
        }
    }
}

fn combine(k: &[Vec<f64>], weight: [f64; 4]) -> Vec<f64> {
    (0..k[0].len()).map(|i| (0..4).map(|s| weight[s] * k[s][i]).sum()).collect()
}
