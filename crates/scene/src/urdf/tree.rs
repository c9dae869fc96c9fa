//! Builds the tree of links of a URDF: a parent before its children, children in the order of their
//! joints in the file.

use tumble_core::Joint;
use tumble_core::articulated::LinkMass;
use tumble_core::collide::{Pose, Vec3};

use super::joint::{JointElement, Kind};
use super::link::{Context, LinkElement};
use super::read::Content;
use crate::notes::NoteList;
use crate::parse::joint::{JointSpec, MimicSpec};
use crate::parse::link::{LinkMassSpec, LinkSpec};
use crate::parse::log::Log;

/// Returns the root of the tree: the one link that no joint moves. `None`, with the problem
/// recorded, if there is not exactly one root, a link has two parents, or joints form a loop.
pub(crate) fn find_root(log: &Log<'_>, links: &[LinkElement], joints: &[JointElement]) -> Option<usize> {
    let problems = log.count();
    let mut moved_by: Vec<Option<usize>> = vec![None; links.len()];
    for (number, joint) in joints.iter().enumerate() {
        if let Some(earlier) = moved_by[joint.child].replace(number) {
            let (name, line) = (&links[joint.child].name, log.line(joints[earlier].span.start));
            let message = format!(
                "joint \"{}\" has the child \"{name}\", which is also the child of joint \"{}\" at line {line}",
                joint.name, joints[earlier].name
            );
            log.report(
                joint.span.clone(),
                message,
                "expected one joint for each link; a scene closes loops by [[loop_joint]]",
            );
        }
    }
    let roots: Vec<usize> = (0..links.len()).filter(|&k| moved_by[k].is_none()).collect();
    if let [root, second, ..] = roots[..] {
        let message =
            format!("links \"{}\" and \"{}\" are not children of any joint", links[second].name, links[root].name);
        log.report(links[second].span.clone(), message, "expected one root link");
    }
    // Follows parents as often as there are links. A link that does not reach a root by then is in
    // a loop.
    for start in 0..links.len() {
        let mut at = start;
        for _ in 0..links.len() {
            let Some(joint) = moved_by[at] else { break };
            at = joints[joint].parent;
        }
        if let Some(joint) = moved_by[at] {
            let joint = &joints[joint];
            log.report(
                joint.span.clone(),
                format!("joint \"{}\" is part of a loop of joints", joint.name),
                "expected a tree with one root",
            );
            break;
        }
    }
    (log.count() == problems).then(|| roots.first().copied())?
}

/// Builds the list of links from the root, depth first.
pub(crate) struct TreeBuilder<'t> {
    pub(crate) log: &'t Log<'t>,
    pub(crate) elements: Vec<LinkElement>,
    pub(crate) joints: &'t [JointElement],
    pub(crate) links: Vec<LinkSpec>,
    /// Place of the joint that moves each link of `links`.
    spans: Vec<std::ops::Range<usize>>,
}

impl<'t> TreeBuilder<'t> {
    pub(crate) fn new(log: &'t Log<'t>, elements: Vec<LinkElement>, joints: &'t [JointElement]) -> Self {
        TreeBuilder { log, elements, joints, links: Vec::new(), spans: Vec::new() }
    }

    /// Returns all links with couplings resolved and masses checked if they are wanted.
    pub(crate) fn build(mut self, root: usize, context: &mut Context<'_>) -> Vec<LinkSpec> {
        let mut children: Vec<Vec<usize>> = vec![Vec::new(); self.elements.len()];
        for (number, joint) in self.joints.iter().enumerate() {
            children[joint.parent].push(number);
        }
        let kind = if context.options.floating { Joint::Floating } else { Joint::Fixed };
        let span = self.elements[root].span.clone();
        let name = self.elements[root].name.clone();
        let placed = self.hang(root, None, Pose::identity(), JointSpec::new(name, kind), span);
        let mut waiting: Vec<(usize, usize)> = children[root].iter().rev().map(|&joint| (joint, placed)).collect();
        while let Some((number, parent)) = waiting.pop() {
            let placed = self.add(&self.joints[number], parent);
            waiting.extend(children[self.joints[number].child].iter().rev().map(|&joint| (joint, placed)));
        }
        self.resolve_mimics(&mut context.notes);
        if context.content != Content::Geometry {
            self.check_masses();
        }
        self.links
    }

    /// Adds the child of a joint. A joint of several degrees of freedom becomes a chain of massless
    /// links.
    fn add(&mut self, joint: &JointElement, parent: usize) -> usize {
        let span = joint.span.clone();
        match joint.kind {
            Kind::Planar => self.add_planar(joint, parent),
            Kind::Floating => self.add_floating(joint, parent),
            _ => {
                let spec = joint.spec().unwrap_or_else(|| JointSpec::new(&joint.name, Joint::Fixed));
                self.hang(joint.child, Some(parent), joint.placement, spec, span)
            }
        }
    }

    /// Adds two prismatic joints in the plane, then a revolute joint about its normal.
    fn add_planar(&mut self, joint: &JointElement, parent: usize) -> usize {
        let normal = joint.axis;
        let first = normal.cross(&Vec3::ith(normal.iamin(), 1.0)).normalize();
        let second = normal.cross(&first);
        let x = self.stack(joint, "x", parent, joint.placement, Joint::Prismatic { axis: first });
        let y = self.stack(joint, "y", x, Pose::identity(), Joint::Prismatic { axis: second });
        let turn = joint.with_effects(JointSpec::new(&joint.name, Joint::Revolute { axis: normal }));
        self.hang(joint.child, Some(y), Pose::identity(), turn, joint.span.clone())
    }

    /// Adds a floating root if the parent is fixed to the base; else three prismatic joints and a
    /// spherical joint.
    fn add_floating(&mut self, joint: &JointElement, parent: usize) -> usize {
        if let Some(pose) = self.pose_in_base(parent) {
            return self.hang(
                joint.child,
                None,
                pose * joint.placement,
                JointSpec::new(&joint.name, Joint::Floating),
                joint.span.clone(),
            );
        }
        let x = self.stack(joint, "x", parent, joint.placement, Joint::Prismatic { axis: Vec3::x() });
        let y = self.stack(joint, "y", x, Pose::identity(), Joint::Prismatic { axis: Vec3::y() });
        let z = self.stack(joint, "z", y, Pose::identity(), Joint::Prismatic { axis: Vec3::z() });
        let turn = joint.with_effects(JointSpec::new(&joint.name, Joint::Spherical));
        self.hang(joint.child, Some(z), Pose::identity(), turn, joint.span.clone())
    }

    /// Returns the pose of a link in the base, if it is fixed to the base.
    fn pose_in_base(&self, link: usize) -> Option<Pose> {
        let (mut at, mut pose) = (Some(link), Pose::identity());
        while let Some(link) = at.map(|k| &self.links[k]) {
            if link.joint.kind != Joint::Fixed {
                return None;
            }
            (at, pose) = (link.parent, link.placement * pose);
        }
        Some(pose)
    }

    fn stack(&mut self, joint: &JointElement, axis: &str, parent: usize, placement: Pose, kind: Joint) -> usize {
        let name = format!("{}/{axis}", joint.name);
        let spec = joint.with_effects(JointSpec::new(&name, kind));
        let mass = LinkMassSpec::Given(LinkMass::none());
        self.links.push(LinkSpec {
            name,
            parent: Some(parent),
            placement,
            joint: spec,
            mass,
            shapes: Vec::new(),
            mounts: Default::default(),
        });
        self.spans.push(joint.span.clone());
        self.links.len() - 1
    }

    fn hang(
        &mut self,
        element: usize,
        parent: Option<usize>,
        placement: Pose,
        joint: JointSpec,
        span: std::ops::Range<usize>,
    ) -> usize {
        let element = &mut self.elements[element];
        let shapes = std::mem::take(&mut element.shapes);
        self.links.push(LinkSpec {
            name: element.name.clone(),
            parent,
            placement,
            joint,
            mass: LinkMassSpec::Given(element.mass),
            shapes,
            mounts: Default::default(),
        });
        self.spans.push(span);
        self.links.len() - 1
    }

    /// Resolves couplings. A fixed joint with `<mimic>`, as in robots reduced to some of their
    /// joints, follows nothing, and no joint can follow it. Both make a note.
    fn resolve_mimics(&mut self, notes: &mut NoteList) {
        for joint in self.joints {
            let Some(mimic) = &joint.mimic else { continue };
            let find =
                |name: &str| self.links.iter().position(|link| link.joint.name == name && link.joint.is_single());
            let known = self.joints.iter().any(|other| other.name == mimic.joint && other.name != joint.name);
            match (find(&joint.name), find(&mimic.joint)) {
                _ if !known => {
                    let message = format!("joint \"{}\" mimics \"{}\"", joint.name, mimic.joint);
                    self.log.report(mimic.span.clone(), message, "expected the name of another joint");
                }
                (Some(follower), Some(link)) => {
                    self.links[follower].joint.mimic =
                        Some(MimicSpec { link, multiplier: mimic.multiplier, offset: mimic.offset });
                }
                _ => {
                    let line = self.log.line(mimic.span.start);
                    notes.add(
                        format!("line {line}: joint \"{}\"", joint.name),
                        "does not follow the other, since one of the two is fixed",
                    );
                }
            }
        }
    }

    /// Checks that every joint moves some mass.
    fn check_masses(&self) {
        let mut heavy: Vec<bool> = self.links.iter().map(LinkSpec::has_mass).collect();
        for k in (0..self.links.len()).rev() {
            let link = &self.links[k];
            if !heavy[k] && link.joint.kind != Joint::Fixed {
                let message = format!(
                    "\"{}\" moves link \"{}\", and that link and its descendants have no mass",
                    link.joint.name, link.name
                );
                self.log.report(self.spans[k].clone(), message, "expected <inertial> in one of them, or a fixed joint");
            }
            if let Some(parent) = link.parent {
                heavy[parent] |= heavy[k];
            }
        }
    }
}
