//! The part of a shape below a plane: its volume and its center, by the divergence theorem.
//!
//! ```text
//! ball      V = π·t²·(3·r − t)/3         center at ¾·(2·r − t)²/(3·r − t) below its middle      t = r + d, 0 to 2r
//! mesh      V = Σ (a × b)·c/6            center = Σ (a + b + c)/4·(a × b)·c/6 / V
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `d` | depth of the middle of a ball below the plane |
//! | `t` | height of the cap that is submerged |
//! | `a`, `b`, `c` | corners of the triangles of the surface, cut at the plane, relative to a point of the plane |
//!
//! The tetrahedra have their tips in the plane, so the face that the plane cuts has no volume, and
//! a surface that is closed above it need not be closed again. Exact for balls, ellipsoids, boxes and
//! meshes, convex or not. Capsules, cylinders, cones and rounded shapes are meshes with 48 sides, with the volume scaled to the
//! exact one: relative error of a part below 0.3 %. Where parts of a compound overlap they count twice, as in its mass.

use tumble_collide::{Pose, Shape, TriMesh, Vec3};

/// Sides of the mesh of a capsule.
const SIDES: usize = 48;
/// Faces of a box by corners; bit k of a corner is its side along axis k. Outward.
const FACES: [[usize; 4]; 6] = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

/// A part of a shape below a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Submerged {
    /// Volume, m³.
    pub volume: f64,
    /// Center of that volume, world axes, m; the origin if the volume is 0.
    pub center: Vec3,
}

/// Returns the part of a shape at `pose` below the plane through `point` (m) with the unit normal `up`.
/// Nothing of a half-space.
pub fn submerged(shape: &Shape, pose: &Pose, point: &Vec3, up: &Vec3) -> Submerged {
    let middle = pose.translation.vector;
    let depth = (point - middle).dot(up);
    let reach = shape.bounding_radius();
    if !reach.is_finite() || depth <= -reach {
        return Submerged { volume: 0.0, center: Vec3::zeros() };
    }
    if depth >= reach {
        return Submerged { volume: shape.volume(), center: middle };
    }
    let origin = point + (middle - point) + depth * up; // the point of the plane above the middle
    let mut sum = Sum { origin, up: *up, volume: 0.0, first: Vec3::zeros() };
    match shape {
        Shape::HalfSpace => {}
        Shape::Sphere { radius } => return cap(&middle, *radius, depth, up),
        Shape::Box { half_extents } => {
            let corner = |k: usize| {
                let sign = Vec3::from_fn(|axis, _| if k >> axis & 1 == 1 { 1.0 } else { -1.0 });
                pose.transform_point(&half_extents.component_mul(&sign).into()).coords
            };
            FACES.iter().for_each(|face| sum.add(&face.map(corner)));
        }
        Shape::Capsule { radius, half_length } => {
            let mesh = TriMesh::capsule(*radius, 2.0 * half_length, SIDES, SIDES / 4);
            return sum.mesh(&mesh, pose).scaled(shape.volume() / mesh.signed_volume());
        }
        Shape::Cylinder(c) => {
            let mesh = TriMesh::cylinder(c.radius(), 2.0 * c.half_length(), SIDES);
            return sum.mesh(&mesh, pose).scaled(shape.volume() / mesh.signed_volume());
        }
        Shape::Ellipsoid { half_axes } => {
            // a unit ball in scaled axes
            let scaled = half_axes.component_mul(&pose.rotation.inverse_transform_vector(up));
            let reach = scaled.norm();
            if depth.abs() >= reach {
                let volume = if depth > 0.0 { shape.volume() } else { 0.0 };
                return Submerged { volume, center: if volume > 0.0 { middle } else { Vec3::zeros() } };
            }
            let ball = cap(&Vec3::zeros(), 1.0, depth / reach, &(scaled / reach));
            let center = pose.transform_point(&ball.center.component_mul(half_axes).into()).coords;
            return Submerged { volume: ball.volume * half_axes.product(), center };
        }
        Shape::Cone { .. } | Shape::RoundedBox { .. } | Shape::RoundedCylinder { .. } => {
            let mesh = shape.surface_mesh(SIDES);
            return sum.mesh(&mesh, pose).scaled(shape.volume() / mesh.signed_volume());
        }
        Shape::Mesh(mesh) => return sum.mesh(mesh.mesh(), pose),
        Shape::Compound(compound) => {
            for (part, own) in compound.placed() {
                let below = submerged(part, &(pose * own), point, up);
                sum.volume += below.volume;
                sum.first += below.volume * (below.center - origin);
            }
        }
    }
    sum.done()
}

/// Returns the cap of a ball that is submerged; `depth` is within its radius.
fn cap(middle: &Vec3, radius: f64, depth: f64, up: &Vec3) -> Submerged {
    let height = radius + depth;
    let volume = std::f64::consts::PI * height * height * (3.0 * radius - height) / 3.0;
    let below = 0.75 * (2.0 * radius - height).powi(2) / (3.0 * radius - height);
    Submerged { volume, center: middle - below * up }
}

/// Volume and first moment below a plane, about a point of it.
struct Sum {
    origin: Vec3,
    up: Vec3,
    volume: f64,
    first: Vec3,
}

impl Sum {
    /// Adds all triangles of a mesh.
    fn mesh(mut self, mesh: &TriMesh, pose: &Pose) -> Submerged {
        let corners: Vec<Vec3> = mesh.vertices.iter().map(|v| pose.transform_point(&(*v).into()).coords).collect();
        mesh.triangles.iter().for_each(|triangle| self.add(&triangle.map(|v| corners[v as usize])));
        self.done()
    }

    /// Adds the part of a convex face below the plane.
    fn add<const N: usize>(&mut self, face: &[Vec3; N]) {
        let corners = face.map(|corner| corner - self.origin);
        let heights = corners.map(|corner| corner.dot(&self.up));
        let (mut cut, mut count) = ([Vec3::zeros(); 8], 0);
        for i in 0..N {
            let j = (i + 1) % N;
            if heights[i] <= 0.0 {
                (cut[count], count) = (corners[i], count + 1);
            }
            if (heights[i] < 0.0 && heights[j] > 0.0) || (heights[i] > 0.0 && heights[j] < 0.0) {
                let share = heights[i] / (heights[i] - heights[j]);
                (cut[count], count) = (corners[i] + share * (corners[j] - corners[i]), count + 1);
            }
        }
        for k in 2..count {
            let (a, b, c) = (cut[0], cut[k - 1], cut[k]);
            let volume = a.cross(&b).dot(&c) / 6.0;
            self.volume += volume;
            self.first += 0.25 * volume * (a + b + c);
        }
    }

    fn done(self) -> Submerged {
        if self.volume > 0.0 {
            Submerged { volume: self.volume, center: self.origin + self.first / self.volume }
        } else {
            Submerged { volume: 0.0, center: Vec3::zeros() }
        }
    }
}

impl Submerged {
    fn scaled(self, factor: f64) -> Submerged {
        Submerged { volume: factor * self.volume, ..self }
    }
}
