//! `--audio`: the sound of a run, heard from the camera that is drawn.

use crate::args::RunOptions;
use crate::atomic_file::write_file;
use crate::failure::Failure;
use std::path::Path;
use tumble::dynamics::{CameraChange, World};
use tumble::render::{Camera, DrawList};
use tumble::scene::SceneFile;
use tumble::sound::{Listener, MAX_SECONDS, Mixed, SoundError, Soundtrack};

/// The sound of one run.
pub struct Audio {
    soundtrack: Soundtrack,
    /// Listener while nothing else was chosen.
    scene: Listener,
    /// `--camera`.
    camera: Option<String>,
    /// `--audio-gain`, dB.
    gain: Option<f64>,
    /// The listener from a time of the run on, s.
    ears: Vec<(f64, Listener)>,
    begin: f64,
}

impl Audio {
    /// Prepares the sound of a scene. Without a camera it is heard from 3 m before the origin, 1.7 m up.
    pub fn new(scene: &SceneFile, world: &World, options: &RunOptions) -> Result<Audio, Failure> {
        if scene.world.duration_s > MAX_SECONDS {
            return Err(Failure::input(format!(
                "--audio: a run of {} s; expected at most {MAX_SECONDS} s",
                scene.world.duration_s
            )));
        }
        let mut audio = Audio {
            soundtrack: Soundtrack::of_scene(scene),
            scene: Listener::of_scene(scene),
            camera: options.camera.clone(),
            gain: options.audio_gain,
            ears: Vec::new(),
            begin: world.time(),
        };
        let listener = audio.listener(world).map_err(Failure::input)?;
        audio.ears.push((0.0, listener));
        Ok(audio)
    }

    /// Listens to a frame.
    pub fn frame(&mut self, world: &World) -> Result<(), Failure> {
        self.soundtrack.frame(world);
        let listener = self.listener(world).map_err(|e| Failure::run("the sound", e))?;
        if self.ears.last().is_none_or(|(_, last)| *last != listener) {
            self.ears.push((world.time() - self.begin, listener));
        }
        Ok(())
    }

    /// Returns the ears at the camera that a picture of the world would have: that of `--camera`, else of the latest
    /// event that chose one, else of the scene.
    fn listener(&self, world: &World) -> Result<Listener, String> {
        let from = |name: &str| match name {
            "scene" => Ok(self.scene),
            _ => camera(world, name),
        };
        let mut listener = match world.looks().camera {
            None => self.scene,
            Some(CameraChange::Named(name)) => from(&name)?,
            Some(CameraChange::LookAt { eye, target, .. }) => {
                Listener::looking(eye.into(), target.into(), [0.0, 0.0, 1.0])
            }
        };
        if let Some(name) = self.camera.as_deref().filter(|name| *name != "scene") {
            listener = camera(world, name)?;
        }
        Ok(listener)
    }

    /// Writes the file of a run of `duration` s, and returns what it is.
    pub fn write(self, path: &Path, duration: f64) -> Result<String, Failure> {
        let failed = |e: SoundError| Failure::run("the sound", e);
        let mixed = self.soundtrack.mix_moving(&self.ears, duration).map_err(failed)?;
        let gain = mixed.gain(self.gain).map_err(failed)?;
        write_file(path, &mixed.wav(gain).map_err(failed)?)?;
        let lost = match self.soundtrack.left_out() {
            0 => String::new(),
            n => format!(", {n} sounds left out"),
        };
        Ok(format!("sound of {} impacts, {}{lost}", self.soundtrack.impacts(), self.levels(&mixed, gain)))
    }

    /// Describes the peak of the file and the gain that made it.
    fn levels(&self, mixed: &Mixed, gain: f64) -> String {
        let level = |x: f64| 20.0 * x.log10();
        if mixed.peak() <= 0.0 {
            return "silent".into();
        }
        let limited = if self.gain.is_some_and(|asked| level(gain) < asked - 1e-6) { ", limited" } else { "" };
        format!("peak {:.1} dB, gain {:+.1} dB{limited}", level(mixed.peak() * gain), level(gain))
    }
}

/// Returns a listener at a mounted camera.
fn camera(world: &World, name: &str) -> Result<Listener, String> {
    let mut list = DrawList::default();
    list.look_from(world, name).map_err(|unknown| unknown.to_string())?;
    match list.camera {
        Camera::LookAt { eye, target, up, .. } => {
            let [eye, target, up] = [eye.coords, target.coords, up].map(|v| v.map(f64::from).into());
            Ok(Listener::looking(eye, target, up))
        }
        Camera::Raw { .. } => Err(format!("the camera '{name}' has no place")),
    }
}
