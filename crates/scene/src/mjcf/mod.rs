//! MJCF: whole models of MuJoCo as scenes.
//!
//! ```no_run
//! use tumble_scene::mjcf::{MjcfOptions, load};
//!
//! let scene = load("cartpole.xml", &MjcfOptions::default())?;
//! scene.notes.iter().for_each(|note| println!("{note}"));
//! let (world, _) = scene.build().unwrap();
//! # Ok::<(), tumble_scene::mjcf::MjcfError>(())
//! ```
//!
//! | element | meaning |
//! |---|---|
//! | `<compiler>`, `<default>`, `<include>`, `<frame>`, `<replicate>` | resolved during reading |
//! | `<option>` | gravity and time step of the world |
//! | `<body>` without a joint above it | static bodies, one for each geom; one kinematic body for `mocap` and all that is fixed to it |
//! | `<body>` with one free joint and no child | a rigid body, if all its geoms collide in the same way |
//! | other trees of `<body>` | an articulated body, named for its root; several joints of a body are a chain of massless links `BODY/JOINT` |
//! | `<joint>` | limits, damping, dry friction, spring, armature; positions are those of MuJoCo, `ref` included |
//! | `<geom>` | a shape that collides, is drawn and has mass; meshes collide by their convex hulls |
//! | `<inertial>` | mass, center of mass and inertia; else those of the geoms |
//! | `<actuator>` | position and velocity actuators are drives; all affine ones are listed in [`SceneFile::actuators`](crate::SceneFile::actuators) |
//! | `<equality>` connect, weld, joint | loop joints and couplings |
//! | `<contact>` pair, exclude | pairs |
//! | `<keyframe>` | the initial state, if [`MjcfOptions::keyframe`] names one |
//! | `<site>`, `<camera>`, `<light>` | frames, cameras and lights on links |
//!
//! Everything else is a note with the file, the line and the element of its first occurrence.
//!
//! [`MjcfWriter`] writes a world as a model.

mod actuator;
mod asset;
mod bodies;
mod compiler;
mod defaults;
mod equality;
mod error;
mod gains;
mod geom;
mod inertia;
mod joint;
mod keyframe;
mod load;
mod mass;
mod mesh;
mod mocap;
mod names;
mod notes;
mod options;
mod pairs;
mod scene;
mod schema;
mod sensor;
mod shapes;
mod source;
mod tree;
mod views;
mod write;

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

use tumble_core::articulated::LinkMass;
use tumble_core::collide::TriMesh;

pub use actuator::ActuatorSpec;
pub(crate) use compiler::turn_z_to;
pub use error::MjcfError;
pub(crate) use load::one_body;
pub use load::{articulation, load, parse};
pub use options::MjcfOptions;
pub use write::{MjcfText, MjcfWriter, SaveMjcfError};

use asset::{Assets, MeshAsset};
use compiler::Compiler;
use defaults::Classes;
use notes::Ledger;
use source::XmlNode;

use crate::urdf::CollisionMeshes;
use crate::xml::Element;

/// Results for each mesh by its name.
type Made<T> = RefCell<BTreeMap<String, Result<T, String>>>;

/// Settings, classes and assets, with which all parts of a model are read.
struct Reader<'a> {
    options: MjcfOptions,
    /// Whether files other than the text may be opened.
    files: bool,
    notes: Ledger,
    classes: Classes<'a>,
    compiler: Compiler,
    assets: Assets<'a>,
    /// Height fields that are left out.
    skipped_fields: BTreeSet<String>,
    solids: Made<Arc<TriMesh>>,
    masses: Made<LinkMass>,
    contacts: bool,
    gravity: bool,
    limits: bool,
    springs: bool,
    dampers: bool,
    friction: bool,
    equality: bool,
    actuation: bool,
}

impl<'a> Reader<'a> {
    /// Reads what other elements refer to: settings, classes and assets.
    fn new(root: &XmlNode<'a>, folder: &Path, options: &MjcfOptions, files: bool) -> Reader<'a> {
        let notes = Ledger::default();
        let (classes, compiler) = (Classes::read(root, &notes), Compiler::read(root, folder, &notes));
        let flags: Vec<&Element<'a, 'a>> =
            root.all("option").flat_map(|option| option.all("flag")).map(|flag| &flag.element).collect();
        flags.iter().for_each(|flag| schema::FLAG.check(flag, &notes));
        let enabled = |name: &str| {
            flags.iter().rev().find_map(|flag| flag.word(name, &[("enable", true), ("disable", false)])).unwrap_or(true)
        };
        let passive = enabled("passive");
        let mut reader = Reader {
            options: options.clone(),
            files,
            classes,
            compiler,
            assets: Assets::default(),
            skipped_fields: BTreeSet::new(),
            solids: RefCell::default(),
            masses: RefCell::default(),
            contacts: enabled("contact"),
            gravity: enabled("gravity"),
            limits: enabled("limit"),
            springs: passive && enabled("spring"),
            dampers: passive && enabled("damper"),
            friction: enabled("frictionloss"),
            equality: enabled("equality"),
            actuation: enabled("actuation"),
            notes,
        };
        reader.assets = Assets::read(root, &reader);
        let fields = root.all("asset").flat_map(|section| section.all("hfield"));
        let skipped = fields.filter_map(|field| Some((field.element.text("name"), field.element.text("file")?)));
        let skipped = skipped.filter_map(|(name, file)| name.map_or_else(|| asset::stem(file), |n| Some(n.to_owned())));
        reader.skipped_fields = skipped.collect();
        reader
    }

    /// Returns a mesh as the solid that collides. Each is made once.
    fn solid(&self, name: &str) -> Result<Arc<TriMesh>, String> {
        let exact = self.options.collision_meshes == CollisionMeshes::Exact;
        self.made(&self.solids, name, |mesh| mesh.solid(exact).map(Arc::new))
    }

    /// Returns the mass of a mesh at density 1. Each is computed once.
    fn mesh_mass(&self, name: &str) -> Result<LinkMass, String> {
        self.made(&self.masses, name, MeshAsset::mass)
    }

    fn made<T: Clone>(
        &self,
        known: &Made<T>,
        name: &str,
        make: impl Fn(&MeshAsset<'a>) -> Result<T, String>,
    ) -> Result<T, String> {
        if let Some(known) = known.borrow().get(name) {
            return known.clone();
        }
        let made = match self.assets.meshes.get(name) {
            Some(mesh) => make(mesh),
            None => Err("there is no such mesh".into()),
        };
        known.borrow_mut().insert(name.to_owned(), made.clone());
        made
    }

    /// Returns whether further problems in the file of an element would be dropped.
    fn log_is_full(&self, element: &Element<'_, '_>) -> bool {
        element.log.is_full()
    }
}
