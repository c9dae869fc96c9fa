//! Meshes of springs on grids: cloth and jelly.
//!
//! | springs of | join |
//! |---|---|
//! | structure | neighbors along the lines of the grid |
//! | shear | neighbors across the cells, in all diagonals |
//! | bending | nodes two apart along the lines |

use super::{Grid, MeshSpring, Origin, SpringMesh};
use crate::error::{BehaviorError, check};
use tumble_collide::{Pose, Vec3};

/// A rectangular sheet in the xy-plane about the origin.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Cloth {
    /// Nodes along x and y, at least 2 each.
    pub nodes: [usize; 2],
    /// Size along x and y, m, above 0.
    pub size: [f64; 2],
    /// Mass of the sheet, kg, above 0; the same for every node.
    pub mass: f64,
    /// Stiffness of the springs of structure, of shear and of bending, N/m, at least 0. A kind with 0 has no springs.
    pub stiffness: [f64; 3],
    /// Damping of every spring over its stiffness, s, at least 0.
    pub damping: f64,
}

impl Default for Cloth {
    /// A square of 1 m and 200 g, 20 × 20 nodes.
    fn default() -> Cloth {
        Cloth { nodes: [20; 2], size: [1.0; 2], mass: 0.2, stiffness: [500.0, 200.0, 20.0], damping: 0.01 }
    }
}

/// A block about the origin.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Jelly {
    /// Nodes along x, y and z, at least 2 each.
    pub nodes: [usize; 3],
    /// Size along x, y and z, m, above 0.
    pub size: [f64; 3],
    /// Mass, kg, above 0; the same for every node.
    pub mass: f64,
    /// Stiffness of the springs of structure, of shear and of bending, N/m, at least 0.
    pub stiffness: [f64; 3],
    /// Damping of every spring over its stiffness, s, at least 0.
    pub damping: f64,
}

impl Default for Jelly {
    /// A cube of 20 cm and 2 kg, 5 nodes along each edge.
    fn default() -> Jelly {
        Jelly { nodes: [5; 3], size: [0.2; 3], mass: 2.0, stiffness: [1000.0, 500.0, 200.0], damping: 0.01 }
    }
}

impl Cloth {
    /// Makes the mesh.
    ///
    /// # Errors
    /// [`BehaviorError::Range`] names what is out of its range.
    pub fn mesh(&self) -> Result<SpringMesh, BehaviorError> {
        let ([nx, ny], [x, y]) = (self.nodes, self.size);
        check("the nodes of a cloth", nx.min(ny) as f64, nx.min(ny) >= 2, "at least 2")?;
        let mesh = grid([nx, ny, 1], [x, y, 1.0], self.mass, self.stiffness, self.damping)?;
        Ok(of(mesh, Grid::Cloth(*self)))
    }
}

impl Jelly {
    /// Makes the mesh.
    ///
    /// # Errors
    /// [`BehaviorError::Range`] names what is out of its range.
    pub fn mesh(&self) -> Result<SpringMesh, BehaviorError> {
        let least = self.nodes.into_iter().min().unwrap_or(0);
        check("the nodes of a jelly", least as f64, least >= 2, "at least 2")?;
        let mesh = grid(self.nodes, self.size, self.mass, self.stiffness, self.damping)?;
        Ok(of(mesh, Grid::Jelly(*self)))
    }
}

fn of(mesh: SpringMesh, grid: Grid) -> SpringMesh {
    SpringMesh { origin: Some(Origin { grid, pose: Pose::identity() }), ..mesh }
}

fn grid(
    nodes: [usize; 3],
    size: [f64; 3],
    mass: f64,
    stiffness: [f64; 3],
    damping: f64,
) -> Result<SpringMesh, BehaviorError> {
    size.into_iter().try_for_each(|size| check("the size of a mesh", size, size > 0.0, "above 0"))?;
    stiffness.into_iter().try_for_each(|k| check("the stiffness of a mesh", k, k >= 0.0, "at least 0"))?;
    check("the mass of a mesh", mass, mass > 0.0, "above 0")?;
    check("the damping of a mesh", damping, damping >= 0.0, "at least 0")?;
    let [nx, ny, nz] = nodes;
    let count = nx.saturating_mul(ny).saturating_mul(nz);
    check("the number of nodes", count as f64, count <= super::MOST, "at most 100,000")?;
    let along = |k: usize, axis: usize| match nodes[axis] {
        1 => 0.0,
        n => size[axis] * (k as f64 / (n - 1) as f64 - 0.5),
    };
    let cell = |k: usize| [k % nx, k / nx % ny, k / nx / ny];
    let places: Vec<Vec3> = (0..count).map(|k| Vec3::from_fn(|axis, _| along(cell(k)[axis], axis))).collect();
    let mut springs = Vec::new();
    for a in 0..count {
        for (step, kind) in steps() {
            let to: [Option<usize>; 3] =
                std::array::from_fn(|axis| cell(a)[axis].checked_add_signed(step[axis]).filter(|k| *k < nodes[axis]));
            let [Some(x), Some(y), Some(z)] = to else { continue };
            let b = x + nx * (y + ny * z);
            if stiffness[kind] > 0.0 {
                let (length, k) = ((places[b] - places[a]).norm(), stiffness[kind]);
                springs.push(MeshSpring { nodes: [a, b], length, stiffness: k, damping: damping * k });
            }
        }
    }
    Ok(SpringMesh::new(places, vec![mass / count as f64; count], springs)?.drawn_as_grid(nodes))
}

/// Returns the ways to the other ends of springs, each pair once, and the kinds: 0 structure, 1 shear, 2 bending.
fn steps() -> impl Iterator<Item = ([isize; 3], usize)> {
    let near = (0..27).map(|k: isize| [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1]);
    let half = near.filter(|step| [step[2], step[1], step[0]] > [0; 3]);
    let kinds = half.map(|step| (step, usize::from(step.iter().filter(|s| **s != 0).count() > 1)));
    kinds.chain([([2, 0, 0], 2), ([0, 2, 0], 2), ([0, 0, 2], 2)])
}
