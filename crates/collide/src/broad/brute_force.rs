//! Every pair, one by one: O(n²), and the oracle that the others are tested against.

use super::BroadPhase;
use crate::Aabb;

/// Compares every box with every other.
#[derive(Clone, Copy, Debug, Default)]
pub struct BruteForce;

impl BroadPhase for BruteForce {
    fn pairs(&mut self, boxes: &[Aabb], moving: &[bool], out: &mut Vec<[u32; 2]>) {
        out.clear();
        for i in 0..boxes.len() {
            for j in i + 1..boxes.len() {
                if (moving[i] || moving[j]) && boxes[i].overlaps(&boxes[j]) {
                    out.push([i as u32, j as u32]);
                }
            }
        }
    }
}
