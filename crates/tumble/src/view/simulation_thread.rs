//! The simulation behind the window, on a thread of its own: slow pictures do not hold it up, and slow steps do not hold up keys and mouse.
//!
//! Between two steps whoever looks may have the world ([`SimulationThread::lock`]); a step is never interrupted, and what it does depends on no clock. Which steps are
//! taken does: [`RealTime`] says. So the state after n steps is that of `tumble run`, whatever the pictures take.

use super::picker::Picker;
use super::real_time::RealTime;
use super::statistics::Meter;
use crate::failure::Failure;
use std::ops::{Deref, DerefMut};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tumble::dynamics::World;

/// Steps that are due at once take at most this long, and then one more; what is still due is given up.
const MAX_STEPPING: Duration = Duration::from_millis(100);
/// Longest sleep between two looks at the clock.
const MAX_SLEEP: Duration = Duration::from_millis(50);
/// Longest wait for those who want the world.
const MAX_YIELD: Duration = Duration::from_millis(1);

/// A world and what moves it.
pub struct Simulation {
    pub world: World,
    pub real_time: RealTime,
    /// What pulls a body.
    pub picker: Option<Picker>,
    /// What stopped it.
    pub error: Option<String>,
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
    pub fn new(world: World, real_time: RealTime, last: Option<u64>) -> Simulation {
        let start = world.save();
        let steps = Meter::default();
        Simulation {
            world,
            real_time,
            picker: None,
            error: None,
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
        self.last.is_some_and(|last| self.world.frame() >= last || self.error.is_some())
    }

    /// Back to time 0.
    pub fn reset(&mut self) -> Result<(), Failure> {
        (self.picker, self.error) = (None, None);
        self.changes += 1;
        self.world.restore(&self.start).map_err(|e| Failure::run("going back to time 0", e))
    }

    /// Takes a step if one is due; whether it did.
    fn advance(&mut self) -> bool {
        if self.error.is_some() || self.is_over() || !self.real_time.take(self.world.settings().dt) {
            return false;
        }
        // what is no longer there lets go
        self.picker = self.picker.take().filter(|picker| picker.pull(&mut self.world).is_ok());
        let clock = Instant::now();
        if let Err(error) = self.world.step() {
            self.real_time.paused = true;
            self.error = Some(error.to_string());
        }
        self.steps.add(clock.elapsed());
        self.changes += 1;
        true
    }

    /// The clock went on since the last look.
    fn advance_clock(&mut self) {
        let now = Instant::now();
        self.real_time.pass((now - self.turn).as_secs_f64());
        self.turn = now;
    }

    /// How long nothing is due.
    fn pause(&self) -> Duration {
        let standing = self.error.is_some() || self.is_over();
        if standing { MAX_SLEEP } else { MAX_SLEEP.min(self.real_time.until(self.world.settings().dt)) }
    }
}

/// The thread, and the way to what it works on.
pub struct SimulationThread {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

struct Shared {
    simulation: Mutex<Simulation>,
    /// How many want it: the thread stands aside for them.
    wanted: AtomicUsize,
    /// Rung when somebody had it.
    released: Condvar,
}

impl SimulationThread {
    /// Stands until it is [started](Self::start).
    pub fn new(simulation: Simulation) -> SimulationThread {
        let shared =
            Shared { simulation: Mutex::new(simulation), wanted: AtomicUsize::new(0), released: Condvar::new() };
        SimulationThread { shared: Arc::new(shared), thread: None }
    }

    /// From now on time goes by the clock.
    pub fn start(&mut self) -> Result<(), Failure> {
        self.lock().turn = Instant::now();
        let shared = self.shared.clone();
        let spawned = std::thread::Builder::new().name("simulation".into()).spawn(move || run_thread(&shared));
        self.thread = Some(spawned.map_err(|e| Failure::run("the simulation", e))?);
        Ok(())
    }

    /// Whether it was started.
    pub fn runs(&self) -> bool {
        self.thread.is_some()
    }

    /// The simulation between two steps; waits for the step that is being taken.
    pub fn lock(&self) -> SimulationGuard<'_> {
        self.shared.wanted.fetch_add(1, Ordering::Relaxed);
        let guard = ignore_poison(self.shared.simulation.lock());
        self.shared.wanted.fetch_sub(1, Ordering::Relaxed);
        SimulationGuard { guard, released: &self.shared.released }
    }

    /// Whether the thread ended by itself, which only a fault in it can do.
    pub fn is_broken(&self) -> bool {
        self.thread.as_ref().is_some_and(JoinHandle::is_finished)
    }
}

impl Drop for SimulationThread {
    fn drop(&mut self) {
        self.lock().ending = true;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join(); // one that panicked has said so
        }
    }
}

/// The simulation, held between two steps.
pub struct SimulationGuard<'a> {
    guard: MutexGuard<'a, Simulation>,
    released: &'a Condvar,
}

impl Deref for SimulationGuard<'_> {
    type Target = Simulation;

    fn deref(&self) -> &Simulation {
        &self.guard
    }
}

impl DerefMut for SimulationGuard<'_> {
    fn deref_mut(&mut self) -> &mut Simulation {
        &mut self.guard
    }
}

impl Drop for SimulationGuard<'_> {
    fn drop(&mut self) {
        self.released.notify_one();
    }
}

/// Takes steps as they come due, until the end.
fn run_thread(shared: &Shared) {
    let mut simulation = ignore_poison(shared.simulation.lock());
    while !simulation.ending {
        simulation.advance_clock();
        let begin = Instant::now();
        while !simulation.ending && simulation.advance() {
            if begin.elapsed() > MAX_STEPPING {
                simulation.real_time.give_up();
                break;
            }
            if shared.wanted.load(Ordering::Relaxed) > 0 {
                simulation = ignore_poison(shared.released.wait_timeout(simulation, MAX_YIELD)).0;
            }
        }
        let pause = simulation.pause().max(Duration::from_micros(50));
        simulation = ignore_poison(shared.released.wait_timeout(simulation, pause)).0;
    }
}

/// What a lock gives, also where another thread panicked with it: that is told apart by [`SimulationThread::is_broken`].
fn ignore_poison<T>(result: Result<T, PoisonError<T>>) -> T {
    result.unwrap_or_else(PoisonError::into_inner)
}
