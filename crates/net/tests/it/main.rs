//! Recordings and sessions, from outside.

mod damage;
mod hostile;
mod inputs;
mod kill;
mod outside;
mod recover;
mod roundtrip;
mod shm;
mod support;
mod sync;
mod udp;
mod udp_hostile;
mod udp_socket;
