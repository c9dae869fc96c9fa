//! The result of a trial, as a table.

use super::Failure;
use super::options::Options;
use std::time::Duration;
use tumble_net::sync::transport::{LinkCounters, Refused};

#[derive(Default)]
pub struct Figures {
    /// Time from the server's send to the arrival at a facet, for each facet and frame.
    pub state_ns: Vec<u64>,
    /// Time from the server's send to the last READY.
    pub ready_ns: Vec<u64>,
    /// Time from the server's send to the last arrival of PRESENT at a facet.
    pub barrier_ns: Vec<u64>,
    /// Time between the first and the last arrival of PRESENT at a facet.
    pub skew_ns: Vec<u64>,
    /// Number of states that were missing, repeated, out of order or incomplete: the largest count
    /// of any facet.
    pub faults: u64,
    /// Number of frames that began more than a frame late.
    pub behind: u64,
    pub wall: Duration,
}

fn row(what: &str, samples: &mut [u64]) {
    samples.sort_unstable();
    let at =
        |q: f64| samples.get((samples.len().saturating_sub(1) as f64 * q) as usize).map_or(0.0, |ns| *ns as f64 / 1e3);
    println!("| {what} | {:.0} | {:.0} | {:.0} | {:.0} |", at(0.5), at(0.99), at(0.999), at(1.0));
}

pub fn print(options: &Options, figures: &mut Figures, bytes: u64, counters: &[LinkCounters]) -> Result<(), Failure> {
    let states = options.frames * u64::from(options.facets) * options.bytes as u64;
    println!(
        "{} frames of {} bytes to {} facets at {} Hz",
        options.frames, options.bytes, options.facets, options.rate
    );
    println!("| microseconds | p50 | p99 | p99.9 | max |\n|---|---|---|---|---|");
    row("state to facet", &mut figures.state_ns);
    row("state to all ready", &mut figures.ready_ns);
    row("whole barrier: state to PRESENT at all facets", &mut figures.barrier_ns);
    row("skew of presentation", &mut figures.skew_ns);
    let rate = options.frames as f64 / figures.wall.as_secs_f64();
    println!(
        "held {rate:.1} Hz, {} frames more than a frame late; missing, repeated, torn or out of order: {}",
        figures.behind, figures.faults
    );
    let sum = |of: fn(&LinkCounters) -> u64| counters.iter().map(of).sum::<u64>();
    let refused: Vec<String> = Refused::ALL
        .into_iter()
        .map(|why| (why, counters.iter().map(|counters| counters.refused_for(why)).sum::<u64>()))
        .filter(|(_, count)| *count > 0)
        .map(|(why, count)| format!("{} {count}", why.name()))
        .collect();
    // the facets count bytes that they received: lost packets are missing there
    println!(
        "{:.3} times the bytes of the states, both ways; {} pieces sent again; refused: {}",
        bytes as f64 / states as f64,
        sum(|counters| counters.repeated),
        if refused.is_empty() { "nothing".into() } else { refused.join(", ") }
    );
    if figures.faults > 0 {
        return Err(format!("{} states were missing, repeated, torn or out of order", figures.faults).into());
    }
    Ok(())
}
