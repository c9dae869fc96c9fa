//! Names of the shapes of bodies and links, and their numbers.

use crate::errors::{Error, Result};
use crate::objects::articulation::Articulation;
use crate::objects::binding::{Binding, Source};
use crate::objects::body::RigidBody;
use pyo3::prelude::*;
use tumble::dynamics::ArticulatedBody;

/// Returns the error of a name that no shape has.
fn unknown(owner: &str, name: &str, known: Vec<String>) -> Error {
    let known: Vec<String> = known.into_iter().take(12).collect();
    Error::Name(match known.is_empty() {
        true => format!("{owner} has no shape named '{name}'; its shapes have no names"),
        false => format!("{owner} has no shape named '{name}'; there are {}", known.join(", ")),
    })
}

#[pymethods]
impl RigidBody {
    /// Names of its shapes by the numbers that contacts and hits report, the parts of a ``Compound``; None for those
    /// without one.
    #[getter]
    fn shape_names(&self) -> Result<Vec<Option<String>>> {
        self.constant(|body| (0..body.shape().part_count()).map(|n| body.shape_name(n).map(str::to_owned)).collect())
    }

    /// Returns the number of the shape of that name.
    pub(super) fn shape_number(&self, name: &str) -> Result<usize> {
        let found = self.constant(|body| body.shape_named(name))?;
        found.ok_or_else(|| {
            let known = self.shape_names().unwrap_or_default().into_iter().flatten().collect();
            unknown(&format!("body '{}'", self.place.name), name, known)
        })
    }
}

impl Articulation {
    /// Reads the body: that of the world, or a description made by a program. The shapes of a file are read when it is added
    /// to a world.
    pub(super) fn of_body<T>(&self, get: impl FnOnce(&ArticulatedBody) -> T) -> Result<T> {
        match &self.spot {
            Binding::Placed(place) => place.read(|inner| inner.world.get::<ArticulatedBody>(place.id).map(get)),
            Binding::Free { source: Source::Built(body), .. } => Ok(get(body)),
            Binding::Free { source: Source::File { .. }, .. } => Err(Error::value(format!(
                "'{}' is a description of a file, whose shapes are read when it is added to a world",
                self.name
            ))),
        }
    }
}

#[pymethods]
impl Articulation {
    /// Names of the shapes that collide, by links as in ``link_names`` and by the numbers that contacts and hits report;
    /// None for those without one.
    ///
    /// A fixed link has its own shapes, although it moves with the link that carries it.
    #[getter]
    fn shape_names(&self) -> Result<Vec<Vec<Option<String>>>> {
        self.of_body(|body| {
            let names = |link| body.shapes_of(link).map(|(_, _, name)| name.map(str::to_owned)).collect();
            (0..body.model().frames().len()).map(names).collect()
        })
    }

    /// Returns the number of the shape of that name on a link, which may be a fixed one; that of contacts with the link.
    pub(super) fn shape_number(&self, link: &str, name: &str) -> Result<usize> {
        self.robot.frame(link)?;
        let found = self.of_body(|body| {
            let (part, shape) = body.shape_named(link, name)?;
            Some(body.shape_number(part, shape))
        })?;
        let known = || {
            self.of_body(|body| {
                let shapes = body.model().frame_index(link).map(|link| body.shapes_of(link));
                shapes.into_iter().flatten().filter_map(|(_, _, own)| own.map(str::to_owned)).collect()
            })
        };
        match found {
            Some(number) => Ok(number),
            None => Err(unknown(&format!("link '{link}'"), name, known()?)),
        }
    }
}
