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
    billiards_time_stepping: "billiards", TimeStepping, "36b9d75c4ae9875c", "0297c6beb51197ed";
    billiards_backtracking: "billiards", Backtracking, "b5a27eda6855859e", "bf300238bd656f9e";
    bowling_time_stepping: "bowling", TimeStepping, "94968c1b4058a725", "3929761e92ed79fc";
    bowling_backtracking: "bowling", Backtracking, "e677eac272ba7de7", "e18c2e4b1775af2c";
    chain_time_stepping: "chain", TimeStepping, "22fbcd4bcbb18743", "7e68bdb4b444ccf6";
    chain_backtracking: "chain", Backtracking, "63d0cbaca36ef0a9", "3198250057940e22";
    falling_time_stepping: "falling", TimeStepping, "975e49a4706a1c69", "e6ab76fd3ebd1444";
    flock_time_stepping: "flock", TimeStepping, "89758af10faedc50", "3a693791277610b4";
    flock_backtracking: "flock", Backtracking, "d183d81677f6cfab", "3cc3efa393ca88df";
    falling_backtracking: "falling", Backtracking, "b064bee7ee0b458a", "d126928e23c90248";
    incline_time_stepping: "incline", TimeStepping, "c7fceb815b144da9", "26dd7785db759c25";
    incline_backtracking: "incline", Backtracking, "dba991e4803cfe34", "95407557393acae5";
    pendulum_time_stepping: "pendulum", TimeStepping, "a6f0f0b542061dc2", "63acd1d2fe930652";
    pendulum_backtracking: "pendulum", Backtracking, "69fe4156518a0013", "692b5de118331942";
    piston_time_stepping: "piston", TimeStepping, "03971f4c855a8149", "498658197dce906c";
    piston_backtracking: "piston", Backtracking, "49b38596ba941018", "3623d35cde9a52a8";
    robot_time_stepping: "robot", TimeStepping, "68db682e31ad9267", "9a0673bfe03781ee";
    robot_backtracking: "robot", Backtracking, "34a6c003f76116a6", "608ca54c62cd056b";
    skeleton_time_stepping: "skeleton", TimeStepping, "e4b2d7099e2ce12c", "c33ec71934ce9b14";
    skeleton_backtracking: "skeleton", Backtracking, "fd6d29b9de01f60c", "a128ff5c335e2548";
    stack_time_stepping: "stack", TimeStepping, "c9eeea26137d2a5f", "99d9eaf45acdf7b8";
    stack_backtracking: "stack", Backtracking, "8bf0d645b39a693b", "3d204eae8525be65";
}

// Structures and machines whose steps cost more, or that are known after less.
table! {
    [0.5, 2.0];
    ball_machine_time_stepping: "ball_machine", TimeStepping, "5ecf66676422b39a", "405845acd18db798";
    ball_machine_backtracking: "ball_machine", Backtracking, "36e0fde2a34f7dfa", "602f95bd076b0fe7";
    bird_time_stepping: "bird", TimeStepping, "edfbc51d27e3b795", "fec93c56055a3e4d";
    bird_backtracking: "bird", Backtracking, "fb21b06f6d3e5830", "5ee9b90abac4068b";
    card_house_time_stepping: "card_house", TimeStepping, "091b9380060ee20c", "8003317c097996db";
    sparks_time_stepping: "sparks", TimeStepping, "515a77d2df6b5217", "9badcde17809dddb";
    sparks_backtracking: "sparks", Backtracking, "805c8cba100469d4", "6052e84af86ee0f9";
    card_house_backtracking: "card_house", Backtracking, "628b1001c97d96e8", "ffb108b34f7b1912";
    marble_run_time_stepping: "marble_run", TimeStepping, "54c3e3322b6781af", "5406447c388d03c0";
    marble_run_backtracking: "marble_run", Backtracking, "67834b3a7fb5547d", "ff57ee16e3696b0a";
    newtons_cradle_time_stepping: "newtons_cradle", TimeStepping, "241aa3d8432a474e", "c34c93b030ba61fc";
    newtons_cradle_backtracking: "newtons_cradle", Backtracking, "878a964993b52e1f", "0579d119408e16b9";
    steam_engine_time_stepping: "steam_engine", TimeStepping, "3a2ab60873834ca6", "4a72b3cc1d1779dd";
    steam_engine_backtracking: "steam_engine", Backtracking, "466f4da8adf2589f", "f65c1d0393337846";
    arch_time_stepping: "arch", TimeStepping, "e7090b6cbe5ad156", "4c2e00f4dc0a531c";
    walker_time_stepping: "walker", TimeStepping, "4f3cf3f418140f88", "5a0751b9b50b1fd7";
    wrecking_ball_time_stepping: "wrecking_ball", TimeStepping, "b8885a64a8d5fa18", "ef3c637cbb294c26";
    dominoes_time_stepping: "dominoes", TimeStepping, "e494f088d2363d0e", "631db3c70aca49e4";
}

table! {
    [0.1, 0.3];
    cloth_time_stepping: "cloth", TimeStepping, "6b8af320d69ac658", "1c8b3c94c431c444";
    cloth_backtracking: "cloth", Backtracking, "645053291a4cb2e0", "e8bc49562045d081";
    jelly_time_stepping: "jelly", TimeStepping, "9a60cdddb1e6cb89", "5782a120f1e26d9b";
    arch_backtracking: "arch", Backtracking, "52e11fa57b32a879", "43819e958609f0f5";
    dominoes_backtracking: "dominoes", Backtracking, "9c7b110aee952a4c", "09a9c0d733328405";
    walker_backtracking: "walker", Backtracking, "ca535adb9b9b96d3", "093bfa105a94cd32";
    wrecking_ball_backtracking: "wrecking_ball", Backtracking, "6c2945a4c1ce9c8e", "3d6cb77528bdd2e7";
}
