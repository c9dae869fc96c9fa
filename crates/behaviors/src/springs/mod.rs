//! Cloth and jelly: point masses joined by springs, implicit in time, that collide as balls.
//!
//! ```text
//! M·Δv = h·(f_ext − ∇V(q) − D·(v₀ + ½·Δv)) + Jᵀ·λ          q = x_½ + ½·h·((2·θ − 1)·v₀ + θ·Δv)
//!
//! V = ½·Σ k·(l − l₀)²          K = k·u·uᵀ + max(0, k·(l − l₀)/l)·(1 − u·uᵀ),  D = c·u·uᵀ
//! A = M + ½·h·D + ½·h²·θ·K     x_½ = x₀ + ½·h·v₀,  x₁ = x_½ + ½·h·(v₀ + Δv)
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `x`, `v`, `M` | positions, velocities and masses of the nodes |
//! | `l`, `u` | length of a spring; its direction, in `D` that at `x_½` |
//! | `l₀`, `k`, `c` | its length at rest, stiffness and damping |
//! | `V`, `K`, `D` | energy, stiffness and damping of all springs; compressed springs have no stiffness across |
//! | `h` | length of a sub-step that the mesh is made for |
//! | `θ` | 1: forces at the end of the step (backward Euler, which damps stiff modes); ½: in its middle (midpoint rule) |
//! | `Jᵀ·λ` | impulses of contacts and joints |
//!
//! The equation without `λ` is solved by a quasi-Newton method: each iteration goes down the incremental potential `Φ(Δv)`,
//! whose gradient is the difference of the two sides, along `−H·∇Φ`. `H` is `A⁻¹` at every twelfth iteration, corrected by
//! the iterations since (L-BFGS; Liu, Bouaziz and Kavan, 2017). So it never makes worse
//! what it begins with, however stiff the springs. The stepper knows nothing of it: to the solver the object has
//! the mass matrix `A = LᵀL` of the last factor, with a sparse factor ([`factor`]), so contacts are solved
//! together with the springs. Implicit cloth: Baraff and Witkin (1998).
//!
//! A spring without damping swings at `ω' = (2/h)·atan(½·ω·h)` with `θ = ½`: of second order in `h`.
//!
//! Limits: made for `time_stepping`. In steps shorter than `h` a mesh is stable and too inert by an error of order
//! `h²`; in longer ones it may blow up. Nodes of one mesh do not collide with each other.

mod block;
mod factor;
mod implicit;
mod make;
mod object;
mod surface;

pub use make::{Cloth, Jelly};

use crate::error::{BehaviorError, check};
use crate::fields::check_vector;
use factor::Pattern;
use std::sync::Arc;
use tumble_collide::{Pose, Shape, Vec3};
use tumble_core::{Material, ObjectId, PartSurface, World};

/// Most nodes of a mesh.
const MOST: usize = 100_000;

/// A spring between two nodes.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct MeshSpring {
    /// Its nodes, two different ones.
    pub nodes: [usize; 2],
    /// Length at rest, m, above 0.
    pub length: f64,
    /// Stiffness, N/m, at least 0.
    pub stiffness: f64,
    /// Damping, N·s/m, at least 0.
    pub damping: f64,
}

/// The grid that a mesh was made as, and its pose at time 0.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Origin {
    /// The grid.
    pub grid: Grid,
    /// Pose of the frame of the grid.
    pub pose: Pose,
}

/// A grid of nodes.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum Grid {
    /// A sheet.
    Cloth(Cloth),
    /// A block.
    Jelly(Jelly),
}

/// Point masses joined by springs. Its state is the positions of all nodes (m), then their velocities (m/s). Each
/// node is a part.
///
/// ```
/// # use tumble_core::prelude::*;
/// # let mut world = World::default();
/// use tumble_behaviors::{Cloth, SpringMesh};
/// let cloth = Cloth { stiffness: [1e6, 1e6, 1e4], ..Cloth::default() }; // N/m: structure, shear, bending
/// let cloth = cloth.mesh()?.with_radius(0.03)?.with_pins(|x| x.y > 0.499);
/// let cloth = SpringMesh::add(&mut world, cloth)?;
/// world.step()?;
/// assert_eq!(SpringMesh::positions(&world, cloth).unwrap().len(), 400);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct SpringMesh {
    name: String,
    pub(crate) nodes: Vec<Vec3>,
    /// The nodes as they were given, from which the order of elimination follows.
    pub(crate) given: Arc<[Vec3]>,
    pub(crate) masses: Vec<f64>,
    pub(crate) pinned: Vec<bool>,
    pub(crate) springs: Vec<MeshSpring>,
    pub(crate) velocity: Vec3,
    pub(crate) shape: Option<Shape>,
    pub(crate) material: Material,
    /// Length of a sub-step, s.
    pub(crate) step: f64,
    /// Time in a step at which the forces of springs act, ½ to 1.
    pub(crate) implicitness: f64,
    pattern: Arc<Pattern>,
    /// Triangles that are drawn.
    pub(crate) surface: Option<PartSurface>,
    /// How its nodes and springs were made.
    pub(crate) origin: Option<Origin>,
}

impl SpringMesh {
    /// Returns the shape with which each node collides.
    pub fn node_shape(&self) -> Option<&Shape> {
        self.shape.as_ref()
    }
    /// Returns the surface constants.
    pub fn material(&self) -> &Material {
        &self.material
    }
    /// Returns the surface that is drawn.
    pub fn surface(&self) -> Option<&PartSurface> {
        self.surface.as_ref()
    }

    /// Makes a mesh at rest of nodes (m), their masses (kg, above 0) and springs.
    ///
    /// # Errors
    /// [`BehaviorError::Range`] names what is out of its range. A mesh whose factor has more than 50 million pairs of
    /// blocks is refused: blocks of many nodes along each edge, or springs between far nodes.
    pub fn new(nodes: Vec<Vec3>, masses: Vec<f64>, springs: Vec<MeshSpring>) -> Result<SpringMesh, BehaviorError> {
        let count = nodes.len();
        check("the number of nodes", count as f64, (1..=MOST).contains(&count), "1 to 100,000")?;
        check("the number of masses", masses.len() as f64, masses.len() == count, "the number of nodes")?;
        nodes.iter().try_for_each(|node| check_vector("the place of a node", node))?;
        masses.iter().try_for_each(|mass| check("the mass of a node", *mass, *mass > 0.0, "above 0"))?;
        for spring in &springs {
            let [a, b] = spring.nodes;
            check("a node of a spring", a.max(b) as f64, a != b && a.max(b) < count, "another node of the mesh")?;
            check("the length of a spring", spring.length, spring.length > 0.0, "above 0")?;
            check("the stiffness of a spring", spring.stiffness, spring.stiffness >= 0.0, "at least 0")?;
            check("the damping of a spring", spring.damping, spring.damping >= 0.0, "at least 0")?;
        }
        let pattern = Arc::new(Pattern::new(&nodes, springs.iter().map(|spring| spring.nodes))?);
        Ok(SpringMesh {
            name: String::new(),
            pinned: vec![false; count],
            given: nodes.clone().into(),
            nodes,
            masses,
            springs,
            velocity: Vec3::zeros(),
            shape: None,
            material: Material::default(),
            step: 1.0 / 240.0,
            implicitness: 1.0,
            pattern,
            surface: None,
            origin: None,
        })
    }
    /// Sets the name.
    pub fn with_name(self, name: impl Into<String>) -> SpringMesh {
        SpringMesh { name: name.into(), ..self }
    }
    /// Moves the nodes of time 0 by a pose.
    pub fn with_pose(mut self, pose: Pose) -> SpringMesh {
        self.nodes.iter_mut().for_each(|node| *node = pose.transform_point(&(*node).into()).coords);
        self.origin = self.origin.map(|origin| Origin { pose: pose * origin.pose, ..origin });
        self
    }
    /// Sets the velocity of all nodes at time 0, m/s.
    pub fn with_velocity(self, velocity: Vec3) -> SpringMesh {
        SpringMesh { velocity, ..self }
    }
    /// Lets the nodes collide as balls, m, above 0. A ball larger than half the distance of nodes
    /// leaves no gap for what is smaller than a mesh.
    ///
    /// # Errors
    /// [`BehaviorError::Range`] names the radius.
    pub fn with_radius(self, radius: f64) -> Result<SpringMesh, BehaviorError> {
        check("the radius of a node", radius, radius > 0.0, "above 0")?;
        Ok(SpringMesh { shape: Some(Shape::Sphere { radius }), ..self })
    }
    /// Sets the surface constants.
    pub fn with_material(self, material: Material) -> SpringMesh {
        SpringMesh { material, ..self }
    }
    /// Pins the nodes for which `which` is true to their places: nothing moves them.
    pub fn with_pins(mut self, which: impl Fn(&Vec3) -> bool) -> SpringMesh {
        self.pinned.iter_mut().zip(&self.nodes).for_each(|(pinned, node)| *pinned |= which(node));
        self
    }
    /// Sets where in a step the forces of springs act, `θ` from ½ to 1: 1, the default, damps what a step does not
    /// resolve; ½ keeps the energy of small motions.
    ///
    /// # Errors
    /// [`BehaviorError::Range`] names it.
    pub fn with_implicitness(self, theta: f64) -> Result<SpringMesh, BehaviorError> {
        check("the implicitness", theta, (0.5..=1.0).contains(&theta), "½ to 1")?;
        Ok(SpringMesh { implicitness: theta, ..self })
    }
    /// Sets the length of the sub-steps that the mesh is made for, s, above 0.
    ///
    /// # Errors
    /// [`BehaviorError::Range`] names it.
    pub fn set_step(&mut self, step: f64) -> Result<(), BehaviorError> {
        check("the length of a sub-step", step, step > 0.0, "above 0")?;
        self.step = step;
        Ok(())
    }

    /// Adds a mesh to a world, made for its sub-steps. If the settings of the world change, call
    /// [`set_step`](Self::set_step).
    ///
    /// # Errors
    /// As [`World::add`].
    pub fn add(world: &mut World, mut mesh: SpringMesh) -> Result<ObjectId, BehaviorError> {
        mesh.set_step(world.settings().dt / f64::from(world.settings().substeps))?;
        Ok(world.add(mesh)?)
    }

    /// Returns the nodes of time 0, m.
    pub fn nodes(&self) -> &[Vec3] {
        &self.nodes
    }
    /// Returns the grid that it was made as; `None` for other nodes and springs.
    pub fn origin(&self) -> Option<&Origin> {
        self.origin.as_ref()
    }
    /// Returns the numbers of the pinned nodes.
    pub fn pinned_nodes(&self) -> impl Iterator<Item = usize> {
        self.pinned.iter().enumerate().filter(|(_, pinned)| **pinned).map(|(node, _)| node)
    }
    /// Returns the velocity of all nodes at time 0, m/s.
    pub fn velocity(&self) -> Vec3 {
        self.velocity
    }
    /// Returns where in a step the forces of springs act.
    pub fn implicitness(&self) -> f64 {
        self.implicitness
    }
    /// Returns the springs.
    pub fn springs(&self) -> &[MeshSpring] {
        &self.springs
    }
    /// Returns the positions of the nodes in a world, m; `None` if the id is of another object.
    pub fn positions(world: &World, id: ObjectId) -> Option<Vec<Vec3>> {
        let count = world.get::<SpringMesh>(id)?.nodes.len();
        Some(world.state_of(id)?[..3 * count].chunks_exact(3).map(Vec3::from_column_slice).collect())
    }

    /// Calls `work` with the number of each spring, the spring, its direction and its length, m. A spring of no length has no direction and is
    /// left out.
    fn each_spring(&self, x: &[f64], mut work: impl FnMut(usize, &MeshSpring, &Vec3, f64)) {
        for (index, spring) in self.springs.iter().enumerate() {
            let [a, b] = spring.nodes.map(|node| Vec3::from_column_slice(&x[3 * node..3 * node + 3]));
            let length = (b - a).norm();
            if length > 0.0 {
                work(index, spring, &((b - a) / length), length);
            }
        }
    }

    /// Returns the energy of the springs, J.
    fn spring_energy(&self, x: &[f64]) -> f64 {
        let mut sum = 0.0;
        self.each_spring(x, |_, spring, _, length| sum += 0.5 * spring.stiffness * (length - spring.length).powi(2));
        sum
    }
}
