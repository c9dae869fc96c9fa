//! `[[loop_joint]]` and `[[pair]]`.

use std::collections::BTreeSet;
use std::f64::consts::PI;

use tumble_core::collide::Pose;
use tumble_core::{
    Anchor, ArticulatedBody, DofSettings, Joint, JointRef, LoopJoint, LoopJointKind, Mimic, ObjectId, PairMaterial,
    PairSide, Transmission,
};

use super::Writer;
use super::articulated::{dof_settings, spherical_settings};
use super::text::Table;

impl Writer<'_> {
    /// Writes a loop joint by the frames of its two sides.
    pub(super) fn loop_joint(&mut self, id: ObjectId, name: &str, joint: &LoopJoint) {
        let kind = joint.kind();
        let mut t = Table::of("name", name);
        t.put("type", kind.name());
        let [a, b] = joint.sides();
        let title = format!("the loop joint \"{name}\"");
        let ((part_a, frame_a), (part_b, frame_b)) = (self.anchor(&title, &a), self.anchor(&title, &b));
        part_a.iter().for_each(|a| t.put("a", a));
        part_b.iter().for_each(|b| t.put("b", b));
        t.put("anchor_a", pose(&frame_a));
        t.put("anchor_b", pose(&frame_b));
        let Transmission { teeth, radius, pitch, ratio, ground, references } = joint.transmission();
        match kind {
            LoopJointKind::Gear => t.put("teeth", *teeth),
            LoopJointKind::Rack => t.put("radius_m", *radius),
            LoopJointKind::Screw => t.put("pitch_m", *pitch),
            LoopJointKind::Pulley => {
                t.put("ground_position_m", ground[0]);
                t.put("second_ground_position_m", ground[1]);
                t.put_unless(1.0, "ratio", *ratio);
            }
            _ => {}
        }
        let by_references = kind == LoopJointKind::Pulley && joint.given_length().is_none();
        if by_references || matches!(kind, LoopJointKind::Gear | LoopJointKind::Rack) {
            t.put("reference_a", pose(&references[0]));
            t.put("reference_b", pose(&references[1]));
        }
        if kind.has_length() && !by_references {
            t.put("length_m", joint.length());
        }
        if kind == LoopJointKind::Spring {
            t.put("stiffness_n_per_m", joint.dof().spring.map_or(0.0, |spring| spring.stiffness));
        }
        joint.cone().iter().for_each(|cone| t.put("cone_rad", *cone));
        joint.twist_limits().iter().for_each(|limits| t.put("twist_limits_rad", *limits));
        let mut dofs: Vec<Table> = (0..kind.dofs()).map(|k| loop_dof(joint, k)).collect();
        while dofs.pop_if(|last| last.is_empty()).is_some() {}
        let all: Vec<&DofSettings> = (0..kind.dofs()).filter_map(|k| joint.dof_at(k)).collect();
        let same = (0..kind.dofs()).all(|k| joint.armature_at(k) == joint.armature_at(0));
        let whole = (kind == LoopJointKind::Spherical && same).then(|| spherical_settings(&all)).flatten();
        match (kind.dofs(), whole) {
            (1, _) => dofs.into_iter().for_each(|dof| t.extend(dof)),
            _ if dofs.is_empty() => {}
            (_, Some(whole)) => {
                t.put_unless(0.0, "armature_kg_m2", joint.armature_at(0).unwrap_or(0.0));
                t.extend(whole);
            }
            _ => t.put("dof", dofs),
        }
        if let Some(angle) = self.turned(id, joint) {
            t.put("angle_rad", angle);
        }
        let [force, torque] = joint.breaking();
        t.put_unless(f64::INFINITY, "breaking_force_n", force);
        t.put_unless(f64::INFINITY, "breaking_torque_n_m", torque);
        t.put_unless(true, "enabled", self.world.status(id).is_none_or(|status| status.enabled));
        self.out += &t.under("[[loop_joint]]");
    }

    /// Returns the angle of a joint that counts its turns and is more than half a turn from where it starts by itself.
    fn turned(&self, id: ObjectId, joint: &LoopJoint) -> Option<f64> {
        let limits = joint.dof().limits.filter(|limits| joint.kind().counts_turns(Some(*limits)));
        let [lo, hi] = limits?;
        let middle = if lo.is_finite() && hi.is_finite() { 0.5 * (lo + hi) } else { 0.0_f64.max(lo).min(hi) };
        let angle = self.world.state_of(id)?.first().copied()?;
        ((angle - middle).abs() > PI).then_some(angle)
    }

    /// Writes a coupling of two joints.
    pub(super) fn mimic(&mut self, id: ObjectId, name: &str, mimic: &Mimic) {
        let mut t = Table::of("name", name);
        let mut turns = false;
        for (key, joint) in ["joint", "of"].into_iter().zip(mimic.joints()) {
            let (text, angle) = match joint {
                JointRef::LoopJoint(joint) => (
                    self.world.name(joint).map(str::to_owned),
                    self.world.get::<LoopJoint>(joint).is_some_and(|joint| joint.kind().turns()),
                ),
                JointRef::Dof(body, dof) => (self.dof_name(body, dof), self.turns(body, dof)),
            };
            match text {
                Some(text) => t.put(key, text),
                None => self.fault(format!("\"{name}\", a coupling of a joint that was removed")),
            }
            turns |= angle && key == "joint";
        }
        let [multiplier, offset] = mimic.ratio();
        t.put_unless(1.0, "multiplier", multiplier);
        t.put_unless(0.0, if turns { "offset_rad" } else { "offset_m" }, offset);
        t.put_unless(true, "enabled", self.world.status(id).is_none_or(|status| status.enabled));
        self.out += &t.under("[[mimic]]");
    }

    /// Returns whether a degree of freedom of an articulated body is an angle.
    fn turns(&self, body: ObjectId, dof: usize) -> bool {
        let body = self.world.get::<ArticulatedBody>(body);
        let link = body.and_then(|body| body.model().links().iter().find(|link| link.v == dof));
        link.is_some_and(|link| matches!(link.joint, Joint::Revolute { .. }))
    }

    /// Returns the name of the part of a side, and its frame in the frame of the body or link;
    /// no name for the world. `title` is the joint or sensor, for faults.
    pub(super) fn anchor(&mut self, title: &str, side: &Anchor) -> (Option<String>, Pose) {
        let Anchor { part, frame, link: named } = side;
        let Some((id, part)) = *part else { return (None, *frame) };
        let Some(name) = self.world.name(id).map(str::to_owned) else {
            self.fault(format!("{title} on an object that was removed"));
            return (None, *frame);
        };
        let Some(body) = self.world.get::<ArticulatedBody>(id) else {
            let center = self.world.get::<tumble_core::RigidBody>(id).map(|body| body.shape().center_of_mass());
            let moved = nalgebra::Translation3::from(center.unwrap_or_default()) * frame;
            return (Some(name), moved);
        };
        let links = body.model().links().len();
        let on_link = match part.checked_sub(links + 1) {
            Some(collider) => body.colliders().nth(collider).map_or(*frame, |(_, c)| c.pose * frame),
            None => *frame,
        };
        let named =
            named.and_then(|link| body.model().frames().get(link)).map(|frame| (frame.name.as_str(), frame.pose));
        match named.or_else(|| link_name(body, part)) {
            Some((link, pose)) => (Some(format!("{name}/{link}")), pose.inverse() * on_link),
            None => {
                self.fault(format!("{title} on the base of \"{name}\", which has no link that is fixed to its base"));
                (None, *frame)
            }
        }
    }

    /// Writes the pairs with surface constants of their own.
    pub(super) fn pairs(&mut self) {
        let world = self.world;
        let mut written = BTreeSet::new();
        for ([a, b], material) in world.pair_materials() {
            let PairMaterial { restitution, friction, rolling_friction, torsional_friction, collides } = *material;
            let mut t = Table::default();
            match (self.material_name(a), self.material_name(b)) {
                (Some(a), Some(b)) => t.put("materials", [a, b]),
                (None, None) => match (self.side(a), self.side(b)) {
                    (Some(a), Some(b)) => {
                        t.put("a", a);
                        t.put("b", b);
                    }
                    _ => continue,
                },
                _ => {
                    self.fault("a pair of a body and a material".into());
                    continue;
                }
            }
            restitution.iter().for_each(|x| t.put("restitution", *x));
            friction.iter().for_each(|x| t.put("friction", *x));
            rolling_friction.iter().for_each(|x| t.put("rolling_friction_m", *x));
            torsional_friction.iter().for_each(|x| t.put("torsional_friction_m", *x));
            collides.iter().for_each(|x| t.put("collides", *x));
            let text = t.under("[[pair]]");
            // links with several shapes have a pair for each
            if written.insert(text.clone()) {
                self.out += &text;
            }
        }
    }

    fn material_name(&self, side: &PairSide) -> Option<String> {
        let PairSide::Material(id) = side else { return None };
        self.materials.iter().find(|(known, _)| known == id).map(|(_, spec)| spec.name.clone())
    }

    /// Returns the name of a side that is an object or a part of one.
    fn side(&mut self, side: &PairSide) -> Option<String> {
        let (id, part) = match *side {
            PairSide::Object(id) => (id, None),
            PairSide::Part(id, part) => (id, Some(part)),
            PairSide::Material(id) => {
                self.fault(format!("a pair of the material {id}, which no part has"));
                return None;
            }
        };
        let name = self.world.name(id)?.to_owned();
        match (part, self.world.get::<ArticulatedBody>(id)) {
            // the link to which the shape was added, which may be a fixed one
            (Some(part), Some(body)) => {
                let frame = body.frame_of(part).and_then(|frame| body.model().frames().get(frame));
                frame.map(|frame| format!("{name}/{}", frame.name))
            }
            _ => Some(name),
        }
    }
}

/// Returns the name of the link that carries a part, and the pose of its frame in that of the moving
/// link or the base.
pub(super) fn link_name(body: &ArticulatedBody, part: usize) -> Option<(&str, Pose)> {
    match body.link_of(part) {
        Some(link) => Some((body.model().links()[link].name.as_str(), Pose::identity())),
        None => body.model().frames().iter().find(|f| f.link.is_none()).map(|f| (f.name.as_str(), f.pose)),
    }
}

/// Returns the keys of a degree of freedom of a loop joint.
fn loop_dof(joint: &LoopJoint, k: usize) -> Table {
    let (turns, mut t) = (joint.kind().turns_at(k), Table::default());
    let mut dof = joint.dof_at(k).cloned().unwrap_or_default();
    dof.spring = dof.spring.filter(|_| joint.kind() != LoopJointKind::Spring);
    t.put_unless(0.0, if turns { "armature_kg_m2" } else { "armature_kg" }, joint.armature_at(k).unwrap_or(0.0));
    t.extend(dof_settings(&dof, turns));
    t
}

fn pose(pose: &Pose) -> Table {
    let mut t = Table::default();
    t.put_pose(pose);
    t
}
