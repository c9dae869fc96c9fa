//! Behaviors in archives: their constants as data, and back.

use crate::fields::{Attractor, Buoyancy, DragLaw, Explosion, Panel, Panels, Targets, Wind};
use crate::particles::{Emitter, ParticleLook, ParticleSettings, ParticleSystem};
use crate::springs::{MeshSpring, Origin, SpringMesh};
use crate::steering::{Search, Steering};
use crate::{BehaviorError, BodyFlock, Boid, Flock, Helm};
use serde::{Deserialize, Serialize, Serializer};
use tumble_collide::{Pose, Vec3};
use tumble_core::archive::{ObjectIndices, ObjectRecord, ReadObject, open};
use tumble_core::{Appearance, Material, Object, ObjectId, PartSurface};

/// First bytes of a record; the last is the number of the format.
const HEAD: &[u8; 8] = b"tumbleB3";

/// An object by its index; `None` for a removed one.
type Index = Option<u32>;

/// The constants of a behavior.
#[derive(Serialize, Deserialize)]
pub(crate) enum Record {
    Boid { mass: f64, material: Material, start: [f64; 8], bank: [f64; 2] },
    Flock { steering: Steering, search: Search, boids: Vec<Index> },
    BodyFlock { steering: Steering, helm: Helm, search: Search, bodies: Vec<Index> },
    Wind { velocity: Vec3, law: DragLaw, targets: Option<Vec<Index>> },
    Attractor { center: Vec3, strength: f64, softening: f64, targets: Option<Vec<Index>> },
    Explosion { center: Vec3, impulse: f64, time: f64, decay: f64, targets: Option<Vec<Index>> },
    Buoyancy { surface: Vec3, density: f64, drag: f64, current: Vec3, targets: Option<Vec<Index>> },
    Panels { density: f64, wind: Vec3, panels: Vec<PanelRecord> },
    Particles { settings: ParticleSettings, emitters: Vec<EmitterRecord>, look: ParticleLook },
    Mesh(Box<MeshRecord>),
}

/// A panel: object, part, point, normal, and area, lift slope and drag.
type PanelRecord = (Index, usize, Vec3, Vec3, [f64; 3]);

/// A source of particles; its mount by index.
#[derive(Serialize, Deserialize)]
pub(crate) struct EmitterRecord {
    pose: Pose,
    mount: Option<(Index, usize)>,
    radius: f64,
    speed: [f64; 2],
    half_angle: f64,
    lifetime: [f64; 2],
    burst: u32,
    rate: f64,
    start: f64,
    end: f64,
}

/// A mesh of springs.
#[derive(Serialize, Deserialize)]
pub(crate) struct MeshRecord {
    given: Vec<Vec3>,
    nodes: Vec<Vec3>,
    masses: Vec<f64>,
    pinned: Vec<bool>,
    springs: Vec<MeshSpring>,
    velocity: Vec3,
    material: Material,
    step: f64,
    implicitness: f64,
    origin: Option<Origin>,
    surface: Option<(Vec<[u32; 3]>, Appearance, f64)>,
}

impl Record {
    /// Returns the record; `None` if it cannot be written.
    fn written(self) -> Option<ObjectRecord> {
        ObjectRecord::of(HEAD, &self).ok()
    }
}

/// Returns objects by their indices, without those that were removed: these have no effect.
fn list(ids: &[ObjectId], indices: &ObjectIndices) -> Vec<Index> {
    ids.iter().filter_map(|id| indices.of_id(*id)).map(Some).collect()
}

fn targets(of: &Targets, indices: &ObjectIndices) -> Option<Vec<Index>> {
    match of {
        Targets::All => None,
        Targets::Only(ids) => Some(list(ids, indices)),
    }
}

pub(crate) fn boid(boid: &Boid) -> Option<ObjectRecord> {
    let Boid { shape, mass, material, visuals, start, bank_time, roll_time, .. } = boid;
    let record = Record::Boid { mass: *mass, material: *material, start: *start, bank: [*bank_time, *roll_time] };
    Some(ObjectRecord { shapes: vec![shape.clone()], visuals: visuals.clone(), ..record.written()? })
}

pub(crate) fn flock(flock: &Flock, indices: &ObjectIndices) -> Option<ObjectRecord> {
    let boids = list(flock.boids(), indices);
    Record::Flock { steering: *flock.steering(), search: flock.search, boids }.written()
}

pub(crate) fn body_flock(flock: &BodyFlock, indices: &ObjectIndices) -> Option<ObjectRecord> {
    let (steering, helm, bodies) = (*flock.steering(), *flock.helm(), list(flock.bodies(), indices));
    Record::BodyFlock { steering, helm, search: flock.search, bodies }.written()
}

pub(crate) fn wind(of: &Wind, indices: &ObjectIndices) -> Option<ObjectRecord> {
    Record::Wind { velocity: of.velocity, law: of.law, targets: targets(&of.targets, indices) }.written()
}

pub(crate) fn attractor(of: &Attractor, indices: &ObjectIndices) -> Option<ObjectRecord> {
    let targets = targets(&of.targets, indices);
    Record::Attractor { center: of.center, strength: of.strength, softening: of.softening, targets }.written()
}

pub(crate) fn explosion(of: &Explosion, indices: &ObjectIndices) -> Option<ObjectRecord> {
    let &Explosion { center, impulse, time, decay, .. } = of;
    Record::Explosion { center, impulse, time, decay, targets: targets(&of.targets, indices) }.written()
}

pub(crate) fn buoyancy(of: &Buoyancy, indices: &ObjectIndices) -> Option<ObjectRecord> {
    let &Buoyancy { surface, density, drag, current, .. } = of;
    Record::Buoyancy { surface, density, drag, current, targets: targets(&of.targets, indices) }.written()
}

pub(crate) fn panels(of: &Panels, indices: &ObjectIndices) -> Option<ObjectRecord> {
    let panel = |p: &Panel| (indices.of_id(p.id), p.part, p.point, p.normal, [p.area, p.lift_slope, p.drag]);
    Record::Panels { density: of.density, wind: of.wind, panels: of.panels.iter().map(panel).collect() }.written()
}

pub(crate) fn particles(of: &ParticleSystem, indices: &ObjectIndices) -> Option<ObjectRecord> {
    let emitter = |e: &Emitter| {
        let &Emitter { pose, mount, radius, speed, half_angle, lifetime, burst, rate, start, end } = e;
        let mount = mount.map(|(id, part)| (indices.of_id(id), part));
        EmitterRecord { pose, mount, radius, speed, half_angle, lifetime, burst, rate, start, end }
    };
    let emitters = of.emitters().iter().map(emitter).collect();
    Record::Particles { settings: of.settings().clone(), emitters, look: of.look().clone() }.written()
}

pub(crate) fn mesh(of: &SpringMesh) -> Option<ObjectRecord> {
    let surface = of.surface.as_ref().map(|s| (s.triangles.to_vec(), s.appearance.clone(), s.crease));
    let record = MeshRecord {
        given: of.given.to_vec(),
        nodes: of.nodes.clone(),
        masses: of.masses.clone(),
        pinned: of.pinned.clone(),
        springs: of.springs.clone(),
        velocity: of.velocity,
        material: of.material,
        step: of.step,
        implicitness: of.implicitness,
        origin: of.origin.clone(),
        surface,
    };
    Some(ObjectRecord { shapes: of.shape.iter().cloned().collect(), ..Record::Mesh(Box::new(record)).written()? })
}

/// Serializes the constants in the bytes of a record, to compare them field by field. The names of the fields are no part of
/// the interface.
///
/// # Errors
/// Those of the serializer, and one for bytes of another crate or format.
pub fn serialize_record<S: Serializer>(bytes: &[u8], serializer: S) -> Result<S::Ok, S::Error> {
    let record: Record = open(HEAD, bytes).map_err(serde::ser::Error::custom)?;
    record.serialize(serializer)
}

/// Makes a behavior of an archive, for [`World::from_archive`](tumble_core::World::from_archive); `None` for an object that is no
/// behavior of this crate, or of another version.
pub fn read_object(read: &ReadObject) -> Option<Box<dyn Object>> {
    let record = read.record?;
    made(record.value(HEAD).ok()?, record, read).ok()?
}

fn made(record: Record, parts: &ObjectRecord, read: &ReadObject) -> Result<Option<Box<dyn Object>>, BehaviorError> {
    let ids = |list: Vec<Index>| list.into_iter().map(|index| read.id(index)).collect::<Vec<ObjectId>>();
    let targets = |list: Option<Vec<Index>>| list.map_or(Targets::All, |list| Targets::Only(ids(list)));
    let name = read.name;
    Ok(Some(match record {
        Record::Boid { mass, material, start, bank: [bank_time, roll_time] } => {
            let Some(shape) = parts.shapes.first() else { return Ok(None) };
            let boid = Boid::new(shape.clone(), mass)?.with_name(name).with_material(material);
            let mut boid = boid.with_bank(bank_time, roll_time)?.with_visuals(parts.visuals.clone());
            boid.start = start;
            Box::new(boid)
        }
        Record::Flock { steering, search, boids } => {
            let mut flock = Flock::new(name, steering)?.with_search(search);
            flock.boids = ids(boids);
            Box::new(flock)
        }
        Record::BodyFlock { steering, helm, search, bodies } => {
            let mut flock = BodyFlock::new(name, steering, helm)?.with_search(search);
            ids(bodies).into_iter().for_each(|body| flock.push(body));
            Box::new(flock)
        }
        Record::Wind { velocity, law, targets: list } => {
            Box::new(Wind::new(name, velocity, law)?.with_targets(targets(list)))
        }
        Record::Attractor { center, strength, softening, targets: list } => {
            Box::new(Attractor::new(name, center, strength, softening)?.with_targets(targets(list)))
        }
        Record::Explosion { center, impulse, time, decay, targets: list } => {
            Box::new(Explosion::new(name, center, impulse, time, decay)?.with_targets(targets(list)))
        }
        Record::Buoyancy { surface, density, drag, current, targets: list } => {
            let fluid = Buoyancy::new(name, surface, density)?.with_drag(drag, current)?;
            Box::new(fluid.with_targets(targets(list)))
        }
        Record::Panels { density, wind, panels } => {
            let panel = |(index, part, point, normal, [area, lift_slope, drag]): PanelRecord| Panel {
                id: read.id(index),
                part,
                point,
                normal,
                area,
                lift_slope,
                drag,
            };
            Box::new(Panels::new(name, density, wind, panels.into_iter().map(panel))?)
        }
        Record::Particles { settings, emitters, look } => {
            let mut system = ParticleSystem::new(name, settings)?.with_look(look)?;
            for e in emitters {
                let EmitterRecord { pose, mount, radius, speed, half_angle, lifetime, burst, rate, start, end } = e;
                let mount = mount.map(|(index, part)| (read.id(index), part));
                system = system.with_emitter(Emitter {
                    pose,
                    mount,
                    radius,
                    speed,
                    half_angle,
                    lifetime,
                    burst,
                    rate,
                    start,
                    end,
                })?;
            }
            Box::new(system)
        }
        Record::Mesh(mesh) => {
            let mut made = SpringMesh::new(mesh.given, mesh.masses, mesh.springs)?
                .with_name(name)
                .with_velocity(mesh.velocity)
                .with_material(mesh.material)
                .with_implicitness(mesh.implicitness)?;
            let surface = mesh.surface.map(|(triangles, appearance, crease)| PartSurface {
                triangles: triangles.into(),
                appearance,
                crease,
            });
            made.set_step(mesh.step)?;
            made.nodes = mesh.nodes;
            (made.pinned, made.origin, made.surface) = (mesh.pinned, mesh.origin, surface);
            made.shape = parts.shapes.first().cloned();
            Box::new(made)
        }
    }))
}
