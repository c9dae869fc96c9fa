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
    billiards_time_stepping: "billiards", TimeStepping, "33c170c167dc1596", "68443c48afff146a";
    billiards_backtracking: "billiards", Backtracking, "4fc9ffdc997b30de", "18ac71f99f03a8c1";
    bowling_time_stepping: "bowling", TimeStepping, "ed36688f395747c2", "c5c7dc3bb443bc78";
    bowling_backtracking: "bowling", Backtracking, "53db2850eca4d504", "bedfe9242da3cf67";
    chain_time_stepping: "chain", TimeStepping, "269e2944ada62119", "f61bdc87b0d6177a";
    chain_backtracking: "chain", Backtracking, "dd07677ce4aa11c1", "6b8d1b78dea2c669";
    falling_time_stepping: "falling", TimeStepping, "55a2efd3019cb810", "7a1963c792f4dfdb";
    falling_backtracking: "falling", Backtracking, "de16ab88f496d86d", "9d4b8e1ceee06e06";
    incline_time_stepping: "incline", TimeStepping, "c8d35ebc2e29a12a", "7b8c108360d8ae2c";
    incline_backtracking: "incline", Backtracking, "e55d9c0fdc513c1e", "a93b5ab540a60671";
    pendulum_time_stepping: "pendulum", TimeStepping, "d403df437fc48e8e", "07a9ea1905d7c967";
    pendulum_backtracking: "pendulum", Backtracking, "69fe4156518a0013", "692b5de118331942";
    piston_time_stepping: "piston", TimeStepping, "e970a95bc604c769", "69f85217f1250e61";
    piston_backtracking: "piston", Backtracking, "eec51fdb3e6e2809", "0b86e6820d08239f";
    robot_time_stepping: "robot", TimeStepping, "d12ab164c366e431", "11bf070e1ec3ca35";
    robot_backtracking: "robot", Backtracking, "889eeadcdf2d375a", "9f75d04f6450b9fc";
    skeleton_time_stepping: "skeleton", TimeStepping, "27999ed81927a3e1", "55ee0abd73f04eef";
    skeleton_backtracking: "skeleton", Backtracking, "e437ef505593c8ae", "4762dfaff6cb956c";
    stack_time_stepping: "stack", TimeStepping, "20ad0965d34e48bf", "ecd253fcdb6efb2e";
    stack_backtracking: "stack", Backtracking, "f3e4e18dc66cf3d0", "e2c70bafe5205c09";
}
