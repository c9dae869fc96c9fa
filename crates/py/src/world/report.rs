//! Statistics of the last step.

use crate::errors::Result;
use crate::world::pickling::pickled;
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use pyo3::types::PyBytes;
use serde::{Deserialize, Serialize};
use tumble::dynamics::archive::open;
use tumble::dynamics::{StepReport as Core, World};

/// The first bytes of a pickle. The number is raised with every change of the fields.
const PICKLED: &[u8; 8] = b"tumbleR1";

/// Statistics of one step; see ``World.report``.
#[pyclass(frozen, get_all, module = "tumble")]
#[derive(Serialize, Deserialize)]
pub struct StepReport {
    /// Committed sub-steps.
    substeps: u32,
    /// ``backtracking``: integrations, including those that were rolled back.
    tries: u32,
    /// ``backtracking`` with ``dormand_prince``: inner steps, including rejected ones.
    inner_steps: u32,
    /// ``backtracking``: sub-steps of minimal length, which accept a crossing and project it out.
    floor_hits: u32,
    /// Contacts of the last sub-step.
    contacts: u32,
    /// Passes of the impact phase.
    impact_passes: u32,
    /// Largest residual of any solve, m/s.
    residual: f64,
    /// Solves that did not reach the solver's tolerance.
    unconverged: u32,
    /// Names of the objects, one or two, on which the row with the largest residual acts; empty if
    /// nothing was solved, or without any error.
    worst_objects: Vec<String>,
    /// Objects of the island of that row (``World.islands`` lists them).
    worst_island_objects: u32,
    /// Rows of that island.
    worst_island_rows: u32,
    /// Largest residual with which that solve counts as converged, m/s.
    worst_tolerance: f64,
    /// Whether that solve reached its tolerance.
    worst_converged: bool,
    /// Solves that ended on a secondary ray.
    rays: u32,
    /// Iterations of the largest solve.
    iterations: u32,
    /// Work of all solves in block relaxations, which ``World.budget`` bounds.
    relaxations: u64,
    /// Objects asleep at the end of the step.
    asleep: u32,
    /// Deepest penetration found, meters.
    max_penetration: f64,
    /// Largest angle by which the forces of joints turn a part back and forth in a sub-step, rad
    /// (``World.max_turn``).
    max_turn: f64,
    /// Name of the loop joint with the largest gap among those that cannot be closed; None if all
    /// can be.
    unreachable_joint: Option<String>,
    /// Gap of that joint, meters.
    unreachable_distance: f64,
}

impl StepReport {
    /// Returns the report of a world's last step.
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
            worst_solve: worst,
            rays,
            iterations,
            relaxations,
            max_penetration,
            max_turn,
            unreachable_joint: out_of_reach,
            asleep,
            ..
        } = *world.report();
        let name = out_of_reach.and_then(|o| Some(world.name(o.loop_joint)?.to_string()));
        let objects = worst.iter().flat_map(|w| [Some(w.object), w.other]).flatten();
        StepReport {
            worst_objects: objects.filter_map(|id| world.name(id).map(str::to_string)).collect(),
            worst_island_objects: worst.map_or(0, |w| w.objects),
            worst_island_rows: worst.map_or(0, |w| w.rows),
            worst_tolerance: worst.map_or(0.0, |w| w.tolerance),
            worst_converged: worst.is_none_or(|w| w.converged),
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
            relaxations,
            max_penetration,
            max_turn,
            asleep,
            unreachable_joint: name,
            unreachable_distance: out_of_reach.map_or(0.0, |o| o.distance),
        }
    }
}

#[pymethods]
impl StepReport {
    fn __reduce__<'py>(&self, py: Python<'py>) -> Result<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        pickled(py, "_unpickle_step_report", PICKLED, self)
    }

    fn __repr__(&self) -> String {
        format!(
            "<tumble.StepReport contacts={} residual={:.1e} m/s unconverged={} max_penetration={:.1e} m>",
            self.contacts, self.residual, self.unconverged, self.max_penetration
        )
    }
}

/// Returns the report of a pickle.
#[pyfunction]
pub fn _unpickle_step_report(data: PyBackedBytes) -> Result<StepReport> {
    Ok(open(PICKLED, &data)?)
}
