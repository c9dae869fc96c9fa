//! Rows of joints: limits, velocity limits, dry friction, drives, couplings (equations in `dof.rs`).

use super::body::ArticulatedBody;
use crate::articulated::model::dof::{DofSettings, Drive};
use crate::articulated::swing::{Swing, turn_from};
use crate::constraint::builder::RowBuilder;
use crate::constraint::dof_rows::DofState;
use crate::constraint::loop_joint::near;
use crate::constraint::rows::RowSet;
use crate::contact::warm_starts::RowStart;
use crate::object::part_state::StateRange;
use crate::object::{Constraint, Level, RowTarget};
use crate::world::view::WorldView;
use tumble_collide::Vec3;

impl ArticulatedBody {
    /// Returns whether any setting or coupling makes a row.
    pub(super) fn has_rows(&self) -> bool {
        let rows = |f: &DofSettings| {
            let resists = f.friction > 0.0 || f.damping > 0.0 || f.max_velocity.is_finite();
            resists || f.limits.is_some() || f.twist_limits.is_some() || f.drive != Drive::None
        };
        let sprung = |(k, f): (usize, &DofSettings)| f.spring.is_some() && self.has_soft_spring(k);
        !self.couplings.is_empty() || self.dofs().iter().any(rows) || self.dofs().iter().enumerate().any(sprung)
    }

    /// Returns the degrees of freedom with the indices of their velocities and the positions that springs see; positions are 0 if
    /// there are none.
    fn dof_states<'a>(&'a self, x: &'a [f64], time: f64) -> impl Iterator<Item = (usize, DofState<'a>, f64)> {
        let n = self.model.positions();
        self.model.links().iter().flat_map(move |link| {
            let (dof, own) = (link.joint.dof(), &self.dofs()[link.v..link.v + link.joint.dof()]);
            let [driven, sprung] = match dof {
                1 => [[x[link.q]; 3]; 2],
                3 => ball_positions(&x[link.q..], own, time),
                _ => [[0.0; 3]; 2],
            };
            (0..dof).map(move |k| {
                let (index, settings) = (link.v + k, &own[k]);
                let limits = settings.limits.filter(|_| dof == 1);
                let (q, rest) = if dof <= 3 { (driven[k], sprung[k]) } else { (0.0, 0.0) };
                (index, DofState { q, v: x[n + index], settings, limits }, rest)
            })
        })
    }

    /// Returns whether the spring of a degree of freedom is a row wherever soft forces are rows.
    fn has_soft_spring(&self, index: usize) -> bool {
        self.position_of(index).is_none()
    }

    /// Calls `row` with the targets of the rows of a degree of freedom that carry forces: spring, dry friction, damping, drive.
    fn forces_of(
        &self,
        (index, dof, sprung): &(usize, DofState, f64),
        level: Level,
        time: f64,
        mut row: impl FnMut(RowTarget),
    ) {
        if dof.settings.spring.is_some() && self.has_soft_spring(*index) {
            dof.spring(level, *sprung).into_iter().for_each(&mut row);
        }
        dof.forces(level, time, row);
    }

    /// Adds the forces of springs and, where rows are not implicit, of damping and position drives.
    pub(super) fn joint_forces(&self, x: &[f64], implicit: bool, time: f64, out: &mut [f64]) {
        for (index, dof, sprung) in self.dof_states(x, time) {
            let DofState { q, v, settings, .. } = dof;
            if settings.spring.is_some() && !(implicit && self.has_soft_spring(index)) {
                out[index] += settings.spring_force(sprung);
            }
            out[index] += if implicit { 0.0 } else { settings.explicit_force(q, v) };
        }
    }

    /// Adds the impulses of drives to `out`, one number per degree of freedom, for the forces `rows` of its rows over a
    /// sub-step of `h` seconds that ended at the state `x`.
    ///
    /// A drive and a damping that share a row divide its force by the velocity at the end: `f_drive = f + d·v`.
    pub(crate) fn add_drives(&self, x: &[f64], time: f64, rows: &[RowStart], h: f64, out: &mut [f64]) {
        let limits = self.limits(x).count() + self.velocity_limits(x).count();
        let targets = |level: Level| -> Vec<usize> {
            let count = |dof: (usize, DofState, f64)| {
                let mut count = 0;
                self.forces_of(&dof, level, time, |_| count += 1);
                count
            };
            self.dof_states(x, time).map(count).collect()
        };
        let levels = [Level::Velocity { h }, Level::Acceleration { h, soft: None }];
        let of = |level: &Level| limits + targets(*level).iter().sum::<usize>() + self.couplings.len() == rows.len();
        let Some(level) = levels.into_iter().find(of) else { return };
        let mut end = limits;
        for ((index, dof, sprung), count) in self.dof_states(x, time).zip(targets(level)) {
            end += count;
            let damping = dof.settings.damping * dof.v;
            let spring = dof.settings.spring.is_some() && self.has_soft_spring(index);
            let springs = usize::from(spring && dof.spring(level, sprung).is_some());
            let resisting = usize::from(dof.settings.friction > 0.0) + usize::from(dof.settings.damping > 0.0);
            out[index] += h * match (dof.drive(level, time), level.soft_step()) {
                (Some(_), soft) if count > 0 => {
                    let shared = soft.is_some() && count == springs + resisting;
                    rows[end - 1].force + if shared { damping } else { 0.0 }
                }
                (None, None) => dof.settings.explicit_force(dof.q, dof.v) + damping,
                _ => 0.0,
            };
        }
    }

    /// Returns the energy of the springs, J.
    pub(super) fn spring_energy(&self, x: &[f64]) -> f64 {
        let energy = |(_, dof, q): (usize, DofState, f64)| {
            dof.settings.spring.map_or(0.0, |s| 0.5 * s.stiffness * (q - s.rest).powi(2))
        };
        self.dof_states(x, 0.0).map(energy).sum()
    }

    /// Returns the limits in the order of their rows: for each degree of freedom the lower, then the upper; of a spherical joint
    /// the cone and the limits of the twist about its axis.
    fn limits<'a>(&'a self, x: &'a [f64]) -> impl Iterator<Item = Limit> {
        let n = self.model.positions();
        self.model.links().iter().filter(|link| matches!(link.joint.dof(), 1 | 3)).flat_map(move |link| {
            let single = link.joint.dof() == 1;
            (0..link.joint.dof()).flat_map(move |k| {
                let (index, settings) = (link.v + k, &self.dofs()[link.v + k]);
                let limits = settings.limits.filter(|_| single);
                let state = DofState { q: x[link.q], v: x[n + index], settings, limits };
                let sides = state.limits().map(move |(sign, gap)| Limit { gap, along: Along::Dof { index, sign } });
                let (q, v) = (&x[link.q..], &x[n + link.v..]);
                let cone = settings.limits.filter(|[_, cone]| !single && cone.is_finite());
                let cone = cone.map(|[_, cone]| Limit::of_cone(cone, link.v, Swing::of(k, q, v)));
                let twist = settings.twist_limits.filter(|_| !single);
                let twist =
                    twist.into_iter().flat_map(move |limits| Limit::of_twist(limits, link.v, &Swing::twist(k, q, v)));
                sides.chain(cone).chain(twist)
            })
        })
    }

    /// Returns the rows of the velocity limits: index of the degree of freedom, sign and target.
    fn velocity_limits<'a>(&'a self, x: &'a [f64]) -> impl Iterator<Item = (usize, f64, RowTarget)> {
        self.dof_states(x, 0.0)
            .flat_map(|(index, p, _)| p.velocity_limits().map(move |(sign, target)| (index, sign, target)))
    }
}

impl Constraint for ArticulatedBody {
    fn rows(&self, me: &StateRange, view: &WorldView, level: Level, out: &mut RowBuilder) {
        let x = &view.x[me.x.clone()];
        let dof = self.model.dof();
        let mut maker = RowMaker { unit: vec![0.0; dof], known: vec![None; dof], out };
        for Limit { gap, along } in self.limits(x) {
            let target = RowTarget::new(RowSet::HalfLine, gap);
            match along {
                Along::Dof { index, sign } => maker.row_of(target, index, sign),
                Along::Swing { first, jacobian, bias_acceleration } => {
                    let entries = [0, 1, 2].map(|k| (first + k, jacobian[k]));
                    maker.row(RowTarget { bias_acceleration, ..target }, &entries);
                }
            }
        }
        for (index, sign, target) in self.velocity_limits(x) {
            maker.row_of(target, index, sign);
        }
        for dof in self.dof_states(x, view.time) {
            self.forces_of(&dof, level, view.time, |target| maker.row_of(target, dof.0, 1.0));
        }
        for c in &self.couplings {
            let position = |dof| self.position_of(dof).map_or(0.0, |q| x[q]);
            let error = position(c.dof) - c.multiplier * position(c.of) - c.offset;
            maker.row(RowTarget::new(RowSet::Equality, error), &[(c.dof, 1.0), (c.of, -c.multiplier)]);
        }
    }

    fn gaps(&self, me: &StateRange, view: &WorldView, out: &mut Vec<f64>) {
        out.extend(self.limits(&view.x[me.x.clone()]).map(|limit| limit.gap));
    }

    fn on_itself(&self) -> bool {
        true
    }

    fn reads_part_states(&self) -> bool {
        false
    }
}

/// A limit of a joint.
struct Limit {
    /// rad or m.
    gap: f64,
    along: Along,
}

/// The velocity at which a gap opens.
enum Along {
    /// `sign` times that of a degree of freedom.
    Dof { index: usize, sign: f64 },
    /// A combination of the three of a spherical joint.
    Swing { first: usize, jacobian: Vec3, bias_acceleration: f64 },
}

impl Limit {
    fn of_cone(cone: f64, first: usize, Swing { angle, jacobian, bias }: Swing) -> Limit {
        Limit { gap: cone - angle, along: Along::Swing { first, jacobian: -jacobian, bias_acceleration: -bias } }
    }

    /// Returns the limits of a twist: the lower, then the upper.
    fn of_twist([lo, hi]: [f64; 2], first: usize, twist: &Swing) -> [Limit; 2] {
        let angle = near(twist.angle, 0.5 * (lo + hi));
        [(1.0, angle - lo), (-1.0, hi - angle)].map(|(sign, gap)| {
            let (jacobian, bias_acceleration) = (sign * twist.jacobian, sign * twist.bias);
            Limit { gap, along: Along::Swing { first, jacobian, bias_acceleration } }
        })
    }
}

/// Returns the positions of the degrees of freedom of a spherical joint with the position numbers `q` that drives and springs
/// see: their goal and the way from there.
fn ball_positions(q: &[f64], dofs: &[DofSettings], time: f64) -> [[f64; 3]; 2] {
    let target = |dof: &DofSettings| match &dof.drive {
        Drive::Position { target, .. } => Some(*target),
        Drive::Playback { motion, .. } => Some(motion.at(time).0),
        Drive::None | Drive::Velocity { .. } => None,
    };
    let rest = |dof: &DofSettings| dof.spring.map(|spring| spring.rest);
    let from = |goal: &dyn Fn(&DofSettings) -> Option<f64>| {
        if dofs.iter().all(|dof| goal(dof).is_none()) {
            return [0.0; 3];
        }
        let from = Vec3::from_fn(|k, _| goal(&dofs[k]).unwrap_or(0.0));
        (from + turn_from(q, &from)).into()
    };
    [from(&target), from(&rest)]
}

/// Makes rows on the generalized coordinates of the owner.
struct RowMaker<'a, 'b> {
    unit: Vec<f64>,
    /// The first row along each degree of freedom, with its sign.
    known: Vec<Option<(usize, f64)>>,
    out: &'a mut RowBuilder<'b>,
}

impl RowMaker<'_, '_> {
    /// Makes a row along one degree of freedom.
    fn row_of(&mut self, target: RowTarget, index: usize, sign: f64) {
        if let Some((row, of_row)) = self.known[index] {
            self.out.row(target);
            if self.out.like(row, sign * of_row) {
                return;
            }
            let owner = self.out.owner();
            self.unit[index] = sign;
            self.out.on_coordinates(owner, &self.unit);
            self.unit[index] = 0.0;
            return;
        }
        self.row(target, &[(index, sign)]);
        self.known[index] = Some((self.out.last(), sign));
    }

    fn row(&mut self, target: RowTarget, entries: &[(usize, f64)]) {
        let owner = self.out.owner();
        entries.iter().for_each(|&(i, value)| self.unit[i] = value);
        self.out.row(target).on_coordinates(owner, &self.unit);
        entries.iter().for_each(|&(i, _)| self.unit[i] = 0.0);
    }
}
