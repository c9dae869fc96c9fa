//! The address of a run's server, and this machine's own address as another machine sees it.

use std::net::{SocketAddr, UdpSocket};

/// Address at which a facet reaches the server.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum ServerAddress {
    /// Name of the run in shared memory.
    Memory(String),
    /// Address over UDP.
    Udp(SocketAddr),
}

/// Returns the local address of this machine on the route to `node`; `None` if there is no route.
/// Nothing is sent.
pub fn address_towards(node: &str, port: u16) -> Option<std::net::IpAddr> {
    let socket = UdpSocket::bind(("0.0.0.0", 0)).ok()?;
    socket.connect((node, port)).ok()?;
    Some(socket.local_addr().ok()?.ip())
}
