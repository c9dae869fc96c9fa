//! Extrapolation of sub-steps of `backtracking` in which contacts move.
//!
//! The force of a contact is constant over a sub-step, with the point and the normal of its middle: an error of second
//! order. Where contacts turn, a sub-step `Φ_h` is taken a second time in two halves, and both results are combined
//! (Richardson). Their difference measures the error of the whole step, contact included:
//!
//! ```text
//! x_1 = x_B + ⅓·(x_B − x_A)          x_A = Φ_h(x_0),  x_B = Φ_{h/2}(Φ_{h/2}(x_0))
//! error = largest ⅓·|x_B − x_A| of a coordinate                m, rad;  momenta by mass and inertia, m/s, rad/s
//! ```
//!
//! With `dormand_prince` a sub-step whose error is above [`SAFETY`] integrator tolerances is halved. The other integrators have no
//! tolerance, and are of lower order by themselves. A sub-step that ends with an event in its second run, or in which
//! other contacts have a force in the second half, is not combined: then its halves stand.
//!
//! Heaps are left out with integrators other than `dormand_prince` ([`MOST_CONTACTS`]).
//! Worlds in which other objects than rigid bodies move are left out: their coordinates are not known to be a linear space.

use super::Workspace;
use super::event_location::Role;
use crate::contact::detect::ContactConstraint;
use crate::contact::motion;
use crate::object::part_state::PartState;
use crate::report::StepReport;
use crate::rigid::RigidBody;
use crate::sensor::loads::FrameLoads;
use crate::settings::Integrator;
use crate::world::events::Touches;
use crate::world::{Core, WorldState};
use tumble_collide::Vec3;

/// Angle by which a contact turns in a sub-step that is extrapolated, rad: with `dormand_prince`, and with other integrators.
const TURN: (f64, f64) = (1e-6, 2e-3);
/// Largest number of touching contacts with other integrators: in a heap most second runs end with an event, and are in vain.
const MOST_CONTACTS: usize = 8;
/// Largest error of a sub-step with `dormand_prince`, in integrator tolerances.
pub(super) const SAFETY: f64 = 10.0;

/// The values that a sub-step changes, before it.
pub(super) struct Before {
    state: WorldState,
    report: StepReport,
    touches: Touches,
    loads: FrameLoads,
}

impl Before {
    pub fn of(core: &Core) -> Before {
        Before {
            state: core.state.clone(),
            report: core.report,
            touches: core.touches.clone(),
            loads: core.loads.clone(),
        }
    }

    /// Goes back to it, and keeps the number of tries.
    pub fn restore(&self, core: &mut Core) {
        let tries = core.report.tries;
        core.state.clone_from(&self.state);
        core.report = StepReport { tries, ..self.report };
        core.touches.clone_from(&self.touches);
        core.loads.clone_from(&self.loads);
        core.clear_contact_forces();
        core.integration().refresh();
    }
}

/// Returns whether the contacts that touch turn so far in `h` seconds that the sub-step is extrapolated.
pub(super) fn is_needed(core: &Core, work: &Workspace, roles: &[Role], h: f64) -> bool {
    let exact = core.settings.integrator == Integrator::DormandPrince;
    let least = if exact { TURN.0 } else { TURN.1 };
    let turns = |(constraint, _): (&ContactConstraint, &Role)| h * turning(core, constraint) > least;
    let touching = || work.contact_constraints.iter().zip(roles).filter(|(_, role)| role.touching);
    let heap = !exact && touching().count() > MOST_CONTACTS;
    if core.settings.solver_settings.budget.is_some() || heap || !touching().any(turns) {
        return false;
    }
    core.objects().iter().filter(|e| e.moves()).all(|e| {
        let any: &dyn std::any::Any = e.object;
        e.object.integratable().is_none() || any.downcast_ref::<RigidBody>().is_some()
    }) && !core.has_breakable_joints()
}

/// Returns the rate at which a contact turns, rad/s: its normal, or its lever arm on a body.
fn turning(core: &Core, constraint: &ContactConstraint) -> f64 {
    let parts = [constraint.a, constraint.b];
    let states = parts.map(|part| &core.derived.part_states[part as usize]);
    let motion = motion::of(core, constraint);
    let arm = |part: u32, state: &PartState| {
        let entry = core.objects().at(core.owners[part as usize].place as usize);
        let center = entry.center_from_origin(state);
        let arm: Vec3 = constraint.contact.point - state.position() - center;
        if entry.moves() {
            let velocity = state.velocity + state.angular_velocity.cross(&center);
            (motion.point_rate - velocity).norm() / arm.norm().max(f64::MIN_POSITIVE)
        } else {
            0.0
        }
    };
    motion.normal_rate.norm().max(arm(parts[0], states[0])).max(arm(parts[1], states[1]))
}

/// Combines the state after a sub-step, `coarse`, with the present one, which is that after its halves. Returns the error.
pub(super) fn combine(core: &mut Core, coarse: &[f64]) -> f64 {
    let objects = core.table.with(&core.state.objects);
    let (mut error, mut combined) = (0.0f64, Vec::new());
    for entry in objects.iter().filter(|e| e.moves()) {
        let any: &dyn std::any::Any = entry.object;
        let Some(body) = any.downcast_ref::<RigidBody>() else { continue };
        let range = entry.state_range.x.clone();
        let (before, fine) = (&coarse[range.clone()], &core.state.x[range.clone()]);
        let mut x: Vec<f64> = fine.iter().zip(before).map(|(b, a)| b + (b - a) / 3.0).collect();
        let size = x[3..7].iter().map(|q| q * q).sum::<f64>().sqrt();
        x[3..7].iter_mut().for_each(|q| *q /= size);
        let least_inertia = body.inertia().symmetric_eigenvalues().min();
        for (i, (x, fine)) in x.iter().zip(fine).enumerate() {
            let unit = match i {
                0..3 => 1.0,
                3..7 => 0.5,
                7..10 => body.mass(),
                _ => least_inertia,
            };
            error = error.max((x - fine).abs() / unit);
        }
        combined.push((range, x));
    }
    for (range, x) in combined {
        core.state.x[range].copy_from_slice(&x);
    }
    core.integration().refresh();
    error
}
