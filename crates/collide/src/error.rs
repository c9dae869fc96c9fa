//! What can be wrong with a shape or a mesh.

use thiserror::Error;

/// A shape that cannot be built, or a question that it cannot answer.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ShapeError {
    /// A length that is zero, negative or not finite.
    #[error("{what} is {value}, but must be a finite length above 0 m")]
    Length {
        /// Which length.
        what: &'static str,
        /// What was given, meters.
        value: f64,
    },
    /// A density that is zero, negative or not finite.
    #[error("density is {0}, but must be finite and above 0 kg/m³")]
    Density(f64),
    /// A half-space has no volume, mass or center.
    #[error("a half-space is unbounded and has no mass properties; make the body static")]
    Unbounded,
    /// A mesh that makes no shape.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// A mesh that cannot be read or is no solid. The caller adds the file's name. Vertices and faces count from 1.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum MeshError {
    /// An error with the line it was found on.
    #[error("line {line}: {error}")]
    At {
        /// From 1.
        line: usize,
        /// What is wrong there.
        error: Box<MeshError>,
    },
    /// Text that cannot be read.
    #[error("line {line}: {what}")]
    Syntax {
        /// From 1.
        line: usize,
        /// What was found.
        what: String,
    },
    /// No triangle at all.
    #[error("the mesh has no triangles; at least 4 are needed to close a solid")]
    Empty,
    /// A mesh whose size says that its unit is wrong, if it is not a point.
    #[error("the mesh is {diagonal:e} m across, but must be at least 1e-30 m; is the unit right?")]
    TooSmall {
        /// Diagonal of its bounding box, meters.
        diagonal: f64,
    },
    /// Only faces without area.
    #[error("none of the {faces} triangles has an area; at least 4 are needed to close a solid")]
    Flat {
        /// How many there are.
        faces: usize,
    },
    /// A concave face, or all of them together, with more corners than can be cut into triangles in a reasonable time.
    #[error(
        "a concave face of {corners} corners; at most {most}, and fewer where there are many such faces, are cut into triangles: cut it before"
    )]
    Concave {
        /// How many it has.
        corners: usize,
        /// How many one may have.
        most: usize,
    },
    /// What is no PLY file.
    #[error("no PLY that can be read: {what}")]
    Ply {
        /// What was found and where, and what would be right.
        what: String,
    },
    /// A vertex that is NaN or infinite.
    #[error("vertex {vertex} is ({x}, {y}, {z}), but coordinates must be finite")]
    NotFinite {
        /// From 1.
        vertex: usize,
        /// As read.
        x: f64,
        /// As read.
        y: f64,
        /// As read.
        z: f64,
    },
    /// A vertex absurdly far away.
    #[error("vertex {vertex} has a coordinate of {value:e} m, but at most 1e9 m is taken; is the unit right?")]
    TooFar {
        /// From 1.
        vertex: usize,
        /// Its greatest coordinate, meters.
        value: f64,
    },
    /// A corner of an STL facet that is NaN or infinite.
    #[error("facet {face} has the vertex ({x}, {y}, {z}), but coordinates must be finite")]
    NotFiniteInFace {
        /// From 1.
        face: usize,
        /// As read.
        x: f64,
        /// As read.
        y: f64,
        /// As read.
        z: f64,
    },
    /// A face that points at a vertex that does not exist.
    #[error("face {face} points at vertex {index}, but there are {count} vertices")]
    IndexOutOfRange {
        /// From 1.
        face: usize,
        /// As read, counted from 1 (0 or less: before the first).
        index: i64,
        /// How many vertices there are.
        count: usize,
    },
    /// A binary STL whose size does not fit the count in its header.
    #[error("the STL header announces {count} triangles ({needed} bytes), but the file has {size} bytes")]
    StlSize {
        /// As announced.
        count: usize,
        /// Bytes that many triangles take.
        needed: usize,
        /// Bytes there are.
        size: usize,
    },
    /// Neither text nor binary STL.
    #[error("no STL: {size} bytes, neither text that begins with `solid` nor a binary header of 84 bytes")]
    StlShort {
        /// Bytes there are.
        size: usize,
    },
    /// Edges with a face on one side only.
    #[error(
        "the mesh is open: {edges} edges have a face on one side only, in {holes} hole(s); the first hole has {first_hole} edges and \
             begins at edge {from}–{to} of face {face}; close it"
    )]
    Open {
        /// How many such edges there are.
        edges: usize,
        /// How many loops they form.
        holes: usize,
        /// Edges of the loop with the first such edge.
        first_hole: usize,
        /// The first such edge.
        from: u32,
        /// The first such edge.
        to: u32,
        /// The face it belongs to.
        face: usize,
    },
    /// An edge whose faces do not pair up (a fin, or a Möbius band).
    #[error(
        "edge {from}–{to} of face {face} is shared by {faces} faces that do not pair up ({edges} such edge(s), {open} open edge(s)): \
             remove the dangling face or split the edge"
    )]
    NonManifold {
        /// How many such edges there are.
        edges: usize,
        /// How many edges have one face.
        open: usize,
        /// Faces at the first one.
        faces: usize,
        /// The first such edge.
        from: u32,
        /// The first such edge.
        to: u32,
        /// The face named: one with an open edge (the fin) where there is one.
        face: usize,
    },
    /// A surface that repair makes no solid of.
    #[error("{error}; repair was asked for, but {why}")]
    BeyondRepair {
        /// What is wrong with the mesh as it was.
        error: Box<MeshError>,
        /// What kept it from being repaired.
        why: String,
    },
    /// A closed surface around nothing.
    #[error("the mesh is closed but encloses no volume ({volume:e} m³); it must be a solid")]
    NoVolume {
        /// What was found, m³.
        volume: f64,
    },
    /// A lathe profile that makes no solid.
    #[error("the profile {what}")]
    Profile {
        /// What is wrong.
        what: String,
    },
    /// Sphere tree settings out of range.
    #[error("{what} is {value}, but must be {allowed}")]
    Settings {
        /// Which setting.
        what: &'static str,
        /// As given.
        value: f64,
        /// What would be right.
        allowed: &'static str,
    },
    /// A sphere tree that breaks one of its promises: an error in the builder, never in the data.
    #[error("the sphere tree is wrong: {what}")]
    Tree {
        /// Which promise, and where.
        what: String,
    },
    /// A build ended early because its [`Progress`](crate::Progress) asked for it.
    #[error("the build was stopped")]
    Stopped,
}

impl MeshError {
    /// The triangle that the error names, from 1 in the order of the mesh as it was given.
    pub fn face(&self) -> Option<usize> {
        match self {
            MeshError::At { error, .. } | MeshError::BeyondRepair { error, .. } => error.face(),
            MeshError::NotFiniteInFace { face, .. }
            | MeshError::IndexOutOfRange { face, .. }
            | MeshError::Open { face, .. }
            | MeshError::NonManifold { face, .. } => Some(*face),
            _ => None,
        }
    }

    /// With the line of the triangle that it names, where `lines` (from [`TriMesh::from_obj_with_lines`]) tells.
    ///
    /// [`TriMesh::from_obj_with_lines`]: crate::TriMesh::from_obj_with_lines
    #[must_use]
    pub fn at_line(self, lines: &[usize]) -> MeshError {
        match self.face().and_then(|face| lines.get(face.checked_sub(1)?)) {
            Some(&line) if !matches!(self, MeshError::At { .. }) => MeshError::At { line, error: Box::new(self) },
            _ => self,
        }
    }
}
