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
    billiards_time_stepping: "billiards", TimeStepping, "3ca1386bb28e1886", "a386b6fae8c2ca18";
    billiards_backtracking: "billiards", Backtracking, "8bf8a8a281a45c6e", "a4a7a94dc8f6f00b";
    bowling_time_stepping: "bowling", TimeStepping, "831fef8c21f98e6d", "4ccea108f8751a7e";
    bowling_backtracking: "bowling", Backtracking, "1694972672f0e977", "07b57402831fedfa";
    chain_time_stepping: "chain", TimeStepping, "49fdbafba0881a53", "f257620a3e674865";
    chain_backtracking: "chain", Backtracking, "85fd5ed3103d35f0", "f28f2703750f5882";
    falling_time_stepping: "falling", TimeStepping, "b22911ae99dd32f5", "f6e0a54c835c7e7c";
    falling_backtracking: "falling", Backtracking, "bef8512f81633516", "9b4d8f0e1d6dc2ce";
    incline_time_stepping: "incline", TimeStepping, "c8d35ebc2e29a12a", "7b8c108360d8ae2c";
    incline_backtracking: "incline", Backtracking, "e55d9c0fdc513c1e", "a93b5ab540a60671";
    pendulum_time_stepping: "pendulum", TimeStepping, "d403df437fc48e8e", "07a9ea1905d7c967";
    pendulum_backtracking: "pendulum", Backtracking, "69fe4156518a0013", "692b5de118331942";
    piston_time_stepping: "piston", TimeStepping, "c8bdbe2dbb4d6e92", "d28c654b599622b8";
    piston_backtracking: "piston", Backtracking, "e4bc1f04bccfbd8a", "0b86e6820d08239f";
    robot_time_stepping: "robot", TimeStepping, "bc43b6f0651f6c15", "8b4bb457452fe429";
    robot_backtracking: "robot", Backtracking, "d74075084d60492f", "01e064e5abc85f17";
    skeleton_time_stepping: "skeleton", TimeStepping, "ee202d377892c7b8", "5e22c6193fcbd3ef";
    skeleton_backtracking: "skeleton", Backtracking, "bdf4cdbeda75f036", "895179911225c2cb";
    stack_time_stepping: "stack", TimeStepping, "faa858303ba3c2af", "accd4da77adb66fe";
    stack_backtracking: "stack", Backtracking, "ac1fb8bad736bd44", "c91438f922aca6c6";
}
