//! Errors of shapes and meshes.

use thiserror::Error;

/// A shape that cannot be built, or that lacks the requested property.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ShapeError {
    /// A length that is zero, negative or not finite.
    #[error("{what} is {value}, but must be a finite length above 0 m")]
    Length {
        /// The name of the length.
        what: &'static str,
        /// The given value, meters.
        value: f64,
    },
    /// A rounding that is negative, or that leaves nothing of its shape.
    #[error("rounding is {rounding}, but must be at least 0 and less than {limit} m, half the smallest size")]
    Rounding {
        /// The given value, meters.
        rounding: f64,
        /// Half the smallest size of the shape, meters.
        limit: f64,
    },
    /// Sizes of an ellipsoid or cone whose ratio is too large.
    #[error("{what} has sizes of {smallest} m and {largest} m, but they may differ by at most 100,000 times")]
    Aspect {
        /// The name of the shape.
        what: &'static str,
        /// The smallest size, meters.
        smallest: f64,
        /// The largest size, meters.
        largest: f64,
    },
    /// A density that is zero, negative or not finite.
    #[error("density is {0}, but must be finite and above 0 kg/m³")]
    Density(f64),
    /// A half-space has no volume, mass or center.
    #[error("a half-space is unbounded and has no mass properties; make the body static")]
    Unbounded,
    /// A compound without parts, or with too many.
    #[error("a compound of {count} parts; it must have 1 to {most}")]
    Parts {
        /// Number of parts.
        count: usize,
        /// Largest allowed number.
        most: usize,
    },
    /// A half-space as a part of a compound.
    #[error("part {number} of a compound is a half-space, which is unbounded; make it a static body")]
    UnboundedPart {
        /// Number of the part, from 1.
        number: usize,
    },
    /// A part of a compound at a pose that is not finite.
    #[error("part {number} of a compound has a pose that is not finite")]
    PartPose {
        /// Number of the part, from 1.
        number: usize,
    },
    /// Two parts of a compound with one name.
    #[error(
        "parts {first} and {second} of a compound are both named '{name}'; give the shapes of one body different names"
    )]
    PartNames {
        /// Number of the first one, from 1.
        first: usize,
        /// Number of the second one.
        second: usize,
        /// The name.
        name: String,
    },
    /// A part of a compound with an empty name.
    #[error("the name of part {number} of a compound is empty; it must have a letter, or be left out")]
    EmptyName {
        /// Its number, from 1.
        number: usize,
    },
    /// A compound in a compound with a name.
    #[error("part {number} of a compound has the name '{name}' and is a compound itself; name its parts instead")]
    CompoundName {
        /// Its number, from 1.
        number: usize,
        /// The name.
        name: String,
    },
    /// A compound of parts with and without a density.
    #[error("part {number} of a compound has {} density, unlike part 1; give all parts one or none", if *has { "a" } else { "no" })]
    PartDensity {
        /// Number of the part, from 1.
        number: usize,
        /// Whether it has a density.
        has: bool,
    },
    /// A mesh that cannot be made a shape.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// A mesh that cannot be read or is not a solid. The caller adds the file name. Vertices and faces
/// count from 1.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum MeshError {
    /// An error with the line at which it was found.
    #[error("line {line}: {error}")]
    At {
        /// From 1.
        line: usize,
        /// The error on this line.
        error: Box<MeshError>,
    },
    /// Text that cannot be parsed.
    #[error("line {line}: {what}")]
    Syntax {
        /// From 1.
        line: usize,
        /// The text that was found.
        what: String,
    },
    /// A mesh without triangles.
    #[error("the mesh has no triangles; at least 4 are needed to close a solid")]
    Empty,
    /// A mesh that is a point, or so small that its unit must be wrong.
    #[error("the mesh is {diagonal:e} m across, but must be at least 1e-30 m; is the unit right?")]
    TooSmall {
        /// Diagonal of its bounding box, meters.
        diagonal: f64,
    },
    /// A mesh all of whose faces have zero area.
    #[error("none of the {faces} triangles has an area; at least 4 are needed to close a solid")]
    Flat {
        /// Number of triangles.
        faces: usize,
    },
    /// A concave face, or all concave faces together, with more corners than can be triangulated in
    /// a reasonable time.
    #[error(
        "a concave face has {corners} corners; at most {most} are triangulated, fewer if there are many such faces: triangulate it before import"
    )]
    Concave {
        /// Number of corners of the face.
        corners: usize,
        /// Largest allowed number of corners.
        most: usize,
    },
    /// A file that is not PLY.
    #[error("not a readable PLY file: {what}")]
    Ply {
        /// The text that was found, its place, and the expected text.
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
    /// A vertex too far from the origin.
    #[error("vertex {vertex} has a coordinate of {value:e} m, but at most 1e9 m is allowed; is the unit right?")]
    TooFar {
        /// From 1.
        vertex: usize,
        /// Its largest coordinate, meters.
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
    /// A face with the index of a vertex that does not exist.
    #[error("face {face} refers to vertex {index}, but there are {count} vertices")]
    IndexOutOfRange {
        /// From 1.
        face: usize,
        /// As read, counted from 1; 0 or less if it lies before the first vertex.
        index: i64,
        /// Number of vertices.
        count: usize,
    },
    /// A binary STL file whose size does not match the count in its header.
    #[error("the STL header announces {count} triangles ({needed} bytes), but the file has {size} bytes")]
    StlSize {
        /// Number of triangles in the header.
        count: usize,
        /// Bytes that this number of triangles needs.
        needed: usize,
        /// Bytes in the file.
        size: usize,
    },
    /// A file that is not STL, as text or binary.
    #[error("not an STL file: {size} bytes; expected text that begins with `solid`, or a binary header of 84 bytes")]
    StlShort {
        /// Bytes in the file.
        size: usize,
    },
    /// Edges with a face on one side only.
    #[error(
        "the mesh is open: {edges} edges have a face on one side only, in {holes} hole(s); the first hole has {first_hole} edges and \
             begins at edge {from}–{to} of face {face}; close it, or use an open mesh"
    )]
    Open {
        /// Number of such edges.
        edges: usize,
        /// Number of loops that they form.
        holes: usize,
        /// Number of edges in the loop of the first such edge.
        first_hole: usize,
        /// First vertex of the first such edge.
        from: u32,
        /// Second vertex of the first such edge.
        to: u32,
        /// The face of the first such edge.
        face: usize,
    },
    /// An edge whose faces do not pair up: a fin, or a Möbius band.
    #[error(
        "edge {from}–{to} of face {face} is shared by {faces} faces that do not pair up ({edges} such edge(s), {open} open edge(s)): \
             remove the dangling face or split the edge"
    )]
    NonManifold {
        /// Number of such edges.
        edges: usize,
        /// Number of edges with one face.
        open: usize,
        /// Number of faces at the first such edge.
        faces: usize,
        /// First vertex of the first such edge.
        from: u32,
        /// Second vertex of the first such edge.
        to: u32,
        /// A face at the first such edge: the one with an open edge (the fin) if there is one.
        face: usize,
    },
    /// A surface that repair cannot make a solid.
    #[error("{error}; repair failed: {why}")]
    BeyondRepair {
        /// The error of the original mesh.
        error: Box<MeshError>,
        /// The reason why it could not be repaired.
        why: String,
    },
    /// A closed surface without volume.
    #[error("the mesh is closed but encloses no volume ({volume:e} m³); it must be a solid")]
    NoVolume {
        /// The computed volume, m³.
        volume: f64,
    },
    /// Too few or too many points for a convex hull.
    #[error("a convex hull of {count} points; it must have 4 to {most}")]
    Points {
        /// Number of points.
        count: usize,
        /// Largest allowed number.
        most: usize,
    },
    /// Points of a convex hull that lie in a plane, on a line or at one place.
    #[error("the {points} points of a convex hull lie in one plane; they must span a solid")]
    Coplanar {
        /// Number of points.
        points: usize,
    },
    /// Heights, a size or a thickness that do not make a solid.
    #[error("the height field {what}")]
    HeightField {
        /// The fault.
        what: String,
    },
    /// An open surface that cannot be extruded to a solid.
    #[error("{what}")]
    Extrusion {
        /// The fault.
        what: String,
        /// The face at fault, from 1.
        face: Option<usize>,
    },
    /// Distances on a grid that enclose no solid, or a grid out of its range.
    #[error("isosurface: {what}")]
    Isosurface {
        /// The fault.
        what: String,
    },
    /// A lathe profile that does not make a solid.
    #[error("the profile {what}")]
    Profile {
        /// The fault.
        what: String,
    },
    /// Sphere tree or repair settings out of range.
    #[error("{what} is {value}, but must be {allowed}")]
    Settings {
        /// The name of the setting.
        what: &'static str,
        /// As given.
        value: f64,
        /// The allowed values.
        allowed: &'static str,
    },
    /// A sphere tree that breaks one of its guarantees: an error of the builder, never of the data.
    #[error("the sphere tree is invalid: {what}")]
    Tree {
        /// The broken guarantee and its place.
        what: String,
    },
    /// A build that ended early because [`Progress`](crate::Progress) requested it.
    #[error("the build was stopped")]
    Stopped,
}

impl MeshError {
    /// Returns the triangle that the error names, from 1 in the order of the given mesh.
    pub fn face(&self) -> Option<usize> {
        match self {
            MeshError::At { error, .. } | MeshError::BeyondRepair { error, .. } => error.face(),
            MeshError::NotFiniteInFace { face, .. }
            | MeshError::IndexOutOfRange { face, .. }
            | MeshError::Open { face, .. }
            | MeshError::NonManifold { face, .. } => Some(*face),
            MeshError::Extrusion { face, .. } => *face,
            _ => None,
        }
    }

    /// Adds the line of the named triangle, if `lines` (from [`TriMesh::from_obj_with_lines`])
    /// contains it.
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
