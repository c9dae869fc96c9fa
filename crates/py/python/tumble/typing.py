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

MissingMeshes: TypeAlias = Literal["error", "skip"]
"""``Articulation.from_urdf(missing_meshes=…)``: treatment of missing collision meshes."""

CollisionMeshes: TypeAlias = Literal["exact", "hull"]
"""``Articulation.from_urdf(collision_meshes=…)``: the meshes themselves, or their convex hulls."""

TreeMethod: TypeAlias = Literal["medial", "hubbard", "grid", "octree"]
"""``SphereTree.build(method=…)``."""

Axis: TypeAlias = Literal["x", "y", "z"]
"""``World.plot_paths(along=…)``: the viewing axis."""
