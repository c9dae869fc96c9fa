//! What is asked of the narrow phase for one pair within a step: how far to look, whether at all, and when.
//!
//! Queries between meshes and cylinders are dear. They are not made where the boxes around both stay apart (`are_separated.rs`), not made twice at the same poses within a
//! frame, and of two meshes of many vertices not with a margin as wide as fast bodies would need: those are
//! followed.

use crate::contact::separation::{OrientedBox, are_separated};
use crate::object::part_state::PartState;
use crate::step::pose_after_free_motion;
use tumble_collide::{Aabb, Contact, ContactMode, Pose, Shape, Vec3};

/// How far two sphere trees look ahead in the `spheres` mode, as a share of the smaller one's radius.
const TREE_MARGIN: f64 = 0.02;
/// How far two meshes look ahead by their surfaces, likewise: further away they are followed along free motion. A wide margin has most of both surfaces in it.
const MESH_MARGIN: f64 = 0.05;
/// Vertices of a mesh that others look as far for as for a block.
const SIMPLE_MESH_VERTICES: usize = 64;
/// Looks along free motion, unless they come near and do not touch: then twice as many.
const MAX_SAMPLES: f64 = 16.0;

/// How far apart two parts are looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PredictionMode {
    /// As far as they come towards each other if neither is stopped: for who looks again after a stop.
    Relative,
    /// As far as either moves.
    Each,
}

/// What a part may do within the horizon.
#[derive(Clone, Copy, Default)]
pub(crate) struct MotionBounds {
    /// Of its origin at its present velocity, metres.
    way: Vec3,
    /// What its acceleration adds, metres.
    gain: Vec3,
    /// Of its points around its origin, metres at most.
    turn: f64,
}

impl MotionBounds {
    /// `around` are the part's greatest distances from its origin along the world's axes, metres.
    pub fn new(part_state: &PartState, bound: f64, around: Vec3, horizon: f64) -> MotionBounds {
        let (w, e) = (part_state.angular_velocity.abs(), around);
        // |ω × r| by components, and as a whole
        let sweep = Vec3::new(w.y * e.z + w.z * e.y, w.z * e.x + w.x * e.z, w.x * e.y + w.y * e.x).norm();
        let turning = if bound.is_finite() { sweep.min(w.norm() * bound) } else { 0.0 };
        MotionBounds {
            way: horizon * part_state.velocity,
            gain: horizon * horizon * part_state.acceleration,
            turn: horizon * turning,
        }
    }

    /// All that a box around the part may meet, `near` aside.
    pub fn swept(&self, tight: &Aabb, near: f64) -> Aabb {
        let grown = tight.grown(near + self.turn + self.gain.norm());
        Aabb { min: grown.min + self.way.inf(&Vec3::zeros()), max: grown.max + self.way.sup(&Vec3::zeros()) }
    }

    /// The same along a unit direction, from the other to this one.
    fn along(&self, n: &Vec3, other: &MotionBounds, prediction: PredictionMode) -> f64 {
        let turns = self.turn + other.turn + self.gain.norm() + other.gain.norm();
        let (this, that) = (-n.dot(&self.way), n.dot(&other.way));
        turns
            + match prediction {
                PredictionMode::Relative => (this + that).max(0.0),
                PredictionMode::Each => this.max(0.0) + that.max(0.0),
            }
    }

    /// By how much a gap between two parts may close, metres.
    fn between(&self, other: &MotionBounds, prediction: PredictionMode) -> f64 {
        let turns = self.turn + other.turn;
        match prediction {
            PredictionMode::Relative => turns + (self.way - other.way).norm() + (self.gain - other.gain).norm(),
            PredictionMode::Each => turns + self.way.norm() + other.way.norm() + self.gain.norm() + other.gain.norm(),
        }
    }
}

/// Two parts that may meet, A first.
pub(crate) struct PairQuery<'a> {
    pub mode: ContactMode,
    pub shapes: [&'a Shape; 2],
    pub part_states: [&'a PartState; 2],
    pub motion_bounds: [MotionBounds; 2],
    /// What counts as near, metres.
    pub near: f64,
    pub prediction: PredictionMode,
}

impl PairQuery<'_> {
    /// Whether a mesh or cylinder takes part.
    pub fn is_expensive(&self) -> bool {
        self.shapes.iter().any(|shape| shape.has_tree())
    }

    /// Whether the boxes around both cannot come near each other.
    pub fn is_separated(&self) -> bool {
        let [a, b] = [0, 1].map(|k| OrientedBox::around(self.shapes[k], &self.part_states[k].pose));
        are_separated(&a, &b, |n| self.near + self.motion_bounds[0].along(n, &self.motion_bounds[1], self.prediction))
    }

    /// Gaps up to this are wanted, and up to this may close.
    fn margins(&self) -> (f64, f64) {
        let closing = self.near + self.motion_bounds[0].between(&self.motion_bounds[1], self.prediction);
        let size = self.shapes.iter().map(|shape| shape.bounding_radius()).fold(f64::INFINITY, f64::min);
        let margin = match (self.mode, self.shapes.map(|shape| shape.has_tree())) {
            // Two trees within a wide margin have contacts by the million: there the look ahead is bounded.
            (ContactMode::Spheres, [true, true]) => closing.min(self.near + TREE_MARGIN * size),
            (ContactMode::Surface, [true, true]) if !self.has_simple_mesh() => {
                closing.min(self.near + MESH_MARGIN * size)
            }
            _ => closing,
        };
        (margin, closing)
    }

    /// Whether one is a mesh of few vertices: against it a wide margin is cheap, as against a block.
    fn has_simple_mesh(&self) -> bool {
        self.shapes
            .iter()
            .any(|shape| matches!(shape, Shape::Mesh(mesh) if mesh.mesh().vertices.len() <= SIMPLE_MESH_VERTICES))
    }

    /// The contacts at present, by feature, and 0. Of two meshes without any that are further apart than they look, those of where free motion brings them near, and when in
    /// s. `rows` are the places of both in the site table.
    pub fn contacts(
        &self,
        rows: [u32; 2],
        horizon: f64,
        narrow_phase_cache: &mut NarrowPhaseCache,
        found: &mut Vec<Contact>,
    ) -> f64 {
        let (margin, closing) = self.margins();
        let poses = self.part_states.map(|part_state| part_state.pose);
        found.clear();
        if !self.is_expensive() {
            self.query(&poses, margin, found);
            return 0.0;
        }
        if !narrow_phase_cache.look_up(rows, &poses, margin, found) {
            self.query(&poses, margin, found);
        }
        narrow_phase_cache.store(rows, poses, margin, found);
        if !found.is_empty() || self.mode == ContactMode::Spheres || margin >= closing {
            return 0.0;
        }
        self.advance_conservatively((margin, closing), horizon, found)
    }

    /// Conservative advancement: no gap closes faster than `closing/horizon`, so a look that sees nothing within its margin, or a least gap, lets that much time pass.
    fn advance_conservatively(&self, (margin, closing): (f64, f64), horizon: f64, found: &mut Vec<Contact>) -> f64 {
        let (speed, wide) = (closing / horizon, margin.max(closing / MAX_SAMPLES));
        let mut moment = margin / speed;
        for appearance in 1.. {
            found.clear();
            if moment > horizon {
                break;
            }
            self.query(&self.part_states.map(|part_state| pose_after_free_motion(part_state, moment)), wide, found);
            let least = found.iter().map(|contact| contact.gap).fold(f64::INFINITY, f64::min);
            if least <= margin || (least.is_finite() && appearance >= 2 * MAX_SAMPLES as u32) {
                found.retain(|contact| contact.gap <= least.max(margin));
                return moment;
            }
            moment += least.min(wide) / speed;
        }
        0.0
    }

    fn query(&self, poses: &[Pose; 2], margin: f64, found: &mut Vec<Contact>) {
        tumble_collide::contacts_in_mode(
            self.mode,
            self.shapes[0],
            &poses[0],
            self.shapes[1],
            &poses[1],
            margin,
            found,
        );
        found.sort_by_key(|contact| contact.feature);
    }
}

/// What dear queries of this frame gave: the last detection's, and those of the one that goes on. Pairs come in ascending order.
#[derive(Default)]
pub(crate) struct NarrowPhaseCache {
    last: CachedContacts,
    now: CachedContacts,
    /// How far the pairs of the last detection have been passed.
    place: usize,
}

#[derive(Default)]
struct CachedContacts {
    queries: Vec<CachedQuery>,
    contacts: Vec<Contact>,
}

struct CachedQuery {
    rows: [u32; 2],
    poses: [Pose; 2],
    margin: f64,
    /// Where its contacts end; they begin where those of the pair before end.
    end: usize,
}

impl CachedContacts {
    fn clear(&mut self) {
        self.queries.clear();
        self.contacts.clear();
    }
}

impl NarrowPhaseCache {
    pub fn forget(&mut self) {
        self.last.clear();
    }

    /// A detection begins.
    pub fn begin(&mut self) {
        self.now.clear();
        self.place = 0;
    }

    /// It ends, and is the last one.
    pub fn end(&mut self) {
        std::mem::swap(&mut self.last, &mut self.now);
    }

    /// Writes to `found` what the last detection found for a pair, if neither side has moved since and it looked as far; whether it did.
    fn look_up(&mut self, rows: [u32; 2], poses: &[Pose; 2], margin: f64, found: &mut Vec<Contact>) -> bool {
        let queries = &self.last.queries;
        while queries.get(self.place).is_some_and(|k| k.rows < rows) {
            self.place += 1;
        }
        let Some(known) = queries.get(self.place).filter(|k| k.rows == rows && k.poses == *poses && k.margin >= margin)
        else {
            return false;
        };
        let start = self.place.checked_sub(1).map_or(0, |before| queries[before].end);
        found.extend(self.last.contacts[start..known.end].iter().filter(|contact| contact.gap <= margin));
        true
    }

    fn store(&mut self, rows: [u32; 2], poses: [Pose; 2], margin: f64, found: &[Contact]) {
        self.now.contacts.extend_from_slice(found);
        self.now.queries.push(CachedQuery { rows, poses, margin, end: self.now.contacts.len() });
    }
}

#[cfg(test)]
mod tests;
