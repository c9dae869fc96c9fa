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
    billiards_time_stepping: "billiards", TimeStepping, "31018d04b3052457", "99394a3d919f7c04";
    billiards_backtracking: "billiards", Backtracking, "b5a27eda6855859e", "bf300238bd656f9e";
    bowling_time_stepping: "bowling", TimeStepping, "f6721937cb4d54f4", "d314bc084d8f191f";
    bowling_backtracking: "bowling", Backtracking, "e677eac272ba7de7", "639dcb1ba70e5e70";
    chain_time_stepping: "chain", TimeStepping, "da183284df94ce40", "7c050bf315c18be7";
    chain_backtracking: "chain", Backtracking, "1605050ff516ff97", "84bb4478ecfdda29";
    falling_time_stepping: "falling", TimeStepping, "11be3b5e263e3343", "5de6da994ffffcee";
    falling_backtracking: "falling", Backtracking, "c681059d5c6a16b9", "7987e4897adeb92d";
    incline_time_stepping: "incline", TimeStepping, "e279621724363969", "85a12d59b2107f19";
    incline_backtracking: "incline", Backtracking, "dba991e4803cfe34", "95407557393acae5";
    pendulum_time_stepping: "pendulum", TimeStepping, "d403df437fc48e8e", "07a9ea1905d7c967";
    pendulum_backtracking: "pendulum", Backtracking, "69fe4156518a0013", "692b5de118331942";
    piston_time_stepping: "piston", TimeStepping, "e970a95bc604c769", "69f85217f1250e61";
    piston_backtracking: "piston", Backtracking, "eec51fdb3e6e2809", "0b86e6820d08239f";
    robot_time_stepping: "robot", TimeStepping, "d12ab164c366e431", "1ba51d3713f4089e";
    robot_backtracking: "robot", Backtracking, "e468ef66569eaf16", "0df5728780acbe50";
    skeleton_time_stepping: "skeleton", TimeStepping, "f0ff31d36e418576", "98b6b85d09cd0b1b";
    skeleton_backtracking: "skeleton", Backtracking, "41dc63582d89a300", "384f159aeb1cdee9";
    stack_time_stepping: "stack", TimeStepping, "20ad0965d34e48bf", "ecd253fcdb6efb2e";
    stack_backtracking: "stack", Backtracking, "8bf0d645b39a693b", "3d204eae8525be65";
}
