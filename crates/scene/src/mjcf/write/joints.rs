//! Loop joints and couplings of two objects as `<equality>`.
//!
//! MuJoCo takes the second anchor of a `<connect>` by bodies from the configuration of zero positions, where a loop is
//! not closed. A spherical joint is therefore written by two sites, which are its frames on both sides.

use tumble_core::collide::Pose;
use tumble_core::{
    Anchor, ArticulatedBody, DofSettings, JointRef, LoopJoint, LoopJointKind, Mimic, ObjectId, RigidBody,
};

use super::MjcfWriter;
use super::bodies::relpose;
use super::xml::{Attributes, numbers};

/// A rigid body, or an articulated body with one of its links or its base.
pub(super) type Carrier = (ObjectId, Option<usize>);

impl MjcfWriter<'_> {
    /// Names the sites of spherical loop joints, which are written with the bodies that carry them.
    pub(super) fn plan_sites(&mut self) {
        let world = self.world;
        for &id in world.ids() {
            let (Some(joint), Some(name)) = (world.get::<LoopJoint>(id), world.name(id)) else { continue };
            if joint.kind() != LoopJointKind::Spherical || !world.status(id).is_some_and(|status| status.enabled) {
                continue;
            }
            let sites = ["a", "b"].map(|side| self.sites.unique(format!("{name}/{side}")));
            for (side, site) in joint.sides().iter().zip(&sites) {
                if let Some((carrier, frame)) = self.carrier(side) {
                    self.planned.entry(carrier).or_default().push((site.clone(), frame));
                }
            }
            self.joint_sites.insert(id, sites);
        }
    }

    /// Writes the sites of loop joints on a body that is open.
    pub(super) fn joint_sites_of(&mut self, carrier: Carrier) {
        for (name, frame) in self.planned.remove(&carrier).unwrap_or_default() {
            self.site(&name, &frame);
        }
    }

    /// Writes a loop joint that MJCF has an equality constraint for; notes all others.
    pub(super) fn loop_joint(&mut self, id: ObjectId, name: &str, joint: &LoopJoint) {
        let kind = joint.kind();
        if !matches!(kind, LoopJointKind::Spherical | LoopJointKind::Fixed) {
            return self.note(name, format!("loop joints of the type {} are left out", kind.name()));
        }
        let settings = (0..kind.dofs()).any(|k| {
            joint.dof_at(k).is_some_and(|dof| *dof != DofSettings::default()) || joint.armature_at(k) != Some(0.0)
        });
        let limits = joint.cone().is_some() || joint.twist_limits().is_some();
        if settings || limits || joint.breaking() != [f64::INFINITY; 2] {
            self.note(name, "limits, damping and breaking loads of loop joints are left out");
        }
        let [Some(a), Some(b)] = joint.sides().map(|side| self.side(&side)) else {
            return self.note(name, "a loop joint of an object that is not written is left out");
        };
        let carriers = joint.sides().map(|side| self.carrier(&side));
        if carriers.iter().flatten().any(|(carrier, _)| self.inner.contains(carrier)) {
            return self.note(name, "a loop joint of a massless link that has no body of its own is left out");
        }
        if let Some(sites) = self.joint_sites.remove(&id) {
            // sites of bodies are written already, and the world is still open
            for ((_, frame), site) in [&a, &b].into_iter().zip(&sites).filter(|((body, _), _)| body == "world") {
                self.site(site, frame);
            }
            let [first, second] = sites;
            let t = Attributes::of("name", name).with("site1", first).with("site2", second);
            return self.equalities.push(("connect", t));
        }
        // body1 is one that moves
        let ((a, frame_a), (b, frame_b)) = if a.0 == "world" { (b, a) } else { (a, b) };
        let mut t = Attributes::of("name", name).with("body1", a).with("body2", b);
        t.put("relpose", relpose(&(frame_a * frame_b.inverse())));
        self.equalities.push(("weld", t));
    }

    /// Writes a coupling of joints of two articulated bodies; notes one of loop joints.
    pub(super) fn coupling(&mut self, name: &str, mimic: &Mimic) {
        let joints = mimic.joints().map(|joint| match joint {
            JointRef::Dof(body, dof) => self.dofs.get(&(body, dof)).cloned(),
            JointRef::LoopJoint(_) => None,
        });
        let [Some(first), Some(second)] = joints else {
            return self.note(name, "a coupling of a loop joint, or of an object that is not written, is left out");
        };
        let [multiplier, offset] = mimic.ratio();
        let mut t = Attributes::of("name", name);
        t.extend(&coupled(first, second, offset, multiplier));
        self.equalities.push(("joint", t));
    }

    fn site(&mut self, name: &str, frame: &Pose) {
        let mut t = Attributes::of("name", name);
        t.put_pose(frame);
        self.xml.leaf("site", &t);
    }

    /// Returns the written body of a side, or `world`, and the pose of the joint's frame in it.
    fn side(&self, side: &Anchor) -> Option<(String, Pose)> {
        let Some((id, _)) = side.part else { return Some(("world".into(), side.frame)) };
        let (carrier, frame) = self.carrier(side)?;
        let name = self.names.get(&carrier)?.clone();
        if name != "world" {
            return Some((name, frame));
        }
        // static bodies, and bases without a body of their own
        let base = match self.world.get::<RigidBody>(id) {
            Some(body) => body.frame_of(&self.world.part_state(id, 0)?.pose),
            None => *self.world.get::<ArticulatedBody>(id)?.base(),
        };
        Some((name, base * frame))
    }

    /// Returns what carries a side that is not the world, and the pose of the joint's frame in it.
    fn carrier(&self, side: &Anchor) -> Option<(Carrier, Pose)> {
        let (id, part) = side.part?;
        if let Some(body) = self.world.get::<RigidBody>(id) {
            let center = nalgebra::Translation3::from(body.shape().center_of_mass());
            return Some(((id, None), center * side.frame));
        }
        let body = self.world.get::<ArticulatedBody>(id)?;
        Some(((id, body.link_of(part)), body.part_pose(part) * side.frame))
    }
}

/// Returns the equality `q₁ = offset + multiplier·q₂` of two joints.
pub(super) fn coupled(first: String, second: String, offset: f64, multiplier: f64) -> Attributes {
    let polynomial = numbers([offset, multiplier, 0.0, 0.0, 0.0]);
    Attributes::of("joint1", first).with("joint2", second).with("polycoef", polynomial)
}
