//! A scene file: from text to a checked description.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

use toml::de::{DeTable, DeValue};

use crate::error::SceneError;
use crate::mjcf::ActuatorSpec;
use crate::parse::articulated::ArticulatedSpec;
use crate::parse::behavior::BehaviorSpecs;
use crate::parse::body::{BodySpec, Library};
use crate::parse::event::{EventSpec, ObjectKind, ObjectNames, TemplateSpec};
use crate::parse::fields::Fields;
use crate::parse::grid::{self, MAX_BODIES};
use crate::parse::joint::JointSpec;
use crate::parse::log::Log;
use crate::parse::loop_joint::{LoopJointSpec, PartSpec, Parts};
use crate::parse::material::MaterialSpec;
use crate::parse::mesh::MeshSpec;
use crate::parse::mimic::{JointMimicSpec, Joints};
use crate::parse::pair::PairSpec;
use crate::parse::place::Place;
use crate::parse::problem::Invalid;
use crate::parse::sensor::SensorSpec;
use crate::parse::view::{CameraSpec, CavePlace, GroundSpec, LightSpec, SkySpec};
use crate::parse::world::WorldSettings;
use crate::save::SavedWorld;
use tumble_core::Joint;
use tumble_core::articulated::Drive;
use tumble_core::collide::ContactMode;

/// Largest scene file in bytes: 16 MiB.
pub const MAX_BYTES: u64 = 16 << 20;
/// In a longer text only the first syntax error is reported, since the parser keeps every one it
/// finds.
const RECOVERED_BYTES: usize = 256 << 10;
/// A text with more syntax errors is probably not TOML. Only the first is reported.
const MAX_SYNTAX_ERRORS: usize = 5;
/// Largest number of articulated bodies of a scene.
const MAX_ARTICULATED: usize = 10_000;
/// Largest number of loop joints of a scene.
const MAX_LOOP_JOINTS: usize = 100_000;
const MAX_MIMICS: usize = 100_000;
const MAX_SENSORS: usize = 100_000;
/// Largest number of tables `[[pair]]` of a scene.
const MAX_PAIRS: usize = 1_000;
/// Largest number of tables `[[template]]` of a scene.
const MAX_TEMPLATES: usize = 1_000;
/// Largest number of tables `[[event]]` of a scene.
const MAX_EVENTS: usize = 10_000;
/// Largest number of lights of a scene.
const MAX_LIGHTS: usize = 64;

/// A scene as its file describes it: checked, references resolved, grids expanded to bodies.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneFile {
    /// The name of the file as errors show it.
    pub file: String,
    /// One line that says what the scene shows; may be empty.
    pub description: String,
    /// `[world]`.
    pub world: WorldSettings,
    /// `[materials.NAME]`, by name.
    pub materials: Vec<MaterialSpec>,
    /// `[meshes.NAME]`, by name.
    pub meshes: Vec<MeshSpec>,
    /// `[[body]]` in the order of the file, then the copies of each `[[grid]]`.
    pub bodies: Vec<BodySpec>,
    /// `[[articulated]]` in the order of the file.
    pub articulated: Vec<ArticulatedSpec>,
    /// `[[loop_joint]]` in the order of the file.
    pub loop_joints: Vec<LoopJointSpec>,
    /// `[[mimic]]` in the order of the file.
    pub mimics: Vec<JointMimicSpec>,
    /// `[[template]]` in the order of the file.
    pub templates: Vec<TemplateSpec>,
    /// `[[event]]` in the order of the file.
    pub events: Vec<EventSpec>,
    /// `[[sensor]]` in the order of the file.
    pub sensors: Vec<SensorSpec>,
    /// Actuators of a model of MuJoCo; scene files have none.
    pub actuators: Vec<ActuatorSpec>,
    /// `[[pair]]` in the order of the file.
    pub pairs: Vec<PairSpec>,
    /// Soft bodies, particles, flocks and fields.
    pub behaviors: BehaviorSpecs,
    /// `[camera]`; `None` leaves the view to the renderer.
    pub camera: Option<CameraSpec>,
    /// `[cave]`; `None` derives the pose of a cave from the camera.
    pub cave: Option<CavePlace>,
    /// `[[light]]`; one sun if the scene has none.
    pub lights: Vec<LightSpec>,
    /// `[sky]`.
    pub sky: SkySpec,
    /// `[ground]`; `None` draws no floor.
    pub ground: Option<GroundSpec>,
    /// Notes about the file.
    pub notes: Vec<String>,
    /// The exact state that belongs to the text of a scene that was saved.
    pub saved: Option<SavedWorld>,
}

impl SceneFile {
    /// Reads a scene from its text. `file_name` is shown in errors; paths of meshes are relative to
    /// its folder.
    ///
    /// # Errors
    /// [`SceneError::TooLarge`] or [`SceneError::Invalid`].
    pub fn parse(text: &str, file_name: &str) -> Result<SceneFile, SceneError> {
        SceneFile::parse_with(text, file_name, &[])
    }

    /// As [`SceneFile::parse`], with texts that replace files of the scene's folder: names and
    /// contents.
    pub(crate) fn parse_with(text: &str, file_name: &str, files: &[(&str, &str)]) -> Result<SceneFile, SceneError> {
        if text.len() as u64 > MAX_BYTES {
            return Err(SceneError::TooLarge { file: file_name.into(), limit: MAX_BYTES });
        }
        let log = Log::new(text).in_folder(Path::new(file_name).parent().unwrap_or(Path::new("")));
        // After a syntax error the tree is guesswork, so only syntax errors are reported.
        let scene = parse_toml(&log, text).map(|root| SceneFile::read(&log, &root, file_name, files));
        match scene {
            Some(mut scene) if log.count() == 0 => {
                scene.saved = scene.saved.take().map(|saved| saved.belonging_to(&scene));
                Ok(scene)
            }
            _ => Err(invalid(log, text, file_name)),
        }
    }

    fn read(log: &Log<'_>, root: &DeTable<'_>, file_name: &str, files: &[(&str, &str)]) -> SceneFile {
        let folder = Path::new(file_name).parent().unwrap_or(Path::new(""));
        let place = Place { folder, files };
        let mut f = Fields::of_table(log, root, 0..0, "the scene");
        let description = f.optional_text("description").map_or("", |(text, _)| text).to_owned();
        let saved = SavedWorld::read(&mut f, folder);
        let world = read_table(&mut f, "world", WorldSettings::read).unwrap_or_default();
        let materials = read_named(&mut f, "materials", |name, table| Some(MaterialSpec::read(name, table)));
        let meshes = read_named(&mut f, "meshes", |name, table| MeshSpec::read(name, table, &place));
        let materials: Vec<MaterialSpec> = materials.into_iter().filter_map(|(_, material)| material).collect();
        let library = library(&meshes, &materials, world.contacts);
        let mut names = BTreeMap::new();
        let bodies = read_bodies(&mut f, &library, &mut names);
        let articulated = read_articulated(&mut f, &library, &place, &mut names);
        let objects = Objects { bodies: &bodies, articulated: &articulated };
        let loop_joints = read_loop_joints(&mut f, &objects, &mut names);
        let joints = Joints { articulated: &articulated, loop_joints: &loop_joints };
        let mimics = read_mimics(&mut f, &joints, &mut names);
        let sensors = read_sensors(&mut f, &library, &objects, &loop_joints, &mut names);
        let pairs = read_pairs(&mut f, &library, &objects);
        let behaviors = BehaviorSpecs::read(&mut f, &library, &objects, |table, name| {
            note_unique(table.log, "object", &mut names, name, &table.span);
        });
        let templates = read_templates(&mut f, &library, bodies.len(), &mut names);
        let camera = read_table(&mut f, "camera", CameraSpec::read);
        let cave = read_table(&mut f, "cave", CavePlace::read);
        let mut lights: Vec<LightSpec> =
            f.tables("light", MAX_LIGHTS).into_iter().filter_map(LightSpec::read).collect();
        if lights.is_empty() {
            lights.push(LightSpec::sun());
        }
        let mut named = object_names(&bodies, &articulated, &loop_joints, &mimics, &templates);
        let of_behaviors = behaviors.names().into_iter();
        let others = sensors.iter().map(|sensor: &SensorSpec| sensor.name.clone()).chain(of_behaviors);
        others.for_each(|name| named.add(&name, ObjectKind::Other));
        let events = read_events(&mut f, named, lights.len(), &mut names);
        let sky = read_table(&mut f, "sky", SkySpec::read).unwrap_or_default();
        let ground = read_table(&mut f, "ground", GroundSpec::read);
        f.finish();
        SceneFile {
            file: file_name.to_owned(),
            description,
            world,
            materials,
            meshes: meshes.into_iter().filter_map(|(_, mesh)| mesh).collect(),
            bodies,
            articulated,
            loop_joints,
            mimics,
            templates,
            events,
            sensors,
            actuators: Vec::new(),
            pairs,
            behaviors,
            camera,
            cave,
            lights,
            sky,
            ground,
            notes: Vec::new(),
            saved,
        }
    }
}

/// Parses a TOML text. Returns `None`, with the problems recorded, if it has syntax errors.
pub(crate) fn parse_toml<'a>(log: &Log<'_>, text: &'a str) -> Option<DeTable<'a>> {
    let (root, errors) = match text.len() > RECOVERED_BYTES {
        true => DeTable::parse(text).map_or_else(|error| (None, vec![error]), |root| (Some(root), Vec::new())),
        false => {
            let (root, errors) = DeTable::parse_recoverable(text);
            (Some(root), errors)
        }
    };
    let no_toml = errors.len() > MAX_SYNTAX_ERRORS;
    for error in errors.iter().take(if no_toml { 1 } else { MAX_SYNTAX_ERRORS }) {
        let (message, mut expected) = message_and_hint(error.message());
        if no_toml {
            expected += &format!("; {} more syntax errors follow, so this may not be TOML", errors.len() - 1);
        }
        log.report(error.span().unwrap_or(0..0), message, expected);
    }
    root.filter(|_| errors.is_empty()).map(toml::Spanned::into_inner)
}

fn invalid(log: Log<'_>, text: &str, file_name: &str) -> SceneError {
    let problems = log.into_problems();
    SceneError::Invalid(Box::new(Invalid { file: file_name.to_owned(), text: text.to_owned(), problems }))
}

/// Splits the parser's message into the fault and the expected text.
fn message_and_hint(message: &str) -> (String, String) {
    let line = message.split_whitespace().collect::<Vec<_>>().join(" ");
    match line.split_once(", expected ") {
        Some((wrong, "nothing")) => (format!("TOML: {wrong}"), "expected nothing here".into()),
        Some((wrong, expected)) => (format!("TOML: {wrong}"), format!("expected {expected}")),
        None if line == "duplicate key" => ("TOML: duplicate key".into(), "expected each key once in its table".into()),
        None => (format!("TOML: {line}"), "expected a TOML document".into()),
    }
}

/// Reads the table `[key]`, if present.
pub(crate) fn read_table<'a, T>(
    f: &mut Fields<'a>,
    key: &'static str,
    read: impl FnOnce(Fields<'a>) -> T,
) -> Option<T> {
    let value = f.value(key)?;
    Fields::of(f.log, value, format!("[{key}]"), &format!("[{key}]")).map(read)
}

/// Reads the tables `[key.NAME]` by name. `None` marks an invalid one.
fn read_named<'a, T>(
    f: &mut Fields<'a>,
    key: &'static str,
    read: impl Fn(&'a str, Fields<'a>) -> Option<T>,
) -> Vec<(&'a str, Option<T>)> {
    let Some(value) = f.value(key) else {
        return Vec::new();
    };
    let example = format!("[{key}.NAME]");
    let Some(tables) = Fields::of(f.log, value, format!("[{key}]"), &example) else {
        return Vec::new();
    };
    let one = |(name, _, value)| {
        let table = Fields::of(f.log, value, format!("[{key}.{name}]"), &example);
        (name, table.and_then(|table| read(name, table)))
    };
    tables.entries().map(one).collect()
}

fn library<'a>(
    meshes: &[(&'a str, Option<MeshSpec>)],
    materials: &'a [MaterialSpec],
    contacts: ContactMode,
) -> Library<'a> {
    let mut right = 0..;
    let meshes = meshes.iter().map(|(name, mesh)| (*name, mesh.as_ref().and_then(|_| right.next()))).collect();
    let material_names = materials.iter().enumerate().map(|(index, m)| (m.name.as_str(), index)).collect();
    Library { meshes, material_names, materials, contacts }
}

/// Reads all bodies, including those of grids, and checks that their names are unique.
fn read_bodies(f: &mut Fields<'_>, library: &Library<'_>, names: &mut Taken) -> Vec<BodySpec> {
    let mut bodies = Vec::new();
    for mut table in f.tables("body", MAX_BODIES) {
        let place = name_span(&mut table);
        if let Some(body) = BodySpec::read(&mut table, library) {
            note_name(&table, names, &body.name, &place);
            bodies.push(body);
        }
        table.finish();
    }
    for mut table in f.tables("grid", MAX_BODIES) {
        let place = name_span(&mut table);
        let (log, what, first) = (table.log, table.what.clone(), bodies.len());
        grid::read(table, library, MAX_BODIES.saturating_sub(first), &mut bodies);
        for body in &bodies[first..] {
            if !note_unique(log, &what, names, &body.name, &place) {
                break;
            }
        }
    }
    bodies
}

/// Reads all articulated bodies and checks that their names are unique among objects.
fn read_articulated(
    f: &mut Fields<'_>,
    library: &Library<'_>,
    files: &Place<'_>,
    names: &mut Taken,
) -> Vec<ArticulatedSpec> {
    let one = |mut table: Fields<'_>| {
        let (log, place) = (table.log, name_span(&mut table));
        let spec = ArticulatedSpec::read(table, library, files)?;
        if !spec.name.is_empty() {
            note_unique(log, "object", names, &spec.name, &place);
        }
        Some(spec)
    };
    f.tables("articulated", MAX_ARTICULATED).into_iter().filter_map(one).collect()
}

fn read_loop_joints(f: &mut Fields<'_>, objects: &Objects<'_>, names: &mut Taken) -> Vec<LoopJointSpec> {
    let one = |mut table: Fields<'_>| {
        let (log, place) = (table.log, name_span(&mut table));
        let spec = LoopJointSpec::read(table, objects)?;
        if !spec.name.is_empty() {
            note_unique(log, "object", names, &spec.name, &place);
        }
        Some(spec)
    };
    f.tables("loop_joint", MAX_LOOP_JOINTS).into_iter().filter_map(one).collect()
}

/// Reads all templates; `bodies` is the number of bodies of the scene without them.
fn read_templates(f: &mut Fields<'_>, library: &Library<'_>, bodies: usize, names: &mut Taken) -> Vec<TemplateSpec> {
    let (mut templates, mut room) = (Vec::new(), MAX_BODIES.saturating_sub(bodies));
    for mut table in f.tables("template", MAX_TEMPLATES) {
        let (log, place) = (table.log, name_span(&mut table));
        let Some(template) = TemplateSpec::read(table, library, &mut room) else { continue };
        let unique = note_unique(log, "template", names, &template.body.name, &place);
        if unique && !template.body.name.is_empty() {
            template.names().take_while(|name| note_unique(log, "body", names, name, &place)).for_each(drop);
        }
        templates.push(template);
    }
    templates
}

/// Returns what events can name.
fn object_names(
    bodies: &[BodySpec],
    articulated: &[ArticulatedSpec],
    loop_joints: &[LoopJointSpec],
    mimics: &[JointMimicSpec],
    templates: &[TemplateSpec],
) -> ObjectNames {
    let mut names = ObjectNames::default();
    bodies.iter().for_each(|body| names.add(&body.name, ObjectKind::Body { mode: body.mode, sensor: body.sensor }));
    for spec in articulated {
        let sensor = spec.links.iter().flat_map(|link| &link.shapes).any(|shape| shape.sensor && shape.collidable);
        names.add(&spec.name, ObjectKind::Articulated { sensor });
        for link in &spec.links {
            let dofs = if link.joint.kind.dof() <= 3 { link.joint.dofs() } else { Vec::new() };
            let driven = [0, 1, 2].map(|k| dofs.get(k).is_some_and(|dof| has_target(&dof.drive)));
            let turns = [matches!(link.joint.kind, Joint::Revolute { .. } | Joint::Spherical); 3];
            let kind = ObjectKind::Link { count: dofs.len(), driven, turns };
            names.add(&format!("{}/{}", spec.name, link.name), kind);
        }
    }
    for joint in loop_joints {
        let driven = [0, 1, 2].map(|k| joint.dofs.get(k).is_some_and(|dof| has_target(&dof.settings.drive)));
        let turns = [0, 1, 2].map(|k| joint.kind.turns_at(k));
        names.add(&joint.name, ObjectKind::Joint { count: joint.dofs.len(), driven, turns });
    }
    mimics.iter().for_each(|mimic| names.add(&mimic.name, ObjectKind::Mimic));
    templates.iter().for_each(|template| names.add_template(&template.body.name, template.count));
    names
}

/// Returns whether events can change the target of a drive.
fn has_target(drive: &Drive) -> bool {
    matches!(drive, Drive::Position { .. } | Drive::Velocity { .. })
}

fn read_events(f: &mut Fields<'_>, mut named: ObjectNames, lights: usize, names: &mut Taken) -> Vec<EventSpec> {
    let mut events = Vec::new();
    for mut table in f.tables("event", MAX_EVENTS) {
        let (log, place) = (table.log, name_span(&mut table));
        let Some(event) = EventSpec::read(table, &named, lights) else { continue };
        note_unique(log, "object", names, &event.name, &place);
        named.add(&event.name, ObjectKind::Event);
        events.push(event);
    }
    events
}

fn read_mimics(f: &mut Fields<'_>, joints: &Joints<'_>, names: &mut Taken) -> Vec<JointMimicSpec> {
    let one = |mut table: Fields<'_>| {
        let (log, place) = (table.log, name_span(&mut table));
        let spec = JointMimicSpec::read(table, joints)?;
        if !spec.name.is_empty() {
            note_unique(log, "object", names, &spec.name, &place);
        }
        Some(spec)
    };
    f.tables("mimic", MAX_MIMICS).into_iter().filter_map(one).collect()
}

fn read_sensors(
    f: &mut Fields<'_>,
    library: &Library<'_>,
    objects: &Objects<'_>,
    joints: &[LoopJointSpec],
    names: &mut Taken,
) -> Vec<SensorSpec> {
    let one = |mut table: Fields<'_>| {
        let (log, place) = (table.log, name_span(&mut table));
        let spec = SensorSpec::read(table, library, objects, joints)?;
        if !spec.name.is_empty() {
            note_unique(log, "object", names, &spec.name, &place);
        }
        Some(spec)
    };
    f.tables("sensor", MAX_SENSORS).into_iter().filter_map(one).collect()
}

fn read_pairs(f: &mut Fields<'_>, library: &Library<'_>, objects: &Objects<'_>) -> Vec<PairSpec> {
    let mut lines = BTreeMap::new();
    let tables = f.tables("pair", MAX_PAIRS);
    tables.into_iter().filter_map(|table| PairSpec::read(table, library, objects, &mut lines)).collect()
}

/// The objects that loop joints and pairs can name.
struct Objects<'a> {
    bodies: &'a [BodySpec],
    articulated: &'a [ArticulatedSpec],
}

impl Parts for Objects<'_> {
    fn part(&self, name: &str) -> Option<PartSpec> {
        if let Some(body) = self.bodies.iter().position(|body| body.name == name) {
            return Some(PartSpec::Body(body));
        }
        self.articulated.iter().enumerate().find_map(|(k, spec)| {
            let link = name.strip_prefix(spec.name.as_str())?.strip_prefix('/')?;
            spec.link(link).map(|link| PartSpec::Link(k, link))
        })
    }

    fn moving_joint(&self, part: &PartSpec) -> Option<&JointSpec> {
        let PartSpec::Link(spec, mut link) = *part else { return None };
        let links = &self.articulated[spec].links;
        while links[link].joint.kind == Joint::Fixed {
            link = links[link].parent?;
        }
        Some(&links[link].joint)
    }

    fn own_joint(&self, part: &PartSpec) -> Option<&JointSpec> {
        let PartSpec::Link(spec, link) = *part else { return None };
        Some(&self.articulated[spec].links[link].joint)
    }

    fn floats(&self, articulated: usize) -> bool {
        self.articulated[articulated].links.first().is_some_and(|root| root.joint.kind == Joint::Floating)
    }

    fn articulated(&self, name: &str) -> Option<usize> {
        self.articulated.iter().position(|spec| spec.name == name)
    }

    fn names(&self) -> Vec<String> {
        let links = |spec: &ArticulatedSpec| {
            spec.links.iter().map(|link| format!("{}/{}", spec.name, link.name)).collect::<Vec<_>>()
        };
        self.bodies.iter().map(|body| body.name.clone()).chain(self.articulated.iter().flat_map(links)).collect()
    }
}

/// Names of objects, with their places.
type Taken = BTreeMap<String, Range<usize>>;

fn name_span(table: &mut Fields<'_>) -> Range<usize> {
    table.value("name").map_or(table.span.clone(), |value| value.span())
}

fn note_name(table: &Fields<'_>, names: &mut Taken, name: &str, place: &Range<usize>) {
    if !name.is_empty() {
        note_unique(table.log, "body", names, name, place);
    }
}

/// Adds `name`. Returns `false`, with the problem recorded, if it is taken.
fn note_unique(log: &Log<'_>, what: &str, names: &mut Taken, name: &str, place: &Range<usize>) -> bool {
    match names.insert(name.to_owned(), place.clone()) {
        None => true,
        Some(earlier) => {
            let line = log.line(earlier.start);
            let kind = what.split(' ').next().unwrap_or("body");
            let message = format!("`name`: there is a second {kind} \"{name}\"; the first is at line {line}");
            log.report(place.clone(), message, "expected a unique name");
            names.insert(name.to_owned(), earlier);
            false
        }
    }
}

/// Returns the `description` of a scene's text without reading the rest; empty if there is none.
pub(crate) fn description(text: &str) -> String {
    let (root, _) = DeTable::parse_recoverable(text);
    match root.get_ref().get("description").map(|value| value.get_ref()) {
        Some(DeValue::String(text)) => text.to_string(),
        _ => String::new(),
    }
}
