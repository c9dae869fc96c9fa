//! The tables of behaviors: `[[cloth]]`, `[[jelly]]`, `[[particle_system]]`, `[[flock]]`, `[[body_flock]]` and `[[field]]`.

pub(crate) mod field;
pub(crate) mod flock;
pub(crate) mod particles;
pub(crate) mod soft;

use crate::parse::body::Library;
use crate::parse::fields::{Fields, Value};
use crate::parse::loop_joint::{PartSpec, Parts};
use field::FieldSpec;
use flock::{BodyFlockSpec, BoidGroupSpec, FlockSpec};
use particles::ParticleSystemSpec;
use soft::SoftSpec;

/// Largest number of tables of one kind.
const MOST: usize = 1_000;

/// The behaviors of a scene, each kind in the order of the file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BehaviorSpecs {
    /// `[[cloth]]`, then `[[jelly]]`.
    pub soft: Vec<SoftSpec>,
    /// `[[particle_system]]`.
    pub particle_systems: Vec<ParticleSystemSpec>,
    /// `[[flock]]`.
    pub flocks: Vec<FlockSpec>,
    /// `[[body_flock]]`.
    pub body_flocks: Vec<BodyFlockSpec>,
    /// `[[field]]`.
    pub fields: Vec<FieldSpec>,
}

impl BehaviorSpecs {
    /// Reads all tables. `take` gets each table and its name after it was read, with the table's place in the text.
    pub(crate) fn read(
        f: &mut Fields<'_>,
        library: &Library<'_>,
        parts: &impl Parts,
        mut take: impl FnMut(&Fields<'_>, &str),
    ) -> BehaviorSpecs {
        let mut specs = BehaviorSpecs::default();
        for (key, dimensions) in [("cloth", 2), ("jelly", 3)] {
            for mut table in f.tables(key, MOST) {
                specs.soft.push(SoftSpec::read(&mut table, library, dimensions));
                end(table, specs.soft.last().map(|soft| soft.name.as_str()), &mut take);
            }
        }
        for mut table in f.tables("particle_system", MOST) {
            specs.particle_systems.push(ParticleSystemSpec::read(&mut table, library, parts));
            end(table, specs.particle_systems.last().map(|system| system.name.as_str()), &mut take);
        }
        for mut table in f.tables("flock", MOST) {
            specs.flocks.push(FlockSpec::read(&mut table));
            for group in specs.flocks.last().iter().flat_map(|flock| &flock.groups) {
                (0..group.count).for_each(|k| take(&table, &group.name_of(k)));
            }
            end(table, specs.flocks.last().map(|flock| flock.name.as_str()), &mut take);
        }
        for mut table in f.tables("body_flock", MOST) {
            specs.body_flocks.push(BodyFlockSpec::read(&mut table, parts));
            end(table, specs.body_flocks.last().map(|flock| flock.name.as_str()), &mut take);
        }
        for mut table in f.tables("field", MOST) {
            match FieldSpec::read(&mut table, parts, &specs.soft) {
                Some(field) => {
                    end(table, Some(&field.name), &mut take);
                    specs.fields.push(field);
                }
                None => table.give_up(),
            }
        }
        specs
    }

    /// Returns the names of all objects of the behaviors, boids included.
    pub(crate) fn names(&self) -> Vec<String> {
        let soft = self.soft.iter().map(|spec| spec.name.clone());
        let systems = self.particle_systems.iter().map(|spec| spec.name.clone());
        let flocks = self.flocks.iter().flat_map(|flock| {
            let of = |group: &BoidGroupSpec| (0..group.count).map(|k| group.name_of(k)).collect::<Vec<String>>();
            flock.groups.iter().flat_map(of).chain([flock.name.clone()])
        });
        let body_flocks = self.body_flocks.iter().map(|spec| spec.name.clone());
        let fields = self.fields.iter().map(|spec| spec.name.clone());
        soft.chain(systems).chain(flocks).chain(body_flocks).chain(fields).collect()
    }
}

fn end(table: Fields<'_>, name: Option<&str>, take: &mut impl FnMut(&Fields<'_>, &str)) {
    if let Some(name) = name.filter(|name| !name.is_empty()) {
        take(&table, name);
    }
    table.finish();
}

/// Reads the part that `key` names; `None` without the key.
pub(crate) fn part(f: &mut Fields<'_>, key: &'static str, parts: &impl Parts) -> Option<PartSpec> {
    let (name, value) = f.optional_text(key)?;
    let found = parts.part(name);
    if found.is_none() {
        unknown_part(f, key, value, name, parts);
    }
    found
}

fn unknown_part(f: &Fields<'_>, key: &str, value: &Value<'_>, name: &str, parts: &impl Parts) {
    f.unknown_name(key, value, name, parts.names().iter().map(String::as_str).collect());
}
