//! The interface of all tree builders: a job in, nested cells and stage counts out.

use super::TreeSettings;
use super::sphere::Sphere;
use crate::{MeshDistance, MeshError, TriMesh};
use serde::{Deserialize, Serialize};

/// The input of a builder.
pub(super) struct Job<'a> {
    /// Closed, outward-wound.
    pub mesh: &'a TriMesh,
    pub distance: &'a MeshDistance,
    pub settings: &'a TreeSettings,
    pub progress: &'a dyn Progress,
}

/// A build method; each has its own file or folder.
pub(super) trait TreeBuilder {
    /// Returns nested cells whose spheres cover the surface. The spheres of inner cells are fitted
    /// later, around their children.
    fn build(&self, job: &Job) -> Result<Built, MeshError>;
}

/// The output of a builder.
pub(super) struct Built {
    pub root: Cell,
    pub stages: Vec<StageCount>,
}

/// Nested cells. Leaves have their spheres.
pub(super) enum Cell {
    Leaf(Sphere),
    Inner(Vec<Cell>),
}

/// Receives the progress of a build and can stop it. Called from any thread that works on the
/// build.
pub trait Progress: Sync {
    /// Reports that the fraction `share` of the work is done, 0 to 1; never decreases.
    fn report(&self, share: f64);

    /// Returns whether the build should end early with [`MeshError::Stopped`]. Polled in every long
    /// loop. The result of a build that is not stopped does not depend on it.
    fn stopped(&self) -> bool {
        false
    }
}

/// Returns [`MeshError::Stopped`] if the build should end early.
pub(super) fn check_stopped(progress: &dyn Progress) -> Result<(), MeshError> {
    if progress.stopped() { Err(MeshError::Stopped) } else { Ok(()) }
}

/// Ignores all reports.
impl Progress for () {
    fn report(&self, _share: f64) {}
}

/// A count of one stage of a builder at one level.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StageCount {
    /// Level of the spheres that were made; 0 for the root.
    pub level: u32,
    /// Name of the stage, as in the file of the builder.
    pub stage: String,
    /// The count.
    pub count: u64,
}
