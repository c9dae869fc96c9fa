//! Obstacles of particles: all parts of a world, as they moved during a frame. When a path meets one is in
//! [`first_contact`](super::first_contact).

use super::cells::Cells;
use super::first_contact::Rates;
use tumble_collide::{Aabb, BoxTree, Pose, Shape, Vec3};
use tumble_core::{CollisionGroup, Frame, Material, ObjectId, PartState, shape_meeting};

/// Number of obstacles from which a tree finds those near a path.
const MANY: usize = 48;

/// A part that particles collide with.
pub(super) struct Obstacle<'a> {
    pub id: ObjectId,
    pub part: usize,
    pub state: &'a PartState,
    pub material: Material,
    shape: &'a Shape,
    /// Pose of the shape in the part, unless it is that of the part.
    placed: Option<&'a Pose>,
    before: Pose,
    moves: bool,
    /// Whether the shape is convex for certain.
    pub(super) convex: bool,
    /// Its velocities over the frame, unless it does not move.
    pub(super) rates: Option<Rates>,
    /// Whether impulses move it.
    pub dynamic: bool,
    /// Normal and offset of a half-space that does not move.
    plane: Option<(Vec3, f64)>,
    /// Bound on the speed of its points over the frame, m/s.
    pub(super) speed: f64,
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
                let Some(met) = shape_meeting(body, part, group, mask) else { continue };
                let meets = |number: usize| match &*met {
                    Shape::Compound(compound) => compound.is_active(number),
                    _ => true,
                };
                let (before, state) = (frame.before[row].pose, &view.part_states[row]);
                let moves = before != state.pose;
                let turn = (state.pose.rotation * before.rotation.inverse()).scaled_axis();
                let path = state.position() - before.translation.vector;
                // a half-space has no bounding radius
                let sweep = if turn == Vec3::zeros() { 0.0 } else { turn.norm() * shape.bounding_radius() };
                let speed = if moves { (path.norm() + sweep) / frame.dt } else { 0.0 };
                let rates = moves.then(|| Rates {
                    start: before.translation.vector,
                    velocity: path / frame.dt,
                    angular: turn / frame.dt,
                });
                let (material, dynamic) = (body.material(part), dynamic && body.part_moves(part));
                for (number, (shape, placed)) in pieces(shape).into_iter().enumerate().filter(|(n, _)| meets(*n)) {
                    let own = body.shape_materials(part).iter().find(|(shape, _)| *shape == number);
                    let material = own.map_or(material, |(_, material)| *material);
                    let at = |pose: &Pose| shape.tight_aabb(&placed.map_or(*pose, |placed| pose * placed));
                    let [a, b] = [at(&before), at(&state.pose)];
                    let bounds = Aabb { min: a.min.inf(&b.min), max: a.max.sup(&b.max) }.grown(radius + sweep);
                    let normal = state.pose.rotation * Vec3::z();
                    let plane =
                        (!moves && matches!(shape, Shape::HalfSpace)).then(|| (normal, normal.dot(&state.position())));
                    let convex = !matches!(shape, Shape::Mesh(_));
                    all.push(Obstacle {
                        id,
                        part,
                        state,
                        material,
                        shape,
                        placed,
                        before,
                        moves,
                        convex,
                        rates,
                        dynamic,
                        plane,
                        speed,
                        bounds,
                    });
                }
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

/// Returns a shape, or those that a compound is made of with their poses.
fn pieces(shape: &Shape) -> Vec<(&Shape, Option<&Pose>)> {
    match shape {
        Shape::Compound(compound) => compound.placed().map(|(shape, pose)| (shape, Some(pose))).collect(),
        _ => vec![(shape, None)],
    }
}

impl Obstacle<'_> {
    /// Returns the gap between a particle at `point` and the surface at a time of the frame, m, and the normal.
    pub fn gap(&self, point: &Vec3, share: f64, radius: f64) -> (f64, Vec3) {
        if let Some((normal, offset)) = self.plane {
            return (normal.dot(point) - offset - radius, normal);
        }
        let pose = match self.moves {
            true => between(&self.before, &self.state.pose, share),
            false => self.state.pose,
        };
        let closest = match self.placed {
            Some(placed) => self.shape.closest_point(&(pose * placed), point),
            None => self.shape.closest_point(&pose, point),
        };
        (closest.distance - radius, closest.normal)
    }

    /// Returns the velocity of its surface at a point, m/s, with that of a belt.
    pub fn velocity(&self, point: &Vec3) -> Vec3 {
        if !self.moves && self.material.surface_velocity == Vec3::zeros() {
            return Vec3::zeros();
        }
        self.state.velocity_at(point) + self.state.pose.rotation * self.material.surface_velocity
    }
}
