//! The operator's console in a run: what it asks is done between two frames, and it shows the state of
//! the run.

use super::facet_processes::FacetProcesses;
use super::recording::Target;
use super::serve::RunLoop;
use crate::cave::console::{Asked, Console, ConsoleStatus, FacetStatus};
use crate::cave::replay::frames::Replay;
use crate::cave::simulation::{OPERATOR_SOURCE, Request};
use crate::failure::Failure;
use crate::recording_file::NamedBy;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use tumble::net::control::Action;
use tumble::net::sync::Membership;
use tumble::net::sync::transport::FacetNumber;
use tumble::render::CalibrationPattern;

/// Interval at which consoles see a new state.
const INTERVAL: Duration = Duration::from_millis(200);

/// How far the operator's wish ends a run.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Wish {
    /// Not at all.
    #[default]
    GoOn,
    /// This scene.
    NextScene,
    /// This scene, for a replay of this recording.
    Replay(PathBuf),
    /// All scenes.
    Stop,
}

/// The console of a run, if it has one.
pub struct Operator<'a> {
    console: Option<&'a Console>,
    /// Whether another scene follows.
    scene_follows: bool,
    pub wish: Wish,
    /// Number of the last request.
    sequence: u64,
    /// The last state that was shown: when, its frame, and the frames shown by each facet.
    shown: (Instant, u64, Vec<u64>),
}

impl<'a> Operator<'a> {
    pub fn new(console: Option<&'a Console>, scene_follows: bool) -> Operator<'a> {
        Operator { console, scene_follows, wish: Wish::GoOn, sequence: 0, shown: (Instant::now(), 0, Vec::new()) }
    }

    /// Adds a line to the console's log.
    pub fn log(&self, line: &str) {
        self.console.into_iter().for_each(|console| console.log(line));
    }
}

impl RunLoop<'_> {
    /// Does what the console asks, and shows the state of the run.
    pub fn operate(&mut self, processes: &mut FacetProcesses) -> Result<(), Failure> {
        let Some(console) = self.operator.console else { return Ok(()) };
        for (slot, lines, picture) in processes.messages() {
            let name = self.slots.get(slot as usize).map_or("", |slot| slot.name.as_str());
            lines.iter().for_each(|line| console.log(&format!("facet {name}: {}", line.trim())));
            picture.into_iter().for_each(|png| console.set_picture(name, png));
        }
        while let Some(asked) = console.next() {
            self.perform(console, asked, processes)?;
        }
        if self.operator.shown.0.elapsed() >= INTERVAL {
            let status = self.console_status(processes);
            console.set_status(&status);
        }
        Ok(())
    }

    fn perform(&mut self, console: &Console, asked: Asked, processes: &mut FacetProcesses) -> Result<(), Failure> {
        let done = match &asked.action {
            Action::Pause => self.request(Request::Pause, "paused")?,
            Action::Resume => self.request(Request::Resume, "time goes on")?,
            Action::Reset => self.request(Request::Reset, "the world is as before the first step")?,
            Action::Next if !self.operator.scene_follows => Err("no scene follows; --then SCENE adds one".into()),
            Action::Next => {
                self.operator.wish = Wish::NextScene;
                Ok("the next scene begins".into())
            }
            Action::Stop => {
                self.operator.wish = Wish::Stop;
                Ok("the run ends".into())
            }
            Action::Record(file) => self.start_recording(file),
            Action::Unrecord => self.end_recording(),
            Action::Replay(file) => self.replay(Path::new(file)),
            Action::Pattern(name) => show_pattern(name, processes),
            Action::Page | Action::Status | Action::Log | Action::Picture(_) => Err("is read without the run".into()),
        };
        let (Ok(said) | Err(said)) = &done;
        console.log(&format!("console: {}: {said}", asked.action.word()));
        asked.answer(done);
        Ok(())
    }

    /// Makes a request of the operator an input, so that it acts on every node and is recorded.
    fn request(&mut self, request: Request, done: &str) -> Result<Result<String, String>, Failure> {
        if self.replay.is_some() || !self.input_devices.live() {
            return Ok(Err("a replay shows what was recorded".into()));
        }
        self.operator.sequence += 1;
        self.take_input(OPERATOR_SOURCE, request.input(self.operator.sequence))?;
        Ok(Ok(done.to_owned()))
    }

    fn start_recording(&mut self, file: &str) -> Result<String, String> {
        if self.replay.is_some() {
            return Err("a replay is not recorded".into());
        }
        if std::fs::metadata(file).is_ok_and(|about| about.len() > 0) {
            return Err(format!("{file} exists; choose another name"));
        }
        let cameras =
            self.options.record_cameras || self.cave.recording.as_ref().is_some_and(|recording| recording.cameras);
        let (file_path, named_by) = (Path::new(file).to_owned(), NamedBy::CaveFile);
        let target = Target { file: file_path, every_frames: 1, cameras, named_by };
        let text = |failure: Failure| failure.report().trim().to_owned();
        self.recorder.start(&target, &self.scene, self.hash, &self.simulation.world, self.signals).map_err(text)?;
        Ok(format!("recording {file}"))
    }

    /// Ends the scene for a replay of a recording, if it is one of this scene.
    fn replay(&mut self, file: &Path) -> Result<String, String> {
        if self.recorder.file().is_some() {
            return Err("a recording is in progress; end it first".into());
        }
        let writes = self.launcher.is_some_and(|l| l.draw.frames_dir.is_some() || l.draw.log_dir.is_some());
        if writes || self.options.summary.is_some() || self.options.replay_input.is_some() {
            return Err("a run with --frames-dir, --log-dir, --summary or --replay-input replays nothing else".into());
        }
        Replay::open(file, self.hash).map_err(|failure| failure.report().trim().to_owned())?;
        self.operator.wish = Wish::Replay(file.to_owned());
        Ok(format!("replaying {}; then the scene begins again", file.display()))
    }

    fn end_recording(&mut self) -> Result<String, String> {
        let file = self.recorder.file().ok_or("no recording is in progress")?.display().to_string();
        self.recorder.finish(true).map_err(|failure| failure.report().trim().to_owned())?;
        Ok(format!("recorded {file}"))
    }

    fn console_status(&mut self, processes: &FacetProcesses) -> ConsoleStatus {
        let (since, frame_before, shown_before) = &self.operator.shown;
        let passed_s = since.elapsed().as_secs_f64().max(1e-3);
        let frame = self.server.session().frame().unwrap_or(0);
        let per_s = |now: u64, before: u64| now.saturating_sub(before) as f64 / passed_s;
        let facet = |(k, slot): (usize, &tumble::net::sync::FacetSlot)| {
            let number = k as FacetNumber;
            let (counts, _, link) = self.server.counts(number);
            let report = processes.report_of(number);
            let (last, draw_ms) = self.metrics.last(k);
            FacetStatus {
                name: slot.name.clone(),
                membership: match self.server.membership(number) {
                    Membership::Absent => "absent",
                    Membership::Following => "behind",
                    Membership::InStep => "in step",
                },
                frame: last,
                frames_per_s: per_s(counts.presented, shown_before.get(k).copied().unwrap_or(0)),
                draw_ms,
                late: counts.late,
                missing: counts.missing,
                dropped: counts.dropped,
                repeated: link.repeated,
                bytes_out: link.bytes_out,
                waiting: report.waiting,
                pictures: report.pictures,
                black: report.black,
                black_now: report.black_now,
                image: report.image,
                browsers: report.browsers,
                adapter: report.adapter,
                first_difference: self.metrics.difference(k),
            }
        };
        let facets: Vec<FacetStatus> = self.slots.iter().enumerate().map(facet).collect();
        let median = |histogram: &super::histogram::Histogram| histogram.non_empty().map(|q| q.p50_ms);
        let status = ConsoleStatus {
            scene: self.scene.clone(),
            cave: self.cave.file.clone(),
            frame,
            simulated_s: self.time_s,
            frames_per_s: per_s(frame, *frame_before),
            behind_s: self.behind_s,
            simulation_ms: 1e3 * self.metrics.step.quantile(0.5),
            skew_ms: median(&self.metrics.skew),
            input_to_picture_ms: median(&self.metrics.input),
            frame_to_picture_ms: median(&self.metrics.picture),
            tracker_lead_ms: median(&self.metrics.lead),
            paused: self.simulation.is_paused(),
            pattern: processes.pattern().map(str::to_owned),
            replaying: self.replay.is_some(),
            recording: self.recorder.file().map(|file| file.display().to_string()),
            alarms: facets.iter().flat_map(FacetStatus::alarms).chain(self.input_devices.alarms()).collect(),
            facets,
        };
        let shown = (0..self.slots.len()).map(|k| self.server.counts(k as FacetNumber).0.presented).collect();
        self.operator.shown = (Instant::now(), frame, shown);
        status
    }
}

/// Has the facets of this launcher show a calibration pattern, or the scene again.
fn show_pattern(name: &str, processes: &mut FacetProcesses) -> Result<String, String> {
    if name != "off" {
        name.parse::<CalibrationPattern>().map_err(|why| format!("no pattern is named {name}: {why}, or off"))?;
    }
    if !processes.any() {
        return Err("this process started no facets (tumble serve); tumble cave shows patterns".into());
    }
    processes.show_pattern(name);
    Ok(if name == "off" { "the facets show the scene".into() } else { format!("the facets show the pattern {name}") })
}
