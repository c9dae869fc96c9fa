//! Handshake of four packets with a cookie, so that the server keeps no state for an address that
//! cannot receive.
//!
//! ```text
//! facet                                             server
//!   Hello(nonce, facet), padded to 256 bytes    →            no state
//!                                               ←   Challenge(nonce, cookie), 97 bytes
//!   Answer(nonce, facet, cookie), padded        →            valid cookie: the session is prepared
//!                                               ←   Welcome(nonce, server's nonce, session), 97 bytes
//!   Data: the first sealed packet               →            the session is live, and replaces an older one of this facet
//! ```
//!
//! `cookie = BLAKE3-keyed(secret of this server's process, address ‖ nonce ‖ facet ‖ ten-second
//! interval)`; the cookie of the previous interval is accepted too. All four packets carry a tag by
//! the handshake key, so a machine without the key file gets no answer. A recorded Answer that is
//! sent again gets the same Welcome, or prepares a session that nobody can complete; it never
//! affects a live session.
//!
//! A facet that receives nothing for two ping intervals probes its session, because the server may
//! have been restarted or may have dropped it. It names the session in a Hello. A server that knows
//! the session answers with a packet sealed by it. Any other server answers as to every Hello, and
//! a second session begins beside the old one. The old session ends when the first sealed packet of
//! the new one arrives, and never by a packet under the handshake key, which other servers may have
//! too. Any packet of the old session before that ends the probe.

use super::keys::Handshake;
use super::packet::{self, HEADER_BYTES, PacketHeader, PacketKind, TAG_BYTES};
use crate::sync::transport::{FacetNumber, Refused};
use std::net::{IpAddr, SocketAddr};
use std::time::Duration;

/// Length of a request, bytes: larger than every answer.
pub const REQUEST_BYTES: usize = 256;
const INTERVAL_S: u64 = 10;

/// Hello or Answer of a facet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Hello {
    /// Fresh for each attempt to connect.
    pub nonce: [u8; 32],
    /// Number of the facet.
    pub facet: FacetNumber,
    /// Cookie of the challenge; zeros in a Hello.
    pub cookie: [u8; 32],
    /// Session that is being probed because nothing arrived for some time; 0 if there is none.
    pub suspect_session: u32,
}

/// Challenge or Welcome of a server.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reply {
    /// Nonce of the facet.
    pub nonce: [u8; 32],
    /// Cookie (Challenge) or nonce of the server (Welcome).
    pub value: [u8; 32],
}

impl Hello {
    /// Writes a Hello or an Answer.
    pub fn write(&self, kind: PacketKind, handshake: &Handshake, datagram: &mut Vec<u8>) {
        packet::begin(datagram, PacketHeader { kind, session: self.suspect_session, sequence: 0 });
        datagram.extend_from_slice(&self.nonce);
        datagram.extend_from_slice(&self.facet.to_le_bytes());
        datagram.extend_from_slice(&self.cookie);
        datagram.resize(REQUEST_BYTES - TAG_BYTES, 0);
        handshake.tag(datagram);
    }

    /// Reads a Hello or an Answer.
    ///
    /// # Errors
    /// The length or the tag is wrong.
    pub fn read(datagram: &[u8], handshake: &Handshake) -> Result<Hello, Refused> {
        if datagram.len() != REQUEST_BYTES {
            return Err(if datagram.len() < REQUEST_BYTES { Refused::Truncated } else { Refused::Oversize });
        }
        let body = handshake.open(datagram)?;
        let (nonce, rest) = body.split_first_chunk().ok_or(Refused::Truncated)?;
        let (facet, rest) = rest.split_first_chunk().ok_or(Refused::Truncated)?;
        let (cookie, _) = rest.split_first_chunk().ok_or(Refused::Truncated)?;
        Ok(Hello {
            nonce: *nonce,
            facet: FacetNumber::from_le_bytes(*facet),
            cookie: *cookie,
            suspect_session: packet::session_of(datagram),
        })
    }
}

impl Reply {
    /// Writes a Challenge or a Welcome.
    pub fn write(&self, kind: PacketKind, session: u32, handshake: &Handshake, datagram: &mut Vec<u8>) {
        packet::begin(datagram, PacketHeader { kind, session, sequence: 0 });
        datagram.extend_from_slice(&self.nonce);
        datagram.extend_from_slice(&self.value);
        handshake.tag(datagram);
    }

    /// Reads a Challenge or a Welcome.
    ///
    /// # Errors
    /// The length or the tag is wrong.
    pub fn read(datagram: &[u8], handshake: &Handshake) -> Result<Reply, Refused> {
        match datagram.len().cmp(&(HEADER_BYTES + 64 + TAG_BYTES)) {
            std::cmp::Ordering::Less => return Err(Refused::Truncated),
            std::cmp::Ordering::Greater => return Err(Refused::Oversize),
            std::cmp::Ordering::Equal => {}
        }
        let body = handshake.open(datagram)?;
        let (nonce, rest) = body.split_first_chunk().ok_or(Refused::Truncated)?;
        let (value, _) = rest.split_first_chunk().ok_or(Refused::Truncated)?;
        Ok(Reply { nonce: *nonce, value: *value })
    }
}

/// Makes and verifies cookies.
pub struct Cookies([u8; 32]);

impl Cookies {
    /// Creates it with a secret of this process.
    pub fn new(secret: [u8; 32]) -> Cookies {
        Cookies(secret)
    }

    /// Returns the cookie for this Hello from this address at this time.
    pub fn create(&self, now: Duration, from: SocketAddr, hello: &Hello) -> [u8; 32] {
        *self.of(now.as_secs() / INTERVAL_S, from, hello).as_bytes()
    }

    /// Returns whether the Answer carries a cookie for this address that is at most 20 s old.
    pub fn verify(&self, now: Duration, from: SocketAddr, answer: &Hello) -> bool {
        let interval = now.as_secs() / INTERVAL_S;
        let given = blake3::Hash::from(answer.cookie);
        [Some(interval), interval.checked_sub(1)]
            .into_iter()
            .flatten()
            .any(|interval| self.of(interval, from, answer) == given)
    }

    fn of(&self, interval: u64, from: SocketAddr, hello: &Hello) -> blake3::Hash {
        let address = match from.ip() {
            IpAddr::V4(ip) => ip.to_ipv6_mapped().octets(),
            IpAddr::V6(ip) => ip.octets(),
        };
        let mut hasher = blake3::Hasher::new_keyed(&self.0);
        hasher
            .update(&address)
            .update(&from.port().to_le_bytes())
            .update(&hello.nonce)
            .update(&hello.facet.to_le_bytes());
        hasher.update(&interval.to_le_bytes()).finalize()
    }
}
