//! The shape of a closed mesh, with its sphere tree and its signed distance field.

use crate::cache::{Entry, Kind};
use crate::ray::RayMesh;
use crate::sdf::Surface;
use crate::sdf::shells::shell_surfaces;
use crate::{
    Aabb, ClosedReport, MassProperties, MeshDistance, MeshError, MeshId, Pose, SphereTree, TreeCache, TreeSettings,
    TriMesh, Vec3,
};
use std::sync::OnceLock;

/// A closed mesh about its center of mass, with its sphere tree.
#[derive(Clone, Debug)]
pub struct MeshShape {
    pub(super) mesh: TriMesh,
    pub(super) settings: TreeSettings,
    pub(super) cache: TreeCache,
    pub(super) tree: OnceLock<Tree>,
    /// The surface; one per shell if shells overlap; empty if the mesh collides by its spheres.
    pub(super) surfaces: OnceLock<Vec<Surface>>,
    /// The triangles for rays, built on first use.
    pub(super) ray_mesh: OnceLock<RayMesh>,
    /// The triangles for distances, built on first use.
    pub(super) distance: OnceLock<MeshDistance>,
    /// Whether some of its faces lie inside the union of its shells.
    pub(super) buried: bool,
    /// Mass properties at density 1.
    pub(super) unit_mass: MassProperties,
    pub(super) bounding_radius: f64,
    pub(super) report: ClosedReport,
    /// Position of the origin in the frame of the given mesh.
    pub(super) center: Vec3,
}

/// A tree, and the radius of the sphere about the origin that contains its leaves, meters.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    tree: SphereTree,
    leaf_radius: f64,
}

impl From<SphereTree> for Tree {
    fn from(tree: SphereTree) -> Tree {
        let leaf_radius = tree.leaves().map(|l| l.center.norm() + l.radius).fold(0.0, f64::max);
        Tree { tree, leaf_radius }
    }
}

/// All other fields are computed from these.
impl PartialEq for MeshShape {
    fn eq(&self, other: &MeshShape) -> bool {
        (&self.mesh, self.tree()) == (&other.mesh, other.tree())
    }
}

impl MeshShape {
    /// Checks and repairs `mesh` ([`TriMesh::check_closed`]), moves its center of mass to the
    /// origin and builds the tree.
    ///
    /// # Errors
    /// [`MeshError`]: a mesh that encloses no solid, a setting out of its range, or a tree that
    /// cannot be built.
    pub fn new(mesh: TriMesh, settings: &TreeSettings) -> Result<MeshShape, MeshError> {
        let shape = MeshShape::new_lazy(mesh, settings, &TreeCache::off())?;
        let tree = shape.build_tree()?;
        let shape = MeshShape { tree: OnceLock::from(Tree::from(tree)), ..shape };
        shape.surfaces();
        Ok(shape)
    }

    fn build_tree(&self) -> Result<SphereTree, MeshError> {
        Ok(SphereTree::build_by(&self.mesh, &self.new_distance(), &self.settings, &())?.0)
    }

    fn new_distance(&self) -> MeshDistance {
        let crosses = self.report.crossing_faces > 0 || self.report.crossing_capped;
        if crosses { MeshDistance::new(&self.mesh) } else { MeshDistance::without_crossings(&self.mesh) }
    }

    /// Returns the triangles for rays, built on first use.
    pub(crate) fn ray_mesh(&self) -> &RayMesh {
        self.ray_mesh.get_or_init(|| RayMesh::new(&self.mesh))
    }

    /// Returns the triangles for distances, built on first use.
    pub(crate) fn distance(&self) -> &MeshDistance {
        self.distance.get_or_init(|| self.new_distance())
    }

    /// Like [`MeshShape::new`], but builds tree and surface on first use: for shapes that are drawn
    /// and not simulated. If the tree cannot be built, it is a single sphere.
    ///
    /// # Errors
    /// [`MeshError`]: a mesh that encloses no solid, or a setting out of its range.
    pub fn new_lazy(mut mesh: TriMesh, settings: &TreeSettings, cache: &TreeCache) -> Result<MeshShape, MeshError> {
        settings.check()?;
        let report = mesh.check_closed()?;
        let overlaps = report.crossing_faces > 0 || report.shells > 1;
        let mass = if overlaps { mesh.union_mass_properties(1.0) } else { mesh.mass_properties(1.0) };
        let center = mass.center_of_mass;
        let mesh = mesh.translated(&-center);
        // the remaining rounding error does not justify a second shift
        let mass = if overlaps { mass } else { mesh.mass_properties(1.0) };
        let unit_mass = MassProperties { center_of_mass: Vec3::zeros(), ..mass };
        let (settings, cache) = (*settings, cache.clone());
        Ok(MeshShape { settings, cache, center, ..MeshShape::of_checked(mesh, unit_mass, report) })
    }

    pub(super) fn of_checked(mesh: TriMesh, unit_mass: MassProperties, report: ClosedReport) -> MeshShape {
        let bounding_radius = mesh.vertices.iter().map(Vec3::norm).fold(0.0, f64::max);
        let buried = report.crossing_faces > 0 || (unit_mass.mass - mesh.signed_volume()).abs() > 1e-9 * unit_mass.mass;
        MeshShape {
            mesh,
            settings: TreeSettings::octree(),
            cache: TreeCache::off(),
            tree: OnceLock::new(),
            surfaces: OnceLock::new(),
            ray_mesh: OnceLock::new(),
            distance: OnceLock::new(),
            buried,
            unit_mass,
            bounding_radius,
            report,
            center: Vec3::zeros(),
        }
    }

    /// Returns the shape from the cache, or else builds and stores it. Also returns a warning about
    /// the cache, if any.
    ///
    /// # Errors
    /// [`MeshError`]: a mesh that encloses no solid, a setting out of its range, or a tree that
    /// cannot be built.
    pub fn new_cached(
        mesh: TriMesh,
        settings: &TreeSettings,
        cache: &TreeCache,
    ) -> Result<(MeshShape, Option<String>), MeshError> {
        let entry = Entry::new(cache, Kind::Shape, &MeshId::of(&mesh), settings);
        let mut note = None;
        match entry.as_ref().map(MeshShape::read) {
            Some(Ok(Some(shape))) => return Ok((shape, None)),
            Some(Err(why)) => note = Some(why),
            None | Some(Ok(None)) => {}
        }
        let shape = MeshShape::new(mesh, settings)?;
        if let Some(entry) = entry
            && let Err(why) = entry.write(&shape.to_bytes())
        {
            note.get_or_insert(why);
        }
        Ok((shape, note))
    }

    fn read(entry: &Entry) -> Result<Option<MeshShape>, String> {
        let Some(body) = entry.read()? else { return Ok(None) };
        MeshShape::of_bytes(&body).map(Some).ok_or_else(|| entry.refused("it holds no shape"))
    }

    /// Returns the mesh; its center of mass is the origin.
    pub fn mesh(&self) -> &TriMesh {
        &self.mesh
    }

    /// Returns the spheres around the surface.
    pub fn tree(&self) -> &SphereTree {
        &self.whole_tree().tree
    }

    fn whole_tree(&self) -> &Tree {
        let build = || SphereTree::build_cached(&self.mesh, &self.settings, &self.cache).map(|cached| cached.tree);
        self.tree.get_or_init(|| build().unwrap_or_else(|_| SphereTree::bounding_sphere(&self.mesh)).into())
    }

    /// Returns whether tree or surface is built, which the first step of a world does.
    pub fn is_built(&self) -> bool {
        self.tree.get().is_some() || self.surfaces.get().is_some()
    }

    /// Returns elements and fields for the `surface` contact mode: one, or one per shell if shells
    /// overlap. Empty if the surface crosses itself in another way; such a mesh collides by its
    /// spheres.
    pub(crate) fn surfaces(&self) -> &[Surface] {
        // faces inside the union are no surface: such a mesh is handled shell by shell, or collides
        // by its spheres
        self.surfaces.get_or_init(|| match self.buried {
            true => shell_surfaces(&self.mesh, self.tree()).unwrap_or_default(),
            false => vec![Surface::new(&self.mesh, self.tree())],
        })
    }

    /// Returns the number of vertices at which convex edges of different directions meet: 8 for a box,
    /// however finely its sides are divided; all for a smooth convex surface, and for a mesh that
    /// collides by its spheres.
    pub fn corner_count(&self) -> usize {
        match self.surfaces() {
            [] => self.mesh.vertices.len(),
            surfaces => surfaces.iter().map(|surface| surface.elements.corners).sum(),
        }
    }

    /// Returns the defects that were found and repaired; the notes are for users.
    pub fn report(&self) -> &ClosedReport {
        &self.report
    }

    /// Returns the volume, m³.
    pub fn volume(&self) -> f64 {
        self.unit_mass.mass
    }

    /// Returns the center of mass in the frame of the given mesh, meters: the offset that was
    /// subtracted from its vertices.
    pub fn center_of_mass(&self) -> Vec3 {
        self.center
    }

    /// Returns the radius of the sphere about the origin that contains the surface, meters.
    pub fn bounding_radius(&self) -> f64 {
        self.bounding_radius
    }

    /// Returns the box in world axes around the leaves: the box of the rotated local box, clipped
    /// by the box of the bounding sphere.
    pub(crate) fn aabb(&self, pose: &Pose) -> Aabb {
        let Tree { tree, leaf_radius } = self.whole_tree();
        let (bounds, here) = (tree.bounds(), pose.translation.vector);
        let center = pose.rotation * (0.5 * (bounds.min + bounds.max)) + here;
        let half = pose.rotation.to_rotation_matrix().matrix().abs() * (0.5 * (bounds.max - bounds.min));
        Aabb {
            min: (center - half).sup(&here.add_scalar(-leaf_radius)),
            max: (center + half).inf(&here.add_scalar(*leaf_radius)),
        }
    }

    /// Returns the mass properties at a uniform `density`, kg/m³.
    pub(crate) fn mass_properties(&self, density: f64) -> MassProperties {
        MassProperties {
            inertia: self.unit_mass.inertia * density,
            ..self.unit_mass.with_mass(self.unit_mass.mass * density)
        }
    }
}
