//! The iceoryx2 ports of one process, its wakeup counters, and the location of their files.
//!
//! A run has two publish-subscribe services, `tumble/RUN/down` and `tumble/RUN/up`, and a
//! [`Wakeup`]. The files are in a folder of this user. Objects in `/dev/shm` carry the user id and
//! have mode 600, so runs of different users do not interfere. Leftovers of a killed process are
//! removed when the next node begins or a server ends; the last process removes the rest
//! ([`super::node_lock`]).

use super::node_lock::NodeLock;
use super::service::Private;
use super::wakeup::{self, Wakeup};
use super::wire::HeaderWords;
use crate::sync::transport::{FacetNumber, LinkError, Message};
use iceoryx2::node::{Node, NodeBuilder, NodeCreationFailure};
use iceoryx2::port::{publisher::Publisher, subscriber::Subscriber};
use iceoryx2::prelude::{
    AllocationStrategy, Config, FileName, LogLevel, Path, SemanticString, SignalHandlingMode, set_log_level,
};
use iceoryx2::sample::Sample;
use std::fmt::Debug;
use std::os::unix::fs::{DirBuilderExt, MetadataExt, PermissionsExt};
use std::path::PathBuf;
use std::sync::Arc;

/// Maximum size of a sample from the server, bytes. A longer message is sent in pieces.
pub const DOWN_BYTES: usize = 128 << 10;
/// Maximum size of a sample from a facet, bytes.
pub const UP_BYTES: usize = 16 << 10;
/// Timeout for the clean-up of one node that another process cleans up.
const CLEAN_UP_TIMEOUT: std::time::Duration = std::time::Duration::from_secs(2);
/// Number of further tries to give a node its number, and the time between them.
const ID_TRIES: u32 = 10;
const ID_PAUSE: std::time::Duration = std::time::Duration::from_millis(20);
/// Number of samples in the buffer of a slow reader.
const BUFFER_SAMPLES: usize = 8;

/// Number of samples that a reader may hold while it continues to read.
const MAX_BORROWED: usize = 6;

/// A received sample. It lies in shared memory and is not overwritten until it is dropped.
pub struct Received(Sample<Private, [u8], HeaderWords>);

impl Received {
    /// Returns the header.
    pub fn header(&self) -> HeaderWords {
        *self.0.user_header()
    }
}

impl AsRef<[u8]> for Received {
    fn as_ref(&self) -> &[u8] {
        self.0.payload()
    }
}

/// The ports of one process.
pub struct Ports {
    publisher: Publisher<Private, [u8], HeaderWords>,
    subscriber: Subscriber<Private, [u8], HeaderWords>,
    /// Its reference count is the number of samples on loan.
    loaned: Arc<()>,
    wakeup: Wakeup,
    sample: usize,
    node: Node<Private>,
    node_lock: NodeLock,
}

impl Ports {
    /// Creates the services of a run, or opens those that an earlier server of the run left.
    pub fn serve(run: &str, facets: FacetNumber) -> Result<Ports, LinkError> {
        let (node, node_lock) = node("tumble server")?;
        // killed processes keep their places until they are cleaned up
        let places = 2 * usize::from(facets) + 4;
        let data = |name: &str, publishers: usize, subscribers: usize| {
            let builder = node
                .service_builder(&service_name(run, name)?)
                .publish_subscribe::<[u8]>()
                .user_header::<HeaderWords>();
            let builder = builder
                .enable_safe_overflow(true)
                .subscriber_max_buffer_size(BUFFER_SAMPLES)
                .history_size(0)
                .subscriber_max_borrowed_samples(MAX_BORROWED);
            builder
                .max_publishers(publishers)
                .max_subscribers(subscribers)
                .max_nodes(places + 4)
                .open_or_create()
                .map_err(|why| refused(run, name, why))
        };
        // before the services: a facet that finds them also finds the counters
        let wakeup = Wakeup::serve(run, node_lock.user())?;
        let (down, up) = (data("down", 4, places)?, data("up", places, 4)?);
        let ports = Ports {
            publisher: publisher(&down, DOWN_BYTES).map_err(|why| refused(run, "down", why))?,
            subscriber: up.subscriber_builder().create().map_err(|why| refused(run, "up", why))?,
            loaned: Arc::default(),
            wakeup,
            sample: DOWN_BYTES,
            node,
            node_lock,
        };
        Ok(ports)
    }

    /// Opens a run's services as a facet; `None` while there are none.
    pub fn join(run: &str) -> Result<Option<Ports>, LinkError> {
        let (node, node_lock) = node("tumble facet")?;
        let data = |name: &str| {
            Ok::<_, LinkError>(
                node.service_builder(&service_name(run, name)?)
                    .publish_subscribe::<[u8]>()
                    .user_header::<HeaderWords>()
                    .open()
                    .ok(),
            )
        };
        let (Some(down), Some(up), Some(wakeup)) = (data("down")?, data("up")?, Wakeup::join(run, node_lock.user())?)
        else {
            return Ok(None);
        };
        let ports = Ports {
            publisher: publisher(&up, UP_BYTES).map_err(|why| refused(run, "up", why))?,
            subscriber: down.subscriber_builder().create().map_err(|why| refused(run, "down", why))?,
            loaned: Arc::default(),
            wakeup,
            sample: UP_BYTES,
            node,
            node_lock,
        };
        Ok(Some(ports))
    }

    /// Returns the maximum number of message bytes in one sample.
    pub fn piece_bytes(&self) -> usize {
        self.sample
    }

    /// Publishes a sample without waking a process.
    pub fn publish(&self, header: HeaderWords, data: &[u8]) -> Result<(), LinkError> {
        let mut sample = self.publisher.loan_slice_uninit(data.len()).map_err(|why| failed("loan", why))?;
        *sample.user_header_mut() = header;
        sample.write_from_slice(data).send().map_err(|why| failed("send", why))?;
        Ok(())
    }

    /// Opens the wakeup counters of a run again, because a new server may have created others.
    pub fn reopen_wakeup(&mut self, run: &str) -> Result<(), LinkError> {
        if let Some(wakeup) = Wakeup::join(run, self.node_lock.user())? {
            self.wakeup = wakeup;
        }
        Ok(())
    }

    /// Returns the wakeup counters.
    pub fn wakeup(&self) -> &Wakeup {
        &self.wakeup
    }

    /// Returns the next sample, if there is one.
    pub fn receive(&self) -> Result<Option<Received>, LinkError> {
        Ok(self.subscriber.receive().map_err(|why| failed("receive", why))?.map(Received))
    }

    /// Returns the message of a sample: in place, or a copy if too many samples are on loan
    /// already.
    pub fn loan(&self, sample: Received) -> Message {
        // one more sample is held while it is read
        if Arc::strong_count(&self.loaned) + 1 < MAX_BORROWED {
            Message::loaned(Loaned { sample, _held: self.loaned.clone() })
        } else {
            sample.as_ref().to_vec().into()
        }
    }

    /// Removes leftovers of killed processes.
    pub fn clean_up(&self) {
        self.node.try_cleanup_dead_nodes();
        wakeup::clean_up(self.node_lock.user());
    }
}

/// A sample on loan.
struct Loaned {
    sample: Received,
    _held: Arc<()>,
}

impl AsRef<[u8]> for Loaned {
    fn as_ref(&self) -> &[u8] {
        self.sample.as_ref()
    }
}

impl Drop for Ports {
    fn drop(&mut self) {
        self.node.try_cleanup_dead_nodes();
    }
}

type Samples = iceoryx2::service::port_factory::publish_subscribe::PortFactory<Private, [u8], HeaderWords>;

fn publisher(service: &Samples, bytes: usize) -> Result<Publisher<Private, [u8], HeaderWords>, impl Debug> {
    service.publisher_builder().initial_max_slice_len(bytes).allocation_strategy(AllocationStrategy::Static).create()
}

/// Creates a node, which removes stale resources, and takes the node lock.
fn node(name: &str) -> Result<(Node<Private>, NodeLock), LinkError> {
    set_log_level(LogLevel::Fatal); // our errors report failures
    let (folder, user) = folder()?;
    let text = folder.display().to_string();
    let unusable =
        |why: &dyn Debug| LinkError::Other(format!("shared memory: the folder {text} cannot be used: {why:?}"));
    let mut config = Config::default();
    // the prefix depends on the folder: nodes that do not see each other use different counters
    let prefix = format!("tumble_{user}_{}_", &blake3::hash(text.as_bytes()).to_hex()[..8]);
    let node_lock = NodeLock::new(&folder, user)?;
    config.global.prefix = FileName::new(prefix.as_bytes()).map_err(|why| unusable(&why))?;
    config.global.set_root_path(&Path::new(text.as_bytes()).map_err(|why| unusable(&why))?);
    let name = name.try_into().map_err(|why| unusable(&why))?;
    let builder = NodeBuilder::new().name(&name).config(&config).signal_handling_mode(SignalHandlingMode::Disabled);
    let mut tries = 0..ID_TRIES;
    let node = loop {
        match builder.clone().create::<Private>() {
            // another process makes the counter of nodes at this moment
            Err(NodeCreationFailure::UnableToGenerateUniqueNodeId) if tries.next().is_some() => {
                std::thread::sleep(ID_PAUSE);
            }
            made => break made.map_err(|why| unusable(&why))?,
        }
    };
    wakeup::clean_up(user);
    Ok((node, node_lock))
}

/// Removes leftovers of killed processes.
pub fn clean_up() -> Result<(), LinkError> {
    let (node, node_lock) = node("tumble clean-up")?;
    node.blocking_cleanup_dead_nodes(CLEAN_UP_TIMEOUT); // waits where another process cleans the same node up
    drop(node);
    drop(node_lock);
    Ok(())
}

/// Returns a folder that only this user can enter, created if needed, and the user id.
///
/// # Errors
/// The folder cannot be created, or has another owner or mode.
pub fn folder() -> Result<(PathBuf, u32), LinkError> {
    let user = std::fs::metadata("/proc/self").map_err(|why| LinkError::Io { what: "/proc/self".into(), why })?.uid();
    let base = std::env::var_os("XDG_RUNTIME_DIR")
        .map(PathBuf::from)
        .filter(|dir| std::fs::metadata(dir).is_ok_and(|about| about.uid() == user));
    let folder = base.unwrap_or_else(std::env::temp_dir).join(format!("tumble-{user}"));
    let io = |why| LinkError::Io { what: format!("shared memory: folder {}", folder.display()), why };
    match std::fs::DirBuilder::new().mode(0o700).create(&folder) {
        Err(why) if why.kind() != std::io::ErrorKind::AlreadyExists => return Err(io(why)),
        _ => {}
    }
    let about = std::fs::symlink_metadata(&folder).map_err(io)?;
    if !about.is_dir() || about.uid() != user || about.permissions().mode() & 0o077 != 0 {
        let mode = about.permissions().mode() & 0o777;
        return Err(LinkError::Other(format!(
            "shared memory: {} must be a folder of user {user} with mode 700; it has owner {} and mode {mode:03o}. Remove it, or set XDG_RUNTIME_DIR",
            folder.display(),
            about.uid()
        )));
    }
    Ok((folder, user))
}

fn service_name(run: &str, name: &str) -> Result<iceoryx2::service::service_name::ServiceName, LinkError> {
    let full = format!("tumble/{run}/{name}");
    full.as_str().try_into().map_err(|why| {
        LinkError::Other(format!("shared memory: {full:?} is no name of a service: {why:?}; at most 200 bytes"))
    })
}

fn refused(run: &str, name: &str, why: impl Debug) -> LinkError {
    LinkError::Other(format!("shared memory: service {name} of run {run}: {why:?}"))
}

fn failed(what: &str, why: impl Debug) -> LinkError {
    LinkError::Other(format!("shared memory: {what}: {why:?}"))
}
