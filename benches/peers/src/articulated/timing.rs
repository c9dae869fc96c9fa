//! Medians of many calls, the engines in turns, so that all meet the same machine.

use std::time::Instant;

/// Calls between two looks at the clock.
const CALLS: usize = 64;

/// Microseconds per call of each, medians over `rounds` rounds.
pub fn in_turns(rounds: usize, calls: &mut [&mut dyn FnMut(usize)]) -> Vec<f64> {
    let mut times = vec![Vec::with_capacity(rounds); calls.len()];
    for round in 0..rounds + rounds / 10 {
        for (call, times) in calls.iter_mut().zip(&mut times) {
            let start = Instant::now();
            for k in 0..CALLS {
                call(k);
            }
            let elapsed = start.elapsed().as_secs_f64() * 1e6 / CALLS as f64;
            // The first rounds warm up.
            if round >= rounds / 10 {
                times.push(elapsed);
            }
        }
    }
    times.into_iter().map(median).collect()
}

/// The middle one.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
