//! Counts and timings of a run: status lines while it runs, a few lines at its end, and everything
//! as JSON.

use super::contact_sound;
use super::histogram::{Histogram, Quantiles};
use crate::cave::endpoints::ServerEndpoint;
use crate::cave::facet_report::BrowserReport;
use crate::cave::replay::frames::Counts;
use crate::cave::replay::replayed_input;
use crate::cave::tracker::osc;
use crate::failure::Failure;
use crate::player;
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::IsTerminal;
use std::time::{Duration, Instant};
use tumble::net::sync::transport::{FacetNumber, LinkCounters, Refused};
use tumble::net::sync::{FacetSlot, Membership, Server, ServerEvent, SlotCounts};

/// Interval of the status lines.
const EVERY: Duration = Duration::from_secs(5);

/// Timings of a run.
#[derive(Default)]
pub struct Metrics {
    /// Simulation of one frame.
    pub step: Histogram,
    /// From publishing a frame until all awaited facets have shown it.
    pub barrier: Histogram,
    /// From the start of one frame to the next.
    pub frame: Histogram,
    /// From the first to the last facet that shows a frame, by the server's clock.
    pub skew: Histogram,
    /// From an input to the last facet that shows it.
    pub input: Histogram,
    /// From taking the inputs for a frame to its presentation, halfway between the first and the last facet.
    pub picture: Histogram,
    /// Time by which heads are predicted.
    pub lead: Histogram,
    /// By slot: from the arrival of a frame at the facet to the end of drawing.
    draw: Vec<Histogram>,
    /// By slot: the last frame drawn or shown, and the time of drawing, ms.
    last: Vec<(u64, f64)>,
    /// By slot: the last frame shown, and the number of different ones. A facet that joins again
    /// shows the last frame again.
    shown: Vec<(Option<u64>, u64)>,
    /// By slot: the first frame in which a facet that steps by itself had another state.
    differences: Vec<Option<Difference>>,
    /// Names of the slots.
    names: Vec<String>,
}

/// The first difference between a facet that steps the world by itself and the server.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Difference {
    pub frame: u64,
    /// The first object whose state differs, in the order of the world.
    pub object: String,
}

/// Refused packets of a link, by reason.
pub type Refusals = BTreeMap<&'static str, u64>;

/// Returns the refused packets of a link.
pub fn refused(link: &LinkCounters) -> Refusals {
    Refused::ALL.iter().map(|&why| (why.name(), link.refused_for(why))).filter(|(_, n)| *n > 0).collect()
}

/// The whole summary. Names end with units.
#[derive(Serialize)]
pub struct Summary {
    pub scene: String,
    pub cave: String,
    pub transport: &'static str,
    pub mode: &'static str,
    pub frames: u64,
    pub simulated_s: f64,
    pub wall_s: f64,
    /// Dropped time, because frames took longer than their length.
    pub behind_s: f64,
    /// Simulation of one frame: all its steps.
    pub simulation: Quantiles,
    pub barrier: Quantiles,
    pub frame: Quantiles,
    /// From the first to the last facet that shows a frame, by the server's clock.
    pub skew: Option<Quantiles>,
    /// From an input to the last facet that shows it, if there was input.
    pub input_to_picture: Option<Quantiles>,
    /// From taking the inputs for a frame to its presentation, if live inputs were taken.
    pub frame_to_picture: Option<Quantiles>,
    /// Time by which heads were predicted, if they were.
    pub tracker_lead: Option<Quantiles>,
    /// Replay: pictures compared with the recording.
    pub replay: Option<Counts>,
    /// Replayed inputs: states compared with the recording.
    pub replay_input: Option<replayed_input::Counts>,
    /// Messages of a tracker.
    pub tracker: Option<osc::Counts>,
    /// Datagrams to a sound engine.
    pub sound: Option<contact_sound::Counts>,
    /// Frames for the outputs of the server's machine.
    pub played: Option<player::Counts>,
    /// Head poses not applied, because an eye would be behind a screen or in it.
    pub heads_rejected: u64,
    /// Refused packets that belong to no facet, by reason; zero counts are omitted.
    pub unknown_peers: Refusals,
    pub facets: Vec<FacetSummary>,
}

/// Counts of the server about one facet.
#[derive(Serialize)]
pub struct FacetSummary {
    pub name: String,
    #[serde(flatten)]
    pub counts: SlotCounts,
    /// Frames of the run that it did not show: absent, behind, or in `latest` superseded.
    pub not_shown: u64,
    /// Shown frames that are written: a line in `frames.jsonl`, and the picture with `--frames-dir`.
    /// `None` if the facet writes none, or was not started by this process.
    pub written: Option<u64>,
    /// Shown frames that are not written.
    pub not_written: Option<u64>,
    /// With `--compute everywhere`: the first frame in which its state was another one.
    pub first_difference: Option<Difference>,
    /// The web browsers that showed it, if it was served to browsers.
    pub browsers: Option<BrowserReport>,
    /// The graphics adapter that drew it; empty if it drew nothing, or was not started by this process.
    pub adapter: String,
    pub draw: Quantiles,
    pub bytes_out: u64,
    pub bytes_in: u64,
    pub repeated: u64,
    /// Refused packets of its link, by reason; zero counts are omitted.
    pub refused_packets: Refusals,
}

impl Metrics {
    /// Creates the timings for these slots.
    pub fn new(names: &[FacetSlot]) -> Metrics {
        let slots = names.len();
        Metrics {
            differences: vec![None; slots],
            names: names.iter().map(|slot| slot.name.clone()).collect(),
            draw: (0..slots).map(|_| Histogram::default()).collect(),
            last: vec![(0, 0.0); slots],
            shown: vec![(None, 0); slots],
            ..Metrics::default()
        }
    }

    /// Adds an event of the session.
    pub fn take(&mut self, event: &ServerEvent, time_s: f64) {
        if let ServerEvent::Shown(shown) = event {
            if shown.facets > 1 {
                self.skew.add(shown.skew.as_secs_f64(), shown.frame, time_s);
            }
            shown.input.iter().for_each(|input| self.input.add(input.as_secs_f64(), shown.frame, time_s));
        }
        if let ServerEvent::Differs(facet, frame, object) = event
            && let Some(difference) = self.differences.get_mut(*facet as usize)
        {
            difference.get_or_insert_with(|| Difference { frame: *frame, object: object.clone() });
        }
        let (ServerEvent::Ready(facet, frame, done, _) | ServerEvent::Presented(facet, frame, done, _)) = event else {
            return;
        };
        let k = *facet as usize;
        if let (ServerEvent::Ready(..), Some(draw)) = (event, self.draw.get_mut(k)) {
            draw.add(f64::from(done.took_us) * 1e-6, *frame, time_s);
            self.last[k].1 = f64::from(done.took_us) * 1e-3;
        }
        if let Some(last) = self.last.get_mut(k) {
            last.0 = *frame;
        }
        if let (ServerEvent::Presented(..), Some((last, different))) = (event, self.shown.get_mut(k)) {
            *different += u64::from(last.replace(*frame) != Some(*frame));
        }
    }

    /// Returns the last frame of a slot, and its time of drawing, ms.
    pub fn last(&self, slot: usize) -> (u64, f64) {
        self.last.get(slot).copied().unwrap_or_default()
    }

    /// Returns the first difference of a slot's states.
    pub fn difference(&self, slot: usize) -> Option<Difference> {
        self.differences.get(slot).cloned().flatten()
    }

    /// Checks that all facets that step the world by themselves had the server's states.
    pub fn check_states(&self) -> Result<(), Failure> {
        let first = |(name, difference): (&String, &Option<Difference>)| {
            let Difference { frame, object } = difference.as_ref()?;
            Some(format!("facet {name} computed another state: {object} differs first, in frame {frame}"))
        };
        let different: Vec<String> = self.names.iter().zip(&self.differences).filter_map(first).collect();
        if different.is_empty() { Ok(()) } else { Err(Failure::run("the run", different.join("; "))) }
    }

    /// Returns the summaries of all facets after this number of frames; `written` by slot.
    pub fn facets(
        &self,
        server: &Server<ServerEndpoint>,
        slots: &[FacetSlot],
        frames: u64,
        written: &[Option<u64>],
    ) -> Vec<FacetSummary> {
        let one = |(k, slot): (usize, &FacetSlot)| {
            let (counts, _, link) = server.counts(k as FacetNumber);
            let written = written.get(k).copied().flatten();
            FacetSummary {
                name: slot.name.clone(),
                not_shown: frames.saturating_sub(self.shown[k].1),
                written,
                not_written: written.map(|written| self.shown[k].1.saturating_sub(written)),
                counts,
                first_difference: self.differences[k].clone(),
                browsers: None,
                adapter: String::new(),
                draw: self.draw[k].quantiles(),
                bytes_out: link.bytes_out,
                bytes_in: link.bytes_in,
                repeated: link.repeated,
                refused_packets: refused(&link),
            }
        };
        slots.iter().enumerate().map(one).collect()
    }
}

impl Summary {
    /// Returns the lines for the terminal.
    pub fn lines(&self) -> String {
        let mut text = format!(
            "{} in {}: {:.3} s in {} frames, {} over {}; {:.3} s wall time, {:.3} s behind\n",
            self.scene, self.cave, self.simulated_s, self.frames, self.mode, self.transport, self.wall_s, self.behind_s
        );
        let quantiles = |what: &str, f: &Quantiles| {
            format!(
                "{what}: median {:.2} ms, 99 % within {:.2} ms, maximum {:.2} ms (frame {} at {:.3} s)\n",
                f.p50_ms, f.p99_ms, f.max_ms, f.max_at_frame, f.max_at_s
            )
        };
        text += &quantiles("simulation of a frame", &self.simulation);
        text += &quantiles("sent, drawn and shown", &self.barrier);
        text += &quantiles("frame to frame", &self.frame);
        if let Some(skew) = &self.skew {
            text += &quantiles("skew between facets", skew);
        }
        if let Some(input) = &self.input_to_picture {
            text += &quantiles("input to picture", input);
        }
        if let Some(lead) = &self.tracker_lead {
            let measured = self.frame_to_picture.iter().map(|taken| quantiles("taken by a frame and shown", taken));
            text += &measured.chain([quantiles("lead of the heads", lead)]).collect::<String>();
        }
        if let Some(Counts { same, different, not_compared }) = self.replay {
            text += &format!(
                "pictures: {same} identical to the recording, {different} different, {not_compared} not compared\n"
            );
        }
        if let Some(replayed_input) = &self.replay_input {
            text += &format!(
                "{} inputs replayed: {} states identical to the recording, {} different\n",
                replayed_input.inputs, replayed_input.same, replayed_input.different
            );
        }
        if let Some(tracker) = &self.tracker {
            text += &format!(
                "tracker: {} messages taken in {} datagrams{}\n",
                tracker.taken,
                tracker.datagrams,
                reasons(", dropped", &tracker.dropped)
            );
        }
        if self.heads_rejected > 0 {
            text += &format!("{} head poses rejected: an eye would be behind a screen\n", self.heads_rejected);
        }
        for facet in &self.facets {
            let FacetSummary { name, counts: c, not_shown, not_written, refused_packets, first_difference, .. } = facet;
            let browsers = facet.browsers.map_or(String::new(), |b| format!("; {b}"));
            let differs = first_difference
                .as_ref()
                .map_or(String::new(), |d| format!(", DIFFERS from frame {} in {}", d.frame, d.object));
            let lost = not_written.filter(|n| *n > 0).map_or(String::new(), |n| format!(", {n} NOT WRITTEN"));
            text += &format!(
                "facet {name}: {} shown, {not_shown} not shown{lost}{differs}, {} late, {} missing, {} duplicate, {} stale, {} torn, {} mismatched, dropped {} times{}{browsers}\n",
                c.presented,
                c.late,
                c.missing,
                c.duplicate,
                c.stale,
                c.torn,
                c.mismatched,
                c.dropped,
                reasons("; packets refused", refused_packets)
            );
        }
        if !self.unknown_peers.is_empty() {
            text += &unknown_peers_line(&self.unknown_peers);
        }
        text
    }
}

/// Returns a line about refused packets that belong to no facet; empty without any.
pub fn unknown_peers_line(refused: &Refusals) -> String {
    let key = if refused.contains_key(Refused::Forged.name()) {
        " (forged: a peer with another key file, or without one, looks like this)"
    } else {
        ""
    };
    if refused.is_empty() {
        String::new()
    } else {
        format!("from unknown peers{}{key}\n", reasons(": packets refused", refused))
    }
}

/// Returns `; packets refused: 3 forged, 1 replayed`, for instance; empty without any.
fn reasons(what: &str, counts: &Refusals) -> String {
    let each: Vec<String> = counts.iter().map(|(why, n)| format!("{n} {why}")).collect();
    if each.is_empty() { String::new() } else { format!("{what}: {}", each.join(", ")) }
}

/// Status lines while a run is in progress: in place on a terminal, every few seconds elsewhere.
pub struct Status {
    quiet: bool,
    terminal: bool,
    since: Instant,
    frame: u64,
    shown: Vec<u64>,
    lines: usize,
}

impl Status {
    /// Creates the status lines.
    pub fn new(quiet: bool) -> Status {
        Status {
            quiet,
            terminal: std::io::stderr().is_terminal(),
            since: Instant::now(),
            frame: 0,
            shown: Vec::new(),
            lines: 0,
        }
    }

    /// Keeps other output from being overwritten.
    pub fn interrupted(&mut self) {
        self.lines = 0;
    }

    /// Updates the status lines after a frame. `alarms` are those of input devices.
    pub fn at(
        &mut self,
        server: &Server<ServerEndpoint>,
        metrics: &Metrics,
        frame: u64,
        time_s: f64,
        browsers: impl Fn(FacetNumber) -> Option<BrowserReport>,
        alarms: &[String],
    ) {
        let passed = self.since.elapsed();
        let every = if self.terminal { EVERY / 5 } else { EVERY };
        if self.quiet || passed < every {
            return;
        }
        let per_s = |now: u64, before: u64| now.saturating_sub(before) as f64 / passed.as_secs_f64();
        let mut text = if self.terminal && self.lines > 0 { format!("\x1b[{}A", self.lines) } else { String::new() };
        let more = |what: &str, histogram: &Histogram| {
            histogram.non_empty().map_or(String::new(), |f| format!(", {what} {:.2} ms", f.p50_ms))
        };
        let (skew, input) = (more("skew", &metrics.skew), more("input to picture", &metrics.input));
        let lead = more("lead of the heads", &metrics.lead);
        text += &format!(
            "\x1b[Kframe {frame}, t = {time_s:.2} s, {:.1} frames/s, simulated in {:.2} ms{skew}{input}{lead}\n",
            per_s(frame, self.frame),
            1e3 * metrics.step.quantile(0.5)
        );
        self.shown.resize(metrics.names.len(), 0);
        for (k, name) in metrics.names.iter().enumerate() {
            let (counts, _, _) = server.counts(k as FacetNumber);
            let membership = match server.membership(k as FacetNumber) {
                Membership::Absent => "absent",
                Membership::Following => "behind",
                Membership::InStep => "in step",
            };
            let (last, took_ms) = metrics.last[k];
            let differs =
                metrics.differences[k].as_ref().map_or(String::new(), |d| format!(", DIFFERS from frame {}", d.frame));
            text += &format!(
                "\x1b[K  {:<12} {membership:<8} frame {last}, {:.1} frames/s, {} late, dropped {} times, drawn in {took_ms:.2} ms{differs}{}\n",
                name,
                per_s(counts.presented, self.shown[k]),
                counts.late + counts.missing,
                counts.dropped,
                browsers(k as FacetNumber).map_or(String::new(), |b| format!("; {b}"))
            );
            self.shown[k] = counts.presented;
        }
        alarms.iter().for_each(|alarm| text += &format!("\x1b[K  {alarm}\n"));
        eprint!("{}", if self.terminal { text } else { text.replace("\x1b[K", "") });
        (self.lines, self.since, self.frame) = (metrics.names.len() + 1 + alarms.len(), Instant::now(), frame);
    }
}
