//! The simulation behind the window, on its own thread: slow pictures do not delay it, and slow
//! steps do not delay keys and mouse.
//!
//! Between two steps other threads may lock the world ([`SimulationThread::lock`]). A step is never
//! interrupted, and its result depends on no clock; [`RealTime`] only decides when steps are taken.
//! The state after n steps is therefore that of `tumble run`, however long pictures take.

use super::picker::Picker;
use super::real_time::RealTime;
use super::statistics::Meter;
use crate::failure::Failure;
use crate::player::Player;
use std::ops::{Deref, DerefMut};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tumble::dynamics::World;
use tumble::sound::Listener;

/// Longest time for steps that are due at once, exceeded by one step at most. Time that is still
/// due is then skipped.
const MAX_STEPPING: Duration = Duration::from_millis(100);
/// Longest sleep between two looks at the clock.
const MAX_SLEEP: Duration = Duration::from_millis(50);
/// Longest wait for a thread that requests the lock.
const MAX_YIELD: Duration = Duration::from_millis(1);

/// A world and everything that drives it.
pub struct Simulation {
    pub world: World,
    pub real_time: RealTime,
    /// The picked body, if any.
    pub picker: Option<Picker>,
    /// The error that stopped the simulation.
    pub error: Option<String>,
    /// `--play`, and the ears of the user.
    pub player: Option<Player>,
    pub ears: Listener,
    /// Durations of the steps.
    pub steps: Meter,
    /// Number of changes of the world: steps, resets and joints moved by hand.
    pub changes: u64,
    /// The snapshot at time 0.
    start: Vec<u8>,
    /// Number of the last step.
    last: Option<u64>,
    /// The last look at the clock.
    turn: Instant,
    ending: bool,
}

impl Simulation {
    /// Starts at time 0; ends after `last` steps.
    pub fn new(world: World, real_time: RealTime, last: Option<u64>, player: Option<Player>) -> Simulation {
        let start = world.save();
        let steps = Meter::default();
        Simulation {
            world,
            real_time,
            picker: None,
            error: None,
            player,
            ears: Listener::looking([0.0; 3], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]),
            steps,
            changes: 0,
            start,
            last,
            turn: Instant::now(),
            ending: false,
        }
    }

    /// Returns whether the last step has been taken, or an error prevents further ones.
    pub fn is_over(&self) -> bool {
        self.last.is_some_and(|last| self.world.frame() >= last || self.error.is_some())
    }

    /// Returns to time 0.
    pub fn reset(&mut self) -> Result<(), Failure> {
        (self.picker, self.error) = (None, None);
        self.changes += 1;
        self.world.restore(&self.start).map_err(|e| Failure::run("resetting to time 0", e))
    }

    /// Takes a step if one is due; returns whether it did.
    fn advance(&mut self) -> bool {
        if self.error.is_some() || self.is_over() || !self.real_time.take(self.world.settings().dt) {
            return false;
        }
        // a picked object that was removed is released
        self.picker = self.picker.take().filter(|picker| picker.pull(&mut self.world).is_ok());
        let clock = Instant::now();
        if let Err(error) = self.world.step() {
            self.real_time.paused = true;
            self.error = Some(error.to_string());
        }
        self.steps.add(clock.elapsed());
        self.changes += 1;
        if let Some(player) = &mut self.player {
            player.step_and_play(&self.world, &self.ears).iter().for_each(|said| eprintln!("{said}"));
        }
        true
    }

    /// Accounts for the time since the last call.
    fn advance_clock(&mut self) {
        let now = Instant::now();
        self.real_time.pass((now - self.turn).as_secs_f64());
        self.turn = now;
    }

    /// Returns for how long no step is due.
    fn pause(&self) -> Duration {
        let standing = self.error.is_some() || self.is_over();
        if standing { MAX_SLEEP } else { MAX_SLEEP.min(self.real_time.until(self.world.settings().dt)) }
    }
}

/// The thread and its simulation.
pub struct SimulationThread {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

struct Shared {
    simulation: Mutex<Simulation>,
    /// Number of threads that wait for the lock; the simulation yields to them.
    wanted: AtomicUsize,
    /// Signaled when the lock is released.
    released: Condvar,
}

impl SimulationThread {
    /// Holds the simulation at its state until [`SimulationThread::start`].
    pub fn new(simulation: Simulation) -> SimulationThread {
        let shared =
            Shared { simulation: Mutex::new(simulation), wanted: AtomicUsize::new(0), released: Condvar::new() };
        SimulationThread { shared: Arc::new(shared), thread: None }
    }

    /// Starts the clock and the thread.
    pub fn start(&mut self) -> Result<(), Failure> {
        self.lock().turn = Instant::now();
        let shared = self.shared.clone();
        let spawned = std::thread::Builder::new().name("simulation".into()).spawn(move || run_thread(&shared));
        self.thread = Some(spawned.map_err(|e| Failure::run("the simulation", e))?);
        Ok(())
    }

    /// Returns whether the thread was started.
    pub fn runs(&self) -> bool {
        self.thread.is_some()
    }

    /// Locks the simulation between two steps; waits for the end of the present step.
    pub fn lock(&self) -> SimulationGuard<'_> {
        self.shared.wanted.fetch_add(1, Ordering::Relaxed);
        let guard = ignore_poison(self.shared.simulation.lock());
        self.shared.wanted.fetch_sub(1, Ordering::Relaxed);
        SimulationGuard { guard, released: &self.shared.released }
    }

    /// Returns whether the thread ended by itself, which only a bug in it can cause.
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

/// The simulation, locked between two steps.
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

/// Returns the guard even if another thread panicked with it; [`SimulationThread::is_broken`]
/// reports the panic.
fn ignore_poison<T>(result: Result<T, PoisonError<T>>) -> T {
    result.unwrap_or_else(PoisonError::into_inner)
}
