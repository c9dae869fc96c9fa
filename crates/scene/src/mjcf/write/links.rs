//! Articulated bodies as trees of `<body>`.
//!
//! ```text
//! tumble:   X_parent_link = P·J(q)                                one joint of a link, at its origin
//! MJCF:     X_parent_body = B·J₁(q₁)·J₂(q₂)·…                     joints by anchor and axis in the axes of the body
//! ```
//!
//! MuJoCo refuses bodies that move without mass. A chain of massless links with one child each and the
//! link at its end therefore become one body with several joints: with placements `P₁ … Pₙ`, `B = P₁·…·Pₙ`, and joint `k`
//! has the pose `(Pₖ₊₁·…·Pₙ)⁻¹` in the body.
//!
//! | symbol | meaning |
//! |---|---|
//! | `P` | placement of a joint's frame in the frame of the parent |
//! | `J` | motion of a joint |
//! | `B` | pose of the body at joint positions 0 |

use std::collections::BTreeSet;

use tumble_core::articulated::{DofSettings, Drive, Link, LinkMass};
use tumble_core::collide::{Pose, Vec3};
use tumble_core::{ArticulatedBody, Joint, Mode, Object, ObjectId};

use super::MjcfWriter;
use super::bodies::put_rotation;
use super::joints::coupled;
use super::xml::{Attributes, numbers, vector};

/// Limit of a joint that is open at one end, rad or m.
const FAR: f64 = 1e10;

/// An articulated body that is being written.
pub(super) struct Tree<'b> {
    pub(super) id: ObjectId,
    name: &'b str,
    pub(super) body: &'b ArticulatedBody,
    state: &'b [f64],
    /// Whether the whole body collides.
    pub(super) collidable: bool,
    children: Vec<Vec<usize>>,
    /// Names of its joints by link.
    pub(super) joints: Vec<String>,
    /// Whether it has a body for its base: the base carries something, or several roots.
    based: bool,
}

impl MjcfWriter<'_> {
    /// Writes an articulated body.
    pub(super) fn articulated(&mut self, id: ObjectId, name: &str, body: &ArticulatedBody) {
        let (Some(status), Some(state)) = (self.world.status(id), self.world.state_of(id)) else { return };
        if status.mode != Mode::Dynamic {
            self.note(name, "an articulated body that is not dynamic is written as a dynamic one");
        }
        let links = body.model().links();
        let mut children: Vec<Vec<usize>> = vec![Vec::new(); links.len()];
        for (k, link) in links.iter().enumerate() {
            link.parent.iter().for_each(|parent| children[*parent].push(k));
        }
        let known = self.joint_names.get(name).cloned().unwrap_or_default();
        let joints = links.iter().enumerate().map(|(k, link)| {
            let own = known.get(k).filter(|_| known.len() == links.len()).unwrap_or(&link.name);
            let label = self.joints.unique(own.to_string());
            self.note_rename("joint", (&format!("joint {own} of {name}"), own), &label);
            label
        });
        let joints = joints.collect::<Vec<_>>();
        for (link, joint) in links.iter().zip(&joints).filter(|(link, _)| link.joint.dof() == 1) {
            self.dofs.insert((id, link.v), joint.clone());
        }
        let fixed = links.iter().filter(|link| link.parent.is_none() && link.joint != Joint::Floating).count();
        let based = fixed > 1
            || body.colliders().any(|(link, _)| link.is_none())
            || visuals(body, None).next().is_some()
            || body.model().frames().iter().any(|frame| frame.link.is_none());
        let tree = Tree { id, name, body, state, collidable: status.collidable, children, joints, based };
        self.base(&tree);
        for root in roots(links, Joint::Floating) {
            self.link(&tree, root, &[]);
        }
        self.excludes(&tree);
        self.drives(&tree);
        for coupling in body.couplings() {
            let of = |v: usize| links.iter().position(|link| link.v == v).map(|k| tree.joints[k].clone());
            let (Some(first), Some(second)) = (of(coupling.dof), of(coupling.of)) else { continue };
            self.equalities.push(("joint", coupled(first, second, coupling.offset, coupling.multiplier)));
        }
        if !body.camera().map_or(&[][..], |c| c.cameras()).is_empty()
            || !body.light().map_or(&[][..], |l| l.lights()).is_empty()
        {
            self.note(name, "cameras and lights are left out");
        }
    }

    /// Writes the base with what is fixed to it, and the trees of links on it.
    fn base(&mut self, tree: &Tree<'_>) {
        let links = tree.body.model().links();
        let fixed = (0..links.len()).filter(|k| links[*k].parent.is_none() && links[*k].joint != Joint::Floating);
        if !tree.based {
            self.names.insert((tree.id, None), "world".into());
            fixed.for_each(|root| self.link(tree, root, &[]));
            return;
        }
        let taken = links.iter().any(|link| link.name == tree.name);
        let label = if taken { format!("{}/base", tree.name) } else { tree.name.to_owned() };
        let label = self.bodies.unique(label);
        self.names.insert((tree.id, None), label.clone());
        let mut t = Attributes::of("name", label);
        t.put_pose(tree.body.base());
        self.xml.open("body", &t);
        self.content(tree, None);
        fixed.for_each(|root| self.link(tree, root, &[]));
        self.xml.close();
    }

    /// Writes a link and all below it. `chain` are massless links above it that become joints of its body.
    fn link(&mut self, tree: &Tree<'_>, k: usize, chain: &[usize]) {
        let chain = [chain, &[k]].concat();
        if let ([child], true) = (&tree.children[k][..], tree.is_bare(k)) {
            return self.link(tree, *child, &chain);
        }
        let links = tree.body.model().links();
        let link = &links[k];
        let label = self.body_label(&link.name);
        for link in &chain {
            self.names.insert((tree.id, Some(*link)), label.clone());
            self.inner.extend((*link != k).then_some((tree.id, Some(*link))));
            let read = format!("{label}/{}", tree.joints[*link]);
            if *link != k && links[*link].name != read {
                let note = format!("a massless link with one child is a joint of its body, and is read back as {read}");
                self.note(&links[*link].name, note);
            }
        }
        if links[chain[0]].parent.is_none() && label != tree.name {
            let note = format!("a tree of MJCF has the name of its root body: it is read back as {label}");
            self.note(tree.name, note);
        }
        let mut t = Attributes::of("name", label);
        let placed = chain.iter().fold(Pose::identity(), |pose, k| pose * tree.placement(&links[*k]));
        t.put_pose(&placed);
        self.xml.open("body", &t);
        for (n, joint) in chain.iter().enumerate() {
            let below = chain[n + 1..].iter().fold(Pose::identity(), |pose, k| pose * tree.placement(&links[*k]));
            self.joint(tree, *joint, &below.inverse());
        }
        // without the links that are fixed to it, which are bodies in this one
        let own = tree.body.link_mass(&link.name).unwrap_or(link.mass);
        if own != LinkMass::none() || link.mass == LinkMass::none() {
            self.inertial(&link.name, &own);
        }
        self.content(tree, Some(k));
        for child in &tree.children[k] {
            self.link(tree, *child, &[]);
        }
        self.xml.close();
    }

    /// Writes the joint of a link, whose frame has this pose in the body.
    fn joint(&mut self, tree: &Tree<'_>, k: usize, at: &Pose) {
        let (model, link) = (tree.body.model(), &tree.body.model().links()[k]);
        let q = &tree.state[link.q..link.q + link.joint.positions()];
        let v = &tree.state[model.positions() + link.v..][..link.joint.dof()];
        let dofs = &tree.body.dofs()[link.v..link.v + link.joint.dof()];
        let Some(dof) = dofs.first() else { return };
        let spherical = link.joint == Joint::Spherical;
        let range = if spherical { self.ball_range(&link.name, dofs) } else { None };
        let free = |dof: &DofSettings| match spherical {
            true => DofSettings { limits: None, twist_limits: None, ..dof.clone() },
            false => dof.clone(),
        };
        if dofs.iter().any(|other| free(other) != free(dof)) {
            self.note(
                &link.name,
                "different settings of one joint's degrees of freedom: those of the first are written",
            );
        }
        let mut t = Attributes::of("name", &tree.joints[k]);
        match &link.joint {
            Joint::Fixed => return,
            Joint::Floating => {
                put_free(q, v, (&mut self.qpos, &mut self.qvel));
                if dof.damping == 0.0 && dof.friction == 0.0 {
                    return self.xml.leaf("freejoint", &t);
                }
                t.put("type", "free");
            }
            Joint::Spherical => {
                put_rotation(q, &mut self.qpos);
                self.qvel.extend(v);
                t.put("type", "ball");
                t.put_unless(Vec3::zeros(), "pos", at.translation.vector, vector(&at.translation.vector));
                t.put_number(0.0, "armature", link.armature);
                if let Some(spring) = &dof.spring {
                    t.put_number(0.0, "stiffness", spring.stiffness);
                    if dofs.iter().any(|dof| dof.spring.is_some_and(|spring| spring.rest != 0.0)) {
                        self.note(
                            &link.name,
                            "rest orientations of spherical joints other than that of the joint are left out",
                        );
                    }
                }
                if dofs.iter().any(|dof| dof.drive != Drive::None) {
                    self.note(&link.name, "drives of spherical joints are left out");
                }
                if let Some(most) = range {
                    t.put("range", numbers([0.0, most]));
                }
                if at.rotation != nalgebra::one() {
                    self.note(
                        &link.name,
                        "a spherical joint in a chain of massless links has axes that MJCF cannot turn",
                    );
                }
            }
            Joint::Revolute { axis } | Joint::Prismatic { axis } => {
                self.qpos.extend(q);
                self.qvel.extend(v);
                let turns = matches!(link.joint, Joint::Revolute { .. });
                t.put("type", if turns { "hinge" } else { "slide" });
                t.put_unless(Vec3::zeros(), "pos", at.translation.vector, vector(&at.translation.vector));
                t.put("axis", vector(&(at.rotation * axis)));
                match dof.limits {
                    // MuJoCo refuses a range without width
                    Some([low, high]) if low == high => {
                        let held = Attributes::of("joint1", &tree.joints[k]);
                        self.equalities.push(("joint", held.with("polycoef", numbers([low, 0.0, 0.0, 0.0, 0.0]))));
                    }
                    Some(limits) => t.put("range", numbers(limits.map(|x| x.clamp(-FAR, FAR)))),
                    None => {}
                }
                if let Some(spring) = &dof.spring {
                    t.put_number(0.0, "stiffness", spring.stiffness);
                    t.put_number(0.0, "springref", spring.rest);
                }
                t.put_number(0.0, "armature", link.armature);
                if dof.effort.is_finite() {
                    t.put("actuatorfrcrange", numbers([-dof.effort, dof.effort]));
                }
            }
        }
        t.put_number(0.0, "damping", dof.damping);
        t.put_number(0.0, "frictionloss", dof.friction);
        if dof.max_velocity.is_finite() {
            self.note(&tree.joints[k], "limits of velocities are left out");
        }
        self.xml.leaf("joint", &t);
    }

    /// Returns the largest rotation of a spherical joint, rad: that of a cone with limits of the twist that are the same about the same
    /// axis, as the reader makes them; others are left out.
    fn ball_range(&mut self, link: &str, dofs: &[DofSettings]) -> Option<f64> {
        let bounded: Vec<&DofSettings> =
            dofs.iter().filter(|dof| dof.limits.is_some() || dof.twist_limits.is_some()).collect();
        let same = |dof: &DofSettings| {
            let [_, cone] = dof.limits?;
            (dof.twist_limits.is_none_or(|[lo, hi]| hi == cone && lo == -cone)).then_some(cone)
        };
        let range = match bounded[..] {
            [dof] => same(dof),
            _ => None,
        };
        match range {
            Some(_) => self.note(link, "the cone and the limits of the twist become a limit of the whole rotation"),
            None if !bounded.is_empty() => {
                self.note(link, "cones and limits of the twist of spherical joints are left out")
            }
            None => {}
        }
        range
    }

    /// Writes the shapes of a link or of the base, and frames that are fixed to it.
    fn content(&mut self, tree: &Tree<'_>, link: Option<usize>) {
        let model = tree.body.model();
        if let Some(number) = link.and_then(|k| model.frame_index(&model.links()[k].name)) {
            self.shapes_of_frame(tree, number, &Pose::identity());
            let label = self.names.get(&(tree.id, link)).cloned().unwrap_or_default();
            self.link_bodies.insert((tree.id, number), label);
        }
        for (number, frame) in model.frames().iter().enumerate().filter(|(_, frame)| frame.link == link) {
            if link.is_some_and(|k| model.links()[k].name == frame.name) {
                continue;
            }
            self.fixed_link(tree, number);
        }
        self.joint_sites_of((tree.id, link));
    }

    /// Excludes pairs of links that collide in MuJoCo and not here.
    fn excludes(&mut self, tree: &Tree<'_>) {
        let (body, links) = (tree.body, tree.body.model().links());
        let Some(parts) = body.collidable() else { return };
        let carriers: BTreeSet<Option<usize>> = body.colliders().map(|(link, _)| link).collect();
        let carriers: Vec<Option<usize>> = carriers.into_iter().collect();
        for (n, a) in carriers.iter().enumerate() {
            for b in &carriers[n + 1..] {
                let (Some(first), Some(second)) = (body.colliders_of(*a).next(), body.colliders_of(*b).next()) else {
                    continue;
                };
                let joined =
                    |a: Option<usize>, b: Option<usize>| b.is_some() && a.is_some_and(|a| tree.parent(links, a) == b);
                let (meets, neighbors) = (parts.parts_collide(first, second), joined(*a, *b) || joined(*b, *a));
                let names = [a, b].map(|side| self.names.get(&(tree.id, *side)).cloned().unwrap_or_default());
                if !meets && !neighbors && names[0] != names[1] {
                    let [first, second] = [a, b].map(|side| self.colliding_bodies(tree, *side));
                    for (first, second) in first.iter().flat_map(|a| second.iter().map(move |b| (a, b))) {
                        self.contacts.push(("exclude", Attributes::of("body1", first).with("body2", second)));
                    }
                } else if meets && neighbors {
                    self.note(&names[0], "links of one joint that collide: MuJoCo leaves out such contacts");
                }
            }
        }
    }
}

impl Tree<'_> {
    /// Returns the placement of a link in its parent, in the base, or in the world for a floating root.
    fn placement(&self, link: &Link) -> Pose {
        match (&link.joint, link.parent) {
            (Joint::Floating, _) => pose_of(&self.state[link.q..link.q + 7]),
            (_, None) if self.based => self.body.base().inverse() * link.placement,
            _ => link.placement,
        }
    }

    /// Returns whether a link is a joint alone: without mass, shapes and visuals.
    fn is_bare(&self, k: usize) -> bool {
        let link = &self.body.model().links()[k];
        link.mass == LinkMass::none()
            && link.joint != Joint::Floating
            && self.body.colliders_of(Some(k)).next().is_none()
            && visuals(self.body, Some(k)).next().is_none()
            && self.body.model().frames().iter().filter(|frame| frame.link == Some(k)).count() == 1
    }

    /// Returns the parent of a link's body.
    fn parent(&self, links: &[Link], mut k: usize) -> Option<usize> {
        loop {
            k = links[k].parent?;
            if !(self.is_bare(k) && self.children[k].len() == 1) {
                return Some(k);
            }
        }
    }
}

/// Returns the roots with this joint.
fn roots(links: &[Link], joint: Joint) -> Vec<usize> {
    (0..links.len()).filter(|k| links[*k].parent.is_none() && links[*k].joint == joint).collect()
}

/// Returns the visuals of a link, or of the base, that are drawn.
fn visuals(body: &ArticulatedBody, link: Option<usize>) -> impl Iterator<Item = &tumble_core::Visual> {
    let part = link.unwrap_or(body.model().links().len());
    let all = body.renderable().map_or(&[][..], |r| r.visuals());
    all.iter().filter(move |visual| visual.part == part && visual.drawn().is_some())
}

/// Adds position and velocity of a floating root: MuJoCo's angular velocity is in the axes of the body.
fn put_free(q: &[f64], v: &[f64], (qpos, qvel): (&mut Vec<f64>, &mut Vec<f64>)) {
    qpos.extend(&q[..3]);
    put_rotation(&q[3..7], qpos);
    let spin = pose_of(q).rotation.inverse() * Vec3::new(v[0], v[1], v[2]);
    qvel.extend(v[3..6].iter().chain(spin.iter()));
}

fn pose_of(q: &[f64]) -> Pose {
    let rotation = nalgebra::Quaternion::new(q[6], q[3], q[4], q[5]);
    Pose::from_parts(Vec3::new(q[0], q[1], q[2]).into(), nalgebra::UnitQuaternion::new_unchecked(rotation))
}
