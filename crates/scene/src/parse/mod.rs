//! Reads scene files: one file per table, and the readers that they share.

pub(crate) mod appearance;
pub(crate) mod articulated;
pub(crate) mod body;
pub(crate) mod bound;
pub(crate) mod fields;
pub(crate) mod file;
pub(crate) mod grid;
pub(crate) mod joint;
pub(crate) mod link;
pub(crate) mod lists;
pub(crate) mod log;
pub(crate) mod loop_joint;
pub(crate) mod material;
pub(crate) mod mesh;
pub(crate) mod mount;
pub(crate) mod pair;
pub(crate) mod place;
pub(crate) mod problem;
pub(crate) mod profile;
pub(crate) mod renamed;
pub(crate) mod rotation;
pub(crate) mod shape;
pub(crate) mod suggest;
pub(crate) mod terrain;
pub(crate) mod view;
pub(crate) mod world;
