"""Real-time dynamics for interactive and immersive environments.

SI units, radians, z up, right-handed axes; quaternions are (x, y, z, w); numpy arrays of float64 in and out.
"""

from tumble._errors import (
    BusyError,
    InternalError,
    InvalidValueError,
    MissingFileError,
    PictureError,
    RecordingError,
    RemovedError,
    SceneError,
    SnapshotError,
    StepError,
    TumbleError,
    UnknownNameError,
    UnreadableFileError,
)
from tumble._extension import Behavior, Force
from tumble._native import (
    Articulation,
    Bodies,
    Box,
    Capsule,
    Cylinder,
    HalfSpace,
    Mesh,
    Recorder,
    RigidBody,
    Shape,
    Sphere,
    SphereTree,
    StepReport,
    View,
    World,
    __version__,
)
from tumble._pictures import Camera, save_png
from tumble._recordings import Recording, read, replay
from tumble._values import Energy, Momentum, SphereLevel

__all__ = [
    "Articulation",
    "Behavior",
    "Bodies",
    "Box",
    "BusyError",
    "Camera",
    "Capsule",
    "Cylinder",
    "Energy",
    "Force",
    "HalfSpace",
    "InternalError",
    "InvalidValueError",
    "Mesh",
    "MissingFileError",
    "Momentum",
    "PictureError",
    "Recorder",
    "Recording",
    "RecordingError",
    "RemovedError",
    "RigidBody",
    "SceneError",
    "Shape",
    "SnapshotError",
    "Sphere",
    "SphereLevel",
    "SphereTree",
    "StepError",
    "StepReport",
    "TumbleError",
    "UnknownNameError",
    "UnreadableFileError",
    "View",
    "World",
    "__version__",
    "read",
    "replay",
    "save_png",
]
