//! The deepest overlap in a scene, from shapes and poses only: the same code for every engine.
//!
//! The depth of two convex bodies is the shortest way that parts them. For two polyhedra it lies along
//! a face normal of one of them or a cross product of two edges.

use crate::Motion;
use crate::scene::{Body, Mode, Plane, Scene, Shape};
use tumble_collide::TriMesh;

/// Cross products of edges shorter than this, in units of the lengths of both, are of parallel edges
/// and are left out.
const PARALLEL: f64 = 1e-6;

type V3 = [f64; 3];

/// Returns the largest depth of two bodies, or of a body in a plane, meters; 0 if nothing overlaps.
/// Bodies of a scene with joints do not collide: 0. A scene has spheres alone or polyhedra alone.
pub fn deepest(scene: &Scene, motions: &[Motion]) -> f64 {
    if !scene.joints.is_empty() {
        return 0.0;
    }
    let hulls: Vec<Hull> = scene.hulls.iter().map(Hull::new).collect();
    let bodies = scene.bodies.iter().zip(motions);
    let mut placed: Vec<Placed> = bodies.map(|(body, motion)| Placed::new(body, &hulls, motion)).collect();
    let dynamic = placed.iter().filter(|a| a.moves);
    let in_planes = dynamic.flat_map(|a| scene.planes.iter().map(|plane| a.in_plane(plane)));
    let mut worst = in_planes.fold(0.0, f64::max);
    let widest = placed.iter().map(|a| a.bound).fold(0.0, f64::max);
    placed.sort_by(|a, b| a.center[0].total_cmp(&b.center[0]));
    for (i, a) in placed.iter().enumerate() {
        let near = placed[i + 1..].iter().take_while(|b| b.center[0] - a.center[0] < a.bound + widest);
        let near = near.filter(|b| a.moves || b.moves);
        worst = near.fold(worst, |worst, b| a.overlap(b, worst).unwrap_or(worst));
    }
    worst
}

/// The directions of a polyhedron in its own axes, each once; opposite ones count as one.
struct Hull {
    vertices: Vec<V3>,
    normals: Vec<V3>,
    edges: Vec<V3>,
    /// Largest distance of a vertex from the center, meters.
    bound: f64,
}

impl Hull {
    fn new(mesh: &TriMesh) -> Hull {
        let vertices: Vec<V3> = mesh.vertices.iter().map(|v| (*v).into()).collect();
        let (mut normals, mut edges) = (Vec::new(), Vec::new());
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|v| vertices[v as usize]);
            let sides = [minus(b, a), minus(c, b), minus(a, c)];
            add_direction(&mut normals, cross(sides[0], sides[1]));
            sides.into_iter().for_each(|side| add_direction(&mut edges, side));
        }
        let bound = vertices.iter().map(|v| dot(*v, *v).sqrt()).fold(0.0, f64::max);
        Hull { vertices, normals, edges, bound }
    }
}

/// Adds the direction of a vector unless it or its opposite is there.
fn add_direction(directions: &mut Vec<V3>, v: V3) {
    let length = dot(v, v).sqrt();
    let unit = v.map(|x| x / length);
    let parallel = |d: &V3| direction(cross(*d, unit)).is_none();
    if !directions.iter().any(parallel) {
        directions.push(unit);
    }
}

/// A body at its place.
struct Placed {
    center: V3,
    /// Radius of a sphere; 0 for a polyhedron.
    radius: f64,
    /// Half of each edge of a box as a vector.
    halves: [V3; 3],
    /// Corners of a polyhedron that is no box, meters.
    vertices: Vec<V3>,
    /// Unit vectors across the faces.
    normals: Vec<V3>,
    /// Unit vectors along the edges.
    edges: Vec<V3>,
    /// Radius of a sphere around the center that contains the body, meters.
    bound: f64,
    /// Whether forces move it.
    moves: bool,
}

impl Placed {
    fn new(body: &Body, hulls: &[Hull], motion: &Motion) -> Placed {
        let axes = [0, 1, 2].map(|k| motion.rotation.map(|row| row[k]));
        let turned = |v: &V3| [0, 1, 2].map(|i| dot(motion.rotation[i], *v));
        let turned = |all: &[V3]| all.iter().map(turned).collect::<Vec<V3>>();
        let bare = Placed {
            center: motion.center,
            radius: 0.0,
            halves: [[0.0; 3]; 3],
            vertices: Vec::new(),
            normals: axes.to_vec(),
            edges: axes.to_vec(),
            bound: 0.0,
            moves: body.mode == Mode::Dynamic,
        };
        match body.shape {
            Shape::Sphere(radius) => Placed { radius, bound: radius, normals: Vec::new(), edges: Vec::new(), ..bare },
            Shape::Box(size) => {
                let halves = [0, 1, 2].map(|k| axes[k].map(|x| 0.5 * size[k] * x));
                Placed { halves, bound: 0.5 * dot(size, size).sqrt(), ..bare }
            }
            Shape::Hull(i) => {
                let Hull { normals, edges, bound, .. } = &hulls[i];
                let vertices = hulls[i].vertices.iter().map(|v| motion.point(*v)).collect();
                Placed { vertices, normals: turned(normals), edges: turned(edges), bound: *bound, ..bare }
            }
        }
    }

    /// Returns the least and greatest coordinate along a unit vector.
    fn range(&self, along: V3) -> [f64; 2] {
        if self.vertices.is_empty() {
            let half = self.radius + self.halves.iter().map(|half| dot(*half, along).abs()).sum::<f64>();
            let middle = dot(self.center, along);
            return [middle - half, middle + half];
        }
        let coordinates = self.vertices.iter().map(|v| dot(*v, along));
        coordinates.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
    }

    fn in_plane(&self, plane: &Plane) -> f64 {
        dot(plane.point, plane.normal) - self.range(plane.normal)[0]
    }

    /// Returns the depth of two spheres or two polyhedra if it is above `least`.
    fn overlap(&self, other: &Placed, least: f64) -> Option<f64> {
        let between = minus(other.center, self.center);
        let far = self.bound + other.bound - dot(between, between).sqrt();
        if far <= least || self.normals.is_empty() {
            return (far > least).then_some(far);
        }
        let faces = self.normals.iter().chain(&other.normals).copied();
        let edges = self.edges.iter().flat_map(|a| other.edges.iter().filter_map(|b| direction(cross(*a, *b))));
        let mut depth = f64::INFINITY;
        for along in faces.chain(edges) {
            let ([a, b], [c, d]) = (self.range(along), other.range(along));
            depth = depth.min((b - c).min(d - a));
            if depth <= least {
                return None;
            }
        }
        Some(depth)
    }
}

fn direction(v: V3) -> Option<V3> {
    let length = dot(v, v).sqrt();
    (length > PARALLEL).then(|| v.map(|x| x / length))
}

fn dot(a: V3, b: V3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn minus(a: V3, b: V3) -> V3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn cross(a: V3, b: V3) -> V3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use tumble_collide::Vec3;

    fn depth(shape: Shape, places: &[(V3, f64)]) -> f64 {
        let bodies = places.iter().map(|(center, _)| Body::new(shape, *center)).collect();
        let planes = vec![Plane { point: [0.0; 3], normal: [0.0, 0.0, 1.0] }];
        let scene = Scene {
            name: String::new(),
            bodies,
            hulls: vec![TriMesh::cuboid(Vec3::new(1.0, 1.0, 1.0))],
            joints: Vec::new(),
            planes,
            friction: 0.5,
            restitution: 0.0,
            rate: 60,
            measured: [0.0, 1.0],
            stands: true,
            large: false,
        };
        let motion = |(center, turn): &(V3, f64)| {
            let (s, c) = turn.sin_cos();
            // about the x axis
            Motion { center: *center, rotation: [[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]], speed: 0.0 }
        };
        deepest(&scene, &places.iter().map(motion).collect::<Vec<_>>())
    }

    fn assert_near(found: f64, right: f64) {
        assert!((found - right).abs() < 1e-12, "{found} instead of {right}");
    }

    #[test]
    fn spheres_overlap_by_the_sum_of_radii_less_their_distance() {
        assert_near(depth(Shape::Sphere(0.5), &[([0.0, 0.0, 1.0], 0.0), ([0.6, 0.0, 1.8], 0.0)]), 0.0);
        assert_near(depth(Shape::Sphere(0.5), &[([0.0, 0.0, 1.0], 0.0), ([0.3, 0.0, 1.4], 0.0)]), 0.5);
        assert_near(depth(Shape::Sphere(0.5), &[([0.0, 0.0, 0.4], 0.0)]), 0.1);
    }

    #[test]
    fn boxes_part_along_faces_and_rest_on_edges() {
        boxes_part(Shape::Box([1.0; 3]));
    }

    #[test]
    fn a_hull_of_a_box_is_as_deep_as_the_box() {
        boxes_part(Shape::Hull(0));
    }

    fn boxes_part(cube: Shape) {
        assert_near(depth(cube, &[([0.0, 0.0, 0.6], 0.0), ([0.2, 0.0, 1.5], 0.0)]), 0.1);
        assert_near(depth(cube, &[([0.0, 0.0, 0.6], 0.0), ([0.95, 0.9, 1.4], 0.0)]), 0.05);
        // turned by 45° it reaches 1/√2 down
        let (turn, reach) = (std::f64::consts::FRAC_PI_4, 0.5_f64.sqrt());
        assert_near(depth(cube, &[([0.0, 0.0, reach - 0.02], turn)]), 0.02);
        assert_near(depth(cube, &[([0.0, 0.0, 0.6], 0.0), ([0.0, 0.0, 1.1 + reach - 0.03], turn)]), 0.03);
    }

    #[test]
    fn crossed_edges_part_along_their_common_normal() {
        // a box on its edge along x below one on its edge along y
        let (s, quarter) = (0.5_f64.sqrt(), std::f64::consts::FRAC_PI_4);
        let cube = Body::new(Shape::Box([1.0; 3]), [0.0; 3]);
        let below = Placed::new(&cube, &[], &turned_about_x([0.0; 3], quarter));
        let about_y = [[s, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, s]];
        let above = Motion { center: [0.0, 0.0, 2.0 * s - 0.01], rotation: about_y, speed: 0.0 };
        let above = Placed::new(&cube, &[], &above);
        assert_near(below.overlap(&above, 0.0).expect("they overlap"), 0.01);
        assert_eq!(below.overlap(&above, 0.02), None);
    }

    fn turned_about_x(center: V3, turn: f64) -> Motion {
        let (s, c) = turn.sin_cos();
        Motion { center, rotation: [[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]], speed: 0.0 }
    }
}
