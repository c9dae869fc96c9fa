//! Hashes of the state of every shipped scene at two times, mostly 1 s and 10 s, with both steppers. A refactoring
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

fn check(scene: &str, stepper: Stepper, seconds: [f64; 2], expected: [&str; 2]) {
    let found = hashes(scene, stepper, &seconds);
    if std::env::var_os("TUMBLE_PRINT_HASHES").is_some() {
        println!("HASHES {scene} {stepper}: {found:?}");
        return;
    }
    assert_eq!(found, expected, "the state of {scene} after {seconds:?} s with {stepper}");
}

macro_rules! table {
    ($seconds:expr; $($test:ident: $scene:literal, $stepper:ident, $first:literal, $second:literal;)*) => {
        $(#[test]
        fn $test() {
            check($scene, Stepper::$stepper, $seconds, [$first, $second]);
        })*
    };
}

table! {
    [1.0, 10.0];
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
    piston_time_stepping: "piston", TimeStepping, "03971f4c855a8149", "498658197dce906c";
    piston_backtracking: "piston", Backtracking, "49b38596ba941018", "3623d35cde9a52a8";
    robot_time_stepping: "robot", TimeStepping, "6b21cb8a1f188192", "8bea891d086ec9c1";
    robot_backtracking: "robot", Backtracking, "34a6c003f76116a6", "1b8364d88cd17538";
    skeleton_time_stepping: "skeleton", TimeStepping, "fd7ab16715dfff87", "2b63db53102edef9";
    skeleton_backtracking: "skeleton", Backtracking, "fd6d29b9de01f60c", "2dda572634ab3e36";
    stack_time_stepping: "stack", TimeStepping, "20ad0965d34e48bf", "ecd253fcdb6efb2e";
    stack_backtracking: "stack", Backtracking, "8bf0d645b39a693b", "3d204eae8525be65";
}

// Structures and machines whose steps cost more, or that are known after less.
table! {
    [0.5, 2.0];
    card_house_time_stepping: "card_house", TimeStepping, "29b46a855d5f640b", "465b1df79b20786e";
    card_house_backtracking: "card_house", Backtracking, "628b1001c97d96e8", "ffb108b34f7b1912";
    marble_run_time_stepping: "marble_run", TimeStepping, "a72b1fd3a5363896", "7de43f3b42f90427";
    marble_run_backtracking: "marble_run", Backtracking, "67834b3a7fb5547d", "59907c8a56f4eda7";
    newtons_cradle_time_stepping: "newtons_cradle", TimeStepping, "241aa3d8432a474e", "a8caedb1d85dab02";
    newtons_cradle_backtracking: "newtons_cradle", Backtracking, "878a964993b52e1f", "0579d119408e16b9";
    steam_engine_time_stepping: "steam_engine", TimeStepping, "3a2ab60873834ca6", "4a72b3cc1d1779dd";
    steam_engine_backtracking: "steam_engine", Backtracking, "466f4da8adf2589f", "f65c1d0393337846";
    arch_time_stepping: "arch", TimeStepping, "b1067ee5cac37610", "7162c57df380fe8b";
    walker_time_stepping: "walker", TimeStepping, "1354183924844efe", "becbf6edc5e078a5";
    wrecking_ball_time_stepping: "wrecking_ball", TimeStepping, "c7b940edc3ea2b9a", "a97663656893ebca";
    dominoes_time_stepping: "dominoes", TimeStepping, "2b5433839ac3b3d2", "97388a630470b482";
}

table! {
    [0.1, 0.3];
    arch_backtracking: "arch", Backtracking, "52e11fa57b32a879", "15c2a2986571f20d";
    dominoes_backtracking: "dominoes", Backtracking, "9c7b110aee952a4c", "4c3f82114ea67b3e";
    walker_backtracking: "walker", Backtracking, "ca535adb9b9b96d3", "093bfa105a94cd32";
    wrecking_ball_backtracking: "wrecking_ball", Backtracking, "6c2945a4c1ce9c8e", "3d6cb77528bdd2e7";
}
