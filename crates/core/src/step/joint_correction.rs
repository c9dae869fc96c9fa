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

use super::contacts::{lay_rows, push, row_velocities, shift, unwhiten_onto, whiten, zero};
use super::unreachable_joints;
use super::{Moment, Workspace};
use crate::constraint::rows::{RowSet, Rows};
use crate::derived::Cache;
use crate::object::{Integratable, Level, RowTarget};
use crate::solver::{GaussSeidel, MAX_DIRECT_ROWS, RowSolver, SolverSettings};
use crate::world::view::{Entry, Objects};
use crate::world::{Coordinates, Core, StepError};
use std::ops::Range;

/// Rounds at most.
const ROUNDS: usize = 16;
/// Rounds where some joints are too many for a direct solve, so that a long rope costs what its sweeps cost.
const FEW_ROUNDS: usize = 2;
/// Sweeps of a round there.
const SWEEPS: u32 = 25;
/// No velocity is closed further than this, m/s, whatever the solver's tolerance.
const FINEST: f64 = 1e-12;
/// A round that leaves more of the error than this is the last of its kind.
const SLOW: f64 = 0.2;
/// Compliance of rows that are off by a meter, as a share of their response, and the most that is taken. What is redundant except for an error
/// responds with the square of it, far less, and is left alone; as the error goes so does the compliance (Levenberg and Marquardt).
const SOFT: (f64, f64) = (10.0, 0.1);
/// What a round that made things worse multiplies the compliance by, what one that did not divides it by, and where no more is tried.
const DAMPING: (f64, f64, f64) = (10.0, 3.0, 1e6);

/// Whether a row is held in place.
pub(super) fn is_joint(t: &RowTarget) -> bool {
    t.set == RowSet::Equality && t.compliance == 0.0
}

/// Returns the errors of all constraint rows at the present, and the rows of the middle of the step: free motion of `ahead` seconds
/// brought onto the joints. Their Jacobians are those of the middle, their responses those of the moment `acting` (or else of the
/// present), as all rows of a step have.
pub(super) fn middle(
    core: &mut Core,
    acting: Option<&mut Moment>,
    level: Level,
    ahead: f64,
) -> Result<(Vec<f64>, Workspace), StepError> {
    let mut rows = Workspace::default();
    let (start, time) = (core.state.time, core.state.time + ahead);
    lay_rows(core.basis(None, start, None), &mut rows, level)?;
    let errors: Vec<f64> = rows.targets.iter().map(|t| t.error).collect();
    let mut at = core.moment();
    go_on(core, &mut at, ahead);
    // open joints aim half-way closer: whether that is out of reach shows here
    let closer = if core.settings.stabilize_positions { core.settings.recovery_speed * ahead } else { 0.0 };
    let aims = |closer: f64, rows: &Workspace| unreachable_joints::left(rows, |i| errors[i], closer);
    let aim = aims(closer, &rows);
    let mut far = onto(core, &mut at, &mut rows, (level, time), &aim);
    if far.as_ref().is_ok_and(|far| far.is_empty())
        && Piece::all(core, &mut rows).iter().any(|p| p.direct() && unreachable_joints::weak(&rows, &p.rows))
    {
        let (mut end, mut at_end, time) = (Workspace::default(), core.moment(), time + ahead);
        at_end.x.copy_from_slice(&at.x);
        go_on(core, &mut at_end, ahead);
        lay_rows(at_end.basis(core, time), &mut end, level)?;
        let aim = aims(2.0 * closer, &end);
        far = onto(core, &mut at_end, &mut end, (level, time), &aim);
        core.moments.push(at_end);
    }
    map_sides(at.coordinates(core), &mut rows, |body, cache, y, j| body.mul_lt(cache, y, j)); // Jᵀ = Lᵀ·Y
    core.moments.push(at);
    map_sides(core.coordinates(acting), &mut rows, |body, cache, j, y| body.solve_lt(cache, j, y));
    unreachable_joints::soften(&mut rows, &far?, unreachable_joints::GIVING);
    Ok((errors, rows))
}

/// Advances a moment by `h` seconds of free motion.
fn go_on(core: &mut Core, moment: &mut Moment, h: f64) {
    let mut motion = core.integration_of(Some(moment));
    motion.free_motion(h);
    motion.refresh();
}

/// What moves, in the order of its coordinates, in which it was added too.
fn by_start(objects: Objects<'_>) -> Vec<Entry<'_>> {
    objects.iter().filter(|e| e.moves()).collect()
}

fn entry_at<'e>(entries: &[Entry<'e>], u: u32) -> Option<Entry<'e>> {
    entries.binary_search_by_key(&(u as usize), |e| e.state_range.v.start).ok().map(|i| entries[i])
}

/// Replaces what every row holds of every side.
fn map_sides(
    Coordinates { objects, caches, .. }: Coordinates,
    work: &mut Workspace,
    map: impl Fn(&dyn Integratable, &mut Cache, &[f64], &mut [f64]),
) {
    let entries = by_start(objects);
    let Rows { blocks, y, .. } = &mut work.rows;
    for side in blocks.iter().flat_map(|b| b.sides()) {
        let entry = entry_at(&entries, side.u);
        if let Some((entry, body)) = entry.and_then(|e| Some((e, e.object.integratable()?))) {
            let held = &mut y[side.y as usize..(side.y + side.dof) as usize];
            let before = held.to_vec();
            map(body, &mut caches[entry.place], &before, held);
        }
    }
}

/// Moves a moment to where the joints have the errors given; `probe` has the rows there. Returns the rows of joints that cannot have
/// them, sorted.
fn onto(
    core: &Core,
    at: &mut Moment,
    probe: &mut Workspace,
    (level, time): (Level, f64),
    errors: &[f64],
) -> Result<Vec<u32>, StepError> {
    let least = 1e-2 * core.settings.contact_tolerance;
    lay_rows(at.basis(core, time), probe, level)?;
    let mut pieces = Piece::all(core, probe);
    let mut kept = at.x.clone();
    while probe.targets.len() == errors.len() && pieces.iter().any(|p| !p.done) {
        let off: Vec<f64> = probe.targets.iter().zip(errors).map(|(t, e)| t.error - e).collect();
        let mut dx = vec![0.0; core.dof];
        for piece in pieces.iter_mut().filter(|p| !p.done) {
            let worst = piece.largest(&off);
            piece.rounds = piece.rounds.saturating_sub(1);
            if worst > piece.left.0 {
                piece.copy(&kept, &mut at.x); // it was better before
                piece.damp();
                piece.done |= piece.rounds == 0;
                continue;
            }
            piece.left.0 = worst;
            piece.done = worst <= least || piece.rounds == 0;
            if !piece.done {
                piece.soften(probe, worst);
                solve(&probe.rows, &piece.rows, &off, &mut dx, 0.1 * least);
            }
        }
        kept.copy_from_slice(&at.x);
        shift(at.coordinates(core), &dx, 1.0);
        at.refresh(core.objects());
        lay_rows(at.basis(core, time), probe, level)?;
    }
    let mut far: Vec<u32> = pieces
        .iter()
        .filter(|p| p.direct() && p.left.0 > core.settings.contact_tolerance)
        .flat_map(|p| p.rows.clone())
        .collect();
    far.sort_unstable();
    Ok(far)
}

/// Closes the joints of `work` at the present state, which is `step.0` seconds after the state `start`; `step.1` is the level of the
/// rows. They respond at the moment `acting`, or else at `start`. `kept` is the error of each constraint row that is to stay.
pub(super) fn close(
    core: &mut Core,
    acting: Option<&mut Moment>,
    work: &mut Workspace,
    start: &[f64],
    step: (f64, Level),
    kept: &[f64],
) -> Result<(), StepError> {
    if !work.targets.iter().any(is_joint) {
        return Ok(());
    }
    let mut at_start = None;
    let acting = match acting {
        Some(moment) => moment,
        None => {
            let moment = at_start.insert(core.moment());
            moment.x.copy_from_slice(start);
            moment.refresh(core.objects());
            moment
        }
    };
    let mut end = core.moment();
    close_at(core, &mut end, acting, work, start, step, kept)?;
    core.state.x.copy_from_slice(&end.x);
    core.moments.extend([Some(end), at_start].into_iter().flatten());
    Ok(())
}

/// The same at the moment `end`.
fn close_at(
    core: &mut Core,
    end: &mut Moment,
    acting: &mut Moment,
    work: &mut Workspace,
    start: &[f64],
    step: (f64, Level),
    kept: &[f64],
) -> Result<(), StepError> {
    let pushed = pushed(work);
    let (arrived, mut moved) = (end.x.clone(), vec![0.0; core.dof]);
    let mut pieces = Piece::all(core, work);
    let mut probe = Workspace::default();
    let mut open = JointErrors::measure(core, end, work, &mut probe, step, kept, &pushed)?;
    pieces.iter_mut().for_each(|piece| piece.left = open.of(piece));
    loop {
        pieces
            .iter_mut()
            .for_each(|piece| piece.done |= (piece.left.0 <= 1.0 && piece.left.1 <= 1.0) || piece.rounds == 0);
        if pieces.iter().all(|p| p.done) {
            break;
        }
        let (before, moved_before) = (end.x.clone(), moved.clone());
        open.newton(end.coordinates(core), &mut probe, &pieces, &mut moved);
        open.chord(end.coordinates_by(core, &mut acting.derived.caches), work, &pieces, &mut moved);
        open = JointErrors::measure(core, end, work, &mut probe, step, kept, &pushed)?;
        let mut worse = false;
        for piece in pieces.iter_mut().filter(|p| !p.done) {
            let (left, was) = (open.of(piece), piece.left);
            piece.rounds -= 1;
            if was.0 > 1.0 && left.1 > was.1.max(1.0) && !piece.place_first {
                // with the place rows change, and velocities along them: one after the other
                piece.copy(&before, &mut end.x);
                piece.forget(&moved_before, &mut moved);
                (worse, piece.place_first) = (true, true);
                continue;
            }
            let share = if was.0 > 1.0 { left.0 / was.0 } else { left.1 / was.1 };
            if share < 1.0 {
                piece.left = left;
                piece.damping = (piece.damping / DAMPING.1).max(1.0);
            } else {
                piece.copy(&before, &mut end.x);
                piece.forget(&moved_before, &mut moved);
                worse = true;
                if !piece.chord {
                    piece.damp();
                }
            }
            piece.chord &= share < SLOW;
        }
        if worse {
            open = JointErrors::measure(core, end, work, &mut probe, step, kept, &pushed)?;
        }
    }
    let far = core.settings.contact_tolerance / open.least.0;
    for piece in pieces.iter().filter(|p| p.direct() && p.left.0 > far) {
        unreachable_joints::go_as_moved(end.coordinates(core), &piece.stretches, [start, &arrived], &moved, step.0);
        unreachable_joints::report(core, &probe, &piece.rows);
    }
    Ok(())
}

/// Objects that joints join, directly or through others, and their joints. What cannot be closed in one piece does not hinder another.
struct Piece {
    /// Joints, as indices of blocks; and of constraint rows.
    blocks: Vec<u32>,
    rows: Vec<u32>,
    /// Its objects' stretches of the state, and of velocities.
    stretches: Vec<(Range<usize>, Range<usize>)>,
    /// What is open: place, speed.
    left: (f64, f64),
    /// Rounds that may still be taken.
    rounds: usize,
    /// Whether by the rows of the step.
    chord: bool,
    /// Whether velocities wait until the place is closed.
    place_first: bool,
    /// What the compliance of its rows is multiplied by.
    damping: f64,
    done: bool,
}

impl Piece {
    fn all(core: &Core, work: &mut Workspace) -> Vec<Piece> {
        let (contact_constraints, targets) = (work.contact_constraints.len(), &work.targets);
        work.islands.build(&work.rows, |b| b >= contact_constraints && is_joint(&targets[b - contact_constraints]));
        let entries = by_start(core.objects());
        let piece = |blocks: &[u32]| {
            let mut starts: Vec<u32> =
                blocks.iter().flat_map(|&b| work.rows.blocks[b as usize].sides()).map(|s| s.u).collect();
            starts.sort_unstable();
            starts.dedup();
            let stretches = starts
                .iter()
                .filter_map(|u| entry_at(&entries, *u))
                .map(|e| (e.state_range.x.clone(), e.state_range.v.clone()))
                .collect();
            let rounds = if blocks.len() > MAX_DIRECT_ROWS { FEW_ROUNDS } else { ROUNDS };
            let rows = blocks.iter().map(|b| b - contact_constraints as u32).collect();
            let left = (f64::INFINITY, f64::INFINITY);
            Piece {
                blocks: blocks.to_vec(),
                rows,
                stretches,
                left,
                rounds,
                chord: true,
                place_first: false,
                damping: 1.0,
                done: false,
            }
        };
        work.islands.iter().map(piece).collect()
    }

    /// Takes its objects' state over.
    fn copy(&self, from: &[f64], to: &mut [f64]) {
        self.stretches.iter().for_each(|(x, _)| to[x.clone()].copy_from_slice(&from[x.clone()]));
    }

    /// The same of how far they were moved.
    fn forget(&self, from: &[f64], to: &mut [f64]) {
        self.stretches.iter().for_each(|(_, v)| to[v.clone()].copy_from_slice(&from[v.clone()]));
    }

    /// Whether it is small enough to be solved directly: what is not may be open because there was too little time.
    fn direct(&self) -> bool {
        self.blocks.len() <= MAX_DIRECT_ROWS
    }

    /// Goes shorter ways from now on.
    fn damp(&mut self) {
        self.damping *= DAMPING.0;
        self.done |= self.damping > DAMPING.2;
    }

    /// Gives its rows, in `probe`, the compliance for such an error: they may not agree.
    fn soften(&self, probe: &mut Workspace, error: f64) {
        unreachable_joints::soften(probe, &self.rows, (SOFT.0 * error).min(SOFT.1) * self.damping);
    }

    /// Whether only its place is closed in this round.
    fn moves_first(&self) -> bool {
        self.place_first && self.left.0 > 1.0
    }

    /// The largest of its rows' numbers.
    fn largest(&self, of_rows: &[f64]) -> f64 {
        self.rows.iter().fold(0.0, |worst, &i| worst.max(of_rows[i as usize].abs()))
    }
}

/// How far each constraint row is off at the present state; 0 where that is to stay.
#[derive(Default)]
struct JointErrors {
    place: Vec<f64>,
    speed: Vec<f64>,
    /// What counts as closed: meters (or radians) and meters per second.
    least: (f64, f64),
}

impl JointErrors {
    /// Refreshes the moment `at`, and leaves its rows in `probe`. Nothing is open if they are not those of `work`.
    fn measure(
        core: &Core,
        at: &mut Moment,
        work: &Workspace,
        probe: &mut Workspace,
        step: (f64, Level),
        kept: &[f64],
        pushed: &[bool],
    ) -> Result<JointErrors, StepError> {
        at.refresh(core.objects());
        lay_rows(at.basis(core, core.state.time + step.0), probe, step.1)?;
        let n = work.targets.len();
        let least = (1e-2 * core.settings.contact_tolerance, core.settings.solver_settings.tolerance.max(FINEST));
        let mut open = JointErrors { place: vec![0.0; n], speed: vec![0.0; n], least };
        if probe.targets.len() != n {
            return Ok(open);
        }
        whiten(at.coordinates(core), &vec![0.0; core.dof], 0.0, &mut probe.u, &mut probe.du_force);
        row_velocities(&probe.rows, &probe.bias, &probe.u, &mut probe.c);
        for (i, (target, block)) in probe.targets.iter().zip(&probe.rows.blocks).enumerate() {
            let joint = is_joint(target);
            let free = !block.sides().iter().any(|s| pushed[s.u as usize]);
            open.place[i] = if joint && core.settings.stabilize_positions { target.error - kept[i] } else { 0.0 };
            open.speed[i] = if joint && free { probe.c[i] - target.velocity } else { 0.0 };
        }
        Ok(open)
    }

    /// The largest place and speed of a piece, as multiples of what counts as closed.
    fn of(&self, piece: &Piece) -> (f64, f64) {
        (piece.largest(&self.place) / self.least.0, piece.largest(&self.speed) / self.least.1)
    }

    /// A round with the rows of the step, in the caches that they were built with.
    fn chord(&self, at: Coordinates, work: &Workspace, pieces: &[Piece], moved: &mut [f64]) {
        let contact_constraints = work.contact_constraints.len();
        self.apply(
            at,
            &work.rows,
            contact_constraints,
            pieces.iter().filter(|p| !p.done && p.chord).map(|p| (&p.blocks[..], p.moves_first())),
            moved,
        );
    }

    /// A round with the rows of the present, where those of the step have got too little done.
    fn newton(&self, at: Coordinates, probe: &mut Workspace, pieces: &[Piece], moved: &mut [f64]) {
        for piece in pieces.iter().filter(|p| !p.done && !p.chord) {
            piece.soften(probe, piece.largest(&self.place));
        }
        self.apply(
            at,
            &probe.rows,
            0,
            pieces.iter().filter(|p| !p.done && !p.chord).map(|p| (&p.rows[..], p.moves_first())),
            moved,
        );
    }

    fn apply<'p>(
        &self,
        Coordinates { objects, x, caches }: Coordinates,
        rows: &Rows,
        contact_constraints: usize,
        pieces: impl Iterator<Item = (&'p [u32], bool)>,
        moved: &mut [f64],
    ) {
        let (mut dx, mut dv) = (vec![0.0; moved.len()], vec![0.0; moved.len()]);
        let mut c = [vec![0.0; rows.len], vec![0.0; rows.len]];
        for (i, block) in rows.blocks[contact_constraints..].iter().enumerate() {
            (c[0][block.row as usize], c[1][block.row as usize]) = (self.place[i], self.speed[i]);
        }
        for (blocks, moves_first) in pieces {
            for (c, du, least, wanted) in
                [(&c[0], &mut dx, self.least.0, true), (&c[1], &mut dv, self.least.1, !moves_first)]
            {
                if wanted && blocks.iter().any(|&b| c[rows.blocks[b as usize].row as usize].abs() > least) {
                    solve(rows, blocks, c, du, 0.1 * least);
                }
            }
        }
        unwhiten_onto(Coordinates { objects, x: &mut *x, caches: &mut *caches }, &dx, moved);
        shift(Coordinates { objects, x: &mut *x, caches: &mut *caches }, &dx, 1.0);
        push(Coordinates { objects, x, caches }, &dv, &mut Vec::new());
    }
}

/// Which coordinates belong to objects of an island in which a contact pushes: the joint answer of all its rows counts more there than what the
/// joints lack in velocity.
fn pushed(work: &mut Workspace) -> Vec<bool> {
    let mut pushed = vec![false; work.rows.dof];
    if work.contact_constraints.is_empty() {
        return pushed;
    }
    work.islands.build(&work.rows, |_| true);
    for blocks in work.islands.iter() {
        let pushes = |&b: &u32| {
            (b as usize) < work.contact_constraints.len()
                && work.lambda[work.rows.blocks[b as usize].row as usize] != 0.0
        };
        if blocks.iter().any(pushes) {
            let sides = blocks.iter().flat_map(|&b| work.rows.blocks[b as usize].sides());
            sides.for_each(|s| pushed[s.u as usize] = true);
        }
    }
    pushed
}

fn solve(rows: &Rows, blocks: &[u32], c: &[f64], du: &mut [f64], tolerance: f64) {
    let mut lambda = Vec::new();
    zero(&mut lambda, rows.len);
    let solver_settings = SolverSettings { max_sweeps: SWEEPS, max_relaxations: u32::MAX, tolerance };
    GaussSeidel.solve(rows, blocks, c, &mut lambda, du, solver_settings);
}
