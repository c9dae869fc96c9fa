//! The draw list of a frame, which the first facet of a process makes for all of them.

use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};
use tumble::net::sync::Viewer;
use tumble::render::DrawList;

/// A frame to draw.
pub struct ListedFrame {
    pub frame: u64,
    pub viewer: Viewer,
    /// `None` if no browser was ready for it.
    pub list: Option<DrawList>,
}

/// The last frame of the first facet.
#[derive(Default)]
pub struct FrameList {
    last: Mutex<Option<Arc<ListedFrame>>>,
    changed: Condvar,
}

impl FrameList {
    /// The first facet's side: replaces the frame.
    pub fn put(&self, frame: ListedFrame) -> Arc<ListedFrame> {
        let frame = Arc::new(frame);
        *self.last.lock().unwrap_or_else(PoisonError::into_inner) = Some(frame.clone());
        self.changed.notify_all();
        frame
    }

    /// Waits for a frame, or a later one, until a time. Returns `None` if there is an earlier one then.
    pub fn wait(&self, wanted: u64, until: Instant) -> Option<Arc<ListedFrame>> {
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            let left = until.saturating_duration_since(Instant::now());
            if let Some(there) = last.as_ref().filter(|there| there.frame >= wanted) {
                return Some(there.clone());
            }
            if left == Duration::ZERO {
                return None;
            }
            last = self.changed.wait_timeout(last, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(frame: u64) -> ListedFrame {
        ListedFrame { frame, viewer: Viewer::default(), list: None }
    }

    #[test]
    fn the_wanted_frame_comes_or_a_later_one() {
        let lists = Arc::new(FrameList::default());
        let soon = || Instant::now() + Duration::from_millis(20);
        assert!(lists.wait(3, soon()).is_none());
        lists.put(frame(3));
        assert_eq!(lists.wait(3, soon()).unwrap().frame, 3);
        assert!(lists.wait(4, soon()).is_none());
        let theirs = lists.clone();
        let waiting = std::thread::spawn(move || theirs.wait(5, Instant::now() + Duration::from_secs(20)));
        lists.put(frame(4));
        lists.put(frame(5));
        assert_eq!(waiting.join().unwrap().unwrap().frame, 5);
        assert_eq!(lists.wait(4, soon()).unwrap().frame, 5, "the first facet has gone on");
    }
}
