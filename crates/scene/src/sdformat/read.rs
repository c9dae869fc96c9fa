//! `<sdf>`: a model, or a world with its models, as a scene.

use std::collections::BTreeMap;
use std::path::Path;

use tumble_core::Mode;
use tumble_core::collide::{Pose, Vec3};

use super::error::SdformatError;
use super::frames::pose_of;
use super::lenient::as_xml;
use super::model::{self, SdfModel};
use super::value::{color, flag, note, note_others, number, numbers};
use crate::notes::NoteList;
use crate::parse::appearance::AppearanceSpec;
use crate::parse::articulated::ArticulatedSpec;
use crate::parse::body::BodySpec;
use crate::parse::bound::Bound;
use crate::parse::file::SceneFile;
use crate::parse::link::LinkShape;
use crate::parse::log::Log;
use crate::parse::problem::Invalid;
use crate::parse::view::{GroundSpec, LightKind, LightSpec};
use crate::urdf::link::Context;
use crate::urdf::{Content, UrdfOptions};
use crate::xml::{self, Element};

/// The format, for messages about a text that is no XML.
const EXPECTED: &str = "an SDF file: an XML document with one element <sdf>";
/// Largest number of models of a file.
const MAX_MODELS: usize = 10_000;
/// Gravity of a world that names none, m/s².
const GRAVITY: [f64; 3] = [0.0, 0.0, -9.8];
/// The body of which static planes are copies.
const FLOOR: &str = "[[body]]\nname = \"floor\"\nmode = \"static\"\nshape = { type = \"half_space\" }\n";

/// Reads a text. `path` is shown in messages, and meshes are relative to its folder.
pub(super) fn read(text: &str, path: &Path, options: &UrdfOptions) -> Result<SceneFile, SdformatError> {
    let file = path.display().to_string();
    let log = Log::new(text).named(&file);
    let strict = as_xml(text);
    let document = xml::parse(&log, &strict, EXPECTED);
    let scene = document.as_ref().and_then(|document| {
        let context = Context {
            folder: path.parent().unwrap_or(Path::new("")),
            file: &file,
            options,
            content: Content::Body,
            colors: BTreeMap::new(),
            notes: NoteList::default(),
        };
        read_root(&Element::new(&log, document.root_element()), context)
    });
    match scene {
        Some(scene) if log.count() == 0 => Ok(scene),
        _ => {
            drop(document);
            Err(SdformatError::Invalid(Box::new(Invalid {
                file,
                text: text.to_owned(),
                problems: log.into_problems(),
            })))
        }
    }
}

fn read_root(root: &Element<'_, '_>, mut context: Context<'_>) -> Option<SceneFile> {
    if root.tag() != "sdf" {
        root.problem("is the outermost element", "expected <sdf>");
        return None;
    }
    note_others(root, &["world", "model"], &mut context.notes);
    let mut reading = Reading { scene: SceneFile::parse("", context.file).ok()?, names: BTreeMap::new() };
    let mut worlds = root.children("world");
    let world = worlds.next();
    if let Some(second) = worlds.next() {
        second.problem("is a second world", "expected one");
    }
    if let Some(world) = &world {
        reading.world(world, &mut context);
    }
    let models = root.children("model").chain(world.into_iter().flat_map(|world| world.children("model")));
    for (k, element) in models.enumerate() {
        if k == MAX_MODELS || root.log.is_full() {
            element.problem("is one too many", format!("expected at most {MAX_MODELS} models"));
            break;
        }
        if let Some(model) = model::read(element, &mut context) {
            reading.add(&element, model);
        }
    }
    if reading.scene.articulated.is_empty() && reading.scene.bodies.is_empty() && root.log.count() == 0 {
        root.problem("has no <model>", "expected a model, or a world with one");
    }
    reading.scene.notes = context.notes.take();
    (root.log.count() == 0).then_some(reading.scene)
}

struct Reading {
    scene: SceneFile,
    /// Models by name, with their lines.
    names: BTreeMap<String, usize>,
}

impl Reading {
    /// Reads gravity, time step and lights of a world.
    fn world(&mut self, world: &Element<'_, '_>, context: &mut Context<'_>) {
        note_others(world, &["gravity", "physics", "model", "light", "include"], &mut context.notes);
        for include in world.children("include") {
            include.problem("is not read", "expected the model itself instead of <include>");
        }
        let gravity = world.child("gravity").map_or(Some(GRAVITY), |gravity| numbers(&gravity, Bound::ANY));
        self.scene.world.gravity_m_per_s2 = gravity.unwrap_or(GRAVITY);
        self.scene.world.dt_s = 0.001;
        if let Some(physics) = world.child("physics") {
            note_others(&physics, &["max_step_size", "real_time_factor", "real_time_update_rate"], &mut context.notes);
            let bound = Bound::new(1e-6, 1.0, "a time from 1e-6 to 1 s");
            self.scene.world.dt_s = number(&physics, "max_step_size", bound, 0.001);
        }
        if world.child("light").is_some() {
            self.scene.lights.clear();
        }
        for light in world.children("light") {
            self.light(&light, context);
        }
    }

    fn light(&mut self, light: &Element<'_, '_>, context: &mut Context<'_>) {
        note_others(light, &["pose", "cast_shadows", "diffuse", "direction", "intensity"], &mut context.notes);
        let pose = light.child("pose").map_or(Pose::identity(), |pose| {
            if pose.text("relative_to").is_some_and(|to| !to.is_empty() && to != "world") {
                pose.wrong("relative_to", "no frame: the pose of a light is in the world");
            }
            pose_of(&pose)
        });
        let kind = match light.text("type") {
            Some("directional") => {
                let given = light.child("direction").and_then(|direction| numbers::<3>(&direction, Bound::ANY));
                let direction = pose.rotation * Vec3::from(given.unwrap_or([0.0, 0.0, -1.0]));
                LightKind::Directional { direction: direction.try_normalize(1e-9).unwrap_or(-Vec3::z()).into() }
            }
            Some("point") => LightKind::Point { position_m: pose.translation.vector.into() },
            _ => {
                return note(
                    light,
                    "lights of other types than directional and point are left out",
                    &mut context.notes,
                );
            }
        };
        let color = light.child("diffuse").and_then(|diffuse| color(&diffuse)).unwrap_or([1.0; 3]);
        let casts_shadow = flag(light, "cast_shadows", false);
        let intensity = number(light, "intensity", Bound::NOT_NEGATIVE, 1.0);
        self.scene.lights.push(LightSpec { kind, color, intensity, casts_shadow });
    }

    /// Adds the trees and planes of a model.
    fn add(&mut self, element: &Element<'_, '_>, model: SdfModel) {
        let line = element.log.line(element.span().start);
        if let Some(first) = self.names.insert(model.name.clone(), line) {
            let message = format!("is a second model of that name; the first is at line {first}");
            return element.problem(message, "expected a unique name");
        }
        let several = model.trees.len() > 1;
        for links in model.trees {
            // a static link whose only shape is a plane is that plane
            let bare = links.iter().all(|link| link.shapes.is_empty());
            if bare && !model.planes.is_empty() && links.iter().all(|link| link.joint.kind == tumble_core::Joint::Fixed)
            {
                continue;
            }
            let name = if several { format!("{}/{}", model.name, links[0].name) } else { model.name.clone() };
            let mut spec = ArticulatedSpec::of(name, links);
            spec.base = model.pose;
            spec.self_collision = model.self_collide;
            self.scene.articulated.push(spec);
        }
        for (k, (link, shape)) in model.planes.into_iter().enumerate() {
            self.plane(format!("{}/{link}/plane{k}", model.name), &model.pose, shape);
        }
    }

    fn plane(&mut self, name: String, model: &Pose, shape: LinkShape) {
        let Ok(floor) = SceneFile::parse(FLOOR, "") else { return };
        let pose = model * shape.pose;
        let level = (pose.rotation * Vec3::z()).z > 1.0 - 1e-12;
        if level && self.scene.ground.is_none() {
            let appearance: AppearanceSpec = GroundSpec::default_appearance();
            self.scene.ground = Some(GroundSpec { height_m: pose.translation.z, appearance });
        }
        self.scene.bodies.push(BodySpec {
            name,
            mode: Mode::Static,
            position_m: pose.translation.vector.into(),
            orientation_xyzw: pose.rotation.coords.into(),
            contact: shape.surface.contact,
            visible: !level,
            shape_name: shape.name,
            ..floor.bodies[0].clone()
        });
    }
}
