//! Loop joints as `<equality>`.

use tumble_core::collide::Pose;
use tumble_core::{Anchor, ArticulatedBody, DofSettings, LoopJoint, LoopJointKind, RigidBody};

use super::MjcfWriter;
use super::bodies::relpose;
use super::xml::{Attributes, vector};

impl MjcfWriter<'_> {
    /// Writes a loop joint that MJCF has an equality constraint for; notes all others.
    pub(super) fn loop_joint(&mut self, name: &str, joint: &LoopJoint) {
        let kind = joint.kind();
        if !matches!(kind, LoopJointKind::Spherical | LoopJointKind::Fixed) {
            return self.note(name, format!("loop joints of the type {} are left out", kind.name()));
        }
        if *joint.dof() != DofSettings::default() || joint.breaking() != [f64::INFINITY; 2] {
            self.note(name, "limits, damping and breaking loads of loop joints are left out");
        }
        let [Some((a, frame_a)), Some((b, frame_b))] = joint.sides().map(|side| self.side(&side)) else {
            return self.note(name, "a loop joint of an object that is not written is left out");
        };
        // body1 is one that moves
        let ((a, frame_a), (b, frame_b)) =
            if a == "world" { ((b, frame_b), (a, frame_a)) } else { ((a, frame_a), (b, frame_b)) };
        let mut t = Attributes::of("name", name).with("body1", a).with("body2", b);
        if kind == LoopJointKind::Spherical {
            t.put("anchor", vector(&frame_a.translation.vector));
            return self.equalities.push(("connect", t));
        }
        t.put("relpose", relpose(&(frame_a * frame_b.inverse())));
        self.equalities.push(("weld", t));
    }

    /// Returns the body of a side and the pose of the joint's frame in it.
    fn side(&self, side: &Anchor) -> Option<(String, Pose)> {
        let Some((id, part)) = side.part else { return Some(("world".into(), side.frame)) };
        if let Some(body) = self.world.get::<RigidBody>(id) {
            let name = self.names.get(&(id, None))?.clone();
            let center = nalgebra::Translation3::from(body.shape().center_of_mass());
            let frame = center * side.frame;
            let pose = body.frame_of(&self.world.part_state(id, 0)?.pose);
            return Some(if name == "world" { (name, pose * frame) } else { (name, frame) });
        }
        let body = self.world.get::<ArticulatedBody>(id)?;
        let name = self.names.get(&(id, body.link_of(part)))?.clone();
        let frame = body.part_pose(part) * side.frame;
        // a base without a body of its own
        let in_world = name == "world" && body.link_of(part).is_none();
        Some((name, if in_world { body.base() * frame } else { frame }))
    }
}
