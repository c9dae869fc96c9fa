//! Two processes that say to be the same facet: the first keeps its place while it answers, the second is refused for good.
//!
//! A link gives a facet's connection to who came last, so that a facet that was killed and started again is back at once. If the one that was pushed out
//! comes back soon it lives, and the one that pushed it out is the second. If it comes back late (it was stopped, say), its place is taken and it is
//! refused itself.

use super::super::transport::{Closed, LinkEvent};
use std::collections::VecDeque;
use std::time::Duration;

/// Processes of one facet that are remembered.
const MAX_REMEMBERED: usize = 8;

/// Which process a joining is of: the upper half of its number.
pub(crate) fn process_of(join: u64) -> u32 {
    (join >> 32) as u32
}

/// The processes that wanted one place.
#[derive(Default)]
pub(super) struct DuplicateFacets {
    /// Who has the place, or had it last.
    holder: Option<u32>,
    /// Its connection was taken by another one, of which nobody knows yet whose it is.
    replaced: bool,
    /// Who was pushed out, and when: the first of them first.
    replaced_processes: VecDeque<(u32, Duration)>,
    refused: VecDeque<u32>,
}

impl DuplicateFacets {
    /// What the link says of the place.
    pub(super) fn link(&mut self, event: LinkEvent) {
        match event {
            LinkEvent::Closed(why) => self.replaced = why == Closed::Replaced,
            LinkEvent::Opened | LinkEvent::Message => {}
        }
    }

    /// Whether a process may have the place. It is soon up to `grace` after it was pushed out.
    pub(super) fn admit(&mut self, now: Duration, process: u32, grace: Duration) -> bool {
        if self.refused.contains(&process) {
            return false;
        }
        let replaced = std::mem::take(&mut self.replaced);
        let Some(holder) = self.holder.filter(|holder| *holder != process) else {
            self.holder = Some(process);
            return true;
        };
        match self.replaced_processes.iter().position(|(who, _)| *who == process) {
            Some(k) if !replaced => _ = self.replaced_processes.remove(k),
            Some(k) if now < self.replaced_processes[k].1.saturating_add(grace) => {
                let second: Vec<u32> =
                    self.replaced_processes.drain(k..).skip(1).map(|(who, _)| who).chain([holder]).collect();
                second.into_iter().for_each(|who| remember(&mut self.refused, who));
            }
            Some(k) => {
                self.replaced_processes.remove(k);
                remember(&mut self.refused, process);
                return false;
            }
            None if replaced => remember(&mut self.replaced_processes, (holder, now)),
            None => {}
        }
        self.holder = Some(process);
        true
    }
}

fn remember<T>(list: &mut VecDeque<T>, one: T) {
    if list.len() == MAX_REMEMBERED {
        list.pop_front();
    }
    list.push_back(one);
}
