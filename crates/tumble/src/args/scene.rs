//! Options that name a scene, its stepping, and how its file is opened.

use super::values::{missing, package, solver, time_step};
use crate::failure::Failure;
use clap::Args;
use std::path::{Path, PathBuf};
use tumble::scene::mjcf::MjcfOptions;
use tumble::scene::urdf::{MissingMeshes, UrdfOptions};
use tumble::scene::{FileKind, Integrator, LoadOptions, SceneFile, Solver, Stepper, resolve_scene};

/// The scene and its stepping.
#[derive(Args, Clone)]
pub struct SceneOptions {
    /// A scene file, a folder with a scene.toml, the name of a shipped scene, a robot (.urdf), a model
    /// of MuJoCo (.xml, .mjcf) or Gazebo (.sdf), or a mesh (.obj, .stl, .ply, .dae).
    #[arg(value_name = "SCENE")]
    pub name: String,
    /// Length of a step, s (default: from the scene).
    #[arg(long, help_heading = "Stepping", value_name = "S", value_parser = time_step)]
    pub dt: Option<f64>,
    /// time_stepping or backtracking.
    #[arg(long, help_heading = "Stepping", value_name = "NAME")]
    pub stepper: Option<Stepper>,
    /// gauss_seidel, lcp (short for lcp_pyramid), lcp_pyramid or lcp_sliding.
    #[arg(long, help_heading = "Stepping", value_name = "NAME", value_parser = solver)]
    pub solver: Option<Solver>,
    /// verlet, symplectic_euler, explicit_euler, rk4 or dormand_prince; time_stepping always uses
    /// the midpoint rule.
    #[arg(long, help_heading = "Stepping", value_name = "NAME")]
    pub integrator: Option<Integrator>,
    /// Threads of a step, 0 for as many as cores (default: from the scene); no number changes the
    /// result.
    #[arg(long, help_heading = "Stepping", value_name = "N", value_parser = clap::value_parser!(u32).range(0..=256))]
    pub threads: Option<u32>,
    /// Largest work of a step in block relaxations (default: from the scene, or no bound). A step that
    /// needs more is less accurate.
    #[arg(long, help_heading = "Stepping", value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4_000_000_000))]
    pub budget: Option<u32>,
    #[command(flatten)]
    pub opening: OpeningOptions,
}

impl SceneOptions {
    /// Loads the scene and applies the settings of the command line.
    pub fn load(&self) -> Result<SceneFile, Failure> {
        let mut scene = self.opening.load(&self.name)?;
        let w = &mut scene.world;
        w.dt_s = self.dt.unwrap_or(w.dt_s);
        w.stepper = self.stepper.unwrap_or(w.stepper);
        w.solver = self.solver.unwrap_or(w.solver);
        w.integrator = self.integrator.unwrap_or(w.integrator);
        w.threads = self.threads.unwrap_or(w.threads);
        w.budget = self.budget.or(w.budget);
        Ok(scene)
    }

    /// Returns the options of stepping as arguments.
    pub fn stepping_args(&self) -> Vec<String> {
        let given = [
            ("--dt", self.dt.map(|dt| dt.to_string())),
            ("--stepper", self.stepper.map(|stepper| stepper.to_string())),
            ("--solver", self.solver.map(|solver| solver.to_string())),
            ("--integrator", self.integrator.map(|integrator| integrator.to_string())),
            ("--threads", self.threads.map(|threads| threads.to_string())),
            ("--budget", self.budget.map(|budget| budget.to_string())),
        ];
        given.into_iter().filter_map(|(name, value)| Some([name.to_owned(), value?])).flatten().collect()
    }
}

/// Opening a robot or a mesh file.
#[derive(Args, Clone)]
#[command(next_help_heading = "Robots and meshes")]
pub struct OpeningOptions {
    /// Let the root link of a URDF float.
    #[arg(long, conflicts_with = "fixed_base")]
    pub floating: bool,
    /// Fix the root link of a URDF to the world (default).
    #[arg(long)]
    pub fixed_base: bool,
    /// Folder of the package in package://NAME/...; may be given several times. Other packages are
    /// searched in the folders above the URDF.
    #[arg(long = "package", value_name = "NAME=DIR", value_parser = package)]
    pub packages: Vec<(String, PathBuf)>,
    /// If a collision mesh of a URDF or a model of MuJoCo or Gazebo is missing: error, or skip it with a note.
    #[arg(long, value_name = "error|skip", value_parser = missing)]
    pub missing_meshes: Option<MissingMeshes>,
    /// The keyframe that a model of MuJoCo starts in: its name, or its number from 0.
    #[arg(long, value_name = "NAME")]
    pub keyframe: Option<String>,
    /// Repair a mesh that is not a closed solid: holes, fins, inner walls, debris. Notes list the
    /// repairs; the file stays unchanged.
    #[arg(long)]
    pub repair: bool,
}

impl OpeningOptions {
    /// Loads the scene of that name or path. A note says so if the base is fixed by default.
    pub fn load(&self, name: &str) -> Result<SceneFile, Failure> {
        let mut scene = self.read(name)?;
        if kind(name) == FileKind::Urdf && !self.fixed_base && scene.has_fixed_base() {
            scene.notes.push(format!("{name}: the root link is fixed to the world; --floating makes it float"));
        }
        Ok(scene)
    }

    /// Loads the scene of that name or path.
    pub fn read(&self, name: &str) -> Result<SceneFile, Failure> {
        self.check(kind(name)).map_err(|option| Failure::input(format!("{name}: {option}")))?;
        let urdf = UrdfOptions {
            floating: self.floating,
            packages: self.packages.iter().cloned().collect(),
            missing_meshes: self.missing_meshes.unwrap_or_default(),
            ..UrdfOptions::default()
        };
        let mjcf = MjcfOptions {
            missing_meshes: self.missing_meshes.unwrap_or_default(),
            keyframe: self.keyframe.clone(),
            ..MjcfOptions::default()
        };
        Ok(resolve_scene(name, &[])?.load_with(&LoadOptions { urdf, mjcf, repair: self.repair })?)
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
        args.extend(self.keyframe.iter().map(|name| format!("--keyframe={name}")));
        args
    }

    /// Refuses options that have no effect on a file of this kind.
    fn check(&self, kind: FileKind) -> Result<(), &'static str> {
        let urdf = self.floating || self.fixed_base || !self.packages.is_empty();
        let robot = urdf || self.missing_meshes.is_some();
        match kind {
            FileKind::Urdf | FileKind::Sdformat | FileKind::Mesh | FileKind::Scene if self.keyframe.is_some() => {
                Err("--keyframe needs a model of MuJoCo (.xml)")
            }
            FileKind::Mjcf if urdf => Err("--floating, --fixed-base and --package need a .urdf file"),
            FileKind::Mjcf if self.repair => {
                Err("--repair needs a mesh file; meshes of a model of MuJoCo collide by their convex hulls")
            }
            FileKind::Sdformat if self.floating || self.fixed_base => {
                Err("--floating and --fixed-base need a .urdf file; an .sdf file says whether its roots float")
            }
            FileKind::Sdformat if self.repair => {
                Err("--repair needs a mesh file; an open mesh of an .sdf file collides by its convex hull")
            }
            FileKind::Urdf if self.repair => {
                Err("--repair needs a mesh file; an open mesh of a URDF collides by its convex hull")
            }
            FileKind::Mesh | FileKind::Scene if robot => Err(
                "--floating, --fixed-base, --package and --missing-meshes need a .urdf file (--missing-meshes also takes a .xml one); a scene has these settings under [[articulated]]",
            ),
            FileKind::Scene if self.repair => {
                Err("--repair needs a mesh file; a scene has `repair = true` under [meshes.NAME]")
            }
            _ => Ok(()),
        }
    }
}

/// The kind of file that a name stands for; a name without an extension is a scene.
pub fn kind(name: &str) -> FileKind {
    FileKind::of(Path::new(name)).unwrap_or(FileKind::Scene)
}
