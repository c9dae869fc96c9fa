//! CPU seconds per simulated second of piles, pyramids and towers, tumble and Rapier in one run.
//!
//! ```text
//! cargo bench --bench piles                              the scenes that take seconds, medians of 3 runs
//! cargo bench --bench piles -- pyramid-55 --runs 9       one scene
//! cargo bench --bench piles -- --large --runs 1          all scenes
//! cargo bench --bench piles -- spheres-1000 --tumble     tumble only, for a profiler
//! cargo bench --bench piles -- cards-5 --sweeps 100000   tumble with this limit of sweeps
//! cargo bench --bench piles -- spheres-1000 --threads 2  tumble on one and two threads, time of the day, best of the runs
//! ```

use tumble_peers::clock::{cpu_seconds, wall_seconds};
use tumble_peers::measure::{Run, run};
use tumble_peers::rapier::{Rapier32, Rapier64};
use tumble_peers::scene::Scene;
use tumble_peers::tumble::Tumble;
use tumble_peers::{Engine, Solves, scenes};

/// Builds a scene in an engine.
type Load = Box<dyn Fn(&Scene) -> Box<dyn Engine>>;

/// Options of the command line.
struct Options {
    names: Vec<String>,
    runs: usize,
    large: bool,
    alone: bool,
    /// Replaces tumble's limit of sweeps.
    sweeps: Option<u32>,
    /// Compares this number of threads with one.
    threads: Option<u32>,
}

fn options() -> Options {
    let mut options = Options { names: Vec::new(), runs: 3, large: false, alone: false, sweeps: None, threads: None };
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
            "--large" => options.large = true,
            "--tumble" => options.alone = true,
            "--sweeps" => {
                let sweeps = arguments.next().and_then(|n| n.parse().ok());
                options.sweeps = Some(sweeps.expect("--sweeps wants a number"));
            }
            "--threads" => {
                let threads = arguments.next().and_then(|n| n.parse().ok());
                options.threads = Some(threads.expect("--threads wants a number"));
            }
            _ => options.names.push(argument),
        }
    }
    options
}

fn main() {
    let options = options();
    let scenes = scenes::all();
    for name in &options.names {
        assert!(scenes.iter().any(|s| s.name == *name), "no scene is called {name}");
    }
    let chosen = |scene: &&Scene| match options.names.is_empty() {
        true => options.large || !scene.large,
        false => options.names.contains(&scene.name),
    };
    if let Some(threads) = options.threads {
        return scenes.iter().filter(chosen).for_each(|scene| compare_threads(scene, threads, options.runs));
    }
    println!("CPU s per simulated s, median of {} runs; errors in mm; tumble (Rapier f64, f32).", options.runs);
    println!(
        "| case | tumble | Rapier f64 | f32 | ratio f64 | f32 | overlap | at the end | movement | joint gap | speed at end, m/s | unconverged | residual, m/s |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    for scene in scenes.iter().filter(chosen) {
        println!("{}", line(scene, &options));
    }
}

/// Returns one row of the table. The engines alternate, so all see the same load of the machine.
fn line(scene: &Scene, options: &Options) -> String {
    let sweeps = options.sweeps;
    let ours = move |s: &Scene| -> Box<dyn Engine> {
        let mut tumble = Tumble::new(s);
        sweeps.into_iter().for_each(|sweeps| tumble.set_max_sweeps(sweeps));
        Box::new(tumble)
    };
    let engines: [Load; 3] =
        [Box::new(ours), Box::new(|s| Box::new(Rapier64::new(s))), Box::new(|s| Box::new(Rapier32::new(s)))];
    let engines = if options.alone { &engines[..1] } else { &engines };
    let mut runs = vec![Vec::new(); engines.len()];
    for _ in 0..options.runs {
        for (runs, engine) in runs.iter_mut().zip(engines) {
            runs.push(run(engine(scene).as_mut(), scene, cpu_seconds));
        }
    }
    let runs: Vec<Run> = runs.into_iter().map(median).collect();
    let cpu = |i: usize| runs.get(i).map_or(f64::NAN, |run: &Run| run.cpu);
    let Solves { residual, unconverged } = runs[0].solves.expect("tumble reports its solves");
    format!(
        "| {} | {:.4} | {:.4} | {:.4} | {:.2} | {:.2} | {} | {} | {} | {} | {} | {unconverged} | {residual:.1e} |",
        scene.name,
        cpu(0),
        cpu(1),
        cpu(2),
        cpu(0) / cpu(1),
        cpu(0) / cpu(2),
        if scene.joints.is_empty() { cell(&runs, |run| mm(run.overlap)) } else { "–".into() },
        if scene.joints.is_empty() { cell(&runs, |run| mm(run.overlap_at_end)) } else { "–".into() },
        if scene.stands { cell(&runs, |run| mm(run.movement)) } else { "–".into() },
        if scene.joints.is_empty() { "–".into() } else { cell(&runs, |run| mm(run.joint_gap)) },
        cell(&runs, |run| format!("{:.3}", run.speed)),
    )
}

/// Prints the time of the day per simulated second on one thread and on `threads`, in alternation, the
/// best of the runs.
fn compare_threads(scene: &Scene, threads: u32, runs: usize) {
    let (mut one, mut many) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..runs {
        for (threads, best) in [(1, &mut one), (threads, &mut many)] {
            *best = run(&mut Tumble::on(scene, threads), scene, wall_seconds).cpu.min(*best);
        }
    }
    println!("{}: {one:.4} s on 1 thread, {many:.4} s on {threads}: {:.2} times", scene.name, one / many);
}

/// Returns a length in millimeters, with a power of ten from 1000 km on.
fn mm(meters: f64) -> String {
    if meters < 1e6 { format!("{:.3}", 1e3 * meters) } else { format!("{:.1e}", 1e3 * meters) }
}

/// Returns the figure of tumble, and those of its peers in brackets.
fn cell(runs: &[Run], figure: impl Fn(&Run) -> String) -> String {
    let peers: Vec<String> = runs[1..].iter().map(&figure).collect();
    let peers = if peers.is_empty() { String::new() } else { format!(" ({})", peers.join(", ")) };
    figure(&runs[0]) + &peers
}

/// Returns the run of median time; its other numbers are the same in every run of one engine.
fn median(mut runs: Vec<Run>) -> Run {
    runs.sort_by(|a, b| a.cpu.total_cmp(&b.cpu));
    runs[runs.len() / 2]
}
