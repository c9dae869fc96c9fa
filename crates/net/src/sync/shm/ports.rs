//! The ends of iceoryx2 that one process holds, the bell, and where its files lie.
//!
//! Two services of samples per run, named by the run: `tumble/RUN/down` and `…/up`, and a [`Bell`]. Files lie in a folder of this user alone, objects in
//! `/dev/shm` carry the user's number: another user's run is neither seen nor disturbed. What a killed process leaves is removed when the next node begins,
//! or when a server ends.

use super::bell::{self, Bell};
use crate::sync::transport::{FacetNumber, LinkError};
use iceoryx2::node::{Node, NodeBuilder};
use iceoryx2::port::{publisher::Publisher, subscriber::Subscriber};
use iceoryx2::prelude::{AllocationStrategy, Config, FileName, LogLevel, Path, SemanticString, SignalHandlingMode, set_log_level};
use iceoryx2::service::ipc_threadsafe::Service;
use std::fmt::Debug;
use std::os::unix::fs::{DirBuilderExt, MetadataExt, PermissionsExt};
use std::path::PathBuf;

/// Most bytes of a sample from the server; a longer message goes in pieces.
pub const DOWN_BYTES: usize = 128 << 10;
/// Most bytes of a sample from a facet.
pub const UP_BYTES: usize = 16 << 10;
/// Samples that a slow reader's buffer holds.
const BUFFER: usize = 8;

/// The ends.
pub struct Ports {
    publisher: Publisher<Service, [u8], ()>,
    subscriber: Subscriber<Service, [u8], ()>,
    bell: Bell,
    sample: usize,
    node: Node<Service>,
    user: u32,
}

impl Ports {
    /// Begins the services of a run, or joins those that an earlier server of it left.
    pub fn serve(run: &str, facets: FacetNumber) -> Result<Ports, LinkError> {
        let (node, user) = node("tumble server")?;
        // Killed processes hold their places until they are cleaned up.
        let places = 2 * usize::from(facets) + 4;
        let data = |name: &str, publishers: usize, subscribers: usize| {
            let builder = node.service_builder(&service_name(run, name)?).publish_subscribe::<[u8]>();
            let builder =
                builder.enable_safe_overflow(true).subscriber_max_buffer_size(BUFFER).history_size(0).subscriber_max_borrowed_samples(2);
            builder
                .max_publishers(publishers)
                .max_subscribers(subscribers)
                .max_nodes(places + 4)
                .open_or_create()
                .map_err(|why| refused(run, name, why))
        };
        // Before the services: who finds them finds it.
        let bell = Bell::serve(run, user)?;
        let (down, up) = (data("down", 4, places)?, data("up", places, 4)?);
        let ports = Ports {
            publisher: publisher(&down, DOWN_BYTES).map_err(|why| refused(run, "down", why))?,
            subscriber: up.subscriber_builder().create().map_err(|why| refused(run, "up", why))?,
            bell,
            sample: DOWN_BYTES,
            node,
            user,
        };
        Ok(ports)
    }

    /// Joins a run's services as a facet; `None` while there are none.
    pub fn join(run: &str) -> Result<Option<Ports>, LinkError> {
        let (node, user) = node("tumble facet")?;
        let data = |name: &str| Ok::<_, LinkError>(node.service_builder(&service_name(run, name)?).publish_subscribe::<[u8]>().open().ok());
        let (Some(down), Some(up), Some(bell)) = (data("down")?, data("up")?, Bell::join(run, user)?) else { return Ok(None) };
        let ports = Ports {
            publisher: publisher(&up, UP_BYTES).map_err(|why| refused(run, "up", why))?,
            subscriber: down.subscriber_builder().create().map_err(|why| refused(run, "down", why))?,
            bell,
            sample: UP_BYTES,
            node,
            user,
        };
        Ok(Some(ports))
    }

    /// Most bytes of a message in one sample.
    pub fn piece_bytes(&self) -> usize {
        self.sample
    }

    /// Publishes a sample of two parts. Nobody is woken yet.
    pub fn publish(&self, head: &[u8], data: &[u8]) -> Result<(), LinkError> {
        let mut sample = self.publisher.loan_slice(head.len() + data.len()).map_err(|why| failed("loan", why))?;
        let (first, rest) = sample.payload_mut().split_at_mut(head.len());
        first.copy_from_slice(head);
        rest.copy_from_slice(data);
        sample.send().map_err(|why| failed("send", why))?;
        Ok(())
    }

    /// Looks again for the bell of a run: a new server of it may have another one.
    pub fn look_for_bell(&mut self, run: &str) -> Result<(), LinkError> {
        if let Some(bell) = Bell::join(run, self.user)? {
            self.bell = bell;
        }
        Ok(())
    }

    /// What wakes the other side.
    pub fn bell(&self) -> &Bell {
        &self.bell
    }

    /// Hands the next sample to `take`; `false` when there is none.
    pub fn receive(&self, take: impl FnOnce(&[u8])) -> Result<bool, LinkError> {
        match self.subscriber.receive().map_err(|why| failed("receive", why))? {
            Some(sample) => {
                take(sample.payload());
                Ok(true)
            }
            None => Ok(false),
        }
    }

    /// Removes what killed processes left.
    pub fn clean_up(&self) {
        self.node.try_cleanup_dead_nodes();
        bell::clean_up(self.user);
    }
}

type Samples = iceoryx2::service::port_factory::publish_subscribe::PortFactory<Service, [u8], ()>;

fn publisher(service: &Samples, bytes: usize) -> Result<Publisher<Service, [u8], ()>, impl Debug> {
    service.publisher_builder().initial_max_slice_len(bytes + super::wire::HEAD).allocation_strategy(AllocationStrategy::Static).create()
}

/// A node, which removes what is stale as it begins, and the number of its user.
fn node(name: &str) -> Result<(Node<Service>, u32), LinkError> {
    set_log_level(LogLevel::Fatal); // what goes wrong is told by our errors
    let (folder, user) = folder()?;
    let text = folder.display().to_string();
    let unusable = |why: &dyn Debug| LinkError::Other(format!("shared memory: the folder {text} cannot be used: {why:?}"));
    let mut config = Config::default();
    config.global.prefix = FileName::new(format!("tumble_{user}_").as_bytes()).map_err(|why| unusable(&why))?;
    config.global.set_root_path(&Path::new(text.as_bytes()).map_err(|why| unusable(&why))?);
    let name = name.try_into().map_err(|why| unusable(&why))?;
    let builder = NodeBuilder::new().name(&name).config(&config).signal_handling_mode(SignalHandlingMode::Disabled);
    let node = builder.create::<Service>().map_err(|why| unusable(&why))?;
    bell::clean_up(user);
    Ok((node, user))
}

/// Removes what killed processes left.
pub fn clean_up() -> Result<(), LinkError> {
    node("tumble clean-up").map(|(node, _)| _ = node.try_cleanup_dead_nodes())
}

/// A folder of this user alone, made if need be; and the user's number.
pub fn folder() -> Result<(PathBuf, u32), LinkError> {
    let user = std::fs::metadata("/proc/self").map_err(|why| LinkError::Io { what: "/proc/self".into(), why })?.uid();
    let base =
        std::env::var_os("XDG_RUNTIME_DIR").map(PathBuf::from).filter(|dir| std::fs::metadata(dir).is_ok_and(|about| about.uid() == user));
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
    full.as_str()
        .try_into()
        .map_err(|why| LinkError::Other(format!("shared memory: {full:?} is no name of a service: {why:?}; at most 200 bytes")))
}

fn refused(run: &str, name: &str, why: impl Debug) -> LinkError {
    LinkError::Other(format!("shared memory: service {name} of run {run}: {why:?}"))
}

fn failed(what: &str, why: impl Debug) -> LinkError {
    LinkError::Other(format!("shared memory: {what}: {why:?}"))
}
