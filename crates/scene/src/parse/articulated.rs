//! `[[articulated]]`: a tree of links in reduced coordinates, written out in the scene or read from
//! a URDF, a model of MuJoCo or one of Gazebo.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use tumble_core::articulated::MAX_LINKS;
use tumble_core::collide::Pose;
use tumble_core::{Joint, Mode};

use crate::mjcf::MjcfOptions;
use crate::parse::body::{Library, read_mode, read_name};
use crate::parse::bound::Bound;
use crate::parse::fields::{Fields, Names, Value, number_of};
use crate::parse::link::{Inherited, LinkRow, LinkSpec, Surface};
use crate::parse::material::overlay_contact;
use crate::parse::place::Place;
use crate::parse::rotation;
use crate::urdf::{CollisionMeshes, MissingMeshes, UrdfOptions};

/// Largest number of pairs in `exclude_collisions`.
const MAX_PAIRS: usize = 100_000;

/// An articulated body at time 0 with all references resolved.
#[derive(Clone, Debug, PartialEq)]
pub struct ArticulatedSpec {
    /// Unique in the scene, rigid bodies included; of any length.
    pub name: String,
    /// Pose of the base, world axes. Links without a parent are attached to it; a floating root
    /// starts there.
    pub base: Pose,
    /// All links, a parent before its children.
    pub links: Vec<LinkSpec>,
    /// Whether links that no joint connects collide with each other. Default true.
    pub self_collision: bool,
    /// Pairs of links that never collide.
    pub exclude_collisions: Vec<[usize; 2]>,
    /// Whether links that overlap at time 0 never collide. True for a URDF.
    pub exclude_overlapping: bool,
    /// Default `dynamic`.
    pub mode: Mode,
    /// Takes part in contacts. Default true.
    pub collidable: bool,
    /// Takes part in the simulation. Default true.
    pub enabled: bool,
    /// Notes about the file that it was read from.
    pub notes: Vec<String>,
}

impl ArticulatedSpec {
    /// Returns the index of the link of that name.
    pub fn link(&self, name: &str) -> Option<usize> {
        self.links.iter().position(|link| link.name == name)
    }

    /// Returns the index of the link whose joint has that name. Fixed joints are not found.
    pub fn joint(&self, name: &str) -> Option<usize> {
        self.links.iter().position(|link| link.joint.name == name && link.joint.kind != Joint::Fixed)
    }

    /// Returns an articulated body of these links with its base at the origin.
    pub(crate) fn of(name: String, links: Vec<LinkSpec>) -> ArticulatedSpec {
        let (base, exclude_collisions, notes) = (Pose::identity(), Vec::new(), Vec::new());
        ArticulatedSpec {
            name,
            base,
            links,
            self_collision: true,
            exclude_collisions,
            exclude_overlapping: false,
            mode: Mode::Dynamic,
            collidable: true,
            enabled: true,
            notes,
        }
    }

    /// Reads the table. Returns `None`, with the problems recorded, if it has no links.
    pub(crate) fn read(mut f: Fields<'_>, library: &Library<'_>, place: &Place<'_>) -> Option<ArticulatedSpec> {
        let name = read_name(&mut f).unwrap_or_default();
        let base = rotation::read_pose(&mut f);
        let surface = Surface::read(&mut f, library, &Surface { contacts: library.contacts, ..Surface::default() });
        let floating = f.flag_or("floating", false);
        let mut spec = ArticulatedSpec {
            base,
            exclude_overlapping: f.value("urdf").or(f.value("sdformat")).is_some(),
            ..ArticulatedSpec::of(name, Vec::new())
        };
        (spec.self_collision, spec.enabled) = (f.flag_or("self_collision", true), f.flag_or("enabled", true));
        (spec.mode, spec.collidable) = (read_mode(&mut f), f.flag_or("collidable", true));
        let from = Inherited {
            library,
            surface: &surface,
            floating,
            room: MAX_LINKS,
            collidable: true,
            visible: f.flag_or("visible", true),
        };
        match (f.value("urdf"), f.value("mjcf"), f.value("sdformat")) {
            (Some(_), _, _) => spec.read_urdf(&mut f, &from, place)?,
            (None, Some(_), _) => spec.read_mjcf(&mut f, &from, place)?,
            (None, None, Some(_)) => spec.read_sdformat(&mut f, &from, place)?,
            (None, None, None) => spec.read_links(&mut f, &from),
        }
        spec.read_joints(&mut f);
        spec.read_start(&mut f);
        spec.read_velocity(&mut f, floating);
        spec.read_pairs(&mut f);
        spec.links.iter_mut().for_each(|link| link.joint.settle());
        f.finish();
        (!spec.links.is_empty()).then_some(spec)
    }

    fn read_links(&mut self, f: &mut Fields<'_>, from: &Inherited<'_, '_>) {
        let tables = f.tables("link", MAX_LINKS);
        if tables.is_empty() && f.value("link").is_none() {
            f.missing("link", "links, each under a line [[articulated.link]], or `urdf`, `mjcf` or `sdformat`");
        }
        let mut mimics = Vec::new();
        let mut lines: BTreeMap<String, usize> = BTreeMap::new();
        for mut table in tables {
            let names: Vec<&str> = self.links.iter().map(|link| link.name.as_str()).collect();
            let room = MAX_LINKS.saturating_sub(self.links.len());
            let row = LinkRow::read(&mut table, &Inherited { room, ..*from }, &names);
            let place = table.value("name").map_or(table.span.clone(), Value::span);
            let first = self.links.len();
            let Some(mut row) = row else {
                table.give_up();
                continue;
            };
            mimics.extend(row.mimic.take().map(|(of, value)| (first, row.count, of, value)));
            row.append_to(&mut self.links);
            if from.floating && first > 0 && self.links.get(first).is_some_and(|link| link.parent.is_none()) {
                let message = format!("{} is a second link without `parent` in a floating body", table.what);
                table.log.report(place.clone(), message, "expected a `parent`: a floating body has one root");
            }
            for link in &self.links[first..] {
                if let Some(line) = lines.insert(link.name.clone(), f.log.line(place.start)) {
                    let message = format!("there is a second link \"{}\"; the first is at line {line}", link.name);
                    table.log.report(place.clone(), message, "expected a unique name");
                    break;
                }
            }
            table.finish();
        }
        for (first, count, of, value) in mimics {
            self.resolve_mimic(f, first..first + count, of, value);
        }
    }

    fn resolve_mimic(&mut self, f: &Fields<'_>, followers: std::ops::Range<usize>, of: &str, value: &Value<'_>) {
        let Some(link) = self.joint(of).filter(|&k| self.links[k].joint.is_single()) else {
            let single = self.links.iter().filter(|link| link.joint.is_single()).map(|link| link.name.as_str());
            return f.unknown_name("mimic", value, of, single.collect());
        };
        if followers.contains(&link) {
            return f.wrong("mimic", value, "a joint other than its own");
        }
        for follower in &mut self.links[followers] {
            follower.joint.mimic.iter_mut().for_each(|mimic| mimic.link = link);
        }
    }

    /// Reads `sdformat` and the keys that belong to it. The pose of the table is that of the model.
    fn read_sdformat(&mut self, f: &mut Fields<'_>, from: &Inherited<'_, '_>, place: &Place<'_>) -> Option<()> {
        let (path, value) = f.optional_text("sdformat")?;
        if let Some(floating) = f.value("floating").filter(|_| from.floating) {
            f.wrong("floating", floating, "no `floating` with `sdformat`: the file says whether its root floats");
        }
        let options = read_options(f, from, place);
        match crate::sdformat::one_body(&place.folder.join(path), &options) {
            Ok((read, notes)) => {
                (self.links, self.notes) = (read.links, notes);
                if f.value("self_collision").is_none() {
                    self.self_collision = read.self_collision;
                }
                for shape in self.links.iter_mut().flat_map(|link| &mut link.shapes) {
                    shape.visible &= from.visible;
                }
                Some(())
            }
            Err(error) => {
                for line in error.to_string().lines() {
                    f.log.report(
                        value.span(),
                        format!("`sdformat` of {}: {line}", f.what),
                        "expected a valid SDF file",
                    );
                }
                None
            }
        }
    }

    /// Reads `urdf` and the keys that belong to it.
    fn read_urdf(&mut self, f: &mut Fields<'_>, from: &Inherited<'_, '_>, place: &Place<'_>) -> Option<()> {
        let (path, value) = f.optional_text("urdf")?;
        let options =
            UrdfOptions { velocity_limits: f.flag_or("velocity_limits", false), ..read_options(f, from, place) };
        let file = place.folder.join(path);
        let robot = match place.text(path) {
            Some(text) => crate::urdf::read_text(text, &file, &options, crate::urdf::Content::Body),
            None => crate::urdf::read_file(&file, &options, crate::urdf::Content::Body),
        };
        match robot {
            Ok(robot) => {
                self.links = robot.links;
                self.notes = robot.notes;
                for shape in self.links.iter_mut().flat_map(|link| &mut link.shapes) {
                    shape.visible &= from.visible;
                }
                Some(())
            }
            Err(error) => {
                let message = error.to_string();
                let lines: Vec<&str> = message.lines().collect();
                for line in &lines {
                    f.log.report(value.span(), format!("`urdf` of {}: {line}", f.what), "expected a valid URDF");
                }
                None
            }
        }
    }

    /// Reads `mjcf` and the keys that belong to it. Surface keys replace those of the file.
    fn read_mjcf(&mut self, f: &mut Fields<'_>, from: &Inherited<'_, '_>, place: &Place<'_>) -> Option<()> {
        let (path, value) = f.optional_text("mjcf")?;
        if let Some(floating) = f.value("floating").filter(|_| from.floating) {
            f.wrong("floating", floating, "no `floating` with `mjcf`: the file says whether its root floats");
        }
        let options = MjcfOptions {
            missing_meshes: f.choice_or("missing_meshes", MISSING, MissingMeshes::Error),
            collision_meshes: f.choice_or("collision_meshes", COLLISION, CollisionMeshes::Hull),
            keyframe: f.optional_text("keyframe").map(|(name, _)| name.to_owned()),
        };
        let read = crate::mjcf::one_body(&place.folder.join(path), &options);
        let (read, notes) = match read {
            Ok(read) => read,
            Err(error) => {
                for line in error.to_string().lines() {
                    f.log.report(value.span(), format!("`mjcf` of {}: {line}", f.what), "expected a valid model");
                }
                return None;
            }
        };
        (self.links, self.exclude_collisions, self.notes) = (read.links, read.exclude_collisions, notes);
        let [named, color] = ["material", "color"].map(|key| f.value(key).is_some());
        for shape in self.links.iter_mut().flat_map(|link| &mut link.shapes) {
            shape.visible &= from.visible;
            let (own, new) = (&mut shape.surface, from.surface);
            own.material = new.material;
            own.contacts = new.contacts;
            if named {
                own.contact = new.contact;
            } else {
                overlay_contact(f, &mut own.contact, &new.contact);
            }
            if named || color {
                own.appearance = new.appearance.clone();
            }
        }
        Some(())
    }

    /// Reads `[[articulated.joint]]`: limits, drives, damping and friction of existing joints.
    fn read_joints(&mut self, f: &mut Fields<'_>) {
        for mut table in f.tables("joint", MAX_LINKS) {
            let named = table.texts("name", MAX_LINKS, "the name of a joint, or a list of them");
            let joints: Vec<usize> =
                named.iter().filter_map(|(name, value)| self.named_joint(&table, "name", name, value)).collect();
            if let Some((name, _)) = named.first() {
                table.what = format!("joint \"{name}\"");
            }
            if joints.is_empty() {
                table.give_up();
                continue;
            }
            for joint in joints {
                self.links[joint].joint.read_effects(&mut table);
            }
            table.finish();
        }
    }

    fn named_joint(&self, f: &Fields<'_>, key: &str, name: &str, value: &Value<'_>) -> Option<usize> {
        let found = self.joint(name);
        if found.is_none() {
            let moving =
                self.links.iter().filter(|link| link.joint.kind != Joint::Fixed).map(|link| link.joint.name.as_str());
            f.unknown_name(key, value, name, moving.collect());
        }
        found
    }

    /// Reads `initial_positions = { JOINT = position }`.
    fn read_start(&mut self, f: &mut Fields<'_>) {
        let Some(start) = f.table("initial_positions", "{ JOINT = 0.5 }") else { return };
        for (name, span, value) in start.entries() {
            let Some(link) = self.joint(name).filter(|&k| self.links[k].joint.is_single()) else {
                let single =
                    self.links.iter().filter(|link| link.joint.is_single()).map(|link| link.joint.name.as_str());
                let near = crate::parse::suggest::nearest(name, single);
                let expected = near.map_or("expected the name of a revolute or prismatic joint".into(), |near| {
                    format!("did you mean `{near}`?")
                });
                f.log.report(span, format!("{} has no joint \"{name}\" with one degree of freedom", f.what), expected);
                continue;
            };
            match number_of(value).filter(|x| Bound::ANY.holds(*x)) {
                Some(x) => self.links[link].joint.position = vec![x],
                None => start.wrong(name, value, "a position: rad of a revolute joint, m of a prismatic one"),
            }
        }
    }

    /// Reads the velocity of a floating root.
    fn read_velocity(&mut self, f: &mut Fields<'_>, floating: bool) {
        if !floating {
            return;
        }
        let linear: [f64; 3] = f.vector_or("velocity_m_per_s", Bound::ANY, [0.0; 3]);
        let angular: [f64; 3] = f.vector_or("angular_velocity_rad_per_s", Bound::ANY, [0.0; 3]);
        for link in self.links.iter_mut().filter(|link| link.joint.kind == Joint::Floating) {
            link.joint.velocity = angular.into_iter().chain(linear).collect();
        }
    }

    fn read_pairs(&mut self, f: &mut Fields<'_>) {
        let expected = "pairs of links, such as [[\"a\", \"b\"]]";
        for value in f.list("exclude_collisions", MAX_PAIRS, expected) {
            let items = value.get_ref().as_array().filter(|items| items.len() == 2);
            let Some(items) = items else {
                f.wrong("exclude_collisions", value, "two names of links, such as [\"a\", \"b\"]");
                continue;
            };
            let pair: Vec<usize> = items.iter().filter_map(|item| self.named_link(f, item)).collect();
            if let [a, b] = pair[..] {
                self.exclude_collisions.push([a, b]);
            }
        }
    }

    fn named_link(&self, f: &Fields<'_>, value: &Value<'_>) -> Option<usize> {
        let Some(name) = value.get_ref().as_str() else {
            f.wrong("exclude_collisions", value, "the name of a link");
            return None;
        };
        let found = self.link(name);
        if found.is_none() {
            f.unknown_name(
                "exclude_collisions",
                value,
                name,
                self.links.iter().map(|link| link.name.as_str()).collect(),
            );
        }
        found
    }
}

/// Reads the keys of a robot's file.
fn read_options(f: &mut Fields<'_>, from: &Inherited<'_, '_>, place: &Place<'_>) -> UrdfOptions {
    UrdfOptions {
        floating: from.floating,
        packages: read_packages(f, place.folder),
        missing_meshes: f.choice_or("missing_meshes", MISSING, MissingMeshes::Error),
        collision_meshes: f.choice_or("collision_meshes", COLLISION, CollisionMeshes::Exact),
        surface: from.surface.clone(),
        recolor: f.value("color").is_some() || f.value("material").is_some(),
        friction_given: f.value("friction").is_some() || f.value("material").is_some(),
        velocity_limits: false,
    }
}

const MISSING: Names<MissingMeshes> = &[("error", MissingMeshes::Error), ("skip", MissingMeshes::Skip)];
const COLLISION: Names<CollisionMeshes> = &[("exact", CollisionMeshes::Exact), ("hull", CollisionMeshes::Hull)];

/// Reads `packages = { NAME = "dir" }`, directories relative to the folder of the scene.
fn read_packages(f: &mut Fields<'_>, folder: &Path) -> BTreeMap<String, PathBuf> {
    let Some(table) = f.table("packages", "{ my_robot = \"../my_robot\" }") else { return BTreeMap::new() };
    let mut packages = BTreeMap::new();
    for (name, _, value) in table.entries() {
        let Some(text) = table.as_text(name, value) else { continue };
        let directory = folder.join(text);
        if !directory.is_dir() {
            table.wrong(name, value, format!("a folder; there is none at {}", directory.display()));
        }
        packages.insert(name.to_owned(), directory);
    }
    packages
}
