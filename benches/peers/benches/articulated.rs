//! Microseconds per forward dynamics (`q, q̇, τ → q̈`, with sines and cosines), tumble and dynibo
//! in one run, on one thread.
//!
//! ```text
//! cargo bench --bench articulated                       all shapes
//! cargo bench --bench articulated -- "chain 7" --rounds 4000
//! ```
//!
//! `best peer` is the best of Pinocchio, MuJoCo and dynibo, measured on another day and scaled by
//! the time of dynibo's chain of 7 in this run. Lanes are microseconds per state with 1, 4 and 8
//! states side by side. A second table has the other maps of an engine's step.

use std::hint::black_box;
use tumble_peers::articulated::{Batch, Dynibo, Maps, Robot, Single, anymal, chain, in_turns, panda, talos};

/// Number of states that the calls cycle through.
const STATES: usize = 8;

/// Positions, velocities, forces.
type State = (Vec<f64>, Vec<f64>, Vec<f64>);

fn main() {
    let mut rounds = 1500;
    let mut names: Vec<String> = Vec::new();
    let mut arguments = std::env::args().skip(1).filter(|a| a != "--bench");
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--rounds" => {
                rounds = arguments
                    .next()
                    .and_then(|n| n.parse().ok())
                    .filter(|n| *n > 0)
                    .expect("--rounds wants a number above 0")
            }
            _ => names.push(argument),
        }
    }
    let mut robots = vec![chain(7, 0.94), chain(10, 1.22), chain(25, 3.70), chain(50, 8.32), chain(100, 16.6)];
    robots.extend([anymal(), panda(), talos()]);
    let scale = dynibo_now(rounds);
    println!(
        "| robot | tumble | dynibo | ratio | best peer, scaled | of it | difference | lanes 1 | 4 | 8 | lanes 8 of best |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    for robot in robots.iter().filter(|r| names.is_empty() || names.contains(&r.name)) {
        println!("{}", line(robot, rounds, scale));
    }
    println!();
    println!("| robot | refresh | accelerate | `mul_l` | test impulses in 3 directions at the last link |");
    println!("|---|---|---|---|---|");
    for robot in robots.iter().filter(|r| names.is_empty() || names.contains(&r.name)) {
        println!("{}", parts(robot, rounds));
    }
}

/// Returns the time of dynibo's chain of 7 in this run.
fn dynibo_now(rounds: usize) -> f64 {
    let robot = chain(7, 0.0);
    let (mut peer, states, mut qdd) = (Dynibo::new(&robot), states(&robot), vec![0.0; 7]);
    in_turns(
        rounds,
        &mut [&mut |k| {
            let (q, v, tau) = &states[k % STATES];
            peer.forward_dynamics(black_box(q), black_box(v), black_box(tau), black_box(&mut qdd));
        }],
    )[0]
}

fn line(robot: &Robot, rounds: usize, scale: f64) -> String {
    let (mut ours, mut theirs) = (Single::new(robot), Dynibo::new(robot));
    let joints = states(robot);
    let whole: Vec<State> = joints
        .iter()
        .map(|(q, v, tau)| {
            let (q, v) = ours.state(q, v);
            (q, v, tau.clone())
        })
        .collect();
    let order = theirs.order(robot);
    let head = robot.dof() - robot.parts.len();
    let permuted: Vec<State> = joints
        .iter()
        .map(|(q, v, tau)| {
            let pick = |x: &[f64]| order.iter().map(|&i| x[i]).collect::<Vec<f64>>();
            (pick(q), pick(v), [vec![0.0; head], pick(&tau[head..])].concat())
        })
        .collect();
    let mut difference = 0.0f64;
    let (mut a, mut b) = (vec![0.0; robot.dof()], vec![0.0; robot.dof()]);
    for ((q, v, tau), (pq, pv, pt)) in whole.iter().zip(&permuted) {
        ours.forward_dynamics(q, v, tau, &mut a);
        theirs.forward_dynamics(pq, pv, pt, &mut b);
        let size = a.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        difference =
            order.iter().enumerate().fold(difference, |m, (k, &i)| m.max((a[head + i] - b[head + k]).abs() / size));
    }
    let (mut one, mut four, mut eight) =
        (Batch::<1>::new(robot, &whole), Batch::<4>::new(robot, &whole), Batch::<8>::new(robot, &whole));
    let times = in_turns(
        rounds,
        &mut [
            &mut |k| {
                let (q, v, tau) = &whole[k % STATES];
                ours.forward_dynamics(black_box(q), black_box(v), black_box(tau), black_box(&mut a));
            },
            &mut |k| {
                let (q, v, tau) = &permuted[k % STATES];
                theirs.forward_dynamics(black_box(q), black_box(v), black_box(tau), black_box(&mut b));
            },
            &mut |_| black_box(&mut one).forward_dynamics(),
            &mut |_| black_box(&mut four).forward_dynamics(),
            &mut |_| black_box(&mut eight).forward_dynamics(),
        ],
    );
    let best = robot.best.0 / robot.best.1 * scale;
    format!(
        "| {} | {:.3} | {:.3} | {:.2} | {best:.2} | {:.2} | {difference:.0e} | {:.3} | {:.3} | {:.3} | {:.2} |",
        robot.name,
        times[0],
        times[1],
        times[0] / times[1],
        times[0] / best,
        times[2],
        times[3] / 4.0,
        times[4] / 8.0,
        times[4] / 8.0 / best
    )
}

/// Returns the times of the maps that an engine evaluates in each step, µs.
fn parts(robot: &Robot, rounds: usize) -> String {
    let mut maps = Maps::new(robot);
    let single = Single::new(robot);
    let states: Vec<State> = states(robot)
        .iter()
        .map(|(q, v, tau)| {
            let (q, v) = single.state(q, v);
            (q, v, tau.clone())
        })
        .collect();
    let maps = std::cell::RefCell::new(&mut maps);
    let times = in_turns(
        rounds,
        &mut [
            &mut |k| maps.borrow_mut().refresh(black_box(&states[k % STATES].0), black_box(&states[k % STATES].1)),
            &mut |k| maps.borrow_mut().accelerate(black_box(&states[k % STATES].2)),
            &mut |k| maps.borrow_mut().mul_l(black_box(&states[k % STATES].1)),
            &mut |_| maps.borrow_mut().probe(),
        ],
    );
    format!("| {} | {:.3} | {:.3} | {:.3} | {:.3} |", robot.name, times[0], times[1], times[2], times[3])
}

/// Returns states away from all limits. All forces are zero on a floating base.
fn states(robot: &Robot) -> Vec<State> {
    let (joints, head) = (robot.parts.len(), robot.dof() - robot.parts.len());
    (0..STATES)
        .map(|s| {
            let wave = |i: usize, rate: f64, size: f64| size * (rate * (i + 1) as f64 + s as f64).sin();
            let list = |rate, size| (0..joints).map(|i| wave(i, rate, size)).collect::<Vec<f64>>();
            (list(0.37, 1.2), list(0.23, 0.7), [vec![0.0; head], list(0.41, 2.0)].concat())
        })
        .collect()
}
