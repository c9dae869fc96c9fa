//! Keeps the cores of this machine out of deep idle states. A core in a deep idle state takes tens
//! of µs to wake up, a core in a shallow one almost none.
//!
//! Linux offers `/dev/cpu_dma_latency` (kernel documentation, "PM Quality of Service"). While a
//! process holds the file open, no core enters a state with an exit latency above the value written
//! to it, in µs. The request ends with the process. Opening the file needs write permission, by
//! default root's. The cost is electric power.

use super::transport::LinkError;
use std::fs::{File, OpenOptions};
use std::io::Write;

const DEVICE: &str = "/dev/cpu_dma_latency";

/// A request for low wake-up latency. It holds until it is dropped.
pub struct CpuLatencyRequest {
    /// Held open and never read.
    _device: File,
}

impl CpuLatencyRequest {
    /// Requests an exit latency of 0 µs.
    ///
    /// # Errors
    /// The system has no such device, or this user may not write to it.
    pub fn ask() -> Result<CpuLatencyRequest, LinkError> {
        let io = |why| LinkError::Io { what: format!("keeping the cores awake: {DEVICE}"), why };
        let mut device = OpenOptions::new().write(true).open(DEVICE).map_err(io)?;
        device.write_all(&0i32.to_ne_bytes()).map_err(io)?;
        Ok(CpuLatencyRequest { _device: device })
    }
}
