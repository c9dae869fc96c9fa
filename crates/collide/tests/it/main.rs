//! One binary for all integration tests of the crate.

#![allow(clippy::disallowed_methods)] // expected numbers may come from the platform

extern crate self as libfuzzer_sys;

/// Replaces the macro of `libfuzzer_sys`: makes a target a function of its bytes or text.
#[macro_export]
macro_rules! fuzz_target {
    (|$input:ident: &$kind:ty| $body:block) => {
        pub fn target($input: &$kind) {
            $body
        }
    };
}

mod against_parry;
mod bad_meshes;
mod broad;
mod brute_force;
mod builders;
mod buried;
mod compound;
mod deep_overlaps;
mod distances;
mod head_on;
mod hull;
mod hull_contacts;
mod isosurface;
mod medial;
mod mesh_contacts;
mod mesh_files;
mod meshes;
mod near_touching;
mod open_mesh;
mod overlaps;
mod pairs;
mod primitives;
mod quality;
mod rays;
mod reader_fuzz;
mod rng;
mod shape_cache;
mod shared_meshes;
mod smooth_in_concave;
mod smooth_shapes;
mod surface;
mod surface_parry;
mod terrain;
mod tree_cache;
mod tree_file;
mod trees;
mod winding;
