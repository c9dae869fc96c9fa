//! Worlds and shapes as bytes, for Python's pickle.
//!
//! A world is the library's archive, and what belongs to the world on Python's side. Its forces and behaviors are Python objects, which pickle
//! writes beside the bytes and `World.__setstate__` puts back, so that one that holds its own world is written too.

use crate::errors::{Error, Result, caught};
use crate::objects::robot::Robot;
use crate::objects::shapes::Shape;
use crate::world::inner::Inner;
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use pyo3::types::PyBytes;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use tumble::collide::{Pose, Shape as Solid};
use tumble::dynamics::archive::{open, seal};
use tumble::dynamics::{ArchiveError, ArticulatedBody, ObjectId, World as Core};
use tumble::scene::{CameraSpec, CavePlace, GroundSpec, LightSpec, SceneFile, SkySpec};

/// The first bytes of a pickled world and a pickled shape. The number is raised with every change of their content.
const WORLD: &[u8; 8] = b"tumbleW5";
const SHAPE: &[u8; 8] = b"tumbleG3";

/// A world.
#[derive(Serialize, Deserialize)]
struct Record {
    archive: Vec<u8>,
    scene: SceneRecord,
    /// Places of articulated bodies, the names of their joints, and the forces that act on them.
    robots: Vec<(u32, Vec<String>, Option<Vec<f64>>)>,
    notes: Vec<String>,
    overlaps: Vec<String>,
}

/// The stored part of a scene: its name, and the settings of pictures.
#[derive(Serialize, Deserialize)]
pub struct SceneRecord {
    file: String,
    description: String,
    integrator: String,
    camera: Option<CameraSpec>,
    cave: Option<CavePlace>,
    lights: Vec<LightSpec>,
    sky: SkySpec,
    ground: Option<GroundSpec>,
}

impl SceneRecord {
    pub fn of(scene: &SceneFile) -> SceneRecord {
        let SceneFile { file, description, camera, cave, lights, sky, ground, world, .. } = scene.clone();
        SceneRecord { file, description, integrator: world.integrator.to_string(), camera, cave, lights, sky, ground }
    }

    pub fn scene(self) -> Result<SceneFile> {
        let SceneRecord { file, description, integrator, camera, cave, lights, sky, ground } = self;
        let mut scene = SceneFile::parse("", &file)?;
        scene.world.integrator = integrator.parse()?;
        Ok(SceneFile { description, camera, cave, lights, sky, ground, ..scene })
    }
}

/// The bytes of a world without its forces and behaviors.
pub fn write(inner: &Inner) -> Result<Vec<u8>> {
    let ids = inner.world.ids();
    let robots = (0..).zip(ids).filter_map(|(place, id)| {
        let robot = inner.robots.get(id)?;
        Some((place, robot.joints.clone(), inner.efforts.get(id).cloned()))
    });
    let record = Record {
        archive: inner.world.archive(&inner.foreign())?,
        scene: SceneRecord::of(&inner.scene),
        robots: robots.collect(),
        notes: inner.notes.clone(),
        overlaps: inner.overlaps.clone(),
    };
    Ok(seal(WORLD, &record)?)
}

/// The bytes of a world that has no forces and behaviors.
pub fn model(inner: &Inner) -> Result<Vec<u8>> {
    match inner.extension.is_empty() {
        true => write(inner),
        false => Err(Error::value(
            "forces, behaviors, callables and intersection tests in Python are no part of a model; pickle the world instead",
        )),
    }
}

/// The world of such bytes; its forces have no Python object yet.
pub fn read(bytes: &[u8]) -> Result<Inner> {
    let record: Record = open(WORLD, bytes)?;
    let mut forces = Vec::new();
    let world = Core::from_archive(&record.archive, &mut |object| {
        tumble::behaviors::read_object(object).or_else(|| {
            object.record.is_none().then(|| {
                forces.push(object.name.to_string());
                crate::extension::callbacks::empty_force(object.name)
            })
        })
    })?;
    let ids: Vec<ObjectId> = world.ids().to_vec();
    let mut inner = Inner::new(world, Arc::new(record.scene.scene()?));
    for (place, joints, effort) in record.robots {
        let missing = || ArchiveError::Damaged(format!("object {place} is not articulated"));
        let id = ids.get(place as usize).copied().ok_or_else(missing)?;
        let body = inner.world.get::<ArticulatedBody>(id).ok_or_else(missing)?;
        let robot = Robot { model: body.model().clone(), base: *body.base(), joints };
        inner.robots.insert(id, Arc::new(robot));
        effort.map(|effort| inner.efforts.insert(id, effort));
    }
    inner.expect_forces(&forces);
    (inner.notes, inner.overlaps) = (record.notes, record.overlaps);
    Ok(inner)
}

/// The bytes of an articulated body: those of a world that has nothing else.
pub fn write_body(body: &ArticulatedBody) -> Result<Vec<u8>> {
    let mut world = Core::default();
    world.add(body.clone())?;
    Ok(world.archive(&[])?)
}

/// Returns the body of such bytes.
pub fn read_body(bytes: &[u8]) -> Result<ArticulatedBody> {
    let world = Core::from_archive(bytes, &mut |_| None)?;
    let body = world.ids().first().and_then(|id| world.get::<ArticulatedBody>(*id));
    Ok(body.cloned().ok_or_else(|| ArchiveError::Damaged("it has no articulated body".into()))?)
}

/// A shape: its solid, where that stands in the body's frame, and how it is written.
#[derive(Serialize, Deserialize)]
pub struct ShapeRecord {
    pub solid: Solid,
    pub placement: Pose,
    pub name: Option<String>,
    pub words: String,
}

/// The bytes of a shape.
pub fn write_shape(record: &ShapeRecord) -> Result<Vec<u8>> {
    Ok(seal(SHAPE, record)?)
}

/// Returns what `__reduce__` of a value does: the function of this module that reads it, and its bytes.
pub fn pickled<'py>(
    py: Python<'py>,
    unpickle: &str,
    head: &[u8; 8],
    value: &impl Serialize,
) -> Result<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
    let unpickle = py.import("tumble._native")?.getattr(unpickle)?;
    Ok((unpickle, (PyBytes::new(py, &seal(head, value)?),)))
}

/// Returns the object of its class that a pickled shape becomes.
#[pyfunction]
pub fn _unpickle_shape(py: Python<'_>, data: PyBackedBytes) -> Result<Py<PyAny>> {
    let record: ShapeRecord = py.detach(|| caught(|| Ok(open(SHAPE, &data)?)))?;
    Shape::of_record(py, record)
}

/// Returns the world of a pickle; pickle then restores its forces and behaviors.
#[pyfunction]
pub fn _unpickle_world(py: Python<'_>, data: PyBackedBytes) -> Result<crate::world::class::World> {
    let read = py.detach(|| caught(|| self::read(&data)))?;
    crate::world::class::World::of(py, read)
}

impl From<ArchiveError> for Error {
    fn from(error: ArchiveError) -> Error {
        Error::Archive(error)
    }
}
