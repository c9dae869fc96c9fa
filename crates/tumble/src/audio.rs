//! `--audio`: the sound of a run, heard from the camera of the scene.

use crate::atomic_file::write_file;
use crate::failure::Failure;
use std::path::Path;
use tumble::dynamics::World;
use tumble::scene::SceneFile;
use tumble::sound::{Listener, MAX_SECONDS, Soundtrack};

/// The sound of one run.
pub struct Audio {
    soundtrack: Soundtrack,
    listener: Listener,
}

impl Audio {
    /// Prepares the sound of a scene. Without a camera it is heard from 3 m before the origin, 1.7 m up.
    pub fn new(scene: &SceneFile) -> Result<Audio, Failure> {
        if scene.world.duration_s > MAX_SECONDS {
            return Err(Failure::input(format!(
                "--audio: a run of {} s; expected at most {MAX_SECONDS} s",
                scene.world.duration_s
            )));
        }
        Ok(Audio { soundtrack: Soundtrack::of_scene(scene), listener: Listener::of_scene(scene) })
    }

    /// Listens to a frame.
    pub fn frame(&mut self, world: &World) {
        self.soundtrack.frame(world);
    }

    /// Writes the file of a run of `duration` s, and returns what it is.
    pub fn write(self, path: &Path, duration: f64) -> Result<String, Failure> {
        let failed = |e: tumble::sound::SoundError| Failure::run("the sound", e);
        let mixed = self.soundtrack.mix(&self.listener, duration).map_err(failed)?;
        write_file(path, &mixed.wav().map_err(failed)?)?;
        let level = |x: f64| if x > 0.0 { format!("{:.1} dB", 20.0 * x.log10()) } else { "silent".into() };
        let limited =
            if mixed.limit() < 1.0 { format!(", limited by {}", level(mixed.limit())) } else { String::new() };
        let lost = if self.soundtrack.left_out() > 0 {
            format!(", {} sounds left out", self.soundtrack.left_out())
        } else {
            String::new()
        };
        Ok(format!("sound of {} impacts, peak {}{limited}{lost}", self.soundtrack.strikes().len(), level(mixed.peak())))
    }
}
