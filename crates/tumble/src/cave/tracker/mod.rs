//! Input of a tracker: OSC messages over UDP.

pub mod osc;
pub mod socket;
