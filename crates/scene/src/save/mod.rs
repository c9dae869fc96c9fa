//! Writes a world as a scene file.
//!
//! | file | content |
//! |---|---|
//! | `NAME.toml` | objects, settings and views in the words of scene files, with the poses, joint positions and velocities of now |
//! | `NAME_files/mesh_1.obj`, … | the meshes, in the frames of their bodies |
//! | `NAME_files/state.world` | the archive of the world ([`World::archive`]) and the hash of the text |
//!
//! The text alone describes the world up to rounding: mass, pose and the like are derived from other
//! numbers when a scene is built. While the text is as it was written, the world is therefore that of
//! the archive, with the same bits, warm starts and time. Once the text is edited, the text counts.
//!
//! Before anything is written for good, the text is read back and the constants of both worlds are
//! compared field by field. A constant that a scene file cannot say is an error that names it.

mod articulated;
mod behaviors;
mod bodies;
mod compare;
mod events;
mod joints;
pub(crate) mod place;
mod saved;
pub(crate) mod shapes;
mod surface;
mod text;
mod views;

pub use saved::SavedWorld;

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::{Path, PathBuf};

use tumble_core::{
    ArchiveError, ArticulatedBody, Collidable, LoopJoint, Material, Mimic, Object, ObjectId, RigidBody, ScriptedEvent,
    Sensor, Template, World,
};

use crate::notes::Notes;
use crate::parse::appearance::AppearanceSpec;
use crate::parse::file::SceneFile;
use crate::parse::material::MaterialSpec;
use place::Unfinished;
use shapes::Meshes;
use text::Table;

/// Largest number of a material.
const MAX_MATERIALS: u32 = 1000;
/// Faults that an error lists.
const MAX_LISTED: usize = 8;

/// Why a world was not written. Earlier files are as they were.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SaveError {
    /// The world has something that scene files cannot say.
    #[error("the world cannot be written as a scene, which has no words for: {}", .0.join("; "))]
    Unsayable(Vec<String>),
    /// The state cannot be written.
    #[error("the world cannot be written as a scene: {0}")]
    Archive(#[from] ArchiveError),
    /// The path has another extension.
    #[error("{}: expected the name of a .toml file", .0.display())]
    Name(PathBuf),
    /// The text of the world is no valid scene.
    #[error("the world cannot be written as a scene: {0}")]
    Unread(String),
    /// A file could not be written.
    #[error("writing {}: {source}", file.display())]
    Write {
        /// The file or folder.
        file: PathBuf,
        /// From the system.
        source: io::Error,
    },
}

/// Writes a world as a scene file, with a folder beside it.
///
/// ```no_run
/// # use tumble_scene::{SceneFile, SceneWriter};
/// let scene = SceneFile::load("scenes/stack")?;
/// let (mut world, _) = scene.build()?;
/// world.step()?;
/// SceneWriter::new(&world).like(&scene).save("stack_now.toml")?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct SceneWriter<'w> {
    world: &'w World,
    like: Option<&'w SceneFile>,
    joint_names: BTreeMap<String, Vec<String>>,
}

impl<'w> SceneWriter<'w> {
    /// Makes a writer of a world as it stands.
    pub fn new(world: &'w World) -> Self {
        SceneWriter { world, like: None, joint_names: BTreeMap::new() }
    }

    /// Takes description, duration, views, and names of materials and joints from the scene that the
    /// world was built from.
    #[must_use]
    pub fn like(mut self, scene: &'w SceneFile) -> Self {
        self.like = Some(scene);
        for spec in &scene.articulated {
            self.joint_names.insert(spec.name.clone(), crate::build::articulated::moving_joints(&spec.links));
        }
        self
    }

    /// Names the joints of an articulated body, in the order of its moving links. Without names they
    /// are those of the links.
    #[must_use]
    pub fn with_joint_names(mut self, body: impl Into<String>, names: Vec<String>) -> Self {
        self.joint_names.insert(body.into(), names);
        self
    }

    /// Writes the scene to `path`, and its files to a folder `NAME_files` beside it, which is
    /// replaced. Returns notes about things that are drawn and could not be written.
    ///
    /// # Errors
    /// [`SaveError`]; [`SaveError::Unsayable`] lists objects of user-defined types and all else that
    /// scene files cannot say.
    pub fn save(self, path: impl AsRef<Path>) -> Result<Notes, SaveError> {
        let path = path.as_ref();
        let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
        let Some(stem) = stem.filter(|_| path.extension().is_some_and(|e| e == "toml")) else {
            return Err(SaveError::Name(path.into()));
        };
        let (world, folder) = (self.world, format!("{stem}_files"));
        let (text, meshes, notes) = self.text(&folder)?;
        let state = saved::file(&text, world.archive(&[])?)?;
        let files: Vec<(String, Vec<u8>)> = meshes.files.into_iter().chain([("state.world".into(), state)]).collect();
        let unfinished = Unfinished::write(path, &text, &files)?;
        check(world, &unfinished.file())?;
        unfinished.put_in_place(path)?;
        Ok(notes)
    }

    /// Returns the text, its meshes and notes.
    fn text(self, folder: &str) -> Result<(String, Meshes, Notes), SaveError> {
        let empty = SceneFile::parse("", "").map_err(|e| SaveError::Unread(e.to_string()))?;
        let like = self.like.unwrap_or(&empty);
        let mut writer = Writer {
            world: self.world,
            like,
            materials: materials(self.world, like)?,
            joint_names: self.joint_names,
            meshes: Meshes::new(folder),
            out: String::new(),
            notes: Vec::new(),
            faults: Vec::new(),
        };
        writer.objects();
        let Writer { mut faults, meshes, notes, mut out, .. } = writer;
        if !faults.is_empty() {
            shorten(&mut faults);
            return Err(SaveError::Unsayable(faults));
        }
        let mut top = Table::of("description", &like.description);
        top.put("saved_world", format!("{folder}/state.world"));
        // the tables of meshes stand before the objects that name them
        let at = out.find("\n[[").unwrap_or(out.len());
        out.insert_str(at, &meshes.tables);
        let head = format!(
            "# A world at {} s, written by tumble. \
             The file `saved_world` has its exact state while this text is unchanged.\n",
            self.world.time()
        );
        Ok((head + &top.lines() + &out, meshes, notes))
    }
}

/// A scene that is being written.
pub(crate) struct Writer<'w> {
    world: &'w World,
    like: &'w SceneFile,
    /// Materials with their numbers in the world.
    materials: Vec<(u32, MaterialSpec)>,
    joint_names: BTreeMap<String, Vec<String>>,
    meshes: Meshes,
    out: String,
    notes: Notes,
    /// Things that scene files cannot say.
    faults: Vec<String>,
}

impl Writer<'_> {
    /// Names the tables of the scene that are not written. Without `..`: a new table of scenes is an
    /// error here until it is written, or noted.
    fn note_tables(&mut self) {
        #[rustfmt::skip]
        let SceneFile {
            file: _, description: _, world: _, materials: _, meshes: _, bodies: _, articulated: _, loop_joints: _,
            actuators, pairs: _, camera: _, cave: _, lights: _, sky: _, ground: _, notes: _, saved: _,
            mimics: _, sensors: _, behaviors: _, templates: _, events: _,
        } = self.like;
        if !actuators.is_empty() {
            self.notes.push("the actuators of its model of MuJoCo are not written: scene files have none".into());
        }
    }

    fn objects(&mut self) {
        self.note_tables();
        self.world_table();
        self.material_tables();
        let world = self.world;
        let objects = || world.ids().iter().filter_map(|&id| Some((id, world.name(id)?, world.object(id)?)));
        let templates = || world.ids().iter().filter_map(|&id| world.get::<Template>(id));
        let spawned: BTreeSet<ObjectId> = templates().flat_map(Template::bodies).copied().collect();
        for (id, name, _) in objects().filter(|(id, ..)| !spawned.contains(id)) {
            if let Some(body) = world.get::<RigidBody>(id) {
                self.body(id, name, body);
            }
        }
        for (id, name, _) in objects() {
            if let Some(body) = world.get::<ArticulatedBody>(id) {
                self.articulated(id, name, body);
            }
        }
        for (id, name, _) in objects() {
            if let Some(joint) = world.get::<LoopJoint>(id) {
                self.loop_joint(id, name, joint);
            }
        }
        for (id, name, _) in objects() {
            if let Some(mimic) = world.get::<Mimic>(id) {
                self.mimic(id, name, mimic);
            }
        }
        for (id, name, object) in objects() {
            self.other(id, name, object);
        }
        self.pairs();
        self.views();
    }

    /// Writes an object that is no body and no joint.
    fn other(&mut self, id: ObjectId, name: &str, object: &dyn Object) {
        let any: &dyn std::any::Any = object;
        let enabled = self.world.status(id).is_none_or(|status| status.enabled);
        if let Some(template) = any.downcast_ref::<Template>() {
            self.template(name, template, enabled);
        } else if let Some(event) = any.downcast_ref::<ScriptedEvent>() {
            self.event(name, event, enabled);
        } else if let Some(sensor) = any.downcast_ref::<Sensor>() {
            self.sensor(name, sensor, enabled);
        } else if !(any.is::<RigidBody>()
            || any.is::<ArticulatedBody>()
            || any.is::<LoopJoint>()
            || any.is::<Mimic>()
            || self.behavior(id, name))
        {
            self.fault(format!("\"{name}\", an object of a type of its own"));
        }
    }

    fn fault(&mut self, fault: String) {
        self.faults.push(fault);
    }
}

/// Returns the materials of a world: those of its scene, and one without constants for each other
/// number that a part has. A scene numbers its materials from 1 in the order of their names.
fn materials(world: &World, like: &SceneFile) -> Result<Vec<(u32, MaterialSpec)>, SaveError> {
    let parts = world.ids().iter().filter_map(|&id| world.object(id)?.collidable());
    let of_part = |c: &dyn Collidable, part: usize| {
        let own = c.shape_materials(part).iter().map(|(_, material)| material.id);
        own.chain([c.material(part).id]).max().unwrap_or(0)
    };
    let used = parts.flat_map(|c| (0..c.parts()).map(move |part| of_part(c, part))).max().unwrap_or(0);
    if used > MAX_MATERIALS {
        return Err(SaveError::Unsayable(vec![format!("the material {used}, since scenes number theirs from 1")]));
    }
    let sorted = like.materials.is_sorted_by(|a, b| a.name < b.name);
    let last = like.materials.last().map_or("", |material| material.name.as_str());
    let prefix = if "material_" > last || !sorted { "material_".into() } else { format!("{last}_") };
    let count = used.max(like.materials.len() as u32);
    let one = |id: u32| {
        let name = format!("{prefix}{id:04}");
        let spec = match like.materials.get(id as usize - 1) {
            Some(known) if sorted => known.clone(),
            Some(known) => MaterialSpec { name, ..known.clone() },
            None => {
                MaterialSpec { name, contact: Material::default(), appearance: AppearanceSpec::default(), sound: None }
            }
        };
        (id, spec)
    };
    Ok((1..=count).map(one).collect())
}

/// Reads what was written and compares the worlds.
fn check(world: &World, file: &Path) -> Result<(), SaveError> {
    let mut scene = SceneFile::load(file).map_err(|e| SaveError::Unread(e.to_string()))?;
    scene.saved = None;
    let (read, _) = scene.build().map_err(|e| SaveError::Unread(e.to_string()))?;
    let mut lost = compare::differences(world, &read).map_err(SaveError::Unread)?;
    if lost.is_empty() {
        return Ok(());
    }
    shorten(&mut lost);
    Err(SaveError::Unsayable(lost))
}

/// Keeps the first entries and counts the others.
fn shorten(list: &mut Vec<String>) {
    let more = list.len().saturating_sub(MAX_LISTED);
    if more > 0 {
        list.truncate(MAX_LISTED);
        list.push(format!("{more} more"));
    }
}
