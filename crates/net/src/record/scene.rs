//! Visible content: entities, their parts and poses, as plain data.

use super::error::{RecordError, Result};
use super::schemas::ROOT_FRAME;
use super::{MAX_CONTACTS, MAX_ENTITIES, MAX_NAME_BYTES};
use std::collections::BTreeSet;

/// Pose of a frame in its parent: rotate, then translate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Origin, meters.
    pub position: [f64; 3],
    /// Unit quaternion, `x, y, z, w`.
    pub rotation: [f64; 4],
}

impl Pose {
    /// The identity: no rotation, no translation.
    pub const IDENTITY: Pose = Pose { position: [0.0; 3], rotation: [0.0, 0.0, 0.0, 1.0] };

    /// Returns a translation without rotation, meters.
    pub const fn at(position: [f64; 3]) -> Pose {
        Pose { position, ..Pose::IDENTITY }
    }

    /// Returns why a viewer cannot use this pose, if so: numbers not finite, or a quaternion not of
    /// unit length (1e-3).
    pub(crate) fn fault(&self) -> Option<String> {
        let finite = self.position.iter().chain(&self.rotation).all(|x| x.is_finite());
        let norm = self.rotation.iter().map(|x| x * x).sum::<f64>().sqrt();
        match (finite, (norm - 1.0).abs() <= 1e-3) {
            (false, _) => {
                Some(format!("pose is not finite: position {:?}, rotation {:?}", self.position, self.rotation))
            }
            (true, false) => {
                Some(format!("rotation {:?} has length {norm}, a unit quaternion x, y, z, w is needed", self.rotation))
            }
            (true, true) => None,
        }
    }
}

/// The shape of a part, about its own origin. All lengths in meters.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// A sphere.
    Sphere {
        /// Radius.
        radius: f64,
    },
    /// A box, axes along x, y, z.
    Box {
        /// Edge lengths.
        size: [f64; 3],
    },
    /// A cylinder along z.
    Cylinder {
        /// Radius.
        radius: f64,
        /// Its length.
        length: f64,
    },
    /// A cylinder along z with a hemisphere on each end. Stored as a cylinder and two spheres, and
    /// read back as these.
    Capsule {
        /// Radius of cylinder and caps.
        radius: f64,
        /// Length of the cylinder without the caps.
        length: f64,
    },
    /// An ellipsoid, axes along x, y, z.
    Ellipsoid {
        /// Full axes.
        size: [f64; 3],
    },
    /// A cone along z, tip up, with its base a quarter of the height below the origin. Stored as a
    /// cylinder whose top has no radius, with the pose of its middle.
    Cone {
        /// Radius of the base.
        radius: f64,
        /// From base to tip.
        height: f64,
    },
    /// Triangles.
    Mesh {
        /// The vertices.
        vertices: Vec<[f64; 3]>,
        /// Three indices each, counter-clockwise from outside.
        triangles: Vec<[u32; 3]>,
    },
    /// The plane z = 0 with normal +z, drawn as a square. Stored as two triangles, and read back as
    /// a mesh.
    Plane {
        /// Edge of the square.
        size: f64,
    },
}

/// A colored shape with a pose in its entity's frame.
#[derive(Clone, Debug, PartialEq)]
pub struct VisualPart {
    /// The shape.
    pub shape: Shape,
    /// The shape's pose in the entity's frame.
    pub pose: Pose,
    /// Red, green, blue, alpha, each 0 to 1.
    pub color: [f32; 4],
}

/// A named object with one pose per frame: a body, a link, a piece of ground.
#[derive(Clone, Debug, PartialEq)]
pub struct Entity {
    /// Name, unique at any time of the recording; 1 to [`MAX_NAME_BYTES`] bytes, and not `world`.
    pub name: String,
    /// Visible parts; may be empty.
    pub parts: Vec<VisualPart>,
}

/// A contact of two entities in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Index of the entity that the normal points to.
    pub a: u32,
    /// Index of the entity that the normal points from.
    pub b: u32,
    /// Shapes of `a` and `b` that touch: their numbers among the shapes of the link, where the parts of a compound count one by
    /// one; of other bodies the part of a compound, else 0.
    pub shapes: [u32; 2],
    /// Contact point, m.
    pub point: [f64; 3],
    /// Unit normal from `b` to `a`.
    pub normal: [f64; 3],
    /// Depth of the overlap, m; negative while apart.
    pub depth: f64,
    /// Force on `a`, N.
    pub force: [f64; 3],
}

impl Contact {
    /// Length of an encoded contact, bytes.
    const BYTES: usize = 96;

    fn numbers(&self) -> [f64; 10] {
        let Contact { point: p, normal: n, depth, force: f, .. } = self;
        [p[0], p[1], p[2], n[0], n[1], n[2], *depth, f[0], f[1], f[2]]
    }

    /// Why it does not fit a frame with this number of entities, if it does not.
    pub(crate) fn fault(&self, entities: usize) -> Option<String> {
        let known = |index: u32| (index as usize) < entities;
        match (known(self.a) && known(self.b), self.numbers().iter().all(|x| x.is_finite())) {
            (false, _) => Some(format!("a contact of entities {} and {}, of {entities}", self.a, self.b)),
            (true, false) => Some("a contact with a number that is not finite".into()),
            (true, true) => None,
        }
    }
}

/// Encodes contacts: the two indices and the two shapes (u32), then point, normal, depth and force (f64),
/// little-endian.
pub fn encode_contacts(contacts: &[Contact]) -> Vec<u8> {
    let mut out = Vec::with_capacity(Contact::BYTES * contacts.len());
    for contact in contacts {
        out.extend([contact.a, contact.b, contact.shapes[0], contact.shapes[1]].iter().flat_map(|i| i.to_le_bytes()));
        out.extend(contact.numbers().iter().flat_map(|x| x.to_le_bytes()));
    }
    out
}

/// Decodes contacts.
pub fn decode_contacts(bytes: &[u8]) -> std::result::Result<Vec<Contact>, String> {
    let (contacts, rest) = bytes.as_chunks::<{ Contact::BYTES }>();
    if !rest.is_empty() || contacts.len() > MAX_CONTACTS {
        return Err(format!(
            "{} bytes of contacts, expected at most {MAX_CONTACTS} of {} bytes",
            bytes.len(),
            Contact::BYTES
        ));
    }
    let read = |bytes: &[u8; Contact::BYTES]| {
        let (indices, numbers) = bytes.split_at(16);
        let index = |i: usize| indices.as_chunks().0.get(i).map_or(0, |b| u32::from_le_bytes(*b));
        let number = |i: usize| numbers.as_chunks().0.get(i).map_or(0.0, |b| f64::from_le_bytes(*b));
        let vector = |i: usize| [number(i), number(i + 1), number(i + 2)];
        Contact {
            a: index(0),
            b: index(1),
            shapes: [index(2), index(3)],
            point: vector(0),
            normal: vector(3),
            depth: number(6),
            force: vector(7),
        }
    };
    Ok(contacts.iter().map(read).collect())
}

/// Checks a list before it is recorded: count, names, numbers, indices.
pub(crate) fn check_entities(entities: &[Entity]) -> Result<()> {
    if entities.len() > MAX_ENTITIES {
        return Err(RecordError::input(
            "the scene",
            format!("{} entities, at most {MAX_ENTITIES} are allowed", entities.len()),
        ));
    }
    let mut seen = BTreeSet::new();
    for entity in entities {
        let refuse = |why: String| RecordError::input(format!("entity \"{}\"", entity.name), why);
        if let Some(why) = name_fault(&entity.name) {
            return Err(refuse(why));
        }
        if !seen.insert(entity.name.as_str()) {
            return Err(refuse("this name is used twice".into()));
        }
        for (k, part) in entity.parts.iter().enumerate() {
            if let Some(why) = part_fault(part) {
                return Err(refuse(format!("part {k}: {why}")));
            }
        }
    }
    Ok(())
}

/// Returns why a name cannot be a frame's name, if so.
pub(crate) fn name_fault(name: &str) -> Option<String> {
    match name.len() {
        0 => Some("the name is empty".into()),
        n if n > MAX_NAME_BYTES => Some(format!("the name has {n} bytes, at most {MAX_NAME_BYTES} are allowed")),
        _ if name == ROOT_FRAME => Some(format!("the name \"{ROOT_FRAME}\" is taken by the root frame")),
        _ => None,
    }
}

fn part_fault(part: &VisualPart) -> Option<String> {
    if !part.color.iter().all(|c| (0.0..=1.0).contains(c)) {
        return Some(format!("color {:?}, four numbers from 0 to 1 are needed", part.color));
    }
    part.pose.fault().or_else(|| shape_fault(&part.shape))
}

fn shape_fault(shape: &Shape) -> Option<String> {
    let lengths: &[f64] = match shape {
        Shape::Sphere { radius } => &[*radius],
        Shape::Box { size } | Shape::Ellipsoid { size } => size,
        Shape::Cone { radius, height } => &[*radius, *height],
        Shape::Cylinder { radius, length } | Shape::Capsule { radius, length } => &[*radius, *length],
        Shape::Plane { size } => &[*size],
        Shape::Mesh { vertices, triangles } => return mesh_fault(vertices, triangles),
    };
    let bad = lengths.iter().find(|x| !(x.is_finite() && **x >= 0.0))?;
    Some(format!("length {bad}, a finite number of meters not below 0 is needed"))
}

fn mesh_fault(vertices: &[[f64; 3]], triangles: &[[u32; 3]]) -> Option<String> {
    if let Some(k) = vertices.iter().position(|v| v.iter().any(|x| !x.is_finite())) {
        return Some(format!("vertex {k} is not finite: {:?}", vertices[k]));
    }
    let (k, t) = triangles.iter().enumerate().find(|(_, t)| t.iter().any(|i| *i as usize >= vertices.len()))?;
    Some(format!("triangle {k} is {t:?}, but there are only {} vertices", vertices.len()))
}
