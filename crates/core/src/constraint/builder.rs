//! Conversion of constraints and contacts to rows.

use crate::constraint::rows::{RowSet, Rows};
use crate::derived::Cache;
use crate::object::collidable::ContactFrame;
use crate::object::part_state::{PartPoint, PartState};
use crate::object::{Constraint, Integratable, RowTarget};
use crate::world::view::{Entry, Mode, ObjectId, Objects};
use smallvec::SmallVec;
use tumble_collide::Vec3;

/// The fraction of the squared responses of two parts of one object below which their difference counts as none:
/// two points that are 0.1 mm apart in a meter, as for dependent rows in `solver/linkage.rs`.
const SAME: f64 = 1e-8;

/// The quantity that a row constrains. Rows of one kind in one constraint share a unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RowKind {
    /// Points, metric: m.
    Point,
    /// Rotations: rad.
    Rotation,
    /// Generalized coordinates of an object, in their own units.
    Coordinate,
}

/// Collects rows. [`row`](Self::row) starts a row; each `on_…` call then adds a term to its
/// velocity.
///
/// ```text
/// out.row(RowTarget::new(RowSet::Equality, drift))
///    .on_point(bead, 0, &p, &axis, 1.0)
///    .on_point(post, 0, &p, &axis, -1.0);
/// ```
pub struct RowBuilder<'a> {
    pub(crate) rows: &'a mut Rows,
    /// Velocity of each row due to sides without degrees of freedom (kinematic motion).
    pub(crate) bias: &'a mut Vec<f64>,
    pub(crate) targets: &'a mut Vec<RowTarget>,
    /// Kind of each target.
    pub(crate) kinds: &'a mut Vec<RowKind>,
    pub(crate) objects: Objects<'a>,
    pub(crate) x: &'a [f64],
    /// At which rows respond.
    pub(crate) caches: &'a mut [Cache],
    pub(crate) part_states: &'a [PartState],
    pub(crate) problem: &'a mut Option<String>,
    /// Constraint that owns the rows.
    pub(crate) owner: ObjectId,
}

impl RowBuilder<'_> {
    /// Returns the constraint that owns the rows, for objects that constrain themselves.
    pub fn owner(&self) -> ObjectId {
        self.owner
    }

    /// Starts a row. A `Cone` set is reserved for contacts, which the world makes itself: it is
    /// refused and the step reports an error.
    pub fn row(&mut self, target: RowTarget) -> &mut Self {
        let bounds = if let RowSet::Interval { lo, hi } = target.set { lo <= hi } else { true };
        if !(target.compliance.is_finite() && target.compliance >= 0.0) {
            self.refuse(format!("a row's compliance is {}; it must be finite and at least 0", target.compliance));
            return self;
        }
        if !(target.share > 0.0 && target.share <= 1.0) {
            self.refuse(format!("a row's share of the step is {}; it must be above 0 and at most 1", target.share));
            return self;
        }
        let finite = [target.error, target.velocity, target.bias_acceleration].iter().all(|x| x.is_finite());
        if target.set.rows() != 1 || !finite || !bounds {
            self.refuse("a constraint's row must be Equality, HalfLine or Interval (lo ≤ hi), with finite error, velocity and bias".into());
            return self;
        }
        self.rows.push_soft(target.set, target.compliance);
        self.bias.push(0.0);
        self.targets.push(target);
        self.kinds.push(RowKind::Point);
        self
    }

    /// Adds `sign` (±1, or any factor) times the velocity along `axis` of the material point of a
    /// part at world point `p`.
    pub fn on_point(&mut self, id: ObjectId, part: usize, p: &Vec3, axis: &Vec3, sign: f64) -> &mut Self {
        let objects = self.objects;
        if !self.open(p.iter().chain(axis.iter())) {
            return self;
        }
        self.on_part(objects.get(id), part, |row, entry| row.point_side(entry, part, p, &[*axis], sign));
        self
    }

    /// Adds `sign` (±1, or a factor such as a gear ratio) times the angular velocity of a part
    /// along the unit vector `axis`.
    ///
    /// Two test impulses of opposite sign express the rotation, so every part supports it: for unit
    /// `b ⟂ c` with `b × c = axis` it is exactly `(v(p + b) − v(p))·c`.
    pub fn on_rotation(&mut self, id: ObjectId, part: usize, axis: &Vec3, sign: f64) -> &mut Self {
        let objects = self.objects;
        if !self.open(axis.iter()) {
            return self;
        }
        self.is_of(RowKind::Rotation);
        let [_, b, c] = ContactFrame::new(Vec3::zeros(), *axis).axes;
        self.on_part(objects.get(id), part, |row, entry| {
            let p = row.part_states[entry.state_range.parts.start + part].position();
            row.point_side(entry, part, &(p + b), &[c], sign) && row.point_side(entry, part, &p, &[c], -sign)
        });
        self
    }

    fn is_of(&mut self, kind: RowKind) {
        self.kinds.last_mut().into_iter().for_each(|last| *last = kind);
    }

    /// Calls `add` to add a side to the row. Refuses the row if the object is gone, has no such
    /// part, or is the third one.
    fn on_part(&mut self, entry: Option<Entry>, part: usize, add: impl FnOnce(&mut Self, &Entry) -> bool) {
        let Some(entry) = entry else { return self.refuse("a row names an object that is not in the world".into()) };
        let before = self.last_side(&entry).map(|y| y.to_vec());
        if part >= entry.state_range.parts.len() || !add(self, &entry) {
            self.refuse(format!(
                "'{}' has no part {part} that answers impulses, or the row names a third object",
                entry.name
            ));
        } else if let (Some(before), Some(y)) = (before, self.last_side(&entry)) {
            drop_common_motion(&before, y);
        }
    }

    /// Returns the responses of the last row on an object; `None` if the row has no such side.
    fn last_side(&mut self, entry: &Entry) -> Option<&mut [f64]> {
        let side = *self.rows.blocks.last()?.sides().iter().find(|s| s.u as usize == entry.state_range.v.start)?;
        Some(&mut self.rows.y[side.y as usize..(side.y + side.dof) as usize])
    }

    /// Adds `Σ j_k · v_k` over the generalized velocities of one object.
    pub fn on_coordinates(&mut self, id: ObjectId, jacobian: &[f64]) -> &mut Self {
        let objects = self.objects;
        if !self.open(jacobian.iter()) {
            return self;
        }
        self.is_of(RowKind::Coordinate);
        let Some(entry) = objects.get(id) else {
            self.refuse("a row names an object that is not in the world".into());
            return self;
        };
        let done = entry.object.integratable().filter(|i| i.state_sizes().dof == jacobian.len()).is_some_and(|i| {
            if !entry.moves() {
                return self.kinematic_coordinates(&entry, i, jacobian);
            }
            let mut y = SmallVec::<[f64; 32]>::from_elem(0.0, jacobian.len());
            i.solve_lt(&mut self.caches[entry.place], jacobian, &mut y);
            let side = self.rows.side(entry.state_range.v.start, y.len());
            side.map(|side| side.iter_mut().zip(&y).for_each(|(s, y)| *s += y)).is_some()
        });
        if !done {
            self.refuse(format!(
                "'{}': the row's Jacobian has {} numbers, or it names a third object",
                entry.name,
                jacobian.len()
            ));
        }
        self
    }

    /// Returns the index of the row that was started last, for [`like`](Self::like).
    pub(crate) fn last(&self) -> usize {
        self.rows.blocks.len().saturating_sub(1)
    }

    /// Gives the row the responses of an earlier row on coordinates of one object, times `factor`. Returns
    /// false, and does nothing, if that row has none.
    pub(crate) fn like(&mut self, earlier: usize, factor: f64) -> bool {
        let Some(&[side]) = self.rows.blocks.get(earlier).map(|block| block.sides()) else { return false };
        if self.problem.is_some() || self.targets.is_empty() {
            return false;
        }
        self.is_of(RowKind::Coordinate);
        let (from, dof) = (side.y as usize, side.dof as usize);
        if self.rows.side(side.u as usize, dof).is_some() {
            let to = self.rows.y.len() - dof;
            let (before, added) = self.rows.y.split_at_mut(to);
            added.iter_mut().zip(&before[from..from + dof]).for_each(|(to, from)| *to = factor * from);
        }
        true
    }

    /// Returns whether a row is open and the given numbers are finite; refuses the row otherwise.
    fn open<'n>(&mut self, mut numbers: impl Iterator<Item = &'n f64>) -> bool {
        let finite = numbers.all(|x| x.is_finite());
        if self.problem.is_none() && (self.targets.is_empty() || !finite) {
            self.refuse("a row's points, axes and Jacobians must be finite, and `row` comes first".into());
        }
        self.problem.is_none()
    }

    /// Adds the velocity of a kinematic object along a row in its generalized coordinates.
    fn kinematic_coordinates(&mut self, entry: &Entry, body: &dyn Integratable, jacobian: &[f64]) -> bool {
        if entry.status.mode == Mode::Kinematic && entry.status.enabled {
            let mut v = vec![0.0; jacobian.len()];
            body.velocity(&self.x[entry.state_range.x.clone()], &mut v);
            let kinematic: f64 = v.iter().zip(jacobian).map(|(v, j)| v * j).sum();
            self.bias.last_mut().into_iter().for_each(|bias| *bias += kinematic);
        }
        true
    }

    /// Adds one side to the last block: a test impulse for a dynamic object, a velocity for any
    /// other.
    pub(crate) fn point_side(&mut self, entry: &Entry, part: usize, p: &Vec3, axes: &[Vec3], sign: f64) -> bool {
        let part_state = &self.part_states[entry.state_range.parts.start + part];
        if entry.moves() {
            let Some(body) = entry.object.integratable() else { return false };
            let Some(y) = self.rows.side(entry.state_range.v.start, entry.state_range.v.len()) else { return false };
            body.test_impulse(&mut self.caches[entry.place], &PartPoint { part, part_state, point: *p, axes }, sign, y);
        } else {
            let velocity = part_state.velocity_at(p);
            let first = self.bias.len() - axes.len();
            for (bias, axis) in self.bias[first..].iter_mut().zip(axes) {
                *bias += sign * velocity.dot(axis);
            }
        }
        true
    }

    pub(crate) fn refuse(&mut self, why: String) {
        self.problem.get_or_insert(why);
    }
}

/// Sets the response of a row between two parts of one object to 0 if both parts respond alike: `before` is the
/// response of the first part, `y` that of both.
///
/// ```text
/// y = y₁ + y₂ = 0    if |y|² ≤ SAME·(|y₁|² + |y₂|²)
/// ```
///
/// What is left of such a row is rounding and the gap of the joint. A solver that held it would stop the motion
/// that both parts share: the bead of a governor that is pinned to its spindle's plane would stop the spindle.
fn drop_common_motion(before: &[f64], y: &mut [f64]) {
    let (mut first, mut second, mut both) = (0.0, 0.0, 0.0);
    for (a, y) in before.iter().zip(y.iter()) {
        first += a * a;
        second += (y - a) * (y - a);
        both += y * y;
    }
    if both <= SAME * (first + second) {
        y.fill(0.0);
    }
}

/// Returns the enabled constraints in the order of insertion. Constraints that act only on an
/// object that impulses do not move are left out.
pub(crate) fn constraints<'a>(objects: Objects<'a>) -> impl Iterator<Item = (ObjectId, Entry<'a>, &'a dyn Constraint)> {
    let entries = objects.iter().map(move |e| (objects.table.order[e.place], e));
    entries
        .filter(|(_, e)| e.status.enabled)
        .filter_map(|(id, e)| Some((id, e, e.object.constraint().filter(|c| e.moves() || !c.on_itself())?)))
}
