//! Records of measuring sensors.

use super::records::{LoadedTables, ObjectIndices, Tables, id, shape};
use super::{ArchiveError, damaged};
use crate::Anchor;
use crate::object::Object;
use crate::sensor::{Optics, Sensor, SensorKind, SensorNoise, SensorPlace};
use crate::world::view::ObjectId;
use serde::{Deserialize, Serialize};
use tumble_collide::Pose;

/// The place of a sensor.
#[derive(Serialize, Deserialize)]
struct Site {
    /// Index of the object, if that still exists, and part; `None` for the world.
    part: Option<(Option<u32>, usize)>,
    frame: Pose,
    /// The link whose shapes are read.
    link: Option<usize>,
}

/// The thing that a sensor is fixed to; objects by index.
#[derive(Serialize, Deserialize)]
enum Place {
    Site(Site),
    LoopJoint(Option<u32>),
    Dof(Option<u32>, usize),
}

/// A sensor.
#[derive(Serialize, Deserialize)]
pub(super) struct SensorRecord {
    name: String,
    kind: SensorKind,
    place: Place,
    reference: Option<Site>,
    volume: Option<u32>,
    cutoff: f64,
    noise: SensorNoise,
    /// Optics of a camera.
    optics: Option<Optics>,
}

fn site(anchor: &Anchor, indices: &ObjectIndices) -> Site {
    let part = anchor.part.map(|(id, part)| (indices.of_id(id), part));
    Site { part, frame: anchor.frame, link: anchor.link }
}

fn anchor(Site { part, frame, link }: Site, ids: &[ObjectId]) -> Anchor {
    Anchor { part: part.map(|(index, part)| (id(ids, index), part)), frame, link }
}

impl SensorRecord {
    pub fn of(sensor: &Sensor, tables: &mut Tables, indices: &ObjectIndices) -> SensorRecord {
        let place = match sensor.place() {
            SensorPlace::Site(anchor) => Place::Site(site(anchor, indices)),
            SensorPlace::LoopJoint(joint) => Place::LoopJoint(indices.of_id(*joint)),
            SensorPlace::Dof(body, dof) => Place::Dof(indices.of_id(*body), *dof),
        };
        SensorRecord {
            name: sensor.name().into(),
            kind: sensor.kind(),
            place,
            reference: sensor.reference().map(|anchor| site(anchor, indices)),
            volume: sensor.volume().map(|volume| tables.shapes.index(volume)),
            cutoff: sensor.cutoff(),
            noise: *sensor.noise(),
            optics: sensor.kind().is_camera().then(|| *sensor.optics()),
        }
    }

    pub fn sensor(self, tables: &LoadedTables, ids: &[ObjectId]) -> Result<Sensor, ArchiveError> {
        let place = match self.place {
            Place::Site(site) => SensorPlace::Site(anchor(site, ids)),
            Place::LoopJoint(index) => SensorPlace::LoopJoint(id(ids, index)),
            Place::Dof(index, dof) => SensorPlace::Dof(id(ids, index), dof),
        };
        let mut sensor = Sensor::at(self.name, self.kind, place).map_err(damaged)?;
        if let Some(site) = self.reference {
            sensor = sensor.relative_to(anchor(site, ids)).map_err(damaged)?;
        }
        if let Some(index) = self.volume {
            sensor = sensor.with_volume(shape(&tables.shapes, index)?).map_err(damaged)?;
        }
        if let Some(optics) = self.optics {
            sensor = sensor.with_optics(optics).map_err(damaged)?;
        }
        sensor.with_cutoff(self.cutoff).and_then(|sensor| sensor.with_noise(self.noise)).map_err(damaged)
    }
}
