//! Smooth motion: forces at a stage, and the integrators that use them (thesis §IV.B.2).
//!
//! | integrator | one step of `h` |
//! |---|---|
//! | explicit Euler | `x += h·v(x,p)`, `p += h·f(x,p,t)` |
//! | symplectic Euler | `p += h·f(x,p,t)`, `x += h·v(x,p)` |
//! | Verlet | `x` coasts `h/2`, `p += h·f(x,p,t+h/2)`, `x` coasts `h/2` |
//! | Dormand–Prince | fifth order, by inner steps that a tolerance chooses: [`crate::integrators`] |
//! | RK4 | classical on `p`; on `x` the commutator-free method of Celledoni, Marthinsen and Owren (2003), two exponentials in the last stage |

use crate::integrators::Adaptive;
use crate::settings::Integrator;
use crate::site::{Forces, Site, Wrench};
use crate::view::{Entry, Mode, ObjectId, Table, WorldView};
use crate::world::StepError;
use tumble_collide::Vec3;

/// What the integrators work on, borrowed from the world.
pub(crate) struct Motion<'a> {
    pub table: &'a mut Table,
    pub x: &'a mut [f64],
    pub sites: &'a mut [Site],
    pub forces: &'a mut Forces,
    pub gravity: Vec3,
    /// See [`WorldView::implicit`].
    pub implicit: bool,
    /// Forces set by the user, per site.
    pub applied: &'a [Wrench],
    /// Generalized forces set by the user, per coordinate.
    pub applied_generalized: &'a [f64],
    /// Generalized contact forces that hold over the sub-step.
    pub held: &'a [f64],
    /// Contact forces that hold over the sub-step on links, per site; empty for none.
    pub held_wrenches: &'a [Wrench],
    /// See [`Core::pin`](crate::world::Core).
    pub pinned: &'a [f64],
    pub pinned_sites: &'a mut [Site],
}

impl Motion<'_> {
    /// Writes sites and caches from the state. What is static or not alive is at rest, whatever momentum it keeps.
    pub fn refresh(&mut self) {
        let (x, sites) = (&self.x[..], &mut *self.sites);
        let (pinned, pinned_sites) = (self.pinned, &mut *self.pinned_sites);
        self.table.for_each_mut(|e| {
            refresh(e, x, sites);
            if !pinned.is_empty() && e.moves() {
                refresh(e, pinned, pinned_sites);
            }
        });
    }

    /// The same for one object.
    pub fn refresh_one(&mut self, id: ObjectId) {
        if let Some(entry) = self.table.slots.get_mut(id) {
            refresh(entry, self.x, self.sites);
        }
    }

    /// Forces at the present state and time `t`: rate of momentum of every object into `dp`, accelerations into the sites.
    pub fn evaluate(&mut self, t: f64, dp: &mut [f64]) {
        self.refresh();
        self.forces.wrenches.clear();
        self.forces.wrenches.extend_from_slice(self.applied);
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
            sites: self.sites,
            table: self.table,
        };
        for entry in self.table.iter().filter(|e| e.status.alive) {
            if let Some(body) = entry.object.integratable().filter(|_| entry.moves()) {
                body.accumulate_forces(&entry.span, &view, self.forces);
            }
            if let Some(force) = entry.object.force() {
                force.apply(&entry.span, &view, self.forces);
            }
        }
        dp.fill(0.0);
        for entry in self.table.iter() {
            let Some(body) = entry.object.integratable() else { continue };
            let (span, sites) = (&entry.span, &mut self.sites[entry.span.site.clone()]);
            if entry.moves() {
                let dp = &mut dp[span.v.clone()];
                body.derivative(&self.x[span.x.clone()], &self.forces.slice(span), dp);
                body.accelerations(&self.x[span.x.clone()], dp, sites);
            } else {
                // what is led keeps its generalized velocity: a link that turns about another still has its centripetal acceleration
                sites.iter_mut().for_each(|s| {
                    (s.acceleration, s.angular_acceleration) = (s.bias_acceleration, s.bias_angular_acceleration)
                });
            }
        }
    }

    /// Every object that moves goes on freely for `h`; what is led follows its velocity.
    pub fn coast(&mut self, h: f64) {
        for entry in self.table.iter() {
            coast(entry, &mut self.x[entry.span.x.clone()], h);
        }
    }

    /// Leaves of the rates what the coasts of a splitting do not do by themselves.
    pub fn take_off_coasting(&self, dp: &mut [f64]) {
        let mut coasting = Vec::new();
        for entry in self.table.iter().filter(|e| e.moves()) {
            let Some(body) = entry.object.integratable().filter(|b| b.holds_velocity()) else { continue };
            coasting.resize(entry.span.v.len(), 0.0);
            body.coasting_rate(&self.x[entry.span.x.clone()], &mut coasting);
            dp[entry.span.v.clone()].iter_mut().zip(&coasting).for_each(|(dp, c)| *dp -= c);
        }
    }

    fn kick(&mut self, dp: &[f64], h: f64) {
        for entry in self.table.iter().filter(|e| e.moves()) {
            if let Some(body) = entry.object.integratable() {
                body.kick(&mut self.x[entry.span.x.clone()], &dp[entry.span.v.clone()], h);
            }
        }
    }

    /// Generalized velocities of everything that moves or is led; zero elsewhere.
    pub fn velocities(&self, v: &mut [f64]) {
        v.fill(0.0);
        for entry in self.table.iter().filter(|e| e.status.alive && e.status.mode != Mode::Static) {
            if let Some(body) = entry.object.integratable() {
                body.velocity(&self.x[entry.span.x.clone()], &mut v[entry.span.v.clone()]);
            }
        }
    }

    fn drift(&mut self, v: &[f64], h: f64) {
        for entry in self.table.iter().filter(|e| e.status.alive && e.status.mode != Mode::Static && !e.asleep) {
            let (x, v) = (&mut self.x[entry.span.x.clone()], &v[entry.span.v.clone()]);
            if let Some(body) = entry.object.integratable() {
                body.drift(x, v, h);
            }
        }
    }

    /// Integrates over `h` from time `t`: one step, or as many inner steps of `adaptive` as its tolerance asks for, which it records. Returns how far
    /// it came, s: `h`, but for a record that is full. Sites and caches are left at the new state.
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
                self.coast(0.5 * h);
                self.evaluate(t + 0.5 * h, dp);
                self.take_off_coasting(dp);
                self.kick(dp, h);
                self.coast(0.5 * h);
            }
            Integrator::SymplecticEuler => {
                self.evaluate(t, dp);
                self.kick(dp, h);
                let mut v = vec![0.0; dp.len()];
                self.velocities(&mut v);
                self.drift(&v, h);
            }
            Integrator::ExplicitEuler => {
                self.evaluate(t, dp);
                let mut v = vec![0.0; dp.len()];
                self.velocities(&mut v);
                self.kick(dp, h);
                self.drift(&v, h);
            }
            Integrator::Rk4 => self.rk4(t, h, dp),
            Integrator::DormandPrince => return adaptive.integrate(self, t, h, dp, true),
        }
        self.restore_led_velocities(&start);
        self.refresh();
        Ok(h)
    }

    fn rk4(&mut self, t: f64, h: f64, dp: &mut [f64]) {
        let n = dp.len();
        let start = self.x.to_vec();
        let (mut v, mut f) = (vec![vec![0.0; n]; 4], vec![vec![0.0; n]; 4]);
        self.stage(t, &mut v[0], &mut f[0]);
        let led = v[0].clone();
        // stages 2 and 3 start from x0 with half a step
        self.kick(&f[0], 0.5 * h);
        self.drift(&v[0], 0.5 * h);
        let second = self.x.to_vec();
        self.stage(t + 0.5 * h, &mut v[1], &mut f[1]);
        self.keep_led(&led, &mut v[1]);
        self.x.copy_from_slice(&start);
        self.kick(&f[1], 0.5 * h);
        self.drift(&v[1], 0.5 * h);
        self.stage(t + 0.5 * h, &mut v[2], &mut f[2]);
        self.keep_led(&led, &mut v[2]);
        // stage 4: positions from stage 2 by v3 − v1/2, momenta p0 + h·f3
        self.x.copy_from_slice(&second);
        self.kick(&combine(&f, [-0.5, 0.0, 1.0, 0.0]), h);
        self.drift(&combine(&v, [-0.5, 0.0, 1.0, 0.0]), h);
        self.stage(t + h, &mut v[3], &mut f[3]);
        self.keep_led(&led, &mut v[3]);
        // the step
        self.x.copy_from_slice(&start);
        let sixth = 1.0 / 6.0;
        dp.copy_from_slice(&combine(&f, [sixth, 2.0 * sixth, 2.0 * sixth, sixth]));
        self.kick(dp, h);
        self.drift(&combine(&v, [3.0 / 12.0, 2.0 / 12.0, 2.0 / 12.0, -1.0 / 12.0]), h);
        self.drift(&combine(&v, [-1.0 / 12.0, 2.0 / 12.0, 2.0 / 12.0, 3.0 / 12.0]), h);
    }

    fn stage(&mut self, t: f64, v: &mut [f64], f: &mut [f64]) {
        self.evaluate(t, f);
        self.velocities(v);
    }

    /// What is led has one velocity over the whole step.
    fn keep_led(&self, led: &[f64], v: &mut [f64]) {
        for entry in self.table.iter().filter(|e| e.status.mode == Mode::Kinematic) {
            v[entry.span.v.clone()].copy_from_slice(&led[entry.span.v.clone()]);
        }
    }

    /// What is led keeps the velocity it started with, whatever the stages made of it.
    fn restore_led_velocities(&mut self, start: &[f64]) {
        for entry in self.table.iter().filter(|e| e.status.alive && e.status.mode == Mode::Kinematic) {
            let Some(body) = entry.object.integratable() else { continue };
            let mut v = vec![0.0; entry.span.v.len()];
            body.velocity(&start[entry.span.x.clone()], &mut v);
            body.write_velocity(&mut self.x[entry.span.x.clone()], &v);
        }
    }
}

fn refresh(entry: &mut Entry, x: &[f64], sites: &mut [Site]) {
    let sites = &mut sites[entry.span.site.clone()];
    entry.object.refresh(&x[entry.span.x.clone()], sites);
    if entry.status.mode == Mode::Static || !entry.status.alive {
        sites.iter_mut().for_each(|s| *s = Site { pose: s.pose, ..Site::default() });
    }
}

/// One object goes on for `h`: freely where it moves, with its given velocity where it is led, not at all where it is static.
pub(crate) fn coast(entry: &Entry, x: &mut [f64], h: f64) {
    let Some(body) = entry.object.integratable().filter(|_| entry.status.alive && !entry.asleep) else { return };
    match entry.status.mode {
        Mode::Static => {}
        Mode::Dynamic => body.coast(x, h),
        Mode::Kinematic => {
            let mut v = vec![0.0; entry.span.v.len()];
            body.velocity(x, &mut v);
            body.drift(x, &v, h);
            body.write_velocity(x, &v);
        }
    }
}

fn combine(k: &[Vec<f64>], weight: [f64; 4]) -> Vec<f64> {
    (0..k[0].len()).map(|i| (0..4).map(|s| weight[s] * k[s][i]).sum()).collect()
}
