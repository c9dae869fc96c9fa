//! The ends of iceoryx2 that one process holds, the bell, and where its files lie.
//!
//! Two services of samples per run, named by the run: `tumble/RUN/down` and `…/up`, and a [`Bell`]. Files lie in a folder of this user alone, objects in
//! `/dev/shm` carry the user's number and have mode 600: another user's run is neither seen nor disturbed. What a killed process leaves is removed when the next node begins,
//! or when a server ends; what then still stays, the last process takes along ([`super::alive`]).

use super::alive::Alive;
use super::bell::{self, Bell};
use super::service::Private;
use super::wire::Words;
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
const BUFFER: usize = 8;

/// Samples that a reader may hold while it goes on reading.
const HELD: usize = 6;

/// A sample that was received. It lies in shared memory, and nobody writes over it until it is dropped.
pub struct Received(Sample<Private, [u8], Words>);

impl Received {
    /// Its head.
    pub fn head(&self) -> Words {
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
    publisher: Publisher<Private, [u8], Words>,
    subscriber: Subscriber<Private, [u8], Words>,
    /// Held by each sample that was lent.
    lent: Arc<()>,
    bell: Bell,
    sample: usize,
    node: Node<Private>,
    alive: Alive,
}

impl Ports {
    /// Begins the services of a run, or joins those that an earlier server of it left.
    pub fn serve(run: &str, facets: FacetNumber) -> Result<Ports, LinkError> {
        let (node, alive) = node("tumble server")?;
        // Killed processes hold their places until they are cleaned up.
        let places = 2 * usize::from(facets) + 4;
        let data = |name: &str, publishers: usize, subscribers: usize| {
            let builder =
                node.service_builder(&service_name(run, name)?).publish_subscribe::<[u8]>().user_header::<Words>();
            let builder = builder
                .enable_safe_overflow(true)
                .subscriber_max_buffer_size(BUFFER)
                .history_size(0)
                .subscriber_max_borrowed_samples(HELD);
            builder
                .max_publishers(publishers)
                .max_subscribers(subscribers)
                .max_nodes(places + 4)
                .open_or_create()
                .map_err(|why| refused(run, name, why))
        };
        // Before the services: who finds them finds it.
        let bell = Bell::serve(run, alive.user())?;
        let (down, up) = (data("down", 4, places)?, data("up", places, 4)?);
        let ports = Ports {
            publisher: publisher(&down, DOWN_BYTES).map_err(|why| refused(run, "down", why))?,
            subscriber: up.subscriber_builder().create().map_err(|why| refused(run, "up", why))?,
            lent: Arc::default(),
            bell,
            sample: DOWN_BYTES,
            node,
            alive,
        };
        Ok(ports)
    }

    /// Joins a run's services as a facet; `None` while there are none.
    pub fn join(run: &str) -> Result<Option<Ports>, LinkError> {
        let (node, alive) = node("tumble facet")?;
        let data = |name: &str| {
            Ok::<_, LinkError>(
                node.service_builder(&service_name(run, name)?)
                    .publish_subscribe::<[u8]>()
                    .user_header::<Words>()
                    .open()
                    .ok(),
            )
        };
        let (Some(down), Some(up), Some(bell)) = (data("down")?, data("up")?, Bell::join(run, alive.user())?) else {
            return Ok(None);
        };
        let ports = Ports {
            publisher: publisher(&up, UP_BYTES).map_err(|why| refused(run, "up", why))?,
            subscriber: down.subscriber_builder().create().map_err(|why| refused(run, "down", why))?,
            lent: Arc::default(),
            bell,
            sample: UP_BYTES,
            node,
            alive,
        };
        Ok(Some(ports))
    }

    /// Most bytes of a message in one sample.
    pub fn piece_bytes(&self) -> usize {
        self.sample
    }

    /// Publishes a sample. Nobody is woken yet.
    pub fn publish(&self, head: Words, data: &[u8]) -> Result<(), LinkError> {
        let mut sample = self.publisher.loan_slice_uninit(data.len()).map_err(|why| failed("loan", why))?;
        *sample.user_header_mut() = head;
        sample.write_from_slice(data).send().map_err(|why| failed("send", why))?;
        Ok(())
    }

    /// Looks again for the bell of a run: a new server of it may have another one.
    pub fn look_for_bell(&mut self, run: &str) -> Result<(), LinkError> {
        if let Some(bell) = Bell::join(run, self.alive.user())? {
            self.bell = bell;
        }
        Ok(())
    }

    /// What wakes the other side.
    pub fn bell(&self) -> &Bell {
        &self.bell
    }

    /// The next sample, if there is one.
    pub fn receive(&self) -> Result<Option<Received>, LinkError> {
        Ok(self.subscriber.receive().map_err(|why| failed("receive", why))?.map(Received))
    }

    /// The message of a sample: where it lies, or a copy where the reader holds so many already that it could not go on reading.
    pub fn lend(&self, sample: Received) -> Message {
        // one more is held while it is looked at
        if Arc::strong_count(&self.lent) + 1 < HELD {
            Message::lent(Lent { sample, _held: self.lent.clone() })
        } else {
            sample.as_ref().to_vec().into()
        }
    }

    /// Removes what killed processes left.
    pub fn clean_up(&self) {
        self.node.try_cleanup_dead_nodes();
        bell::clean_up(self.alive.user());
    }
}

/// A sample that somebody holds.
struct Lent {
    sample: Received,
    _held: Arc<()>,
}

impl AsRef<[u8]> for Lent {
    fn as_ref(&self) -> &[u8] {
        self.sample.as_ref()
    }
}

impl Drop for Ports {
    fn drop(&mut self) {
        self.node.try_cleanup_dead_nodes();
    }
}

type Samples = iceoryx2::service::port_factory::publish_subscribe::PortFactory<Private, [u8], Words>;

fn publisher(service: &Samples, bytes: usize) -> Result<Publisher<Private, [u8], Words>, impl Debug> {
    service.publisher_builder().initial_max_slice_len(bytes).allocation_strategy(AllocationStrategy::Static).create()
}

/// A node, which removes what is stale as it begins, and the word that it is here.
fn node(name: &str) -> Result<(Node<Private>, Alive), LinkError> {
    set_log_level(LogLevel::Fatal); // what goes wrong is told by our errors
    let (folder, user) = folder()?;
    let text = folder.display().to_string();
    let unusable =
        |why: &dyn Debug| LinkError::Other(format!("shared memory: the folder {text} cannot be used: {why:?}"));
    let mut config = Config::default();
    // Of another folder another one: nodes that do not see each other draw from different counters.
    let prefix = format!("tumble_{user}_{}_", &blake3::hash(text.as_bytes()).to_hex()[..8]);
    let alive = Alive::new(&folder, user)?;
    config.global.prefix = FileName::new(prefix.as_bytes()).map_err(|why| unusable(&why))?;
    config.global.set_root_path(&Path::new(text.as_bytes()).map_err(|why| unusable(&why))?);
    let name = name.try_into().map_err(|why| unusable(&why))?;
    let builder = NodeBuilder::new().name(&name).config(&config).signal_handling_mode(SignalHandlingMode::Disabled);
    let node = builder.create::<Private>().map_err(|why| unusable(&why))?;
    bell::clean_up(user);
    Ok((node, alive))
}

/// Removes what killed processes left.
pub fn clean_up() -> Result<(), LinkError> {
    let (node, alive) = node("tumble clean-up")?;
    node.try_cleanup_dead_nodes();
    drop(node);
    drop(alive);
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
