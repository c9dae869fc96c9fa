//! The adaptive medial axis builder.
//!
//! Source: Bradshaw and O'Sullivan, *Adaptive medial-axis approximation for sphere-tree construction* (2004).
//!
//! Level by level, each ball's points are covered by at most `branch` balls: candidates on the medial axis
//! ([`candidates`]) are reduced ([`expand`]), moved to where they need least ([`refit`]), exchanged ([`optimise`]),
//! and divide the points among themselves. Then the leaves are refitted all together, made to cover the surface
//! itself and not its samples (`close`), and the inner balls are put around their children.

pub(in crate::tree) mod adaptive;
mod burst;
mod candidates;
mod cover_points;
pub(in crate::tree) mod delaunay;
mod expand;
mod gaps;
mod group;
mod levels;
mod merge;
mod optimise;
mod reduce;
mod refit;
mod site;
mod spheres;
pub(in crate::tree) mod voronoi;

pub(super) use spheres::{CoverPoints, MedialBall, Want};

use super::builder::{Built, Job, TreeBuilder};
use crate::MeshError;

/// The builder.
pub(super) struct Medial;

impl TreeBuilder for Medial {
    fn build(&self, job: &Job) -> Result<Built, MeshError> {
        let mut levels = levels::Levels::new(job);
        Ok(Built { root: levels.cells(), stages: levels.stages })
    }
}
