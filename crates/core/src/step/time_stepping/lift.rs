//! The potential energy of lifts: the correction of overlap raises bodies that contacts hold, and this is taken
//! from their kinetic energy, as far as the step has made energy.
//!
//! For every group of objects that contacts with a force, corrected contacts and constraints connect:
//!
//! ```text
//! lift  = −f·Δ                                                 f: forces,  Δ: displacement by the correction
//! made  = ½|u_1|² − ½|u_0|² − f·(h·v̄ + Δ) − Σ λ·½(w_0 + w_1)       the sum over the rows of constraints
//! u_1 ← s·u_1,    ½(1 − s²)·|u_1|² = min(lift, made) if both are positive
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `u_0`, `u_1` | whitened velocities at the start and the end of the step, of the rows' time |
//! | `v̄` | mean velocity of the step |
//! | `w` | velocities of rows |
//!
//! Only groups that something strikes, or in which a contact is not kept, pay. Elsewhere the energy of a step
//! differs from that of the motion by its order, either way: to take each surplus would damp what rolls.
//!
//! All velocities of a group get one factor, so those of its rows that are zero stay so. A group that
//! kinematic bodies, moving surfaces or motors may drive gives nothing: they add energy.

use crate::constraint::rows::{Block, Rows};
use crate::step::Workspace;
use crate::step::contacts::push;
use crate::world::Coordinates;

/// Energy below this fraction of a group's kinetic energy and of its work is rounding.
const ROUNDING: f64 = 1e-13;

/// A step without the correction of overlap, in whitened coordinates.
pub(super) struct Step<'a> {
    /// Velocities at the start and at the end.
    pub u: [&'a [f64]; 2],
    /// Change of velocity by forces.
    pub du_force: &'a [f64],
    /// Mean velocity.
    pub mean: &'a [f64],
    /// Displacement by the correction, per second.
    pub moved: &'a [f64],
    /// Multipliers of impacts and of the solve.
    pub lambda: &'a [f64],
    /// Multipliers of the impacts alone.
    pub impact: &'a [f64],
    /// Whether each block was solved.
    pub keep: &'a [bool],
}

/// Iterates over the coordinates of both sides of a block.
pub(super) fn coordinates(block: &Block) -> impl Iterator<Item = usize> + '_ {
    block.sides().iter().flat_map(|side| side.u as usize..(side.u + side.dof) as usize)
}

/// Returns the coordinates of all sides of some blocks, ascending.
pub(super) fn coordinates_of(rows: &Rows, blocks: &[u32]) -> Vec<usize> {
    let sides = blocks.iter().flat_map(|&b| rows.blocks[b as usize].sides());
    let mut ranges: Vec<(u32, u32)> = sides.map(|side| (side.u, side.dof)).collect();
    ranges.sort_unstable();
    ranges.dedup();
    ranges.iter().flat_map(|&(u, dof)| u as usize..(u + dof) as usize).collect()
}

/// Takes the potential energy of lifts from the kinetic energy of the groups.
pub(super) fn pay_for_lift(at: Coordinates, work: &mut Workspace, step: &Step) {
    let strikes = step.impact.iter().any(|impulse| *impulse != 0.0) || step.keep.iter().any(|keep| !keep);
    if !strikes || step.moved.iter().all(|du| *du == 0.0) {
        return;
    }
    let contacts = work.contact_constraints.len();
    let Workspace { rows, islands, bias, targets, .. } = work;
    let mut du = vec![0.0; step.moved.len()];
    let strikes =
        |&b: &u32| !step.keep[b as usize] || rows.blocks[b as usize].range().any(|row| step.impact[row] != 0.0);
    if !(0..rows.blocks.len() as u32).any(|b| strikes(&b)) {
        return push(at, &du, &mut Vec::new());
    }
    let acts = |b: usize| {
        let block = &rows.blocks[b];
        b >= contacts
            || !step.keep[b]
            || block.range().any(|row| step.lambda[row] != 0.0)
            || coordinates(block).any(|i| step.moved[i] != 0.0)
    };
    islands.build(rows, acts);
    for blocks in islands.iter() {
        let places = coordinates_of(rows, blocks);
        let sum = |of: &dyn Fn(usize) -> f64| places.iter().map(|&i| of(i)).sum::<f64>();
        let lift = -sum(&|i| step.du_force[i] * step.moved[i]);
        if lift <= 0.0 || !blocks.iter().any(strikes) {
            continue;
        }
        let driven = |&b: &u32| {
            let target = (b as usize).checked_sub(contacts).map_or(0.0, |i| targets[i].velocity);
            target != 0.0 || rows.blocks[b as usize].range().any(|row| bias[row] != 0.0)
        };
        if blocks.iter().any(driven) {
            continue;
        }
        let [before, kinetic] = step.u.map(|u| sum(&|i| 0.5 * u[i] * u[i]));
        let force = sum(&|i| step.du_force[i] * (step.mean[i] + step.moved[i]));
        let joints: f64 = blocks
            .iter()
            .filter(|&&b| b as usize >= contacts)
            .map(|&b| {
                let block = &rows.blocks[b as usize];
                let velocity = |u: &[f64]| rows.row_velocity(block, 0, u);
                step.lambda[block.row as usize] * 0.5 * (velocity(step.u[0]) + velocity(step.u[1]))
            })
            .sum();
        let made = kinetic - before - force - joints;
        let paid = lift.min(made);
        if paid > ROUNDING * (kinetic + before + force.abs()) {
            let scale = (1.0 - paid / kinetic).max(0.0).sqrt() - 1.0;
            places.iter().for_each(|&i| du[i] = scale * step.u[1][i]);
        }
    }
    push(at, &du, &mut Vec::new());
}
