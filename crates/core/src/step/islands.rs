//! Solves of all islands, on several threads.
//!
//! An island reads and writes its own rows of `λ` and its own ranges of `du` alone. A thread has copies
//! of both, and what its islands have written is copied back afterwards.

use crate::constraint::rows::Rows;
use crate::threads::Threads;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Fewer blocks than this are solved on the calling thread, about 20 µs.
const FEW_BLOCKS: usize = 64;

/// Multipliers and `du` of the islands that one thread has solved, and their results.
struct Solved<R> {
    lambda: Vec<f64>,
    du: Vec<f64>,
    results: Vec<(usize, R)>,
}

/// Calls `solve` with the blocks of every island, `λ` and `du`, then `done` with the results in the order
/// of the islands. `solve` may read and write those rows of `λ` and ranges of `du` that belong to the blocks.
pub(super) fn each_island<'a, R: Send>(
    threads: &Threads,
    rows: &Rows,
    islands: impl Iterator<Item = &'a [u32]>,
    (lambda, du): (&mut [f64], &mut [f64]),
    solve: impl Fn(&[u32], &mut [f64], &mut [f64]) -> R + Sync,
    mut done: impl FnMut(R),
) {
    if threads.count() == 1 {
        return islands.for_each(|blocks| done(solve(blocks, lambda, du)));
    }
    let islands: Vec<&[u32]> = islands.collect();
    if islands.len() < 2 || islands.iter().map(|blocks| blocks.len()).sum::<usize>() < FEW_BLOCKS {
        return islands.iter().for_each(|blocks| done(solve(blocks, lambda, du)));
    }
    let mut order: Vec<usize> = (0..islands.len()).collect();
    order.sort_by_key(|&i| std::cmp::Reverse(islands[i].len()));
    let mut all: Vec<Solved<R>> = (0..threads.count().min(islands.len()))
        .map(|_| Solved { lambda: Vec::new(), du: Vec::new(), results: Vec::new() })
        .collect();
    let (next, before) = (AtomicUsize::new(0), (&*lambda, &*du));
    threads.each(all.iter_mut(), |solved| {
        while let Some(&island) = order.get(next.fetch_add(1, Ordering::Relaxed)) {
            solved.lambda.resize(before.0.len(), 0.0);
            solved.du.resize(before.1.len(), 0.0);
            copy(rows, islands[island], before, (&mut solved.lambda, &mut solved.du));
            let result = solve(islands[island], &mut solved.lambda, &mut solved.du);
            solved.results.push((island, result));
        }
    });
    let mut results: Vec<Option<R>> = islands.iter().map(|_| None).collect();
    for Solved { lambda: from, du: du_from, results: solved } in all {
        for (island, result) in solved {
            copy(rows, islands[island], (&from, &du_from), (&mut *lambda, &mut *du));
            results[island] = Some(result);
        }
    }
    results.into_iter().flatten().for_each(done);
}

/// Copies the rows of `λ` and the ranges of `du` of some blocks.
fn copy(rows: &Rows, blocks: &[u32], from: (&[f64], &[f64]), to: (&mut [f64], &mut [f64])) {
    for block in blocks.iter().map(|&b| &rows.blocks[b as usize]) {
        to.0[block.range()].copy_from_slice(&from.0[block.range()]);
        for side in block.sides() {
            let range = side.u as usize..(side.u + side.dof) as usize;
            to.1[range.clone()].copy_from_slice(&from.1[range]);
        }
    }
}
