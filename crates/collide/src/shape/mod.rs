//! The shapes that a part of a body can have.

mod compound;
pub(crate) mod cone;
mod curvature;
mod cylinder;
pub(crate) mod ellipsoid;
mod mesh;
pub(crate) mod rounded;
mod stored;
mod surface;

use crate::sdf::DistanceField;
use crate::{Aabb, MassProperties, Pose, ShapeError, SphereTree, TreeCache, TreeSettings, TriMesh, Vec3, mass};
pub use compound::{CompoundPart, CompoundShape};
pub(crate) use cone::Cone;
pub use cylinder::CylinderShape;
pub use mesh::MeshShape;
use std::sync::Arc;

/// A solid in its own frame. Primitives are centered on the origin.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub enum Shape {
    /// All points with local `z ≤ 0`; the outward normal is local `+z`.
    HalfSpace,
    /// A sphere.
    Sphere {
        /// Meters.
        radius: f64,
    },
    /// A box with its faces across the local axes.
    Box {
        /// Distances from the center to the faces, meters.
        half_extents: Vec3,
    },
    /// All points within `radius` of a segment on the local z axis.
    Capsule {
        /// Meters.
        radius: f64,
        /// Distance from the center to an end of the segment (without the caps), meters.
        half_length: f64,
    },
    /// A cylinder along the local z axis; shared, because its tree is large.
    Cylinder(#[serde(with = "crate::archive::shared")] Arc<CylinderShape>),
    /// A closed mesh about its center of mass; shared.
    Mesh(#[serde(with = "crate::archive::shared")] Arc<MeshShape>),
    /// Several shapes of one body about their common center of mass; shared.
    Compound(#[serde(with = "crate::archive::shared")] Arc<CompoundShape>),
    /// An ellipsoid with its axes along the local axes.
    Ellipsoid {
        /// Distances from the center to the surface along x, y and z, meters.
        half_axes: Vec3,
    },
    /// A cone along the local z axis, tip up, about its center of mass: the base is a quarter of the
    /// height below the origin.
    Cone {
        /// Radius of the base, meters.
        radius: f64,
        /// From base to tip, meters.
        height: f64,
    },
    /// A box with rounded edges and corners: all points within `rounding` of a smaller box.
    RoundedBox {
        /// Distances from the center to the faces, meters.
        half_extents: Vec3,
        /// Radius of edges and corners, meters; below each half extent.
        rounding: f64,
    },
    /// A cylinder along the local z axis with rounded rims: all points within `rounding` of a smaller
    /// one.
    RoundedCylinder {
        /// The cylinder without the rounding.
        #[serde(with = "crate::archive::shared")]
        core: Arc<CylinderShape>,
        /// Radius of the rims, meters.
        rounding: f64,
    },
}

impl Shape {
    /// Returns the half-space `z ≤ 0`.
    pub fn half_space() -> Shape {
        Shape::HalfSpace
    }

    /// Returns [`Shape::half_space`] under its other name: a plane is solid below.
    pub fn plane() -> Shape {
        Shape::HalfSpace
    }

    /// Returns a sphere of `radius` meters.
    ///
    /// # Errors
    /// [`ShapeError::Length`] if the radius is not finite and above 0.
    pub fn sphere(radius: f64) -> Result<Shape, ShapeError> {
        positive("radius of a sphere", radius)?;
        Ok(Shape::Sphere { radius })
    }

    /// Returns a box with edges of `size` along x, y and z, meters.
    ///
    /// # Errors
    /// [`ShapeError::Length`] if an edge is not finite and above 0.
    pub fn cuboid(size: Vec3) -> Result<Shape, ShapeError> {
        let [x, y, z] = size.into();
        let half_extents =
            Vec3::new(half("size x of a box", x)?, half("size y of a box", y)?, half("size z of a box", z)?);
        Ok(Shape::Box { half_extents })
    }

    /// Returns a capsule along z: all points within `radius` of a segment of `length`, meters.
    ///
    /// # Errors
    /// [`ShapeError::Length`] if a size is not finite and above 0.
    pub fn capsule(radius: f64, length: f64) -> Result<Shape, ShapeError> {
        positive("radius of a capsule", radius)?;
        Ok(Shape::Capsule { radius, half_length: half("length of a capsule", length)? })
    }

    /// Returns a cylinder along z of `radius` and `length`, meters.
    ///
    /// # Errors
    /// [`ShapeError::Length`] if a size is not finite and above 0.
    pub fn cylinder(radius: f64, length: f64) -> Result<Shape, ShapeError> {
        positive("radius of a cylinder", radius)?;
        half("length of a cylinder", length)?;
        Ok(Shape::Cylinder(Arc::new(CylinderShape::new(radius, length)?)))
    }

    /// Returns an ellipsoid with full axes of `size` along x, y and z, meters.
    ///
    /// # Errors
    /// [`ShapeError::Length`] if an axis is not finite and above 0, [`ShapeError::Aspect`] if two axes
    /// differ by more than 100,000 times.
    pub fn ellipsoid(size: Vec3) -> Result<Shape, ShapeError> {
        let [x, y, z] = size.into();
        let half_axes = Vec3::new(
            half("size x of an ellipsoid", x)?,
            half("size y of an ellipsoid", y)?,
            half("size z of an ellipsoid", z)?,
        );
        similar("an ellipsoid", size.min(), size.max())?;
        Ok(Shape::Ellipsoid { half_axes })
    }

    /// Returns a cone along z with its tip up, about its center of mass; `radius` of the base and
    /// `height` in meters.
    ///
    /// # Errors
    /// [`ShapeError::Length`] if a size is not finite and above 0, [`ShapeError::Aspect`] if they
    /// differ by more than 100,000 times.
    pub fn cone(radius: f64, height: f64) -> Result<Shape, ShapeError> {
        positive("radius of a cone", radius)?;
        half("height of a cone", height)?;
        similar("a cone", radius.min(height), radius.max(height))?;
        Ok(Shape::Cone { radius, height })
    }

    /// Checks the sizes, which the constructors do too: bytes that were read may be damaged.
    ///
    /// # Errors
    /// [`ShapeError`] for the first size out of its range.
    pub fn validate(&self) -> Result<(), ShapeError> {
        match self {
            Shape::HalfSpace | Shape::Cylinder(_) | Shape::Mesh(_) => Ok(()), // these are checked when they are made
            Shape::Sphere { radius } => Shape::sphere(*radius).map(drop),
            Shape::Box { half_extents } => Shape::cuboid(2.0 * half_extents).map(drop),
            Shape::Capsule { radius, half_length } => Shape::capsule(*radius, 2.0 * half_length).map(drop),
            Shape::Ellipsoid { half_axes } => Shape::ellipsoid(2.0 * half_axes).map(drop),
            Shape::Cone { radius, height } => Shape::cone(*radius, *height).map(drop),
            Shape::RoundedBox { half_extents, rounding } => rounded::check(*rounding, half_extents.min()),
            Shape::RoundedCylinder { core, rounding } => {
                rounded::check(*rounding, core.radius().min(core.half_length()) + rounding)
            }
            Shape::Compound(compound) => compound.parts().iter().try_for_each(|part| part.shape.validate()),
        }
    }

    /// Returns a compound of several shapes, moved so that its center of mass is the origin;
    /// [`Shape::center_of_mass`] is its position in the frame of the parts.
    ///
    /// ```
    /// use tumble_collide::{CompoundPart, Pose, Shape, Vec3};
    /// let (head, handle) = (Shape::cuboid(Vec3::new(0.1, 0.04, 0.04))?, Shape::cylinder(0.015, 0.3)?);
    /// let hammer = Shape::compound(vec![
    ///     CompoundPart::new(head, Pose::translation(0.0, 0.0, 0.15)).with_density(7800.0),
    ///     CompoundPart::new(handle, Pose::identity()).with_density(700.0),
    /// ])?;
    /// assert!((hammer.center_of_mass().z - 0.134).abs() < 1e-3);
    /// # Ok::<(), tumble_collide::ShapeError>(())
    /// ```
    ///
    /// # Errors
    /// [`ShapeError`]: no part or more than 4096, a half-space, a pose that is not finite, a density
    /// that is not above 0, or parts with and without a density.
    pub fn compound(parts: Vec<CompoundPart>) -> Result<Shape, ShapeError> {
        Ok(Shape::Compound(Arc::new(CompoundShape::new(parts)?)))
    }

    /// Returns a closed mesh, moved so that its center of mass is the origin;
    /// [`Shape::center_of_mass`] is its original position. Harmless defects are repaired (see
    /// [`TriMesh::check_closed`]).
    ///
    /// # Errors
    /// [`ShapeError::Mesh`]: a mesh that encloses no solid, a setting out of its range, or a tree
    /// that cannot be built.
    pub fn mesh(mesh: TriMesh, settings: &TreeSettings) -> Result<Shape, ShapeError> {
        Ok(Shape::Mesh(Arc::new(MeshShape::new(mesh, settings)?)))
    }

    /// Returns the convex hull of points in meters, as a mesh ([`TriMesh::hull_of`]).
    ///
    /// ```
    /// use tumble_collide::{Shape, Vec3};
    /// let roof = [[0, 0, 0], [4, 0, 0], [4, 3, 0], [0, 3, 0], [0, 1, 2], [4, 1, 2]];
    /// let roof = Shape::convex_hull(&roof.map(|p| Vec3::from(p.map(f64::from))))?;
    /// assert!((roof.volume() - 12.0).abs() < 1e-12);
    /// # Ok::<(), tumble_collide::ShapeError>(())
    /// ```
    ///
    /// # Errors
    /// [`ShapeError::Mesh`]: less than 4 points or more than 10 million, one that is not finite or
    /// beyond 1e9 m, or all in one plane.
    pub fn convex_hull(points: &[Vec3]) -> Result<Shape, ShapeError> {
        Shape::mesh(TriMesh::hull_of(points)?, &TreeSettings::octree())
    }

    /// Returns the solid under a grid of heights, as a mesh ([`TriMesh::height_field`]): rows of
    /// `columns` heights along x, `size` meters along x and y, the bottom `thickness` meters below the
    /// lowest height (`None`: a tenth of the longer side).
    ///
    /// # Errors
    /// [`ShapeError::Mesh`]: less than 2 rows or columns, an incomplete row, a height that is not
    /// finite, or a length that is not above 0.
    pub fn height_field(
        heights: &[f64],
        columns: usize,
        size: [f64; 2],
        thickness: Option<f64>,
    ) -> Result<Shape, ShapeError> {
        Shape::mesh(TriMesh::height_field(heights, columns, size, thickness)?, &TreeSettings::octree())
    }

    /// Returns an open surface as a solid that reaches `thickness` meters below it (`None`: a tenth
    /// of its longer horizontal side), as a mesh ([`TriMesh::terrain`]). Every face must look up, or
    /// every face down.
    ///
    /// # Errors
    /// [`ShapeError::Mesh`]: wrong data, a thickness that is not above 0, a vertical face, or faces
    /// that look up and down.
    pub fn terrain(surface: &TriMesh, thickness: Option<f64>) -> Result<Shape, ShapeError> {
        Shape::mesh(surface.terrain(thickness)?, &TreeSettings::octree())
    }

    /// Returns an open surface of any form (rooms, walls, tunnels) as a solid that reaches `thickness` meters
    /// behind its faces (`None`: a hundredth of its diagonal), or half as far to both sides if `centered`, as a
    /// mesh ([`TriMesh::thickened`]).
    ///
    /// # Errors
    /// [`ShapeError::Mesh`]: wrong data, faces without area, or a thickness that is not above 0.
    pub fn open_mesh(surface: &TriMesh, thickness: Option<f64>, centered: bool) -> Result<Shape, ShapeError> {
        Shape::mesh(surface.thickened(thickness, centered)?, &TreeSettings::octree())
    }

    /// Returns the solid in which a signed distance is negative, as a mesh of its surface
    /// ([`TriMesh::isosurface`]): within the box from `low` to `high` (m), `cells` along the longest side.
    /// Mass properties are those of the mesh.
    ///
    /// # Errors
    /// [`ShapeError::Mesh`]: a surface that is not inside the box, or a grid out of its range.
    pub fn sdf(distance: impl Fn(&Vec3) -> f64, low: Vec3, high: Vec3, cells: usize) -> Result<Shape, ShapeError> {
        Shape::mesh(TriMesh::isosurface(distance, low, high, cells)?, &TreeSettings::octree())
    }

    /// Returns the solid in which signed distances on a grid are negative, as a mesh ([`TriMesh::isosurface_within`]):
    /// `counts` points along x, y and z, x fastest, the first at `low` and the last at `high` (m).
    ///
    /// # Errors
    /// As [`Shape::sdf`].
    pub fn sdf_of_grid(values: &[f64], counts: [usize; 3], low: Vec3, high: Vec3) -> Result<Shape, ShapeError> {
        Shape::mesh(TriMesh::isosurface_within(values, counts, low, high)?, &TreeSettings::octree())
    }

    /// Returns [`Shape::mesh`] from the cache if it was built before from the same vertices,
    /// triangles and settings; otherwise builds and stores it. The bits are the same. Also returns
    /// a warning about the cache, if any.
    ///
    /// # Errors
    /// [`ShapeError::Mesh`], as [`Shape::mesh`]. An unusable cache is not an error.
    pub fn mesh_cached(
        mesh: TriMesh,
        settings: &TreeSettings,
        cache: &TreeCache,
    ) -> Result<(Shape, Option<String>), ShapeError> {
        let (shape, note) = MeshShape::new_cached(mesh, settings, cache)?;
        Ok((Shape::Mesh(Arc::new(shape)), note))
    }

    /// Returns [`Shape::mesh`] with its tree and surface built on first use: for a world that is
    /// drawn and not simulated. The tree then comes from the cache if it is there.
    ///
    /// # Errors
    /// [`ShapeError::Mesh`]: a mesh that encloses no solid, or a setting out of its range.
    pub fn mesh_lazy(mesh: TriMesh, settings: &TreeSettings, cache: &TreeCache) -> Result<Shape, ShapeError> {
        Ok(Shape::Mesh(Arc::new(MeshShape::new_lazy(mesh, settings, cache)?)))
    }

    /// Returns whether a tree or surface is built; false for shapes without any.
    pub fn is_built(&self) -> bool {
        match self {
            Shape::Cylinder(cylinder) => cylinder.is_built(),
            Shape::Mesh(mesh) => mesh.is_built(),
            Shape::Compound(compound) => compound.parts().iter().any(|part| part.shape.is_built()),
            _ => false,
        }
    }

    /// Returns whether the shape, or a part of it, has a sphere tree: meshes and cylinders.
    pub fn has_tree(&self) -> bool {
        match self {
            Shape::Cylinder(_) | Shape::Mesh(_) => true,
            Shape::Compound(compound) => compound.parts().iter().any(|part| part.shape.has_tree()),
            _ => false,
        }
    }

    /// Returns whether the shape is convex or a union of convex parts: all but meshes with concave edges.
    /// Builds the surface of a mesh on first use.
    pub fn has_convex_parts(&self) -> bool {
        match self {
            Shape::Mesh(mesh) => mesh.surfaces().iter().all(|surface| surface.field.is_convex()),
            Shape::Compound(compound) => compound.parts().iter().all(|part| part.shape.has_convex_parts()),
            _ => true,
        }
    }

    /// Returns the mean density of a compound whose parts have densities of their own, kg/m³.
    pub fn own_density(&self) -> Option<f64> {
        if let Shape::Compound(compound) = self { compound.own_density() } else { None }
    }

    /// Returns the sphere tree of a mesh or cylinder, built on first use for a cylinder.
    pub fn tree(&self) -> Option<&SphereTree> {
        match self {
            Shape::Cylinder(cylinder) => Some(cylinder.tree()),
            Shape::Mesh(mesh) => Some(mesh.tree()),
            _ => None,
        }
    }

    /// Returns the box in world axes around the shape at `pose`. A half-space that faces along an
    /// axis is bounded on that side; any other is unbounded on all sides. The boxes of meshes and
    /// cylinders include the leaves of their trees.
    pub fn aabb(&self, pose: &Pose) -> Aabb {
        let center = pose.translation.vector;
        let half = match self {
            Shape::HalfSpace => return half_space_aabb(pose),
            Shape::Sphere { radius } => Vec3::repeat(*radius),
            Shape::Box { half_extents } => pose.rotation.to_rotation_matrix().matrix().abs() * half_extents,
            Shape::Capsule { radius, half_length } => (axis(pose).abs() * *half_length).add_scalar(*radius),
            Shape::Cylinder(cylinder) => return cylinder.aabb(pose),
            Shape::Mesh(mesh) => return mesh.aabb(pose),
            Shape::Compound(compound) => return compound.aabb(pose),
            Shape::Ellipsoid { half_axes } => {
                // the support function along the world axes
                let turn = pose.rotation.to_rotation_matrix();
                let reach = |k: usize| turn.matrix().row(k).transpose().component_mul(half_axes).norm();
                Vec3::from_fn(|k, _| reach(k)) * (1.0 + 1e-12)
            }
            Shape::Cone { radius, height } => {
                let cone = Cone { radius: *radius, height: *height };
                let support = |n: Vec3| cone.support(&pose.rotation.inverse_transform_vector(&n));
                let rounding = Vec3::repeat(1e-12 * (radius + height));
                let low = Vec3::from_fn(|k, _| -support(Vec3::ith(k, -1.0))) - rounding;
                let high = Vec3::from_fn(|k, _| support(Vec3::ith(k, 1.0))) + rounding;
                return Aabb { min: center + low, max: center + high };
            }
            Shape::RoundedBox { .. } | Shape::RoundedCylinder { .. } => {
                let (core, rounding) = self.core();
                let own = core.aabb(pose);
                // of a half extent less the rounding and back: room for rounding
                return own.grown(rounding * (1.0 + 1e-12) + 1e-15 * center.amax());
            }
        };
        Aabb { min: center - half, max: center + half }
    }

    /// Returns the box in world axes around the surface of the shape at `pose`, without the leaves
    /// of its tree. The first call builds the tree of triangles of a mesh.
    pub fn tight_aabb(&self, pose: &Pose) -> Aabb {
        let (center, half) = match self {
            Shape::Cylinder(c) => {
                let axis = axis(pose);
                let disk = axis.map(|x| (1.0 - x * x).max(0.0).sqrt() * c.radius());
                (pose.translation.vector, axis.abs() * c.half_length() + disk)
            }
            Shape::Mesh(mesh) => {
                let Some(bounds) = mesh.ray_mesh().bounds() else { return self.aabb(pose) };
                let half = pose.rotation.to_rotation_matrix().matrix().abs() * (0.5 * (bounds.max - bounds.min));
                (pose.transform_point(&(0.5 * (bounds.min + bounds.max)).into()).coords, half)
            }
            Shape::Compound(compound) => return compound.tight_aabb(pose),
            Shape::RoundedBox { .. } | Shape::RoundedCylinder { .. } => {
                let (core, rounding) = self.core();
                return core.tight_aabb(pose).grown(rounding * (1.0 + 1e-12));
            }
            _ => return self.aabb(pose),
        };
        // room for rounding
        let half = half * (1.0 + 1e-12) + center.abs() * 1e-15;
        Aabb { min: center - half, max: center + half }
    }

    /// Returns the mass properties at a uniform `density` in kg/m³; of a compound whose parts have
    /// densities of their own, it is the mean.
    ///
    /// # Errors
    /// [`ShapeError::Density`] if the density is not finite and above 0, [`ShapeError::Unbounded`]
    /// for a half-space.
    pub fn mass_properties(&self, density: f64) -> Result<MassProperties, ShapeError> {
        if !(density.is_finite() && density > 0.0) {
            return Err(ShapeError::Density(density));
        }
        match self {
            Shape::HalfSpace => Err(ShapeError::Unbounded),
            Shape::Sphere { radius } => Ok(mass::sphere(*radius, density)),
            Shape::Box { half_extents } => Ok(mass::cuboid(half_extents, density)),
            Shape::Capsule { radius, half_length } => Ok(mass::capsule(*radius, *half_length, density)),
            Shape::Cylinder(c) => Ok(mass::cylinder(c.radius(), c.half_length(), density)),
            Shape::Mesh(mesh) => Ok(mesh.mass_properties(density)),
            Shape::Compound(compound) => Ok(compound.mass_properties(density)),
            Shape::Ellipsoid { half_axes } => Ok(mass::ellipsoid(half_axes, density)),
            Shape::Cone { radius, height } => Ok(mass::cone(*radius, *height, density)),
            Shape::RoundedBox { half_extents, rounding: r } => {
                Ok(mass::rounded_cuboid(&half_extents.add_scalar(-r), *r, density))
            }
            Shape::RoundedCylinder { core, rounding } => {
                Ok(mass::rounded_cylinder(core.radius(), core.half_length(), *rounding, density))
            }
        }
    }

    /// Returns the center of mass in the frame of the shape's description, meters: that of the file
    /// for a mesh, that of the parts for a compound, which are stored about their centers of mass; the
    /// origin for all others.
    pub fn center_of_mass(&self) -> Vec3 {
        match self {
            Shape::Mesh(mesh) => mesh.center_of_mass(),
            Shape::Compound(compound) => compound.center_of_mass(),
            _ => Vec3::zeros(),
        }
    }

    /// Returns the volume in m³; infinite for a half-space, the sum of its parts for a compound.
    pub fn volume(&self) -> f64 {
        match self {
            Shape::HalfSpace => f64::INFINITY,
            Shape::Sphere { radius } => mass::sphere_volume(*radius),
            Shape::Box { half_extents } => mass::cuboid_volume(half_extents),
            Shape::Capsule { radius, half_length } => {
                mass::sphere_volume(*radius) + mass::cylinder_volume(*radius, *half_length)
            }
            Shape::Cylinder(c) => mass::cylinder_volume(c.radius(), c.half_length()),
            Shape::Mesh(mesh) => mesh.volume(),
            Shape::Compound(compound) => compound.volume(),
            Shape::Ellipsoid { half_axes } => mass::ellipsoid_volume(half_axes),
            Shape::Cone { radius, height } => mass::cone_volume(*radius, *height),
            Shape::RoundedBox { half_extents, rounding: r } => {
                mass::rounded_cuboid_volume(&half_extents.add_scalar(-r), *r)
            }
            Shape::RoundedCylinder { core, rounding } => {
                mass::rounded_cylinder_volume(core.radius(), core.half_length(), *rounding)
            }
        }
    }

    /// Returns the radius of a sphere about the local origin that contains the shape, meters;
    /// infinite for a half-space.
    pub fn bounding_radius(&self) -> f64 {
        match self {
            Shape::HalfSpace => f64::INFINITY,
            Shape::Sphere { radius } => *radius,
            Shape::Box { half_extents } => half_extents.norm(),
            Shape::Capsule { radius, half_length } => radius + half_length,
            Shape::Cylinder(c) => (c.radius().powi(2) + c.half_length().powi(2)).sqrt(),
            Shape::Mesh(mesh) => mesh.bounding_radius(),
            Shape::Compound(compound) => compound.bounding_radius(),
            Shape::Ellipsoid { half_axes } => half_axes.max(),
            Shape::Cone { radius, height } => (radius.powi(2) + (0.25 * height).powi(2)).sqrt().max(0.75 * height),
            Shape::RoundedBox { .. } | Shape::RoundedCylinder { .. } => {
                let (core, rounding) = self.core();
                core.bounding_radius() + rounding
            }
        }
    }
}

/// Largest ratio of two sizes of an ellipsoid or cone: radii of curvature are up to its square.
const MAX_ASPECT: f64 = 1e5;

fn similar(what: &'static str, smallest: f64, largest: f64) -> Result<(), ShapeError> {
    if largest > MAX_ASPECT * smallest { Err(ShapeError::Aspect { what, smallest, largest }) } else { Ok(()) }
}

fn positive(what: &'static str, value: f64) -> Result<(), ShapeError> {
    if value.is_finite() && value > 0.0 { Ok(()) } else { Err(ShapeError::Length { what, value }) }
}

/// Returns half a length, exactly; both are above 0.
fn half(what: &'static str, value: f64) -> Result<f64, ShapeError> {
    let half = 0.5 * value;
    if half.is_finite() && half > 0.0 { Ok(half) } else { Err(ShapeError::Length { what, value }) }
}

/// Returns the local z axis in the world.
pub(crate) fn axis(pose: &Pose) -> Vec3 {
    pose.rotation * Vec3::z()
}

fn half_space_aabb(pose: &Pose) -> Aabb {
    let mut all = Aabb { min: Vec3::repeat(f64::NEG_INFINITY), max: Vec3::repeat(f64::INFINITY) };
    let normal = axis(pose);
    for k in 0..3 {
        // within rounding of the axis the plane rises less than 1e-12 m per meter and is treated as
        // perpendicular to it
        if normal[(k + 1) % 3].abs() < 1e-12 && normal[(k + 2) % 3].abs() < 1e-12 {
            let bound = if normal[k] > 0.0 { &mut all.max } else { &mut all.min };
            bound[k] = pose.translation.vector[k];
        }
    }
    all
}
