//! Islands: sets of objects that contacts and constraints connect.
//!
//! Static and kinematic objects connect nothing. Objects that fell asleep together stay one island,
//! since sleepers have no contacts.

use super::{Core, World};
use crate::constraint::builder::constraints;
use crate::world::view::{Entry, ObjectId};
use tumble_collide::UnionFind;

impl World {
    /// Returns the islands after the last step: sets of dynamic objects that contacts of the last
    /// sub-step or constraints connect, directly or through other dynamic objects. An object
    /// without connections is an island of its own. Objects are in the order of their addition,
    /// islands in the order of their first objects.
    ///
    /// A constraint that does not name its objects
    /// ([`Constraint::partners`](crate::Constraint::partners)) connects nothing here.
    pub fn islands(&self) -> Vec<Vec<ObjectId>> {
        let core = &self.core;
        let asleep = core.state.groups.iter().flat_map(|group| group.members.windows(2)).filter_map(|serials| {
            let [a, b] = [serials[0], serials[1]].map(|serial| core.by_serial(serial));
            Some([core.table.order[a?], core.table.order[b?]])
        });
        let connections = core.connections().0.into_iter().chain(asleep);
        let (island, count) = core.components(connections, |e| e.dynamic());
        let mut islands = vec![Vec::new(); count];
        for entry in core.objects().all().filter(|e| e.dynamic()) {
            islands[island[entry.place] as usize].push(core.table.order[entry.place]);
        }
        islands.retain(|island| !island.is_empty());
        islands
    }
}

impl Core {
    /// Returns pairs of objects that have a contact or share a constraint, and whether every
    /// constraint names its objects.
    pub(super) fn connections(&self) -> (Vec<[ObjectId; 2]>, bool) {
        let mut pairs: Vec<[ObjectId; 2]> = self.contacts.iter().map(|c| [c.a, c.b]).collect();
        let (mut partners, mut all_named) = (Vec::new(), true);
        for (_, _, constraint) in constraints(self.objects()).filter(|(_, _, c)| !c.on_itself()) {
            partners.clear();
            all_named &= constraint.partners(&mut partners);
            partners.retain(|&id| self.table.place(id).is_some());
            pairs.extend(partners.windows(2).map(|w| [w[0], w[1]]));
        }
        (pairs, all_named)
    }

    /// Joins the objects that satisfy `member` along these pairs. Returns the number of each
    /// object's set, in the order of addition, and how many sets there are; the sets are numbered
    /// by their first objects. Every other object is a set of its own.
    pub(super) fn components(
        &self,
        pairs: impl IntoIterator<Item = [ObjectId; 2]>,
        member: impl Fn(&Entry) -> bool,
    ) -> (Vec<u32>, usize) {
        let objects = self.objects();
        let mut sets = UnionFind::new(self.table.placed.len());
        for [a, b] in pairs {
            if let (Some(a), Some(b)) = (self.table.place(a), self.table.place(b))
                && member(&objects.at(a))
                && member(&objects.at(b))
            {
                sets.union(a as u32, b as u32);
            }
        }
        sets.numbered()
    }
}
