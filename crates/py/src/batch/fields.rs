//! Numbers of all worlds of a batch as arrays: which there are, and how one world writes its part.

use crate::arrays::convert::shown;
use crate::errors::{Error, Result};
use crate::objects::place::body_ids;
use crate::world::bulk::{self, Bulk};
use crate::world::contacts::link;
use crate::world::inner::Inner;
use numpy::{PyArrayDyn, PyArrayMethods};
use pyo3::prelude::*;
use std::ops::Range;
use tumble::dynamics::ObjectId;

/// An articulated body whose degrees of freedom are columns of a batch.
pub struct Driven {
    /// The body.
    pub id: ObjectId,
    /// Its numbers in the state, `q` and then `v`.
    pub x: Range<usize>,
    /// Length of its `q`.
    pub positions: usize,
    /// Degrees of freedom.
    pub dof: usize,
    /// Frames in its `link_names`.
    pub links: usize,
}

/// The objects and sizes that all worlds of a batch have in common.
pub struct Layout {
    /// Length of the state.
    pub state: usize,
    /// All objects except for forces written in Python.
    objects: Vec<ObjectId>,
    /// All bodies.
    pub bodies: Vec<ObjectId>,
    /// The articulated bodies of `q`, `v` and controls.
    pub driven: Vec<Driven>,
}

impl Layout {
    /// Returns the layout of a world. `asked`: the articulated bodies, by default all.
    pub fn new(inner: &Inner, asked: Option<Vec<ObjectId>>) -> Result<Layout> {
        let bodies = body_ids(&inner.world);
        let all = || bodies.iter().copied().filter(|id| inner.robots.contains_key(id)).collect();
        let driven = asked.unwrap_or_else(all).into_iter().map(|id| {
            let none = || Error::value("articulations: expected articulations of the world");
            let robot = inner.robots.get(&id).ok_or_else(none)?;
            let view = inner.world.view();
            let x = view.state_range(id).map(|span| span.x.clone()).ok_or_else(none)?;
            Ok(Driven { id, x, positions: robot.positions(), dof: robot.dof(), links: robot.model.frames().len() })
        });
        let driven = driven.collect::<Result<Vec<Driven>>>()?;
        if let Some(k) = (1..driven.len()).find(|k| driven[..*k].iter().any(|one| one.id == driven[*k].id)) {
            return Err(Error::value(format!("articulations: number {k} is there twice; name each once")));
        }
        let objects = inner.world.ids().iter().copied().filter(|id| !inner.forces().contains(id)).collect();
        Ok(Layout { state: inner.world.state().len(), objects, bodies, driven })
    }

    /// Returns the degrees of freedom of all driven bodies.
    pub fn dof(&self) -> usize {
        self.driven.iter().map(|one| one.dof).sum()
    }

    /// Returns the length of `q`.
    pub fn positions(&self) -> usize {
        self.driven.iter().map(|one| one.positions).sum()
    }

    /// Returns the places of the driven bodies among all objects.
    pub fn driven_places(&self) -> Vec<usize> {
        let place = |one: &Driven| self.objects.iter().position(|id| *id == one.id);
        self.driven.iter().filter_map(place).collect()
    }

    /// Checks that a world still has the bodies that the batch was made with.
    pub fn check(&self, inner: &Inner) -> Result<()> {
        let own = inner.world.ids();
        let own = own.iter().filter(|id| !inner.forces().contains(id));
        match own.eq(&self.objects) {
            true => Ok(()),
            false => Err(Error::value("bodies or joints were added to this world of a batch, or removed from it")),
        }
    }
}

/// A quantity of each world.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Field {
    State,
    Time,
    Q,
    V,
    Bodies(Bulk),
    /// Sum of the contact forces on each body.
    Forces,
    /// Sum of the contact forces on each link: torque about the world's origin, and force.
    Links,
    Contacts,
}

impl Field {
    /// Returns the shape of one world's part.
    pub fn shape(self, layout: &Layout) -> Vec<usize> {
        match self {
            Field::State => vec![layout.state],
            Field::Time | Field::Contacts => vec![],
            Field::Q => vec![layout.positions()],
            Field::V => vec![layout.dof()],
            Field::Bodies(bulk) => vec![layout.bodies.len(), bulk.width()],
            Field::Forces => vec![layout.bodies.len(), 3],
            Field::Links => vec![layout.driven.iter().map(|one| one.links).sum(), 6],
        }
    }

    /// Returns how many numbers one world's part has.
    pub fn width(self, layout: &Layout) -> usize {
        self.shape(layout).iter().product()
    }

    /// Writes one world's part.
    pub fn write(self, layout: &Layout, inner: &Inner, out: &mut [f64]) -> Result<()> {
        let x = inner.world.state();
        let mut parts = out;
        let mut next = |from: &[f64]| {
            let (part, rest) = std::mem::take(&mut parts).split_at_mut(from.len());
            part.copy_from_slice(from);
            parts = rest;
        };
        match self {
            Field::State => next(x),
            Field::Time => next(&[inner.world.time()]),
            Field::Contacts => next(&[inner.world.contacts().len() as f64]),
            Field::Q => layout.driven.iter().for_each(|d| next(&x[d.x.start..d.x.start + d.positions])),
            Field::V => layout.driven.iter().for_each(|d| next(&x[d.x.end - d.dof..d.x.end])),
            Field::Bodies(bulk) => next(&bulk::get(inner, bulk)?),
            Field::Forces => forces(layout, inner, parts),
            Field::Links => links(layout, inner, parts),
        }
        Ok(())
    }
}

/// Adds up the contact forces on each body.
fn forces(layout: &Layout, inner: &Inner, out: &mut [f64]) {
    out.fill(0.0);
    for contact in inner.world.contacts() {
        for (id, sign) in [(contact.a, 1.0), (contact.b, -1.0)] {
            let Some(row) = layout.bodies.iter().position(|other| *other == id) else { continue };
            out[3 * row..3 * row + 3].iter_mut().zip(contact.force.iter()).for_each(|(sum, f)| *sum += sign * f);
        }
    }
}

/// Adds up the contact forces on each link of the driven bodies.
fn links(layout: &Layout, inner: &Inner, out: &mut [f64]) {
    out.fill(0.0);
    for contact in inner.world.contacts() {
        let torque = contact.point.cross(&contact.force);
        for (id, part, sign) in [(contact.a, contact.part_a, 1.0), (contact.b, contact.part_b, -1.0)] {
            let mut first = 0;
            for body in &layout.driven {
                if body.id == id {
                    let row = first + link(inner, id, part) as usize;
                    let wrench = torque.iter().chain(contact.force.iter());
                    out[6 * row..6 * row + 6].iter_mut().zip(wrench).for_each(|(sum, f)| *sum += sign * f);
                }
                first += body.links;
            }
        }
    }
}

/// A field whose array Python has, and where each world's part of it is in the world's record.
pub struct Table {
    pub field: Field,
    pub first: usize,
    pub width: usize,
    array: Py<PyArrayDyn<f64>>,
    /// The array that Python gets: read-only.
    view: Py<PyAny>,
}

impl Table {
    /// Returns an array of zeros.
    pub fn new(py: Python<'_>, field: Field, layout: &Layout, worlds: usize, first: usize) -> Result<Table> {
        let shape: Vec<usize> = std::iter::once(worlds).chain(field.shape(layout)).collect();
        let array = PyArrayDyn::<f64>::zeros(py, shape, false);
        let view = array.call_method0("view")?;
        view.call_method1("setflags", (false,))?;
        Ok(Table { field, first, width: field.width(layout), array: array.unbind(), view: view.unbind() })
    }

    /// Returns the array for Python.
    pub fn view<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        self.view.bind(py).clone()
    }

    /// Copies the parts of some worlds from their records, each of `record` numbers.
    pub fn fill(&self, py: Python<'_>, records: &[f64], record: usize, of: impl Iterator<Item = usize>) -> Result<()> {
        let mut array = self.array.bind(py).readwrite();
        let to = array.as_slice_mut().map_err(|e| Error::Internal(e.to_string()))?;
        for world in of {
            let from = world * record + self.first;
            to[world * self.width..(world + 1) * self.width].copy_from_slice(&records[from..from + self.width]);
        }
        Ok(())
    }
}

/// Numbers for each world: rows of their own, or one row for all.
pub struct Rows {
    data: Vec<f64>,
    width: usize,
    single: bool,
}

impl Rows {
    /// Checks the shape of an argument against the worlds and the length of a row.
    pub fn new(name: &str, given: crate::arrays::convert::Numbers, worlds: usize, width: usize) -> Result<Rows> {
        let single = given.shape == [width];
        if !single && given.shape != [worlds, width] {
            let got = shown(&given.shape);
            return Err(Error::value(format!("{name}: expected shape ({width},) or ({worlds}, {width}), got {got}")));
        }
        Ok(Rows { data: given.data, width, single })
    }

    /// Returns the numbers for a world.
    pub fn of(&self, world: usize) -> &[f64] {
        if self.single { &self.data } else { &self.data[world * self.width..(world + 1) * self.width] }
    }
}
