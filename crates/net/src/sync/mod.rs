//! NetSync: one server simulates, one process per facet draws, and every facet shows the same frame (thesis §IV.A.6, §IV.C).

pub mod shm;
pub mod transport;
pub mod udp;
