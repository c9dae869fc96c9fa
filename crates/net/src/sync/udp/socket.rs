//! A socket and two threads around each state machine. No other file of this module uses sockets or
//! the clock.
//!
//! One thread receives, the other waits for the next due work. Both threads and the owner of the
//! link use the machine under one lock, and each sends due datagrams before it releases the lock. A
//! datagram that the system refuses to send counts as lost.

use super::facet::FacetSettings;
use super::keys::{Entropy, SharedKey};
use super::server::ServerSettings;
use super::{FacetMachine, Numbering, ServerMachine, Timing};
use crate::sync::transport::{
    Delivery, FacetLink, FacetNumber, LinkCounters, LinkError, LinkEvent, Message, ServerLink,
};
use std::net::{SocketAddr, UdpSocket};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Interval at which the receiving thread checks whether to stop.
const POLL_INTERVAL: Duration = Duration::from_millis(50);
/// Longer than any valid datagram, so that a longer one is recognized.
const BUFFER: usize = 2048;

/// Common interface of the two state machines.
trait Machine: Send + 'static {
    type Event;
    fn receive(&mut self, now: Duration, from: SocketAddr, datagram: &[u8]);
    fn transmit(&mut self, now: Duration, emit: &mut dyn FnMut(SocketAddr, &[u8]));
    fn wake(&self) -> Option<Duration>;
    fn poll(&mut self) -> Option<Self::Event>;
    fn close_all(&mut self, now: Duration, emit: &mut dyn FnMut(SocketAddr, &[u8]));
}

struct State<M> {
    machine: M,
    /// Time until which the waiting thread sleeps.
    asleep_until: Duration,
    stop: bool,
    failed: Option<std::io::Error>,
}

struct Shared<M> {
    state: Mutex<State<M>>,
    /// Signals that an event may be there.
    arrived: Condvar,
    /// Signals work that is due before the waiting thread would wake up.
    earlier: Condvar,
    socket: UdpSocket,
    start: Instant,
}

impl<M: Machine> Shared<M> {
    fn now(&self) -> Duration {
        self.start.elapsed()
    }

    fn lock(&self) -> MutexGuard<'_, State<M>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sends due datagrams, and wakes the waiting thread if it would sleep too long.
    fn transmit_due(&self, state: &mut State<M>) {
        state.machine.transmit(self.now(), &mut |to, datagram| self.emit(to, datagram));
        if state.machine.wake().is_some_and(|wake| wake < state.asleep_until) {
            self.earlier.notify_one();
        }
    }

    fn emit(&self, to: SocketAddr, datagram: &[u8]) {
        let _ = self.socket.send_to(datagram, to);
    }

    fn receive_until_stopped(&self) {
        let mut buffer = [0; BUFFER];
        loop {
            let result = self.socket.recv_from(&mut buffer);
            let mut state = self.lock();
            if state.stop {
                return;
            }
            match result {
                Ok((length, from)) => {
                    state.machine.receive(self.now(), from, &buffer[..length]);
                    self.transmit_due(&mut state);
                    self.arrived.notify_one();
                }
                Err(error) if is_transient(&error) => {}
                Err(error) => {
                    state.failed = Some(error);
                    self.arrived.notify_one();
                    return;
                }
            }
        }
    }

    fn wait_until_stopped(&self) {
        let mut state = self.lock();
        while !state.stop {
            let now = self.now();
            let wake = state.machine.wake().unwrap_or(now + POLL_INTERVAL).min(now + POLL_INTERVAL);
            if wake <= now {
                self.transmit_due(&mut state);
                self.arrived.notify_one();
            }
            // a minimum, so that an error in a machine cannot make this thread spin
            let wake = state
                .machine
                .wake()
                .unwrap_or(now + POLL_INTERVAL)
                .clamp(now + Duration::from_micros(50), now + POLL_INTERVAL);
            state.asleep_until = wake;
            state = self.earlier.wait_timeout(state, wake - now).unwrap_or_else(PoisonError::into_inner).0;
            state.asleep_until = Duration::ZERO;
        }
    }

    fn next_event(&self, timeout: Duration) -> Result<Option<M::Event>, LinkError> {
        let end = Instant::now() + timeout;
        let mut state = self.lock();
        loop {
            if let Some(event) = state.machine.poll() {
                return Ok(Some(event));
            }
            if let Some(why) = state.failed.take() {
                return Err(LinkError::Io { what: format!("udp socket {}: cannot receive", name(&self.socket)), why });
            }
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(None);
            }
            state = self.arrived.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

/// Returns whether an error of the system concerns a single call only.
fn is_transient(error: &std::io::Error) -> bool {
    use std::io::ErrorKind::*;
    matches!(
        error.kind(),
        WouldBlock
            | TimedOut
            | Interrupted
            | ConnectionRefused
            | ConnectionReset
            | HostUnreachable
            | NetworkUnreachable
    )
}

fn name(socket: &UdpSocket) -> String {
    socket.local_addr().map_or_else(|_| "?".into(), |address| address.to_string())
}

/// A machine with its threads, which end when this is dropped.
struct Running<M: Machine> {
    shared: Arc<Shared<M>>,
    threads: Vec<JoinHandle<()>>,
}

impl<M: Machine> Running<M> {
    fn start(socket: UdpSocket, machine: M) -> Result<Running<M>, LinkError> {
        let what = || format!("udp socket {}", name(&socket));
        socket.set_read_timeout(Some(POLL_INTERVAL)).map_err(|why| LinkError::Io { what: what(), why })?;
        let state = State { machine, asleep_until: Duration::ZERO, stop: false, failed: None };
        let shared = Arc::new(Shared {
            state: Mutex::new(state),
            arrived: Condvar::new(),
            earlier: Condvar::new(),
            socket,
            start: Instant::now(),
        });
        let mut running = Running { shared, threads: Vec::new() };
        running.spawn("udp receive", Shared::receive_until_stopped)?;
        running.spawn("udp wait", Shared::wait_until_stopped)?;
        Ok(running)
    }

    fn spawn(&mut self, name: &str, work: fn(&Shared<M>)) -> Result<(), LinkError> {
        let shared = self.shared.clone();
        let thread = std::thread::Builder::new().name(name.into()).spawn(move || work(&shared));
        self.threads.push(thread.map_err(|why| LinkError::Io { what: format!("thread {name}"), why })?);
        Ok(())
    }
}

impl<M: Machine> Drop for Running<M> {
    fn drop(&mut self) {
        let mut state = self.shared.lock();
        state.machine.close_all(self.shared.now(), &mut |to, datagram| self.shared.emit(to, datagram));
        state.stop = true;
        drop(state);
        self.shared.earlier.notify_all();
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
    }
}

/// Refuses an address other than loopback without a key.
fn check_address(address: SocketAddr, key: &Option<SharedKey>, what: &str) -> Result<(), LinkError> {
    if key.is_some() || address.ip().is_loopback() {
        return Ok(());
    }
    Err(LinkError::Other(format!(
        "{what} {address}: without a key only this machine's own addresses (127.0.0.1, ::1) are used; give a key file, the same on every machine"
    )))
}

fn bind(address: SocketAddr) -> Result<UdpSocket, LinkError> {
    UdpSocket::bind(address).map_err(|why| LinkError::Io { what: format!("cannot bind udp {address}"), why })
}

/// Describes an address for the user, and whether its packets are encrypted.
fn describe(socket: &UdpSocket, sealed: bool) -> String {
    let state = if sealed { "sealed" } else { "no key: serves this machine only, without authentication" };
    format!("udp {}, {state}", name(socket))
}

/// The server's endpoint over UDP.
pub struct UdpServer {
    running: Running<ServerMachine>,
    sealed: bool,
}

impl UdpServer {
    /// Binds `address` for facets with numbers below `facets`. Without a key only a loopback
    /// address is bound.
    ///
    /// # Errors
    /// The address is not loopback and there is no key; the system refuses.
    pub fn bind(
        address: SocketAddr,
        facets: FacetNumber,
        key: Option<SharedKey>,
        timing: Timing,
    ) -> Result<UdpServer, LinkError> {
        check_address(address, &key, "udp")?;
        let sealed = key.is_some();
        let settings = ServerSettings { facets, timing, numbering: Numbering::default() };
        let machine = ServerMachine::new(settings, key.unwrap_or_else(SharedKey::none), Entropy::system()?);
        Ok(UdpServer { running: Running::start(bind(address)?, machine)?, sealed })
    }

    /// Returns the bound address, with its port if port 0 was requested.
    ///
    /// # Errors
    /// The system refuses.
    pub fn address(&self) -> Result<SocketAddr, LinkError> {
        self.running.shared.socket.local_addr().map_err(|why| LinkError::Io { what: "udp socket".into(), why })
    }

    /// Returns a line for the user: the address, and whether packets are encrypted.
    pub fn describe(&self) -> String {
        describe(&self.running.shared.socket, self.sealed)
    }
}

impl ServerLink for UdpServer {
    fn send(&mut self, to: FacetNumber, delivery: Delivery, message: &[u8]) -> Result<bool, LinkError> {
        Ok(self.send_all(&[to], delivery, message)? == 1)
    }

    fn send_all(&mut self, to: &[FacetNumber], delivery: Delivery, message: &[u8]) -> Result<usize, LinkError> {
        let message: Arc<[u8]> = message.into();
        let mut state = self.running.shared.lock();
        let sent = to.iter().filter(|facet| state.machine.send(**facet, delivery, &message)).count();
        self.running.shared.transmit_due(&mut state);
        Ok(sent)
    }

    fn recv(
        &mut self,
        timeout: Duration,
        message: &mut Vec<u8>,
    ) -> Result<Option<(FacetNumber, LinkEvent)>, LinkError> {
        message.clear();
        Ok(self.running.shared.next_event(timeout)?.map(|(facet, event, bytes)| {
            *message = bytes;
            (facet, event)
        }))
    }

    fn close(&mut self, facet: FacetNumber) {
        let shared = &self.running.shared;
        shared.lock().machine.close(shared.now(), facet, &mut |to, datagram| shared.emit(to, datagram));
    }

    fn counters(&self, facet: FacetNumber) -> LinkCounters {
        self.running.shared.lock().machine.counters(facet)
    }

    fn unknown_peers(&self) -> LinkCounters {
        self.running.shared.lock().machine.unknown_peers()
    }
}

/// A facet's endpoint over UDP.
pub struct UdpFacet {
    running: Running<FacetMachine>,
    sealed: bool,
}

impl UdpFacet {
    /// Starts to connect to the server. Without a key only a loopback address is used.
    ///
    /// # Errors
    /// The address is not loopback and there is no key; the system refuses.
    pub fn connect(
        server: SocketAddr,
        facet: FacetNumber,
        key: Option<SharedKey>,
        timing: Timing,
    ) -> Result<UdpFacet, LinkError> {
        check_address(server, &key, "udp server")?;
        let local: SocketAddr = match (server, server.ip().is_loopback()) {
            (SocketAddr::V4(_), true) => ([127, 0, 0, 1], 0).into(),
            (SocketAddr::V4(_), false) => ([0, 0, 0, 0], 0).into(),
            (SocketAddr::V6(_), true) => (std::net::Ipv6Addr::LOCALHOST, 0).into(),
            (SocketAddr::V6(_), false) => (std::net::Ipv6Addr::UNSPECIFIED, 0).into(),
        };
        let sealed = key.is_some();
        let settings = FacetSettings { facet, server, timing, numbering: Numbering::default() };
        let machine =
            FacetMachine::new(Duration::ZERO, settings, key.unwrap_or_else(SharedKey::none), Entropy::system()?);
        Ok(UdpFacet { running: Running::start(bind(local)?, machine)?, sealed })
    }

    /// Returns a line for the user: the address, and whether packets are encrypted.
    pub fn describe(&self) -> String {
        describe(&self.running.shared.socket, self.sealed)
    }
}

impl FacetLink for UdpFacet {
    fn send(&mut self, delivery: Delivery, message: &[u8]) -> Result<bool, LinkError> {
        let shared = &self.running.shared;
        let mut state = shared.lock();
        let sent = state.machine.send(shared.now(), delivery, message);
        shared.transmit_due(&mut state);
        Ok(sent)
    }

    fn recv(&mut self, timeout: Duration, message: &mut Message) -> Result<Option<LinkEvent>, LinkError> {
        message.clear();
        Ok(self.running.shared.next_event(timeout)?.map(|(event, bytes)| {
            *message = bytes.into();
            event
        }))
    }

    fn close(&mut self) {
        let shared = &self.running.shared;
        shared.lock().machine.close(shared.now(), &mut |to, datagram| shared.emit(to, datagram));
    }

    fn counters(&self) -> LinkCounters {
        self.running.shared.lock().machine.counters()
    }
}

impl Machine for ServerMachine {
    type Event = (FacetNumber, LinkEvent, Vec<u8>);
    fn receive(&mut self, now: Duration, from: SocketAddr, datagram: &[u8]) {
        self.receive(now, from, datagram);
    }
    fn transmit(&mut self, now: Duration, emit: &mut dyn FnMut(SocketAddr, &[u8])) {
        self.transmit(now, emit);
    }
    fn wake(&self) -> Option<Duration> {
        self.wake()
    }
    fn poll(&mut self) -> Option<Self::Event> {
        self.poll()
    }
    fn close_all(&mut self, now: Duration, emit: &mut dyn FnMut(SocketAddr, &[u8])) {
        for facet in 0..crate::sync::transport::MAX_FACETS as FacetNumber {
            self.close(now, facet, emit);
        }
    }
}

impl Machine for FacetMachine {
    type Event = (LinkEvent, Vec<u8>);
    fn receive(&mut self, now: Duration, from: SocketAddr, datagram: &[u8]) {
        self.receive(now, from, datagram);
    }
    fn transmit(&mut self, now: Duration, emit: &mut dyn FnMut(SocketAddr, &[u8])) {
        self.transmit(now, emit);
    }
    fn wake(&self) -> Option<Duration> {
        Some(self.wake())
    }
    fn poll(&mut self) -> Option<Self::Event> {
        self.poll()
    }
    fn close_all(&mut self, now: Duration, emit: &mut dyn FnMut(SocketAddr, &[u8])) {
        self.close(now, emit);
    }
}
