//! A scene: bodies at rest and the planes around them.

/// Density of every body, kg/m³.
pub const DENSITY: f64 = 1000.0;
/// Friction of every body and plane.
pub const FRICTION: f64 = 0.5;

/// The shape of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// A sphere of this radius, meters.
    Sphere(f64),
    /// A box with these edges, meters.
    Box([f64; 3]),
}

/// A body that is parallel to the axes at the start.
#[derive(Clone, Copy, Debug)]
pub struct Body {
    /// The shape.
    pub shape: Shape,
    /// Center at the start, meters.
    pub center: [f64; 3],
}

/// A half-space: everything with `(p − point)·normal ≤ 0` is solid.
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    /// A point of its surface, meters.
    pub point: [f64; 3],
    /// Outward unit normal.
    pub normal: [f64; 3],
}

/// Bodies at rest, the planes around them, and the times of the measurement.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Name on the command line and in the table.
    pub name: String,
    /// The bodies.
    pub bodies: Vec<Body>,
    /// The planes.
    pub planes: Vec<Plane>,
    /// Restitution of every body and plane.
    pub restitution: f64,
    /// Frames per second, a multiple of 60.
    pub rate: usize,
    /// Start and end of the measurement, s.
    pub measured: [f64; 2],
    /// Whether the bodies rest on each other at the start and should stay where they are.
    pub stands: bool,
    /// Whether the scene takes so long that it runs only if it is named.
    pub large: bool,
}

impl Scene {
    /// Length of a frame, s.
    pub fn dt(&self) -> f64 {
        1.0 / self.rate as f64
    }
}
