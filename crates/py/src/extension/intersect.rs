//! Intersection tests written in Python.

use crate::arrays::convert::{array, brief, quaternion, some, vector};
use crate::errors::{Error, Result};
use crate::extension::code::lock;
use crate::objects::shapes::Shape;
use crate::world::gc::Callable;
use crate::world::pickling::ShapeRecord;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use std::sync::Mutex;
use tumble::collide::{Contact, NormalFrom, Pose, Vec3};
use tumble::dynamics::{Intersect, IntersectPart};

/// An object with `contacts`, and its pending exception.
pub struct PythonTest {
    pub object: Callable,
    raised: Mutex<Option<PyErr>>,
}

impl PythonTest {
    pub fn new(object: Callable) -> PythonTest {
        PythonTest { object, raised: Mutex::default() }
    }

    /// Takes the exception of the last call that raised.
    pub fn take_raised(&self) -> Option<PyErr> {
        lock(&self.raised).take()
    }
}

impl Intersect for PythonTest {
    fn contacts(&self, own: &IntersectPart, other: &IntersectPart, margin: f64, out: &mut Vec<Contact>) -> bool {
        // After an error the rest of the frame is discarded.
        if lock(&self.raised).is_some() {
            return true;
        }
        let found = Python::attach(|py| -> Result<Option<Vec<Contact>>> {
            let returned = self.object.bind(py).call_method1("contacts", (part(py, own)?, part(py, other)?, margin))?;
            if returned.is_none() {
                return Ok(None);
            }
            let Ok(each) = returned.try_iter() else { return Err(no_list(&returned, own)) };
            let each = each.enumerate().map(|(number, touch)| contact(&touch?, number, &name_of(own)));
            each.collect::<Result<Vec<Contact>>>().map(Some)
        });
        match found {
            Ok(Some(contacts)) => {
                out.extend(contacts.into_iter().filter(|contact| contact.gap <= margin));
                true
            }
            Ok(None) => false,
            Err(why) => {
                *lock(&self.raised) = Some(why.into());
                true
            }
        }
    }
}

/// Returns the error of a test whose `contacts` returns something else than contacts.
fn no_list(returned: &Bound<'_, PyAny>, own: &IntersectPart) -> Error {
    Error::value(format!(
        "the intersection test of '{}': `contacts` returned {}; expected a list of tuples (point, normal, gap), empty if nothing touches, or None, which leaves the pair to the shapes",
        name_of(own),
        brief(returned)
    ))
}

fn name_of(part: &IntersectPart) -> String {
    part.name().to_string()
}

/// Makes the `IntersectPart` of Python.
fn part<'py>(py: Python<'py>, part: &IntersectPart) -> Result<Bound<'py, PyAny>> {
    let words = format!("<tumble.Shape of '{}'>", name_of(part));
    let shape = Shape::of_record(
        py,
        ShapeRecord { solid: part.shape.clone(), placement: Pose::identity(), name: None, words },
    )?;
    let (position, orientation) = (vector(py, &part.pose.translation.vector), quaternion(py, &part.pose.rotation));
    let matrix = array(py, part.pose.rotation.to_rotation_matrix().matrix().transpose().as_slice());
    let matrix = matrix.call_method1("reshape", ((3, 3),))?;
    let class = py.import("tumble._values")?.getattr("IntersectPart")?;
    let (link, shape_name) = (part.link().map(str::to_owned), part.shape_name().map(str::to_owned));
    Ok(class.call1((name_of(part), part.part, position, orientation, matrix, shape, link, shape_name))?)
}

/// Converts `(point, normal, gap[, feature[, core_own[, core_other]]])`.
fn contact(touch: &Bound<'_, PyAny>, number: usize, name: &str) -> Result<Contact> {
    let wrong = |what: &str| Error::value(format!("the intersection test of '{name}': {what}"));
    let touch = touch
        .cast::<PyTuple>()
        .map_err(|_| wrong(&format!("contact {number} is {}; expected a tuple (point, normal, gap)", brief(touch))))?;
    if !(3..=6).contains(&touch.len()) {
        return Err(wrong("expected tuples of 3 to 6 entries: point, normal, gap, feature, core_own, core_other"));
    }
    let number_at = |k: usize| -> Result<f64> {
        if k >= touch.len() {
            return Ok(0.0);
        }
        let entry = touch.get_item(k)?;
        let value: f64 = entry.extract().map_err(|_| {
            let what = ["point", "normal", "gap", "feature", "core_own", "core_other"][k];
            wrong(&format!("{what} of contact {number} is {}; expected a number", brief(&entry)))
        })?;
        if value.is_finite() { Ok(value) } else { Err(wrong("a number that is not finite")) }
    };
    let vector_at = |k: usize, what| Ok::<_, Error>(Vec3::from(some::<3>(&touch.get_item(k)?, what)?));
    let normal = vector_at(1, "normal")?;
    let normal = normal.try_normalize(1e-12).ok_or_else(|| wrong("a normal without length"))?;
    let (core_a, core_b) = (number_at(4)?, number_at(5)?);
    if core_a < 0.0 || core_b < 0.0 {
        return Err(wrong("a core distance below 0"));
    }
    let feature = match touch.get_item(3) {
        Ok(entry) => entry.extract().map_err(|_| {
            wrong(&format!("feature of contact {number} is {}; expected a whole number from 0", brief(&entry)))
        })?,
        Err(_) => number as u64,
    };
    let normal_from = match (core_a > 0.0, core_b > 0.0) {
        (false, _) => NormalFrom::FaceOfA,
        (true, false) => NormalFrom::FaceOfB,
        (true, true) => NormalFrom::CorePoints,
    };
    Ok(Contact {
        point: vector_at(0, "point")?,
        normal,
        gap: number_at(2)?,
        feature,
        core_a,
        core_b,
        normal_from,
        shapes: [0; 2],
    })
}
