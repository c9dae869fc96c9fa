//! Keeps the cores of this machine from falling asleep: a core that sleeps takes tens of microseconds to hear that there is work, one that waits awake takes none.
//!
//! Linux's `/dev/cpu_dma_latency` (kernel documentation, "PM Quality of Service"): as long as a process holds it open, no core enters a state that takes longer to
//! leave than it wrote there, µs. It is over when the process ends, however that is. Whoever may write to it (root, usually) decides; the price is electricity.

use super::transport::LinkError;
use std::fs::{File, OpenOptions};
use std::io::Write;

const DEVICE: &str = "/dev/cpu_dma_latency";

/// As long as it lives the cores stay awake.
pub struct CpuLatencyRequest {
    /// Held open, no more.
    _device: File,
}

impl CpuLatencyRequest {
    /// Asks for it.
    ///
    /// Errors: the system does not have it, or this user may not.
    pub fn ask() -> Result<CpuLatencyRequest, LinkError> {
        let io = |why| LinkError::Io { what: format!("keeping the cores awake: {DEVICE}"), why };
        let mut device = OpenOptions::new().write(true).open(DEVICE).map_err(io)?;
        device.write_all(&0i32.to_ne_bytes()).map_err(io)?;
        Ok(CpuLatencyRequest { _device: device })
    }
}
