//! Objects of other crates in an archive: [`Object::record`] writes one, and the caller of
//! [`World::from_archive`](crate::World::from_archive) reads it.

use super::records::{LoadedTables, ObjectIndices, Tables, VisualRecord, shape};
use super::{ArchiveError, open, seal};
use crate::Object;
use crate::object::visual::Visual;
use crate::world::view::ObjectId;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::cell::Cell;
use tumble_collide::Shape;

/// The constants of an object of another crate.
#[derive(Clone, Debug, Default)]
pub struct ObjectRecord {
    /// Its numbers, as its crate writes them.
    pub bytes: Vec<u8>,
    /// Its shapes. Those that objects share are written once.
    pub shapes: Vec<Shape>,
    /// Its visuals.
    pub visuals: Vec<Visual>,
}

impl ObjectRecord {
    /// Makes a record of a value in postcard, after eight bytes that name the crate and the format.
    ///
    /// # Errors
    /// As [`seal`].
    pub fn of(head: &[u8; 8], value: &impl Serialize) -> Result<ObjectRecord, ArchiveError> {
        Ok(ObjectRecord { bytes: seal(head, value)?, ..ObjectRecord::default() })
    }

    /// Returns the value.
    ///
    /// # Errors
    /// As [`open`]: the record is of another crate or format.
    pub fn value<T: DeserializeOwned>(&self, head: &[u8; 8]) -> Result<T, ArchiveError> {
        open(head, &self.bytes)
    }
}

/// An object of another crate that is read.
pub struct ReadObject<'a> {
    /// Its name in the world.
    pub name: &'a str,
    /// Its record; `None` if it was among the foreign objects of [`World::archive`](crate::World::archive).
    pub record: Option<&'a ObjectRecord>,
    ids: &'a [ObjectId],
    /// Whether it named an object that is not read yet.
    ahead: Cell<bool>,
}

impl ReadObject<'_> {
    /// Returns the id of an object by the index that [`ObjectIndices::of_id`] gave when it was written; an id of no
    /// object for one that was removed.
    pub fn id(&self, index: Option<u32>) -> ObjectId {
        let known = index.and_then(|index| self.ids.get(index as usize)).copied();
        self.ahead.set(self.ahead.get() || index.is_some() && known.is_none());
        known.unwrap_or_default()
    }
}

/// The record with its shapes by index.
#[derive(Serialize, Deserialize)]
pub(super) struct OtherRecord {
    bytes: Vec<u8>,
    part_shapes: Vec<u32>,
    visuals: Vec<VisualRecord>,
}

impl OtherRecord {
    /// Returns `None` for an object that does not write itself.
    pub fn of(object: &dyn Object, tables: &mut Tables, indices: &ObjectIndices) -> Option<OtherRecord> {
        let ObjectRecord { bytes, shapes, visuals } = object.record(indices)?;
        let part_shapes = shapes.iter().map(|shape| tables.shapes.index(shape)).collect();
        Some(OtherRecord {
            bytes,
            part_shapes,
            visuals: visuals.iter().map(|visual| VisualRecord::of(visual, tables)).collect(),
        })
    }

    /// Returns the record with its shapes.
    pub fn record(self, tables: &LoadedTables) -> Result<ObjectRecord, ArchiveError> {
        let shapes =
            self.part_shapes.into_iter().map(|index| shape(&tables.shapes, index)).collect::<Result<_, _>>()?;
        let visuals = self.visuals.into_iter().map(|v| v.visual(tables)).collect::<Result<_, _>>()?;
        Ok(ObjectRecord { bytes: self.bytes, shapes, visuals })
    }
}

/// The maker of objects of other crates.
pub type MakeObject<'m> = dyn FnMut(&ReadObject) -> Option<Box<dyn Object>> + 'm;

/// Makes an object. Returns whether it names objects that are not read yet.
pub(super) fn made(
    name: &str,
    record: Option<&ObjectRecord>,
    ids: &[ObjectId],
    make: &mut MakeObject,
) -> Result<(Box<dyn Object>, bool), ArchiveError> {
    let read = ReadObject { name, record, ids, ahead: Cell::new(false) };
    let object = make(&read).ok_or_else(|| ArchiveError::Foreign(name.into()))?;
    Ok((object, read.ahead.get()))
}
