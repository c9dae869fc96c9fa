//! Hashes of the state of every shipped scene after 1 s and 10 s, with both steppers. A refactoring
//! keeps this table. A change of the dynamics replaces the rows that it changes, and `CHANGELOG.md`
//! states the reason.
//!
//! `TUMBLE_PRINT_HASHES=1 cargo test --release --workspace --test it state_hashes -- --nocapture`
//! prints the table.

use tumble_scene::{Stepper, shipped};

/// Returns the first 16 hexadecimal digits of BLAKE3 over the bytes of the flat state `X`
/// (little-endian f64), after each of `seconds`.
fn hashes(scene: &str, stepper: Stepper, seconds: &[f64]) -> Vec<String> {
    let shipped = shipped().iter().find(|s| s.name == scene).expect("the scene is shipped");
    let mut file = shipped.read().unwrap_or_else(|error| panic!("{}", error.report(false)));
    file.world.stepper = stepper;
    let (mut world, _) = file.build().unwrap();
    let state = |world: &tumble_core::World| {
        let bytes: Vec<u8> = world.state().iter().flat_map(|x| x.to_le_bytes()).collect();
        blake3::hash(&bytes).to_hex()[..16].to_string()
    };
    let mut found = Vec::new();
    for &end in seconds {
        while world.time() < end - 1e-9 {
            world.step().unwrap();
        }
        found.push(state(&world));
    }
    found
}

fn check(scene: &str, stepper: Stepper, expected: [&str; 2]) {
    if std::env::var_os("TUMBLE_PRINT_HASHES").is_some() {
        println!("HASHES {scene} {stepper}: {:?}", hashes(scene, stepper, &[1.0, 10.0]));
        return;
    }
    assert_eq!(
        hashes(scene, stepper, &[1.0, 10.0]),
        expected,
        "the state of {scene} after 1 s and 10 s with {stepper}"
    );
}

macro_rules! table {
    ($($test:ident: $scene:literal, $stepper:ident, $after_1_s:literal, $after_10_s:literal;)*) => {
        $(#[test]
        fn $test() {
            check($scene, Stepper::$stepper, [$after_1_s, $after_10_s]);
        })*
    };
}

table! {
    billiards_time_stepping: "billiards", TimeStepping, "d7521db61a4044f1", "dde13f97df02c7af";
    billiards_backtracking: "billiards", Backtracking, "dde525a4d714d38e", "453edf585fcd7eb4";
    bowling_time_stepping: "bowling", TimeStepping, "ed36688f395747c2", "4ea80a7f29117a6d";
    bowling_backtracking: "bowling", Backtracking, "53db2850eca4d504", "3968829bfd6d9f63";
    chain_time_stepping: "chain", TimeStepping, "a9d265bcd59cde4d", "c77dcc987d556a82";
    chain_backtracking: "chain", Backtracking, "cf938a3028a77cdf", "aec0064e0240df39";
    falling_time_stepping: "falling", TimeStepping, "d30b150920d659ba", "77731db98e3ce6e3";
    falling_backtracking: "falling", Backtracking, "f5e89fe4764d71d9", "3101f005da0aeac5";
    incline_time_stepping: "incline", TimeStepping, "c8d35ebc2e29a12a", "7b8c108360d8ae2c";
    incline_backtracking: "incline", Backtracking, "e55d9c0fdc513c1e", "a93b5ab540a60671";
    pendulum_time_stepping: "pendulum", TimeStepping, "d403df437fc48e8e", "07a9ea1905d7c967";
    pendulum_backtracking: "pendulum", Backtracking, "69fe4156518a0013", "692b5de118331942";
    piston_time_stepping: "piston", TimeStepping, "c8bdbe2dbb4d6e92", "d28c654b599622b8";
    piston_backtracking: "piston", Backtracking, "e4bc1f04bccfbd8a", "0b86e6820d08239f";
    robot_time_stepping: "robot", TimeStepping, "d2ff6677a2f25e68", "d7993967865d7389";
    robot_backtracking: "robot", Backtracking, "d9bdae46cf681082", "e3f2d884e335d1a2";
    skeleton_time_stepping: "skeleton", TimeStepping, "4601701823a7deff", "00287ccc74d46029";
    skeleton_backtracking: "skeleton", Backtracking, "438f18ce0bbb9bdd", "2ac456022b491e61";
    stack_time_stepping: "stack", TimeStepping, "20ad0965d34e48bf", "ecd253fcdb6efb2e";
    stack_backtracking: "stack", Backtracking, "f3e4e18dc66cf3d0", "e2c70bafe5205c09";
}
