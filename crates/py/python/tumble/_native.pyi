"""The compiled part of the package: what it takes and gives. The words about each are in its docstring."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, TypeAlias, final, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray
from typing_extensions import disjoint_base

from tumble._extension import Behavior, Force
from tumble._values import Energy, Momentum, SphereLevel
from tumble.typing import Axis, CollisionMeshes, Combine, Contacts, Integrator, MissingMeshes, Mode, Solver, Stepper, TreeMethod

_Floats: TypeAlias = NDArray[np.float64]
_Path: TypeAlias = str | PathLike[str]
_Body: TypeAlias = RigidBody | Articulation | str

__version__: str

__all__ = [
    "Articulation",
    "Bodies",
    "Box",
    "Capsule",
    "Cylinder",
    "HalfSpace",
    "Mesh",
    "Recorder",
    "RigidBody",
    "Shape",
    "Sphere",
    "SphereTree",
    "StepReport",
    "View",
    "World",
    "__version__",
    "read_recording",
    "_panic",
    "_unpickle_articulation",
    "_unpickle_shape",
    "_unpickle_tree",
    "_unpickle_world",
    "_choices",
]

@disjoint_base
class Shape:
    """A solid that bodies are made of. Made by ``Sphere``, ``Box``, ``Capsule``, ``Cylinder``, ``HalfSpace`` or ``Mesh``."""
    @property
    def volume(self) -> float:
        """Volume, m³; infinite for a half-space."""
    @property
    def bounding_radius(self) -> float:
        """Radius of a ball about the shape's origin that holds it, metres; infinite for a half-space."""

@final
class Sphere(Shape):
    """A ball. radius: metres."""
    def __new__(cls, radius: float) -> Sphere: ...

@final
class Box(Shape):
    """A block about its centre. size: full edge lengths along x, y and z, metres; one number is a cube."""
    def __new__(cls, size: ArrayLike) -> Box: ...

@final
class Capsule(Shape):
    """A capsule along z about its centre. radius: metres; length: of the straight part, without the caps, metres."""
    def __new__(cls, radius: float, length: float) -> Capsule: ...

@final
class Cylinder(Shape):
    """A cylinder along z about its centre. radius, length: metres."""
    def __new__(cls, radius: float, length: float) -> Cylinder: ...

@final
class HalfSpace(Shape):
    """All points x with ``normal · x <= offset``. normal: of any length above 0, points out of the solid; offset: metres along the unit normal.

    Only static and kinematic bodies can have it. The frame of such a body has its z axis along the normal and its origin on the plane.
    """
    def __new__(cls, normal: ArrayLike | None = (0.0, 0.0, 1.0), offset: float = 0.0) -> HalfSpace: ...

@final
class Mesh(Shape):
    """A closed mesh. A body of it has the frame that its vertices are given in: ``position`` is where their origin is.

    ``Mesh(vertices, faces)``: shapes (n, 3) in metres and (m, 3) of indices from 0, counter-clockwise seen from outside.
    ``Mesh(path)``: an OBJ, STL or COLLADA file in metres; ``scale`` multiplies its coordinates. An object with ``vertices`` and ``faces``
    (trimesh) is taken as such. What is open, or encloses nothing, is a ``ValueError`` that names the place.
    """
    def __new__(cls, vertices: Any, faces: ArrayLike | None = None, *, scale: float = 1.0) -> Mesh: ...
    @property
    def center_of_mass(self) -> _Floats:
        """The center of mass in the frame of the vertices, shape (3,), metres."""
    @property
    def vertices(self) -> _Floats:
        """The vertices after mending, to rounding as they were given, shape (n, 3), metres."""
    @property
    def faces(self) -> NDArray[np.uint32]:
        """The triangles, shape (m, 3), indices into ``vertices``."""

@final
class RigidBody:
    """A rigid body, or static geometry, of a world. Its frame is that of its shape, of a mesh that of its file; all vectors are in world axes.

    A handle: it holds no numbers of its own. After the body was removed every use raises ``RemovedError``.
    """
    @property
    def name(self) -> str:
        """Unique in its world."""
    @property
    def exists(self) -> bool:
        """Whether its world still has it."""
    @property
    def mass(self) -> float:
        """Mass, kg. Of static geometry it means nothing."""
    @property
    def inertia(self) -> _Floats:
        """Inertia about the centre of mass, body axes, shape (3, 3), kg·m²."""
    @property
    def position(self) -> _Floats:
        """Where the origin of its frame is, shape (3,), metres: the middle of a sphere, box, capsule or cylinder, the origin of a mesh's file. Setting it
        keeps the velocity.
        """
    @position.setter
    def position(self, value: ArrayLike) -> None: ...
    @property
    def center_of_mass(self) -> _Floats:
        """The center of mass in the body's frame, shape (3,), metres: zeros but for meshes."""
    @property
    def world_center_of_mass(self) -> _Floats:
        """The center of mass in the world, shape (3,), metres."""
    @property
    def orientation(self) -> _Floats:
        """Orientation, body to world, unit quaternion (x, y, z, w), shape (4,). Setting it turns the body about the origin of its frame and keeps
        the velocity.
        """
    @orientation.setter
    def orientation(self, value: ArrayLike) -> None: ...
    @property
    def velocity(self) -> _Floats:
        """Velocity of the centre of mass, shape (3,), m/s."""
    @velocity.setter
    def velocity(self, value: ArrayLike) -> None: ...
    @property
    def angular_velocity(self) -> _Floats:
        """Angular velocity, world axes, shape (3,), rad/s."""
    @angular_velocity.setter
    def angular_velocity(self, value: ArrayLike) -> None: ...
    @property
    def acceleration(self) -> _Floats:
        """Acceleration of the centre of mass at the last force evaluation, shape (3,), m/s²."""
    @property
    def mode(self) -> Mode:
        """``"dynamic"``, ``"kinematic"`` (follows the velocity it is given and pushes others) or ``"static"``."""
    @mode.setter
    def mode(self, value: Mode) -> None: ...
    @property
    def enabled(self) -> bool:
        """Whether it takes part in anything at all; its state stays while it does not."""
    @enabled.setter
    def enabled(self, value: bool) -> None: ...
    @property
    def asleep(self) -> bool:
        """Whether it sleeps: left out of the steps until something touches it (``World(sleep_after=…)``). What is done to it wakes it."""
    @property
    def collidable(self) -> bool:
        """Whether it meets others."""
    @collidable.setter
    def collidable(self, value: bool) -> None: ...
    @property
    def restitution(self) -> float:
        """Coefficient of restitution, 0 to 1."""
    @restitution.setter
    def restitution(self, value: float) -> None: ...
    @property
    def friction(self) -> float:
        """Coefficient of Coulomb friction, at least 0."""
    @friction.setter
    def friction(self, value: float) -> None: ...
    @property
    def color(self) -> _Floats:
        """Colour that it is drawn in, sRGB, shape (3,), each 0 to 1. Setting it takes a pattern off."""
    @color.setter
    def color(self, value: ArrayLike) -> None: ...
    @property
    def linear_damping(self) -> float:
        """Linear damping, 1/s: a force of ``-damping · momentum``."""
    @linear_damping.setter
    def linear_damping(self, value: float) -> None: ...
    @property
    def angular_damping(self) -> float:
        """Angular damping, 1/s: a torque of ``-damping · angular momentum``."""
    @angular_damping.setter
    def angular_damping(self, value: float) -> None: ...
    def apply_force(self, force: ArrayLike, point: ArrayLike | None = None) -> None:
        """A force during the next frame alone. force: shape (3,), N, world axes; point: where in the world it acts, metres (default: the centre of mass)."""
    def apply_torque(self, torque: ArrayLike) -> None:
        """A torque during the next frame alone. torque: shape (3,), N·m, world axes."""
    def apply_impulse(self, impulse: ArrayLike, point: ArrayLike | None = None) -> None:
        """An impulse, at once. impulse: shape (3,), N·s, world axes; point: where in the world it acts, metres (default: the centre of mass)."""
    def move_to(self, position: ArrayLike | None = None, orientation: ArrayLike | None = None) -> None:
        """Gives a kinematic body the velocity that brings its frame to a pose by the end of the next frame. What is not given stays as it is."""
    def to_world(self, point: ArrayLike | None = None) -> _Floats:
        """Position of a point of the body in the world. point: shape (3,), in the body's frame, metres (default: its origin)."""
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class Articulation:
    """A tree of links: a robot, a chain, a skeleton.

    ``Articulation.from_urdf`` gives a description, whose dynamics can be asked at once; ``World.add_articulation`` puts it into a world and gives a handle
    of the one there. ``q`` has ``nq`` numbers: one per hinge (rad) or slider (m), a quaternion (x, y, z, w) per ball joint, position and quaternion of
    a floating root. ``qd`` and ``tau`` have ``dof``: rad/s or m/s and N·m or N; of a floating root angular, then linear, world axes.

    All functions of ``q``, ``qd``, ``tau`` take one state or a batch of states, a leading axis: what has none stands for all of the batch. They know the
    tree alone: no limits, damping, drives or contacts.
    """
    @staticmethod
    def from_urdf(
        path: _Path,
        *,
        floating: bool = False,
        packages: Mapping[str, _Path] | None = None,
        missing_meshes: MissingMeshes = "error",
        collision_meshes: CollisionMeshes = "exact",
    ) -> Articulation:
        """Reads a URDF: its tree at once, its collision shapes when it is added to a world, the meshes of its visuals when somebody draws them.

        floating: whether the root floats, else it is fixed to the base; packages: folders by name, for ``package://NAME/…``; missing_meshes:
        ``"error"`` or ``"skip"``, for collision meshes that are not there; collision_meshes: ``"exact"`` or ``"hull"``.
        """
    @property
    def name(self) -> str:
        """The robot's name in its file, or the body's in its world."""
    @property
    def placed_in_world(self) -> bool:
        """Whether it is in a world."""
    @property
    def exists(self) -> bool:
        """Whether its world still has it; a description always exists."""
    @property
    def joint_names(self) -> list[str]:
        """Names of the moving joints, in the order of the coordinates."""
    @property
    def link_names(self) -> list[str]:
        """Names of all links, the fixed ones too, in the order of ``link_poses``."""
    @property
    def dof(self) -> int:
        """Length of ``qd`` and ``tau``: degrees of freedom."""
    @property
    def nq(self) -> int:
        """Length of ``q``."""
    @property
    def mass(self) -> float:
        """Mass of all that moves, kg."""
    @property
    def q(self) -> _Floats:
        """Positions, shape (nq,), rad and m."""
    @q.setter
    def q(self, value: ArrayLike) -> None: ...
    @property
    def qd(self) -> _Floats:
        """Velocities, shape (dof,), rad/s and m/s."""
    @qd.setter
    def qd(self, value: ArrayLike) -> None: ...
    @property
    def tau(self) -> _Floats:
        """Generalized forces, shape (dof,), N·m and N: they act in every step until they are set anew, beside drives and damping. ``save`` and forks take
        them along; ``World.state`` does not hold them.
        """
    @tau.setter
    def tau(self, value: ArrayLike) -> None: ...
    @property
    def gravity(self) -> _Floats:
        """Gravity that its functions count with, shape (3,), m/s². In a world it is the world's and set there."""
    @gravity.setter
    def gravity(self, value: ArrayLike) -> None: ...
    @property
    def limits(self) -> _Floats:
        """Least and greatest position of each freedom, shape (dof, 2), rad or m; infinite where there is no limit."""
    def forward_dynamics(
        self, q: ArrayLike | None = None, qd: ArrayLike | None = None, tau: ArrayLike | None = None
    ) -> _Floats:
        """Accelerations ``qdd`` that generalized forces ``tau`` cause. q: (nq,), qd, tau: (dof,), each also batched (batch, …); what is not given is
        what it is now. Returns (dof,) or (batch, dof).
        """
    def inverse_dynamics(
        self, q: ArrayLike | None = None, qd: ArrayLike | None = None, qdd: ArrayLike | None = None
    ) -> _Floats:
        """Generalized forces that accelerations ``qdd`` take, gravity included. q: (nq,), qd, qdd: (dof,), each also batched. Without ``qdd`` those that
        hold the motion unaccelerated. Returns (dof,) or (batch, dof).
        """
    def mass_matrix(self, q: ArrayLike | None = None) -> _Floats:
        """The mass matrix, shape (dof, dof) or (batch, dof, dof), symmetric."""
    def jacobian(self, link: str, q: ArrayLike | None = None) -> _Floats:
        """What velocities do to a link: shape (6, dof) or (batch, 6, dof). ``J @ qd`` is the angular velocity (first three rows) and the velocity of the
        origin of the link's frame (last three), world axes.
        """
    def link_poses(self, q: ArrayLike | None = None) -> _Floats:
        """Poses of all links in the world: shape (links, 7) or (batch, links, 7), in the order of ``link_names``: position, m, and quaternion
        (x, y, z, w).
        """
    def link_pose(self, link: str, q: ArrayLike | None = None) -> _Floats:
        """The pose of one link in the world: shape (7,) or (batch, 7), as in ``link_poses``."""
    def center_of_mass(self, q: ArrayLike | None = None) -> _Floats:
        """The centre of mass in the world, shape (3,) or (batch, 3), metres."""
    def set_drive(
        self,
        joint: str,
        *,
        target: float | None = None,
        velocity: float | None = None,
        stiffness: float = 0.0,
        damping: float = 0.0,
        max_force: float | None = None,
    ) -> None:
        """Puts a motor on a hinge or slider of one in a world, by the name of its joint.

        With ``stiffness`` or ``damping`` it drives to position ``target`` (rad or m) and ``velocity``; with neither it holds ``velocity``; with nothing
        given there is no motor. limit: greatest torque or force, N·m or N; None: none. Part of the body and no state: ``save`` leaves it out.
        """
    def apply_force(self, link: str, force: ArrayLike, point: ArrayLike | None = None) -> None:
        """A force on a link of one in a world, during the next step alone. force: shape (3,), N; point: where in the world it acts, metres (default: the
        origin of the link's frame). World axes.
        """
    def apply_torque(self, link: str, torque: ArrayLike) -> None:
        """A torque on a link, during the next step alone. torque: shape (3,), N·m, world axes."""
    def apply_impulse(self, link: str, impulse: ArrayLike, point: ArrayLike | None = None) -> None:
        """An impulse on a link, at once. impulse: shape (3,), N·s; point: as in ``apply_force``."""
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class Bodies:
    """The bodies of a world in the order in which they were added: a sequence that also takes names, ``world.bodies["ball"]``.

    It follows the world. Constraints and forces are no bodies and not in it.
    """
    def __len__(self) -> int: ...
    @overload
    def __getitem__(self, key: str, /) -> Any: ...
    @overload
    def __getitem__(self, key: int, /) -> Any: ...
    def __contains__(self, key: object, /) -> bool: ...
    def __iter__(self) -> Iterator[Any]: ...
    def names(self) -> list[str]:
        """Their names, in order."""

@final
class StepReport:
    """What one frame took and how well it went; see ``World.report``."""
    @property
    def substeps(self) -> int:
        """Committed sub-steps."""
    @property
    def tries(self) -> int:
        """``backtracking``: integrations tried, committed ones included."""
    @property
    def inner_steps(self) -> int:
        """``backtracking`` with ``dormand_prince``: inner steps, refused ones included."""
    @property
    def floor_hits(self) -> int:
        """``backtracking``: sub-steps at the floor, where a crossing was accepted and projected out."""
    @property
    def contacts(self) -> int:
        """Contacts at the last sub-step."""
    @property
    def impact_passes(self) -> int:
        """Passes of the impact phase."""
    @property
    def residual(self) -> float:
        """Largest residual of any solve, m/s."""
    @property
    def unconverged(self) -> int:
        """Solves that did not reach the solver's own aim."""
    @property
    def rays(self) -> int:
        """Solves that ended on a secondary ray."""
    @property
    def iterations(self) -> int:
        """Iterations of the largest solve."""
    @property
    def asleep(self) -> int:
        """Objects asleep at its end."""
    @property
    def max_penetration(self) -> float:
        """Deepest penetration found, metres."""
    @property
    def unreachable_joint(self) -> str | None:
        """Name of the joint that was furthest open where it cannot be closed; None where all could."""
    @property
    def unreachable_distance(self) -> float:
        """How far that joint is open, metres."""

@final
class SphereTree:
    """Nested balls around a closed mesh: every ball holds the balls of its children, and the balls of each level cover the surface.

    Made by ``SphereTree.build`` or ``SphereTree.load``. All numbers are in the axes of the mesh as it was given, metres.
    """
    @staticmethod
    def build(
        vertices: Any,
        faces: ArrayLike | None = None,
        *,
        method: TreeMethod = "medial",
        branching: int | None = None,
        depth: int | None = None,
        max_error: float | None = None,
        cache: bool = True,
    ) -> SphereTree:
        """Builds a tree around a closed mesh, and checks that it covers the surface and is nested.

        vertices: shape (n, 3), metres, and faces: shape (m, 3), indices from 0, counter-clockwise seen from outside; or the path of an OBJ, STL or
        COLLADA file; or an object with ``vertices`` and ``faces``, such as a trimesh. method: ``"medial"`` (adaptive medial axis, the tightest),
        ``"hubbard"``, ``"grid"`` or ``"octree"``; branching: most children of a ball, 2 to 64 (default 8); depth: most levels below the root, 1 to 9
        (default 3, of the octree 7); max_error: no ball that reaches less than this outside is divided, as a part of the mesh's diagonal, 1e-4 to 1
        (default 1e-4, of the octree 0.01); cache: keep the tree on disk and take it from there next time.

        A mesh that is open or encloses nothing, and settings out of range, are ``InvalidValueError``. The interpreter is let go meanwhile; Ctrl-C ends the build.
        """
    @staticmethod
    def load(path: _Path) -> SphereTree:
        """Reads a tree that ``save`` or ``tumble spheretree --output`` wrote. What is no tree is an ``InvalidValueError`` that says what is wrong."""
    def save(self, path: _Path) -> None:
        """Writes the tree and its figures as JSON: the file of ``tumble spheretree --output``."""
    def to_json(self) -> str:
        """The same as a string."""
    @property
    def name(self) -> str:
        """Name of the mesh: that of its file, or ``"mesh"``."""
    @property
    def method(self) -> TreeMethod:
        """How it was built."""
    @property
    def branching(self) -> int:
        """Most children of a ball that were allowed."""
    @property
    def depth(self) -> int:
        """Most levels below the root that were allowed."""
    @property
    def levels(self) -> tuple[SphereLevel, ...]:
        """The levels, the root's first: each a ``SphereLevel`` of ``centers``, shape (n, 3), and ``radii``, shape (n,), metres. Every level stands for the
        solid by itself: a leaf above the last level is repeated in the levels below.
        """
    @property
    def parents(self) -> tuple[NDArray[np.int64], ...]:
        """For each level, of each ball the index of its parent in the level above, shape (n,); -1 for the root."""
    @property
    def outward_error(self) -> float:
        """How far the balls of the last level reach outside the solid at most, metres: a bound that is proved, not sampled."""
    @property
    def quality(self) -> dict[str, NDArray[Any]]:
        """The figures of the levels, measured by samples: a dict of arrays with a number per level. Lengths are parts of the mesh's diagonal.

        ``level``, ``spheres``; ``coverage``: share of the surface inside the balls; ``protrusion_mean``, ``protrusion_p95``, ``protrusion_max``: how far the
        balls' surface is outside the solid; ``gap_mean``, ``gap_max``: how far bare surface is from the balls; ``volume_ratio``: volume of the
        balls over that of the solid; ``nesting_broken``: balls that stick out of their parents.
        """
    def report(self, verbose: bool = False) -> str:
        """The figures as the table that ``tumble spheretree`` prints; verbose: with more columns and what the builder's stages did."""
    def __len__(self) -> int: ...

@final
class View:
    """The world as a force or a behavior sees it while it is called: a row for every rigid body and every link, in world axes.

    The arrays are copies of that moment and read-only, but ``force`` and ``torque``, which begin at zero and take what the callback adds. After the
    callback has returned the view raises ``RemovedError``.
    """
    @property
    def time(self) -> float:
        """Simulated time of this evaluation, s: within a step it may lie anywhere in it."""
    @property
    def gravity(self) -> _Floats:
        """Gravity, shape (3,), m/s²."""
    @property
    def position(self) -> _Floats:
        """Positions of the centres of mass, shape (n, 3), m."""
    @property
    def orientation(self) -> _Floats:
        """Orientations, body to world, unit quaternions (x, y, z, w), shape (n, 4)."""
    @property
    def velocity(self) -> _Floats:
        """Velocities of the same points, shape (n, 3), m/s."""
    @property
    def angular_velocity(self) -> _Floats:
        """Angular velocities, shape (n, 3), rad/s."""
    @property
    def acceleration(self) -> _Floats:
        """Accelerations of the same points when forces were last evaluated, shape (n, 3), m/s²."""
    @property
    def angular_acceleration(self) -> _Floats:
        """Angular accelerations at the same time, shape (n, 3), rad/s²."""
    @property
    def mass(self) -> _Floats:
        """Masses, shape (n,), kg; 0 of static geometry and of bases."""
    @property
    def moves(self) -> NDArray[np.bool_]:
        """Whether forces move it: neither static nor kinematic, and enabled. Shape (n,), bool."""
    @property
    def names(self) -> list[str]:
        """Of each row the name of its body."""
    @property
    def force(self) -> _Floats:
        """Forces at the centres of mass, which ``position`` tells, shape (n, 3), N, world axes: add to it."""
    @force.setter
    def force(self, value: ArrayLike) -> None: ...
    @property
    def torque(self) -> _Floats:
        """Torques, shape (n, 3), N·m, world axes: add to it."""
    @torque.setter
    def torque(self, value: ArrayLike) -> None: ...
    def row(self, body: _Body, part: int | str | None = None) -> int:
        """The row of a rigid body, given by name or as a handle; of an articulated body that of a link, given by name, or the one of its rows with the number
        ``part``. A link that is fixed to another has the row of that one.
        """
    def rows(self, body: _Body) -> slice:
        """The rows of a body as a slice: one of a rigid body; of an articulated body one of each moving link, parents first, and at last one of its base."""
    def apply_force(self, row: int, force: ArrayLike, point: ArrayLike) -> None:
        """Adds a force, shape (3,), N, that acts on a row at a point of the world, shape (3,), m: with the torque ``(point - position) × force``."""
    def __len__(self) -> int: ...

@final
class Recorder:
    """Writes an MCAP file that Foxglove and ``tumble.read`` open: ``with tumble.Recorder("run.mcap") as recorder: recorder.frame(world)``.

    The file begins with the first frame. A program that is killed leaves a file that is readable up to the last quarter of a simulated second.
    """
    def __new__(cls, path: _Path) -> Recorder: ...
    def frame(self, world: World) -> None:
        """Adds the world as it is: what is drawn, all poses, and the state. Frames must come in the order of time, each once."""
    def run(self, world: World, n: int, *, every: int = 1) -> None:
        """Steps the world ``n`` times and adds it after every ``every`` steps; before the first step too where nothing is recorded yet."""
    def close(self) -> None:
        """Ends the file: index and checksums. Later calls do nothing. A recording without a frame leaves no file."""
    @property
    def frames(self) -> int:
        """Frames added so far."""
    @property
    def path(self) -> Path:
        """The file."""
    def __enter__(self) -> Recorder: ...
    def __exit__(self, _kind: Any, _error: Any, _trace: Any, /) -> None: ...

def read_recording(path: _Path) -> dict[str, Any]:
    """All of a recording, as the arguments of `Recording`."""

@final
class World:
    """A world of bodies that moves in steps of ``dt`` seconds. SI units, radians, z up; quaternions are (x, y, z, w).

    gravity: shape (3,), m/s²; dt: length of a step, s; stepper: ``"time_stepping"`` or ``"backtracking"``; integrator: ``"verlet"``,
    ``"symplectic_euler"``, ``"explicit_euler"``, ``"rk4"`` or ``"dormand_prince"``; solver: ``"gauss_seidel"``, ``"lcp_pyramid"`` or
    ``"lcp_sliding"``: the words of scene files, with their defaults. integrator: acts in ``"backtracking"`` (``"time_stepping"`` has its own midpoint rule); substeps: parts of each step; iterations: sweeps of the solver at most;
    contact_tolerance: metres; integrator_tolerance: of ``dormand_prince``. sleep_after: seconds after which islands that have moved by less than
    sleep_within (metres) are left out of the steps until something touches them; None: never. combine_restitution, combine_friction: what the
    coefficients of two bodies make for the pair, ``"min"``, ``"max"``, ``"average"``, ``"product"`` or ``"geometric_mean"``.

    One thread at a time: while one steps a world, calls on it from another raise ``BusyError``. The interpreter is let go while a world steps.
    """
    def __new__(
        cls,
        gravity: ArrayLike | None = (0.0, 0.0, -9.81),
        dt: float = 0.004166666666666667,
        stepper: Stepper = "time_stepping",
        integrator: Integrator = "verlet",
        solver: Solver = "gauss_seidel",
        *,
        substeps: int = 1,
        iterations: int = 200,
        contact_tolerance: float = 1e-7,
        integrator_tolerance: float = 1e-6,
        sleep_after: float | None = None,
        sleep_within: float = 1e-5,
        combine_restitution: Combine = "max",
        combine_friction: Combine = "geometric_mean",
    ) -> World: ...
    @staticmethod
    def load(
        path_or_name: _Path,
        *,
        dt: float | None = None,
        stepper: Stepper | None = None,
        integrator: Integrator | None = None,
        solver: Solver | None = None,
    ) -> World:
        """The world of a scene: the path of a ``scene.toml`` or of its folder, or the name of a shipped scene.

        What is given beside it stands instead of what the file says. A file that is not there, or an unknown name, is a ``MissingFileError``
        (a ``FileNotFoundError``); a file with problems a ``SceneError`` (a ``ValueError``) that tells all of them with line and column.
        """
    @staticmethod
    def parse(text: str) -> World:
        """The world of a scene that is given as the text of its file."""
    @property
    def notes(self) -> list[str]:
        """What is to be said of the world: a list of sentences.

        Of the files of a scene and of articulations that were added, such as what was mended in a mesh or that a convex hull collides; of visual meshes
        that could not be read, once something has drawn them; of bodies that overlap at the start, the deepest eight by name. Overlaps are looked for when
        this is asked before the first step.
        """
    def step(self, n: int = 1) -> None:
        """Advances by ``n`` steps of ``dt``. The interpreter is let go meanwhile; Ctrl-C ends it between two steps.

        On a ``StepError`` the world is as it was before the step that failed; the steps before that stand.
        """
    @property
    def time(self) -> float:
        """Simulated time, s."""
    @property
    def frame(self) -> int:
        """Steps taken since the world was made."""
    @property
    def dt(self) -> float:
        """Length of a step, s."""
    @dt.setter
    def dt(self, value: float) -> None: ...
    @property
    def gravity(self) -> _Floats:
        """Gravity, shape (3,), m/s²."""
    @gravity.setter
    def gravity(self, value: ArrayLike) -> None: ...
    @property
    def combine_restitution(self) -> Combine:
        """Rule by which the restitution of two bodies in contact combines: ``"min"``, ``"max"``, ``"average"``, ``"product"`` or ``"geometric_mean"``."""
    @combine_restitution.setter
    def combine_restitution(self, value: Combine) -> None: ...
    @property
    def combine_friction(self) -> Combine:
        """The same for friction."""
    @combine_friction.setter
    def combine_friction(self, value: Combine) -> None: ...
    def set_pair_material(
        self, a: _Body | str, b: _Body | str, *, restitution: float | None = None, friction: float | None = None
    ) -> None:
        """Restitution and friction that contacts of two bodies have from the next step on, in place of what the rules make of their materials.

        a, b: handles or names in any order; a link of an articulation, with the links that are fixed to it, is ``"ARTICULATION/LINK"``. What is None goes by
        the rule; with neither given the pair is as any other again. Forks have the same pairs; like materials they are not in ``save``.
        """
    def pair_material(self, a: _Body | str, b: _Body | str) -> tuple[float, float]:
        """Restitution and friction that contacts of two bodies have: by the pair's own constants where it has them, else by the rules.

        a, b: as in ``set_pair_material``. Of an articulation the first shape answers.
        """
    @property
    def stepper(self) -> Stepper:
        """Name of the stepper."""
    @property
    def solver(self) -> Solver:
        """Name of the solver of contacts."""
    @property
    def integrator(self) -> Integrator:
        """Name of the integrator."""
    @property
    def bodies(self) -> Bodies:
        """All bodies, in the order in which they were added; by number or by name."""
    def body(self, name: str) -> RigidBody:
        """The rigid body, or static geometry, of that name. An articulation, or a name that no body has, is an ``UnknownNameError``."""
    def articulation(self, name: str) -> Articulation:
        """The articulated body of that name. A rigid body, or a name that no body has, is an ``UnknownNameError``."""
    def __getitem__(self, name: str, /) -> Any: ...
    @property
    def contacts(self) -> NDArray[np.void]:
        """The contacts of the last step: a structured array with one row each.

        Fields: ``bodies`` (2,) numbers in ``world.bodies``, -1 for what is none; ``parts`` (2,) of articulated bodies the places of the links in their ``link_names``; ``point`` (3,), m; ``normal`` (3,),
        unit, from the second body to the first; ``depth``, m, negative while apart; ``velocity`` (3,) of the first against the second before the
        contact was solved, m/s; ``impulse`` (3,) on the first over the last sub-step, N·s; ``force`` (3,), N, without impacts. World axes.
        """
    def energy(self) -> Energy:
        """Mechanical energy of everything that moves: ``kinetic``, ``potential`` (zero at the world's origin) and ``total``, J."""
    def momentum(self) -> Momentum:
        """Momentum of everything that moves: ``linear`` (3,), N·s, and ``angular`` (3,) about the world's origin, N·m·s. World axes."""
    @property
    def report(self) -> StepReport:
        """What the last step took and how well it went."""
    def save(self) -> bytes:
        """All that the next step reads, as bytes: for ``restore`` in a world of the same bodies. Shapes, masses, settings and drives are not in it."""
    def restore(self, snapshot: bytes | bytearray) -> None:
        """Goes back to what ``save`` gave. Bytes that are none, or of another world, are a ``SnapshotError`` and change nothing."""
    def fork(self) -> World:
        """An independent copy: same state, same future.

        Forces and behaviors are copied by their own ``fork``.
        """
    def __copy__(self) -> World: ...
    def __deepcopy__(self, _memo: Any) -> World: ...
    def rollout(
        self,
        controls: ArrayLike,
        *,
        articulations: Any = None,
        states: ArrayLike | None = None,
        every: int = 1,
        threads: int | None = None,
    ) -> _Floats:
        """The futures of many forks, each under forces of its own, on all cores with the interpreter let go. This world stays as it is.

        controls: shape (forks, steps, n): generalized forces of each step, N·m and N, for all ``articulations`` one after the other (by default all of the
        world, in order; with none of them n is 0); states: where the forks start, shape (len(state),) or (forks, len(state)), by default where the world
        is; every: every how many steps the state is kept; threads: at most so many (default: all cores). Returns the states, shape
        (forks, steps // every, len(state)): the same bits on any number of threads. A fork that fails raises ``StepError`` and says which; Ctrl-C ends all of them between two steps.
        """
    @property
    def state(self) -> _Floats:
        """The flat state, shape (n,): a read-only view of the world's own memory, until bodies are added or removed; then it keeps what it showed last.

        A rigid body has 13 numbers: position of the center of mass (``body.world_center_of_mass``), quaternion (x, y, z, w), linear and angular momentum; an articulated body its ``q`` and ``qd``. Nothing
        is copied, neither here nor by steps. While a view is held, a step holds the interpreter but for other threads' turns between two frames.
        Setting it writes every body's numbers.
        """
    @state.setter
    def state(self, value: ArrayLike) -> None: ...
    def add_rigid(
        self,
        name: str,
        shape: Shape,
        mass: float | None = None,
        density: float | None = None,
        position: ArrayLike | None = None,
        orientation: ArrayLike | None = None,
        velocity: ArrayLike | None = None,
        angular_velocity: ArrayLike | None = None,
        restitution: float = 0.0,
        friction: float = 0.5,
        *,
        linear_damping: float = 0.0,
        angular_damping: float = 0.0,
        kinematic: bool = False,
        collidable: bool = True,
        contacts: Contacts = "surface",
    ) -> RigidBody:
        """Adds a body that moves.

        mass: kg, or density: kg/m³, one of the two; position: of the shape's frame, the file's for a mesh, metres; orientation: unit quaternion (x, y, z, w); velocity,
        m/s, and angular_velocity, rad/s, world axes; restitution: 0 to 1; friction: at least 0; kinematic: follows the velocity it is given.
        contacts: by its ``"surface"``, or as in the thesis by the ``"spheres"`` of its tree; a pair goes by spheres if either asks for it.
        """
    def add_static(
        self,
        name: str,
        shape: Shape,
        position: ArrayLike | None = None,
        orientation: ArrayLike | None = None,
        restitution: float = 0.0,
        friction: float = 0.5,
        *,
        collidable: bool = True,
        contacts: Contacts = "surface",
    ) -> RigidBody:
        """Adds geometry that never moves. position, orientation, restitution, friction, contacts: as in ``add_rigid``."""
    def add_articulation(
        self, articulation: Articulation | _Path, base: ArrayLike | None = None, *, name: str | None = None
    ) -> Articulation:
        """Adds an articulated body, and gives the handle of it.

        articulation: a description, or the path of a URDF; base: where its base stands: a position (3,), or position and quaternion (7,), metres and
        (x, y, z, w); name: by default the description's. It starts with the ``q``, ``qd`` and ``tau`` of the description; where a floating root is, is
        said from the base.
        """
    def remove(self, body: RigidBody | Articulation | str) -> None:
        """Removes a body, given as a handle or by name, or a force or behavior by name. Handles of a body raise ``RemovedError`` from then on."""
    def add_force(self, name: str, force: Force) -> None:
        """Adds a force of your own: an object of a subclass of ``tumble.Force``. Its name is unique among bodies, forces and behaviors."""
    def add_behavior(self, name: str, behavior: Behavior, bodies: _Body | Iterable[_Body]) -> None:
        """Adds a behavior of your own, an object of a subclass of ``tumble.Behavior``, to bodies given by name or as handles."""
    @property
    def forces(self) -> dict[str, Force]:
        """Forces of your own by name: a new dict."""
    @property
    def behaviors(self) -> dict[str, Behavior]:
        """Behaviors of your own by name: a new dict."""
    def render(
        self,
        width: int | None = None,
        height: int | None = None,
        *,
        camera: Sequence[Any] | None = None,
        facet: str | None = None,
        cave: str | None = None,
        overlays: str | None = None,
    ) -> NDArray[np.uint8]:
        """A picture of the world as it is: sRGB and alpha, shape (height, width, 4), uint8, rows from the top. Needs no window.

        width, height: pixels, 640 x 480 unless told otherwise. From one of: camera, ``tumble.Camera`` or ``(eye, target)`` in metres; facet,
        ``"cube4:front"``: a facet of a cave, given by path or name, at the size that the cave says; cave: all its facets unfolded into at most
        width x height; else the scene's camera, or one that shows everything. overlays: words of ``tumble run --debug-draw``, such as
        ``"contacts,forces"``. Without a graphics adapter ``PictureError``.
        """
    def _repr_png_(self) -> bytes | None:
        """How a notebook shows the world: a PNG, or nothing where there is no graphics adapter."""
    def plot_energy(self, duration: float = 5.0, *, ax: Any = None) -> Any:
        """Steps a fork for ``duration`` seconds and plots its energy over time; the world stays as it is. Needs matplotlib, the extra ``plot``.

        ax: the axes to plot on, by default new ones. Returns the axes.
        """
    def plot_paths(
        self, duration: float = 5.0, *, bodies: _Body | Iterable[_Body] | None = None, along: Axis = "y", ax: Any = None
    ) -> Any:
        """Steps a fork for ``duration`` seconds and plots the paths of bodies (default: all that move) as seen along an axis, ``"x"``, ``"y"`` or ``"z"``.

        As ``plot_energy`` otherwise.
        """

def _panic(world: World, while_: str) -> None:
    """Panics within a call on a world: while it is ``"read"``, ``"changed"`` or ``"stepped"``."""
def _choices() -> dict[str, list[str]]:
    """Every set of words by the name of its type in ``tumble.typing``, in the library's order."""
def _unpickle_articulation(
    file: Path, floating: bool, packages: Mapping[str, Path], words: Sequence[str], numbers: Sequence[Sequence[float]]
) -> Articulation:
    """What a pickled description becomes: its file is read anew."""
def _unpickle_shape(data: bytes) -> Shape:
    """What a pickled shape becomes: an object of its class."""
def _unpickle_tree(data: bytes) -> SphereTree:
    """What a pickled sphere tree becomes."""
def _unpickle_world(data: bytes) -> World:
    """What a pickled world becomes; pickle then puts its forces and behaviors back."""
