//! The drawn surface of a mesh, and the names of its sides.

use super::{Cloth, Jelly, SpringMesh};
use crate::error::{BehaviorError, check};
use std::f64::consts::PI;
use std::sync::Arc;
use tumble_core::{Appearance, PartSurface, Renderable, Visual};

/// Edges of a block sharper than this are drawn sharp, rad.
const CREASE: f64 = 1.0;
/// Names of the sides of a grid: the lower and the upper end of each axis.
const SIDES: [&str; 6] = ["x_min", "x_max", "y_min", "y_max", "z_min", "z_max"];

impl Cloth {
    /// Returns the numbers of the nodes of a side, `x_min`, `x_max`, `y_min` or `y_max`, or of the four `corners`;
    /// `None` for another name.
    pub fn side(&self, name: &str) -> Option<Vec<usize>> {
        side([self.nodes[0], self.nodes[1], 1], name)
    }
}

impl Jelly {
    /// Returns the numbers of the nodes of a side, `x_min` to `z_max`, or of the eight `corners`; `None` for another
    /// name.
    pub fn side(&self, name: &str) -> Option<Vec<usize>> {
        side(self.nodes, name)
    }
}

impl SpringMesh {
    /// Draws the mesh as a surface through its nodes: three nodes per triangle, counter-clockwise from outside. A cloth
    /// and a jelly have one already.
    ///
    /// # Errors
    /// [`BehaviorError::Range`] names a node that the mesh does not have.
    pub fn with_surface(self, triangles: Vec<[u32; 3]>, appearance: Appearance) -> Result<SpringMesh, BehaviorError> {
        let most = self.nodes.len();
        for node in triangles.iter().flatten() {
            check("a node of the surface", f64::from(*node), (*node as usize) < most, "a node of the mesh")?;
        }
        Ok(self.drawn(triangles, appearance, PI))
    }
    /// Sets the appearance of its surface.
    pub fn with_appearance(mut self, appearance: Appearance) -> SpringMesh {
        if let Some(surface) = &mut self.surface {
            surface.appearance = appearance;
        }
        self
    }
    /// Pins the nodes of these numbers to their places.
    ///
    /// # Errors
    /// [`BehaviorError::Range`] names a node that the mesh does not have.
    pub fn with_pinned_nodes(mut self, nodes: &[usize]) -> Result<SpringMesh, BehaviorError> {
        for node in nodes {
            check("a pinned node", *node as f64, *node < self.nodes.len(), "the number of a node, from 0")?;
            self.pinned[*node] = true;
        }
        Ok(self)
    }
    /// Returns which nodes are pinned.
    pub fn pinned(&self) -> &[bool] {
        &self.pinned
    }
    /// Returns the masses of the nodes, kg.
    pub fn masses(&self) -> &[f64] {
        &self.masses
    }

    /// Draws a grid by its outer faces.
    pub(super) fn drawn_as_grid(self, nodes: [usize; 3]) -> SpringMesh {
        let crease = if nodes[2] == 1 { PI } else { CREASE };
        self.drawn(faces(nodes), Appearance::default(), crease)
    }

    fn drawn(self, triangles: Vec<[u32; 3]>, appearance: Appearance, crease: f64) -> SpringMesh {
        let triangles = Arc::from(triangles);
        SpringMesh { surface: Some(PartSurface { triangles, appearance, crease }), ..self }
    }
}

impl Renderable for SpringMesh {
    fn visuals(&self) -> &[Visual] {
        &[]
    }
    fn surface(&self) -> Option<&PartSurface> {
        self.surface.as_ref()
    }
}

/// Returns the nodes of a side, or of the corners.
fn side(nodes: [usize; 3], name: &str) -> Option<Vec<usize>> {
    let all = 0..nodes.iter().product();
    let at = |k: usize| [k % nodes[0], k / nodes[0] % nodes[1], k / nodes[0] / nodes[1]];
    if name == "corners" {
        return Some(all.filter(|k| (0..3).all(|a| at(*k)[a] == 0 || at(*k)[a] + 1 == nodes[a])).collect());
    }
    let number = SIDES.iter().position(|side| *side == name)?;
    let (axis, end) = (number / 2, if number % 2 == 0 { 0 } else { nodes[number / 2] - 1 });
    (nodes[axis] > 1).then(|| all.filter(|k| at(*k)[axis] == end).collect())
}

/// Returns the triangles of the outer faces of a grid; of a flat one, its upper face alone.
fn faces(nodes: [usize; 3]) -> Vec<[u32; 3]> {
    let mut triangles = Vec::new();
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let ends: &[bool] = if nodes[axis] == 1 { &[true] } else { &[false, true] };
        for &upper in ends {
            for (j, k) in (1..nodes[v]).flat_map(|k| (1..nodes[u]).map(move |j| (j, k))) {
                let corner = |j: usize, k: usize| {
                    let mut at = [0; 3];
                    (at[axis], at[u], at[v]) = (if upper { nodes[axis] - 1 } else { 0 }, j, k);
                    (at[0] + nodes[0] * (at[1] + nodes[1] * at[2])) as u32
                };
                let [a, b, c, d] = [corner(j - 1, k - 1), corner(j, k - 1), corner(j, k), corner(j - 1, k)];
                // diagonals in turn, so that no direction of the sheet is preferred
                let pair = if (j + k) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
                triangles.extend(pair.map(|[p, q, r]| if upper { [p, q, r] } else { [p, r, q] }));
            }
        }
    }
    triangles
}
