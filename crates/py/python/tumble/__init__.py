"""Real-time dynamics for interactive and immersive environments.

SI units, radians, z up, right-handed axes; quaternions are (x, y, z, w); numpy arrays of float64 in and out.
"""

from tumble._errors import (
    BusyError,
    InternalError,
    InvalidValueError,
    MissingFileError,
    RemovedError,
    SceneError,
    SnapshotError,
    StepError,
    TumbleError,
    UnknownNameError,
    UnreadableFileError,
)
from tumble._native import (
    Articulation,
    Bodies,
    Box,
    Capsule,
    Cylinder,
    HalfSpace,
    Mesh,
    RigidBody,
    Shape,
    Sphere,
    SphereTree,
    StepReport,
    World,
    __version__,
)
from tumble._values import Energy, Momentum, SphereLevel

__all__ = [
    "Articulation",
    "Bodies",
    "Box",
    "BusyError",
    "Capsule",
    "Cylinder",
    "Energy",
    "HalfSpace",
    "InternalError",
    "InvalidValueError",
    "Mesh",
    "MissingFileError",
    "Momentum",
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
    "World",
    "__version__",
]
