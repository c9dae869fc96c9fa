//! `tumble run`: simulates a scene and writes its results.

use crate::args::RunOptions;
use crate::atomic_file::{check_writable, write_file};
use crate::audio::Audio;
use crate::capture::{Capture, write_png};
use crate::divergence;
use crate::failure::Failure;
use crate::progress::Progress;
use crate::recording_file::{self, NamedBy};
use crate::summary::{State, Summary, Tally};
use std::io::Read;
use std::path::Path;
use std::time::Instant;
use tumble::dynamics::World;
use tumble::net::record::{Images, Recorder, RecorderOptions};
use tumble::net::world::{contacts, deforming, entities, events, images, poses, readings};
use tumble::scene::{SceneFile, SceneWriter, open_file, visual_notes};

/// Largest saved state that is read: a thousand times the size of one of ten thousand bodies.
const MAX_STATE_BYTES: u64 = 1 << 30;

/// Runs a scene.
pub fn run(options: &RunOptions) -> Result<(), Failure> {
    let outputs =
        [&options.summary, &options.screenshot, &options.save, &options.save_scene, &options.video, &options.audio];
    outputs
        .into_iter()
        .flatten()
        .try_for_each(|path| check_writable(path).map_err(|why| Failure::run("the results", why)))?;
    options.record.as_deref().map_or(Ok(false), |file| recording_file::check(file, NamedBy::User))?;
    let mut scene = options.scene.load()?;
    scene.world.duration_s = options.duration.unwrap_or(scene.world.duration_s);
    let (mut world, notes) = scene.build().map_err(Failure::input)?;
    notes.iter().filter(|_| !options.quiet).for_each(|note| println!("{note}"));
    restore(&mut world, options)?;
    let mut capture = Capture::new(&scene, &world, options)?;
    let mut recorder = recorder(&world, &scene, options)?;
    // the capture and the recorder have read the visual meshes by now
    visual_notes(world.visuals()).iter().filter(|_| !options.quiet).for_each(|note| println!("{note}"));
    let start = State::of(&world);
    let mut audio = options.audio.is_some().then(|| Audio::new(&scene, &world, options)).transpose()?;
    let outputs = Outputs { recorder: recorder.as_mut(), capture: capture.as_mut(), audio: audio.as_mut() };
    let simulated = simulate(&mut world, outputs, &scene, options)?;
    finish_recording(recorder, options)?;
    if let Some(path) = &options.save {
        write_file(path, &world.save())?;
    }
    save_scene(&world, &scene, options)?;
    let summary = simulated.tally.summary(&scene.file, &world, start, simulated.time_s, simulated.wall_s);
    if !options.quiet {
        print!("{}", summary.lines());
    }
    write_summary(&summary, options)?;
    if let (Some(audio), Some(path)) = (audio, &options.audio) {
        let what = audio.write(path, simulated.time_s)?;
        say(options, &what, path);
    }
    pictures(&world, capture, options)?;
    // what was computed is written all the same
    simulated.outcome
}

/// The outputs that look at each frame.
struct Outputs<'a> {
    recorder: Option<&'a mut Recorder>,
    capture: Option<&'a mut Capture>,
    audio: Option<&'a mut Audio>,
}

/// A run without its outputs.
struct Simulated {
    tally: Tally,
    /// Simulated time, s.
    time_s: f64,
    /// Wall-clock time spent in steps, s.
    wall_s: f64,
    /// An error if the simulation has diverged, which ends it.
    outcome: Result<(), Failure>,
}

fn restore(world: &mut World, options: &RunOptions) -> Result<(), Failure> {
    let Some(path) = &options.restore else { return Ok(()) };
    let wrong = |why: String| Failure::input(format!("{}: {why}", path.display()));
    let mut bytes = Vec::new();
    // an endless file, such as a device, is read no further
    let read = open_file(path).and_then(|file| file.take(MAX_STATE_BYTES + 1).read_to_end(&mut bytes));
    read.map_err(|e| wrong(format!("cannot be read: {e}")))?;
    if bytes.len() as u64 > MAX_STATE_BYTES {
        return Err(wrong(format!("is larger than {MAX_STATE_BYTES} bytes, the largest size of a saved state")));
    }
    world.restore(&bytes).map_err(|e| wrong(e.to_string()))
}

fn recorder(world: &World, scene: &SceneFile, options: &RunOptions) -> Result<Option<Recorder>, Failure> {
    let Some(path) = &options.record else { return Ok(None) };
    let recorder = Recorder::create(path, &scene.file, &entities(world), RecorderOptions::default());
    recorder.map(Some).map_err(|e| Failure::run("recording", e))
}

/// Steps to the end, or until the simulation diverges.
fn simulate(
    world: &mut World,
    Outputs { mut recorder, mut capture, mut audio }: Outputs<'_>,
    scene: &SceneFile,
    options: &RunOptions,
) -> Result<Simulated, Failure> {
    let frames = (scene.world.duration_s / scene.world.dt_s).round() as u64;
    let (begin, mut tally, mut wall) = (world.time(), Tally::default(), 0.0);
    let mut progress = Progress::new(frames, options.quiet);
    let mut record = |world: &World| match &mut recorder {
        Some(r) => r
            .report(&readings(world), &events(world))
            .and_then(|()| r.images(&if options.record_cameras { images(world) } else { Images::new() }))
            .and_then(|()| r.deforming(world.time(), &deforming(world)))
            .and_then(|()| r.frame(world.time(), world.frame(), &poses(world), &contacts(world), &world.save()))
            .map_err(|e| Failure::run("recording", e)),
        None => Ok(()),
    };
    let mut shoot = |world: &World| capture.as_mut().map_or(Ok(()), |capture| capture.frame(world, begin));
    record(world)?;
    shoot(world)?;
    let mut outcome = divergence::check(world);
    for frame in 1..=frames {
        let clock = Instant::now();
        let report = match world.step() {
            Ok(report) => *report,
            Err(e) => {
                outcome = Err(Failure::run("the simulation stopped", e));
                break;
            }
        };
        let taken = clock.elapsed().as_secs_f64();
        tally.add(&report, taken);
        wall += taken;
        record(world)?;
        shoot(world)?;
        audio.as_mut().map_or(Ok(()), |audio| audio.frame(world))?;
        progress.at(frame, world.time());
        outcome = divergence::check(world);
        if outcome.is_err() {
            break;
        }
    }
    progress.done();
    Ok(Simulated { tally, time_s: world.time() - begin, wall_s: wall, outcome })
}

fn finish_recording(recorder: Option<Recorder>, options: &RunOptions) -> Result<(), Failure> {
    let (Some(recorder), Some(path)) = (recorder, &options.record) else { return Ok(()) };
    recorder.finish().map_err(|e| Failure::run("recording", e))?;
    say(options, "recording", path);
    Ok(())
}

fn save_scene(world: &World, scene: &SceneFile, options: &RunOptions) -> Result<(), Failure> {
    let Some(path) = &options.save_scene else { return Ok(()) };
    let notes = SceneWriter::new(world).like(scene).save(path).map_err(|e| Failure::run("the scene", e))?;
    notes.iter().filter(|_| !options.quiet).for_each(|note| println!("{note}"));
    say(options, "scene", path);
    Ok(())
}

fn write_summary(summary: &Summary, options: &RunOptions) -> Result<(), Failure> {
    let Some(path) = &options.summary else { return Ok(()) };
    let text = serde_json::to_string_pretty(summary).map_err(|e| Failure::run("the summary", e))?;
    write_file(path, (text + "\n").as_bytes())?;
    say(options, "summary", path);
    Ok(())
}

/// Ends the video and takes the screenshot of the last frame.
fn pictures(world: &World, capture: Option<Capture>, options: &RunOptions) -> Result<(), Failure> {
    let Some(mut capture) = capture else { return Ok(()) };
    let count = capture.finish_frames()?;
    if let Some(folder) = &options.frames_dir {
        say(options, &format!("{count} frames"), folder);
    }
    if let Some(path) = &options.video {
        say(options, "video", path);
    }
    if let Some(path) = &options.screenshot {
        write_png(&capture.take(world)?, path)?;
        say(options, "picture", path);
    }
    Ok(())
}

fn say(options: &RunOptions, what: &str, path: &Path) {
    if !options.quiet {
        println!("{what}: {}", path.display());
    }
}
