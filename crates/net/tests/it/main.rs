//! Recordings, from outside.

mod damage;
mod hostile;
mod inputs;
mod kill;
mod outside;
mod recover;
mod roundtrip;
mod support;
mod udp;
mod sync;
