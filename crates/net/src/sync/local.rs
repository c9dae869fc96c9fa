//! Transport within one process: queues behind a lock. It loses nothing, so it is the reference for
//! the other transports.

use super::transport::{
    Closed, Delivery, FacetLink, FacetNumber, LinkCounters, LinkError, LinkEvent, MAX_FACETS, MAX_MESSAGE_BYTES,
    MAX_QUEUED_BYTES, Message, ServerLink,
};
use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

struct Item {
    facet: FacetNumber,
    event: LinkEvent,
    delivery: Delivery,
    bytes: Vec<u8>,
}

/// Messages of one direction to one receiver.
#[derive(Default)]
struct Queue {
    items: VecDeque<Item>,
    counters: Vec<LinkCounters>,
}

#[derive(Default)]
struct Queues {
    /// How many endpoints were made for the server and for each facet. An endpoint of an earlier
    /// generation sends and receives nothing.
    server: u64,
    facets: Vec<u64>,
    open: Vec<bool>,
    up: Queue,
    down: Vec<Queue>,
}

#[derive(Default)]
struct Shared {
    queues: Mutex<Queues>,
    wakeup: Condvar,
}

/// Makes the endpoints of links within a process. Dropping an endpoint closes its connections, and
/// a new endpoint opens new ones.
#[derive(Clone)]
pub struct LocalTransport(Arc<Shared>);

/// The server's endpoint.
pub struct LocalServer {
    shared: Arc<Shared>,
    generation: u64,
}

/// A facet's endpoint.
pub struct LocalFacet {
    shared: Arc<Shared>,
    facet: FacetNumber,
    generation: u64,
}

impl LocalTransport {
    /// Creates the transport for `facets` facets, at most [`MAX_FACETS`].
    pub fn new(facets: usize) -> LocalTransport {
        let n = facets.min(MAX_FACETS);
        let counters = || vec![LinkCounters::default(); n];
        let queues = Queues {
            facets: vec![0; n],
            open: vec![false; n],
            up: Queue { items: VecDeque::new(), counters: counters() },
            down: (0..n).map(|_| Queue { items: VecDeque::new(), counters: counters() }).collect(),
            server: 0,
        };
        LocalTransport(Arc::new(Shared { queues: Mutex::new(queues), wakeup: Condvar::new() }))
    }

    /// Returns a server endpoint, which replaces the previous one.
    pub fn server(&self) -> LocalServer {
        let mut queues = lock(&self.0);
        (0..queues.open.len()).for_each(|k| queues.close(k, Closed::Replaced, Closed::ByPeer));
        queues.up.items.clear();
        queues.server += 1;
        (0..queues.open.len()).for_each(|k| queues.try_open(k));
        self.0.wakeup.notify_all();
        LocalServer { generation: queues.server, shared: self.0.clone() }
    }

    /// Returns a facet's endpoint, which replaces the previous one. Returns `None` if the transport
    /// has no such facet.
    pub fn facet(&self, facet: FacetNumber) -> Option<LocalFacet> {
        let (mut queues, k) = (lock(&self.0), facet as usize);
        let generation = *queues.facets.get(k)? + 1;
        queues.close(k, Closed::Replaced, Closed::ByPeer);
        queues.down[k].items.clear();
        queues.facets[k] = generation;
        queues.try_open(k);
        self.0.wakeup.notify_all();
        Some(LocalFacet { shared: self.0.clone(), facet, generation })
    }
}

fn lock(shared: &Shared) -> MutexGuard<'_, Queues> {
    shared.queues.lock().unwrap_or_else(PoisonError::into_inner) // queues are whole between any two statements
}

impl Queues {
    /// Opens a connection if both endpoints exist and no connection is open.
    fn try_open(&mut self, k: usize) {
        if !self.open[k] && self.server > 0 && self.facets[k] > 0 {
            self.open[k] = true;
            self.notify(k, LinkEvent::Opened, LinkEvent::Opened);
            self.up.counters[k].opened += 1;
            self.down[k].counters[k].opened += 1;
        }
    }

    /// Closes a connection and discards its messages in flight.
    fn close(&mut self, k: usize, to_server: Closed, to_facet: Closed) {
        if std::mem::take(&mut self.open[k]) {
            self.up.items.retain(|item| item.facet as usize != k || item.event != LinkEvent::Message);
            self.down[k].items.retain(|item| item.event != LinkEvent::Message);
            self.notify(k, LinkEvent::Closed(to_server), LinkEvent::Closed(to_facet));
        }
    }

    fn notify(&mut self, k: usize, server: LinkEvent, facet: LinkEvent) {
        let item = |event| Item { facet: k as FacetNumber, event, delivery: Delivery::Reliable, bytes: Vec::new() };
        self.up.items.push_back(item(server));
        self.down[k].items.push_back(item(facet));
    }

    /// Puts a message into a queue.
    fn post(&mut self, k: usize, up: bool, delivery: Delivery, bytes: &[u8]) -> bool {
        let (sender, queue) = if up {
            (&mut self.down[k].counters[k], &mut self.up)
        } else {
            (&mut self.up.counters[k], &mut self.down[k])
        };
        if !self.open[k] || bytes.is_empty() || bytes.len() > MAX_MESSAGE_BYTES {
            sender.unsent += 1;
            return false;
        }
        sender.messages_out += 1;
        sender.bytes_out += bytes.len() as u64;
        if delivery == Delivery::Newest {
            let before = queue.items.len();
            queue.items.retain(|item| item.facet as usize != k || item.delivery != Delivery::Newest);
            sender.superseded += (before - queue.items.len()) as u64;
        }
        let waiting: usize =
            queue.items.iter().filter(|item| item.facet as usize == k).map(|item| item.bytes.len()).sum();
        if waiting + bytes.len() > MAX_QUEUED_BYTES {
            let (server, facet) =
                if up { (Closed::ByPeer, Closed::Overrun) } else { (Closed::Overrun, Closed::ByPeer) };
            self.close(k, server, facet);
            self.try_open(k);
            return false;
        }
        queue.items.push_back(Item {
            facet: k as FacetNumber,
            event: LinkEvent::Message,
            delivery,
            bytes: bytes.to_vec(),
        });
        true
    }
}

/// Takes the next item, waiting at most `timeout`.
fn wait(shared: &Shared, timeout: Duration, mut next: impl FnMut(&mut Queues) -> Option<Item>) -> Option<Item> {
    let until = Instant::now().checked_add(timeout);
    let mut queues = lock(shared);
    loop {
        if let Some(item) = next(&mut queues) {
            return Some(item);
        }
        let left = until.map_or(Duration::from_secs(1), |until| until.saturating_duration_since(Instant::now()));
        if left.is_zero() {
            return None;
        }
        queues = shared.wakeup.wait_timeout(queues, left).unwrap_or_else(PoisonError::into_inner).0;
    }
}

fn received(counters: &mut LinkCounters, item: &Item) {
    counters.messages_in += u64::from(item.event == LinkEvent::Message);
    counters.bytes_in += item.bytes.len() as u64;
}

impl ServerLink for LocalServer {
    fn send(&mut self, to: FacetNumber, delivery: Delivery, message: &[u8]) -> Result<bool, LinkError> {
        let mut queues = lock(&self.shared);
        let sent = queues.server == self.generation
            && (to as usize) < queues.open.len()
            && queues.post(to as usize, false, delivery, message);
        self.shared.wakeup.notify_all();
        Ok(sent)
    }

    fn recv(
        &mut self,
        timeout: Duration,
        message: &mut Vec<u8>,
    ) -> Result<Option<(FacetNumber, LinkEvent)>, LinkError> {
        message.clear();
        let item = wait(&self.shared, timeout, |queues| {
            let item = if queues.server == self.generation { queues.up.items.pop_front()? } else { return None };
            received(&mut queues.up.counters[item.facet as usize], &item);
            Some(item)
        });
        Ok(item.map(|item| {
            *message = item.bytes;
            (item.facet, item.event)
        }))
    }

    fn close(&mut self, facet: FacetNumber) {
        let mut queues = lock(&self.shared);
        if queues.server == self.generation && (facet as usize) < queues.open.len() {
            queues.close(facet as usize, Closed::ByUs, Closed::ByPeer);
            queues.try_open(facet as usize);
            self.shared.wakeup.notify_all();
        }
    }

    fn counters(&self, facet: FacetNumber) -> LinkCounters {
        lock(&self.shared).up.counters.get(facet as usize).copied().unwrap_or_default()
    }
}

impl Drop for LocalServer {
    fn drop(&mut self) {
        let mut queues = lock(&self.shared);
        if queues.server == self.generation {
            (0..queues.open.len()).for_each(|k| queues.close(k, Closed::ByUs, Closed::ByPeer));
            queues.up.items.clear();
            queues.server = 0;
            self.shared.wakeup.notify_all();
        }
    }
}

impl FacetLink for LocalFacet {
    fn send(&mut self, delivery: Delivery, message: &[u8]) -> Result<bool, LinkError> {
        let (mut queues, k) = (lock(&self.shared), self.facet as usize);
        let sent = queues.facets[k] == self.generation && queues.post(k, true, delivery, message);
        self.shared.wakeup.notify_all();
        Ok(sent)
    }

    fn recv(&mut self, timeout: Duration, message: &mut Message) -> Result<Option<LinkEvent>, LinkError> {
        message.clear();
        let k = self.facet as usize;
        let item = wait(&self.shared, timeout, |queues| {
            let item =
                if queues.facets[k] == self.generation { queues.down[k].items.pop_front()? } else { return None };
            received(&mut queues.down[k].counters[k], &item);
            Some(item)
        });
        Ok(item.map(|item| {
            *message = item.bytes.into();
            item.event
        }))
    }

    fn close(&mut self) {
        let (mut queues, k) = (lock(&self.shared), self.facet as usize);
        if queues.facets[k] == self.generation {
            queues.close(k, Closed::ByPeer, Closed::ByUs);
            queues.try_open(k);
            self.shared.wakeup.notify_all();
        }
    }

    fn counters(&self) -> LinkCounters {
        lock(&self.shared).down[self.facet as usize].counters[self.facet as usize]
    }
}

impl Drop for LocalFacet {
    fn drop(&mut self) {
        let (mut queues, k) = (lock(&self.shared), self.facet as usize);
        if queues.facets[k] == self.generation {
            queues.close(k, Closed::ByPeer, Closed::ByUs);
            queues.down[k].items.clear();
            queues.facets[k] = 0;
            self.shared.wakeup.notify_all();
        }
    }
}
