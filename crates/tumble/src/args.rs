//! What can be typed.

use crate::cave::args::{CaveOptions, FacetOptions, RecoverOptions, ReplayOptions, ServeOptions};
use crate::failure::Failure;
use clap::{Args, Parser, Subcommand};
use std::path::{Path, PathBuf};
use tumble::collide::Builder;
use tumble::render::{CalibrationPattern, DebugDraw, MAX_PIXELS, MAX_SIDE, Quality};
use tumble::scene::urdf::{MissingMeshes, UrdfOptions};
use tumble::scene::{FileKind, Integrator, LoadOptions, SceneFile, Solver, Stepper, resolve_scene};

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
    /// Show a recording in a cave, and compare its pictures with those recorded
    Replay(Box<ReplayOptions>),
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
    /// Print a script that completes commands and options in a shell
    Completions(CompletionOptions),
}

/// What is simulated, and how it is stepped.
#[derive(Args, Clone)]
pub struct SceneOptions {
    /// A scene file, a folder that holds a scene.toml, the name of a shipped scene, a robot (.urdf) or a mesh (.obj, .stl, .ply, .dae).
    #[arg(value_name = "SCENE")]
    pub name: String,
    /// Length of a step, s (default: what the scene says).
    #[arg(long, help_heading = "Stepping", value_name = "S", value_parser = time_step)]
    pub dt: Option<f64>,
    /// time_stepping or backtracking.
    #[arg(long, help_heading = "Stepping", value_name = "NAME")]
    pub stepper: Option<Stepper>,
    /// gauss_seidel, lcp (short for lcp_pyramid), lcp_pyramid or lcp_sliding.
    #[arg(long, help_heading = "Stepping", value_name = "NAME", value_parser = solver)]
    pub solver: Option<Solver>,
    /// verlet, symplectic_euler, explicit_euler, rk4 or dormand_prince; time_stepping is the midpoint rule whatever is chosen.
    #[arg(long, help_heading = "Stepping", value_name = "NAME")]
    pub integrator: Option<Integrator>,
    #[command(flatten)]
    pub opening: OpeningOptions,
}

impl SceneOptions {
    /// The scene, with the settings that the command line gives.
    pub fn load(&self) -> Result<SceneFile, Failure> {
        let mut scene = self.opening.load(&self.name)?;
        let w = &mut scene.world;
        w.dt_s = self.dt.unwrap_or(w.dt_s);
        w.stepper = self.stepper.unwrap_or(w.stepper);
        w.solver = self.solver.unwrap_or(w.solver);
        w.integrator = self.integrator.unwrap_or(w.integrator);
        Ok(scene)
    }
}

/// How a robot or a mesh file is opened.
#[derive(Args, Clone)]
#[command(next_help_heading = "Robots and meshes")]
pub struct OpeningOptions {
    /// The root link of a URDF floats.
    #[arg(long, conflicts_with = "fixed_base")]
    pub floating: bool,
    /// The root link of a URDF is fixed to the world (default).
    #[arg(long)]
    pub fixed_base: bool,
    /// Where a package of package://NAME/... is; may be given several times. Others are looked for in the folders above the URDF.
    #[arg(long = "package", value_name = "NAME=DIR", value_parser = package)]
    pub packages: Vec<(String, PathBuf)>,
    /// What to do where a collision mesh of a URDF is not there: error, or skip it with a note.
    #[arg(long, value_name = "error|skip", value_parser = missing)]
    pub missing_meshes: Option<MissingMeshes>,
    /// Repair a mesh that is no solid: holes, fins, inner walls, debris. What was done is told; the file stays as it is.
    #[arg(long)]
    pub repair: bool,
}

impl OpeningOptions {
    /// The scene of that name or path; notes tell of a base that is fixed unasked.
    pub fn load(&self, name: &str) -> Result<SceneFile, Failure> {
        let mut scene = self.read(name)?;
        if kind(name) == FileKind::Urdf && !self.fixed_base && scene.has_fixed_base() {
            scene.notes.push(format!("{name}: the root link is fixed to the world; --floating frees it"));
        }
        Ok(scene)
    }

    /// The scene of that name or path.
    pub fn read(&self, name: &str) -> Result<SceneFile, Failure> {
        self.check(kind(name)).map_err(|option| Failure::input(format!("{name}: {option}")))?;
        let urdf = UrdfOptions {
            floating: self.floating,
            packages: self.packages.iter().cloned().collect(),
            missing_meshes: self.missing_meshes.unwrap_or_default(),
            ..UrdfOptions::default()
        };
        Ok(resolve_scene(name, &[])?.load_with(&LoadOptions { urdf, repair: self.repair })?)
    }

    /// Returns the options as they are typed, for a process that opens the same file.
    pub fn to_args(&self) -> Vec<String> {
        let switches = [("--floating", self.floating), ("--fixed-base", self.fixed_base), ("--repair", self.repair)];
        let mut args: Vec<String> = switches.iter().filter(|(_, on)| *on).map(|(name, _)| (*name).to_owned()).collect();
        args.extend(
            self.packages.iter().flat_map(|(name, dir)| ["--package".into(), format!("{name}={}", dir.display())]),
        );
        let missing = self.missing_meshes.map(|missing| match missing {
            MissingMeshes::Error => "error",
            MissingMeshes::Skip => "skip",
        });
        args.extend(missing.iter().flat_map(|word| ["--missing-meshes".to_owned(), (*word).to_owned()]));
        args
    }

    /// An option that says nothing about a file of this kind is refused.
    fn check(&self, kind: FileKind) -> Result<(), &'static str> {
        let robot = self.floating || self.fixed_base || !self.packages.is_empty() || self.missing_meshes.is_some();
        match kind {
            FileKind::Urdf if self.repair => {
                Err("--repair goes with a mesh; open meshes of a URDF collide by their hulls")
            }
            FileKind::Mesh | FileKind::Scene if robot => Err(
                "--floating, --fixed-base, --package and --missing-meshes go with a .urdf; a scene says so itself, under [[articulated]]",
            ),
            FileKind::Scene if self.repair => {
                Err("--repair goes with a mesh; a scene says `repair = true` under [meshes.NAME]")
            }
            _ => Ok(()),
        }
    }
}

/// What a name stands for; a name without an extension for a scene.
pub fn kind(name: &str) -> FileKind {
    FileKind::of(Path::new(name)).unwrap_or(FileKind::Scene)
}

#[derive(Args)]
pub struct RunOptions {
    #[command(flatten)]
    pub scene: SceneOptions,
    /// Simulated time to run for, s (default: what the scene says).
    #[arg(long, help_heading = "Stepping", value_name = "S", value_parser = seconds)]
    pub duration: Option<f64>,
    /// Write a recording (MCAP; opens in Foxglove).
    #[arg(long, help_heading = "Results", value_name = "FILE")]
    pub record: Option<PathBuf>,
    /// Write a summary (JSON).
    #[arg(long, help_heading = "Results", value_name = "FILE")]
    pub summary: Option<PathBuf>,
    /// Write a picture of the last frame (PNG).
    #[arg(long, help_heading = "Pictures", value_name = "FILE", value_parser = png)]
    pub screenshot: Option<PathBuf>,
    /// Size of the picture, pixels; an unfolded cave is made to fit (default: 1280x720; a facet has the size that its cave says).
    #[arg(long, help_heading = "Pictures", value_name = "WxH", value_parser = size)]
    pub size: Option<(u32, u32)>,
    /// Draw for a cave: all its facets, unfolded into one picture. A cave file or the name of a shipped cave.
    #[arg(long, help_heading = "Pictures", value_name = "CAVE")]
    pub cave: Option<String>,
    /// Draw this facet of the cave alone, as its projector gets it.
    #[arg(long, help_heading = "Pictures", value_name = "NAME")]
    pub facet: Option<String>,
    /// Write pictures of the run into a folder: frame_000000.png and so on.
    #[arg(long, help_heading = "Pictures", value_name = "DIR")]
    pub frames_dir: Option<PathBuf>,
    /// Write a video of the run (needs the program ffmpeg; the ending says the kind, such as .mp4).
    #[arg(long, help_heading = "Pictures", value_name = "FILE")]
    pub video: Option<PathBuf>,
    /// Frames of the video, and pictures in the folder, per simulated second.
    #[arg(long, help_heading = "Pictures", value_name = "N", default_value = "30", value_parser = rate)]
    pub fps: f64,
    /// Draw over the picture: contacts, normals, velocities, forces, joints, frames, islands, sleep, tree=LEVEL, all; with commas between them.
    #[arg(long, help_heading = "Pictures", value_name = "WHAT", default_value = "")]
    pub debug_draw: Overlays,
    /// Speed against looks: usual, fast, fastest, and shadows=off|hard|soft, samples=1|4, occlusion=on|off, reflections=on|off, map=TEXELS; with commas between them.
    #[arg(long, help_heading = "Pictures", value_name = "WHAT", default_value = "default")]
    pub quality: tumble::render::Quality,
    /// See from this camera: scene, or the name of an object that carries one.
    #[arg(long, help_heading = "Pictures", value_name = "NAME", conflicts_with = "cave")]
    pub camera: Option<String>,
    /// Restore a saved state before the first step.
    #[arg(long, help_heading = "Results", value_name = "FILE")]
    pub restore: Option<PathBuf>,
    /// Save the state after the last step.
    #[arg(long, help_heading = "Results", value_name = "FILE")]
    pub save: Option<PathBuf>,
    /// Say nothing but errors.
    #[arg(long, short, help_heading = "Results")]
    pub quiet: bool,
}

#[derive(Args)]
#[command(after_help = "In the window, H shows what keys and mouse do.")]
pub struct ViewOptions {
    #[command(flatten)]
    pub scene: SceneOptions,
    /// Size of the window, pixels; an unfolded cave is made to fit (default: 1280x720; a facet has the size that its cave says).
    #[arg(long, help_heading = "Window", value_name = "WxH", value_parser = size)]
    pub size: Option<(u32, u32)>,
    /// Look through the screens of a cave that moves with the user: a file or the name of a shipped cave.
    #[arg(long, help_heading = "Window", value_name = "CAVE")]
    pub cave: Option<String>,
    /// Show this facet of the cave alone, as its projector gets it, in a window without a frame.
    #[arg(long, help_heading = "Window", value_name = "NAME", requires = "cave", conflicts_with = "preview")]
    pub facet: Option<String>,
    /// Show all facets of the cave, unfolded; so does --cave without --facet.
    #[arg(long, help_heading = "Window", requires = "cave")]
    pub preview: bool,
    /// The camera to begin with: scene, one that a body or link carries, front, left, back, right or top.
    #[arg(long, help_heading = "Window", value_name = "NAME")]
    pub camera: Option<String>,
    /// Draw over the picture: contacts, normals, velocities, forces, joints, frames, islands, sleep, tree=LEVEL, all; with commas between them.
    #[arg(long, help_heading = "Window", value_name = "WHAT", default_value = "")]
    pub debug_draw: Overlays,
    /// usual, fast or fastest, or parts of it: shadows=off|hard|soft, samples=1|4, occlusion=on|off, reflections=on|off, map=TEXELS; with commas between them (default: usual; fast
    /// where a software driver draws).
    #[arg(long, help_heading = "Window", value_name = "WORDS")]
    pub quality: Option<Quality>,
    /// Begin with time standing.
    #[arg(long, help_heading = "Session")]
    pub paused: bool,
    /// Begin without text over the picture.
    #[arg(long, help_heading = "Window")]
    pub no_hud: bool,
    /// Pictures per second at most (default: what the desktop shows).
    #[arg(long, help_heading = "Window", value_name = "N", value_parser = rate)]
    pub fps: Option<f64>,
    /// End at this simulated time, s.
    #[arg(long, help_heading = "Stepping", value_name = "S", value_parser = seconds)]
    pub duration: Option<f64>,
    /// End after so many pictures.
    #[arg(long, help_heading = "Session", value_name = "N")]
    pub frames: Option<u64>,
    /// Write what is shown at the end (PNG).
    #[arg(long, help_heading = "Session", value_name = "FILE", value_parser = png)]
    pub screenshot: Option<PathBuf>,
    /// Where the key P leaves pictures: SCENE_000123.png, by the number of the step.
    #[arg(long, help_heading = "Session", value_name = "DIR", default_value = ".")]
    pub screenshot_dir: PathBuf,
    /// Write what is shown as JSON, a line whenever the user changes something and four a second; - for stdout.
    #[arg(long, help_heading = "Session", value_name = "FILE|-")]
    pub status: Option<PathBuf>,
    /// Lose the graphics device after so many pictures, as a driver that crashes does: to see what comes then.
    #[arg(long, value_name = "N", hide = true)]
    pub lose_device: Option<u64>,
}

#[derive(Args)]
pub struct CheckOptions {
    /// Scene files, folders, names of shipped scenes; cave files, names of shipped caves; .urdf robots; .obj, .stl, .ply and .dae meshes.
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
    /// How trees are built: medial (adaptive medial axis, the tightest; default), hubbard (medial axis of fixed samples), grid (cubes of a grid) or octree (the fastest).
    #[arg(long, value_name = "NAME", value_parser = method)]
    pub method: Option<Builder>,
    /// Greatest number of children of a ball, 2 to 64 (default 8; an octree has 8).
    #[arg(long, value_name = "N")]
    pub branching: Option<u32>,
    /// Greatest number of subdivisions, 1 to 9 (default 3; of an octree 7).
    #[arg(long, value_name = "N")]
    pub depth: Option<u32>,
    /// Balls that reach at most this far outside are not divided further: a share of the mesh's diagonal, 0.0001 to 1 (default 0.0001; of an octree 0.01, which its leaves
    /// are all grown to; with --urdf 0.001).
    #[arg(long, value_name = "SHARE", value_parser = fraction)]
    pub max_error: Option<f64>,
    /// Close holes and drop what dangles before building; what was done is said.
    #[arg(long, conflicts_with = "urdf")]
    pub repair: bool,
    /// Write the tree (JSON), or the URDF of spheres.
    #[arg(long, short, value_name = "FILE", visible_alias = "json")]
    pub output: Option<PathBuf>,
    /// Write a picture (PNG) of a level over the mesh.
    #[arg(long, help_heading = "Picture", value_name = "FILE", conflicts_with = "urdf", value_parser = png)]
    pub screenshot: Option<PathBuf>,
    /// The level of the picture, the root being 0 (default: the last).
    #[arg(long, help_heading = "Picture", value_name = "N", requires = "screenshot")]
    pub level: Option<u32>,
    /// The axis that is up in the picture.
    #[arg(long, help_heading = "Picture", value_name = "x|y|z", default_value = "z", value_parser = ["x", "y", "z"])]
    pub up: String,
    /// Size of the picture, pixels.
    #[arg(long, help_heading = "Picture", value_name = "WxH", default_value = "960x720", value_parser = size)]
    pub size: (u32, u32),
    /// Keep built trees in this folder (default: $TUMBLE_CACHE, else the user's cache folder).
    #[arg(long, value_name = "DIR", value_parser = folder)]
    pub cache: Option<PathBuf>,
    /// Build even if the tree was built before, and keep nothing.
    #[arg(long, conflicts_with = "cache")]
    pub no_cache: bool,
    /// Replace the collision geometry of every link of this robot by spheres.
    #[arg(long, help_heading = "Robots", value_name = "ROBOT")]
    pub urdf: Option<PathBuf>,
    /// Where a package of package://NAME/... is; may be given several times. Others are looked for in the folders above the URDF.
    #[arg(long = "package", help_heading = "Robots", value_name = "NAME=DIR", requires = "urdf", value_parser = package)]
    pub packages: Vec<(String, PathBuf)>,
    /// What to do where a collision mesh is not there: error, or skip it with a note.
    #[arg(long, help_heading = "Robots", value_name = "error|skip", requires = "urdf", default_value = "error", value_parser = missing)]
    pub missing_meshes: MissingMeshes,
    /// Most spheres per link, at least one per collision element; a link gets fewer where all reach out less than --max-error (default 32, or 10000 with --max-error).
    #[arg(long, help_heading = "Robots", value_name = "N", requires = "urdf", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub spheres: Option<u32>,
    /// Also write the spheres for motion planners: yaml (cuRobo) or json (foam, VAMP) beside the output, or a file that ends in .yml or .json.
    #[arg(long, help_heading = "Robots", value_name = "yaml|json|FILE", requires = "urdf", value_parser = planner)]
    pub planner: Option<PathBuf>,
    /// More figures, and what the stages of the builder did.
    #[arg(long, short)]
    pub verbose: bool,
    /// Say nothing but errors.
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

#[derive(Args)]
pub struct CavesOptions {
    /// Draw a calibration pattern: grid, corners, colours or name.
    #[arg(long, value_name = "WHAT", requires_all = ["cave", "facet", "screenshot"])]
    pub pattern: Option<CalibrationPattern>,
    /// A cave file or the name of a shipped cave.
    #[arg(long, value_name = "CAVE", requires = "pattern")]
    pub cave: Option<String>,
    /// The facet that the pattern is for.
    #[arg(long, value_name = "NAME", requires = "pattern")]
    pub facet: Option<String>,
    /// Where the picture goes (PNG).
    #[arg(long, value_name = "FILE", requires = "pattern", value_parser = png)]
    pub screenshot: Option<PathBuf>,
}

/// Overlays, or none for an empty word.
#[derive(Clone, Copy, Default)]
pub struct Overlays(pub DebugDraw);

impl std::str::FromStr for Overlays {
    type Err = tumble::render::UnknownOverlay;

    fn from_str(words: &str) -> Result<Overlays, Self::Err> {
        Ok(Overlays(if words.is_empty() { DebugDraw::default() } else { words.parse()? }))
    }
}

fn number(text: &str, from: f64, to: f64) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(x) if (from..=to).contains(&x) => Ok(x),
        _ => Err(format!("wanted a number from {from} to {to}")),
    }
}

pub fn seconds(text: &str) -> Result<f64, String> {
    number(text, 0.0, 1e6)
}

pub fn time_step(text: &str) -> Result<f64, String> {
    number(text, 1e-6, 1.0)
}

pub fn rate(text: &str) -> Result<f64, String> {
    number(text, 0.01, 1000.0)
}

pub fn solver(text: &str) -> Result<Solver, String> {
    let name = if text == "lcp" { "lcp_pyramid" } else { text };
    name.parse().map_err(|e: tumble::scene::UnknownName| e.to_string())
}

fn fraction(text: &str) -> Result<f64, String> {
    number(text, 1e-4, 1.0)
}

/// The names are those of the JSON of a tree.
fn method(text: &str) -> Result<Builder, String> {
    serde_json::from_value(text.into()).map_err(|e| e.to_string().replace("variant", "method").replace('`', ""))
}

fn folder(text: &str) -> Result<PathBuf, String> {
    if text.trim().is_empty() { Err("wanted the name of a folder".into()) } else { Ok(PathBuf::from(text)) }
}

fn package(text: &str) -> Result<(String, PathBuf), String> {
    let (name, folder) = text
        .split_once('=')
        .filter(|(name, folder)| !name.is_empty() && !folder.is_empty())
        .ok_or("wanted NAME=DIR")?;
    if Path::new(folder).is_dir() {
        Ok((name.into(), folder.into()))
    } else {
        Err(format!("there is no folder {folder}"))
    }
}

fn missing(text: &str) -> Result<MissingMeshes, String> {
    match text {
        "error" => Ok(MissingMeshes::Error),
        "skip" => Ok(MissingMeshes::Skip),
        _ => Err("wanted error or skip".into()),
    }
}

/// A file for a picture: PNG is what is written, and no ending says something else.
fn png(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match path.extension() {
        Some(ending) if !ending.eq_ignore_ascii_case("png") => {
            Err("pictures are written as PNG; wanted a file that ends in .png".into())
        }
        _ => Ok(path),
    }
}

fn planner(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or(text);
    if ["yaml", "yml", "json"].contains(&ending) {
        Ok(path)
    } else {
        Err("wanted yaml, json, or a file that ends in .yml, .yaml or .json".into())
    }
}

fn size(text: &str) -> Result<(u32, u32), String> {
    let parsed = text.split_once('x').and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    let side = 1..=MAX_SIDE;
    let fits =
        |(w, h): &(u32, u32)| side.contains(w) && side.contains(h) && u64::from(*w) * u64::from(*h) <= MAX_PIXELS;
    parsed
        .filter(fits)
        .ok_or_else(|| format!("wanted WIDTHxHEIGHT in pixels, each 1 to {MAX_SIDE}, together at most {MAX_PIXELS}"))
}
