//! Shapes of links: made from their descriptions, mesh files read once each.
//!
//! Meshes of real robots are often not closed, and a surface that is not closed has no inside to collide with. Their convex hull stands in, and a note
//! says so: it is closed for any input, it touches what the mesh touches from outside, and robots' collision meshes are mostly made to be used that
//! way. (A box or capsule around them would be larger by far at the corners that robots touch things with.)

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use tumble_core::articulated::LinkMass;
use tumble_core::collide::{Pose, Shape, ShapeError, TreeCache, TreeSettings, TriMesh, Vec3};

use crate::body::MassSpec;
use crate::build::{MOST_MESH_BYTES, read_triangles};
use crate::link::{Geometry, LinkMassSpec, LinkShape, LinkSpec};
use crate::notes::NoteList;
use crate::shape::ShapeSpec;

/// A shape in its place on a link.
#[derive(Clone)]
pub(crate) struct Placed<'s> {
    pub(crate) shape: Shape,
    /// In the link's frame.
    pub(crate) pose: Pose,
    /// Where the shape's origin was in the axes of the description.
    pub(crate) center: Vec3,
    pub(crate) spec: &'s LinkShape,
    pub(crate) visible: bool,
}

/// Makes shapes, and remembers those from files. Trees come from the cache that the environment names.
pub(crate) struct ShapeMaker<'m> {
    /// Meshes of the scene as solids, with the place of the centre of each.
    meshes: &'m [(Shape, Vec3)],
    files: BTreeMap<FileKey, Result<(Shape, Vec3), String>>,
    cache: TreeCache,
    pub(crate) notes: NoteList,
}

/// A file, the bits of its scale, and what it is read for.
type FileKey = (PathBuf, [u64; 3], Use);

/// What a mesh file is read for.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Use {
    Collision,
    Hull,
    Drawing,
}

/// A shape of the scene and the place of its centre of mass in the axes of the description.
pub(crate) fn make(spec: &ShapeSpec, meshes: &[(Shape, Vec3)]) -> Result<(Shape, Vec3), ShapeError> {
    let shape = match *spec {
        ShapeSpec::Mesh { mesh } => return Ok(meshes[mesh].clone()),
        ShapeSpec::HalfSpace => Ok(Shape::half_space()),
        ShapeSpec::Sphere { radius_m } => Shape::sphere(radius_m),
        ShapeSpec::Box { size_m } => Shape::cuboid(0.5 * Vec3::from(size_m)),
        ShapeSpec::Capsule { radius_m, length_m } => Shape::capsule(radius_m, 0.5 * length_m),
        ShapeSpec::Cylinder { radius_m, height_m } => Shape::cylinder(radius_m, 0.5 * height_m),
    };
    Ok((shape?, Vec3::zeros()))
}

impl<'m> ShapeMaker<'m> {
    pub(crate) fn new(meshes: &'m [(Shape, Vec3)]) -> Self {
        ShapeMaker { meshes, files: BTreeMap::new(), cache: TreeCache::of_environment(), notes: NoteList::default() }
    }

    /// All shapes of a link; what may be left out and cannot be read is, with a note. Where no picture of a link can be read its collision shapes
    /// are drawn.
    pub(crate) fn shapes<'s>(&mut self, link: &'s LinkSpec) -> Result<Vec<Placed<'s>>, String> {
        let mut placed = Vec::with_capacity(link.shapes.len());
        let mut lost_picture = false;
        for spec in &link.shapes {
            match self.shape(spec)? {
                Some((shape, center)) => {
                    let pose = spec.pose * Pose::from_parts(center.into(), nalgebra::one());
                    placed.push(Placed { shape, pose, center, spec, visible: spec.visible });
                }
                None => lost_picture |= spec.visible,
            }
        }
        if lost_picture && placed.iter().all(|p| !p.visible) {
            placed.iter_mut().for_each(|p| p.visible = true);
        }
        Ok(placed)
    }

    fn shape(&mut self, spec: &LinkShape) -> Result<Option<(Shape, Vec3)>, String> {
        let (path, scale, place, hull, required) = match &spec.geometry {
            Geometry::Shape(shape) => return make(shape, self.meshes).map(Some).map_err(|e| e.to_string()),
            Geometry::File { path, scale, place, hull, required } => (path, scale, place, *hull, *required),
        };
        let used = if !spec.collides {
            Use::Drawing
        } else if hull {
            Use::Hull
        } else {
            Use::Collision
        };
        let key = (path.clone(), scale.map(f64::to_bits), used);
        if !self.files.contains_key(&key) {
            let made = self.read(path, *scale, used);
            self.files.insert(key.clone(), made);
        }
        match &self.files[&key] {
            Ok(made) => Ok(Some(made.clone())),
            Err(why) if required && spec.collides => Err(format!("{place}: {}: {why}", path.display())),
            Err(why) => {
                self.notes.add(format!("{place}: {}", path.display()), format!("left out: {why}"));
                Ok(None)
            }
        }
    }

    fn read(&mut self, path: &Path, scale: [f64; 3], used: Use) -> Result<(Shape, Vec3), String> {
        let mesh = stretched(read_file(path)?, scale);
        if used != Use::Hull {
            if let Ok(made) = self.solid(mesh.clone(), used) {
                return Ok(made);
            }
            if used == Use::Drawing
                && let Ok(made) = self.solid(scales(&mesh), used)
            {
                return Ok(made);
            }
            let does = if used == Use::Drawing { "is drawn" } else { "collides" };
            self.notes.add(path.display().to_string(), format!("its surface is not closed, so its convex hull {does}"));
        }
        let hull = mesh.convex_hull().map_err(|e| e.to_string())?;
        self.solid(hull, used).map_err(|e| e.to_string())
    }

    /// With the coarsest tree for what is only drawn, else with one from the cache.
    fn solid(&mut self, mesh: TriMesh, used: Use) -> Result<(Shape, Vec3), ShapeError> {
        if used == Use::Drawing {
            return Shape::mesh(mesh, &TreeSettings { depth: 1, error: 1.0, ..TreeSettings::octree() });
        }
        let (shape, center, note) = Shape::mesh_cached(mesh, &TreeSettings::octree(), &self.cache)?;
        note.into_iter().for_each(|note| self.notes.add("sphere trees", note));
        Ok((shape, center))
    }
}

pub(crate) fn read_file(path: &Path) -> Result<TriMesh, String> {
    let unread = |error: std::io::Error| format!("cannot be read: {error}");
    let size = std::fs::metadata(path).map_err(unread)?.len();
    if size > MOST_MESH_BYTES {
        return Err(format!("it has {size} bytes; the most that is read is {MOST_MESH_BYTES}"));
    }
    read_triangles(path, &std::fs::read(path).map_err(unread)?)
}

/// Scaled along each axis; a mirrored mesh is turned outside out again.
pub(crate) fn stretched(mut mesh: TriMesh, scale: [f64; 3]) -> TriMesh {
    let scale = Vec3::from(scale);
    mesh.vertices.iter_mut().for_each(|v| v.component_mul_assign(&scale));
    if scale.product() < 0.0 {
        mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    mesh
}

/// A surface that need not be closed as a solid to draw: each triangle with a shallow pyramid below it. Slivers, and triangles that are there
/// already, are left out.
fn scales(mesh: &TriMesh) -> TriMesh {
    let size = mesh.diagonal();
    let depth = 1e-4 * size;
    let mut made = TriMesh::default();
    let mut there = BTreeSet::new();
    for t in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(t);
        let mut key = [a, b, c].map(|corner| [0, 1, 2].map(|k| corner[k].to_bits()));
        key.sort_unstable();
        if let Some(normal) = (b - a).cross(&(c - a)).try_normalize(1e-12 * size * size).filter(|_| there.insert(key)) {
            let first = made.vertices.len() as u32;
            made.vertices.extend([a, b, c, (a + b + c) / 3.0 - depth * normal]);
            made.triangles.extend([[0, 1, 2], [1, 0, 3], [2, 1, 3], [0, 2, 3]].map(|face| face.map(|v| first + v)));
        }
    }
    made
}

/// The mass of a link, link frame.
pub(crate) fn mass(link: &LinkSpec, placed: &[Placed<'_>]) -> Result<LinkMass, ShapeError> {
    let solid = |placed: &Placed<'_>, mass: MassSpec| -> Result<LinkMass, ShapeError> {
        let properties = match mass {
            MassSpec::Density(density) => placed.shape.mass_properties(density)?,
            MassSpec::Mass(mass) => placed.shape.mass_properties(1.0)?.with_mass(mass),
        };
        let own = LinkMass { mass: properties.mass, center: properties.center_of_mass, inertia: properties.inertia };
        Ok(own.seen_from(&placed.pose))
    };
    let total = |each: &dyn Fn(&Placed<'_>) -> Option<MassSpec>| {
        let mut sum = LinkMass::none();
        for placed in placed {
            if let Some(mass) = each(placed) {
                sum = sum.with(&solid(placed, mass)?);
            }
        }
        Ok(sum)
    };
    match link.mass {
        LinkMassSpec::Given(mass) => Ok(mass),
        LinkMassSpec::OfShapes => total(&|placed| placed.spec.mass),
        LinkMassSpec::Spread(MassSpec::Density(density)) => total(&|_| Some(MassSpec::Density(density))),
        LinkMassSpec::Spread(MassSpec::Mass(mass)) => {
            let volume: f64 = placed.iter().map(|p| p.shape.volume()).sum();
            total(&|_| Some(MassSpec::Density(mass / volume)))
        }
    }
}
