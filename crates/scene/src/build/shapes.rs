//! Shapes and visuals of links. Each collision mesh file is read once; visual meshes are read when
//! they are first drawn.
//!
//! Collision meshes of real robots are often not closed, and an open surface has no inside. Their
//! convex hull is used instead, with a note: a hull is closed for any input, it touches the same
//! surroundings from outside, and most collision meshes of robots are made to be used that way. A
//! box or capsule around them would be much larger at the corners with which robots touch things.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use tumble_core::articulated::LinkMass;
use tumble_core::collide::{CompoundPart, Pose, Shape, ShapeError, TreeCache, TreeSettings, TriMesh, Vec3};
use tumble_core::{Material, RigidBody, ShapeFilter, VisualGeometry, VisualMesh};

use crate::build::appearance::material_id;
use crate::build::mesh_files::{read_file, stretched};
use crate::build::slow::building_surface;
use crate::build::visual_mesh;
use crate::notes::NoteList;
use crate::parse::body::MassSpec;
use crate::parse::link::{Geometry, LinkMassSpec, LinkShape, LinkSpec};
use crate::parse::shape::{CompoundPartSpec, PartFilter, PartSurface, ShapeSpec};

/// A shape or visual with its pose on a link.
#[derive(Clone)]
pub(crate) struct Placed<'s> {
    pub(crate) geometry: VisualGeometry,
    /// In the link's frame.
    pub(crate) pose: Pose,
    pub(crate) spec: &'s LinkShape,
    pub(crate) visible: bool,
    /// Drawn only if none of these meshes can be read.
    pub(crate) stands_in_for: Vec<Arc<VisualMesh>>,
}

impl Placed<'_> {
    /// Returns the geometry's origin in the axes of the description, meters.
    pub(crate) fn center(&self) -> Vec3 {
        center(&self.geometry)
    }

    /// Returns the collision shape, which also has the mass. Visual meshes have none.
    pub(crate) fn solid(&self) -> Option<&Shape> {
        match &self.geometry {
            VisualGeometry::Shape(shape) => Some(shape),
            VisualGeometry::Mesh(_) => None,
        }
    }
}

/// Makes shapes and keeps those made from files. Sphere trees come from the cache that the
/// environment names.
pub(crate) struct ShapeMaker<'m> {
    /// Meshes of the scene as solids.
    meshes: &'m [Shape],
    solids: BTreeMap<SolidKey, Result<Shape, String>>,
    visuals: BTreeMap<FileKey, Arc<VisualMesh>>,
    cache: TreeCache,
    pub(crate) purpose: Purpose,
    pub(crate) notes: NoteList,
}

/// The purpose of a world.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// To be stepped.
    Stepped,
    /// To be drawn only: sphere trees and distance fields are built on first use.
    Drawn,
}

impl Purpose {
    /// Returns a closed mesh as a shape, and a note about the tree cache.
    pub(crate) fn mesh(
        self,
        mesh: TriMesh,
        settings: &TreeSettings,
        cache: &TreeCache,
    ) -> Result<(Shape, Option<String>), ShapeError> {
        match self {
            Purpose::Stepped => Shape::mesh_cached(mesh, settings, cache),
            Purpose::Drawn => Shape::mesh_lazy(mesh, settings, cache).map(|shape| (shape, None)),
        }
    }
}

/// A file and the bits of its scale.
type FileKey = (PathBuf, [u64; 3]);
/// The same, and whether its convex hull collides instead of the mesh.
type SolidKey = (FileKey, bool);

/// Makes the shape of a description.
pub(crate) fn make(spec: &ShapeSpec, meshes: &[Shape]) -> Result<Shape, ShapeError> {
    match *spec {
        ShapeSpec::Compound { ref parts } => {
            let part = |part: &CompoundPartSpec| {
                Ok(CompoundPart {
                    shape: make(&part.shape, meshes)?,
                    pose: part.pose,
                    density: part.density_kg_per_m3,
                    name: part.name.clone(),
                })
            };
            Shape::compound(parts.iter().map(part).collect::<Result<_, ShapeError>>()?)
        }
        ShapeSpec::Mesh { mesh } => Ok(meshes[mesh].clone()),
        ShapeSpec::HalfSpace => Ok(Shape::half_space()),
        ShapeSpec::Sphere { radius_m } => Shape::sphere(radius_m),
        ShapeSpec::Box { size_m } => Shape::cuboid(Vec3::from(size_m)),
        ShapeSpec::RoundedBox { size_m, rounding_m } => Shape::rounded_cuboid(Vec3::from(size_m), rounding_m),
        ShapeSpec::Ellipsoid { size_m } => Shape::ellipsoid(Vec3::from(size_m)),
        ShapeSpec::Cone { radius_m, height_m } => Shape::cone(radius_m, height_m),
        ShapeSpec::Capsule { radius_m, length_m } => Shape::capsule(radius_m, length_m),
        ShapeSpec::Cylinder { radius_m, length_m } => Shape::cylinder(radius_m, length_m),
        ShapeSpec::RoundedCylinder { radius_m, length_m, rounding_m } => {
            Shape::rounded_cylinder(radius_m, length_m, rounding_m)
        }
    }
}

/// Returns the surface constants of those parts of a compound that have their own, with their numbers.
pub(crate) fn own_materials(spec: &ShapeSpec) -> impl Iterator<Item = (usize, Material)> {
    let own = |(n, own): (usize, Option<PartSurface>)| {
        own.map(|own| (n, Material { id: material_id(own.material), ..own.contact }))
    };
    spec.surfaces().into_iter().enumerate().filter_map(own)
}

/// Returns the filters of those parts of a compound that have their own, for a body or a link with a filter.
pub(crate) fn own_filters(spec: &ShapeSpec, body: ShapeFilter) -> impl Iterator<Item = (usize, ShapeFilter)> {
    let own = move |(n, own): (usize, PartFilter)| Some((n, own.of_part(body)?));
    spec.filters().into_iter().enumerate().filter_map(own)
}

fn center(geometry: &VisualGeometry) -> Vec3 {
    match geometry {
        VisualGeometry::Shape(shape) => shape.center_of_mass(),
        VisualGeometry::Mesh(_) => Vec3::zeros(),
    }
}

impl<'m> ShapeMaker<'m> {
    pub(crate) fn new(meshes: &'m [Shape], purpose: Purpose) -> Self {
        ShapeMaker {
            meshes,
            solids: BTreeMap::new(),
            visuals: BTreeMap::new(),
            cache: TreeCache::of_environment(),
            purpose,
            notes: NoteList::default(),
        }
    }

    /// Returns all shapes and visuals of a link. A collision mesh that is not required and cannot
    /// be read is left out with a note. If no visual of a link can be read, its collision shapes
    /// are drawn.
    pub(crate) fn shapes<'s>(&mut self, link: &'s LinkSpec) -> Result<Vec<Placed<'s>>, String> {
        let mut placed = Vec::with_capacity(link.shapes.len());
        let mut lost_visual = false;
        let unused =
            |spec: &&LinkShape| matches!(spec.geometry, Geometry::File { .. }) && !spec.collidable && !spec.visible;
        for spec in link.shapes.iter().filter(|spec| !unused(spec)) {
            match self.geometry(spec)? {
                Some(geometry) => {
                    let pose = spec.pose * Pose::from_parts(center(&geometry).into(), nalgebra::one());
                    let visible = spec.visible;
                    placed.push(Placed { geometry, pose, spec, visible, stands_in_for: Vec::new() });
                }
                None => lost_visual |= spec.visible,
            }
        }
        let shown = placed.iter().filter(|p| p.visible);
        let meshes = shown.clone().filter_map(|p| match &p.geometry {
            VisualGeometry::Mesh(mesh) => Some(mesh.clone()),
            VisualGeometry::Shape(_) => None,
        });
        let meshes: Vec<Arc<VisualMesh>> = meshes.collect();
        if shown.count() == meshes.len() && (lost_visual || !meshes.is_empty()) {
            for p in placed.iter_mut().filter(|p| !p.visible) {
                (p.visible, p.stands_in_for) = (true, meshes.clone());
            }
        }
        Ok(placed)
    }

    fn geometry(&mut self, spec: &LinkShape) -> Result<Option<VisualGeometry>, String> {
        let as_shape = |shape| Some(VisualGeometry::Shape(shape));
        match &spec.geometry {
            Geometry::Shape(shape) => make(shape, self.meshes).map(as_shape).map_err(|e| e.to_string()),
            Geometry::File { path, scale, .. } if !spec.collidable => {
                let key = (path.clone(), scale.map(f64::to_bits));
                let mesh = self.visuals.entry(key).or_insert_with(|| Arc::new(visual_mesh::of_file(path, *scale)));
                Ok(Some(VisualGeometry::Mesh(mesh.clone())))
            }
            Geometry::Solid { name, mesh } => {
                let key = ((PathBuf::from(name), [1.0_f64.to_bits(); 3]), false);
                if !self.solids.contains_key(&key) {
                    let made = self.solid(Path::new(name), mesh.as_ref().clone()).map_err(|e| e.to_string());
                    self.solids.insert(key.clone(), made);
                }
                self.solids[&key].clone().map(as_shape).map_err(|why| format!("mesh \"{name}\": {why}"))
            }
            Geometry::File { path, scale, place, hull, required } => {
                let key = ((path.clone(), scale.map(f64::to_bits)), *hull);
                if !self.solids.contains_key(&key) {
                    let made = self.read(path, *scale, *hull);
                    self.solids.insert(key.clone(), made);
                }
                match &self.solids[&key] {
                    Ok(made) => Ok(as_shape(made.clone())),
                    Err(why) if *required => Err(format!("{place}: {}: {why}", path.display())),
                    Err(why) => {
                        self.notes.add(format!("{place}: {}", path.display()), format!("left out: {why}"));
                        Ok(None)
                    }
                }
            }
        }
    }

    fn read(&mut self, path: &Path, scale: [f64; 3], hull: bool) -> Result<Shape, String> {
        let mesh = stretched(read_file(path)?, scale);
        if !hull {
            if let Ok(made) = self.solid(path, mesh.clone()) {
                return Ok(made);
            }
            self.notes.add(path.display().to_string(), "its surface is not closed, so its convex hull is used");
        }
        let hull = mesh.convex_hull().map_err(|e| e.to_string())?;
        self.solid(path, hull).map_err(|e| e.to_string())
    }

    /// Makes a solid, from the cache if it is there. `path` names the mesh in the message about
    /// slow loading.
    fn solid(&mut self, path: &Path, mesh: TriMesh) -> Result<Shape, ShapeError> {
        let (name, count) = (path.file_name().unwrap_or_default().to_string_lossy(), mesh.triangles.len());
        let made = building_surface(&name, count, || self.purpose.mesh(mesh, &TreeSettings::octree(), &self.cache));
        let (shape, note) = made?;
        note.into_iter().for_each(|note| self.notes.add("sphere trees", note));
        Ok(shape)
    }
}

/// Returns the mass of a link, link frame. Visual meshes have no mass.
pub(crate) fn mass(link: &LinkSpec, placed: &[Placed<'_>]) -> Result<LinkMass, ShapeError> {
    let total = |each: &dyn Fn(&Placed<'_>) -> Option<MassSpec>| {
        let mut sum = LinkMass::none();
        for (placed, shape) in placed.iter().filter_map(|placed| Some((placed, placed.solid()?))) {
            if let Some(mass) = each(placed) {
                sum = sum.with(&own_mass(shape, mass)?.seen_from(&placed.pose));
            }
        }
        Ok(sum)
    };
    match link.mass {
        LinkMassSpec::Given(mass) => Ok(mass),
        LinkMassSpec::OfShapes => total(&|placed| placed.spec.mass),
        LinkMassSpec::Spread(spec @ (MassSpec::Density(_) | MassSpec::Usual)) => total(&|_| Some(spec)),
        LinkMassSpec::Spread(MassSpec::Mass(mass)) => {
            let volume: f64 = placed.iter().filter_map(Placed::solid).map(Shape::volume).sum();
            total(&|_| Some(MassSpec::Density(mass / volume)))
        }
    }
}

/// Returns the mass of a shape, in its own axes.
fn own_mass(shape: &Shape, mass: MassSpec) -> Result<LinkMass, ShapeError> {
    let properties = match mass {
        MassSpec::Density(density) => shape.mass_properties(density)?,
        MassSpec::Usual => shape.mass_properties(shape.own_density().unwrap_or(RigidBody::DEFAULT_DENSITY))?,
        MassSpec::Mass(mass) => shape.mass_properties(1.0)?.with_mass(mass),
    };
    Ok(LinkMass { mass: properties.mass, center: properties.center_of_mass, inertia: properties.inertia })
}
