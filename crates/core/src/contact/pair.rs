//! Narrow-phase queries of a pair within a step: whether to query, with which margin, and at what
//! time.
//!
//! Queries between meshes and cylinders are expensive. They are skipped if the bounding boxes stay
//! apart (`separation.rs`), and cached within a frame while the poses do not change. Two meshes of
//! many vertices are not queried with the wide margin that fast bodies need; they are followed
//! along free motion instead.
//!
//! The contacts of two meshes are also kept from the end of a frame to the start of the next. They are a function of
//! shapes, poses and margin, and are kept for the same bits of all three, so results do not depend on what is kept. Their
//! margin is rounded up to a quarter or a sixteenth of a power of two (`⌈m⌉₄` and `⌈m⌉₁₆` below), so that the margin at the
//! end of a frame is nearly always that of the start, although forces differ a little:
//!
//! ```text
//! margin = ⌈min(closing, near + 0.05·R)⌉₄       R: bounding radius of the smaller mesh
//! margin = ⌈closing⌉₁₆                          if a mesh has few vertices
//! ```

use crate::contact::separation::{OrientedBox, are_separated};
use crate::contact::time_of_impact::{Approach, MovingPair, Search};
use crate::object::part_state::PartState;
use std::sync::Arc;
use tumble_collide::{Aabb, Contact, ContactMode, Pose, Shape, Vec3};

/// Margin of two sphere trees in the `spheres` mode, as a fraction of the smaller bounding radius.
const TREE_MARGIN: f64 = 0.02;
/// Margin of two meshes in the `surface` mode, as a fraction of the smaller bounding radius. Beyond
/// it they are followed along free motion: a wide margin includes most of both surfaces.
const MESH_MARGIN: f64 = 0.05;
/// Maximum number of corners of a mesh that is queried with the full margin.
const SIMPLE_MESH_CORNERS: usize = 64;
/// Number of samples along free motion; twice as many if the bodies come near and do not touch.
const MAX_SAMPLES: f64 = 16.0;

/// How far apart parts may be to be paired.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PredictionMode {
    /// The distance that they close if neither is stopped: for a query after an impact.
    Relative,
    /// The sum of the distances that each moves.
    Each,
}

/// Which contacts a detection finds.
#[derive(Clone, Copy)]
pub(crate) struct Reach<'a> {
    /// Time within which the parts may meet, s.
    pub horizon: f64,
    pub prediction: PredictionMode,
    /// Distance beside that of their motion, m.
    pub distance: f64,
    /// Serials and parts of pairs that are left out if both parts move, ascending.
    pub known: &'a [[u32; 4]],
}

impl Reach<'_> {
    /// Returns the reach of parts that move for `horizon` seconds.
    pub fn in_time(horizon: f64, prediction: PredictionMode) -> Reach<'static> {
        Reach { horizon, prediction, distance: 0.0, known: &[] }
    }

    /// Returns the reach of parts at their places, m.
    pub fn in_place(distance: f64) -> Reach<'static> {
        Reach { horizon: 0.0, prediction: PredictionMode::Each, distance, known: &[] }
    }
}

/// Bounds on the motion of a part within the horizon.
#[derive(Clone, Copy, Default)]
pub(crate) struct MotionBounds {
    /// Displacement of its origin at its present velocity, m.
    way: Vec3,
    /// Additional displacement due to its acceleration, m.
    gain: Vec3,
    /// Bound on the displacement of its points about its origin, m.
    turn: f64,
}

impl MotionBounds {
    /// `around` are the part's largest distances from its origin along the world's axes, m.
    pub fn new(part_state: &PartState, bound: f64, around: Vec3, horizon: f64) -> MotionBounds {
        let (w, e) = (part_state.angular_velocity.abs(), around);
        // |ω × r| by components and as a whole
        let sweep = Vec3::new(w.y * e.z + w.z * e.y, w.z * e.x + w.x * e.z, w.x * e.y + w.y * e.x).norm();
        let turning = if bound.is_finite() { sweep.min(w.norm() * bound) } else { 0.0 };
        MotionBounds {
            way: horizon * part_state.velocity,
            gain: horizon * horizon * part_state.acceleration,
            turn: horizon * turning,
        }
    }

    /// Returns the box that a part in the box `tight` may touch, with the margin `near`.
    pub fn swept(&self, tight: &Aabb, near: f64) -> Aabb {
        let grown = tight.grown(near + self.turn + self.gain.norm());
        Aabb { min: grown.min + self.way.inf(&Vec3::zeros()), max: grown.max + self.way.sup(&Vec3::zeros()) }
    }

    /// Returns the distance closed along a unit direction from the other part to this one, m.
    fn along(&self, n: &Vec3, other: &MotionBounds, prediction: PredictionMode) -> f64 {
        let turns = self.turn + other.turn + self.gain.norm() + other.gain.norm();
        let (this, that) = (-n.dot(&self.way), n.dot(&other.way));
        turns
            + match prediction {
                PredictionMode::Relative => (this + that).max(0.0),
                PredictionMode::Each => this.max(0.0) + that.max(0.0),
            }
    }

    /// Returns the distance by which a gap between two parts may close, m.
    pub fn between(&self, other: &MotionBounds, prediction: PredictionMode) -> f64 {
        let turns = self.turn + other.turn;
        match prediction {
            PredictionMode::Relative => turns + (self.way - other.way).norm() + (self.gain - other.gain).norm(),
            PredictionMode::Each => turns + self.way.norm() + other.way.norm() + self.gain.norm() + other.gain.norm(),
        }
    }
}

/// Two parts that may touch, A first.
pub(crate) struct PairQuery<'a> {
    pub parts: MovingPair<'a>,
    pub motion_bounds: [MotionBounds; 2],
    /// Distance that counts as near, m.
    pub near: f64,
    pub prediction: PredictionMode,
}

impl PairQuery<'_> {
    /// Returns whether a mesh or cylinder takes part.
    pub fn is_expensive(&self) -> bool {
        self.parts.shapes.iter().any(|shape| shape.has_tree())
    }

    /// Returns whether the bounding spheres or boxes cannot come near each other.
    pub fn is_separated(&self) -> bool {
        let closing = |n: &Vec3| self.near + self.motion_bounds[0].along(n, &self.motion_bounds[1], self.prediction);
        let off = self.parts.part_states[0].position() - self.parts.part_states[1].position();
        let radii: f64 = self.parts.shapes.iter().map(|shape| shape.bounding_radius()).sum();
        let distance = off.norm();
        if distance > radii && distance - radii > closing(&(off / distance)) {
            return true;
        }
        let [a, b] = [0, 1].map(|k| OrientedBox::around(self.parts.shapes[k], &self.parts.part_states[k].pose));
        are_separated(&a, &b, closing)
    }

    /// Returns the margin of the query, and the distance by which the gap may close.
    fn margins(&self) -> (f64, f64) {
        let closing = self.near + self.motion_bounds[0].between(&self.motion_bounds[1], self.prediction);
        let size = self.parts.shapes.iter().map(|shape| shape.bounding_radius()).fold(f64::INFINITY, f64::min);
        let margin = match (self.parts.mode, self.parts.shapes.map(|shape| shape.has_tree())) {
            // two trees within a wide margin have contacts by the million, so the margin is bounded
            (ContactMode::Spheres, [true, true]) => closing.min(self.near + TREE_MARGIN * size),
            _ if self.is_of_meshes() && self.has_simple_mesh() => rounded_up(closing, 4),
            _ if self.is_of_meshes() => rounded_up(closing.min(self.near + MESH_MARGIN * size), 2),
            _ => closing,
        };
        (margin, closing)
    }

    /// Returns whether both shapes have meshes, in the `surface` mode.
    fn is_of_meshes(&self) -> bool {
        self.parts.mode == ContactMode::Surface && self.parts.shapes.iter().all(|shape| shape.has_tree())
    }

    /// Returns the shapes if the contacts are a function of shapes, poses and margin that is worth keeping.
    fn kept_shapes(&self) -> Option<[Shape; 2]> {
        let MovingPair { tests, filtered, plane, skipped, .. } = &self.parts;
        let plain = !tests.any() && filtered.is_none() && plane.is_none() && skipped.is_empty();
        (plain && self.is_of_meshes()).then(|| self.parts.shapes.map(Clone::clone))
    }

    /// Returns whether one shape is a mesh of few corners: a wide margin is then cheap, as for a
    /// box.
    fn has_simple_mesh(&self) -> bool {
        self.parts
            .shapes
            .iter()
            .any(|shape| matches!(shape, Shape::Mesh(mesh) if mesh.corner_count() <= SIMPLE_MESH_CORNERS))
    }

    /// Finds the present contacts, ordered by feature, and returns 0. Two meshes without any within
    /// the margin are followed: it then finds the contacts where free motion brings them near, and
    /// returns the time, s. `rows` are the indices of both in the table of part states.
    pub fn contacts(
        &self,
        rows: [u32; 2],
        horizon: f64,
        (known, cached): (&mut KnownContacts, &mut CachedContacts),
        found: &mut Vec<Contact>,
    ) -> f64 {
        let (margin, closing) = self.margins();
        let poses = self.parts.part_states.map(|part_state| part_state.pose);
        found.clear();
        if !self.is_expensive() {
            self.parts.contacts_at(&poses, margin, found);
            return 0.0;
        }
        match known.look_up(self, rows, &poses, margin) {
            Some((query, contacts)) => {
                found.extend(contacts.iter().filter(|contact| contact.gap <= margin));
                // with its own margin, which a later query can need
                cached.store(query.clone(), contacts);
            }
            None => {
                self.parts.contacts_at(&poses, margin, found);
                cached.store(CachedQuery { rows, shapes: self.kept_shapes(), poses, margin, end: 0 }, found);
            }
        }
        if !found.is_empty() || self.parts.mode == ContactMode::Spheres || margin >= closing {
            return 0.0;
        }
        let search = Search {
            horizon,
            margin: margin.max(closing / MAX_SAMPLES),
            near: margin,
            max_advances: 2 * MAX_SAMPLES as u32,
        };
        let start = Approach::Bounded { gap: margin, speed: closing / horizon };
        let Some((time, nearest)) = self.parts.time_of_impact(start, 0.0, &search, found) else {
            found.clear();
            return 0.0;
        };
        found.retain(|contact| contact.gap <= nearest.gap.max(margin));
        time
    }
}

/// Returns the next number with `bits` binary digits after the first one, for a positive number.
fn rounded_up(x: f64, bits: u32) -> f64 {
    let below = (1 << (f64::MANTISSA_DIGITS - 1 - bits)) - 1;
    f64::from_bits((x.to_bits() + below) & !below)
}

/// Results of the expensive queries of the last detection.
#[derive(Default)]
pub(crate) struct NarrowPhaseCache {
    last: CachedContacts,
    /// Whether that detection was in an earlier frame.
    is_old: bool,
}

/// Results of the last detection, for pairs in ascending order.
pub(crate) struct KnownContacts<'a> {
    last: &'a CachedContacts,
    is_old: bool,
    /// Position in its queries.
    place: usize,
}

/// Results of expensive queries, in ascending order of the pairs.
#[derive(Default)]
pub(crate) struct CachedContacts {
    queries: Vec<CachedQuery>,
    contacts: Vec<Contact>,
}

#[derive(Clone)]
struct CachedQuery {
    rows: [u32; 2],
    /// The shapes, if the contacts are exactly those of the shapes at the poses within the margin, and are kept for the next
    /// frame.
    shapes: Option<[Shape; 2]>,
    poses: [Pose; 2],
    margin: f64,
    /// End of its contacts; they start at the end of the previous pair's.
    end: usize,
}

impl CachedContacts {
    fn clear(&mut self) {
        self.queries.clear();
        self.contacts.clear();
    }

    /// Stores the contacts of a query, whose end is set.
    fn store(&mut self, query: CachedQuery, found: &[Contact]) {
        self.contacts.extend_from_slice(found);
        self.queries.push(CachedQuery { end: self.contacts.len(), ..query });
    }

    /// Moves the results of later pairs here.
    fn append(&mut self, later: &mut CachedContacts) {
        if self.queries.is_empty() {
            return std::mem::swap(self, later);
        }
        let before = self.contacts.len();
        self.contacts.append(&mut later.contacts);
        self.queries.extend(later.queries.drain(..).map(|query| CachedQuery { end: before + query.end, ..query }));
    }
}

impl NarrowPhaseCache {
    /// Begins a frame, which does not depend on the one before.
    pub fn forget(&mut self) {
        self.is_old = true;
    }

    /// Returns whether contacts of the last detection can be those of the next frame.
    pub fn keeps_any(&self) -> bool {
        self.last.queries.iter().any(|query| query.shapes.is_some())
    }

    /// Returns the results for pairs from `first` on.
    pub fn from(&self, first: [u32; 2]) -> KnownContacts<'_> {
        let place = self.last.queries.partition_point(|k| k.rows < first);
        KnownContacts { last: &self.last, is_old: self.is_old, place }
    }

    /// Replaces the results by those of a new detection, in parts of ascending pairs, which are left
    /// empty.
    pub fn replace<'a>(&mut self, parts: impl Iterator<Item = &'a mut CachedContacts>) {
        self.last.clear();
        self.is_old = false;
        parts.for_each(|part| self.last.append(part));
    }
}

impl<'a> KnownContacts<'a> {
    /// Returns the last query of a pair and its contacts, if neither part has moved and the margin was at least as large; in
    /// another frame, if everything that they depend on has the same bits.
    fn look_up(
        &mut self,
        pair: &PairQuery,
        rows: [u32; 2],
        poses: &[Pose; 2],
        margin: f64,
    ) -> Option<(&'a CachedQuery, &'a [Contact])> {
        let queries = &self.last.queries;
        while queries.get(self.place).is_some_and(|k| k.rows < rows) {
            self.place += 1;
        }
        let is_known = |k: &&CachedQuery| match self.is_old {
            false => k.rows == rows && k.poses == *poses && k.margin >= margin,
            true => k.rows == rows && k.margin == margin && k.is_exactly(pair, poses),
        };
        let known = queries.get(self.place).filter(is_known)?;
        let start = self.place.checked_sub(1).map_or(0, |before| queries[before].end);
        Some((known, &self.last.contacts[start..known.end]))
    }
}

impl CachedQuery {
    /// Returns whether the shapes are those of a pair whose contacts are kept, and the poses have the same bits.
    fn is_exactly(&self, pair: &PairQuery, poses: &[Pose; 2]) -> bool {
        let bits = |pose: &Pose| {
            let (place, turn) = (pose.translation.vector, pose.rotation.coords);
            [place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w].map(f64::to_bits)
        };
        let (Some(known), Some(now)) = (&self.shapes, pair.kept_shapes()) else { return false };
        (0..2).all(|k| is_shared(&known[k], &now[k]) && bits(&self.poses[k]) == bits(&poses[k]))
    }
}

/// Returns whether two shapes are one mesh, one compound or one cylinder.
fn is_shared(a: &Shape, b: &Shape) -> bool {
    match (a, b) {
        (Shape::Mesh(a), Shape::Mesh(b)) => Arc::ptr_eq(a, b),
        (Shape::Compound(a), Shape::Compound(b)) => Arc::ptr_eq(a, b),
        (Shape::Cylinder(a), Shape::Cylinder(b)) => Arc::ptr_eq(a, b),
        _ => false,
    }
}

#[cfg(test)]
mod tests;
