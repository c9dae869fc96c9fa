//! Records of an archive that refer to objects by index, and to shapes by index in a table.

use super::{ArchiveError, ContactPoint, Event, EventKind, StepReport, UnreachableJoint, WorstSolve, damaged};
use crate::articulated::DofSettings;
use crate::constraint::loop_joint::{Anchor, LoopJoint, LoopJointKind, Transmission};
use crate::contact::pair_material::{PairMaterial, PairSide};
use crate::object::visual::{Visual, VisualGeometry, VisualMesh};
use crate::object::{Appearance, Object};
use crate::world::view::ObjectId;
use crate::world::{World, WorldError};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::Arc;
use tumble_collide::{Pose, Shape, TriMesh, Vec3};

/// All shapes, each written once: shared shapes are identified by their address.
#[derive(Default)]
pub(super) struct ShapeTable {
    pub list: Vec<Shape>,
    tables: BTreeMap<usize, u32>,
    /// Whether shared shapes are written once for each use.
    pub repeated: bool,
}

impl ShapeTable {
    /// Returns the index of a shape.
    pub fn index(&mut self, shape: &Shape) -> u32 {
        let next = self.list.len() as u32;
        let address = match shape {
            _ if self.repeated => None,
            Shape::Mesh(mesh) => Some(Arc::as_ptr(mesh).addr()),
            Shape::Cylinder(cylinder) => Some(Arc::as_ptr(cylinder).addr()),
            Shape::Compound(compound) => Some(Arc::as_ptr(compound).addr()),
            Shape::RoundedCylinder { .. } => None, // its core may be that of another rounding
            _ => None,
        };
        let index = address.map_or(next, |address| *self.tables.entry(address).or_insert(next));
        if index == next {
            self.list.push(shape.clone());
        }
        index
    }
}

/// Returns the shape at an index.
pub(super) fn shape(shapes: &[Shape], index: u32) -> Result<Shape, ArchiveError> {
    shapes.get(index as usize).cloned().ok_or_else(|| damaged(format!("there is no shape {index}")))
}

/// All visual meshes, each written once. They are read here, so the archive needs none of their
/// files.
#[derive(Default)]
pub(super) struct MeshTable {
    pub list: Vec<MeshRecord>,
    tables: BTreeMap<usize, u32>,
    /// Whether no mesh is read.
    pub skipped: bool,
}

/// Source of a visual mesh, with its triangles or the reason why they cannot be read.
pub(super) type MeshRecord = (String, Result<TriMesh, String>);

impl MeshTable {
    fn index(&mut self, mesh: &Arc<VisualMesh>) -> u32 {
        if self.skipped {
            return 0;
        }
        *self.tables.entry(Arc::as_ptr(mesh).addr()).or_insert_with(|| {
            let triangles = mesh.triangles().map(|mesh| TriMesh::clone(mesh)).map_err(str::to_owned);
            self.list.push((mesh.name().to_owned(), triangles));
            self.list.len() as u32 - 1
        })
    }
}

/// Returns the meshes of a table.
pub(super) fn meshes(list: Vec<MeshRecord>) -> Vec<Arc<VisualMesh>> {
    let mesh = |(name, triangles): MeshRecord| {
        let triangles = triangles.map(Arc::new);
        Arc::new(VisualMesh::read_by(name, move || triangles.clone()))
    };
    list.into_iter().map(mesh).collect()
}

/// Indices of objects in the order of insertion.
pub struct ObjectIndices(BTreeMap<ObjectId, u32>);

impl ObjectIndices {
    pub(super) fn of(ids: &[ObjectId]) -> ObjectIndices {
        ObjectIndices(ids.iter().zip(0..).map(|(id, index)| (*id, index)).collect())
    }

    /// Returns the index of an object; `None` for a removed one.
    pub fn of_id(&self, id: ObjectId) -> Option<u32> {
        self.0.get(&id).copied()
    }
}

/// Returns the id at an index, or an id of no object.
pub(super) fn id(ids: &[ObjectId], index: Option<u32>) -> ObjectId {
    index.and_then(|index| ids.get(index as usize)).copied().unwrap_or_default()
}

/// One side of a loop joint: index of its object, if that still exists, and part; `None` for the
/// world.
type Side = (Option<(Option<u32>, usize)>, Pose);

/// A loop joint.
#[derive(Serialize, Deserialize)]
pub(super) struct LoopJointRecord {
    name: String,
    kind: LoopJointKind,
    sides: [Side; 2],
    /// Settings and armature of each degree of freedom.
    dofs: Vec<(DofSettings, f64)>,
    cone: Option<f64>,
    twist_limits: Option<[f64; 2]>,
    length: Option<f64>,
    breaking: [f64; 2],
    transmission: Transmission,
}

impl LoopJointRecord {
    pub fn of(loop_joint: &LoopJoint, indices: &ObjectIndices) -> LoopJointRecord {
        let side = |a: Anchor| (a.part.map(|(id, part)| (indices.of_id(id), part)), a.frame);
        LoopJointRecord {
            name: loop_joint.name().into(),
            kind: loop_joint.kind(),
            sides: loop_joint.sides().map(side),
            dofs: (0..loop_joint.kind().dofs())
                .filter_map(|k| Some((loop_joint.dof_at(k)?.clone(), loop_joint.armature_at(k)?)))
                .collect(),
            cone: loop_joint.cone(),
            twist_limits: loop_joint.twist_limits(),
            length: loop_joint.given_length(),
            breaking: loop_joint.breaking(),
            transmission: *loop_joint.transmission(),
        }
    }

    pub fn loop_joint(self, ids: &[ObjectId]) -> Result<LoopJoint, ArchiveError> {
        let [a, b] = self.sides.map(|(part, frame)| {
            let part = part.map(|(index, part)| (id(ids, index), part));
            Anchor { part, frame, link: None }
        });
        let mut joint = LoopJoint::new(self.name, self.kind, a, b).map_err(damaged)?;
        joint.set_transmission(self.transmission).map_err(damaged)?;
        if let Some(length) = self.length {
            joint.set_length(length).map_err(damaged)?;
        }
        for (k, (dof, armature)) in self.dofs.into_iter().enumerate() {
            joint.set_dof_at(k, dof).map_err(damaged)?;
            joint.set_armature_at(k, armature).map_err(damaged)?;
        }
        joint.set_cone(self.cone).map_err(damaged)?;
        joint.set_twist_limits(self.twist_limits).map_err(damaged)?;
        let [force, torque] = self.breaking;
        joint.set_breaking(force, torque).map_err(damaged)?;
        Ok(joint)
    }
}

/// A contact.
#[derive(Serialize, Deserialize)]
pub(super) struct ContactRecord {
    sides: [(Option<u32>, usize); 2],
    shapes: [usize; 2],
    /// Point, normal, velocity, impulse, force.
    vectors: [Vec3; 5],
    depth: f64,
}

impl ContactRecord {
    pub fn of(c: &ContactPoint, indices: &ObjectIndices) -> ContactRecord {
        ContactRecord {
            sides: [(indices.of_id(c.a), c.part_a), (indices.of_id(c.b), c.part_b)],
            shapes: [c.shape_a, c.shape_b],
            vectors: [c.point, c.normal, c.velocity, c.impulse, c.force],
            depth: c.depth,
        }
    }

    pub fn contact(self, ids: &[ObjectId]) -> ContactPoint {
        let [(a, part_a), (b, part_b)] = self.sides;
        let [shape_a, shape_b] = self.shapes;
        let [point, normal, velocity, impulse, force] = self.vectors;
        ContactPoint {
            a: id(ids, a),
            part_a,
            shape_a,
            b: id(ids, b),
            part_b,
            shape_b,
            point,
            normal,
            depth: self.depth,
            velocity,
            impulse,
            force,
        }
    }
}

/// An event of the last frame; objects by index.
#[derive(Serialize, Deserialize)]
pub(super) struct EventRecord {
    kind: EventKind,
    sides: [(Option<u32>, usize); 2],
    shapes: [usize; 2],
    /// Impulse, point.
    vectors: [Vec3; 2],
}

impl EventRecord {
    pub fn of(e: &Event, indices: &ObjectIndices) -> EventRecord {
        EventRecord {
            kind: e.kind,
            sides: [(indices.of_id(e.a), e.part_a), (e.b.and_then(|b| indices.of_id(b)), e.part_b)],
            shapes: [e.shape_a, e.shape_b],
            vectors: [e.impulse, e.point],
        }
    }

    pub fn event(self, ids: &[ObjectId]) -> Event {
        let [(a, part_a), (b, part_b)] = self.sides;
        let [impulse, point] = self.vectors;
        let [shape_a, shape_b] = self.shapes;
        let b = b.map(|b| id(ids, Some(b)));
        Event { part_a, shape_a, part_b, shape_b, impulse, point, ..Event::of(self.kind, id(ids, a), b) }
    }
}

/// One side of a pair with its own surface constants; objects by index.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(super) enum PairSideRecord {
    Part(u32, usize),
    Object(u32),
    Material(u32),
}

/// A pair with its own surface constants.
#[derive(Serialize, Deserialize)]
pub(super) struct PairRecord {
    /// Sorted.
    pub sides: [PairSideRecord; 2],
    restitution: Option<f64>,
    friction: Option<f64>,
    rolling_friction: Option<f64>,
    torsional_friction: Option<f64>,
    collides: Option<bool>,
}

impl PairRecord {
    /// Returns `None` for a pair whose object was removed.
    pub fn of(sides: &[PairSide; 2], material: &PairMaterial, indices: &ObjectIndices) -> Option<PairRecord> {
        let side = |side: PairSide| {
            Some(match side {
                PairSide::Part(id, part) => PairSideRecord::Part(indices.of_id(id)?, part),
                PairSide::Object(id) => PairSideRecord::Object(indices.of_id(id)?),
                PairSide::Material(material) => PairSideRecord::Material(material),
            })
        };
        let PairMaterial { restitution, friction, rolling_friction, torsional_friction, collides } = *material;
        let mut sides = [side(sides[0])?, side(sides[1])?];
        sides.sort_unstable();
        Some(PairRecord { sides, restitution, friction, rolling_friction, torsional_friction, collides })
    }

    /// Adds the pair to a world with these objects.
    pub fn put(self, world: &mut World, ids: &[ObjectId]) -> Result<(), WorldError> {
        let [a, b] = self.sides.map(|side| match side {
            PairSideRecord::Part(index, part) => PairSide::Part(id(ids, Some(index)), part),
            PairSideRecord::Object(index) => PairSide::Object(id(ids, Some(index))),
            PairSideRecord::Material(material) => PairSide::Material(material),
        });
        let PairRecord { restitution, friction, rolling_friction, torsional_friction, collides, .. } = self;
        let material = PairMaterial { restitution, friction, rolling_friction, torsional_friction, collides };
        world.set_pair_material(a, b, material)
    }
}

/// The report of the last step; its loop joint by index, with distance and angle, and the objects of
/// its worst solve by index.
#[derive(Serialize, Deserialize)]
pub(super) struct ReportRecord {
    report: StepReport,
    unreachable_joint: Option<(Option<u32>, f64, f64)>,
    worst_solve: Option<WorstSolveRecord>,
}

/// The worst solve of a report.
#[derive(Serialize, Deserialize)]
struct WorstSolveRecord {
    /// Object and other object of the row.
    sides: [Option<u32>; 2],
    objects: u32,
    rows: u32,
    tolerance: f64,
    converged: bool,
}

impl WorstSolveRecord {
    fn of(worst: &WorstSolve, indices: &ObjectIndices) -> WorstSolveRecord {
        let WorstSolve { object, other, objects, rows, tolerance, converged } = *worst;
        let sides = [indices.of_id(object), other.and_then(|other| indices.of_id(other))];
        WorstSolveRecord { sides, objects, rows, tolerance, converged }
    }

    fn worst_solve(self, ids: &[ObjectId]) -> WorstSolve {
        let WorstSolveRecord { sides: [object, other], objects, rows, tolerance, converged } = self;
        let other = other.map(|other| id(ids, Some(other)));
        WorstSolve { object: id(ids, object), other, objects, rows, tolerance, converged }
    }
}

impl ReportRecord {
    pub fn of(report: &StepReport, indices: &ObjectIndices) -> ReportRecord {
        let unreachable_joint = report.unreachable_joint.map(|o| (indices.of_id(o.loop_joint), o.distance, o.angle));
        let worst_solve = report.worst_solve.map(|worst| WorstSolveRecord::of(&worst, indices));
        ReportRecord { report: *report, unreachable_joint, worst_solve }
    }

    pub fn report(self, ids: &[ObjectId]) -> StepReport {
        let joint = |(index, distance, angle)| UnreachableJoint { loop_joint: id(ids, index), distance, angle };
        StepReport {
            unreachable_joint: self.unreachable_joint.map(joint),
            worst_solve: self.worst_solve.map(|worst| worst.worst_solve(ids)),
            ..self.report
        }
    }
}

/// A visual.
#[derive(Serialize, Deserialize)]
pub(super) struct VisualRecord {
    part: usize,
    pose: Pose,
    geometry: GeometryRecord,
    appearance: Appearance,
    stands_in_for: Vec<u32>,
}

/// Index of a shape, or of a visual mesh.
#[derive(Serialize, Deserialize)]
enum GeometryRecord {
    Shape(u32),
    Mesh(u32),
}

/// Tables that visuals refer to, while an archive is written.
#[derive(Default)]
pub(super) struct Tables {
    pub shapes: ShapeTable,
    pub meshes: MeshTable,
}

/// Tables that visuals refer to, while an archive is read.
pub(super) struct LoadedTables {
    pub shapes: Vec<Shape>,
    pub meshes: Vec<Arc<VisualMesh>>,
}

impl VisualRecord {
    pub fn of(visual: &Visual, tables: &mut Tables) -> VisualRecord {
        let Visual { part, pose, geometry, appearance, stands_in_for } = visual;
        let geometry = match geometry {
            VisualGeometry::Shape(shape) => GeometryRecord::Shape(tables.shapes.index(shape)),
            VisualGeometry::Mesh(mesh) => GeometryRecord::Mesh(tables.meshes.index(mesh)),
        };
        let stands_in_for = stands_in_for.iter().map(|mesh| tables.meshes.index(mesh)).collect();
        VisualRecord { part: *part, pose: *pose, geometry, appearance: appearance.clone(), stands_in_for }
    }

    pub fn visual(self, tables: &LoadedTables) -> Result<Visual, ArchiveError> {
        let mesh = |index: u32| {
            let mesh = tables.meshes.get(index as usize).cloned();
            mesh.ok_or_else(|| damaged(format!("there is no visual mesh {index}")))
        };
        let geometry = match self.geometry {
            GeometryRecord::Shape(index) => VisualGeometry::Shape(shape(&tables.shapes, index)?),
            GeometryRecord::Mesh(index) => VisualGeometry::Mesh(mesh(index)?),
        };
        let stands_in_for = self.stands_in_for.into_iter().map(mesh).collect::<Result<_, _>>()?;
        Ok(Visual { part: self.part, pose: self.pose, geometry, appearance: self.appearance, stands_in_for })
    }
}
