//! Hubbard's builder: medial balls of a fixed set of samples, merged until few are left.
//!
//! Source: Hubbard, *Approximating polyhedra with spheres for time-critical collision detection* (1996). Samples of the
//! surface give Voronoi balls whose centres are inside the solid (and others where those leave samples bare), once for the
//! whole solid. For each region, its points choose among the balls that hold them; then, of all pairs of neighbours,
//! the pair is merged whose ball reaches out of the solid least, until as many are left as there may be children.
//!
//! Neighbours are groups some of whose points lie in one ball; groups that hang together with no other get the nearest for
//! a neighbour. A merged ball is about either old centre or the point half-way between, whichever reaches out less.
//!
//! Departs from the paper: where a ball reaches out far, over a hole between samples, a sample is added; and the parts that are left are refitted
//! (points choose balls, balls are fitted anew), which brought spot's 64 balls from 0.034 to 0.023–0.031 of the diagonal.

use super::builder::{Built, Job, Progress, StageCount, TreeBuilder};
use super::medial::CoverPoints;
use super::medial::adaptive::Axis;
use super::medial::{MedialBall, Want};
use super::regions::{Part, build, cover_of, refitted};
use crate::{MeshDistance, MeshError, Vec3};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, BinaryHeap};

/// Samples that the balls are made of; about three balls each.
const SAMPLES: usize = 2000;

/// A ball that reaches further out, in diagonals, is over a hole between samples, and gets one more.
const HOLE: f64 = 0.01;

/// Points of a component that others are sought from.
const LINKED_BY: usize = 32;

/// Points of a group by which costs are bounded.
const BOUNDED_BY: usize = 4;
/// Balls that hold a point which are kept, those that reach out least.
const HOLDERS: usize = 32;

/// The builder.
pub(super) struct Hubbard;

impl TreeBuilder for Hubbard {
    fn build(&self, job: &Job) -> Result<Built, MeshError> {
        let cover = cover_of(job);
        let all: Vec<u32> = (0..cover.points.len() as u32).collect();
        let mut axis = Axis::new(&cover, &all, job.distance, SAMPLES, job.progress);
        axis.refine(&Want { target: HOLE * job.mesh.diagonal(), least: 0, most: SAMPLES });
        let all = axis.balls();
        let mut holders = axis.holders();
        for of in &mut holders {
            let outward = |b: u32| all[b as usize].outward;
            of.sort_unstable_by(|&a, &b| outward(a).total_cmp(&outward(b)).then(a.cmp(&b)));
            of.truncate(HOLDERS);
        }
        let balls = Balls { all, holders, cover: &cover, distance: job.distance, progress: job.progress };
        let most = job.settings.branch as usize;
        let mut built = build(job, &cover, &|region| balls.divide(region, most));
        built.stages.insert(0, StageCount { level: 0, stage: "medial balls".into(), count: balls.all.len() as u64 });
        Ok(built)
    }
}

struct Balls<'a> {
    all: Vec<MedialBall>,
    /// Per cover point, balls that hold it, the one that reaches out least first.
    holders: Vec<Vec<u32>>,
    cover: &'a CoverPoints,
    distance: &'a MeshDistance,
    progress: &'a dyn Progress,
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
        let mut merging = Merging {
            points: &self.cover.points,
            distance: self.distance,
            left: groups.len(),
            groups: &mut groups,
            progress: self.progress,
        };
        merging.run(most);
        // half merged, the groups are too many for what follows
        if self.progress.stopped() {
            return Vec::new();
        }
        let parts = groups.into_iter().filter(|g| g.alive);
        let parts: Vec<Part> =
            parts.map(|g| Part::of(g.points, Some(g.center), &self.cover.points, self.distance)).collect();
        if parts.len() < 2 { Vec::new() } else { refitted(parts, &self.cover.points, self.distance, self.progress) }
    }

    /// Each point with the ball that reaches out least, among those that hold it.
    fn groups(&self, region: &[u32]) -> Vec<Group> {
        let chosen = |i: u32| self.holders[i as usize].first().copied().unwrap_or(0);
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
        // in the order of a ball's points, each group with the next that the ball holds some of
        let mut last: BTreeMap<u32, u32> = BTreeMap::new();
        for &i in region {
            let own = number[&chosen(i)];
            for b in &self.holders[i as usize] {
                if let Some(other) = last.insert(*b, own).filter(|other| *other != own) {
                    groups[own as usize].neighbors.insert(other);
                    groups[other as usize].neighbors.insert(own);
                }
            }
        }
        connect(&mut groups, region, &self.cover.points);
        groups
    }
}

/// Cost (ordered bits), whether it is known or a lower bound, and the pair of groups.
type Offer = Reverse<(u64, bool, u32, u32)>;

struct Merging<'a> {
    points: &'a [Vec3],
    distance: &'a MeshDistance,
    groups: &'a mut Vec<Group>,
    left: usize,
    progress: &'a dyn Progress,
}

impl Merging<'_> {
    fn run(&mut self, most: usize) {
        let mut queue = BinaryHeap::new();
        for a in 0..self.groups.len() as u32 {
            self.offer(a, &mut queue, |a, b| a < b);
        }
        while self.left > most && !self.progress.stopped() {
            let Some(Reverse((_, known, a, b))) = queue.pop() else { return };
            if !(self.groups[a as usize].alive && self.groups[b as usize].alive) {
                continue;
            }
            if known {
                let merged = self.merge(a, b);
                self.offer(merged, &mut queue, |_, _| true);
            } else {
                queue.push(Reverse((self.merged(a, b).0.to_bits(), true, a, b)));
            }
        }
    }

    /// Queues the pairs of a group with its neighbours by what they cost at least; what they cost is found when they come up.
    fn offer(&self, a: u32, queue: &mut BinaryHeap<Offer>, which: impl Fn(u32, u32) -> bool) {
        if self.groups[a as usize].alive {
            for &b in self.groups[a as usize].neighbors.iter().filter(|b| which(a, **b)) {
                queue.push(Reverse((self.at_least(a, b).to_bits(), false, a, b)));
            }
        }
    }

    /// A lower bound of [`Merging::merged`], by some of the points, and since signed distances differ by no more than centres do.
    fn at_least(&self, a: u32, b: u32) -> f64 {
        let [a, b] = [a, b].map(|g| &self.groups[g as usize]);
        let half = 0.5 * (a.center - b.center).norm();
        let centers =
            [(a.center, a.signed), (b.center, b.signed), (0.5 * (a.center + b.center), a.signed.max(b.signed) - half)];
        let some = |g: &'_ Group| g.points.len().div_ceil(BOUNDED_BY);
        let reaches = centers.map(|(center, signed)| {
            let square = |i: &u32| (self.points[*i as usize] - center).norm_squared();
            let [one, other] = [a, b].map(|g| g.points.iter().step_by(some(g)).map(square).fold(0.0, f64::max));
            one.max(other).sqrt() + signed
        });
        // less a rounding's worth
        (reaches.into_iter().fold(f64::INFINITY, f64::min) * (1.0 - 1e-9)).max(0.0)
    }

    /// How far the ball of two groups reaches out, at least 0, its centre and that one's signed distance.
    fn merged(&self, a: u32, b: u32) -> (f64, Vec3, f64) {
        let [a, b] = [a, b].map(|g| &self.groups[g as usize]);
        let middle = 0.5 * (a.center + b.center);
        let centers =
            [(a.center, a.signed), (b.center, b.signed), (middle, self.distance.closest(&middle).signed_distance)];
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
}

/// Makes neighbours until all groups hang together: each component but the largest gets the group of the point closest to some of its own.
fn connect(groups: &mut [Group], region: &[u32], points: &[Vec3]) {
    let mut group_of: BTreeMap<u32, u32> = BTreeMap::new();
    for (g, group) in groups.iter().enumerate() {
        group.points.iter().for_each(|i| _ = group_of.insert(*i, g as u32));
    }
    loop {
        let (component, largest) = components(groups);
        let mut own: BTreeMap<usize, Vec<u32>> = BTreeMap::new();
        for (i, g) in &group_of {
            own.entry(component[*g as usize]).or_default().push(*i);
        }
        if own.len() < 2 {
            return;
        }
        for (c, inside) in own.iter().filter(|(c, _)| **c != largest) {
            let mut best = (f64::INFINITY, 0, 0);
            for i in inside.iter().step_by(inside.len().div_ceil(LINKED_BY)) {
                for j in region.iter().filter(|j| component[group_of[j] as usize] != *c) {
                    let square = (points[*i as usize] - points[*j as usize]).norm_squared();
                    if square < best.0 {
                        best = (square, group_of[i], group_of[j]);
                    }
                }
            }
            groups[best.1 as usize].neighbors.insert(best.2);
            groups[best.2 as usize].neighbors.insert(best.1);
        }
    }
}

/// The component of each group, and which has most points.
fn components(groups: &[Group]) -> (Vec<usize>, usize) {
    let mut component = vec![usize::MAX; groups.len()];
    let mut sizes = Vec::new();
    for start in 0..groups.len() {
        if component[start] != usize::MAX {
            continue;
        }
        let (mut size, mut stack) = (0, vec![start]);
        component[start] = sizes.len();
        while let Some(g) = stack.pop() {
            size += groups[g].points.len();
            for &n in &groups[g].neighbors {
                if component[n as usize] == usize::MAX {
                    component[n as usize] = sizes.len();
                    stack.push(n as usize);
                }
            }
        }
        sizes.push(size);
    }
    let largest = (0..sizes.len()).max_by_key(|&c| (sizes[c], Reverse(c))).unwrap_or(0);
    (component, largest)
}
