//! The contacts of the last step as one structured numpy array.

use crate::arrays::convert::vector;
use crate::behaviors;
use crate::choices::word;
use crate::errors::{Error, Result};
use crate::objects::bodies::handle;
use crate::objects::place::{Found, body_ids, found};
use crate::world::inner::Inner;
use crate::world::shared::Shared;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyList;
use std::sync::Arc;
use tumble::dynamics::{ArticulatedBody, Event, EventKind, ObjectId};

/// Fields of a contact: name, format, count. All have 8 bytes, so there is no padding.
const FIELDS: [(&str, &str, usize); 9] = [
    ("bodies", "<i8", 2),
    ("parts", "<i8", 2),
    ("shapes", "<i8", 2),
    ("point", "<f8", 3),
    ("normal", "<f8", 3),
    ("depth", "<f8", 1),
    ("velocity", "<f8", 3),
    ("impulse", "<f8", 3),
    ("force", "<f8", 3),
];

/// Returns the contacts as the bytes of the array.
pub fn bytes(inner: &Inner) -> Vec<u8> {
    let ids = body_ids(&inner.world);
    let number = |id: ObjectId| ids.iter().position(|&other| other == id).map_or(-1, |k| k as i64);
    let contacts = inner.world.contacts();
    let mut out = Vec::with_capacity(contacts.len() * 22 * 8);
    for c in contacts {
        let [a, b] = [(c.a, c.part_a, c.shape_a), (c.b, c.part_b, c.shape_b)];
        let each =
            |of: fn(&Inner, ObjectId, usize, usize) -> i64| [a, b].map(|(id, part, shape)| of(inner, id, part, shape));
        let whole = [[number(a.0), number(b.0)], each(|inner, id, part, _| link(inner, id, part)), each(shape_number)];
        whole.as_flattened().iter().for_each(|k| out.extend_from_slice(&k.to_le_bytes()));
        let (first, last) =
            (c.point.iter().chain(c.normal.iter()), c.velocity.iter().chain(c.impulse.iter()).chain(c.force.iter()));
        let real = first.copied().chain([c.depth]).chain(last.copied());
        real.for_each(|x| out.extend_from_slice(&x.to_le_bytes()));
    }
    out
}

/// Returns the index of the touched link in the `link_names` of its articulation, which may be a fixed one. A rigid body
/// has only one part.
pub fn link(inner: &Inner, id: ObjectId, part: usize) -> i64 {
    let Some(body) = inner.world.get::<ArticulatedBody>(id) else { return part as i64 };
    body.frame_of(part).unwrap_or(0) as i64
}

/// Returns the number of a shape: the index of a compound's part; on a link, its index among the
/// shapes of the link that collide, where the parts of a compound count one by one.
pub fn shape_number(inner: &Inner, id: ObjectId, part: usize, shape: usize) -> i64 {
    inner.world.get::<ArticulatedBody>(id).map_or(shape, |body| body.shape_number(part, shape)) as i64
}

/// Returns the name of a shape by its body, and the index of its link and its number as contacts report them.
pub fn shape_name(inner: &Inner, id: ObjectId, link: usize, number: usize) -> Result<Option<String>> {
    let none = |owner: &str, count: usize| {
        Error::value(format!("{owner} has no shape {number}; it has {count} that collide, numbered from 0"))
    };
    let Some(body) = inner.world.get::<ArticulatedBody>(id) else {
        let solid = inner.world.object(id).and_then(|object| object.collidable()?.shape(0));
        let count = solid.map_or(0, |solid| solid.part_count());
        return match link == 0 && number < count {
            true => Ok(inner.world.shape_name(id, 0, number).map(str::to_owned)),
            false => Err(none(inner.world.name(id).unwrap_or_default(), count)),
        };
    };
    let frames = body.model().frames();
    let frame = frames.get(link).ok_or_else(|| {
        Error::value(format!("part is {link}; it must be an index of the {} links in link_names", frames.len()))
    })?;
    let found = body.shapes_of(link).nth(number);
    let (_, _, name) = found.ok_or_else(|| none(&frame.name, body.shapes_of(link).count()))?;
    Ok(name.map(str::to_owned))
}

/// Returns the array of such bytes.
pub fn array<'py>(py: Python<'py>, bytes: Vec<u8>) -> Result<Bound<'py, PyAny>> {
    Ok(PyArray1::from_vec(py, bytes).call_method1("view", (kind(py)?,))?)
}

/// Returns the numpy type of one contact.
pub fn kind<'py>(py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
    static KIND: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    let kind = KIND.get_or_try_init(py, || {
        let fields = FIELDS.map(|(name, format, count)| match count {
            1 => (name, format).into_pyobject(py).map(|f| f.into_any()),
            _ => (name, format, (count,)).into_pyobject(py).map(|f| f.into_any()),
        });
        let fields = fields.into_iter().collect::<PyResult<Vec<_>>>()?;
        PyResult::Ok(py.import("numpy")?.call_method1("dtype", (PyList::new(py, fields)?,))?.unbind())
    })?;
    Ok(kind.bind(py).clone())
}

/// One side of an event.
#[derive(Default)]
struct Side {
    link: i64,
    shape: i64,
    link_name: Option<String>,
    name: Option<String>,
}

/// Returns the events of the last step.
pub fn events(shared: &Arc<Shared>, py: Python<'_>) -> Result<Vec<Py<PyAny>>> {
    let all = shared.read(|inner| {
        let found = |e: &Event| {
            let a = found(inner, e.a)?;
            let b = e.b.and_then(|id| found(inner, id));
            let side = |id, part, shape| Side {
                link: link(inner, id, part),
                shape: shape_number(inner, id, part, shape),
                link_name: inner.world.part_name(id, part).filter(|_| e.is_of_parts()).map(str::to_owned),
                name: inner.world.shape_name(id, part, shape).filter(|_| e.has_shapes()).map(str::to_owned),
            };
            let b_side = e.b.map_or_else(Side::default, |id| side(id, e.part_b, e.shape_b));
            Some((*e, a, b, [side(e.a, e.part_a, e.shape_a), b_side]))
        };
        Ok(inner.world.events().iter().filter_map(found).collect::<Vec<_>>())
    })?;
    let class = py.import("tumble._values")?.getattr("Event")?;
    let tuple = |(event, a, b, [first, second]): (Event, _, Option<_>, [Side; 2])| {
        let a = event_side(py, shared, a)?;
        let b = b.map(|b| handle(py, shared, b)).transpose()?;
        let kind = word(event.kind, EventKind::NAMES);
        let (parts, shapes) = ((first.link, second.link), (first.shape, second.shape));
        let (impulse, point) = (vector(py, &event.impulse), vector(py, &event.point));
        let (links, shape_names) = ((first.link_name, second.link_name), (first.name, second.name));
        Ok(class.call1((kind, a, b, parts, impulse, point, shapes, shape_names, links))?.unbind())
    };
    all.into_iter().map(tuple).collect()
}

/// Returns the handle of the first side of an event: a body, a joint, or a scripted event.
fn event_side(py: Python<'_>, shared: &Arc<Shared>, found: Found) -> Result<Py<PyAny>> {
    match behaviors::handle(py, shared, &found.name)? {
        Some(other) => Ok(other),
        None => handle(py, shared, found),
    }
}

/// Returns the handles of the bodies in contact with a body, or in a sensor.
pub fn touching(shared: &Arc<Shared>, py: Python<'_>, id: ObjectId) -> Result<Vec<Py<PyAny>>> {
    let others = shared.read(|inner| {
        let mut ids: Vec<ObjectId> = inner.world.touching(id).into_iter().map(|(other, _)| other).collect();
        ids.dedup();
        Ok(ids.into_iter().filter_map(|id| found(inner, id)).collect::<Vec<_>>())
    })?;
    others.into_iter().map(|other| handle(py, shared, other)).collect()
}
