//! Group: the leaves are put into at most `branch` groups, each into at most `branch` again, down the levels.
//!
//! A group of `n` levels has room for `branchⁿ` leaves. Each leaf goes where it makes the group's ball reach out
//! least, so far as there is room: a transport problem, solved exactly by shortest chains of hand-overs. Groups' balls
//! are then fitted to their leaves, and leaves choose anew.

use super::refit::simplex;
use super::site::Site;
use crate::MeshDistance;
use crate::tree::ball::{Ball, around_balls};

/// Turns of choosing and fitting.
const TURNS: usize = 8;
const EVALUATIONS: usize = 60;

/// How far the ball about the site must reach out of the solid to hold `ball`, metres.
fn need(site: &Site, ball: &Ball) -> f64 {
    (ball.center - site.center).norm() + ball.radius - site.depth
}

/// The balls in groups, at most `room` each: indices. `sites` are where the groups start.
pub(super) fn grouped(balls: &[Ball], mut sites: Vec<Site>, room: usize, distance: &MeshDistance) -> Vec<Vec<u32>> {
    let mut best: (f64, Vec<usize>) = (f64::INFINITY, Vec::new());
    for _ in 0..TURNS {
        let chosen = transport(balls, &sites, room);
        let mut worst: f64 = 0.0;
        for g in 0..sites.len() {
            let own: Vec<Ball> = chosen.iter().zip(balls).filter(|(c, _)| **c == g).map(|(_, b)| *b).collect();
            if !own.is_empty() {
                let (site, error) = fitted(&own, distance);
                sites[g] = site;
                worst = worst.max(error);
            }
        }
        if worst >= best.0 && best.1 == chosen {
            break;
        }
        if worst < best.0 {
            best = (worst, chosen);
        }
    }
    let members = |g: usize| (0..balls.len() as u32).filter(|&b| best.1[b as usize] == g).collect::<Vec<u32>>();
    (0..sites.len()).map(members).filter(|m| !m.is_empty()).collect()
}

/// The centre of the ball around the balls that reaches out least, and how far.
pub(super) fn fitted(balls: &[Ball], distance: &MeshDistance) -> (Site, f64) {
    let start = around_balls(balls);
    let mut best = (Site::at(start.center, distance), f64::INFINITY);
    simplex(start.center, 0.2 * start.radius, EVALUATIONS, |c| {
        let site = Site::at(*c, distance);
        let worst = balls.iter().map(|b| need(&site, b)).fold(0.0, f64::max);
        if worst < best.1 {
            best = (site, worst);
        }
        worst
    });
    best
}

/// Per ball its group: least sum of the fourth powers of the needs, at most `room` balls in a group.
fn transport(balls: &[Ball], sites: &[Site], room: usize) -> Vec<usize> {
    let cost: Vec<Vec<f64>> =
        balls.iter().map(|b| sites.iter().map(|s| need(s, b).max(0.0).powi(4)).collect()).collect();
    let groups = sites.len();
    let mut chosen: Vec<usize> =
        cost.iter().map(|row| (0..groups).min_by(|&a, &b| row[a].total_cmp(&row[b])).unwrap_or(0)).collect();
    let mut size = vec![0; groups];
    chosen.iter().for_each(|&g| size[g] += 1);
    // each turn one ball leaves the fullest group, along the cheapest chain to a group with room
    while let Some(full) = (0..groups).find(|&g| size[g] > room) {
        let Some(chain) = cheapest_chain(&cost, &chosen, &size, room, full) else { break };
        size[full] -= 1;
        for (ball, to) in chain {
            chosen[ball] = to;
            if size[to] < room {
                size[to] += 1;
            }
        }
    }
    chosen
}

/// Hand-overs `(ball, to)` from `full` to a group with room, of least total cost (Bellman and Ford).
fn cheapest_chain(
    cost: &[Vec<f64>],
    chosen: &[usize],
    size: &[usize],
    room: usize,
    full: usize,
) -> Option<Vec<(usize, usize)>> {
    let groups = size.len();
    let mut hand = vec![vec![(f64::INFINITY, 0); groups]; groups];
    for (ball, &from) in chosen.iter().enumerate() {
        for to in (0..groups).filter(|to| *to != from) {
            let extra = cost[ball][to] - cost[ball][from];
            if extra < hand[from][to].0 {
                hand[from][to] = (extra, ball);
            }
        }
    }
    let mut reached = vec![(f64::INFINITY, full); groups];
    reached[full].0 = 0.0;
    for _ in 1..groups {
        for from in 0..groups {
            for to in 0..groups {
                let through = reached[from].0 + hand[from][to].0;
                if through < reached[to].0 && to != full {
                    reached[to] = (through, from);
                }
            }
        }
    }
    let mut to = (0..groups)
        .filter(|&g| size[g] < room && reached[g].0.is_finite())
        .min_by(|&a, &b| reached[a].0.total_cmp(&reached[b].0))?;
    let mut chain = Vec::new();
    while to != full && chain.len() < groups {
        let from = reached[to].1;
        chain.push((hand[from][to].1, to));
        to = from;
    }
    Some(chain)
}
