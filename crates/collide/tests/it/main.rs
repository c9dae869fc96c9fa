//! One binary for all integration tests of the crate.

mod against_parry;
mod bad_meshes;
mod broad;
mod brute_force;
mod builders;
mod buried;
mod distances;
mod hull;
mod medial;
mod mesh_contacts;
mod mesh_files;
mod meshes;
mod overlaps;
mod pairs;
mod primitives;
mod quality;
mod rays;
mod rng;
mod shape_cache;
mod shared_meshes;
mod surface;
mod surface_parry;
mod tree_cache;
mod tree_file;
mod trees;
mod winding;
