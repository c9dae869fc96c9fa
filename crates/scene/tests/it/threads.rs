//! Shipped scenes have the same bits on any number of threads, with both steppers.

use tumble_scene::{Stepper, shipped};

/// Returns the bits of the state after every tenth frame of 2 s.
fn record(scene: &str, stepper: Stepper, threads: u32) -> Vec<Vec<u64>> {
    let shipped = shipped().iter().find(|s| s.name == scene).expect("the scene is shipped");
    let mut file = shipped.read().unwrap_or_else(|error| panic!("{}", error.report(false)));
    (file.world.stepper, file.world.threads) = (stepper, threads);
    let (mut world, _) = file.build().unwrap();
    let mut record = Vec::new();
    while world.time() < 2.0 - 1e-9 {
        world.step().unwrap();
        if world.frame().is_multiple_of(10) {
            record.push(world.state().iter().map(|x| x.to_bits()).collect());
        }
    }
    record
}

fn compare(scene: &str) {
    for stepper in [Stepper::TimeStepping, Stepper::Backtracking] {
        let alone = record(scene, stepper, 1);
        for threads in [2, 3, 8] {
            let many = record(scene, stepper, threads);
            let first = alone.iter().zip(&many).position(|(a, b)| a != b);
            assert_eq!(first, None, "{scene}, {stepper} on {threads} threads: first tenth frame that differs");
        }
    }
}

#[test]
fn falling() {
    compare("falling");
}

#[test]
fn bowling() {
    compare("bowling");
}

#[test]
fn skeleton() {
    compare("skeleton");
}
