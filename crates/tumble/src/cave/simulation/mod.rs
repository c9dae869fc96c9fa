//! The simulation of a cave: the world, its users, and the operator's requests. The server has one,
//! and with `--compute everywhere` every facet has one too. Everything that acts on it is an input,
//! so equal inputs give equal bits on every node, and a recording of inputs gives the run again.

mod saved;
mod user_colliders;
mod users;

use super::run_setup::RunSetup;
use crate::failure::Failure;
pub use users::{PACE_SOURCE, Users, key};

use tumble::dynamics::World;
use tumble::net::sync::transport::FacetNumber;
use tumble::net::sync::{FrameInputs, Input, Simulation, Viewer};

/// Source of the operator's requests, which travel as the buttons of an input; no facet and no other
/// device has the number.
pub const OPERATOR_SOURCE: FacetNumber = FacetNumber::MAX - 2;

/// A request of the operator, as a button.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// Simulated time stands; frames go on, so that users still look around.
    Pause = 1,
    /// Simulated time goes on.
    Resume = 2,
    /// The world is as before the first step; users stay where they are.
    Reset = 4,
}

impl Request {
    /// Returns the request as an input.
    pub fn input(self, sequence: u64) -> Input {
        let buttons = self as u32;
        Input { sequence, user: 0, head: None, wand: None, hands: [None; 2], buttons, keys: Vec::new() }
    }
}

/// A world with its users.
pub struct CaveSimulation {
    pub world: World,
    pub users: Users,
    /// The world before the first step.
    first: Vec<u8>,
    paused: bool,
    /// For tests: from this frame of the world on, one number of it is wrong, once.
    disturb_after: Option<u64>,
}

impl CaveSimulation {
    /// Takes the world of a run and adds the users.
    pub fn new(setup: &RunSetup, mut world: World, user_colliders: bool) -> Result<CaveSimulation, Failure> {
        let users = Users::new(setup.viewer()?, &setup.cave, &mut world, user_colliders)?;
        let first = world.save();
        Ok(CaveSimulation { world, users, first, paused: false, disturb_after: None })
    }

    /// Makes this simulation a wrong one, for tests of the comparison: after the given frame of the
    /// world the last bit of one number changes.
    #[must_use]
    pub fn disturbed(self, disturb_after: Option<u64>) -> CaveSimulation {
        CaveSimulation { disturb_after, ..self }
    }

    /// Returns the hash by which nodes find that their simulations begin alike: of the scene, of all
    /// constants and settings that change a result, and of the state.
    pub fn hash(&self, setup: &RunSetup) -> Result<[u8; 32], Failure> {
        let failed = |e: &dyn std::fmt::Display| Failure::run("--compute everywhere", e);
        let mut alike = self.world.fork();
        let settings = alike.settings().with_threads(1); // no number of threads changes a result
        alike.set_settings(settings).map_err(|e| failed(&e))?;
        let archive = alike.archive(alike.ids()).map_err(|e| failed(&e))?;
        let mut hasher = blake3::Hasher::new();
        // constants of behaviors are not in the archive
        hasher.update(&setup.join_hash).update(format!("{:?}", setup.scene.behaviors).as_bytes()).update(&archive);
        Ok(*hasher.finalize().as_bytes())
    }

    /// Returns whether simulated time stands.
    pub fn is_paused(&self) -> bool {
        self.paused
    }

    /// Takes an input, which acts from the next step on.
    pub fn take(&mut self, from: FacetNumber, input: Input) -> Result<(), Failure> {
        if from != OPERATOR_SOURCE {
            self.users.take(from, input, self.world.time());
            return Ok(());
        }
        let asks = |request: Request| input.buttons & request as u32 != 0;
        self.paused = (self.paused || asks(Request::Pause)) && !asks(Request::Resume);
        if asks(Request::Reset) {
            self.world.restore(&self.first).map_err(|e| Failure::run("reset", e))?;
            self.users.release();
        }
        Ok(())
    }

    /// Steps; while time stands, nothing moves. `after_step` looks at the world after each step.
    pub fn step(&mut self, steps: u32, mut after_step: impl FnMut(&World)) -> Result<(), Failure> {
        let dt = self.world.settings().dt;
        for _ in 0..if self.paused { 0 } else { steps } {
            self.users.act(&mut self.world, dt)?;
            self.world.step().map_err(|e| Failure::run("the simulation stopped", e))?;
            after_step(&self.world);
        }
        if self.disturb_after.take_if(|frame| self.world.frame() >= *frame).is_some() {
            self.disturb();
        }
        Ok(())
    }

    fn disturb(&mut self) {
        let moving = self.world.ids().iter().find(|&&id| self.world.status(id).is_some_and(|s| s.moves()));
        let Some((&id, x)) = moving.and_then(|id| Some((id, self.world.state_of(*id)?))) else { return };
        let mut x = x.to_vec();
        if let Some(first) = x.first_mut() {
            *first = f64::from_bits(first.to_bits() ^ 1);
        }
        let _ = self.world.write_state_of(id, &x); // a neighboring number is as good a state
    }
}

impl Simulation for CaveSimulation {
    fn world(&self) -> &World {
        &self.world
    }

    fn viewer(&self) -> &Viewer {
        &self.users.viewer
    }

    fn advance(&mut self, frame: &FrameInputs) -> Result<(), String> {
        for (from, input) in &frame.inputs {
            self.take(*from, input.clone()).map_err(|e| e.report().to_owned())?;
        }
        self.step(frame.steps, |_| {}).map_err(|e| e.report().to_owned())
    }

    fn save(&self) -> Vec<u8> {
        let mut out = vec![u8::from(self.paused)];
        self.users.write(&self.world, &mut out);
        out.extend(self.world.save());
        out
    }

    fn restore(&mut self, bytes: &[u8]) -> Result<(), String> {
        let (paused, rest) = bytes.split_first().ok_or("no bytes")?;
        let (users, world) = self.users.parse(&self.world, rest).ok_or("the users are damaged")?;
        self.world.restore(world).map_err(|e| e.to_string())?;
        self.users.set(users);
        self.paused = *paused != 0;
        Ok(())
    }
}

#[cfg(test)]
mod tests;
