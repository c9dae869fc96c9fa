//! Exact signed distances of the primitives, each in its own frame.

use super::{DistanceField, Feature, Hit, facing, opposition};
use crate::Vec3;

/// Maximum distance beyond the closest face up to which another face can be selected, in sizes of
/// the body.
const FACE_CHOICE_RANGE: f64 = 0.02;
/// Fraction of a distance along a face's normal from which a point is directly above the face.
const STRAIGHT_ABOVE: f64 = 1.0 - 5e-7;

/// `z ≤ 0`.
pub(crate) struct HalfSpaceField;

/// All points within `radius` of the segment from `−half_length` to `half_length` on z; a sphere if
/// that is 0.
pub(crate) struct RoundField {
    pub radius: f64,
    pub half_length: f64,
}

/// A box.
pub(crate) struct BoxField {
    pub half: Vec3,
}

/// A cylinder along z.
pub(crate) struct CylinderField {
    pub radius: f64,
    pub half_length: f64,
}

impl DistanceField for HalfSpaceField {
    fn bound(&self, p: &Vec3) -> f64 {
        p.z
    }

    fn hit(&self, p: &Vec3, normals: &[Vec3], _beside: f64) -> Hit {
        let normal = Vec3::z();
        Hit { distance: p.z, nearest: p.z, normal, core: 0.0, feature: Feature::Face, facing: facing(normals, &normal) }
    }

    fn is_convex(&self) -> bool {
        true
    }

    fn is_linear(&self) -> bool {
        true
    }
}

impl DistanceField for RoundField {
    fn bound(&self, p: &Vec3) -> f64 {
        (p - Vec3::z() * p.z.clamp(-self.half_length, self.half_length)).norm() - self.radius
    }

    fn hit(&self, p: &Vec3, normals: &[Vec3], _beside: f64) -> Hit {
        let offset = p - Vec3::z() * p.z.clamp(-self.half_length, self.half_length);
        let length = offset.norm();
        let normal = if length > 1e-12 * self.radius { offset / length } else { Vec3::x() };
        let feature = if p.z.abs() < self.half_length { Feature::Line(Vec3::z()) } else { Feature::Point };
        let distance = length - self.radius;
        Hit { distance, nearest: distance, normal, core: self.radius, feature, facing: facing(normals, &normal) }
    }

    fn is_round(&self) -> bool {
        true
    }

    fn is_convex(&self) -> bool {
        true
    }
}

impl DistanceField for BoxField {
    fn bound(&self, p: &Vec3) -> f64 {
        let outside = p.abs() - self.half;
        if outside.max() > 0.0 { outside.sup(&Vec3::zeros()).norm() } else { outside.max() }
    }

    fn hit(&self, p: &Vec3, normals: &[Vec3], beside: f64) -> Hit {
        let touching = beside * self.half.max();
        let outside = p.abs() - self.half;
        let sign = |k: usize| Vec3::ith(k, if p[k] < 0.0 { -1.0 } else { 1.0 });
        let beyond = outside.sup(&Vec3::zeros());
        let distance = beyond.norm();
        if distance > touching {
            let k = beyond.imax();
            let normal = match beyond[k] > STRAIGHT_ABOVE * distance {
                true => sign(k),
                false => beyond.zip_map(p, |b, x| if x < 0.0 { -b } else { b }) / distance,
            };
            let free = (0..3).filter(|&k| beyond[k] == 0.0);
            let feature = match (beyond[k] > STRAIGHT_ABOVE * distance, free.clone().count()) {
                (true, _) => Feature::Face,
                (false, 1) => Feature::Edge(Vec3::ith(free.sum(), 1.0)),
                _ => Feature::Point,
            };
            return Hit { distance, nearest: distance, normal, core: 0.0, feature, facing: facing(normals, &normal) };
        }
        let nearer = |&a: &usize, &b: &usize| {
            // of faces at the same distance, the one most opposite to the element
            let square = || opposition(normals, &sign(a)).total_cmp(&opposition(normals, &sign(b)));
            if (outside[a] - outside[b]).abs() < touching { square() } else { outside[b].total_cmp(&outside[a]) }
        };
        let facing_one = (0..3)
            .filter(|&k| facing(normals, &sign(k)) && outside[k] > outside.max() - FACE_CHOICE_RANGE * self.half.max())
            .min_by(nearer);
        let k = facing_one.unwrap_or(outside.imax());
        Hit {
            distance: outside[k],
            nearest: if distance > 0.0 { distance } else { outside.max() },
            normal: sign(k),
            core: 0.0,
            feature: Feature::Face,
            facing: facing_one.is_some(),
        }
    }

    fn is_convex(&self) -> bool {
        true
    }
}

impl DistanceField for CylinderField {
    fn bound(&self, p: &Vec3) -> f64 {
        let (r, z) = ((p.x * p.x + p.y * p.y).sqrt() - self.radius, p.z.abs() - self.half_length);
        if r.max(z) > 0.0 { (r.max(0.0).powi(2) + z.max(0.0).powi(2)).sqrt() } else { r.max(z) }
    }

    fn hit(&self, p: &Vec3, normals: &[Vec3], beside: f64) -> Hit {
        let touching = beside * self.radius.max(self.half_length);
        let across = Vec3::new(p.x, p.y, 0.0);
        let length = across.norm();
        let outward = if length > 1e-12 * self.radius { across / length } else { Vec3::x() };
        let up = Vec3::z() * if p.z < 0.0 { -1.0 } else { 1.0 };
        let (r, z) = (length - self.radius, p.z.abs() - self.half_length);
        let distance = self.bound(p);
        let side = Hit {
            distance: r,
            nearest: distance,
            normal: outward,
            core: self.radius,
            feature: Feature::Line(Vec3::z()),
            facing: facing(normals, &outward),
        };
        let end = Hit {
            distance: z,
            nearest: distance,
            normal: up,
            core: 0.0,
            feature: Feature::Face,
            facing: facing(normals, &up),
        };
        if distance > touching {
            return match (r > STRAIGHT_ABOVE * distance, z > STRAIGHT_ABOVE * distance) {
                (true, _) => side,
                (_, true) => end,
                _ => {
                    let normal = (outward * r + up * z) / distance;
                    Hit {
                        distance,
                        nearest: distance,
                        normal,
                        core: 0.0,
                        feature: Feature::Point,
                        facing: facing(normals, &normal),
                    }
                }
            };
        }
        let square = opposition(normals, &outward) < opposition(normals, &up);
        let side_first = if (r - z).abs() < touching { square } else { r > z };
        let near = |depth: f64| depth > r.max(z) - FACE_CHOICE_RANGE * self.radius.max(self.half_length);
        match (side.facing, end.facing) {
            (true, false) if near(r) => side,
            (false, true) if near(z) => end,
            _ if side_first => side,
            _ => end,
        }
    }

    fn is_round(&self) -> bool {
        true
    }

    fn is_curved(&self) -> bool {
        true
    }

    fn is_convex(&self) -> bool {
        true
    }
}
