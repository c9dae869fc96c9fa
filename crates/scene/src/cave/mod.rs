//! Cave files: positions of screens and users, and the processes that draw.
//!
//! A cave is read like a scene: in one pass that finds all its problems, each with file, line,
//! column, the value and the expected value. The result, a [`Cave`], has references resolved to
//! indices and files to paths. [`Cave::notes`] reports conditions that are not errors, such as gaps
//! between screens and pixels that are not square.
//!
//! Frame of a cave: meters, right-handed, z up. By convention x points to the right when facing the
//! front screen, y ahead, and the origin lies on the floor below the center. Nothing depends on
//! this convention. A scene places the cave with [`crate::CavePlace`].
//!
//! ```
//! let cave = tumble_scene::cave::resolve_cave("cube4")?.load()?;
//! assert_eq!(cave.facets.len(), 4);
//! let error = tumble_scene::cave::Cave::parse("[[screen]]\nnme = \"front\"\n", "my.toml").unwrap_err();
//! assert!(error.to_string().contains("my.toml:2:1: unknown key `nme` in screen 1; did you mean `name`?"));
//! # Ok::<(), tumble_scene::cave::CaveError>(())
//! ```

mod checks;
mod devices;
mod error;
mod facet;
mod parts;
mod settings;
mod shipped;
mod surface;
mod tracker;

pub use checks::{Gap, MAX_PIXELS, MAX_SIDE_PX, RIM_PX, SQUARE_TOLERANCE, gaps};
pub use devices::DeviceMap;
pub use error::CaveError;
pub use facet::{Display, Facet, FacetColor, Flip, Output, Stereo};
pub use parts::{LAUNCH_PLACEHOLDERS, Node, Screen, User};
pub use settings::{Compute, Mode, Recording, Security, Sync, Transport};
pub use shipped::{CaveSource, ShippedCave, resolve_cave, shipped_caves};
pub use surface::{Place, Surface, SurfaceFrame};
pub use tracker::{Axes, TRACKER_PORT, Tracker};

use std::collections::BTreeMap;
use std::io::Read;
use std::ops::Range;
use std::path::Path;

use toml::de::DeTable;

use crate::open::plain::open_file;
use crate::parse::fields::Fields;
use crate::parse::file::{parse_toml, read_table};
use crate::parse::log::Log;
use crate::parse::problem::Invalid;
use crate::parse::suggest::nearest;

/// Largest cave file in bytes: 1 MiB.
pub const MAX_BYTES: u64 = 1 << 20;
/// Largest number of users, screens, nodes, and facets, of each.
pub const MAX_PARTS: usize = 256;
/// Tables that caves have and scenes do not. A file with one of them is a cave.
const MARKS: [&str; 5] = ["user", "screen", "node", "facet", "sync"];
/// Tables that scenes have and caves do not.
const SCENE_MARKS: [&str; 8] = ["world", "body", "articulated", "ground", "grid", "camera", "cave", "materials"];

/// A cave as its file describes it: checked, references resolved.
#[derive(Clone, Debug, PartialEq)]
pub struct Cave {
    /// The name of the file as errors show it.
    pub file: String,
    /// One line that describes the cave; may be empty.
    pub description: String,
    /// `[[user]]`, at least one.
    pub users: Vec<User>,
    /// `[[screen]]`, at least one.
    pub screens: Vec<Screen>,
    /// `[[node]]`; empty if all facets are drawn on this machine.
    pub nodes: Vec<Node>,
    /// `[[facet]]`, at least one.
    pub facets: Vec<Facet>,
    /// `[sync]`.
    pub sync: Sync,
    /// `[security]`.
    pub security: Option<Security>,
    /// `[recording]`.
    pub recording: Option<Recording>,
    /// `[tracker]`.
    pub tracker: Option<Tracker>,
}

impl Cave {
    /// Reads the cave file at `path`.
    ///
    /// # Errors
    /// [`CaveError`]: the file cannot be read, is larger than 1 MiB or not UTF-8, or has problems.
    /// All problems are reported at once.
    pub fn load(path: impl AsRef<Path>) -> Result<Cave, CaveError> {
        let path = path.as_ref();
        let unread = |source| CaveError::Read { file: path.to_path_buf(), source };
        let mut bytes = Vec::new();
        open_file(path).map_err(unread)?.take(MAX_BYTES + 1).read_to_end(&mut bytes).map_err(unread)?;
        if bytes.len() as u64 > MAX_BYTES {
            return Err(CaveError::TooLarge { file: path.to_path_buf(), limit: MAX_BYTES });
        }
        match std::str::from_utf8(&bytes) {
            Ok(text) => Cave::parse(text, &path.display().to_string()),
            Err(error) => Err(CaveError::NotUtf8 { file: path.to_path_buf(), byte: error.valid_up_to() }),
        }
    }

    /// Reads a cave from its text. `file_name` is shown in errors; paths in the cave are relative
    /// to its folder.
    ///
    /// # Errors
    /// [`CaveError::TooLarge`] or [`CaveError::Invalid`].
    pub fn parse(text: &str, file_name: &str) -> Result<Cave, CaveError> {
        if text.len() as u64 > MAX_BYTES {
            return Err(CaveError::TooLarge { file: file_name.into(), limit: MAX_BYTES });
        }
        let log = Log::new(text);
        let cave = parse_toml(&log, text).map(|root| Cave::read(&log, &root, file_name));
        match cave {
            Some(cave) if log.count() == 0 => Ok(cave),
            _ => {
                let problems = log.into_problems();
                Err(CaveError::Invalid(Box::new(Invalid {
                    file: file_name.to_owned(),
                    text: text.to_owned(),
                    problems,
                })))
            }
        }
    }

    fn read(log: &Log<'_>, root: &DeTable<'_>, file_name: &str) -> Cave {
        let folder = Path::new(file_name).parent().unwrap_or(Path::new(""));
        let mut f = Fields::of_table(log, root, 0..0, "the cave");
        let description = f.optional_text("description").map_or("", |(text, _)| text).to_owned();
        let users = named(&mut f, "user", User::read, |user| &user.name);
        let screens = named(&mut f, "screen", |table| Screen::read(table, folder), |screen| &screen.name);
        let nodes = named(&mut f, "node", Node::read, |node| &node.name);
        let facets =
            named(&mut f, "facet", |table| Facet::read(table, &users, &screens, &nodes, folder), |facet| &facet.name);
        for (key, count) in [("user", users.len()), ("screen", screens.len()), ("facet", facets.len())] {
            if count == 0 && f.value(key).is_none() {
                f.missing(key, &format!("at least one table [[{key}]]"));
            }
        }
        let sync = read_table(&mut f, "sync", Sync::read).unwrap_or_default();
        let security = read_table(&mut f, "security", |table| Security::read(table, folder)).flatten();
        let recording = read_table(&mut f, "recording", |table| Recording::read(table, folder)).flatten();
        let tracker = read_table(&mut f, "tracker", |table| Tracker::read(table, &users, security.is_some()));
        let place = f.value("sync").map_or(0..0, |value| value.span());
        let tables = f.value("facet").and_then(|value| value.get_ref().as_array());
        let places: Vec<_> = tables.into_iter().flat_map(|tables| tables.iter().map(|table| table.span())).collect();
        f.finish();
        let cave = Cave {
            file: file_name.to_owned(),
            description,
            users,
            screens,
            nodes,
            facets,
            sync,
            security,
            recording,
            tracker,
        };
        if log.count() == 0 {
            settings::check_reach(&cave, log, &place);
            checks::processes(&cave, log, &places);
        }
        cave
    }

    /// Returns notes about the cave: gaps between neighboring screens, pixels that are not square,
    /// screens without a facet.
    pub fn notes(&self) -> Vec<String> {
        checks::notes(self)
    }

    /// Returns a summary in one line.
    pub fn summary(&self) -> String {
        let count = |n: usize, one: &str, many: &str| format!("{n} {}", if n == 1 { one } else { many });
        format!(
            "a cave of {} on {}, {}, {}",
            count(self.facets.len(), "facet", "facets"),
            count(self.screens.len(), "screen", "screens"),
            count(self.users.len(), "user", "users"),
            if self.nodes.is_empty() {
                "all on this machine".to_owned()
            } else {
                count(self.nodes.len(), "node", "nodes")
            }
        )
    }

    /// Returns the facet of that name.
    ///
    /// # Errors
    /// [`CaveError::NoFacet`] with the names of all facets.
    pub fn facet(&self, name: &str) -> Result<&Facet, CaveError> {
        self.facets.iter().find(|facet| facet.name == name).ok_or_else(|| CaveError::no_facet(self, name))
    }
}

/// Returns whether a text is meant as a cave: it has a table that only caves have, or, without any
/// of a scene's tables, one with nearly such a name.
pub fn is_cave(text: &str) -> bool {
    let (root, _) = DeTable::parse_recoverable(text.get(..text.len().min(MAX_BYTES as usize)).unwrap_or(""));
    let root = root.get_ref();
    let nearly = || root.keys().any(|key| nearest(key.get_ref(), MARKS).is_some());
    MARKS.iter().any(|key| root.get(*key).is_some())
        || (!SCENE_MARKS.iter().any(|key| root.get(*key).is_some()) && nearly())
}

/// Reads the tables `[[key]]` and checks that their names are unique.
fn named<'a, T>(
    f: &mut Fields<'a>,
    key: &'static str,
    read: impl Fn(Fields<'a>) -> Option<T>,
    name: impl Fn(&T) -> &str,
) -> Vec<T> {
    let mut taken: BTreeMap<String, Range<usize>> = BTreeMap::new();
    let mut out = Vec::new();
    for mut table in f.tables(key, MAX_PARTS) {
        let (log, place) = (table.log, table.value("name").map_or(table.span.clone(), |value| value.span()));
        let Some(part) = read(table) else { continue };
        match taken.get(name(&part)) {
            Some(earlier) => {
                let message = format!(
                    "`name`: a second {key} \"{}\"; the first is at line {}",
                    name(&part),
                    log.line(earlier.start)
                );
                log.report(place, message, "expected a unique name");
            }
            None => {
                taken.insert(name(&part).to_owned(), place);
            }
        }
        out.push(part);
    }
    out
}
