//! The ends of iceoryx2 that one process holds, the bell, and where its files lie.
//!
//! Two services of samples per run, named by the run: `tumble/RUN/down` and `…/up`, and a [`Wakeup`]. Files lie in a folder of this user alone, objects in
//! `/dev/shm` carry the user's number and have mode 600: another user's run is neither seen nor disturbed. What a killed process leaves is removed when the next node begins,
//! or when a server ends; what then still stays, the last process takes along ([`super::node_lock`]).

use super::node_lock::NodeLock;
use super::service::Private;
use super::wakeup::{self, Wakeup};
use super::wire::HeaderWords;
use crate::sync::transport::{FacetNumber, LinkError, Message};
use iceoryx2::node::{Node, NodeBuilder};
use iceoryx2::port::{publisher::Publisher, subscriber::Subscriber};
use iceoryx2::prelude::{
    AllocationStrategy, Config, FileName, LogLevel, Path, SemanticString, SignalHandlingMode, set_log_level,
};
use iceoryx2::sample::Sample;
use std::fmt::Debug;
use std::os::unix::fs::{DirBuilderExt, MetadataExt, PermissionsExt};
use std::path::PathBuf;
use std::sync::Arc;

/// Most bytes of a sample from the server; a longer message goes in pieces.
pub const DOWN_BYTES: usize = 128 << 10;
/// Most bytes of a sample from a facet.
pub const UP_BYTES: usize = 16 << 10;
/// Samples that a slow reader's buffer holds.
const BUFFER_SAMPLES: usize = 8;

/// Samples that a reader may hold while it goes on reading.
const MAX_BORROWED: usize = 6;

/// A sample that was received. It lies in shared memory, and nobody writes over it until it is dropped.
pub struct Received(Sample<Private, [u8], HeaderWords>);

impl Received {
    /// Its head.
    pub fn header(&self) -> HeaderWords {
        *self.0.user_header()
    }
}

impl AsRef<[u8]> for Received {
    fn as_ref(&self) -> &[u8] {
        self.0.payload()
    }
}

/// The ends.
pub struct Ports {
    publisher: Publisher<Private, [u8], HeaderWords>,
    subscriber: Subscriber<Private, [u8], HeaderWords>,
    /// Held by each sample that was lent.
    loaned: Arc<()>,
    wakeup: Wakeup,
    sample: usize,
    node: Node<Private>,
    node_lock: NodeLock,
}

impl Ports {
    /// Begins the services of a run, or joins those that an earlier server of it left.
    pub fn serve(run: &str, facets: FacetNumber) -> Result<Ports, LinkError> {
        let (node, node_lock) = node("tumble server")?;
        // Killed processes hold their places until they are cleaned up.
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
        // Before the services: who finds them finds it.
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

    /// Joins a run's services as a facet; `None` while there are none.
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

    /// Most bytes of a message in one sample.
    pub fn piece_bytes(&self) -> usize {
        self.sample
    }

    /// Publishes a sample. Nobody is woken yet.
    pub fn publish(&self, header: HeaderWords, data: &[u8]) -> Result<(), LinkError> {
        let mut sample = self.publisher.loan_slice_uninit(data.len()).map_err(|why| failed("loan", why))?;
        *sample.user_header_mut() = header;
        sample.write_from_slice(data).send().map_err(|why| failed("send", why))?;
        Ok(())
    }

    /// Looks again for the bell of a run: a new server of it may have another one.
    pub fn reopen_wakeup(&mut self, run: &str) -> Result<(), LinkError> {
        if let Some(wakeup) = Wakeup::join(run, self.node_lock.user())? {
            self.wakeup = wakeup;
        }
        Ok(())
    }

    /// What wakes the other side.
    pub fn wakeup(&self) -> &Wakeup {
        &self.wakeup
    }

    /// The next sample, if there is one.
    pub fn receive(&self) -> Result<Option<Received>, LinkError> {
        Ok(self.subscriber.receive().map_err(|why| failed("receive", why))?.map(Received))
    }

    /// The message of a sample: where it lies, or a copy where the reader holds so many already that it could not go on reading.
    pub fn loan(&self, sample: Received) -> Message {
        // one more is held while it is looked at
        if Arc::strong_count(&self.loaned) + 1 < MAX_BORROWED {
            Message::loaned(Loaned { sample, _held: self.loaned.clone() })
        } else {
            sample.as_ref().to_vec().into()
        }
    }

    /// Removes what killed processes left.
    pub fn clean_up(&self) {
        self.node.try_cleanup_dead_nodes();
        wakeup::clean_up(self.node_lock.user());
    }
}

/// A sample that somebody holds.
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

/// A node, which removes what is stale as it begins, and the word that it is here.
fn node(name: &str) -> Result<(Node<Private>, NodeLock), LinkError> {
    set_log_level(LogLevel::Fatal); // what goes wrong is told by our errors
    let (folder, user) = folder()?;
    let text = folder.display().to_string();
    let unusable =
        |why: &dyn Debug| LinkError::Other(format!("shared memory: the folder {text} cannot be used: {why:?}"));
    let mut config = Config::default();
    // Of another folder another one: nodes that do not see each other draw from different counters.
    let prefix = format!("tumble_{user}_{}_", &blake3::hash(text.as_bytes()).to_hex()[..8]);
    let node_lock = NodeLock::new(&folder, user)?;
    config.global.prefix = FileName::new(prefix.as_bytes()).map_err(|why| unusable(&why))?;
    config.global.set_root_path(&Path::new(text.as_bytes()).map_err(|why| unusable(&why))?);
    let name = name.try_into().map_err(|why| unusable(&why))?;
    let builder = NodeBuilder::new().name(&name).config(&config).signal_handling_mode(SignalHandlingMode::Disabled);
    let node = builder.create::<Private>().map_err(|why| unusable(&why))?;
    wakeup::clean_up(user);
    Ok((node, node_lock))
}

/// Removes what killed processes left.
pub fn clean_up() -> Result<(), LinkError> {
    let (node, node_lock) = node("tumble clean-up")?;
    node.try_cleanup_dead_nodes();
    drop(node);
    drop(node_lock);
    Ok(())
}

/// A folder of this user alone, made if need be; and the user's number.
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
