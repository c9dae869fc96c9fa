//! Socket of a tracker, read by its own thread. So a flood of datagrams does not slow the
//! simulation, and the newest input is there when a frame begins.

use super::budget::{SenderBudgets, WINDOW};
use super::osc::{Counts, Dropped, MAX_DATAGRAM_BYTES, OscDecoder, TrackedInput};
use super::sealed;
use crate::failure::Failure;
use std::io::ErrorKind;
use std::net::{IpAddr, SocketAddr, UdpSocket};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tumble::net::sync::udp::SharedKey;
use tumble::scene::cave::{Cave, DeviceMap, Tracker};

/// Maximum number of datagrams of all senders that are read in each [`WINDOW`]; the rest waits in
/// the system's buffer or is dropped there. It bounds the time that a flood costs, and is far above
/// what strangers can send without harm to a tracker.
const MAX_READ_PER_WINDOW: u32 = 20_000;
/// Interval at which the thread checks whether to end.
pub(super) const POLL_INTERVAL: Duration = Duration::from_millis(50);

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
pub fn configured(
    cave: &Cave,
    address: Option<SocketAddr>,
    senders: &[IpAddr],
    dtrack_map: &[DeviceMap],
) -> Result<Option<Tracker>, Failure> {
    let configured = cave.tracker.clone();
    if configured.is_none() && address.is_none() {
        let stray = [("--tracker-from", senders.is_empty()), ("--dtrack-map", dtrack_map.is_empty())];
        return match stray.into_iter().find(|(_, is_empty)| !is_empty) {
            None => Ok(None),
            Some((option, _)) => {
                Err(Failure::input(format!("{option}: there is no tracker; give its address with --tracker")))
            }
        };
    }
    let mut tracker = configured.unwrap_or_else(|| Tracker::of(&cave.users));
    if let Some(address) = address {
        (tracker.address, tracker.port) = (address.ip(), address.port());
    }
    if !senders.is_empty() {
        tracker.senders = senders.to_vec();
    }
    if !dtrack_map.is_empty() {
        let stray = dtrack_map.iter().find_map(|map| map.check_dtrack(&tracker.users).err());
        stray.map_or(Ok(()), |expected| Err(Failure::input(format!("--dtrack-map: expected {expected}"))))?;
        tracker.dtrack_map = dtrack_map.to_vec();
    }
    if tracker.sealed {
        return Ok(Some(tracker));
    }
    if !tracker.address.is_loopback() && tracker.senders.is_empty() {
        let why = "its datagrams are not authenticated, so name the senders: --tracker-from IP, or senders = [\"IP\"] in [tracker] of the cave file";
        return Err(Failure::input(format!("--tracker {}: reachable from other machines; {why}", tracker.socket())));
    }
    Ok(Some(tracker))
}

impl TrackerSocket {
    /// Opens the socket and starts the thread. `key` is that of the cave, for sealed datagrams.
    pub fn open(tracker: &Tracker, key: Option<&SharedKey>) -> Result<TrackerSocket, Failure> {
        let title = format!("the tracker's address {}", tracker.socket());
        let failed = |e: std::io::Error| Failure::run(&title, e);
        let (decoder, end) = (Arc::new(Mutex::new(OscDecoder::new(tracker))), Arc::new(AtomicBool::new(false)));
        let (theirs, ended) = (decoder.clone(), end.clone());
        let builder = std::thread::Builder::new().name("tracker".into());
        let (thread, at) = if tracker.sealed {
            let key = key.ok_or_else(|| Failure::input("[tracker] is sealed and the cave has no key file"))?;
            let link = sealed::bind(tracker.socket(), key).map_err(|e| Failure::run(&title, e))?;
            let at = link.address().map_err(|e| Failure::run(&title, e))?;
            (builder.spawn(move || sealed::listen(link, &theirs, &ended)), at)
        } else {
            let socket = UdpSocket::bind(tracker.socket()).map_err(failed)?;
            socket.set_read_timeout(Some(POLL_INTERVAL)).map_err(failed)?;
            let at = socket.local_addr().map_err(failed)?;
            (builder.spawn(move || listen(&socket, &theirs, &ended)), at)
        };
        Ok(TrackerSocket { decoder, end, thread: Some(thread.map_err(failed)?), at })
    }

    /// Returns a line for the user: address, senders, users.
    pub fn describe(&self, tracker: &Tracker) -> String {
        let senders = match &tracker.senders[..] {
            _ if tracker.sealed => "relays with the key file".to_owned(),
            [] => "this machine".to_owned(),
            senders => senders.iter().map(ToString::to_string).collect::<Vec<_>>().join(", "),
        };
        let what = if tracker.dtrack_map.is_empty() { "OSC" } else { "DTrack" };
        format!("tracker: {what} at {}, from {senders}; users {}", self.at, tracker.users.join(", "))
    }

    /// Returns the users' input that changed since the last call.
    pub fn inputs(&self) -> Vec<TrackedInput> {
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

/// Locks the decoder.
pub(super) fn lock(decoder: &Mutex<OscDecoder>) -> MutexGuard<'_, OscDecoder> {
    decoder.lock().unwrap_or_else(PoisonError::into_inner)
}

fn listen(socket: &UdpSocket, decoder: &Mutex<OscDecoder>, end: &AtomicBool) {
    // one byte more than allowed, to recognize a longer datagram
    let mut bytes = [0; MAX_DATAGRAM_BYTES + 1];
    let (start, mut budgets) = (Instant::now(), SenderBudgets::default());
    let (mut since, mut count) = (Duration::ZERO, 0);
    while !end.load(Ordering::Relaxed) {
        let now = start.elapsed();
        if now >= since + WINDOW {
            (since, count) = (now, 0);
        }
        if count >= MAX_READ_PER_WINDOW {
            std::thread::sleep(WINDOW.saturating_sub(now - since));
            continue;
        }
        match socket.recv_from(&mut bytes) {
            Ok((length, from)) => {
                count += 1;
                take(&mut lock(decoder), &mut budgets, start, Instant::now(), from, &bytes[..length]);
            }
            Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
            // such as a refused answer; this socket sends none, so any error may pass
            Err(_) => std::thread::sleep(POLL_INTERVAL),
        }
    }
}

/// Takes a datagram that was received at a time: first its sender, then the sender's budget since `start`, then its
/// content.
pub(super) fn take(
    decoder: &mut OscDecoder,
    budgets: &mut SenderBudgets,
    start: Instant,
    at: Instant,
    from: SocketAddr,
    bytes: &[u8],
) {
    let now = at.saturating_duration_since(start);
    if !decoder.knows(from.ip()) {
        return decoder.skip(Dropped::UnknownSender);
    }
    if !budgets.admit(now, from) {
        return decoder.skip(Dropped::TooMany);
    }
    let before = decoder.counts.taken;
    decoder.take(at, from.ip(), bytes);
    if decoder.counts.taken != before {
        budgets.applied(now, from);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A head pose by the bytes of the specification.
    fn pose() -> Vec<u8> {
        let padded = |text: &str| [text.as_bytes(), &vec![0; 4 - text.len() % 4]].concat();
        let numbers = [0.0f32, 0.0, 1.5, 0.0, 0.0, 0.0, 1.0];
        let numbers = numbers.iter().flat_map(|x| x.to_be_bytes()).collect();
        [padded("/tumble/user/u/head"), padded(",fffffff"), numbers].concat()
    }

    /// 60 poses a second for 8 s, with 20,000 datagrams a second of garbage between them: from an
    /// address that is not among the senders, and from another process of this machine.
    #[test]
    fn garbage_of_others_takes_no_pose() {
        let tracker = |senders| Tracker { senders, users: vec!["u".into()], ..Tracker::of(&[]) };
        let cases: [(Vec<IpAddr>, SocketAddr, SocketAddr, &str); 2] = [
            (vec![[10, 0, 0, 7].into()], ([10, 0, 0, 7], 9000).into(), ([10, 0, 0, 8], 9000).into(), "unknown_sender"),
            (vec![], ([127, 0, 0, 1], 9000).into(), ([127, 0, 0, 1], 9001).into(), "too_many"),
        ];
        for (senders, genuine, stranger, why) in cases {
            let (mut decoder, mut budgets) = (OscDecoder::new(&tracker(senders)), SenderBudgets::default());
            let (pose, start) = (pose(), Instant::now());
            for k in 0..160_000u64 {
                let at = start + Duration::from_micros(50 * k);
                take(&mut decoder, &mut budgets, start, at, stranger, b"garbage");
                if k % 333 == 0 {
                    take(&mut decoder, &mut budgets, start, at, genuine, &pose);
                }
            }
            assert_eq!(decoder.counts.taken, 481, "{:?}", decoder.counts);
            assert!(decoder.counts.dropped[why] > 100_000, "{:?}", decoder.counts);
        }
    }
}
