//! The address of a run's server, and this machine's own address as another machine sees it.

use std::net::{SocketAddr, UdpSocket};
use tumble::net::sync::udp::SharedKey;

/// Address at which a facet reaches the server.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum ServerAddress {
    /// Name of the run in shared memory.
    Memory(String),
    /// Address over UDP.
    Udp(SocketAddr),
}

/// The server of a run, as facets of this machine find it.
#[derive(Clone, Debug, PartialEq)]
pub struct RunServer {
    pub address: ServerAddress,
    /// Key of the run, if the cave has no key file and the address is one of UDP.
    pub key: Option<RunKey>,
}

/// A key that a server draws for one run. It is written in the cave's lock file, which only the
/// user can read, so that only processes of this user join.
#[derive(Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct RunKey([u8; 32]);

impl RunKey {
    /// Returns a key of these random bytes.
    pub fn new(random: [u8; 32]) -> RunKey {
        RunKey(random)
    }

    /// Returns the key for a link.
    pub fn shared(&self) -> SharedKey {
        SharedKey::new(self.0)
    }
}

impl std::fmt::Debug for RunKey {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("RunKey(secret)")
    }
}

/// Returns the local address of this machine on the route to `node`; `None` if there is no route.
/// Nothing is sent.
pub fn address_towards(node: &str, port: u16) -> Option<std::net::IpAddr> {
    let socket = UdpSocket::bind(("0.0.0.0", 0)).ok()?;
    socket.connect((node, port)).ok()?;
    Some(socket.local_addr().ok()?.ip())
}
