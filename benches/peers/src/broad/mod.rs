//! Crowds of moving boxes, and the methods that track their pairs: tumble's broad phase, parry's
//! bounding volume hierarchy (Rapier's), and a plain pass over memory.

mod crowd;
mod curve;

pub use crowd::{Crowd, Kind};
pub use curve::write as write_curve;

use crate::clock::cpu_seconds;
use rapier3d_f64::parry::bounding_volume::Aabb as ParryBox;
use rapier3d_f64::parry::partitioning::{Bvh, BvhBuildStrategy, BvhWorkspace};
use std::time::Instant;
use tumble_collide::{Aabb, BroadPhase, SweepAndPrune};

/// A method that tracks a crowd of boxes and counts its pairs.
pub trait Follower {
    /// Adds all boxes.
    fn start(&mut self, crowd: &Crowd);
    /// Updates the boxes that moved and returns the number of pairs.
    fn step(&mut self, crowd: &Crowd) -> usize;
}

/// tumble: the overlapping pairs of the exact boxes, sorted.
#[derive(Default)]
pub struct Sweep {
    broad: SweepAndPrune,
    handles: Vec<u32>,
    pairs: Vec<[u32; 2]>,
}

impl Follower for Sweep {
    fn start(&mut self, crowd: &Crowd) {
        self.handles = crowd.boxes.iter().zip(&crowd.moving).map(|(b, moving)| self.broad.insert(b, *moving)).collect();
    }

    fn step(&mut self, crowd: &Crowd) -> usize {
        for (i, b) in crowd.boxes.iter().enumerate().filter(|(i, _)| crowd.moving[*i]) {
            if crowd.replaced[i] {
                self.broad.remove(self.handles[i]);
                self.handles[i] = self.broad.insert(b, true);
            } else {
                self.broad.set(self.handles[i], b, true);
            }
        }
        self.broad.pairs(&mut self.pairs);
        self.pairs.len()
    }
}

/// parry's tree with the margin of its change detection; all overlapping pairs of leaves,
/// unordered, also those of two static boxes.
pub struct Tree {
    tree: Bvh,
    workspace: BvhWorkspace,
    margin: f64,
    pairs: Vec<[u32; 2]>,
    steps: u32,
}

impl Tree {
    /// Makes a tree with a margin in meters, which equals that of tumble's fat boxes.
    pub fn new(margin: f64) -> Tree {
        Tree { tree: Bvh::new(), workspace: BvhWorkspace::default(), margin, pairs: Vec::new(), steps: 0 }
    }
}

/// Number of steps between two optimizations of the tree.
const OPTIMIZED: u32 = 8;

impl Follower for Tree {
    fn start(&mut self, crowd: &Crowd) {
        let leaves: Vec<ParryBox> = crowd.boxes.iter().map(theirs).collect();
        self.tree = Bvh::from_leaves(BvhBuildStrategy::Binned, &leaves);
    }

    fn step(&mut self, crowd: &Crowd) -> usize {
        for (i, b) in crowd.boxes.iter().enumerate().filter(|(i, _)| crowd.moving[*i]) {
            if crowd.replaced[i] {
                self.tree.remove(i as u32);
            }
            self.tree.insert_or_update_partially(theirs(b), i as u32, self.margin);
        }
        self.tree.refit(&mut self.workspace);
        self.steps += 1;
        if self.steps.is_multiple_of(OPTIMIZED) {
            self.tree.optimize_incremental(&mut self.workspace);
            self.tree.refit(&mut self.workspace);
        }
        self.pairs.clear();
        let pairs = &mut self.pairs;
        self.tree.traverse_bvtt_single_tree::<false>(&mut self.workspace, &mut |i, j| pairs.push([i, j]));
        self.pairs.len()
    }
}

/// A lower bound for the work of a broad phase that keeps a list of near pairs. It writes every box
/// in 32 bytes and reads both boxes of every pair. The list stays as it was at the start, so only
/// the memory grows.
#[derive(Default)]
pub struct Plain {
    boxes: Vec<[f32; 8]>,
    near: Vec<[u32; 2]>,
    pairs: Vec<[u32; 2]>,
    margin: f64,
}

impl Plain {
    /// Makes the list of pairs that overlap when grown by a margin, meters.
    pub fn new(margin: f64) -> Plain {
        Plain { margin, ..Plain::default() }
    }
}

impl Follower for Plain {
    fn start(&mut self, crowd: &Crowd) {
        let mut broad = SweepAndPrune::default();
        for (b, moving) in crowd.boxes.iter().zip(&crowd.moving) {
            broad.insert(&Aabb { min: b.min.add_scalar(-self.margin), max: b.max.add_scalar(self.margin) }, *moving);
        }
        broad.pairs(&mut self.near);
        self.boxes = vec![[0.0; 8]; crowd.boxes.len()];
    }

    fn step(&mut self, crowd: &Crowd) -> usize {
        for (short, b) in self.boxes.iter_mut().zip(&crowd.boxes) {
            *short = [b.min.x, b.min.y, b.min.z, -b.max.x, -b.max.y, -b.max.z, -1.0, -1.0].map(|x| x as f32);
        }
        self.pairs.resize(self.near.len(), [0; 2]);
        let mut count = 0;
        for &[i, j] in &self.near {
            let (a, [x, y, z, u, v, w, ..]) = (&self.boxes[i as usize], self.boxes[j as usize]);
            self.pairs[count] = [i, j];
            count +=
                usize::from(a.iter().zip([-u, -v, -w, -x, -y, -z, 1.0, 1.0]).fold(true, |all, (a, b)| all & (*a <= b)));
        }
        count
    }
}

fn theirs(b: &Aabb) -> ParryBox {
    let corner = |v: &tumble_collide::Vec3| rapier3d_f64::math::Vector::new(v.x, v.y, v.z);
    ParryBox::new(corner(&b.min), corner(&b.max))
}

/// The cost of tracking a crowd.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cost {
    /// Microseconds of CPU per step, without the motion of the boxes.
    pub step: f64,
    /// Wall-clock microseconds of the fastest tenth of the steps: those with few insertions and
    /// without other load.
    pub tenth: f64,
    /// Pairs after the last step.
    pub pairs: usize,
}

/// Tracks a crowd for `steps` steps, after as many to warm up.
pub fn follow(follower: &mut dyn Follower, kind: Kind, n: usize, steps: usize) -> Cost {
    let mut crowd = Crowd::new(kind, n);
    follower.start(&crowd);
    let mut pairs = 0;
    for _ in 0..steps {
        crowd.advance();
        pairs = follower.step(&crowd);
    }
    let mut walls = Vec::with_capacity(steps);
    let start = cpu_seconds();
    for _ in 0..steps {
        crowd.advance();
        let begun = Instant::now();
        pairs = follower.step(&crowd);
        walls.push(begun.elapsed().as_secs_f64());
    }
    let followed = cpu_seconds();
    for _ in 0..steps {
        crowd.advance();
    }
    let moved = cpu_seconds() - followed;
    walls.sort_unstable_by(f64::total_cmp);
    Cost { step: 1e6 * (followed - start - moved) / steps as f64, tenth: 1e6 * walls[steps / 10], pairs }
}
