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
    billiards_time_stepping: "billiards", TimeStepping, "41c9d6a80a4215d2", "a62d36da0e7f5ce2";
    billiards_backtracking: "billiards", Backtracking, "b5a27eda6855859e", "bf300238bd656f9e";
    bowling_time_stepping: "bowling", TimeStepping, "f6721937cb4d54f4", "8c68902f614f0847";
    bowling_backtracking: "bowling", Backtracking, "e677eac272ba7de7", "098bcebdb2ce128e";
    chain_time_stepping: "chain", TimeStepping, "22fbcd4bcbb18743", "531efe443cc14759";
    chain_backtracking: "chain", Backtracking, "63d0cbaca36ef0a9", "3198250057940e22";
    falling_time_stepping: "falling", TimeStepping, "b502e3d757eeef41", "8787b18645b7223e";
    falling_backtracking: "falling", Backtracking, "cbb914d607445f21", "253502563aa8576c";
    incline_time_stepping: "incline", TimeStepping, "e279621724363969", "85a12d59b2107f19";
    incline_backtracking: "incline", Backtracking, "dba991e4803cfe34", "95407557393acae5";
    pendulum_time_stepping: "pendulum", TimeStepping, "a6f0f0b542061dc2", "63acd1d2fe930652";
    pendulum_backtracking: "pendulum", Backtracking, "69fe4156518a0013", "692b5de118331942";
    piston_time_stepping: "piston", TimeStepping, "ae876d8e7e8e345e", "bc01df0546e1951d";
    piston_backtracking: "piston", Backtracking, "cebbc368133e0eb4", "ac9f392a7dadcd1e";
    robot_time_stepping: "robot", TimeStepping, "6b21cb8a1f188192", "8bea891d086ec9c1";
    robot_backtracking: "robot", Backtracking, "34a6c003f76116a6", "1b8364d88cd17538";
    skeleton_time_stepping: "skeleton", TimeStepping, "fd7ab16715dfff87", "2b63db53102edef9";
    skeleton_backtracking: "skeleton", Backtracking, "fd6d29b9de01f60c", "2dda572634ab3e36";
    stack_time_stepping: "stack", TimeStepping, "20ad0965d34e48bf", "ecd253fcdb6efb2e";
    stack_backtracking: "stack", Backtracking, "8bf0d645b39a693b", "3d204eae8525be65";
}
