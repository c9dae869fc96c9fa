//! Replay of recorded frames instead of a simulation, with a comparison of the pictures then and
//! now.

use crate::failure::Failure;
use std::collections::BTreeMap;
use std::path::Path;
use tumble::net::sync::transport::FacetNumber;
use tumble::net::sync::{FrameRecord, RecordedFrame, ServerEvent, SessionReader};

/// Maximum number of recorded pictures that wait for a comparison.
const MAX_REMEMBERED: usize = 1 << 16;

/// A recording that is being replayed.
pub struct Replay {
    reader: SessionReader,
    /// The first two frames, if not returned yet.
    ahead: std::collections::VecDeque<RecordedFrame>,
    frame_length: Option<f64>,
    /// Recorded pictures by frame and facet.
    images: BTreeMap<(u64, FacetNumber), [u8; 16]>,
    pub counts: Counts,
}

/// Result of the comparison of pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Counts {
    /// Number of identical pictures.
    pub same: u64,
    /// Number of different pictures.
    pub different: u64,
    /// Number of frames that were shown only now, or without a picture then or now.
    pub not_compared: u64,
}

impl Replay {
    /// Opens a recording of this scene.
    pub fn open(path: &Path, scene: [u8; 32]) -> Result<Replay, Failure> {
        let wrong = |e: &dyn std::fmt::Display| super::named(path, e);
        let mut reader = SessionReader::open(path).map_err(|e| wrong(&e))?;
        reader.check_scene(scene).map_err(|e| wrong(&e))?;
        let mut ahead = std::collections::VecDeque::new();
        for _ in 0..2 {
            ahead.extend(reader.next_frame().map_err(|e| wrong(&e))?);
        }
        let frame_length = ahead
            .get(1)
            .map(|second: &RecordedFrame| second.recorded.time_s - ahead[0].recorded.time_s)
            .filter(|s| *s > 0.0);
        Ok(Replay { reader, ahead, frame_length, images: BTreeMap::new(), counts: Counts::default() })
    }

    /// Returns the next frame as it was sent.
    pub fn next(&mut self) -> Result<Option<FrameRecord>, Failure> {
        let next = match self.ahead.pop_front() {
            Some(frame) => Some(frame),
            None => self.reader.next_frame().map_err(|e| Failure::run("the replay", e))?,
        };
        let Some(frame) = next else { return Ok(None) };
        self.images.extend(frame.presented.iter().map(|(facet, frame, done)| ((*frame, *facet), done.image)));
        while self.images.len() > MAX_REMEMBERED {
            self.images.pop_first();
        }
        Ok(Some(frame.recorded))
    }

    /// Returns the time from the first frame to the second, s.
    pub fn frame_length(&self) -> Option<f64> {
        self.frame_length
    }

    /// Compares the picture of a facet with the recorded one.
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
