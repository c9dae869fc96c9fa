//! Recordings, from outside.

mod damage;
mod hostile;
mod inputs;
mod kill;
mod links;
mod outside;
mod recover;
mod roundtrip;
mod support;
mod shm;
mod sync;
mod udp;
mod udp_hostile;
mod udp_socket;
