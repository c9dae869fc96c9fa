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
    billiards_time_stepping: "billiards", TimeStepping, "902d9b2039798813", "04e97dda57f29f5b";
    billiards_backtracking: "billiards", Backtracking, "5c3d2c760e7c52da", "c2964b8dad76bdf4";
    bowling_time_stepping: "bowling", TimeStepping, "53e604fc6854b0f2", "fdbc7b7a997170a2";
    bowling_backtracking: "bowling", Backtracking, "8efe465a30ebc13b", "42a00e4870244b44";
    chain_time_stepping: "chain", TimeStepping, "51a78b5bdac7bf65", "9a9233a467758672";
    chain_backtracking: "chain", Backtracking, "37b8cf357ed51095", "23bbf9cb7921e71d";
    falling_time_stepping: "falling", TimeStepping, "e4671c0ee21ed722", "cef07154cf638c3f";
    flock_time_stepping: "flock", TimeStepping, "e41e23ddcc483acc", "1855f9c020bc971a";
    flock_backtracking: "flock", Backtracking, "af789340dc0ef11e", "6faef2e76a3efc30";
    falling_backtracking: "falling", Backtracking, "d1513aca63296e42", "97eedc6cc174ae0c";
    incline_time_stepping: "incline", TimeStepping, "c7fceb815b144da9", "26dd7785db759c25";
    incline_backtracking: "incline", Backtracking, "dba991e4803cfe34", "95407557393acae5";
    pendulum_time_stepping: "pendulum", TimeStepping, "a6f0f0b542061dc2", "63acd1d2fe930652";
    pendulum_backtracking: "pendulum", Backtracking, "69fe4156518a0013", "692b5de118331942";
    piston_time_stepping: "piston", TimeStepping, "03971f4c855a8149", "498658197dce906c";
    piston_backtracking: "piston", Backtracking, "49b38596ba941018", "3623d35cde9a52a8";
    robot_time_stepping: "robot", TimeStepping, "617584311da206c8", "e3daef76eb545345";
    robot_backtracking: "robot", Backtracking, "1af0172412c09af6", "347f7c177c9b2e4f";
    skeleton_time_stepping: "skeleton", TimeStepping, "6f7c6a0daa3c23f3", "cead67e6baa4a820";
    skeleton_backtracking: "skeleton", Backtracking, "c7a9b3de921103d6", "015df888682c8fa8";
    stack_time_stepping: "stack", TimeStepping, "c9eeea26137d2a5f", "99d9eaf45acdf7b8";
    stack_backtracking: "stack", Backtracking, "8bf0d645b39a693b", "3d204eae8525be65";
}

// Structures and machines whose steps cost more, or that are known after less.
table! {
    [0.5, 2.0];
    ball_machine_time_stepping: "ball_machine", TimeStepping, "5ecf66676422b39a", "cc169b8f7f9a0d18";
    ball_machine_backtracking: "ball_machine", Backtracking, "36e0fde2a34f7dfa", "50a39ed5ff84a6aa";
    bird_time_stepping: "bird", TimeStepping, "10d4a92a5cc33df9", "4e6c5af8d4117d23";
    bird_backtracking: "bird", Backtracking, "b5e07c8878b5ccea", "7681d45b1374835e";
    card_house_time_stepping: "card_house", TimeStepping, "091b9380060ee20c", "8003317c097996db";
    sparks_time_stepping: "sparks", TimeStepping, "4d51d6429d4ba2cf", "63c5aa8f37bac88c";
    sparks_backtracking: "sparks", Backtracking, "dfa02104906b2991", "847a159107ba4a95";
    card_house_backtracking: "card_house", Backtracking, "628b1001c97d96e8", "ffb108b34f7b1912";
    marble_run_time_stepping: "marble_run", TimeStepping, "a6aa80e60f400a7a", "80f2216852c0c445";
    marble_run_backtracking: "marble_run", Backtracking, "d233e2869b9ec085", "85be23266f25baed";
    newtons_cradle_time_stepping: "newtons_cradle", TimeStepping, "241aa3d8432a474e", "8a992d40dc67236d";
    newtons_cradle_backtracking: "newtons_cradle", Backtracking, "1a0128aa197a01fb", "ecc9f19bdcb9f483";
    steam_engine_time_stepping: "steam_engine", TimeStepping, "0d1a9f294d535f1d", "4a72b3cc1d1779dd";
    steam_engine_backtracking: "steam_engine", Backtracking, "466f4da8adf2589f", "f65c1d0393337846";
    arch_time_stepping: "arch", TimeStepping, "e7090b6cbe5ad156", "4c2e00f4dc0a531c";
    walker_time_stepping: "walker", TimeStepping, "4f3cf3f418140f88", "22300531661b6dd7";
    wrecking_ball_time_stepping: "wrecking_ball", TimeStepping, "a088038d428e36c3", "382e062bb5aef3af";
    dominoes_time_stepping: "dominoes", TimeStepping, "fe44a6680e801f5a", "c798dcaf8ca85ed0";
}

table! {
    [0.1, 0.3];
    cloth_time_stepping: "cloth", TimeStepping, "6b8af320d69ac658", "1c8b3c94c431c444";
    cloth_backtracking: "cloth", Backtracking, "645053291a4cb2e0", "e8bc49562045d081";
    jelly_time_stepping: "jelly", TimeStepping, "9a60cdddb1e6cb89", "5782a120f1e26d9b";
    arch_backtracking: "arch", Backtracking, "52e11fa57b32a879", "43819e958609f0f5";
    dominoes_backtracking: "dominoes", Backtracking, "94511c9695cd65a8", "8ea2dcd0224d1f61";
    walker_backtracking: "walker", Backtracking, "ca535adb9b9b96d3", "093bfa105a94cd32";
    wrecking_ball_backtracking: "wrecking_ball", Backtracking, "edd1de7daad227d6", "dec185d53d1e009f";
}
