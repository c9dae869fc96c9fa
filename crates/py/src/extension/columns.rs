//! The numpy arrays of a view, which are reused from call to call.

use crate::arrays::state::holders;
use crate::errors::{Error, Result};
use crate::extension::layout::Layout;
use numpy::{PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use std::sync::Arc;
use tumble::collide::Vec3;
use tumble::dynamics::{PartState, Wrench};

/// Numbers of a row: position, quaternion, velocity, angular velocity, acceleration, angular acceleration.
const WIDTHS: [usize; 6] = [3, 4, 3, 3, 3, 3];

/// An array that is written here, and a read-only view of it. Python gets views of the latter.
type Column = (Py<PyArray2<f64>>, Py<PyAny>);

/// The arrays of a view.
pub struct Arrays {
    rows: usize,
    /// In the order of [`WIDTHS`].
    pub shown: [Column; 6],
    pub force: Py<PyArray2<f64>>,
    pub torque: Py<PyArray2<f64>>,
}

impl Arrays {
    /// Returns arrays with that number of rows.
    pub fn new(py: Python<'_>, rows: usize) -> Result<Arrays> {
        let zeros = |width| PyArray2::zeros(py, [rows, width], false);
        let mut shown = Vec::with_capacity(WIDTHS.len());
        for width in WIDTHS {
            let array = zeros(width);
            let view = array.call_method0("view")?;
            view.call_method1("setflags", (false,))?;
            shown.push((array.unbind(), view.unbind()));
        }
        let shown = shown.try_into().map_err(|_| Error::Internal("one array for each column".into()))?;
        Ok(Arrays { rows, shown, force: zeros(3).unbind(), torque: zeros(3).unbind() })
    }

    /// Returns whether the arrays may be reused: Python has no reference to them or to a view of
    /// one.
    pub fn free(self: &Arc<Arrays>, py: Python<'_>, rows: usize) -> bool {
        let own = |(array, view): &Column| holders(array, py) == 2 && holders(view, py) == 1;
        let wrenches = [&self.force, &self.torque].iter().all(|array| holders(array, py) == 1);
        self.rows == rows && Arc::strong_count(self) == 1 && wrenches && self.shown.iter().all(own)
    }

    /// Writes the part states and zeroes forces and torques.
    pub fn fill(&self, py: Python<'_>, part_states: &[PartState]) -> Result<()> {
        let [position, orientation, velocity, angular_velocity, acceleration, angular_acceleration] = &self.shown;
        copy(py, position, part_states, |s| s.position().into())?;
        copy(py, orientation, part_states, |s| s.pose.rotation.coords.into())?;
        copy(py, velocity, part_states, |s| s.velocity.into())?;
        copy(py, angular_velocity, part_states, |s| s.angular_velocity.into())?;
        copy(py, acceleration, part_states, |s| s.acceleration.into())?;
        copy(py, angular_acceleration, part_states, |s| s.angular_acceleration.into())?;
        for array in [&self.force, &self.torque] {
            array.bind(py).try_readwrite().map_err(PyErr::from)?.as_slice_mut().map_err(PyErr::from)?.fill(0.0);
        }
        Ok(())
    }

    /// Returns the forces and torques that a callback added, by row.
    pub fn take(
        &self,
        py: Python<'_>,
        layout: &Layout,
        whose: &str,
        mut each: impl FnMut(usize, Wrench),
    ) -> Result<()> {
        let (force, torque) = (
            self.force.bind(py).try_readonly().map_err(PyErr::from)?,
            self.torque.bind(py).try_readonly().map_err(PyErr::from)?,
        );
        let (force, torque) = (force.as_slice().map_err(PyErr::from)?, torque.as_slice().map_err(PyErr::from)?);
        for (what, numbers) in [("force", force), ("torque", torque)] {
            if let Some(k) = numbers.iter().position(|x| !x.is_finite()) {
                let name = layout.owner(k / 3).map_or("nothing", |(_, _, name)| name);
                return Err(Error::value(format!(
                    "'{whose}': its {what} on '{name}' is {}; it must be finite",
                    numbers[k]
                )));
            }
        }
        for (row, (force, torque)) in force.chunks_exact(3).zip(torque.chunks_exact(3)).enumerate() {
            each(row, Wrench { force: Vec3::from_column_slice(force), torque: Vec3::from_column_slice(torque) });
        }
        Ok(())
    }
}

/// Writes one row for each part state.
fn copy<const N: usize>(
    py: Python<'_>,
    (array, _): &Column,
    part_states: &[PartState],
    get: impl Fn(&PartState) -> [f64; N],
) -> Result<()> {
    let mut out = array.bind(py).try_readwrite().map_err(PyErr::from)?;
    let rows = out.as_slice_mut().map_err(PyErr::from)?.as_chunks_mut().0;
    rows.iter_mut().zip(part_states).for_each(|(row, part_state)| *row = get(part_state));
    Ok(())
}
