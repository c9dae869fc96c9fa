//! Conversion of numbers between Python and Rust. Input is checked for its shape and for finite
//! numbers.

use crate::errors::{Error, Result};
use nalgebra::{Quaternion, Translation3, UnitQuaternion};
use numpy::{
    AllowTypeChange, PyArray1, PyArray2, PyArrayDescrMethods, PyArrayLikeDyn, PyArrayMethods, PyUntypedArray,
    PyUntypedArrayMethods,
};
use pyo3::exceptions::{PyMemoryError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::{PyList, PyTuple};
use std::path::PathBuf;
use tumble::collide::{Mat3, Pose, Quat, Vec3};

/// Largest deviation of a quaternion's length from 1.
const UNIT: f64 = 1e-6;

/// Largest size of an array: 8 GiB of numbers.
const MAX_NUMBERS: usize = 1 << 30;

/// Finite numbers and their shape, in C order.
pub struct Numbers {
    /// The shape.
    pub shape: Vec<usize>,
    /// As many numbers as the product of the shape.
    pub data: Vec<f64>,
}

/// Converts anything that numpy can make an array of, if all its numbers are finite. `what` names the argument in errors.
pub fn numbers(value: &Bound<'_, PyAny>, what: &str) -> Result<Numbers> {
    let all = any_numbers(value, what)?;
    match all.data.iter().position(|x| !x.is_finite()) {
        Some(_) if has_none(value) => Err(not_numbers(value, what)),
        Some(k) => Err(Error::value(format!("{what}: number {k} is {}; all must be finite", all.data[k]))),
        None => Ok(all),
    }
}

/// Converts anything that numpy can make an array of, such as bounds that may be infinite.
pub fn bounds(value: &Bound<'_, PyAny>, what: &str) -> Result<Numbers> {
    let all = any_numbers(value, what)?;
    match all.data.iter().any(|x| x.is_nan()) {
        true if has_none(value) => Err(not_numbers(value, what)),
        true => Err(Error::value(format!("{what}: NaN is no bound"))),
        false => Ok(all),
    }
}

fn any_numbers(value: &Bound<'_, PyAny>, what: &str) -> Result<Numbers> {
    // numpy would drop imaginary parts and convert dates to days.
    if value.cast::<PyUntypedArray>().is_ok_and(|array| b"cmMSUV".contains(&array.dtype().kind())) {
        return Err(not_numbers(value, what));
    }
    let array: PyArrayLikeDyn<'_, f64, AllowTypeChange> = value.extract().map_err(|_| not_numbers(value, what))?;
    let shape = array.shape().to_vec();
    let mut data = room(array.len(), what)?;
    // An array that numpy calls contiguous may be in column order.
    match array.as_slice() {
        Ok(slice) if array.is_c_contiguous() => data.extend_from_slice(slice),
        _ => data.extend(array.as_array().iter()),
    }
    Ok(Numbers { shape, data })
}

/// Returns whether a value is None, or a list or tuple with None in it, of which numpy makes NaN.
fn has_none(value: &Bound<'_, PyAny>) -> bool {
    let nested = value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>();
    let mut entries = value.try_iter().into_iter().filter(|_| nested).flatten().flatten();
    value.is_none() || entries.any(|entry| has_none(&entry))
}

/// Returns an empty vector with room for `len` numbers, if there is enough memory.
pub fn room(len: usize, what: &str) -> Result<Vec<f64>> {
    let mut room = Vec::new();
    let reserved = if len <= MAX_NUMBERS { room.try_reserve_exact(len).is_ok() } else { false };
    match reserved {
        true => Ok(room),
        false => {
            Err(PyMemoryError::new_err(format!("{what}: {len} numbers do not fit into memory (at most {MAX_NUMBERS})"))
                .into())
        }
    }
}

fn not_numbers(value: &Bound<'_, PyAny>, what: &str) -> Error {
    Error::value(format!("{what}: expected numbers, not {}", brief(value)))
}

/// Returns the first characters of the text of a value, for errors.
pub fn brief(value: &Bound<'_, PyAny>) -> String {
    let shown = value.repr().map_or_else(|_| "something".into(), |r| r.to_string());
    shown.chars().take(60).collect()
}

/// Converts `N` numbers in one dimension.
pub fn some<const N: usize>(value: &Bound<'_, PyAny>, what: &str) -> Result<[f64; N]> {
    let Numbers { shape, data } = numbers(value, what)?;
    if shape.as_slice() != [N] {
        return Err(Error::value(format!("{what}: expected {N} numbers, shape ({N},), got shape {}", shown(&shape))));
    }
    data.try_into().map_err(|_| Error::value(what))
}

/// Formats a shape as Python does.
pub fn shown(shape: &[usize]) -> String {
    let inner: Vec<String> = shape.iter().map(usize::to_string).collect();
    if inner.len() == 1 { format!("({},)", inner[0]) } else { format!("({})", inner.join(", ")) }
}

/// Checks that a number is finite.
pub fn number(value: f64, what: &str) -> Result<f64> {
    if value.is_finite() { Ok(value) } else { Err(Error::value(format!("{what} is {value}; it must be finite"))) }
}

/// Converts three numbers.
pub fn vec3(value: &Bound<'_, PyAny>, what: &str) -> Result<Vec3> {
    some::<3>(value, what).map(Vec3::from)
}

/// Converts three numbers, or returns the default for None.
pub fn vec3_or(value: Option<&Bound<'_, PyAny>>, what: &str, usual: Vec3) -> Result<Vec3> {
    value.map_or(Ok(usual), |value| vec3(value, what))
}

/// Converts a direction: the letter of an axis, such as ``"x"`` or ``"-z"``, or three numbers of any length.
pub fn direction(value: &Bound<'_, PyAny>, what: &str) -> Result<Vec3> {
    let Ok(word) = value.extract::<String>() else { return vec3(value, what) };
    tumble::scene::axis_by_name(&word).map(Vec3::from).ok_or_else(|| {
        Error::value(format!("{what}: `{word}` is no axis; expected x, y, z, -x, -y, -z or three numbers"))
    })
}

/// Converts a direction, or returns the default for None.
pub fn direction_or(value: Option<&Bound<'_, PyAny>>, what: &str, usual: Vec3) -> Result<Vec3> {
    value.map_or(Ok(usual), |value| direction(value, what))
}

/// Converts a unit quaternion `x, y, z, w`. A length within 1e-6 of 1 is normalized.
pub fn rotation(value: &Bound<'_, PyAny>, what: &str) -> Result<Quat> {
    let [x, y, z, w] = some::<4>(value, what)?;
    let q = Quaternion::new(w, x, y, z);
    let norm = q.norm();
    if (norm - 1.0).abs() > UNIT {
        return Err(Error::value(format!("{what}: the quaternion (x, y, z, w) has length {norm}; it must be 1")));
    }
    Ok(UnitQuaternion::from_quaternion(q))
}

/// Converts a position and an orientation to a pose; omitted ones are those of the identity.
pub fn pose(position: Option<&Bound<'_, PyAny>>, orientation: Option<&Bound<'_, PyAny>>) -> Result<Pose> {
    let position = vec3_or(position, "position", Vec3::zeros())?;
    let rotation = orientation.map_or(Ok(Quat::identity()), |q| self::rotation(q, "orientation"))?;
    Ok(Pose::from_parts(Translation3::from(position), rotation))
}

/// Converts 3 or 7 numbers to a pose.
pub fn base_pose(base: &Bound<'_, PyAny>) -> Result<Pose> {
    let Numbers { shape, data } = numbers(base, "base")?;
    match shape.as_slice() {
        [3] => Ok(Vec3::from_column_slice(&data).into()),
        [7] if (data[3..].iter().map(|x| x * x).sum::<f64>().sqrt() - 1.0).abs() <= 1e-6 => {
            Ok(Pose::from_parts(Vec3::from_column_slice(&data[..3]).into(), unit(&data[3..])))
        }
        [7] => Err(Error::value("base: the quaternion (x, y, z, w) in its last four numbers must have length 1")),
        _ => Err(Error::value(format!(
            "base: expected a position, shape (3,), or position and quaternion, shape (7,), got {}",
            shown(&shape)
        ))),
    }
}

/// Returns a pose as 7 numbers: position, quaternion `x, y, z, w`.
pub fn pose_numbers(pose: &Pose) -> [f64; 7] {
    let (p, q) = (pose.translation.vector, pose.rotation.coords);
    [p.x, p.y, p.z, q.x, q.y, q.z, q.w]
}

/// Returns the rotation of four numbers `x, y, z, w`, normalized.
pub fn unit(q: &[f64]) -> Quat {
    UnitQuaternion::from_quaternion(Quaternion::new(q[3], q[0], q[1], q[2]))
}

/// Converts a path: `str` or `os.PathLike`.
pub fn path(value: &Bound<'_, PyAny>) -> Result<PathBuf> {
    Ok(value.extract().map_err(|_| PyTypeError::new_err("expected a path: str or os.PathLike"))?)
}

/// Returns a numpy array of one dimension.
pub fn array<'py>(py: Python<'py>, values: &[f64]) -> Bound<'py, PyArray1<f64>> {
    PyArray1::from_slice(py, values)
}

/// Returns the three numbers of a vector.
pub fn vector<'py>(py: Python<'py>, v: &Vec3) -> Bound<'py, PyArray1<f64>> {
    array(py, v.as_slice())
}

/// Returns a quaternion as `x, y, z, w`.
pub fn quaternion<'py>(py: Python<'py>, q: &Quat) -> Bound<'py, PyArray1<f64>> {
    array(py, q.coords.as_slice())
}

/// Returns a symmetric matrix.
pub fn symmetric<'py>(py: Python<'py>, m: &Mat3) -> Result<Bound<'py, PyArray2<f64>>> {
    Ok(array(py, m.as_slice()).reshape([3, 3])?)
}
