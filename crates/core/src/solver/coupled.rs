//! Islands of robots in which bounds follow the normal forces of contacts, as those of rolling and torsional friction do
//! (`step/patch.rs`): Newton's method with these bounds in its equations, and with what does not change from one solve to
//! the next computed once.

use super::direct::SmallIsland;
use super::folded::Folded;
use super::{RIGID, SolveReport};
use crate::constraint::rows::{RowSet, Rows};

/// An island without the soft rows of its objects.
pub(crate) struct Folding(Folded);

impl Folding {
    /// Returns `None` for islands of rigid bodies alone: of redundant multipliers Newton's method finds the nearest, and other
    /// methods those that share the load evenly.
    pub fn new(rows: &Rows, blocks: &[u32], c: &[f64], lambda: &[f64]) -> Option<Folding> {
        let mut sides = blocks.iter().flat_map(|&b| rows.blocks[b as usize].sides());
        sides.any(|side| side.dof > RIGID).then(|| Folding(Folded::copied(rows, blocks, (c, lambda))))
    }
}

/// An island whose bounds may follow normal forces.
pub(crate) struct CoupledIsland<'a> {
    folded: &'a Folded,
    small: SmallIsland<'a>,
    /// Multipliers of the blocks that are left, and velocities by them.
    own: Vec<f64>,
    du: Vec<f64>,
}

impl<'a> CoupledIsland<'a> {
    /// Returns `None` if the island is too large.
    pub fn new(Folding(folded): &'a Folding) -> Option<CoupledIsland<'a>> {
        let small = SmallIsland::new(&folded.rows, &folded.blocks, &folded.c)?;
        Some(CoupledIsland { folded, small, own: folded.lambda.clone(), du: vec![0.0; folded.dof()] })
    }

    /// Takes the friction coefficients of `rows`, and bounds that follow forces: each with its block, and the blocks of the
    /// contacts that it follows with the factor of each. Bounds of blocks that are not in the island are left out.
    pub fn follow(&mut self, rows: &Rows, bounds: &[(usize, Vec<(usize, f64)>)]) {
        let members = self.folded.members();
        let place = |block: usize| members.iter().position(|&member| member as usize == block);
        for (i, &member) in members.iter().enumerate() {
            if let RowSet::Cone { mu } = rows.blocks[member as usize].set {
                self.small.set_friction(i, mu);
            }
        }
        self.small.set_bounds(bounds.len());
        for (bound, (block, loads)) in bounds.iter().enumerate() {
            let (Some(own), RowSet::Interval { hi, .. }) = (place(*block), rows.blocks[*block].set) else { continue };
            let of_island = loads.iter().filter_map(|(block, factor)| Some((place(*block)?, *factor)));
            self.small.bind(bound, own, hi, of_island);
        }
    }

    /// Takes the multipliers from which the next solve begins.
    pub fn restart(&mut self, rows: &Rows, lambda: &[f64]) {
        for (block, &member) in self.folded.rows.blocks.iter().zip(self.folded.members()) {
            self.own[block.range()].copy_from_slice(&lambda[rows.blocks[member as usize].range()]);
        }
    }

    /// Solves from the multipliers of the last solve. Writes the multipliers and adds their effect to `du`. Returns `None`,
    /// and writes nothing, if it finds no solution.
    pub fn solve(
        &mut self,
        (rows, c): (&Rows, &[f64]),
        tolerance: f64,
        lambda: &mut [f64],
        du: &mut [f64],
    ) -> Option<SolveReport> {
        let solved = self.small.solve(&mut self.own, tolerance, false);
        if !solved.converged {
            return None;
        }
        self.du.fill(0.0);
        for block in &self.folded.rows.blocks {
            self.folded.rows.apply_block(block, &self.own, &mut self.du);
        }
        self.folded.write((rows, c), (&self.own, &mut self.du), lambda, du);
        let work = f64::from(solved.factorizations) * self.small.cost() * self.folded.members().len() as f64;
        Some(SolveReport { iterations: solved.factorizations, converged: true, ray: false, relaxations: work as u32 })
    }
}
