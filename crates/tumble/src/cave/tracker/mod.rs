//! Input of a tracker: OSC messages or the output of DTrack over UDP, or the stream of a VRPN server.

pub mod budget;
mod dtrack;
pub mod one_euro;
pub mod osc;
pub mod relay;
pub mod sealed;
mod smoothed;
pub mod socket;
pub mod vrpn_client;
