//! `--play`: the sound of a run on the outputs of this machine, by a program that plays samples from its standard input.
//!
//! A thread mixes the frames and writes the samples: two channels of 16 bits, little-endian, at 48 kHz. It never delays the
//! simulation. Frames that come while many wait are not heard, and of samples that are late only the last tenth of a second is
//! played, so the sound stays close to the picture.

use crate::failure::Failure;
use rustix::pipe::fcntl_setpipe_size;
use serde::Serialize;
use std::io::Write;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tumble::dynamics::World;
use tumble::scene::SceneFile;
use tumble::sound::{LIVE_GAIN_DB, Listener, LiveFrame, LiveMixer, LiveSound, RATE_HZ};

/// Programs that are tried in this order, of PulseAudio, ALSA, PipeWire and SoX.
const PLAYERS: [&str; 4] = [
    "pacat --playback --raw --rate=48000 --channels=2 --format=s16le --latency-msec=60",
    "aplay -q -t raw -f S16_LE -r 48000 -c 2 -B 100000",
    "pw-cat --playback --raw --rate 48000 --channels 2 --format s16 --latency 60ms -",
    "play -q -t raw -r 48000 -c 2 -e signed -b 16 -",
];
/// Largest number of frames that wait for the mixer.
const WAITING: usize = 16;
/// Least length of a frame of a window, s.
const FRAME_S: f64 = 1.0 / 61.0;
/// Silence before the first sample, s: frames are not ready at equal intervals.
const LEAD_S: f64 = 0.03;
/// Largest number of samples that are played of those that have become late.
const MOST: usize = RATE_HZ as usize / 10;
/// Samples in the pipe: what is there is not heard yet.
const PIPE_BYTES: usize = 16 * 1024;
/// Time for the last samples.
const LAST: Duration = Duration::from_secs(1);

/// Options of the sound that is played.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct PlayOptions {
    /// Play the sound of the run on this machine, by a command that plays samples from its standard input: two channels of
    /// 16 bits at 48 kHz (default: pacat, aplay, pw-cat or play).
    #[arg(long, value_name = "COMMAND", num_args = 0..=1, require_equals = true, default_missing_value = "")]
    pub play: Option<String>,
    /// Gain of the sound at the start, dB. It falls when a sample would exceed full scale.
    #[arg(
        long,
        value_name = "DB",
        requires = "play",
        allow_negative_numbers = true,
        default_value_t = LIVE_GAIN_DB,
        value_parser = crate::args::gain
    )]
    pub play_gain: f64,
}

/// Starts a player if one is wanted.
pub fn wanted(options: &PlayOptions, scene: &SceneFile) -> Result<Option<Player>, Failure> {
    options.play.as_deref().map(|command| Player::start(command, scene, options.play_gain)).transpose()
}

/// Counts of a run.
#[derive(Clone, Debug, Serialize, PartialEq)]
pub struct Counts {
    /// The program.
    pub player: String,
    /// Frames that were mixed.
    pub frames: u64,
    /// Frames that came too fast to be heard, or after the end of the program.
    pub not_heard: u64,
    /// Sounds left out because a frame had too many.
    pub left_out: u64,
}

/// Plays a run.
pub struct Player {
    sound: LiveSound,
    child: Child,
    frames: Option<SyncSender<LiveFrame>>,
    thread: Option<JoinHandle<u64>>,
    counts: Counts,
    ended: bool,
    /// Time of the last frame, s.
    last: f64,
}

impl Player {
    /// Starts the program, words separated by spaces; if it is empty, the first of the known ones that is installed.
    pub fn start(command: &str, scene: &SceneFile, gain_db: f64) -> Result<Player, Failure> {
        let mut child = match command.trim() {
            "" => PLAYERS.into_iter().find_map(|player| spawn(player).ok()).ok_or_else(|| {
                let names: Vec<&str> = PLAYERS.iter().filter_map(|player| player.split(' ').next()).collect();
                Failure::input(format!(
                    "--play: no program that plays samples is installed; expected one of {}, or --play=COMMAND",
                    names.join(", ")
                ))
            })?,
            command => {
                spawn(command).map_err(|e| Failure::input(format!("--play={command}: cannot be started: {e}")))?
            }
        };
        let failed = |e: String| Failure::run("--play", e);
        let input = child.0.stdin.take().ok_or_else(|| failed("no standard input".into()))?;
        // a larger pipe only plays later
        let _ = fcntl_setpipe_size(&input, PIPE_BYTES);
        let (frames, waiting) = sync_channel(WAITING);
        let mixer = LiveMixer::new(gain_db);
        let thread = std::thread::Builder::new().name("sound".into()).spawn(move || play(mixer, &waiting, input));
        let thread = thread.inspect_err(|_| drop(child.0.kill())).map_err(|e| failed(e.to_string()))?;
        let counts = Counts { player: child.1, frames: 0, not_heard: 0, left_out: 0 };
        let sound = LiveSound::new(scene.clone());
        Ok(Player {
            sound,
            child: child.0,
            frames: Some(frames),
            thread: Some(thread),
            counts,
            ended: false,
            last: 0.0,
        })
    }

    /// Listens to a step.
    pub fn step(&mut self, world: &World) {
        self.sound.step(world);
    }

    /// Listens to a step, and plays a frame when a sixtieth of a second is complete. Returns why nothing is heard any more, once.
    pub fn step_and_play(&mut self, world: &World, ears: &Listener) -> Option<String> {
        self.step(world);
        if (world.time() - self.last).abs() < FRAME_S {
            return None;
        }
        self.last = world.time();
        self.frame(ears)
    }

    /// Plays the steps since the last call, heard from a place. Returns why nothing is heard any more, once.
    pub fn frame(&mut self, ears: &Listener) -> Option<String> {
        let frame = self.sound.frame(ears);
        match self.frames.as_ref()?.try_send(frame) {
            Ok(()) => self.counts.frames += 1,
            Err(TrySendError::Full(_)) => self.counts.not_heard += 1,
            Err(TrySendError::Disconnected(_)) => {
                self.counts.not_heard += 1;
                if !std::mem::replace(&mut self.ended, true) {
                    let status = self.child.try_wait().ok().flatten().map_or(String::new(), |s| format!(" ({s})"));
                    return Some(format!("{} has ended{status}; the run is not heard any more", self.counts.player));
                }
            }
        }
        None
    }

    /// Returns the counts so far.
    pub fn counts(&self) -> Counts {
        Counts { left_out: self.sound.left_out(), ..self.counts.clone() }
    }
}

impl Drop for Player {
    /// Lets the program play what it has, for a second at most.
    fn drop(&mut self) {
        self.frames = None;
        let until = Instant::now() + LAST;
        let ended = |child: &mut Child| !matches!(child.try_wait(), Ok(None));
        while !ended(&mut self.child) && Instant::now() < until {
            std::thread::sleep(Duration::from_millis(10));
        }
        if !ended(&mut self.child) {
            // the thread may be writing to it
            let _ = self.child.kill();
        }
        let _ = self.child.wait();
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

/// Starts a program; returns its name too.
fn spawn(command: &str) -> std::io::Result<(Child, String)> {
    let mut words = command.split_whitespace();
    let program = words.next().unwrap_or_default();
    let child =
        Command::new(program).args(words).stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::null()).spawn()?;
    Ok((child, program.to_owned()))
}

/// Mixes and writes until there are no more frames or nobody reads. Returns the number of samples written.
fn play(mut mixer: LiveMixer, frames: &Receiver<LiveFrame>, mut to: impl Write) -> u64 {
    let mut written = 0;
    let mut samples = vec![[0.0; 2]; (LEAD_S * f64::from(RATE_HZ)) as usize];
    loop {
        let heard = &samples[samples.len().saturating_sub(MOST)..];
        let bytes: Vec<u8> = heard.iter().flatten().flat_map(|x| sample(*x).to_le_bytes()).collect();
        if to.write_all(&bytes).is_err() {
            return written;
        }
        written += heard.len() as u64;
        let Ok(frame) = frames.recv() else { return written };
        samples = mixer.mix(&frame);
        frames.try_iter().for_each(|frame| samples.extend(mixer.mix(&frame)));
    }
}

/// Converts a sample to 16 bits.
fn sample(x: f64) -> i16 {
    (x * f64::from(i16::MAX)).round() as i16
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::{Arc, Mutex};

    const SCENE: &str = "[[body]]\nname = \"floor\"\nmode = \"static\"\nshape = { type = \"half_space\" }\n\
        [[body]]\nname = \"ball\"\nshape = { type = \"sphere\", radius_m = 0.1 }\nmass_kg = 1.0\nsound = \"steel\"\nposition_m = [0, 0, 0.3]\n";
    const EARS: Listener = Listener { position: [0.0, -1.0, 0.5], right: [1.0, 0.0, 0.0] };

    /// Bytes that were written.
    #[derive(Clone, Default)]
    struct Written(Arc<Mutex<Vec<u8>>>);

    impl Write for Written {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            self.0.lock().unwrap().extend_from_slice(bytes);
            Ok(bytes.len())
        }

        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }

    /// Frames that are mixed as they come are the samples of the run, after the silence of the start.
    #[test]
    fn frames_become_the_samples_of_the_run() {
        let scene = SceneFile::parse(SCENE, "s.toml").unwrap();
        let mut world = scene.build().unwrap().0;
        let [mut live, mut played] = [0; 2].map(|_| LiveSound::new(scene.clone()));
        let mut mixer = LiveMixer::new(20.0);
        let mut expected = vec![0u8; (LEAD_S * f64::from(RATE_HZ)) as usize * 4];
        let written = Written::default();
        let (frames, waiting) = sync_channel(WAITING);
        let to = written.clone();
        let thread = std::thread::spawn(move || play(LiveMixer::new(20.0), &waiting, to));
        for _ in 0..60 {
            for _ in 0..4 {
                world.step().unwrap();
                played.step(&world);
                live.step(&world);
            }
            frames.send(played.frame(&EARS)).unwrap();
            let samples = mixer.mix(&live.frame(&EARS));
            expected.extend(samples.iter().flatten().flat_map(|x| sample(*x).to_le_bytes()));
            let until = Instant::now() + Duration::from_secs(30);
            while written.0.lock().unwrap().len() < expected.len() {
                assert!(Instant::now() < until, "the frame is not written");
                std::thread::sleep(Duration::from_millis(1));
            }
        }
        drop(frames);
        assert_eq!(thread.join().unwrap() * 4, expected.len() as u64);
        assert!(*written.0.lock().unwrap() == expected && expected.iter().any(|x| *x != 0));
    }

    /// Frames wait while a program does not read; then only their last tenth of a second is played.
    #[test]
    fn late_samples_are_left_out() {
        let scene = SceneFile::parse(SCENE, "s.toml").unwrap();
        let mut world = scene.build().unwrap().0;
        let mut live = LiveSound::new(scene);
        let (frames, waiting) = sync_channel(WAITING);
        for _ in 0..WAITING {
            for _ in 0..8 {
                world.step().unwrap();
                live.step(&world);
            }
            frames.send(live.frame(&EARS)).unwrap();
        }
        drop(frames);
        let mut bytes = Vec::new();
        let silence = (LEAD_S * f64::from(RATE_HZ)) as usize;
        assert_eq!(play(LiveMixer::new(0.0), &waiting, &mut bytes), (silence + MOST) as u64);
        assert_eq!(bytes.len(), 4 * (silence + MOST));
    }

    /// A program gets whole samples on its standard input.
    #[test]
    fn a_program_gets_samples() {
        let file = std::env::temp_dir().join(format!("tumble-player-{}", std::process::id()));
        let scene = SceneFile::parse(SCENE, "s.toml").unwrap();
        let mut world = scene.build().unwrap().0;
        let mut player = Player::start(&format!("dd status=none of={}", file.display()), &scene, 20.0).ok().unwrap();
        for _ in 0..60 {
            world.step().unwrap();
            player.step(&world);
            assert_eq!(player.frame(&EARS), None);
        }
        let counts = player.counts();
        drop(player);
        let heard = std::fs::read(&file).unwrap();
        std::fs::remove_file(&file).unwrap();
        assert_eq!((counts.player.as_str(), counts.frames + counts.not_heard, counts.left_out), ("dd", 60, 0));
        assert!(heard.len() > 4 * (LEAD_S * f64::from(RATE_HZ)) as usize && heard.len().is_multiple_of(4));
    }

    /// A program that reads nothing, or that ends, delays nothing and is said.
    #[test]
    fn a_program_that_does_not_play_stops_nothing() {
        let scene = SceneFile::parse(SCENE, "s.toml").unwrap();
        let mut world = scene.build().unwrap().0;
        let mut stuck = Player::start("sleep 60", &scene, 0.0).ok().unwrap();
        let mut gone = Player::start("true", &scene, 0.0).ok().unwrap();
        std::thread::sleep(Duration::from_millis(300));
        let begin = Instant::now();
        let mut said = Vec::new();
        for _ in 0..240 {
            world.step().unwrap();
            stuck.step(&world);
            gone.step(&world);
            assert_eq!(stuck.frame(&EARS), None);
            said.extend(gone.frame(&EARS));
            std::thread::sleep(Duration::from_millis(1));
        }
        assert!(begin.elapsed() < Duration::from_secs(20));
        assert!(stuck.counts().not_heard > 0, "{:?}", stuck.counts());
        assert!(said.len() == 1 && said[0].starts_with("true has ended (exit status: 0)"), "{said:?}");
        let end = Instant::now();
        drop(stuck);
        assert!(end.elapsed() < Duration::from_secs(10), "a program that reads nothing is killed");
    }

    #[test]
    fn a_program_that_is_not_installed_is_named() {
        let scene = SceneFile::parse(SCENE, "s.toml").unwrap();
        let failure = Player::start("no-such-player -x", &scene, 0.0).err().expect("it is not installed");
        let said = failure.report();
        assert!(said.contains("--play=no-such-player -x: cannot be started"), "{said}");
    }
}
