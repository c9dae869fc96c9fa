//! Measuring sensors of a world: how they are added, and what they read.

use crate::arrays::convert::{number, pose};
use crate::choices::meaning;
use crate::errors::{Error, Result};
use crate::objects::place::Place;
use crate::objects::sensor::Sensor;
use crate::objects::shapes::Shape;
use crate::world::inner::Inner;
use crate::world::joints;
use crate::world::query::Numbering;
use crate::world::shared::Shared;
use crate::world::target::{self, Target};
use nalgebra::Translation3;
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use std::sync::Arc;
use tumble::collide::Pose;
use tumble::dynamics::{
    Anchor, ObjectId, Optics, RigidBody as Rigid, Sensor as Core, SensorImage, SensorKind, SensorNoise, SensorPlace,
};

/// The arguments of ``add_sensor``.
pub struct Arguments<'a, 'py> {
    pub kind: &'a str,
    pub on: Option<&'a Bound<'py, PyAny>>,
    pub name: &'a str,
    pub position: Option<&'a Bound<'py, PyAny>>,
    pub orientation: Option<&'a Bound<'py, PyAny>>,
    pub relative_to: Option<&'a Bound<'py, PyAny>>,
    pub volume: Option<&'a Bound<'py, Shape>>,
    pub cutoff: Option<f64>,
    pub noise: SensorNoise,
    pub resolution: Option<[u32; 2]>,
    pub vertical_fov: Option<f64>,
}

/// Adds a sensor and returns its handle.
pub fn add(shared: &Arc<Shared>, py: Python<'_>, given: &Arguments<'_, '_>) -> Result<Sensor> {
    let kinds: Vec<(&str, SensorKind)> = SensorKind::NAMES.into_iter().zip(SensorKind::ALL).collect();
    let kind = meaning("kind", given.kind, &kinds)?;
    let site = pose(given.position, given.orientation)?;
    let joint = given.on.map_or(Ok(None), |on| joints::place_of(shared, on))?;
    let target = match given.on.filter(|_| joint.is_none()) {
        Some(on) => Some(target::target(shared, on)?),
        None => None,
    };
    let reference = given.relative_to.map(|value| target::target(shared, value)).transpose()?;
    let volume = match given.volume.map(|volume| volume.get()) {
        Some(volume) if volume.placement != Pose::identity() => {
            return Err(Error::value("volume: expected a sphere, a box, a capsule or a cylinder"));
        }
        volume => volume.map(|volume| volume.solid.clone()),
    };
    let cutoff = given.cutoff.map_or(Ok(f64::INFINITY), |cutoff| number(cutoff, "cutoff"))?;
    let place = shared.write(py, |inner| {
        let place = match (&joint, &target) {
            (Some(joint), _) => SensorPlace::LoopJoint(joint.id),
            (_, Some(target)) if kind.reads_dof() => {
                let (id, dof) = dof_of(inner, target, "on")?;
                SensorPlace::Dof(id, dof)
            }
            (_, Some(target)) => SensorPlace::Site(anchor(inner, target, &site)?),
            (_, None) => SensorPlace::Site(Anchor::world(site)),
        };
        let mut sensor = Core::at(given.name.into(), kind, place)?;
        if let Some(reference) = &reference {
            sensor = sensor.relative_to(anchor(inner, reference, &Pose::identity())?)?;
        }
        if let Some(volume) = volume {
            sensor = sensor.with_volume(volume)?;
        }
        if given.resolution.is_some() || given.vertical_fov.is_some() {
            let usual = Optics::default();
            let resolution = given.resolution.unwrap_or(usual.resolution);
            let vertical_fov = given.vertical_fov.unwrap_or(usual.vertical_fov);
            sensor = sensor.with_optics(Optics { resolution, vertical_fov })?;
        }
        let id = inner.world.add(sensor.with_cutoff(cutoff)?.with_noise(given.noise)?)?;
        let name = inner.world.name(id).unwrap_or_default().into();
        Ok(Place { shared: shared.clone(), id, name })
    })?;
    Sensor::new(py, place)
}

fn anchor(inner: &Inner, target: &Target, site: &Pose) -> Result<Anchor> {
    match target.link(inner)? {
        Some((body, link)) => body.anchor(target.id, link, site).map_err(|e| Error::Name(e.to_string())),
        None => {
            // the frame of a body is that of its shape
            let center = inner.world.get::<Rigid>(target.id).map(|body| body.shape().center_of_mass());
            let shift = Translation3::from(-center.unwrap_or_default());
            Ok(Anchor::on(target.id, 0, shift * site))
        }
    }
}

/// Returns the degree of freedom of the joint that moves a link.
pub fn dof_of(inner: &Inner, target: &Target, argument: &str) -> Result<(ObjectId, usize)> {
    let name = inner.world.name(target.id).unwrap_or_default();
    let none = |link: &str| {
        Error::value(format!(
            "{argument}: expected a link that a revolute or prismatic joint of its own moves, or a loop joint, got '{name}{link}'"
        ))
    };
    let (body, link) = target.link(inner)?.ok_or_else(|| none(""))?;
    let model = body.model();
    model.frame(link).ok_or_else(|| Error::Name(format!("'{name}' has no link named '{link}'")))?;
    let moving = model.link(link).map(|k| &model.links()[k]).filter(|link| link.joint.dof() == 1);
    Ok((target.id, moving.ok_or_else(|| none(&format!("/{link}")))?.v))
}

/// Returns the place of the sensor of that name.
pub fn place_by_name(shared: &Arc<Shared>, name: &str) -> Result<Place> {
    shared.read(|inner| {
        let id = inner.world.find(name).filter(|id| inner.world.get::<Core>(*id).is_some());
        let unknown = || {
            let names: Vec<&str> = inner.world.sensors().filter_map(|id| inner.world.name(id)).take(8).collect();
            Error::Name(format!("the world has no measuring sensor named '{name}'; it has [{}]", names.join(", ")))
        };
        Ok(Place { shared: shared.clone(), id: id.ok_or_else(unknown)?, name: name.into() })
    })
}

/// Returns the place of a sensor of this world, given as a handle or by name; `None` for anything else.
pub fn place_of(shared: &Arc<Shared>, value: &Bound<'_, PyAny>) -> Result<Option<Place>> {
    if let Ok(sensor) = value.cast::<Sensor>() {
        let place = sensor.get().place.clone();
        return match Arc::ptr_eq(&place.shared, shared) {
            true => place.status().map(|_| Some(place)),
            false => Err(Error::value(format!("'{}' belongs to another world", place.name))),
        };
    }
    Ok(value.extract::<String>().ok().and_then(|name| place_by_name(shared, &name).ok()))
}

/// Returns the reading of a sensor: an array of float64, of a segmentation of int32, of colors of uint8.
pub fn value<'py>(py: Python<'py>, place: &Place) -> Result<Bound<'py, PyAny>> {
    match place.read(|inner| Some(inner.world.get::<Core>(place.id)?.kind()))? {
        SensorKind::Depth => {
            let SensorImage { width, height, pixels } = place.read(|inner| inner.world.depth_image(place.id))?;
            Ok(PyArray1::from_vec(py, pixels).reshape([height, width])?.into_any())
        }
        SensorKind::Color => {
            let SensorImage { width, height, pixels } = place.read(|inner| inner.world.color_image(place.id))?;
            let colors = pixels.into_iter().flatten().collect();
            Ok(PyArray1::from_vec(py, colors).reshape([height, width, 3])?.into_any())
        }
        SensorKind::Segmentation => {
            let SensorImage { width, height, pixels } = place.read(|inner| parts_in_image(inner, place.id))?;
            let numbers = pixels.into_iter().flatten().collect();
            Ok(PyArray1::from_vec(py, numbers).reshape([height, width, 2])?.into_any())
        }
        _ => {
            let numbers = place.read(|inner| inner.world.reading(place.id).map(<[f64]>::to_vec))?;
            Ok(PyArray1::from_vec(py, numbers).into_any())
        }
    }
}

/// Returns the index of the body in ``world.bodies`` and that of the link in its ``link_names`` behind each pixel.
fn parts_in_image(inner: &Inner, id: ObjectId) -> Option<SensorImage<[i32; 2]>> {
    let SensorImage { width, height, pixels } = inner.world.segmentation_image(id)?;
    let numbers = Numbering::of(inner);
    let of = |(id, part)| {
        let [body, part, _] = numbers.sides(inner, id, part, 0);
        [body, part].map(|number| i32::try_from(number).unwrap_or(-1))
    };
    let pixels = pixels.into_iter().map(|part| part.map_or([-1; 2], of)).collect();
    Some(SensorImage { width, height, pixels })
}

/// Returns the places of a sensor's reading in the state.
pub fn columns(shared: &Arc<Shared>, name: &str) -> Result<std::ops::Range<usize>> {
    let place = place_by_name(shared, name)?;
    place.read(|inner| {
        let kind = inner.world.get::<Core>(place.id)?.kind();
        if kind.is_camera() {
            return Some(Err(Error::value(format!("'{name}' is a camera: read it in each world"))));
        }
        let start = inner.world.view().state_range(place.id)?.x.start;
        Some(Ok(start..start + kind.numbers()))
    })?
}

/// Names of sensors with the lengths of their readings.
type Lengths = Vec<(String, usize)>;

/// Returns the names of all sensors, cameras included, in the order of their addition. Those of removed bodies are left out.
pub fn names(shared: &Arc<Shared>) -> Result<Vec<String>> {
    shared.read(|inner| {
        let world = &inner.world;
        let camera = |id: ObjectId| {
            let sensor = world.get::<Core>(id).filter(|sensor| sensor.kind().is_camera());
            sensor.is_some_and(|sensor| sensor.place().object().is_none_or(|on| world.status(on).is_some()))
        };
        let present = world.sensors().filter(|id| camera(*id) || world.reading(*id).is_some());
        Ok(present.filter_map(|id| world.name(id).map(str::to_owned)).collect())
    })
}

/// Returns the names of all sensors but cameras with the lengths of their readings and the numbers one after the other, in the order of
/// their addition. Those of removed bodies are left out.
pub fn all(shared: &Arc<Shared>) -> Result<(Lengths, Vec<f64>)> {
    shared.read(|inner| {
        let (mut names, mut numbers) = (Vec::new(), Vec::new());
        for id in inner.world.sensors() {
            if let (Some(name), Some(reading)) = (inner.world.name(id), inner.world.reading(id)) {
                names.push((name.to_owned(), reading.len()));
                numbers.extend_from_slice(reading);
            }
        }
        Ok((names, numbers))
    })
}
