//! `tumble check`: reads and builds files without running them.

use crate::args::{CheckOptions, OpeningOptions, kind};
use crate::cave::key;
use crate::failure::Failure;
use std::path::Path;
use tumble::collide::{RepairSettings, Shape, TreeSettings};
use tumble::dynamics::{ArticulatedBody, World};
use tumble::render::{Blend, DebugDraw, Drawing, ProjectorColor, RenderError, ScreenMesh, Warp};
use tumble::scene::cave::{Cave, MAX_BYTES, Surface, is_cave, resolve_cave, shipped_caves};
use tumble::scene::{
    FileKind, SceneError, building_surface, overlap_notes, read_mesh_bytes, read_solid, resolve_scene, shipped,
    visual_notes,
};

/// Checks every file and reports each failure. The exit code is that of the first one.
pub fn check(options: &CheckOptions) -> Result<(), Failure> {
    let mut outcome = Ok(());
    for file in &options.files {
        match one(file, &options.opening) {
            Ok(said) => println!("{file}: {said}"),
            Err(failure) => {
                if let Err(earlier) = std::mem::replace(&mut outcome, Err(failure)) {
                    eprint!("{}", earlier.report());
                }
            }
        }
    }
    outcome
}

fn one(file: &str, opening: &OpeningOptions) -> Result<String, Failure> {
    match kind(file) {
        FileKind::Mesh => mesh(Path::new(file), opening.repair),
        FileKind::Urdf => robot(file, opening),
        FileKind::Mjcf | FileKind::Sdformat => model(file, opening),
        FileKind::Scene if looks_like_cave(file) => cave(file),
        FileKind::Scene => scene(file),
    }
}

fn robot(name: &str, opening: &OpeningOptions) -> Result<String, Failure> {
    let scene = OpeningOptions { repair: false, ..opening.clone() }.read(name)?;
    let (world, notes) = scene.build().map_err(Failure::input)?;
    notes.into_iter().chain(read_visuals(&world)).for_each(|note| println!("{note}"));
    let body = scene.articulated.first().and_then(|spec| world.get::<ArticulatedBody>(world.find(&spec.name)?));
    let model = body.ok_or_else(|| Failure::input(format!("{name}: the file has no robot")))?.model();
    Ok(format!(
        "a robot of {} links, {} degrees of freedom on a {} base, {:.6} kg of moving mass",
        model.frames().len(),
        model.dof(),
        if scene.has_fixed_base() { "fixed" } else { "floating" },
        model.mass()
    ))
}

fn model(name: &str, opening: &OpeningOptions) -> Result<String, Failure> {
    let scene = OpeningOptions { repair: false, ..opening.clone() }.read(name)?;
    let (world, notes) = scene.build().map_err(Failure::input)?;
    let overlaps = overlap_notes(&world);
    notes.into_iter().chain(read_visuals(&world)).chain(overlaps).for_each(|note| println!("{note}"));
    let body = |name: &str| world.get::<ArticulatedBody>(world.find(name)?);
    let dof: usize = scene.articulated.iter().filter_map(|spec| body(&spec.name)).map(|body| body.model().dof()).sum();
    Ok(format!(
        "a model of {} rigid and static bodies, {} articulated bodies with {} degrees of freedom, and {} actuators",
        scene.bodies.len(),
        scene.articulated.len(),
        dof,
        scene.actuators.len()
    ))
}

/// Reads the meshes that are drawn and never collide. Returns a note for each that cannot be read.
fn read_visuals(world: &World) -> Vec<String> {
    world.visuals().for_each(|visual| _ = visual.drawn());
    visual_notes(world.visuals())
}

/// Returns whether `file` is a cave: a file with a table that caves have and scenes do not, or the
/// name of a shipped cave that no shipped scene has.
fn looks_like_cave(file: &str) -> bool {
    let path = Path::new(file);
    if path.is_file() {
        let small = path.metadata().is_ok_and(|about| about.len() <= MAX_BYTES);
        return small && std::fs::read_to_string(path).is_ok_and(|text| is_cave(&text));
    }
    let shipped_cave =
        shipped_caves().iter().any(|cave| file == cave.name || file == format!("caves/{}.toml", cave.name));
    shipped_cave && !path.is_dir() && !shipped().iter().any(|scene| scene.name == file)
}

fn cave(name: &str) -> Result<String, Failure> {
    let cave = resolve_cave(name)?.load()?;
    check_files(&cave)?;
    cave.notes().iter().for_each(|note| println!("{note}"));
    Ok(cave.summary())
}

/// Reads the files that a cave names (meshes, warps, blends, colors, the key), as its facets and its server do.
fn check_files(cave: &Cave) -> Result<(), Failure> {
    for facet in &cave.facets {
        let named = |e: RenderError| Failure::input(format!("facet \"{}\" of {}: {e}", facet.name, cave.file));
        facet.warp_file.as_deref().map(Warp::load).transpose().map_err(named)?;
        for mask in [&facet.blend_file, &facet.black_file].into_iter().flatten() {
            Blend::load(mask, facet.size_px).map_err(named)?;
        }
        ProjectorColor::load(facet).map_err(named)?;
        if let Surface::Mesh { file } = &cave.screens[facet.screen].surface {
            ScreenMesh::load(file).map_err(named)?;
        }
    }
    key(cave).map(drop)
}

fn scene(name: &str) -> Result<String, Failure> {
    let scene = resolve_scene(name, &[]).map_err(|error| match error {
        SceneError::Unknown { .. } => unknown_name(name, &error),
        error => error.into(),
    })?;
    let scene = scene.load()?;
    let (world, notes) = scene.build().map_err(Failure::input)?;
    // reads textures and visual meshes
    Drawing::new(&scene)
        .list(&world, &DebugDraw::default())
        .map_err(|e| Failure::input(format!("{}: {e}", scene.file)))?;
    let found = visual_notes(world.visuals()).into_iter().chain(overlap_notes(&world));
    notes.into_iter().chain(found).for_each(|note| println!("{note}"));
    Ok(format!("a scene of {} bodies, {} degrees of freedom", world.ids().len(), degrees(&world)))
}

/// The message for a name that no scene and no cave has.
fn unknown_name(name: &str, error: &SceneError) -> Failure {
    let cave = resolve_cave(name).err().map_or(String::new(), |error| format!("; {error}"));
    Failure::input(format!("{error}{cave}"))
}

fn degrees(world: &World) -> usize {
    let view = world.view();
    let moving = world.ids().iter().filter(|id| view.status(**id).is_some_and(|s| s.moves()));
    moving.filter_map(|id| view.state_range(*id)).map(|span| span.v.len()).sum()
}

fn mesh(path: &Path, repair: bool) -> Result<String, Failure> {
    let wrong = |why: String| Failure::input(format!("{}: {why}", path.display()));
    let bytes = read_mesh_bytes(path).map_err(wrong)?;
    let (mesh, notes) = read_solid(path, &bytes, repair.then(RepairSettings::default).as_ref()).map_err(wrong)?;
    notes.iter().for_each(|note| println!("{}: {note}", path.display()));
    let (triangles, diagonal) = (mesh.triangles.len(), mesh.diagonal());
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let made = building_surface(&name, triangles, || Shape::mesh(mesh, &TreeSettings::octree()));
    let shape = made.map_err(|e| wrong(e.to_string()))?;
    let center = shape.center_of_mass();
    let error = shape.tree().map_or(0.0, |tree| tree.outward_error());
    Ok(format!(
        "a closed mesh of {triangles} triangles, volume {:.6e} m³, center of mass ({:.6}, {:.6}, {:.6}) m, sphere tree within {:.3} % of its diagonal",
        shape.volume(),
        center.x,
        center.y,
        center.z,
        100.0 * error / diagonal
    ))
}
