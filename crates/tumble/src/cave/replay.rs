//! A recording in place of the simulation, and what facets answer beside what they answered then.

use crate::failure::Failure;
use std::collections::BTreeMap;
use std::path::Path;
use tumble::net::sync::transport::FacetNumber;
use tumble::net::sync::{Recorded, Replay, ServerEvent};

/// Answers that are remembered for who is slow.
const MOST: usize = 1 << 16;

/// A recording that is shown again.
pub struct Tape {
    replay: Replay,
    /// What facets showed of a frame then, by frame and facet.
    images: BTreeMap<(u64, FacetNumber), [u8; 16]>,
    pub counts: Counts,
}

/// Pictures, compared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Counts {
    /// Pictures that are the same bit by bit.
    pub same: u64,
    /// Pictures that are not.
    pub different: u64,
    /// Frames that were shown now and not then, or without a picture then or now.
    pub not_compared: u64,
}

impl Tape {
    /// Opens it, if it is of this scene.
    pub fn open(path: &Path, scene: [u8; 32]) -> Result<Tape, Failure> {
        let wrong = |e: &dyn std::fmt::Display| Failure::input(format!("{}: {e}", path.display()));
        let replay = Replay::open(path).map_err(|e| wrong(&e))?;
        replay.check_scene(scene).map_err(|e| wrong(&e))?;
        Ok(Tape { replay, images: BTreeMap::new(), counts: Counts::default() })
    }

    /// The next frame, as it was sent.
    pub fn next(&mut self) -> Result<Option<Recorded>, Failure> {
        let Some(frame) = self.replay.next_frame().map_err(|e| Failure::run("the replay", e))? else { return Ok(None) };
        self.images.extend(frame.presented.iter().map(|(facet, frame, done)| ((*frame, *facet), done.image)));
        while self.images.len() > MOST {
            self.images.pop_first();
        }
        Ok(Some(frame.recorded))
    }

    /// What a facet answers now.
    pub fn take(&mut self, event: &ServerEvent) {
        let ServerEvent::Presented(facet, frame, done, _) = event else { return };
        match self.images.remove(&(*frame, *facet)) {
            Some(image) if image == [0; 16] || done.image == [0; 16] => self.counts.not_compared += 1,
            Some(image) if image == done.image => self.counts.same += 1,
            Some(_) => self.counts.different += 1,
            None => self.counts.not_compared += 1,
        }
    }
}
