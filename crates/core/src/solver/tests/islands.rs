//! Islands against a search through the blocks.

use super::Random;
use crate::constraint::rows::{RowSet, Rows};
use crate::solver::Islands;

/// Rows among objects of 1 to 3 degrees of freedom, with none, one or two sides.
fn tangle(random: &mut Random) -> Rows {
    let mut starts = vec![0];
    for _ in 0..1 + random.index(12) {
        starts.push(starts[starts.len() - 1] + 1 + random.index(3));
    }
    let mut rows = Rows::default();
    rows.clear(starts[starts.len() - 1]);
    for _ in 0..random.index(15) {
        rows.push_block(RowSet::HalfLine);
        for _ in 0..random.index(3) {
            let object = random.index(starts.len() - 1);
            rows.side(starts[object], starts[object + 1] - starts[object]).expect("two sides at most");
        }
    }
    rows
}

/// Components by flooding from each block that no island has yet.
fn flood(rows: &Rows, keep: impl Fn(usize) -> bool) -> Vec<Vec<u32>> {
    let touch =
        |a: usize, b: usize| rows.blocks[a].sides().iter().any(|s| rows.blocks[b].sides().iter().any(|t| s.u == t.u));
    let enabled: Vec<usize> =
        (0..rows.blocks.len()).filter(|&b| keep(b) && !rows.blocks[b].sides().is_empty()).collect();
    let mut seen = vec![false; rows.blocks.len()];
    let mut islands = Vec::new();
    for &start in &enabled {
        if seen[start] {
            continue;
        }
        seen[start] = true;
        let mut island = vec![start];
        let mut next = 0;
        while next < island.len() {
            for &b in &enabled {
                if !seen[b] && touch(island[next], b) {
                    seen[b] = true;
                    island.push(b);
                }
            }
            next += 1;
        }
        island.sort_unstable();
        islands.push(island.into_iter().map(|b| b as u32).collect());
    }
    islands
}

#[test]
fn islands_are_the_connected_components_in_order() {
    let mut random = Random(41);
    let (mut islands, mut many) = (Islands::default(), 0);
    for _ in 0..500 {
        let rows = tangle(&mut random);
        let mask = random.bits();
        let keep = |b: usize| mask >> (b % 60) & 7 != 0;
        islands.build(&rows, keep);
        let expected = flood(&rows, keep);
        assert_eq!(islands.iter().map(<[u32]>::to_vec).collect::<Vec<_>>(), expected);
        assert_eq!((islands.len(), islands.is_empty()), (expected.len(), expected.is_empty()));
        many += (expected.len() > 2) as u32;
    }
    assert!(many > 100, "only {many} of 500 with more than two islands");
}

/// Two boxes on the same ground are two islands.
#[test]
fn the_ground_joins_nothing() {
    let mut rows = Rows::default();
    rows.clear(2);
    for object in [0, 1, 0] {
        rows.push_block(RowSet::HalfLine);
        rows.side(object, 1).expect("first side");
    }
    let mut islands = Islands::default();
    islands.build(&rows, |_| true);
    assert_eq!(islands.iter().collect::<Vec<_>>(), [&[0, 2][..], &[1]]);
}
