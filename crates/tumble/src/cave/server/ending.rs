//! The end of a run: recording, summary, facets.

use super::facet_commands::transport_kind;
use super::facet_processes::FacetProcesses;
use super::outputs;
use super::serve::{RunLoop, failed};
use super::summary::{Summary, refused, unknown_peers_line};
use crate::atomic_file::write_file;
use crate::cave::args::TransportKind;
use crate::failure::Failure;
use crate::player::Player;
use tumble::scene::cave::Mode;

impl RunLoop<'_> {
    /// Ends the run: recording, summary, facets. Every part is done even if another fails, and
    /// files come first because facets may not answer. The summary is written again after facets
    /// that write frames have ended. It goes to stderr if its file cannot be written.
    pub fn end(&mut self, processes: &mut FacetProcesses) -> Result<(), Failure> {
        let wall_s = self.began.elapsed().as_secs_f64();
        let session = self.server.end().map_err(failed);
        let recorded = self.recorder.finish(self.options.quiet);
        let heard = self.write_audio();
        let first = self.summary(wall_s, processes);
        let mut summed = first.as_ref().map_or(Ok(()), |summary| self.write_summary(summary));
        let ended = processes.end(self.frames > 0);
        match self.summary(wall_s, processes) {
            Some(last) => {
                if (self.writes_frames() || self.serves_browsers()) && summed.is_ok() {
                    summed = self.write_summary(&last);
                }
                if summed.is_err() {
                    eprintln!("{}", to_json(&last)?);
                }
                if !self.options.quiet {
                    outputs::say(&last.lines())?;
                }
            }
            // explains why no facet joined
            None => eprint!("{}", unknown_peers_line(&refused(&self.server.unknown_peers()))),
        }
        session
            .and(recorded)
            .and(heard)
            .and(summed)
            .and(ended)
            .and(self.input_devices.check())
            .and(self.metrics.check_states())
    }

    /// Writes what the users heard, if that was asked for and there was a frame.
    fn write_audio(&self) -> Result<(), Failure> {
        let Some(audio) = self.sounds.files.as_ref().filter(|_| self.frames > 0) else { return Ok(()) };
        let said = audio.write()?;
        if self.options.quiet { Ok(()) } else { outputs::say(&(said + "\n")) }
    }

    /// Returns whether the facets of this launcher write frames.
    fn writes_frames(&self) -> bool {
        self.launcher.is_some_and(|launcher| launcher.draw.frames_dir.is_some() || launcher.draw.log_dir.is_some())
    }

    /// Returns whether facets of this launcher are served to browsers.
    fn serves_browsers(&self) -> bool {
        self.launcher.is_some_and(|launcher| launcher.web.web.is_some())
    }

    /// Returns by slot how many frames have been written; `None` where that is unknown.
    fn written(&self, processes: &FacetProcesses) -> Vec<Option<u64>> {
        match self.writes_frames() {
            true => processes.written(self.slots.len()),
            false => vec![None; self.slots.len()],
        }
    }

    /// Returns the summary, if there was a frame.
    fn summary(&self, wall_s: f64, processes: &FacetProcesses) -> Option<Summary> {
        let mut facets = self.metrics.facets(&self.server, &self.slots, self.frames, &self.written(processes));
        for (k, facet) in (0..).zip(&mut facets) {
            let report = processes.report_of(k);
            (facet.browsers, facet.adapter) = (report.browsers, report.adapter);
        }
        (self.frames > 0).then(|| Summary {
            scene: self.scene.clone(),
            cave: self.cave.file.clone(),
            transport: if transport_kind(self.options, &self.cave) == TransportKind::Udp {
                "udp"
            } else {
                "shared memory"
            },
            mode: if self.cave.sync.mode == Mode::Lockstep { "lockstep" } else { "latest" },
            frames: self.frames,
            simulated_s: self.time_s,
            wall_s,
            behind_s: self.behind_s,
            simulation: self.metrics.step.quantiles(),
            barrier: self.metrics.barrier.quantiles(),
            frame: self.metrics.frame.quantiles(),
            skew: self.metrics.skew.non_empty(),
            input_to_picture: self.metrics.input.non_empty(),
            frame_to_picture: self.metrics.picture.non_empty(),
            tracker_lead: self.metrics.lead.non_empty(),
            replay: self.replay.as_ref().map(|replay| replay.counts),
            replay_input: self.input_devices.replayed_counts(),
            tracker: self.input_devices.tracker_counts(),
            sound: self.sounds.engine.as_ref().map(|engine| engine.counts),
            played: self.sounds.player.as_ref().map(Player::counts),
            heads_rejected: self.simulation.users.heads_rejected,
            unknown_peers: refused(&self.server.unknown_peers()),
            facets,
        })
    }

    /// Writes the summary's file, if there is one.
    fn write_summary(&self, summary: &Summary) -> Result<(), Failure> {
        let Some(path) = &self.options.summary else { return Ok(()) };
        write_file(path, (to_json(summary)? + "\n").as_bytes())
    }
}

fn to_json(summary: &Summary) -> Result<String, Failure> {
    serde_json::to_string_pretty(summary).map_err(|e| Failure::run("the summary", e))
}
