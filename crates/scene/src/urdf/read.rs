//! Reads the text of a URDF into links.

use std::collections::BTreeMap;
use std::io::Read;
use std::ops::Range;
use std::path::Path;

use tumble_core::articulated::MAX_LINKS;

use super::error::{MAX_BYTES, UrdfError};
use super::joint::JointElement;
use super::link::{Context, LinkElement, read_color};
use super::options::UrdfOptions;
use super::tree::{self, TreeBuilder};
use crate::notes::NoteList;
use crate::parse::link::LinkSpec;
use crate::parse::log::Log;
use crate::parse::problem::Invalid;
use crate::xml::{self, Element};
/// The format, for messages about a text that is no XML.
pub(super) const EXPECTED: &str = "a URDF: an XML document with one element <robot>";

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
pub(crate) fn text_of(path: &Path) -> Result<String, UrdfError> {
    let unread = |source| UrdfError::Read { file: path.to_path_buf(), source };
    let mut bytes = Vec::new();
    crate::open_file(path).map_err(unread)?.take(MAX_BYTES + 1).read_to_end(&mut bytes).map_err(unread)?;
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
    let file = path.display().to_string();
    let log = Log::new(text).named(&file);
    let document = xml::parse(&log, text, EXPECTED);
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
    let mut links = TreeBuilder::new(robot.log, elements, &joints).build(root, &mut context);
    for joint in links.iter_mut().map(|link| &mut link.joint).filter(|_| context.options.velocity_limits) {
        joint.dof.max_velocity = joint.speed.filter(|_| joint.is_single()).unwrap_or(f64::INFINITY);
    }
    Some(Robot { name, links, notes: context.notes.take() })
}

fn note_unique(log: &Log<'_>, taken: &mut BTreeMap<String, usize>, kind: &str, name: &str, span: &Range<usize>) {
    if let Some(line) = taken.insert(name.to_owned(), log.line(span.start)) {
        let message = format!("there is a second {kind} \"{name}\"; the first is at line {line}");
        log.report(span.clone(), message, "expected a unique name");
    }
}
