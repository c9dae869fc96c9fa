//! Capsule (always A) against capsule and box.
//!
//! Both start with the exact closest points of the core segments. If a capsule is parallel to
//! another, or to a face, the two ends of the overlap are contacts too, so that it rests on two
//! points.

use super::segment::{clip_to_prism, closest_on_segment, segment_box, segment_segment};
use super::sphere::{clamp, region};
use crate::shape::axis;
use crate::{Contact, NormalFrom, Pose, Vec3};

/// Sine of the angle below which two capsules are treated as parallel.
const PARALLEL_SINE: f64 = 0.05;
/// Cosine of the angle between the closest direction and a face normal above which the face
/// supports the capsule.
const FACE_COSINE: f64 = 0.99;

pub(super) fn capsule_capsule(
    (ra, la): (f64, f64),
    pose_a: &Pose,
    (rb, lb): (f64, f64),
    pose_b: &Pose,
    margin: f64,
    out: &mut Vec<Contact>,
) {
    let (ca, cb) = (pose_a.translation.vector, pose_b.translation.vector);
    let (ea, eb) = (axis(pose_a), axis(pose_b));
    let (ua, ub) = (ea * la, eb * lb);
    let (s, t) = segment_segment(&ca, &ua, &cb, &ub);
    let mut closest = Contact::between_cores((ca + ua * s, ra), (cb + ub * t, rb), 0);
    if closest.gap > margin {
        return;
    }
    let across = ea.cross(&eb).norm();
    if across < PARALLEL_SINE && push_overlap_ends((ca, ua, ra), (cb, ub, rb), closest.gap, margin, out) {
        return;
    }
    let interior = s.abs() < 1.0 && t.abs() < 1.0;
    if interior && across >= PARALLEL_SINE {
        closest.normal_from = NormalFrom::Edges;
    }
    if closest.gap + ra + rb < 1e-9 * (ra + rb) {
        separate_crossing_axes(&mut closest, &ea, &eb, rb);
    }
    out.push(closest);
}

/// If the axes intersect, the normal is perpendicular to both.
fn separate_crossing_axes(contact: &mut Contact, ea: &Vec3, eb: &Vec3, rb: f64) {
    let cross = ea.cross(eb);
    let normal = if cross.norm() > 1e-9 { cross.normalize() } else { any_perpendicular(ea) };
    contact.point += (normal - contact.normal) * (rb + 0.5 * contact.gap);
    contact.normal = normal;
}

fn any_perpendicular(e: &Vec3) -> Vec3 {
    e.cross(&Vec3::ith(e.iamin(), 1.0)).normalize()
}

/// Appends contacts at both ends of the overlap of two parallel capsules. Returns false if there is
/// no overlap, or if the closest points, at gap `least`, lie inside it and are closer.
fn push_overlap_ends(
    a: (Vec3, Vec3, f64),
    b: (Vec3, Vec3, f64),
    least: f64,
    margin: f64,
    out: &mut Vec<Contact>,
) -> bool {
    let ((ca, ua, ra), (cb, ub, rb)) = (a, b);
    let uu = ua.norm_squared();
    let ends = [(cb - ub - ca).dot(&ua) / uu, (cb + ub - ca).dot(&ua) / uu];
    let (low, high) = (ends[0].min(ends[1]).max(-1.0), ends[0].max(ends[1]).min(1.0));
    if (high - low) * uu.sqrt() < 1e-3 * (ra + rb) {
        return false;
    }
    let at = |s: f64, feature| {
        let core_a = ca + ua * s;
        let core_b = cb + ub * closest_on_segment(&(core_a - cb), &ub);
        Contact::between_cores((core_a, ra), (core_b, rb), feature)
    };
    let pair = [at(low, 1), at(high, 2)];
    let touching = pair[0].gap + ra + rb < 1e-9 * (ra + rb) || pair[1].gap + ra + rb < 1e-9 * (ra + rb);
    if touching {
        return false;
    }
    out.extend(pair.into_iter().filter(|c| c.gap <= margin));
    pair[0].gap.min(pair[1].gap) <= least + 1e-9 * (ra + rb)
}

/// A capsule's segment `c + s·u`, `s ∈ [−1, 1]`, in the frame of the box.
struct CoreSegment {
    c: Vec3,
    u: Vec3,
    radius: f64,
}

impl CoreSegment {
    fn at(&self, s: f64) -> Vec3 {
        self.c + self.u * s
    }
}

/// Works in the frame of the box until a contact is appended.
pub(super) fn capsule_box(
    (radius, half_length): (f64, f64),
    pose_a: &Pose,
    half: &Vec3,
    pose_b: &Pose,
    margin: f64,
    out: &mut Vec<Contact>,
) {
    let local = pose_b.inv_mul(pose_a);
    let core = CoreSegment { c: local.translation.vector, u: axis(&local) * half_length, radius };
    let s = segment_box(&core.c, &core.u, half);
    let distance = (core.at(s) - clamp(&core.at(s), half)).norm();
    if distance > radius + margin {
        return;
    }
    let start = out.len();
    if distance > 1e-9 * half.max() {
        separated_cores(&core, s, half, margin, out);
    } else {
        crossing_cores(&core, half, margin, out);
    }
    for contact in &mut out[start..] {
        contact.point = (pose_b * nalgebra::Point3::from(contact.point)).coords;
        contact.normal = pose_b.rotation * contact.normal;
    }
}

/// Handles a core segment outside the box; `s` is its closest point.
fn separated_cores(core: &CoreSegment, s: f64, half: &Vec3, margin: f64, out: &mut Vec<Contact>) {
    let (p, radius) = (core.at(s), core.radius);
    let offset = p - clamp(&p, half);
    let distance = offset.norm();
    let normal = offset / distance;
    let k = normal.iamax();
    let mut least = f64::INFINITY;
    if normal[k].abs() > FACE_COSINE {
        least = push_on_face(core, half, (k, normal[k].signum()), margin, out);
    }
    let gap = distance - radius;
    if least > (gap + 1e-3 * radius).min(margin) {
        let edge_on_edge = s.abs() < 1.0 && offset.iter().filter(|d| **d != 0.0).count() == 2;
        out.push(Contact {
            point: p - normal * (radius + 0.5 * gap),
            normal,
            gap,
            feature: 1000 + region(&p, half) * 3 + end_code(s),
            core_a: radius,
            core_b: 0.0,
            normal_from: if edge_on_edge { NormalFrom::Edges } else { NormalFrom::CorePoints },
            shapes: [0; 2],
        });
    }
}

fn end_code(s: f64) -> u64 {
    if s <= -1.0 {
        0
    } else if s >= 1.0 {
        2
    } else {
        1
    }
}

/// Appends contacts at both ends of the part of the segment that is over the face across axis `k`
/// on side `sign`. Returns the smallest gap.
fn push_on_face(core: &CoreSegment, half: &Vec3, (k, sign): (usize, f64), margin: f64, out: &mut Vec<Contact>) -> f64 {
    let (slop, radius) = (1e-3 * half.min(), core.radius);
    let Some((low, high)) = clip_to_prism(&core.c, &core.u, &half.add_scalar(slop), k) else { return f64::INFINITY };
    let ends = if (high - low) * core.u.norm() < 1e-3 * radius { &[low][..] } else { &[low, high][..] };
    let mut least = f64::INFINITY;
    for (n, &s) in ends.iter().enumerate() {
        let p = core.at(s);
        let gap = sign * p[k] - half[k] - radius;
        least = least.min(gap);
        if gap <= margin {
            let normal = Vec3::ith(k, sign);
            let feature = 10 * k as u64 + if sign > 0.0 { 5 } else { 0 } + n as u64;
            let point = p - normal * (radius + 0.5 * gap);
            out.push(Contact {
                point,
                normal,
                gap,
                feature,
                core_a: radius,
                core_b: 0.0,
                normal_from: NormalFrom::FaceOfB,
                shapes: [0; 2],
            });
        }
    }
    least
}

/// Handles a core segment through the box: the greatest separation over the faces and the cross
/// products of edges.
fn crossing_cores(core: &CoreSegment, half: &Vec3, margin: f64, out: &mut Vec<Contact>) {
    let CoreSegment { c, u, radius } = core;
    let face = c.abs() - u.abs() - half;
    let k = face.imax();
    let edge =
        (0..3).filter_map(|j| edge_separation(c, u, half, j)).fold(None, |best: Option<(f64, usize, Vec3)>, new| {
            if best.is_none_or(|b| new.0 > b.0) { Some(new) } else { best }
        });
    let bias = 1e-3 * half.min() - 0.05 * face[k];
    match edge {
        Some((separation, j, normal)) if separation > face[k] + bias => {
            let gap = separation - radius;
            let point = crossing_point(c, u, half, j, &normal) - normal * (0.5 * (separation + radius));
            let feature = 2000 + j as u64;
            out.push(Contact {
                point,
                normal,
                gap,
                feature,
                core_a: *radius,
                core_b: 0.0,
                normal_from: NormalFrom::Edges,
                shapes: [0; 2],
            });
        }
        _ => {
            let sign = if c[k] < 0.0 { -1.0 } else { 1.0 };
            push_on_face(core, half, (k, sign), margin, out);
        }
    }
}

/// Returns the separation along `± e_j × u`, towards the segment; `None` if the two are parallel.
fn edge_separation(c: &Vec3, u: &Vec3, half: &Vec3, j: usize) -> Option<(f64, usize, Vec3)> {
    let cross = Vec3::ith(j, 1.0).cross(u);
    let length = cross.norm();
    if length < 1e-3 * u.norm() {
        return None;
    }
    let axis = if cross.dot(c) < 0.0 { -cross / length } else { cross / length };
    Some((axis.dot(c) - axis.abs().dot(half), j, axis))
}

/// Returns the point of the segment nearest to the box's edge along `j` that supports `normal`.
fn crossing_point(c: &Vec3, u: &Vec3, half: &Vec3, j: usize, normal: &Vec3) -> Vec3 {
    let mut edge = half.zip_map(normal, |h, n| if n < 0.0 { -h } else { h });
    edge[j] = 0.0;
    let (s, _) = segment_segment(c, u, &edge, &Vec3::ith(j, half[j]));
    c + u * s
}
