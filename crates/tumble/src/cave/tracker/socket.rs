//! Socket of a tracker, read by its own thread. So a flood of datagrams does not slow the
//! simulation, and the newest input is there when a frame begins.

use super::osc::{Counts, MAX_DATAGRAM_BYTES, OscDecoder};
use crate::failure::Failure;
use std::io::ErrorKind;
use std::net::{IpAddr, SocketAddr, UdpSocket};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tumble::net::sync::Input;
use tumble::scene::cave::{Cave, Tracker};

/// Maximum number of datagrams decoded in each [`RATE_WINDOW`]. Up to four times as many more are
/// counted and dropped; the rest waits in the system's buffer or is dropped there.
const MAX_PER_WINDOW: u32 = 500;
const RATE_WINDOW: Duration = Duration::from_millis(100);
/// Interval at which the thread checks whether to end.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// A tracker's socket and its thread.
pub struct TrackerSocket {
    decoder: Arc<Mutex<OscDecoder>>,
    end: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
    at: SocketAddr,
}

/// Returns the tracker of the cave file with the address and senders of the command line, if there
/// are any. Returns `None` if neither defines a tracker.
///
/// # Errors
/// The address is reachable from other machines and there are no senders.
pub fn configured(cave: &Cave, address: Option<SocketAddr>, senders: &[IpAddr]) -> Result<Option<Tracker>, Failure> {
    let configured = cave.tracker.clone();
    if configured.is_none() && address.is_none() {
        return if senders.is_empty() {
            Ok(None)
        } else {
            Err(Failure::input("--tracker-from: there is no tracker; give its address with --tracker"))
        };
    }
    let mut tracker = configured.unwrap_or_else(|| Tracker::of(&cave.users));
    if let Some(address) = address {
        (tracker.address, tracker.port) = (address.ip(), address.port());
    }
    if !senders.is_empty() {
        tracker.senders = senders.to_vec();
    }
    if !tracker.address.is_loopback() && tracker.senders.is_empty() {
        let why = "its datagrams are not authenticated, so name the senders: --tracker-from IP, or senders = [\"IP\"] in [tracker] of the cave file";
        return Err(Failure::input(format!("--tracker {}: reachable from other machines; {why}", tracker.socket())));
    }
    Ok(Some(tracker))
}

impl TrackerSocket {
    /// Opens the socket and starts the thread.
    pub fn open(tracker: &Tracker) -> Result<TrackerSocket, Failure> {
        let failed = |e: std::io::Error| Failure::run(&format!("the tracker's address {}", tracker.socket()), e);
        let socket = UdpSocket::bind(tracker.socket()).map_err(failed)?;
        socket.set_read_timeout(Some(POLL_INTERVAL)).map_err(failed)?;
        let at = socket.local_addr().map_err(failed)?;
        let (decoder, end) = (Arc::new(Mutex::new(OscDecoder::new(tracker))), Arc::new(AtomicBool::new(false)));
        let (theirs, ended) = (decoder.clone(), end.clone());
        let thread = std::thread::Builder::new()
            .name("tracker".into())
            .spawn(move || listen(&socket, &theirs, &ended))
            .map_err(failed)?;
        Ok(TrackerSocket { decoder, end, thread: Some(thread), at })
    }

    /// Returns a line for the user: address, senders, users.
    pub fn describe(&self, tracker: &Tracker) -> String {
        let senders = match &tracker.senders[..] {
            [] => "this machine".to_owned(),
            senders => senders.iter().map(ToString::to_string).collect::<Vec<_>>().join(", "),
        };
        format!("tracker: OSC at {}, from {senders}; users {}", self.at, tracker.users.join(", "))
    }

    /// Returns the users' input that changed since the last call.
    pub fn inputs(&self) -> Vec<Input> {
        lock(&self.decoder).inputs()
    }

    /// Returns the counts.
    pub fn counts(&self) -> Counts {
        lock(&self.decoder).counts.clone()
    }
}

impl Drop for TrackerSocket {
    fn drop(&mut self) {
        self.end.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn lock(decoder: &Mutex<OscDecoder>) -> MutexGuard<'_, OscDecoder> {
    decoder.lock().unwrap_or_else(PoisonError::into_inner)
}

fn listen(socket: &UdpSocket, decoder: &Mutex<OscDecoder>, end: &AtomicBool) {
    // one byte more than allowed, to recognize a longer datagram
    let mut bytes = [0; MAX_DATAGRAM_BYTES + 1];
    let (mut since, mut count) = (Instant::now(), 0);
    while !end.load(Ordering::Relaxed) {
        if since.elapsed() > RATE_WINDOW {
            (since, count) = (Instant::now(), 0);
        }
        if count >= 5 * MAX_PER_WINDOW {
            std::thread::sleep(RATE_WINDOW.saturating_sub(since.elapsed()));
            continue;
        }
        match socket.recv_from(&mut bytes) {
            Ok((length, from)) => {
                count += 1;
                let mut decoder = lock(decoder);
                if count <= MAX_PER_WINDOW { decoder.take(from.ip(), &bytes[..length]) } else { decoder.skip() }
            }
            Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
            // such as a refused answer; this socket sends none, so any error may pass
            Err(_) => std::thread::sleep(POLL_INTERVAL),
        }
    }
}
