//! Writes a world as a model of MuJoCo.
//!
//! | in the world | in MJCF |
//! |---|---|
//! | gravity, time step | `<option>` |
//! | static rigid bodies | geoms of the world |
//! | kinematic, dynamic rigid bodies | bodies with `mocap`, with `<freejoint>` |
//! | articulated bodies | trees of `<body>`; links that are folded into others become `<site>` |
//! | limits, springs, damping, dry friction, armature, effort | attributes of `<joint>` |
//! | position drives; motors and actuators of the scene that no drive includes | `<general>` actuators |
//! | couplings; spherical and fixed loop joints | `<joint>`, `<connect>` by sites, `<weld>` of `<equality>` |
//! | collision groups; pairs that do not collide | `contype`, `conaffinity`; `<exclude>` |
//! | the present state | the keyframe `now` |
//!
//! Everything else is a note.

mod actuators;
mod bodies;
mod fixed_links;
mod geoms;
mod joints;
mod links;
mod xml;

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::{Path, PathBuf};

use tumble_core::collide::Pose;
use tumble_core::{ArticulatedBody, Combine, LoopJoint, Mimic, ObjectId, PairMaterial, PairSide, RigidBody, World};

use super::names::Taken;
use crate::notes::{NoteList, Notes};
use crate::parse::file::SceneFile;
use crate::save::place::{Fault, Unfinished};
use actuators::Motor;
use geoms::{Assets, Groups};
use joints::Carrier;
use xml::{Attributes, Xml, numbers, vector};

/// Name of the keyframe with the state of the world.
const NOW: &str = "now";

/// Why a world was not written as MJCF.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SaveMjcfError {
    /// The path has another extension.
    #[error("{}: expected the name of a .xml or .mjcf file", .0.display())]
    Name(PathBuf),
    /// A file could not be written.
    #[error("writing {}: {source}", file.display())]
    Write {
        /// The file or folder.
        file: PathBuf,
        /// From the system.
        source: io::Error,
    },
}

impl From<Fault> for SaveMjcfError {
    fn from(Fault { file, source }: Fault) -> Self {
        SaveMjcfError::Write { file, source }
    }
}

/// A world as MJCF.
#[derive(Clone, Debug, PartialEq)]
pub struct MjcfText {
    /// The model.
    pub text: String,
    /// Names and contents of the meshes that it names in its folder of files.
    pub files: Vec<(String, Vec<u8>)>,
    /// Everything that MJCF cannot say, or that is written in another way.
    pub notes: Notes,
}

/// Writes a world as a model of MuJoCo, which the reader of this module and MuJoCo read. Its keyframe `now` is the present state.
///
/// ```
/// # use tumble_scene::{mjcf::MjcfWriter, resolve_scene};
/// let scene = resolve_scene("pendulum", &[])?.load()?;
/// let (world, _) = scene.build()?;
/// let model = MjcfWriter::new(&world).like(&scene).text("pendulum_files");
/// assert!(model.text.starts_with("<mujoco"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct MjcfWriter<'w> {
    world: &'w World,
    model: String,
    joint_names: BTreeMap<String, Vec<String>>,
    /// Motors of the scene, and its other actuators that no drive includes.
    motors: Vec<Motor>,
    folder: String,
    xml: Xml,
    assets: Assets,
    groups: Groups,
    bodies: Taken,
    /// Names of geoms.
    shapes: Taken,
    joints: Taken,
    sites: Taken,
    actuators: Taken,
    /// Name of the body of each object, or of each link of one.
    names: BTreeMap<Carrier, String>,
    /// Name of the body of each link with shapes, also of fixed ones, by its number among the frames of its articulated body.
    link_bodies: BTreeMap<(ObjectId, usize), String>,
    /// Name of the joint of each single degree of freedom of an articulated body.
    dofs: BTreeMap<(ObjectId, usize), String>,
    /// Massless links that are joints of another link's body.
    inner: BTreeSet<Carrier>,
    /// Names of the two sites of each spherical loop joint.
    joint_sites: BTreeMap<ObjectId, [String; 2]>,
    /// Sites of loop joints that are not written yet.
    planned: BTreeMap<Carrier, Vec<(String, Pose)>>,
    contacts: Vec<(&'static str, Attributes)>,
    equalities: Vec<(&'static str, Attributes)>,
    drive_elements: Vec<(&'static str, Attributes)>,
    controls: Vec<f64>,
    qpos: Vec<f64>,
    qvel: Vec<f64>,
    notes: NoteList,
}

impl<'w> MjcfWriter<'w> {
    /// Makes a writer of a world as it stands.
    pub fn new(world: &'w World) -> Self {
        MjcfWriter {
            world,
            model: "tumble".into(),
            joint_names: BTreeMap::new(),
            motors: Vec::new(),
            folder: String::new(),
            xml: Xml::default(),
            assets: Assets::default(),
            groups: Groups::default(),
            bodies: Taken::default(),
            shapes: Taken::default(),
            joints: Taken::default(),
            sites: Taken::default(),
            actuators: Taken::default(),
            names: BTreeMap::new(),
            link_bodies: BTreeMap::new(),
            dofs: BTreeMap::new(),
            inner: BTreeSet::new(),
            joint_sites: BTreeMap::new(),
            planned: BTreeMap::new(),
            contacts: Vec::new(),
            equalities: Vec::new(),
            drive_elements: Vec::new(),
            controls: Vec::new(),
            qpos: Vec::new(),
            qvel: Vec::new(),
            notes: NoteList::default(),
        }
    }

    /// Takes the names of joints, motors and actuators that no drive includes from the scene that the world was built from.
    #[must_use]
    pub fn like(mut self, scene: &SceneFile) -> Self {
        for spec in &scene.articulated {
            self.joint_names.insert(spec.name.clone(), crate::build::articulated::moving_joints(&spec.links));
        }
        self.motors = Motor::all(scene);
        self
    }

    /// Names the joints of an articulated body, in the order of its moving links. Without names they
    /// are those of the links.
    #[must_use]
    pub fn with_joint_names(mut self, body: impl Into<String>, names: Vec<String>) -> Self {
        self.joint_names.insert(body.into(), names);
        self
    }

    /// Writes the model to `path`, and its meshes to a folder `NAME_files` beside it. Returns notes about everything that
    /// MJCF cannot say. Model and meshes are finished in a folder of their own and moved to their places at once; if that fails,
    /// the earlier ones stay. An earlier folder of files is replaced.
    ///
    /// # Errors
    /// [`SaveMjcfError`]: the path has another extension, or a file cannot be written.
    pub fn save(mut self, path: impl AsRef<Path>) -> Result<Notes, SaveMjcfError> {
        let path = path.as_ref();
        let known = path.extension().is_some_and(|e| e == "xml" || e == "mjcf");
        let Some(stem) = path.file_stem().filter(|_| known).map(|stem| stem.to_string_lossy().into_owned()) else {
            return Err(SaveMjcfError::Name(path.into()));
        };
        self.model.clone_from(&stem);
        let MjcfText { text, files, notes } = self.text(&format!("{stem}_files"));
        Unfinished::write(path, &text, &files)?.put_in_place(path)?;
        Ok(notes)
    }

    /// Returns the model as a text that names its meshes in this folder.
    pub fn text(mut self, folder: &str) -> MjcfText {
        self.folder = folder.into();
        let (groups, notes) = Groups::of(self.world);
        self.groups = groups;
        notes.into_iter().for_each(|note| self.note("collision groups", note));
        let settings = self.world.settings();
        if settings.combine_friction != Combine::Max {
            self.note(
                "the world",
                "MuJoCo takes the larger friction of a pair, where this world combines them in another way",
            );
        }
        // names of the world's own
        self.bodies.unique("world".into());
        self.xml.open("worldbody", &Attributes::default());
        self.objects();
        self.xml.close();
        let body = std::mem::take(&mut self.xml).finish();
        self.document(&body)
    }

    fn objects(&mut self) {
        let world = self.world;
        let objects = || world.ids().iter().filter_map(|&id| Some((id, world.name(id)?)));
        self.plan_sites();
        for (id, name) in objects() {
            if world.status(id).is_some_and(|status| !status.enabled) {
                self.note(name, "objects that are disabled are left out");
            } else if let Some(body) = world.get::<RigidBody>(id) {
                self.rigid(id, name, body);
            } else if let Some(body) = world.get::<ArticulatedBody>(id) {
                self.articulated(id, name, body);
            } else if world.get::<LoopJoint>(id).is_none() && world.get::<Mimic>(id).is_none() {
                self.note(name, "sensors, behaviors, events and objects of types of their own are left out");
            }
        }
        for (id, name) in objects().filter(|(id, _)| world.status(*id).is_some_and(|status| status.enabled)) {
            if let Some(joint) = world.get::<LoopJoint>(id) {
                self.loop_joint(id, name, joint);
            } else if let Some(mimic) = world.get::<Mimic>(id) {
                self.coupling(name, mimic);
            }
        }
        self.motors();
        self.pairs();
    }

    /// Writes pairs of objects that never collide.
    fn pairs(&mut self) {
        let world = self.world;
        for ([a, b], material) in world.pair_materials() {
            let named = |side: &PairSide| match side {
                PairSide::Object(id) => world.get::<RigidBody>(*id).and(self.names.get(&(*id, None)).cloned()),
                PairSide::Part(id, part) => {
                    let frame = world.get::<ArticulatedBody>(*id).and_then(|body| body.frame_of(*part));
                    frame.and_then(|frame| self.link_bodies.get(&(*id, frame)).cloned())
                }
                PairSide::Material(_) => None,
            };
            match (named(a), named(b), material.collides) {
                (Some(a), Some(b), Some(false)) if a != b && a != "world" && b != "world" => {
                    let t = Attributes::of("body1", a).with("body2", b);
                    if !self.contacts.iter().any(|(_, other)| *other == t) {
                        self.contacts.push(("exclude", t));
                    }
                }
                _ => self.note(
                    "a pair",
                    "surface constants of pairs, and pairs of materials or with static bodies, are left out",
                ),
            }
            let alone = PairMaterial { collides: Some(false), ..PairMaterial::default() };
            if material.collides == Some(false) && *material != alone {
                self.note("a pair", "constants of a pair that does not collide are left out");
            }
        }
    }

    /// Puts the sections together.
    fn document(mut self, worldbody: &str) -> MjcfText {
        let settings = self.world.settings();
        let mut head = Xml::default();
        head.open("mujoco", &Attributes::of("model", &self.model));
        let compiler = Attributes::of("angle", "radian").with("autolimits", "true").with("inertiafromgeom", "false");
        head.leaf("compiler", &compiler);
        let option = Attributes::of("timestep", numbers([settings.dt])).with("gravity", vector(&settings.gravity));
        head.leaf("option", &option);
        head.section("asset", &self.assets.elements);
        head.verbatim(worldbody);
        head.section("contact", &self.contacts);
        head.section("equality", &self.equalities);
        head.section("actuator", &self.drive_elements);
        let mut key = Attributes::of("name", NOW).with("time", numbers([self.world.time()]));
        for (name, list) in [("qpos", &self.qpos), ("qvel", &self.qvel), ("ctrl", &self.controls)] {
            if !list.is_empty() {
                key.put(name, numbers(list.iter().copied()));
            }
        }
        head.section("keyframe", &[("key", key)]);
        MjcfText { text: head.finish(), files: self.assets.files, notes: self.notes.take() }
    }

    fn note(&mut self, subject: &str, text: impl Into<String>) {
        self.notes.add(subject, text);
    }
}
