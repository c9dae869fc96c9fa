//! Recordings: written from worlds, read back as arrays.

use crate::arrays::convert::path;
use crate::arrays::whole;
use crate::errors::{Error, Result, caught};
use crate::keywords::{self, Unknown};
use crate::world::class::World;
use crate::world::inner::Inner;
use crate::world::shared::Shared;
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use pyo3::types::{PyBytes, PyDict, PyList};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use tumble::dynamics::ObjectId;
use tumble::net::record::{
    Contact, Ending, Images, Pixels, Pose, RecordedEvent, RecordedImage, Recorder as Writer, RecorderOptions,
    decode_contacts, encode_contacts, read,
};
use tumble::net::world::{
    self as net_world, contacts, deforming, entities, events, images, names as entity_names, poses, readings,
};

/// Largest count of numbers, and of bytes of states, of a recording that is read at once.
const MAX_NUMBERS: usize = 1 << 29;

/// A recording being written.
struct Open {
    writer: Writer,
    /// The world of the last frame and its objects. If they change, the list of visuals is written
    /// again.
    world: Arc<Shared>,
    objects: Vec<ObjectId>,
}

enum Stage {
    Empty,
    Open(Box<Open>),
    Closed,
}

/// Writes an MCAP file that Foxglove and ``tumble.read`` open: ``with tumble.Recorder("run.mcap")
/// as recorder: recorder.frame(world)``.
///
/// The file is created by the first frame. After a crash the file is readable up to the last
/// quarter of a simulated second.
#[pyclass(frozen, module = "tumble")]
pub struct Recorder {
    path: PathBuf,
    cameras: bool,
    stage: Mutex<Stage>,
    frames: Mutex<u64>,
}

impl Open {
    fn begin(path: &PathBuf, world: &Arc<Shared>, inner: &Inner) -> Result<Open> {
        let writer = Writer::create(path, &inner.scene.file, &entities(&inner.world), RecorderOptions::default())?;
        Ok(Open { writer, world: world.clone(), objects: inner.world.ids().to_vec() })
    }

    fn add(&mut self, world: &Arc<Shared>, inner: &Inner, cameras: bool) -> Result<()> {
        let core = &inner.world;
        if !Arc::ptr_eq(world, &self.world) || self.objects != core.ids() {
            self.writer.set_entities(core.time(), &entities(core))?;
            (self.world, self.objects) = (world.clone(), core.ids().to_vec());
        }
        self.writer.report(&readings(core), &events(core))?;
        self.writer.images(&if cameras { images(core) } else { Images::new() })?;
        self.writer.deforming(core.time(), &deforming(core))?;
        Ok(self.writer.frame(core.time(), core.frame(), &poses(core), &contacts(core), &core.save())?)
    }
}

impl Recorder {
    fn add(&self, world: &Arc<Shared>) -> Result<()> {
        let mut stage = self.stage.lock().unwrap_or_else(PoisonError::into_inner);
        world.read(|inner| {
            if matches!(*stage, Stage::Empty) {
                *stage = Stage::Open(Box::new(Open::begin(&self.path, world, inner)?));
            }
            match &mut *stage {
                Stage::Open(open) => open.add(world, inner, self.cameras),
                _ => Err(Error::value(format!("{}: the recording is closed", self.path.display()))),
            }
        })?;
        *self.frames.lock().unwrap_or_else(PoisonError::into_inner) += 1;
        Ok(())
    }
}

#[pymethods]
impl Recorder {
    /// path: of the file. An existing file is replaced; its folder must exist. cameras: whether frames have the images of all
    /// cameras, which make it large.
    #[new]
    #[pyo3(signature = (path, *, cameras=false, **unknown), text_signature = "(path, *, cameras=False)")]
    fn new(path: &Bound<'_, PyAny>, cameras: bool, unknown: Option<Unknown<'_, '_>>) -> Result<Recorder> {
        keywords::check(unknown, "Recorder")?;
        let path = self::path(path)?;
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        if let Some(folder) = folder.filter(|folder| !folder.is_dir()) {
            let source =
                std::io::Error::new(std::io::ErrorKind::NotFound, format!("there is no folder {}", folder.display()));
            return Err(Error::File { file: path.display().to_string(), source });
        }
        Ok(Recorder { path, cameras, stage: Mutex::new(Stage::Empty), frames: Mutex::new(0) })
    }

    /// Adds the present frame: visuals, poses, contacts and state. Frames must be added in the order of time,
    /// each once.
    #[pyo3(signature = (world, **unknown), text_signature = "($self, world)")]
    fn frame(&self, py: Python<'_>, world: &Bound<'_, World>, unknown: Option<Unknown<'_, '_>>) -> Result<()> {
        keywords::check(unknown, "Recorder.frame")?;
        let shared = world.get().shared.clone();
        py.detach(|| self.add(&shared))
    }

    /// Steps the world ``n`` times and adds a frame after every ``every`` steps. If nothing is
    /// recorded yet, a frame is also added before the first step.
    #[pyo3(signature = (world, n, *, every=1, **unknown), text_signature = "($self, world, n, *, every=1)")]
    fn run(
        &self,
        py: Python<'_>,
        world: &Bound<'_, World>,
        #[pyo3(from_py_with = whole::n)] n: u32,
        #[pyo3(from_py_with = whole::every)] every: u32,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<()> {
        keywords::check(unknown, "Recorder.run")?;
        if every == 0 {
            return Err(Error::value("every is 0; it must be at least 1"));
        }
        if self.frames() == 0 {
            self.frame(py, world, None)?;
        }
        for k in 1..=n {
            world.get().shared.work(py, |inner| inner.step())?;
            if k % every == 0 {
                self.frame(py, world, None)?;
            }
            py.check_signals()?;
        }
        Ok(())
    }

    /// Writes index and checksums and closes the file. Later calls do nothing. A recording without
    /// a frame leaves no file.
    fn close(&self, py: Python<'_>) -> Result<()> {
        py.detach(|| {
            let mut stage = self.stage.lock().unwrap_or_else(PoisonError::into_inner);
            match std::mem::replace(&mut *stage, Stage::Closed) {
                Stage::Open(open) => Ok(open.writer.finish().map(|_| ())?),
                _ => Ok(()),
            }
        })
    }

    /// Frames added so far.
    #[getter]
    fn frames(&self) -> u64 {
        *self.frames.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Path of the file.
    #[getter]
    fn path(&self) -> &std::path::Path {
        &self.path
    }

    fn __enter__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    /// Closes the file, also if the block raised.
    fn __exit__(
        &self,
        py: Python<'_>,
        _kind: &Bound<'_, PyAny>,
        _error: &Bound<'_, PyAny>,
        _trace: &Bound<'_, PyAny>,
    ) -> Result<()> {
        self.close(py)
    }

    fn __repr__(&self) -> String {
        format!("<tumble.Recorder {}: {} frames>", self.path.display(), self.frames())
    }
}

/// Frames of a recording. Poses refer to names by number.
#[derive(Default)]
struct Frames {
    names: Vec<String>,
    numbers: BTreeMap<String, usize>,
    times: Vec<f64>,
    frames: Vec<u64>,
    poses: Vec<(Arc<Vec<usize>>, Vec<Pose>)>,
    states: Vec<Vec<u8>>,
    contacts: Vec<Vec<u8>>,
    sensors: BTreeMap<String, Vec<(usize, Vec<f64>)>>,
    events: Vec<Vec<RecordedEvent>>,
    /// Images of each camera with their frames; those of segmentations refer to names.
    images: BTreeMap<String, Vec<(usize, RecordedImage)>>,
    /// Numbers of all sensors in a frame.
    width: usize,
    bytes: usize,
}

impl Frames {
    fn columns(&mut self, names: &[String]) -> Arc<Vec<usize>> {
        let mut column = |name: &String| {
            *self.numbers.entry(name.clone()).or_insert_with(|| {
                self.names.push(name.clone());
                self.names.len() - 1
            })
        };
        Arc::new(names.iter().map(&mut column).collect())
    }

    /// Returns the readings of a sensor, with NaN for a frame without one, and the numbers per frame. Readings of
    /// another length than the first are left out.
    fn column(&self, readings: &[(usize, Vec<f64>)]) -> (Vec<f64>, usize) {
        let length = readings.first().map_or(0, |(_, reading)| reading.len());
        let mut column = vec![f64::NAN; length * self.times.len()];
        for (row, reading) in readings.iter().filter(|(_, reading)| reading.len() == length) {
            column[row * length..(row + 1) * length].copy_from_slice(reading);
        }
        (column, length)
    }

    /// Returns the images of a camera, with NaN, black or −1 for a frame without one. Images of another kind or size than the
    /// first are left out.
    fn film<'py>(&self, py: Python<'py>, images: &[(usize, RecordedImage)]) -> Result<Bound<'py, PyAny>> {
        let Some((_, first)) = images.first() else { return Ok(py.None().into_bound(py)) };
        let (frames, [height, width]) = (self.times.len(), [first.height, first.width].map(|n| n as usize));
        let alike = images.iter().filter(|(_, image)| (image.width, image.height) == (first.width, first.height));
        let at = |row: &usize| row * width * height;
        match first.pixels {
            Pixels::Depth(_) => {
                let mut film = vec![f32::NAN; frames * width * height];
                for (row, image) in alike {
                    if let Pixels::Depth(depths) = &image.pixels {
                        film[at(row)..at(row) + depths.len()].copy_from_slice(depths);
                    }
                }
                Ok(PyArray1::from_vec(py, film).reshape([frames, height, width])?.into_any())
            }
            Pixels::Color(_) => {
                let mut film = vec![[0_u8; 3]; frames * width * height];
                for (row, image) in alike {
                    if let Pixels::Color(colors) = &image.pixels {
                        film[at(row)..at(row) + colors.len()].copy_from_slice(colors);
                    }
                }
                Ok(PyArray1::from_vec(py, film.into_flattened()).reshape([frames, height, width, 3])?.into_any())
            }
            Pixels::Parts(_) => {
                let mut film = vec![-1_i32; frames * width * height];
                for (row, image) in alike {
                    if let Pixels::Parts(parts) = &image.pixels {
                        let columns = &self.poses[*row].0;
                        let column = |part: &Option<u32>| columns.get((*part)? as usize).copied();
                        for (pixel, part) in film[at(row)..].iter_mut().zip(parts) {
                            *pixel = column(part).map_or(-1, |column| column as i32);
                        }
                    }
                }
                Ok(PyArray1::from_vec(py, film).reshape([frames, height, width])?.into_any())
            }
        }
    }

    /// Returns both arrays, with NaN for a name without a pose.
    fn arrays(&self) -> (Vec<f64>, Vec<f64>) {
        let count = self.names.len() * self.times.len();
        let (mut positions, mut rotations) = (vec![f64::NAN; 3 * count], vec![f64::NAN; 4 * count]);
        for (row, (columns, poses)) in self.poses.iter().enumerate() {
            for (column, pose) in columns.iter().zip(poses) {
                let at = row * self.names.len() + column;
                positions[3 * at..3 * at + 3].copy_from_slice(&pose.position);
                rotations[4 * at..4 * at + 4].copy_from_slice(&pose.rotation);
            }
        }
        (positions, rotations)
    }
}

/// Returns all of a recording, as the arguments of `Recording`.
#[pyfunction]
pub fn read_recording<'py>(py: Python<'py>, path: &Bound<'py, PyAny>) -> Result<Bound<'py, PyDict>> {
    let file = self::path(path)?;
    let (world, all, note) = py.detach(|| caught(|| whole(&file)))?;
    let (positions, rotations) = all.arrays();
    let (frames, names) = (all.times.len(), all.names.len());
    let dict = PyDict::new(py);
    let sensors = PyDict::new(py);
    for (name, readings) in &all.sensors {
        let (column, length) = all.column(readings);
        sensors.set_item(name, PyArray1::from_vec(py, column).reshape([frames, length])?)?;
    }
    dict.set_item("sensors", sensors)?;
    let cameras = PyDict::new(py);
    for (name, images) in &all.images {
        cameras.set_item(name, all.film(py, images)?)?;
    }
    dict.set_item("images", cameras)?;
    let event = |e: &RecordedEvent| {
        let pair = |[a, b]: &[Option<String>; 2]| (a.clone(), b.clone());
        let (shapes, names) = ((e.shapes[0], e.shapes[1]), pair(&e.shape_names));
        let (bodies, links) = (pair(&e.bodies), pair(&e.links));
        (e.kind.clone(), e.a.clone(), e.b.clone(), e.impulse, e.point, shapes, names, bodies, links)
    };
    let events: Vec<Vec<_>> = all.events.iter().map(|events| events.iter().map(event).collect()).collect();
    dict.set_item("events", events)?;
    dict.set_item("world", world)?;
    dict.set_item("times", PyArray1::from_vec(py, all.times))?;
    dict.set_item("frames", PyArray1::from_iter(py, all.frames.iter().map(|&frame| frame as i64)))?;
    dict.set_item("names", all.names)?;
    dict.set_item("positions", PyArray1::from_vec(py, positions).reshape([frames, names, 3])?)?;
    dict.set_item("orientations", PyArray1::from_vec(py, rotations).reshape([frames, names, 4])?)?;
    dict.set_item("states", PyList::new(py, all.states.iter().map(|state| PyBytes::new(py, state)))?)?;
    dict.set_item("contacts", PyList::new(py, all.contacts.iter().map(|contacts| PyBytes::new(py, contacts)))?)?;
    dict.set_item("note", note)?;
    Ok(dict)
}

/// Encodes contacts whose bodies are columns of the arrays.
fn named_contacts(contacts: &[Contact], columns: &[usize]) -> Vec<u8> {
    let column = |index: u32| columns.get(index as usize).map_or(0, |column| *column as u32);
    let named: Vec<Contact> = contacts.iter().map(|c| Contact { a: column(c.a), b: column(c.b), ..*c }).collect();
    encode_contacts(&named)
}

fn whole(file: &PathBuf) -> Result<(String, Frames, Option<String>)> {
    let mut reader = read(file)?;
    let (mut all, mut names, mut columns) = (Frames::default(), Vec::new(), Arc::new(Vec::new()));
    while let Some(frame) = reader.next_frame()? {
        let now = reader.entities();
        if !now.iter().map(|entity| &entity.name).eq(&names) {
            names = now.iter().map(|entity| entity.name.clone()).collect();
            columns = all.columns(&names);
        }
        let contacts = named_contacts(&frame.contacts, &columns);
        all.bytes += frame.state.len() + contacts.len();
        all.bytes += frame.sensors.values().map(|reading| 8 * reading.len()).sum::<usize>();
        // at most 12 bytes a pixel in the arrays and before
        all.bytes +=
            frame.images.values().map(|image| 12 * image.width as usize * image.height as usize).sum::<usize>();
        let names = |e: &RecordedEvent| {
            let sides = [&e.bodies, &e.links, &e.shape_names];
            e.a.len() + sides.into_iter().flatten().flatten().map(String::len).sum::<usize>()
        };
        all.bytes += frame.events.iter().map(|event| size_of_val(event) + names(event)).sum::<usize>();
        let new = frame.sensors.iter().filter(|(name, _)| !all.sensors.contains_key(*name));
        all.width += new.map(|(_, reading)| reading.len()).sum::<usize>();
        let columns_of = all.names.len() * 7 + all.width;
        if (all.times.len() + 1).saturating_mul(columns_of) > MAX_NUMBERS || all.bytes > MAX_NUMBERS {
            return Err(Error::value(format!(
                "{}: too many frames to read at once ({MAX_NUMBERS} numbers or bytes)",
                file.display()
            )));
        }
        for (name, reading) in frame.sensors {
            all.sensors.entry(name).or_default().push((all.times.len(), reading));
        }
        for (name, image) in frame.images {
            all.images.entry(name).or_default().push((all.times.len(), image));
        }
        all.events.push(frame.events);
        all.times.push(frame.time_s);
        all.frames.push(frame.frame);
        all.poses.push((columns.clone(), frame.poses));
        all.states.push(frame.state);
        all.contacts.push(contacts);
    }
    let note = match reader.ending() {
        Some(Ending::Cut { offset, what }) => Some(format!("cut at byte {offset}: {what}")),
        _ => None,
    };
    Ok((reader.world().to_owned(), all, note))
}

/// Shows recorded contacts as those of a world's last step. They refer to bodies by their indices in
/// ``names``.
#[pyfunction]
pub fn show_contacts(
    py: Python<'_>,
    world: &Bound<'_, World>,
    names: Vec<String>,
    contacts: PyBackedBytes,
) -> Result<()> {
    let contacts = decode_contacts(&contacts).map_err(Error::value)?;
    world.get().shared.write(py, |inner| {
        let here: BTreeMap<String, u32> = entity_names(&inner.world).into_iter().zip(0..).collect();
        let index = |column: u32| here.get(names.get(column as usize)?).copied();
        let contacts = contacts.iter().filter_map(|c| Some(Contact { a: index(c.a)?, b: index(c.b)?, ..*c }));
        net_world::show_contacts(&mut inner.world, &contacts.collect::<Vec<_>>());
        Ok(())
    })
}
