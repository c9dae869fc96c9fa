//! Queries of the geometry: conversion of arguments and results.

use crate::arrays::convert::{Numbers, number, numbers, pose, shown, vec3};
use crate::errors::{Error, Result};
use crate::objects::place::body_ids;
use crate::objects::shapes::Shape;
use crate::world::contacts::{link, shape_number};
use crate::world::inner::Inner;
use crate::world::shared::Shared;
use crate::world::target::target;
use nalgebra::Translation3;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyInt, PyList, PyTuple};
use std::collections::BTreeMap;
use std::sync::Arc;
use tumble::collide::{Pose, Vec3};
use tumble::dynamics::{ArticulatedBody, BodyDistance, CollisionGroup, ObjectId, QueryFilter, Ray};

/// A field of a structured array: name, whether it holds integers, shape.
type Field = (&'static str, bool, &'static [usize]);

const BODY: Field = ("body", true, &[]);
const PART: Field = ("part", true, &[]);
const SHAPE: Field = ("shape", true, &[]);
const NORMAL: Field = ("normal", false, &[3]);
const POINT: Field = ("point", false, &[3]);
const DISTANCE: Field = ("distance", false, &[]);
const DEPTH: Field = ("depth", false, &[]);

/// Rows of a structured array; all numbers have 8 bytes.
struct Rows {
    fields: &'static [Field],
    bytes: Vec<u8>,
}

impl Rows {
    fn new(fields: &'static [Field]) -> Rows {
        Rows { fields, bytes: Vec::new() }
    }

    fn whole(&mut self, numbers: &[i64]) {
        numbers.iter().for_each(|k| self.bytes.extend_from_slice(&k.to_le_bytes()));
    }

    fn real<'a>(&mut self, numbers: impl IntoIterator<Item = &'a f64>) {
        numbers.into_iter().for_each(|x| self.bytes.extend_from_slice(&x.to_le_bytes()));
    }

    /// Returns the array, in one dimension.
    fn array<'py>(self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        let fields = self.fields.iter().map(|&(name, whole, shape)| {
            let kind = if whole { "<i8" } else { "<f8" };
            (name, kind, PyTuple::new(py, shape)?).into_pyobject(py)
        });
        let fields = fields.collect::<PyResult<Vec<_>>>()?;
        let kind = py.import("numpy")?.call_method1("dtype", (PyList::new(py, fields)?,))?;
        Ok(PyArray1::from_vec(py, self.bytes).call_method1("view", (kind,))?)
    }

    /// Returns the first row, or None.
    fn first<'py>(self, py: Python<'py>) -> Result<Option<Bound<'py, PyAny>>> {
        match self.bytes.is_empty() {
            true => Ok(None),
            false => Ok(Some(self.array(py)?.get_item(0)?)),
        }
    }
}

/// The numbers of the bodies in `world.bodies`.
pub struct Numbering(BTreeMap<ObjectId, i64>);

impl Numbering {
    pub fn of(inner: &Inner) -> Numbering {
        Numbering((0..).zip(body_ids(&inner.world)).map(|(number, id)| (id, number)).collect())
    }

    /// Returns the number of a body, the index of its link, and the number of its shape.
    pub fn sides(&self, inner: &Inner, id: ObjectId, part: usize, shape: usize) -> [i64; 3] {
        [self.0.get(&id).copied().unwrap_or(-1), link(inner, id, part), shape_number(inner, id, part, shape)]
    }
}

/// The arguments that select bodies.
pub struct Selection<'a, 'py> {
    pub group: u8,
    pub mask: Option<&'a Bound<'py, PyAny>>,
    pub ignore: Option<&'a Bound<'py, PyAny>>,
    pub as_body: Option<&'a Bound<'py, PyAny>>,
}

impl Selection<'_, '_> {
    /// Returns the filter of these arguments.
    fn filter(&self, shared: &Arc<Shared>) -> Result<QueryFilter> {
        let mut filter = QueryFilter { group: group(self.group)?, mask: mask(self.mask)?, ..QueryFilter::default() };
        if let Some(ignore) = self.ignore {
            match named(shared, ignore) {
                Ok(one) => filter = without(filter, one),
                Err(_) if !ignore.is_instance_of::<pyo3::types::PyString>() && ignore.try_iter().is_ok() => {
                    for body in ignore.try_iter()? {
                        filter = without(filter, named(shared, &body?)?);
                    }
                }
                Err(error) => return Err(error),
            }
        }
        if let Some(body) = self.as_body {
            filter = match named(shared, body)? {
                (id, None) => filter.acting_as(id),
                (id, Some(parts)) => filter.acting_as_parts(id, parts),
            };
        }
        Ok(filter)
    }
}

fn without(filter: QueryFilter, (id, parts): (ObjectId, Option<Vec<usize>>)) -> QueryFilter {
    match parts {
        None => filter.ignoring(id),
        Some(parts) => filter.ignoring_parts(id, parts),
    }
}

/// Converts what names a body or a link, with the parts that are the shapes of the link.
pub fn named(shared: &Arc<Shared>, value: &Bound<'_, PyAny>) -> Result<(ObjectId, Option<Vec<usize>>)> {
    let target = target(shared, value)?;
    Ok((target.id, shared.read(|inner| target.parts(inner))?))
}

/// Converts the number of a collision group.
pub fn group(number: u8) -> Result<CollisionGroup> {
    CollisionGroup::new(number).ok_or_else(|| Error::value(format!("group is {number}; it must be 0 to 63")))
}

/// Converts a mask: None for all groups, the bits of an integer, or a sequence of groups.
pub fn mask(value: Option<&Bound<'_, PyAny>>) -> Result<u64> {
    let Some(value) = value else { return Ok(u64::MAX) };
    if value.is_instance_of::<PyInt>() {
        let wrong = "expected the bits of an integer from 0 to 2**64 - 1, a sequence of groups, or None for all";
        return value.extract::<u64>().map_err(|_| Error::value(format!("mask is {value}; {wrong}")));
    }
    let wrong = |_| Error::value("mask: expected the bits of an integer, or a sequence of groups from 0 to 63");
    let groups: Vec<u8> = value.extract().map_err(wrong)?;
    groups.into_iter().try_fold(0, |mask, number| Ok(mask | group(number)?.bit()))
}

/// Returns vectors in a row, and whether there was more than one dimension.
fn vectors(value: &Bound<'_, PyAny>, what: &str) -> Result<(Vec<Vec3>, bool)> {
    let Numbers { shape, data } = numbers(value, what)?;
    let many = match shape.as_slice() {
        [3] => false,
        [_, 3] => true,
        _ => return Err(Error::value(format!("{what}: expected shape (3,) or (n, 3), got {}", shown(&shape)))),
    };
    Ok((data.chunks_exact(3).map(Vec3::from_column_slice).collect(), many))
}

/// Checks a distance, which may be infinite.
fn length(value: f64, what: &str) -> Result<f64> {
    if value >= 0.0 { Ok(value) } else { Err(Error::value(format!("{what} is {value}; it must be at least 0"))) }
}

/// Returns the pose of a shape's solid, for a pose of the frame that the user places.
fn placed(shape: &Shape, at: Pose) -> Pose {
    at * shape.placement * Translation3::from(shape.solid.center_of_mass())
}

/// Returns the hits of rays.
pub fn cast_rays<'py>(
    shared: &Arc<Shared>,
    py: Python<'py>,
    origins: &Bound<'_, PyAny>,
    directions: &Bound<'_, PyAny>,
    max_distance: Option<&Bound<'_, PyAny>>,
    selection: &Selection<'_, '_>,
) -> Result<Bound<'py, PyAny>> {
    let ((origins, _), directions) = (
        vectors(origins, "origins")?,
        match directions.is_instance_of::<pyo3::types::PyString>() {
            true => vec![crate::arrays::convert::direction(directions, "directions")?],
            false => vectors(directions, "directions")?.0,
        },
    );
    let count = if origins.len() == 1 { directions.len() } else { origins.len() };
    if directions.len() != count && directions.len() != 1 {
        let (n, m) = (origins.len(), directions.len());
        return Err(Error::value(format!("{n} origins and {m} directions; expected as many, or one of either")));
    }
    if let Some(k) = directions.iter().position(|d| d.norm() == 0.0) {
        return Err(Error::value(format!("directions: number {k} has no length")));
    }
    let lengths = match max_distance {
        None => vec![f64::INFINITY],
        Some(value) => match value.extract::<f64>() {
            Ok(one) => vec![length(one, "max_distance")?],
            Err(_) => {
                let Numbers { shape, data } = numbers(value, "max_distance")?;
                if shape != [count] {
                    let shape = shown(&shape);
                    return Err(Error::value(format!("max_distance: expected one number or ({count},), got {shape}")));
                }
                data.into_iter().map(|x| length(x, "max_distance")).collect::<Result<_>>()?
            }
        },
    };
    let pick = |k: usize, len: usize| if len == 1 { 0 } else { k };
    let rays: Vec<Ray> = (0..count)
        .map(|k| Ray {
            origin: origins[pick(k, origins.len())],
            direction: directions[pick(k, directions.len())],
            max_distance: lengths[pick(k, lengths.len())],
        })
        .collect();
    let filter = selection.filter(shared)?;
    const FIELDS: &[Field] = &[DISTANCE, BODY, PART, SHAPE, ("face", true, &[]), NORMAL];
    let rows = py.detach(|| {
        shared.read(|inner| {
            let (hits, numbering) = (inner.world.cast_rays(&rays, &filter), Numbering::of(inner));
            let mut rows = Rows { fields: FIELDS, bytes: Vec::with_capacity(hits.len() * 8 * 8) };
            for hit in hits {
                match hit {
                    Some(hit) => {
                        rows.real([&hit.distance]);
                        rows.whole(&numbering.sides(inner, hit.id, hit.part, hit.shape));
                        rows.whole(&[i64::from(hit.face)]);
                        rows.real(hit.normal.iter());
                    }
                    None => {
                        rows.real([&f64::INFINITY]);
                        rows.whole(&[-1; 4]);
                        rows.real(Vec3::zeros().iter());
                    }
                }
            }
            Ok(rows)
        })
    })?;
    rows.array(py)
}

/// Returns the bodies that overlap a shape.
pub fn overlaps<'py>(
    shared: &Arc<Shared>,
    py: Python<'py>,
    shape: &Shape,
    (position, orientation): (Option<&Bound<'_, PyAny>>, Option<&Bound<'_, PyAny>>),
    selection: &Selection<'_, '_>,
) -> Result<Bound<'py, PyAny>> {
    let (at, filter) = (placed(shape, pose(position, orientation)?), selection.filter(shared)?);
    let rows = shared.read(|inner| {
        let (mut rows, numbering) = (Rows::new(&[BODY, PART, SHAPE, DEPTH]), Numbering::of(inner));
        for found in inner.world.overlaps(&shape.solid, &at, &filter) {
            rows.whole(&numbering.sides(inner, found.id, found.part, found.shape));
            rows.real([&found.depth]);
        }
        Ok(rows)
    })?;
    rows.array(py)
}

/// Returns the numbers of the bodies that contain a point.
pub fn contains<'py>(
    shared: &Arc<Shared>,
    py: Python<'py>,
    point: &Bound<'_, PyAny>,
    selection: &Selection<'_, '_>,
) -> Result<Bound<'py, PyArray1<i64>>> {
    let (point, filter) = (vec3(point, "point")?, selection.filter(shared)?);
    let mut bodies = shared.read(|inner| {
        let numbering = Numbering::of(inner);
        Ok(inner
            .world
            .contains(&point, &filter)
            .into_iter()
            .map(|(id, part)| numbering.sides(inner, id, part, 0)[0])
            .collect::<Vec<i64>>())
    })?;
    bodies.dedup();
    Ok(PyArray1::from_vec(py, bodies))
}

/// Returns the depth of points.
pub fn point_depth<'py>(
    shared: &Arc<Shared>,
    py: Python<'py>,
    points: &Bound<'_, PyAny>,
    selection: &Selection<'_, '_>,
) -> Result<Bound<'py, PyAny>> {
    let ((points, many), filter) = (vectors(points, "points")?, selection.filter(shared)?);
    let rows = py.detach(|| {
        shared.read(|inner| {
            let (mut rows, numbering) = (Rows::new(&[DEPTH, BODY, PART, SHAPE, POINT, NORMAL]), Numbering::of(inner));
            for point in &points {
                match inner.world.point_depth(point, &filter) {
                    Some(found) => {
                        rows.real([&found.depth]);
                        rows.whole(&numbering.sides(inner, found.id, found.part, found.shape));
                        rows.real(found.point.iter().chain(found.normal.iter()));
                    }
                    None => {
                        rows.real([&f64::NEG_INFINITY]);
                        rows.whole(&[-1; 3]);
                        rows.real([&0.0; 6]);
                    }
                }
            }
            Ok(rows)
        })
    })?;
    let array = rows.array(py)?;
    if many { Ok(array) } else { Ok(array.get_item(0)?) }
}

/// Returns the closest points of two bodies, or of a shape and a body.
pub fn closest_points<'py>(
    shared: &Arc<Shared>,
    py: Python<'py>,
    a: &Bound<'_, PyAny>,
    b: Option<&Bound<'_, PyAny>>,
    (position, orientation): (Option<&Bound<'_, PyAny>>, Option<&Bound<'_, PyAny>>),
    selection: &Selection<'_, '_>,
) -> Result<Option<Bound<'py, PyAny>>> {
    const PAIR: &[usize] = &[2];
    const FIELDS: &[Field] = &[
        DISTANCE,
        ("bodies", true, PAIR),
        ("parts", true, PAIR),
        ("shapes", true, PAIR),
        ("points", false, &[2, 3]),
        NORMAL,
    ];
    let row = |inner: &Inner, found: Option<BodyDistance>| {
        let mut rows = Rows::new(FIELDS);
        if let Some(found) = found {
            let numbering = Numbering::of(inner);
            let [shape_a, shape_b] = found.shapes;
            let side = |(id, part): (ObjectId, usize), shape| numbering.sides(inner, id, part, shape);
            let (a, b) = (found.a.map_or([-1; 3], |a| side(a, shape_a)), side(found.b, shape_b));
            rows.real([&found.distance]);
            (0..3).for_each(|k| rows.whole(&[a[k], b[k]]));
            rows.real(found.points.iter().flat_map(|p| p.iter()).chain(found.normal.iter()));
        }
        Ok(rows)
    };
    let rows = match a.extract::<PyRef<'_, Shape>>() {
        Ok(shape) => {
            let (at, mut filter) = (placed(&shape, pose(position, orientation)?), selection.filter(shared)?);
            if let Some(b) = b {
                let (only, parts) = named(shared, b)?;
                shared.read(|inner| {
                    filter.ignored.extend(inner.world.ids().iter().filter(|&&id| id != only));
                    let body = inner.world.get::<ArticulatedBody>(only).filter(|_| parts.is_some());
                    let others = body.map_or(0..0, |body| 0..body.model().links().len() + 1 + body.colliders().count());
                    filter = std::mem::take(&mut filter)
                        .ignoring_parts(only, others.filter(|part| !parts.iter().flatten().any(|own| own == part)));
                    Ok(())
                })?;
            }
            shared.read(|inner| row(inner, inner.world.closest_to_shape(&shape.solid, &at, f64::INFINITY, &filter)))?
        }
        Err(_) => {
            let Some(b) = b else { return Err(Error::value("closest_points: b is missing; expected a body")) };
            if position.is_some() || orientation.is_some() {
                return Err(Error::value("closest_points: position and orientation are those of a shape; a is a body"));
            }
            let ((a, parts_a), (b, parts_b)) = (named(shared, a)?, named(shared, b)?);
            shared.read(|inner| {
                row(inner, inner.world.closest_points_of((a, parts_a.as_deref()), (b, parts_b.as_deref()))?)
            })?
        }
    };
    rows.first(py)
}

/// Returns the first body that a moved shape touches.
#[allow(clippy::too_many_arguments, reason = "Python's arguments")]
pub fn cast_shape<'py>(
    shared: &Arc<Shared>,
    py: Python<'py>,
    shape: &Shape,
    direction: &Bound<'_, PyAny>,
    max_distance: f64,
    (position, orientation): (Option<&Bound<'_, PyAny>>, Option<&Bound<'_, PyAny>>),
    selection: &Selection<'_, '_>,
) -> Result<Option<Bound<'py, PyAny>>> {
    let (direction, max_distance) =
        (crate::arrays::convert::direction(direction, "direction")?, number(max_distance, "max_distance")?);
    if direction.norm() == 0.0 {
        return Err(Error::value("direction has no length"));
    }
    let max_distance = length(max_distance, "max_distance")?;
    let (at, filter) = (placed(shape, pose(position, orientation)?), selection.filter(shared)?);
    let rows = shared.read(|inner| {
        let mut rows = Rows::new(&[DISTANCE, BODY, PART, SHAPE, POINT, NORMAL]);
        if let Some(hit) = inner.world.cast_shape(&shape.solid, &at, &direction, max_distance, &filter) {
            rows.real([&hit.distance]);
            rows.whole(&Numbering::of(inner).sides(inner, hit.id, hit.part, hit.shape));
            rows.real(hit.point.iter().chain(hit.normal.iter()));
        }
        Ok(rows)
    })?;
    rows.first(py)
}
