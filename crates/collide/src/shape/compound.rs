//! Several shapes of one body.
//!
//! ```text
//! m = Σ ρᵢ Vᵢ      c = Σ ρᵢ Vᵢ cᵢ / m      I = Σ (Rᵢ Iᵢ Rᵢᵀ + mᵢ (|dᵢ|² 1 − dᵢ dᵢᵀ)),  dᵢ = cᵢ − c
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `ρᵢ`, `Vᵢ`, `mᵢ` | density (kg/m³), volume (m³) and mass (kg) of part `i` |
//! | `cᵢ`, `Rᵢ`, `Iᵢ` | its center of mass (m), rotation, and inertia in its own axes (kg·m²) |

use super::Shape;
use crate::{Aabb, CylinderShape, MassProperties, Mat3, MeshShape, Pose, ShapeError, TriMesh, Vec3};
use nalgebra::Translation3;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock};

/// Maximum number of parts: each is compared with all others once.
const MAX_PARTS: usize = 4096;
/// Number of parts up to which the box of a compound is that of the boxes of its parts.
const FEW_PARTS: usize = 16;
/// Number of sides of a round part, and of subdivisions of a sphere, in [`CompoundShape::mesh`].
const SIDES: usize = 48;
const SUBDIVISIONS: u32 = 3;
/// Depth above which a point is inside a part, in radii of the compound.
const BURIED: f64 = 1e-7;
/// Distance of a point beside a contact, in the same.
const BESIDE: f64 = 1e-5;

/// A shape at a pose in a [`CompoundShape`].
#[derive(Clone, Debug)]
pub struct CompoundPart {
    /// The shape; no half-space.
    pub shape: Shape,
    /// Pose of the shape's frame (for a mesh that of its vertices) in the frame of the compound.
    pub pose: Pose,
    /// Density, kg/m³; all parts of a compound have one or none has.
    pub density: Option<f64>,
    /// Name, not empty, unlike that of all other parts; a part that is a compound has none.
    pub name: Option<String>,
}

impl CompoundPart {
    /// Returns a part without a name and a density of its own.
    pub fn new(shape: Shape, pose: Pose) -> CompoundPart {
        CompoundPart { shape, pose, density: None, name: None }
    }

    /// Sets the name, by which contacts, hits and events report the part.
    #[must_use]
    pub fn with_name(mut self, name: impl Into<String>) -> Self {
        self.name = Some(name.into());
        self
    }

    /// Sets the density, kg/m³.
    #[must_use]
    pub fn with_density(mut self, density: f64) -> Self {
        self.density = Some(density);
        self
    }
}

/// Several shapes of one body, about their common center of mass. Parts may overlap; mass and volume
/// of an overlap then count for each.
#[derive(Clone, Debug)]
pub struct CompoundShape {
    parts: Vec<CompoundPart>,
    /// Poses of the parts' shapes about the center of mass.
    poses: Vec<Pose>,
    /// Mass properties at a mean density of 1.
    unit_mass: MassProperties,
    own_density: Option<f64>,
    /// Position of the origin in the frame of the parts.
    center: Vec3,
    bounding_radius: f64,
    /// Boxes of the parts, built on first use.
    boxes: OnceLock<Vec<Aabb>>,
    /// Parts whose boxes overlap that of each part.
    neighbors: OnceLock<Vec<Vec<u32>>>,
    /// Whether each part is there, for a compound that is a subset of another.
    active: Option<Vec<bool>>,
    /// The subsets made so far, by the indices of their parts.
    subsets: Arc<Mutex<Subsets>>,
}

type Subsets = BTreeMap<Vec<u32>, Arc<CompoundShape>>;

impl CompoundShape {
    /// Returns a compound; parts that are compounds are replaced by their own parts.
    ///
    /// # Errors
    /// [`ShapeError`]: no part or more than 4096, a half-space, a pose that is not finite, a density
    /// that is not above 0, parts with and without a density, two parts of one name, or an empty name.
    pub fn new(parts: Vec<CompoundPart>) -> Result<CompoundShape, ShapeError> {
        let parts = flattened(parts)?;
        if parts.is_empty() || parts.len() > MAX_PARTS {
            return Err(ShapeError::Parts { count: parts.len(), most: MAX_PARTS });
        }
        for (n, part) in parts.iter().enumerate() {
            if matches!(part.shape, Shape::HalfSpace) {
                return Err(ShapeError::UnboundedPart { number: n + 1 });
            }
            if !(part.pose.translation.vector.sum() + part.pose.rotation.coords.sum()).is_finite() {
                return Err(ShapeError::PartPose { number: n + 1 });
            }
            if part.density.is_some() != parts[0].density.is_some() {
                return Err(ShapeError::PartDensity { number: n + 1, has: part.density.is_some() });
            }
        }
        check_names(&parts)?;
        let placed = |part: &CompoundPart| part.pose * Translation3::from(part.shape.center_of_mass());
        let (mut mass, mut volume, mut moment) = (0.0, 0.0, Vec3::zeros());
        let mut own = Vec::with_capacity(parts.len());
        for part in &parts {
            let properties = part.shape.mass_properties(part.density.unwrap_or(1.0))?;
            mass += properties.mass;
            volume += part.shape.volume();
            moment += properties.mass * placed(part).translation.vector;
            own.push(properties);
        }
        let (center, mean) = (moment / mass, mass / volume);
        let poses: Vec<Pose> = parts.iter().map(|part| Translation3::from(-center) * placed(part)).collect();
        let mut inertia = Mat3::zeros();
        for (properties, pose) in own.iter().zip(&poses) {
            let (r, d) = (pose.rotation.to_rotation_matrix().into_inner(), pose.translation.vector);
            inertia += r * properties.inertia * r.transpose()
                + properties.mass * (Mat3::identity() * d.norm_squared() - d * d.transpose());
        }
        let radius = |(part, pose): (&CompoundPart, &Pose)| {
            let corner = |d: f64| part.shape.bounding_radius() + d;
            match &part.shape {
                Shape::Box { half_extents: h } => (pose.rotation.inverse() * pose.translation.vector).abs() + h,
                Shape::Capsule { radius, half_length } => {
                    let across = Vec3::new(0.0, 0.0, *half_length);
                    let offset = (pose.rotation.inverse() * pose.translation.vector).abs() + across;
                    return offset.norm() + radius;
                }
                _ => return corner(pose.translation.vector.norm()),
            }
            .norm()
        };
        let bounding_radius = parts.iter().zip(&poses).map(radius).fold(0.0, f64::max);
        if !(mass > 0.0 && (mass + volume + bounding_radius + inertia.sum()).is_finite()) {
            return Err(ShapeError::Length { what: "size of a compound", value: bounding_radius });
        }
        Ok(CompoundShape {
            own_density: parts[0].density.map(|_| mean),
            parts,
            poses,
            unit_mass: MassProperties { mass: volume, center_of_mass: Vec3::zeros(), inertia: inertia / mean },
            center,
            bounding_radius,
            boxes: OnceLock::new(),
            neighbors: OnceLock::new(),
            active: None,
            subsets: Arc::default(),
        })
    }

    /// Returns the compound with only some of its parts, ascending and of indices below their number, for contacts and queries:
    /// parts keep their indices, and frame, mass and bounding radius stay those of the whole. Made once for each subset.
    pub fn subset(&self, parts: &[u32]) -> Arc<CompoundShape> {
        let mut made = self.subsets.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        if let Some(known) = made.get(parts) {
            return known.clone();
        }
        let mut active = vec![false; self.parts.len()];
        for part in parts {
            active.get_mut(*part as usize).into_iter().for_each(|active| *active = self.is_active(*part as usize));
        }
        let subset = Arc::new(CompoundShape { active: Some(active), subsets: Arc::default(), ..self.clone() });
        made.insert(parts.to_vec(), subset.clone());
        subset
    }

    /// Returns whether a part is there: all are, except in a [`subset`](Self::subset).
    pub fn is_active(&self, part: usize) -> bool {
        self.active.as_ref().is_none_or(|active| active.get(part).copied().unwrap_or(false))
    }

    /// Returns the index, the shape and the pose about the center of mass of each part that is there.
    pub fn active_parts(&self) -> impl Iterator<Item = (usize, &Shape, &Pose)> {
        self.placed().enumerate().filter(|(n, _)| self.is_active(*n)).map(|(n, (shape, pose))| (n, shape, pose))
    }

    /// Returns the parts, in the frame in which they were given.
    pub fn parts(&self) -> &[CompoundPart] {
        &self.parts
    }

    /// Returns each part's shape with its pose about the center of mass.
    pub fn placed(&self) -> impl Iterator<Item = (&Shape, &Pose)> {
        self.parts.iter().map(|part| &part.shape).zip(&self.poses)
    }

    /// Returns the mean density of parts with densities of their own, kg/m³.
    pub fn own_density(&self) -> Option<f64> {
        self.own_density
    }

    /// Returns the sum of the volumes of the parts, m³.
    pub fn volume(&self) -> f64 {
        self.unit_mass.mass
    }

    /// Returns the center of mass in the frame of the parts, meters.
    pub fn center_of_mass(&self) -> Vec3 {
        self.center
    }

    /// Returns the radius of a sphere about the center of mass that contains all parts, meters.
    pub fn bounding_radius(&self) -> f64 {
        self.bounding_radius
    }

    /// Returns the mass properties at a mean density, kg/m³.
    pub(crate) fn mass_properties(&self, density: f64) -> MassProperties {
        MassProperties {
            inertia: self.unit_mass.inertia * density,
            ..self.unit_mass.with_mass(self.unit_mass.mass * density)
        }
    }

    /// Returns the boxes of the parts in the frame of the compound.
    pub(crate) fn boxes(&self) -> &[Aabb] {
        self.boxes.get_or_init(|| self.placed().map(|(shape, pose)| shape.aabb(pose)).collect())
    }

    /// Returns the box in world axes around the boxes of the parts.
    pub(crate) fn aabb(&self, pose: &Pose) -> Aabb {
        if self.parts.len() <= FEW_PARTS {
            return joined(self.active_parts().map(|(_, shape, own)| shape.aabb(&(pose * own))));
        }
        turned(&joined((0..).zip(self.boxes()).filter(|(n, _)| self.is_active(*n)).map(|(_, own)| *own)), pose)
    }

    /// Returns the box in world axes around the surfaces of the parts.
    pub(crate) fn tight_aabb(&self, pose: &Pose) -> Aabb {
        joined(self.active_parts().map(|(_, shape, own)| shape.tight_aabb(&(pose * own))))
    }

    /// Returns whether a point, in the compound's frame, on part `part` lies inside another part.
    pub(crate) fn is_buried(&self, part: usize, point: &Vec3) -> bool {
        let depth = BURIED * self.bounding_radius;
        let inside = |other: u32| {
            let other = other as usize;
            self.is_active(other) && self.parts[other].shape.closest_point(&self.poses[other], point).distance < -depth
        };
        self.neighbors()[part].iter().any(|other| inside(*other))
    }

    /// Returns whether a contact of part `part`, at a point of its surface with this outward normal, both in the compound's frame, is
    /// inside another part: the point, or the surface beside it towards the middle of the part. The
    /// latter is true at the end of a face that another part covers.
    pub fn has_no_contact(&self, part: usize, point: &Vec3, outward: &Vec3) -> bool {
        let arm = point - self.poses[part].translation.vector;
        let across = arm - outward * outward.dot(&arm);
        let inward = across.try_normalize(BESIDE * self.bounding_radius).map_or(Vec3::zeros(), |across| -across);
        let beside = point + (outward + inward) * (BESIDE * self.bounding_radius);
        self.is_buried(part, point) || self.is_buried(part, &beside)
    }

    fn neighbors(&self) -> &[Vec<u32>] {
        self.neighbors.get_or_init(|| {
            let boxes = self.boxes();
            let meets = |a: &Aabb, b: &Aabb| (0..3).all(|k| a.min[k] <= b.max[k] && b.min[k] <= a.max[k]);
            let others = |n: usize| (0..boxes.len()).filter(move |m| *m != n && meets(&boxes[n], &boxes[*m]));
            (0..boxes.len()).map(|n| others(n).map(|m| m as u32).collect()).collect()
        })
    }

    /// Returns the surfaces of all parts as triangles, in the frame of the compound; round parts with
    /// 48 sides. For drawing.
    pub fn mesh(&self) -> TriMesh {
        let mut all = TriMesh { vertices: Vec::new(), triangles: Vec::new() };
        for (shape, pose) in self.placed() {
            let mesh = surface(shape);
            let first = all.vertices.len() as u32;
            all.vertices.extend(mesh.vertices.iter().map(|v| pose.transform_point(&(*v).into()).coords));
            all.triangles.extend(mesh.triangles.iter().map(|t| t.map(|v| v + first)));
        }
        all
    }
}

/// Numbers and names of the shapes of which a shape consists.
impl Shape {
    /// Returns how many shapes it consists of: the parts of a compound, 1 for all others.
    pub fn part_count(&self) -> usize {
        if let Shape::Compound(compound) = self { compound.parts().len() } else { 1 }
    }

    /// Returns the name of a compound's part; `None` for a part without one and for all other shapes.
    pub fn part_name(&self, part: usize) -> Option<&str> {
        let Shape::Compound(compound) = self else { return None };
        compound.parts().get(part)?.name.as_deref()
    }
}

/// Returns the surface of a shape as triangles; a half-space and a compound have none.
fn surface(shape: &Shape) -> TriMesh {
    match shape {
        Shape::Sphere { radius } => TriMesh::icosphere(*radius, SUBDIVISIONS),
        Shape::Box { half_extents } => TriMesh::cuboid(2.0 * half_extents),
        Shape::Capsule { radius, half_length } => TriMesh::capsule(*radius, 2.0 * half_length, SIDES, SIDES / 4),
        Shape::Cylinder(c) => TriMesh::cylinder(c.radius(), 2.0 * c.half_length(), SIDES),
        Shape::Mesh(mesh) => mesh.mesh().clone(),
        Shape::Ellipsoid { .. } | Shape::Cone { .. } | Shape::RoundedBox { .. } | Shape::RoundedCylinder { .. } => {
            shape.surface_mesh(SIDES)
        }
        Shape::HalfSpace | Shape::Compound(_) => TriMesh { vertices: Vec::new(), triangles: Vec::new() },
    }
}

/// Checks that no name is empty and that none occurs twice.
fn check_names(parts: &[CompoundPart]) -> Result<(), ShapeError> {
    let mut known = BTreeMap::new();
    for (n, name) in parts.iter().enumerate().filter_map(|(n, part)| Some((n, part.name.as_ref()?))) {
        if name.is_empty() {
            return Err(ShapeError::EmptyName { number: n + 1 });
        }
        if let Some(first) = known.insert(name, n) {
            return Err(ShapeError::PartNames { first: first + 1, second: n + 1, name: name.clone() });
        }
    }
    Ok(())
}

/// Replaces compounds by their parts. A density of a compound is the mean of its parts'.
fn flattened(parts: Vec<CompoundPart>) -> Result<Vec<CompoundPart>, ShapeError> {
    let mut flat = Vec::with_capacity(parts.len());
    for part in parts {
        if let Some(density) = part.density.filter(|density| !(density.is_finite() && *density > 0.0)) {
            return Err(ShapeError::Density(density));
        }
        let Shape::Compound(inner) = &part.shape else {
            flat.push(part);
            continue;
        };
        if let Some(name) = part.name {
            return Err(ShapeError::CompoundName { number: flat.len() + 1, name });
        }
        let mean = inner.own_density;
        flat.extend(inner.parts.iter().map(|own| CompoundPart {
            shape: own.shape.clone(),
            pose: part.pose * own.pose,
            name: own.name.clone(),
            density: match (part.density, mean) {
                (Some(density), Some(mean)) => own.density.map(|own| own * density / mean),
                (given, None) => given,
                (None, Some(_)) => own.density,
            },
        }));
    }
    Ok(flat)
}

fn joined(boxes: impl Iterator<Item = Aabb>) -> Aabb {
    let none = Aabb { min: Vec3::repeat(f64::INFINITY), max: Vec3::repeat(f64::NEG_INFINITY) };
    boxes.fold(none, |all, one| Aabb { min: all.min.inf(&one.min), max: all.max.sup(&one.max) })
}

fn turned(own: &Aabb, pose: &Pose) -> Aabb {
    let center = pose.transform_point(&(0.5 * (own.min + own.max)).into()).coords;
    let half = pose.rotation.to_rotation_matrix().matrix().abs() * (0.5 * (own.max - own.min));
    Aabb { min: center - half, max: center + half }
}

/// A part's shape in an archive. Without compounds, so that bytes cannot nest.
#[derive(Serialize, Deserialize)]
enum StoredShape {
    Sphere(f64),
    Box(Vec3),
    Capsule(f64, f64),
    Cylinder(#[serde(with = "crate::archive::shared")] Arc<CylinderShape>),
    Mesh(#[serde(with = "crate::archive::shared")] Arc<MeshShape>),
    Ellipsoid(Vec3),
    Cone(f64, f64),
    RoundedBox(Vec3, f64),
    RoundedCylinder(#[serde(with = "crate::archive::shared")] Arc<CylinderShape>, f64),
}

impl Serialize for CompoundShape {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let stored = |part: &CompoundPart| {
            let shape = match &part.shape {
                Shape::Sphere { radius } => StoredShape::Sphere(*radius),
                Shape::Box { half_extents } => StoredShape::Box(*half_extents),
                Shape::Capsule { radius, half_length } => StoredShape::Capsule(*radius, *half_length),
                Shape::Cylinder(cylinder) => StoredShape::Cylinder(cylinder.clone()),
                Shape::Mesh(mesh) => StoredShape::Mesh(mesh.clone()),
                Shape::Ellipsoid { half_axes } => StoredShape::Ellipsoid(*half_axes),
                Shape::Cone { radius, height } => StoredShape::Cone(*radius, *height),
                Shape::RoundedBox { half_extents, rounding } => StoredShape::RoundedBox(*half_extents, *rounding),
                Shape::RoundedCylinder { core, rounding } => StoredShape::RoundedCylinder(core.clone(), *rounding),
                // neither is a part
                Shape::HalfSpace | Shape::Compound(_) => StoredShape::Sphere(0.0),
            };
            (shape, part.pose, part.density, part.name.clone())
        };
        self.parts.iter().map(stored).collect::<Vec<_>>().serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for CompoundShape {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<CompoundShape, D::Error> {
        let stored = Vec::<(StoredShape, Pose, Option<f64>, Option<String>)>::deserialize(deserializer)?;
        let part = |(shape, pose, density, name)| {
            let shape = match shape {
                StoredShape::Sphere(radius) => Shape::Sphere { radius },
                StoredShape::Box(half_extents) => Shape::Box { half_extents },
                StoredShape::Capsule(radius, half_length) => Shape::Capsule { radius, half_length },
                StoredShape::Cylinder(cylinder) => Shape::Cylinder(cylinder),
                StoredShape::Mesh(mesh) => Shape::Mesh(mesh),
                StoredShape::Ellipsoid(half_axes) => Shape::Ellipsoid { half_axes },
                StoredShape::Cone(radius, height) => Shape::Cone { radius, height },
                StoredShape::RoundedBox(half_extents, rounding) => Shape::RoundedBox { half_extents, rounding },
                StoredShape::RoundedCylinder(core, rounding) => Shape::RoundedCylinder { core, rounding },
            };
            shape.validate()?;
            Ok(CompoundPart { shape, pose, density, name })
        };
        let parts = stored.into_iter().map(part).collect::<Result<Vec<_>, ShapeError>>();
        parts.and_then(CompoundShape::new).map_err(serde::de::Error::custom)
    }
}
