//! Input of a tracker: OSC messages over UDP.

pub mod budget;
pub mod osc;
pub mod relay;
pub mod sealed;
pub mod socket;
