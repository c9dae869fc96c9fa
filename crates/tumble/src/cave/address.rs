//! The address of a run's server, and this machine's own address as another machine sees it.

use std::net::{SocketAddr, UdpSocket};

/// How a facet finds the server.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum ServerAddress {
    /// The run's name in shared memory.
    Memory(String),
    /// The server's address.
    Udp(SocketAddr),
}

/// This machine's address as `node` would see it; `None` where it cannot be told. Nothing is sent.
pub fn address_towards(node: &str, port: u16) -> Option<std::net::IpAddr> {
    let socket = UdpSocket::bind(("0.0.0.0", 0)).ok()?;
    socket.connect((node, port)).ok()?;
    Some(socket.local_addr().ok()?.ip())
}
