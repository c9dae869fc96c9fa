//! Self-collision of a robot of spheres at given joint positions.
//!
//! Two links collide if a sphere of the one overlaps a sphere of the other; the depth is the
//! largest `r₁ + r₂ − |c₁ − c₂|`. Planners skip pairs of links that cannot collide or always do
//! ([`SphereRobot::ignored_pairs`]):
//!
//! - *adjacent* links: the one is the nearest link with collision geometry above the other,
//! - links that overlap at a pose which is known to be free of collisions,
//! - links that overlap at all of many poses.

use std::collections::BTreeMap;

use tumble_core::Joint;
use tumble_core::collide::{Pose, Quat, Vec3};

use super::read::Robot;
use super::spheres::SphereRobot;
use crate::parse::link::LinkSpec;

/// Maximum number of poses of a robot that are examined together.
pub const MAX_POSES: usize = 1_000_000;

/// Positions of joints by name, rad or m. Joints that are not named are at 0, or at the limit next
/// to it; a joint that follows another cannot be named.
pub type JointPositions = BTreeMap<String, f64>;

/// Two links whose spheres overlap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overlap {
    /// Indices into [`SphereRobot::links`], the smaller one first.
    pub links: [usize; 2],
    /// Depth of the deepest overlap of two spheres, meters.
    pub depth: f64,
    /// Whether the links are adjacent.
    pub adjacent: bool,
}

/// A link of the tree, with the joint that moves it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TreeLink {
    parent: Option<usize>,
    placement: Pose,
    joint: String,
    kind: Joint,
    limits: Option<[f64; 2]>,
    /// The link whose joint is followed, ratio, and offset.
    mimic: Option<(usize, f64, f64)>,
    /// Index of its spheres.
    spheres: Option<usize>,
}

impl TreeLink {
    fn new(link: &LinkSpec, names: &BTreeMap<&str, usize>) -> TreeLink {
        TreeLink {
            parent: link.parent,
            placement: link.placement,
            joint: link.joint.name.clone(),
            kind: link.joint.kind,
            limits: link.joint.dof.limits,
            mimic: link.joint.mimic.map(|mimic| (mimic.link, mimic.multiplier, mimic.offset)),
            spheres: names.get(link.name.as_str()).copied(),
        }
    }

    fn is_driven(&self) -> bool {
        self.mimic.is_none() && matches!(self.kind, Joint::Revolute { .. } | Joint::Prismatic { .. })
    }

    /// Returns the lowest and the highest position: the limits, one turn without them, and no motion
    /// of a prismatic joint without them.
    fn range(&self) -> [f64; 2] {
        self.limits.unwrap_or(match self.kind {
            Joint::Revolute { .. } => [-std::f64::consts::PI, std::f64::consts::PI],
            _ => [0.0; 2],
        })
    }

    fn rest(&self) -> f64 {
        self.limits.map_or(0.0, |[low, high]| 0.0_f64.clamp(low, high.max(low)))
    }
}

/// Returns the tree of a robot; `names` are the links with spheres, in their order.
pub(super) fn tree<'n>(robot: &Robot, names: impl Iterator<Item = &'n str>) -> Vec<TreeLink> {
    let names: BTreeMap<&str, usize> = names.zip(0..).collect();
    robot.links.iter().map(|link| TreeLink::new(link, &names)).collect()
}

impl SphereRobot {
    /// Returns the pairs of links that overlap at the given positions of joints, in order.
    ///
    /// # Errors
    /// A name is not that of a joint with one degree of freedom, or a position is not finite.
    pub fn overlaps(&self, positions: &JointPositions) -> Result<Vec<Overlap>, String> {
        let poses = self.link_poses(positions)?;
        let placed: Vec<Vec<(Vec3, f64)>> =
            self.links.iter().zip(&poses).map(|(link, pose)| at(pose, &link.spheres)).collect();
        let mut overlaps = Vec::new();
        for b in 0..placed.len() {
            for a in 0..b {
                let depth = depth(&placed[a], &placed[b]);
                if depth > 0.0 {
                    overlaps.push(Overlap { links: [a, b], depth, adjacent: self.is_adjacent(a, b) });
                }
            }
        }
        overlaps.sort_by_key(|overlap| overlap.links);
        Ok(overlaps)
    }

    /// Returns the pairs of links that a planner need not compare, in order: adjacent ones, those
    /// that overlap at one of the poses `free` (by default, if it is empty, at the zero pose), and
    /// those that overlap at all of `samples`.
    ///
    /// # Errors
    /// As [`SphereRobot::overlaps`], and more than [`MAX_POSES`] poses.
    pub fn ignored_pairs(
        &self,
        free: &[JointPositions],
        samples: &[JointPositions],
    ) -> Result<Vec<[usize; 2]>, String> {
        let count = free.len() + samples.len();
        if count > MAX_POSES {
            return Err(format!("{count} poses; at most {MAX_POSES} are examined"));
        }
        let zero = [JointPositions::new()];
        let mut times: BTreeMap<[usize; 2], usize> = BTreeMap::new();
        for pose in samples {
            self.overlaps(pose)?.iter().for_each(|overlap| *times.entry(overlap.links).or_default() += 1);
        }
        let mut ignored: Vec<[usize; 2]> =
            times.into_iter().filter(|(_, times)| *times == samples.len()).map(|(links, _)| links).collect();
        for pose in if free.is_empty() { &zero[..] } else { free } {
            ignored.extend(self.overlaps(pose)?.iter().map(|overlap| overlap.links));
        }
        let pairs = (0..self.links.len()).flat_map(|b| (0..b).map(move |a| [a, b]));
        ignored.extend(pairs.filter(|[a, b]| self.is_adjacent(*a, *b)));
        ignored.sort_unstable();
        ignored.dedup();
        Ok(ignored)
    }

    /// Returns `count` poses within the limits of the joints, evenly distributed: the Kronecker
    /// sequence `frac(½ + n √p)`, with a prime `p` for each joint that drives. `first` is the first
    /// `n`.
    pub fn sample_poses(&self, count: usize, first: usize) -> Vec<JointPositions> {
        let driven: Vec<&TreeLink> = self.tree.iter().filter(|link| link.is_driven()).collect();
        let roots: Vec<f64> = primes(driven.len()).iter().map(|p| (*p as f64).sqrt().fract()).collect();
        let position = |n: usize, link: &TreeLink, root: f64| {
            let [low, high] = link.range();
            low + (high - low) * (0.5 + n as f64 * root).fract()
        };
        let pose =
            |n: usize| driven.iter().zip(&roots).map(|(l, root)| (l.joint.clone(), position(n, l, *root))).collect();
        (first..first.saturating_add(count.min(MAX_POSES))).map(pose).collect()
    }

    /// Returns the poses of the links with spheres in the frame of the base.
    fn link_poses(&self, positions: &JointPositions) -> Result<Vec<Pose>, String> {
        let driven = || self.tree.iter().filter(|link| link.is_driven());
        for (name, position) in positions {
            if !driven().any(|link| link.joint == *name) {
                let names: Vec<&str> = driven().map(|link| link.joint.as_str()).collect();
                return Err(format!("there is no joint \"{name}\" to set; the joints are {}", names.join(", ")));
            }
            if !position.is_finite() {
                return Err(format!("the position of joint \"{name}\" is {position}; expected a finite number"));
            }
        }
        let own = |link: &TreeLink| positions.get(&link.joint).copied().unwrap_or(link.rest());
        let position = |link: &TreeLink| match link.mimic {
            // a followed joint follows none
            Some((of, ratio, offset)) => ratio * own(&self.tree[of]) + offset,
            None => own(link),
        };
        let mut poses: Vec<Pose> = Vec::new();
        for link in &self.tree {
            let above = link.parent.map_or(Pose::identity(), |parent| poses[parent]);
            poses.push(above * link.placement * motion(&link.kind, position(link)));
        }
        let mut with_spheres = vec![Pose::identity(); self.links.len()];
        for (link, pose) in self.tree.iter().zip(&poses) {
            if let Some(n) = link.spheres {
                with_spheres[n] = *pose;
            }
        }
        Ok(with_spheres)
    }

    fn is_adjacent(&self, a: usize, b: usize) -> bool {
        self.above(a) == Some(b) || self.above(b) == Some(a)
    }

    /// Returns the nearest link with spheres above one.
    fn above(&self, link: usize) -> Option<usize> {
        let mut at = self.tree.iter().find(|l| l.spheres == Some(link))?.parent;
        while let Some(n) = at {
            if let Some(spheres) = self.tree[n].spheres {
                return Some(spheres);
            }
            at = self.tree[n].parent;
        }
        None
    }
}

/// Returns the motion of a joint; none for one of several degrees of freedom.
fn motion(kind: &Joint, position: f64) -> Pose {
    match kind {
        Joint::Revolute { axis } => Pose::from_parts(Vec3::zeros().into(), Quat::new(axis * position)),
        Joint::Prismatic { axis } => Pose::from_parts((axis * position).into(), Quat::identity()),
        _ => Pose::identity(),
    }
}

fn at(pose: &Pose, spheres: &[(Vec3, f64)]) -> Vec<(Vec3, f64)> {
    spheres.iter().map(|(center, radius)| ((pose * nalgebra::Point3::from(*center)).coords, *radius)).collect()
}

/// Returns the depth of the deepest overlap; not above 0 if there is none.
fn depth(a: &[(Vec3, f64)], b: &[(Vec3, f64)]) -> f64 {
    let pairs = a.iter().flat_map(|one| b.iter().map(move |other| (one, other)));
    pairs.map(|(one, other)| one.1 + other.1 - (one.0 - other.0).norm()).fold(0.0, f64::max)
}

fn primes(count: usize) -> Vec<usize> {
    (2..).filter(|n| (2..*n).take_while(|k| k * k <= *n).all(|k| n % k != 0)).take(count).collect()
}
