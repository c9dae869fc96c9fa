//! Box against box: separating axes, then a face manifold, a pair of edges, or the closest points.
//!
//! Source: Gottschalk, Lin, Manocha, *OBBTree* (1996) for the 15 axes; clipping as in `clip.rs`.
//! All in A's frame.
//!
//! | symbol | meaning |
//! |---|---|
//! | `R` | B's axes as columns, in A's frame |
//! | `t` | B's center in A's frame |
//! | `a`, `b` | half extents |
//! | separation on axis `n` | `|t·n| − Σ aᵢ|eᵢ·n| − Σ bⱼ|Rⱼ·n|`, a lower bound of the signed distance |
//!
//! A face is preferred over a pair of edges by a small bias, because it gives a manifold. If the
//! boxes are separated and no face manifold reaches the greatest separation, the exact closest
//! points are used (`box_closest.rs`).

use super::box_pair::BoxPair;
use super::clip::Polygon;
use super::{box_closest, reduce};
use crate::{Contact, Mat3, NormalFrom, Pose, Vec3};

/// Cosine of the angle between a single contact and a face up to which the points of the face may
/// follow.
const FLAT: f64 = 0.9;
/// Points closer to the contact than this fraction of the smallest half extent are the same.
const SAME_PLACE: f64 = 0.1;

/// A face axis: which box, which axis, its separation.
struct FaceAxis {
    of_b: bool,
    k: usize,
    separation: f64,
}

/// A pair of edges: unit axis from B towards A, edge directions, separation.
struct EdgeAxis {
    normal: Vec3,
    i: usize,
    j: usize,
    separation: f64,
}

pub(super) fn box_box(a: &Vec3, pose_a: &Pose, b: &Vec3, pose_b: &Pose, margin: f64, out: &mut Vec<Contact>) {
    let rotation_a = pose_a.rotation.to_rotation_matrix();
    let offset = pose_b.translation.vector - pose_a.translation.vector;
    if offset.norm_squared() > (a.norm() + b.norm() + margin).powi(2) {
        return;
    }
    let rotation_b = pose_b.rotation.to_rotation_matrix();
    let boxes = BoxPair {
        a: *a,
        b: *b,
        r: rotation_a.matrix().tr_mul(rotation_b.matrix()),
        t: rotation_a.matrix().tr_mul(&offset),
    };
    let start = out.len();
    in_frame_of_a(&boxes, margin, out);
    for contact in &mut out[start..] {
        contact.point = rotation_a * contact.point + pose_a.translation.vector;
        contact.normal = rotation_a * contact.normal;
    }
}

fn in_frame_of_a(f: &BoxPair, margin: f64, out: &mut Vec<Contact>) {
    let smallest = f.a.min().min(f.b.min());
    let Some(face) = best_face(f, margin, 1e-4 * smallest) else { return };
    let Some(edge) = best_edge(f, margin) else { return };
    let greatest = edge.as_ref().map_or(face.separation, |e| e.separation.max(face.separation));
    let bias = 1e-3 * smallest + 0.05 * greatest.abs();
    if greatest <= 0.0 {
        match edge {
            Some(edge) if edge.separation > face.separation + bias => {
                push_with_face(f, edge_contact(f, &edge), &face, margin, out);
            }
            _ => face_or_support(f, &face, margin, out),
        }
        return;
    }
    let start = out.len();
    let least = face_manifold(f, &face, margin, out);
    if least > (greatest + bias).min(margin) || face.separation < greatest - bias {
        match box_closest::closest(f) {
            Some(contact) if contact.gap <= margin => {
                out.insert(start, contact);
                keep_following(f, start, out);
            }
            _ => out.truncate(start),
        }
    }
}

/// Appends a contact and those points of a face manifold that may follow it: tilted boxes meet at
/// one point, and turn until they lie flat, within one step if they are fast.
fn push_with_face(f: &BoxPair, contact: Contact, face: &FaceAxis, margin: f64, out: &mut Vec<Contact>) {
    let start = out.len();
    out.push(contact);
    face_manifold(f, face, margin, out);
    keep_following(f, start, out);
}

/// Keeps the contact at `start` and those of the following points of a face manifold that may follow it.
fn keep_following(f: &BoxPair, start: usize, out: &mut Vec<Contact>) {
    let contact = out[start];
    let start = start + 1;
    let same_place = SAME_PLACE * f.a.min().min(f.b.min());
    let mut n = start;
    for i in start..out.len() {
        let other = out[i];
        let follows = other.gap > contact.gap
            && other.normal.dot(&contact.normal) > FLAT
            && (other.point - contact.point).norm() > same_place;
        if follows {
            out[n] = other;
            n += 1;
        }
    }
    out.truncate(n);
}

/// Returns the face axis of greatest separation (A's unless B's is greater by `bias`); `None` if
/// some axis separates by more than `margin`.
fn best_face(f: &BoxPair, margin: f64, bias: f64) -> Option<FaceAxis> {
    let across_a = f.t.abs() - f.a - f.r.abs() * f.b;
    let across_b = f.r.tr_mul(&f.t).abs() - f.b - f.r.abs().tr_mul(&f.a);
    if across_a.max() > margin || across_b.max() > margin {
        return None;
    }
    let (ka, kb) = (greatest_axis(&across_a, bias), greatest_axis(&across_b, bias));
    let of_b = across_b[kb] > across_a[ka] + bias;
    let (k, separation) = if of_b { (kb, across_b[kb]) } else { (ka, across_a[ka]) };
    Some(FaceAxis { of_b, k, separation })
}

/// Returns the index of the greatest entry; a later entry must be greater by `bias`.
fn greatest_axis(v: &Vec3, bias: f64) -> usize {
    (1..3).fold(0, |best, k| if v[k] > v[best] + bias { k } else { best })
}

/// Returns the pair of non-parallel edges of greatest separation, if any; outer `None` if one
/// separates by more than `margin`.
fn best_edge(f: &BoxPair, margin: f64) -> Option<Option<EdgeAxis>> {
    let mut best: Option<EdgeAxis> = None;
    for i in 0..3 {
        for j in 0..3 {
            let cos = f.r[(i, j)];
            let square = 1.0 - cos * cos;
            if square < 1e-4 {
                continue;
            }
            let axis = Vec3::ith(i, 1.0).cross(&f.r.column(j)) / square.sqrt();
            let along = axis.dot(&f.t);
            let separation = along.abs() - axis.abs().dot(&f.a) - f.r.tr_mul(&axis).abs().dot(&f.b);
            if separation > margin {
                return None;
            }
            if best.as_ref().is_none_or(|b| separation > b.separation + 1e-12) {
                best = Some(EdgeAxis { normal: if along > 0.0 { -axis } else { axis }, i, j, separation });
            }
        }
    }
    Some(best)
}

/// Returns one contact midway between the two edges that support the axis.
fn edge_contact(f: &BoxPair, edge: &EdgeAxis) -> Contact {
    let EdgeAxis { normal, i, j, separation } = edge;
    let local_b = f.r.tr_mul(normal);
    // A's edge lies furthest against the normal, B's furthest along it
    let mut on_a = f.a.zip_map(normal, |h, n| if n > 0.0 { -h } else { h });
    let mut on_b = f.b.zip_map(&local_b, |h, n| if n > 0.0 { h } else { -h });
    let signs = sign_bits(&on_a) * 8 + sign_bits(&on_b);
    on_a[*i] = 0.0;
    on_b[*j] = 0.0;
    let middle_b = f.t + f.r * on_b;
    let (s, t) =
        super::segment::segment_segment(&on_a, &Vec3::ith(*i, f.a[*i]), &middle_b, &(f.r.column(*j) * f.b[*j]));
    let point = 0.5 * (on_a + Vec3::ith(*i, s * f.a[*i]) + middle_b + f.r.column(*j) * (t * f.b[*j]));
    let feature = (1 << 20) | ((i * 3 + j) as u64) << 8 | signs;
    Contact {
        point,
        normal: *normal,
        gap: *separation,
        feature,
        core_a: 0.0,
        core_b: 0.0,
        normal_from: NormalFrom::Edges,
        shapes: [0; 2],
    }
}

fn sign_bits(v: &Vec3) -> u64 {
    (0..3).map(|k| u64::from(v[k] > 0.0) << k).sum()
}

/// Appends a face manifold that is never empty: if rounding clips all points, it is the supporting
/// corner.
fn face_or_support(f: &BoxPair, face: &FaceAxis, margin: f64, out: &mut Vec<Contact>) {
    let start = out.len();
    face_manifold(f, face, margin, out);
    if out.len() == start {
        let view = FaceView::new(f, face);
        let corner = view.incident_face()[0];
        let mut contact = view.contact(corner, 63);
        contact.gap = face.separation;
        out.push(contact);
    }
}

/// Clips the incident face by the prism of the reference face. Appends up to 4 points with gap ≤
/// `margin`, and returns the smallest gap.
fn face_manifold(f: &BoxPair, face: &FaceAxis, margin: f64, out: &mut Vec<Contact>) -> f64 {
    let view = FaceView::new(f, face);
    let slop = 1e-3 * view.half.min().min(view.other_half.min());
    let mut polygon = Polygon::quad(view.incident_face());
    for (n, k) in [(face.k + 1) % 3, (face.k + 2) % 3].into_iter().enumerate() {
        let bound = view.half[k] + slop;
        polygon = polygon.clip(k, 1.0, bound, 4 + 2 * n as u8).clip(k, -1.0, bound, 5 + 2 * n as u8);
    }
    let start = out.len();
    let mut least = f64::INFINITY;
    for (point, name) in polygon.vertices() {
        let contact = view.contact(point, name);
        least = least.min(contact.gap);
        if contact.gap <= margin {
            out.push(contact);
        }
    }
    reduce::reduce_to_four(out, start);
    least
}

/// The other box in the frame of the reference box.
struct FaceView<'a> {
    boxes: &'a BoxPair,
    face: &'a FaceAxis,
    half: Vec3,
    other_half: Vec3,
    /// The other box's axes and center in the reference frame.
    axes: Mat3,
    center: Vec3,
    /// The side of the reference axis that faces the other box.
    sign: f64,
}

impl<'a> FaceView<'a> {
    fn new(f: &'a BoxPair, face: &'a FaceAxis) -> FaceView<'a> {
        let (half, other_half, axes, center) =
            if face.of_b { (f.b, f.a, f.r.transpose(), -f.r.tr_mul(&f.t)) } else { (f.a, f.b, f.r, f.t) };
        let sign = if center[face.k] < 0.0 { -1.0 } else { 1.0 };
        FaceView { boxes: f, face, half, other_half, axes, center, sign }
    }

    /// Returns the axis and side of the other box's face that is most opposite to the reference
    /// normal.
    fn incident(&self) -> (usize, f64) {
        let along = self.axes.row(self.face.k).transpose() * self.sign;
        let j = (1..3).fold(0, |best, j| if along[j].abs() > along[best].abs() + 1e-9 { j } else { best });
        (j, if along[j] > 0.0 { -1.0 } else { 1.0 })
    }

    fn incident_face(&self) -> [Vec3; 4] {
        let (j, side) = self.incident();
        let (j1, j2) = ((j + 1) % 3, (j + 2) % 3);
        let middle = self.center + self.axes.column(j) * (side * self.other_half[j]);
        let (u, v) = (self.axes.column(j1) * self.other_half[j1], self.axes.column(j2) * self.other_half[j2]);
        [middle + u + v, middle - u + v, middle - u - v, middle + u - v]
    }

    /// Returns the contact, in A's frame, of a point of the incident face, given in the reference
    /// frame.
    fn contact(&self, p: Vec3, name: u64) -> Contact {
        let k = self.face.k;
        let gap = self.sign * p[k] - self.half[k];
        let outward = Vec3::ith(k, self.sign);
        let middle = p - outward * (0.5 * gap);
        let (j, side) = self.incident();
        let faces = 6 * (2 * k + usize::from(self.sign > 0.0)) + 2 * j + usize::from(side > 0.0);
        let feature = (u64::from(self.face.of_b) << 16) | (faces as u64) << 6 | name;
        let (point, normal, normal_from) = if self.face.of_b {
            (self.boxes.t + self.boxes.r * middle, self.boxes.r * outward, NormalFrom::FaceOfB)
        } else {
            (middle, -outward, NormalFrom::FaceOfA)
        };
        Contact { point, normal, gap, feature, core_a: 0.0, core_b: 0.0, normal_from, shapes: [0; 2] }
    }
}
