//! URDF: links, joints, masses and shapes of a robot from XML files.
//!
//! ```no_run
//! use tumble_scene::urdf::{UrdfOptions, load};
//!
//! let options = UrdfOptions { floating: true, ..UrdfOptions::default() };
//! let (robot, notes) = load("anymal.urdf", &options)?;
//! notes.iter().for_each(|note| println!("{note}"));
//! # Ok::<(), tumble_scene::urdf::UrdfError>(())
//! ```
//!
//! | element | meaning |
//! |---|---|
//! | `<inertial>` | mass, center of mass and inertia, rotated by its origin; a link without one is massless |
//! | `<joint>` revolute, continuous, prismatic, fixed | the joint of that type; fixed links are merged into their parents |
//! | `<joint>` planar | two massless prismatic joints `NAME/x`, `NAME/y` in the plane, then a revolute joint `NAME` about its normal |
//! | `<joint>` floating | a floating root if its parent is fixed to the base; else prismatic joints `NAME/x`, `/y`, `/z` and a spherical joint |
//! | `<limit>` | position limits; effort is the default force limit of drives; velocity is stored and not enforced |
//! | `<dynamics>` | viscous damping and dry friction |
//! | `<mimic>` | a coupling of the two joints |
//! | `<collision>` | box, cylinder, sphere, capsule; meshes in STL, OBJ, PLY and COLLADA |
//! | `<visual>` | the same, with the color of its material. Its mesh need not be closed, is read when it is first drawn, and does not collide. If no visual of a link can be read, its collision shapes are drawn |
//!
//! Other elements (transmissions, sensors, extensions of simulators) are ignored. The root link is
//! fixed to the base, or floats with [`UrdfOptions::floating`].

mod files;
mod joint;
mod link;
mod share;
mod spheres;
mod tree;
mod xml;

use std::collections::BTreeMap;
use std::io::Read;
use std::ops::Range;
use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::articulated::ArticulatedSpec;
use crate::assemble;
use crate::build::Notes;
use crate::error::Invalid;
use crate::link::{LinkSpec, Surface};
use crate::link_shapes::{Purpose, ShapeMaker};
use crate::log::Log;
use crate::notes::NoteList;
pub use spheres::{LinkSpheres, SphereOptions, SphereRobot, spherize};

use joint::JointElement;
use link::{Context, LinkElement, read_color};
use tree::TreeBuilder;
use tumble_core::articulated::{ArticulatedBody, DofSettings, LinkMass, MAX_LINKS, Model, ModelError};
use xml::Element;

/// Largest URDF in bytes: 64 MiB.
const MAX_BYTES: u64 = 64 << 20;

/// What happens with collision meshes that do not exist or cannot be read. Visual meshes are never
/// an error: missing ones are left out with a note, unreadable ones when they are drawn
/// ([`visual_notes`](crate::visual_notes)).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MissingMeshes {
    /// An error.
    #[default]
    Error,
    /// Left out, with a note.
    Skip,
}

/// The shape that a collision mesh collides as.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CollisionMeshes {
    /// The mesh itself if it is closed; an open one as its convex hull, with a note.
    #[default]
    Exact,
    /// Its convex hull.
    Hull,
}

/// How a URDF is read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct UrdfOptions {
    /// Whether the root link floats. Otherwise it is fixed to the base.
    pub floating: bool,
    /// Folders of packages by name, for `package://NAME/…`. Other packages are searched in the
    /// folders above the URDF.
    pub packages: BTreeMap<String, PathBuf>,
    /// Default [`MissingMeshes::Error`].
    pub missing_meshes: MissingMeshes,
    /// Default [`CollisionMeshes::Exact`].
    pub collision_meshes: CollisionMeshes,
    /// Surface of all links.
    pub surface: Surface,
    /// Whether the appearance of `surface` replaces the file's colors.
    pub recolor: bool,
}

/// Why a URDF could not be read.
#[derive(Debug, Error)]
pub enum UrdfError {
    /// The file could not be opened or read.
    #[error("{}: cannot read the URDF: {source}", file.display())]
    Read {
        /// The path that was tried.
        file: PathBuf,
        /// From the system.
        source: std::io::Error,
    },
    /// The file is too large.
    #[error("{}: the file is larger than {MAX_BYTES} bytes, the limit for URDFs", file.display())]
    TooLarge {
        /// The path that was tried.
        file: PathBuf,
    },
    /// The file is not UTF-8.
    #[error("{}:{line}: byte {byte} of the file is not UTF-8; a URDF is a UTF-8 text in XML", file.display())]
    NotUtf8 {
        /// The path that was tried.
        file: PathBuf,
        /// The line, from 1.
        line: usize,
        /// Offset of the first invalid byte, from 0.
        byte: usize,
    },
    /// The text has one or more problems.
    #[error("{0}")]
    Invalid(Box<Invalid>),
    /// The links do not form a tree that can move.
    #[error("{}: {source}", file.display())]
    Model {
        /// The file.
        file: PathBuf,
        /// From the model.
        source: ModelError,
    },
    /// A mesh cannot be read, or a shape or constant is invalid.
    #[error("{}: {why}", file.display())]
    Body {
        /// The file.
        file: PathBuf,
        /// The reason; names the link.
        why: String,
    },
}

/// Reads a URDF as an articulated body at the origin with its shapes, limits and couplings. Visual
/// meshes are read when they are first drawn. Also returns notes about the file.
///
/// # Errors
/// [`UrdfError`]: a file cannot be read, or has problems. All problems of the XML are reported at once, with line and column.
pub fn load(path: impl AsRef<Path>, options: &UrdfOptions) -> Result<(ArticulatedBody, Notes), UrdfError> {
    let path = path.as_ref();
    let robot = read_file(path, options, Content::Body)?;
    let mut maker = ShapeMaker::new(&[], Purpose::Stepped);
    let spec = ArticulatedSpec { exclude_overlapping: true, ..ArticulatedSpec::of(robot.name, robot.links) };
    let body = assemble::body(&spec, &mut maker).map_err(|why| UrdfError::Body { file: path.to_path_buf(), why })?;
    Ok((body, robot.notes.into_iter().chain(maker.notes.take()).collect()))
}

/// The tree of a URDF without its shapes.
#[derive(Clone, Debug, PartialEq)]
pub struct UrdfModel {
    /// The robot's name.
    pub name: String,
    /// Its links and joints.
    pub model: Model,
    /// Names of its joints, one for each of [`Model::links`], in the order of the coordinates. The
    /// name for a floating root is that of the root link.
    pub joints: Vec<String>,
    /// Limits, damping and dry friction of its degrees of freedom, in the order of the velocities.
    pub dofs: Vec<DofSettings>,
    /// Notes about the file.
    pub notes: Vec<String>,
}

/// Reads the tree of a URDF without its shapes. No mesh is searched for.
///
/// # Errors
/// [`UrdfError`]: the file cannot be read, or has problems. All problems are reported at once, with line and column.
pub fn model(path: impl AsRef<Path>, options: &UrdfOptions) -> Result<UrdfModel, UrdfError> {
    let path = path.as_ref();
    let robot = read_file(path, options, Content::Tree)?;
    robot.into_model(path)
}

/// As [`model`], from a text; `file_name` is shown in errors.
///
/// # Errors
/// As [`model`], except those of files.
pub fn parse_model(text: &str, file_name: &str, options: &UrdfOptions) -> Result<UrdfModel, UrdfError> {
    let path = Path::new(file_name);
    read_text(text, path, options, Content::Tree)?.into_model(path)
}

impl Robot {
    fn into_model(self, path: &Path) -> Result<UrdfModel, UrdfError> {
        let masses: Vec<LinkMass> = self.links.iter().map(LinkSpec::given_mass).collect();
        let model = assemble::model(&self.links, &masses)
            .map_err(|source| UrdfError::Model { file: path.to_path_buf(), source })?;
        let (joints, dofs) = (assemble::moving_joints(&self.links), assemble::dofs(&self.links));
        Ok(UrdfModel { joints, dofs, name: self.name, model, notes: self.notes })
    }
}

impl UrdfError {
    /// Returns the error as a report for people, as
    /// [`SceneError::report`](crate::SceneError::report).
    pub fn report(&self, color: bool) -> String {
        match self {
            UrdfError::Invalid(invalid) => invalid.report(color),
            other => format!("error: {other}\n"),
        }
    }
}

/// The content of a URDF.
pub(crate) struct Robot {
    pub(crate) name: String,
    /// A parent before its children.
    pub(crate) links: Vec<LinkSpec>,
    pub(crate) notes: Vec<String>,
}

/// The parts of a file that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Content {
    /// Links, joints and masses; no mesh is searched for.
    Tree,
    /// Everything.
    Body,
    /// The shapes; links may move without a mass.
    Geometry,
}

/// Reads a file.
pub(crate) fn read_file(path: &Path, options: &UrdfOptions, content: Content) -> Result<Robot, UrdfError> {
    read_text(&text_of(path)?, path, options, content)
}

/// Reads the text of a file.
fn text_of(path: &Path) -> Result<String, UrdfError> {
    let unread = |source| UrdfError::Read { file: path.to_path_buf(), source };
    let mut bytes = Vec::new();
    std::fs::File::open(path).map_err(unread)?.take(MAX_BYTES + 1).read_to_end(&mut bytes).map_err(unread)?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(UrdfError::TooLarge { file: path.to_path_buf() });
    }
    String::from_utf8(bytes).map_err(|error| {
        let byte = error.utf8_error().valid_up_to();
        let line = 1 + error.as_bytes()[..byte].iter().filter(|&&b| b == b'\n').count();
        UrdfError::NotUtf8 { file: path.to_path_buf(), line, byte }
    })
}

/// Reads a text. `path` is shown in messages, and meshes are relative to its folder.
pub(crate) fn read_text(text: &str, path: &Path, options: &UrdfOptions, content: Content) -> Result<Robot, UrdfError> {
    let log = Log::new(text);
    let file = path.display().to_string();
    let document = xml::parse(&log, text);
    let robot = document.as_ref().and_then(|document| {
        let context = Context {
            folder: path.parent().unwrap_or(Path::new("")),
            file: &file,
            options,
            content,
            colors: BTreeMap::new(),
            notes: NoteList::default(),
        };
        read_robot(&Element::new(&log, document.root_element()), context)
    });
    match robot {
        Some(robot) if log.count() == 0 => Ok(robot),
        _ => {
            drop(document);
            Err(UrdfError::Invalid(Box::new(Invalid { file, text: text.to_owned(), problems: log.into_problems() })))
        }
    }
}

/// Reads `<robot>`. `None`, with the problems recorded, if it has no tree.
fn read_robot(robot: &Element<'_, '_>, mut context: Context<'_>) -> Option<Robot> {
    if robot.tag() != "robot" {
        robot.problem("is the outermost element", "expected <robot>");
        return None;
    }
    let colors: Vec<_> = robot.children("material").filter_map(|m| Some((m.text("name")?, read_color(&m)?))).collect();
    context.colors = colors.iter().map(|(name, color)| ((*name).to_owned(), *color)).collect();
    let mut taken = BTreeMap::new();
    let elements: Vec<LinkElement> =
        robot.children("link").filter_map(|link| LinkElement::read(&link, &mut context)).collect();
    let mut names = BTreeMap::new();
    for (number, link) in elements.iter().enumerate() {
        names.insert(link.name.clone(), number);
        note_unique(robot.log, &mut taken, "link", &link.name, &link.span);
    }
    if elements.is_empty() || elements.len() > MAX_LINKS {
        robot.problem(format_args!("has {} links", elements.len()), format!("expected 1 to {MAX_LINKS}"));
        return None;
    }
    let joints: Vec<JointElement> =
        robot.children("joint").filter_map(|joint| JointElement::read(&joint, &names)).collect();
    taken.clear();
    joints.iter().for_each(|joint| note_unique(robot.log, &mut taken, "joint", &joint.name, &joint.span));
    if robot.log.count() > 0 {
        return None;
    }
    let root = tree::find_root(robot.log, &elements, &joints)?;
    let name = robot.text("name").unwrap_or("robot").to_owned();
    let links = TreeBuilder::new(robot.log, elements, &joints).build(root, &mut context);
    Some(Robot { name, links, notes: context.notes.take() })
}

fn note_unique(log: &Log<'_>, taken: &mut BTreeMap<String, usize>, kind: &str, name: &str, span: &Range<usize>) {
    if let Some(line) = taken.insert(name.to_owned(), log.line(span.start)) {
        let message = format!("there is a second {kind} \"{name}\"; the first is at line {line}");
        log.report(span.clone(), message, "expected a unique name");
    }
}
