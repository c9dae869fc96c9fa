//! The sound of a world while it runs: a [`LiveSound`] collects what sounds, and a [`LiveMixer`] on another thread renders it.
//!
//! Sounds arrive after they begin, so the samples up to the end of a frame are final when the frame has been simulated. They are
//! those that [`Soundtrack::mix_moving`] gives with the same ears. The mixer keeps what is not heard yet: at most the longest
//! voice and the way of the sound.
//!
//! A track that is written has one gain, from its peak. The peak of a run that goes on is unknown, so the gain falls when a
//! sample would exceed full scale, and never rises: the proportions stay from then on.

use super::mix::Renderer;
use super::wav::CEILING;
use super::{Listener, RATE_HZ, Rub, Soundtrack, Strike};
use tumble_core::World;
use tumble_scene::SceneFile;

/// Gain at the start, dB: shipped scenes have their peak at -3 dB of full scale with 11 to 40 dB.
pub const LIVE_GAIN_DB: f64 = 30.0;
/// Largest number of strikes of a frame, the loudest, which a mixer renders in real time.
const MAX_STRIKES: usize = 32;

/// Collects the sounds of a world that runs.
pub struct LiveSound {
    scene: SceneFile,
    soundtrack: Soundtrack,
    /// Time of the world after the last step, s.
    time: f64,
    restarted: bool,
    left_out: u64,
}

/// The sounds of a frame.
pub struct LiveFrame {
    /// Whether what sounded before ends: the world went back in time.
    restarted: bool,
    strikes: Vec<Strike>,
    rubs: Vec<(u64, Rub)>,
    ears: Listener,
    /// End of the frame, s after the start of the first.
    end: f64,
}

impl LiveSound {
    /// Begins the sound of a scene.
    pub fn new(scene: SceneFile) -> LiveSound {
        let soundtrack = Soundtrack::of_scene(&scene);
        LiveSound { scene, soundtrack, time: f64::NEG_INFINITY, restarted: false, left_out: 0 }
    }

    /// Listens to a step. A world that went back in time is listened to from there on.
    pub fn step(&mut self, world: &World) {
        if world.time() < self.time {
            self.left_out += self.soundtrack.left_out();
            self.soundtrack = Soundtrack::of_scene(&self.scene);
            self.restarted = true;
        }
        self.time = world.time();
        self.soundtrack.frame(world);
    }

    /// Returns the sounds since the last call. They are heard from where the listener is now.
    pub fn frame(&mut self, ears: &Listener) -> LiveFrame {
        let (mut strikes, rubs, end) = self.soundtrack.take(self.time);
        if let Some(more) = strikes.len().checked_sub(MAX_STRIKES).filter(|more| *more > 0) {
            self.left_out += more as u64;
            // in the order of their time, whatever their loudness
            let mut order: Vec<usize> = (0..strikes.len()).collect();
            let speed = |k: &usize| strikes[*k].impulse / strikes[*k].body.mass;
            order.sort_by(|a, b| speed(b).total_cmp(&speed(a)));
            order.truncate(MAX_STRIKES);
            order.sort_unstable();
            strikes = order.into_iter().map(|k| strikes[k]).collect();
        }
        LiveFrame { restarted: std::mem::take(&mut self.restarted), strikes, rubs, ears: *ears, end }
    }

    /// Returns how many sounds were left out because there were too many.
    pub fn left_out(&self) -> u64 {
        self.left_out + self.soundtrack.left_out()
    }
}

/// Renders the frames of a [`LiveSound`].
pub struct LiveMixer {
    renderer: Renderer,
    gain: f64,
}

impl LiveMixer {
    /// Begins with a gain, dB.
    pub fn new(gain_db: f64) -> LiveMixer {
        let gain = libm::pow(10.0, gain_db / 20.0);
        LiveMixer { renderer: Renderer::default(), gain }
    }

    /// Returns the samples of both ears from the end of the last frame to the end of this one; 1 is full scale, with the gain.
    pub fn mix(&mut self, frame: &LiveFrame) -> Vec<[f64; 2]> {
        if frame.restarted {
            self.renderer = Renderer::default();
        }
        self.renderer.add(&frame.strikes, &frame.rubs, |_| frame.ears);
        // the times of two frames that meet differ by rounding, so the last sample waits
        let end = (frame.end * f64::from(RATE_HZ)).floor() as usize;
        let mut samples = self.renderer.canvas.take(end.saturating_sub(1));
        let peak = samples.iter().flatten().fold(0.0, |most: f64, sample| most.max(sample.abs()));
        if peak * self.gain > CEILING {
            self.gain = CEILING / peak;
        }
        samples.iter_mut().flatten().for_each(|sample| *sample *= self.gain);
        samples
    }

    /// Returns the present gain, dB.
    pub fn gain_db(&self) -> f64 {
        20.0 * libm::log10(self.gain)
    }
}
