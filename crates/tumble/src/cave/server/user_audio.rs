//! `--audio DIR`: the sound of a run as each user hears it, a file per user.
//!
//! A user hears at the head that is tracked, in meters of the scene. All files have one gain, so they can be compared.

use super::sounds::ears as ears_of;
use crate::atomic_file::write_file;
use crate::failure::Failure;
use std::path::{Path, PathBuf};
use tumble::dynamics::World;
use tumble::net::sync::Viewer;
use tumble::scene::SceneFile;
use tumble::sound::{Listener, MAX_SECONDS, Mixed, SoundError, Soundtrack};

/// The sound of one run.
pub struct UserAudio {
    soundtrack: Soundtrack,
    folder: PathBuf,
    /// Names of the files, and the ears from a time of the run on, s.
    users: Vec<(String, Vec<(f64, Listener)>)>,
    begin: f64,
    /// Time of the last frame of the run, s.
    end: f64,
}

impl UserAudio {
    /// Prepares the sound of a run of `duration` s, and the folder of its files.
    pub fn new(
        folder: &Path,
        scene: &SceneFile,
        users: &[String],
        world: &World,
        duration: f64,
    ) -> Result<UserAudio, Failure> {
        if duration > MAX_SECONDS {
            let why = format!("--audio: a run of {duration} s; expected at most {MAX_SECONDS} s");
            return Err(Failure::input(why));
        }
        std::fs::create_dir_all(folder)
            .map_err(|e| Failure::input(format!("--audio {}: cannot create the folder: {e}", folder.display())))?;
        let users = file_names(users).into_iter().map(|name| (name, Vec::new())).collect();
        let (soundtrack, folder) = (Soundtrack::of_scene(scene), folder.to_owned());
        Ok(UserAudio { soundtrack, folder, users, begin: world.time(), end: 0.0 })
    }

    /// Listens to a step.
    pub fn step(&mut self, world: &World) {
        self.soundtrack.frame(world);
        self.end = world.time() - self.begin;
    }

    /// Moves the ears to where the users are in a frame whose last step is at the present time.
    pub fn frame(&mut self, viewer: &Viewer) {
        for ((_, ears), user) in self.users.iter_mut().zip(&viewer.users) {
            let listener = ears_of(viewer, user);
            if ears.last().is_none_or(|(_, last)| *last != listener) {
                ears.push((self.end, listener));
            }
        }
    }

    /// Mixes the sound of each user that has a head.
    fn tracks(&self) -> Result<Vec<(&str, Mixed)>, SoundError> {
        let there = self.users.iter().filter(|(_, ears)| !ears.is_empty());
        there.map(|(name, ears)| Ok((name.as_str(), self.soundtrack.mix_moving(ears, self.end)?))).collect()
    }

    /// Writes the files, and returns what they are.
    pub fn write(&self) -> Result<String, Failure> {
        let failed = |e: SoundError| Failure::run("--audio", e);
        let tracks = self.tracks().map_err(failed)?;
        let loudest = tracks.iter().max_by(|a, b| a.1.peak().total_cmp(&b.1.peak()));
        let gain = loudest.map_or(Ok(1.0), |(_, mixed)| mixed.gain(None)).map_err(failed)?;
        for (name, mixed) in &tracks {
            write_file(&self.folder.join(name), &mixed.wav(gain).map_err(failed)?)?;
        }
        let (impacts, files, folder) = (self.soundtrack.impacts(), tracks.len(), self.folder.display());
        let gain = 20.0 * gain.log10();
        Ok(format!("sound of {impacts} impacts as {files} users hear it, in {folder}, gain {gain:+.1} dB"))
    }
}

/// Returns a file name for each user: its name, with `_` for what some systems do not allow, and its number if that
/// makes two the same.
fn file_names(users: &[String]) -> Vec<String> {
    let plain = |c: char| if c.is_alphanumeric() || "-_".contains(c) { c } else { '_' };
    let names: Vec<String> = users.iter().map(|name| name.chars().take(64).map(plain).collect()).collect();
    let same = |name: &String| names.iter().filter(|other| other.to_lowercase() == name.to_lowercase()).count() > 1;
    let file = |(k, name): (usize, &String)| {
        if same(name) { format!("{name}_{}.wav", k + 1) } else { format!("{name}.wav") }
    };
    names.iter().enumerate().map(file).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use tumble::collide::Pose;
    use tumble::net::sync::User;

    const SCENE: &str = "[[body]]\nname = \"floor\"\nmode = \"static\"\nshape = { type = \"half_space\" }\n\
        [[body]]\nname = \"ball\"\nshape = { type = \"sphere\", radius_m = 0.1 }\nmass_kg = 1.0\nsound = \"steel\"\nposition_m = [0, 0, 0.3]\n";

    /// A user at a place of the cave.
    fn user(x: f64, y: f64) -> User {
        User { head: Pose::translation(x, y, 0.0), interpupillary_m: 0.063, input: 0 }
    }

    /// A ball falls at the origin. The users are about 1 m and 2 m in front of it and 1 m to its left, in a cave that is twice as
    /// large in the scene. Sound takes 140 samples for the shorter way, so nothing is interpolated between samples.
    #[test]
    fn users_hear_a_blow_from_where_they_are() {
        let folder = std::env::temp_dir().join(format!("tumble-user-audio-{}", std::process::id()));
        let scene = SceneFile::parse(SCENE, "s.toml").unwrap();
        let mut world = scene.build().unwrap().0;
        let names = ["near", "far", "left side"].map(str::to_owned);
        let mut audio = UserAudio::new(&folder, &scene, &names, &world, 1.0).ok().unwrap();
        let half = 0.5 * 140.0 * 343.0 / 48_000.0;
        let users = vec![user(0.0, -half), user(0.0, -2.0 * half), user(-half, 0.0)];
        let viewer = Viewer { users, scale: 2.0, ..Viewer::default() };
        audio.frame(&viewer);
        while world.time() < 1.0 {
            world.step().unwrap();
            audio.step(&world);
            audio.frame(&viewer);
        }
        let tracks = audio.tracks().unwrap();
        assert_eq!(tracks.iter().map(|(name, _)| *name).collect::<Vec<_>>(), ["near.wav", "far.wav", "left_side.wav"]);
        let peak = |k: usize, ear: usize| tracks[k].1.samples.iter().fold(0.0, |most: f64, s| most.max(s[ear].abs()));
        // the pressure falls with 1/r, and the blow is some millimeters above the ears; from the front both ears are equal, and from the right the left one hears nothing
        assert!((peak(0, 0) / peak(1, 0) - 2.0).abs() < 1e-3, "{} and {}", peak(0, 0), peak(1, 0));
        assert!((peak(0, 0) / peak(0, 1) - 1.0).abs() < 1e-9);
        assert!(peak(2, 1) > 0.0 && peak(2, 0) < 0.01 * peak(2, 1), "{} and {}", peak(2, 0), peak(2, 1));
        assert!(audio.write().is_ok_and(|said| said.contains("3 users")));
        for name in ["near.wav", "far.wav", "left_side.wav"] {
            let bytes = std::fs::read(folder.join(name)).unwrap();
            assert_eq!((&bytes[..4], &bytes[8..12]), (&b"RIFF"[..], &b"WAVE"[..]), "{name}");
        }
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn names_of_files_are_plain_and_distinct() {
        let users = ["a/b", "a b", "../x", "Viewer"].map(str::to_owned);
        assert_eq!(file_names(&users), ["a_b_1.wav", "a_b_2.wav", "___x.wav", "Viewer.wav"]);
    }
}
