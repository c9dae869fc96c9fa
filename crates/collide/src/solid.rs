//! The shapes that carry a sphere tree: meshes and cylinders.

use crate::shape::axis;
use crate::surface::Surface;
use crate::surface::parts::parts;
use crate::{
    Aabb, ClosedReport, MassProperties, MeshError, Pose, ShapeError, SphereTree, TreeCache, TreeSettings, TriMesh, Vec3,
};

/// A closed mesh about its centre of mass, with its sphere tree.
#[derive(Clone, Debug)]
pub struct MeshShape {
    mesh: TriMesh,
    tree: SphereTree,
    /// One; of shells that overlap, each; none where it collides by its balls.
    surfaces: Vec<Surface>,
    /// At density 1.
    unit_mass: MassProperties,
    bounding_radius: f64,
    /// The same for the leaves.
    leaf_radius: f64,
    report: ClosedReport,
}

/// The rest is made of these two.
impl PartialEq for MeshShape {
    fn eq(&self, other: &MeshShape) -> bool {
        (&self.mesh, &self.tree) == (&other.mesh, &other.tree)
    }
}

impl MeshShape {
    /// Checks and mends `mesh` ([`TriMesh::check_closed`]), moves its centre of mass to the origin and builds the
    /// tree. Also returns the offset that was subtracted from the vertices (metres).
    pub fn new(mesh: TriMesh, settings: &TreeSettings) -> Result<(MeshShape, Vec3), MeshError> {
        MeshShape::with_tree(mesh, |mesh| SphereTree::build(mesh, settings))
    }

    /// The same with a tree from the cache where it has one; also returns what is to be said of the cache.
    pub fn new_cached(
        mesh: TriMesh,
        settings: &TreeSettings,
        cache: &TreeCache,
    ) -> Result<(MeshShape, Vec3, Option<String>), MeshError> {
        let mut note = None;
        let tree_of = |mesh: &TriMesh| {
            let cached = SphereTree::build_cached(mesh, settings, cache)?;
            note = cached.note;
            Ok(cached.tree)
        };
        let (shape, offset) = MeshShape::with_tree(mesh, tree_of)?;
        Ok((shape, offset, note))
    }

    fn with_tree(
        mut mesh: TriMesh,
        tree_of: impl FnOnce(&TriMesh) -> Result<SphereTree, MeshError>,
    ) -> Result<(MeshShape, Vec3), MeshError> {
        let report = mesh.check_closed()?;
        let overlaps = report.crossing_faces > 0 || report.shells > 1;
        let mass = if overlaps { mesh.union_mass_properties(1.0) } else { mesh.mass_properties(1.0) };
        let offset = mass.center_of_mass;
        let mesh = mesh.translated(&-offset);
        // what rounding left of the offset is not worth a second shift
        let mass = if overlaps { mass } else { mesh.mass_properties(1.0) };
        let unit_mass = MassProperties { center_of_mass: Vec3::zeros(), ..mass };
        let tree = tree_of(&mesh)?;
        Ok((MeshShape::of_parts(mesh, tree, unit_mass, report), offset))
    }

    /// Of a mesh that was checked and moved, with its tree: the rest follows from these.
    pub(crate) fn of_parts(
        mesh: TriMesh,
        tree: SphereTree,
        unit_mass: MassProperties,
        report: ClosedReport,
    ) -> MeshShape {
        let bounding_radius = mesh.vertices.iter().map(Vec3::norm).fold(0.0, f64::max);
        let leaf_radius = tree.leaves().map(|l| l.center.norm() + l.radius).fold(0.0, f64::max);
        // buried faces are no surface of the union: such a mesh goes shell by shell, or stands for itself by its balls
        let buried = report.crossing_faces > 0 || (unit_mass.mass - mesh.signed_volume()).abs() > 1e-9 * unit_mass.mass;
        let surfaces = if buried { parts(&mesh, &tree).unwrap_or_default() } else { vec![Surface::new(&mesh, &tree)] };
        MeshShape { mesh, tree, surfaces, unit_mass, bounding_radius, leaf_radius, report }
    }

    /// The surface; its centre of mass is the origin.
    pub fn mesh(&self) -> &TriMesh {
        &self.mesh
    }

    /// The balls around the surface.
    pub fn tree(&self) -> &SphereTree {
        &self.tree
    }

    /// Elements and fields of the `surface` contact mode: one, or one for each of several shells that overlap; none where the surface crosses
    /// itself in another way, which then collides by its balls.
    pub(crate) fn surfaces(&self) -> &[Surface] {
        &self.surfaces
    }

    /// At density 1, about the center of mass.
    pub(crate) fn unit_mass(&self) -> &MassProperties {
        &self.unit_mass
    }

    /// What was found and mended when the mesh was read; its notes are for the user.
    pub fn report(&self) -> &ClosedReport {
        &self.report
    }

    /// Volume, m³.
    pub fn volume(&self) -> f64 {
        self.unit_mass.mass
    }

    /// Radius of the ball about the origin that holds the surface, metres.
    pub fn bounding_radius(&self) -> f64 {
        self.bounding_radius
    }

    /// The box in world axes around the leaves: the turned local box, cut by the ball about the centre.
    pub(crate) fn aabb(&self, pose: &Pose) -> Aabb {
        let (bounds, here) = (self.tree.bounds(), pose.translation.vector);
        let center = pose.rotation * (0.5 * (bounds.min + bounds.max)) + here;
        let half = pose.rotation.to_rotation_matrix().matrix().abs() * (0.5 * (bounds.max - bounds.min));
        Aabb {
            min: (center - half).sup(&here.add_scalar(-self.leaf_radius)),
            max: (center + half).inf(&here.add_scalar(self.leaf_radius)),
        }
    }

    /// At a uniform `density`, kg/m³.
    pub(crate) fn mass_properties(&self, density: f64) -> MassProperties {
        MassProperties {
            inertia: self.unit_mass.inertia * density,
            ..self.unit_mass.with_mass(self.unit_mass.mass * density)
        }
    }
}

/// A cylinder along local z about the origin, with the sphere tree of a closed mesh around it.
#[derive(Clone, Debug, PartialEq)]
pub struct CylinderShape {
    radius: f64,
    half_length: f64,
    mesh: TriMesh,
    tree: SphereTree,
    /// Of a cylinder around prism and leaves, metres.
    outer_radius: f64,
    outer_half_length: f64,
}

/// Sides of the prism that stands for a cylinder: its edges lie `1/cos(π/48)`, 0.2 % of the radius, outside.
const SIDES: usize = 48;

impl CylinderShape {
    /// Radius and half length in metres.
    pub fn new(radius: f64, half_length: f64) -> Result<CylinderShape, ShapeError> {
        // the prism is around the cylinder, so that its tree covers the true surface
        let outer = radius / nalgebra::ComplexField::cos(std::f64::consts::PI / SIDES as f64);
        let mesh = TriMesh::cylinder(outer, half_length, SIDES);
        let tree = SphereTree::build(&mesh, &TreeSettings::octree())?;
        let error = tree.outward_error();
        let (outer_radius, outer_half_length) = (outer + error, half_length + error);
        Ok(CylinderShape { radius, half_length, mesh, tree, outer_radius, outer_half_length })
    }

    /// Metres.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// From the centre to a flat face, metres.
    pub fn half_length(&self) -> f64 {
        self.half_length
    }

    /// The box in world axes around the leaves.
    pub(crate) fn aabb(&self, pose: &Pose) -> Aabb {
        let here = pose.translation.vector;
        // a disc reaches r·sin of the angle between its axis and the direction asked for
        let half =
            axis(pose).map(|e| self.outer_half_length * e.abs() + self.outer_radius * (1.0 - e * e).max(0.0).sqrt());
        Aabb { min: here - half, max: here + half }
    }

    /// The prism around the cylinder that the tree was made of.
    pub fn mesh(&self) -> &TriMesh {
        &self.mesh
    }

    /// The balls around the surface.
    pub fn tree(&self) -> &SphereTree {
        &self.tree
    }
}
