//! Input of a tracker: OSC messages or the output of DTrack over UDP, the stream of a VRPN server, or a headset by
//! OpenXR.

pub mod budget;
mod dtrack;
mod headset;
pub mod lead;
pub mod one_euro;
pub mod openxr_client;
pub mod osc;
pub mod presence;
pub mod relay;
pub mod sealed;
pub mod smoothed;
pub mod socket;
pub mod vrpn_client;
