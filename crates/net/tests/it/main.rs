//! Recordings and sessions, from outside.

// the fuzz targets ask for their macro by this name
extern crate self as libfuzzer_sys;

mod damage;
mod fuzz;
mod hostile;
mod inputs;
mod kill;
mod links;
mod mesh_frame;
mod outside;
mod recover;
mod roundtrip;
mod shm;
mod support;
mod sync;
mod udp;
mod udp_hostile;
mod udp_socket;
