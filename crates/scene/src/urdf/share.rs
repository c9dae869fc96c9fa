//! Distributes the allowed number of spheres over the shapes of a link.
//!
//! Each shape gets one sphere. Then the shape whose spheres reach furthest outside it gets one
//! more, until the allowed number is used or all shapes are covered tightly enough. The order does
//! not depend on the allowed number, and no step makes the worst value of a shape worse, so more
//! spheres never cover a link less tightly.

use tumble_core::collide::{Builder, Covering, SphereTree, TreeSettings, TriMesh, Vec3};

use super::spheres::{SphereOptions, Surface};

/// Largest number of children in a sphere tree.
const MAX_BRANCHES: usize = 64;
/// Sphere trees are tried from this number of spheres on, at each doubling.
const FIRST_TREE: usize = 4;

/// The spheres of a shape so far, in the shape's own frame.
pub(super) enum Share<'s> {
    Sphere(f64),
    Capsule { radius: f64, length: f64, count: usize },
    Barrel { radius: f64, length: f64, count: usize },
    Mesh(Box<MeshShare<'s>>),
}

pub(super) struct MeshShare<'s> {
    covering: Covering,
    solid: &'s TriMesh,
    slack: f64,
    /// Number of spheres at which trees are tried next.
    next_tree: usize,
    /// Octrees of depth 1, 2, …, as far as they are built.
    octrees: Vec<SphereTree>,
    stuck: bool,
}

/// Returns the spheres of shapes, within the limits of the options.
///
/// # Errors
/// There are more shapes than spheres, or a tree cannot be built.
pub(super) fn shared<'s>(
    surfaces: impl ExactSizeIterator<Item = &'s Surface>,
    options: &SphereOptions,
) -> Result<Vec<Share<'s>>, String> {
    let count = surfaces.len();
    if count > options.most {
        return Err(format!("it has {count} collision shapes, and each needs a sphere; {} are allowed", options.most));
    }
    let mut shares: Vec<Share<'s>> = surfaces.map(Share::new).collect();
    while shares.iter().map(Share::count).sum::<usize>() < options.most {
        let open = (0..shares.len()).filter(|k| shares[*k].wants_more(options.error));
        let Some(worst) = open.max_by(|a, b| shares[*a].worst().total_cmp(&shares[*b].worst()).then(b.cmp(a))) else {
            break;
        };
        shares[worst].add(options)?;
    }
    Ok(shares)
}

impl<'s> Share<'s> {
    fn new(surface: &'s Surface) -> Share<'s> {
        match surface {
            Surface::Sphere(radius) => Share::Sphere(*radius),
            Surface::Capsule(radius, length) => Share::Capsule { radius: *radius, length: *length, count: 1 },
            Surface::Barrel(radius, length) => Share::Barrel { radius: *radius, length: *length, count: 1 },
            Surface::Mesh { given, solid, slack } => {
                let covering = Covering::new(given, solid);
                Share::Mesh(Box::new(MeshShare {
                    covering,
                    solid,
                    slack: *slack,
                    next_tree: FIRST_TREE,
                    octrees: Vec::new(),
                    stuck: false,
                }))
            }
        }
    }

    fn count(&self) -> usize {
        match self {
            Share::Sphere(_) => 1,
            Share::Capsule { count, .. } | Share::Barrel { count, .. } => *count,
            Share::Mesh(mesh) => mesh.covering.count(),
        }
    }

    /// Returns how far the spheres reach outside the shape at most, meters.
    fn worst(&self) -> f64 {
        match self {
            Share::Sphere(_) => 0.0,
            Share::Capsule { radius, length, count } => reach(*radius, *length, *count) - radius,
            Share::Barrel { radius, length, count } => barrel_reach(*radius, *length, *count) - radius,
            Share::Mesh(mesh) => mesh.covering.worst() + mesh.slack,
        }
    }

    /// Returns whether they reach further than a fraction of the shape's diagonal and one more
    /// would help.
    fn wants_more(&self, error: f64) -> bool {
        match self {
            Share::Sphere(_) => false,
            Share::Capsule { radius, length, .. } | Share::Barrel { radius, length, .. } => {
                self.worst() > error * (length + 2.0 * radius)
            }
            Share::Mesh(mesh) => !mesh.stuck && mesh.covering.worst() > error * mesh.solid.diagonal(),
        }
    }

    fn add(&mut self, options: &SphereOptions) -> Result<(), String> {
        match self {
            Share::Sphere(_) => Ok(()),
            Share::Capsule { count, .. } | Share::Barrel { count, .. } => {
                *count += 1;
                Ok(())
            }
            Share::Mesh(mesh) => mesh.add(options),
        }
    }

    /// Returns center, radius and the largest distance outside the shape, meters, of each sphere.
    pub(super) fn spheres(&self) -> Vec<(Vec3, f64, f64)> {
        match self {
            Share::Sphere(radius) => vec![(Vec3::zeros(), *radius, 0.0)],
            Share::Capsule { radius, length, count } => {
                let at = |n: usize| if *count == 1 { 0.0 } else { length * (n as f64 / (count - 1) as f64 - 0.5) };
                let reach = reach(*radius, *length, *count);
                (0..*count).map(|n| (Vec3::z() * at(n), reach, reach - radius)).collect()
            }
            Share::Barrel { radius, length, count } => {
                let at = |n: usize| length * ((n as f64 + 0.5) / *count as f64 - 0.5);
                let reach = barrel_reach(*radius, *length, *count);
                (0..*count).map(|n| (Vec3::z() * at(n), reach, reach - radius)).collect()
            }
            Share::Mesh(mesh) => mesh
                .covering
                .spheres()
                .map(|(center, radius, outward)| (center, radius, outward + mesh.slack))
                .collect(),
        }
    }
}

/// Returns the radius of each of `count` spheres on a capsule's axis that cover it.
fn reach(radius: f64, length: f64, count: usize) -> f64 {
    // A single sphere also covers the ends.
    if count == 1 {
        radius + 0.5 * length
    } else {
        (radius * radius + 0.25 * (length / (count - 1) as f64).powi(2)).sqrt()
    }
}

/// Returns the radius of each of `count` spheres on a cylinder's axis that cover its side.
fn barrel_reach(radius: f64, length: f64, count: usize) -> f64 {
    (radius * radius + 0.25 * (length / count as f64).powi(2)).sqrt()
}

impl MeshShare<'_> {
    fn add(&mut self, options: &SphereOptions) -> Result<(), String> {
        self.stuck = !self.covering.refine();
        let count = self.covering.count();
        if count >= self.next_tree {
            self.next_tree = 2 * count;
            for centers in self.trees(count, options)? {
                self.covering.suggest(&centers, count);
            }
            self.covering.settle();
        }
        Ok(())
    }

    /// Returns the centers of trees' spheres, at most `count` of each tree.
    fn trees(&mut self, count: usize, options: &SphereOptions) -> Result<Vec<Vec<Vec3>>, String> {
        let build = |settings: TreeSettings| {
            SphereTree::build_cached(self.solid, &settings, &options.cache)
                .map(|built| built.tree)
                .map_err(|e| e.to_string())
        };
        let enough = options.error * self.solid.diagonal();
        let cut = |tree: &SphereTree| tree.select(count, enough).iter().map(|&n| tree.nodes()[n].center).collect();
        if options.tree.builder != Builder::Octree {
            let settings = TreeSettings { branch: count as u32, depth: 1, ..options.tree };
            return if count <= MAX_BRANCHES { Ok(vec![cut(&build(settings)?)]) } else { Ok(Vec::new()) };
        }
        while self.octrees.len() < options.tree.depth as usize
            && self.octrees.last().is_none_or(|tree| tree.leaves().count() <= count)
        {
            self.octrees.push(build(TreeSettings { depth: self.octrees.len() as u32 + 1, ..options.tree })?);
        }
        Ok(self.octrees.iter().rev().take(2).map(cut).collect())
    }
}
