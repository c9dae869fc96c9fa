//! Errors of joints and active limits at any state, and the rows there: what one round of a
//! correction starts from.

use super::super::contacts::{lay_rows, row_velocities, whiten};
use super::super::{Moment, Workspace, springs};
use super::group::Group;
use super::is_joint;
use crate::constraint::rows::{Block, RowSet};
use crate::object::Level;
use crate::world::{Core, StepError};

/// No velocity is corrected beyond this, m/s, whatever the solver's tolerance.
const MIN_VELOCITY_TOLERANCE: f64 = 1e-12;

/// Returns the error of a corrected row, m or rad, for a contact tolerance.
pub(super) fn position_tolerance(contact_tolerance: f64) -> f64 {
    1e-2 * contact_tolerance
}

/// Returns which targets resist corrections: inertias, and springs, dampers and drives of finite gain that are stiff for the
/// step.
fn resisting(work: &Workspace) -> Vec<bool> {
    let blocks = &work.rows.blocks[work.contact_constraints.len()..];
    work.targets.iter().zip(blocks).map(|(t, block)| t.inertial || springs::is_stiff(work, block, t)).collect()
}

/// A limit with a force.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct ActiveLimit {
    /// See [`Limit`](super::super::contacts::Limit).
    pub key: [u32; 2],
    /// Whether a contact pushes in its island.
    pub with_contacts: bool,
}

/// Returns the limits with a force in the last solve of `work`, sorted by key.
pub(in super::super) fn limits_with_force(work: &Workspace) -> Vec<ActiveLimit> {
    let contacts = work.contact_constraints.len();
    let force = |b: usize| work.lambda[work.rows.blocks[b].row as usize];
    let mut active = Vec::new();
    for blocks in work.islands.iter() {
        let with_contacts = blocks.iter().any(|&b| (b as usize) < contacts && force(b as usize) != 0.0);
        for limit in &work.limits {
            let block = limit.target.map(|t| t + contacts as u32);
            if block.is_some_and(|b| blocks.contains(&b) && force(b as usize) > 0.0) {
                active.push(ActiveLimit { key: limit.key, with_contacts });
            }
        }
    }
    active.sort_by_key(|limit| limit.key);
    active
}

/// The limits that a correction makes active: it then moves their gaps to the allowed value.
#[derive(Clone, Copy)]
pub(in super::super) enum Limits<'a> {
    /// None.
    Free,
    /// Those that are violated by more than the contact tolerance.
    Violated,
    /// The listed ones, sorted by key, within `reach` (m or rad) of their stop: further away they
    /// were left in the meantime.
    Listed { limits: &'a [ActiveLimit], reach: f64 },
}

/// The state that a correction aims at, and the rows that take part.
#[derive(Clone, Copy)]
pub(super) struct Goal<'a> {
    /// Time of the state, s.
    pub time: f64,
    /// Level of the rows.
    pub level: Level,
    /// Error of each constraint row that remains, m or rad.
    pub kept: &'a [f64],
    /// Extensions of springs by the midpoint rule; empty if springs have no error.
    pub extensions: &'a [f64],
    /// Whether the positions of joints are corrected.
    pub joints: bool,
    pub limits: Limits<'a>,
    /// Whether velocities are corrected, and at which coordinates contacts push: rows there keep
    /// their velocities, because the simultaneous solve of contacts and joints is more important.
    pub velocities: Option<&'a [bool]>,
}

/// Errors of the constraint rows at a state; 0 for rows that are not corrected.
pub(super) struct Errors<'a> {
    pub goal: Goal<'a>,
    pub position: Vec<f64>,
    pub velocity: Vec<f64>,
    /// Tolerance of positions, m or rad, and of velocities, m/s or rad/s.
    pub tolerance: (f64, f64),
    /// The rows at the state.
    pub probe: &'a mut Workspace,
    /// Per target: whether it is a limit with a reported gap, a joint, an inertia or a stiff spring, an active limit; and
    /// whether an active limit keeps its velocity.
    is_limit: Vec<bool>,
    is_joint: Vec<bool>,
    resists: Vec<bool>,
    /// Displacement by which each stiff spring has yielded to the correction, m or rad.
    pub yielded: Vec<f64>,
    active: Vec<bool>,
    keeps_velocity: Vec<bool>,
}

impl<'a> Errors<'a> {
    /// Makes room for the errors of the constraint rows of `work`.
    pub fn new(core: &Core, work: &Workspace, probe: &'a mut Workspace, goal: Goal<'a>) -> Errors<'a> {
        let (n, settings) = (work.targets.len(), &core.settings);
        let mut errors = Errors {
            goal,
            position: vec![0.0; n],
            velocity: vec![0.0; n],
            tolerance: (
                position_tolerance(settings.contact_tolerance),
                settings.solver_settings.tolerance.max(MIN_VELOCITY_TOLERANCE),
            ),
            probe,
            is_limit: vec![false; n],
            is_joint: work.targets.iter().map(is_joint).collect(),
            resists: resisting(work),
            yielded: vec![0.0; n],
            active: vec![false; n],
            keeps_velocity: vec![false; n],
        };
        for limit in &work.limits {
            let Some(target) = limit.target.map(|t| t as usize) else { continue };
            errors.is_limit[target] = match goal.limits {
                Limits::Free => false,
                Limits::Violated => {
                    errors.keeps_velocity[target] = true;
                    true
                }
                Limits::Listed { limits, .. } => match limits.binary_search_by_key(&limit.key, |l| l.key) {
                    Ok(i) => {
                        errors.keeps_velocity[target] = limits[i].with_contacts;
                        true
                    }
                    Err(_) => false,
                },
            };
        }
        errors
    }

    /// Returns whether a target is a joint, an active limit, or resists: an inertia or a stiff spring is part of the mass
    /// that corrections move.
    pub fn measures(&self, target: usize) -> bool {
        self.is_joint[target] || self.active[target] || self.resists[target]
    }

    /// Returns whether a target is an inertia or a stiff spring.
    pub fn resists(&self, target: usize) -> bool {
        self.resists[target]
    }

    /// Returns whether a target is an active limit.
    pub fn is_active(&self, target: usize) -> bool {
        self.active[target]
    }

    /// Returns whether the active limits are those that had a force in the step.
    pub fn holds_limits(&self) -> bool {
        matches!(self.goal.limits, Limits::Listed { .. })
    }

    /// Refreshes the moment and measures the errors there. All are 0 if the rows are not those of
    /// the step.
    pub fn measure(&mut self, core: &Core, at: &mut Moment) -> Result<(), StepError> {
        at.refresh(core);
        lay_rows(at.basis(core, self.goal.time), self.probe, self.goal.level)?;
        if self.goal.velocities.is_some() {
            let Workspace { rows, bias, u, du_force, c, .. } = &mut *self.probe;
            whiten(at.coordinates(core), &vec![0.0; core.dof], 0.0, u, du_force);
            row_velocities(&core.threads, rows, bias, u, c);
        }
        self.compare();
        Ok(())
    }

    /// Activates limits at the measured state. Returns whether there are any more than before.
    pub fn activate(&mut self, core: &Core) -> bool {
        let targets = &self.probe.targets;
        if targets.len() != self.active.len() {
            return false;
        }
        let mut more = false;
        for (i, target) in targets.iter().enumerate().filter(|(i, _)| self.is_limit[*i]) {
            let activates = match self.goal.limits {
                Limits::Free => false,
                Limits::Violated => target.error - self.goal.kept[i].min(0.0) < -core.settings.contact_tolerance,
                Limits::Listed { reach, .. } => target.error.abs() <= reach,
            };
            more |= activates && !self.active[i];
            self.active[i] |= activates;
        }
        if more {
            self.compare();
        }
        more
    }

    /// Writes the errors from the rows at the state, whose active limits become equalities.
    fn compare(&mut self) {
        self.position.fill(0.0);
        self.velocity.fill(0.0);
        let Workspace { targets, rows, c, .. } = &mut *self.probe;
        if targets.len() != self.position.len() {
            return;
        }
        for (i, (target, block)) in targets.iter().zip(&mut rows.blocks).enumerate() {
            let (joint, limit) = (self.is_joint[i], self.active[i]);
            if limit {
                block.set = RowSet::Equality;
                self.position[i] = target.error - self.goal.kept[i].min(0.0);
            } else if joint && self.goal.joints {
                self.position[i] = target.error - self.goal.kept[i];
            } else if let (Some(spring), Some(by_rule), true) =
                (target.spring, self.goal.extensions.get(i), self.resists[i])
            {
                self.position[i] = spring.extension - by_rule + self.yielded[i];
            }
            if let Some(pushed) = self.goal.velocities
                && (joint || limit)
                && !self.keeps_velocity[i]
                && (limit || !block.sides().iter().any(|s| pushed[s.u as usize]))
            {
                self.velocity[i] = c[i] - target.velocity;
            }
        }
    }

    /// Adds the multipliers of a round to what springs have yielded. `blocks` are those of the constraints.
    pub fn yield_to(&mut self, blocks: &[Block], lambda: &[f64]) {
        for (i, block) in blocks.iter().enumerate().filter(|(i, _)| self.resists[*i]) {
            self.yielded[i] += block.compliance * lambda[block.row as usize];
        }
    }

    /// Returns the largest errors of position and velocity of a group, as multiples of the
    /// tolerance.
    pub fn of(&self, group: &Group) -> (f64, f64) {
        (group.largest(&self.position) / self.tolerance.0, group.largest(&self.velocity) / self.tolerance.1)
    }
}
