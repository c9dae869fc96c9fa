//! Rows of joints: limits, dry friction, drives, couplings (equations in `dof.rs`).

use super::body::ArticulatedBody;
use crate::articulated::model::dof::{DofSettings, Drive};
use crate::constraint::builder::RowBuilder;
use crate::constraint::rows::RowSet;
use crate::object::part_state::StateRange;
use crate::object::{Constraint, Level, RowTarget};
use crate::world::view::WorldView;

/// Distance from a limit at which a drive stops, rad or m, if rows are at the acceleration level.
/// It is larger than the accuracy with which the stepper locates the limit.
const LIMIT_MARGIN: f64 = 1e-6;

/// A degree of freedom: index of its velocity, position (0 if it has none), velocity and settings.
struct DofState<'a> {
    index: usize,
    q: f64,
    v: f64,
    settings: &'a DofSettings,
}

impl ArticulatedBody {
    /// Returns whether any setting or coupling makes a row.
    pub(super) fn has_rows(&self) -> bool {
        let rows =
            |f: &DofSettings| f.limits.is_some() || f.friction > 0.0 || f.damping > 0.0 || f.drive != Drive::None;
        !self.couplings.is_empty() || self.dofs().iter().any(rows)
    }

    fn dof_states<'a>(&'a self, x: &'a [f64]) -> impl Iterator<Item = DofState<'a>> {
        let n = self.model.positions();
        self.model.links().iter().flat_map(move |link| {
            (0..link.joint.dof()).map(move |k| {
                let index = link.v + k;
                let q = if link.joint.dof() == 1 { x[link.q] } else { 0.0 };
                DofState { index, q, v: x[n + index], settings: &self.dofs()[index] }
            })
        })
    }

    /// Adds the forces of springs and, where rows are not implicit, of damping and position drives.
    pub(super) fn joint_forces(&self, x: &[f64], implicit: bool, out: &mut [f64]) {
        for DofState { index, q, v, settings } in self.dof_states(x) {
            out[index] += settings.spring_force(q) + if implicit { 0.0 } else { settings.explicit_force(q, v) };
        }
    }

    /// Returns the energy of the springs, J.
    pub(super) fn spring_energy(&self, x: &[f64]) -> f64 {
        let energy = |p: DofState| p.settings.spring.map_or(0.0, |s| 0.5 * s.stiffness * (p.q - s.rest).powi(2));
        self.dof_states(x).map(energy).sum()
    }

    /// Returns the errors of the limits in the order of their rows: for each degree of freedom the
    /// lower, then the upper.
    fn limit_errors<'a>(&'a self, x: &'a [f64]) -> impl Iterator<Item = (usize, f64, f64)> {
        self.dof_states(x).filter_map(|p| p.settings.limits.map(|l| (p, l))).flat_map(|(p, [lo, hi])| {
            let errors = [(p.index, 1.0, p.q - lo), (p.index, -1.0, hi - p.q)];
            errors.into_iter().filter(|(_, _, error)| error.is_finite())
        })
    }
}

impl Constraint for ArticulatedBody {
    fn rows(&self, me: &StateRange, view: &WorldView, level: Level, out: &mut RowBuilder) {
        let x = &view.x[me.x.clone()];
        let mut maker = RowMaker { unit: vec![0.0; self.model.dof()], level, out };
        for (index, sign, error) in self.limit_errors(x) {
            maker.row(RowTarget::new(RowSet::HalfLine, error), &[(index, sign)]);
        }
        for dof_state in self.dof_states(x) {
            maker.friction(&dof_state);
            maker.damping(&dof_state);
            maker.drive(&dof_state, view.time);
        }
        for c in &self.couplings {
            let position = |dof| self.position_of(dof).map_or(0.0, |q| x[q]);
            let error = position(c.dof) - c.multiplier * position(c.of) - c.offset;
            maker.row(RowTarget::new(RowSet::Equality, error), &[(c.dof, 1.0), (c.of, -c.multiplier)]);
        }
    }

    fn gaps(&self, me: &StateRange, view: &WorldView, out: &mut Vec<f64>) {
        out.extend(self.limit_errors(&view.x[me.x.clone()]).map(|(_, _, error)| error));
    }

    fn on_itself(&self) -> bool {
        true
    }
}

impl Level {
    /// Returns the length of the step at the velocity level, s.
    fn step(self) -> Option<f64> {
        if let Level::Velocity { h } = self { Some(h) } else { None }
    }
}

/// Makes rows on the generalized coordinates of the owner.
struct RowMaker<'a, 'b> {
    unit: Vec<f64>,
    level: Level,
    out: &'a mut RowBuilder<'b>,
}

impl RowMaker<'_, '_> {
    fn row(&mut self, target: RowTarget, entries: &[(usize, f64)]) {
        let owner = self.out.owner();
        entries.iter().for_each(|&(i, value)| self.unit[i] = value);
        self.out.row(target).on_coordinates(owner, &self.unit);
        entries.iter().for_each(|&(i, _)| self.unit[i] = 0.0);
    }

    /// Returns the set for a force of at most `limit`: an impulse over the step, or the force
    /// itself at the acceleration level.
    fn bounded(&self, limit: f64) -> RowSet {
        let most = limit * self.level.step().unwrap_or(1.0);
        RowSet::Interval { lo: -most, hi: most }
    }

    fn friction(&mut self, p: &DofState) {
        if p.settings.friction > 0.0 {
            self.row(RowTarget::new(self.bounded(p.settings.friction), 0.0), &[(p.index, 1.0)]);
        }
    }

    fn damping(&mut self, p: &DofState) {
        if let (Some(h), true) = (self.level.step(), p.settings.damping > 0.0) {
            let soft =
                RowTarget { compliance: 1.0 / (h * p.settings.damping), ..RowTarget::new(RowSet::Equality, 0.0) };
            self.row(soft, &[(p.index, 1.0)]);
        }
    }

    /// Clamps the target velocity of a drive so that it does not point beyond the joint's limits,
    /// which hold for any strength of the drive. At the end of a step the joint is then exactly at
    /// the limit.
    fn within_limits(&self, p: &DofState, target: f64) -> f64 {
        let Some([lo, hi]) = p.settings.limits else { return target };
        let (down, up) = match self.level.step() {
            // the view is that of the middle of the step
            Some(h) => ((lo - (p.q - 0.5 * h * p.v)) / h, (hi - (p.q - 0.5 * h * p.v)) / h),
            None => (
                if p.q - lo > LIMIT_MARGIN { f64::NEG_INFINITY } else { 0.0 },
                if hi - p.q > LIMIT_MARGIN { f64::INFINITY } else { 0.0 },
            ),
        };
        target.max(down.min(0.0)).min(up.max(0.0))
    }

    fn drive(&mut self, p: &DofState, time: f64) {
        let hard = |limit: f64| limit.is_infinite();
        match &p.settings.drive {
            Drive::None => {}
            Drive::Position { stiffness, damping, target, velocity, limit } => {
                let Some(h) = self.level.step() else { return };
                // the view is that of the middle of the step: the position at its start is half a
                // step behind
                let (q, gain) = (p.q - 0.5 * h * p.v, damping + h * stiffness);
                let aim = (stiffness * (target - q) + damping * velocity) / gain;
                let set = if hard(*limit) { RowSet::Equality } else { self.bounded(*limit) };
                self.row(
                    RowTarget { velocity: aim, compliance: 1.0 / (h * gain), ..RowTarget::new(set, 0.0) },
                    &[(p.index, 1.0)],
                );
            }
            Drive::Velocity { target, limit } => {
                let set = if hard(*limit) { RowSet::Equality } else { self.bounded(*limit) };
                self.row(
                    RowTarget { velocity: self.within_limits(p, *target), ..RowTarget::new(set, 0.0) },
                    &[(p.index, 1.0)],
                );
            }
            Drive::Playback { motion, limit } if hard(*limit) => {
                let (position, velocity) = motion.at(time);
                self.row(RowTarget { velocity, ..RowTarget::new(RowSet::Equality, p.q - position) }, &[(p.index, 1.0)]);
            }
            Drive::Playback { motion, limit } => {
                let velocity = match self.level.step() {
                    Some(h) => (motion.at(time + 0.5 * h).0 - (p.q - 0.5 * h * p.v)) / h,
                    None => motion.at(time).1,
                };
                self.row(RowTarget { velocity, ..RowTarget::new(self.bounded(*limit), 0.0) }, &[(p.index, 1.0)]);
            }
        }
    }
}
