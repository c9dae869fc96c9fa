//! Warm starts: multipliers of the contacts of the last sub-step, with which the next solve begins.

use crate::clone_by_field::clone_by_field;
use crate::contact::detect::ContactKey;
use tumble_collide::Vec3;

/// Force of every contact in the last sub-step, N, world axes, on A; sorted by key.
#[derive(Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct WarmStarts {
    entries: Vec<(ContactKey, [f64; 3])>,
}

clone_by_field!(WarmStarts { entries });

impl WarmStarts {
    /// Removes and returns the entries of the keys that `which` selects.
    pub fn take(&mut self, which: impl Fn(&ContactKey) -> bool) -> Vec<(ContactKey, [f64; 3])> {
        let (taken, kept) = std::mem::take(&mut self.entries).into_iter().partition(|e| which(&e.0));
        self.entries = kept;
        taken
    }

    /// Inserts entries that [`take`](Self::take) returned.
    pub fn add(&mut self, entries: Vec<(ContactKey, [f64; 3])>) {
        self.entries.extend(entries);
        self.entries.sort_by_key(|e| e.0);
        self.entries.dedup_by_key(|e| e.0);
    }

    /// Replaces all entries; they may come in any order.
    pub fn replace(&mut self, entries: impl Iterator<Item = (ContactKey, Vec3)>) {
        self.entries.clear();
        self.entries.extend(entries.map(|(k, v)| (k, [v.x, v.y, v.z])));
        if !self.in_order() {
            self.entries.sort_by_key(|e| e.0);
        }
    }

    /// Returns the force of a contact. `place` is where the last search ended, so keys in ascending
    /// order are found in a step or two.
    pub fn get(&self, key: &ContactKey, place: &mut usize) -> Option<Vec3> {
        let before = self.entries[..*place].last().is_some_and(|e| e.0 >= *key);
        let from = if before { 0 } else { *place };
        *place = from + exponential_search(&self.entries[from..], key);
        let found = self.entries.get(*place).filter(|e| e.0 == *key)?;
        Some(Vec3::from(found.1))
    }

    /// Returns whether any contact of the key's pair carried a force.
    pub fn carries(&self, key: &ContactKey) -> bool {
        let first = self.entries.partition_point(|e| e.0.pair < key.pair);
        self.entries[first..].iter().take_while(|e| e.0.pair == key.pair).any(|e| e.1 != [0.0; 3])
    }

    /// Returns whether the entries are sorted by key, as searches require.
    pub fn in_order(&self) -> bool {
        self.entries.is_sorted_by(|a, b| a.0 < b.0)
    }

    /// Returns whether all forces are finite.
    pub fn finite(&self) -> bool {
        self.entries.iter().flat_map(|e| e.1).all(f64::is_finite)
    }

    /// Removes the contacts of an object.
    pub fn forget(&mut self, serial: u32) {
        self.entries.retain(|(k, _)| k.pair[0] != serial && k.pair[2] != serial);
    }
}

/// Returns the number of entries before `key`, searched at doubling distances from the start.
fn exponential_search(entries: &[(ContactKey, [f64; 3])], key: &ContactKey) -> usize {
    let (mut low, mut step) = (0, 1);
    while entries.get(low + step - 1).is_some_and(|e| e.0 < *key) {
        low += step;
        step *= 2;
    }
    let high = (low + step).min(entries.len());
    low + entries[low..high].partition_point(|e| e.0 < *key)
}
