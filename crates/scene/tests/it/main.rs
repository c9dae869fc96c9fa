//! Tests of `tumble-scene`.

mod articulated;
mod articulated_world;
mod bad_input;
mod cave_devices;
mod caves;
mod contacts;
mod events;
mod expansion;
mod finding;
mod mjcf;
mod mjcf_damaged;
mod mujoco;
mod names;
mod on_floor;
mod pinocchio;
mod repair;
mod robots;
mod robust;
mod scenes_in_motion;
mod shipped;
mod spheres;
mod state_hashes;
mod terrain;
mod threads;
mod urdf;
mod visuals;
