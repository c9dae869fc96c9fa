//! Rows of joints: limits, velocity limits, dry friction, drives, couplings (equations in `dof.rs`).

use super::body::ArticulatedBody;
use crate::articulated::model::dof::{DofSettings, Drive};
use crate::articulated::swing::Swing;
use crate::constraint::builder::RowBuilder;
use crate::constraint::dof_rows::DofState;
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
            resists || f.limits.is_some() || f.drive != Drive::None
        };
        !self.couplings.is_empty() || self.dofs().iter().any(rows)
    }

    /// Returns the degrees of freedom with the indices of their velocities; the position is 0 if
    /// there is none.
    fn dof_states<'a>(&'a self, x: &'a [f64]) -> impl Iterator<Item = (usize, DofState<'a>)> {
        let n = self.model.positions();
        self.model.links().iter().flat_map(move |link| {
            (0..link.joint.dof()).map(move |k| {
                let index = link.v + k;
                let q = if link.joint.dof() == 1 { x[link.q] } else { 0.0 };
                (index, DofState { q, v: x[n + index], settings: &self.dofs()[index] })
            })
        })
    }

    /// Adds the forces of springs and, where rows are not implicit, of damping and position drives.
    pub(super) fn joint_forces(&self, x: &[f64], implicit: bool, out: &mut [f64]) {
        for (index, DofState { q, v, settings }) in self.dof_states(x) {
            out[index] += settings.spring_force(q) + if implicit { 0.0 } else { settings.explicit_force(q, v) };
        }
    }

    /// Adds the impulses of drives to `out`, one number per degree of freedom, for the forces `rows` of its rows over a
    /// sub-step of `h` seconds that ended at the state `x`.
    ///
    /// A drive and a damping that share a row divide its force by the velocity at the end: `f_drive = f + d·v`.
    pub(crate) fn add_drives(&self, x: &[f64], time: f64, rows: &[RowStart], h: f64, out: &mut [f64]) {
        let limits = self.limits(x).count() + self.velocity_limits(x).count();
        let targets = |level: Level| -> Vec<usize> {
            let count = |(_, dof): (usize, DofState)| {
                let mut count = 0;
                dof.forces(level, time, |_| count += 1);
                count
            };
            self.dof_states(x).map(count).collect()
        };
        let levels = [Level::Velocity { h }, Level::Acceleration { h, soft: None }];
        let of = |level: &Level| limits + targets(*level).iter().sum::<usize>() + self.couplings.len() == rows.len();
        let Some(level) = levels.into_iter().find(of) else { return };
        let mut end = limits;
        for ((index, dof), count) in self.dof_states(x).zip(targets(level)) {
            end += count;
            let damping = dof.settings.damping * dof.v;
            let resisting = usize::from(dof.settings.friction > 0.0) + usize::from(dof.settings.damping > 0.0);
            out[index] += h * match (dof.drive(level, time), level.soft_step()) {
                (Some(_), soft) if count > 0 => {
                    let shared = soft.is_some() && count == resisting;
                    rows[end - 1].force + if shared { damping } else { 0.0 }
                }
                (None, None) => dof.settings.explicit_force(dof.q, dof.v) + damping,
                _ => 0.0,
            };
        }
    }

    /// Returns the energy of the springs, J.
    pub(super) fn spring_energy(&self, x: &[f64]) -> f64 {
        let energy = |p: DofState| p.settings.spring.map_or(0.0, |s| 0.5 * s.stiffness * (p.q - s.rest).powi(2));
        self.dof_states(x).map(|(_, p)| energy(p)).sum()
    }

    /// Returns the limits in the order of their rows: for each degree of freedom the lower, then the upper.
    fn limits<'a>(&'a self, x: &'a [f64]) -> impl Iterator<Item = Limit> {
        let n = self.model.positions();
        self.model.links().iter().filter(|link| matches!(link.joint.dof(), 1 | 3)).flat_map(move |link| {
            let single = link.joint.dof() == 1;
            (0..link.joint.dof()).flat_map(move |k| {
                let (index, settings) = (link.v + k, &self.dofs()[link.v + k]);
                let state = DofState { q: x[link.q], v: x[n + index], settings };
                let sides = state.limits().filter(move |_| single);
                let sides = sides.map(move |(sign, gap)| Limit { gap, along: Along::Dof { index, sign } });
                let cone = settings.limits.filter(|[_, cone]| !single && cone.is_finite());
                let cone =
                    cone.map(|[_, cone]| Limit::of_cone(cone, link.v, Swing::of(k, &x[link.q..], &x[n + link.v..])));
                sides.chain(cone)
            })
        })
    }

    /// Returns the rows of the velocity limits: index of the degree of freedom, sign and target.
    fn velocity_limits<'a>(&'a self, x: &'a [f64]) -> impl Iterator<Item = (usize, f64, RowTarget)> {
        self.dof_states(x).flat_map(|(index, p)| p.velocity_limits().map(move |(sign, target)| (index, sign, target)))
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
        for (index, dof_state) in self.dof_states(x) {
            dof_state.forces(level, view.time, |target| maker.row_of(target, index, 1.0));
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
