//! Frames of facets that step the world by themselves: inputs, or the whole world for one that joins,
//! has missed a frame, or differs.

use super::super::compute::{MAX_FRAME_INPUTS, ObjectHashes, SavedWorld, Simulation, StateHashes, Step};
use super::super::messages::{Content, increment};
use super::super::publisher::PublishError;
use super::super::transport::{Delivery, FacetNumber, MAX_MESSAGE_BYTES};
use super::super::wire::{HEADER_BYTES, Hash, MessageKind, is_later, message};
use super::frame_times::note_request;
use super::{FacetState, ServerEvent, ServerSession};
use crate::sync::compute::FrameInputs;
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;
use tumble_core::ObjectId;

/// Messages and hashes of frames for facets that step by themselves.
#[derive(Default)]
pub(super) struct InputStream {
    /// The newest STEP message and its frame.
    step: Option<(u64, Arc<Vec<u8>>)>,
    /// The newest WORLD payload and its frame.
    world: Option<(u64, Arc<Vec<u8>>)>,
    hashes: VecDeque<StateHashes>,
    /// Objects and their names at the last frame.
    ids: Vec<ObjectId>,
    names: Vec<String>,
}

impl InputStream {
    fn hashes(&self, frame: u64) -> Option<&StateHashes> {
        self.hashes.iter().find(|hashes| hashes.frame == frame)
    }

    /// Returns the hash of a frame, if it is remembered.
    pub fn hash(&self, frame: u64) -> Option<&Hash> {
        self.hashes(frame).map(|hashes| &hashes.hash)
    }
}

impl FacetState {
    /// Notes that the facet has drawn or shown a frame: a world of that frame or an earlier one has
    /// arrived.
    pub(super) fn answer_world(&mut self, frame: u64) {
        self.world_under_way = self.world_under_way.filter(|world| is_later(*world, frame));
    }
}

impl ServerSession {
    fn computing(&self) -> impl Iterator<Item = (FacetNumber, &FacetState)> {
        self.joined().filter(|(_, p)| p.content == Content::Inputs)
    }

    /// Sends everything that acts on the world in the next frame, before the server steps: all nodes
    /// step at the same time. [`publish_simulation`](Self::publish_simulation) of that frame follows.
    pub fn send_inputs(&mut self, now: Duration, inputs: FrameInputs) {
        let to: Vec<FacetNumber> = self.computing().filter(|(_, p)| !p.needs_world).map(|(k, _)| k).collect();
        if inputs.inputs.len() > MAX_FRAME_INPUTS || to.is_empty() {
            return; // without a step of the frame, its world is sent
        }
        let frame = self.next;
        let step = Step { before: self.hash_before(frame), inputs };
        let bytes = Arc::new(message(&self.head(MessageKind::Step, 0, frame), |out| step.write(out)));
        self.inputs.step = Some((frame, bytes.clone()));
        for &k in &to {
            note_request(&mut self.facets[k as usize].state_requested, frame, now);
            self.facets[k as usize].sent = now;
        }
        self.send(to, Delivery::Reliable, bytes);
    }

    /// Publishes the world of a simulation as the next frame, like [`publish`](Self::publish). Facets
    /// that step by themselves got the inputs before, or get the world.
    ///
    /// # Errors
    /// [`PublishError`]; no state was sent.
    pub fn publish_simulation(&mut self, now: Duration, simulation: &dyn Simulation) -> Result<u64, PublishError> {
        let frame = self.next;
        let (world, viewer) = (simulation.world(), simulation.viewer());
        if self.computing().next().is_some() {
            let before = self.hash_before(frame);
            if self.inputs.ids != world.ids() {
                self.inputs.ids = world.ids().to_vec();
                self.inputs.names =
                    world.ids().iter().map(|&id| world.name(id).unwrap_or_default().to_string()).collect();
            }
            let hashes = StateHashes::of(frame, world, viewer);
            let hash = hashes.hash;
            self.inputs.hashes.push_back(hashes);
            while self.inputs.hashes.len() > self.options.history {
                self.inputs.hashes.pop_front();
            }
            let stepped = self.inputs.step.as_ref().is_some_and(|(of, _)| *of == frame);
            for facet_state in self.facets.iter_mut().filter(|p| p.content == Content::Inputs) {
                facet_state.needs_world |= !stepped;
            }
            if self.computing().any(|(_, p)| p.needs_world) {
                let mut payload = Vec::new();
                SavedWorld { before, hash, bytes: &simulation.save() }.write(&mut payload);
                match payload.len() + HEADER_BYTES {
                    count if count > MAX_MESSAGE_BYTES => self.refuse_worlds(count),
                    _ => self.inputs.world = Some((frame, Arc::new(payload))),
                }
            }
        }
        self.publish(now, world, viewer)
    }

    /// Refuses the facets that need a world of too many bytes; the others go on.
    fn refuse_worlds(&mut self, count: usize) {
        let needing: Vec<(FacetNumber, u64)> =
            self.computing().filter(|(_, p)| p.needs_world).map(|(k, p)| (k, p.join)).collect();
        for (facet, join) in needing {
            let why = format!(
                "the world has {count} bytes, at most {MAX_MESSAGE_BYTES} can be sent: start the facet with --compute server"
            );
            self.reject_join(facet, join, why);
            self.mark_absent(facet, false);
        }
    }

    /// Sends the world of the frame to the facets that need it.
    pub(super) fn send_worlds(&mut self, now: Duration) {
        let to: Vec<FacetNumber> = self.computing().filter(|(_, p)| p.needs_world).map(|(k, _)| k).collect();
        to.into_iter().for_each(|facet| self.send_world(now, facet));
    }

    /// Sends the world of the present frame if it is there; else the facet gets that of the next one.
    /// Over a reliable link one world at a time is under way.
    pub(super) fn send_world(&mut self, now: Duration, facet: FacetNumber) {
        let world = self.inputs.world.as_ref().filter(|(of, _)| Some(*of) == self.frame).cloned();
        let facet_state = &mut self.facets[facet as usize];
        if self.options.resend_interval.is_none() && facet_state.world_under_way.is_some() {
            facet_state.needs_world = false;
            return;
        }
        facet_state.needs_world = world.is_none();
        let Some((frame, payload)) = world else { return };
        note_request(&mut facet_state.state_requested, frame, now);
        (facet_state.sent, facet_state.world_under_way) = (now, Some(frame));
        let join = facet_state.join;
        self.send_to(facet, MessageKind::World, join, frame, |out| out.extend(payload.iter()));
    }

    /// Sends the present frame again: the world if there is one of it, else the inputs.
    pub(super) fn repeat_inputs(&mut self, now: Duration, facet: FacetNumber) {
        let step = self.inputs.step.as_ref().filter(|(of, _)| Some(*of) == self.frame).map(|(_, step)| step.clone());
        let has_world = self.inputs.world.as_ref().is_some_and(|(of, _)| Some(*of) == self.frame);
        if has_world {
            return self.send_world(now, facet);
        }
        if let Some(step) = step {
            self.send(vec![facet], Delivery::Reliable, step);
        }
    }

    /// Reports the first object that differs. The facet gets the world with the next frame.
    pub(super) fn on_differs(&mut self, facet: FacetNumber, frame: u64, theirs: &ObjectHashes) {
        let what = match self.inputs.hashes(frame) {
            None => "an object of a frame that is no longer kept".to_owned(),
            Some(ours) => match ours.first_difference(theirs) {
                Some(index) => {
                    self.inputs.names.get(index).map_or("the number of objects".into(), |name| format!("'{name}'"))
                }
                None if ours.objects == *theirs => "the time or the users".to_owned(),
                None => "the number of objects".to_owned(),
            },
        };
        self.require_world(facet);
        self.report(ServerEvent::Differs(facet, frame, what));
    }

    /// Marks a facet whose hash of a frame is wrong.
    pub(super) fn replace_wrong_world(&mut self, facet: FacetNumber) {
        increment(&mut self.facets[facet as usize].counts.mismatched);
        self.require_world(facet);
    }

    /// Lets a facet that steps by itself get the world with the next frame, unless one is on its way.
    fn require_world(&mut self, facet: FacetNumber) {
        let lossy = self.options.resend_interval.is_some();
        let facet_state = &mut self.facets[facet as usize];
        let open = lossy || facet_state.world_under_way.is_none();
        facet_state.needs_world |= open && facet_state.content == Content::Inputs;
    }

    fn hash_before(&self, frame: u64) -> Hash {
        self.inputs.hash(frame.wrapping_sub(1)).copied().unwrap_or_default()
    }
}
