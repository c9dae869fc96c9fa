//! `simulate`: from bytes and controls to arrays, without a handle that stays.

use crate::arrays::convert::{Numbers, numbers, room, shown};
use crate::arrays::whole;
use crate::batch::fields::{Field, Layout};
use crate::batch::member::write;
use crate::errors::{Error, Result};
use crate::interrupt::{Stop, interruptible};
use crate::world::bulk::Bulk;
use crate::world::inner::Inner;
use crate::world::{pickling, snapshot};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use pyo3::types::PyDict;

/// The fields that are returned after every `every` steps.
const FIELDS: [(&str, Field); 9] = [
    ("time", Field::Time),
    ("state", Field::State),
    ("q", Field::Q),
    ("v", Field::V),
    ("positions", Field::Bodies(Bulk::Positions)),
    ("orientations", Field::Bodies(Bulk::Orientations)),
    ("velocities", Field::Bodies(Bulk::Velocities)),
    ("angular_velocities", Field::Bodies(Bulk::AngularVelocities)),
    ("contact_counts", Field::Contacts),
];

/// The numbers of all fields, one record after each kept step, and the world at the end.
struct Course {
    layout: Layout,
    records: Vec<f64>,
    end: Vec<u8>,
}

/// Simulates a world that is given as bytes: a pure function of its arguments, for any engine that
/// has a ``map``. Nothing is kept between two calls, and arguments and results pickle.
///
/// model: ``World.model()``. snapshot: where it starts, ``World.save()`` of a world of that model;
/// None: the model's own state. controls: shape (steps, dof), as those of one fork in
/// ``World.rollout``. every: interval in steps at which the results are kept.
///
/// Returns a dict of arrays with one row for each kept step: ``time``, ``state``, ``q``, ``v``,
/// ``positions``, ``orientations``, ``velocities``, ``angular_velocities``, ``contact_counts``, each
/// as in ``Batch``, and ``snapshot``, the bytes of ``World.save()`` at the end, uint8, with which
/// the next call goes on.
#[pyfunction]
#[pyo3(signature = (model, snapshot, controls, every=1))]
pub fn simulate<'py>(
    py: Python<'py>,
    model: PyBackedBytes,
    snapshot: Option<PyBackedBytes>,
    controls: &Bound<'py, PyAny>,
    #[pyo3(from_py_with = whole::every)] every: usize,
) -> Result<Bound<'py, PyDict>> {
    let controls = numbers(controls, "controls")?;
    let course = interruptible(py, |stop| run(&model, snapshot.as_deref(), &controls, every, stop))?;
    let Course { layout, records, end } = course;
    let (out, record) = (PyDict::new(py), FIELDS.iter().map(|(_, field)| field.width(&layout)).sum::<usize>().max(1));
    let (kept, mut first) = (records.len() / record, 0);
    for (name, field) in FIELDS {
        let width = field.width(&layout);
        let column = records.chunks_exact(record).flat_map(|row| row[first..first + width].iter().copied());
        let shape: Vec<usize> = std::iter::once(kept).chain(field.shape(&layout)).collect();
        out.set_item(name, PyArray1::from_iter(py, column).reshape(shape)?)?;
        first += width;
    }
    out.set_item("snapshot", PyArray1::from_vec(py, end))?;
    Ok(out)
}

fn run(model: &[u8], start: Option<&[u8]>, controls: &Numbers, every: usize, stop: &Stop) -> Result<Course> {
    let mut inner: Inner = pickling::read(model)?;
    if !inner.forces().is_empty() {
        return Err(Error::value("model: it has forces written in Python; pickle that world instead"));
    }
    if let Some(start) = start {
        snapshot::read(&mut inner, start)?;
    }
    let layout = Layout::new(&inner, None)?;
    let dof = layout.dof();
    let [steps, got] = controls.shape[..] else {
        return Err(Error::value(format!("controls: expected shape (steps, {dof}), got {}", shown(&controls.shape))));
    };
    if got != dof {
        return Err(Error::value(format!("controls: expected shape (steps, {dof}), got {}", shown(&controls.shape))));
    }
    if every == 0 || steps % every != 0 {
        return Err(Error::value(format!("every is {every}; it must divide the {steps} steps")));
    }
    let fields = FIELDS.map(|(_, field)| field);
    let record: usize = fields.iter().map(|field| field.width(&layout)).sum();
    let len = (steps / every).checked_mul(record).ok_or_else(|| Error::value("the results do not fit into memory"))?;
    let mut records = room(len, "results")?;
    records.resize(len, 0.0);
    for frame in 0..steps {
        stop.check()?;
        let row = &controls.data[frame * dof..(frame + 1) * dof];
        inner.set_efforts(layout.driven.iter().map(|body| (body.id, body.dof)), row);
        inner.step()?;
        if (frame + 1) % every == 0 {
            let at = ((frame + 1) / every - 1) * record;
            write(&fields, &layout, &inner, &mut records[at..at + record])?;
        }
    }
    Ok(Course { layout, records, end: snapshot::write(&inner) })
}
