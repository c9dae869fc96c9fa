//! Warm starts: multipliers of the last sub-step, with which the next solve begins.

use crate::clone_by_field::clone_by_field;
use crate::contact::detect::ContactKey;

/// Force of a contact in the last sub-step.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct WarmStart {
    pub key: ContactKey,
    /// Force on A, N, world axes.
    pub force: [f64; 3],
    /// The contact point in the frame of A's part, m.
    pub point: [f64; 3],
}

impl WarmStart {
    /// Returns whether all of its numbers are finite.
    pub fn is_finite(&self) -> bool {
        self.force.iter().chain(&self.point).all(|x| x.is_finite())
    }
}

/// Multiplier of a constraint's row in the last sub-step.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct RowStart {
    /// Serial of the object that has the constraint.
    pub owner: u32,
    /// N or N·m.
    pub force: f64,
}

/// Forces of the last sub-step.
#[derive(Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct WarmStarts {
    /// Those of contacts, sorted by key.
    entries: Vec<WarmStart>,
    /// Those of constraints, in the order of their rows: the owners ascend.
    rows: Vec<RowStart>,
}

clone_by_field!(WarmStarts { entries, rows });

impl WarmStarts {
    /// Returns the keys of all contacts, ascending.
    pub fn keys(&self) -> impl Iterator<Item = &ContactKey> {
        self.entries.iter().map(|e| &e.key)
    }

    /// Removes and returns the entries that `of` gives to an island, in their order with its number. `of` is in
    /// the order of the [`keys`](Self::keys).
    pub fn take(&mut self, of: &[Option<usize>]) -> Vec<(usize, WarmStart)> {
        let (mut taken, mut kept) = (Vec::new(), Vec::new());
        for (entry, island) in std::mem::take(&mut self.entries).into_iter().zip(of) {
            match island {
                Some(island) => taken.push((*island, entry)),
                None => kept.push(entry),
            }
        }
        self.entries = kept;
        taken
    }

    /// Inserts entries that [`take`](Self::take) returned.
    pub fn add(&mut self, entries: Vec<WarmStart>) {
        self.entries.extend(entries);
        self.entries.sort_by_key(|e| e.key);
        self.entries.dedup_by_key(|e| e.key);
    }

    /// Replaces the forces of constraints; the owners must ascend.
    pub fn replace_rows(&mut self, rows: impl Iterator<Item = RowStart>) {
        self.rows.clear();
        self.rows.extend(rows);
    }

    /// Returns the forces of an object's constraint, in the order of its rows.
    pub fn of_owner(&self, owner: u32) -> &[RowStart] {
        let start = self.rows.partition_point(|row| row.owner < owner);
        let count = self.rows[start..].iter().take_while(|row| row.owner == owner).count();
        &self.rows[start..start + count]
    }

    /// Returns the forces of each object's constraint.
    pub fn rows_by_owner(&self) -> impl Iterator<Item = &[RowStart]> {
        self.rows.chunk_by(|a, b| a.owner == b.owner)
    }

    /// Replaces the forces of contacts; they may come in any order.
    pub fn replace(&mut self, entries: impl Iterator<Item = WarmStart>) {
        self.entries.clear();
        self.entries.extend(entries);
        if !self.in_order() {
            self.entries.sort_by_key(|e| e.key);
        }
    }

    /// Returns the forces of a pair. `place` is where the last search ended, so pairs in ascending
    /// order are found in a step or two.
    pub fn of_pair(&self, pair: [u32; 4], place: &mut usize) -> &[WarmStart] {
        let before = self.entries[..*place].last().is_some_and(|e| e.key.pair >= pair);
        let from = if before { 0 } else { *place };
        *place = from + exponential_search(&self.entries[from..], pair);
        let count = self.entries[*place..].iter().take_while(|e| e.key.pair == pair).count();
        &self.entries[*place..*place + count]
    }

    /// Returns whether any contact of the key's pair carried a force.
    pub fn carries(&self, key: &ContactKey) -> bool {
        self.of_pair(key.pair, &mut 0).iter().any(|e| e.force != [0.0; 3])
    }

    /// Returns whether this contact itself carried a force.
    pub fn has(&self, key: &ContactKey) -> bool {
        self.of_pair(key.pair, &mut 0).iter().any(|e| e.key == *key && e.force != [0.0; 3])
    }

    /// Returns whether the entries are sorted by key, as searches require.
    pub fn in_order(&self) -> bool {
        self.entries.is_sorted_by(|a, b| a.key < b.key) && self.rows.is_sorted_by_key(|row| row.owner)
    }

    /// Returns whether all forces are finite.
    pub fn finite(&self) -> bool {
        self.entries.iter().all(WarmStart::is_finite) && self.rows.iter().all(|row| row.force.is_finite())
    }

    /// Removes the contacts and the constraint of an object.
    pub fn forget(&mut self, serial: u32) {
        self.entries.retain(|e| e.key.pair[0] != serial && e.key.pair[2] != serial);
        self.rows.retain(|row| row.owner != serial);
    }
}

/// Returns the number of entries before `pair`, searched at doubling distances from the start.
fn exponential_search(entries: &[WarmStart], pair: [u32; 4]) -> usize {
    let (mut low, mut step) = (0, 1);
    while entries.get(low + step - 1).is_some_and(|e| e.key.pair < pair) {
        low += step;
        step *= 2;
    }
    let high = (low + step).min(entries.len());
    low + entries[low..high].partition_point(|e| e.key.pair < pair)
}
