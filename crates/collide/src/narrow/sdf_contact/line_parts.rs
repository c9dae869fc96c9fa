//! Parts of an edge on which its distance from a mesh is concave or convex, so that they need no
//! samples or a few.
//!
//! ```text
//! ρ          largest gap of contacts that are needed
//! x(s)       the edge
//! P_i        planes of the triangles within ρ of a part of it
//! concave    each triangle lies on or above the plane of each other one: a flat face, a valley
//! convex     each triangle lies on or below the plane of each other one: a ridge
//! ```
//!
//! The empty space over a valley is the intersection of half-spaces, so the signed distance is
//! concave wherever it is at most `ρ`: it has its minima at the ends of the part. The solid below a
//! ridge is such an intersection, so there the distance is convex. The long edges of a body that
//! slides in a hole or lies on a wall are over flat faces and valleys for most of their length.
//!
//! Depths beyond `ρ` are excluded: the ends of a part are not so deep, and the line does not come
//! deeper below any of the planes.

use super::query::Query;
use super::tolerances::{FLAT_SLOPE, MAX_PIECE};
use crate::Vec3;
use crate::sdf::elements::Edge;
use crate::sdf::facing;
use crate::sdf::field::{MeshField, Segment, TriangleNearLine};
use arrayvec::ArrayVec;

/// How the distance changes on a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Curvature {
    /// No minimum within `ρ`, except at the ends.
    Concave,
    /// At most one minimum within `ρ`.
    Convex,
    Unknown,
}

/// A part of an edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part {
    /// Range of the distance from the start of the edge, meters.
    pub from: f64,
    pub to: f64,
    pub curvature: Curvature,
}

/// Number of pieces of an edge, or of its row, above which its parts are looked for.
const MIN_PIECES: f64 = 3.0;
/// Maximum number of triangles near an edge.
const MAX_NEAR: usize = 24;
/// Maximum number of planes near an edge, and of their pairs.
const MAX_PLANES: usize = 12;
const MAX_RANGES: usize = MAX_PLANES * (MAX_PLANES + 1) / 2;
/// Maximum number of parts of an edge.
const MAX_PARTS: usize = 16;
/// Largest depth of a line below a plane, as a fraction of `ρ`: then it is less than `ρ` inside.
const MAX_DEPTH: f64 = 0.25;
/// Smallest cosine between the normals of two faces, so that they are not too steep for that.
const NARROWEST: f64 = -0.8;
/// Rounding of a height, as a fraction of the smaller body's radius.
const HEIGHT_ROUNDING: f64 = 1e-9;
/// Rounding of a squared difference of normals.
const SAME_NORMAL: f64 = 1e-20;

/// Parts of an edge, ascending; they cover all of it.
pub(super) type Parts = ArrayVec<Part, MAX_PARTS>;

/// The triangles of one plane near an edge.
struct Plane<'a> {
    normal: &'a Vec3,
    triangles: ArrayVec<&'a [Vec3; 3], MAX_NEAR>,
    /// Range of the edge that they can be near.
    from: f64,
    to: f64,
    /// Slope of the edge over the plane.
    slope: f64,
    /// Whether the edge can touch the plane, and is not deep below it.
    fits: bool,
}

/// A range of the edge that is near two planes.
struct Range {
    from: f64,
    to: f64,
    curvature: Curvature,
}

impl Query<'_> {
    /// Returns the parts of a line in the frame of the field: of an edge those of its row. `normals`
    /// are those of the edge, `reach` is `ρ`.
    pub(super) fn parts_of(&self, edge: Option<&Edge>, line: &Segment, normals: &[Vec3], reach: f64) -> Parts {
        let unknown = || Parts::from_iter([Part { from: line.from, to: line.to, curvature: Curvature::Unknown }]);
        let Some(edge) = edge.filter(|_| self.mesh.is_some()) else { return unknown() };
        let (smooth, least) = (edge.end_tolerance > 0.0, MAX_PIECE * self.size);
        let is_short = |length: f64| self.is_one_piece(length / MIN_PIECES, smooth);
        match self.rows.get(edge.row as usize) {
            _ if self.is_one_piece(line.to, smooth) => unknown(),
            Some(row) if !is_short(row.length) => {
                let mut known = self.parts_of_rows.borrow_mut();
                let parts = known.entry(edge.row).or_insert_with(|| {
                    let along = self.rotation * row.along;
                    let whole = Segment { start: self.to_field(&row.start), along, from: 0.0, to: row.length };
                    self.parts(&whole, normals, reach, least)
                });
                parts_between(parts, edge.places, line.to, least)
            }
            None if !is_short(line.to) => self.parts(line, normals, reach, least),
            _ => unknown(),
        }
    }

    /// Divides an edge into parts; `normals` are those of its faces, `reach` is `ρ`. Parts shorter
    /// than `least` are joined to others. Returns one unknown part if nothing is known.
    fn parts(&self, edge: &Segment, normals: &[Vec3], reach: f64, least: f64) -> Parts {
        let mut parts = Parts::new();
        let unknown = Part { from: edge.from, to: edge.to, curvature: Curvature::Unknown };
        let known = self.mesh.filter(|_| reach > 0.0).is_some_and(|mesh| {
            let Some(planes) = self.planes(mesh, edge, normals, reach) else { return false };
            let ranges = self.ranges(&planes);
            let divided = divide(edge, &ranges, &mut parts);
            self.mark_deep(mesh, edge, reach, &mut parts);
            parts = joined(&parts, least);
            divided
        });
        if !known {
            parts.clear();
            parts.push(unknown);
        }
        parts
    }

    /// Returns the planes near an edge; `None` if they are too many.
    fn planes<'a>(
        &self,
        mesh: &'a MeshField,
        edge: &Segment,
        normals: &[Vec3],
        reach: f64,
    ) -> Option<ArrayVec<Plane<'a>, MAX_PLANES>> {
        let mut planes = ArrayVec::<Plane, MAX_PLANES>::new();
        let rounding = HEIGHT_ROUNDING * self.size;
        let add = |near: TriangleNearLine<'a>| {
            let is_same = |plane: &&mut Plane| {
                (plane.normal - near.normal).norm_squared() < SAME_NORMAL
                    && plane.normal.dot(&(near.corners[0] - plane.triangles[0][0])).abs() <= rounding
            };
            let lowest = near.height + (near.slope * near.from).min(near.slope * near.to);
            let is_shallow = lowest >= -MAX_DEPTH * reach;
            if let Some(plane) = planes.iter_mut().find(is_same) {
                plane.from = plane.from.min(near.from);
                plane.to = plane.to.max(near.to);
                plane.fits &= is_shallow;
                return plane.triangles.try_push(near.corners).is_ok();
            }
            let mut plane = Plane {
                normal: near.normal,
                triangles: ArrayVec::new(),
                from: near.from,
                to: near.to,
                slope: near.slope,
                fits: is_shallow && facing(normals, near.normal),
            };
            plane.triangles.push(near.corners);
            planes.try_push(plane).is_ok()
        };
        mesh.each_near_line(edge, reach, add).then_some(planes)
    }

    /// Returns the ranges near a plane that does not fit, or near two planes.
    fn ranges(&self, planes: &[Plane]) -> ArrayVec<Range, MAX_RANGES> {
        let rounding = HEIGHT_ROUNDING * self.size;
        let mut ranges = ArrayVec::new();
        for (k, a) in planes.iter().enumerate() {
            if !a.fits {
                ranges.push(Range { from: a.from, to: a.to, curvature: Curvature::Unknown });
                continue;
            }
            for b in planes[k + 1..].iter().filter(|b| b.fits) {
                let (from, to) = (a.from.max(b.from), a.to.min(b.to));
                if from <= to {
                    ranges.push(Range { from, to, curvature: curvature_of(a, b, rounding) });
                }
            }
        }
        ranges
    }

    /// Marks the parts as unknown whose ends are deeper than half of `reach`.
    fn mark_deep(&self, mesh: &MeshField, edge: &Segment, reach: f64, parts: &mut Parts) {
        let deepest = -0.5 * reach;
        let is_deep = |s: f64| match mesh.nearest_within(&(edge.start + edge.along * s), deepest) {
            Ok(nearest) => nearest.distance <= deepest,
            Err(_) => false,
        };
        for part in parts.iter_mut().filter(|part| part.curvature != Curvature::Unknown) {
            if is_deep(part.from) || is_deep(part.to) {
                part.curvature = Curvature::Unknown;
            }
        }
    }
}

/// Returns how the distance changes near two planes.
fn curvature_of(a: &Plane, b: &Plane, rounding: f64) -> Curvature {
    let heights = |a: &Plane, b: &Plane| {
        let corners = a.triangles.iter().flat_map(|corners| corners.iter());
        corners
            .map(|c| b.normal.dot(&(c - b.triangles[0][0])))
            .fold([0.0_f64; 2], |[low, high], h| [low.min(h), high.max(h)])
    };
    if a.normal.dot(b.normal) < NARROWEST {
        return Curvature::Unknown;
    }
    let ([low, high], [low_b, high_b]) = (heights(a, b), heights(b, a));
    if low.min(low_b) >= -rounding {
        // over a valley that the edge meets head-on, it leaves a face on which it lies
        if a.slope.abs().max(b.slope.abs()) < FLAT_SLOPE { Curvature::Concave } else { Curvature::Unknown }
    } else if high.max(high_b) <= rounding {
        Curvature::Convex
    } else {
        Curvature::Unknown
    }
}

/// Divides an edge at the ends of all ranges; returns false if the parts are too many.
fn divide(edge: &Segment, ranges: &[Range], parts: &mut Parts) -> bool {
    let mut from = edge.from;
    while from < edge.to {
        // the next end of a range
        let ends = ranges.iter().flat_map(|range| [range.from, range.to]);
        let to = ends.filter(|end| *end > from).fold(edge.to, f64::min);
        let middle = 0.5 * (from + to);
        let over =
            || ranges.iter().filter(|range| range.from <= middle && middle <= range.to).map(|range| range.curvature);
        let curvature = match over().all(|curvature| curvature == Curvature::Concave) {
            true => Curvature::Concave,
            false if over().all(|curvature| curvature == Curvature::Convex) => Curvature::Convex,
            false => Curvature::Unknown,
        };
        match parts.last_mut() {
            Some(last) if last.curvature == curvature => last.to = to,
            _ => {
                if parts.try_push(Part { from, to, curvature }).is_err() {
                    return false;
                }
            }
        }
        from = to;
    }
    true
}

/// Returns the parts of an edge between two places of its row, with distances from the first place,
/// which may lie beyond the second one.
fn parts_between(parts: &[Part], [first, last]: [f64; 2], length: f64, least: f64) -> Parts {
    let inside = parts.iter().filter(|part| part.from < first.max(last) && first.min(last) < part.to);
    let place = |s: f64| ((s - first) * (last - first).signum()).clamp(0.0, length);
    let mut own: Parts = inside
        .map(|part| {
            let [a, b] = [part.from, part.to].map(place);
            Part { from: a.min(b), to: a.max(b), ..*part }
        })
        .collect();
    if last < first {
        own.reverse();
    }
    // exactly the ends of the edge, not those of rounded places
    if let Some(part) = own.first_mut() {
        part.from = 0.0;
    }
    if let Some(part) = own.last_mut() {
        part.to = length;
    }
    joined(&own, least)
}

/// Joins neighbors of the same curvature; short parts are not worth samples at their ends, so their
/// curvature counts as unknown.
fn joined(parts: &[Part], least: f64) -> Parts {
    let mut joined = Parts::new();
    for part in parts {
        let curvature = if part.to - part.from < least { Curvature::Unknown } else { part.curvature };
        match joined.last_mut() {
            Some(last) if last.curvature == curvature => last.to = part.to,
            _ => joined.push(Part { curvature, ..*part }),
        }
    }
    joined
}

#[cfg(test)]
mod tests {
    use super::super::query::NearestCache;
    use super::super::{Body, BodyElements, Query};
    use super::*;
    use crate::sdf::DistanceField;
    use crate::{Pose, Shape as Solid, TreeSettings, TriMesh};
    use nalgebra::{Translation3, UnitQuaternion};

    /// Returns numbers between -1 and 1.
    fn random(state: &mut u64) -> f64 {
        *state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (*state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// On concave parts the distance, sampled densely, has no minimum within the reach; on convex ones it is nowhere
    /// above its chords. Segments lie near the surface of a shaft with two grooves, flat, in its corners and across.
    #[test]
    fn distances_have_the_shape_of_their_part() {
        let profile = [
            (0.0, -1.0),
            (0.5, -1.0),
            (0.5, -0.3),
            (0.35, -0.2),
            (0.35, 0.2),
            (0.5, 0.2),
            (0.5, 0.6),
            (0.4, 0.6),
            (0.4, 1.0),
            (0.0, 1.0),
        ];
        let shaft = TriMesh::lathe(&profile, 12).unwrap();
        let Solid::Mesh(solid) = Solid::mesh(shaft, &TreeSettings::octree()).unwrap() else { unreachable!() };
        let surface = &solid.surfaces()[0];
        let field = &surface.field;
        let other = Body { elements: BodyElements::Mesh(&surface.elements), field, mesh: Some(field), radius: 1.2 };
        let one = Body { elements: BodyElements::Empty, field, mesh: None, radius: 0.5 };
        let (pose, cache) = (Pose::identity(), NearestCache::new());
        let query = Query::new([&one, &other], &pose, 0.5, None, &cache);
        let (mut state, mut seen) = (1, [0.0; 3]);
        for _ in 0..4000 {
            // beside the axis, parallel to it up to a small angle, or in any direction
            let turn = UnitQuaternion::from_scaled_axis(
                Vec3::from_fn(|_, _| random(&mut state)) * if random(&mut state) < 0.0 { 0.02 } else { 3.0 },
            );
            let at = Vec3::new(0.36 + 0.16 * random(&mut state).abs(), 0.0, random(&mut state));
            let at = UnitQuaternion::from_scaled_axis(Vec3::z() * 3.0 * random(&mut state)) * at;
            let place = Pose::from_parts(Translation3::from(at), turn);
            let segment = Segment { start: at, along: place.rotation * Vec3::z(), from: -0.3, to: 0.3 };
            let reach = 0.02 + 0.02 * random(&mut state).abs();
            for Part { from, to, curvature } in query.parts(&segment, &[], reach, 0.015) {
                seen[curvature as usize] += to - from;
                let distance = |k: usize| {
                    let s = from + (to - from) * k as f64 / 200.0;
                    field.nearest(&(segment.start + segment.along * s)).distance
                };
                let all: Vec<f64> = (0..=200).map(distance).collect();
                for [a, b, c] in all.windows(3).map(|w| [w[0], w[1], w[2]]).filter(|w| w.iter().all(|d| *d <= reach)) {
                    match curvature {
                        Curvature::Concave => assert!(b >= a.min(c) - 1e-12, "{a} {b} {c}"),
                        Curvature::Convex => assert!(b <= 0.5 * (a + c) + 1e-12, "{a} {b} {c}"),
                        Curvature::Unknown => {}
                    }
                    assert!(curvature == Curvature::Unknown || b > -reach, "{b} m deep");
                }
            }
        }
        let all: f64 = seen.iter().sum();
        assert!(seen[0] > 0.3 * all && seen[1] > 0.005 * all, "concave, convex and unknown: {seen:?} m");
        assert!(!field.is_convex());
    }
}
