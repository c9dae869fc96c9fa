//! What `tumble-scene` promises of scene files.

mod bad_input;
mod expansion;
mod finding;
mod pinocchio;
mod robust;
mod shipped;
