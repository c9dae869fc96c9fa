//! Names of bodies and links in recordings.
//!
//! | entity | name |
//! |---|---|
//! | a body of one part | that of the body: `ball` |
//! | a link of an articulated body | `BODY/LINK`: `leg/foot` |
//! | a part of another object with several parts | `OBJECT/NUMBER` |
//!
//! If a link of a body has no name, or another body or link has the same name in full, all links of that body have their
//! numbers instead, the indices in [`Model::frames`](tumble_core::Model::frames): `leg/3`.

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
    /// Whether the links of a body have numbers, for the bodies that were asked for.
    numbered: RefCell<BTreeMap<ObjectId, bool>>,
}

impl<'w> Names<'w> {
    pub fn of(world: &'w World) -> Names<'w> {
        Names { world, numbered: RefCell::default() }
    }

    /// Returns the name of an object.
    pub fn object(&self, id: ObjectId) -> String {
        shortened(self.world.name(id).unwrap_or_default().to_owned())
    }

    /// Returns the name of a site.
    pub fn site(&self, site: Site) -> String {
        let name = |id: ObjectId| self.world.name(id).unwrap_or_default();
        match site {
            Site::Part(id, part) => {
                let several = self.world.view().state_range(id).is_some_and(|span| span.parts.len() > 1);
                shortened(if several { format!("{}/{part}", name(id)) } else { name(id).to_owned() })
            }
            Site::Link(id, link) => {
                let named = self.link(id, link).filter(|_| !self.is_numbered(id));
                shortened(format!("{}/{}", name(id), named.map_or_else(|| link.to_string(), str::to_owned)))
            }
        }
    }

    /// Returns the name of a link without that of its body.
    pub fn link(&self, id: ObjectId, link: usize) -> Option<&'w str> {
        Some(&self.world.get::<ArticulatedBody>(id)?.model().frames().get(link)?.name)
    }

    fn is_numbered(&self, id: ObjectId) -> bool {
        if let Some(known) = self.numbered.borrow().get(&id) {
            return *known;
        }
        let frames = self.world.get::<ArticulatedBody>(id).map_or(&[][..], |body| body.model().frames());
        let numbered = frames.iter().any(|frame| frame.name.is_empty() || self.is_taken(id, &frame.name));
        self.numbered.borrow_mut().insert(id, numbered);
        numbered
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
