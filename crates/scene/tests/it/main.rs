//! Tests of `tumble-scene`.

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

mod articulated;
mod articulated_settings;
mod articulated_world;
mod bad_input;
mod behaviors;
mod bird;
mod cave_devices;
mod cave_schema;
mod caves;
mod contacts;
mod curved_screens;
mod damage;
mod events;
mod expansion;
mod finding;
mod loop_dofs;
mod mimics;
mod mjcf;
mod mjcf_actuators;
mod mjcf_constraints;
mod mjcf_contacts;
mod mjcf_damaged;
mod mjcf_mocap;
mod mjcf_written;
mod mjcf_written_names;
mod mujoco;
mod names;
mod npy;
mod on_floor;
mod pinocchio;
mod reader_fuzz;
mod repair;
mod robots;
mod robust;
mod same_bits;
mod saving;
mod scenes_in_motion;
mod sdformat;
mod sdformat_damaged;
mod sensors;
mod shape_names;
mod shipped;
mod spheres;
mod state_hashes;
mod terrain;
mod threads;
mod urdf;
mod visuals;
mod weigh;
