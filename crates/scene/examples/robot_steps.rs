//! Prints the time of a step of one robot and a hash of where it gets, with the same random torques in every run: what a change of the step
//! gains, and whether it changes a bit.
//!
//! ```text
//! robot_steps [MODELS [TURNS [WORLDS]]]     names of models, or `all`; the mean of 1000 steps, of each the fastest of TURNS turns; with WORLDS, steps and their memory as in a batch
//! ```

use std::path::{Path, PathBuf};
use std::time::Instant;

use tumble_core::{ArticulatedBody, ObjectId, WorkingMemory, World, WorldState};
use tumble_scene::mjcf::{MjcfOptions, load};

const STEPS: usize = 1000;

/// Names, files from the root of the repository, and degrees of freedom of the root, which are not driven.
const MODELS: [(&str, &str, usize); 10] = [
    ("cartpole", "crates/scene/tests/mjcf/cartpole.xml", 0),
    ("two_poles", "crates/py/python/tumble/gym/models/inverted_double_pendulum.xml", 0),
    ("swimmer", "crates/py/python/tumble/gym/models/swimmer.xml", 3),
    ("hopper", "crates/py/python/tumble/gym/models/hopper.xml", 3),
    ("walker", "crates/py/python/tumble/gym/models/walker2d.xml", 3),
    ("cheetah", "crates/py/python/tumble/gym/models/half_cheetah.xml", 3),
    ("ant", "crates/py/python/tumble/gym/models/ant.xml", 6),
    ("quadruped", "crates/scene/tests/mjcf/quadruped.xml", 6),
    ("gym_humanoid", "crates/py/python/tumble/gym/models/humanoid.xml", 6),
    ("humanoid", "crates/scene/tests/mjcf/humanoid.xml", 6),
];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let asked = words.first().map_or("all", String::as_str);
    let turns: usize = words.get(1).map_or(Ok(5), |word| word.parse())?;
    let worlds: usize = words.get(2).map_or(Ok(0), |word| word.parse())?;
    println!("{:14}{:>4}{:>10}{:>10}{:>12}  hash", "model", "dof", "µs/step", "contacts", "iterations");
    for (name, file, root) in MODELS.iter().filter(|(name, ..)| asked == "all" || asked.split(',').any(|a| a == *name))
    {
        let path: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(file);
        let (world, _) = load(path, &MjcfOptions::default())?.build()?;
        let mut run = Run::new(world, *root, worlds);
        let mut report = (String::new(), [0.0; 2]);
        for _ in 0..turns {
            report = run.turn()?;
        }
        let mean = 1e6 * run.fastest.iter().sum::<f64>() / run.fastest.len() as f64;
        let [contacts, iterations] = report.1;
        println!("{name:14}{:4}{mean:10.3}{contacts:10.2}{iterations:12.2}  {}", run.dof, report.0);
    }
    Ok(())
}

struct Run {
    worlds: Vec<World>,
    start: WorldState,
    memory: Option<WorkingMemory>,
    robot: ObjectId,
    dof: usize,
    /// Forces of each step on each degree of freedom.
    forces: Vec<Vec<f64>>,
    /// Shortest time of each step of all worlds, s.
    fastest: Vec<f64>,
}

impl Run {
    fn new(world: World, root: usize, count: usize) -> Run {
        let robots = world.ids().iter().find_map(|id| Some((*id, world.get::<ArticulatedBody>(*id)?)));
        let (robot, body) = robots.expect("a robot");
        let (dof, mass) = (body.model().dof(), body.model().links().iter().map(|link| link.mass.mass).sum::<f64>());
        let mut seed = 1_u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64
        };
        // of a standard deviation of 0.05 of the mass
        let mut force =
            |k: usize| if k < root { 0.0 } else { 0.05 * mass * ((0..12).map(|_| random()).sum::<f64>() - 6.0) };
        let forces = (0..STEPS).map(|_| (0..dof).map(&mut force).collect()).collect();
        let mut start = WorldState::default();
        world.checkpoint(&mut start);
        let worlds = (0..count.max(1)).map(|_| world.fork()).collect();
        let (memory, fastest) = ((count > 0).then(WorkingMemory::default), vec![f64::INFINITY; STEPS * count.max(1)]);
        Run { worlds, start, memory, robot, dof, forces, fastest }
    }

    /// Returns the hash of the states of the first world and the mean numbers of contacts and of iterations of the solver. Every
    /// hundred steps the robot goes back to the start.
    fn turn(&mut self) -> Result<(String, [f64; 2]), Box<dyn std::error::Error>> {
        let (mut counts, mut hasher, mut fastest) = ([0, 0], blake3::Hasher::new(), self.fastest.iter_mut());
        for steps in self.forces.chunks(100) {
            for world in &mut self.worlds {
                world.roll_back(&self.start);
            }
            for forces in steps {
                for world in &mut self.worlds {
                    let begin = Instant::now();
                    if let Some(memory) = &mut self.memory {
                        world.lend_working_memory(memory);
                    }
                    world.apply_generalized(self.robot, forces)?;
                    let report = world.step()?;
                    counts = [counts[0] + report.contacts, counts[1] + report.iterations];
                    if let Some(memory) = &mut self.memory {
                        world.return_working_memory(memory);
                    }
                    let time = begin.elapsed().as_secs_f64();
                    fastest.next().into_iter().for_each(|fastest| *fastest = fastest.min(time));
                }
            }
            for x in self.worlds[0].state() {
                hasher.update(&x.to_le_bytes());
            }
        }
        let taken = (STEPS * self.worlds.len()) as f64;
        Ok((hasher.finalize().to_hex()[..16].to_string(), counts.map(|count| f64::from(count) / taken)))
    }
}
