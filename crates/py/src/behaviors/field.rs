//! Force fields.

#![allow(clippy::approx_constant, reason = "defaults that Python shows as numbers")]

use crate::arrays::convert::{direction_or, vec3, vec3_or};
use crate::arrays::whole;
use crate::behaviors;
use crate::errors::{Error, Result};
use crate::keywords::{self, Unknown};
use crate::world::add::own_place;
use crate::world::shared::Shared;
use pyo3::prelude::*;
use std::sync::Arc;
use tumble::behaviors::{Attractor, Buoyancy, DragLaw, Explosion, Panel as Flat, Panels, Targets, Wind};
use tumble::collide::Vec3;

/// A law of force on bodies, given to ``World.add_field``; made by one of its static methods.
#[pyclass(frozen, module = "tumble")]
pub struct Field {
    law: Law,
}

enum Law {
    Wind { velocity: Vec3, law: DragLaw },
    Attractor { position: Vec3, strength: f64, softening: f64 },
    Explosion { position: Vec3, impulse: f64, start: f64, decay: f64 },
    Buoyancy { surface: Vec3, density: f64, drag: f64, current: Vec3 },
    Panels { density: f64, wind: Vec3, panels: Vec<Py<Panel>> },
}

/// A flat surface on a body with lift and drag, for ``Field.panels``.
///
/// body: handle or name; part: of an articulation, the index of a link. point: its middle, and normal, of any length:
/// shape (3,), in the frame of the part, m. area: m². lift_slope: of the lift over the angle of attack, 1/rad, 2π of a
/// thin airfoil. drag: coefficient along the panel.
#[pyclass(frozen, module = "tumble")]
pub struct Panel {
    body: Py<PyAny>,
    flat: [f64; 3],
    part: usize,
    point: Vec3,
    normal: Vec3,
}

#[pymethods]
impl Panel {
    #[new]
    #[pyo3(signature = (body, area, *, part=0, point=None, normal=None, lift_slope=6.283185307179586, drag=0.02, **unknown), text_signature = "(body, area, *, part=0, point=None, normal=None, lift_slope=6.283185307179586, drag=0.02)")]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn new(
        body: Py<PyAny>,
        area: f64,
        #[pyo3(from_py_with = whole::part)] part: usize,
        point: Option<&Bound<'_, PyAny>>,
        normal: Option<&Bound<'_, PyAny>>,
        lift_slope: f64,
        drag: f64,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Panel> {
        keywords::check(unknown, "Panel")?;
        let (point, normal) = (vec3_or(point, "point", Vec3::zeros())?, direction_or(normal, "normal", Vec3::z())?);
        Ok(Panel { body, part, point, normal, flat: [area, lift_slope, drag] })
    }

    fn __repr__(&self) -> String {
        format!("<tumble.Panel: {} m²>", self.flat[0])
    }
}

#[pymethods]
impl Field {
    /// Moving air. velocity: shape (3,), m/s. drag: force per speed, N·s/m, the same for every body; None for a force in
    /// proportion to the square of the speed and to the silhouette, with the density of the air, kg/m³, and a
    /// drag coefficient.
    #[staticmethod]
    #[pyo3(signature = (velocity, *, drag=None, density=1.2, drag_coefficient=0.47, **unknown), text_signature = "(velocity, *, drag=None, density=1.2, drag_coefficient=0.47)")]
    fn wind(
        velocity: &Bound<'_, PyAny>,
        drag: Option<f64>,
        density: f64,
        drag_coefficient: f64,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Field> {
        keywords::check(unknown, "Field.wind")?;
        let velocity = vec3(velocity, "velocity")?;
        let law = match drag {
            Some(coefficient) => DragLaw::Linear { coefficient },
            None => DragLaw::Quadratic { density, coefficient: drag_coefficient },
        };
        Wind::new("", velocity, law)?;
        Ok(Field { law: Law::Wind { velocity, law } })
    }

    /// A point that attracts masses as a planet does. position: shape (3,), m. strength: m³/s², negative to repel.
    /// softening: length, m, below which the force does not grow.
    #[staticmethod]
    #[pyo3(signature = (position, strength, *, softening=0.0, **unknown), text_signature = "(position, strength, *, softening=0.0)")]
    fn attractor(
        position: &Bound<'_, PyAny>,
        strength: f64,
        softening: f64,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Field> {
        keywords::check(unknown, "Field.attractor")?;
        let position = vec3(position, "position")?;
        Attractor::new("", position, strength, softening)?;
        Ok(Field { law: Law::Attractor { position, strength, softening } })
    }

    /// An explosion. position: shape (3,), m. impulse: momentum in all directions together, N·s; a body gets the
    /// share that its silhouette covers. start: s. decay: time constant, s.
    #[staticmethod]
    #[pyo3(signature = (position, impulse, *, start=0.0, decay=0.02, **unknown), text_signature = "(position, impulse, *, start=0.0, decay=0.02)")]
    fn explosion(
        position: &Bound<'_, PyAny>,
        impulse: f64,
        start: f64,
        decay: f64,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Field> {
        keywords::check(unknown, "Field.explosion")?;
        let position = vec3(position, "position")?;
        Explosion::new("", position, impulse, start, decay)?;
        Ok(Field { law: Law::Explosion { position, impulse, start, decay } })
    }

    /// A fluid below a horizontal surface. surface: a point of it, shape (3,), m. density: kg/m³. drag: per mass of
    /// displaced fluid, 1/s. current: velocity of the fluid, shape (3,), m/s.
    #[staticmethod]
    #[pyo3(signature = (surface=None, density=1000.0, *, drag=0.0, current=None, **unknown), text_signature = "(surface=None, density=1000.0, *, drag=0.0, current=None)")]
    fn buoyancy(
        surface: Option<&Bound<'_, PyAny>>,
        density: f64,
        drag: f64,
        current: Option<&Bound<'_, PyAny>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Field> {
        keywords::check(unknown, "Field.buoyancy")?;
        let surface = vec3_or(surface, "surface", Vec3::zeros())?;
        let current = vec3_or(current, "current", Vec3::zeros())?;
        Buoyancy::new("", surface, density)?.with_drag(drag, current)?;
        Ok(Field { law: Law::Buoyancy { surface, density, drag, current } })
    }

    /// Lift and drag on panels: wings, sails, fins. density: of the air, kg/m³. wind: its velocity, shape (3,), m/s.
    #[staticmethod]
    #[pyo3(signature = (panels, *, density=1.2, wind=None, **unknown), text_signature = "(panels, *, density=1.2, wind=None)")]
    fn panels(
        panels: Vec<Py<Panel>>,
        density: f64,
        wind: Option<&Bound<'_, PyAny>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Field> {
        keywords::check(unknown, "Field.panels")?;
        let wind = vec3_or(wind, "wind", Vec3::zeros())?;
        Panels::new("", density, wind, [])?;
        Ok(Field { law: Law::Panels { density, wind, panels } })
    }

    fn __repr__(&self) -> &'static str {
        match self.law {
            Law::Wind { .. } => "<tumble.Field: wind>",
            Law::Attractor { .. } => "<tumble.Field: attractor>",
            Law::Explosion { .. } => "<tumble.Field: explosion>",
            Law::Buoyancy { .. } => "<tumble.Field: buoyancy>",
            Law::Panels { .. } => "<tumble.Field: panels>",
        }
    }
}

/// Adds a field to a world; `targets` is a list of handles or names.
pub fn add(
    shared: &Arc<Shared>,
    py: Python<'_>,
    name: &str,
    field: &Field,
    targets: Option<Vec<Bound<'_, PyAny>>>,
) -> Result<()> {
    let id = |body: &Bound<'_, PyAny>| match behaviors::own_place(shared, body)? {
        Some(place) => Ok(place.id),
        None => own_place(shared, body).map(|place| place.id),
    };
    if targets.is_some() && matches!(field.law, Law::Panels { .. }) {
        return Err(Error::value("targets: panels name their bodies themselves"));
    }
    let targets = match targets {
        Some(bodies) => Targets::Only(bodies.iter().map(id).collect::<Result<_>>()?),
        None => Targets::All,
    };
    let add = |object: Box<dyn tumble::dynamics::Object>| {
        shared.write(py, |inner| Ok(inner.world.add_boxed(object, Default::default()).map(drop)?))
    };
    match &field.law {
        Law::Wind { velocity, law } => add(Box::new(Wind::new(name, *velocity, *law)?.with_targets(targets))),
        Law::Attractor { position, strength, softening } => {
            add(Box::new(Attractor::new(name, *position, *strength, *softening)?.with_targets(targets)))
        }
        Law::Explosion { position, impulse, start, decay } => {
            add(Box::new(Explosion::new(name, *position, *impulse, *start, *decay)?.with_targets(targets)))
        }
        Law::Buoyancy { surface, density, drag, current } => {
            let fluid = Buoyancy::new(name, *surface, *density)?.with_drag(*drag, *current)?;
            add(Box::new(fluid.with_targets(targets)))
        }
        Law::Panels { density, wind, panels } => {
            let flat = |panel: &Py<Panel>| {
                let panel = panel.get();
                let [area, lift_slope, drag] = panel.flat;
                let id = id(panel.body.bind(py))?;
                Ok(Flat { id, part: panel.part, point: panel.point, normal: panel.normal, area, lift_slope, drag })
            };
            let panels: Vec<Flat> = panels.iter().map(flat).collect::<Result<_>>()?;
            add(Box::new(Panels::new(name, *density, *wind, panels)?))
        }
    }
}
