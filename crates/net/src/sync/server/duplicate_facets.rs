//! Detection of two processes that claim the same facet. The first one keeps the slot while it
//! answers, and the second one is refused for good.
//!
//! A link gives a facet's connection to the newest process, so that a facet that was killed and
//! restarted is back at once. If the replaced process returns within the grace period, it is alive,
//! and the process that replaced it is the second. If it returns later (it was stopped, for
//! instance), its slot is taken and it is refused itself.

use super::super::transport::{Closed, LinkEvent};
use std::collections::VecDeque;
use std::time::Duration;

/// Maximum number of processes remembered per facet.
const MAX_REMEMBERED: usize = 8;

/// Returns the process of a join: the upper half of its number.
pub(crate) fn process_of(join: u64) -> u32 {
    (join >> 32) as u32
}

/// Processes that claimed one slot.
#[derive(Default)]
pub(super) struct DuplicateFacets {
    /// The process that has the slot, or had it last.
    holder: Option<u32>,
    /// Another process took over the connection, and its join is not known yet.
    replaced: bool,
    /// Replaced processes with the time of replacement, the earliest first.
    replaced_processes: VecDeque<(u32, Duration)>,
    refused: VecDeque<u32>,
}

impl DuplicateFacets {
    /// Notes an event of the slot's link.
    pub(super) fn link(&mut self, event: LinkEvent) {
        match event {
            LinkEvent::Closed(why) => self.replaced = why == Closed::Replaced,
            LinkEvent::Opened | LinkEvent::Message => {}
        }
    }

    /// Returns whether a process may have the slot. `grace` is the time after its replacement
    /// within which a process may reclaim it.
    pub(super) fn admit(&mut self, now: Duration, process: u32, grace: Duration) -> bool {
        if self.refused.contains(&process) {
            return false;
        }
        let replaced = std::mem::take(&mut self.replaced);
        let Some(holder) = self.holder.filter(|holder| *holder != process) else {
            self.holder = Some(process);
            return true;
        };
        match self.replaced_processes.iter().position(|(other, _)| *other == process) {
            Some(k) if !replaced => _ = self.replaced_processes.remove(k),
            Some(k) if now < self.replaced_processes[k].1.saturating_add(grace) => {
                let second: Vec<u32> =
                    self.replaced_processes.drain(k..).skip(1).map(|(other, _)| other).chain([holder]).collect();
                second.into_iter().for_each(|other| remember(&mut self.refused, other));
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
