//! One link of an articulated body.

use crate::arrays::convert::{quaternion, symmetric, vec3, vector};
use crate::arrays::whole;
use crate::errors::Result;
use crate::objects::articulation::Articulation;
use crate::objects::body::link_inertia;
use crate::world::query;
use numpy::{PyArray1, PyArray2};
use pyo3::gc::{PyTraverseError, PyVisit};
use pyo3::prelude::*;
use tumble::collide::{Pose, Vec3};
use tumble::dynamics::{ArticulatedBody, CollisionGroup, LinkMass};

/// A link of an articulation: its motion, its mass, and what its shapes collide with.
///
/// ``Articulation.link`` returns it, also for a fixed link. A handle without data of its own. It can be changed if the
/// articulation is in a world.
#[pyclass(frozen, module = "tumble")]
pub struct Link {
    /// The articulation.
    #[pyo3(get)]
    articulation: Py<Articulation>,
    /// Name of the link.
    #[pyo3(get)]
    name: String,
}

impl Link {
    pub(crate) fn articulation(&self) -> &Py<Articulation> {
        &self.articulation
    }

    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    fn body<'a>(&'a self, py: Python<'a>) -> &'a Articulation {
        self.articulation.bind(py).get()
    }

    fn mass_properties(&self, py: Python<'_>) -> Result<LinkMass> {
        Ok(self.body(py).present()?.frame(&self.name)?.mass)
    }

    /// Changes the mass properties. Invalid ones change nothing.
    fn change(&self, py: Python<'_>, change: impl FnOnce(&mut LinkMass) -> Result<()>) -> Result<()> {
        let mut mass = self.mass_properties(py)?;
        change(&mut mass)?;
        let place = self.body(py).in_world()?;
        place.write(py, |inner| Ok(inner.world.set_link_mass(place.id, &self.name, mass)?))
    }

    /// Returns pose and velocity of its frame, and its angular velocity, in a world.
    fn motion(&self, py: Python<'_>) -> Result<(Pose, Vec3, Vec3)> {
        let place = self.body(py).in_world()?;
        place.read(|inner| {
            let body = inner.world.get::<ArticulatedBody>(place.id)?;
            let frame = body.model().frame(&self.name)?;
            let part = inner.world.part_state(place.id, frame.link.unwrap_or(body.model().links().len()))?;
            let pose = part.pose * frame.pose;
            let arm = pose.translation.vector - part.position();
            Some((pose, part.velocity + part.angular_velocity.cross(&arm), part.angular_velocity))
        })
    }

    /// Returns group and mask of its shapes, where they are the same.
    fn groups(&self, py: Python<'_>) -> Result<[Option<u64>; 2]> {
        let carrier = self.body(py).robot.frame(&self.name)?.link;
        self.body(py).of_body(|body| groups_of(body, |link| link == carrier))
    }

    fn set_groups(&self, py: Python<'_>, group: Option<CollisionGroup>, mask: Option<u64>) -> Result<()> {
        let place = self.body(py).in_world()?;
        place.write(py, |inner| {
            let body = inner.world.get_mut::<ArticulatedBody>(place.id).ok_or_else(|| place.removed())?;
            Ok(body.change_link_groups(&self.name, |own, all| (group.unwrap_or(own), mask.unwrap_or(all)))?)
        })
    }
}

/// Returns number of the group and mask of the shapes of some moving links, or of the base for `None`; each `None` if there
/// is no shape, or they differ.
pub(super) fn groups_of(body: &ArticulatedBody, of: impl Fn(Option<usize>) -> bool) -> [Option<u64>; 2] {
    let own = || body.colliders().filter(|(link, _)| of(*link)).map(|(_, collider)| collider);
    let same = |get: fn(&tumble::dynamics::Collider) -> u64| {
        let first = own().next().map(get)?;
        own().all(|collider| get(collider) == first).then_some(first)
    };
    [same(|collider| u64::from(collider.group.bit().trailing_zeros())), same(|collider| collider.mask)]
}

#[pymethods]
impl Link {
    /// Mass, kg, at least 0: of the link alone, without links that are fixed to it. Setting it keeps positions and
    /// velocities and changes the inertia by the same factor; that of a link that had none stays 0. The mass of a link that
    /// is fixed to the base has no effect on motion.
    #[getter]
    fn mass(&self, py: Python<'_>) -> Result<f64> {
        Ok(self.mass_properties(py)?.mass)
    }

    #[setter]
    fn set_mass(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.change(py, |own| {
            if own.mass > 0.0 {
                own.inertia *= value / own.mass;
            }
            own.mass = value;
            Ok(())
        })
    }

    /// Inertia about its center of mass, axes of the link, shape (3, 3), kg·m². Setting it, also by three moments, keeps the
    /// velocities.
    #[getter]
    fn inertia<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray2<f64>>> {
        symmetric(py, &self.mass_properties(py)?.inertia)
    }

    #[setter]
    fn set_inertia(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        let inertia = link_inertia(value)?;
        self.change(py, |own| {
            own.inertia = inertia;
            Ok(())
        })
    }

    /// The center of mass in the frame of the link, shape (3,), meters. Setting it keeps the motion of the link; the inertia is
    /// then about the new center.
    #[getter]
    fn center_of_mass<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        Ok(vector(py, &self.mass_properties(py)?.center))
    }

    #[setter]
    fn set_center_of_mass(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        let center = vec3(value, "center_of_mass")?;
        self.change(py, |own| {
            own.center = center;
            Ok(())
        })
    }

    /// Position of the origin of its frame, shape (3,), meters, world axes.
    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        Ok(vector(py, &self.motion(py)?.0.translation.vector))
    }

    /// Orientation, link to world, unit quaternion (x, y, z, w), shape (4,).
    #[getter]
    fn orientation<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        Ok(quaternion(py, &self.motion(py)?.0.rotation))
    }

    /// Velocity of the origin of its frame, shape (3,), m/s, world axes.
    #[getter]
    fn velocity<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        Ok(vector(py, &self.motion(py)?.1))
    }

    /// Angular velocity, shape (3,), rad/s, world axes.
    #[getter]
    fn angular_velocity<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        Ok(vector(py, &self.motion(py)?.2))
    }

    /// Collision group of its shapes, 0 to 63; None if it has none or they differ. Shapes of links that are fixed to each
    /// other have it together.
    #[getter]
    fn group(&self, py: Python<'_>) -> Result<Option<u64>> {
        Ok(self.groups(py)?[0])
    }

    #[setter]
    fn set_group(&self, py: Python<'_>, #[pyo3(from_py_with = whole::group)] value: u8) -> Result<()> {
        self.set_groups(py, Some(query::group(value)?), None)
    }

    /// Groups that its shapes collide with, one bit each; None if it has none or they differ. May be set to a sequence of
    /// groups, or None for all.
    #[getter]
    fn mask(&self, py: Python<'_>) -> Result<Option<u64>> {
        Ok(self.groups(py)?[1])
    }

    #[setter]
    fn set_mask(&self, py: Python<'_>, value: Option<&Bound<'_, PyAny>>) -> Result<()> {
        self.set_groups(py, None, Some(query::mask(value)?))
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        format!("<tumble.Link '{}' of '{}'>", self.name, self.body(py).name)
    }

    fn __eq__(&self, py: Python<'_>, other: &Bound<'_, PyAny>) -> Result<bool> {
        let Ok(other) = other.cast::<Link>() else { return Ok(false) };
        let other = other.get();
        Ok(self.name == other.name && self.articulation.bind(py).eq(other.articulation.bind(py))?)
    }

    fn __hash__(&self, py: Python<'_>) -> Result<isize> {
        Ok((self.articulation.bind(py).hash()?, &self.name).into_pyobject(py)?.hash()?)
    }

    fn __traverse__(&self, visit: PyVisit<'_>) -> Result<(), PyTraverseError> {
        visit.call(&self.articulation)
    }
}

#[pymethods]
impl Articulation {
    /// Returns a link by name, which may be a fixed one.
    fn link(slf: &Bound<'_, Self>, name: &str) -> Result<Link> {
        slf.get().robot.frame(name)?;
        Ok(Link { articulation: slf.clone().unbind(), name: name.into() })
    }

    /// All links, including fixed ones, in the order of ``link_names``.
    #[getter]
    fn links(slf: &Bound<'_, Self>) -> Vec<Link> {
        let frames = slf.get().robot.model.frames().iter();
        frames.map(|frame| Link { articulation: slf.clone().unbind(), name: frame.name.clone() }).collect()
    }
}
