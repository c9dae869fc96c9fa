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
    billiards_time_stepping: "billiards", TimeStepping, "acec9cb7318c19f1", "85acd8b4d4045bee";
    billiards_backtracking: "billiards", Backtracking, "028b3fc6133e3084", "4948e3c8f0eb518d";
    bowling_time_stepping: "bowling", TimeStepping, "53e604fc6854b0f2", "311de4a4d588b58b";
    bowling_backtracking: "bowling", Backtracking, "8efe465a30ebc13b", "fadbe58c3fd1d0c3";
    chain_time_stepping: "chain", TimeStepping, "d6f52c8eced3f294", "354d41d199dc5867";
    chain_backtracking: "chain", Backtracking, "e95b2c5fd7a05d9c", "209fc1911104a1b4";
    falling_time_stepping: "falling", TimeStepping, "845f1f0a48541cdb", "2b235b255416c75e";
    flock_time_stepping: "flock", TimeStepping, "e41e23ddcc483acc", "1855f9c020bc971a";
    flock_backtracking: "flock", Backtracking, "af789340dc0ef11e", "6faef2e76a3efc30";
    falling_backtracking: "falling", Backtracking, "9d661d033f1dd373", "5c45e8dafb36fc7c";
    incline_time_stepping: "incline", TimeStepping, "c7fceb815b144da9", "26dd7785db759c25";
    incline_backtracking: "incline", Backtracking, "f953d1e35a61b08a", "188ead72ee20f94b";
    pendulum_time_stepping: "pendulum", TimeStepping, "5d5a0c61633ceb71", "1f3184745a57812c";
    pendulum_backtracking: "pendulum", Backtracking, "69fe4156518a0013", "692b5de118331942";
    piston_time_stepping: "piston", TimeStepping, "b0c7d2b7ad732e80", "a0b3838111d7e4b1";
    piston_backtracking: "piston", Backtracking, "490cefd12db353ab", "7e34bcef17dc8c52";
    robot_time_stepping: "robot", TimeStepping, "a5c5395feda47469", "195aa5f921a7b2d5";
    robot_backtracking: "robot", Backtracking, "5d43b13f9771b917", "c622c65d53ec29f0";
    skeleton_time_stepping: "skeleton", TimeStepping, "87272ecc5d41db6a", "11f18378af840c16";
    skeleton_backtracking: "skeleton", Backtracking, "3972aeec7ed4684a", "0503afb338b9a6b0";
    stack_time_stepping: "stack", TimeStepping, "c9eeea26137d2a5f", "99d9eaf45acdf7b8";
    stack_backtracking: "stack", Backtracking, "8bf0d645b39a693b", "3d204eae8525be65";
}

// Structures and machines whose steps cost more, or that are known after less.
table! {
    [0.5, 2.0];
    ball_machine_time_stepping: "ball_machine", TimeStepping, "5ecf66676422b39a", "6ca07cc8c4dab840";
    ball_machine_backtracking: "ball_machine", Backtracking, "36e0fde2a34f7dfa", "8bba253f4e158314";
    bird_time_stepping: "bird", TimeStepping, "3d85f0ea42bb77db", "878264a194147426";
    bird_backtracking: "bird", Backtracking, "1ce1e6f8cf5eb25d", "dcde02ee42013d37";
    card_house_time_stepping: "card_house", TimeStepping, "091b9380060ee20c", "8003317c097996db";
    sparks_time_stepping: "sparks", TimeStepping, "b8077dc41b083964", "400afd684ba4d9c5";
    sparks_backtracking: "sparks", Backtracking, "e856d118294a5e88", "879fe126adcb8b24";
    campfire_time_stepping: "campfire", TimeStepping, "b2b53ea54d16087f", "07e5ef35c0df9446";
    campfire_backtracking: "campfire", Backtracking, "b2b53ea54d16087f", "07e5ef35c0df9446";
    card_house_backtracking: "card_house", Backtracking, "628b1001c97d96e8", "ffb108b34f7b1912";
    marble_run_time_stepping: "marble_run", TimeStepping, "d52361e606637d3b", "1bf68256a3ee7988";
    marble_run_backtracking: "marble_run", Backtracking, "d233e2869b9ec085", "65dc5e3b02c312fa";
    newtons_cradle_time_stepping: "newtons_cradle", TimeStepping, "612299c73004bdf4", "087f72ba625bf535";
    newtons_cradle_backtracking: "newtons_cradle", Backtracking, "1a0128aa197a01fb", "ecc9f19bdcb9f483";
    steam_engine_time_stepping: "steam_engine", TimeStepping, "a6c0231afb80a4ab", "d3520c2611ed1cae";
    steam_engine_backtracking: "steam_engine", Backtracking, "95124e328b286cfa", "1265d2cc6d6c5851";
    arch_time_stepping: "arch", TimeStepping, "7defd295d446fda8", "368220ae959f1b1e";
    walker_time_stepping: "walker", TimeStepping, "8777a6192c315bf3", "78419b7aa839cab6";
    wrecking_ball_time_stepping: "wrecking_ball", TimeStepping, "a3370f391f84a50c", "c58355862589602b";
    mechanism_time_stepping: "mechanism", TimeStepping, "567e83b223ef83c7", "c0fcdb31517b4661";
    dominoes_time_stepping: "dominoes", TimeStepping, "fa5dc5dc7e45ffba", "123cebc4c427a566";
}

table! {
    [0.1, 0.3];
    cloth_time_stepping: "cloth", TimeStepping, "193dfd785230acaf", "b77a063e154a12ca";
    cloth_backtracking: "cloth", Backtracking, "193dfd785230acaf", "b77a063e154a12ca";
    jelly_time_stepping: "jelly", TimeStepping, "58432d5e1831dfb4", "6d8fb706aa558611";
    arch_backtracking: "arch", Backtracking, "19376406abf1fe22", "ca6590afa76c49b0";
    dominoes_backtracking: "dominoes", Backtracking, "4aff9d4f589e8417", "7b6644db6277f1cf";
    walker_backtracking: "walker", Backtracking, "55963c311462ad4e", "88379ffebfbc3908";
    mechanism_backtracking: "mechanism", Backtracking, "4fab6d90e389a76f", "5b7159a9936cb74d";
    wrecking_ball_backtracking: "wrecking_ball", Backtracking, "be3e16a61a93cd6a", "9121e031bf023833";
}
