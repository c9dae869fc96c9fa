//! Intersection tests of links.

use crate::errors::{Error, Result};
use crate::keywords::{self, Unknown};
use crate::objects::articulation::Articulation;
use crate::objects::shape_material::Which;
use pyo3::prelude::*;

#[pymethods]
impl Articulation {
    /// Gives the shapes of a link of a body in a world an intersection test of their own, or takes it for None: a function that
    /// decides with what the link collides.
    ///
    /// test: an object of a subclass of ``tumble.Intersect``, or None. shape: one shape only, by name or number as ``shapes`` of
    /// contacts has it; the whole compound for a part of one. Shapes of other links that are fixed to it are not meant.
    #[pyo3(signature = (link, test, shape=None, **unknown), text_signature = "($self, link, test, shape=None)")]
    fn set_intersect(
        &self,
        py: Python<'_>,
        link: &str,
        test: Option<&Bound<'_, PyAny>>,
        shape: Option<Which>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<()> {
        keywords::check(unknown, "Articulation.set_intersect")?;
        if let Some(test) = test {
            py.import("tumble._extension")?.call_method1("check_intersect", (test,))?;
        }
        let place = self.in_world()?;
        self.robot.frame(link)?;
        let only = shape.map(|shape| self.of_link(link, shape)).transpose()?.map(|(part, _)| part);
        // each collider by its first shape
        let numbers: Vec<usize> = self.of_body(|body| {
            let shapes = body.model().frame_index(link).into_iter().flat_map(|frame| body.shapes_of(frame)).enumerate();
            let meant = |part: usize, shape: usize| shape == 0 && only.is_none_or(|only| only == part);
            shapes.filter(|(_, (part, shape, _))| meant(*part, *shape)).map(|(number, _)| number).collect()
        })?;
        if numbers.is_empty() {
            return Err(Error::value(format!("link '{link}' has no shape that collides")));
        }
        place.shared.extend(py, |inner| {
            numbers.iter().try_for_each(|number| inner.set_test(place.id, Some((link.into(), *number)), test))
        })
    }
}
