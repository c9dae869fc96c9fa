//! What the narrow phase says of two shapes that touch or nearly do.

use crate::Vec3;

/// One contact between shape A and shape B, in world axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Midway between the two surfaces, metres.
    pub point: Vec3,
    /// Unit normal, from B towards A: A is pushed along it, B against it.
    pub normal: Vec3,
    /// Signed distance between the surfaces along the normal, metres; negative where they overlap.
    pub gap: f64,
    /// Names the features that touch; the same features keep their id while they stay in contact.
    pub feature: u64,
    /// Distance from A's surface back along the normal to the core feature that carries it, metres:
    /// the radius of a sphere, capsule or leaf sphere; 0 for a vertex, edge or face.
    pub core_a: f64,
    /// The same for B.
    pub core_b: f64,
    /// What the normal turns with.
    pub normal_from: NormalFrom,
}

/// What fixes a contact's normal, and so how it turns when the bodies move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NormalFrom {
    /// A flat face of A: the normal turns with A.
    FaceOfA,
    /// A flat face of B: the normal turns with B.
    FaceOfB,
    /// The line from B's core point to A's (two rounded features, or a rounded one and a vertex or an edge).
    CorePoints,
    /// Two edges: perpendicular to both.
    Edges,
}
