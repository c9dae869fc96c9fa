//! Position drives, motors of the scene, and its other actuators that no drive includes.

use tumble_core::articulated::{DofSettings, Drive};
use tumble_core::{ArticulatedBody, Joint};

use super::MjcfWriter;
use super::links::Tree;
use super::xml::{Attributes, numbers};
use crate::mjcf::ActuatorSpec;
use crate::parse::file::SceneFile;

/// An actuator of an articulated body.
pub(super) struct Motor {
    /// Name of the articulated body.
    body: String,
    /// Numbers of the joints among those that move, and the moment arm of each.
    moments: Vec<(usize, f64)>,
    spec: ActuatorSpec,
}

impl Motor {
    /// Returns the motors of a scene, and other actuators that no drive includes. A drive includes the control of a motor.
    pub(super) fn all(scene: &SceneFile) -> Vec<Motor> {
        let found = scene.actuators.iter().filter(|spec| !spec.driven || spec.bias == [0.0; 3]).map(|spec| {
            let body = &scene.articulated[spec.articulated];
            let before = |link: usize| body.links[..link].iter().filter(|l| l.joint.kind != Joint::Fixed).count();
            let moments = spec.moments.iter().map(|(link, arm)| (before(*link), *arm)).collect();
            Motor { body: body.name.clone(), moments, spec: spec.clone() }
        });
        found.collect()
    }
}

impl MjcfWriter<'_> {
    /// Writes drives as actuators: `f = g·u + b₀ + b₁·q + b₂·q̇`.
    pub(super) fn drives(&mut self, tree: &Tree<'_>) {
        for (k, link) in tree.body.model().links().iter().enumerate().filter(|(_, link)| link.joint.dof() == 1) {
            let dof = &tree.body.dofs()[link.v];
            let joint = &tree.joints[k];
            let DofSettings { drive, .. } = dof;
            match drive {
                Drive::None => {}
                Drive::Position { stiffness, damping, target, velocity, limit } => {
                    let (gain, constant, control) = match *stiffness > 0.0 {
                        true => (*stiffness, damping * velocity, *target),
                        false => (*damping, 0.0, *velocity),
                    };
                    let mut t = Attributes::of("name", self.actuators.unique(joint.to_string())).with("joint", joint);
                    t = t.with("gaintype", "fixed").with("gainprm", numbers([gain])).with("biastype", "affine");
                    t.put("biasprm", numbers([constant, -stiffness, -damping]));
                    if limit.is_finite() {
                        t.put("forcerange", numbers([-limit, *limit]));
                    }
                    self.controls.push(control);
                    self.drive_elements.push(("general", t));
                }
                Drive::Velocity { .. } => {
                    self.note(joint, "velocity drives, which hold their velocity exactly, are left out")
                }
                Drive::Playback { .. } => self.note(joint, "playback drives are left out"),
            }
        }
    }

    /// Writes actuators of one joint; notes all others.
    pub(super) fn motors(&mut self) {
        for Motor { body, moments, spec } in std::mem::take(&mut self.motors) {
            let subject = if spec.name.is_empty() { format!("an actuator of {body}") } else { spec.name.clone() };
            let [(number, arm)] = moments[..] else {
                self.note(&subject, "actuators of several joints are left out");
                continue;
            };
            let id = self.world.find(&body);
            let link = id.and_then(|id| self.world.get::<ArticulatedBody>(id)?.model().links().get(number));
            let joint = id.zip(link).and_then(|(id, link)| self.dofs.get(&(id, link.v)).cloned());
            let Some(joint) = joint else {
                self.note(&subject, "an actuator of a joint that is not written is left out");
                continue;
            };
            let name = if spec.name.is_empty() { joint.clone() } else { spec.name.clone() };
            let mut t = Attributes::of("name", self.actuators.unique(name)).with("joint", joint);
            t.put("gear", numbers([arm, 0.0, 0.0, 0.0, 0.0, 0.0]));
            t.put("gainprm", numbers([spec.gain]));
            if spec.bias != [0.0; 3] {
                t.put("biastype", "affine");
                t.put("biasprm", numbers(spec.bias));
            }
            for (range, name) in [(spec.control_range, "ctrlrange"), (spec.force_range, "forcerange")] {
                range.iter().for_each(|range| t.put(name, numbers(*range)));
            }
            self.controls.push(if spec.driven { 0.0 } else { spec.control });
            self.drive_elements.push(("general", t));
        }
    }
}
