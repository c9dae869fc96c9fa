//! Closing: joints (the rigid equality rows of constraints) are exact in place and velocity at the end of a step, and at its middle.
//!
//! ```text
//! middle    x_½ = x₀ coasted h/2, brought onto g(x_½) = g(x₀)              its rows J are those of the step
//! step      x₁, v₁ from impulses Jᵀλ                                       J₁v₁ = 0 by the estimate of J̇v: off by the third order
//! repeat    x₁ += M⁻¹Jᵀμ,  K·μ = −g(x₁)        v₁ += M⁻¹Jᵀν,  K·ν = −J₁v₁      K = J·M⁻¹Jᵀ, by a direct solve
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `g` | errors of the rows; only what the step made of them is closed, what was there before is left to the projection and its bound on speed |
//! | `J₁` | the rows at `x₁` |
//!
//! The repetition is Newton's method with the matrix held (a chord method): a round leaves a part of about the angle that the rows turn in half a
//! step. Where that is too much the rows of the end take over. Rows of the middle look the same from the end backwards, so that the whole
//! step is reversible: energy comes and goes with the swing and is not lost in the joints. That needs a middle *on* the joints. So do redundant
//! joints: two hinges of a door agree about its axis only where both are closed, and rows taken beside that place would hold the door fast.

use super::Workspace;
use super::contacts::{displace, lay_rows, push, row_velocities, whiten, zero};
use crate::object::{Integratable, Level, RowTarget};
use crate::rows::{RowSet, Rows};
use crate::solver::{Accuracy, DIRECT_ROWS, GaussSeidel, RowSolver};
use crate::view::Entry;
use crate::world::{Core, StepError};

/// Rounds at most.
const ROUNDS: usize = 12;
/// Rounds where some joints are too many for a direct solve, so that a long rope costs what its sweeps cost.
const FEW_ROUNDS: usize = 2;
const SWEEPS: u32 = 25;
/// A round that leaves more of the error than this is the last of its kind.
const SLOW: f64 = 0.5;
/// Compliance of rows that are off by a metre, as a share of their own response, and the most that is taken. What is redundant but for an error
/// responds with the square of it, far less, and is left alone; as the error goes so does the compliance (Levenberg and Marquardt).
const SOFT: (f64, f64) = (10.0, 1e-3);

/// Whether a row is held in place.
pub(super) fn is_joint(t: &RowTarget) -> bool {
    t.set == RowSet::Equality && t.compliance == 0.0
}

/// Errors of all constraint rows at the present, and the rows of the middle of the step: free motion of `ahead` seconds brought onto the joints.
/// Their Jacobians are those of the middle, their responses those of the present, as all rows of a step have. Sites and caches are those of the
/// present before and after.
pub(super) fn middle(core: &mut Core, level: Level, ahead: f64) -> Result<(Vec<f64>, Workspace), StepError> {
    let mut rows = Workspace::default();
    lay_rows(core, &mut rows, level, None)?;
    let errors: Vec<f64> = rows.targets.iter().map(|t| t.error).collect();
    let (start, time, pinned) = (core.x.clone(), core.time, core.unpin());
    core.motion().coast(ahead);
    core.motion().refresh();
    core.time += ahead;
    let outcome = onto(core, &mut rows, level, &errors).and_then(|_| lay_rows(core, &mut rows, level, None));
    map_sides(core, &mut rows, |body, y, j| body.recover(y, j)); // Jᵀ = Lᵀ·Y
    core.time = time;
    core.x = start;
    core.pin_again(pinned);
    core.motion().refresh();
    map_sides(core, &mut rows, |body, j, y| body.respond(j, y));
    outcome.map(|_| (errors, rows))
}

/// Replaces what every row holds of every side.
fn map_sides(core: &Core, work: &mut Workspace, map: impl Fn(&dyn Integratable, &[f64], &mut [f64])) {
    let starts: Vec<(usize, &Entry)> = core.table.iter().filter(|e| e.moves()).map(|e| (e.span.v.start, e)).collect();
    let Rows { blocks, y, .. } = &mut work.rows;
    for side in blocks.iter().flat_map(|b| b.sides()) {
        let found = starts.binary_search_by_key(&(side.u as usize), |(start, _)| *start);
        if let Some(body) = found.ok().and_then(|i| starts[i].1.object.integratable()) {
            let held = &mut y[side.y as usize..(side.y + side.dof) as usize];
            let before = held.to_vec();
            map(body, &before, held);
        }
    }
}

/// Moves the present state to where the joints have the errors given.
fn onto(core: &mut Core, probe: &mut Workspace, level: Level, errors: &[f64]) -> Result<(), StepError> {
    let least = 1e-2 * core.settings.contact_tolerance;
    let mut best = (f64::INFINITY, Vec::new());
    for round in 0..ROUNDS {
        lay_rows(core, probe, level, None)?;
        if probe.targets.len() != errors.len() {
            return Ok(());
        }
        let off: Vec<f64> = probe.targets.iter().zip(errors).map(|(t, e)| if is_joint(t) { t.error - e } else { 0.0 }).collect();
        if largest(&off) > best.0 {
            core.x.clone_from(&best.1);
            core.motion().refresh();
            return Ok(());
        }
        best = (largest(&off), core.x.clone());
        islands(probe);
        if best.0 <= least || round >= rounds(probe) {
            return Ok(());
        }
        soften(probe, best.0);
        let mut dx = vec![0.0; core.dof];
        probe.islands.iter().for_each(|blocks| solve(&probe.rows, blocks, &off, &mut dx, 0.1 * least));
        displace(core, &dx, 1.0);
        core.motion().refresh();
    }
    Ok(())
}

/// Closes the joints of `work`, whose rows were built at the state `start`, at the present state, `step.0` seconds later; `step.1` is the level of the
/// rows. `kept` is the error of each constraint row that is to stay. Sites and caches are those of `start` before and after.
pub(super) fn close(core: &mut Core, work: &mut Workspace, start: &[f64], step: (f64, Level), kept: &[f64]) -> Result<(), StepError> {
    if !work.targets.iter().any(is_joint) {
        return Ok(());
    }
    let pushed = pushed(work);
    islands(work);
    let (mut probe, mut chord) = (Workspace::default(), true);
    let mut open = Open::measure(core, work, &mut probe, step, kept, &pushed)?;
    for _ in 0..rounds(work) {
        if open.is_closed() {
            break;
        }
        let before = core.x.clone();
        if chord {
            refresh_at(core, start);
            open.apply(core, work);
        } else {
            soften(&mut probe, largest(&open.place));
            islands(&mut probe);
            open.apply(core, &probe);
        }
        let next = Open::measure(core, work, &mut probe, step, kept, &pushed)?;
        let left = next.left_of(&open);
        if left < 1.0 {
            open = next;
        } else {
            core.x = before;
            if !chord {
                break;
            }
            open = Open::measure(core, work, &mut probe, step, kept, &pushed)?;
        }
        chord &= left < SLOW;
    }
    refresh_at(core, start);
    Ok(())
}

/// How far each constraint row is off at the present state; 0 where that is to stay.
#[derive(Default)]
struct Open {
    place: Vec<f64>,
    speed: Vec<f64>,
    /// What counts as closed: metres (or radians) and metres per second.
    least: (f64, f64),
}

impl Open {
    /// Sites and caches are left at the present, whose rows come in `probe`. Nothing is open where they are not those of `work`.
    fn measure(core: &mut Core, work: &Workspace, probe: &mut Workspace, step: (f64, Level), kept: &[f64], pushed: &[bool]) -> Result<Open, StepError> {
        let pinned = core.unpin();
        let open = Open::measure_here(core, work, probe, step, kept, pushed);
        core.pin_again(pinned);
        open
    }

    fn measure_here(core: &mut Core, work: &Workspace, probe: &mut Workspace, step: (f64, Level), kept: &[f64], pushed: &[bool]) -> Result<Open, StepError> {
        core.motion().refresh();
        let time = core.time;
        core.time += step.0;
        let laid = lay_rows(core, probe, step.1, None);
        core.time = time;
        laid?;
        let mut open = Open { least: (1e-2 * core.settings.contact_tolerance, core.settings.accuracy.tolerance), ..Open::default() };
        if probe.targets.len() != work.targets.len() {
            return Ok(open);
        }
        whiten(core, &vec![0.0; core.dof], 0.0, &mut probe.u, &mut probe.du_force);
        row_velocities(&probe.rows, &probe.bias, &probe.u, &mut probe.c);
        for (i, (target, block)) in probe.targets.iter().zip(&probe.rows.blocks).enumerate() {
            let joint = is_joint(target);
            let free = !block.sides().iter().any(|s| pushed[s.u as usize]);
            open.place.push(if joint && core.settings.stabilize_positions { target.error - kept[i] } else { 0.0 });
            open.speed.push(if joint && free { probe.c[i] - target.velocity } else { 0.0 });
        }
        Ok(open)
    }

    /// The largest errors, as multiples of what counts as closed.
    fn worst(&self) -> (f64, f64) {
        (largest(&self.place) / self.least.0, largest(&self.speed) / self.least.1)
    }

    fn is_closed(&self) -> bool {
        let (place, speed) = self.worst();
        place <= 1.0 && speed <= 1.0
    }

    /// The share of the error before that is left: of place while that is open, then of speed, for which a change of place is a change of rows.
    fn left_of(&self, before: &Open) -> f64 {
        let (place, speed) = before.worst();
        if place > 1.0 { self.worst().0 / place } else { self.worst().1 / speed }
    }

    /// One round with the rows of `work`, whose islands are built, and the caches that they were built with.
    fn apply(&self, core: &mut Core, work: &Workspace) {
        let touches = work.touches.len();
        let (mut dx, mut dv) = (vec![0.0; core.dof], vec![0.0; core.dof]);
        let mut c = vec![0.0; work.rows.len];
        for (off, least, du) in [(&self.place, self.least.0, &mut dx), (&self.speed, self.least.1, &mut dv)] {
            work.rows.blocks[touches..].iter().zip(off).for_each(|(block, off)| c[block.row as usize] = *off);
            for blocks in work.islands.iter().filter(|blocks| blocks.iter().any(|&b| off[b as usize - touches].abs() > least)) {
                solve(&work.rows, blocks, &c, du, 0.1 * least);
            }
        }
        displace(core, &dx, 1.0);
        push(core, &dv);
    }
}

/// Which coordinates belong to objects of an island in which a contact pushes: the joint answer of all its rows counts more there than what the
/// joints lack in velocity.
fn pushed(work: &mut Workspace) -> Vec<bool> {
    let mut pushed = vec![false; work.rows.dof];
    if work.touches.is_empty() {
        return pushed;
    }
    work.islands.build(&work.rows, |_| true);
    for blocks in work.islands.iter() {
        let pushes = |&b: &u32| (b as usize) < work.touches.len() && work.lambda[work.rows.blocks[b as usize].row as usize] != 0.0;
        if blocks.iter().any(pushes) {
            let sides = blocks.iter().flat_map(|&b| work.rows.blocks[b as usize].sides());
            sides.for_each(|s| pushed[s.u as usize] = true);
        }
    }
    pushed
}

fn largest(v: &[f64]) -> f64 {
    v.iter().fold(0.0, |worst, x| worst.max(x.abs()))
}

/// Groups the joints alone.
fn islands(work: &mut Workspace) {
    let (touches, targets) = (work.touches.len(), &work.targets);
    work.islands.build(&work.rows, |b| b >= touches && is_joint(&targets[b - touches]));
}

fn rounds(work: &Workspace) -> usize {
    if work.islands.iter().any(|blocks| blocks.len() > DIRECT_ROWS) { FEW_ROUNDS } else { ROUNDS }
}

/// Gives rows that may not agree the compliance for such an error.
fn soften(probe: &mut Workspace, error: f64) {
    let share = (SOFT.0 * error).min(SOFT.1);
    for b in 0..probe.rows.blocks.len() {
        let own = probe.rows.own(&probe.rows.blocks[b], 0, 0);
        probe.rows.blocks[b].compliance = share * own;
    }
}

fn solve(rows: &Rows, blocks: &[u32], c: &[f64], du: &mut [f64], tolerance: f64) {
    let mut lambda = Vec::new();
    zero(&mut lambda, rows.len);
    let accuracy = Accuracy { sweeps: SWEEPS, relaxations: u32::MAX, tolerance };
    GaussSeidel.solve(rows, blocks, c, &mut lambda, du, accuracy);
}

/// Sites and caches of a state that is not the present one.
pub(super) fn refresh_at(core: &mut Core, x: &[f64]) {
    let now = std::mem::replace(&mut core.x, x.to_vec());
    core.motion().refresh();
    core.x = now;
}
