//! The visual geometry of objects: shapes, and meshes that need not be closed.
//!
//! A visual mesh is read when it is first drawn, so a world without a renderer does not pay for it.
//! It is never checked for being closed. A mesh that cannot be read is not drawn, and
//! [`VisualMesh::fault`] then returns the reason.

use super::{Appearance, Cloud, PartSurface};
use std::fmt;
use std::sync::{Arc, OnceLock};
use tumble_collide::{MeshError, Pose, Shape, TriMesh, Vec3};

/// Can be drawn (thesis `Renderable` and `SidRenderable`, §IV.A.5). Visuals are data; a renderer
/// decides how to draw them.
pub trait Renderable {
    /// Returns its visuals.
    fn visuals(&self) -> &[Visual];
    /// Returns a surface through its parts, if it has one.
    fn surface(&self) -> Option<&PartSurface> {
        None
    }
    /// Returns spheres that are read from the object's range `x` of a state, if it has them.
    fn cloud<'a>(&'a self, x: &'a [f64]) -> Option<Cloud<'a>> {
        let _ = x;
        None
    }
}

/// One visual, fixed to a part.
#[derive(Clone, Debug)]
pub struct Visual {
    /// Part of the object that it is fixed to.
    pub part: usize,
    /// Pose in the part's frame.
    pub pose: Pose,
    /// Geometry.
    pub geometry: VisualGeometry,
    /// Appearance.
    pub appearance: Appearance,
    /// If not empty, the visual is drawn only if none of these meshes can be read.
    pub stands_in_for: Vec<Arc<VisualMesh>>,
}

/// Geometry of a [`Visual`].
#[derive(Clone, Debug)]
pub enum VisualGeometry {
    /// A solid.
    Shape(Shape),
    /// Triangles.
    Mesh(Arc<VisualMesh>),
}

/// The geometry of a [`Visual`] that is drawn.
#[derive(Clone, Copy, Debug)]
pub enum Drawn<'v> {
    /// A solid.
    Shape(&'v Shape),
    /// Triangles.
    Mesh(&'v Arc<TriMesh>),
}

impl Visual {
    /// Makes a visual of a shape at a pose in the part's frame.
    pub fn shape(part: usize, pose: Pose, shape: Shape, appearance: Appearance) -> Visual {
        Visual { part, pose, geometry: VisualGeometry::Shape(shape), appearance, stands_in_for: Vec::new() }
    }

    /// Makes a visual of a mesh at a pose in the part's frame.
    pub fn mesh(part: usize, pose: Pose, mesh: Arc<VisualMesh>, appearance: Appearance) -> Visual {
        Visual { part, pose, geometry: VisualGeometry::Mesh(mesh), appearance, stands_in_for: Vec::new() }
    }

    /// Returns the geometry to draw and reads its mesh if necessary. `None` if it cannot be read,
    /// or if a mesh that it stands in for can.
    pub fn drawn(&self) -> Option<Drawn<'_>> {
        if self.stands_in_for.iter().any(|mesh| mesh.triangles().is_ok()) {
            return None;
        }
        match &self.geometry {
            VisualGeometry::Shape(shape) => Some(Drawn::Shape(shape)),
            VisualGeometry::Mesh(mesh) => mesh.triangles().ok().map(Drawn::Mesh),
        }
    }

    /// Returns the distance at which a ray from `origin` along `direction` (any length above 0)
    /// enters the visual, m; world axes. `part` is the pose of its part. `None` if the ray misses
    /// or starts inside a shape; a mesh is hit from either side.
    pub fn ray(&self, part: &Pose, origin: &Vec3, direction: &Vec3) -> Option<f64> {
        let pose = part * self.pose;
        match self.drawn()? {
            Drawn::Shape(shape) => shape.cast_ray(&pose, origin, direction, f64::INFINITY).map(|hit| hit.distance),
            Drawn::Mesh(mesh) => mesh.ray(&pose, origin, direction),
        }
    }
}

/// Reads the triangles of a [`VisualMesh`]; the error is a message for the user.
type Read = dyn Fn() -> Result<Arc<TriMesh>, String> + Send + Sync;

/// Triangles that are drawn and never collide, m. They need not be closed. Read once, at first use.
pub struct VisualMesh {
    name: String,
    read: Box<Read>,
    mesh: OnceLock<Result<Arc<TriMesh>, String>>,
}

impl VisualMesh {
    /// Makes a mesh of triangles in memory.
    ///
    /// # Errors
    /// As [`TriMesh::check_data`].
    pub fn new(name: impl Into<String>, mesh: TriMesh) -> Result<VisualMesh, MeshError> {
        mesh.check_data()?;
        let made = VisualMesh::read_by(name, || Err(String::new()));
        let _ = made.mesh.set(Ok(Arc::new(mesh))); // nobody else has it yet
        Ok(made)
    }

    /// Makes a mesh of the triangles that `read` returns at first use. `name` is their source, such
    /// as a path.
    pub fn read_by(
        name: impl Into<String>,
        read: impl Fn() -> Result<Arc<TriMesh>, String> + Send + Sync + 'static,
    ) -> VisualMesh {
        VisualMesh { name: name.into(), read: Box::new(read), mesh: OnceLock::new() }
    }

    /// Returns the source of the triangles.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the triangles and reads them if necessary.
    ///
    /// # Errors
    /// The reason why `read` failed or [`TriMesh::check_data`] refused the triangles: a sentence
    /// without the name.
    pub fn triangles(&self) -> Result<&Arc<TriMesh>, &str> {
        let read = || {
            let mesh = (self.read)()?;
            mesh.check_data().map_err(|why| why.to_string())?;
            Ok(mesh)
        };
        self.mesh.get_or_init(read).as_ref().map_err(String::as_str)
    }

    /// Returns whether the triangles were read, successfully or not.
    pub fn is_read(&self) -> bool {
        self.mesh.get().is_some()
    }

    /// Returns the reason why reading failed; `None` before the first attempt. Reads nothing.
    pub fn fault(&self) -> Option<&str> {
        self.mesh.get()?.as_ref().err().map(String::as_str)
    }
}

impl fmt::Debug for VisualMesh {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("VisualMesh").field("name", &self.name).field("mesh", &self.mesh.get()).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

    fn triangle() -> TriMesh {
        TriMesh { vertices: vec![Vec3::zeros(), Vec3::x(), Vec3::y()], triangles: vec![[0, 1, 2]] }
    }

    #[test]
    fn a_mesh_is_read_when_it_is_drawn_and_once() {
        let reads = Arc::new(AtomicUsize::new(0));
        let count = reads.clone();
        let mesh = Arc::new(VisualMesh::read_by("open", move || {
            count.fetch_add(1, Relaxed);
            Ok(Arc::new(triangle()))
        }));
        let visual = Visual::mesh(0, Pose::translation(0.0, 0.0, 2.0), mesh.clone(), Appearance::default());
        assert!(!mesh.is_read() && mesh.fault().is_none() && reads.load(Relaxed) == 0);
        let copy = visual.clone();
        assert!(matches!(visual.drawn(), Some(Drawn::Mesh(read)) if **read == triangle()));
        assert!(copy.drawn().is_some());
        assert_eq!(reads.load(Relaxed), 1);
        // the triangle is at z = 2 + 1, faces up, and is 5 m below the eye
        let hit = visual.ray(&Pose::translation(0.0, 0.0, 1.0), &Vec3::new(0.25, 0.25, 8.0), &-Vec3::z());
        assert_eq!(hit, Some(5.0));
    }

    #[test]
    fn what_cannot_be_read_gives_its_place_to_what_stands_in() {
        let mut bad = triangle();
        bad.vertices[1].x = f64::NAN;
        assert!(VisualMesh::new("bad", bad.clone()).is_err());
        let lost = Arc::new(VisualMesh::read_by("lost", move || Ok(Arc::new(bad.clone()))));
        let gone = Arc::new(VisualMesh::read_by("gone", || Err("there is none".into())));
        let there = Arc::new(VisualMesh::new("there", triangle()).unwrap());
        let ball = Visual::shape(0, Pose::identity(), Shape::sphere(1.0).unwrap(), Appearance::default());
        let instead = |meshes: &[&Arc<VisualMesh>]| Visual {
            stands_in_for: meshes.iter().map(|mesh| (*mesh).clone()).collect(),
            ..ball.clone()
        };
        assert!(ball.drawn().is_some());
        assert!(instead(&[&lost, &gone]).drawn().is_some(), "neither can be read");
        assert!(instead(&[&lost, &there]).drawn().is_none(), "one can be read");
        assert!(Visual::mesh(0, Pose::identity(), gone.clone(), Appearance::default()).drawn().is_none());
        assert_eq!(gone.fault(), Some("there is none"));
        assert_eq!(lost.fault(), Some("vertex 2 is (NaN, 0, 0), but coordinates must be finite"));
    }
}
