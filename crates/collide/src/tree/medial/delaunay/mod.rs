//! Delaunay tetrahedralization: no sphere through the corners of a cell holds another point strictly inside.
//!
//! Built point by point ([`insert`]), with exact predicates ([`predicates`]), in a spatial order ([`order`]). The
//! outside of the convex hull is filled with *ghost* cells: one on each facet of the hull, with a corner at infinity,
//! so that every facet has a cell on both sides and the hull needs no case of its own.
//!
//! | name | meaning |
//! |---|---|
//! | corner `k` of a cell | `vertices[k]`, [`GHOST`] for infinity |
//! | facet `k` | the three corners other than `k` |
//! | `across[k]` | the cell beyond facet `k` |
//! | orientation | `orient` of the four corners is positive; of a ghost with any point strictly beyond its hull facet in infinity's place |

mod insert;
mod locate;
mod order;
mod predicates;
#[cfg(test)]
mod tests;

pub(in crate::tree) use predicates::orient;

use crate::Vec3;

/// The vertex at infinity.
pub(in crate::tree) const GHOST: u32 = u32::MAX;
/// No cell.
pub(in crate::tree) const NONE: u32 = u32::MAX;

/// Four vertices and the four cells around.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Cell {
    vertices: [u32; 4],
    across: [u32; 4],
}

/// A tetrahedralization that points can be added to.
#[derive(Clone, Debug)]
pub(in crate::tree) struct Delaunay {
    points: Vec<Vec3>,
    cells: Vec<Cell>,
    /// Dead cells, to be used again.
    free: Vec<u32>,
    /// What the last insertion made.
    created: Vec<u32>,
    /// What the last insertion took away; the ids may be given anew by the next.
    removed: Vec<u32>,
    /// Facets around the hole, as (cell that goes, facet).
    cavity_boundary: Vec<(u32, usize)>,
    /// Per cell, the last insertion that looked at it, and how it was judged.
    stamps: Vec<u32>,
    stamp: u32,
    duplicates: usize,
}

impl Delaunay {
    /// The tetrahedralization of `points`, which keep their numbers as vertices; `None` if they all lie in one plane.
    /// Of points that are the same bits the first is used.
    pub fn new(points: &[Vec3]) -> Option<Delaunay> {
        let order = order::order(points);
        let first = independent(points, &order)?;
        let mut created = Delaunay {
            points: points.to_vec(),
            cells: Vec::with_capacity(8 * points.len()),
            free: Vec::new(),
            created: Vec::new(),
            removed: Vec::new(),
            cavity_boundary: Vec::new(),
            stamps: Vec::new(),
            stamp: 0,
            duplicates: 0,
        };
        created.initialize(first);
        let mut hint = 0;
        for v in order {
            if first.contains(&v) {
                continue;
            }
            if created.insert_vertex(v, hint) {
                hint = created.created[0];
            } else {
                created.duplicates += 1;
            }
        }
        Some(created)
    }

    /// Adds a point; its vertex, or `None` for a duplicate. [`Delaunay::created`] and [`Delaunay::removed`] say what
    /// changed. `hint`: a cell to walk from.
    pub fn insert(&mut self, p: Vec3, hint: u32) -> Option<u32> {
        let v = self.points.len() as u32;
        self.points.push(p);
        if self.insert_vertex(v, hint) {
            return Some(v);
        }
        self.points.pop();
        self.duplicates += 1;
        None
    }

    /// One more than the greatest cell; some below are ghosts or dead.
    pub fn cell_count(&self) -> usize {
        self.cells.len()
    }

    /// Cells made by the last insertion, ghosts too.
    pub fn created(&self) -> &[u32] {
        &self.created
    }

    /// Cells taken away by the last insertion, ghosts too.
    pub fn removed(&self) -> &[u32] {
        &self.removed
    }

    /// Points that were skipped since they were there.
    pub fn duplicates(&self) -> usize {
        self.duplicates
    }

    /// The four vertices, [`GHOST`] among them for a ghost.
    pub fn vertices(&self, cell: u32) -> [u32; 4] {
        self.cells[cell as usize].vertices
    }

    /// The cells beyond the four facets.
    pub fn across(&self, cell: u32) -> [u32; 4] {
        self.cells[cell as usize].across
    }

    /// Corners of a finite cell.
    pub fn corners(&self, cell: u32) -> [Vec3; 4] {
        self.vertices(cell).map(|v| self.points[v as usize])
    }

    /// Whether the cell is a tetrahedron.
    pub fn is_finite(&self, cell: u32) -> bool {
        self.vertices(cell).iter().all(|&v| v != GHOST)
    }

    /// All tetrahedra.
    #[cfg(test)]
    pub fn finite_cells(&self) -> impl Iterator<Item = u32> {
        (0..self.cells.len() as u32).filter(|&c| self.is_finite(c))
    }

    fn is_in_use(&self, cell: u32) -> bool {
        self.vertices(cell) != [GHOST; 4]
    }

    fn ghost_corner(&self, cell: u32) -> Option<usize> {
        self.vertices(cell).iter().position(|&v| v == GHOST)
    }

    /// One tetrahedron and its four ghosts.
    fn initialize(&mut self, [a, b, c, d]: [u32; 4]) {
        let at = |v: u32| &self.points[v as usize];
        let vertices = if orient(at(a), at(b), at(c), at(d)) > 0.0 { [a, b, c, d] } else { [b, a, c, d] };
        self.add(Cell { vertices, across: [1, 2, 3, 4] });
        for k in 0..4 {
            // infinity in place of corner k is on the other side, so that two of the others change places
            let mut ghost = vertices;
            ghost[k] = GHOST;
            ghost.swap((k + 1) % 4, (k + 2) % 4);
            let across = ghost.map(|v| match vertices.iter().position(|w| *w == v) {
                Some(n) => n as u32 + 1,
                None => 0,
            });
            self.add(Cell { vertices: ghost, across });
        }
    }
}

/// The first four points in the order that are not in one plane.
fn independent(points: &[Vec3], order: &[u32]) -> Option<[u32; 4]> {
    let at = |v: u32| &points[v as usize];
    let &a = order.first()?;
    let &b = order.iter().find(|&&v| at(v) != at(a))?;
    let &c = order.iter().find(|&&v| !predicates::collinear(at(a), at(b), at(v)))?;
    let &d = order.iter().find(|&&v| orient(at(a), at(b), at(c), at(v)) != 0.0)?;
    Some([a, b, c, d])
}
