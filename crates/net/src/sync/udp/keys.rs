//! Keys: from the key file that all machines of a cave share to the two keys of each session.
//!
//! | name | definition |
//! |---|---|
//! | pre-shared key | 32 bytes that only the machines of this cave know |
//! | handshake key | `BLAKE3-derive("… handshake", pre-shared key)`: tags packets before there is a session |
//! | session keys | `BLAKE3-derive("… facet to server", pre-shared key ‖ facet's nonce ‖ server's nonce ‖ session ‖ facet)`, and the same for the other direction |
//!
//! Both sides contribute a fresh nonce of 32 bytes, so no two sessions have the same keys, and a
//! packet of one direction, facet or session is a forgery in every other. The key file decrypts
//! recorded sessions: there is no forward secrecy, because there is no other secret.

use super::packet::{self, HEADER_BYTES, MAX_DATAGRAM, PacketHeader, TAG_BYTES};
use crate::sync::transport::{FacetNumber, LinkError, Refused};
use chacha20poly1305::aead::{AeadInOut, Generate, Key, KeyInit};
use chacha20poly1305::{ChaCha20Poly1305, Nonce, Tag};
use std::path::Path;

const HANDSHAKE: &str = "tumble-net udp v2 handshake";
const TO_SERVER: &str = "tumble-net udp v2 facet to server";
const TO_FACET: &str = "tumble-net udp v2 server to facet";
const TRACKERS: &str = "tumble-net udp v2 trackers";
const SEEDED: &str = "tumble-net udp v1 random numbers of one process";

/// The pre-shared key.
#[derive(Clone)]
pub struct SharedKey {
    bytes: [u8; 32],
    secret: bool,
}

impl std::fmt::Debug for SharedKey {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(if self.secret { "SharedKey(secret)" } else { "SharedKey(none)" })
    }
}

/// A key file as it should be.
const WANTED: &str = "expected are 64 hexadecimal digits (32 bytes); make one with: head -c 32 /dev/urandom | od -An -tx1 | tr -d ' \\n'";

impl SharedKey {
    /// Returns a public key: it detects damage and no forgery. It is used on loopback addresses
    /// only.
    pub fn none() -> SharedKey {
        SharedKey { bytes: [0; 32], secret: false }
    }

    /// Returns a secret key.
    pub fn new(bytes: [u8; 32]) -> SharedKey {
        SharedKey { bytes, secret: true }
    }

    /// Returns whether the key is secret.
    pub fn is_secret(&self) -> bool {
        self.secret
    }

    /// Returns the key that links of trackers use: another one, so that no packet of theirs is one of
    /// a facet.
    pub fn for_trackers(&self) -> SharedKey {
        SharedKey { bytes: blake3::derive_key(TRACKERS, &self.bytes), secret: self.secret }
    }

    /// Reads a key file: 64 hexadecimal digits (32 bytes), with optional white space around them.
    ///
    /// # Errors
    /// The file cannot be read, others than its owner may read it, or it has another content. Each
    /// message names the file and the remedy.
    pub fn read(path: &Path) -> Result<SharedKey, LinkError> {
        let refuse = |why: String| LinkError::Other(format!("key file {}: {why}", path.display()));
        let file = std::fs::File::open(path)
            .map_err(|why| LinkError::Io { what: format!("key file {}", path.display()), why })?;
        let about =
            file.metadata().map_err(|why| LinkError::Io { what: format!("key file {}", path.display()), why })?;
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            let mode = about.permissions().mode() & 0o777;
            if mode & 0o077 != 0 {
                return Err(refuse(format!("mode {mode:03o} lets others read it; run: chmod 600 {}", path.display())));
            }
        }
        if about.len() > 256 {
            return Err(refuse(format!("{} bytes long; {WANTED}", about.len())));
        }
        let mut text = Vec::new();
        std::io::Read::read_to_end(&mut std::io::Read::take(file, 256), &mut text)
            .map_err(|why| LinkError::Io { what: format!("key file {}", path.display()), why })?;
        SharedKey::parse(&text).map_err(refuse)
    }

    /// Parses the content of a key file.
    ///
    /// # Errors
    /// The fault.
    pub fn parse(text: &[u8]) -> Result<SharedKey, String> {
        let text = std::str::from_utf8(text).map_err(|_| format!("not text; {WANTED}"))?;
        let digits = text.trim().as_bytes();
        if digits.len() != 64 {
            return Err(format!("{} digits; {WANTED}", digits.len()));
        }
        let mut bytes = [0; 32];
        for (k, pair) in digits.chunks_exact(2).enumerate() {
            let digit = |at: usize| {
                (pair[at] as char)
                    .to_digit(16)
                    .ok_or_else(|| format!("character {} is no hexadecimal digit; {WANTED}", 2 * k + at + 1))
            };
            bytes[k] = (digit(0)? * 16 + digit(1)?) as u8;
        }
        if bytes == [0; 32] {
            return Err(format!("all zeros; {WANTED}"));
        }
        Ok(SharedKey::new(bytes))
    }
}

/// Random bytes, from the operating system or, in tests, from a seed.
pub struct Entropy {
    key: [u8; 32],
    counter: u64,
}

impl Entropy {
    /// Returns a generator seeded by the operating system.
    ///
    /// # Errors
    /// The system gives no random numbers.
    pub fn system() -> Result<Entropy, LinkError> {
        let key = Key::<ChaCha20Poly1305>::try_generate()
            .map_err(|why| LinkError::Other(format!("the system gives no random numbers: {why}")))?;
        Ok(Entropy { key: key.into(), counter: 0 })
    }

    /// Returns a generator with a fixed seed, for tests.
    pub fn seeded(seed: u64) -> Entropy {
        Entropy { key: blake3::derive_key(SEEDED, &seed.to_le_bytes()), counter: 0 }
    }

    /// Returns the next 32 bytes.
    pub fn next_bytes(&mut self) -> [u8; 32] {
        self.counter += 1;
        *blake3::keyed_hash(&self.key, &self.counter.to_le_bytes()).as_bytes()
    }

    /// Returns the next number, never 0.
    pub fn next_u64(&mut self) -> u64 {
        let [a, b, c, d, e, f, g, h, ..] = self.next_bytes();
        u64::from_le_bytes([a, b, c, d, e, f, g, h]).max(1)
    }
}

/// Key that tags packets before there is a session.
#[derive(Clone)]
pub struct Handshake([u8; 32]);

impl Handshake {
    /// Derives the key.
    pub fn new(shared: &SharedKey) -> Handshake {
        Handshake(blake3::derive_key(HANDSHAKE, &shared.bytes))
    }

    /// Completes a datagram begun by [`packet::begin`]: length, tag, checksum.
    pub fn tag(&self, datagram: &mut Vec<u8>) {
        packet::set_length(datagram);
        let tag = self.of(datagram);
        packet::finish(datagram, &tag);
    }

    /// Returns the body if the tag is right.
    ///
    /// # Errors
    /// [`Refused::Forged`].
    pub fn open<'a>(&self, datagram: &'a [u8]) -> Result<&'a [u8], Refused> {
        let (covered, tag) = datagram.split_at(datagram.len() - TAG_BYTES);
        // comparing two hashes takes constant time
        let (mut have, mut want) = ([0; 32], [0; 32]);
        have[..TAG_BYTES].copy_from_slice(tag);
        want[..TAG_BYTES].copy_from_slice(&self.of(covered));
        if blake3::Hash::from(have) == blake3::Hash::from(want) {
            Ok(&covered[HEADER_BYTES..])
        } else {
            Err(Refused::Forged)
        }
    }

    fn of(&self, covered: &[u8]) -> [u8; TAG_BYTES] {
        let mut hasher = blake3::Hasher::new_keyed(&self.0);
        hasher.update(&packet::associated(covered));
        hasher.update(&covered[HEADER_BYTES..]);
        let mut tag = [0; TAG_BYTES];
        tag.copy_from_slice(&hasher.finalize().as_bytes()[..TAG_BYTES]);
        tag
    }
}

/// Side of a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The server.
    Server,
    /// A facet.
    Facet,
}

/// Parameters of a session that both sides know.
#[derive(Clone, Copy)]
pub struct Agreement {
    /// Number of the session, drawn by the server.
    pub session: u32,
    /// Number of the facet.
    pub facet: FacetNumber,
    /// Drawn by the facet.
    pub facet_nonce: [u8; 32],
    /// Drawn by the server.
    pub server_nonce: [u8; 32],
}

/// Encrypts sent packets and decrypts received ones.
pub struct Seal {
    session: u32,
    outgoing: ChaCha20Poly1305,
    incoming: ChaCha20Poly1305,
    next: u64,
}

impl Seal {
    /// Derives the keys of `side`. `first` is the first sequence number, 0 except in tests of the
    /// wrap.
    pub fn new(shared: &SharedKey, agreed: &Agreement, side: Side, first: u64) -> Seal {
        let material = [
            &shared.bytes[..],
            &agreed.facet_nonce,
            &agreed.server_nonce,
            &agreed.session.to_le_bytes(),
            &agreed.facet.to_le_bytes(),
        ]
        .concat();
        let cipher = |context| ChaCha20Poly1305::new(&blake3::derive_key(context, &material).into());
        let (outgoing, incoming) = match side {
            Side::Server => (cipher(TO_FACET), cipher(TO_SERVER)),
            Side::Facet => (cipher(TO_SERVER), cipher(TO_FACET)),
        };
        Seal { session: agreed.session, outgoing, incoming, next: first }
    }

    /// Returns the sequence number of the next packet; `None` when all are used up, because a
    /// number is never used twice under one key.
    pub fn next_sequence(&self) -> Option<u64> {
        (self.next < u64::MAX).then_some(self.next)
    }

    /// Writes the next packet with this body. Returns `false` and writes nothing if the sequence
    /// numbers are used up or the body is too long.
    pub fn close(&mut self, body: &[u8], datagram: &mut Vec<u8>) -> bool {
        let Some(sequence) = self.next_sequence().filter(|_| HEADER_BYTES + body.len() + TAG_BYTES <= MAX_DATAGRAM)
        else {
            return false;
        };
        packet::begin(datagram, PacketHeader { kind: packet::PacketKind::Data, session: self.session, sequence });
        datagram.extend_from_slice(body);
        packet::set_length(datagram);
        let covered = packet::associated(datagram);
        let Ok(tag) =
            self.outgoing.encrypt_inout_detached(&nonce(sequence), &covered, (&mut datagram[HEADER_BYTES..]).into())
        else {
            return false; // only for bodies of gigabytes
        };
        packet::finish(datagram, &tag.into());
        self.next += 1;
        true
    }

    /// Decrypts the body of a packet with its full sequence number into `body`.
    ///
    /// # Errors
    /// [`Refused::Forged`].
    pub fn open(&self, header: &PacketHeader, datagram: &[u8], body: &mut Vec<u8>) -> Result<(), Refused> {
        let (covered, tag) = datagram.split_at(datagram.len() - TAG_BYTES);
        body.clear();
        body.extend_from_slice(&covered[HEADER_BYTES..]);
        let tag = Tag::try_from(tag).map_err(|_| Refused::Forged)?;
        self.incoming
            .decrypt_inout_detached(
                &nonce(header.sequence),
                &packet::associated(datagram),
                body.as_mut_slice().into(),
                &tag,
            )
            .map_err(|_| Refused::Forged)
    }
}

/// Returns 32 zero bits followed by the sequence number.
fn nonce(sequence: u64) -> Nonce {
    let mut nonce = [0; 12];
    nonce[4..].copy_from_slice(&sequence.to_le_bytes());
    nonce.into()
}
