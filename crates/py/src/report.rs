//! What the last frame took and how well it went.

use pyo3::prelude::*;
use tumble::dynamics::{StepReport as Core, World};

/// What one frame took and how well it went; see ``World.report``.
#[pyclass(frozen, get_all, module = "tumble")]
pub struct StepReport {
    /// Committed sub-steps.
    substeps: u32,
    /// ``backtracking``: integrations tried, committed ones included.
    tries: u32,
    /// ``backtracking`` with ``dormand_prince``: inner steps, refused ones included.
    inner_steps: u32,
    /// ``backtracking``: sub-steps at the floor, where a crossing was accepted and projected out.
    floor_hits: u32,
    /// Contacts at the last sub-step.
    contacts: u32,
    /// Passes of the impact phase.
    impact_passes: u32,
    /// Largest residual of any solve, m/s.
    residual: f64,
    /// Solves that did not reach the solver's own aim.
    unconverged: u32,
    /// Solves that ended on a secondary ray.
    rays: u32,
    /// Iterations of the largest solve.
    iterations: u32,
    /// Objects asleep at its end.
    asleep: u32,
    /// Deepest penetration found, metres.
    max_penetration: f64,
    /// Name of the joint that was furthest open where it cannot be closed; None where all could.
    out_of_reach: Option<String>,
    /// How far that joint is open, metres.
    out_of_reach_distance: f64,
}

impl StepReport {
    /// The report of a world's last frame.
    pub fn of(world: &World) -> StepReport {
        let Core {
            substeps,
            tries,
            inner_steps,
            floor_hits,
            contacts,
            impact_passes,
            residual,
            unconverged,
            rays,
            iterations,
            max_penetration,
            unreachable_joint: out_of_reach,
            asleep,
        } = *world.report();
        let name = out_of_reach.and_then(|o| Some(world.object(o.loop_joint)?.name().to_string()));
        StepReport {
            substeps,
            tries,
            inner_steps,
            floor_hits,
            contacts,
            impact_passes,
            residual,
            unconverged,
            rays,
            iterations,
            max_penetration,
            asleep,
            out_of_reach: name,
            out_of_reach_distance: out_of_reach.map_or(0.0, |o| o.distance),
        }
    }
}

#[pymethods]
impl StepReport {
    fn __repr__(&self) -> String {
        format!(
            "<tumble.StepReport contacts={} residual={:.1e} m/s unconverged={} max_penetration={:.1e} m>",
            self.contacts, self.residual, self.unconverged, self.max_penetration
        )
    }
}
