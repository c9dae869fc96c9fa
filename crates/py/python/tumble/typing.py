"""Types for annotations: the words that arguments choose from. A type checker finds a wrong word before the program runs."""

from typing import Literal, TypeAlias

Stepper: TypeAlias = Literal["time_stepping", "backtracking"]
"""``World(stepper=…)``: one solve per step at a fixed cost, or steps that go back to the time of each impact."""

Integrator: TypeAlias = Literal["verlet", "symplectic_euler", "explicit_euler", "rk4", "dormand_prince"]
"""``World(integrator=…)``: acts in ``"backtracking"``."""

Solver: TypeAlias = Literal["gauss_seidel", "lcp_pyramid", "lcp_sliding"]
"""``World(solver=…)``: finds contact forces."""

Combine: TypeAlias = Literal["min", "max", "average", "product", "geometric_mean"]
"""``World(combine_restitution=…, combine_friction=…)``: what two bodies' coefficients make for the pair."""

Contacts: TypeAlias = Literal["surface", "spheres"]
"""``World.add_rigid(contacts=…)``: by the surface, or by the spheres of its tree."""

Mode: TypeAlias = Literal["dynamic", "kinematic", "static"]
"""``RigidBody.mode``."""

MissingMeshes: TypeAlias = Literal["error", "skip"]
"""``Articulation.from_urdf(missing_meshes=…)``: for collision meshes that are not there."""

CollisionMeshes: TypeAlias = Literal["exact", "hull"]
"""``Articulation.from_urdf(collision_meshes=…)``: as they are, or as their convex hulls."""

TreeMethod: TypeAlias = Literal["medial", "hubbard", "grid", "octree"]
"""``SphereTree.build(method=…)``."""

Axis: TypeAlias = Literal["x", "y", "z"]
"""``World.plot_paths(along=…)``: the axis to look along."""
