//! Brute-force broad phase: compares all pairs, O(n²). The reference for the tests of the others.

use super::BroadPhase;
use crate::Aabb;

/// Compares every box with every other box.
#[derive(Clone, Debug, Default)]
pub struct BruteForce {
    boxes: Vec<Option<(Aabb, bool)>>,
}

impl BroadPhase for BruteForce {
    fn insert(&mut self, bounds: &Aabb, moving: bool) -> u32 {
        let handle = self.boxes.iter().position(Option::is_none).unwrap_or(self.boxes.len());
        self.boxes.resize(self.boxes.len().max(handle + 1), None);
        self.boxes[handle] = Some((*bounds, moving));
        handle as u32
    }

    fn set(&mut self, handle: u32, bounds: &Aabb, moving: bool) {
        if let Some(Some(filed)) = self.boxes.get_mut(handle as usize) {
            *filed = (*bounds, moving);
        }
    }

    fn remove(&mut self, handle: u32) {
        if let Some(filed) = self.boxes.get_mut(handle as usize) {
            *filed = None;
        }
    }

    fn pairs(&mut self, out: &mut Vec<[u32; 2]>) {
        out.clear();
        let proper = |b: &Aabb| (0..3).all(|k| b.min[k] <= b.max[k]);
        let filed = |(i, b): (usize, &Option<(Aabb, bool)>)| {
            b.filter(|(b, _)| proper(b)).map(|(b, moving)| (i as u32, b, moving))
        };
        let filed: Vec<(u32, Aabb, bool)> = self.boxes.iter().enumerate().filter_map(filed).collect();
        for (n, (i, a, a_moves)) in filed.iter().enumerate() {
            let met = filed[n + 1..].iter().filter(|(_, b, b_moves)| (*a_moves || *b_moves) && a.overlaps(b));
            out.extend(met.map(|(j, ..)| [*i, *j]));
        }
    }
}
