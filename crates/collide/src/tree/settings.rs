//! Settings of sphere tree builds.

use crate::MeshError;
use serde::{Deserialize, Serialize};

/// Settings of a sphere tree build.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TreeSettings {
    /// The build method.
    pub builder: Builder,
    /// Maximum number of children per sphere, 2 to 64. The octree ignores it and has at most 8.
    pub branch: u32,
    /// Maximum number of subdivisions, 1 to 9.
    pub depth: u32,
    /// A cell is not divided further once its sphere extends at most this far outside, as a
    /// fraction of the mesh's diagonal; 1e-4 to 1.
    pub error: f64,
    /// Grow every leaf to the same offset, `error`. Flat faces stay flat, so a body that stands on
    /// one stays upright and at rest. Otherwise each leaf is as tight as possible. Octree only.
    pub even: bool,
}

/// The build methods.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Builder {
    /// Cells of an octree that intersect the surface. The fastest method, and the only one with
    /// even flat faces.
    Octree,
    /// Adaptive medial axis. The tightest method.
    #[default]
    Medial,
    /// Hubbard's medial axis: merges the spheres of a fixed set of samples. Faster and coarser than
    /// the adaptive one.
    Hubbard,
    /// Spheres of the cubes of an oriented grid. Faster still.
    Grid,
}

impl Default for TreeSettings {
    /// The tightest tree, with at most 8, 64 and 512 spheres.
    fn default() -> TreeSettings {
        TreeSettings { builder: Builder::Medial, branch: 8, depth: 3, error: 1e-4, even: false }
    }
}

impl TreeSettings {
    /// Returns the settings of an even octree with an outward error of 1 % of the diagonal.
    pub fn octree() -> TreeSettings {
        TreeSettings { builder: Builder::Octree, branch: 8, depth: 7, error: 0.01, even: true }
    }

    pub(crate) fn check(&self) -> Result<(), MeshError> {
        if !(2..=64).contains(&self.branch) {
            return Err(MeshError::Settings {
                what: "the branching of a sphere tree",
                value: f64::from(self.branch),
                allowed: "2 to 64",
            });
        }
        if !(1..=9).contains(&self.depth) {
            return Err(MeshError::Settings {
                what: "the depth of a sphere tree",
                value: f64::from(self.depth),
                allowed: "1 to 9",
            });
        }
        if !(1e-4..=1.0).contains(&self.error) {
            return Err(MeshError::Settings {
                what: "the error of a sphere tree",
                value: self.error,
                allowed: "0.0001 to 1",
            });
        }
        Ok(())
    }
}
