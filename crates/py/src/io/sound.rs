//! The sound of a run.

use crate::arrays::convert::some;
use crate::arrays::whole;
use crate::errors::{Error, Result};
use crate::keywords::{self, Unknown};
use crate::world::class::World;
use crate::world::gc::{Anchor, anchor};
use crate::world::shared::Shared;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::gc::{PyTraverseError, PyVisit};
use pyo3::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tumble::sound::{Listener, Mixed, SOUND_MATERIALS, SoundError, SoundMaterial, Soundtrack as Track};

/// Collects the sound of a world, frame by frame: ``sound = tumble.Soundtrack(world); sound.run(480); sound.save("run.wav")``.
///
/// It is what ``tumble run --audio`` writes: two channels of 48 kHz. The same run gives the same samples.
#[pyclass(frozen, module = "tumble")]
pub struct Soundtrack {
    shared: Arc<Shared>,
    anchor: Py<Anchor>,
    listener: Listener,
    heard: Mutex<Heard>,
}

struct Heard {
    track: Track,
    frames: u64,
    /// Times of the world before the first frame and after the last, s.
    begin: f64,
    end: f64,
}

impl Soundtrack {
    fn heard(&self) -> MutexGuard<'_, Heard> {
        self.heard.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn mixed(&self, py: Python<'_>) -> Result<Mixed> {
        py.detach(|| {
            let heard = self.heard();
            heard.track.mix(&self.listener, heard.end - heard.begin).map_err(failed)
        })
    }

    fn listen(&self) -> Result<()> {
        let mut heard = self.heard();
        self.shared.read(|inner| {
            heard.track.frame(&inner.world);
            heard.frames += 1;
            heard.end = inner.world.time();
            Ok(())
        })
    }
}

fn failed(error: SoundError) -> Error {
    Error::value(error.to_string())
}

#[pymethods]
impl Soundtrack {
    /// world: to be heard from now on. eye, target: place of the listener and the point at which it looks, m; by default the camera of
    /// the scene, or ``(0, -3, 1.7)`` and the origin. materials: names of bodies, and how each sounds: ``"wood"``, ``"rubber"``,
    /// ``"plastic"``, ``"glass"``, ``"stone"`` or ``"steel"``; by default the scene or the density of a body says it.
    #[new]
    #[pyo3(signature = (world, *, eye=None, target=None, materials=None, **unknown), text_signature = "(world, *, eye=None, target=None, materials=None)")]
    fn new(
        py: Python<'_>,
        world: &Bound<'_, World>,
        eye: Option<&Bound<'_, PyAny>>,
        target: Option<&Bound<'_, PyAny>>,
        materials: Option<BTreeMap<String, String>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Soundtrack> {
        keywords::check(unknown, "Soundtrack")?;
        let shared = world.get().shared.clone();
        let (scene, time) = shared.read(|inner| Ok((inner.scene.clone(), inner.world.time())))?;
        let listener = match (eye, target) {
            (None, None) => Listener::of_scene(&scene),
            (Some(eye), target) => {
                let target = target.map_or(Ok([0.0; 3]), |target| some(target, "target"))?;
                Listener::looking(some(eye, "eye")?, target, [0.0, 0.0, 1.0])
            }
            (None, Some(_)) => return Err(Error::value("target: expected an eye with it")),
        };
        let mut track = Track::of_scene(&scene);
        for (body, name) in materials.into_iter().flatten() {
            let material = SoundMaterial::of_name(&name).ok_or_else(|| {
                let names = SOUND_MATERIALS.map(|material| material.name);
                Error::value(format!("materials: '{name}' of '{body}'; expected one of {}", names.join(", ")))
            })?;
            track.set_material(body, material);
        }
        let heard = Mutex::new(Heard { track, frames: 0, begin: time, end: time });
        Ok(Soundtrack { anchor: anchor(py, &shared)?, shared, listener, heard })
    }

    /// Listens to the last frame of the world. Every frame must be heard, each once.
    fn frame(&self, py: Python<'_>) -> Result<()> {
        py.detach(|| self.listen())
    }

    /// Steps the world n times and listens to each frame.
    #[pyo3(signature = (n, **unknown), text_signature = "($self, n)")]
    fn run(
        &self,
        py: Python<'_>,
        #[pyo3(from_py_with = whole::n)] n: u32,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<()> {
        keywords::check(unknown, "Soundtrack.run")?;
        for _ in 0..n {
            self.shared.work(py, |inner| inner.step())?;
            self.frame(py)?;
            py.check_signals()?;
        }
        Ok(())
    }

    /// Number of impacts so far.
    #[getter]
    fn impacts(&self) -> u64 {
        self.heard().track.impacts()
    }

    /// Number of sounds that were left out because there were too many.
    #[getter]
    fn left_out(&self) -> u64 {
        self.heard().track.left_out()
    }

    /// Returns the samples of both ears, shape (n, 2), 48,000 for each second; 1 is full scale, and louder ones are not cut.
    fn samples<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray2<f64>>> {
        let samples = self.mixed(py)?.samples;
        let shape = [samples.len(), 2];
        Ok(PyArray1::from_iter(py, samples.into_iter().flatten()).reshape(shape)?)
    }

    /// Writes a WAV file of 16 bits, whose name ends in ``.wav``, and returns the factor of its samples. gain_db: gain, -120 to 120 dB; by
    /// default the peak is brought to -3 dB of full scale. A peak above 0.98 of full scale is lowered to it by one factor for the whole.
    #[pyo3(signature = (path, *, gain_db=None, **unknown), text_signature = "($self, path, *, gain_db=None)")]
    fn save(
        &self,
        py: Python<'_>,
        path: &Bound<'_, PyAny>,
        gain_db: Option<f64>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<f64> {
        keywords::check(unknown, "Soundtrack.save")?;
        let path = crate::arrays::convert::path(path)?;
        if path.extension().is_some_and(|ending| !ending.eq_ignore_ascii_case("wav")) {
            let file = path.display();
            return Err(Error::value(format!(
                "path: '{file}'; sound is written as WAV; expected a file that ends in .wav"
            )));
        }
        let mixed = self.mixed(py)?;
        let gain = mixed.gain(gain_db).map_err(failed)?;
        py.detach(|| {
            write(&path, &mixed.wav(gain).map_err(failed)?)?;
            Ok(gain)
        })
    }

    fn __repr__(&self) -> String {
        format!("<tumble.Soundtrack: {} impacts in {} frames>", self.impacts(), self.heard().frames)
    }

    fn __traverse__(&self, visit: PyVisit<'_>) -> std::result::Result<(), PyTraverseError> {
        visit.call(&self.anchor)
    }
}

fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    std::fs::write(path, bytes).map_err(|source| Error::File { file: path.display().to_string(), source })
}
