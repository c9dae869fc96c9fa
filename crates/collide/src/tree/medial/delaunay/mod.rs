//! Delaunay tetrahedralization: no sphere through the corners of a cell contains another point
//! strictly inside.
//!
//! Points are inserted one by one ([`insert`]), with exact predicates ([`predicates`]), in a
//! spatial order ([`order`]). The outside of the convex hull is filled with *ghost* cells: one on
//! each facet of the hull, with a corner at infinity. So every facet has a cell on both sides and
//! the hull needs no special case.
//!
//! | name | meaning |
//! |---|---|
//! | corner `k` of a cell | `vertices[k]`, [`GHOST`] for infinity |
//! | facet `k` | the three corners other than `k` |
//! | `across[k]` | the cell beyond facet `k` |
//! | orientation | `orient` of the four corners is positive; for a ghost with any point strictly beyond its hull facet instead of infinity |

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
/// Marks a missing cell.
pub(in crate::tree) const NONE: u32 = u32::MAX;

/// Four vertices and the four adjacent cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Cell {
    vertices: [u32; 4],
    across: [u32; 4],
}

/// A tetrahedralization with insertion of points.
#[derive(Clone, Debug)]
pub(in crate::tree) struct Delaunay {
    points: Vec<Vec3>,
    cells: Vec<Cell>,
    /// Removed cells, for reuse.
    free: Vec<u32>,
    /// Cells created by the last insertion.
    created: Vec<u32>,
    /// Cells removed by the last insertion; the next one can reuse their ids.
    removed: Vec<u32>,
    /// Facets around the cavity, as (removed cell, facet).
    cavity_boundary: Vec<(u32, usize)>,
    /// Per cell, the last insertion that visited it, and whether it is removed.
    stamps: Vec<u32>,
    stamp: u32,
    duplicates: usize,
}

impl Delaunay {
    /// Builds the tetrahedralization of `points`, which keep their indices as vertices. Of points
    /// with the same bits the first is used. Returns `None` if all points lie in one plane.
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

    /// Adds a point, walking from the cell `hint`. Returns its vertex, or `None` for a duplicate.
    /// [`Delaunay::created`] and [`Delaunay::removed`] list the changes.
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

    /// Returns one more than the greatest cell id. Some ids below are ghosts or free.
    pub fn cell_count(&self) -> usize {
        self.cells.len()
    }

    /// Returns the cells created by the last insertion, ghosts included.
    pub fn created(&self) -> &[u32] {
        &self.created
    }

    /// Returns the cells removed by the last insertion, ghosts included.
    pub fn removed(&self) -> &[u32] {
        &self.removed
    }

    /// Returns the number of points skipped as duplicates.
    pub fn duplicates(&self) -> usize {
        self.duplicates
    }

    /// Returns the four vertices; one is [`GHOST`] in a ghost.
    pub fn vertices(&self, cell: u32) -> [u32; 4] {
        self.cells[cell as usize].vertices
    }

    /// Returns the cells beyond the four facets.
    pub fn across(&self, cell: u32) -> [u32; 4] {
        self.cells[cell as usize].across
    }

    /// Returns the corners of a finite cell.
    pub fn corners(&self, cell: u32) -> [Vec3; 4] {
        self.vertices(cell).map(|v| self.points[v as usize])
    }

    /// Returns whether the cell is a tetrahedron.
    pub fn is_finite(&self, cell: u32) -> bool {
        self.vertices(cell).iter().all(|&v| v != GHOST)
    }

    /// Returns all tetrahedra.
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

    /// Creates one tetrahedron and its four ghosts.
    fn initialize(&mut self, [a, b, c, d]: [u32; 4]) {
        let at = |v: u32| &self.points[v as usize];
        let vertices = if orient(at(a), at(b), at(c), at(d)) > 0.0 { [a, b, c, d] } else { [b, a, c, d] };
        self.add(Cell { vertices, across: [1, 2, 3, 4] });
        for k in 0..4 {
            // infinity at corner k is on the other side, so two of the others are swapped
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

/// Returns the first four points in the order that are not coplanar.
fn independent(points: &[Vec3], order: &[u32]) -> Option<[u32; 4]> {
    let at = |v: u32| &points[v as usize];
    let &a = order.first()?;
    let &b = order.iter().find(|&&v| at(v) != at(a))?;
    let &c = order.iter().find(|&&v| !predicates::collinear(at(a), at(b), at(v)))?;
    let &d = order.iter().find(|&&v| orient(at(a), at(b), at(c), at(v)) != 0.0)?;
    Some([a, b, c, d])
}
