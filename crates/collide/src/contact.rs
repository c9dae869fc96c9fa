//! What the narrow phase says of two shapes that touch or nearly do.

use crate::Vec3;

/// One contact between shape A and shape B, in world axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Midway between the two surfaces, meters.
    pub point: Vec3,
    /// Unit normal, from B towards A: A is pushed along it, B against it.
    pub normal: Vec3,
    /// Signed distance between the surfaces along the normal, meters; negative where they overlap.
    pub gap: f64,
    /// Names the features that touch; the same features keep their id while they stay in contact.
    pub feature: u64,
    /// Distance from A's surface back along the normal to the core feature that carries it, meters:
    /// the radius of a sphere, capsule or leaf sphere; 0 for a vertex, edge or face.
    pub core_a: f64,
    /// The same for B.
    pub core_b: f64,
    /// What the normal turns with.
    pub normal_from: NormalFrom,
}

/// What fixes a contact's normal, and so how it turns when the bodies move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NormalFrom {
    /// A flat face of A: the normal turns with A.
    FaceOfA,
    /// A flat face of B: the normal turns with B.
    FaceOfB,
    /// The line from B's core point to A's (two rounded features, or a rounded one and a vertex or an edge).
    CorePoints,
    /// The line from the nearest point of a straight edge or axis of A, along this unit direction (world), to B's core point: that nearest
    /// point slides freely along the direction.
    LineOfA(Vec3),
    /// The same with a straight edge or axis of B and A's core point.
    LineOfB(Vec3),
    /// Two edges: perpendicular to both.
    Edges,
}

/// How meshes and cylinders collide.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum ContactMode {
    /// Points and edges of each body against the exact signed distance of the other: flat faces stay flat, gaps and
    /// normals are those of the surfaces. The gap of two crossing edges of finely triangulated smooth meshes may be
    /// too large by 2e-4 of a diagonal.
    #[default]
    Surface,
    /// The thesis's mode: point and normal from the two leaf spheres. No contact is missed; gaps are too small by at most
    /// the trees' outward errors ([`crate::SphereTree::outward_error`]).
    Spheres,
}

impl ContactMode {
    /// All modes with their names, as scene files and Python write them.
    pub const NAMES: &[(&str, ContactMode)] = &[("surface", ContactMode::Surface), ("spheres", ContactMode::Spheres)];

    /// The mode of a pair: `Spheres` if either side asks for it.
    #[must_use]
    pub fn of_pair(self, other: ContactMode) -> ContactMode {
        if self == ContactMode::Spheres { self } else { other }
    }
}

impl Contact {
    /// The same contact with A and B exchanged.
    pub(crate) fn flipped(self) -> Contact {
        let normal_from = match self.normal_from {
            NormalFrom::LineOfA(along) => NormalFrom::LineOfB(along),
            NormalFrom::LineOfB(along) => NormalFrom::LineOfA(along),
            NormalFrom::FaceOfA => NormalFrom::FaceOfB,
            NormalFrom::FaceOfB => NormalFrom::FaceOfA,
            other => other,
        };
        Contact { normal: -self.normal, core_a: self.core_b, core_b: self.core_a, normal_from, ..self }
    }

    /// A contact between two spheres about core points; coincident centers are pushed apart along z.
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
        }
    }
}
