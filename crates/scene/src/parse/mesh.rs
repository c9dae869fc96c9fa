//! `[meshes.NAME]`: closed surfaces, from a file or generated.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use tumble_core::collide::TriMesh;

use crate::parse::bound::Bound;
use crate::parse::fields::{Fields, Names};
use crate::parse::place::Place;
use crate::parse::profile;
use crate::parse::terrain::{self, Heights, HullPoints};

/// A named mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshSpec {
    /// The NAME of `[meshes.NAME]`.
    pub name: String,
    /// The source of its triangles.
    pub source: MeshSource,
    /// Whether holes, fins and other defects are repaired, with a note. Otherwise they are an
    /// error.
    pub repair: bool,
    /// Largest number of levels of its sphere tree, 1 to 9; `None` for the builder's default.
    pub sphere_tree_depth: Option<u32>,
    /// How far the spheres may reach outside the surface, as a fraction of the mesh's diagonal,
    /// 1e-4 to 1; `None` for the builder's default.
    pub sphere_tree_max_error: Option<f64>,
}

/// The triangles of a mesh. Generated meshes are closed, have z as their axis, and have the origin
/// stated here.
#[derive(Clone, Debug, PartialEq)]
pub enum MeshSource {
    /// An OBJ, STL, PLY or COLLADA file that existed when the scene was read.
    File {
        /// The path, prefixed with the folder of the scene.
        path: PathBuf,
        /// Meters per unit of the file.
        scale: f64,
    },
    /// A profile revolved about the z axis; the origin is that of the profile.
    Lathe {
        /// Radius and height `[r, z]` in meters, from the bottom of the axis to its top. The first
        /// and the last radius are 0, all others positive, and the line does not cross itself.
        profile_m: Vec<[f64; 2]>,
        /// Segments around the axis.
        segments: u32,
    },
    /// A torus about z, centered on the origin.
    Torus {
        /// From the axis to the center of the tube, meters; more than the tube's radius.
        radius_m: f64,
        /// Radius of the tube, meters.
        tube_radius_m: f64,
        /// Segments around the axis.
        segments: u32,
        /// Segments around the tube.
        tube_segments: u32,
    },
    /// An icosahedron whose triangles are divided in four `subdivisions` times, projected onto a
    /// sphere about the origin.
    Icosphere {
        /// Meters.
        radius_m: f64,
        /// 0 to 7.
        subdivisions: u32,
    },
    /// A cylinder along z, centered on the origin.
    Cylinder {
        /// Meters.
        radius_m: f64,
        /// Full length, meters.
        length_m: f64,
        /// Segments around the axis.
        segments: u32,
    },
    /// A capsule along z, centered on the origin.
    Capsule {
        /// Meters.
        radius_m: f64,
        /// Length of the straight part, without the two caps, meters.
        length_m: f64,
        /// Segments around the axis.
        segments: u32,
    },
    /// A box centered on the origin.
    Box {
        /// Full edge lengths along x, y and z, meters.
        size_m: [f64; 3],
    },
    /// A closed mesh that was read with the description: of another format's model, or of an OBJ file that is built in with
    /// its scene.
    Triangles {
        /// Closed and wound outwards, meters.
        mesh: Arc<TriMesh>,
    },
    /// The convex hull of points, in their frame.
    ConvexHull(HullPoints),
    /// The solid under a grid of heights along z, centered on the origin in x and y.
    HeightField {
        /// The heights.
        heights: Heights,
        /// Size of the grid along x and y, meters.
        size_m: [f64; 2],
        /// Distance of the bottom from the lowest height, meters; `None` for a tenth of the longer
        /// side.
        thickness_m: Option<f64>,
    },
    /// The solid below an open surface, in the frame of its file.
    Terrain {
        /// An OBJ, STL, PLY or COLLADA file, prefixed with the folder of the scene.
        path: PathBuf,
        /// Meters per unit of the file.
        scale: f64,
        /// Distance that the solid reaches down, meters; `None` for a tenth of the longer horizontal
        /// side.
        thickness_m: Option<f64>,
    },
    /// The solid behind an open surface, in the frame of its file.
    OpenMesh {
        /// An OBJ, STL, PLY or COLLADA file, prefixed with the folder of the scene.
        path: PathBuf,
        /// Meters per unit of the file.
        scale: f64,
        /// Distance that the solid reaches behind the faces, meters; `None` for a hundredth of the diagonal.
        thickness_m: Option<f64>,
        /// Whether it reaches half as far to both sides instead.
        centered: bool,
    },
    /// The solid in which signed distances on a grid are negative, in the frame of the grid.
    Sdf {
        /// A NumPy file of three axes, prefixed with the folder of the scene.
        path: PathBuf,
        /// The first grid point, meters.
        low_m: [f64; 3],
        /// The last grid point, meters.
        high_m: [f64; 3],
    },
}

const TREE_ERROR: Bound = Bound::new(1e-4, 1.0, "a fraction of the mesh's diagonal, from 1e-4 to 1");

#[derive(Clone, Copy)]
enum Kind {
    File,
    Lathe,
    Torus,
    Icosphere,
    Cylinder,
    Capsule,
    Box,
    ConvexHull,
    HeightField,
    Terrain,
    OpenMesh,
    Sdf,
}

const KINDS: Names<Kind> = &[
    ("file", Kind::File),
    ("lathe", Kind::Lathe),
    ("torus", Kind::Torus),
    ("icosphere", Kind::Icosphere),
    ("cylinder", Kind::Cylinder),
    ("capsule", Kind::Capsule),
    ("box", Kind::Box),
    ("convex_hull", Kind::ConvexHull),
    ("height_field", Kind::HeightField),
    ("terrain", Kind::Terrain),
    ("open_mesh", Kind::OpenMesh),
    ("sdf", Kind::Sdf),
];

impl MeshSpec {
    /// Returns the name of its file, else its own name.
    pub(crate) fn called(&self) -> String {
        match self.source.file() {
            Some(path) => path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            None => self.name.clone(),
        }
    }

    /// Reads a mesh; paths are relative to the folder of the scene.
    pub(crate) fn read(name: &str, mut f: Fields<'_>, place: &Place<'_>) -> Option<Self> {
        let Some(kind) = f.choice("type", KINDS) else {
            f.give_up();
            return None;
        };
        let repair = f.flag_or("repair", false);
        let sphere_tree_depth = f.value("sphere_tree_depth").map(|v| f.as_integer("sphere_tree_depth", v, 1..=9));
        let sphere_tree_max_error = f.optional_number("sphere_tree_max_error", TREE_ERROR);
        let source = MeshSource::read(&mut f, kind, place);
        f.finish();
        Some(MeshSpec { name: name.to_owned(), source: source?, repair, sphere_tree_depth, sphere_tree_max_error })
    }
}

impl MeshSource {
    /// Returns the file that it is read from, if any.
    pub fn file(&self) -> Option<&Path> {
        match self {
            MeshSource::File { path, .. }
            | MeshSource::Terrain { path, .. }
            | MeshSource::OpenMesh { path, .. }
            | MeshSource::Sdf { path, .. }
            | MeshSource::ConvexHull(HullPoints::File { path, .. })
            | MeshSource::HeightField { heights: Heights::File { path, .. }, .. } => Some(path),
            _ => None,
        }
    }

    fn read(f: &mut Fields<'_>, kind: Kind, place: &Place<'_>) -> Option<Self> {
        let folder = place.folder;
        Some(match kind {
            Kind::File => {
                let scale = f.number_or("scale", Bound::POSITIVE, 1.0);
                match read_built_in(f, place, scale) {
                    Some(mesh) => MeshSource::Triangles { mesh },
                    None => MeshSource::File { path: read_path(f, folder)?, scale },
                }
            }
            Kind::Lathe => {
                let segments = read_segments(f, "segments", 48);
                MeshSource::Lathe { profile_m: profile::read(f, "profile_m")?, segments }
            }
            Kind::Torus => read_torus(f),
            Kind::Icosphere => MeshSource::Icosphere {
                radius_m: f.number("radius_m", Bound::POSITIVE),
                subdivisions: f.integer_or("subdivisions", 0..=7, 3),
            },
            Kind::Cylinder => MeshSource::Cylinder {
                radius_m: f.number("radius_m", Bound::POSITIVE),
                length_m: f.number("length_m", Bound::POSITIVE),
                segments: read_segments(f, "segments", 48),
            },
            Kind::Capsule => MeshSource::Capsule {
                radius_m: f.number("radius_m", Bound::POSITIVE),
                length_m: f.number("length_m", Bound::POSITIVE),
                segments: read_segments(f, "segments", 48),
            },
            Kind::Box => MeshSource::Box { size_m: f.vector("size_m", Bound::POSITIVE) },
            Kind::ConvexHull => terrain::read_hull(f, folder)?,
            Kind::HeightField => terrain::read_height_field(f, folder)?,
            Kind::Terrain => terrain::read_terrain(f, folder)?,
            Kind::OpenMesh => terrain::read_open_mesh(f, folder)?,
            Kind::Sdf => {
                let [low_m, high_m] = ["low_m", "high_m"].map(|key| f.vector(key, Bound::ANY));
                let path = read_file(f, folder, &["npy"], "the path of an .npy file")?;
                MeshSource::Sdf { path, low_m, high_m }
            }
        })
    }
}

fn read_segments(f: &mut Fields<'_>, key: &'static str, default: u32) -> u32 {
    f.integer_or(key, 3..=1024, default)
}

fn read_torus(f: &mut Fields<'_>) -> MeshSource {
    let radius_m = f.number("radius_m", Bound::POSITIVE);
    let tube_radius_m = f.number("tube_radius_m", Bound::POSITIVE);
    if tube_radius_m >= radius_m
        && let Some(value) = f.value("tube_radius_m")
    {
        f.wrong("tube_radius_m", value, format!("less than radius_m, {radius_m}, so that the ring has a hole"));
    }
    let (segments, tube_segments) = (read_segments(f, "segments", 48), read_segments(f, "tube_segments", 24));
    MeshSource::Torus { radius_m, tube_radius_m, segments, tube_segments }
}

/// Returns the mesh of an OBJ file whose text is given with that of the scene.
fn read_built_in(f: &mut Fields<'_>, place: &Place<'_>, scale: f64) -> Option<Arc<TriMesh>> {
    let name = f.value("file")?.get_ref().as_str()?;
    let text = place.text(name)?;
    Some(Arc::new(TriMesh::from_obj(text).ok()?.scaled(scale)))
}

/// Reads the path of a mesh file: an existing OBJ, STL, PLY or COLLADA file.
pub(crate) fn read_path(f: &mut Fields<'_>, folder: &Path) -> Option<PathBuf> {
    read_file(f, folder, &["obj", "stl", "ply", "dae"], "the path of an .obj, .stl, .ply or .dae file")
}

/// Reads the path of an existing file with one of these extensions.
pub(super) fn read_file(
    f: &mut Fields<'_>,
    folder: &Path,
    extensions: &[&str],
    expected: &'static str,
) -> Option<PathBuf> {
    let (text, value) = f.text("file", expected)?;
    let path = folder.join(text);
    let known = |e: &std::ffi::OsStr| extensions.iter().any(|known| e.eq_ignore_ascii_case(known));
    if !path.extension().is_some_and(known) {
        f.wrong("file", value, expected);
        return None;
    }
    if !path.is_file() {
        let message = format!("`file` of {}: there is no file {}", f.what, path.display());
        f.log.report(value.span(), message, "expected a path relative to the folder of the scene");
        return None;
    }
    Some(path)
}
