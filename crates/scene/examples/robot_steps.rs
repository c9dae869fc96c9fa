//! Steps a robot with random torques, as `benches/python/robots.py` does, and prints the time of a step; for profilers.
//!
//! ```text
//! robot_steps FILE [STEPS [ROUNDS]]     FILE is a scene or a model of MuJoCo
//! ```

use std::time::Instant;
use tumble_core::{ArticulatedBody, Joint, ObjectId};
use tumble_scene::{SceneFile, mjcf};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut words = std::env::args().skip(1);
    let path = words.next().ok_or("usage: robot_steps FILE [STEPS [ROUNDS]]")?;
    let steps: u32 = words.next().map_or(Ok(100), |word| word.parse())?;
    let rounds: u32 = words.next().map_or(Ok(1), |word| word.parse())?;
    let file = match path.ends_with(".xml") {
        true => mjcf::load(&path, &mjcf::MjcfOptions::default())?,
        false => SceneFile::load(&path)?,
    };
    let (mut world, _) = file.build()?;
    let view = world.view();
    let is_robot = |id: &&ObjectId| view.get::<ArticulatedBody>(**id).is_some();
    let robot = *view.ids().iter().find(is_robot).ok_or("no articulated body")?;
    let model = view.get::<ArticulatedBody>(robot).ok_or("no articulated body")?.model();
    let (dof, mass) = (model.dof(), model.links().iter().map(|link| link.mass.mass).sum::<f64>());
    let root = if matches!(model.links()[0].joint, Joint::Floating) { 6 } else { 0 };
    let mut start = tumble_core::WorldState::default();
    world.checkpoint(&mut start);
    let mut times = Vec::new();
    let quiet = std::env::var("QUIET").is_ok();
    for _ in 0..rounds {
        world.roll_back(&start);
        let mut random = 1_u64;
        let begun = Instant::now();
        for _ in 0..steps {
            let forces: Vec<f64> = (0..dof)
                .map(|k| {
                    let sum: f64 = (0..12)
                        .map(|_| {
                            random = random.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                            (random >> 11) as f64 / (1_u64 << 53) as f64
                        })
                        .sum();
                    if k < root || quiet { 0.0 } else { 0.05 * mass * (sum - 6.0) }
                })
                .collect();
            world.apply_generalized(robot, &forces)?;
            world.step()?;
        }
        times.push(begun.elapsed().as_secs_f64() / f64::from(steps) * 1e6);
    }
    times.sort_by(f64::total_cmp);
    let bytes: u64 =
        world.state().iter().fold(0, |h: u64, x| h.rotate_left(7) ^ x.to_bits().wrapping_mul(0x9E37_79B9_7F4A_7C15));
    println!(
        "{path}: {dof} dof, {:.2} us per step (least {:.2}), state {bytes:016x}, {} contacts, {:?}",
        times[times.len() / 2],
        times[0],
        world.contacts().len(),
        world.report()
    );
    Ok(())
}
