//! CPU time per step of the broad phase in one run: tumble, parry's bounding volume hierarchy, and
//! a plain pass over the data that must be read.
//!
//! ```text
//! cargo bench --bench broad                                          the curve, and all kinds of crowds at 1,000, 10,000 and 100,000
//! cargo bench --bench broad -- --svg ../../docs/images/broad.svg     the curve only, also as a picture
//! cargo bench --bench broad -- --curve                               the curve only
//! cargo bench --bench broad -- --tumble slow 100000                  one case of tumble only, for a profiler
//! ```
//!
//! Another program on the same core evicts data from the caches, which slows large crowds. `chrt -f
//! 1` in front reserves the core.

use tumble_peers::broad::{Cost, Follower, Kind, Plain, Sweep, Tree, follow, write_curve};
use tumble_peers::scenes::RADIUS;

/// Margin of fat boxes in both engines, as a fraction of a box's smallest extent.
const ROOM: f64 = 0.1;
/// Number of alternating rounds; the median is reported.
const ROUNDS: usize = 3;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["--tumble", kind, n] => {
            let kind = Kind::ALL.into_iter().find(|k| k.1 == kind).expect("a kind of crowd as the table names it").0;
            let n = n.parse().expect("a number of boxes");
            let cost = follow(&mut Sweep::default(), kind, n, steps(n));
            println!("{:.1} µs per step, {} pairs", cost.step, cost.pairs);
        }
        ["--curve"] => drop(curves()),
        ["--svg", path] => std::fs::write(path, write_curve(&curves())).expect("the picture can be written"),
        _ => drop(curves()),
    }
    if arguments.is_empty() {
        kinds();
    }
}

/// Returns the curves of slow crowds of growing size.
fn curves() -> [(&'static str, &'static str, Vec<(f64, f64)>); 3] {
    println!(
        "CPU µs per step, boxes in a cube of constant density that move by 1 % of their radius per step; medians of {ROUNDS} rounds.\n"
    );
    println!(
        "| boxes | tumble | per box, ns | fastest tenth, ns | parry | ratio | plain pass | pairs |\n|---|---|---|---|---|---|---|---|"
    );
    let mut curves = [
        ("tumble", "#1060c0", Vec::new()),
        ("parry (Rapier)", "#c05010", Vec::new()),
        ("a plain pass", "#808080", Vec::new()),
    ];
    for n in [1000, 2000, 5000, 10_000, 20_000, 50_000, 100_000] {
        let [ours, theirs, plain] = all(Kind::Slow, n);
        let per_box = [ours.step, ours.tenth].map(|time| 1e3 * time / n as f64);
        let ratio = ours.step / theirs.step;
        println!(
            "| {n} | {:.1} | {:.1} | {:.1} | {:.1} | {ratio:.2} | {:.1} | {} |",
            ours.step, per_box[0], per_box[1], theirs.step, plain.step, ours.pairs
        );
        for (curve, cost) in curves.iter_mut().zip([ours, theirs, plain]) {
            curve.2.push((n as f64, cost.step));
        }
    }
    for (name, _, points) in &curves {
        println!("{name}: the time grows as n^{:.2}", exponent(points));
    }
    curves
}

/// Returns the slope of the best straight line in logarithmic scales.
fn exponent(points: &[(f64, f64)]) -> f64 {
    let logarithms: Vec<(f64, f64)> = points.iter().map(|(n, time)| (n.ln(), time.ln())).collect();
    let mean = |of: fn(&(f64, f64)) -> f64| logarithms.iter().map(of).sum::<f64>() / logarithms.len() as f64;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    logarithms.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>()
        / logarithms.iter().map(|p| (p.0 - x).powi(2)).sum::<f64>()
}

/// Prints the costs of every kind of crowd.
fn kinds() {
    println!("\nCPU µs per step, tumble (parry).\n\n| crowd | 1,000 | 10,000 | 100,000 |\n|---|---|---|---|");
    for (kind, name) in Kind::ALL {
        let cell = |n: usize| {
            let [ours, theirs, _] = all(kind, n);
            format!("{:.0} ({:.0})", ours.step, theirs.step)
        };
        println!("| {name} | {} | {} | {} |", cell(1000), cell(10_000), cell(100_000));
    }
}

/// Returns the costs of tumble, parry and the plain pass.
fn all(kind: Kind, n: usize) -> [Cost; 3] {
    let margin = ROOM * 2.0 * RADIUS;
    let mut costs = [Vec::new(), Vec::new(), Vec::new()];
    for _ in 0..ROUNDS {
        let followers: [Box<dyn Follower>; 3] =
            [Box::new(Sweep::default()), Box::new(Tree::new(margin)), Box::new(Plain::new(margin))];
        for (costs, mut follower) in costs.iter_mut().zip(followers) {
            costs.push(follow(follower.as_mut(), kind, n, steps(n)));
        }
    }
    costs.map(|mut c| {
        c.sort_by(|a, b| a.step.total_cmp(&b.step));
        c[c.len() / 2]
    })
}

/// Returns the number of steps of a round.
fn steps(n: usize) -> usize {
    (2_000_000 / n).clamp(60, 1000)
}
