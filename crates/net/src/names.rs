//! Names of bodies and links in recordings.
//!
//! | entity | name |
//! |---|---|
//! | a body of one part | that of the body: `ball` |
//! | a link of an articulated body | `BODY/LINK`: `leg/foot` |
//! | a part of another object with several parts | `OBJECT/NUMBER` |
//!
//! If a link of a body has no name, or another body or link has the same name in full, all links of that body have their
//! numbers instead, the indices in [`Model::frames`](tumble_core::Model::frames): `leg/3`. If one of these is taken too, they are
//! `leg/#3`, with as many `#` as it takes.

use crate::record::MAX_NAME_BYTES;
use std::cell::RefCell;
use std::collections::BTreeMap;
use tumble_core::{ArticulatedBody, ObjectId, World};
use xxhash_rust::xxh3::xxh3_64;

/// An entity with a frame of its own in a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Site {
    /// A part of an object.
    Part(ObjectId, usize),
    /// A link of an articulated body, an index in the frames of its model.
    Link(ObjectId, usize),
}

impl Site {
    /// Returns the site to which the shapes of a part belong; `None` for the base of an articulated body.
    pub fn of_part(world: &World, id: ObjectId, part: usize) -> Option<Site> {
        match world.get::<ArticulatedBody>(id) {
            Some(body) => Some(Site::Link(id, body.frame_of(part)?)),
            None => Some(Site::Part(id, part)),
        }
    }
}

/// The names of the sites of a world.
pub(crate) struct Names<'w> {
    world: &'w World,
    /// The styles of the objects that were asked for.
    styles: RefCell<BTreeMap<ObjectId, usize>>,
}

impl<'w> Names<'w> {
    pub fn of(world: &'w World) -> Names<'w> {
        Names { world, styles: RefCell::default() }
    }

    /// Returns the name of an object.
    pub fn object(&self, id: ObjectId) -> String {
        shortened(self.world.name(id).unwrap_or_default().to_owned())
    }

    /// Returns the name of a site.
    pub fn site(&self, site: Site) -> String {
        let (Site::Part(id, k) | Site::Link(id, k)) = site;
        let name = self.world.name(id).unwrap_or_default();
        shortened(match site {
            Site::Part(..) if self.parts(id) <= 1 => name.to_owned(),
            _ => format!("{name}/{}", self.within(id, k, self.style(id))),
        })
    }

    /// Returns the number of parts of an object, or of links of an articulated body.
    fn parts(&self, id: ObjectId) -> usize {
        match self.world.get::<ArticulatedBody>(id) {
            Some(body) => body.model().frames().len(),
            None => self.world.view().state_range(id).map_or(0, |span| span.parts.len()),
        }
    }

    /// Returns the name of a link or part without that of its object: in style 0 that of the link, which may be empty, then
    /// the number, then the number with one more `#` in front in each style.
    fn within(&self, id: ObjectId, k: usize, style: usize) -> String {
        match style.checked_sub(1) {
            None => self.world.get::<ArticulatedBody>(id).map_or(String::new(), |b| b.model().frames()[k].name.clone()),
            Some(marks) => format!("{}{k}", "#".repeat(marks)),
        }
    }

    /// Returns the first style in which all links or parts of an object have names that nothing else has.
    fn style(&self, id: ObjectId) -> usize {
        if let Some(known) = self.styles.borrow().get(&id) {
            return *known;
        }
        let fits = |style: &usize| {
            let mut names = (0..self.parts(id)).map(|k| self.within(id, k, *style));
            names.all(|name| !name.is_empty() && !self.is_taken(id, &name))
        };
        // each object can take one style
        let style = (0..=self.world.ids().len() + 1).find(fits).unwrap_or(1);
        self.styles.borrow_mut().insert(id, style);
        style
    }

    /// Returns whether another object, or a part or link of another object, has the full name of a link.
    fn is_taken(&self, id: ObjectId, link: &str) -> bool {
        let name = self.world.name(id).unwrap_or_default();
        let full = format!("{name}/{link}");
        let of_another = |at: usize| {
            let Some(other) = self.world.find(&full[..at]).filter(|other| *other != id) else { return false };
            let (rest, number) = (&full[at + 1..], full[at + 1..].parse::<usize>().ok());
            match self.world.get::<ArticulatedBody>(other) {
                Some(body) => {
                    let frames = body.model().frames();
                    body.model().frame(rest).is_some() || number.is_some_and(|number| number < frames.len())
                }
                None => number.is_some_and(|number| self.world.part_state(other, number).is_some()),
            }
        };
        self.world.find(&full).is_some() || full.match_indices('/').any(|(at, _)| of_another(at))
    }
}

/// Returns a name of at most [`MAX_NAME_BYTES`]. A longer name is replaced by its beginning, `~`,
/// and 16 hexadecimal digits, the XXH3 of the whole name.
pub(crate) fn shortened(name: String) -> String {
    if name.len() <= MAX_NAME_BYTES {
        return name;
    }
    let hash = format!("~{:016x}", xxh3_64(name.as_bytes()));
    let room = MAX_NAME_BYTES - hash.len();
    let end = (0..=room).rev().find(|&n| name.is_char_boundary(n)).unwrap_or(0);
    name[..end].to_owned() + &hash
}
