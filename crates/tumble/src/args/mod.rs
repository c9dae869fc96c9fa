//! The command line: commands and their options.

mod caves;
mod scene;
mod values;

pub use caves::{CalibrateAction, CalibrateOptions, CavesOptions, MpcdiOptions, SolveOptions};
pub use scene::{OpeningOptions, SceneOptions, kind};
pub use values::{cutoff, gain, rate, seconds, web_timeout};

use crate::cave::args::{
    CaveOptions, ConsoleOptions, FacetOptions, RecoverOptions, RelayOptions, ReplayOptions, ServeOptions,
};
use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;
use tumble::collide::Builder;
use tumble::render::{DebugDraw, Quality};
use tumble::scene::urdf::{JointPositions, MissingMeshes};
use values::{
    folder, fraction, joint_positions, method, missing, package, per_link, planner, png, pose_count, size, wav,
};

/// Real-time dynamics for interactive and immersive environments.
#[derive(Parser)]
#[command(version, name = "tumble")]
pub struct Tumble {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Subcommand)]
pub enum Command {
    /// Simulate a scene; write a recording, a summary, pictures or a video
    Run(RunOptions),
    /// Show a scene in a window, with keys, mouse and sliders for joints
    View(ViewOptions),
    /// Run a scene in a cave: one process that simulates, one per facet that draws
    Cave(Box<CaveOptions>),
    /// Run the server of a cave alone; facets are started by hand
    Serve(Box<ServeOptions>),
    /// Draw one facet of a cave, from a server that runs or will run
    Facet(Box<FacetOptions>),
    /// Watch and direct a run in a cave by its console: status, pause, reset, record and others
    Console(ConsoleOptions),
    /// Forward the datagrams of a tracker to the server of a cave, sealed
    Relay(RelayOptions),
    /// Show a recording in a cave, and compare its pictures with those recorded
    Replay(Box<ReplayOptions>),
    /// Compute a recording again from its scene, and name the first frame that differs
    Verify(VerifyOptions),
    /// Save the intact part of a recording that was cut or damaged
    Recover(RecoverOptions),
    /// Check scenes, caves, URDF robots and meshes without running them
    Check(CheckOptions),
    /// Build a sphere tree around a mesh, or a robot of spheres
    #[command(name = "spheretree")]
    SphereTree(SphereTreeOptions),
    /// List the shipped scenes
    Scenes,
    /// List the shipped caves, or draw a calibration pattern for a facet
    Caves(CavesOptions),
    /// Measure a cave with a camera: patterns for projectors, warps of photographs
    Calibrate(CalibrateOptions),
    /// Make a cave of an MPCDI archive or a configuration of SGCT, or an archive of a cave
    Mpcdi(MpcdiOptions),
    /// Print a script that completes commands and options in a shell
    Completions(CompletionOptions),
}

/// Options of `tumble verify`.
#[derive(Args)]
pub struct VerifyOptions {
    /// Recording (MCAP) of a run.
    pub recording: PathBuf,
    #[command(flatten)]
    pub scene: SceneOptions,
}

#[derive(Args)]
pub struct RunOptions {
    #[command(flatten)]
    pub scene: SceneOptions,
    /// Simulated time of the run, s (default: from the scene).
    #[arg(long, help_heading = "Stepping", value_name = "S", value_parser = seconds)]
    pub duration: Option<f64>,
    /// Write the world at the end as a scene, with its files beside it; running that goes on with the same
    /// bits.
    #[arg(long, help_heading = "Results", value_name = "FILE.toml")]
    pub save_scene: Option<PathBuf>,
    /// Write a recording (MCAP; opens in Foxglove).
    #[arg(long, help_heading = "Results", value_name = "FILE")]
    pub record: Option<PathBuf>,
    /// Write the images of all cameras to the recording.
    #[arg(long, help_heading = "Results", requires = "record")]
    pub record_cameras: bool,
    /// Write a summary (JSON).
    #[arg(long, help_heading = "Results", value_name = "FILE")]
    pub summary: Option<PathBuf>,
    /// Write a picture of the last frame (PNG).
    #[arg(long, help_heading = "Pictures", value_name = "FILE", value_parser = png)]
    pub screenshot: Option<PathBuf>,
    /// Size of the picture, pixels. An unfolded cave is fitted into it (default: 1280x720; a facet
    /// has the size in its cave file).
    #[arg(long, help_heading = "Pictures", value_name = "WxH", value_parser = size)]
    pub size: Option<(u32, u32)>,
    /// Draw for a cave: all its facets, unfolded into one picture. A cave file or the name of a
    /// shipped cave.
    #[arg(long, help_heading = "Pictures", value_name = "CAVE")]
    pub cave: Option<String>,
    /// Draw this facet of the cave alone, as its projector shows it.
    #[arg(long, help_heading = "Pictures", value_name = "NAME")]
    pub facet: Option<String>,
    /// Write pictures of the run into a folder: frame_000000.png and so on.
    #[arg(long, help_heading = "Pictures", value_name = "DIR")]
    pub frames_dir: Option<PathBuf>,
    /// Remove the pictures of an earlier run from the folder of --frames-dir. Without it such a folder
    /// is refused.
    #[arg(long, help_heading = "Pictures")]
    pub overwrite: bool,
    /// Write a video of the run. It needs the program ffmpeg; the extension selects the format,
    /// such as .mp4.
    #[arg(long, help_heading = "Pictures", value_name = "FILE")]
    pub video: Option<PathBuf>,
    /// Write the sound of the run, heard from the camera, as a WAV file.
    #[arg(long, help_heading = "Pictures", value_name = "FILE", value_parser = wav)]
    pub audio: Option<PathBuf>,
    /// Gain of the sound, dB (default: the peak is brought to -3 dB). A peak above full scale is lowered to it.
    #[arg(
        long,
        help_heading = "Pictures",
        value_name = "DB",
        requires = "audio",
        allow_negative_numbers = true,
        value_parser = gain
    )]
    pub audio_gain: Option<f64>,
    /// Frames of the video, and pictures in the folder, per simulated second.
    #[arg(long, help_heading = "Pictures", value_name = "N", default_value = "30", value_parser = rate)]
    pub fps: f64,
    /// Overlays: contacts, normals, velocities, forces, joints, frames, islands, sleep, tree=LEVEL,
    /// all; separated by commas.
    #[arg(long, help_heading = "Pictures", value_name = "WHAT", default_value = "")]
    pub debug_draw: Overlays,
    /// Quality of pictures against speed: default, fast, fastest, and shadows=off|hard|soft,
    /// samples=1|4, occlusion=on|off, reflections=on|off, resolution=full|half, map=TEXELS; separated by commas.
    #[arg(long, help_heading = "Pictures", value_name = "WHAT", default_value = "default")]
    pub quality: tumble::render::Quality,
    /// The camera: scene, or the name of an object with a camera.
    #[arg(long, help_heading = "Pictures", value_name = "NAME", conflicts_with = "cave")]
    pub camera: Option<String>,
    /// Restore a saved state before the first step.
    #[arg(long, help_heading = "Results", value_name = "FILE")]
    pub restore: Option<PathBuf>,
    /// Save the state after the last step.
    #[arg(long, help_heading = "Results", value_name = "FILE")]
    pub save: Option<PathBuf>,
    /// Print nothing but errors.
    #[arg(long, short, help_heading = "Results")]
    pub quiet: bool,
}

#[derive(Args)]
#[command(after_help = "In the window, H shows what keys and mouse do.")]
pub struct ViewOptions {
    #[command(flatten)]
    pub scene: SceneOptions,
    /// Size of the window, pixels. An unfolded cave is fitted into it (default: 1280x720; a facet
    /// has the size in its cave file).
    #[arg(long, help_heading = "Window", value_name = "WxH", value_parser = size)]
    pub size: Option<(u32, u32)>,
    /// Look through the screens of a cave that moves with the user. A cave file or the name of a
    /// shipped cave.
    #[arg(long, help_heading = "Window", value_name = "CAVE")]
    pub cave: Option<String>,
    /// Show this facet of the cave alone, as its projector shows it, in a window without a frame.
    #[arg(long, help_heading = "Window", value_name = "NAME", requires = "cave", conflicts_with = "preview")]
    pub facet: Option<String>,
    /// Show all facets of the cave, unfolded; this is the default with --cave.
    #[arg(long, help_heading = "Window", requires = "cave")]
    pub preview: bool,
    /// The first camera: scene, one on a body or link, front, left, back, right or top.
    #[arg(long, help_heading = "Window", value_name = "NAME")]
    pub camera: Option<String>,
    /// Overlays: contacts, normals, velocities, forces, joints, frames, islands, sleep, tree=LEVEL,
    /// all; separated by commas.
    #[arg(long, help_heading = "Window", value_name = "WHAT", default_value = "")]
    pub debug_draw: Overlays,
    /// Quality of pictures against speed: default, fast or fastest, or shadows=off|hard|soft,
    /// samples=1|4, occlusion=on|off, reflections=on|off, resolution=full|half, map=TEXELS; separated by commas (default:
    /// default; fast with a software driver).
    #[arg(long, help_heading = "Window", value_name = "WORDS")]
    pub quality: Option<Quality>,
    /// Start paused.
    #[arg(long, help_heading = "Session")]
    pub paused: bool,
    /// Start without text over the picture.
    #[arg(long, help_heading = "Window")]
    pub no_hud: bool,
    /// Pictures per second, at most (default: the desktop's refresh rate).
    #[arg(long, help_heading = "Window", value_name = "N", value_parser = rate)]
    pub fps: Option<f64>,
    #[command(flatten, next_help_heading = "Session")]
    pub play: crate::player::PlayOptions,
    /// End at this simulated time, s.
    #[arg(long, help_heading = "Stepping", value_name = "S", value_parser = seconds)]
    pub duration: Option<f64>,
    /// End after this number of pictures.
    #[arg(long, help_heading = "Session", value_name = "N")]
    pub frames: Option<u64>,
    /// Write the last picture (PNG).
    #[arg(long, help_heading = "Session", value_name = "FILE", value_parser = png)]
    pub screenshot: Option<PathBuf>,
    /// Folder for the screenshots of the key P: SCENE_000123.png, with the number of the step.
    #[arg(long, help_heading = "Session", value_name = "DIR", default_value = ".")]
    pub screenshot_dir: PathBuf,
    /// Write the state of the window as lines of JSON, at each change by the user and four times a
    /// second; - is stdout.
    #[arg(long, help_heading = "Session", value_name = "FILE|-")]
    pub status: Option<PathBuf>,
    /// Lose the graphics device after this number of pictures, as if a driver crashed; for tests.
    #[arg(long, value_name = "N", hide = true)]
    pub lose_device: Option<u64>,
}

#[derive(Args)]
pub struct CheckOptions {
    /// Scene files, folders, names of shipped scenes; cave files, names of shipped caves; .urdf
    /// robots; .xml models of MuJoCo; .obj, .stl, .ply and .dae meshes.
    #[arg(required = true)]
    pub files: Vec<String>,
    #[command(flatten)]
    pub opening: OpeningOptions,
}

#[derive(Args)]
#[command(override_usage = "tumble spheretree [OPTIONS] MESH\n       tumble spheretree [OPTIONS] --urdf ROBOT")]
pub struct SphereTreeOptions {
    /// A closed mesh: .obj, .stl, .ply or .dae.
    #[arg(conflicts_with = "urdf")]
    pub mesh: Option<PathBuf>,
    /// Method of building: medial (adaptive medial axis, the tightest; default), hubbard (medial
    /// axis of fixed samples), grid (cubes of a grid) or octree (the fastest).
    #[arg(long, value_name = "NAME", value_parser = method)]
    pub method: Option<Builder>,
    /// Largest number of children of a sphere, 2 to 64 (default 8; an octree has 8).
    #[arg(long, value_name = "N")]
    pub branching: Option<u32>,
    /// Largest number of subdivisions, 1 to 9 (default 3; for an octree 7).
    #[arg(long, value_name = "N")]
    pub depth: Option<u32>,
    /// Outward error at which spheres are not subdivided further: a fraction of the mesh's
    /// diagonal, 0.0001 to 1 (default 0.0001; for an octree 0.01, to which all its leaves are
    /// grown; with --urdf 0.001).
    #[arg(long, value_name = "SHARE", value_parser = fraction)]
    pub max_error: Option<f64>,
    /// Repair holes and dangling parts before building. Notes list the repairs.
    #[arg(long, conflicts_with = "urdf")]
    pub repair: bool,
    /// Write the tree (JSON), or with --urdf the URDF of spheres, to a file that ends in .urdf or .xml.
    #[arg(long, short, value_name = "FILE", visible_alias = "json")]
    pub output: Option<PathBuf>,
    /// Write a picture (PNG) of a level over the mesh.
    #[arg(long, help_heading = "Picture", value_name = "FILE", conflicts_with = "urdf", value_parser = png)]
    pub screenshot: Option<PathBuf>,
    /// Level in the picture; the root is level 0 (default: the last level).
    #[arg(long, help_heading = "Picture", value_name = "N", requires = "screenshot")]
    pub level: Option<u32>,
    /// Axis of the mesh that points up in the picture.
    #[arg(long, help_heading = "Picture", value_name = "x|y|z", default_value = "z", value_parser = ["x", "y", "z"])]
    pub up: String,
    /// Size of the picture, pixels.
    #[arg(long, help_heading = "Picture", value_name = "WxH", default_value = "960x720", value_parser = size)]
    pub size: (u32, u32),
    /// Folder of the cache of built trees (default: $TUMBLE_CACHE, else the user's cache folder).
    #[arg(long, value_name = "DIR", value_parser = folder)]
    pub cache: Option<PathBuf>,
    /// Build the tree even if it is cached, and cache nothing.
    #[arg(long, conflicts_with = "cache")]
    pub no_cache: bool,
    /// Replace the collision geometry of every link of this robot by spheres.
    #[arg(long, help_heading = "Robots", value_name = "ROBOT")]
    pub urdf: Option<PathBuf>,
    /// Folder of the package in package://NAME/...; may be given several times. Other packages are
    /// searched in the folders above the URDF.
    #[arg(long = "package", help_heading = "Robots", value_name = "NAME=DIR", requires = "urdf", value_parser = package)]
    pub packages: Vec<(String, PathBuf)>,
    /// If a collision mesh is missing: error, or skip it with a note.
    #[arg(long, help_heading = "Robots", value_name = "error|skip", requires = "urdf", default_value = "error", value_parser = missing)]
    pub missing_meshes: MissingMeshes,
    /// Number of spheres per link, at most; LINK=N for one link. May be given several times. A link
    /// gets fewer if all stay within --max-error (default 32, or 10000 with --max-error).
    #[arg(long, help_heading = "Robots", value_name = "N|LINK=N", requires = "urdf", value_parser = per_link::<usize>)]
    pub spheres: Vec<(Option<String>, usize)>,
    /// Share of the outer surface of a link that is covered at least, by area, above 0 and at most 1
    /// (default); LINK=SHARE for one link. May be given several times. Less is tighter.
    #[arg(long, help_heading = "Robots", value_name = "SHARE|LINK=SHARE", requires = "urdf", value_parser = per_link::<f64>)]
    pub coverage: Vec<(Option<String>, f64)>,
    /// Weight of coverage against volume outside the link, 0 (nothing outside) to 1 (full coverage);
    /// LINK=WEIGHT for one link. May be given several times. Minimizes weight times the share of the
    /// surface that is not covered plus (1 - weight) times the volume outside over that of the link,
    /// with at least --coverage if that is given.
    #[arg(long, help_heading = "Robots", value_name = "WEIGHT|LINK=WEIGHT", requires = "urdf", value_parser = per_link::<f64>)]
    pub weight: Vec<(Option<String>, f64)>,
    /// Print the links whose spheres overlap at these positions of joints (rad, m; the others at 0 or
    /// at the limit next to it); `zero` names none. May be given several times. The pose is taken to
    /// be free: --planner yaml lists its pairs under self_collision_ignore.
    #[arg(long = "pose", help_heading = "Robots", value_name = "JOINT=POSITION,...", requires = "urdf", value_parser = joint_positions)]
    pub poses: Vec<JointPositions>,
    /// Examine N poses within the limits of the joints, evenly distributed. Pairs of links that
    /// overlap at all of them go under self_collision_ignore, too.
    #[arg(long, help_heading = "Robots", value_name = "N", requires = "urdf", default_value_t = 0, value_parser = pose_count)]
    pub sample_poses: usize,
    /// Also write the spheres for motion planners: yaml (cuRobo) or json (foam, VAMP) beside the
    /// output, or a file that ends in .yml or .json.
    #[arg(long, help_heading = "Robots", value_name = "yaml|json|FILE", requires = "urdf", value_parser = planner)]
    pub planner: Option<PathBuf>,
    /// Print more figures and the stages of the builder.
    #[arg(long, short)]
    pub verbose: bool,
    /// Print nothing but errors.
    #[arg(long, short, conflicts_with = "verbose")]
    pub quiet: bool,
}

#[derive(Args)]
#[command(
    after_help = "bash:  tumble completions bash > ~/.local/share/bash-completion/completions/tumble\nzsh:   tumble completions zsh > DIR/_tumble, with DIR in $fpath\nfish:  tumble completions fish > ~/.config/fish/completions/tumble.fish"
)]
pub struct CompletionOptions {
    /// The shell.
    pub shell: clap_complete::Shell,
}

/// Overlays of `--debug-draw`; an empty word means none.
#[derive(Clone, Copy, Default)]
pub struct Overlays(pub DebugDraw);

impl std::str::FromStr for Overlays {
    type Err = tumble::render::UnknownOverlay;

    fn from_str(words: &str) -> Result<Overlays, Self::Err> {
        Ok(Overlays(if words.is_empty() { DebugDraw::default() } else { words.parse()? }))
    }
}
