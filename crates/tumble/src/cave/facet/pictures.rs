//! Finished pictures on their way from the painter to the session of their facet.

use super::burn_in::burn_in;
use crate::failure::Failure;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tumble::render::{Image, Reading, RenderError};

/// Longest time for a session to take a picture that it has asked for.
const TAKE_TIMEOUT: Duration = Duration::from_secs(5);

/// A picture that is drawn.
pub enum Picture {
    /// Already in memory.
    Image(Image),
    /// Still to be copied from the device's memory.
    Reading(Reading),
    /// Kept for a window, and in no other place.
    OnDevice,
}

impl Picture {
    /// Waits until the device has drawn it.
    ///
    /// # Errors
    /// As [`Reading::wait`].
    pub fn wait(self) -> Result<Picture, RenderError> {
        if let Picture::Reading(reading) = &self {
            reading.wait()?;
        }
        Ok(self)
    }
}

/// A picture of a frame, or why there is none.
struct Delivered {
    frame: u64,
    burn_in: bool,
    picture: Result<Picture, String>,
}

#[derive(Default)]
struct Slot {
    delivered: Option<Delivered>,
    /// The frame that the session waits for.
    wanted: Option<u64>,
    ended: bool,
}

/// The place of one picture, between the painter and a session. A later picture replaces one that was not
/// asked for.
#[derive(Clone, Default)]
pub struct Pictures(Arc<(Mutex<Slot>, Condvar)>);

impl Pictures {
    fn slot(&self) -> MutexGuard<'_, Slot> {
        self.0.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    #[cfg(test)]
    pub fn holders(&self) -> usize {
        Arc::strong_count(&self.0)
    }

    /// The painter's side: delivers a picture. First waits until the session has taken the last one, if it
    /// has asked for it.
    pub fn put(&self, frame: u64, burn_in: bool, picture: Result<Picture, String>) {
        let asked = |slot: &mut Slot| slot.delivered.as_ref().is_some_and(|d| slot.wanted == Some(d.frame));
        let (mut slot, _) =
            self.0.1.wait_timeout_while(self.slot(), TAKE_TIMEOUT, asked).unwrap_or_else(PoisonError::into_inner);
        slot.delivered = Some(Delivered { frame, burn_in, picture });
        self.0.1.notify_all();
    }

    /// The painter's side: there will be no further picture.
    pub fn end(&self) {
        self.slot().ended = true;
        self.0.1.notify_all();
    }

    /// Asks for the picture of a frame.
    pub fn want(&self, frame: u64) {
        self.slot().wanted = Some(frame);
    }

    /// The session's side: takes no further picture, so the painter waits for none to be taken.
    pub fn abandon(&self) {
        self.slot().wanted = None;
        self.0.1.notify_all();
    }

    /// Returns whether the wanted picture is there within `timeout`, and the picture if it is in memory.
    pub fn take(&self, timeout: Duration) -> Result<Option<Option<Image>>, Failure> {
        let failed = |why: &dyn std::fmt::Display| Failure::run("drawing", why);
        let until = Instant::now() + timeout;
        let mut slot = self.slot();
        loop {
            let Some(wanted) = slot.wanted else { return Ok(None) };
            match slot.delivered.take() {
                Some(Delivered { frame, burn_in: digits, picture }) if frame == wanted => {
                    slot.wanted = None;
                    drop(slot);
                    self.0.1.notify_all();
                    let mut image = match picture.map_err(|e| failed(&e))? {
                        Picture::Image(image) => image,
                        Picture::Reading(reading) => reading.finish().map_err(|e| failed(&e))?,
                        Picture::OnDevice => return Ok(Some(None)),
                    };
                    if digits {
                        burn_in(&mut image, frame);
                    }
                    return Ok(Some(Some(image)));
                }
                Some(Delivered { frame, .. }) if frame > wanted => {
                    return Err(failed(&format!(
                        "the picture of frame {wanted} was replaced by that of frame {frame}"
                    )));
                }
                _ if slot.ended => return Err(failed(&"the render thread has ended")),
                _ => {}
            }
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(None);
            }
            slot = self.0.1.wait_timeout(slot, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHORT: Duration = Duration::from_millis(1);

    fn picture(level: u8) -> Result<Picture, String> {
        Ok(Picture::Image(Image { width: 1, height: 1, rgba: vec![level; 4] }))
    }

    fn taken(pictures: &Pictures) -> Result<Option<Vec<u8>>, String> {
        let taken = pictures.take(SHORT).map_err(|failure| failure.report().to_owned())?;
        Ok(taken.map(|image| image.unwrap().rgba))
    }

    #[test]
    fn a_session_gets_the_frame_that_it_wants_and_no_other() {
        let pictures = Pictures::default();
        pictures.put(6, false, picture(6));
        pictures.put(7, false, picture(7)); // nobody wanted 6
        assert!(taken(&pictures).unwrap().is_none(), "nothing is wanted");
        pictures.want(7);
        assert_eq!(taken(&pictures).unwrap().unwrap(), [7; 4]);
        pictures.want(8);
        assert!(taken(&pictures).unwrap().is_none());
        // the painter waits until a wanted picture is taken
        pictures.put(8, false, picture(8));
        let theirs = pictures.clone();
        let painter = std::thread::spawn(move || theirs.put(9, false, picture(9)));
        std::thread::sleep(20 * SHORT);
        assert!(!painter.is_finished());
        assert_eq!(taken(&pictures).unwrap().unwrap(), [8; 4]);
        painter.join().unwrap();
        pictures.want(8);
        assert!(taken(&pictures).unwrap_err().contains("frame 8 was replaced by that of frame 9"));
        pictures.want(10);
        pictures.end();
        assert!(taken(&pictures).unwrap_err().contains("has ended"));
    }
}
