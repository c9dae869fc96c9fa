//! Simulated time against the clock: how many steps are due, and how much time is skipped if they
//! take too long.

use std::time::Duration;

/// Longest time between two updates that is caught up with, s. The rest is skipped, as after a
/// window was hidden or the machine slept.
const MAX_LATE_S: f64 = 1.0;
/// Range of speeds, as powers of 2.
const SPEEDS: std::ops::RangeInclusive<i32> = -6..=4;

/// Keeps simulated time in step with the clock.
pub struct RealTime {
    /// Whether the simulation is paused.
    pub paused: bool,
    /// Simulated seconds that are due and not yet stepped.
    owed_s: f64,
    /// Simulated seconds skipped since the start.
    pub behind_s: f64,
    /// The speed as a power of 2.
    power: i32,
    /// Requested single steps.
    single: u32,
}

impl RealTime {
    /// Starts at the speed of the clock.
    pub fn new(paused: bool) -> RealTime {
        RealTime { paused, owed_s: 0.0, behind_s: 0.0, power: 0, single: 0 }
    }

    /// Simulated seconds per second of the clock.
    pub fn speed(&self) -> f64 {
        2f64.powi(self.power)
    }

    /// Doubles (1) or halves (-1) the speed.
    pub fn change_speed(&mut self, by: i32) {
        self.power = (self.power + by).clamp(*SPEEDS.start(), *SPEEDS.end());
    }

    /// Pauses, or continues. Time that was due is dropped.
    pub fn toggle(&mut self) {
        self.paused = !self.paused;
        (self.owed_s, self.single) = (0.0, 0);
    }

    /// Requests one step and pauses.
    pub fn step_once(&mut self) {
        self.paused = true;
        self.owed_s = 0.0;
        self.single = (self.single + 1).min(100);
    }

    /// Adds time that has passed on the clock, s.
    pub fn pass(&mut self, clock_s: f64) {
        if !self.paused {
            let counted = clock_s.clamp(0.0, MAX_LATE_S);
            self.behind_s += (clock_s - counted).max(0.0) * self.speed();
            self.owed_s += counted * self.speed();
        }
    }

    /// Returns whether a step of `dt` seconds is due; it then counts as taken.
    pub fn take(&mut self, dt: f64) -> bool {
        if self.single > 0 {
            self.single -= 1;
            return true;
        }
        let due = !self.paused && self.owed_s >= dt;
        if due {
            self.owed_s -= dt;
        }
        due
    }

    /// Time on the clock until a step of `dt` seconds is due; long if none will be.
    pub fn until(&self, dt: f64) -> Duration {
        match (self.single > 0, self.paused) {
            (true, _) => Duration::ZERO,
            (false, true) => Duration::from_secs_f64(MAX_LATE_S),
            (false, false) => Duration::from_secs_f64(((dt - self.owed_s) / self.speed()).clamp(0.0, MAX_LATE_S)),
        }
    }

    /// Skips the time that is still due, so that slow steps do not delay the next picture further.
    pub fn give_up(&mut self) {
        self.behind_s += self.owed_s;
        self.owed_s = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steps(real_time: &mut RealTime, dt: f64) -> u32 {
        std::iter::from_fn(|| real_time.take(dt).then_some(())).count() as u32
    }

    #[test]
    fn a_second_in_uneven_turns_gives_as_many_steps_as_fit_in_it() {
        let mut real_time = RealTime::new(false);
        let turns = [0.25, 0.125, 0.5, 0.0625, 0.0625];
        assert_eq!(
            turns.map(|t| {
                real_time.pass(t);
                steps(&mut real_time, 1.0 / 64.0)
            }),
            [16, 8, 32, 4, 4]
        );
        real_time.change_speed(-1);
        real_time.pass(1.0);
        assert_eq!(steps(&mut real_time, 1.0 / 64.0), 32);
    }

    #[test]
    fn no_time_passes_while_paused_and_single_steps_are_exact() {
        let mut real_time = RealTime::new(true);
        real_time.pass(0.5);
        assert_eq!(steps(&mut real_time, 0.01), 0);
        real_time.step_once();
        real_time.step_once();
        real_time.pass(0.5);
        assert_eq!(steps(&mut real_time, 0.01), 2);
        real_time.toggle();
        assert!(!real_time.paused);
        assert_eq!(steps(&mut real_time, 0.01), 0, "time that passed during the pause is not due");
    }

    #[test]
    fn the_next_step_is_due_when_the_clock_has_gone_on_by_what_is_missing() {
        let mut real_time = RealTime::new(false);
        real_time.pass(0.25);
        real_time.change_speed(1);
        // half a second is missing, at twice the speed
        assert_eq!(real_time.until(0.75), Duration::from_millis(250));
        assert_eq!(real_time.until(0.2), Duration::ZERO);
        real_time.step_once();
        assert_eq!(real_time.until(0.75), Duration::ZERO);
        assert!(real_time.take(0.75) && real_time.paused);
        assert_eq!(real_time.until(0.75), Duration::from_secs(1), "no step is due while paused");
    }

    #[test]
    fn late_time_is_skipped_and_counted() {
        let mut real_time = RealTime::new(false);
        real_time.pass(10.0);
        assert_eq!((real_time.owed_s, real_time.behind_s), (1.0, 9.0));
        assert!(real_time.take(0.25));
        real_time.give_up();
        assert_eq!((steps(&mut real_time, 0.25), real_time.behind_s), (0, 9.75));
    }
}
