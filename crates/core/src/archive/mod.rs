//! A whole world as bytes: its objects, its settings and its [`WorldState`].
//!
//! | part | bytes |
//! |---|---|
//! | `tumbleAL`; the last is the number of the format | 8 |
//! | XXH3 of the rest, little-endian | 8 |
//! | settings, stepper, solver, shapes, visual meshes, objects, pairs, state, contacts, report in postcard | any |
//!
//! The same world gives the same bytes. Objects of other crates write themselves ([`Object::record`]), or are written
//! by name alone; the caller makes both. Shapes that objects share are written once and are shared again; meshes
//! that are only drawn are read for it, so that no file is needed later. The order of objects is
//! kept, ids are not: they are new.

mod bodies;
mod constants;
mod mimic;
mod other;
mod records;
mod script;
mod sensors;

use crate::articulated::Drive;
use crate::report::StepReport;
use crate::settings::Settings;
use crate::solver::{self, RowSolver};
use crate::step::{STEPPERS, Stepper, stepper_by_name};
use crate::world::view::{Mode, ObjectId};
use crate::world::{ContactPoint, Event, EventKind, World, WorldState};
use crate::{
    ArticulatedBody, EventError, LoopJoint, Mimic, Object, RigidBody, ScriptedEvent, Sensor, Template,
    UnreachableJoint, WorstSolve,
};
use bodies::{ArticulatedRecord, RigidRecord};
use mimic::MimicRecord;
use other::OtherRecord;
pub use other::{MakeObject, ObjectRecord, ReadObject};
pub use records::ObjectIndices;
use records::{
    ContactRecord, EventRecord, LoadedTables, LoopJointRecord, MeshRecord, PairRecord, ReportRecord, Tables, meshes,
};
use script::{EventScript, TemplateRecord};
use sensors::SensorRecord;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use tumble_collide::Shape;
use xxhash_rust::xxh3::xxh3_64;

/// First bytes of an archive of a world. The last is the number of the format, which rises with
/// every change of the content.
const HEAD: &[u8; 8] = b"tumbleAL";

/// Why an archive cannot be written or read.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ArchiveError {
    /// The bytes are of another kind.
    #[error("these bytes do not begin with '{0}': they are of another kind, or were not written by tumble")]
    NotOne(String),
    /// The format is that of an older or newer version.
    #[error("these bytes have format '{theirs}'; this version of tumble reads '{ours}'")]
    Format {
        /// Format of the bytes.
        theirs: String,
        /// Format of this version.
        ours: String,
    },
    /// The bytes were changed or cut off.
    #[error("these bytes are damaged: {0}")]
    Damaged(String),
    /// A value cannot be written, such as a path that is not UTF-8.
    #[error("the world cannot be written: {0}")]
    Unwritable(String),
    /// An object of a user-defined type, or with an intersection test or a callback of one, that the caller does not write, or
    /// does not make.
    #[error(
        "'{0}' is, or has a test or a callback of, a user-defined type, and the caller gave nothing to write or to make it"
    )]
    Foreign(String),
    /// A stepper of a user-defined type, or of another version of tumble: its name.
    #[error(
        "the stepper '{0}' cannot be archived; expected {expected}: set one of these before the world is written, \
         and '{0}' again on the world that is read",
        expected = any_of(&STEPPERS)
    )]
    Stepper(String),
    /// A solver of a user-defined type, or of another version of tumble: its name.
    #[error(
        "the solver '{0}' cannot be archived; expected {expected}: set one of these before the world is written, \
         and '{0}' again on the world that is read",
        expected = any_of(&solver::NAMES)
    )]
    Solver(String),
}

/// Returns the names in quotes, the last one after "or".
fn any_of(names: &[&str]) -> String {
    let quoted: Vec<String> = names.iter().map(|name| format!("'{name}'")).collect();
    quoted.split_last().map_or_else(String::new, |(last, rest)| format!("{} or {last}", rest.join(", ")))
}

/// Content of an archive.
#[derive(Serialize, Deserialize)]
struct Archive {
    settings: Settings,
    stepper: String,
    solver: String,
    shapes: Vec<Shape>,
    meshes: Vec<MeshRecord>,
    objects: Vec<NamedRecord>,
    pairs: Vec<PairRecord>,
    state: WorldState,
    contacts: Vec<ContactRecord>,
    events: Vec<EventRecord>,
    report: ReportRecord,
    /// The drives with which objects were added, of those that the program has changed.
    first_drives: Vec<(u32, Vec<Drive>)>,
}

/// One object and its name in the world.
#[derive(Serialize, Deserialize)]
struct NamedRecord {
    name: String,
    record: Record,
}

/// One object.
#[derive(Serialize, Deserialize)]
enum Record {
    Rigid(Box<RigidRecord>),
    Articulated(Box<ArticulatedRecord>),
    LoopJoint(Box<LoopJointRecord>),
    Sensor(Box<SensorRecord>),
    Foreign,
    Event(Box<EventScript>),
    Template(TemplateRecord),
    Other(Box<OtherRecord>),
    Mimic(MimicRecord),
}

impl World {
    /// Returns the whole world as bytes: objects with their shapes, settings, stepper, solver and
    /// state. `foreign` are the objects of user-defined types that the caller of
    /// [`from_archive`](World::from_archive) makes itself, and the rigid bodies with an intersection test of their own,
    /// which it sets again.
    ///
    /// # Errors
    /// [`ArchiveError::Foreign`] for an object of a user-defined type that is not among `foreign`;
    /// [`ArchiveError::Stepper`] and [`ArchiveError::Solver`] for a stepper and a solver of a
    /// user-defined type, since [`from_archive`](World::from_archive) could not make them;
    /// [`ArchiveError::Unwritable`] for a value that cannot be written.
    pub fn archive(&self, foreign: &[ObjectId]) -> Result<Vec<u8>, ArchiveError> {
        let (mut tables, indices) = (Tables::default(), ObjectIndices::of(self.ids()));
        // only what can be read again is written
        let (stepper, solver) = (stepper(self.stepper_name())?.name(), solver(self.solver_name())?.name());
        let objects = self
            .ids()
            .iter()
            .filter_map(|&id| Some((self.name(id)?, self.object(id)?)))
            .map(|(name, object)| NamedRecord { name: name.into(), record: record(object, &mut tables, &indices) })
            .collect::<Vec<NamedRecord>>();
        let unknown = self.ids().iter().zip(&objects).find_map(|(id, object)| match object.record {
            Record::Foreign if !foreign.contains(id) => Some(object.name.clone()),
            _ if !foreign.contains(id) && has_function(self.object(*id)?) => Some(object.name.clone()),
            _ => None,
        });
        if let Some(name) = unknown {
            return Err(ArchiveError::Foreign(name));
        }
        let mut pairs: Vec<PairRecord> =
            self.pair_materials().filter_map(|(sides, material)| PairRecord::of(sides, material, &indices)).collect();
        pairs.sort_unstable_by_key(|pair| pair.sides);
        let archive = Archive {
            settings: *self.settings(),
            stepper: stepper.into(),
            solver: solver.into(),
            shapes: tables.shapes.list,
            meshes: tables.meshes.list,
            objects,
            pairs,
            state: self.state_value().clone(),
            contacts: self.contacts().iter().map(|c| ContactRecord::of(c, &indices)).collect(),
            events: self.events().iter().map(|event| EventRecord::of(event, &indices)).collect(),
            report: ReportRecord::of(self.report(), &indices),
            first_drives: self.first_drives(),
        };
        seal(HEAD, &archive)
    }

    /// Returns the world of an archive, which continues with the same bits. `foreign` makes an
    /// object of another crate from its name and its record. It is called once more, when all ids are known, for one that names an
    /// object after it.
    ///
    /// # Errors
    /// [`ArchiveError`] for bytes that are no archive, of another format or damaged, for an object
    /// that `foreign` does not make, and for a stepper or solver without a name in [`STEPPERS`] or
    /// [`solver::NAMES`].
    pub fn from_archive(bytes: &[u8], foreign: &mut MakeObject) -> Result<World, ArchiveError> {
        let archive: Archive = open(HEAD, bytes)?;
        archive.shapes.iter().try_for_each(Shape::validate).map_err(damaged)?;
        let mut world = World::new(archive.settings).map_err(damaged)?;
        world.set_stepper(stepper(&archive.stepper)?);
        world.set_solver(solver(&archive.solver)?);
        let tables = LoadedTables { shapes: archive.shapes, meshes: meshes(archive.meshes) };
        let mut ids = Vec::with_capacity(archive.objects.len());
        let mut ahead: Vec<(usize, String, ObjectRecord)> = Vec::new();
        for NamedRecord { name, record } in archive.objects {
            let object: Box<dyn Object> = match record {
                Record::Rigid(rigid) => Box::new(rigid.body(&tables)?),
                Record::Articulated(articulated) => Box::new(articulated.body(&tables)?),
                Record::LoopJoint(loop_joint) => Box::new(loop_joint.loop_joint(&ids)?),
                Record::Mimic(mimic) => Box::new(mimic.mimic(&ids)?),
                Record::Event(event) => Box::new(event.event(&ids)),
                Record::Template(template) => Box::new(template.template(&ids)),
                Record::Sensor(sensor) => Box::new(sensor.sensor(&tables, &ids)?),
                Record::Foreign => other::made(&name, None, &ids, foreign)?.0,
                Record::Other(other) => {
                    let record = other.record(&tables)?;
                    let (object, names_later) = other::made(&name, Some(&record), &ids, foreign)?;
                    if names_later {
                        ahead.push((ids.len(), name.clone(), record));
                    }
                    object
                }
            };
            ids.push(world.add_named(name, object, Mode::Dynamic).map_err(damaged)?);
        }
        for (place, name, record) in ahead {
            world.replace_object(place, other::made(&name, Some(&record), &ids, foreign)?.0);
        }
        archive.pairs.into_iter().try_for_each(|pair| pair.put(&mut world, &ids)).map_err(damaged)?;
        world.restore_state(&archive.state).map_err(damaged)?;
        for event in ids.iter().filter_map(|id| world.get::<ScriptedEvent>(*id)) {
            match event.clone().prepare(&world) {
                Ok(()) | Err(EventError::Gone(_)) => {} // it may name a removed object
                Err(why) => return Err(damaged(why)),
            }
        }
        for (place, drives) in archive.first_drives {
            let id = ids.get(place as usize).copied().unwrap_or_default();
            if !world.set_first_drives(id, drives) {
                return Err(damaged(format!("object {place} has another number of drives")));
            }
        }
        let contacts = archive.contacts.into_iter().map(|c| c.contact(&ids)).collect();
        let events = archive.events.into_iter().map(|event| event.event(&ids)).collect();
        world.publish(contacts, events, archive.report.report(&ids));
        Ok(world)
    }
}

/// A value as bytes: eight bytes that name the kind and, as the last, the number of the format;
/// XXH3 of the rest; the value in postcard.
///
/// # Errors
/// [`ArchiveError::Unwritable`].
pub fn seal(head: &[u8; 8], value: &impl Serialize) -> Result<Vec<u8>, ArchiveError> {
    let body = postcard::to_stdvec(value).map_err(|e| ArchiveError::Unwritable(e.to_string()))?;
    Ok([&head[..], &xxh3_64(&body).to_le_bytes(), &body].concat())
}

/// The value of [`seal`]ed bytes.
///
/// # Errors
/// [`ArchiveError`]: other bytes, another format, damaged ones.
pub fn open<T: DeserializeOwned>(head: &[u8; 8], bytes: &[u8]) -> Result<T, ArchiveError> {
    let text = |bytes: &[u8]| bytes.escape_ascii().to_string();
    let (theirs, rest) = bytes.split_first_chunk::<8>().ok_or_else(|| ArchiveError::NotOne(text(&head[..7])))?;
    if theirs[..7] != head[..7] {
        return Err(ArchiveError::NotOne(text(&head[..7])));
    }
    if theirs != head {
        return Err(ArchiveError::Format { theirs: text(theirs), ours: text(head) });
    }
    let (checksum, body) = rest.split_first_chunk::<8>().ok_or_else(|| damaged("they are cut off"))?;
    if xxh3_64(body) != u64::from_le_bytes(*checksum) {
        return Err(damaged("their checksum is another"));
    }
    postcard::from_bytes(body).map_err(damaged)
}

fn damaged(why: impl ToString) -> ArchiveError {
    ArchiveError::Damaged(why.to_string())
}

fn stepper(name: &str) -> Result<Box<dyn Stepper>, ArchiveError> {
    stepper_by_name(name).ok_or_else(|| ArchiveError::Stepper(name.into()))
}

fn solver(name: &str) -> Result<Box<dyn RowSolver>, ArchiveError> {
    solver::by_name(name).ok_or_else(|| ArchiveError::Solver(name.into()))
}

/// Returns whether an object has a function of the program: an intersection test, or callbacks.
fn has_function(object: &dyn Object) -> bool {
    let any: &dyn std::any::Any = object;
    any.downcast_ref::<RigidBody>().is_some_and(|body| body.intersect().is_some())
        || any.downcast_ref::<ArticulatedBody>().is_some_and(ArticulatedBody::has_intersect)
        || any.downcast_ref::<ScriptedEvent>().is_some_and(ScriptedEvent::has_calls)
}

fn record(object: &dyn Object, tables: &mut Tables, indices: &ObjectIndices) -> Record {
    let any: &dyn std::any::Any = object;
    if let Some(body) = any.downcast_ref::<RigidBody>() {
        Record::Rigid(Box::new(RigidRecord::of(body, tables)))
    } else if let Some(body) = any.downcast_ref::<ArticulatedBody>() {
        Record::Articulated(Box::new(ArticulatedRecord::of(body, tables)))
    } else if let Some(loop_joint) = any.downcast_ref::<LoopJoint>() {
        Record::LoopJoint(Box::new(LoopJointRecord::of(loop_joint, indices)))
    } else if let Some(mimic) = any.downcast_ref::<Mimic>() {
        Record::Mimic(MimicRecord::of(mimic, indices))
    } else if let Some(event) = any.downcast_ref::<ScriptedEvent>() {
        Record::Event(Box::new(EventScript::of(event, indices)))
    } else if let Some(template) = any.downcast_ref::<Template>() {
        Record::Template(TemplateRecord::of(template, indices))
    } else if let Some(sensor) = any.downcast_ref::<Sensor>() {
        Record::Sensor(Box::new(SensorRecord::of(sensor, tables, indices)))
    } else {
        OtherRecord::of(object, tables, indices).map_or(Record::Foreign, |other| Record::Other(Box::new(other)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the error of reading the archive of an empty world after a change.
    fn refused(change: impl Fn(&mut Archive)) -> String {
        let mut archive: Archive = open(HEAD, &World::default().archive(&[]).unwrap()).unwrap();
        change(&mut archive);
        World::from_archive(&seal(HEAD, &archive).unwrap(), &mut |_| None).map(|_| ()).unwrap_err().to_string()
    }

    #[test]
    fn unknown_steppers_and_solvers_are_errors_of_their_own() {
        assert_eq!(
            refused(|archive| archive.stepper = "graded".into()),
            "the stepper 'graded' cannot be archived; expected 'time_stepping' or 'backtracking': set one of these \
             before the world is written, and 'graded' again on the world that is read"
        );
        assert_eq!(
            refused(|archive| archive.solver = "jacobi".into()),
            "the solver 'jacobi' cannot be archived; expected 'gauss_seidel', 'lcp_pyramid' or 'lcp_sliding': set one \
             of these before the world is written, and 'jacobi' again on the world that is read"
        );
    }
}
