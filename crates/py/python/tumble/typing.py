"""Types for annotations: the names that arguments accept. A type checker finds a wrong name before the program runs."""

from typing import Literal, TypeAlias

Stepper: TypeAlias = Literal["time_stepping", "backtracking"]
"""``World(stepper=…)``: one solve per step at a fixed cost, or steps that go back to the time of each impact."""

Integrator: TypeAlias = Literal["verlet", "symplectic_euler", "explicit_euler", "rk4", "dormand_prince"]
"""``World(integrator=…)``: used by ``"backtracking"``."""

Solver: TypeAlias = Literal["gauss_seidel", "lcp_pyramid", "lcp_sliding"]
"""``World(solver=…)``: the solver of contact forces."""

Combine: TypeAlias = Literal["min", "max", "average", "product", "geometric_mean"]
"""``World(combine_restitution=…, combine_friction=…)``: combination rule for the coefficients of a pair."""

Contacts: TypeAlias = Literal["surface", "spheres"]
"""``World.add_rigid(contacts=…)``: contact by the surface, or by the spheres of its tree."""

Mode: TypeAlias = Literal["dynamic", "kinematic", "static"]
"""``RigidBody.mode``."""

EventKind: TypeAlias = Literal[
    "contact_begin", "contact_persist", "contact_end", "sensor_begin", "sensor_end", "asleep", "awake", "joint_broken", "fired"
]
"""``Event.kind``."""

LockedAxis: TypeAlias = Literal["x", "y", "z", "rotation_x", "rotation_y", "rotation_z"]
"""``RigidBody.locked``: axes of the world along which a body does not move, or about which it does not turn."""

JointKind: TypeAlias = Literal[
    "fixed",
    "revolute",
    "prismatic",
    "spherical",
    "cylindrical",
    "universal",
    "planar",
    "distance",
    "rope",
    "spring",
    "gear",
    "rack",
    "screw",
    "pulley",
]
"""``World.add_joint(kind=…)``: the motion that a joint between two bodies leaves free."""

SensorKind: TypeAlias = Literal[
    "accelerometer",
    "gyroscope",
    "velocimeter",
    "force",
    "torque",
    "touch",
    "range_finder",
    "position",
    "orientation",
    "linear_velocity",
    "angular_velocity",
    "linear_acceleration",
    "angular_acceleration",
    "joint_position",
    "joint_velocity",
    "drive_force",
    "depth",
    "segmentation",
    "color",
]
"""``World.add_sensor(kind=…)``: what a measuring sensor reads."""

JointType: TypeAlias = Literal["revolute", "prismatic", "spherical", "fixed", "floating"]
"""``ArticulationBuilder.add_link(joint=…)``: the joint of a link."""

MissingMeshes: TypeAlias = Literal["error", "skip"]
"""``Articulation.from_urdf(missing_meshes=…)``, ``from_mjcf`` and ``from_sdformat``: treatment of missing collision meshes."""

CollisionMeshes: TypeAlias = Literal["exact", "hull"]
"""``Articulation.from_urdf(collision_meshes=…)``, ``from_mjcf`` and ``from_sdformat``: the meshes themselves, or their convex hulls."""

TreeMethod: TypeAlias = Literal["medial", "hubbard", "grid", "octree"]
"""``SphereTree.build(method=…)``."""

Axis: TypeAlias = Literal["x", "y", "z"]
"""``World.plot_paths(along=…)``: the viewing axis."""
