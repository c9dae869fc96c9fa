//! The deepest overlap in a scene, from shapes and poses only: the same code for every engine.
//!
//! The depth of two convex bodies is the shortest way that parts them. For two boxes it lies along
//! a face normal of one of them or a cross product of two edges.

use crate::Motion;
use crate::scene::{Plane, Scene, Shape};

/// Cross products of edges shorter than this are of parallel edges and are left out.
const PARALLEL: f64 = 1e-6;

type V3 = [f64; 3];

/// Returns the largest depth of two bodies, or of a body in a plane, meters; 0 if nothing overlaps.
pub fn deepest(scene: &Scene, motions: &[Motion]) -> f64 {
    let bodies = scene.bodies.iter().zip(motions);
    let mut placed: Vec<Placed> = bodies.map(|(body, motion)| Placed::new(body.shape, motion)).collect();
    let in_planes = placed.iter().flat_map(|a| scene.planes.iter().map(|plane| a.in_plane(plane)));
    let mut worst = in_planes.fold(0.0, f64::max);
    let widest = placed.iter().map(|a| a.bound).fold(0.0, f64::max);
    placed.sort_by(|a, b| a.center[0].total_cmp(&b.center[0]));
    for (i, a) in placed.iter().enumerate() {
        let near = placed[i + 1..].iter().take_while(|b| b.center[0] - a.center[0] < a.bound + widest);
        worst = near.fold(worst, |worst, b| worst.max(a.overlap(b)));
    }
    worst
}

/// A body at its place.
struct Placed {
    shape: Shape,
    center: V3,
    /// Half of each edge as a vector; zero for a sphere.
    halves: [V3; 3],
    /// Unit vectors along the edges.
    axes: [V3; 3],
    /// Radius of a sphere around the center that contains the body, meters.
    bound: f64,
}

impl Placed {
    fn new(shape: Shape, motion: &Motion) -> Placed {
        let axes = [0, 1, 2].map(|k| motion.rotation.map(|row| row[k]));
        let (size, bound) = match shape {
            Shape::Sphere(radius) => ([0.0; 3], radius),
            Shape::Box(size) => (size, 0.5 * dot(size, size).sqrt()),
        };
        let halves = [0, 1, 2].map(|k| axes[k].map(|x| 0.5 * size[k] * x));
        Placed { shape, center: motion.center, halves, axes, bound }
    }

    /// Returns half of the extent along a unit vector.
    fn extent(&self, along: V3) -> f64 {
        match self.shape {
            Shape::Sphere(radius) => radius,
            Shape::Box(_) => self.halves.iter().map(|half| dot(*half, along).abs()).sum(),
        }
    }

    fn in_plane(&self, plane: &Plane) -> f64 {
        self.extent(plane.normal) - dot(minus(self.center, plane.point), plane.normal)
    }

    /// Returns the depth of two spheres or two boxes; negative if they are apart.
    fn overlap(&self, other: &Placed) -> f64 {
        let between = minus(other.center, self.center);
        let far = self.bound + other.bound - dot(between, between).sqrt();
        if far <= 0.0 || matches!(self.shape, Shape::Sphere(_)) {
            return far;
        }
        let faces = self.axes.into_iter().chain(other.axes);
        let edges = self.axes.iter().flat_map(|a| other.axes.iter().filter_map(|b| direction(cross(*a, *b))));
        let depth = |along: V3| self.extent(along) + other.extent(along) - dot(between, along).abs();
        faces.chain(edges).map(depth).fold(f64::INFINITY, f64::min)
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
    use crate::scene::Body;

    fn depth(shape: Shape, places: &[(V3, f64)]) -> f64 {
        let bodies = places.iter().map(|(center, _)| Body { shape, center: *center }).collect();
        let planes = vec![Plane { point: [0.0; 3], normal: [0.0, 0.0, 1.0] }];
        let scene = Scene {
            name: String::new(),
            bodies,
            planes,
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
        let cube = Shape::Box([1.0; 3]);
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
        let size = Shape::Box([1.0; 3]);
        let below = Placed::new(size, &turned_about_x([0.0; 3], quarter));
        let about_y = [[s, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, s]];
        let above = Motion { center: [0.0, 0.0, 2.0 * s - 0.01], rotation: about_y, speed: 0.0 };
        assert_near(below.overlap(&Placed::new(size, &above)), 0.01);
    }

    fn turned_about_x(center: V3, turn: f64) -> Motion {
        let (s, c) = turn.sin_cos();
        Motion { center, rotation: [[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]], speed: 0.0 }
    }
}
