//! `tumble spheretree`: builds a sphere tree around a mesh and measures it, or makes a robot of
//! spheres.

mod picture;
mod robot;

use crate::args::SphereTreeOptions;
use crate::atomic_file::{check_writable, write_file};
use crate::failure::Failure;
use crate::progress::WorkProgress;
use std::path::Path;
use std::time::Instant;
use tumble::collide::{
    Builder, MeshId, QualitySettings, RepairSettings, SphereTree, TreeCache, TreeFile, TreeSettings, TriMesh,
};
use tumble::scene::{read_mesh_bytes, read_solid};

/// Builds, measures, prints and writes.
pub fn spheretree(options: &SphereTreeOptions) -> Result<(), Failure> {
    check_outputs(options)?;
    match (&options.mesh, &options.urdf) {
        (_, Some(urdf)) => robot::spherize(urdf, options),
        (Some(mesh), None) => of_mesh(mesh, options),
        (None, None) => Err(Failure::input("expected a mesh or --urdf ROBOT")),
    }
}

/// Refuses before the work what would fail after it: outputs that cannot be written, levels that no
/// tree has.
fn check_outputs(options: &SphereTreeOptions) -> Result<(), Failure> {
    for path in options.output.iter().chain(&options.screenshot) {
        check_writable(path).map_err(Failure::input)?;
    }
    let depth = settings(options).depth;
    match options.level {
        Some(level) if level > depth => Err(Failure::input(format!(
            "--level is {level}; a tree with --depth {depth} has at most levels 0 to {depth}"
        ))),
        _ => Ok(()),
    }
}

fn of_mesh(path: &Path, options: &SphereTreeOptions) -> Result<(), Failure> {
    let wrong = |why: String| Failure::input(format!("{}: {why}", path.display()));
    let mesh = read(path, options)?;
    let settings = settings(options);
    let (clock, progress) = (Instant::now(), WorkProgress::new("building", options.quiet));
    let built = SphereTree::build_cached_with_progress(&mesh, &settings, &cache(options), &progress);
    progress.done();
    let built = built.map_err(|e| wrong(e.to_string()))?;
    let seconds = clock.elapsed().as_secs_f64();
    built.note.iter().filter(|_| !options.quiet).for_each(|note| eprintln!("{note}"));
    let quality = built.tree.quality(&mesh, &QualitySettings::default());
    let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let file = TreeFile { name, mesh: MeshId::of(&mesh), settings, stages: built.stages, quality, tree: built.tree };
    if !options.quiet {
        let from = if built.found { "from the cache".into() } else { format!("built in {seconds:.2} s") };
        let volume = mesh.union_mass_properties(1.0).mass;
        println!(
            "{}: {} triangles, volume {volume:.6e} m³, diagonal {} m; {from}",
            path.display(),
            mesh.triangles.len(),
            length(mesh.diagonal())
        );
        print!("{}", file.table(options.verbose));
    }
    if let Some(output) = &options.output {
        write_file(output, file.to_json().as_bytes())?;
        say(options, "tree", output);
    }
    match &options.screenshot {
        Some(output) => picture::picture(&mesh, &file.tree, output, options),
        None => Ok(()),
    }
}

/// Reads the mesh. Harmless defects are repaired, with notes.
fn read(path: &Path, options: &SphereTreeOptions) -> Result<TriMesh, Failure> {
    let wrong = |why: String| Failure::input(format!("{}: {why}", path.display()));
    let bytes = read_mesh_bytes(path).map_err(wrong)?;
    let (mesh, notes) =
        read_solid(path, &bytes, options.repair.then(RepairSettings::default).as_ref()).map_err(wrong)?;
    notes.iter().filter(|_| !options.quiet).for_each(|note| println!("{}: {note}", path.display()));
    Ok(mesh)
}

/// The defaults of the method, with the options of the command line.
fn settings(options: &SphereTreeOptions) -> TreeSettings {
    let defaults = match options.method {
        Some(Builder::Octree) => TreeSettings::octree(),
        Some(builder) => TreeSettings { builder, ..TreeSettings::default() },
        None => TreeSettings::default(),
    };
    TreeSettings {
        branch: options.branching.unwrap_or(defaults.branch),
        depth: options.depth.unwrap_or(defaults.depth),
        error: options.max_error.unwrap_or(defaults.error),
        ..defaults
    }
}

fn cache(options: &SphereTreeOptions) -> TreeCache {
    match &options.cache {
        _ if options.no_cache => TreeCache::off(),
        Some(folder) => TreeCache::at(folder),
        None => TreeCache::of_environment(),
    }
}

/// Formats meters with six decimals, and lengths below 1 mm by their power of ten.
fn length(meters: f64) -> String {
    if meters >= 1e-3 { format!("{meters:.6}") } else { format!("{meters:.6e}") }
}

fn say(options: &SphereTreeOptions, what: &str, path: &Path) {
    if !options.quiet {
        println!("{what}: {}", path.display());
    }
}
