//! The closest points of two solids that are apart.
//!
//! Convex bodies, and a triangle with a body or another triangle, have the distance of [`gjk`](super::gjk), less
//! the radii around their cores. Meshes that are not convex are searched by branch and bound over
//! their trees of boxes: the distance of two boxes is a lower bound of what they contain.

use super::ClosestPair;
use super::gjk::{Convex, Separation, separation};
use super::solid::Core;
use crate::{MeshDistance, Pose, Shape, SurfacePoint, Vec3};

/// Maximum number of alternating projections that give the search its first bound.
const PROJECTIONS: usize = 16;
/// Maximum number of directions in which bodies that overlap are moved apart, and the distance that they then
/// have, as a fraction of the smaller radius.
const MAX_TRANSLATIONS: usize = 16;
const CLEARANCE: f64 = 1e-2;
/// Distance of two surfaces that touch or cross, in smaller radii: a point of both has at most a distance of rounding.
const TOUCHING: f64 = 1e-12;

/// Returns the closest points of two bounded shapes that are no compounds, or else, if they
/// overlap or touch, a pair of points where they do: at minus the depth if that is exact, else at distance 0.
pub(super) fn apart(a: &Shape, pose_a: &Pose, b: &Shape, pose_b: &Pose) -> Result<ClosestPair, ClosestPair> {
    let cores = [Core::of(a, pose_a), Core::of(b, pose_b)];
    if let [Some(a), Some(b)] = &cores {
        let start = a.center() - b.center();
        let found = separation(a, b, &start, f64::INFINITY);
        return pair_of(&found, [a.radius, b.radius], &start);
    }
    let best = surfaces_apart(a, pose_a, b, pose_b)?;
    let within = |shape: &Shape, pose: &Pose, p: &Vec3| shape.closest_point(pose, p).distance < 0.0;
    let shells = |shape: &Shape| if let Shape::Mesh(mesh) = shape { mesh.report().shells } else { 1 };
    if shells(a).max(shells(b)) > 1 {
        let mut found = Vec::new();
        crate::contacts(a, pose_a, b, pose_b, 0.0, &mut found);
        if found.iter().any(|contact| {
            contact.gap < 0.0 && {
                let on = ClosestPair::of(contact).points;
                within(a, pose_a, &on[1]) && within(b, pose_b, &on[0])
            }
        }) {
            return Err(ClosestPair { distance: 0.0, ..best });
        }
    }
    Ok(best)
}

/// Returns the closest points of two shapes of which at least one is a mesh, or else, if their surfaces cross
/// or the closest points are inside the other solid, a pair of points at distance 0. The solids may
/// still overlap if a mesh has several shells.
pub(crate) fn surfaces_apart(a: &Shape, pose_a: &Pose, b: &Shape, pose_b: &Pose) -> Result<ClosestPair, ClosestPair> {
    let cores = [Core::of(a, pose_a), Core::of(b, pose_b)];
    let start = projected(a, pose_a, b, pose_b);
    let mut search = Search { best: start, crosses: false };
    let [of_a, of_b] = [(a, pose_a), (b, pose_b)].map(|(shape, pose)| surface(shape, pose));
    match (&cores, of_a, of_b) {
        ([None, None], Some(x), Some(y)) => search.meshes(&x, 0, &y, 0),
        ([None, Some(core)], Some(x), _) => search.mesh_and_core(&x, 0, core, false),
        ([Some(core), None], _, Some(y)) => search.mesh_and_core(&y, 0, core, true),
        _ => {}
    }
    let best = search.best;
    // surfaces that do not cross: one solid is within the other, or a shell of it is
    let within = |shape: &Shape, pose: &Pose, p: &Vec3| shape.closest_point(pose, p).distance < 0.0;
    let touches = best.distance <= TOUCHING * a.bounding_radius().min(b.bounding_radius());
    if touches || search.crosses || within(a, pose_a, &best.points[1]) || within(b, pose_b, &best.points[0]) {
        return Err(ClosestPair { distance: 0.0, ..best });
    }
    Ok(best)
}

/// Returns the pair of two convex bodies that overlap, with the least translation that separates them,
/// as far as it is found from that of `pair`: A is moved out along the normal and a little further, and
/// the normal of the closest points there is the next one. The translation never grows, since both
/// normals separate the bodies there, and that of the closest points the most.
pub(super) fn least_translation(a: &Core<'_>, b: &Core<'_>, pair: &ClosestPair, size: f64) -> ClosestPair {
    let mut least = *pair;
    for _ in 0..MAX_TRANSLATIONS {
        let by = least.normal * (CLEARANCE * size - least.distance);
        let found = separation(&a.moved(&by), b, &by, f64::INFINITY);
        let Some(normal) = (found.points[0] - found.points[1]).try_normalize(0.0) else { break };
        let overlap = a.overlap(b, &normal).max(0.0);
        if overlap >= -least.distance * (1.0 - 1e-12) {
            break;
        }
        let on_b = found.points[1] + normal * b.radius;
        least = ClosestPair { distance: -overlap, points: [on_b - normal * overlap, on_b], normal, ..least };
    }
    least
}

/// Returns the closest points of a half-space and a bounded shape that is no compound. Below the
/// plane the distance is minus the depth of the lowest point.
pub(super) fn above_plane(plane: &Pose, shape: &Shape, pose: &Pose) -> ClosestPair {
    let up = plane.rotation * Vec3::z();
    let lowest = match (Core::of(shape, pose), shape) {
        (Some(core), _) => core.support(&-up) - up * core.radius,
        (None, Shape::Mesh(mesh)) => {
            let down = pose.rotation.inverse_transform_vector(&-up);
            let height = |p: &&Vec3| p.dot(&down);
            let lowest = mesh.mesh().vertices.iter().max_by(|x, y| height(x).total_cmp(&height(y)));
            pose.transform_point(&(*lowest.unwrap_or(&Vec3::zeros())).into()).coords
        }
        (None, _) => pose.translation.vector,
    };
    let distance = up.dot(&(lowest - plane.translation.vector));
    ClosestPair { distance, points: [lowest - up * distance, lowest], normal: -up, shapes: [0; 2] }
}

/// Returns the pair of two cores with radii: `Err` if they overlap or touch, with the depth if the
/// cores are apart, else at distance 0.
fn pair_of(found: &Separation, radii: [f64; 2], start: &Vec3) -> Result<ClosestPair, ClosestPair> {
    let [on_a, on_b] = found.points;
    let normal = (on_a - on_b).try_normalize(0.0).or(start.try_normalize(0.0)).unwrap_or_else(Vec3::z);
    let distance = found.distance - radii[0] - radii[1];
    let points = [on_a - normal * radii[0], on_b + normal * radii[1]];
    let depth = if found.distance > 0.0 { distance.min(0.0) } else { 0.0 };
    let pair = ClosestPair { distance: distance.max(depth), points, normal, shapes: [0; 2] };
    if distance > 0.0 { Ok(pair) } else { Err(pair) }
}

/// A mesh at a pose.
struct Surface<'a> {
    mesh: &'a MeshDistance,
    pose: &'a Pose,
}

fn surface<'a>(shape: &'a Shape, pose: &'a Pose) -> Option<Surface<'a>> {
    if let Shape::Mesh(mesh) = shape { Some(Surface { mesh: mesh.distance(), pose }) } else { None }
}

impl Surface<'_> {
    fn bounds(&self, node: usize) -> Core<'static> {
        Core::of_box(&self.mesh.tree().nodes[node].bounds, self.pose)
    }

    /// Returns the triangles of a leaf, in world axes; `None` for any other node.
    fn triangles(&self, node: usize) -> Option<impl Iterator<Item = [Vec3; 3]>> {
        let here = &self.mesh.tree().nodes[node];
        let to_world = |p: Vec3| self.pose.transform_point(&p.into()).coords;
        (here.count > 0).then(|| here.range().map(move |n| self.mesh.piece(n).map(to_world)))
    }

    fn children(&self, node: usize) -> [usize; 2] {
        [node + 1, self.mesh.tree().nodes[node].second as usize]
    }
}

/// A search for the closest points of two surfaces.
struct Search {
    best: ClosestPair,
    /// Whether the surfaces cross: the search is over.
    crosses: bool,
}

impl Search {
    /// Returns a lower bound of the distance of two bodies, or infinity if it exceeds the best distance.
    fn bound(&self, a: &Core<'_>, b: &Core<'_>) -> f64 {
        let (radii, start) = (a.radius + b.radius, a.center() - b.center());
        let least = separation(a, b, &start, self.best.distance + radii).least - radii;
        if least > self.best.distance { f64::INFINITY } else { least }
    }

    /// Compares two bodies with the best pair; with `swapped` the first is of B.
    fn compare(&mut self, a: &impl Convex, b: &impl Convex, start: &Vec3, radius: f64, swapped: bool) {
        let found = separation(a, b, start, self.best.distance + radius);
        if found.distance - radius >= self.best.distance {
            return;
        }
        match pair_of(&found, [0.0, radius], start) {
            Ok(pair) => self.best = if swapped { pair.swapped() } else { pair },
            Err(pair) => (self.best, self.crosses) = (if swapped { pair.swapped() } else { pair }, true),
        }
    }

    /// Searches a node of a mesh; with `swapped` the mesh is B.
    fn mesh_and_core(&mut self, mesh: &Surface<'_>, node: usize, core: &Core<'_>, swapped: bool) {
        if let Some(triangles) = mesh.triangles(node) {
            for triangle in triangles {
                self.compare(&triangle, core, &(triangle[0] - core.center()), core.radius, swapped);
            }
            return;
        }
        let mut children = mesh.children(node).map(|child| (self.bound(&mesh.bounds(child), core), child));
        children.sort_by(|x, y| x.0.total_cmp(&y.0));
        for (bound, child) in children {
            if !self.crosses && bound < self.best.distance {
                self.mesh_and_core(mesh, child, core, swapped);
            }
        }
    }

    /// Searches a node of each of two meshes.
    fn meshes(&mut self, a: &Surface<'_>, node_a: usize, b: &Surface<'_>, node_b: usize) {
        let (size_a, size_b) = (a.mesh.tree().nodes[node_a].bounds, b.mesh.tree().nodes[node_b].bounds);
        let larger = (size_a.max - size_a.min).norm() >= (size_b.max - size_b.min).norm();
        let pairs = match (a.triangles(node_a), b.triangles(node_b)) {
            (Some(of_a), Some(of_b)) => {
                let of_b: Vec<_> = of_b.collect();
                for x in of_a {
                    for y in &of_b {
                        self.compare(&x, y, &(x[0] - y[0]), 0.0, false);
                    }
                }
                return;
            }
            (leaf_a, leaf_b) if leaf_b.is_some() || leaf_a.is_none() && larger => {
                a.children(node_a).map(|child| (child, node_b))
            }
            _ => b.children(node_b).map(|child| (node_a, child)),
        };
        let mut pairs = pairs.map(|(x, y)| (self.bound(&a.bounds(x), &b.bounds(y)), x, y));
        pairs.sort_by(|x, y| x.0.total_cmp(&y.0));
        for (bound, x, y) in pairs {
            if !self.crosses && bound < self.best.distance {
                self.meshes(a, x, b, y);
            }
        }
    }
}

/// Returns a pair of points of the two surfaces, by alternating projections from the center of A.
fn projected(a: &Shape, pose_a: &Pose, b: &Shape, pose_b: &Pose) -> ClosestPair {
    let mut from = pose_a.translation.vector;
    let mut best = ClosestPair { distance: f64::INFINITY, points: [from; 2], normal: Vec3::z(), shapes: [0; 2] };
    for _ in 0..PROJECTIONS {
        let SurfacePoint { point: to, .. } = b.closest_point(pose_b, &from);
        let back = a.closest_point(pose_a, &to);
        let offset = back.point - to;
        let distance = offset.norm();
        if distance.is_nan() || distance >= best.distance * (1.0 - 1e-15) {
            break;
        }
        let normal = offset.try_normalize(0.0).unwrap_or(-back.normal);
        best = ClosestPair { distance, points: [back.point, to], normal, shapes: [0; 2] };
        from = back.point;
    }
    best
}
