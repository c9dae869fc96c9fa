"""The compiled part of the package: what it takes and gives. The words about each are in its docstring."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, Literal, TypeAlias, final, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray
from typing_extensions import Self, disjoint_base

from tumble._animations import Animation
from tumble._extension import Behavior, Force, Intersect
from tumble._pictures import Appearance
from tumble._values import Energy, Event, Firing, LinkSpheres, Momentum, SphereLevel
from tumble._window import Window
from tumble.typing import Axis, CollisionMeshes, Combine, Contacts, Integrator, JointKind, JointType, LockedAxis, MissingMeshes, Mode, SensorKind, Solver, Stepper, TreeMethod

_Floats: TypeAlias = NDArray[np.float64]
_Path: TypeAlias = str | PathLike[str]
_Body: TypeAlias = RigidBody | Articulation | str
_BodyOrLink: TypeAlias = RigidBody | Articulation | Link | str | tuple[Articulation | str, str]
_Object: TypeAlias = (
    RigidBody | Articulation | Link | Joint | SpringMesh | ParticleSystem | Flock | BodyFlock | Boid | ScriptedEvent | Template | str | tuple[Articulation | str, str]
)
_Several: TypeAlias = _Object | list[_Object]
_Side: TypeAlias = _BodyOrLink | None

__version__: str

__all__ = [
    "Action",
    "Articulation",
    "ArticulationBuilder",
    "Batch",
    "Bodies",
    "BodyFlock",
    "Boid",
    "Box",
    "Capsule",
    "Compound",
    "Cone",
    "ConvexHull",
    "Cylinder",
    "Ellipsoid",
    "Emitter",
    "Field",
    "Flock",
    "HalfSpace",
    "HeightField",
    "Joint",
    "JointDof",
    "LinearizedStep",
    "Link",
    "Mesh",
    "Mimic",
    "OpenMesh",
    "Panel",
    "ParticleSystem",
    "Policy",
    "Recorder",
    "RigidBody",
    "ScriptedEvent",
    "Sdf",
    "Sensor",
    "Sensors",
    "Shape",
    "Soundtrack",
    "Sphere",
    "SphereRobot",
    "SphereTree",
    "SpringMesh",
    "StepReport",
    "Template",
    "Terrain",
    "Trigger",
    "View",
    "World",
    "_WindowFeed",
    "__version__",
    "_choices",
    "_panic",
    "_show_window",
    "_unpickle_articulation",
    "_unpickle_batch",
    "_unpickle_built_articulation",
    "_unpickle_linearized_step",
    "_unpickle_shape",
    "_unpickle_step_report",
    "_unpickle_tree",
    "_unpickle_world",
    "read_recording",
    "show_contacts",
    "simulate",
]

@disjoint_base
class Shape:
    """A collision shape. The classes ``Sphere``, ``Box``, ``Capsule``, ``Cylinder``, ``Ellipsoid``,
    ``Cone``, ``HalfSpace``, ``Mesh``, ``ConvexHull``, ``HeightField``, ``Terrain``, ``OpenMesh`` and ``Compound``
    make one.
    """
    @property
    def volume(self) -> float:
        """Volume, m³; infinite for a half-space."""
    @property
    def bounding_radius(self) -> float:
        """Radius of the smallest sphere about the shape's origin that contains it, meters; infinite
        for a half-space.
        """
    @property
    def name(self) -> str | None:
        """The name that ``named`` gave it, or None."""
    def named(self, name: str) -> Self:
        """Returns the same shape with a name, by which contacts, hits and events report it.

        The shapes of one body, or of one link, must have different names. A ``Compound`` has no name: its parts have.
        """

@final
class Sphere(Shape):
    """A sphere. radius: meters."""
    def __new__(cls, radius: float) -> Sphere: ...

@final
class Box(Shape):
    """A box about its center. size: full edge lengths along x, y and z, meters, shape (3,); one number is a cube. ``Box(0.4, 0.2, 0.1)``
    is the same as ``Box((0.4, 0.2, 0.1))``.
    rounding: radius of edges and corners, meters, below half the shortest edge; the faces stay.
    """
    def __new__(cls, size: ArrayLike, y: float | None = None, z: float | None = None, *, rounding: float = 0.0) -> Box: ...

@final
class Capsule(Shape):
    """A capsule along z about its center. radius: meters; length: of the straight part, without the
    caps, meters.
    """
    def __new__(cls, radius: float, length: float) -> Capsule: ...

@final
class Compound(Shape):
    """Several shapes of one body.

    parts: tuples ``(shape, position)``, ``(shape, position, orientation)`` or ``(shape, position,
    orientation, density)``: position of the shape's origin, meters; orientation: quaternion
    (x, y, z, w) or None; density: kg/m³, for all parts or for none. A part has the name of its shape: ``shape.named``. A body made without mass and
    density has these densities. Parts may overlap; mass and volume of an overlap then count for
    each. The frame of its body is that of the positions.
    """
    def __new__(cls, parts: Sequence[tuple[Any, ...]]) -> Compound: ...
    @property
    def center_of_mass(self) -> _Floats:
        """The center of mass in the frame of the parts, shape (3,), meters."""

@final
class Cylinder(Shape):
    """A cylinder along z about its center. radius, length: meters; rounding: radius of the rims, meters,
    below the radius and half the length.
    """
    def __new__(cls, radius: float, length: float, *, rounding: float = 0.0) -> Cylinder: ...

@final
class Ellipsoid(Shape):
    """An ellipsoid about its center. size: full axes along x, y and z, meters, shape (3,), or three numbers one by one; one number is a
    sphere.
    """
    def __new__(cls, size: ArrayLike, y: float | None = None, z: float | None = None) -> Ellipsoid: ...

@final
class Cone(Shape):
    """A cone along z with its tip up, about its center of mass, a quarter of the height above the base.
    radius: of the base, meters; height: meters.
    """
    def __new__(cls, radius: float, height: float) -> Cone: ...

@final
class HalfSpace(Shape):
    """All points x with ``normal · x <= offset``. normal: of any length above 0, points out of the
    solid; offset: meters along the unit normal.

    Only static and kinematic bodies can have it. The frame of such a body has its z axis along the
    normal and its origin on the plane.
    """
    def __new__(cls, normal: ArrayLike | None = (0.0, 0.0, 1.0), offset: float = 0.0) -> HalfSpace: ...

class Mesh(Shape):
    """A closed mesh. The frame of its body is that of its vertices, so ``position`` is the position of
    their origin.

    ``Mesh(vertices, faces)``: shapes (n, 3) in meters and (m, 3) of indices from 0,
    counter-clockwise seen from outside. ``Mesh(path)``: an OBJ, STL or COLLADA file in meters;
    ``scale`` multiplies its coordinates. Also takes an object with ``vertices`` and ``faces``, such
    as a trimesh. A mesh that is open or encloses nothing is a ``ValueError`` that names the place.
    """
    def __new__(cls, vertices: Any, faces: ArrayLike | None = None, *, scale: float = 1.0) -> Mesh: ...
    @property
    def center_of_mass(self) -> _Floats:
        """The center of mass in the frame of the vertices, shape (3,), meters."""
    @property
    def vertices(self) -> _Floats:
        """The vertices after repair, equal to the given ones up to rounding, shape (n, 3), meters."""
    @property
    def faces(self) -> NDArray[np.uint32]:
        """The triangles, shape (m, 3), indices into ``vertices``."""

@final
class ConvexHull(Mesh):
    """The convex hull of points, a ``Mesh``. points: shape (n, 3), meters; an object with ``vertices``
    and ``faces``; or the path of an OBJ, STL, PLY or COLLADA file, which need not be closed.
    ``scale`` multiplies the coordinates. The frame of its body is that of the points.

    At least 4 points, not all in one plane. A point is outside by at most half a millionth of the
    longest side.
    """
    def __new__(cls, points: Any, *, scale: float = 1.0) -> ConvexHull: ...

@final
class HeightField(Mesh):
    """The solid under a grid of heights, a ``Mesh``; for static bodies. heights: shape (rows, columns),
    meters, with rows along x, from the smallest y to the largest; or the path of a gray PNG, whose
    upper edge has the largest y, or of a text with a row in each line. size: of the grid along x and
    y, meters; its center is the origin of the body. thickness: distance of the bottom from the
    lowest height, meters; None: a tenth of the longer side. height_range: heights of black and white
    in a PNG, meters, by default (0, 1); an error for other heights.
    """
    def __new__(
        cls,
        heights: ArrayLike | _Path,
        size: ArrayLike,
        thickness: float | None = None,
        *,
        height_range: ArrayLike | None = (0.0, 1.0),
    ) -> HeightField: ...

@final
class Terrain(Mesh):
    """The solid below an open surface, a ``Mesh``; for static bodies. Takes what ``Mesh`` takes; all
    faces must look up, or all down. thickness: distance that the solid reaches straight down,
    meters; None: a tenth of the longer horizontal side. It is below the surface whichever way the faces look; the
    solid of an ``OpenMesh`` is behind them, and its thickness is measured across them.
    """
    def __new__(
        cls,
        vertices: Any,
        faces: ArrayLike | None = None,
        thickness: float | None = None,
        *,
        scale: float = 1.0,
    ) -> Terrain: ...

@final
class OpenMesh(Mesh):
    """The solid behind an open surface of any form, a ``Mesh``; for static bodies: rooms, walls, tunnels. Takes what
    ``Mesh`` takes; faces look to the free side, counter-clockwise seen from there. thickness: distance that the
    solid reaches behind them, meters; None: a hundredth of the diagonal. centered: whether it reaches half as far
    to both sides instead. ``Terrain`` reaches straight down instead, whichever way the faces look.
    """
    def __new__(
        cls,
        vertices: Any,
        faces: ArrayLike | None = None,
        thickness: float | None = None,
        *,
        centered: bool = False,
        scale: float = 1.0,
    ) -> OpenMesh: ...

@final
class Sdf(Mesh):
    """The solid in which signed distances on a grid are negative, a ``Mesh`` of the surface by marching tetrahedra.
    values: shape (nx, ny, nz), ``values[i, j, k]`` at x, y and z, as ``numpy.meshgrid(indexing="ij")`` makes them;
    or the path of a NumPy file (.npy). low, high: the first and the last grid point, shape (3,), meters, in the
    frame of the body. The grid must surround the solid.
    """
    def __new__(cls, values: ArrayLike | _Path, low: ArrayLike, high: ArrayLike) -> Sdf: ...

@final
class RigidBody:
    """A rigid body, or static geometry, of a world. Its frame is that of its shape, for a mesh that of
    its file. All vectors are in world axes.

    A handle without data of its own. After the body was removed every use raises ``RemovedError``.
    """
    @property
    def name(self) -> str:
        """Name, unique in its world."""
    @property
    def exists(self) -> bool:
        """Whether its world still has it."""
    @property
    def mass(self) -> float:
        """Mass, kg, above 0. Meaningless for static geometry. Setting it keeps the velocity and changes
        the inertia by the same factor.
        """
    @mass.setter
    def mass(self, value: float) -> None: ...
    @property
    def inertia(self) -> _Floats:
        """Inertia about the center of mass, body axes, shape (3, 3), kg·m². Setting it, also by three
        moments, keeps the velocities.
        """
    @inertia.setter
    def inertia(self, value: ArrayLike) -> None: ...
    @property
    def position(self) -> _Floats:
        """Position of the origin of its frame, shape (3,), meters: the center of a sphere, box,
        capsule or cylinder, the origin of a mesh's file. Setting it keeps the velocity.
        """
    @position.setter
    def position(self, value: ArrayLike) -> None: ...
    @property
    def center_of_mass(self) -> _Floats:
        """The center of mass in the body's frame, shape (3,), meters: zero except for meshes, unless it
        is set. Setting it keeps the motion of the body; the inertia is then about the new center.
        """
    @center_of_mass.setter
    def center_of_mass(self, value: ArrayLike) -> None: ...
    @property
    def world_center_of_mass(self) -> _Floats:
        """The center of mass in the world, shape (3,), meters."""
    @property
    def orientation(self) -> _Floats:
        """Orientation, body to world, unit quaternion (x, y, z, w), shape (4,). Setting it rotates the
        body about the origin of its frame and keeps the velocity.
        """
    @orientation.setter
    def orientation(self, value: ArrayLike) -> None: ...
    @property
    def velocity(self) -> _Floats:
        """Velocity of the center of mass, shape (3,), m/s. That of a static body is zero, and another one is an error."""
    @velocity.setter
    def velocity(self, value: ArrayLike) -> None: ...
    @property
    def angular_velocity(self) -> _Floats:
        """Angular velocity, world axes, shape (3,), rad/s. That of a static body is zero, and another one is an error."""
    @angular_velocity.setter
    def angular_velocity(self, value: ArrayLike) -> None: ...
    @property
    def acceleration(self) -> _Floats:
        """Acceleration of the center of mass at the last force evaluation, shape (3,), m/s²."""
    @property
    def mode(self) -> Mode:
        """``"dynamic"``, ``"kinematic"`` (moves at its prescribed velocity and pushes dynamic bodies)
        or ``"static"``.
        """
    @mode.setter
    def mode(self, value: Mode) -> None: ...
    @property
    def enabled(self) -> bool:
        """Whether it takes part in the simulation. A disabled object keeps its state and has no effect: an event does not
        fire, a sensor is not read. A joint that broke is disabled; setting True mends it.
        """
    @enabled.setter
    def enabled(self, value: bool) -> None: ...
    @property
    def asleep(self) -> bool:
        """Whether it sleeps: the steps leave it out until something touches it
        (``World(sleep_after=…)``). Any change wakes it.
        """
    @property
    def collidable(self) -> bool:
        """Whether it collides."""
    @collidable.setter
    def collidable(self, value: bool) -> None: ...
    @property
    def group(self) -> int:
        """Collision group, 0 to 63. Two bodies collide if the group of each is in the mask of the other."""
    @group.setter
    def group(self, value: int) -> None: ...
    @property
    def mask(self) -> int:
        """Groups that it collides with, one bit each. May be set to a sequence of groups, or None for
        all.
        """
    @mask.setter
    def mask(self, value: int | Sequence[int] | None) -> None: ...
    @property
    def sensor(self) -> bool:
        """Whether it is a sensor: it has no contacts, and ``world.events`` reports the bodies that overlap
        it at the end of a step.
        """
    @sensor.setter
    def sensor(self, value: bool) -> None: ...
    @property
    def touching(self) -> list[RigidBody | Articulation]:
        """The bodies in contact with it after the last step, or in it if it is a sensor: a list of
        handles in the order of ``world.bodies``.
        """
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
    def surface_velocity(self) -> _Floats:
        """Velocity of the surface over the body, frame of the shape, shape (3,), m/s: a conveyor belt. Friction
        acts against the velocity of other bodies over the surface. Zero by default.
        """
    @surface_velocity.setter
    def surface_velocity(self, value: ArrayLike) -> None: ...
    @property
    def static_friction(self) -> float:
        """Coefficient of friction of surfaces at rest on each other, if larger than ``friction``; 0 for none."""
    @static_friction.setter
    def static_friction(self, value: float) -> None: ...
    @property
    def stribeck_speed(self) -> float:
        """Sliding speed, m/s, at which friction has fallen from ``static_friction`` towards ``friction`` by
        63 %: the coefficient at speed v is ``friction + (static_friction - friction) * exp(-(v / stribeck_speed)**2)``.
        """
    @stribeck_speed.setter
    def stribeck_speed(self, value: float) -> None: ...
    @property
    def friction_scale(self) -> _Floats:
        """Factors of ``friction`` along the axes of the shape's frame, shape (3,), 1e-3 to 1e3: a surface with
        a grain. All 1 by default.
        """
    @friction_scale.setter
    def friction_scale(self, value: ArrayLike) -> None: ...
    @property
    def rolling_friction(self) -> float:
        """Moment of rolling friction per normal force, m, at least 0. The larger of a pair counts."""
    @rolling_friction.setter
    def rolling_friction(self, value: float) -> None: ...
    @property
    def torsional_friction(self) -> float:
        """Moment of torsional friction per normal force, m, at least 0, about the normal of a contact that
        does not slide: two thirds of friction times the radius of a patch under uniform pressure. The
        larger of a pair counts.
        """
    @torsional_friction.setter
    def torsional_friction(self, value: float) -> None: ...
    @property
    def tangential_restitution(self) -> float:
        """Tangential velocity of the contact point after an impact as a fraction of the reverse of that
        before, 0 to 1, as far as friction permits: 1 for a superball. The larger of a pair counts.
        """
    @tangential_restitution.setter
    def tangential_restitution(self, value: float) -> None: ...
    @property
    def adhesion(self) -> float:
        """Force with which surfaces in contact attract each other, N, at least 0. The larger of a pair counts."""
    @adhesion.setter
    def adhesion(self, value: float) -> None: ...
    @property
    def shape_names(self) -> list[str | None]:
        """Names of its shapes by the numbers that contacts and hits report, the parts of a ``Compound``; None for those
        without one.
        """
    def shape_number(self, name: str) -> int:
        """Returns the number of the shape of that name."""
    def shape_material(self, shape: int | str) -> dict[str, Any]:
        """Returns the surface constants of one shape: a dict by the names of ``set_shape_material``.

        shape: name, or index of the part of a ``Compound``, as ``shapes`` of contacts has it.
        """
    def shape_filter(self, shape: int | str) -> dict[str, Any]:
        """Returns what one shape collides with: a dict by the names of ``set_shape_filter``, with the mask as the bits of an integer.

        shape: name, or index of the part of a ``Compound``, as ``shapes`` of contacts has it.
        """
    def set_shape_filter(
        self, shape: int | str, *, group: int | None = None, mask: int | Sequence[int] | None = None, sensor: bool | None = None
    ) -> None:
        """Sets collision group, mask and sensor of one shape, the part of a ``Compound``, by the names of the properties of the body. A sensor has
        no contacts; ``events`` reports the bodies that overlap it, with its number.

        shape: name or index of the part. What is not given stays as it is, for a shape without its own as the body has it at
        this time. Without any, the shape is as the body again.
        """
    def set_shape_material(
        self,
        shape: int | str,
        *,
        friction: float | None = None,
        restitution: float | None = None,
        static_friction: float | None = None,
        stribeck_speed: float | None = None,
        friction_scale: ArrayLike | None = None,
        rolling_friction: float | None = None,
        torsional_friction: float | None = None,
        tangential_restitution: float | None = None,
        adhesion: float | None = None,
        surface_velocity: ArrayLike | None = None,
    ) -> None:
        """Sets surface constants of one shape, the part of a ``Compound``, by the names of the properties of the body.

        shape: name or index of the part. Constants that are not given stay as they are, for a shape without its own those of
        the body at this time. Without any, the shape has those of the body again.
        """
    @property
    def color(self) -> _Floats:
        """Color, sRGB, shape (3,), each 0 to 1. Setting it gives the body that of a ``tumble.Appearance`` without anything else."""
    @color.setter
    def color(self, value: ArrayLike) -> None: ...
    @property
    def appearance(self) -> Appearance:
        """The look of its surface, a ``tumble.Appearance``. It has no effect on motion."""
    @appearance.setter
    def appearance(self, value: Appearance) -> None: ...
    def attach_camera(
        self,
        position: ArrayLike | None = (0.0, 0.0, 0.0),
        forward: ArrayLike | None = (1.0, 0.0, 0.0),
        up: ArrayLike | None = (0.0, 0.0, 1.0),
        *,
        fov_deg: float = 40.0,
        near: float = 0.05,
        far: float = 500.0,
    ) -> None:
        """Attaches a camera, at most one, that moves with the body or link and that scenes keep. position: shape (3,), m; forward,
        up: directions, shape (3,), not parallel; all in the frame of the shape of a body, or of the link. fov_deg: vertical
        field of view, degrees, 1 to 170. near, far: depths between which it sees, m.
        """
    def attach_light(
        self,
        kind: Literal["point", "directional"] = "point",
        *,
        position: ArrayLike | None = None,
        direction: ArrayLike | None = None,
        color: ArrayLike | None = None,
        intensity: float = 1.0,
        radius: float = 0.1,
        casts_shadow: bool | None = None,
    ) -> None:
        """Attaches a light, at most one, which scenes keep. kind: ``"point"``, with position, shape (3,), m, and radius, m, or
        ``"directional"``, along direction, shape (3,); both in the frame of the shape of a body, or of the link. color: sRGB,
        shape (3,). intensity: at least 0; a directional light of 1 makes a white wall that faces it white, a point light at
        1 m. casts_shadow: by default of directional lights.
        """
    @property
    def camera(self) -> dict[str, Any] | None:
        """The camera that it carries, as a dict of the arguments of ``attach_camera``, or None. Setting a dict replaces it, or attaches
        one; arguments that the dict lacks have their defaults. Setting None removes it. A link and the links fixed to it
        have one between them.
        """
    @camera.setter
    def camera(self, value: dict[str, Any] | None) -> None: ...
    @property
    def light(self) -> dict[str, Any] | None:
        """The light that it carries, as a dict of the arguments of ``attach_light``, or None. Setting a dict replaces it, or attaches
        one; arguments that the dict lacks have their defaults. Setting None removes it. A link and the links fixed to it
        have one between them.
        """
    @light.setter
    def light(self, value: dict[str, Any] | None) -> None: ...
    @property
    def gravity_scale(self) -> float:
        """Factor of the world's gravity, 1 by default."""
    @gravity_scale.setter
    def gravity_scale(self, value: float) -> None: ...
    @property
    def one_way(self) -> _Floats | None:
        """Direction, shape (3,), frame of the shape, any length above 0, of a body that collides on one side only, such as
        open terrain or a one-way platform: with what comes against it. What comes from the other side passes. None for
        a body that collides on all sides.
        """
    @one_way.setter
    def one_way(self, value: ArrayLike | None) -> None: ...
    @property
    def locked(self) -> tuple[LockedAxis, ...]:
        """Locked axes of the world: a tuple of ``"x"``, ``"y"``, ``"z"`` (the center of mass does not move
        along them), ``"rotation_x"``, ``"rotation_y"``, ``"rotation_z"`` (the body does not turn about
        them). Setting it takes one name or several, and clears the velocity along
        these axes.
        """
    @locked.setter
    def locked(self, value: LockedAxis | Sequence[LockedAxis]) -> None: ...
    @property
    def linear_damping(self) -> float:
        """Linear damping, 1/s, at least 0: a force of ``-damping · momentum``. Without other forces the
        velocity decays by ``exp(-damping · t)``.
        """
    @linear_damping.setter
    def linear_damping(self, value: float) -> None: ...
    @property
    def angular_damping(self) -> float:
        """Angular damping, 1/s, at least 0: a torque of ``-damping · angular momentum``."""
    @angular_damping.setter
    def angular_damping(self, value: float) -> None: ...
    def apply_force(self, force: ArrayLike, point: ArrayLike | None = None) -> None:
        """Applies a force during the next step only. force: shape (3,), N, world axes; point: where it
        acts in the world, meters (default: the center of mass).
        """
    def apply_torque(self, torque: ArrayLike) -> None:
        """Applies a torque during the next step only. torque: shape (3,), N·m, world axes."""
    def apply_impulse(self, impulse: ArrayLike, point: ArrayLike | None = None) -> None:
        """Applies an impulse at once. impulse: shape (3,), N·s, world axes; point: where it acts in
        the world, meters (default: the center of mass).
        """
    def move_to(self, position: ArrayLike | None = None, orientation: ArrayLike | None = None) -> None:
        """Sets the velocity of a kinematic body such that its frame reaches a pose at the end of the
        next step. An omitted argument keeps its present value. An error for a dynamic or static body, which
        ``position`` and ``orientation`` place.
        """
    def to_world(self, point: ArrayLike | None = None) -> _Floats:
        """Returns the position of a point of the body in the world. point: shape (3,), in the body's
        frame, meters (default: its origin).
        """
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class Mimic:
    """A coupling of two joints, made by ``World.add_mimic`` or ``[[mimic]]``: the position of one is ``multiplier`` times that
    of the other, plus ``offset``.
    """
    @property
    def name(self) -> str:
        """Name, unique in its world."""
    @property
    def exists(self) -> bool:
        """Whether its world still has it."""
    @property
    def joint(self) -> Joint | tuple[Articulation, str] | None:
        """The joint that follows: a ``Joint``, or (articulation, link); None if it was removed."""
    @property
    def of(self) -> Joint | tuple[Articulation, str] | None:
        """The joint that it follows: a ``Joint``, or (articulation, link); None if it was removed."""
    @property
    def enabled(self) -> bool:
        """Whether it takes part in the simulation. A disabled object keeps its state and has no effect: an event does not
        fire, a sensor is not read. A joint that broke is disabled; setting True mends it.
        """
    @enabled.setter
    def enabled(self, value: bool) -> None: ...
    @property
    def multiplier(self) -> float:
        """Ratio of the positions, not 0."""
    @multiplier.setter
    def multiplier(self, value: float) -> None: ...
    @property
    def offset(self) -> float:
        """Position of the joint that follows while the other is at 0, rad or m."""
    @offset.setter
    def offset(self, value: float) -> None: ...
    @property
    def force(self) -> float:
        """Force of the coupling along the position of the joint that follows in the last sub-step, N·m or N; on the other
        joint acts ``-multiplier`` times as much.
        """
    @property
    def error(self) -> float:
        """Position of the joint that follows less that which it should have, rad or m; NaN while it does not act."""
    def __hash__(self) -> int: ...

@final
class Sensor:
    """A measuring sensor, made by ``World.add_sensor`` or ``[[sensor]]``."""
    @property
    def name(self) -> str:
        """Name, unique in its world."""
    @property
    def enabled(self) -> bool:
        """Whether it takes part in the simulation. A disabled object keeps its state and has no effect: an event does not
        fire, a sensor is not read. A joint that broke is disabled; setting True mends it.
        """
    @enabled.setter
    def enabled(self, value: bool) -> None: ...
    @property
    def exists(self) -> bool:
        """Whether its world still has it."""
    @property
    def kind(self) -> SensorKind:
        """Quantity that it reads."""
    @property
    def value(self) -> NDArray[Any]:
        """Reading at the end of the last step, with its errors: 3 numbers, or 1 or 4 for some kinds, or the present image of a camera. Raises ``RemovedError`` if
        the sensor or its body was removed.
        """
    def seed(self, seed: int) -> None:
        """Starts its noise anew from a seed, a whole number of at most 64 bits. The reading and the bias stay."""
    def __hash__(self) -> int: ...

@final
class Sensors:
    """The readings of all measuring sensors of a world by name, in the order of their addition: a mapping to arrays."""
    def __getitem__(self, key: str, /) -> NDArray[Any]: ...
    def __contains__(self, key: object, /) -> bool: ...
    def __len__(self) -> int: ...
    def __iter__(self) -> Iterator[str]: ...
    def keys(self) -> list[str]:
        """Names of all sensors."""
    def values(self) -> list[NDArray[Any]]:
        """Readings of all sensors."""
    def items(self) -> list[tuple[str, NDArray[Any]]]:
        """Names and readings of all sensors."""
    def handle(self, name: str) -> Sensor:
        """The handle of a sensor, for its kind and its seed."""
    def record(self) -> np.void:
        """All readings but images as one value of a structured dtype, with a field of each sensor's name: ``record["imu"]``."""

@final
class SpringMesh:
    """A cloth or a jelly of a world: point masses, the nodes, joined by springs. Node ``i + nx·(j + ny·k)`` is
    number ``i`` along x, ``j`` along y and ``k`` along z.

    A handle without data of its own, made by ``World.add_cloth`` and ``World.add_jelly``.
    """
    @property
    def name(self) -> str:
        """Name, unique in its world."""
    @property
    def enabled(self) -> bool:
        """Whether it takes part in the simulation. A disabled object keeps its state and has no effect: an event does not
        fire, a sensor is not read. A joint that broke is disabled; setting True mends it.
        """
    @enabled.setter
    def enabled(self, value: bool) -> None: ...
    @property
    def exists(self) -> bool:
        """Whether its world still has it."""
    @property
    def positions(self) -> _Floats:
        """Positions of the nodes, shape (n, 3), m."""
    @property
    def velocities(self) -> _Floats:
        """Velocities of the nodes, shape (n, 3), m/s."""
    @property
    def masses(self) -> _Floats:
        """Masses of the nodes, shape (n,), kg."""
    @property
    def pinned(self) -> NDArray[np.bool_]:
        """Which nodes are pinned, shape (n,)."""
    @property
    def triangles(self) -> NDArray[np.uint32]:
        """Triangles of its surface, shape (m, 3): numbers of nodes."""
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class Emitter:
    """A source of particles: a burst at its start, and a stream from then on.

    position: shape (3,), m. orientation: unit quaternion (x, y, z, w) that turns z to the axis of its cone. body: the
    handle or name of the body that carries it, whose frame position and orientation are in; None for the world. part:
    of that body. radius: of a sphere around the position in which particles begin, m. speed, m/s, and lifetime, s: one
    number, or the least and the greatest. half_angle: half the angle of the cone, rad, π for all directions. burst:
    particles at the start. rate: particles per second. start, end: of the stream, s; end None for never.
    """
    def __new__(
        cls,
        position: ArrayLike | None = None,
        *,
        orientation: ArrayLike | None = None,
        body: _Body | None = None,
        part: int = 0,
        radius: float = 0.0,
        speed: float | ArrayLike | None = None,
        half_angle: float = 3.141592653589793,
        lifetime: float | ArrayLike | None = None,
        burst: int = 0,
        rate: float = 0.0,
        start: float = 0.0,
        end: float | None = None,
    ) -> Emitter: ...

@final
class ParticleSystem:
    """A system of particles of a world: points that fly, collide with bodies one way or two ways, and end.

    A handle without data of its own, made by ``World.add_particles``. The arrays have one row for each particle that
    lives, in the order of their places.
    """
    @property
    def name(self) -> str:
        """Name, unique in its world."""
    @property
    def enabled(self) -> bool:
        """Whether it takes part in the simulation. A disabled object keeps its state and has no effect: an event does not
        fire, a sensor is not read. A joint that broke is disabled; setting True mends it.
        """
    @enabled.setter
    def enabled(self, value: bool) -> None: ...
    @property
    def exists(self) -> bool:
        """Whether its world still has it."""
    @property
    def capacity(self) -> int:
        """Most particles that live at once."""
    @property
    def positions(self) -> _Floats:
        """Positions, shape (n, 3), m."""
    @property
    def velocities(self) -> _Floats:
        """Velocities, shape (n, 3), m/s."""
    @property
    def lives(self) -> _Floats:
        """Times that are left, shape (n,), s."""
    @property
    def lifetimes(self) -> _Floats:
        """Times from birth to end, shape (n,), s."""
    @property
    def serials(self) -> NDArray[np.uint64]:
        """Numbers in the order of birth, shape (n,)."""
    def spawn(self, position: ArrayLike, velocity: ArrayLike | None = None, life: float = 1.0) -> int | None:
        """Adds a particle between two steps. position: m, velocity: m/s, shape (3,); life: s, above 0. Returns its number;
        None if all places are taken.
        """
    def __len__(self) -> int: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class Flock:
    """A flock of a world: boids that keep together, and the forces on them.

    A handle without data of its own, made by ``World.add_flock``.
    """
    @property
    def name(self) -> str:
        """Name, unique in its world."""
    @property
    def enabled(self) -> bool:
        """Whether it takes part in the simulation. A disabled object keeps its state and has no effect: an event does not
        fire, a sensor is not read. A joint that broke is disabled; setting True mends it.
        """
    @enabled.setter
    def enabled(self, value: bool) -> None: ...
    @property
    def exists(self) -> bool:
        """Whether its world still has it."""
    @property
    def boids(self) -> list[Boid]:
        """Its boids, in the order in which they were added: a list of ``Boid``."""
    @property
    def steering(self) -> dict[str, Any]:
        """The constants of its forces by name, as in ``World.add_flock``. Setting it changes those that are given, from the
        next step on.
        """
    @steering.setter
    def steering(self, value: dict[str, Any]) -> None: ...
    def add(
        self,
        name: str = "",
        position: ArrayLike | None = None,
        velocity: ArrayLike | None = None,
        *,
        mass: float = 1.0,
        radius: float = 0.2,
        bank_time: float = 1.0,
        roll_time: float = 0.2,
        color: ArrayLike | None = None,
    ) -> Boid:
        """Adds a boid, also in flight, and returns its handle. name: unique; by default the world makes one. position: m,
        velocity: m/s, shape (3,). mass: kg. radius: of the sphere with which it collides, m. bank_time: seconds of its
        rate of turn that are a quarter turn of bank; roll_time: time constant of the roll, s. color: sRGB, each 0 to 1.
        """
    def remove(self, boid: Boid | str) -> None:
        """Removes a boid, given as a handle or by name, from the flock and from the world."""
    def __len__(self) -> int: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class BodyFlock:
    """A flock of rigid and articulated bodies of a world: the forces of a flock on their centers of mass, and torques that turn the nose (x)
    of each, or of its first link, along its velocity and bank it into turns.

    A handle without data of its own, made by ``World.add_body_flock``.
    """
    def __len__(self) -> int: ...
    def add(self, body: _Body) -> None:
        """Adds a rigid body of the world, or an articulation whose first link floats, given as a handle or by name. Gravity acts beside
        the flock: a rigid body that no wings carry has ``gravity_scale=0``.
        """
    def remove(self, body: _Body) -> None:
        """Removes a body, given as a handle or by name, from the flock. It stays in the world."""
    @property
    def enabled(self) -> bool:
        """Whether it takes part in the simulation. A disabled object keeps its state and has no effect: an event does not
        fire, a sensor is not read. A joint that broke is disabled; setting True mends it.
        """
    @enabled.setter
    def enabled(self, value: bool) -> None: ...
    @property
    def exists(self) -> bool:
        """Whether its world still has it."""
    @property
    def steering(self) -> dict[str, Any]:
        """The constants of its forces and of its helm by name, as in ``World.add_body_flock``. Setting it changes those that are given, from
        the next step on.
        """
    @steering.setter
    def steering(self, value: dict[str, Any]) -> None: ...
    @property
    def name(self) -> str:
        """Name, unique in its world."""
    @property
    def bodies(self) -> list[RigidBody | Articulation]:
        """Its bodies, in the order in which they were added."""
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class Trigger:
    """The cause that makes an event of ``World.add_event`` fire; made by one of its static methods.

    Bodies are handles or names; a template stands for all its bodies. Where several are accepted, a list of them is.
    """
    @staticmethod
    def time(at: float) -> Trigger:
        """Once, at the end of the first frame that reaches a time. at: s."""
    @staticmethod
    def every(period: float, *, first: float | None = None) -> Trigger:
        """Again and again. period: s. first: time of the first firing, s, by default the period."""
    @staticmethod
    def contact(a: _Several, b: _Several | None = None, *, impulse: float = 0.0) -> Trigger:
        """A body of a and one of b come into contact; without b any body counts. With an impulse, N·s, above 0: whenever the impulse between
        two parts in a frame reaches it, in a lasting contact too. The body of b is the *other* one of the event.
        """
    @staticmethod
    def touching(a: _Several, b: _Several | None = None) -> Trigger:
        """A body of a and one of b are in contact, in every step after the one in which they came into contact; not while they sleep."""
    @staticmethod
    def parting(a: _Several, b: _Several | None = None) -> Trigger:
        """A body of a and one of b part."""
    @staticmethod
    def enters(sensor: _Object, bodies: _Several | None = None) -> Trigger:
        """A body enters a sensor (``sensor=True`` of ``add_rigid`` and ``add_static``); without bodies any one counts. It is the *other* body of the event."""
    @staticmethod
    def leaves(sensor: _Object, bodies: _Several | None = None) -> Trigger:
        """A body leaves a sensor."""
    @staticmethod
    def asleep(bodies: _Several | None = None) -> Trigger:
        """A body falls asleep; without bodies any one counts. It is the *other* body of the event."""
    @staticmethod
    def awake(bodies: _Several | None = None) -> Trigger:
        """A body wakes in a step, not between two steps; without bodies any one counts. It is the *other* body of the event."""
    @staticmethod
    def broken(joint: _Object) -> Trigger:
        """A joint of ``World.add_joint`` breaks."""
    @staticmethod
    def key(key: str) -> Trigger:
        """A user presses a key in a window or in a cave, or a program calls ``World.press``."""
    @staticmethod
    def after(event: _Object) -> Trigger:
        """An event that was added before fires. The *other* body is that of it."""

@final
class Action:
    """A deed of an event of ``World.add_event``; made by one of its static methods.

    Objects are handles or names; a link is ``"ARTICULATION/LINK"``. Instead of a body, ``"other"`` is the body that made the event fire: the
    visitor of a sensor, or the second side of a contact. SI units and world axes. An action on an object that was removed does nothing.
    """
    @staticmethod
    def spawn(template: _Object, position: ArrayLike | None = None, orientation: ArrayLike | None = None, velocity: ArrayLike | None = None, angular_velocity: ArrayLike | None = None, *, source: _Object | None = None) -> Action:
        """Spawns a body of a template at a pose with a velocity of its center of mass, m/s, and an angular velocity, rad/s. source: a body that
        throws it: all of them are relative to it and to its motion.
        """
    @staticmethod
    def push(body: _Object, impulse: ArrayLike, *, point: ArrayLike | None = None) -> Action:
        """An impulse at once, N·s, shape (3,). point: of the frame of the body, m, by default its center of mass."""
    @staticmethod
    def force(body: _Object, force: ArrayLike | None = None, torque: ArrayLike | None = None, *, duration: float) -> Action:
        """A constant force at the center of mass, N, and a torque, N·m, for a duration, s."""
    @staticmethod
    def set_velocity(body: _Object, velocity: ArrayLike | None = None, angular_velocity: ArrayLike | None = None) -> Action:
        """Sets the velocity of a rigid body, m/s, and its angular velocity, rad/s."""
    @staticmethod
    def remove(body: _Object) -> Action:
        """Disables a body. A body of a template can be spawned again."""
    @staticmethod
    def enable(object: _Object) -> Action:
        """Enables a body, a joint or an event."""
    @staticmethod
    def disable(object: _Object) -> Action:
        """Disables a body, a joint or an event."""
    @staticmethod
    def attach(joint: _Object, *, here: bool = False) -> Action:
        """Enables a joint of ``World.add_joint``. here: joins its sides where they are at that moment."""
    @staticmethod
    def detach(joint: _Object) -> Action:
        """Disables a joint."""
    @staticmethod
    def recolor(body: _Object, color: ArrayLike) -> Action:
        """Gives a body another color, sRGB, each 0 to 1."""
    @staticmethod
    def move_along(body: _Object, times: ArrayLike, positions: ArrayLike, orientations: ArrayLike | None = None, *, smoothness: Literal["c1", "c2"] = "c2", ends: Literal["rest", "free", "loop"] = "rest") -> Action:
        """Moves a kinematic rigid body along a path through n keyframes. times: since the firing, shape (n,), s, rising. positions: shape (n, 3), m.
        orientations: shape (n, 4), by default none. smoothness: ``"c1"`` or ``"c2"``; ends: ``"rest"``, ``"free"`` or ``"loop"``.
        """
    @staticmethod
    def drive(joint: _Object, target: float, *, dof: int = 0) -> Action:
        """Sets the target of a drive, rad, m, rad/s or m/s as the drive has it. joint: a joint of ``World.add_joint``, or
        ``"ARTICULATION/LINK"`` for the joint that moves the link. dof: the degree of freedom of that joint, from 0, in the order of
        ``Joint.dofs``; of a spherical joint a component of its rotation vector.
        """
    @staticmethod
    def camera(name: str | None = None, *, eye: ArrayLike | None = None, target: ArrayLike | None = None, vertical_fov: float = 0.6981317007977318) -> Action:
        """Looks from a camera by its name, or from an eye at a target, m; vertical_fov: rad."""
    @staticmethod
    def light(number: int, *, intensity: float | None = None, color: ArrayLike | None = None) -> Action:
        """Changes a light of the scene. number: from 1. intensity: at least 0. color: sRGB, each 0 to 1."""

@final
class ScriptedEvent:
    """An event of a world, made by ``World.add_event`` or ``[[event]]``."""
    @property
    def fired(self) -> int:
        """How often it has fired."""
    @property
    def name(self) -> str:
        """Name, unique in its world."""
    @property
    def exists(self) -> bool:
        """Whether its world still has it."""
    @property
    def enabled(self) -> bool:
        """Whether it takes part in the simulation. A disabled object keeps its state and has no effect: an event does not
        fire, a sensor is not read. A joint that broke is disabled; setting True mends it.
        """
    @enabled.setter
    def enabled(self, value: bool) -> None: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class Template:
    """Equal bodies that events spawn, made by ``World.add_template`` or ``[[template]]``.

    They are in the world from the start, disabled, under the names ``"NAME 1"``, ``"NAME 2"`` and so on.
    """
    @property
    def name(self) -> str:
        """Name, unique in its world."""
    @property
    def enabled(self) -> bool:
        """Whether it takes part in the simulation. A disabled object keeps its state and has no effect: an event does not
        fire, a sensor is not read. A joint that broke is disabled; setting True mends it.
        """
    @enabled.setter
    def enabled(self, value: bool) -> None: ...
    @property
    def exists(self) -> bool:
        """Whether its world still has it."""
    @property
    def spawned(self) -> int:
        """How often it has spawned a body."""
    @property
    def bodies(self) -> list[RigidBody]:
        """Its bodies, disabled ones too."""
    @property
    def refused(self) -> int:
        """How often it could not spawn one, because all were in use."""
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class Soundtrack:
    """Collects the sound of a world, frame by frame: ``sound = tumble.Soundtrack(world); sound.run(480); sound.save("run.wav")``.

    It is what ``tumble run --audio`` writes: two channels of 48 kHz. The same run gives the same samples.
    """
    def __new__(cls, world: World, *, eye: ArrayLike | None = None, target: ArrayLike | None = None, materials: Mapping[str, str] | None = None) -> Soundtrack: ...
    def frame(self) -> None:
        """Listens to the last frame of the world. Every frame must be heard, each once."""
    def run(self, n: int) -> None:
        """Steps the world n times and listens to each frame."""
    def samples(self) -> _Floats:
        """Returns the samples of both ears, shape (n, 2), 48,000 for each second; 1 is full scale, and louder ones are not cut."""
    def save(self, path: _Path, *, gain_db: float | None = None) -> float:
        """Writes a WAV file of 16 bits, whose name ends in ``.wav``, and returns the factor of its samples. gain_db: gain, -120 to 120 dB; by
        default the peak is brought to -3 dB of full scale. A peak above 0.98 of full scale is lowered to it by one factor for the whole.
        """
    @property
    def impacts(self) -> int:
        """Number of impacts so far."""
    @property
    def left_out(self) -> int:
        """Number of sounds that were left out because there were too many."""

@final
class Boid:
    """A boid of a flock: a point mass whose nose points along its velocity, and that banks into turns.

    A handle without data of its own, made by ``Flock.add``. After the boid was removed every use raises
    ``RemovedError``.
    """
    @property
    def name(self) -> str:
        """Name, unique in its world."""
    @property
    def enabled(self) -> bool:
        """Whether it takes part in the simulation. A disabled object keeps its state and has no effect: an event does not
        fire, a sensor is not read. A joint that broke is disabled; setting True mends it.
        """
    @enabled.setter
    def enabled(self, value: bool) -> None: ...
    @property
    def exists(self) -> bool:
        """Whether its world still has it."""
    @property
    def mass(self) -> float:
        """Mass, kg."""
    @property
    def position(self) -> _Floats:
        """Position, shape (3,), m."""
    @property
    def orientation(self) -> _Floats:
        """Unit quaternion (x, y, z, w): x forward, y to the left, z up."""
    @property
    def velocity(self) -> _Floats:
        """Velocity, shape (3,), m/s."""
    @property
    def bank(self) -> float:
        """Bank about the nose, rad; negative in turns to the left."""
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class Panel:
    """A flat surface on a body with lift and drag, for ``Field.panels``.

    body: handle or name; part: of an articulation, the index of a link. point: its middle, and normal, of any length:
    shape (3,), in the frame of the part, m. area: m². lift_slope: of the lift over the angle of attack, 1/rad, 2π of a
    thin airfoil. drag: coefficient along the panel.
    """
    def __new__(
        cls,
        body: _Body,
        area: float,
        *,
        part: int = 0,
        point: ArrayLike | None = None,
        normal: ArrayLike | None = None,
        lift_slope: float = 6.283185307179586,
        drag: float = 0.02,
    ) -> Panel: ...

@final
class Field:
    """A law of force on bodies, given to ``World.add_field``; made by one of its static methods."""
    @staticmethod
    def wind(velocity: ArrayLike, *, drag: float | None = None, density: float = 1.2, drag_coefficient: float = 0.47) -> Field:
        """Moving air. velocity: shape (3,), m/s. drag: force per speed, N·s/m, the same for every body; None for a force in
        proportion to the square of the speed and to the silhouette, with the density of the air, kg/m³, and a
        drag coefficient.
        """
    @staticmethod
    def attractor(position: ArrayLike, strength: float, *, softening: float = 0.0) -> Field:
        """A point that attracts masses as a planet does. position: shape (3,), m. strength: m³/s², negative to repel.
        softening: length, m, below which the force does not grow.
        """
    @staticmethod
    def explosion(position: ArrayLike, impulse: float, *, start: float = 0.0, decay: float = 0.02) -> Field:
        """An explosion. position: shape (3,), m. impulse: momentum in all directions together, N·s; a body gets the
        share that its silhouette covers. start: s. decay: time constant, s.
        """
    @staticmethod
    def buoyancy(surface: ArrayLike | None = None, density: float = 1000.0, *, drag: float = 0.0, current: ArrayLike | None = None) -> Field:
        """A fluid below a horizontal surface. surface: a point of it, shape (3,), m. density: kg/m³. drag: per mass of
        displaced fluid, 1/s. current: velocity of the fluid, shape (3,), m/s.
        """
    @staticmethod
    def panels(panels: Sequence[Panel], *, density: float = 1.2, wind: ArrayLike | None = None) -> Field:
        """Lift and drag on panels: wings, sails, fins. density: of the air, kg/m³. wind: its velocity, shape (3,), m/s."""

@final
class Joint:
    """A joint between two bodies, or a body and the world, made by ``World.add_joint``.

    Its position is an angle (rad), a displacement (m) or a length (m), the first of its ``dofs``; ``"fixed"``, ``"gear"`` and
    ``"rack"`` joints have none. Everything can change between steps. All vectors
    are in world axes.
    """
    @property
    def name(self) -> str:
        """Name, unique in its world."""
    @property
    def exists(self) -> bool:
        """Whether its world still has it."""
    @property
    def kind(self) -> JointKind:
        """Kind of the joint."""
    @property
    def a(self) -> RigidBody | Articulation | None:
        """The body on its first side."""
    @property
    def b(self) -> RigidBody | Articulation | None:
        """The body on its second side; None for the world."""
    @property
    def enabled(self) -> bool:
        """Whether it takes part in the simulation. A disabled object keeps its state and has no effect: an event does not
        fire, a sensor is not read. A joint that broke is disabled; setting True mends it.
        """
    @enabled.setter
    def enabled(self, value: bool) -> None: ...
    @property
    def dofs(self) -> list[JointDof]:
        """Its degrees of freedom: (angle) of ``"revolute"``, (displacement) of ``"prismatic"`` and ``"screw"``, (displacement,
        angle) of ``"cylindrical"``, angles about the axis and the second axis of ``"universal"``, displacements along
        x and y of b's frame and the angle of ``"planar"``, the rotation vector in b's frame of ``"spherical"``, (length) of kinds with a length.
        The settings of the joint itself are those of the first one, of a ``"spherical"`` joint of all three.
        """
    @property
    def position(self) -> float:
        """Position, rad or m: the angle of ``a`` about the axis, its displacement along the axis, the length, or
        the angle between both axes of a ``"spherical"`` joint. Zero where the joint was made, except for a length. An angle is in (-π, π], or within π
        of the middle of its limits.
        """
    @property
    def velocity(self) -> float:
        """Rate of the position, rad/s or m/s."""
    @property
    def limits(self) -> tuple[float, float] | None:
        """Limits of the position, (lower, upper), rad or m, or None. One of them may be infinite."""
    @limits.setter
    def limits(self, value: ArrayLike | None) -> None: ...
    @property
    def cone(self) -> float | None:
        """Largest swing of a ``"spherical"`` joint, rad, or None: its axis on ``a`` stays in this cone about that on ``b``."""
    @cone.setter
    def cone(self, value: float | None) -> None: ...
    @property
    def twist_limits(self) -> tuple[float, float] | None:
        """Limits of the twist of a ``"spherical"`` joint, (lower, upper), rad, or None: of its rotation about its axis on ``a`` after the shortest
        turn of that on ``b`` to it.
        """
    @twist_limits.setter
    def twist_limits(self, value: ArrayLike | None) -> None: ...
    @property
    def effort(self) -> float:
        """Force of its motor, N·m or N, above 0: the limit of drives that name none. Infinite if it is not known."""
    @effort.setter
    def effort(self, value: float) -> None: ...
    @property
    def armature(self) -> float:
        """Inertia of its rotor, as the joint meets it, kg·m² or kg: it acts between ``a`` and ``b`` against accelerations of the
        position. Kinds with a length have none.
        """
    @armature.setter
    def armature(self, value: float) -> None: ...
    @property
    def max_velocity(self) -> float:
        """Largest speed of the position, of a ``"spherical"`` joint that about each axis, rad/s or m/s; infinite
        for none.
        """
    @max_velocity.setter
    def max_velocity(self, value: float) -> None: ...
    @property
    def damping(self) -> float:
        """Viscous damping along the position, of a ``"spherical"`` joint about each axis, N·m·s/rad or N·s/m."""
    @damping.setter
    def damping(self, value: float) -> None: ...
    @property
    def friction(self) -> float:
        """Dry friction along the position: largest torque or force, N·m or N. Of a ``"spherical"`` joint about each
        axis.
        """
    @friction.setter
    def friction(self, value: float) -> None: ...
    @property
    def stiffness(self) -> float:
        """Stiffness of its spring, N·m/rad or N/m; 0 without one."""
    @stiffness.setter
    def stiffness(self, value: float) -> None: ...
    @property
    def rest(self) -> float:
        """Position at which its spring is at rest, rad or m; for a ``"spring"`` its ``length``."""
    @rest.setter
    def rest(self, value: float) -> None: ...
    @property
    def length(self) -> float:
        """Length of a ``"distance"``, largest length of a ``"rope"``, length of a ``"spring"`` at rest,
        largest length of the rope of a ``"pulley"``, m.
        """
    @length.setter
    def length(self, value: float) -> None: ...
    @property
    def teeth(self) -> tuple[int, int]:
        """Teeth of the gears ``a`` and ``b``, not 0; negative for inner teeth."""
    @teeth.setter
    def teeth(self, value: tuple[int, int]) -> None: ...
    @property
    def radius(self) -> float:
        """Displacement of a ``"rack"`` per radian of its pinion ``a``, m, not 0."""
    @radius.setter
    def radius(self, value: float) -> None: ...
    @property
    def pitch(self) -> float:
        """Displacement of a ``"screw"`` per turn, m, not 0; positive for a right-handed one."""
    @pitch.setter
    def pitch(self, value: float) -> None: ...
    @property
    def ratio(self) -> float:
        """Weight of the side of ``b`` in the length of a ``"pulley"``, above 0."""
    @ratio.setter
    def ratio(self, value: float) -> None: ...
    @property
    def breaking_force(self) -> float:
        """Force above which it breaks, N; infinite if it does not."""
    @breaking_force.setter
    def breaking_force(self, value: float) -> None: ...
    @property
    def breaking_torque(self) -> float:
        """Torque about its point above which it breaks, N·m; infinite if it does not."""
    @breaking_torque.setter
    def breaking_torque(self, value: float) -> None: ...
    def set_drive(
        self,
        *,
        target: ArrayLike | None = None,
        velocity: ArrayLike | None = None,
        stiffness: float = 0.0,
        damping: float = 0.0,
        max_force: float | None = None,
    ) -> None:
        """Sets its drive; the arguments are those of ``Articulation.set_drive``. A drive to an angle goes
        the shorter way if the joint has no limits. max_force: None: its ``effort``. target and velocity may be sequences with
        a number for each of its ``dofs``, which all get a drive then; a number is that of the first one, of a ``"spherical"`` joint of all three.
        """
    @property
    def force(self) -> _Floats:
        """Force on ``a`` in the last sub-step, shape (3,), N; the opposite acts on ``b``. It includes those
        of limits, spring, damping, friction and drive. Zero while the joint is not enabled; while its
        bodies sleep it is that with which they fell asleep.
        """
    @property
    def torque(self) -> _Floats:
        """Torque on ``a`` about its point of the joint, shape (3,), N·m; otherwise as ``force``."""
    @property
    def drive_force(self) -> float:
        """Force or torque of the drive of its first degree of freedom, N or N·m."""
    @property
    def error(self) -> tuple[float, float]:
        """How far it is open: distance, m, and angle, rad, without the motion that it leaves free."""
    def __repr__(self) -> str: ...
    def __eq__(self, value: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class JointDof:
    """One degree of freedom that a joint leaves free: a member of ``Joint.dofs``. Its settings are those of the joint,
    and can change between steps.
    """
    @property
    def position(self) -> float:
        """Position, rad or m; 0 where the joint was made, except for a length."""
    @property
    def velocity(self) -> float:
        """Rate of the position, rad/s or m/s; of a ``"spherical"`` joint the angular velocity about the axis."""
    @property
    def limits(self) -> tuple[float, float] | None:
        """Limits of the position, (lower, upper), rad or m, or None. One of them may be infinite."""
    @limits.setter
    def limits(self, value: ArrayLike | None) -> None: ...
    @property
    def max_velocity(self) -> float:
        """Largest speed of the position, of a ``"spherical"`` joint that about each axis, rad/s or m/s; infinite
        for none.
        """
    @max_velocity.setter
    def max_velocity(self, value: float) -> None: ...
    @property
    def damping(self) -> float:
        """Viscous damping along the position, of a ``"spherical"`` joint about each axis, N·m·s/rad or N·s/m."""
    @damping.setter
    def damping(self, value: float) -> None: ...
    @property
    def friction(self) -> float:
        """Dry friction along the position: largest torque or force, N·m or N. Of a ``"spherical"`` joint about each
        axis.
        """
    @friction.setter
    def friction(self, value: float) -> None: ...
    @property
    def stiffness(self) -> float:
        """Stiffness of its spring, N·m/rad or N/m; 0 without one."""
    @stiffness.setter
    def stiffness(self, value: float) -> None: ...
    @property
    def rest(self) -> float:
        """Position at which its spring is at rest, rad or m; for a ``"spring"`` its ``length``."""
    @rest.setter
    def rest(self, value: float) -> None: ...
    @property
    def effort(self) -> float:
        """Force of its motor, N·m or N, above 0: the limit of drives that name none. Infinite if it is not known."""
    @effort.setter
    def effort(self, value: float) -> None: ...
    @property
    def armature(self) -> float:
        """Inertia of its rotor, as the joint meets it, kg·m² or kg: it acts between ``a`` and ``b`` against accelerations of the
        position. Kinds with a length have none.
        """
    @armature.setter
    def armature(self, value: float) -> None: ...
    def set_drive(
        self,
        *,
        target: float | None = None,
        velocity: float | None = None,
        stiffness: float = 0.0,
        damping: float = 0.0,
        max_force: float | None = None,
    ) -> None:
        """Sets its drive; the arguments are those of ``Joint.set_drive``."""
    @property
    def drive_force(self) -> float:
        """Force or torque of the drive, N or N·m."""
    def __repr__(self) -> str: ...
    def __eq__(self, value: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class ArticulationBuilder:
    """Makes an articulated body link by link, without a file.

    name: of the body. self_collision: whether its links collide with each other; links that a joint
    connects never do. ``build`` returns a description; ``World.add_articulation`` takes the builder
    too.
    """
    def __new__(cls, name: str = "articulation", *, self_collision: bool = True) -> ArticulationBuilder: ...
    def add_link(
        self,
        name: str,
        parent: str | None = None,
        *,
        joint: JointType = "revolute",
        axis: ArrayLike = (0.0, 0.0, 1.0),
        position: ArrayLike | None = None,
        orientation: ArrayLike | None = None,
        shape: Shape | None = None,
        shape_position: ArrayLike | None = None,
        shape_orientation: ArrayLike | None = None,
        mass: float | None = None,
        density: float | None = None,
        center_of_mass: ArrayLike | None = None,
        inertia: ArrayLike | None = None,
        limits: ArrayLike | None = None,
        joint_damping: float = 0.0,
        joint_friction: float = 0.0,
        armature: float = 0.0,
        stiffness: float = 0.0,
        rest: ArrayLike = 0.0,
        drive: Mapping[str, Any] | None = None,
        max_velocity: float | None = None,
        effort: float | None = None,
        q: ArrayLike | None = None,
        qd: ArrayLike | None = None,
        friction: float = 0.5,
        restitution: float = 0.0,
        collidable: bool = True,
        color: ArrayLike | None = None,
        cone: float | None = None,
        contacts: Contacts = "surface",
        group: int = 0,
        mask: int | Sequence[int] | None = None,
        twist_limits: ArrayLike | None = None,
        static_friction: float | None = None,
        stribeck_speed: float | None = None,
        friction_scale: ArrayLike | None = None,
        rolling_friction: float | None = None,
        torsional_friction: float | None = None,
        tangential_restitution: float | None = None,
        adhesion: float | None = None,
        surface_velocity: ArrayLike | None = None,
        appearance: Appearance | None = None,
    ) -> None:
        """Adds a link. Its joint has the same name.

        parent: a link that was added before; None: the base. joint: ``"revolute"``, ``"prismatic"``,
        ``"spherical"``, ``"fixed"``, or ``"floating"`` without a parent. axis: of a revolute or
        prismatic joint, shape (3,), any length above 0, or ``"x"``, ``"-z"`` and so on. position, orientation: the frame of the joint
        in the frame of the parent, shape (3,), m, and (4,); with the joint at zero it is the frame of
        the link.

        shape: collides and is drawn, at shape_position and shape_orientation in the frame of the link;
        ``add_shape`` adds others. mass, kg: spread over the volumes of all shapes; or density, kg/m³,
        by default that of water. A link without shapes has no mass. center_of_mass, shape (3,), m, and
        inertia about it, shape (3, 3) or (3,), kg·m²: numbers for ``mass``, without regard to the shapes;
        a point mass without inertia.

        limits: (lower, upper), rad or m. joint_damping: N·m·s/rad or N·s/m. joint_friction: N·m or N.
        armature: inertia of the rotor of a revolute, prismatic or spherical joint, as the joint meets it, kg·m² or kg.
        max_velocity: largest speed of the joint, rad/s or m/s. effort: the force of its motor, N·m or N, which limits drives that name no
        ``max_force``. stiffness, N·m/rad or N/m, and rest, rad or m: a spring. drive: a dict with the arguments of
        ``Articulation.set_drive``; or with ``times``, s, and ``values``, rad or m, of a recorded motion, of a spherical joint of shape (n,) or
        (n, 3), with ``repeat``, by default False, and ``max_force``. q, qd: position and velocity of the joint at the start, by its numbers in ``Articulation.q`` and ``qd``: a
        number of a revolute or prismatic joint; a unit quaternion, shape (4,), and the angular velocity in the axes of the link, shape
        (3,), of a spherical one; position and quaternion in the world, shape (7,), and (6,), of a floating one. A spherical joint has
        settings about each axis of the link: rest and the target of its drive may be rotation vectors, shape (3,), a number is for each
        component. cone: largest angle of a spherical joint between its axis, x, y or z, on the link and on the parent, rad; twist_limits:
        (lower, upper) of the turn of the link about that axis, rad.

        friction, restitution, and the other constants of surfaces, contacts, group, mask, collidable: of the shapes, as the
        properties of ``RigidBody``. color: sRGB, shape (3,); appearance: a ``tumble.Appearance`` instead.
        """
    def add_shape(
        self,
        link: str,
        shape: Shape,
        position: ArrayLike | None = None,
        orientation: ArrayLike | None = None,
        *,
        collidable: bool = True,
        one_way: ArrayLike | None = None,
        sensor: bool = False,
        mass: float | None = None,
        density: float | None = None,
        friction: float | None = None,
        restitution: float | None = None,
        contacts: Contacts | None = None,
        group: int | None = None,
        mask: int | Sequence[int] | None = None,
        color: ArrayLike | None = None,
        visible: bool = True,
        static_friction: float | None = None,
        stribeck_speed: float | None = None,
        friction_scale: ArrayLike | None = None,
        rolling_friction: float | None = None,
        torsional_friction: float | None = None,
        tangential_restitution: float | None = None,
        adhesion: float | None = None,
        surface_velocity: ArrayLike | None = None,
        appearance: Appearance | None = None,
    ) -> None:
        """Adds a shape to a link. position, orientation: in the frame of the link. collidable: whether it
        collides, or is only drawn; both count for the mass. one_way: direction, shape (3,), in the frame of the shape, of a
        shape that collides on one side only, as in ``World.add_rigid``. sensor: no contacts; ``events`` reports the bodies that
        overlap it.

        mass, kg, or density, kg/m³: of the shape, for a link without a mass. friction, restitution, the other constants of surfaces,
        contacts, group, mask, color: by default those of the link; appearance: a ``tumble.Appearance`` instead of the color. visible: whether it is drawn.
        """
    def mimic(self, link: str, of: str, multiplier: float = 1.0, offset: float = 0.0) -> None:
        """Couples the joint of a link to that of another: ``q = multiplier · q_of + offset``."""
    def exclude_collisions(self, a: str, b: str) -> None:
        """Disables collisions between two links."""
    def build(self) -> Articulation:
        """Returns a description of the body, whose dynamics functions work at once. Later links do not
        change it.
        """
    def __repr__(self) -> str: ...

@final
class Link:
    """A link of an articulation: its motion, its mass, and what its shapes collide with.

    ``Articulation.link`` returns it, also for a fixed link. A handle without data of its own. It can be changed if the
    articulation is in a world.
    """
    @property
    def articulation(self) -> Articulation:
        """The articulation."""
    @property
    def name(self) -> str:
        """Name of the link."""
    @property
    def mass(self) -> float:
        """Mass, kg, at least 0: of the link alone, without links that are fixed to it. Setting it keeps positions and
        velocities and changes the inertia by the same factor; that of a link that had none stays 0. The mass of a link that
        is fixed to the base has no effect on motion.
        """
    @mass.setter
    def mass(self, value: float) -> None: ...
    @property
    def inertia(self) -> _Floats:
        """Inertia about its center of mass, axes of the link, shape (3, 3), kg·m². Setting it, also by three moments, keeps the
        velocities.
        """
    @inertia.setter
    def inertia(self, value: ArrayLike) -> None: ...
    @property
    def center_of_mass(self) -> _Floats:
        """The center of mass in the frame of the link, shape (3,), meters. Setting it keeps the motion of the link; the inertia is
        then about the new center.
        """
    @center_of_mass.setter
    def center_of_mass(self, value: ArrayLike) -> None: ...
    @property
    def group(self) -> int | None:
        """Collision group of its shapes, 0 to 63; None if it has none or they differ. Shapes of links that are fixed to each
        other have it together.
        """
    @group.setter
    def group(self, value: int) -> None: ...
    @property
    def mask(self) -> int | None:
        """Groups that its shapes collide with, one bit each; None if it has none or they differ. May be set to a sequence of
        groups, or None for all.
        """
    @mask.setter
    def mask(self, value: int | Sequence[int] | None) -> None: ...
    @property
    def position(self) -> _Floats:
        """Position of the origin of its frame, shape (3,), meters, world axes."""
    @property
    def orientation(self) -> _Floats:
        """Orientation, link to world, unit quaternion (x, y, z, w), shape (4,)."""
    @property
    def velocity(self) -> _Floats:
        """Velocity of the origin of its frame, shape (3,), m/s, world axes."""
    @property
    def angular_velocity(self) -> _Floats:
        """Angular velocity, shape (3,), rad/s, world axes."""
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def attach_camera(
        self,
        position: ArrayLike | None = (0.0, 0.0, 0.0),
        forward: ArrayLike | None = (1.0, 0.0, 0.0),
        up: ArrayLike | None = (0.0, 0.0, 1.0),
        *,
        fov_deg: float = 40.0,
        near: float = 0.05,
        far: float = 500.0,
    ) -> None:
        """Attaches a camera, at most one, that moves with the body or link and that scenes keep. position: shape (3,), m; forward,
        up: directions, shape (3,), not parallel; all in the frame of the shape of a body, or of the link. fov_deg: vertical
        field of view, degrees, 1 to 170. near, far: depths between which it sees, m.
        """
    def attach_light(
        self,
        kind: Literal["point", "directional"] = "point",
        *,
        position: ArrayLike | None = None,
        direction: ArrayLike | None = None,
        color: ArrayLike | None = None,
        intensity: float = 1.0,
        radius: float = 0.1,
        casts_shadow: bool | None = None,
    ) -> None:
        """Attaches a light, at most one, which scenes keep. kind: ``"point"``, with position, shape (3,), m, and radius, m, or
        ``"directional"``, along direction, shape (3,); both in the frame of the shape of a body, or of the link. color: sRGB,
        shape (3,). intensity: at least 0; a directional light of 1 makes a white wall that faces it white, a point light at
        1 m. casts_shadow: by default of directional lights.
        """
    @property
    def camera(self) -> dict[str, Any] | None:
        """The camera that it carries, as a dict of the arguments of ``attach_camera``, or None. Setting a dict replaces it, or attaches
        one; arguments that the dict lacks have their defaults. Setting None removes it. A link and the links fixed to it
        have one between them.
        """
    @camera.setter
    def camera(self, value: dict[str, Any] | None) -> None: ...
    @property
    def light(self) -> dict[str, Any] | None:
        """The light that it carries, as a dict of the arguments of ``attach_light``, or None. Setting a dict replaces it, or attaches
        one; arguments that the dict lacks have their defaults. Setting None removes it. A link and the links fixed to it
        have one between them.
        """
    @light.setter
    def light(self, value: dict[str, Any] | None) -> None: ...

@final
class Articulation:
    """A tree of links: a robot, a chain, a skeleton.

    ``Articulation.from_urdf`` returns a description, whose dynamics functions work at once.
    ``World.add_articulation`` adds it to a world and returns a handle of the body there. ``q`` has
    ``nq`` numbers: one per revolute joint (rad) or prismatic joint (m), a quaternion (x, y, z, w)
    per spherical joint, position and quaternion of a floating root. ``qd`` and ``tau`` have ``dof``
    numbers: rad/s or m/s and N·m or N; those of a floating root are angular, then linear, world
    axes.

    All functions of ``q``, ``qd``, ``tau`` take one state or a batch of states with a leading axis.
    An argument without that axis applies to the whole batch. These functions ignore limits,
    damping, drives and contacts.
    """
    @staticmethod
    def from_urdf(
        path: _Path,
        *,
        floating: bool = False,
        packages: Mapping[str, _Path] | None = None,
        missing_meshes: MissingMeshes = "error",
        collision_meshes: CollisionMeshes = "exact",
        velocity_limits: bool = False,
    ) -> Articulation:
        """Reads a URDF. The tree is read at once, collision shapes when it is added to a world, and
        visual meshes when they are first drawn.

        floating: whether the root floats; otherwise it is fixed to the base. packages: folders by
        name, for ``package://NAME/…``. missing_meshes: ``"error"`` or ``"skip"``, for missing
        collision meshes. collision_meshes: ``"exact"`` or ``"hull"``. velocity_limits: whether the largest
        velocities of joints are enforced, as ``max_velocity``, against any force; False: they are read and have no effect.
        """
    @staticmethod
    def from_mjcf(
        path: _Path,
        *,
        keyframe: str | None = None,
        missing_meshes: MissingMeshes = "error",
        collision_meshes: CollisionMeshes = "hull",
    ) -> Articulation:
        """Reads the only articulated body of a model of MuJoCo, at the place that it has there.
        ``World.load`` reads a whole model: bodies, floors, gravity and time step.

        keyframe: name or number of the keyframe that it starts in. missing_meshes: ``"error"`` or
        ``"skip"``, for missing collision meshes. collision_meshes: ``"exact"`` or ``"hull"``.
        """
    @staticmethod
    def from_sdformat(
        path: _Path,
        *,
        packages: Mapping[str, _Path] | None = None,
        missing_meshes: MissingMeshes = "error",
        collision_meshes: CollisionMeshes = "exact",
    ) -> Articulation:
        """Reads the only body of joined links of an SDF file (of Gazebo), at the place that it has there.
        ``World.load`` reads a whole file: models, planes, lights, gravity and time step.

        packages: folders by name, for ``model://NAME/…``. missing_meshes: ``"error"`` or ``"skip"``, for
        missing collision meshes. collision_meshes: ``"exact"`` or ``"hull"``.
        """
    @property
    def name(self) -> str:
        """Name of the robot in its file, or of the body in its world."""
    @property
    def placed_in_world(self) -> bool:
        """Whether it is in a world."""
    @property
    def exists(self) -> bool:
        """Whether its world still has it; True for a description."""
    @property
    def joint_names(self) -> list[str]:
        """Names of all joints that are not fixed, in the order of the coordinates."""
    @property
    def link_names(self) -> list[str]:
        """Names of all links, including fixed ones, in the order of ``link_poses``."""
    @property
    def dof(self) -> int:
        """Number of degrees of freedom: the length of ``qd`` and ``tau``."""
    @property
    def nq(self) -> int:
        """Length of ``q``."""
    @property
    def mass(self) -> float:
        """Mass of all links that can move, kg."""
    @property
    def mode(self) -> Mode:
        """``"dynamic"``, ``"kinematic"`` (its joints move at their velocities, whatever it collides with) or ``"static"``, of a
        body in a world.
        """
    @mode.setter
    def mode(self, value: Mode) -> None: ...
    @property
    def enabled(self) -> bool:
        """Whether it takes part in the simulation of its world. A disabled body keeps its state."""
    @enabled.setter
    def enabled(self, value: bool) -> None: ...
    @property
    def asleep(self) -> bool:
        """Whether it sleeps in its world: the steps leave it out until something touches it (``World(sleep_after=…)``). Any
        change wakes it.
        """
    @property
    def collidable(self) -> bool:
        """Whether it collides in its world."""
    @collidable.setter
    def collidable(self, value: bool) -> None: ...
    @property
    def group(self) -> int | None:
        """Collision group of its shapes, 0 to 63; None if it has no shape or they differ. Two bodies collide if the group of
        each is in the mask of the other. Settable for a body in a world; ``Link.group`` is that of one link.
        """
    @group.setter
    def group(self, value: int) -> None: ...
    @property
    def mask(self) -> int | None:
        """Groups that its shapes collide with, one bit each; None if it has no shape or they differ. May be set, for a body in a
        world, to a sequence of groups, or None for all.
        """
    @mask.setter
    def mask(self, value: int | Sequence[int] | None) -> None: ...
    @property
    def touching(self) -> list[RigidBody | Articulation]:
        """The bodies in contact with it after the last step, or in a sensor of it: a list of handles in the order of
        ``world.bodies``.
        """
    @property
    def links(self) -> list[Link]:
        """All links, including fixed ones, in the order of ``link_names``."""
    def link(self, name: str) -> Link:
        """Returns a link by name, which may be a fixed one."""
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
        """Generalized forces, shape (dof,), N·m and N. They act in every step until they are changed,
        in addition to drives and damping. ``save`` and forks include them; ``World.state`` does
        not.
        """
    @tau.setter
    def tau(self, value: ArrayLike) -> None: ...
    @property
    def gravity(self) -> _Floats:
        """Gravity used by its functions, shape (3,), m/s². In a world it is the world's gravity and
        can only be set there.
        """
    @gravity.setter
    def gravity(self, value: ArrayLike) -> None: ...
    @property
    def limits(self) -> _Floats:
        """Lower and upper position limit of each degree of freedom, shape (dof, 2), rad or m; infinite
        without a limit. Settable for a body in a world.
        """
    @limits.setter
    def limits(self, value: ArrayLike) -> None: ...
    @property
    def joint_damping(self) -> _Floats:
        """Viscous damping of each degree of freedom, shape (dof,), N·m·s/rad or N·s/m. Settable for a body in a world: a
        number for all, or shape (dof,).
        """
    @joint_damping.setter
    def joint_damping(self, value: ArrayLike) -> None: ...
    @property
    def joint_friction(self) -> _Floats:
        """Dry friction of each degree of freedom, shape (dof,), N·m or N. Settable like ``joint_damping``."""
    @joint_friction.setter
    def joint_friction(self, value: ArrayLike) -> None: ...
    @property
    def armature(self) -> _Floats:
        """Armature of each degree of freedom, shape (dof,), kg·m² or kg: the inertia of the rotor of its joint, as the joint meets
        it; 0 for floating roots. Settable like ``joint_damping``: velocities stay. A number is for all joints that have
        one; those of a spherical joint are the same.
        """
    @armature.setter
    def armature(self, value: ArrayLike) -> None: ...
    @property
    def shape_names(self) -> list[list[str | None]]:
        """Names of the shapes that collide, by links as in ``link_names`` and by the numbers that contacts and hits report;
        None for those without one.

        A fixed link has its own shapes, although it moves with the link that carries it.
        """
    def shape_number(self, link: str, name: str) -> int:
        """Returns the number of the shape of that name on a link, which may be a fixed one; that of contacts with the link."""
    def shape_material(self, link: str, shape: int | str) -> dict[str, Any]:
        """Returns the surface constants of one shape of a link: a dict by the names of ``set_shape_material``.

        shape: name, or number as ``shapes`` of contacts has it.
        """
    def shape_filter(self, link: str, shape: int | str) -> dict[str, Any]:
        """Returns what one shape of a link collides with: a dict by the names of ``set_shape_filter``, with the mask as the bits of an
        integer.

        shape: name, or number as ``shapes`` of contacts has it.
        """
    def set_shape_filter(
        self,
        link: str,
        shape: int | str,
        *,
        group: int | None = None,
        mask: int | Sequence[int] | None = None,
        sensor: bool | None = None,
    ) -> None:
        """Sets collision group, mask and sensor of one shape of a link of a body in a world, by the names of
        ``RigidBody.set_shape_filter``.

        shape: name, or number as ``shapes`` of contacts has it. What is not given stays as it is. Without any, a part of a
        ``Compound`` is as the compound again.
        """
    def set_intersect(self, link: str, test: Intersect | None, shape: int | str | None = None) -> None:
        """Gives the shapes of a link of a body in a world an intersection test of their own, or takes it for None: a function that
        decides with what the link collides.

        test: an object of a subclass of ``tumble.Intersect``, or None. shape: one shape only, by name or number as ``shapes`` of
        contacts has it; the whole compound for a part of one. Shapes of other links that are fixed to it are not meant.
        """
    def set_shape_material(
        self,
        link: str,
        shape: int | str,
        *,
        friction: float | None = None,
        restitution: float | None = None,
        static_friction: float | None = None,
        stribeck_speed: float | None = None,
        friction_scale: ArrayLike | None = None,
        rolling_friction: float | None = None,
        torsional_friction: float | None = None,
        tangential_restitution: float | None = None,
        adhesion: float | None = None,
        surface_velocity: ArrayLike | None = None,
    ) -> None:
        """Sets surface constants of one shape of a link of a body in a world, by the names of ``RigidBody.set_shape_material``.

        shape: name, or number as ``shapes`` of contacts has it. Constants that are not given stay as they are. Without any,
        a part of a ``Compound`` has those of the compound again.
        """
    @property
    def stiffness(self) -> _Floats:
        """Stiffness of the spring of each degree of freedom, shape (dof,), N·m/rad or N/m; 0 without one. Settable like
        ``joint_damping``; that of a drive is an argument of ``set_drive``.
        """
    @stiffness.setter
    def stiffness(self, value: ArrayLike) -> None: ...
    @property
    def twist_limits(self) -> _Floats:
        """Limits of the twist about each axis of a spherical joint, shape (dof, 2), rad; infinite without any, and for all other joints. Settable
        like ``limits``, whose rows for such a joint are 0 and the largest angle of its cone about that axis.
        """
    @twist_limits.setter
    def twist_limits(self, value: ArrayLike) -> None: ...
    @property
    def rest(self) -> _Floats:
        """Rest position of the spring of each degree of freedom, shape (dof,), rad or m, of a spherical joint a rotation vector. Settable like ``joint_damping``."""
    @rest.setter
    def rest(self, value: ArrayLike) -> None: ...
    @property
    def max_velocity(self) -> _Floats:
        """Largest speed of each degree of freedom, shape (dof,), rad/s or m/s; infinite for none. Settable for a
        body in a world.
        """
    @max_velocity.setter
    def max_velocity(self, value: ArrayLike) -> None: ...
    @property
    def effort(self) -> _Floats:
        """Force of the motor of each degree of freedom, shape (dof,), N·m or N, the limit of drives that name none;
        infinite if it is not known. A URDF states it. Settable for a body in a world.
        """
    @effort.setter
    def effort(self, value: ArrayLike) -> None: ...
    def forward_dynamics(
        self, q: ArrayLike | None = None, qd: ArrayLike | None = None, tau: ArrayLike | None = None
    ) -> _Floats:
        """Returns the accelerations ``qdd`` that generalized forces ``tau`` cause, shape (dof,) or
        (batch, dof).

        q: (nq,), qd, tau: (dof,), each optionally batched (batch, …). Omitted arguments have their
        current values. A singular mass matrix raises ``InvalidValueError`` with the name of the link whose joint
        moves no inertia.
        """
    def inverse_dynamics(
        self, q: ArrayLike | None = None, qd: ArrayLike | None = None, qdd: ArrayLike | None = None
    ) -> _Floats:
        """Returns the generalized forces that accelerations ``qdd`` require, including gravity, shape
        (dof,) or (batch, dof).

        q: (nq,), qd, qdd: (dof,), each optionally batched. Without ``qdd`` the accelerations are
        zero.
        """
    def inverse_dynamics_derivatives(
        self, q: ArrayLike | None = None, qd: ArrayLike | None = None, qdd: ArrayLike | None = None
    ) -> _Floats:
        """Returns the derivatives of ``inverse_dynamics``: by ``q``, by ``qd`` and by ``qdd``, which is the
        mass matrix; shape (3, dof, dof) or (batch, 3, dof, dof).

        Arguments as in ``inverse_dynamics``. Row ``i``, column ``k`` is that of force ``i`` by number
        ``k``. Positions change along velocities: column ``k`` by ``q`` is the slope along unit velocity
        ``k``, also of spherical joints and floating roots.
        """
    def forward_dynamics_derivatives(
        self, q: ArrayLike | None = None, qd: ArrayLike | None = None, tau: ArrayLike | None = None
    ) -> _Floats:
        """Returns the derivatives of ``forward_dynamics``: by ``q``, by ``qd`` and by ``tau``, which is the
        inverse of the mass matrix; shape (3, dof, dof) or (batch, 3, dof, dof).

        Arguments as in ``forward_dynamics``, rows and columns as in ``inverse_dynamics_derivatives``. A
        singular mass matrix raises ``InvalidValueError``.
        """
    def mass_matrix(self, q: ArrayLike | None = None) -> _Floats:
        """Returns the mass matrix, symmetric, shape (dof, dof) or (batch, dof, dof)."""
    def jacobian(self, link: str, q: ArrayLike | None = None) -> _Floats:
        """Returns the Jacobian of a link, shape (6, dof) or (batch, 6, dof). ``J @ qd`` is the angular
        velocity (first three rows) and the velocity of the origin of the link's frame (last three),
        world axes.
        """
    def link_poses(self, q: ArrayLike | None = None) -> _Floats:
        """Returns the poses of all links in the world, in the order of ``link_names``: position, m,
        and quaternion (x, y, z, w). Shape (links, 7) or (batch, links, 7).
        """
    def link_pose(self, link: str, q: ArrayLike | None = None) -> _Floats:
        """Returns the pose of one link in the world, shape (7,) or (batch, 7), as in ``link_poses``."""
    def center_of_mass(self, q: ArrayLike | None = None) -> _Floats:
        """Returns the center of mass in the world, shape (3,) or (batch, 3), meters."""
    def set_drive(
        self,
        joint: str,
        *,
        target: ArrayLike | None = None,
        velocity: ArrayLike | None = None,
        stiffness: float = 0.0,
        damping: float = 0.0,
        max_force: float | None = None,
    ) -> None:
        """Sets the drive of a revolute, prismatic or spherical joint of a body in a world, by the name of the
        joint. Target and velocity of a spherical joint are a rotation vector in the frame of the joint and an angular velocity in the
        axes of the link, shape (3,); a number is for each component.

        With ``stiffness`` or ``damping`` it drives to position ``target`` (rad or m) and
        ``velocity``. With neither it holds ``velocity``. Without arguments the drive is removed.
        max_force: largest torque or force, N·m or N; None: the ``effort`` of the joint. ``save`` includes it.
        """
    def set_drives(
        self,
        *,
        target: ArrayLike | None = None,
        velocity: ArrayLike | None = None,
        stiffness: ArrayLike | None = None,
        damping: ArrayLike | None = None,
        max_force: ArrayLike | None = None,
    ) -> None:
        """Sets the drives of all degrees of freedom of a body in a world at once, in the order of ``qd``.

        Arguments as in ``set_drive``: a number for all that can have a drive, or shape (dof,). Degrees of freedom whose numbers are
        all 0 or None have no drive then. A ``target`` without
        ``stiffness`` and ``damping`` is that of the drives that are there, which keep their gains. ``save`` includes them.
        """
    def apply_force(self, link: str, force: ArrayLike, point: ArrayLike | None = None) -> None:
        """Applies a force to a link of a body in a world during the next step only. force: shape (3,),
        N; point: where it acts, meters (default: the origin of the link's frame). World axes.
        """
    def apply_torque(self, link: str, torque: ArrayLike) -> None:
        """Applies a torque to a link during the next step only. torque: shape (3,), N·m, world axes."""
    def apply_impulse(self, link: str, impulse: ArrayLike, point: ArrayLike | None = None) -> None:
        """Applies an impulse to a link at once. impulse: shape (3,), N·s; point: as in
        ``apply_force``.
        """
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class Bodies:
    """The bodies of a world in the order in which they were added: a sequence that also takes names,
    ``world.bodies["ball"]``.

    It follows the world. Constraints and forces are not bodies.
    """
    def __len__(self) -> int: ...
    @overload
    def __getitem__(self, key: str, /) -> Any: ...
    @overload
    def __getitem__(self, key: int, /) -> Any: ...
    def __contains__(self, key: object, /) -> bool: ...
    def __iter__(self) -> Iterator[Any]: ...
    def names(self) -> list[str]:
        """Returns the names of all bodies, in order."""

@final
class Policy:
    """A linear policy or a perceptron, evaluated within the steps of a ``Batch``.

    layers: pairs (W, b) of weights, shape (outputs, inputs), and offsets, shape (outputs,), or None for
    zeros; one pair is a linear policy. With shapes (n, outputs, inputs) and (n, outputs) world i has a policy of its own, the i-th. activation:
    ``"tanh"`` or ``"relu"`` between layers. ``policy(observation, i=0)`` evaluates the i-th alone, with the same bits.
    """

    def __new__(
        cls, layers: Sequence[tuple[ArrayLike, ArrayLike | None]], *, activation: Literal["tanh", "relu"] = "tanh"
    ) -> Policy: ...
    def __call__(self, observation: ArrayLike, i: int = 0) -> _Floats: ...

@final
class LinearizedStep:
    """The derivative of a step, see ``World.linearize``. ``A, B = world.linearize()`` unpacks it."""

    @property
    def A(self) -> _Floats:  # noqa: N802
        """The derivative by the state, shape (2n, 2n) for n degrees of freedom."""
    @property
    def B(self) -> _Floats:  # noqa: N802
        """The derivative by generalized forces that are constant over the step, shape (2n, n)."""
    @property
    def objects(self) -> list[tuple[str, int, int]]:
        """Names of the objects that move, and the range (first, end) of each in the n degrees of freedom."""
    @property
    def switches(self) -> list[tuple[str, tuple[str, str] | None]]:
        """Kinks of the step next to its state, at which the derivative is that of one side: ``"gap"`` (a contact or a limit
        closes or is open), ``"overlap"`` (is corrected or within the tolerance), ``"force"`` (presses or
        separates), ``"friction"`` (sticks or slides, or a motor reaches its bound), each with the names of the two
        objects in contact, or None.
        """
    @property
    def one_sided(self) -> list[int]:
        """Columns of ``[A B]`` that are one-sided, since the number of contacts or impacts is another on the other side."""
    @property
    def across(self) -> list[int]:
        """Columns of ``[A B]`` differenced across a jump, since the number of contacts or impacts is another on both sides."""
    @property
    def residual(self) -> float:
        """Largest error of the contact solutions that are differentiated, m/s."""
    @property
    def indeterminate(self) -> bool:
        """Whether rigid contact leaves velocities open: redundant contacts, as four corners of a box that slides and turns, may share
        forces in other ways with other friction. The derivative is that of the nearest solution.
        """
    def __iter__(self) -> Iterator[_Floats]: ...

@final
class StepReport:
    """Statistics of one step; see ``World.report``."""
    @property
    def substeps(self) -> int:
        """Committed sub-steps."""
    @property
    def tries(self) -> int:
        """``backtracking``: integrations, including those that were rolled back."""
    @property
    def inner_steps(self) -> int:
        """``backtracking`` with ``dormand_prince``: inner steps, including rejected ones."""
    @property
    def floor_hits(self) -> int:
        """``backtracking``: sub-steps of minimal length, which accept a crossing and project it out."""
    @property
    def contacts(self) -> int:
        """Contacts of the last sub-step."""
    @property
    def impact_passes(self) -> int:
        """Passes of the impact phase."""
    @property
    def residual(self) -> float:
        """Largest residual of any solve, m/s."""
    @property
    def unconverged(self) -> int:
        """Solves that did not reach the solver's tolerance."""
    @property
    def worst_objects(self) -> list[str]:
        """Names of the objects, one or two, on which the row with the largest residual acts; empty if
        nothing was solved, or without any error.
        """
    @property
    def worst_island_objects(self) -> int:
        """Objects of the island of that row (``World.islands`` lists them)."""
    @property
    def worst_island_rows(self) -> int:
        """Rows of that island."""
    @property
    def worst_tolerance(self) -> float:
        """Largest residual with which that solve counts as converged, m/s."""
    @property
    def worst_converged(self) -> bool:
        """Whether that solve reached its tolerance."""
    @property
    def rays(self) -> int:
        """Solves that ended on a secondary ray."""
    @property
    def iterations(self) -> int:
        """Iterations of the largest solve."""
    @property
    def relaxations(self) -> int:
        """Work of all solves in block relaxations, which ``World.budget`` bounds."""
    @property
    def asleep(self) -> int:
        """Objects asleep at the end of the step."""
    @property
    def max_penetration(self) -> float:
        """Deepest penetration found, meters."""
    @property
    def max_turn(self) -> float:
        """Largest angle by which the forces of joints turn a part back and forth in a sub-step, rad
        (``World.max_turn``).
        """
    @property
    def unreachable_joint(self) -> str | None:
        """Name of the loop joint with the largest gap among those that cannot be closed; None if all
        can be.
        """
    @property
    def unreachable_distance(self) -> float:
        """Gap of that joint, meters."""

@final
class SphereRobot:
    """A robot whose links are covered by spheres, as motion planners use them: that of
    ``tumble spheretree --urdf``.

    Made by ``SphereRobot.from_urdf``.
    """
    @staticmethod
    def from_urdf(
        path: _Path,
        *,
        spheres: int | None = None,
        spheres_of: Mapping[str, int] | None = None,
        coverage: float | None = None,
        coverage_of: Mapping[str, float] | None = None,
        weight: float | None = None,
        weight_of: Mapping[str, float] | None = None,
        max_error: float | None = None,
        packages: Mapping[str, _Path] | None = None,
        missing_meshes: MissingMeshes = "error",
        method: TreeMethod = "medial",
        cache: bool = True,
    ) -> SphereRobot:
        """Reads a URDF and covers the outer surface of the collision shapes of each link by spheres.

        spheres: largest number of spheres of a link, 1 to 10,000 (default 32, with max_error 10,000);
        spheres_of: that of links by name. coverage: share of the outer surface of a link, by area, that is
        covered at least, above 0 and at most 1 (default 1, with weight no bound); coverage_of: that of links by
        name. weight: 0 (nothing outside) to 1 (full coverage): minimizes ``weight`` times the share of the surface
        that is not covered plus ``1 - weight`` times the volume outside over that of the link (default: the set that
        reaches the least far outside); weight_of: that of links by name. max_error: spheres that
        reach at most this far outside are not divided, as a fraction of the link's diagonal (default 0.001).
        packages: folders by name, for ``package://NAME/…``. missing_meshes: ``"error"`` or ``"skip"``. method:
        the sphere trees that are tried, as in ``SphereTree.build``. cache: whether trees are kept on disk.

        Names of links that do not exist, numbers out of range, and files that cannot be read raise
        ``InvalidValueError``, ``UnreadableFileError`` or ``SceneError`` with the reason. The interpreter is released meanwhile;
        Ctrl-C ends the work.
        """
    @property
    def name(self) -> str:
        """Name of the robot."""
    @property
    def urdf(self) -> str:
        """The URDF with spheres as collision geometry, a text. All else in it is that of the file."""
    @property
    def notes(self) -> list[str]:
        """Notes about the file and its meshes."""
    @property
    def links(self) -> dict[str, LinkSpheres]:
        """The spheres by the name of the link, in the order of the file: each a ``LinkSpheres``."""
    def overlaps(self, positions: Mapping[str, float] | None = None) -> list[tuple[str, str, float, bool]]:
        """Returns the pairs of links whose spheres overlap: two names, the depth in meters, and whether the
        links are adjacent.

        positions: positions of joints by name, rad or m; others are at 0, or at the limit next to it. A name
        that is no joint with one degree of freedom raises ``InvalidValueError``.
        """
    def ignored_pairs(
        self, poses: Sequence[Mapping[str, float]] | None = None, sample_poses: int = 0
    ) -> list[tuple[str, str]]:
        """Returns the pairs of links that a planner need not compare: adjacent ones, those that overlap at one
        of ``poses``, which are taken to be free (without any at the zero pose), and those that overlap at all
        of ``sample_poses`` poses, which are evenly distributed within the limits.

        poses: dicts as in ``overlaps``, at most 1,000,000 with the samples.
        """

@final
class SphereTree:
    """Nested spheres around a closed mesh. Every sphere contains those of its children, and the
    spheres of each level cover the surface.

    Made by ``SphereTree.build`` or ``SphereTree.load``. All numbers are in the axes of the given
    mesh, meters.
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

        vertices: shape (n, 3), meters, and faces: shape (m, 3), indices from 0, counter-clockwise
        seen from outside; or the path of an OBJ, STL or COLLADA file; or an object with
        ``vertices`` and ``faces``, such as a trimesh. method: ``"medial"`` (adaptive medial axis,
        the tightest), ``"hubbard"``, ``"grid"`` or ``"octree"``. branching: largest number of
        children of a sphere, 2 to 64 (default 8). depth: largest number of levels below the root, 1
        to 9 (default 3, for the octree 7). max_error: spheres that reach less than this outside are
        not divided, as a fraction of the mesh's diagonal, 1e-4 to 1 (default 1e-4, for the octree
        0.01). cache: whether to keep the tree on disk and read it from there next time.

        A mesh that is open or encloses nothing, and settings out of range, raise
        ``InvalidValueError``. The interpreter is released meanwhile; Ctrl-C ends the build.
        """
    @staticmethod
    def load(path: _Path) -> SphereTree:
        """Reads a tree that ``save`` or ``tumble spheretree --output`` wrote. Any other file raises
        ``InvalidValueError`` with the reason.
        """
    def save(self, path: _Path) -> None:
        """Writes the tree and its metrics as JSON: the file of ``tumble spheretree --output``."""
    def to_json(self) -> str:
        """Returns the JSON text that ``save`` writes."""
    @property
    def name(self) -> str:
        """Name of the mesh: that of its file, or ``"mesh"``."""
    @property
    def method(self) -> TreeMethod:
        """The method that built it."""
    @property
    def branching(self) -> int:
        """Largest allowed number of children of a sphere."""
    @property
    def depth(self) -> int:
        """Largest allowed number of levels below the root."""
    @property
    def levels(self) -> tuple[SphereLevel, ...]:
        """The levels, the root's first: each a ``SphereLevel`` of ``centers``, shape (n, 3), and
        ``radii``, shape (n,), meters. Every level covers the solid by itself: a leaf above the last
        level is repeated in the levels below.
        """
    @property
    def parents(self) -> tuple[NDArray[np.int64], ...]:
        """For each level, the index of each sphere's parent in the level above, shape (n,); -1 for the
        root.
        """
    @property
    def outward_error(self) -> float:
        """Upper bound of the distance by which the spheres of the last level reach outside the solid,
        meters. Proved, not sampled.
        """
    @property
    def quality(self) -> dict[str, NDArray[Any]]:
        """The metrics of the levels, measured by samples: a dict of arrays with one number per level.
        Lengths are fractions of the mesh's diagonal.

        ``level``, ``spheres``; ``coverage``: fraction of the surface inside the spheres;
        ``protrusion_mean``, ``protrusion_p95``, ``protrusion_max``: distance of the spheres'
        surface outside the solid; ``gap_mean``, ``gap_max``: distance of uncovered surface from the
        spheres; ``volume_ratio``: volume of the spheres over that of the solid; ``nesting_broken``:
        spheres that extend beyond their parents.
        """
    def report(self, verbose: bool = False) -> str:
        """Returns the metrics as the table that ``tumble spheretree`` prints. verbose: with more
        columns and the work of the builder's stages.
        """
    def __len__(self) -> int: ...

@final
class View:
    """The world as a force or a behavior sees it during a call: a row for every rigid body and every
    link, in world axes.

    The arrays are read-only copies, except ``force`` and ``torque``, which start at zero and to
    which the callback adds. After the callback has returned the view raises ``RemovedError``.
    """
    @property
    def time(self) -> float:
        """Simulated time of this evaluation, s. Within a step it may be anywhere in it."""
    @property
    def gravity(self) -> _Floats:
        """Gravity, shape (3,), m/s²."""
    @property
    def position(self) -> _Floats:
        """Positions of the centers of mass, shape (n, 3), m."""
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
        """Accelerations of the same points at the last force evaluation, shape (n, 3), m/s²."""
    @property
    def angular_acceleration(self) -> _Floats:
        """Angular accelerations at the same time, shape (n, 3), rad/s²."""
    @property
    def mass(self) -> _Floats:
        """Masses, shape (n,), kg; 0 for static geometry and for bases."""
    @property
    def moves(self) -> NDArray[np.bool_]:
        """Whether forces move it: dynamic and enabled. Shape (n,), bool."""
    @property
    def names(self) -> list[str]:
        """Name of the body of each row."""
    @property
    def force(self) -> _Floats:
        """Forces at the centers of mass (``position``), shape (n, 3), N, world axes. Callbacks add to
        it.
        """
    @force.setter
    def force(self, value: ArrayLike) -> None: ...
    @property
    def torque(self) -> _Floats:
        """Torques, shape (n, 3), N·m, world axes. Callbacks add to it."""
    @torque.setter
    def torque(self, value: ArrayLike) -> None: ...
    def row(self, body: _Body, part: int | str | None = None) -> int:
        """Returns the row of a rigid body, given by name or as a handle. For an articulated body
        ``part`` is the name of a link or a row number among its rows. A link that is fixed to
        another has the row of that one.
        """
    def rows(self, body: _Body) -> slice:
        """Returns the rows of a body as a slice: one for a rigid body; for an articulated body one for
        each moving link, parents first, and one for its base at the end.
        """
    def apply_force(self, row: int, force: ArrayLike, point: ArrayLike) -> None:
        """Adds a force, shape (3,), N, on a row at a point of the world, shape (3,), m: with the
        torque ``(point - position) × force``.
        """
    def __len__(self) -> int: ...

@final
class Recorder:
    """Writes an MCAP file that Foxglove and ``tumble.read`` open: ``with tumble.Recorder("run.mcap")
    as recorder: recorder.frame(world)``.

    The file is created by the first frame. After a crash the file is readable up to the last
    quarter of a simulated second.
    """
    def __new__(cls, path: _Path, *, cameras: bool = False) -> Recorder: ...
    def frame(self, world: World) -> None:
        """Adds the present frame: visuals, poses, contacts and state. Frames must be added in the order of time,
        each once.
        """
    def run(self, world: World, n: int, *, every: int = 1) -> None:
        """Steps the world ``n`` times and adds a frame after every ``every`` steps. If nothing is
        recorded yet, a frame is also added before the first step.
        """
    def close(self) -> None:
        """Writes index and checksums and closes the file. Later calls do nothing. A recording without
        a frame leaves no file.
        """
    @property
    def frames(self) -> int:
        """Frames added so far."""
    @property
    def path(self) -> Path:
        """Path of the file."""
    def __enter__(self) -> Recorder: ...
    def __exit__(self, _kind: Any, _error: Any, _trace: Any, /) -> None: ...

def show_contacts(world: World, names: list[str], contacts: bytes) -> None:
    """Shows recorded contacts as those of a world's last step. They refer to bodies by their indices in
    ``names``.
    """

def read_recording(path: _Path) -> dict[str, Any]:
    """Returns all of a recording, as the arguments of `Recording`."""

@final
class Batch:
    """``n`` worlds of one model that are stepped together on all cores, each under controls of its own.

    world: the model; the batch has forks of it and leaves it alone. threads: largest number of
    threads, by default one for each core; no number changes a bit of any world, and each moves as it
    would alone. articulations: the articulated bodies that ``controls``, ``q`` and ``v`` are about,
    by default all, one after the other in the order of ``world.bodies``. configure: called as
    ``configure(world, i)`` for each world, to change masses, frictions, drives, poses or states; it
    may not add or remove bodies. What it leaves is what ``reset`` goes back to.

    Arrays have one row for each world. The same array is returned at each access, is read-only, and
    follows ``step`` and ``reset``; copy what is to be kept. An array costs nothing before its first
    access.
    """
    def __new__(
        cls,
        world: World,
        n: int,
        *,
        threads: int | None = None,
        articulations: Sequence[Articulation | str] | None = None,
        configure: Callable[[World, int], Any] | None = None,
    ) -> Batch: ...
    def step(
        self,
        controls: ArrayLike | None = None,
        substeps: int = 1,
        *,
        targets: ArrayLike | None = None,
        policy: Policy | None = None,
        mask: ArrayLike | None = None,
    ) -> None:
        """Advances each world by ``substeps`` steps of its ``dt``, from 0 to 2**40, with the interpreter released; Ctrl-C
        stops all of them between two steps.

        controls: generalized forces on the degrees of freedom of the articulations, N·m and N, shape
        (n, dof), or (dof,) for all worlds; they act in every step until they are set again. None
        leaves them. policy: a ``Policy`` instead, evaluated before each step: its inputs are ``q``, then ``v`` of the world, its
        outputs the forces, of which the last ones go on acting. targets: of the position drives, rad or m, of the same shapes; numbers for
        degrees of freedom without such a drive have no effect. mask: which worlds step, booleans of
        shape (n,); None: all.

        A world that fails raises ``StepError`` with its number, after all others have stepped:
        ``failed`` says which. It stays as before the step that failed, and ``reset`` serves it as any
        other.
        """
    def reset(
        self,
        mask: ArrayLike | None = None,
        state: ArrayLike | None = None,
        *,
        q: ArrayLike | None = None,
        v: ArrayLike | None = None,
    ) -> None:
        """Takes worlds back to the state in which the batch was made, contacts and the forces of the last
        step excepted.

        mask: which worlds, booleans of shape (n,); None: all. state: states instead, as ``state``; q,
        v: positions and velocities of the articulations instead, as ``q`` and ``v``; each of them one row
        or a row for each world, of which those of other worlds are not used. Masses, drives and other
        constants stay as they are.

        A row that is no state raises ``InvalidValueError`` with the number of its world, which is at its
        start then.
        """
    def set_drives(
        self,
        *,
        target: ArrayLike | None = None,
        velocity: ArrayLike | None = None,
        stiffness: ArrayLike | None = None,
        damping: ArrayLike | None = None,
        max_force: ArrayLike | None = None,
    ) -> None:
        """Sets the drives of all degrees of freedom of the articulations in all worlds; those of which all
        numbers are 0 or None have none then.

        Arguments as in ``Articulation.set_drive``: one number for all joints, shape (dof,) or (n, dof). A
        spherical joint has three columns, and a floating root six, which must be 0. Drives and their
        targets are no part of the state, so ``reset`` leaves them.
        """
    def set_body(
        self,
        name: str,
        *,
        mass: ArrayLike | None = None,
        friction: ArrayLike | None = None,
        restitution: ArrayLike | None = None,
    ) -> None:
        """Sets constants of the rigid body of that name, each one number for all worlds or one for each, shape (n,); None leaves
        them. mass: kg, with the inertia in proportion. friction, restitution: its coefficients. Velocities stay. They are no part
        of the state, so ``reset`` leaves them.

        A number out of range raises ``InvalidValueError`` with the number of the world; worlds before it have their new ones.
        """
    @property
    def worlds(self) -> list[World]:
        """The worlds: a new list. They are the batch's own, and what is changed in them counts from the
        next step on. From the first access on, each access to an array reads all worlds.
        """
    def world(self, index: int) -> World:
        """Returns the world of a number; negative ones count from the end."""
    def __len__(self) -> int: ...
    @property
    def dof(self) -> int:
        """Number of columns of ``controls`` and ``v``."""
    @property
    def threads(self) -> int:
        """Number of threads that step the worlds."""
    @property
    def failed(self) -> NDArray[np.bool_]:
        """Which worlds failed in the last ``step`` or ``reset``: a new array of booleans, shape (n,)."""
    @property
    def time(self) -> _Floats:
        """Simulated times, s, shape (n,)."""
    @property
    def state(self) -> _Floats:
        """The states, as ``World.state``, shape (n, len(state))."""
    def sensor(self, name: str) -> _Floats:
        """Readings of the measuring sensor of that name, shape (n, k): a view of ``state``."""
    @property
    def q(self) -> _Floats:
        """Positions of the articulations, as ``Articulation.q``, one after the other: shape (n, nq)."""
    @property
    def v(self) -> _Floats:
        """Velocities of the articulations, as ``Articulation.qd``, one after the other: shape (n, dof)."""
    @property
    def positions(self) -> _Floats:
        """Positions of all bodies, as ``World.positions``: shape (n, bodies, 3), m."""
    @property
    def orientations(self) -> _Floats:
        """Orientations of all bodies, quaternions (x, y, z, w): shape (n, bodies, 4)."""
    @property
    def velocities(self) -> _Floats:
        """Velocities of all bodies, as ``World.velocities``: shape (n, bodies, 3), m/s."""
    @property
    def angular_velocities(self) -> _Floats:
        """Angular velocities of all bodies, world axes: shape (n, bodies, 3), rad/s."""
    @property
    def contact_forces(self) -> _Floats:
        """Sum of the contact forces on each body, ``force`` of ``World.contacts``: shape (n, bodies, 3),
        N, world axes.
        """
    @property
    def link_contact_forces(self) -> _Floats:
        """Sum of the contact forces on each link of the articulations, in the order of their
        ``link_names``: torque about the world's origin, N·m, then force, N; shape (n, links, 6), world
        axes.
        """
    @property
    def contact_counts(self) -> _Floats:
        """Number of contacts of the last step: shape (n,), of whole numbers as floats."""

@final
class World:
    """A world of bodies that moves in steps of ``dt`` seconds. SI units, radians, z up; quaternions
    are (x, y, z, w).

    gravity: shape (3,), m/s². dt: length of a step, s. stepper: ``"time_stepping"`` or
    ``"backtracking"``. integrator: ``"verlet"``, ``"symplectic_euler"``, ``"explicit_euler"``,
    ``"rk4"`` or ``"dormand_prince"``; used by ``"backtracking"``, since ``"time_stepping"`` has its
    own midpoint rule. solver: ``"gauss_seidel"``, ``"lcp_pyramid"`` or ``"lcp_sliding"``. substeps:
    sub-steps of each step. iterations: largest number of solver sweeps. contact_tolerance: meters.
    integrator_tolerance: for ``dormand_prince``. sleep_after: seconds after which islands that
    moved by less than sleep_within (meters) sleep until something touches them; None: never.
    combine_restitution, combine_friction: rule for the coefficients of a pair, ``"min"``,
    ``"max"``, ``"average"``, ``"product"`` or ``"geometric_mean"``. threads: threads of a step, 0 for
    as many as cores; no number changes the result. budget: largest work of a step in block
    relaxations, None for no bound. event_impulse: N·s, see ``events``. max_turn: largest angle, rad, by
    which forces of joints may turn a part back and forth in a sub-step; frames are divided so that they do not.
    drift_tolerance: meters, None: 1e-4, or contact_tolerance if that is larger. recovery_speed: at which overlap is
    corrected, m/s. projection_sweeps: largest number of sweeps of that correction. stabilize_positions: whether
    positions of joints are corrected. solver_tolerance: a sweep that changes no velocity by more than this ends a
    solve, m/s. max_relaxations: largest number of block relaxations of a step in sweeps beyond the first 25.
    Names and defaults are those of scene files.

    One thread at a time: while one thread steps a world, calls on it from another raise
    ``BusyError``. The interpreter is released while a world steps.
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
        integrator_tolerance: float = 1e-10,
        sleep_after: float | None = None,
        sleep_within: float = 1e-5,
        combine_restitution: Combine = "max",
        combine_friction: Combine = "geometric_mean",
        threads: int = 1,
        budget: int | None = None,
        event_impulse: float = 0.0,
        max_turn: float = 1.0,
        drift_tolerance: float | None = None,
        recovery_speed: float = 3.0,
        projection_sweeps: int = 15,
        stabilize_positions: bool = True,
        solver_tolerance: float = 1e-9,
        max_relaxations: int = 20000,
    ) -> World: ...
    @staticmethod
    def load(
        path_or_name: _Path,
        *,
        dt: float | None = None,
        stepper: Stepper | None = None,
        integrator: Integrator | None = None,
        solver: Solver | None = None,
        threads: int | None = None,
        budget: int | None = None,
        keyframe: str | None = None,
    ) -> World:
        """Loads the world of a scene: the path of a ``scene.toml`` or of its folder, the name of a
        shipped scene, or the path of a robot (``.urdf``), a model of MuJoCo (``.xml``) or a mesh.

        keyframe: name or number of the keyframe that a model of MuJoCo starts in. The other arguments
        override the settings of the file. A missing file or an unknown name raises
        ``MissingFileError`` (a ``FileNotFoundError``); a file with problems raises ``SceneError``
        (a ``ValueError``), which lists all of them with line and column.
        """
    @staticmethod
    def parse(text: str) -> World:
        """Builds the world of a scene from the text of its file."""
    @property
    def notes(self) -> list[str]:
        """Notes about the world: a list of sentences.

        They are about the files of a scene and of added articulations, such as repairs of a mesh or
        a convex hull instead of an open mesh; about visual meshes that could not be read, once
        something has drawn them; and about bodies that overlap at the start, the deepest eight by
        name. Overlaps are searched for if this is read before the first step.
        """
    def step(self, n: int = 1) -> None:
        """Advances by ``n`` steps of ``dt``. The interpreter is released meanwhile; Ctrl-C stops
        between two steps.

        After a ``StepError`` the world is as before the step that failed; earlier steps are kept.
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
    def threads(self) -> int:
        """Threads of a step, 0 for as many as cores. No number changes the result. Forks have the same
        number; an unpickled world has 1.
        """
    @threads.setter
    def threads(self, value: int) -> None: ...
    @property
    def budget(self) -> int | None:
        """Largest work of a step in block relaxations (``report.relaxations`` is the work of the last
        one), None for no bound. A step that needs more is less accurate, and ``report.residual`` says by
        how much. The same budget gives the same result on every machine. It may change between any two
        steps, and wakes nothing.
        """
    @budget.setter
    def budget(self, value: int | None) -> None: ...
    @property
    def combine_restitution(self) -> Combine:
        """Combination rule for restitution: ``"min"``, ``"max"``, ``"average"``, ``"product"`` or
        ``"geometric_mean"``.
        """
    @combine_restitution.setter
    def combine_restitution(self, value: Combine) -> None: ...
    @property
    def combine_friction(self) -> Combine:
        """Combination rule for friction."""
    @combine_friction.setter
    def combine_friction(self, value: Combine) -> None: ...
    def set_pair_material(
        self,
        a: _Body | str,
        b: _Body | str,
        *,
        restitution: float | None = None,
        friction: float | None = None,
        rolling_friction: float | None = None,
        torsional_friction: float | None = None,
        collides: bool | None = None,
    ) -> None:
        """Sets restitution and the frictions of the contacts of two bodies from the next step on,
        overriding the combination rules, and whether they collide at all.

        a, b: handles or names in any order; ``"ARTICULATION/LINK"`` is a link of an articulation
        with the links fixed to it. rolling_friction, torsional_friction: m, at least 0. None keeps the rule; without all the pair has no constants of
        its own any more. collides: False ignores the pair; True does not override groups and masks. Forks have the same pairs. ``save`` does not include them, as it does not
        include materials.
        """
    def pair_material(self, a: _Body | str, b: _Body | str) -> tuple[float, float]:
        """Returns restitution and friction of the contacts of two bodies: the pair's own constants if
        set, else those of the combination rules.

        a, b: as in ``set_pair_material``. An articulation is represented by its first shape.
        """
    @property
    def stepper(self) -> Stepper:
        """Name of the stepper."""
    @property
    def solver(self) -> Solver:
        """Name of the contact solver."""
    @property
    def integrator(self) -> Integrator:
        """Name of the integrator."""
    @property
    def bodies(self) -> Bodies:
        """All bodies in the order in which they were added, by number or by name."""
    def body(self, name: str) -> RigidBody:
        """Returns the rigid body, or static geometry, of that name. An articulation or an unknown name
        raises ``UnknownNameError``.
        """
    def articulation(self, name: str) -> Articulation:
        """Returns the articulated body of that name. A rigid body or an unknown name raises
        ``UnknownNameError``.
        """
    def __getitem__(self, name: str, /) -> Any: ...
    @property
    def contacts(self) -> NDArray[np.void]:
        """The contacts of the last step: a structured array with one row each.

        Fields: ``bodies`` (2,), indices in ``world.bodies``, -1 for other objects; ``parts`` (2,),
        for articulated bodies the indices of the links in their ``link_names``; ``shapes`` (2,), as
        ``shape`` in ``cast_rays``, whose names ``shape_name`` returns; ``point`` (3,), m;
        ``normal`` (3,), unit, from the second body to the first; ``depth``, m, negative while
        apart; ``velocity`` (3,) of the first relative to the second before the contact was solved,
        m/s; ``impulse`` (3,) on the first over the last sub-step, N·s; ``force`` (3,), N, without
        impacts. World axes.
        """
    @property
    def positions(self) -> _Floats:
        """Positions of all bodies, as ``body.position``, in the order of ``bodies``: a read-only copy of shape
        (n, 3), m; for an articulation that of its first link. Setting it, as in
        ``world.positions = world.positions + (0, 0, 1)``, moves the rigid bodies whose
        rows change and keeps their velocities; rows of articulations must stay as they are.
        """
    @positions.setter
    def positions(self, value: ArrayLike) -> None: ...
    @property
    def orientations(self) -> _Floats:
        """Orientations of all bodies, quaternions (x, y, z, w), shape (n, 4); otherwise as ``positions``."""
    @orientations.setter
    def orientations(self, value: ArrayLike) -> None: ...
    @property
    def velocities(self) -> _Floats:
        """Velocities of the centers of mass of all bodies, for an articulation of the origin of its first
        link, shape (n, 3), m/s; otherwise as ``positions``.
        """
    @velocities.setter
    def velocities(self, value: ArrayLike) -> None: ...
    @property
    def angular_velocities(self) -> _Floats:
        """Angular velocities of all bodies, world axes, shape (n, 3), rad/s; otherwise as ``positions``."""
    @angular_velocities.setter
    def angular_velocities(self, value: ArrayLike) -> None: ...
    def contact_force(self, a: _BodyOrLink, b: _BodyOrLink) -> _Floats:
        """Returns the sum of the contact forces of ``a`` on ``b`` in the last sub-step, shape (3,), N, world axes, without impacts; zero if
        they do not touch.

        a, b: a body, an articulation or a link: a handle, a name, ``"ARTICULATION/LINK"`` or (articulation, link). A link is its own
        shapes, without those of links fixed to it.
        """
    @property
    def events(self) -> list[Event]:
        """The events of the last step, a list of ``Event`` tuples: ``kind``, ``a``, ``b``, ``parts``,
        ``impulse``, ``point``, ``shapes``, ``shape_names``, ``links``.

        kind: ``"contact_begin"``, ``"contact_persist"`` (in contact in the step before too),
        ``"contact_end"``, ``"sensor_begin"``, ``"sensor_end"``, ``"asleep"``, ``"awake"``, ``"joint_broken"``. a, b: handles
        of the bodies, the sensor first, or the joint; b is None for sleep and joints. parts: the touched links, as in
        ``contacts``. impulse: on ``a`` over the step, shape (3,), N·s; point: where the largest one
        acts, shape (3,), m; both zero for all but contacts that begin or persist. World axes. shapes, shape_names: the shapes
        that touch there, as in ``contacts``, and their names. links: names of the touched links, fixed ones too.

        Two bodies are in contact in a step if their surfaces touch or an impulse acts between them, of
        at least ``event_impulse`` of the world. Of ``step(n)`` the last step counts. Pairs in contact
        are part of ``save``; a restored world has no events before its next step.
        """
    @property
    def event_impulse(self) -> float:
        """Smallest impulse of a pair in a step with which it counts as in contact, N·s, at least 0:
        weaker contacts make no ``events``.
        """
    @event_impulse.setter
    def event_impulse(self, value: float) -> None: ...
    @property
    def max_turn(self) -> float:
        """Largest angle, rad, 0.01 to 1e6, by which forces of joints may turn a part back and forth in a
        sub-step. A frame in which a part turns further is taken in sub-steps that are short enough;
        chains of light links with a heavy end need it. 1 by default.
        """
    @max_turn.setter
    def max_turn(self, value: float) -> None: ...
    @property
    def substeps(self) -> int:
        """Sub-steps of each step."""
    @substeps.setter
    def substeps(self, value: int) -> None: ...
    @property
    def iterations(self) -> int:
        """Largest number of solver sweeps."""
    @iterations.setter
    def iterations(self, value: int) -> None: ...
    @property
    def max_relaxations(self) -> int:
        """Largest number of block relaxations of a step in sweeps beyond the first 25."""
    @max_relaxations.setter
    def max_relaxations(self, value: int) -> None: ...
    @property
    def solver_tolerance(self) -> float:
        """A sweep that changes no velocity by more than this ends a solve, m/s."""
    @solver_tolerance.setter
    def solver_tolerance(self, value: float) -> None: ...
    @property
    def projection_sweeps(self) -> int:
        """Largest number of sweeps of the correction of overlap."""
    @projection_sweeps.setter
    def projection_sweeps(self, value: int) -> None: ...
    @property
    def stabilize_positions(self) -> bool:
        """Whether positions of joints are corrected, and not their velocities alone."""
    @stabilize_positions.setter
    def stabilize_positions(self, value: bool) -> None: ...
    @property
    def contact_tolerance(self) -> float:
        """Surfaces closer than this are in contact in ``"backtracking"``, m."""
    @contact_tolerance.setter
    def contact_tolerance(self, value: float) -> None: ...
    @property
    def drift_tolerance(self) -> float:
        """Depth that a lasting contact may reach within a sub-step, m, at least ``contact_tolerance``."""
    @drift_tolerance.setter
    def drift_tolerance(self, value: float) -> None: ...
    @property
    def recovery_speed(self) -> float:
        """Largest speed at which overlap and open joints are corrected, m/s."""
    @recovery_speed.setter
    def recovery_speed(self, value: float) -> None: ...
    @property
    def integrator_tolerance(self) -> float:
        """Error of an inner step of ``"dormand_prince"``, m, rad, m/s and rad/s."""
    @integrator_tolerance.setter
    def integrator_tolerance(self, value: float) -> None: ...
    @property
    def sleep_after(self) -> float | None:
        """Seconds after which islands that moved by less than ``sleep_within`` sleep until something touches them; None:
        never.
        """
    @sleep_after.setter
    def sleep_after(self, value: float | None) -> None: ...
    @property
    def sleep_within(self) -> float:
        """Largest displacement of any point of an island at rest during ``sleep_after``, m. Settable while that is not None."""
    @sleep_within.setter
    def sleep_within(self, value: float) -> None: ...
    def shape_name(self, body: int | _Body, part: int, shape: int) -> str | None:
        """Returns the name of a shape, or None if it has none, by the numbers that ``contacts`` and queries report.

        body: number in ``bodies``, a handle or a name; part, shape: the numbers beside it.
        """
    def cast_rays(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        max_distance: ArrayLike | None = None,
        *,
        group: int = 0,
        mask: int | Sequence[int] | None = None,
        ignore: _BodyOrLink | Sequence[_BodyOrLink] | None = None,
        as_body: _BodyOrLink | None = None,
    ) -> NDArray[np.void]:
        """Returns where rays enter bodies: a structured array with one row per ray.

        origins, directions: shape (3,) or (n, 3), m; directions of any length above 0. One of either
        serves all. max_distance: length of the rays, m, a number or shape (n,); None: unlimited.

        Fields: ``distance``, m, infinite for a miss; ``body``, its number in ``world.bodies``, -1 for
        a miss; ``part``, for an articulation the index of the link in its ``link_names``; ``shape``, the
        index of a compound's part, and on a link that among its shapes that collide, in their order; ``face``,
        the index of a mesh's triangle, 0 to 5 for -x, +x, -y, +y, -z and +z of a box, 0 to 2 for side,
        -z end and +z end of a cylinder, of a compound the face of that part, else 0; ``normal`` (3,), unit, outward, world axes.

        A ray that starts inside a convex shape does not meet that shape; a mesh is hit on its outside
        only. group, mask, ignore: the query has a collision group (0 to 63) and a mask (the
        groups that it finds, as bits of an integer or a sequence; None for all) like a body, and does not find the ignored bodies and links (handles, a
        name, ``"ARTICULATION/LINK"``, (articulation, link), or a list of them). as_body: a body or a link; the query then finds only what could have contacts
        with it, by groups, masks, pairs and excluded links. Sensors are not found. Runs on ``threads`` threads, which change no bit.
        """
    def cast_shape(
        self,
        shape: Shape,
        direction: ArrayLike,
        max_distance: float,
        position: ArrayLike | None = None,
        orientation: ArrayLike | None = None,
        *,
        group: int = 0,
        mask: int | Sequence[int] | None = None,
        ignore: _BodyOrLink | Sequence[_BodyOrLink] | None = None,
        as_body: _BodyOrLink | None = None,
    ) -> np.void | None:
        """Returns the first body that a shape touches if it moves along a direction without rotation, or
        None.

        direction: shape (3,), of any length above 0, world axes. max_distance: how far it moves, m,
        finite. position, orientation: where it starts. Fields: ``distance``, m, 0 if it overlaps at
        the start; ``body``, ``part``, ``shape`` and the filter as in ``cast_rays``; ``point`` (3,), m;
        ``normal`` (3,), unit, from the body towards the shape.
        """
    def overlaps(
        self,
        shape: Shape,
        position: ArrayLike | None = None,
        orientation: ArrayLike | None = None,
        *,
        group: int = 0,
        mask: int | Sequence[int] | None = None,
        ignore: _BodyOrLink | Sequence[_BodyOrLink] | None = None,
        as_body: _BodyOrLink | None = None,
    ) -> NDArray[np.void]:
        """Returns the bodies that overlap a shape at a pose: a structured array with the fields ``body``,
        ``part`` and ``shape``, as in ``cast_rays``, and ``depth``, that of the deepest contact, m.

        position, orientation: as in ``add_rigid``. group, mask, ignore, as_body: as in ``cast_rays``.
        """
    def closest_points(
        self,
        a: _BodyOrLink | Shape,
        b: _BodyOrLink | None = None,
        *,
        position: ArrayLike | None = None,
        orientation: ArrayLike | None = None,
        group: int = 0,
        mask: int | Sequence[int] | None = None,
        ignore: _BodyOrLink | Sequence[_BodyOrLink] | None = None,
        as_body: _BodyOrLink | None = None,
    ) -> np.void | None:
        """Returns the closest points of two bodies or links, or of a shape at a pose and a body or link, the nearest one
        if ``b`` is None. None if one has no shape or is disabled. Two links may be of one articulation.

        a: a body or link (a handle, a name, ``"ARTICULATION/LINK"`` or (articulation, link)), or a shape; b: a body or link. position, orientation: of a shape. Fields: ``distance``, m, the
        negative depth if they overlap; ``bodies`` (2,), ``parts`` (2,) and ``shapes`` (2,) as in ``contacts``, -1
        for a shape; ``points`` (2, 3), on the surfaces, world, m; ``normal`` (3,), unit, from the second to
        the first. group, mask, ignore, as_body: of a shape, as in ``cast_rays``.
        """
    def contains(
        self, point: ArrayLike, *, group: int = 0, mask: int | Sequence[int] | None = None, ignore: _BodyOrLink | Sequence[_BodyOrLink] | None = None, as_body: _BodyOrLink | None = None
    ) -> NDArray[np.int64]:
        """Returns the numbers in ``world.bodies`` of the bodies that contain a point: shape (k,).

        point: shape (3,), m. The surface belongs to a body. group, mask, ignore, as_body: as in ``cast_rays``.
        """
    def point_depth(
        self, points: ArrayLike, *, group: int = 0, mask: int | Sequence[int] | None = None, ignore: _BodyOrLink | Sequence[_BodyOrLink] | None = None, as_body: _BodyOrLink | None = None
    ) -> Any:
        """Returns how deep points lie in the bodies: one row for a point of shape (3,), a structured
        array for points of shape (n, 3), m.

        Fields: ``depth``, m, below the surface of the body in which the point is deepest, and for a
        point outside of all bodies minus the distance from the nearest one, minus infinity if there
        is none; ``body``, ``part``, ``shape`` and the filter as in ``cast_rays``; ``point`` (3,), the closest
        point of the surface, m; ``normal`` (3,), unit, outward.
        """
    def energy(self) -> Energy:
        """Returns the mechanical energy of everything that moves: ``kinetic``, ``potential`` (zero at
        the world's origin) and ``total``, J.
        """
    def momentum(self) -> Momentum:
        """Returns the momentum of everything that moves: ``linear`` (3,), N·s, and ``angular`` (3,)
        about the world's origin, N·m·s. World axes.
        """
    @property
    def report(self) -> StepReport:
        """Statistics of the last step."""
    def save_scene(self, path: _Path) -> list[str]:
        """Writes the world as it stands to a scene file (``.toml``), with a folder ``NAME_files`` beside it for
        meshes and the exact state: ``World.load`` of the file goes on with the same bits. Once its text is
        edited, the text counts.

        Returns notes about things that are not in it, such as generalized forces and visuals that scenes do
        not have. Forces and behaviors written in Python, and all else that a scene cannot say, raise
        ``ValueError`` with their names, and nothing is written.
        """
    def save_mjcf(self, path: _Path) -> list[str]:
        """Writes the world as it stands to a model of MuJoCo (``.xml`` or ``.mjcf``), with a folder
        ``NAME_files`` beside it for meshes. The keyframe ``now`` of the model is the present state.

        Returns notes about everything that MJCF cannot say.
        """
    def save(self) -> bytes:
        """Returns everything that the next step reads as bytes, for ``restore`` in a world of the same
        bodies, with the drives that were set since they were added. Shapes, masses and settings are not included.
        """
    def restore(self, snapshot: bytes | bytearray) -> None:
        """Restores the bytes of ``save``. Invalid bytes, or those of another world, raise
        ``SnapshotError`` and change nothing.
        """
    def fork(self) -> World:
        """Returns an independent copy with the same state and the same future.

        Forces and behaviors are copied by their own ``fork``.
        """
    def model(self) -> bytes:
        """Returns the world as bytes for ``simulate``: shapes, masses, settings, drives and its present
        state. Forces and behaviors in Python are no part of them: such a world raises
        ``InvalidValueError`` and is pickled instead.
        """
    def __copy__(self) -> World: ...
    def __deepcopy__(self, _memo: Any) -> World: ...
    def linearize(self) -> LinearizedStep:
        """Returns the derivative of the next step by the state and by generalized forces: ``A, B = world.linearize()``,
        ``dx' = A @ dx + B @ dtau``. The world stays as it is.

        Coordinates, for n degrees of freedom of the objects that move: n of positions, then n of velocities, object by
        object in the order of addition (``objects``). Positions are displacements along generalized velocities: the
        angle of a joint; for a rigid body or a floating root a turn in world axes, rad, then a displacement, m; for
        a spherical joint a turn in the link's axes. Velocities are ``qd``; of a rigid body ω, then v of its center of mass.

        Contacts are differentiated at their active set (which presses, sticks, slides), exactly; free motion and
        forces by differences with an error of about 1e-9 of the largest entry. At a kink the result is the derivative of one side, and ``switches``
        names the contact. The stepper must be ``"time_stepping"`` and the solver ``"gauss_seidel"``, and the world
        must have no callables of Python in its steps.
        """
    def rollout(
        self,
        controls: ArrayLike | None = None,
        *,
        steps: int | None = None,
        forks: int | None = None,
        articulations: Any = None,
        states: ArrayLike | None = None,
        every: int = 1,
        threads: int | None = None,
    ) -> _Floats:
        """Runs many forks, each with its own controls, on all cores with the interpreter released.
        This world does not change.

        controls: shape (forks, steps, n): generalized forces of each step, N·m and N, for all
        ``articulations`` one after the other (by default all of the world, in order; without any, n
        is 0). Without controls generalized forces stay as they are: then steps is the number of steps, and forks that of
        forks, by default as many as states, or 1. states: initial states of the forks, shape (len(state),) or (forks, len(state)), by
        default the state of the world. every: interval in steps at which the state is kept.
        threads: largest number of threads (default: all cores). Returns the states, shape (forks,
        steps // every, len(state)): the same bits on any number of threads. A fork that fails
        raises ``StepError`` with its number; Ctrl-C stops all of them between two steps.
        """
    @property
    def state(self) -> _Floats:
        """The flat state, shape (n,): a read-only view of the world's own memory until bodies are
        added or removed; then it keeps its last numbers.

        A rigid body has 13 numbers: position of the center of mass (``body.world_center_of_mass``),
        quaternion (x, y, z, w), linear and angular momentum. An articulated body has its ``q`` and
        ``qd``. Nothing is copied, here or by steps. While a view exists, a step keeps the
        interpreter, except for turns of other threads between two frames. Setting it writes every
        body's numbers.
        """
    @state.setter
    def state(self, value: ArrayLike) -> None: ...
    def add_rigid(
        self,
        name: str | Shape | None = None,
        shape: Shape | None = None,
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
        group: int = 0,
        mask: int | Sequence[int] | None = None,
        sensor: bool = False,
        inertia: ArrayLike | None = None,
        center_of_mass: ArrayLike | None = None,
        gravity_scale: float = 1.0,
        locked: LockedAxis | Sequence[LockedAxis] | None = None,
        non_spinning: bool = False,
        intersect: Intersect | None = None,
        one_way: ArrayLike | None = None,
        appearance: Appearance | None = None,
    ) -> RigidBody:
        """Adds a body that moves.

        name: unique, of any length; without one, as in ``add_rigid(Sphere(0.1), mass=1)``, the world
        makes one from the number of objects added before, such as ``"body 3"``.
        mass: kg, or density: kg/m³; without both the density is 1000 kg/m³. position: of the shape's frame, for a mesh the
        file's, meters. orientation: unit quaternion (x, y, z, w). velocity, m/s, and
        angular_velocity, rad/s: world axes. restitution: 0 to 1. friction: at least 0. kinematic:
        moves at its prescribed velocity. contacts: contact mode, ``"surface"``, or ``"spheres"``
        for the spheres of its tree as in the thesis; a pair uses spheres if either body does. group, mask:
        collision group, 0 to 63, and the groups that it collides with, as bits of an integer or a
        sequence, None for all; two bodies collide if the group of each is in the mask of the other.
        sensor: no contacts; ``events`` reports the bodies that overlap it. inertia: about the center of
        mass, shape (3, 3) or (3,), kg·m², by default that of a uniform body; center_of_mass: in the
        frame of the shape, shape (3,), m; gravity_scale, locked: as the properties of a body. non_spinning: locks all
        rotations, so that forces and impulses act on the center of mass alone. intersect: an object of a subclass of
        ``tumble.Intersect``, the body's own intersection test; the shape then surrounds the true surface. one_way: as
        the property. appearance: a ``tumble.Appearance``, by default one of a few colors in turn.
        """
    def add_static(
        self,
        name: str | Shape | None = None,
        shape: Shape | None = None,
        position: ArrayLike | None = None,
        orientation: ArrayLike | None = None,
        restitution: float = 0.0,
        friction: float = 0.5,
        *,
        collidable: bool = True,
        contacts: Contacts = "surface",
        group: int = 0,
        mask: int | Sequence[int] | None = None,
        sensor: bool = False,
        intersect: Intersect | None = None,
        one_way: ArrayLike | None = None,
        appearance: Appearance | None = None,
    ) -> RigidBody:
        """Adds geometry that never moves. name, position, orientation, restitution, friction, contacts,
        group, mask, sensor, intersect, one_way, appearance: as in ``add_rigid``; by default gray, planes checkered.
        """
    def add_articulation(
        self, articulation: Articulation | ArticulationBuilder | _Path, base: ArrayLike | None = None, *, name: str | None = None
    ) -> Articulation:
        """Adds an articulated body and returns its handle.

        articulation: a description, a builder, or the path of a URDF, a model of MuJoCo or an SDF file. base: pose
        of its base: a position (3,), or position and quaternion (7,), meters and (x, y, z, w). name: by default the
        description's. It starts with the ``q``, ``qd`` and ``tau`` of the description; the pose of
        a floating root is relative to the base.
        """
    @property
    def joints(self) -> list[Joint]:
        """All joints made by ``add_joint`` or ``[[loop_joint]]``, in the order in which they were added."""
    @property
    def mimics(self) -> list[Mimic]:
        """All couplings of joints made by ``add_mimic`` or ``[[mimic]]``, in the order in which they were added."""
    def joint(self, name: str) -> Joint:
        """Returns the joint of that name, made by ``add_joint`` or ``[[loop_joint]]``."""
    def add_joint(
        self,
        kind: JointKind,
        a: _Side,
        b: _Side = None,
        point: ArrayLike | None = None,
        axis: ArrayLike = (0.0, 0.0, 1.0),
        limits: ArrayLike | None = None,
        drive: Mapping[str, Any] | None = None,
        breaking_force: float | None = None,
        *,
        name: str = "",
        second_point: ArrayLike | None = None,
        second_axis: ArrayLike | None = None,
        length: float | None = None,
        stiffness: float = 0.0,
        rest: ArrayLike | None = None,
        damping: float = 0.0,
        friction: float = 0.0,
        breaking_torque: float | None = None,
        teeth: tuple[int, int] | None = None,
        radius: float | None = None,
        pitch: float | None = None,
        ratio: float = 1.0,
        ground: ArrayLike | None = None,
        cone: float | None = None,
        max_velocity: float | None = None,
        effort: float | None = None,
        armature: float = 0.0,
        twist_limits: ArrayLike | None = None,
        dofs: Sequence[Mapping[str, Any]] | None = None,
        angle: float | None = None,
    ) -> Joint:
        """Joins two bodies, or a body and the world, in their present poses, and returns the joint.

        kind: ``"fixed"``, ``"revolute"`` (turns about the axis), ``"prismatic"`` (slides along it),
        ``"spherical"``, ``"cylindrical"`` (both turns and slides), ``"universal"`` (turns about the axis,
        which is fixed to a, and second_axis, fixed to b), ``"planar"`` (slides across the axis and turns
        about it), ``"distance"``, ``"rope"`` (at most a length), ``"spring"``, ``"gear"``, ``"rack"``, ``"screw"`` or ``"pulley"``. a, b: handles or names;
        a link is ``"ARTICULATION/LINK"`` or ``(articulation, "LINK")``; None is the world.

        point: shape (3,), m, by default the center of mass of a, or the origin of a link; second_point:
        the end on b of a distance, rope or spring, by default likewise of b. axis: shape (3,), any length
        above 0. length: of a distance, rope or spring, m, by default the present one.

        teeth: of the gears a and b, negative for inner teeth; they turn about axis and second_axis, which
        do not move in the world. radius, m: a rack b moves along second_axis by it per radian of a
        about axis. pitch, m: displacement of a screw per turn. ground: the points of the world over which the rope of
        a pulley runs, shape (2, 3), m; ratio: the weight of b's side in its length.

        limits: (lower, upper) of the position, rad or m. drive: a dict with the arguments of
        ``Joint.set_drive``. stiffness, rest: a spring along the position, N·m/rad or N/m, and rad or m; of a spherical joint, rest
        and target may be a rotation vector, shape (3,).
        cone: largest angle of a spherical joint between its axis on a and that on b, rad; twist_limits: (lower, upper) of its turn about that axis, rad. max_velocity: largest speed
        of the position, rad/s or m/s. damping: N·m·s/rad or N·s/m. friction: N·m or N. effort: the force of its motor, N·m or N, which limits drives
        that name no max_force. armature: inertia of its rotor, kg·m² or kg. dofs: dicts of these settings for each degree of freedom in the order of
        ``Joint.dofs``, where the joint has several; without them they are those of the first one, of a spherical joint of all three. breaking_force, N, and breaking_torque about the
        point, N·m: above one of them the joint breaks; ``events`` has a ``"joint_broken"`` then. The
        bodies do not collide with each other, unless ``set_pair_material(a, b, collides=True)`` lets them; those of a distance, rope,
        spring or pulley do. Points and axes are in the world. angle: rad, of a revolute joint that counts its turns, where its limits are more than 3π/2 apart or on one
        side: of the angles that its frames have now it takes the nearest to this number.
        """
    def add_mimic(self, joint: _Side | Joint, of: _Side | Joint, multiplier: float = 1.0, offset: float = 0.0, *, name: str = "") -> Mimic:
        """Couples two joints, and returns the coupling: the position of ``joint`` is ``multiplier`` times that of ``of``, plus ``offset``.

        joint, of: joints made by ``add_joint``, by handle or name, of a kind with a position other than ``"spherical"``; or
        links that a revolute or prismatic joint moves, ``"ARTICULATION/LINK"`` or ``(articulation, "LINK")``. Together they
        join two bodies that move at most. multiplier: not 0; between two angles of joints without limits a ratio of whole
        numbers up to 1000. offset: rad or m, as the position of ``joint``.
        """
    def add_sensor(
        self,
        kind: SensorKind,
        on: _Side | Joint = None,
        *,
        name: str = "",
        position: ArrayLike | None = None,
        orientation: ArrayLike | None = None,
        relative_to: _Side = None,
        volume: Shape | None = None,
        cutoff: float | None = None,
        deviation: float = 0.0,
        bias_walk: float = 0.0,
        quantization: float = 0.0,
        delay: int = 0,
        seed: int = 0,
        resolution: tuple[int, int] | None = None,
        vertical_fov: float | None = None,
    ) -> Sensor:
        """Adds a measuring sensor, read after every step: ``world.sensors[name]``.

        kind: ``"accelerometer"``, ``"gyroscope"``, ``"velocimeter"`` (in the axes of the site), ``"force"`` and ``"torque"`` (of the joint
        that moves the link, on the link; of a loop joint, on its side a), ``"touch"`` (normal force on the link or body), ``"range_finder"``
        (along z of the site; -1 if nothing is there), ``"position"``, ``"orientation"``, ``"linear_velocity"``, ``"angular_velocity"``,
        ``"linear_acceleration"``, ``"angular_acceleration"``, ``"joint_position"``, ``"joint_velocity"`` or ``"drive_force"``. Accelerations
        and forces are means over the step.

        on: a body, a link (``"ARTICULATION/LINK"`` or ``(articulation, "LINK")``) or a joint, as handle or name; None is the world.
        position: shape (3,), m, and orientation, (x, y, z, w): the site in the frame of the body or link. relative_to: a body or link
        against whose frame positions, orientations and velocities are read. volume: a shape at the site; touch outside does not
        count. cutoff: largest absolute value of a reading; of a camera of any kind the largest depth that it sees, m.

        deviation: standard deviation of white noise. bias_walk: that of the change of a bias in a second. quantization: distance
        of the values that a reading can have. delay: steps by which it is late. seed: start of the noise.

        ``"depth"``, ``"segmentation"`` and ``"color"`` are cameras that look along z of the site, with x to the right and y down in the image.
        resolution: pixels in a row and rows, by default (64, 48). vertical_fov: rad, by default π/4. Their readings are made when
        they are read: distances along z, m, shape (rows, columns), -1 where nothing is; and what a pixel shows, shape (rows,
        columns, 2): the index in ``world.bodies`` and that of the link in its ``link_names``, -1 for nothing and other objects. An
        image has one bias; a segmentation has no noise. With a delay a camera makes its image after every step, and keeps it
        in the state.
        """
    @property
    def sensors(self) -> Sensors:
        """The readings of all measuring sensors by name, after the last step."""
    def remove(self, body: _Object | Sensor) -> None:
        """Removes an object, given as a handle or by name, or a force, a field or a behavior by name. Handles
        of a removed object raise ``RemovedError``. Joints and measuring sensors of a removed body are removed with it, and
        so are couplings and sensors of a removed joint.
        """
    def add_cloth(
        self,
        name: str = "",
        *,
        nodes: Sequence[int] | None = None,
        size: ArrayLike | None = None,
        mass: float = 0.2,
        stiffness: ArrayLike | None = None,
        damping: float = 0.01,
        position: ArrayLike | None = None,
        orientation: ArrayLike | None = None,
        velocity: ArrayLike | None = None,
        node_radius: float | None = None,
        pins: Iterable[str | int] | None = None,
        implicitness: float = 1.0,
        friction: float = 0.5,
        restitution: float = 0.0,
        color: ArrayLike | None = None,
    ) -> SpringMesh:
        """Adds a rectangular cloth in the xy-plane of its frame: point masses, the nodes, joined by springs. Returns its
        handle.

        nodes: along x and y, at least 2 each. size: along x and y, m. mass: of the whole, kg. stiffness: of the springs
        of structure, of shear and of bending, N/m. damping: of each spring over its stiffness, s. position: of the
        middle, m; orientation: unit quaternion (x, y, z, w). velocity: m/s. node_radius: with which the nodes collide,
        m, None for no collisions. pins: nodes that never move: names of sides (``"x_min"``, ``"x_max"``, ``"y_min"``,
        ``"y_max"``), ``"corners"``, and numbers. implicitness: time in a step at which the springs act, 0.5 to 1; 1
        damps what a step does not resolve. friction, restitution: of the nodes. color: sRGB, each 0 to 1.
        """
    def add_jelly(
        self,
        name: str = "",
        *,
        nodes: Sequence[int] | None = None,
        size: ArrayLike | None = None,
        mass: float = 2.0,
        stiffness: ArrayLike | None = None,
        damping: float = 0.01,
        position: ArrayLike | None = None,
        orientation: ArrayLike | None = None,
        velocity: ArrayLike | None = None,
        node_radius: float | None = None,
        pins: Iterable[str | int] | None = None,
        implicitness: float = 1.0,
        friction: float = 0.5,
        restitution: float = 0.0,
        color: ArrayLike | None = None,
    ) -> SpringMesh:
        """Adds a block of jelly: point masses, the nodes, joined by springs. Returns its handle.

        nodes, size: along x, y and z. pins: names of sides, ``"x_min"`` to ``"z_max"``, ``"corners"``, and numbers of
        nodes. The other arguments are those of ``add_cloth``.
        """
    def add_particles(
        self,
        name: str = "",
        emitters: Sequence[Emitter] = (),
        *,
        capacity: int = 10000,
        seed: int = 0,
        mass: float = 0.001,
        radius: float = 0.01,
        friction: float = 0.5,
        restitution: float = 0.0,
        gravity_scale: float = 1.0,
        linear_drag: float = 0.0,
        quadratic_drag: float = 0.0,
        wind: ArrayLike | None = None,
        collidable: bool = True,
        group: int = 0,
        mask: int | Sequence[int] | None = None,
        two_way: bool = False,
        color: ArrayLike | None = None,
        drawn_radius: float | None = None,
        fade: float = 0.0,
        opacity: float | ArrayLike | None = None,
        scale: float | ArrayLike | None = None,
        end_color: ArrayLike | None = None,
        glow: bool = False,
    ) -> ParticleSystem:
        """Adds a system of particles: sparks, smoke, drops. Returns its handle.

        emitters: its sources, a list of ``Emitter``. capacity: most particles that live at once. seed: of its random
        numbers. mass, kg, and radius, m, of a particle. friction, restitution: at bodies. gravity_scale: factor of
        gravity, negative for smoke. linear_drag: 1/s, quadratic_drag: 1/m, both per mass. wind: velocity of the air,
        shape (3,), m/s. collidable: with bodies. group, mask: as in ``add_rigid``. two_way: whether bodies get the
        momentum that particles lose. color: sRGB, each 0 to 1. drawn_radius: in pictures, m, by default the radius.
        fade: seconds before its end in which a particle shrinks. opacity: share of the light from behind that the middle
        of a particle blocks, 0 to 1, or two numbers, at birth and at the end; None for solid particles. scale: factor of
        the drawn radius, one number or two likewise. end_color: sRGB at the end, where color is that at birth.
        glow: colors as they are, without light, for sparks and flames.
        """
    def add_flock(self, name: str = "", **steering: Any) -> Flock:
        """Adds a flock without boids and returns its handle; ``Flock.add`` adds boids.

        Keywords are the constants of its forces: ``avoidance`` (m²/s²), ``matching`` (1/s), ``clustering`` (1/s²),
        ``max_force`` of these three together (N); ``visibility_distance``, ``inner_visibility_distance`` (m),
        ``visibility_angle``, ``inner_visibility_angle`` (rad): within the inner ones a neighbor is seen fully;
        ``desired_speed`` (m/s), ``speed_rate`` (1/s); ``boundary_center`` (m), ``boundary_radius`` (m),
        ``boundary_stiffness`` (N/m) of a soft sphere around the flock.
        """
    def add_body_flock(self, name: str = "", **steering: Any) -> BodyFlock:
        """Adds a flock of rigid and articulated bodies, empty, and returns its handle; ``BodyFlock.add`` adds bodies of the world.

        Keywords are the constants of the forces, as in ``add_flock``, and of the helm: ``agility``, rate at which the orientation
        approaches the wanted one (1/s); ``max_angular_acceleration`` (rad/s²); ``bank_time``, seconds of the rate of turn that are a
        quarter turn of bank; ``up``, the direction that is up for a body without bank; ``wind``, velocity of the air in which bodies
        fly (m/s).
        """
    def add_event(
        self,
        name: str,
        when: Trigger,
        do: list[Action | Callable[[View, Firing], Iterable[Action] | None]] | Action | Callable[[View, Firing], Iterable[Action] | None],
        *,
        delay: float = 0.0,
        times: int | None = None,
    ) -> ScriptedEvent:
        """Adds a scripted event and returns its handle.

        when: a ``Trigger``. do: a list of ``Action`` and callables, done in this order, callables last. A callable is called after the
        frame, as ``f(view, firing)`` with a ``View`` and a ``Firing``, and returns None or a list of actions that are done at once.
        delay: from the trigger to the actions, s. times: how often it fires at most, None for any number. Objects that it names must be
        in the world.
        """
    def add_template(
        self,
        name: str,
        shape: Shape,
        max: int,
        *,
        mass: float | None = None,
        density: float | None = None,
        restitution: float = 0.0,
        friction: float = 0.5,
        reuse: bool = False,
        color: ArrayLike | None = None,
    ) -> Template:
        """Adds equal rigid bodies for events to spawn, and returns their template.

        max: the largest number that is there at a time, 1 to 10,000. reuse: whether the oldest one is spawned again when all are there.
        mass, density, restitution, friction: as in ``add_rigid``. color: sRGB, each 0 to 1.
        """
    def press(self, key: str) -> bool:
        """Presses a key for the events that wait for it; they fire at the end of the next step. Returns whether there are any."""
    def add_field(
        self, name: str, field: Field, *, targets: Sequence[_Body | SpringMesh | Boid] | None = None
    ) -> None:
        """Adds a force field under a unique name; ``remove`` takes the name.

        targets: the bodies, cloths, jellies and boids that it acts on, as handles or names; None for all that move,
        also those that are added later.
        """
    def add_force(self, name: str, force: Force) -> None:
        """Adds a custom force: an object of a subclass of ``tumble.Force``. Its name must be unique
        among bodies, forces and behaviors.
        """
    def add_behavior(self, name: str, behavior: Behavior, bodies: _Body | Iterable[_Body]) -> None:
        """Adds a custom behavior, an object of a subclass of ``tumble.Behavior``, to bodies given by
        name or as handles.
        """
    @property
    def forces(self) -> dict[str, Force]:
        """Custom forces by name: a new dict."""
    @property
    def behaviors(self) -> dict[str, Behavior]:
        """Custom behaviors by name: a new dict."""
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
        """Renders the world: sRGB and alpha, shape (height, width, 4), uint8, rows from the top. No
        window is needed.

        width, height: pixels, by default 640 x 480. The view is one of: camera, ``tumble.Camera``
        or ``(eye, target)`` in meters; facet, ``"cube4:front"``: a facet of a cave, given by path
        or name, at the size in the cave file; cave: all its facets unfolded into at most width x
        height; else the scene's camera, or one that shows everything. overlays: names of ``tumble
        run --debug-draw``, such as ``"contacts,forces"``. Without a graphics adapter it raises
        ``PictureError``.
        """
    def view(self, *, block: bool = False, title: str | None = None, width: int = 1280, height: int = 720) -> Window:
        """Opens a window on the world and returns it once it is open: ``tumble.Window``. A process of its own draws the world as
        it stands, 60 times a second, while the program steps and changes it. The window closes with the
        program.

        block: step the world in real time until the window is closed. title, width, height (pixels): of the
        window. Without a desktop or a graphics adapter it raises ``PictureError`` with the reason.
        """
    def _repr_png_(self) -> bytes | None:
        """Returns a PNG for notebooks, or None without a graphics adapter."""
    def plot_energy(self, duration: float = 5.0, *, ax: Any = None) -> Any:
        """Steps a fork for ``duration`` seconds and plots its energy over time. The world does not
        change. Requires matplotlib, the extra ``plot``.

        ax: the axes to plot on, by default new ones. Returns the axes.
        """
    def animation(
        self,
        duration: float = 5.0,
        *,
        width: int = 480,
        height: int = 320,
        fps: float = 15.0,
        speed: float = 1.0,
        camera: Sequence[Any] | None = None,
        control: Callable[[World], object] | None = None,
    ) -> Animation:
        """Steps a fork for ``duration`` seconds and returns an ``Animation`` of it for notebooks, which plays without a kernel and without
        a network; ``save`` writes it. This world does not change.

        width, height: pixels. fps: images per second. speed: times real time. camera: as in ``render``. control: a function that
        is called with the fork before each step.
        """
    def video(
        self,
        path: _Path,
        duration: float = 5.0,
        *,
        width: int = 1280,
        height: int = 720,
        fps: float = 30.0,
        speed: float = 1.0,
        camera: Sequence[Any] | None = None,
        control: Callable[[World], object] | None = None,
    ) -> None:
        """Steps a fork for ``duration`` seconds and writes a video of it (``.mp4`` and all that ffmpeg knows), or without ffmpeg an animated
        PNG (``.png``, ``.apng``). This world does not change. Arguments as in ``animation``. Without ffmpeg or a graphics adapter:
        ``PictureError``.
        """
    def plot_paths(
        self, duration: float = 5.0, *, bodies: _Body | Iterable[_Body] | None = None, along: Axis = "y", ax: Any = None
    ) -> Any:
        """Steps a fork for ``duration`` seconds and plots the paths of bodies (default: all dynamic
        bodies) as seen along an axis, ``"x"``, ``"y"`` or ``"z"``.

        Otherwise as ``plot_energy``.
        """

def simulate(
    model: bytes, snapshot: bytes | None, controls: ArrayLike, every: int = 1
) -> dict[str, NDArray[Any]]:
    """Simulates a world that is given as bytes: a pure function of its arguments, for any engine that
    has a ``map``. Nothing is kept between two calls, and arguments and results pickle.

    model: ``World.model()``. snapshot: where it starts, ``World.save()`` of a world of that model;
    None: the model's own state. controls: shape (steps, dof), as those of one fork in
    ``World.rollout``. every: interval in steps at which the results are kept.

    Returns a dict of arrays with one row for each kept step: ``time``, ``state``, ``q``, ``v``,
    ``positions``, ``orientations``, ``velocities``, ``angular_velocities``, ``contact_counts``, each
    as in ``Batch``, and ``snapshot``, the bytes of ``World.save()`` at the end, uint8, with which
    the next call goes on.
    """

def _panic(world: World, while_: str) -> None:
    """Panics within a call on a world that is ``"read"``, ``"changed"`` or ``"stepped"``."""
def _choices() -> dict[str, list[str]]:
    """Returns the names of every choice by the name of its type in ``tumble.typing``, in the library's
    order.
    """
def _unpickle_articulation(
    file: Path, floating: bool, packages: Mapping[str, Path], words: Sequence[str], velocity_limits: bool, numbers: Sequence[Sequence[float]]
) -> Articulation:
    """Unpickles a description. Its file is read again."""
def _unpickle_batch(
    worlds: Sequence[World], starts: Sequence[World], driven: Sequence[int], threads: int | None, given: bool, failed: Sequence[bool]
) -> Batch:
    """Returns the batch of a pickle."""
def _unpickle_built_articulation(data: bytes, numbers: Sequence[Sequence[float]]) -> Articulation:
    """Unpickles a description of a body made by a program."""
def _unpickle_linearized_step(data: bytes) -> LinearizedStep:
    """Returns the linearized step of a pickle."""
def _unpickle_shape(data: bytes) -> Shape:
    """Returns the object of its class that a pickled shape becomes."""
@final
class _WindowFeed:
    """Makes the messages of a window."""

    def __new__(cls) -> _WindowFeed: ...
    def opening(self, world: World, title: str, size: tuple[int, int]) -> bytes:
        """Returns the first message."""
    def frame(self, world: World) -> bytes:
        """Returns the messages of the present state; empty if nothing changed."""

def _show_window() -> None:
    """Shows the messages of stdin in a window until it is closed or they end."""
def _unpickle_step_report(data: bytes) -> StepReport:
    """Returns the report of a pickle."""
def _unpickle_tree(data: bytes) -> SphereTree:
    """Unpickles a sphere tree."""
def _unpickle_world(data: bytes) -> World:
    """Returns the world of a pickle; pickle then restores its forces and behaviors."""
