//! Pairs of objects that overlap in the present state.

use super::Part;
use crate::contact::detect::may_collide;
use crate::contact::own_tests::OwnTests;
use crate::object::FilteredPart;
use crate::world::World;
use crate::world::view::{Mode, ObjectId};
use std::collections::BTreeMap;
use tumble_collide::{Aabb, BroadPhase, Contact, SweepAndPrune};

/// Two objects that overlap, in the order in which they were added; the same object twice if its
/// own parts overlap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overlap {
    /// The objects.
    pub objects: [ObjectId; 2],
    /// The parts with the deepest overlap.
    pub parts: [usize; 2],
    /// Distance by which these must be moved apart along their contact's normal, meters.
    pub depth: f64,
}

impl World {
    /// Returns the pairs of objects that may collide and overlap by more than `depth` meters, in
    /// the order in which they were added. Changes nothing; costs one detection of contacts.
    pub fn overlapping_pairs(&self, depth: f64) -> Vec<Overlap> {
        let parts = self.parts().collect::<Vec<_>>();
        let mut broad = SweepAndPrune::default();
        let places: BTreeMap<u32, usize> =
            parts.iter().enumerate().map(|(n, part)| (broad.insert(&part.bounds(), part.moves()), n)).collect();
        let mut pairs = Vec::new();
        broad.pairs(&mut pairs);
        let mut deepest: BTreeMap<[u32; 2], Overlap> = BTreeMap::new();
        for pair in pairs {
            let [i, j] = pair.map(|handle| places[&handle]);
            let (a, b) = (&parts[i.min(j)], &parts[i.max(j)]);
            let Some(found) = self.depth_of(a, b).filter(|found| *found > depth) else { continue };
            let overlap = Overlap { objects: [a.id, b.id], parts: [a.part, b.part], depth: found };
            let known = deepest.entry([a.entry.serial, b.entry.serial]).or_insert(overlap);
            if found > known.depth {
                *known = overlap;
            }
        }
        deepest.into_values().collect()
    }

    /// Returns the greatest depth of the contacts of two parts that may collide, if they overlap.
    fn depth_of<'a>(&'a self, a: &Part<'a>, b: &Part<'a>) -> Option<f64> {
        if !may_collide(&a.entry, a.part, &b.entry, b.part, &self.core.derived.part_states) {
            return None;
        }
        let mode = a.mode.of_pair(b.mode);
        let mut found: Vec<Contact> = Vec::new();
        let tests = OwnTests::of([(a.entry.object, a.part), (b.entry.object, b.part)]);
        let side = |p: &Part<'a>| {
            Some(FilteredPart::of(p.entry.object.collidable()?, p.part)?.named(p.id, &self.core.pair_materials))
        };
        let (side_a, side_b) = (side(a)?, side(b)?);
        for [shape_a, shape_b] in side_a.contact_pairs(&side_b) {
            tests.contacts(mode, [&shape_a, &shape_b], [&a.pose, &b.pose], 0.0, &mut found);
        }
        found.iter().map(|contact| -contact.gap).max_by(f64::total_cmp)
    }
}

impl Part<'_> {
    fn bounds(&self) -> Aabb {
        self.shape.aabb(&self.pose)
    }

    fn moves(&self) -> bool {
        self.entry.status.mode != Mode::Static
    }
}
