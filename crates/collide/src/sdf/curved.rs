//! Exact signed distances of an ellipsoid and a cone, each in its own frame.

use super::{DistanceField, Feature, Hit, facing, opposition};
use crate::Vec3;
use crate::shape::cone::{Cone, ConePart};
use crate::shape::ellipsoid;

/// Maximum distance beyond the closest face up to which another face can be selected, in sizes of
/// the body.
const FACE_CHOICE_RANGE: f64 = 0.02;

/// An ellipsoid with half axes along x, y and z.
pub(crate) struct EllipsoidField {
    pub half: Vec3,
}

/// A cone about its center of mass.
pub(crate) struct ConeField {
    pub cone: Cone,
}

impl DistanceField for EllipsoidField {
    fn bound(&self, p: &Vec3) -> f64 {
        ellipsoid::closest(&self.half, p).distance
    }

    fn hit(&self, p: &Vec3, normals: &[Vec3], _beside: f64) -> Hit {
        let found = ellipsoid::closest(&self.half, p);
        Hit {
            distance: found.distance,
            nearest: found.distance,
            normal: found.normal,
            core: ellipsoid::mean_radius(&self.half, &found.normal),
            feature: Feature::Point,
            facing: facing(normals, &found.normal),
        }
    }

    fn is_convex(&self) -> bool {
        true
    }

    fn is_round(&self) -> bool {
        true
    }

    fn is_curved(&self) -> bool {
        true
    }

    fn is_smooth(&self) -> bool {
        true
    }
}

impl DistanceField for ConeField {
    fn bound(&self, p: &Vec3) -> f64 {
        self.cone.closest(p).1
    }

    fn hit(&self, p: &Vec3, normals: &[Vec3], beside: f64) -> Hit {
        let cone = &self.cone;
        let touching = beside * cone.radius.max(cone.height);
        let (part, nearest, normal) = cone.closest(p);
        if nearest > touching {
            let (core, feature) = match part {
                ConePart::Base => (0.0, Feature::Face),
                ConePart::Side => (self.core(p), Feature::Line(self.generator(p))),
                ConePart::Rim | ConePart::Tip => (0.0, Feature::Point),
            };
            return Hit { distance: nearest, nearest, normal, core, feature, facing: facing(normals, &normal) };
        }
        let (across, along) = cone.side_normal();
        let (side_distance, base_distance, _) = cone.planes(p);
        let up = -Vec3::z();
        let outward = cone.outward(p) * across + Vec3::z() * along;
        let side = Hit {
            distance: side_distance,
            nearest,
            normal: outward,
            core: self.core(p),
            feature: Feature::Line(self.generator(p)),
            facing: facing(normals, &outward),
        };
        let base = Hit {
            distance: base_distance,
            nearest,
            normal: up,
            core: 0.0,
            feature: Feature::Face,
            facing: facing(normals, &up),
        };
        let square = opposition(normals, &outward) < opposition(normals, &up);
        let level = (side_distance - base_distance).abs() < touching;
        let side_first = if level { square } else { side_distance > base_distance };
        let deepest = side_distance.max(base_distance);
        let near = |depth: f64| depth > deepest - FACE_CHOICE_RANGE * cone.radius.max(cone.height);
        match (side.facing, base.facing) {
            (true, false) if near(side_distance) => side,
            (false, true) if near(base_distance) => base,
            _ if side_first => side,
            _ => base,
        }
    }

    fn is_convex(&self) -> bool {
        true
    }

    fn is_round(&self) -> bool {
        true
    }

    fn is_curved(&self) -> bool {
        true
    }

    fn is_smooth(&self) -> bool {
        true
    }
}

impl ConeField {
    /// Returns the distance along the side's normal from the surface to the axis.
    fn core(&self, p: &Vec3) -> f64 {
        let (_, _, place) = self.cone.planes(p);
        let place = place.clamp(0.0, self.cone.side_length());
        place * self.cone.radius / self.cone.height
    }

    /// Returns the direction of the side's straight line below a point, from the tip.
    fn generator(&self, p: &Vec3) -> Vec3 {
        let (across, along) = self.cone.side_normal();
        self.cone.outward(p) * along - Vec3::z() * across
    }
}
