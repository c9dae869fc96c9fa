//! How a sphere tree is to be built.

use crate::MeshError;
use serde::{Deserialize, Serialize};

/// How a tree is built.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TreeSettings {
    /// Which method.
    pub builder: Builder,
    /// Greatest number of children of a sphere, 2 to 64. The octree has 8 at most and takes no notice.
    pub branch: u32,
    /// Greatest number of subdivisions, 1 to 9.
    pub depth: u32,
    /// A cell is not divided further once its sphere reaches at most this far outwards, as a part of the mesh's
    /// diagonal; 1e-4 to 1.
    pub error: f64,
    /// Grow every leaf to the same stand-off, `error`: flat faces stay flat, so that what stands on them stands
    /// upright and at rest. Otherwise each leaf is as tight as it can be. Of the octree only.
    pub even: bool,
}

/// The methods there are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Builder {
    /// Cells of an octree that the surface passes through. The fastest, and the one whose flat faces can be even.
    Octree,
    /// Adaptive medial axis. The tightest.
    #[default]
    Medial,
    /// Hubbard's medial axis: spheres of a fixed set of samples, merged. Faster than the adaptive one and coarser.
    Hubbard,
    /// Spheres of an oriented grid's cubes. Faster still.
    Grid,
}

impl Default for TreeSettings {
    /// The tightest tree of at most 8, 64 and 512 spheres.
    fn default() -> TreeSettings {
        TreeSettings { builder: Builder::Medial, branch: 8, depth: 3, error: 1e-4, even: false }
    }
}

impl TreeSettings {
    /// An octree of an outward error of 1 % of the diagonal, evenly.
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
