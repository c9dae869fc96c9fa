//! `[sync]`, `[security]`, `[recording]`: synchronization of the processes of a cave.

use std::ops::Range;
use std::path::{Path, PathBuf};

use super::Cave;
use crate::parse::fields::{Fields, Names};
use crate::parse::log::Log;

/// How frames travel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transport {
    /// Memory shared by processes of one machine.
    SharedMemory,
    /// Datagrams between machines.
    Udp,
}

/// When a frame is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// When every critical facet has drawn it: all show the same frame.
    Lockstep,
    /// As soon as it is drawn: each facet shows its newest frame.
    Latest,
}

/// Place where the world is stepped.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Compute {
    /// On the server, which sends poses.
    #[default]
    Server,
    /// On the server and on every facet: inputs are sent, and the hashes of all states are compared.
    Everywhere,
}

impl Compute {
    /// All choices with their names in cave files and on the command line.
    pub const NAMES: &[(&str, Self)] = &[("server", Compute::Server), ("everywhere", Compute::Everywhere)];
}

const TRANSPORTS: Names<Transport> = &[("shared_memory", Transport::SharedMemory), ("udp", Transport::Udp)];
const MODES: Names<Mode> = &[("lockstep", Mode::Lockstep), ("latest", Mode::Latest)];

/// `[sync]`. All keys have defaults.
#[derive(Clone, Debug, PartialEq)]
pub struct Sync {
    /// Default `shared_memory`.
    pub transport: Transport,
    /// UDP port on which the server listens if a node is another machine, 1 to 65535. Default 47
    /// 100.
    pub port: u16,
    /// Default `lockstep`.
    pub mode: Mode,
    /// Default `server`.
    pub compute: Compute,
    /// Time that the start waits for facets, ms, 1 to 600 000. Default 10 000.
    pub connect_timeout_ms: u32,
    /// Time that a frame waits for a facet, ms, 1 to 60 000. Default 100.
    pub ready_timeout_ms: u32,
    /// A facet that is silent for this long is dropped and may join again, ms, 100 to 600 000.
    /// Facets send every 50 ms. Default 2000.
    pub drop_timeout_ms: u32,
    /// Frames kept for retransmission, 1 to 1024. Default 8.
    pub history_frames: u32,
}

impl Default for Sync {
    fn default() -> Self {
        Sync {
            transport: Transport::SharedMemory,
            port: 47_100,
            mode: Mode::Lockstep,
            compute: Compute::Server,
            connect_timeout_ms: 10_000,
            ready_timeout_ms: 100,
            drop_timeout_ms: 2000,
            history_frames: 8,
        }
    }
}

impl Sync {
    pub(crate) fn read(mut f: Fields<'_>) -> Sync {
        let default = Sync::default();
        let sync = Sync {
            transport: f.choice_or("transport", TRANSPORTS, default.transport),
            port: f.integer_or("port", 1..=65_535, default.port.into()) as u16,
            mode: f.choice_or("mode", MODES, default.mode),
            compute: f.choice_or("compute", Compute::NAMES, default.compute),
            connect_timeout_ms: f.integer_or("connect_timeout_ms", 1..=600_000, default.connect_timeout_ms),
            ready_timeout_ms: f.integer_or("ready_timeout_ms", 1..=60_000, default.ready_timeout_ms),
            drop_timeout_ms: f.integer_or("drop_timeout_ms", 100..=600_000, default.drop_timeout_ms),
            history_frames: f.integer_or("history_frames", 1..=1024, default.history_frames),
        };
        if sync.drop_timeout_ms < sync.ready_timeout_ms {
            let message = format!(
                "`drop_timeout_ms` of {} is {} and `ready_timeout_ms` is {}",
                f.what, sync.drop_timeout_ms, sync.ready_timeout_ms
            );
            f.log.report(f.span.clone(), message, "expected a `drop_timeout_ms` of at least `ready_timeout_ms`");
        }
        f.finish();
        sync
    }
}

/// `[security]`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Security {
    /// A file with the key that all nodes share. Cave files never have the key itself.
    pub key_file: PathBuf,
}

impl Security {
    pub(crate) fn read(mut f: Fields<'_>, folder: &Path) -> Option<Security> {
        let key = f.text("key_file", "the path of a file that holds the key").map(|(text, _)| folder.join(text));
        f.finish();
        key.map(|key_file| Security { key_file })
    }
}

/// `[recording]`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Recording {
    /// The recording (MCAP).
    pub file: PathBuf,
    /// Interval between recorded frames, 1 to 10 000. Default 1.
    pub every_frames: u32,
    /// Whether the images of cameras are recorded. Default false.
    pub cameras: bool,
}

impl Recording {
    pub(crate) fn read(mut f: Fields<'_>, folder: &Path) -> Option<Recording> {
        let file = f.text("file", "the path of an .mcap file").map(|(text, _)| folder.join(text));
        let every_frames = f.integer_or("every_frames", 1..=10_000, 1);
        let cameras = f.flag_or("cameras", false);
        f.finish();
        file.map(|file| Recording { file, every_frames, cameras })
    }
}

/// Checks that shared memory is used on one machine only and that remote nodes have a key.
pub(crate) fn check_reach(cave: &Cave, log: &Log<'_>, place: &Range<usize>) {
    let Some(far) = cave.nodes.iter().find(|node| !node.is_local()) else { return };
    if cave.sync.transport == Transport::SharedMemory {
        let message = format!(
            "node \"{}\" is at {}, but `transport` of [sync] is shared_memory, which works on one machine only",
            far.name, far.address
        );
        log.report(place.clone(), message, "expected transport = \"udp\", or nodes at 127.0.0.1");
    } else if cave.security.is_none() {
        let message = format!("node \"{}\" is at {}, but there is no [security]", far.name, far.address);
        log.report(
            place.clone(),
            message,
            "expected [security] with a key_file; without it only nodes at 127.0.0.1 are allowed",
        );
    }
}
