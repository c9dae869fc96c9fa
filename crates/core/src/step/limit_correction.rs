//! Limits that push are held: their gap and its rate are closed at the end of the sub-step.
//!
//! A limit's force is that of the start of the sub-step and holds over it. What it should have been changes as the rest moves, so at the end the
//! gap is off by `⅙·ȧ·h³` and its rate by `½·ȧ·h²`. Left alone this lets the limit go and strikes it anew, over and over. So what pushed is
//! brought back onto its stop, with the joints where they are:
//!
//! ```text
//! x += M⁻¹Jᵀμ,  K·μ = −gap        v += M⁻¹Jᵀν,  K·ν = −J·v            rows J of the limits that pushed, and of joints with 0 instead of −gap, −J·v
//! ```
//!
//! The projection of `time_stepping` ends after so many sweeps, contacts and limits together; a limit that it leaves passed is put back in the same way,
//! with its rate left to the next step.
//!
//! A limit that would have let go within the sub-step is held to its end. Where contacts push in the same island velocities are left to them.

use super::Workspace;
use super::contacts::{lay_rows, limits, locate_limits, push, row_velocities, shift, whiten, zero};
use super::joint_correction::is_joint;
use crate::constraint::rows::RowSet;
use crate::object::Level;
use crate::solver::{GaussSeidel, RowSolver, SolverSettings};
use crate::world::{Core, StepError};

/// A limit that pushes.
#[derive(Clone, Copy, Debug)]
pub(super) struct ActiveLimit {
    pub key: [u32; 2],
    /// Whether a contact pushes in its island.
    pub with_contacts: bool,
}

/// The limits that pushed in the solve that was just made in `work`; sorted by key.
pub(super) fn pushing(work: &Workspace) -> Vec<ActiveLimit> {
    let contact_constraints = work.contact_constraints.len();
    let force = |b: usize| work.lambda[work.rows.blocks[b].row as usize];
    let mut held = Vec::new();
    for blocks in work.islands.iter() {
        let with_contacts = blocks.iter().any(|&b| (b as usize) < contact_constraints && force(b as usize) != 0.0);
        for limit in &work.limits {
            let block = limit.target.map(|t| t + contact_constraints as u32);
            if block.is_some_and(|b| blocks.contains(&b) && force(b as usize) > 0.0) {
                held.push(ActiveLimit { key: limit.key, with_contacts });
            }
        }
    }
    held.sort_by_key(|h| h.key);
    held
}

/// The limits that are passed at the present state, `h` seconds after the present time: their place alone is to be put right.
pub(super) fn passed(core: &mut Core, probe: &mut Workspace, h: f64) -> Result<Vec<ActiveLimit>, StepError> {
    let time = core.state.time + h;
    limits(&core.view(time), &mut probe.limits)?;
    let least = core.settings.contact_tolerance;
    Ok(probe
        .limits
        .iter()
        .filter(|l| l.gap < -least)
        .map(|l| ActiveLimit { key: l.key, with_contacts: true })
        .collect())
}

/// Closes the limits `held` at the present state, `h` seconds after the present time; those that are off by more than `reach` are left alone: they have
/// let go, or are to come back at a bounded speed. Part states and caches are those of the present afterwards.
pub(super) fn hold(
    core: &mut Core,
    probe: &mut Workspace,
    held: &[ActiveLimit],
    h: f64,
    reach: f64,
) -> Result<(), StepError> {
    if held.is_empty() {
        return Ok(());
    }
    core.integration().refresh();
    let time = core.state.time + h;
    lay_rows(core.basis(None, time, None), probe, Level::Acceleration)?;
    locate_limits(core, probe, time)?;
    let rest = vec![0.0; core.dof];
    whiten(core.coordinates(None), &rest, 0.0, &mut probe.u, &mut probe.du_force);
    row_velocities(&probe.rows, &probe.bias, &probe.u, &mut probe.c);
    let (mut place, mut speed) = (vec![0.0; probe.rows.len], vec![0.0; probe.rows.len]);
    let mut chosen = vec![false; probe.targets.len()];
    for limit in &probe.limits {
        let (Some(target), Ok(i)) = (limit.target, held.binary_search_by_key(&limit.key, |h| h.key)) else { continue };
        if limit.gap.abs() > reach {
            continue;
        }
        let block = &mut probe.rows.blocks[target as usize];
        (block.set, chosen[target as usize]) = (RowSet::Equality, true);
        place[block.row as usize] = limit.gap;
        speed[block.row as usize] = if held[i].with_contacts { 0.0 } else { probe.c[block.row as usize] };
    }
    let targets = &probe.targets;
    probe.islands.build(&probe.rows, |b| chosen[b] || is_joint(&targets[b]));
    let s = core.settings;
    let (mut dx, mut dv) = (vec![0.0; core.dof], vec![0.0; core.dof]);
    for blocks in probe.islands.iter().filter(|blocks| blocks.iter().any(|&b| chosen[b as usize])) {
        for (c, tolerance, du) in
            [(&place, 1e-3 * s.contact_tolerance, &mut dx), (&speed, s.solver_settings.tolerance, &mut dv)]
        {
            zero(&mut probe.lambda, probe.rows.len);
            let solver_settings = SolverSettings { max_sweeps: 100, max_relaxations: u32::MAX, tolerance };
            GaussSeidel.solve(&probe.rows, blocks, c, &mut probe.lambda, du, solver_settings);
        }
    }
    shift(core.coordinates(None), &dx, 1.0);
    push(core.coordinates(None), &dv, &mut Vec::new());
    core.integration().refresh();
    Ok(())
}
