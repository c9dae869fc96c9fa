//! The simulation behind the window, on a thread of its own: slow pictures do not hold it up, and slow steps do not hold up keys and mouse.
//!
//! Between two steps whoever looks may have the world ([`Clockwork::lock`]); a step is never interrupted, and what it does depends on no clock. Which steps are
//! taken does: [`Pace`] says. So the state after n steps is that of `tumble run`, whatever the pictures take.

use super::hand::Hand;
use super::pace::Pace;
use super::statistics::Meter;
use crate::failure::Failure;
use std::ops::{Deref, DerefMut};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tumble::core::World;

/// Steps that are due at once take at most this long, and then one more; what is still due is given up.
const MOST_STEPPING: Duration = Duration::from_millis(100);
/// Longest sleep between two looks at the clock.
const NAP: Duration = Duration::from_millis(50);
/// Longest wait for those who want the world.
const ASIDE: Duration = Duration::from_millis(1);

/// A world and what moves it.
pub struct Simulation {
    pub world: World,
    pub pace: Pace,
    /// What pulls a body.
    pub hand: Option<Hand>,
    /// What stopped it.
    pub trouble: Option<String>,
    /// How long steps took.
    pub steps: Meter,
    /// Counts whatever changes the world: steps, and going back.
    pub changes: u64,
    /// The world at time 0.
    start: Vec<u8>,
    /// No step after this one.
    last: Option<u64>,
    /// When the clock was looked at.
    turn: Instant,
    ending: bool,
}

impl Simulation {
    /// At time 0; ends after `last` steps.
    pub fn new(world: World, pace: Pace, last: Option<u64>) -> Simulation {
        let start = world.save();
        let steps = Meter::default();
        Simulation {
            world,
            pace,
            hand: None,
            trouble: None,
            steps,
            changes: 0,
            start,
            last,
            turn: Instant::now(),
            ending: false,
        }
    }

    /// Whether the last step is taken, or no further one can be.
    pub fn is_over(&self) -> bool {
        self.last.is_some_and(|last| self.world.frame() >= last || self.trouble.is_some())
    }

    /// Back to time 0.
    pub fn reset(&mut self) -> Result<(), Failure> {
        (self.hand, self.trouble) = (None, None);
        self.changes += 1;
        self.world.restore(&self.start).map_err(|e| Failure::run("going back to time 0", e))
    }

    /// Takes a step if one is due; whether it did.
    fn advance(&mut self) -> bool {
        if self.trouble.is_some() || self.is_over() || !self.pace.take(self.world.settings().dt) {
            return false;
        }
        // what is no longer there lets go
        self.hand = self.hand.take().filter(|hand| hand.pull(&mut self.world).is_ok());
        let clock = Instant::now();
        if let Err(error) = self.world.step() {
            self.pace.paused = true;
            self.trouble = Some(error.to_string());
        }
        self.steps.add(clock.elapsed());
        self.changes += 1;
        true
    }

    /// The clock went on since the last look.
    fn look_at_the_clock(&mut self) {
        let now = Instant::now();
        self.pace.pass((now - self.turn).as_secs_f64());
        self.turn = now;
    }

    /// How long nothing is due.
    fn pause(&self) -> Duration {
        let standing = self.trouble.is_some() || self.is_over();
        if standing { NAP } else { NAP.min(self.pace.until(self.world.settings().dt)) }
    }
}

/// The thread, and the way to what it works on.
pub struct Clockwork {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

struct Shared {
    simulation: Mutex<Simulation>,
    /// How many want it: the thread stands aside for them.
    wanted: AtomicUsize,
    /// Rung when somebody had it.
    bell: Condvar,
}

impl Clockwork {
    /// Stands until it is [started](Self::start).
    pub fn new(simulation: Simulation) -> Clockwork {
        let shared = Shared { simulation: Mutex::new(simulation), wanted: AtomicUsize::new(0), bell: Condvar::new() };
        Clockwork { shared: Arc::new(shared), thread: None }
    }

    /// From now on time goes by the clock.
    pub fn start(&mut self) -> Result<(), Failure> {
        self.lock().turn = Instant::now();
        let shared = self.shared.clone();
        let spawned = std::thread::Builder::new().name("simulation".into()).spawn(move || work(&shared));
        self.thread = Some(spawned.map_err(|e| Failure::run("the simulation", e))?);
        Ok(())
    }

    /// Whether it was started.
    pub fn runs(&self) -> bool {
        self.thread.is_some()
    }

    /// The simulation between two steps; waits for the step that is being taken.
    pub fn lock(&self) -> Held<'_> {
        self.shared.wanted.fetch_add(1, Ordering::Relaxed);
        let guard = whole(self.shared.simulation.lock());
        self.shared.wanted.fetch_sub(1, Ordering::Relaxed);
        Held { guard, bell: &self.shared.bell }
    }

    /// Whether the thread ended by itself, which only a fault in it can do.
    pub fn is_broken(&self) -> bool {
        self.thread.as_ref().is_some_and(JoinHandle::is_finished)
    }
}

impl Drop for Clockwork {
    fn drop(&mut self) {
        self.lock().ending = true;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join(); // one that panicked has said so
        }
    }
}

/// The simulation, held between two steps.
pub struct Held<'a> {
    guard: MutexGuard<'a, Simulation>,
    bell: &'a Condvar,
}

impl Deref for Held<'_> {
    type Target = Simulation;

    fn deref(&self) -> &Simulation {
        &self.guard
    }
}

impl DerefMut for Held<'_> {
    fn deref_mut(&mut self) -> &mut Simulation {
        &mut self.guard
    }
}

impl Drop for Held<'_> {
    fn drop(&mut self) {
        self.bell.notify_one();
    }
}

/// Takes steps as they come due, until the end.
fn work(shared: &Shared) {
    let mut simulation = whole(shared.simulation.lock());
    while !simulation.ending {
        simulation.look_at_the_clock();
        let begin = Instant::now();
        while !simulation.ending && simulation.advance() {
            if begin.elapsed() > MOST_STEPPING {
                simulation.pace.give_up();
                break;
            }
            if shared.wanted.load(Ordering::Relaxed) > 0 {
                simulation = whole(shared.bell.wait_timeout(simulation, ASIDE)).0;
            }
        }
        let pause = simulation.pause().max(Duration::from_micros(50));
        simulation = whole(shared.bell.wait_timeout(simulation, pause)).0;
    }
}

/// What a lock gives, also where another thread panicked with it: that is told apart by [`Clockwork::is_broken`].
fn whole<T>(result: Result<T, PoisonError<T>>) -> T {
    result.unwrap_or_else(PoisonError::into_inner)
}
