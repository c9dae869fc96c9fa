//! The constants of a world as data, to compare two worlds field by field.
//!
//! A format that describes worlds in words of its own, such as scene files, shows by this that it has
//! left nothing out: the world that is read has the constants of the world that was written.

use super::records::{ObjectIndices, PairRecord, Tables};
use super::{NamedRecord, record};
use crate::object::Object;
use crate::settings::Settings;
use crate::world::World;
use crate::world::view::ObjectId;
use crate::world::view::Status;
use crate::{ArticulatedBody, LoopJoint, RigidBody, Template};
use serde::{Serialize, Serializer};
use std::collections::BTreeSet;
use tumble_collide::{Shape, Vec3};

/// Everything that is constant during a step, except meshes that are only drawn.
#[derive(Serialize)]
struct Constants<'w> {
    settings: &'w Settings,
    stepper: &'w str,
    solver: &'w str,
    objects: Vec<NamedRecord>,
    status: Vec<Status>,
    shapes: Vec<Outline>,
    pairs: Vec<PairRecord>,
}

/// Kind and measures of a shape.
#[derive(Serialize)]
struct Outline {
    kind: &'static str,
    volume: f64,
    center: Vec3,
    radius: f64,
    names: Vec<Option<String>>,
}

impl World {
    /// Writes settings, objects and pairs without the state: first the rigid bodies, then the
    /// articulated ones, then the loop joints, each in the order of the world; then bodies of templates and all other objects by
    /// their names. The names of the fields are no part of
    /// the interface, except that `initial_pose`, `initial_velocity` and `start` are of time 0, that
    /// `visuals`, `cameras` and `lights` have no effect on motion, and that `colliders` may be in
    /// another order.
    ///
    /// # Errors
    /// Those of the serializer.
    pub fn serialize_constants<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut ids = self.ids().to_vec();
        let templates = ids.iter().filter_map(|&id| self.get::<Template>(id));
        let spawned: BTreeSet<ObjectId> = templates.flat_map(Template::bodies).copied().collect();
        ids.sort_by_cached_key(|&id| match self.object(id).map_or(OTHER, rank) {
            rank if rank < OTHER && !spawned.contains(&id) => (rank, String::new()),
            _ => (OTHER, self.name(id).unwrap_or_default().to_owned()),
        });
        let (mut tables, indices) = (Tables::default(), ObjectIndices::of(&ids));
        (tables.shapes.repeated, tables.meshes.skipped) = (true, true);
        let objects = ids.iter().filter_map(|&id| Some((self.name(id)?, self.object(id)?)));
        let objects = objects
            .map(|(name, object)| NamedRecord { name: name.into(), record: record(object, &mut tables, &indices) });
        let objects = objects.collect();
        let mut pairs: Vec<PairRecord> =
            self.pair_materials().filter_map(|(sides, material)| PairRecord::of(sides, material, &indices)).collect();
        pairs.sort_unstable_by_key(|pair| pair.sides);
        let constants = Constants {
            settings: self.settings(),
            stepper: self.stepper_name(),
            solver: self.solver_name(),
            objects,
            status: ids.iter().filter_map(|&id| self.status(id)).collect(),
            shapes: tables.shapes.list.iter().map(outline).collect(),
            pairs,
        };
        constants.serialize(serializer)
    }
}

/// Place of all other kinds.
const OTHER: u8 = 3;

/// Returns the place of an object's kind in the order of kinds.
fn rank(object: &dyn Object) -> u8 {
    let any: &dyn std::any::Any = object;
    match () {
        _ if any.is::<RigidBody>() => 0,
        _ if any.is::<ArticulatedBody>() => 1,
        _ if any.is::<LoopJoint>() => 2,
        _ => OTHER,
    }
}

fn outline(shape: &Shape) -> Outline {
    let kind = match shape {
        Shape::HalfSpace => "half-space",
        Shape::Sphere { .. } => "sphere",
        Shape::Box { .. } => "box",
        Shape::Capsule { .. } => "capsule",
        Shape::Cylinder(_) => "cylinder",
        Shape::Mesh(_) => "mesh",
        Shape::Compound(_) => "compound",
        Shape::Ellipsoid { .. } => "ellipsoid",
        Shape::Cone { .. } => "cone",
        Shape::RoundedBox { .. } => "rounded box",
        Shape::RoundedCylinder { .. } => "rounded cylinder",
    };
    let bounded = kind != "half-space";
    Outline {
        kind,
        volume: if bounded { shape.volume() } else { 0.0 },
        center: shape.center_of_mass(),
        radius: if bounded { shape.bounding_radius() } else { 0.0 },
        names: (0..shape.part_count()).map(|part| shape.part_name(part).map(str::to_owned)).collect(),
    }
}
