//! A scene: bodies, the planes around them and the joints between them.

use tumble_collide::TriMesh;

/// Density of every body without another one, kg/m³.
pub const DENSITY: f64 = 1000.0;
/// Friction of every body and plane of scenes without another one.
pub const FRICTION: f64 = 0.5;

/// The shape of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// A sphere of this radius, meters.
    Sphere(f64),
    /// A box with these edges, meters.
    Box([f64; 3]),
    /// A convex polyhedron: index into [`Scene::hulls`].
    Hull(usize),
}

/// How a body moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mode {
    /// By forces.
    Dynamic,
    /// Not at all.
    Fixed,
    /// About the y axis of the world at this angular velocity, rad/s.
    Turning(f64),
}

/// A body.
#[derive(Clone, Copy, Debug)]
pub struct Body {
    /// The shape.
    pub shape: Shape,
    /// Center of mass at the start, meters.
    pub center: [f64; 3],
    /// Angle about the y axis at the start, rad.
    pub turn: f64,
    /// Density, kg/m³.
    pub density: f64,
    /// How it moves.
    pub mode: Mode,
}

impl Body {
    /// Returns a dynamic body that is parallel to the axes, with the common density.
    pub fn new(shape: Shape, center: [f64; 3]) -> Body {
        Body { shape, center, turn: 0.0, density: DENSITY, mode: Mode::Dynamic }
    }

    /// Returns the center and the angle about the y axis at a time (s) of a body that no force
    /// moves.
    pub fn place(&self, time: f64) -> ([f64; 3], f64) {
        let Mode::Turning(rate) = self.mode else { return (self.center, self.turn) };
        let (s, c) = (rate * time).sin_cos();
        let [x, y, z] = self.center;
        ([c * x + s * z, y, c * z - s * x], self.turn + rate * time)
    }
}

/// A spherical joint of two bodies.
#[derive(Clone, Copy, Debug)]
pub struct Joint {
    /// The bodies.
    pub bodies: [usize; 2],
    /// The joined point in the axes of each body from its center, meters.
    pub anchors: [[f64; 3]; 2],
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
    /// Convex polyhedra about their centers of mass, meters.
    pub hulls: Vec<TriMesh>,
    /// Joints of the bodies. Bodies of a scene with joints do not collide with each other.
    pub joints: Vec<Joint>,
    /// The planes.
    pub planes: Vec<Plane>,
    /// Friction of every body and plane.
    pub friction: f64,
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
