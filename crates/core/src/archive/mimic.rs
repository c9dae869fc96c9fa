//! Records of couplings of two joints.

use super::records::{ObjectIndices, id};
use super::{ArchiveError, damaged};
use crate::constraint::mimic::{JointRef, Mimic};
use crate::object::Object;
use crate::world::view::ObjectId;
use serde::{Deserialize, Serialize};

/// A joint; objects by index, if they still exist.
#[derive(Serialize, Deserialize)]
enum JointRecord {
    LoopJoint(Option<u32>),
    Dof(Option<u32>, usize),
}

/// A coupling.
#[derive(Serialize, Deserialize)]
pub(super) struct MimicRecord {
    name: String,
    joints: [JointRecord; 2],
    objects: Vec<Option<u32>>,
    multiplier: f64,
    offset: f64,
}

impl MimicRecord {
    pub fn of(mimic: &Mimic, indices: &ObjectIndices) -> MimicRecord {
        let [multiplier, offset] = mimic.ratio();
        MimicRecord {
            name: mimic.name().into(),
            joints: mimic.joints().map(|joint| match joint {
                JointRef::LoopJoint(joint) => JointRecord::LoopJoint(indices.of_id(joint)),
                JointRef::Dof(body, dof) => JointRecord::Dof(indices.of_id(body), dof),
            }),
            objects: mimic.objects().iter().map(|object| indices.of_id(*object)).collect(),
            multiplier,
            offset,
        }
    }

    pub fn mimic(self, ids: &[ObjectId]) -> Result<Mimic, ArchiveError> {
        let joints = self.joints.map(|joint| match joint {
            JointRecord::LoopJoint(index) => JointRef::LoopJoint(id(ids, index)),
            JointRecord::Dof(index, dof) => JointRef::Dof(id(ids, index), dof),
        });
        let objects = self.objects.into_iter().map(|index| id(ids, index)).collect();
        Mimic::restored(self.name, joints, objects, [self.multiplier, self.offset]).map_err(damaged)
    }
}
