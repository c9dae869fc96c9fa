//! Several facets of a cave in one process: one device, one world and one draw list for all.
//!
//! ```text
//! first facet (leader)    STATE ─► world ─► draw list ─► painter ─┬─► picture ─► READY, PRESENTED, file
//!                                   │ applied                     │
//! others (followers)      STATE ────┴─► follow ───────────────────┴─► picture ─► READY, PRESENTED, file
//! ```
//!
//! Each facet has a session and a thread of its own, so the server, its barrier, counts and files see no
//! difference to facets with a process each.

use crate::cave::endpoints::FacetEndpoint;
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Duration;
use tumble::net::sync::{AppliedFrame, Facet};

/// Longest wait of a follower for the leader between two looks at its own session.
const LEADER_WAIT: Duration = Duration::from_millis(5);

/// The part of a facet in its process.
#[derive(Clone, Default)]
pub enum Membership {
    /// The process has no other facet.
    #[default]
    Alone,
    /// It applies the states, for all.
    Leader(Arc<LeaderFrame>),
    /// It shows what the leader has applied.
    Follower(Arc<LeaderFrame>),
}

/// The last frame that the leader has applied.
#[derive(Default)]
pub struct LeaderFrame {
    frame: Mutex<Option<AppliedFrame>>,
    changed: Condvar,
}

impl Membership {
    /// Begins the frame that waits and returns its number. Returns `None` if it did not fit the scene, or if
    /// the leader has not applied it yet.
    pub fn begin(&self, facet: &mut Facet<FacetEndpoint>) -> Option<u64> {
        match self {
            Membership::Alone => facet.begin(),
            Membership::Leader(shared) => {
                let begun = facet.begin();
                *shared.frame.lock().unwrap_or_else(PoisonError::into_inner) = facet.applied();
                shared.changed.notify_all();
                begun
            }
            Membership::Follower(shared) => {
                let mut follow =
                    |frame: &Option<AppliedFrame>| frame.as_ref().filter(|f| facet.follow(f)).map(AppliedFrame::frame);
                let frame = shared.frame.lock().unwrap_or_else(PoisonError::into_inner);
                follow(&frame).or_else(|| {
                    let waited = shared.changed.wait_timeout(frame, LEADER_WAIT);
                    follow(&waited.unwrap_or_else(PoisonError::into_inner).0)
                })
            }
        }
    }
}
