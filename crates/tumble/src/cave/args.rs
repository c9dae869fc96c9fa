//! What can be typed after `tumble cave`, `tumble serve` and `tumble facet`.

use crate::args::{OpeningOptions, SceneOptions};
use clap::{Args, ValueEnum};
use std::net::SocketAddr;
use std::path::PathBuf;
use tumble::render::Quality;

/// The cave, and the surroundings of the scene. The server and all facets must be given the same.
#[derive(Args, Clone)]
pub struct CaveSceneOptions {
    /// A cave file or the name of a shipped cave.
    #[arg(long, value_name = "CAVE")]
    pub cave: String,
    /// Another scene that brings camera, lights, sky, the cave's place, and bodies that do not move; they are drawn and never touched. Those of the
    /// first scene (but for its bodies) are then ignored.
    #[arg(long, value_name = "FILE")]
    pub environment: Option<String>,
}

/// What carries the frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum TransportKind {
    /// Memory that processes of one machine share.
    #[value(name = "shared_memory")]
    SharedMemory,
    /// Datagrams.
    Udp,
}

/// What a server is told.
#[derive(Args, Clone)]
pub struct ServeOptions {
    #[command(flatten)]
    pub scene: SceneOptions,
    #[command(flatten)]
    pub surroundings: CaveSceneOptions,
    /// Simulated time to run for, s (default: until Ctrl-C).
    #[arg(long, value_name = "S", value_parser = crate::args::seconds)]
    pub duration: Option<f64>,
    /// Frames shown per simulated second, at most; a frame holds as many steps as fit, at least one.
    #[arg(long, value_name = "N", default_value = "60", value_parser = crate::args::rate)]
    pub fps: f64,
    /// Do not keep to the clock: the next frame begins when the last one is shown, and waits for its facets as long as the start does.
    #[arg(long)]
    pub no_realtime: bool,
    /// What carries the frames (default: what the cave says).
    #[arg(long, value_name = "NAME")]
    pub transport: Option<TransportKind>,
    /// Where to listen with --transport udp (default: 127.0.0.1 and a free port, or every address and the cave's port where it has machines elsewhere).
    #[arg(long, value_name = "ADDR:PORT")]
    pub listen: Option<SocketAddr>,
    /// How long the start waits for facets, s (default: connect_timeout_ms of the cave).
    #[arg(long, value_name = "S", value_parser = crate::args::seconds)]
    pub connect_timeout: Option<f64>,
    /// End the run that is going on in this cave, and take its place.
    #[arg(long)]
    pub replace: bool,
    /// Record states, inputs and answers (MCAP), in place of what the cave file says under [recording].
    #[arg(long, value_name = "FILE")]
    pub record: Option<PathBuf>,
    /// Write what was counted and measured (JSON).
    #[arg(long, value_name = "FILE")]
    pub summary: Option<PathBuf>,
    /// The users' bodies push what they walk into: an upright capsule of 0.25 m around each, and two hands.
    #[arg(long)]
    pub user_colliders: bool,
    /// Hear a tracker (OSC over UDP) at this address; the rest is as [tracker] of the cave file says. Its datagrams are not sealed: any address but this machine's own
    /// needs senders.
    #[arg(long, value_name = "ADDR:PORT")]
    pub tracker: Option<SocketAddr>,
    /// Whom the tracker's port listens to, in place of `senders` of the cave file.
    #[arg(long, value_name = "IP,…", value_delimiter = ',')]
    pub tracker_from: Vec<std::net::IpAddr>,
    /// Show the run to viewers of Foxglove (WebSocket; whoever reaches the address sees it).
    #[cfg(feature = "foxglove")]
    #[arg(long, value_name = "ADDR:PORT", num_args = 0..=1, default_missing_value = "127.0.0.1:8765")]
    pub foxglove: Option<SocketAddr>,
    /// Do again what users did in a recorded run, in place of what they do now; ends with the recording.
    #[arg(long, value_name = "FILE", conflicts_with = "tracker")]
    pub replay_input: Option<PathBuf>,
    /// Keep the cores of this machine from falling asleep while the run goes on, where this user may: frames pass between processes faster, for more electricity.
    #[arg(long)]
    pub stay_awake: bool,
    /// Say nothing but errors.
    #[arg(long, short)]
    pub quiet: bool,
}

/// How facets draw.
#[derive(Args, Clone, Default)]
#[command(next_help_heading = "Pictures")]
pub struct DrawOptions {
    /// Write every frame that is shown into a folder for each facet, frame_000000.png and so on, with frames.jsonl beside them.
    #[arg(long, value_name = "DIR")]
    pub frames_dir: Option<PathBuf>,
    /// Write only frames.jsonl of each facet: number, state and picture of every frame that was shown.
    #[arg(long, value_name = "DIR", conflicts_with = "frames_dir")]
    pub log_dir: Option<PathBuf>,
    /// Draw the number of the frame into the picture: in figures, and as squares for programs.
    #[arg(long)]
    pub burn_in: bool,
    /// usual, fast or fastest, or parts of it as for tumble view (default: usual; fast in windows where a software driver draws).
    #[arg(long, value_name = "NAME")]
    pub quality: Option<Quality>,
    /// Draw into memory even where there is a display.
    #[arg(long)]
    pub offscreen: bool,
    /// Draw nothing: states are applied and acknowledged.
    #[arg(long, conflicts_with_all = ["frames_dir", "burn_in"])]
    pub no_pictures: bool,
}

/// `tumble cave`.
#[derive(Args, Clone)]
pub struct CaveOptions {
    #[command(flatten)]
    pub serve: ServeOptions,
    #[command(flatten)]
    pub draw: DrawOptions,
    /// One process that draws all facets, unfolded into one picture, in place of one process per facet.
    #[arg(long)]
    pub preview: bool,
    /// Start a facet again that ended by itself or was killed; at most 5 times in a minute.
    #[arg(long)]
    pub restart: bool,
}

/// `tumble replay`.
#[derive(Args, Clone)]
pub struct ReplayOptions {
    /// A recording of a run in a cave (`tumble cave --record`), complete or cut.
    pub file: PathBuf,
    #[command(flatten)]
    pub cave: CaveOptions,
}

/// `tumble recover`.
#[derive(Args, Clone)]
pub struct RecoverOptions {
    /// A recording (MCAP) that was cut or damaged.
    pub file: PathBuf,
    /// Where all of it goes that can be saved; must not exist.
    #[arg(long, short, value_name = "FILE")]
    pub output: PathBuf,
}

/// `tumble facet`.
#[derive(Args, Clone)]
pub struct FacetOptions {
    /// The scene, as the server was given it.
    #[arg(value_name = "SCENE")]
    pub scene: String,
    #[command(flatten)]
    pub opening: OpeningOptions,
    #[command(flatten)]
    pub surroundings: CaveSceneOptions,
    /// The facet of the cave.
    #[arg(long, value_name = "NAME", required_unless_present = "preview")]
    pub facet: Option<String>,
    /// All facets in one picture, for a server that was started with --preview.
    #[arg(long, conflicts_with = "facet")]
    pub preview: bool,
    /// The server, where frames come as datagrams (default: the run that goes on in this cave on this machine).
    #[arg(long, value_name = "ADDR:PORT")]
    pub server: Option<SocketAddr>,
    /// The run, where frames come through shared memory.
    #[arg(long, value_name = "NUMBER", conflicts_with = "server")]
    pub run: Option<String>,
    /// How long to wait for a server, at the start and when it is lost, s.
    #[arg(long, value_name = "S", default_value = "10", value_parser = crate::args::seconds)]
    pub connect_timeout: f64,
    #[command(flatten)]
    pub draw: DrawOptions,
    /// Started by a launcher: ends when stdin does, which is when the launcher ends, however that is.
    #[arg(long, hide = true)]
    pub parent_watch: bool,
}
