//! Whole numbers among the arguments of Python. `from_py_with` gets the function of the argument's name, so that a number which does not fit is a
//! value error that names the argument, the number and what would be right, and not an overflow.

use crate::errors::Error;
use pyo3::exceptions::PyOverflowError;
use pyo3::prelude::*;
use std::collections::BTreeMap;

/// A type of one or several whole numbers.
pub trait Whole: for<'a, 'py> FromPyObject<'a, 'py> {
    /// The range of a number of this type, in words.
    const EXPECTED: &'static str;
}

macro_rules! types {
    ($($kind:ty: $expected:literal,)+) => { $(impl Whole for $kind { const EXPECTED: &'static str = $expected; })+ };
}

types! {
    u8: "a whole number from 0 to 255",
    u32: "a whole number from 0 to 4294967295",
    u64: "a whole number from 0 to 2**64 - 1",
    usize: "a whole number from 0 to 2**64 - 1",
    i64: "a whole number from -2**63 to 2**63 - 1",
    [u32; 2]: "two whole numbers from 0 to 4294967295",
    [usize; 2]: "two whole numbers from 0 to 2**64 - 1",
    [usize; 3]: "three whole numbers from 0 to 2**64 - 1",
    [i32; 2]: "two whole numbers from -2147483648 to 2147483647",
    BTreeMap<String, usize>: "whole numbers from 0 to 2**64 - 1 by name",
}

impl<T: Whole> Whole for Option<T> {
    const EXPECTED: &'static str = T::EXPECTED;
}

fn named<T: Whole>(value: &Bound<'_, PyAny>, name: &str, expected: &str) -> PyResult<T> {
    value.extract::<T>().map_err(|error| {
        let error: PyErr = error.into();
        if !error.is_instance_of::<PyOverflowError>(value.py()) {
            return error;
        }
        let written: String =
            value.str().map_or_else(|_| "another number".into(), |s| s.to_string()).chars().take(40).collect();
        Error::value(format!("{name} is {written}; expected {expected}")).into()
    })
}

/// Converts the argument `substeps` of `Batch.step`: steps of a world, as those of `World.step`, and not the sub-steps in one.
pub fn steps_of_a_batch(value: &Bound<'_, PyAny>) -> PyResult<usize> {
    named(value, "substeps", "a whole number from 0 to 2**40")
}

/// Makes the functions: the range of a name is that of its type if none is given here.
macro_rules! names {
    ($($name:ident $(: $expected:literal)?,)+) => { $(
        #[doc = concat!("Converts the argument `", stringify!($name), "`.")]
        pub fn $name<T: Whole>(value: &Bound<'_, PyAny>) -> PyResult<T> {
            let [.., expected] = [T::EXPECTED $(, $expected)?];
            named(value, stringify!($name), expected)
        }
    )+ };
}

names! {
    branching,
    budget: "a whole number from 1 to 4000000000, or None",
    burst,
    capacity,
    delay: "a whole number of steps from 0 to 10000",
    depth,
    dof,
    every,
    forks,
    group: "a group from 0 to 63",
    height,
    i,
    iterations: "a whole number from 1 to 1000000",
    max,
    max_relaxations,
    n,
    nodes,
    number,
    part,
    projection_sweeps,
    resolution: "two whole numbers of pixels, above 0",
    row,
    sample_poses,
    seed,
    shape,
    size,
    spheres,
    spheres_of,
    steps,
    substeps: "a whole number from 1 to 1000",
    teeth,
    threads,
    times,
    width,
}
