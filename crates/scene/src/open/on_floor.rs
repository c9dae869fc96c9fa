//! A robot or a mesh file as a scene of its own: on a floor, in front of a camera.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use tumble_core::collide::{Aabb, Pose, TriMesh, Vec3};
use tumble_core::{Joint, Mode};

use crate::build::articulated::link_poses_at_start;
use crate::build::{mesh_files, shapes};
use crate::error::SceneError;
use crate::parse::appearance::AppearanceSpec;
use crate::parse::articulated::ArticulatedSpec;
use crate::parse::body::{BodySpec, MassSpec};
use crate::parse::file::SceneFile;
use crate::parse::link::{Geometry, LinkShape, LinkSpec};
use crate::parse::mesh::{MeshSource, MeshSpec};
use crate::parse::shape::ShapeSpec;
use crate::parse::view::CameraSpec;
use crate::urdf::{self, Content, UrdfError, UrdfOptions};

/// A static half-space that is drawn as a checkered floor.
const FLOOR: &str = "\
[[body]]
name = \"floor\"
mode = \"static\"
shape = { type = \"half_space\" }
visible = false
[ground]
";
/// Density of a mesh, kg/m³: that of water.
const DENSITY: f64 = 1000.0;
/// Height of a mesh above the floor at time 0, as a fraction of its diagonal.
const DROP: f64 = 0.1;
/// A mesh with a longer diagonal is probably not in meters, m.
const LIKELY_MILLIMETERS_M: f64 = 10.0;
/// The direction in which the camera looks.
const VIEW: [f64; 3] = [-0.55, 1.0, -0.45];
const FOV_DEG: f64 = 40.0;
/// Color of a mesh, sRGB: one that floor and sky do not have.
const COLOR: [f64; 3] = [0.78, 0.45, 0.20];

/// Returns a scene with a URDF on a floor through its lowest point. Joints start at 0, or at the
/// nearest limit if 0 is outside their limits.
pub(crate) fn robot(path: &Path, options: &UrdfOptions) -> Result<SceneFile, SceneError> {
    let robot = urdf::read_file(path, options, Content::Body)?;
    let name = if robot.name.is_empty() { stem(path) } else { robot.name };
    let notes = robot.notes;
    let mut spec = ArticulatedSpec { exclude_overlapping: true, notes, ..ArticulatedSpec::of(name, robot.links) };
    start_within_limits(&mut spec.links);
    let poses = link_poses_at_start(&spec).map_err(|source| UrdfError::Model { file: path.to_path_buf(), source })?;
    let bounds = Aabb::around(Extent::default().points(&spec.links, &poses));
    let mut scene = empty(path, &spec.name)?;
    stand(&mut scene, &bounds, bounds.min.z);
    scene.articulated.push(spec);
    Ok(scene)
}

/// Returns a scene with a mesh file as a dynamic body of the density of water, a tenth of its
/// diagonal above a floor. Its frame is that of the file.
pub(crate) fn mesh(path: &Path, repair: bool) -> Result<SceneFile, SceneError> {
    let wrong = |why: String| SceneError::Format { file: path.to_path_buf(), why };
    let triangles = mesh_files::read_file(path).map_err(wrong)?;
    if triangles.triangles.is_empty() {
        return Err(wrong("the mesh has no triangles; expected a closed surface".into()));
    }
    let bounds = Aabb::around(triangles.vertices.iter().copied());
    let diagonal = (bounds.max - bounds.min).norm();
    if !diagonal.is_finite() {
        return Err(wrong("a vertex of the mesh is not finite".into()));
    }
    let name = stem(path);
    let mut scene = empty(path, &name)?;
    let source = MeshSource::File { path: path.to_path_buf(), scale: 1.0 };
    scene.meshes.push(MeshSpec {
        name: name.clone(),
        source,
        repair,
        sphere_tree_depth: None,
        sphere_tree_max_error: None,
    });
    let body = BodySpec {
        name,
        mode: Mode::Dynamic,
        shape: ShapeSpec::Mesh { mesh: 0 },
        mass: Some(MassSpec::Density(DENSITY)),
        visible: true,
        sound: None,
        appearance: AppearanceSpec { color: COLOR, ..AppearanceSpec::default() },
        ..scene.bodies[0].clone()
    };
    scene.bodies.push(body);
    stand(&mut scene, &bounds, bounds.min.z - DROP * diagonal);
    if diagonal > LIKELY_MILLIMETERS_M {
        scene.notes.push(format!(
            "{}: its diagonal is {diagonal:.1} m, so it may be in millimeters; a scene reads it with `scale = 0.001`",
            path.display()
        ));
    }
    Ok(scene)
}

/// Returns a scene with a floor whose name differs from that of the object on it.
fn empty(path: &Path, name: &str) -> Result<SceneFile, SceneError> {
    let mut scene = SceneFile::parse(FLOOR, &path.display().to_string())?;
    if name == "floor" {
        scene.bodies[0].name = "ground".into();
    }
    Ok(scene)
}

/// Moves the floor to a height and the camera in front of the space between the floor and the top
/// of the bounds. Squares of the floor are 10ⁿ m, the largest such size below the diagonal.
fn stand(scene: &mut SceneFile, bounds: &Aabb, floor_m: f64) {
    let min = Vec3::new(bounds.min.x, bounds.min.y, floor_m);
    let radius = (0.5 * (bounds.max - min).norm()).max(1e-3);
    scene.bodies[0].position_m[2] = floor_m;
    if let Some(ground) = &mut scene.ground {
        ground.height_m = floor_m;
        ground.appearance.pattern_scale_m = libm::pow(10.0, libm::floor(libm::log10(2.0 * radius)));
    }
    let target = 0.5 * (min + bounds.max);
    let distance = radius / (0.5 * FOV_DEG).to_radians().sin();
    let eye = target - distance * Vec3::from(VIEW).normalize();
    scene.camera = Some(CameraSpec {
        eye_m: eye.into(),
        target_m: target.into(),
        up: [0.0, 0.0, 1.0],
        vertical_fov_deg: FOV_DEG,
        near_m: (0.01 * radius).min(0.05),
        far_m: (50.0 * radius).max(500.0),
    });
}

/// Moves initial positions into the limits. Joints that follow others follow them.
fn start_within_limits(links: &mut [LinkSpec]) {
    for link in links.iter_mut().filter(|link| link.joint.is_single()) {
        let [lower, upper] = link.joint.dof.limits.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
        link.joint.position[0] = link.joint.position[0].max(lower).min(upper);
    }
    for follower in 0..links.len() {
        if let Some(mimic) = links[follower].joint.mimic
            && let Some(of) = links[mimic.link].joint.position.first().copied()
            && links[follower].joint.is_single()
        {
            links[follower].joint.position[0] = mimic.multiplier * of + mimic.offset;
        }
    }
}

/// Finds the extent of links. Each mesh file is read once.
#[derive(Default)]
struct Extent {
    files: BTreeMap<PathBuf, Option<TriMesh>>,
}

impl Extent {
    /// Returns points in the world whose bounding box contains all shapes; the origins of links if
    /// there are none.
    fn points(&mut self, links: &[LinkSpec], poses: &[Pose]) -> Vec<Vec3> {
        let mut points = Vec::new();
        for (link, pose) in links.iter().zip(poses) {
            link.shapes.iter().for_each(|shape| self.add(shape, &(pose * shape.pose), &mut points));
        }
        if points.is_empty() {
            points.extend(poses.iter().map(|pose| pose.translation.vector));
        }
        points
    }

    /// Adds the points of one shape. A file that cannot be read adds none; building the robot
    /// reports it.
    fn add(&mut self, shape: &LinkShape, pose: &Pose, points: &mut Vec<Vec3>) {
        match &shape.geometry {
            Geometry::Shape(spec) => {
                let made = shapes::make(spec, &[]).ok();
                points.extend(made.map(|shape| shape.aabb(pose)).into_iter().flat_map(|b| [b.min, b.max]));
            }
            Geometry::Solid { mesh, .. } => {
                points.extend(mesh.vertices.iter().map(|v| pose.transform_point(&(*v).into()).coords));
            }
            Geometry::File { path, scale, .. } => {
                let read = self.files.entry(path.clone()).or_insert_with(|| mesh_files::read_file(path).ok());
                let Some(mesh) = read else { return };
                let place = |v: &Vec3| pose.transform_point(&v.component_mul(&Vec3::from(*scale)).into()).coords;
                let own = Aabb::around(mesh.vertices.iter().map(place).filter(|v| v.iter().all(|x| x.is_finite())));
                points.extend([own.min, own.max].into_iter().filter(|v| v.iter().all(|x| x.is_finite())));
            }
        }
    }
}

/// Returns the name of a file without its extension and without control characters.
fn stem(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let name: String = stem.chars().filter(|c| !c.is_control()).collect();
    if name.is_empty() { "object".into() } else { name }
}

impl SceneFile {
    /// Returns whether the scene has a robot with a fixed base: one without a floating link.
    pub fn has_fixed_base(&self) -> bool {
        let floats = |spec: &ArticulatedSpec| spec.links.iter().any(|link| link.joint.kind == Joint::Floating);
        self.articulated.iter().any(|spec| !floats(spec))
    }
}
