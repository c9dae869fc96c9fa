//! Couplings of joints of a scene.

use tumble_core::{JointRef, Mimic, World};

use super::error::BuildError;
use crate::parse::file::SceneFile;
use crate::parse::loop_joint::PartSpec;
use crate::parse::mimic::{JointMimicSpec, JointSideSpec};

impl SceneFile {
    pub(super) fn add_mimic(&self, spec: &JointMimicSpec, world: &mut World) -> Result<(), BuildError> {
        let wrong = |why: String| BuildError::Mimic { scene: self.file.clone(), why };
        let gone = || wrong(format!("mimic '{}': a joint of it is not in the world", spec.name));
        let [Some(joint), Some(of)] = [spec.joint, spec.of].map(|side| match side {
            JointSideSpec::LoopJoint(index) => world.find(&self.loop_joints[index].name).map(JointRef::LoopJoint),
            JointSideSpec::Link(tree, link) => {
                self.joint_of(world, &PartSpec::Link(tree, link)).map(|(id, dof)| JointRef::Dof(id, dof))
            }
        }) else {
            return Err(gone());
        };
        let mimic = Mimic::between(spec.name.as_str(), world, [joint, of], spec.multiplier, spec.offset);
        let id = world.add(mimic.map_err(|e| wrong(e.to_string()))?).map_err(|e| wrong(e.to_string()))?;
        world.set_enabled(id, spec.enabled).map_err(|e| wrong(e.to_string()))
    }
}
