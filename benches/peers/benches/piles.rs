//! CPU seconds per simulated second of piles and pyramids, tumble and Rapier in one run.
//!
//! ```text
//! cargo bench                              all cases, 5 runs each, medians
//! cargo bench -- pyramid-55 --runs 9       one case
//! cargo bench -- spheres-1000 --tumble     tumble only, for a profiler
//! ```

use tumble_peers::measure::{Run, run, stands};
use tumble_peers::scene::{Scene, pyramid, spheres};
use tumble_peers::{Engine, rapier::Rapier, tumble::Tumble};

/// Options of the command line.
struct Options {
    names: Vec<String>,
    runs: usize,
    alone: bool,
}

fn options() -> Options {
    let mut options = Options { names: Vec::new(), runs: 5, alone: false };
    let mut arguments = std::env::args().skip(1).filter(|a| a != "--bench");
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--runs" => {
                options.runs = arguments
                    .next()
                    .and_then(|n| n.parse().ok())
                    .filter(|n| *n > 0)
                    .expect("--runs wants a number above 0")
            }
            "--tumble" => options.alone = true,
            _ => options.names.push(argument),
        }
    }
    options
}

fn main() {
    let options = options();
    let scenes = [spheres(100), spheres(500), spheres(1000), pyramid(10), pyramid(20)];
    println!(
        "CPU s per simulated s, t = 1 to 4 s, dt 1/60, median of {} runs. Errors in mm; residual in m/s.",
        options.runs
    );
    println!("| case | tumble | Rapier f64 | ratio | penetration (Rapier) | movement (Rapier) | residual |");
    println!("|---|---|---|---|---|---|---|");
    for scene in scenes.iter().filter(|s| options.names.is_empty() || options.names.contains(&s.name)) {
        println!("{}", line(scene, &options));
    }
}

/// Returns one row of the table. The engines alternate, so both see the same load of the machine.
fn line(scene: &Scene, options: &Options) -> String {
    let (mut ours, mut theirs) = (Vec::new(), Vec::new());
    for _ in 0..options.runs {
        ours.push(checked(&mut Tumble::new(scene), scene));
        if !options.alone {
            theirs.push(checked(&mut Rapier::new(scene), scene));
        }
    }
    let (a, b) = (median(ours), if theirs.is_empty() { Run::default() } else { median(theirs) });
    let mm = |x: f64, y: f64| format!("{:.3} ({:.3})", 1e3 * x, 1e3 * y);
    format!(
        "| {} | {:.4} | {:.4} | {:.2} | {} | {} | {:.1e} |",
        scene.name,
        a.cpu,
        b.cpu,
        a.cpu / b.cpu,
        mm(a.penetration, b.penetration),
        mm(a.movement, b.movement),
        a.residual.unwrap_or(0.0)
    )
}

fn checked(engine: &mut dyn Engine, scene: &Scene) -> Run {
    let run = run(engine, scene);
    if !stands(scene, &run) {
        println!("{}: the pyramid fell", scene.name);
    }
    run
}

/// Returns the run of median time; its other numbers are the same in every run of one engine.
fn median(mut runs: Vec<Run>) -> Run {
    runs.sort_by(|a, b| a.cpu.total_cmp(&b.cpu));
    runs[runs.len() / 2]
}
