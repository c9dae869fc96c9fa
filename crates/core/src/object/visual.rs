//! What is drawn of an object: shapes, and meshes that need not be solids.
//!
//! A mesh that is only drawn is read when somebody draws it, and is never checked for being closed: a world that nobody looks at does not pay for its
//! pictures. What cannot be read is not drawn, and [`VisualMesh::fault`] says why from then on.

use crate::object::Appearance;
use std::fmt;
use std::sync::{Arc, OnceLock};
use tumble_collide::{MeshError, Pose, Shape, TriMesh, Vec3};

/// One thing to draw, fixed to a site.
#[derive(Clone, Debug)]
pub struct Visual {
    /// Part of the object that it moves with.
    pub part: usize,
    /// Pose in the part's frame.
    pub pose: Pose,
    /// Geometry.
    pub geometry: VisualGeometry,
    /// Look.
    pub appearance: Appearance,
    /// If not empty: drawn only where none of these can be read.
    pub stands_in_for: Vec<Arc<VisualMesh>>,
}

/// The geometry of a [`Visual`].
#[derive(Clone, Debug)]
pub enum VisualGeometry {
    /// A solid.
    Shape(Shape),
    /// Triangles.
    Mesh(Arc<VisualMesh>),
}

/// What a [`Visual`] draws now.
#[derive(Clone, Copy, Debug)]
pub enum Drawn<'v> {
    /// A solid.
    Shape(&'v Shape),
    /// Triangles.
    Mesh(&'v Arc<TriMesh>),
}

impl Visual {
    /// A shape at a pose in the part's frame.
    pub fn shape(part: usize, pose: Pose, shape: Shape, appearance: Appearance) -> Visual {
        Visual { part, pose, geometry: VisualGeometry::Shape(shape), appearance, stands_in_for: Vec::new() }
    }

    /// A mesh at a pose in the part's frame.
    pub fn mesh(part: usize, pose: Pose, mesh: Arc<VisualMesh>, appearance: Appearance) -> Visual {
        Visual { part, pose, geometry: VisualGeometry::Mesh(mesh), appearance, stands_in_for: Vec::new() }
    }

    /// What is to be drawn, its mesh read if nobody has before. `None` where it cannot be read, or stands in for what can.
    pub fn drawn(&self) -> Option<Drawn<'_>> {
        if self.stands_in_for.iter().any(|mesh| mesh.triangles().is_ok()) {
            return None;
        }
        match &self.geometry {
            VisualGeometry::Shape(shape) => Some(Drawn::Shape(shape)),
            VisualGeometry::Mesh(mesh) => mesh.triangles().ok().map(Drawn::Mesh),
        }
    }

    /// The distance along `direction` (any length above 0) at which a ray from `origin` enters it, metres; world axes. `part` is the pose of its part.
    /// `None` where it misses or starts inside a shape; a mesh is met from either side.
    pub fn ray(&self, part: &Pose, origin: &Vec3, direction: &Vec3) -> Option<f64> {
        let pose = part * self.pose;
        match self.drawn()? {
            Drawn::Shape(shape) => shape.ray(&pose, origin, direction),
            Drawn::Mesh(mesh) => mesh.ray(&pose, origin, direction),
        }
    }
}

/// Reads the triangles of a [`VisualMesh`]; the error is for the user.
type Read = dyn Fn() -> Result<Arc<TriMesh>, String> + Send + Sync;

/// Triangles that are drawn and never collide, in metres; they need not be closed. Read once, when first asked for.
pub struct VisualMesh {
    name: String,
    read: Box<Read>,
    mesh: OnceLock<Result<Arc<TriMesh>, String>>,
}

impl VisualMesh {
    /// Triangles in memory.
    ///
    /// # Errors
    /// As [`TriMesh::check_data`].
    pub fn new(name: impl Into<String>, mesh: TriMesh) -> Result<VisualMesh, MeshError> {
        mesh.check_data()?;
        let made = VisualMesh::read_by(name, || Err(String::new()));
        let _ = made.mesh.set(Ok(Arc::new(mesh))); // nobody else has it yet
        Ok(made)
    }

    /// Triangles that `read` gives when they are first asked for. `name` says where they come from, such as a path.
    pub fn read_by(
        name: impl Into<String>,
        read: impl Fn() -> Result<Arc<TriMesh>, String> + Send + Sync + 'static,
    ) -> VisualMesh {
        VisualMesh { name: name.into(), read: Box::new(read), mesh: OnceLock::new() }
    }

    /// Where it comes from.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The triangles, read now if they were not.
    ///
    /// # Errors
    /// Why they cannot be read, or [`TriMesh::check_data`] refuses them; a sentence without the name.
    pub fn triangles(&self) -> Result<&Arc<TriMesh>, &str> {
        let read = || {
            let mesh = (self.read)()?;
            mesh.check_data().map_err(|why| why.to_string())?;
            Ok(mesh)
        };
        self.mesh.get_or_init(read).as_ref().map_err(String::as_str)
    }

    /// Whether they were asked for.
    pub fn is_read(&self) -> bool {
        self.mesh.get().is_some()
    }

    /// Why they could not be read, where that was tried; reads nothing.
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
        // the triangle stands at z = 2 + 1, faces up, and is 5 m below the eye
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
