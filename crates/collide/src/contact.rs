//! Contacts: the result of the narrow phase for two shapes that touch or nearly touch.

use crate::Vec3;

/// One contact between shape A and shape B, in world axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Midway between the two surfaces, meters.
    pub point: Vec3,
    /// Unit normal, from B towards A: A is pushed along it, B against it.
    pub normal: Vec3,
    /// Signed distance between the surfaces along the normal, meters; negative if they overlap.
    pub gap: f64,
    /// Identifier of the features that touch. The same features keep it while they stay in contact.
    pub feature: u64,
    /// Distance from A's surface along the normal, into A, to its core feature, meters, at least 0.
    ///
    /// The core feature moves with A as a material point, while the contact point slides over a
    /// rounded surface. It is the center of a sphere or leaf sphere, the nearest point on the axis
    /// of a capsule or of a cylinder's side, and the surface itself for a vertex, edge or face. So
    /// this is a radius of curvature, or 0. In world axes the feature is at
    /// `point + (gap/2 + core_a)·normal`. Only the acceleration of the gap depends on it.
    pub core_a: f64,
    /// The same distance for B, against the normal: B's core feature is at
    /// `point − (gap/2 + core_b)·normal`.
    pub core_b: f64,
    /// The feature that determines the normal.
    pub normal_from: NormalFrom,
    /// The shapes that touch, of A and of B: the index of a compound's part; 0 for all other shapes.
    pub shapes: [u32; 2],
}

/// The feature that determines a contact's normal, and so how the normal rotates when the bodies
/// move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NormalFrom {
    /// A flat face of A: the normal rotates with A.
    FaceOfA,
    /// A flat face of B: the normal rotates with B.
    FaceOfB,
    /// The line from B's core point to A's, for two rounded features, or a rounded feature and a
    /// vertex or edge.
    CorePoints,
    /// The line from the nearest point of a straight edge or axis of A to B's core point. The
    /// nearest point slides freely along this unit direction of the edge or axis, in world axes.
    LineOfA(Vec3),
    /// Like [`NormalFrom::LineOfA`], with an edge or axis of B and A's core point.
    LineOfB(Vec3),
    /// Two edges: the normal is perpendicular to both.
    Edges,
}

/// The method of contact generation for meshes and cylinders.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum ContactMode {
    /// Vertices and edges of each body are tested against the exact signed distance of the other.
    /// Flat faces stay flat; gaps and normals are those of the surfaces. The gap of two crossing
    /// edges of finely triangulated smooth meshes can be too large by 2e-4 of a diagonal.
    #[default]
    Surface,
    /// The method of the thesis: point and normal come from the two leaf spheres. No contact is
    /// missed; gaps are too small by at most the outward errors of the trees
    /// ([`crate::SphereTree::outward_error`]).
    Spheres,
}

impl ContactMode {
    /// All modes with their names in scene files and in Python.
    pub const NAMES: &[(&str, ContactMode)] = &[("surface", ContactMode::Surface), ("spheres", ContactMode::Spheres)];

    /// Returns the mode of a pair: `Spheres` if either side requests it.
    #[must_use]
    pub fn of_pair(self, other: ContactMode) -> ContactMode {
        if self == ContactMode::Spheres { self } else { other }
    }
}

impl Contact {
    /// Returns the same contact with A and B exchanged.
    pub(crate) fn flipped(self) -> Contact {
        let normal_from = match self.normal_from {
            NormalFrom::LineOfA(along) => NormalFrom::LineOfB(along),
            NormalFrom::LineOfB(along) => NormalFrom::LineOfA(along),
            NormalFrom::FaceOfA => NormalFrom::FaceOfB,
            NormalFrom::FaceOfB => NormalFrom::FaceOfA,
            other => other,
        };
        let shapes = [self.shapes[1], self.shapes[0]];
        Contact { normal: -self.normal, core_a: self.core_b, core_b: self.core_a, normal_from, shapes, ..self }
    }

    /// Returns the contact of two spheres about core points. Coincident centers are separated along
    /// z.
    pub(crate) fn between_cores(core_a: (Vec3, f64), core_b: (Vec3, f64), feature: u64) -> Contact {
        let ((a, radius_a), (b, radius_b)) = (core_a, core_b);
        let offset = a - b;
        let distance = offset.norm();
        let normal = if distance > 1e-300 { offset / distance } else { Vec3::z() };
        let gap = distance - radius_a - radius_b;
        Contact {
            point: b + normal * (radius_b + 0.5 * gap),
            normal,
            gap,
            feature,
            core_a: radius_a,
            core_b: radius_b,
            normal_from: NormalFrom::CorePoints,
            shapes: [0; 2],
        }
    }
}
