//! `<model>`: its links as trees of link specifications.
//!
//! Links are walked from those that no joint moves. Such a root floats, unless a joint fixes it to `world`; a root that a
//! joint lets move in the world has that joint. Each root and all below it are one body.
//!
//! ```text
//! X_PJ = X_MP⁻¹·X_MC·X_CJ        placement of a joint with its frame J, between parent P and child C in the model M
//! ```
//!
//! The frame of a link is that of its joint. If the joint of a link turns about another point, the moving link is
//! `LINK/JOINT`, and the link itself is fixed to it.

use std::collections::BTreeMap;

use tumble_core::Joint;
use tumble_core::articulated::{LinkMass, MAX_LINKS};
use tumble_core::collide::{Pose, Vec3};

use super::frames::{Frames, MODEL, pose_of};
use super::joint::{JointElement, Kind};
use super::link::LinkElement;
use super::value::{flag, note, note_others};
use crate::parse::joint::{JointSpec, MimicSpec};
use crate::parse::link::{LinkMassSpec, LinkShape, LinkSpec};
use crate::urdf::link::Context;
use crate::xml::Element;

/// Name of the world as the parent of a joint.
const WORLD: &str = "world";

/// A model.
pub(crate) struct SdfModel {
    pub(crate) name: String,
    pub(crate) pose: Pose,
    /// Whether links that no joint connects collide.
    pub(crate) self_collide: bool,
    /// Links of each tree: a parent before its children.
    pub(crate) trees: Vec<Vec<LinkSpec>>,
    /// Planes of a static model: name, and shape in the model.
    pub(crate) planes: Vec<(String, LinkShape)>,
}

/// Reads a model. `None`, with the problems recorded, if it has any.
pub(super) fn read<'a, 'd>(model: Element<'a, 'd>, context: &mut Context<'_>) -> Option<SdfModel> {
    let before = model.log.count();
    let name = model.required_text("name", "a unique name")?.to_owned();
    const READ: [&str; 9] =
        ["pose", "static", "self_collide", "link", "joint", "frame", "model", "include", "allow_auto_disable"];
    note_others(&model, &READ, &mut context.notes);
    for nested in model.children("model").chain(model.children("include")) {
        nested.problem(
            "is nested in a model",
            "expected a model without nested models and includes; write its links out",
        );
    }
    if let Some(frame) = model.text("placement_frame").filter(|frame| *frame != MODEL) {
        let frame: String = frame.chars().take(48).collect();
        model.problem(
            format_args!("has the placement frame \"{frame}\""),
            "expected none: its pose is that of the model",
        );
    }
    let pose = model.child("pose").map_or(Pose::identity(), |pose| {
        if pose.text("relative_to").is_some_and(|to| !to.is_empty() && to != WORLD) {
            pose.wrong("relative_to", "no frame: the pose of a model is in the world");
        }
        pose_of(&pose)
    });
    let fixed = flag(&model, "static", false);
    let mut frames = Frames::of(&model);
    let count = model.children("link").count();
    if count == 0 || count > MAX_LINKS {
        model.problem(format_args!("has {count} links"), format!("expected 1 to {MAX_LINKS}"));
        return None;
    }
    let links: Vec<LinkElement<'a, 'd>> =
        model.children("link").filter_map(|link| LinkElement::read(link, &mut frames, context)).collect();
    let joints: Vec<JointElement<'a, 'd>> = model
        .children("joint")
        .filter_map(|joint| JointElement::read(joint, &mut frames, &mut context.notes))
        .collect();
    if model.log.count() > before {
        return None;
    }
    let mut tree = Tree { links, joints, fixed, moved_by: Vec::new(), trees: Vec::new(), followers: Vec::new() };
    tree.connect()?;
    let planes = tree.planes(context);
    tree.build();
    tree.couple(context);
    if !fixed {
        tree.check_masses(&model);
    }
    (model.log.count() == before).then(|| SdfModel {
        name,
        pose,
        self_collide: flag(&model, "self_collide", false),
        trees: tree.trees,
        planes,
    })
}

/// The links of a model that become trees.
struct Tree<'a, 'd> {
    links: Vec<LinkElement<'a, 'd>>,
    joints: Vec<JointElement<'a, 'd>>,
    /// Whether nothing moves.
    fixed: bool,
    /// Joint of each link.
    moved_by: Vec<Option<usize>>,
    trees: Vec<Vec<LinkSpec>>,
    /// Tree and link of each follower, with its joint and axis.
    followers: Vec<(usize, usize, usize, usize)>,
}

impl Tree<'_, '_> {
    fn index(&self, name: &str) -> Option<usize> {
        self.links.iter().position(|link| link.name == name)
    }

    /// Finds the joint of each link. `None`, with the problem recorded, if the links are no trees.
    fn connect(&mut self) -> Option<()> {
        let index: BTreeMap<&str, usize> =
            self.links.iter().enumerate().map(|(k, link)| (link.name.as_str(), k)).collect();
        let mut moved_by: Vec<Option<usize>> = vec![None; self.links.len()];
        let mut parents: Vec<Option<usize>> = vec![None; self.links.len()];
        let mut good = true;
        for (number, joint) in self.joints.iter().enumerate() {
            let mut problem = |message: String, expected: &str| {
                joint.element.problem(message, expected);
                good = false;
            };
            let Some(&child) = index.get(joint.child) else {
                let near = crate::parse::suggest::nearest(joint.child, index.keys().copied());
                let expected = near
                    .map_or("expected the name of a link of this model".into(), |n| format!("did you mean \"{n}\"?"));
                problem(format!("has the child \"{}\"", joint.child.chars().take(48).collect::<String>()), &expected);
                continue;
            };
            let parent = index.get(joint.parent).copied();
            if parent.is_none() && joint.parent != WORLD {
                let near = crate::parse::suggest::nearest(joint.parent, index.keys().copied());
                let expected = near.map_or("expected the name of a link of this model, or world".into(), |n| {
                    format!("did you mean \"{n}\"?")
                });
                problem(format!("has the parent \"{}\"", joint.parent.chars().take(48).collect::<String>()), &expected);
                continue;
            }
            if let Some(earlier) = moved_by[child].replace(number) {
                let first = &self.joints[earlier];
                let message = format!(
                    "has the child \"{}\", which is also that of {} at {}",
                    joint.child,
                    first.element.what(),
                    first.element.place()
                );
                problem(message, "expected one joint for each link; a scene closes loops by [[loop_joint]]");
            }
            parents[child] = parent;
        }
        for start in 0..self.links.len() {
            let (mut at, mut left) = (start, self.links.len());
            while let Some(parent) = parents[at].filter(|_| left > 0) {
                (at, left) = (parent, left - 1);
            }
            if left == 0 && good {
                self.links[at].element.problem("is part of a loop of joints", "expected trees of links");
                good = false;
            }
        }
        self.moved_by = moved_by;
        good.then_some(())
    }

    /// Takes the planes of static links; those of other links are problems.
    fn planes(&mut self, context: &mut Context<'_>) -> Vec<(String, LinkShape)> {
        let mut found = Vec::new();
        for k in 0..self.links.len() {
            let link = &mut self.links[k];
            for (element, shape) in std::mem::take(&mut link.planes) {
                if !self.fixed {
                    note(&element, "planes on links that are not static are left out", &mut context.notes);
                    continue;
                }
                let shape = LinkShape { pose: link.pose * shape.pose, ..shape };
                found.push((link.name.clone(), shape));
            }
        }
        found
    }

    fn build(&mut self) {
        let mut children: Vec<Vec<usize>> = vec![Vec::new(); self.links.len()];
        for (number, joint) in self.joints.iter().enumerate() {
            if let Some(parent) = self.index(joint.parent) {
                children[parent].push(number);
            }
        }
        for root in 0..self.links.len() {
            let joint = self.moved_by[root];
            if joint.is_some_and(|joint| self.joints[joint].parent != WORLD) {
                continue;
            }
            let mut list = Vec::new();
            let placed = match joint {
                Some(joint) => self.add(joint, None, &mut list),
                None => {
                    let kind = if self.fixed { Joint::Fixed } else { Joint::Floating };
                    let link = &mut self.links[root];
                    let spec = JointSpec::new(link.name.clone(), kind);
                    list.push(spec_of(link, None, link.pose, spec));
                    0
                }
            };
            let mut waiting: Vec<(usize, usize)> = children[root].iter().rev().map(|&joint| (joint, placed)).collect();
            while let Some((joint, parent)) = waiting.pop() {
                let placed = self.add(joint, Some(parent), &mut list);
                let child = self.index(self.joints[joint].child).unwrap_or(root);
                waiting.extend(children[child].iter().rev().map(|&joint| (joint, placed)));
            }
            self.trees.push(list);
        }
    }

    /// Adds the child of a joint; returns its index in the list.
    fn add(&mut self, number: usize, parent: Option<usize>, list: &mut Vec<LinkSpec>) -> usize {
        let tree = self.trees.len();
        let (Some(child), at) = (self.index(self.joints[number].child), self.index(self.joints[number].parent)) else {
            return 0;
        };
        let joint = &self.joints[number];
        let from = at.map_or(Pose::identity(), |parent| self.links[parent].pose);
        let relative = from.inverse() * self.links[child].pose;
        let kind = if self.fixed { Kind::Fixed } else { joint.kind };
        let turns_elsewhere =
            !matches!(kind, Kind::Fixed | Kind::Prismatic) && joint.frame.translation.vector != Vec3::zeros();
        // axes of the joint in the frame of the link that moves
        let turn = if turns_elsewhere { nalgebra::one() } else { joint.frame.rotation };
        let joints: Vec<JointSpec> = match kind {
            Kind::Fixed => vec![JointSpec::new(joint.name.clone(), Joint::Fixed)],
            Kind::Ball => vec![JointSpec::new(joint.name.clone(), Joint::Spherical)],
            _ => joint
                .axes
                .iter()
                .enumerate()
                .map(|(k, axis)| {
                    let name =
                        if k + 1 == joint.axes.len() { joint.name.clone() } else { format!("{}/axis", joint.name) };
                    JointSpec { dof: axis.dof.clone(), ..JointSpec::new(name, joint.joint(turn * axis.direction)) }
                })
                .collect(),
        };
        let (mut above, mut placement) = (parent, if turns_elsewhere { relative * joint.frame } else { relative });
        let (last, frame) = (joints.len() - 1, joint.frame);
        for (k, spec) in joints.into_iter().enumerate() {
            if kind != Kind::Fixed && self.joints[number].axes.get(k).is_some_and(|axis| axis.mimic.is_some()) {
                self.followers.push((tree, list.len(), number, k));
            }
            if k == last && !turns_elsewhere {
                list.push(spec_of(&mut self.links[child], above, placement, spec));
            } else {
                let name = format!("{}/{}", self.links[child].name, spec.name);
                list.push(bare(name, above, placement, spec));
            }
            (above, placement) = (Some(list.len() - 1), Pose::identity());
        }
        if turns_elsewhere {
            let link = &mut self.links[child];
            let spec = JointSpec::new(link.name.clone(), Joint::Fixed);
            list.push(spec_of(link, above, frame.inverse(), spec));
        }
        list.len() - 1
    }

    /// Resolves `<mimic>`.
    fn couple(&mut self, context: &mut Context<'_>) {
        for &(tree, link, number, axis) in &self.followers {
            let Some((element, of, multiplier, offset)) =
                self.joints[number].axes.get(axis).and_then(|axis| axis.mimic)
            else {
                continue;
            };
            if !self.joints.iter().any(|joint| joint.name == of) || of == self.joints[number].name {
                element.wrong("joint", "the name of another joint of this model");
                continue;
            }
            let found = self.trees[tree].iter().position(|link| link.joint.name == of && link.joint.is_single());
            match found.filter(|found| *found != link) {
                Some(found) => self.trees[tree][link].joint.mimic = Some(MimicSpec { link: found, multiplier, offset }),
                None => note(
                    &element,
                    "a joint that follows one of another tree, or one without a position, follows nothing",
                    &mut context.notes,
                ),
            }
        }
    }

    /// Checks that every joint moves some mass.
    fn check_masses(&self, model: &Element<'_, '_>) {
        for list in &self.trees {
            let mut heavy: Vec<bool> = list.iter().map(LinkSpec::has_mass).collect();
            for k in (0..list.len()).rev() {
                if !heavy[k] && list[k].joint.kind != Joint::Fixed {
                    let named = self.links.iter().find(|link| link.name == list[k].name);
                    named.map_or(*model, |link| link.element).problem(
                        format_args!("moves no mass: \"{}\" and all links below it have none", list[k].name),
                        "expected <inertial> with a mass in one of them, or a fixed joint",
                    );
                }
                if let Some(parent) = list[k].parent {
                    heavy[parent] |= heavy[k];
                }
            }
        }
    }
}

fn spec_of(link: &mut LinkElement<'_, '_>, parent: Option<usize>, placement: Pose, joint: JointSpec) -> LinkSpec {
    let (name, mass, shapes) = (link.name.clone(), link.mass, std::mem::take(&mut link.shapes));
    LinkSpec { name, parent, placement, joint, mass, shapes, mounts: Default::default() }
}

/// Returns a link without mass and shapes.
fn bare(name: String, parent: Option<usize>, placement: Pose, joint: JointSpec) -> LinkSpec {
    let mass = LinkMassSpec::Given(LinkMass::none());
    LinkSpec { name, parent, placement, joint, mass, shapes: Vec::new(), mounts: Default::default() }
}
