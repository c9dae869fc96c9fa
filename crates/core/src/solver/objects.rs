//! The objects of an island, numbered from 0, with their velocities in a row.

use crate::constraint::rows::Rows;
use smallvec::SmallVec;

/// An object of an island.
#[derive(Clone, Copy, Debug)]
pub(super) struct IslandObject {
    /// First of its numbers in `u` of all objects.
    pub start: u32,
    /// First of its numbers in the velocities of the island.
    pub first: usize,
    /// Degrees of freedom.
    pub dof: usize,
}

/// Returns the objects that blocks act on, ascending by their place in `u`.
pub(super) fn objects_of(rows: &Rows, blocks: &[u32]) -> Vec<IslandObject> {
    let sides = blocks.iter().flat_map(|&b| rows.blocks[b as usize].sides());
    let mut all: SmallVec<[(u32, u32); 32]> = SmallVec::new();
    // rows of a robot come one after the other
    for side in sides.map(|side| (side.u, side.dof)) {
        if all.last() != Some(&side) {
            all.push(side);
        }
    }
    all.sort_unstable();
    all.dedup();
    let mut first = 0;
    let place = |(start, dof): (u32, u32)| {
        let dof = dof as usize;
        first += dof;
        IslandObject { start, first: first - dof, dof }
    };
    all.into_iter().map(place).collect()
}

/// Returns the number of velocities of the island.
pub(super) fn dof_of(objects: &[IslandObject]) -> usize {
    objects.last().map_or(0, |object| object.first + object.dof)
}

/// Returns the number of the object whose numbers in `u` begin at `start`.
pub(super) fn place_of(objects: &[IslandObject], start: u32) -> usize {
    objects.partition_point(|object| object.start < start)
}
