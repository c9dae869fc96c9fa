//! Rows of one degree of freedom with one position, of a joint of an articulated body or of a loop
//! joint: limits, dry friction, damping, spring and drive. The equations are in `articulated/model/dof.rs`.

use super::rows::RowSet;
use crate::articulated::{DofSettings, Drive};
use crate::object::{Level, RowTarget};

/// Distance from a limit at which a drive stops, rad or m, if rows are at the acceleration level.
/// It is larger than the accuracy with which the stepper locates the limit.
const LIMIT_MARGIN: f64 = 1e-6;

/// A degree of freedom in a view of the world: position, velocity and settings.
pub(crate) struct DofState<'a> {
    /// rad or m.
    pub q: f64,
    /// rad/s or m/s.
    pub v: f64,
    pub settings: &'a DofSettings,
    /// Limits of `q`; `None` for a component of a rotation.
    pub limits: Option<[f64; 2]>,
}

impl Level {
    /// Returns the length of the step at the velocity level, s.
    pub(crate) fn step(self) -> Option<f64> {
        if let Level::Velocity { h } = self { Some(h) } else { None }
    }

    /// Returns the set for a force of at most `limit`: an impulse over the step, or the force
    /// itself at the acceleration level.
    pub(crate) fn bounded(self, limit: f64) -> RowSet {
        let most = limit * self.step().unwrap_or(1.0);
        RowSet::Interval { lo: -most, hi: most }
    }
}

impl DofState<'_> {
    /// Returns the rows of the limits: sign of the row's velocity, and gap; the lower limit first.
    pub fn limits(&self) -> impl Iterator<Item = (f64, f64)> + use<> {
        let q = self.q;
        let gaps = self.limits.map(|[lo, hi]| [(1.0, q - lo), (-1.0, hi - q)]);
        gaps.into_iter().flatten().filter(|(_, gap)| gap.is_finite())
    }

    /// Returns the rows of the velocity limit: sign of the row's velocity, and target. They hold no position, so
    /// they are intervals and no half-lines.
    pub fn velocity_limits(&self) -> impl Iterator<Item = (f64, RowTarget)> + use<> {
        let most = self.settings.max_velocity;
        let set = RowSet::Interval { lo: 0.0, hi: f64::INFINITY };
        let target = RowTarget { velocity: -most, ..RowTarget::new(set, 0.0) };
        [1.0, -1.0].into_iter().filter(move |_| most.is_finite()).map(move |sign| (sign, target))
    }

    /// Calls `row` with the targets of the rows of dry friction and damping.
    pub fn resistance(&self, level: Level, mut row: impl FnMut(RowTarget)) {
        if self.settings.friction > 0.0 {
            row(RowTarget::new(level.bounded(self.settings.friction), 0.0));
        }
        if let (Some(h), true) = (level.soft_step(), self.settings.damping > 0.0) {
            let compliance = 1.0 / (h * self.settings.damping);
            row(RowTarget { compliance, share: level.share(), ..RowTarget::new(RowSet::Equality, 0.0) });
        }
    }

    /// Returns the target of the row of a spring by the implicit midpoint rule, with its own position `q`, if it is a row.
    pub fn spring(&self, level: Level, q: f64) -> Option<RowTarget> {
        let (spring, soft) = (self.settings.spring.filter(|s| s.stiffness > 0.0)?, level.soft_step()?);
        let h = level.h();
        let velocity = self.v - 4.0 * (q - spring.rest) * soft / (h * h);
        let compliance = 4.0 / (spring.stiffness * h * h);
        Some(RowTarget { velocity, compliance, share: level.share(), ..RowTarget::new(RowSet::Equality, 0.0) })
    }

    /// Calls `row` with the targets of the rows of dry friction, damping and drive. Damping and a position
    /// drive without a limit are one row: two springs in parallel.
    pub fn forces(&self, level: Level, time: f64, mut row: impl FnMut(RowTarget)) {
        let drive = self.drive(level, time);
        let soft = drive.filter(|d| d.set == RowSet::Equality && d.compliance > 0.0 && self.settings.damping > 0.0);
        let (Some(drive), Some(h)) = (soft, level.soft_step()) else {
            self.resistance(level, &mut row);
            return drive.into_iter().for_each(row);
        };
        if self.settings.friction > 0.0 {
            row(RowTarget::new(level.bounded(self.settings.friction), 0.0));
        }
        let (own, both) = (1.0 / drive.compliance, 1.0 / drive.compliance + h * self.settings.damping);
        row(RowTarget { compliance: 1.0 / both, velocity: drive.velocity * own / both, ..drive });
    }

    /// Clamps the target velocity of a drive so that it does not point beyond the joint's limits,
    /// which hold for any strength of the drive. At the end of a step the joint is then exactly at
    /// the limit.
    fn within_limits(&self, level: Level, target: f64) -> f64 {
        let Some([lo, hi]) = self.limits else { return target };
        let (down, up) = match level.step() {
            // the view is that of the middle of the step
            Some(h) => ((lo - (self.q - 0.5 * h * self.v)) / h, (hi - (self.q - 0.5 * h * self.v)) / h),
            None => (
                if self.q - lo > LIMIT_MARGIN { f64::NEG_INFINITY } else { 0.0 },
                if hi - self.q > LIMIT_MARGIN { f64::INFINITY } else { 0.0 },
            ),
        };
        target.max(down.min(0.0)).min(up.max(0.0))
    }

    /// Returns the target of the row of the drive, if it is a row.
    pub fn drive(&self, level: Level, time: f64) -> Option<RowTarget> {
        let set = |limit: f64| if limit.is_infinite() { RowSet::Equality } else { level.bounded(limit) };
        Some(match &self.settings.drive {
            Drive::None => return None,
            Drive::Position { stiffness, damping, target, velocity, limit } => {
                let h = level.soft_step()?;
                let start = self.q - 0.5 * level.h() * self.v;
                // the view is that of the middle of the step: the position at its start is half a
                // step behind
                let gain = damping + h * stiffness;
                let aim = (stiffness * (target - start) + damping * velocity) / gain;
                let (compliance, share) = (1.0 / (h * gain), level.share());
                RowTarget { velocity: aim, compliance, share, ..RowTarget::new(set(*limit), 0.0) }
            }
            Drive::Velocity { target, limit } => {
                // a drive of any strength must not fight with the limit of the velocity
                let most = self.settings.max_velocity;
                let velocity = self.within_limits(level, target.max(-most).min(most));
                RowTarget { velocity, ..RowTarget::new(set(*limit), 0.0) }
            }
            Drive::Playback { motion, limit } if limit.is_infinite() => {
                let (position, velocity) = motion.at(time);
                RowTarget { velocity, ..RowTarget::new(RowSet::Equality, self.q - position) }
            }
            Drive::Playback { motion, limit } => {
                let velocity = match level.step() {
                    Some(h) => (motion.at(time + 0.5 * h).0 - (self.q - 0.5 * h * self.v)) / h,
                    None => motion.at(time).1,
                };
                RowTarget { velocity, ..RowTarget::new(level.bounded(*limit), 0.0) }
            }
        })
    }
}
