//! The shape in which boids are drawn: a dart with two wings.

use crate::boid::Boid;
use std::sync::Arc;
use tumble_collide::{Pose, TriMesh, Vec3};
use tumble_core::{Appearance, Visual, VisualMesh};

impl Boid {
    /// Returns visuals for boids of a length, m: one dart, whose nose is along x and whose wings are along y. Boids
    /// that share a copy are drawn together.
    pub fn dart(length: f64, appearance: Appearance) -> Vec<Visual> {
        let corners = [[0.5, 0.0, 0.0], [-0.5, 0.5, 0.1], [-0.3, 0.0, 0.0], [-0.5, -0.5, 0.1], [-0.4, 0.0, -0.2]];
        let vertices = corners.iter().map(|corner| length * Vec3::from(*corner)).collect();
        let triangles = vec![[0, 1, 2], [0, 2, 3], [0, 2, 4]];
        let mesh = VisualMesh::new("a dart", TriMesh { vertices, triangles });
        mesh.into_iter().map(|mesh| Visual::mesh(0, Pose::identity(), Arc::new(mesh), appearance.clone())).collect()
    }
}
