//! Rows of joints: limits, velocity limits, dry friction, drives, couplings (equations in `dof.rs`).

use super::body::ArticulatedBody;
use crate::articulated::model::coordinates::read_vector;
use crate::articulated::model::dof::{DofSettings, Drive};
use crate::articulated::swing::{Swing, turn_from};
use crate::constraint::builder::RowBuilder;
use crate::constraint::dof_rows::DofState;
use crate::constraint::loop_joint::near;
use crate::constraint::rows::RowSet;
use crate::contact::warm_starts::RowStart;
use crate::object::part_state::StateRange;
use crate::object::{Constraint, Level, RowTarget, SpringRow};
use crate::rotation_vector::RotationVector;
use crate::world::view::WorldView;
use smallvec::{SmallVec, smallvec};
use tumble_collide::Vec3;

impl ArticulatedBody {
    /// Returns whether any setting or coupling makes a row.
    pub(super) fn has_rows(&self) -> bool {
        let rows = |f: &DofSettings| {
            let resists = f.friction > 0.0 || f.damping > 0.0 || f.max_velocity.is_finite();
            let holds = f.limits.is_some() || f.twist_limits.is_some() || f.drive != Drive::None;
            resists || holds || f.spring.is_some()
        };
        !self.couplings.is_empty() || self.dofs().iter().any(rows)
    }

    /// Calls `act` with each degree of freedom: the index of its velocity, its state and what springs see. Positions are 0
    /// if there are none.
    fn each_dof<'a>(&'a self, x: &'a [f64], time: f64, mut act: impl FnMut(usize, DofState<'a>, Sprung)) {
        let n = self.model.positions();
        for link in self.model.links() {
            let dof = link.joint.dof();
            let own = &self.dofs()[link.v..link.v + dof];
            let v = &x[n + link.v..];
            let driven = match dof {
                1 => [x[link.q]; 3],
                3 => driven_positions(&x[link.q..], own, time),
                _ => [0.0; 3],
            };
            let turned = if dof == 3 { turned(&x[link.q..], v, own) } else { None };
            for (k, settings) in own.iter().enumerate() {
                let limits = settings.limits.filter(|_| dof == 1);
                let q = if dof <= 3 { driven[k] } else { 0.0 };
                let sprung = match &turned {
                    Some((from, vector)) => Sprung {
                        position: from[k] + vector.r[k],
                        rate: vector.rate[k],
                        turns: Some(Turns::of(link.v, vector.gradient(k), v)),
                    },
                    None => Sprung { position: q, rate: v[k], turns: None },
                };
                act(link.v + k, DofState { q, v: v[k], settings, limits }, sprung);
            }
        }
    }

    /// Adds the forces of springs, damping and position drives where they are no rows.
    pub(super) fn joint_forces(&self, x: &[f64], implicit: bool, time: f64, out: &mut [f64]) {
        if implicit {
            return;
        }
        self.each_dof(x, time, |index, DofState { q, v, settings, .. }, sprung| {
            out[index] += settings.explicit_force(q, v);
            let force = settings.spring_force(sprung.position);
            match sprung.turns {
                Some(Turns { first, along, .. }) => (0..3).for_each(|k| out[first + k] += force * along[k]),
                None => out[index] += force,
            }
        });
    }

    /// Adds the impulses of drives to `out`, one number per degree of freedom, for the forces `rows` of its rows over a
    /// sub-step of `h` seconds that ended at the state `x`.
    ///
    /// A drive and a damping that share a row divide its force by the velocity at the end: `f_drive = f + d·v`.
    pub(crate) fn add_drives(&self, x: &[f64], time: f64, rows: &[RowStart], h: f64, out: &mut [f64]) {
        let mut limits = 0;
        self.each_limit(x, |_| limits += 1);
        self.each_velocity_limit(x, |_, _, _| limits += 1);
        let targets = |level: Level| -> Vec<usize> {
            let mut counts = Vec::with_capacity(self.dofs().len());
            self.each_dof(x, time, |_, dof, sprung| {
                let mut count = 0;
                let spring = spring_of(&dof, &sprung, level);
                spring.iter().for_each(|_| count += 1);
                dof.forces(level, time, |_| count += 1);
                counts.push(count);
            });
            counts
        };
        let levels = [Level::Velocity { h }, Level::Acceleration { h, soft: None }];
        let of = |level: &Level| limits + targets(*level).iter().sum::<usize>() + self.couplings.len() == rows.len();
        let Some(level) = levels.into_iter().find(of) else { return };
        let (mut end, mut counts) = (limits, targets(level).into_iter());
        self.each_dof(x, time, |index, dof, sprung| {
            let count = counts.next().unwrap_or(0);
            end += count;
            let damping = dof.settings.damping * dof.v;
            let springs = usize::from(spring_of(&dof, &sprung, level).is_some());
            let resisting = usize::from(dof.settings.friction > 0.0) + usize::from(dof.settings.damping > 0.0);
            out[index] += h * match (dof.drive(level, time), level.soft_step()) {
                (Some(_), soft) if count > 0 => {
                    let shared = soft.is_some() && count == springs + resisting;
                    rows[end - 1].force + if shared { damping } else { 0.0 }
                }
                (None, None) => dof.settings.explicit_force(dof.q, dof.v) + damping,
                _ => 0.0,
            };
        });
    }

    /// Returns the energy of the springs, J.
    pub(super) fn spring_energy(&self, x: &[f64]) -> f64 {
        let mut energy = 0.0;
        self.each_dof(x, 0.0, |_, dof, sprung| {
            energy += dof.settings.spring.map_or(0.0, |s| 0.5 * s.stiffness * (sprung.position - s.rest).powi(2));
        });
        energy
    }

    /// Calls `act` with the limits in the order of their rows: for each degree of freedom the lower, then the upper; of a spherical
    /// joint the cone and the limits of the twist about its axis.
    fn each_limit(&self, x: &[f64], mut act: impl FnMut(Limit)) {
        let n = self.model.positions();
        for link in self.model.links() {
            let (dof, q) = (link.joint.dof(), &x[link.q..]);
            for (k, settings) in self.dofs()[link.v..link.v + dof].iter().enumerate() {
                match dof {
                    1 => {
                        let state = DofState { q: q[0], v: x[n + link.v], settings, limits: settings.limits };
                        state.limits().for_each(|(sign, gap)| {
                            act(Limit { gap, along: Along::Dof { index: link.v, sign } });
                        });
                    }
                    3 => {
                        let v = &x[n + link.v..];
                        if let Some([_, cone]) = settings.limits.filter(|[_, cone]| cone.is_finite()) {
                            act(Limit::of_cone(cone, link.v, Swing::of(k, q, v)));
                        }
                        if let Some(limits) = settings.twist_limits {
                            Limit::of_twist(limits, link.v, &Swing::twist(k, q, v)).into_iter().for_each(&mut act);
                        }
                    }
                    _ => {}
                }
            }
        }
    }

    /// Calls `act` with the rows of the velocity limits: index of the degree of freedom, sign and target.
    fn each_velocity_limit(&self, x: &[f64], mut act: impl FnMut(usize, f64, RowTarget)) {
        if self.dofs().iter().any(|settings| settings.max_velocity.is_finite()) {
            self.each_dof(x, 0.0, |index, dof, _| {
                dof.velocity_limits().for_each(|(sign, target)| act(index, sign, target));
            });
        }
    }
}

impl Constraint for ArticulatedBody {
    fn rows(&self, me: &StateRange, view: &WorldView, level: Level, out: &mut RowBuilder) {
        let x = &view.x[me.x.clone()];
        let dof = self.model.dof();
        let mut maker = RowMaker { unit: smallvec![0.0; dof], known: smallvec![None; dof], out };
        self.each_limit(x, |Limit { gap, along }| {
            let target = RowTarget::new(RowSet::HalfLine, gap);
            match along {
                Along::Dof { index, sign } => maker.row_of(target, index, sign),
                Along::Swing { first, jacobian, bias_acceleration } => {
                    let entries = [0, 1, 2].map(|k| (first + k, jacobian[k]));
                    maker.row(RowTarget { bias_acceleration, ..target }, &entries);
                }
            }
        });
        self.each_velocity_limit(x, |index, sign, target| maker.row_of(target, index, sign));
        self.each_dof(x, view.time, |index, dof, sprung| {
            if let Some(target) = spring_of(&dof, &sprung, level) {
                match sprung.turns {
                    None => maker.row_of(target, index, 1.0),
                    Some(Turns { first, along, bias_acceleration }) => {
                        let entries = [0, 1, 2].map(|k| (first + k, along[k]));
                        maker.row(RowTarget { bias_acceleration, ..target }, &entries);
                    }
                }
            }
            dof.forces(level, view.time, |target| maker.row_of(target, index, 1.0));
        });
        for c in &self.couplings {
            let position = |dof| self.position_of(dof).map_or(0.0, |q| x[q]);
            let error = position(c.dof) - c.multiplier * position(c.of) - c.offset;
            maker.row(RowTarget::new(RowSet::Equality, error), &[(c.dof, 1.0), (c.of, -c.multiplier)]);
        }
    }

    fn gaps(&self, me: &StateRange, view: &WorldView, out: &mut Vec<f64>) {
        out.reserve(2 * self.dofs().len());
        self.each_limit(&view.x[me.x.clone()], |limit| out.push(limit.gap));
    }

    fn on_itself(&self) -> bool {
        true
    }

    fn reads_part_states(&self) -> bool {
        false
    }
}

/// The coordinate along which the spring of a degree of freedom pulls.
struct Sprung {
    /// rad or m.
    position: f64,
    /// rad/s or m/s.
    rate: f64,
    /// The row, if the joint is spherical.
    turns: Option<Turns>,
}

/// The rate of a component of the rotation vector of a spherical joint.
struct Turns {
    /// The first degree of freedom of the joint.
    first: usize,
    /// The rate by the velocities of the three.
    along: Vec3,
    /// Its rate at constant velocities, rad/s².
    bias_acceleration: f64,
}

impl Turns {
    fn of(first: usize, [along, turning]: [Vec3; 2], v: &[f64]) -> Turns {
        Turns { first, along, bias_acceleration: turning.dot(&read_vector(v)) }
    }
}

/// Returns the target of the row of a spring, if it is a row.
fn spring_of(dof: &DofState, sprung: &Sprung, level: Level) -> Option<RowTarget> {
    let (spring, damping) = (dof.settings.spring?, dof.settings.damping);
    let state = DofState { v: sprung.rate, q: dof.q, settings: dof.settings, limits: dof.limits };
    let target = state.spring(level, sprung.position)?;
    let row = SpringRow { extension: sprung.position - spring.rest, stiffness: spring.stiffness, damping };
    Some(RowTarget { spring: Some(row), ..target })
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

/// Returns the positions of the degrees of freedom of a spherical joint with the position numbers `q` that drives see: their
/// goal and the way from there.
fn driven_positions(q: &[f64], dofs: &[DofSettings], time: f64) -> [f64; 3] {
    let target = |dof: &DofSettings| match &dof.drive {
        Drive::Position { target, .. } => Some(*target),
        Drive::Playback { motion, .. } => Some(motion.at(time).0),
        Drive::None | Drive::Velocity { .. } => None,
    };
    if dofs.iter().all(|dof| target(dof).is_none()) {
        return [0.0; 3];
    }
    let from = Vec3::from_fn(|k, _| target(&dofs[k]).unwrap_or(0.0));
    (from + turn_from(q, &from)).into()
}

/// Returns the rest of the springs of a spherical joint with the position numbers `q` and the velocities `v`, and the rotation vector
/// from there; `None` if it has no springs.
fn turned(q: &[f64], v: &[f64], dofs: &[DofSettings]) -> Option<(Vec3, RotationVector)> {
    let rest = |dof: &DofSettings| dof.spring.map(|spring| spring.rest);
    if dofs.iter().all(|dof| rest(dof).is_none()) {
        return None;
    }
    let from = Vec3::from_fn(|k, _| rest(&dofs[k]).unwrap_or(0.0));
    Some((from, RotationVector::inside(turn_from(q, &from), &read_vector(v))))
}

/// Makes rows on the generalized coordinates of the owner.
struct RowMaker<'a, 'b> {
    unit: SmallVec<[f64; 32]>,
    /// The first row along each degree of freedom, with its sign.
    known: SmallVec<[Option<(usize, f64)>; 32]>,
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
