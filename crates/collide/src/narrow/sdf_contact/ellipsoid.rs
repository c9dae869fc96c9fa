//! An ellipsoid against a field: the points at which its surface is parallel to a face of the other
//! body, to the side of a cone, or to another ellipsoid. Vertices, edges, rims and axes of the other
//! body are tested against the ellipsoid's own field.
//!
//! ```text
//! flat face with normal n    S_A(−n), the point of the ellipsoid farthest towards it
//! D(n)                       h_B(n) + h_A(−n) − n·t, minus the gap along n (`min_translation`)
//! two ellipsoids             min of D over unit n:   gradient w = S_B(n) − S_A(−n) − t across n
//!                            Hessian across n  ∇²h_B + ∇²h_A − D·1
//! ```
//!
//! Where `D < 0` the Hessian is positive definite, so for separated ellipsoids `D` has one minimum and
//! Newton's method with a line search finds it from any start. In an overlap `−D·1` is replaced by
//! `+|D|·1`, and the search descends to a minimum; deep overlaps are searched in all directions by
//! [`min_translation`](super::min_translation).
//!
//! | symbol | meaning |
//! |---|---|
//! | `n` | unit normal out of B, towards A |
//! | `h`, `S` | support function and support point (`shape/ellipsoid.rs`) |
//! | `t` | center of A in the frame of B |

use super::super::reduce::Collector;
use super::BodyElements;
use super::query::{Query, point_normal};
use crate::sdf::field::MeshField;
use crate::sdf::{Feature, Hit, TOUCHING};
use crate::shape::ellipsoid::{closest, curvature_radii, mean_radius, support_point};
use crate::{Mat3, NormalFrom, Vec3};

/// Largest difference between the distance from a face's plane and that from the body, in radii of the
/// smaller body: the point is above the face.
const ABOVE: f64 = 1e-9;
/// Maximum number of Newton steps, and of halvings of one.
const MAX_STEPS: usize = 50;
const MAX_HALVINGS: usize = 30;
/// Length of the gradient, in radii of the smaller body, at which the search ends.
const FLAT: f64 = 1e-14;

impl Query<'_> {
    /// Queries the points at which the ellipsoid is parallel to the other body.
    pub(super) fn query_ellipsoid(&self, half: &Vec3, found: &mut Collector) {
        if self.field.bound(&self.pose.translation.vector) - half.max() > found.limit() {
            return;
        }
        self.record_center();
        match (self.mesh, self.other) {
            (Some(mesh), _) => self.ellipsoid_on_mesh(half, mesh, found),
            (_, BodyElements::Box(_)) => {
                for face in 0..6 {
                    self.ellipsoid_on_face(
                        half,
                        &Vec3::ith(face / 2, if face % 2 == 0 { -1.0 } else { 1.0 }),
                        face as u64,
                        found,
                    );
                }
            }
            (_, BodyElements::Cylinder { .. }) => {
                [-1.0, 1.0]
                    .iter()
                    .enumerate()
                    .for_each(|(n, z)| self.ellipsoid_on_face(half, &(Vec3::z() * *z), n as u64, found));
            }
            (_, BodyElements::Cone(_)) => self.ellipsoid_on_face(half, &-Vec3::z(), 0, found),
            // once per pair
            (_, BodyElements::Ellipsoid(other)) if self.second.is_none() => self.two_ellipsoids(half, other, found),
            (_, BodyElements::Empty) => self.ellipsoid_on_face(half, &Vec3::z(), 0, found),
            _ => {}
        }
    }

    /// Records the distance of the body's center, which shows a deep overlap without any element.
    pub(super) fn record_center(&self) {
        self.record(&self.field.hit(&self.pose.translation.vector, &[], TOUCHING), 0.0);
    }

    /// Returns the point of the ellipsoid farthest along a direction, in the field's frame.
    fn farthest(&self, half: &Vec3, along: &Vec3) -> Vec3 {
        self.to_field(&support_point(half, &self.rotation.tr_mul(along)))
    }

    /// Queries the point that is farthest towards a flat face with normal `n`, if it is above or below
    /// that face.
    fn ellipsoid_on_face(&self, half: &Vec3, n: &Vec3, face: u64, found: &mut Collector) {
        let at = self.farthest(half, &-n);
        if self.field.bound(&at) > found.limit() {
            return;
        }
        let hit = self.field.hit(&at, &[-n], TOUCHING);
        self.record(&hit, 0.0);
        let above = hit.normal.dot(n) > 1.0 - 1e-12 && (hit.distance - hit.nearest).abs() < ABOVE * self.size;
        if hit.feature == Feature::Face && hit.facing && above {
            self.push_ellipsoid(half, &at, &hit, point_normal(&hit), face, found);
        }
    }

    /// Queries all faces of a mesh within reach.
    fn ellipsoid_on_mesh(&self, half: &Vec3, mesh: &MeshField, found: &mut Collector) {
        let center = self.pose.translation.vector;
        let reach = half.max() + found.limit().max(0.0);
        mesh.faces_within(&center, reach, &mut |face| {
            let n = mesh.face_normal(face);
            let at = self.farthest(half, &-n);
            let plane = n.dot(&(at - mesh.faces()[face][0]));
            // a face farther below than the ellipsoid is large cannot be the nearest to that point
            if plane > found.limit() || plane < -2.0 * half.max() {
                return;
            }
            let hit = self.field.hit(&at, &[-n], TOUCHING);
            self.record(&hit, 0.0);
            let above = hit.normal.dot(&n) > 1.0 - 1e-12
                && (hit.distance - plane).abs() < ABOVE * self.size
                && (hit.distance - hit.nearest).abs() < ABOVE * self.size;
            if hit.feature == Feature::Face && hit.facing && above && !self.is_duplicate(&at, 0.0, &hit, found) {
                self.push_ellipsoid(half, &at, &hit, point_normal(&hit), 16 + face as u64, found);
            }
        });
    }

    /// Adds the contact of a point of the ellipsoid's surface, whose core is behind it.
    fn push_ellipsoid(&self, half: &Vec3, at: &Vec3, hit: &Hit, from: NormalFrom, feature: u64, found: &mut Collector) {
        let core = mean_radius(half, &self.rotation.tr_mul(&-hit.normal));
        let hit = Hit { distance: hit.distance + core, ..*hit };
        self.push(&(at + hit.normal * core), core, &hit, from, 1 << 58 | feature, found);
    }

    fn two_ellipsoids(&self, half: &Vec3, other: &Vec3, found: &mut Collector) {
        let Some((n, depth)) = self.direction_between(half, other) else { return };
        if -depth > found.limit() {
            return;
        }
        let (at, on_b) = (self.farthest(half, &-n), support_point(other, &n));
        let nearest = closest(other, &at).distance;
        let core = mean_radius(other, &n);
        let hit =
            Hit { distance: n.dot(&(at - on_b)), nearest, normal: n, core, feature: Feature::Point, facing: true };
        self.record(&hit, 0.0);
        self.push_ellipsoid(half, &at, &hit, NormalFrom::CorePoints, 0, found);
    }

    /// Returns the normal of the least translation nearest to the line of centers, and `D` there.
    fn direction_between(&self, half: &Vec3, other: &Vec3) -> Option<(Vec3, f64)> {
        let t = self.pose.translation.vector;
        let own = |n: &Vec3| self.rotation.tr_mul(&-n);
        let value = |n: &Vec3| other.component_mul(n).norm() + half.component_mul(&own(n)).norm() - n.dot(&t);
        // from the tangent planes on the line of centers to one that separates them better
        let mut n = t.try_normalize(1e-12 * self.size)?;
        let mut depth = value(&n);
        for _ in 0..MAX_STEPS {
            let gradient = support_point(other, &n) - self.rotation * support_point(half, &own(&n)) - t;
            let across = gradient - n * n.dot(&gradient);
            if across.norm() <= FLAT * self.size {
                break;
            }
            let bend = curvature_radii(other, &n)
                + self.rotation * curvature_radii(half, &own(&n)) * self.rotation.transpose();
            let least = 1e-12 * self.size;
            let hessian =
                bend + (Mat3::identity() - n * n.transpose()) * depth.abs().max(least) + n * n.transpose() * self.size;
            let step = -(hessian.try_inverse()? * across);
            let slope = across.dot(&step);
            let mut share = 1.0;
            let mut better = None;
            for _ in 0..MAX_HALVINGS {
                let next = (n + step * share).normalize();
                let there = value(&next);
                if there <= depth + 0.1 * share * slope {
                    better = Some((next, there));
                    break;
                }
                share *= 0.5;
            }
            // within rounding of the minimum no step is better
            let Some(better) = better else {
                n = (n + step).normalize();
                depth = value(&n);
                break;
            };
            (n, depth) = better;
        }
        Some((n, depth))
    }
}
