//! Medians of many calls. The engines alternate, so all see the same load of the machine.

use std::time::Instant;

/// Number of calls between two readings of the clock.
const CALLS: usize = 64;

/// Returns microseconds per call of each function, medians over `rounds` rounds.
pub fn in_turns(rounds: usize, calls: &mut [&mut dyn FnMut(usize)]) -> Vec<f64> {
    let mut times = vec![Vec::with_capacity(rounds); calls.len()];
    for round in 0..rounds + rounds / 10 {
        for (call, times) in calls.iter_mut().zip(&mut times) {
            let start = Instant::now();
            for k in 0..CALLS {
                call(k);
            }
            let elapsed = start.elapsed().as_secs_f64() * 1e6 / CALLS as f64;
            // the first rounds warm up
            if round >= rounds / 10 {
                times.push(elapsed);
            }
        }
    }
    times.into_iter().map(median).collect()
}

/// Returns the median.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
