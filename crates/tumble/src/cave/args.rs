//! Options of `tumble cave`, `tumble serve`, `tumble facet`, `tumble replay` and `tumble recover`.

use crate::args::{Overlays, SceneOptions};
use crate::cave::tracker::lead::Lead;
use crate::cave::tracker::one_euro::Smoothing;
use crate::cave::tracker::sealed::MAX_RELAYS;
use crate::cave::tracker::smoothed::HeadOptions;
use clap::{Args, Subcommand, ValueEnum};
use std::net::SocketAddr;
use std::path::PathBuf;
use tumble::render::{DebugDraw, Quality, UnknownOverlay};
use tumble::scene::cave::{Compute, DeviceMap};

/// The cave and the environment of the scene. Server and facets must get the same.
#[derive(Args, Clone)]
pub struct CaveSceneOptions {
    /// Cave file, or name of a shipped cave.
    #[arg(long, value_name = "CAVE")]
    pub cave: String,
    /// Another scene that supplies camera, lights, sky, ground, the cave's place and static bodies
    /// without collisions. They replace those of the first scene, except its bodies.
    #[arg(long, value_name = "FILE")]
    pub environment: Option<String>,
}

/// Transport of the frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum TransportKind {
    /// Memory shared by processes of one machine.
    #[value(name = "shared_memory")]
    SharedMemory,
    /// UDP datagrams.
    Udp,
}

/// Place where the world is stepped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ComputeKind {
    /// On the server, which sends poses.
    Server,
    /// On every node: inputs are sent, and the hashes of all states are compared.
    Everywhere,
}

impl From<Compute> for ComputeKind {
    fn from(compute: Compute) -> ComputeKind {
        match compute {
            Compute::Server => ComputeKind::Server,
            Compute::Everywhere => ComputeKind::Everywhere,
        }
    }
}

/// Options of a server.
#[derive(Args, Clone)]
pub struct ServeOptions {
    #[command(flatten)]
    pub scene: SceneOptions,
    #[command(flatten)]
    pub surroundings: CaveSceneOptions,
    /// Simulated time to run for, s (default: until Ctrl-C).
    #[arg(long, value_name = "S", value_parser = crate::args::seconds)]
    pub duration: Option<f64>,
    /// Maximum number of frames per simulated second; a frame holds as many steps as fit, at least
    /// one.
    #[arg(long, value_name = "N", default_value = "60", value_parser = crate::args::rate)]
    pub fps: f64,
    /// Run as fast as possible: each frame begins when the last one is shown, and waits for its
    /// facets as long as the start does.
    #[arg(long)]
    pub no_realtime: bool,
    /// Transport of the frames (default: as the cave says).
    #[arg(long, value_name = "NAME")]
    pub transport: Option<TransportKind>,
    /// Address to listen on with --transport udp (default: 127.0.0.1 and a free port; every address
    /// and the cave's port if the cave has remote nodes).
    #[arg(long, value_name = "ADDR:PORT")]
    pub listen: Option<SocketAddr>,
    /// Timeout for facets to join at the start, s (default: connect_timeout_ms of the cave). It
    /// begins when the facets that this command has started have compiled their pipelines.
    #[arg(long, visible_alias = "wait", value_name = "S", value_parser = crate::args::seconds)]
    pub connect_timeout: Option<f64>,
    /// End the run in progress in this cave and take its place.
    #[arg(long)]
    pub replace: bool,
    /// Record states, inputs and acknowledgements (MCAP), instead of [recording] in the cave file.
    #[arg(long, value_name = "FILE")]
    pub record: Option<PathBuf>,
    /// Write the images of all cameras to the recording, also to that of the cave file.
    #[arg(long)]
    pub record_cameras: bool,
    /// Write counts and timings (JSON).
    #[arg(long, value_name = "FILE")]
    pub summary: Option<PathBuf>,
    /// Add kinematic colliders for the users: an upright capsule of radius 0.25 m and two hands
    /// each.
    #[arg(long)]
    pub user_colliders: bool,
    /// Receive a tracker (OSC over UDP) at this address; the rest is taken from [tracker] of the
    /// cave file. The datagrams are not authenticated, so an address other than loopback needs
    /// senders.
    #[arg(long, value_name = "ADDR:PORT")]
    pub tracker: Option<SocketAddr>,
    /// Addresses from which the tracker's datagrams are accepted, instead of `senders` of the cave
    /// file.
    #[arg(long, value_name = "IP,…", value_delimiter = ',')]
    pub tracker_from: Vec<std::net::IpAddr>,
    /// Take the users' positions from a VRPN server (TCP, usually port 3883) instead of OSC. Axes and origin
    /// are those of [tracker] in the cave file.
    #[arg(long, value_name = "HOST:PORT", conflicts_with = "tracker", requires = "vrpn_map")]
    pub vrpn: Option<String>,
    /// The part that a device of the VRPN server moves: DEVICE=USER/PART or DEVICE:SENSOR=USER/PART, separated by
    /// commas. A part is head, wand, hand/left, hand/right or buttons.
    #[arg(long, value_name = "MAP,…", value_delimiter = ',', requires = "vrpn")]
    pub vrpn_map: Vec<DeviceMap>,
    /// Read the tracker's datagrams as output of DTrack, and take the users' positions from its bodies:
    /// body:NUMBER=USER/PART or flystick:NUMBER=USER/PART, separated by commas. A part is head, wand, hand/left,
    /// hand/right, or buttons of a flystick.
    #[arg(long, value_name = "MAP,…", value_delimiter = ',', conflicts_with = "vrpn")]
    pub dtrack_map: Vec<DeviceMap>,
    /// Take head and hands of this user from a headset of this machine by OpenXR, without drawing into it; the runtime
    /// needs XR_MND_headless. Users and origin are those of [tracker] in the cave file.
    #[arg(long, value_name = "USER", conflicts_with_all = ["tracker", "vrpn", "dtrack_map"])]
    pub openxr: Option<String>,
    /// Take the first gamepad of this machine for this user: sticks walk and turn, buttons are digits.
    #[arg(long, value_name = "USER")]
    pub gamepad: Option<String>,
    /// Smooth tracked heads by a 1 € filter with this cutoff at rest, Hz; less is smoother, 1 to 2 suits heads.
    #[arg(long, value_name = "HZ", value_parser = crate::args::cutoff)]
    pub tracker_smooth: Option<f64>,
    /// Draw tracked heads where they will be when the picture is shown. auto measures the time from the receipt of a
    /// pose to the presentation of its frame; auto+MS adds what the run cannot see, such as scan-out and projector;
    /// MS alone is a constant, from the receipt.
    #[arg(long, value_name = "auto|auto+MS|MS")]
    pub tracker_lead: Option<Lead>,
    /// Send contacts to a sound engine at this address: impacts, slides and listeners as OSC over UDP.
    #[arg(long, value_name = "ADDR:PORT")]
    pub sound: Option<SocketAddr>,
    #[command(flatten)]
    pub play: crate::player::PlayOptions,
    /// Write the sound of the run at each user's head: DIR/USER.wav, one gain for all.
    #[arg(long, value_name = "DIR", requires = "duration", conflicts_with_all = ["console", "then"])]
    pub audio: Option<PathBuf>,
    /// Stream the run to Foxglove (WebSocket); every machine that reaches the address can watch.
    #[cfg(feature = "foxglove")]
    #[arg(long, value_name = "ADDR:PORT", num_args = 0..=1, default_missing_value = "127.0.0.1:8765")]
    pub foxglove: Option<SocketAddr>,
    /// Apply the users' inputs of a recorded run instead of live ones; ends with the recording.
    #[arg(long, value_name = "FILE", conflicts_with = "tracker")]
    pub replay_input: Option<PathBuf>,
    /// Prevent idle states of the cores during the run, if this user may. Frames pass between
    /// processes faster, at the cost of electric power.
    #[arg(long)]
    pub stay_awake: bool,
    /// Send the contacts of every frame, at most the 256 with the largest forces, for overlays of
    /// facets.
    #[arg(long)]
    pub contacts: bool,
    /// Send the events of every frame, at most 1024, for programs that read them in a facet. The readings of
    /// sensors are sent always.
    #[arg(long)]
    pub events: bool,
    /// Place where the world is stepped (default: as the cave says). With everywhere, each facet steps it
    /// by itself from the users' inputs, and its states are compared with the server's.
    #[arg(long, value_name = "WHERE")]
    pub compute: Option<ComputeKind>,
    /// Serve an operator's console (page and `tumble console`) at this address. Clients need the token
    /// of the run, which this user finds by itself, or that of --console-token.
    #[arg(long, value_name = "ADDR:PORT", num_args = 0..=1, default_missing_value = crate::cave::console::DEFAULT_ADDRESS)]
    pub console: Option<SocketAddr>,
    /// File with the console's token, at least 16 characters; required if other machines reach the
    /// address of --console.
    #[arg(long, value_name = "FILE", requires = "console")]
    pub console_token: Option<PathBuf>,
    /// Another scene, which begins when the one before ends or at the console's `next`; may be given
    /// several times.
    #[arg(long, value_name = "SCENE")]
    pub then: Vec<String>,
    /// Print errors only.
    #[arg(long, short)]
    pub quiet: bool,
}

/// Options of `tumble console`.
#[derive(Args, Clone)]
pub struct ConsoleOptions {
    /// Address of the console (`--console` of the run).
    #[arg(value_name = "ADDR:PORT")]
    pub address: SocketAddr,
    /// File with the token (default: that of a run of this user on this machine).
    #[arg(long, value_name = "FILE", global = true)]
    pub token_file: Option<PathBuf>,
    /// Print the answer as JSON.
    #[arg(long, global = true)]
    pub json: bool,
    #[command(subcommand)]
    pub command: ConsoleCommand,
}

/// Request of a console.
#[derive(Subcommand, Clone)]
pub enum ConsoleCommand {
    /// Print the state of the run; exit code 1 if there are alarms
    Status,
    /// Print the last lines of all processes
    Log,
    /// Let simulated time stand
    Pause,
    /// Let simulated time go on
    Resume,
    /// Set the world back to its first state
    Reset,
    /// End this scene and begin the next one of --then
    Next,
    /// Record into a file, written where the run was started
    Record {
        /// Name without folders that ends with .mcap.
        file: String,
    },
    /// End the recording
    Unrecord,
    /// Replay a recording of this scene, then begin the scene again
    Replay {
        /// Name without folders that ends with .mcap, where the run was started.
        file: String,
    },
    /// Show a calibration pattern on all facets: grid, corners, colors, ramps, blend, convergence, name;
    /// off shows the scene again
    Pattern {
        /// The pattern, or off.
        name: String,
    },
    /// End the run
    Stop,
}

/// Overlays of a facet, which knows poses and contacts; no words mean none.
#[derive(Clone, Default)]
pub struct FacetOverlays {
    words: String,
    /// The overlays to draw.
    pub draw: DebugDraw,
}

impl FacetOverlays {
    /// Returns whether an overlay shows contacts.
    pub fn needs_contacts(&self) -> bool {
        self.draw.contacts || self.draw.normals || self.draw.forces
    }
}

impl std::str::FromStr for FacetOverlays {
    type Err = String;

    fn from_str(words: &str) -> Result<FacetOverlays, String> {
        if let Some(word) = words.split(',').map(str::trim).find(|w| ["velocities", "islands", "sleep"].contains(w)) {
            return Err(format!(
                "a facet of a cave cannot draw {word}; expected contacts, normals, forces, joints, frames, tree=LEVEL or all"
            ));
        }
        let Overlays(draw) = words.parse().map_err(|e: UnknownOverlay| e.to_string())?;
        Ok(FacetOverlays { words: words.to_owned(), draw: DebugDraw { velocities: false, ..draw } })
    }
}

impl std::fmt::Display for FacetOverlays {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.words)
    }
}

/// Options of drawing facets.
#[derive(Args, Clone, Default)]
#[command(next_help_heading = "Pictures")]
pub struct DrawOptions {
    /// Write every shown frame into a folder per facet, as frame_000000.png and so on, with
    /// frames.jsonl beside them.
    #[arg(long, value_name = "DIR")]
    pub frames_dir: Option<PathBuf>,
    /// Write only frames.jsonl of each facet: number, state hash and picture hash of every shown
    /// frame.
    #[arg(long, value_name = "DIR", conflicts_with = "frames_dir")]
    pub log_dir: Option<PathBuf>,
    /// Remove the frames of an earlier run from the folder of --frames-dir or --log-dir. Without it
    /// such a folder is refused.
    #[arg(long)]
    pub overwrite: bool,
    /// Draw the frame number into the picture: as digits, and as squares for programs.
    #[arg(long)]
    pub burn_in: bool,
    /// default, fast or fastest, or parts of it as for tumble view (default: default; fast with a
    /// software driver).
    #[arg(long, value_name = "NAME")]
    pub quality: Option<Quality>,
    /// Overlays: contacts, normals, forces, joints, frames, tree=LEVEL, all; separated by commas.
    /// The first three need a server that sends contacts, as that of `tumble cave` then does.
    #[arg(long, value_name = "WHAT", default_value = "")]
    pub debug_draw: FacetOverlays,
    /// Draw into memory even if there is a display.
    #[arg(long)]
    pub offscreen: bool,
    /// Look at the own pictures for the operator's console. A launcher with --console sets it.
    #[arg(long, hide = true)]
    pub watch_pictures: bool,
    /// Draw nothing: states are applied and acknowledged.
    #[arg(long, conflicts_with_all = ["frames_dir", "burn_in"])]
    pub no_pictures: bool,
}

/// Options of facets on the screens of web browsers.
#[derive(Args, Clone)]
#[command(next_help_heading = "Web browsers")]
pub struct WebOptions {
    /// Show facets in web browsers: each facet of this machine serves a page at this address, the next one at
    /// the next port, process by process. The link of each is printed.
    #[arg(long, value_name = "ADDR:PORT", num_args = 0..=1, default_missing_value = "127.0.0.1:47400")]
    #[arg(conflicts_with_all = ["preview", "no_pictures", "burn_in"])]
    pub web: Option<SocketAddr>,
    /// File with the key of the links, at least 16 letters, digits and -_.~ (default: a new one for each run).
    #[arg(long, value_name = "FILE", requires = "web")]
    pub web_key: Option<PathBuf>,
    /// Time for a browser to draw a frame, ms. One that takes longer is no longer awaited until it is faster.
    #[arg(long, value_name = "MS", requires = "web", default_value = "100", value_parser = crate::args::web_timeout)]
    pub web_timeout: f64,
    /// Key of the links for all scenes of this launcher, which draws it.
    #[arg(skip)]
    pub drawn_key: Option<String>,
}

/// Options of `tumble cave`.
#[derive(Args, Clone)]
pub struct CaveOptions {
    #[command(flatten)]
    pub serve: ServeOptions,
    #[command(flatten)]
    pub draw: DrawOptions,
    #[command(flatten)]
    pub web: WebOptions,
    /// Facets of --web (default: all of this machine).
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', requires = "web", help_heading = "Web browsers")]
    pub web_facets: Vec<String>,
    /// Start one process that draws all facets, unfolded into one picture, instead of one process
    /// per facet.
    #[arg(long)]
    pub preview: bool,
    /// Draw all facets of a machine with one graphics adapter in one process, instead of one process per facet
    /// (default: as `process` in the cave file says).
    #[arg(long, conflicts_with = "preview")]
    pub one_process: bool,
    /// Restart a facet that ended by itself or was killed, at most 5 times in a minute.
    #[arg(long)]
    pub restart: bool,
    /// Keep a second process of each facet of a window or in memory ready, which takes the place of one that
    /// ended. It has compiled its pipelines and takes as much memory as the first.
    #[arg(long, requires = "restart")]
    pub stand_by: bool,
}

/// Options of `tumble replay`.
#[derive(Args, Clone)]
pub struct ReplayOptions {
    /// Recording of a run in a cave (`tumble cave --record`), complete or truncated.
    pub file: PathBuf,
    #[command(flatten)]
    pub cave: CaveOptions,
}

/// Options of `tumble recover`.
#[derive(Args, Clone)]
pub struct RecoverOptions {
    /// Truncated or damaged recording (MCAP).
    pub file: PathBuf,
    /// New file for everything that can be recovered; must not exist.
    #[arg(long, short, value_name = "FILE")]
    pub output: PathBuf,
}

/// Options of `tumble relay`.
#[derive(Args, Clone)]
pub struct RelayOptions {
    /// Cave file, or name of a shipped cave. The key file of its [security] seals the datagrams.
    #[arg(long, value_name = "CAVE")]
    pub cave: String,
    /// Address of the server's tracker, as this machine reaches it.
    #[arg(long, value_name = "ADDR:PORT")]
    pub to: SocketAddr,
    /// Address at which the tracker's datagrams arrive.
    #[arg(long, value_name = "ADDR:PORT", default_value = "127.0.0.1:47200")]
    pub listen: SocketAddr,
    /// Addresses from which datagrams are accepted; required if others than this machine reach the
    /// address of --listen.
    #[arg(long, value_name = "IP,…", value_delimiter = ',')]
    pub from: Vec<std::net::IpAddr>,
    /// Number of this relay, 0 to 7; each relay of a server has another one.
    #[arg(long, value_name = "N", default_value = "0", value_parser = clap::value_parser!(u16).range(0..i64::from(MAX_RELAYS)))]
    pub number: u16,
}

/// Options of `tumble facet`.
#[derive(Args, Clone)]
pub struct FacetOptions {
    /// The scene, as the server got it.
    #[command(flatten)]
    pub scene: SceneOptions,
    #[command(flatten)]
    pub surroundings: CaveSceneOptions,
    /// Place where the world is stepped (default: as the cave says). With everywhere, this facet steps it by
    /// itself; the options of stepping and --user-colliders must then be the server's.
    #[arg(long, value_name = "WHERE")]
    pub compute: Option<ComputeKind>,
    /// With --compute everywhere: the server has --user-colliders.
    #[arg(long)]
    pub user_colliders: bool,
    /// For tests of the comparison: after this frame of the world one bit of its state is wrong.
    #[arg(long, hide = true, value_name = "N")]
    pub disturb_after: Option<u64>,
    /// Name of the facet in the cave. Several names, separated by commas, are drawn by this process
    /// together: with one device and one copy of the world.
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', required_unless_present = "preview")]
    pub facet: Vec<String>,
    /// Draw all facets in one picture, for a server started with --preview.
    #[arg(long, conflicts_with = "facet")]
    pub preview: bool,
    /// Address of the server, for frames over UDP (default: the run in progress in this cave on
    /// this machine).
    #[arg(long, value_name = "ADDR:PORT")]
    pub server: Option<SocketAddr>,
    /// Number of the run, for frames through shared memory.
    #[arg(long, value_name = "NUMBER", conflicts_with = "server")]
    pub run: Option<String>,
    /// Timeout for a server, at the start and after its loss, s.
    #[arg(long, visible_alias = "wait", value_name = "S", default_value = "10", value_parser = crate::args::seconds)]
    pub connect_timeout: f64,
    #[command(flatten)]
    pub draw: DrawOptions,
    #[command(flatten)]
    pub web: WebOptions,
    /// End when stdin ends. A launcher sets it, so that a facet ends with its launcher in any case.
    #[arg(long, hide = true)]
    pub parent_watch: bool,
    /// Continue the frames that this run has written before. A launcher sets it when it starts a
    /// facet again.
    #[arg(long, hide = true, conflicts_with = "overwrite")]
    pub continue_frames: bool,
    /// Prepare, and join when the launcher says so. A launcher with --stand-by sets it.
    #[arg(long, hide = true, requires = "parent_watch", conflicts_with = "web")]
    pub stand_by: bool,
}

impl ServeOptions {
    /// Returns how tracked heads are smoothed and predicted; `None` for as they are.
    pub fn heads(&self) -> Option<HeadOptions> {
        let wanted = self.tracker_smooth.is_some() || self.tracker_lead.is_some();
        let smoothing = Smoothing { rest_hz: self.tracker_smooth, beta: Smoothing::BETA };
        wanted.then_some(HeadOptions { smoothing, lead: self.tracker_lead.unwrap_or(Lead::Stated(0.0)) })
    }
}
