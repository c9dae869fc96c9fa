//! The `tumble` command as its users run it: processes, files, exit codes.

mod articulated_scenes;
mod bad_input;
mod cave_ends;
mod cave_faults;
mod cave_figures;
mod cave_place;
mod cave_processes;
mod cave_recordings;
mod cave_tracker;
mod cave_users;
mod cave_windows;
mod caves;
mod common;
mod desktop;
mod determinism;
mod machines;
mod outputs;
mod picture;
mod repair;
mod scenes;
mod spheretree;
mod view;
mod view_drivers;
mod view_windows;
