//! Puts the bodies of a model together as a scene.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use tumble_core::articulated::LinkMass;
use tumble_core::collide::Pose;

use super::geom::Form;
use super::joint::Kind;
use super::names::{Names, Taken, joint_ends};
use super::shapes::{Groups, Meshes};
use super::source::XmlNode;
use super::tree::{self, Body, Frame};
use super::{Reader, actuator, equality, inertia, keyframe, mass, pairs, schema, sensor, views};
use crate::parse::bound::Bound;
use crate::parse::file::SceneFile;
use crate::parse::log::Log;
use crate::parse::loop_joint::PartSpec;
use tumble_core::Combine;

/// The counterpart of a body of the model in the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Place {
    /// Fixed to the world: its geoms are static bodies.
    World,
    /// A rigid body, by its index in the scene.
    Rigid(usize),
    /// Part of the kinematic body of a mocap body, by its index in the scene, with its pose in that body.
    Kinematic(usize, Pose),
    /// A link of an articulated body, by both indices.
    Link(usize, usize),
}

/// A scene that is being put together.
pub(super) struct Assembly<'r, 'a> {
    pub(super) reader: &'r Reader<'a>,
    pub(super) bodies: &'r [Body<'a>],
    pub(super) names: &'r Names,
    /// Sites that are places of joints alone.
    pub(super) joint_ends: BTreeSet<String>,
    pub(super) masses: Vec<LinkMass>,
    /// Poses of the bodies in the world, in the reference configuration.
    pub(super) poses: Vec<Pose>,
    /// Whether nothing above a body moves.
    pub(super) fixed: Vec<bool>,
    pub(super) places: Vec<Place>,
    /// The link of each joint of each body, for those of articulated bodies.
    pub(super) joints: Vec<Vec<(usize, usize)>>,
    /// Static bodies of the scene for each geom of each fixed body.
    pub(super) statics: Vec<Vec<(usize, usize)>>,
    pub(super) groups: Groups,
    pub(super) meshes: Meshes,
    pub(super) taken: Taken,
    pub(super) scene: SceneFile,
}

/// Reads a model. `None`, with the problems recorded, if it has any.
pub(super) fn read<'a>(root: &XmlNode<'a>, path: &Path, reader: &Reader<'a>, logs: &[Log<'_>]) -> Option<SceneFile> {
    let is_good = || logs.iter().all(|log| log.count() == 0);
    note_sections(root, reader);
    let bodies = tree::read(root, reader);
    let names = Names::of(&bodies);
    let groups = Groups::of(&bodies, pairs::partners(root, &bodies, &names, reader), &root.element, reader);
    let mut scene = SceneFile::parse("", &path.display().to_string()).ok()?;
    read_option(root, reader, &mut scene);
    // Numbers that are not finite are problems, and masses need finite numbers.
    if !is_good() {
        return None;
    }
    let masses = mass::of_bodies(&bodies, reader);
    let (poses, fixed) = walk(&bodies);
    let mut assembly = Assembly {
        reader,
        bodies: &bodies,
        names: &names,
        joint_ends: joint_ends(root),
        masses,
        poses,
        fixed,
        places: vec![Place::World; bodies.len()],
        joints: vec![Vec::new(); bodies.len()],
        statics: vec![Vec::new(); bodies.len()],
        groups,
        meshes: Meshes::default(),
        taken: Taken::default(),
        scene,
    };
    assembly.scene.description = root.element.text("model").map(super::defaults::cleaned).unwrap_or_default();
    assembly.check_masses();
    if !is_good() {
        return None;
    }
    assembly.add_bodies();
    inertia::set_spring_dampers(&mut assembly);
    let controls = keyframe::apply(root, &mut assembly);
    equality::read(root, &mut assembly);
    actuator::read(root, controls.as_deref(), &mut assembly);
    sensor::read(root, &mut assembly);
    pairs::read(root, &mut assembly);
    if let Some((material, pair)) = assembly.groups.frictionless() {
        assembly.scene.materials.push(material);
        assembly.scene.pairs.push(pair);
    }
    views::read(&mut assembly);
    let mut scene = assembly.scene;
    scene.meshes = assembly.meshes.specs;
    scene.notes = reader.notes.take();
    is_good().then_some(scene)
}

/// Returns the poses of all bodies in the world, and whether nothing above each moves.
fn walk(bodies: &[Body<'_>]) -> (Vec<Pose>, Vec<bool>) {
    let (mut poses, mut fixed): (Vec<Pose>, Vec<bool>) = (vec![Pose::identity()], vec![true]);
    for body in &bodies[1..] {
        poses.push(poses[body.parent] * body.pose);
        fixed.push(fixed[body.parent] && body.joints.is_empty());
    }
    (poses, fixed)
}

fn read_option(root: &XmlNode<'_>, reader: &Reader<'_>, scene: &mut SceneFile) {
    let world = &mut scene.world;
    world.combine_friction = Combine::Max;
    world.dt_s = 0.002;
    for option in root.all("option") {
        let element = &option.element;
        schema::OPTION.check(element, &reader.notes);
        if let Some(dt) = element.number("timestep", Bound::new(1e-6, 1.0, "a time from 1e-6 to 1 s")) {
            world.dt_s = dt;
        }
        if let Some(gravity) = element.numbers("gravity", Bound::ANY) {
            world.gravity_m_per_s2 = gravity;
        }
    }
    if !reader.gravity {
        world.gravity_m_per_s2 = [0.0; 3];
    }
}

/// Notes the sections that are left out as a whole.
fn note_sections(root: &XmlNode<'_>, reader: &Reader<'_>) {
    const READ: [&str; 11] = [
        "compiler",
        "option",
        "default",
        "asset",
        "worldbody",
        "contact",
        "equality",
        "actuator",
        "keyframe",
        "tendon",
        "sensor",
    ];
    for section in &root.children {
        let (tag, element) = (section.tag(), &section.element);
        match tag {
            _ if READ.contains(&tag) => {}
            "visual" | "statistic" | "size" | "custom" | "extension" | "deformable" => {
                reader.notes.add(element, format!("<{tag}> is left out"));
            }
            _ => {
                let near = crate::parse::suggest::nearest(tag, READ);
                let expected = near.map_or("expected a section of MJCF".to_owned(), |n| format!("did you mean <{n}>?"));
                element.problem("is not a section of <mujoco>", expected);
            }
        }
    }
}

impl Assembly<'_, '_> {
    /// Checks that every joint moves some mass or has an armature.
    fn check_masses(&self) {
        let mut heavy: Vec<bool> = self.masses.iter().map(|m| m.mass > 0.0 || m.inertia.amax() > 0.0).collect();
        // meshes that add no mass, of each body and those below it
        let mut faults: Vec<BTreeMap<&str, String>> = self.bodies.iter().map(|body| self.faults(body)).collect();
        for (number, body) in self.bodies.iter().enumerate().skip(1).rev() {
            let massless = |joint: &&super::joint::JointItem<'_>| joint.armature == 0.0;
            if !heavy[number] && body.joints.iter().any(|joint| massless(&joint)) {
                let message = "moves no mass: it and its descendants have none";
                if faults[number].is_empty() {
                    body.element.problem(message, "expected <inertial>, or a geom with a mass, in one of them");
                }
                for (mesh, why) in std::mem::take(&mut faults[number]) {
                    let expected = "expected an existing mesh with a volume, or <inertial> in the body";
                    let element = &self.reader.assets.meshes[mesh].element;
                    element.problem(format!("has no mass, so a body moves none: {why}"), expected);
                }
                // One message for the chain is enough.
                heavy[number] = true;
            }
            // A free body needs mass of its own or below it; a chain passes it on.
            if body.parent > 0 {
                heavy[body.parent] |= heavy[number];
                let own = std::mem::take(&mut faults[number]);
                faults[body.parent].extend(own);
            }
        }
    }

    /// Returns the meshes of a body that should add mass and do not, and why.
    fn faults(&self, body: &Body<'_>) -> BTreeMap<&str, String> {
        let meshes = body.geoms.iter().filter(|geom| geom.is_heavy());
        let named = meshes.filter_map(|geom| match &geom.form {
            Form::Mesh(name) => Some(self.reader.assets.meshes.get_key_value(name)?.0.as_str()),
            _ => None,
        });
        named.filter_map(|name| Some((name, self.reader.mesh_mass(name).err()?))).collect()
    }

    /// Returns the body or link that a body of the model became, `None` for the world, and a pose of the body in it.
    pub(super) fn placed(&self, body: usize, pose: &Pose) -> (Option<PartSpec>, Pose) {
        match self.places[body] {
            Place::World => (None, self.poses[body] * pose),
            Place::Rigid(index) => (Some(PartSpec::Body(index)), *pose),
            Place::Kinematic(index, own) => (Some(PartSpec::Body(index)), own * pose),
            Place::Link(tree, link) => (Some(PartSpec::Link(tree, link)), *pose),
        }
    }

    /// Returns whether a body of the model is fixed to the world, or moves along a prescribed motion.
    pub(super) fn is_held(&self, body: usize) -> bool {
        matches!(self.places[body], Place::World | Place::Kinematic(..))
    }

    /// Returns whether a site is the place of a joint of `<equality>`, and nothing else.
    pub(super) fn is_joint_end(&self, site: &Frame<'_>) -> bool {
        site.name.as_ref().is_some_and(|name| self.joint_ends.contains(name))
    }

    /// Returns whether a body is free and has nothing below it.
    pub(super) fn is_free_leaf(&self, number: usize) -> bool {
        let body = &self.bodies[number];
        body.joints.len() == 1
            && body.joints[0].kind == Kind::Free
            && self.bodies.get(number + 1).is_none_or(|next| next.parent != number)
    }
}
