//! Hubbard's builder: medial balls of a fixed set of samples, merged until few are left.
//!
//! Source: Hubbard, *Approximating polyhedra with spheres for time-critical collision detection* (1996). Samples of the
//! surface give Voronoi balls whose centres are inside the solid (and others where those leave samples bare), once for the
//! whole solid. For each region, its points choose among the balls that hold them; then, of all pairs of neighbours,
//! the pair is merged whose ball reaches out of the solid least, until as many are left as there may be children.
//!
//! Neighbours are balls that hold a point in common. A merged ball is about either old centre or the point
//! half-way between, whichever reaches out less; those that are left are moved to where they reach out less still.

use super::builder::{Built, Job, StageCount, TreeBuilder};
use super::medial::CoverPoints;
use super::medial::adaptive::Axis;
use super::medial::MedialBall;
use super::regions::{Part, build, cover_of};
use crate::{MeshDistance, MeshError, Vec3};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, BinaryHeap};

/// Samples that the balls are made of; about three balls each.
const SAMPLES: usize = 2000;

/// The builder.
pub(super) struct Hubbard;

impl TreeBuilder for Hubbard {
    fn build(&self, job: &Job) -> Result<Built, MeshError> {
        let cover = cover_of(job);
        let all: Vec<u32> = (0..cover.points.len() as u32).collect();
        let mut axis = Axis::new(&cover, &all, job.distance, SAMPLES);
        let balls = Balls { all: axis.balls(), holders: axis.holders(), cover: &cover, distance: job.distance };
        let most = job.settings.branch as usize;
        let mut built = build(job, &cover, &|region| balls.divide(region, most));
        built.stages.insert(0, StageCount { level: 0, stage: "medial balls".into(), count: balls.all.len() as u64 });
        Ok(built)
    }
}

struct Balls<'a> {
    all: Vec<MedialBall>,
    /// Per cover point, the balls that hold it.
    holders: Vec<Vec<u32>>,
    cover: &'a CoverPoints,
    distance: &'a MeshDistance,
}

/// A ball that some were merged into.
struct Group {
    center: Vec3,
    /// Signed distance of the centre.
    signed: f64,
    points: Vec<u32>,
    neighbors: BTreeSet<u32>,
    alive: bool,
}

impl Balls<'_> {
    fn divide(&self, region: &[u32], most: usize) -> Vec<Part> {
        let mut groups = self.groups(region);
        let mut merging = Merging { points: &self.cover.points, distance: self.distance, left: groups.len(), groups: &mut groups };
        merging.run(most);
        let parts = groups.into_iter().filter(|g| g.alive);
        let parts: Vec<Part> = parts.map(|g| Part::of(g.points, &self.cover.points, self.distance)).collect();
        if parts.len() < 2 { Vec::new() } else { parts }
    }

    /// Each point with the ball that holds most of the region, among those that hold it.
    fn groups(&self, region: &[u32]) -> Vec<Group> {
        let mut held: BTreeMap<u32, u32> = BTreeMap::new();
        for &i in region {
            self.holders[i as usize].iter().for_each(|b| *held.entry(*b).or_default() += 1);
        }
        let chosen = |i: u32| self.holders[i as usize].iter().copied().max_by_key(|b| (held[b], Reverse(*b))).unwrap_or(0);
        let mut number: BTreeMap<u32, u32> = BTreeMap::new();
        let mut groups: Vec<Group> = Vec::new();
        for &i in region {
            let ball = chosen(i);
            let g = *number.entry(ball).or_insert(groups.len() as u32) as usize;
            if g == groups.len() {
                let b = &self.all[ball as usize];
                let signed = self.distance.closest(&b.ball.center).signed_distance;
                let (points, neighbors) = (Vec::new(), BTreeSet::new());
                groups.push(Group { center: b.ball.center, signed, points, neighbors, alive: true });
            }
            groups[g].points.push(i);
        }
        for &i in region {
            let own = number[&chosen(i)];
            for b in &self.holders[i as usize] {
                if let Some(&other) = number.get(b).filter(|n| **n != own) {
                    groups[own as usize].neighbors.insert(other);
                    groups[other as usize].neighbors.insert(own);
                }
            }
        }
        groups
    }
}

struct Merging<'a> {
    points: &'a [Vec3],
    distance: &'a MeshDistance,
    groups: &'a mut Vec<Group>,
    left: usize,
}

impl Merging<'_> {
    fn run(&mut self, most: usize) {
        let mut queue = BinaryHeap::new();
        for a in 0..self.groups.len() as u32 {
            self.offer(a, &mut queue, |a, b| a < b);
        }
        while self.left > most {
            let Some(Reverse((_, a, b))) = queue.pop() else {
                if !self.bridge() {
                    return;
                }
                for a in 0..self.groups.len() as u32 {
                    self.offer(a, &mut queue, |a, b| a < b);
                }
                continue;
            };
            if self.groups[a as usize].alive && self.groups[b as usize].alive {
                let merged = self.merge(a, b);
                self.offer(merged, &mut queue, |_, _| true);
            }
        }
    }

    /// Queues the pairs of a group with its neighbours.
    fn offer(&self, a: u32, queue: &mut BinaryHeap<Reverse<(u64, u32, u32)>>, which: impl Fn(u32, u32) -> bool) {
        if self.groups[a as usize].alive {
            for &b in self.groups[a as usize].neighbors.iter().filter(|b| which(a, **b)) {
                queue.push(Reverse((self.merged(a, b).0.to_bits(), a, b)));
            }
        }
    }

    /// How far the ball of two groups reaches out, at least 0, its centre and that one's signed distance.
    fn merged(&self, a: u32, b: u32) -> (f64, Vec3, f64) {
        let [a, b] = [a, b].map(|g| &self.groups[g as usize]);
        let middle = 0.5 * (a.center + b.center);
        let centers = [(a.center, a.signed), (b.center, b.signed), (middle, self.distance.closest(&middle).signed_distance)];
        let judged = centers.map(|(center, signed)| {
            let square = |i: &u32| (self.points[*i as usize] - center).norm_squared();
            let reach = a.points.iter().chain(&b.points).map(square).fold(0.0, f64::max).sqrt();
            ((reach + signed).max(0.0), center, signed)
        });
        judged.into_iter().fold((f64::INFINITY, a.center, a.signed), |best, x| if x.0 < best.0 { x } else { best })
    }

    fn merge(&mut self, a: u32, b: u32) -> u32 {
        let (_, center, signed) = self.merged(a, b);
        let new = self.groups.len() as u32;
        let mut group = Group { center, signed, points: Vec::new(), neighbors: BTreeSet::new(), alive: true };
        for old in [a, b] {
            let old = &mut self.groups[old as usize];
            old.alive = false;
            group.points.append(&mut old.points);
            group.neighbors.append(&mut old.neighbors);
        }
        group.neighbors.retain(|n| *n != a && *n != b);
        for &n in &group.neighbors {
            let there = &mut self.groups[n as usize].neighbors;
            there.remove(&a);
            there.remove(&b);
            there.insert(new);
        }
        self.groups.push(group);
        self.left -= 1;
        new
    }

    /// Joins what has no neighbours in common: each group becomes a neighbour of the one with the closest centre. Whether there was a pair.
    fn bridge(&mut self) -> bool {
        let alive: Vec<u32> = (0..self.groups.len() as u32).filter(|&g| self.groups[g as usize].alive).collect();
        let center = |g: u32| self.groups[g as usize].center;
        let closest = |a: u32| {
            let others = alive.iter().copied().filter(|&b| b != a);
            others.min_by(|&x, &y| (center(x) - center(a)).norm_squared().total_cmp(&(center(y) - center(a)).norm_squared()))
        };
        let pairs: Vec<(u32, u32)> = alive.iter().filter_map(|&a| Some((a, closest(a)?))).collect();
        for &(a, b) in &pairs {
            self.groups[a as usize].neighbors.insert(b);
            self.groups[b as usize].neighbors.insert(a);
        }
        !pairs.is_empty()
    }
}
