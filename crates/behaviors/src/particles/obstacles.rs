//! Obstacles of particles: all parts of a world, as they moved during a frame.
//!
//! ```text
//! gap(t) = distance(shape at X(t), x(t)) − r,  |gap(t₂) − gap(t₁)| ≤ s·|t₂ − t₁|
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `x(t)`, `r` | path of a particle; its radius |
//! | `X(t)` | pose of the shape between those at the start and the end of the frame |
//! | `s` | bound on the relative speed: that of the particle and of the fastest point of the shape |
//!
//! The bound finds the first contact along a path by steps of `gap/s`, which pass no surface however thin
//! (conservative advancement). If the gap is negative at the end, regula falsi (Illinois) finds the root instead; it is exact
//! to rounding, and may be a later one of three.

use super::cells::Cells;
use super::path::Path;
use tumble_collide::{Aabb, BoxTree, Pose, Shape, Vec3};
use tumble_core::{CollisionGroup, Frame, Material, ObjectId, PartState};

/// Most steps along a path.
const STEPS: usize = 48;
/// Gap of a particle that lies on a surface, m.
pub(super) const TOUCHING: f64 = 1e-10;
/// Number of obstacles from which a tree finds those near a path.
const MANY: usize = 48;

/// A part that particles collide with.
pub(super) struct Obstacle<'a> {
    pub id: ObjectId,
    pub part: usize,
    pub state: &'a PartState,
    pub material: Material,
    shape: &'a Shape,
    before: Pose,
    moves: bool,
    /// Whether impulses move it.
    pub dynamic: bool,
    /// Normal and offset of a half-space that does not move.
    plane: Option<(Vec3, f64)>,
    /// Bound on the speed of its points over the frame, m/s.
    speed: f64,
    /// Box around its motion, grown by the radius of a particle.
    bounds: Aabb,
}

/// The obstacles of a frame.
pub(super) struct Obstacles<'a> {
    all: Vec<Obstacle<'a>>,
    /// Number of those at the front that have no finite box.
    unbounded: usize,
    /// A box around the others.
    bounds: Aabb,
    /// Cells of the others, for short ways.
    cells: Cells,
    /// A tree of the others, if they are many, for long ways.
    tree: Option<BoxTree>,
}

/// The first contact of a path.
#[derive(Clone, Copy)]
pub(super) struct Hit {
    /// Time along the path, s.
    pub time: f64,
    pub obstacle: usize,
}

/// Returns the pose at a share of the way between two.
pub(super) fn between(before: &Pose, after: &Pose, share: f64) -> Pose {
    let turn = (after.rotation * before.rotation.inverse()).scaled_axis();
    let rotation = tumble_collide::Quat::from_scaled_axis(share * turn) * before.rotation;
    Pose::from_parts(before.translation.vector.lerp(&after.translation.vector, share).into(), rotation)
}

impl<'a> Obstacles<'a> {
    /// Collects the parts that particles of a group with a mask collide with.
    pub fn new(frame: &'a Frame<'a>, radius: f64, group: CollisionGroup, mask: u64) -> Obstacles<'a> {
        let view = &frame.view;
        let mut all = Vec::new();
        let active = view.ids().iter().filter(|id| view.status(**id).is_some_and(|s| s.enabled && s.collidable));
        for &id in active {
            let dynamic = view.status(id).is_some_and(|status| status.moves());
            let (Some(object), Some(range)) = (view.object(id), view.state_range(id)) else { continue };
            let Some(body) = object.collidable() else { continue };
            for (part, row) in range.parts.clone().enumerate() {
                let Some(shape) = body.shape(part) else { continue };
                let meets = mask & body.collision_group(part).bit() != 0 && body.collides_with(part, group);
                if body.is_sensor(part) || !meets {
                    continue;
                }
                let (before, state) = (frame.before[row].pose, &view.part_states[row]);
                let moves = before != state.pose;
                let turn = (state.pose.rotation * before.rotation.inverse()).angle();
                let (path, reach) = ((state.position() - before.translation.vector).norm(), shape.bounding_radius());
                let sweep = if turn > 0.0 { turn * reach } else { 0.0 };
                let speed = if moves { (path + sweep) / frame.dt } else { 0.0 };
                let [a, b] = [&before, &state.pose].map(|pose| shape.tight_aabb(pose));
                let bounds = Aabb { min: a.min.inf(&b.min), max: a.max.sup(&b.max) }.grown(radius + sweep);
                let (material, dynamic) = (body.material(part), dynamic && body.part_moves(part));
                let normal = state.pose.rotation * Vec3::z();
                let plane =
                    (!moves && matches!(shape, Shape::HalfSpace)).then(|| (normal, normal.dot(&state.position())));
                all.push(Obstacle { id, part, state, material, shape, before, moves, dynamic, plane, speed, bounds });
            }
        }
        let finite = |o: &Obstacle| o.bounds.min.iter().chain(o.bounds.max.iter()).all(|x| x.is_finite());
        let (mut all, bounded): (Vec<_>, Vec<_>) = all.into_iter().partition(|o| !finite(o));
        let unbounded = all.len();
        let boxes: Vec<Aabb> = bounded.iter().map(|o| o.bounds).collect();
        let tree = (bounded.len() > MANY).then(|| BoxTree::new(&boxes));
        let bounds = Aabb::around(boxes.iter().flat_map(|b| [b.min, b.max]));
        let cells = Cells::new(&bounds, &boxes);
        all.extend(bounded);
        Obstacles { all, unbounded, bounds, cells, tree }
    }

    /// Returns an obstacle.
    pub fn get(&self, index: usize) -> &Obstacle<'a> {
        &self.all[index]
    }

    /// Appends the obstacles whose box a straight way meets, in their order.
    pub fn near(&self, from: &Vec3, to: &Vec3, out: &mut Vec<usize>) {
        out.clear();
        let way = Aabb { min: from.inf(to), max: from.sup(to) };
        let meets = |index: &usize| overlap(&self.all[*index].bounds, &way);
        out.extend((0..self.unbounded).filter(meets));
        if !overlap(&self.bounds, &way) {
            return;
        }
        let start = out.len();
        if self.cells.near(&way, out) {
            let mut kept = start;
            for k in start..out.len() {
                out[kept] = self.unbounded + out[k];
                kept += usize::from(meets(&out[kept]));
            }
            return out.truncate(kept);
        }
        match &self.tree {
            None => out.extend((self.unbounded..self.all.len()).filter(meets)),
            Some(tree) => {
                let length = (to - from).norm();
                let direction = (to - from).try_normalize(0.0).unwrap_or_else(Vec3::z);
                let order = tree.order();
                tree.visit_along(from, &direction, &mut { length }, |slot, _| {
                    out.push(self.unbounded + order[slot] as usize);
                });
                out.sort_unstable();
            }
        }
    }
}

/// Returns whether two boxes share a point.
#[inline(always)]
fn overlap(a: &Aabb, b: &Aabb) -> bool {
    (0..3).all(|k| a.min[k] <= b.max[k] && b.min[k] <= a.max[k])
}

/// A stretch of a path within a frame.
pub(super) struct Stretch<'a> {
    pub path: &'a Path,
    /// Position at its end, m.
    pub end: &'a Vec3,
    /// Start and length, s; the start is counted from that of the frame.
    pub start: f64,
    pub length: f64,
    /// Length of the frame, s.
    pub dt: f64,
    /// Radius of the particle, m.
    pub radius: f64,
}

impl Obstacle<'_> {
    /// Returns the gap between a particle at `point` and the surface at a time of the frame, m, and the normal.
    pub fn gap(&self, point: &Vec3, share: f64, radius: f64) -> (f64, Vec3) {
        if let Some((normal, offset)) = self.plane {
            return (normal.dot(point) - offset - radius, normal);
        }
        let pose = match self.moves {
            true => &between(&self.before, &self.state.pose, share),
            false => &self.state.pose,
        };
        let closest = self.shape.closest_point(pose, point);
        (closest.distance - radius, closest.normal)
    }

    /// Returns the velocity of its surface at a point, m/s, with that of a belt.
    pub fn velocity(&self, point: &Vec3) -> Vec3 {
        if !self.moves && self.material.surface_velocity == Vec3::zeros() {
            return Vec3::zeros();
        }
        self.state.velocity_at(point) + self.state.pose.rotation * self.material.surface_velocity
    }

    /// Returns the time at which a stretch that leaves the surface turns back to it, s, at most half of it.
    fn apex(&self, stretch: &Stretch) -> Option<f64> {
        let (path, half) = (stretch.path, 0.5 * stretch.length);
        let normal = self.gap(&path.x, stretch.start / stretch.dt, stretch.radius).1;
        let (rate, pull) = ((path.v - self.velocity(&path.x)).dot(&normal), path.pull.dot(&normal));
        (rate > 0.0).then(|| if pull < 0.0 { half.min(-rate / pull) } else { half })
    }

    /// Returns the time along a stretch at which it meets the surface, s; 0 if it begins there. The gap is
    /// not negative then, unless it was at the start.
    pub fn meets(&self, stretch: &Stretch) -> Option<f64> {
        let bound = stretch.path.top_speed(stretch.length) + self.speed;
        let at = |t: f64, x: &Vec3| self.gap(x, (stretch.start + t) / stretch.dt, stretch.radius).0;
        let gap = |t: f64| at(t, &stretch.path.at(t).0);
        let mut low = (0.0, at(0.0, &stretch.path.x));
        if low.1 <= 0.0 {
            return Some(0.0);
        }
        if low.1 > bound * stretch.length {
            return None;
        }
        let mut high = (stretch.length, at(stretch.length, stretch.end));
        if low.1 <= TOUCHING && high.1 < 0.0 {
            // a bounce that begins here may end within the stretch
            match self.apex(stretch).map(|t| (t, gap(t))).filter(|apex| apex.1 > TOUCHING) {
                Some(apex) => low = apex,
                None => return Some(0.0),
            }
        }
        if high.1 >= 0.0 {
            let mut steps = 0;
            while low.1 > 0.0 && low.1 + high.1 < bound * (high.0 - low.0) && steps < STEPS {
                let t = low.0 + (low.1 / bound).max(1e-6 * stretch.length);
                if t >= high.0 {
                    return None;
                }
                let next = (t, gap(t));
                if next.1 < 0.0 {
                    high = next;
                    break;
                }
                (low, steps) = (next, steps + 1);
            }
            if high.1 >= 0.0 {
                return None;
            }
        }
        let (mut ends, mut last) = ((low.1, high.1), 0);
        for _ in 0..STEPS {
            let chord = (low.0 * ends.1 - high.0 * ends.0) / (ends.1 - ends.0);
            // rounding puts a root close to the later end there: halves then find how close
            let t = if chord < high.0 { chord } else { 0.5 * (low.0 + high.0) };
            if !(t > low.0 && t < high.0) {
                break;
            }
            let value = gap(t);
            let side = if value >= 0.0 { 1 } else { -1 };
            // an end that stays twice counts half
            let half = if side == last { 0.5 } else { 1.0 };
            if side > 0 {
                (low, ends) = ((t, value), (value, half * ends.1));
            } else {
                (high, ends) = ((t, value), (half * ends.0, value));
            }
            last = side;
            if low.1 < 1e-14 {
                break;
            }
        }
        Some(low.0)
    }
}
