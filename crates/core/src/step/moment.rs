//! A second state of the objects within a step, with the values derived from it.

use super::contacts::Basis;
use crate::constraint::builder::constraints;
use crate::derived::{Cache, Derived};
use crate::integrators::context::refresh_all;
use crate::world::view::{Table, WorldView};
use crate::world::{Coordinates, Core};

/// A state of the objects besides the present one, with its part states and caches. Part states
/// have the accelerations of the present.
pub(crate) struct Moment {
    pub x: Vec<f64>,
    pub derived: Derived,
    /// [`Walk::settlings`](crate::world::walk::Walk::settlings) at which it got the numbers of all objects.
    pub settlings: Option<u64>,
}

impl Moment {
    /// Returns a moment without numbers for these objects.
    pub fn new(table: &Table) -> Moment {
        let derived = Derived { part_states: Vec::new(), caches: table.new_caches() };
        Moment { x: Vec::new(), derived, settlings: None }
    }

    /// Writes part states and caches from the state.
    pub fn refresh(&mut self, core: &Core) {
        refresh_all(&core.threads, core.objects(), &self.x, &mut self.derived);
    }

    /// Writes part states and caches from the state if any constraint reads part states.
    pub fn refresh_for_constraints(&mut self, core: &Core) {
        if constraints(core.objects()).any(|(_, _, constraint)| constraint.reads_part_states()) {
            self.refresh(core);
        }
    }

    /// Returns the view of it that objects are given, at a time, s.
    pub fn view<'a>(&'a self, core: &'a Core, time: f64) -> WorldView<'a> {
        WorldView { x: &self.x, part_states: &self.derived.part_states, ..core.view(time) }
    }

    /// Returns its numbers and its caches.
    pub fn coordinates<'a>(&'a mut self, core: &'a Core) -> Coordinates<'a> {
        Coordinates {
            objects: core.objects(),
            x: &mut self.x,
            caches: &mut self.derived.caches,
            threads: &core.threads,
        }
    }

    /// Returns its numbers, with caches of another state.
    pub fn coordinates_by<'a>(&'a mut self, core: &'a Core, caches: &'a mut [Cache]) -> Coordinates<'a> {
        Coordinates { objects: core.objects(), x: &mut self.x, caches, threads: &core.threads }
    }

    /// Returns the basis of rows at it, at a time, s.
    pub fn basis<'a>(&'a mut self, core: &'a Core, time: f64) -> Basis<'a> {
        let Moment { x, derived: Derived { part_states, caches }, .. } = self;
        let (x, part_states) = (&x[..], &part_states[..]);
        let view = WorldView { x, part_states, ..core.view(time) };
        Basis { owners: &core.owners, found: (x, part_states), acting: None, caches, threads: &core.threads, view }
    }
}
