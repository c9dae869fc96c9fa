//! Prints the hash of the state of every shipped scene after a part of a second, with each stepper, each solver and several numbers of
//! threads: one line `scene stepper solver threads hash` each. `scripts/same_bits.sh` builds this program for several targets and compares
//! the lines.
//!
//! ```text
//! state_hashes [SECONDS [THREADS [SCENES]]]     0.1 s of simulated time, a quarter of it with the pivoting solvers; 1 and 8 threads, or up to THREADS
//! ```

use tumble_core::solver;
use tumble_scene::{Stepper, shipped};

/// Steppers and solvers that are compared.
pub(crate) const METHODS: [(Stepper, &str); 4] = [
    (Stepper::TimeStepping, "gauss_seidel"),
    (Stepper::TimeStepping, "lcp_pyramid"),
    (Stepper::TimeStepping, "lcp_sliding"),
    (Stepper::Backtracking, "gauss_seidel"),
];

fn main() {
    let mut words = std::env::args().skip(1);
    let seconds: f64 = words.next().and_then(|word| word.parse().ok()).unwrap_or(0.1);
    let most: u32 = words.next().and_then(|word| word.parse().ok()).unwrap_or(8);
    let chosen: Vec<String> = words.collect();
    for scene in shipped().iter().filter(|scene| chosen.is_empty() || chosen.iter().any(|name| name == scene.name)) {
        for (stepper, solver) in METHODS {
            for threads in [1, 8].into_iter().filter(|threads| *threads <= most) {
                println!("{}", line(scene.name, stepper, solver, threads, seconds));
            }
        }
    }
}

/// A line of the output. Pivoting solvers get a quarter of the time: their cost is the cube of the size of an island.
pub(crate) fn line(scene: &str, stepper: Stepper, solver: &str, threads: u32, seconds: f64) -> String {
    let seconds = if solver == "gauss_seidel" { seconds } else { 0.25 * seconds };
    let outcome = hash(scene, stepper, solver, threads, seconds);
    format!("{scene} {stepper} {solver} {threads} {}", outcome.unwrap_or_else(|why| why.replace(' ', "_")))
}

/// The first 16 hexadecimal digits of BLAKE3 over the bytes of the state, or the reason why a step failed.
fn hash(scene: &str, stepper: Stepper, solver: &str, threads: u32, seconds: f64) -> Result<String, String> {
    let shipped = shipped().iter().find(|s| s.name == scene).ok_or("no such scene")?;
    let mut file = shipped.read().map_err(|error| error.report(false))?;
    file.world.stepper = stepper;
    let (mut world, _) = file.build().map_err(|error| error.to_string())?;
    world.set_solver(solver::by_name(solver).ok_or("no such solver")?);
    world.set_settings(world.settings().with_threads(threads)).map_err(|error| error.to_string())?;
    while world.time() < seconds - 1e-9 {
        world.step().map_err(|error| error.to_string())?;
    }
    let bytes: Vec<u8> = world.state().iter().flat_map(|x| x.to_le_bytes()).collect();
    Ok(blake3::hash(&bytes).to_hex()[..16].to_string())
}
