//! Conversion of errors to Python: the text comes from Rust, the class is one of `tumble._errors`.

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyType;
use std::collections::BTreeMap;
use std::io::ErrorKind;
use tumble::behaviors::BehaviorError;
use tumble::collide::{MeshError, ShapeError};
use tumble::dynamics::{
    ArchiveError, ArticulatedError, ArticulationError, BodyError, LinearizeError, LoopJointError, MimicError,
    ModelError, SensorError, SettingsError, SnapshotError, StepError, WorldError,
};
use tumble::net::record::RecordError;
use tumble::render::RenderError;
use tumble::scene::cave::CaveError;
use tumble::scene::mjcf::MjcfError;
use tumble::scene::sdformat::SdformatError;
use tumble::scene::urdf::UrdfError;
use tumble::scene::{BuildError, SceneError, UnknownName};

/// Any error that a call from Python can end with.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    #[error(transparent)]
    World(#[from] WorldError),
    #[error(transparent)]
    Body(#[from] BodyError),
    #[error(transparent)]
    Settings(#[from] SettingsError),
    #[error(transparent)]
    Shape(#[from] ShapeError),
    #[error(transparent)]
    Mesh(#[from] MeshError),
    #[error(transparent)]
    Articulated(#[from] ArticulatedError),
    #[error(transparent)]
    Articulation(#[from] ArticulationError),
    #[error(transparent)]
    Joint(#[from] LoopJointError),
    #[error(transparent)]
    Mimic(#[from] MimicError),
    #[error(transparent)]
    Sensor(#[from] SensorError),
    #[error(transparent)]
    Behavior(#[from] BehaviorError),
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error(transparent)]
    Build(#[from] BuildError),
    #[error(transparent)]
    Urdf(#[from] UrdfError),
    #[error(transparent)]
    Mjcf(#[from] MjcfError),
    #[error(transparent)]
    Sdformat(#[from] SdformatError),
    #[error(transparent)]
    Cave(#[from] CaveError),
    #[error(transparent)]
    Render(#[from] RenderError),
    #[error(transparent)]
    Record(#[from] RecordError),
    #[error(transparent)]
    Choice(#[from] UnknownName),
    #[error(transparent)]
    Snapshot(#[from] SnapshotError),
    /// The bytes are not a pickled world or shape.
    #[error(transparent)]
    Archive(ArchiveError),
    #[error(transparent)]
    Linearize(#[from] LinearizeError),
    #[error(transparent)]
    Step(#[from] StepError),
    /// A step failed in one of many forks.
    #[error("fork {fork}, frame {frame}: {source}")]
    Fork { fork: usize, frame: usize, source: Box<Error> },
    /// A step failed in worlds of a batch; the first of them.
    #[error("world {world}: {source}{}", others(*.failed, *.count))]
    Member { world: usize, failed: usize, count: usize, source: Box<Error> },
    /// A file that the binding reads itself.
    #[error("{file}: {source}")]
    File { file: String, source: std::io::Error },
    /// An invalid value, and the expected value.
    #[error("{0}")]
    Value(String),
    /// An unknown name, and the known ones.
    #[error("{0}")]
    Name(String),
    #[error("{0}")]
    Removed(String),
    #[error(
        "the world is being stepped by another thread; wait until that step returns, or give each thread a fork of its own"
    )]
    Busy,
    #[error(
        "the world is being stepped, and this call comes from within that step; a force or behavior must use its view"
    )]
    Within,
    /// Work that was ended early. The caller raises the reason.
    #[error("the work was stopped")]
    Stopped,
    /// A panic that was caught.
    #[error("an error inside tumble: {0}; please report it")]
    Internal(String),
    #[error(
        "an error inside tumble stopped this world in the middle of a call; make a new one, or continue from a fork or a snapshot in another world"
    )]
    Broken,
    /// An exception raised by Python.
    #[error(transparent)]
    Python(#[from] PyErr),
}

/// The result of every call.
pub type Result<T, E = Error> = std::result::Result<T, E>;

impl Error {
    /// Returns a value error.
    pub fn value(text: impl Into<String>) -> Error {
        Error::Value(text.into())
    }

    /// Returns the name of its class in `tumble._errors`.
    fn class(&self) -> &'static str {
        match self {
            Error::World(WorldError::Stale) | Error::Removed(_) => "RemovedError",
            Error::Behavior(BehaviorError::NoFlock | BehaviorError::World(WorldError::Stale)) => "RemovedError",
            Error::Scene(SceneError::Unknown { .. }) => "MissingFileError",
            Error::Scene(SceneError::Read { source, .. }) => of_file(source),
            Error::Scene(SceneError::Mjcf(error)) => match error.as_ref() {
                MjcfError::Read { source, .. } => of_file(source),
                _ => "SceneError",
            },
            Error::Urdf(UrdfError::Read { source, .. }) => of_file(source),
            Error::Mjcf(MjcfError::Read { source, .. }) => of_file(source),
            Error::Sdformat(SdformatError::Read { source, .. })
            | Error::Scene(SceneError::Sdformat(SdformatError::Read { source, .. })) => of_file(source),
            Error::Build(BuildError::MeshFile { source, .. }) => of_file(source),
            Error::File { source, .. } => of_file(source),
            Error::Record(RecordError::Io { source, .. }) => of_file(source),
            Error::Cave(CaveError::Read { source, .. }) => of_file(source),
            Error::Cave(CaveError::Unknown { .. }) => "MissingFileError",
            Error::Cave(CaveError::NoFacet { .. }) => "UnknownNameError",
            Error::Cave(_) => "SceneError",
            Error::Render(RenderError::NoAdapter { .. } | RenderError::Device { .. }) => "PictureError",
            Error::Record(RecordError::Input { .. }) => "InvalidValueError",
            Error::Record(_) => "RecordingError",
            Error::Build(BuildError::World { .. }) => "InvalidValueError",
            Error::Scene(_) | Error::Build(_) | Error::Urdf(_) | Error::Mjcf(_) | Error::Sdformat(_) => "SceneError",
            Error::Snapshot(_) | Error::Archive(_) => "SnapshotError",
            Error::Step(_) | Error::Linearize(LinearizeError::Step(_)) => "StepError",
            Error::Fork { source, .. } | Error::Member { source, .. } => source.class(),
            Error::Name(_) => "UnknownNameError",
            Error::Busy | Error::Within => "BusyError",
            Error::Internal(_) | Error::Broken | Error::Stopped => "InternalError",
            _ => "InvalidValueError",
        }
    }
}

fn of_file(error: &std::io::Error) -> &'static str {
    if error.kind() == ErrorKind::NotFound { "MissingFileError" } else { "UnreadableFileError" }
}

impl From<Error> for PyErr {
    fn from(error: Error) -> PyErr {
        let error = match error {
            Error::Python(error) => return error,
            Error::Fork { fork, frame, source } if matches!(*source, Error::Python(_)) => {
                return noted(PyErr::from(*source), format!("in fork {fork}, frame {frame}"));
            }
            Error::Member { world, source, .. } if matches!(*source, Error::Python(_)) => {
                return noted(PyErr::from(*source), format!("in world {world} of the batch"));
            }
            error => error,
        };
        Python::attach(|py| match class(py, error.class()) {
            Ok(class) => PyErr::from_type(class, (error.to_string(),)),
            Err(_) => PyRuntimeError::new_err(error.to_string()),
        })
    }
}

/// Adds a note about the place to an exception (Python 3.11 and later).
fn noted(error: PyErr, place: String) -> PyErr {
    Python::attach(|py| _ = error.value(py).call_method1("add_note", (place,)));
    error
}

/// Returns what is said about the other worlds that failed.
fn others(failed: usize, count: usize) -> String {
    if failed > 1 { format!(" ({failed} of {count} worlds failed)") } else { String::new() }
}

/// Returns a class of `tumble._errors`, imported once.
fn class<'py>(py: Python<'py>, name: &'static str) -> PyResult<Bound<'py, PyType>> {
    static CLASSES: PyOnceLock<BTreeMap<String, Py<PyType>>> = PyOnceLock::new();
    let classes = CLASSES.get_or_try_init(py, || {
        let module = py.import("tumble._errors")?;
        let classes = module
            .dict()
            .iter()
            .filter_map(|(name, class)| Some((name.extract().ok()?, class.cast_into::<PyType>().ok()?.unbind())));
        PyResult::Ok(classes.collect())
    })?;
    classes.get(name).map(|class| class.bind(py).clone()).ok_or_else(|| PyRuntimeError::new_err(name))
}

/// Runs `call` and converts a panic to [`Error::Internal`] with its text.
pub fn caught<T>(call: impl FnOnce() -> Result<T>) -> Result<T> {
    std::panic::catch_unwind(std::panic::AssertUnwindSafe(call)).unwrap_or_else(|panic| {
        let text =
            panic.downcast_ref::<&str>().map(|s| s.to_string()).or_else(|| panic.downcast_ref::<String>().cloned());
        Err(Error::Internal(text.unwrap_or_else(|| "a panic without a message".into())))
    })
}
