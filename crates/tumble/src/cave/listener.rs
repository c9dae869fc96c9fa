//! A socket that accepts connections, each in a thread of its own, until it is dropped.

use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

/// Pause after a connection that could not be accepted.
const FAILED_PAUSE: Duration = Duration::from_millis(50);

/// A thread that accepts connections until this value is dropped.
pub struct Listener {
    address: SocketAddr,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

struct Shared {
    name: &'static str,
    max_connections: usize,
    connections: AtomicUsize,
    over: AtomicBool,
}

impl Listener {
    /// Listens. Connections beyond the maximum number are closed at once.
    ///
    /// # Errors
    /// The address cannot be used.
    pub fn start(
        at: SocketAddr,
        name: &'static str,
        max_connections: usize,
        serve: impl Fn(TcpStream) + Send + Sync + 'static,
    ) -> std::io::Result<Listener> {
        let socket = TcpListener::bind(at)?;
        let address = socket.local_addr()?;
        let (connections, over) = (AtomicUsize::new(0), AtomicBool::new(false));
        let shared = Arc::new(Shared { name, max_connections, connections, over });
        let (ours, serve) = (shared.clone(), Arc::new(serve));
        let thread = std::thread::Builder::new().name(name.into()).spawn(move || ours.accept(&socket, &serve))?;
        Ok(Listener { address, shared, thread: Some(thread) })
    }

    /// Returns the address.
    pub fn address(&self) -> SocketAddr {
        self.address
    }
}

impl Drop for Listener {
    fn drop(&mut self) {
        self.shared.over.store(true, Ordering::Relaxed);
        let mut here = self.address;
        if here.ip().is_unspecified() {
            here.set_ip(if here.is_ipv4() { [127, 0, 0, 1].into() } else { std::net::Ipv6Addr::LOCALHOST.into() });
        }
        // wakes the thread; without that it ends with the process
        if TcpStream::connect_timeout(&here, Duration::from_millis(200)).is_ok()
            && let Some(thread) = self.thread.take()
        {
            let _ = thread.join();
        }
    }
}

impl Shared {
    fn accept<F: Fn(TcpStream) + Send + Sync + 'static>(self: &Arc<Self>, socket: &TcpListener, serve: &Arc<F>) {
        while !self.over.load(Ordering::Relaxed) {
            let Ok((stream, _)) = socket.accept() else {
                // a client that has gone, or no free descriptor: both pass
                std::thread::sleep(FAILED_PAUSE);
                continue;
            };
            if self.connections.fetch_add(1, Ordering::Relaxed) >= self.max_connections {
                self.connections.fetch_sub(1, Ordering::Relaxed);
                continue;
            }
            let (shared, serve) = (self.clone(), serve.clone());
            let serve = move || {
                serve(stream);
                shared.connections.fetch_sub(1, Ordering::Relaxed);
            };
            if std::thread::Builder::new().name(format!("{} client", self.name)).spawn(serve).is_err() {
                self.connections.fetch_sub(1, Ordering::Relaxed);
            }
        }
    }
}
