//! Listeners to the contacts of a run: a sound engine, files of the users, and the outputs of this machine.

use super::contact_sound::ContactSound;
use super::user_audio::UserAudio;
use crate::cave::args::ServeOptions;
use crate::failure::Failure;
use crate::player::{Player, wanted};
use tumble::dynamics::World;
use tumble::net::sync::{User, Viewer};
use tumble::scene::SceneFile;
use tumble::sound::Listener;

/// The sounds of a run.
pub struct Sounds {
    /// `--sound`.
    pub engine: Option<ContactSound>,
    /// `--audio`.
    pub files: Option<UserAudio>,
    /// `--play`, heard by the first user.
    pub player: Option<Player>,
}

impl Sounds {
    /// Prepares what the options ask for; `users` names the users.
    pub fn open(
        options: &ServeOptions,
        scene: &SceneFile,
        users: Vec<String>,
        world: &World,
    ) -> Result<Sounds, Failure> {
        let listened = options.audio.as_deref().zip(options.duration);
        let files = listened.map(|(folder, duration)| UserAudio::new(folder, scene, &users, world, duration));
        Ok(Sounds {
            files: files.transpose()?,
            engine: options.sound.map(|engine| ContactSound::open(engine, users)).transpose()?,
            player: wanted(&options.play, scene)?,
        })
    }

    /// Listens to a step.
    pub fn step(&mut self, world: &World) {
        self.engine.iter_mut().for_each(|engine| engine.step(world));
        self.files.iter_mut().for_each(|files| files.step(world));
        self.player.iter_mut().for_each(|player| player.step(world));
    }

    /// Ends a frame. Returns why nothing is played any more, once.
    pub fn frame(&mut self, frame: u64, world: &World, viewer: &Viewer) -> Option<String> {
        self.engine.iter_mut().for_each(|engine| engine.frame(frame, world, viewer));
        self.files.iter_mut().for_each(|files| files.frame(viewer));
        let ears = ears(viewer, viewer.users.first()?);
        self.player.as_mut()?.frame(&ears)
    }
}

/// Returns the ears of a user, in meters of the scene.
pub fn ears(viewer: &Viewer, user: &User) -> Listener {
    let at = viewer.cave * nalgebra::Point3::from(user.head.translation.vector * viewer.scale);
    let right = viewer.cave.rotation * user.head.rotation * nalgebra::Vector3::x();
    Listener { position: at.into(), right: right.into() }
}
