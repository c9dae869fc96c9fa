//! `[[mimic]]`: a coupling of two joints.

use crate::parse::articulated::ArticulatedSpec;
use crate::parse::body::read_name;
use crate::parse::bound::Bound;
use crate::parse::fields::{Fields, Value};
use crate::parse::joint::JointSpec;
use crate::parse::loop_joint::LoopJointSpec;
use tumble_core::collide::Vec3;
use tumble_core::{Joint, LoopJointKind};

/// A joint with one position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointSideSpec {
    /// A loop joint, by its index in [`SceneFile::loop_joints`](crate::SceneFile::loop_joints).
    LoopJoint(usize),
    /// The joint of a link of an articulated body, by both indices.
    Link(usize, usize),
}

/// A coupling of two joints, all references resolved: `q = multiplier·q_of + offset`.
#[derive(Clone, Debug, PartialEq)]
pub struct JointMimicSpec {
    /// Unique in the scene, bodies included.
    pub name: String,
    /// The joint that follows.
    pub joint: JointSideSpec,
    /// The joint that it follows.
    pub of: JointSideSpec,
    /// Ratio, not 0. Default 1.
    pub multiplier: f64,
    /// Offset, rad or m. Default 0.
    pub offset: f64,
    /// Takes part in the simulation. Default true.
    pub enabled: bool,
}

/// The joints that a coupling can name.
pub(crate) struct Joints<'a> {
    pub articulated: &'a [ArticulatedSpec],
    pub loop_joints: &'a [LoopJointSpec],
}

impl Joints<'_> {
    fn find(&self, name: &str) -> Option<JointSideSpec> {
        let coupled = |joint: &LoopJointSpec| joint.kind.has_position() && joint.kind != LoopJointKind::Spherical;
        if let Some(index) = self.loop_joints.iter().position(|joint| joint.name == name && coupled(joint)) {
            return Some(JointSideSpec::LoopJoint(index));
        }
        self.articulated.iter().enumerate().find_map(|(tree, spec)| {
            let link = name.strip_prefix(spec.name.as_str())?.strip_prefix('/')?;
            let is = |(_, of): &(usize, &crate::LinkSpec)| of.name == link && of.joint.is_single();
            spec.links.iter().enumerate().find(is).map(|(index, _)| JointSideSpec::Link(tree, index))
        })
    }

    fn names(&self) -> Vec<String> {
        let links = self.articulated.iter().flat_map(|spec| {
            let single = spec.links.iter().filter(|link| link.joint.is_single());
            single.map(move |link| format!("{}/{}", spec.name, link.name))
        });
        self.loop_joints.iter().map(|joint| joint.name.clone()).chain(links).collect()
    }

    /// Returns a joint with the keys of a joint: in radians, or in meters.
    fn like(&self, side: JointSideSpec) -> JointSpec {
        match side {
            JointSideSpec::Link(tree, link) => self.articulated[tree].links[link].joint.clone(),
            JointSideSpec::LoopJoint(index) => {
                let axis = Vec3::z();
                let turns = self.loop_joints[index].kind.turns();
                JointSpec::new("", if turns { Joint::Revolute { axis } } else { Joint::Prismatic { axis } })
            }
        }
    }
}

impl JointMimicSpec {
    pub(crate) fn read(mut f: Fields<'_>, joints: &Joints<'_>) -> Option<JointMimicSpec> {
        const EXPECTED: &str = "the name of a loop joint with a position, or \"OBJECT/LINK\" of a link that a revolute or prismatic joint moves";
        let name = read_name(&mut f).unwrap_or_default();
        let named = [("joint", f.text("joint", EXPECTED)), ("of", f.text("of", EXPECTED))];
        let [joint, of] = named.map(|(key, given): (&str, Option<(&str, &Value<'_>)>)| {
            let (name, value) = given?;
            let found = joints.find(name);
            if found.is_none() {
                let names = joints.names();
                f.unknown_name(key, value, name, names.iter().map(String::as_str).collect());
            }
            found
        });
        if let (Some(first), Some(second), Some((_, value))) = (joint, of, named[1].1)
            && first == second
        {
            f.wrong("of", value, "a joint other than `joint`");
        }
        let multiplier = match f.value("multiplier") {
            None => 1.0,
            Some(value) => {
                let problems = f.log.count();
                let number = f.as_number("multiplier", value, Bound::ANY);
                if number == 0.0 && f.log.count() == problems {
                    f.wrong("multiplier", value, "a number other than 0");
                }
                number
            }
        };
        let offset = joint.map_or(0.0, |side| joints.like(side).read_offset(&mut f));
        let enabled = f.flag_or("enabled", true);
        if joint.is_none() {
            f.give_up();
        } else {
            f.finish();
        }
        Some(JointMimicSpec { name, joint: joint?, of: of?, multiplier, offset, enabled })
    }
}
