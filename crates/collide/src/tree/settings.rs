//! How a sphere tree is to be built.

use crate::MeshError;
use serde::{Deserialize, Serialize};

/// How a tree is built.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TreeSettings {
    /// Which method.
    pub builder: Builder,
    /// Greatest number of children of a ball, 2 to 64. The octree has 8 at most and takes no notice.
    pub branch: u32,
    /// Greatest number of subdivisions, 1 to 9.
    pub depth: u32,
    /// A cell is not divided further once its ball reaches at most this far outwards, as a part of the mesh's
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
    /// Cells of an octree that the surface passes through.
    #[default]
    Octree,
}

impl Default for TreeSettings {
    /// Outward error of 1 % of the diagonal, evenly.
    fn default() -> TreeSettings {
        TreeSettings { builder: Builder::Octree, branch: 8, depth: 7, error: 0.01, even: true }
    }
}

impl TreeSettings {
    pub(super) fn check(&self) -> Result<(), MeshError> {
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
