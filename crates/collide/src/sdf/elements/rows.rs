//! Rows of edges: edges of one mesh that continue each other along a straight line between the same two planes, as
//! tessellations cut them.

use super::Edge;
use crate::Vec3;

/// Largest sine of the angle between edges of a row, and largest difference of their normals.
const STRAIGHT: f64 = 1e-9;
/// [`Edge::row`] of an edge that no other one continues.
pub(crate) const NO_ROW: u32 = u32::MAX;

/// A row of at least two edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Row {
    pub start: Vec3,
    /// Unit vector.
    pub along: Vec3,
    /// Meters.
    pub length: f64,
}

/// Joins edges to rows: sets [`Edge::row`] and [`Edge::places`], and returns the rows.
pub(super) fn rows(edges: &mut [Edge], vertices: usize) -> Vec<Row> {
    let mut at_vertex: Vec<Vec<u32>> = vec![Vec::new(); vertices];
    for (e, edge) in edges.iter().enumerate() {
        edge.points.iter().for_each(|&v| at_vertex[v as usize].push(e as u32));
    }
    // the edge that continues `e` from its end `end`, with its own end there
    let next = |edges: &[Edge], e: u32, end: usize| {
        let edge = &edges[e as usize];
        let others = at_vertex[edge.points[end] as usize].iter().filter(|other| **other != e);
        others.copied().find_map(|other| {
            let near = usize::from(edges[other as usize].points[1] == edge.points[end]);
            continues(edge, end, &edges[other as usize], near).then_some((other, near))
        })
    };
    let mut rows = Vec::new();
    for first in 0..edges.len() as u32 {
        if edges[first as usize].row != NO_ROW {
            continue;
        }
        // back to the start of the row, but not in a circle
        let (mut e, mut end) = (first, 0);
        for _ in 0..edges.len() {
            let Some((other, near)) = next(edges, e, end).filter(|(other, _)| edges[*other as usize].row == NO_ROW)
            else {
                break;
            };
            (e, end) = (other, 1 - near);
        }
        let (start, mut length) = (edges[e as usize].ends[end], 0.0);
        let along = (edges[e as usize].ends[1 - end] - start) / edges[e as usize].length;
        let (row, mut at, mut count) = (rows.len() as u32, Some((e, end)), 0);
        while let Some((e, end)) = at {
            let edge = &mut edges[e as usize];
            (edge.row, edge.places[end], edge.places[1 - end]) = (row, length, length + edge.length);
            length += edge.length;
            count += 1;
            at = next(edges, e, 1 - end).filter(|(other, _)| edges[*other as usize].row == NO_ROW);
        }
        match count {
            1 => edges[e as usize].row = NO_ROW,
            _ => rows.push(Row { start, along, length }),
        }
    }
    rows
}

/// Returns whether `b` continues `a` beyond its end `end`, where `b` has its own end `near`.
fn continues(a: &Edge, end: usize, b: &Edge, near: usize) -> bool {
    let out = (a.ends[end] - a.ends[1 - end]) / a.length;
    let further = (b.ends[1 - near] - b.ends[near]) / b.length;
    let same = |x: &Vec3, y: &Vec3| (x - y).norm() <= STRAIGHT;
    let [[a0, a1], [b0, b1]] = [&a.normals, &b.normals];
    out.dot(&further) > 0.0
        && out.cross(&further).norm() <= STRAIGHT
        && (same(a0, b0) && same(a1, b1) || same(a0, b1) && same(a1, b0))
        && a.fine == b.fine
}
