//! What every builder does: a job in, nested cells and an account of the stages out.

use super::TreeSettings;
use super::sphere::Sphere;
use crate::{MeshDistance, MeshError, TriMesh};
use serde::{Deserialize, Serialize};

/// What a builder works on.
pub(super) struct Job<'a> {
    /// Closed, outward-wound.
    pub mesh: &'a TriMesh,
    pub distance: &'a MeshDistance,
    pub settings: &'a TreeSettings,
    pub progress: &'a dyn Progress,
}

/// A method of building: one file (or folder) each.
pub(super) trait TreeBuilder {
    /// Nested cells whose spheres cover the surface; the spheres of inner cells are made later, around their children.
    fn build(&self, job: &Job) -> Result<Built, MeshError>;
}

/// What a builder hands over.
pub(super) struct Built {
    pub root: Cell,
    pub stages: Vec<StageCount>,
}

/// Nested cells, whose leaves have their spheres.
pub(super) enum Cell {
    Leaf(Sphere),
    Inner(Vec<Cell>),
}

/// Hears how far a build is, and can end it; called from any thread that works on the build.
pub trait Progress: Sync {
    /// `share` of the work is done, 0 to 1; does not fall.
    fn report(&self, share: f64);

    /// Whether the build shall end early, with [`MeshError::Stopped`]. Asked in every long loop; a build that runs to its end does not
    /// depend on it.
    fn stopped(&self) -> bool {
        false
    }
}

/// [`MeshError::Stopped`] where the build shall end early.
pub(super) fn check_stopped(progress: &dyn Progress) -> Result<(), MeshError> {
    if progress.stopped() { Err(MeshError::Stopped) } else { Ok(()) }
}

/// Nobody listens.
impl Progress for () {
    fn report(&self, _share: f64) {}
}

/// How often a stage of a builder did its work at one level.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StageCount {
    /// Level of the spheres that were made, the root being 0.
    pub level: u32,
    /// The stage, in the words of the builder's file.
    pub stage: String,
    /// How many.
    pub count: u64,
}
