//! Queries of the present of a world: contacts, events, rays, overlaps, distances, energy, the report of a step.

use crate::arrays::convert::vector;
use crate::arrays::whole;
use crate::errors::{Error, Result};
use crate::keywords::{self, Unknown};
use crate::objects::place::body_ids;
use crate::objects::shapes::Shape;
use crate::world::add::own_place;
use crate::world::class::World;
use crate::world::contacts;
use crate::world::query::{self, Selection};
use crate::world::report::StepReport;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyString;

#[pymethods]
impl World {
    /// The contacts of the last step: a structured array with one row each.
    ///
    /// Fields: ``bodies`` (2,), indices in ``world.bodies``, -1 for other objects; ``parts`` (2,),
    /// for articulated bodies the indices of the links in their ``link_names``; ``shapes`` (2,), as
    /// ``shape`` in ``cast_rays``, whose names ``shape_name`` returns; ``point`` (3,), m;
    /// ``normal`` (3,), unit, from the second body to the first; ``depth``, m, negative while
    /// apart; ``velocity`` (3,) of the first relative to the second before the contact was solved,
    /// m/s; ``impulse`` (3,) on the first over the last sub-step, N·s; ``force`` (3,), N, without
    /// impacts. World axes.
    #[getter]
    fn contacts<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        contacts::array(py, self.shared.read(|inner| Ok(contacts::bytes(inner)))?)
    }

    /// Returns the sum of the contact forces of ``a`` on ``b`` in the last sub-step, shape (3,), N, world axes, without impacts; zero if
    /// they do not touch.
    ///
    /// a, b: a body, an articulation or a link: a handle, a name, ``"ARTICULATION/LINK"`` or (articulation, link). A link is its own
    /// shapes, without those of links fixed to it.
    #[pyo3(signature = (a, b, **unknown), text_signature = "($self, a, b)")]
    fn contact_force<'py>(
        &self,
        py: Python<'py>,
        a: &Bound<'py, PyAny>,
        b: &Bound<'py, PyAny>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Bound<'py, PyArray1<f64>>> {
        keywords::check(unknown, "World.contact_force")?;
        let ((a, parts_a), (b, parts_b)) = (query::named(&self.shared, a)?, query::named(&self.shared, b)?);
        let force = self
            .shared
            .read(|inner| Ok(inner.world.contact_force_of((a, parts_a.as_deref()), (b, parts_b.as_deref()))?))?;
        Ok(vector(py, &force))
    }

    /// The events of the last step, a list of ``Event`` tuples: ``kind``, ``a``, ``b``, ``parts``,
    /// ``impulse``, ``point``, ``shapes``, ``shape_names``, ``links``.
    ///
    /// kind: ``"contact_begin"``, ``"contact_persist"`` (in contact in the step before too),
    /// ``"contact_end"``, ``"sensor_begin"``, ``"sensor_end"``, ``"asleep"``, ``"awake"``, ``"joint_broken"``. a, b: handles
    /// of the bodies, the sensor first, or the joint; b is None for sleep and joints. parts: the touched links, as in
    /// ``contacts``. impulse: on ``a`` over the step, shape (3,), N·s; point: where the largest one
    /// acts, shape (3,), m; both zero for all but contacts that begin or persist. World axes. shapes, shape_names: the shapes
    /// that touch there, as in ``contacts``, and their names. links: names of the touched links, fixed ones too.
    ///
    /// Two bodies are in contact in a step if their surfaces touch or an impulse acts between them, of
    /// at least ``event_impulse`` of the world. Of ``step(n)`` the last step counts. Pairs in contact
    /// are part of ``save``; a restored world has no events before its next step.
    #[getter]
    fn events(&self, py: Python<'_>) -> Result<Vec<Py<PyAny>>> {
        contacts::events(&self.shared, py)
    }

    /// Returns the name of a shape, or None if it has none, by the numbers that ``contacts`` and queries report.
    ///
    /// body: number in ``bodies``, a handle or a name; part, shape: the numbers beside it.
    #[pyo3(signature = (body, part, shape, **unknown), text_signature = "($self, body, part, shape)")]
    fn shape_name(
        &self,
        body: &Bound<'_, PyAny>,
        #[pyo3(from_py_with = whole::part)] part: usize,
        #[pyo3(from_py_with = whole::shape)] shape: usize,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Option<String>> {
        keywords::check(unknown, "World.shape_name")?;
        let named = body.is_instance_of::<PyString>() || body.extract::<usize>().is_err();
        let handle = named.then(|| own_place(&self.shared, body)).transpose()?;
        self.shared.read(|inner| {
            let id = match &handle {
                Some(place) => place.id,
                None => {
                    let (ids, number) = (body_ids(&inner.world), body.extract::<usize>()?);
                    let none = || Error::value(format!("body is {number}; the world has {} bodies", ids.len()));
                    *ids.get(number).ok_or_else(none)?
                }
            };
            contacts::shape_name(inner, id, part, shape)
        })
    }

    /// Returns where rays enter bodies: a structured array with one row per ray.
    ///
    /// origins, directions: shape (3,) or (n, 3), m; directions of any length above 0. One of either
    /// serves all. max_distance: length of the rays, m, a number or shape (n,); None: unlimited.
    ///
    /// Fields: ``distance``, m, infinite for a miss; ``body``, its number in ``world.bodies``, -1 for
    /// a miss; ``part``, for an articulation the index of the link in its ``link_names``; ``shape``, the
    /// index of a compound's part, and on a link that among its shapes that collide, in their order; ``face``,
    /// the index of a mesh's triangle, 0 to 5 for -x, +x, -y, +y, -z and +z of a box, 0 to 2 for side,
    /// -z end and +z end of a cylinder, of a compound the face of that part, else 0; ``normal`` (3,), unit, outward, world axes.
    ///
    /// A ray that starts inside a convex shape does not meet that shape; a mesh is hit on its outside
    /// only. group, mask, ignore: the query has a collision group (0 to 63) and a mask (the
    /// groups that it finds, as bits of an integer or a sequence; None for all) like a body, and does not find the ignored bodies and links (handles, a
    /// name, ``"ARTICULATION/LINK"``, (articulation, link), or a list of them). as_body: a body or a link; the query then finds only what could have contacts
    /// with it, by groups, masks, pairs and excluded links. Sensors are not found. Runs on ``threads`` threads, which change no bit.
    #[pyo3(signature = (origins, directions, max_distance=None, *, group=0, mask=None, ignore=None, as_body=None, **unknown), text_signature = "($self, origins, directions, max_distance=None, *, group=0, mask=None, ignore=None, as_body=None)")]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn cast_rays<'py>(
        &self,
        py: Python<'py>,
        origins: &Bound<'_, PyAny>,
        directions: &Bound<'_, PyAny>,
        max_distance: Option<&Bound<'_, PyAny>>,
        #[pyo3(from_py_with = whole::group)] group: u8,
        mask: Option<&Bound<'_, PyAny>>,
        ignore: Option<&Bound<'_, PyAny>>,
        as_body: Option<&Bound<'_, PyAny>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Bound<'py, PyAny>> {
        keywords::check(unknown, "World.cast_rays")?;
        query::cast_rays(
            &self.shared,
            py,
            origins,
            directions,
            max_distance,
            &Selection { group, mask, ignore, as_body },
        )
    }

    /// Returns the first body that a shape touches if it moves along a direction without rotation, or
    /// None.
    ///
    /// direction: shape (3,), of any length above 0, world axes. max_distance: how far it moves, m,
    /// finite. position, orientation: where it starts. Fields: ``distance``, m, 0 if it overlaps at
    /// the start; ``body``, ``part``, ``shape`` and the filter as in ``cast_rays``; ``point`` (3,), m;
    /// ``normal`` (3,), unit, from the body towards the shape.
    #[pyo3(signature = (shape, direction, max_distance, position=None, orientation=None, *, group=0, mask=None, ignore=None, as_body=None, **unknown), text_signature = "($self, shape, direction, max_distance, position=None, orientation=None, *, group=0, mask=None, ignore=None, as_body=None)")]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn cast_shape<'py>(
        &self,
        py: Python<'py>,
        shape: PyRef<'_, Shape>,
        direction: &Bound<'_, PyAny>,
        max_distance: f64,
        position: Option<&Bound<'_, PyAny>>,
        orientation: Option<&Bound<'_, PyAny>>,
        #[pyo3(from_py_with = whole::group)] group: u8,
        mask: Option<&Bound<'_, PyAny>>,
        ignore: Option<&Bound<'_, PyAny>>,
        as_body: Option<&Bound<'_, PyAny>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Option<Bound<'py, PyAny>>> {
        keywords::check(unknown, "World.cast_shape")?;
        let (at, selection) = ((position, orientation), Selection { group, mask, ignore, as_body });
        query::cast_shape(&self.shared, py, &shape, direction, max_distance, at, &selection)
    }

    /// Returns the bodies that overlap a shape at a pose: a structured array with the fields ``body``,
    /// ``part`` and ``shape``, as in ``cast_rays``, and ``depth``, that of the deepest contact, m.
    ///
    /// position, orientation: as in ``add_rigid``. group, mask, ignore, as_body: as in ``cast_rays``.
    #[pyo3(signature = (shape, position=None, orientation=None, *, group=0, mask=None, ignore=None, as_body=None, **unknown), text_signature = "($self, shape, position=None, orientation=None, *, group=0, mask=None, ignore=None, as_body=None)")]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn overlaps<'py>(
        &self,
        py: Python<'py>,
        shape: PyRef<'_, Shape>,
        position: Option<&Bound<'_, PyAny>>,
        orientation: Option<&Bound<'_, PyAny>>,
        #[pyo3(from_py_with = whole::group)] group: u8,
        mask: Option<&Bound<'_, PyAny>>,
        ignore: Option<&Bound<'_, PyAny>>,
        as_body: Option<&Bound<'_, PyAny>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Bound<'py, PyAny>> {
        keywords::check(unknown, "World.overlaps")?;
        query::overlaps(&self.shared, py, &shape, (position, orientation), &Selection { group, mask, ignore, as_body })
    }

    /// Returns the closest points of two bodies or links, or of a shape at a pose and a body or link, the nearest one
    /// if ``b`` is None. None if one has no shape or is disabled. Two links may be of one articulation.
    ///
    /// a: a body or link (a handle, a name, ``"ARTICULATION/LINK"`` or (articulation, link)), or a shape; b: a body or link. position, orientation: of a shape. Fields: ``distance``, m, the
    /// negative depth if they overlap; ``bodies`` (2,), ``parts`` (2,) and ``shapes`` (2,) as in ``contacts``, -1
    /// for a shape; ``points`` (2, 3), on the surfaces, world, m; ``normal`` (3,), unit, from the second to
    /// the first. group, mask, ignore, as_body: of a shape, as in ``cast_rays``.
    #[pyo3(signature = (a, b=None, *, position=None, orientation=None, group=0, mask=None, ignore=None, as_body=None, **unknown), text_signature = "($self, a, b=None, *, position=None, orientation=None, group=0, mask=None, ignore=None, as_body=None)")]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn closest_points<'py>(
        &self,
        py: Python<'py>,
        a: &Bound<'_, PyAny>,
        b: Option<&Bound<'_, PyAny>>,
        position: Option<&Bound<'_, PyAny>>,
        orientation: Option<&Bound<'_, PyAny>>,
        #[pyo3(from_py_with = whole::group)] group: u8,
        mask: Option<&Bound<'_, PyAny>>,
        ignore: Option<&Bound<'_, PyAny>>,
        as_body: Option<&Bound<'_, PyAny>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Option<Bound<'py, PyAny>>> {
        keywords::check(unknown, "World.closest_points")?;
        query::closest_points(
            &self.shared,
            py,
            a,
            b,
            (position, orientation),
            &Selection { group, mask, ignore, as_body },
        )
    }

    /// Returns the numbers in ``world.bodies`` of the bodies that contain a point: shape (k,).
    ///
    /// point: shape (3,), m. The surface belongs to a body. group, mask, ignore, as_body: as in ``cast_rays``.
    #[pyo3(signature = (point, *, group=0, mask=None, ignore=None, as_body=None, **unknown), text_signature = "($self, point, *, group=0, mask=None, ignore=None, as_body=None)")]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn contains<'py>(
        &self,
        py: Python<'py>,
        point: &Bound<'_, PyAny>,
        #[pyo3(from_py_with = whole::group)] group: u8,
        mask: Option<&Bound<'_, PyAny>>,
        ignore: Option<&Bound<'_, PyAny>>,
        as_body: Option<&Bound<'_, PyAny>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Bound<'py, PyArray1<i64>>> {
        keywords::check(unknown, "World.contains")?;
        query::contains(&self.shared, py, point, &Selection { group, mask, ignore, as_body })
    }

    /// Returns how deep points lie in the bodies: one row for a point of shape (3,), a structured
    /// array for points of shape (n, 3), m.
    ///
    /// Fields: ``depth``, m, below the surface of the body in which the point is deepest, and for a
    /// point outside of all bodies minus the distance from the nearest one, minus infinity if there
    /// is none; ``body``, ``part``, ``shape`` and the filter as in ``cast_rays``; ``point`` (3,), the closest
    /// point of the surface, m; ``normal`` (3,), unit, outward.
    #[pyo3(signature = (points, *, group=0, mask=None, ignore=None, as_body=None, **unknown), text_signature = "($self, points, *, group=0, mask=None, ignore=None, as_body=None)")]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn point_depth<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'_, PyAny>,
        #[pyo3(from_py_with = whole::group)] group: u8,
        mask: Option<&Bound<'_, PyAny>>,
        ignore: Option<&Bound<'_, PyAny>>,
        as_body: Option<&Bound<'_, PyAny>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Bound<'py, PyAny>> {
        keywords::check(unknown, "World.point_depth")?;
        query::point_depth(&self.shared, py, points, &Selection { group, mask, ignore, as_body })
    }

    /// Returns the mechanical energy of everything that moves: ``kinetic``, ``potential`` (zero at
    /// the world's origin) and ``total``, J.
    fn energy(&self, py: Python<'_>) -> Result<Py<PyAny>> {
        let e = self.shared.read(|inner| Ok(inner.world.energy()))?;
        Ok(py.import("tumble._values")?.call_method1("Energy", (e.kinetic, e.potential, e.total()))?.unbind())
    }

    /// Returns the momentum of everything that moves: ``linear`` (3,), N·s, and ``angular`` (3,)
    /// about the world's origin, N·m·s. World axes.
    fn momentum(&self, py: Python<'_>) -> Result<Py<PyAny>> {
        let m = self.shared.read(|inner| Ok(inner.world.momentum()))?;
        Ok(py
            .import("tumble._values")?
            .call_method1("Momentum", (vector(py, &m.linear), vector(py, &m.angular)))?
            .unbind())
    }

    /// Statistics of the last step.
    #[getter]
    fn report(&self) -> Result<StepReport> {
        self.shared.read(|inner| Ok(StepReport::of(&inner.world)))
    }
}
