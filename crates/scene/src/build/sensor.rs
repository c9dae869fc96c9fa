//! Measuring sensors of a scene.

use tumble_core::collide::{Pose, Shape};
use tumble_core::{Anchor, ArticulatedBody, ObjectId, RigidBody, Sensor, SensorPlace, World};

use super::error::BuildError;
use super::shapes;
use crate::parse::file::SceneFile;
use crate::parse::loop_joint::PartSpec;
use crate::parse::sensor::{SensorPlaceSpec, SensorSpec};

impl SceneFile {
    pub(super) fn add_sensor(&self, spec: &SensorSpec, meshes: &[Shape], world: &mut World) -> Result<(), BuildError> {
        let wrong = |why: String| BuildError::Sensor { scene: self.file.clone(), why };
        let gone = || wrong(format!("sensor '{}': what it is on is not in the world", spec.name));
        let place = match spec.on {
            SensorPlaceSpec::World => SensorPlace::Site(Anchor::world(spec.site)),
            SensorPlaceSpec::LoopJoint(joint) => {
                SensorPlace::LoopJoint(world.find(&self.loop_joints[joint].name).ok_or_else(gone)?)
            }
            SensorPlaceSpec::Part(part) if spec.kind.reads_dof() => {
                let (id, dof) = self.joint_of(world, &part).ok_or_else(|| {
                    wrong(format!("sensor '{}': no revolute or prismatic joint moves what it is on", spec.name))
                })?;
                SensorPlace::Dof(id, dof)
            }
            SensorPlaceSpec::Part(part) => SensorPlace::Site(self.anchor(world, &part, &spec.site).ok_or_else(gone)?),
        };
        let make = || -> Result<Sensor, String> {
            let text = |e: tumble_core::SensorError| e.to_string();
            let mut sensor = Sensor::at(spec.name.clone(), spec.kind, place).map_err(text)?;
            if let Some(part) = spec.relative_to {
                let anchor = self.anchor(world, &part, &Pose::identity()).ok_or("its reference is not in the world")?;
                sensor = sensor.relative_to(anchor).map_err(text)?;
            }
            if let Some(volume) = &spec.volume {
                sensor = sensor.with_volume(shapes::make(volume, meshes).map_err(|e| e.to_string())?).map_err(text)?;
            }
            if let Some(optics) = spec.optics {
                sensor = sensor.with_optics(optics).map_err(text)?;
            }
            sensor.with_cutoff(spec.cutoff).and_then(|sensor| sensor.with_noise(spec.noise)).map_err(text)
        };
        let sensor = make().map_err(wrong)?;
        let id = world.add(sensor).map_err(|e| wrong(e.to_string()))?;
        world.set_enabled(id, spec.enabled).map_err(|e| wrong(e.to_string()))
    }

    /// Returns a frame of a body or of a link, which may be a fixed one, in the world.
    fn anchor(&self, world: &World, part: &PartSpec, pose: &Pose) -> Option<Anchor> {
        match *part {
            PartSpec::Body(body) => {
                let id = world.find(&self.bodies[body].name)?;
                Some(Anchor::on(id, 0, frame_of_body(world, id) * pose))
            }
            PartSpec::Link(spec, link) => {
                let spec = &self.articulated[spec];
                let id = world.find(&spec.name)?;
                world.get::<ArticulatedBody>(id)?.anchor(id, &spec.links[link].name, pose).ok()
            }
        }
    }

    /// Returns the degree of freedom that moves a link.
    pub(super) fn joint_of(&self, world: &World, part: &PartSpec) -> Option<(ObjectId, usize)> {
        let PartSpec::Link(spec, link) = *part else { return None };
        let spec = &self.articulated[spec];
        let id = world.find(&spec.name)?;
        let body = world.get::<ArticulatedBody>(id)?;
        let moving = &body.model().links()[body.model().link(&spec.links[link].name)?];
        (moving.joint.dof() == 1).then_some((id, moving.v))
    }
}

/// Returns the frame of a rigid body, that of its shape, in the one about its center of mass.
pub(super) fn frame_of_body(world: &World, id: ObjectId) -> Pose {
    let center = world.get::<RigidBody>(id).map(|body| body.shape().center_of_mass());
    Pose::from_parts((-center.unwrap_or_default()).into(), nalgebra::one())
}
