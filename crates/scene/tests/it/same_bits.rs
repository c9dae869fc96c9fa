//! The hashes that builds for all targets have (docs/same_bits.md): `tests/same_bits.txt` is the output of the program `state_hashes` for 0.02 s and one thread.
//! Here some scenes are computed anew, and a program for WebAssembly in Node where both are there; `scripts/same_bits.sh 0.02` computes all of them for all targets.

#[path = "../../examples/state_hashes.rs"]
#[allow(dead_code)]
mod program;

use std::io::Write;
use std::path::Path;
use std::process::Command;

const TABLE: &str = include_str!("../same_bits.txt");
/// Simulated time of the table, s.
const SECONDS: f64 = 0.02;
/// Scenes that are built and stepped in a moment.
const QUICK: [&str; 9] =
    ["stack", "incline", "pendulum", "newtons_cradle", "robot", "skeleton", "bird", "sparks", "walker"];

#[test]
fn the_table_has_all_shipped_scenes() {
    for scene in tumble_scene::shipped() {
        for (stepper, solver) in program::METHODS {
            let start = format!("{} {stepper} {solver} 1 ", scene.name);
            let hashes: Vec<&str> = TABLE.lines().filter_map(|line| line.strip_prefix(&start)).collect();
            assert!(hashes.len() == 1 && hashes[0].len() == 16, "{start}{hashes:?}");
        }
    }
}

#[test]
fn this_build_has_the_hashes_of_the_table() {
    for scene in QUICK {
        for (stepper, solver) in program::METHODS {
            let line = program::line(scene, stepper, solver, 1, SECONDS);
            assert!(TABLE.lines().any(|known| known == line), "{line} is not in the table");
        }
    }
}

/// The program that `scripts/same_bits.sh 0.02 wasm32` has built, if it is as new as the crates.
#[test]
fn webassembly_has_the_hashes_of_the_table() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let wasm = root.join("target/bits/wasm32-wasip1/release/examples/state_hashes.wasm");
    let mut run = Command::new("node");
    run.arg(root.join("scripts/wasi.mjs"))
        .arg(&wasm)
        .args([&SECONDS.to_string(), "1"])
        .args(["stack", "pendulum", "robot"]);
    let skip = |why: &str| {
        let _ = writeln!(std::io::stderr(), "SKIPPED: WebAssembly is not compared: {why}");
    };
    if !wasm.is_file() {
        return skip("scripts/same_bits.sh 0.02 wasm32 builds the program");
    }
    if newest(&root.join("crates")) > wasm.metadata().unwrap().modified().unwrap() {
        return skip("the program is older than the crates; scripts/same_bits.sh 0.02 wasm32 builds it");
    }
    let Ok(output) = run.output() else { return skip("there is no node") };
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(said.lines().count(), 3 * program::METHODS.len(), "{said}");
    said.lines().for_each(|line| assert!(TABLE.lines().any(|known| known == line), "{line} is not in the table"));
}

/// Returns the time of the last change of the crates and scenes that the program is made of.
fn newest(crates: &Path) -> std::time::SystemTime {
    let mut folders: Vec<_> =
        ["collide", "core", "behaviors", "scene"].map(|name| crates.join(name).join("src")).into();
    folders.extend(["scene/examples", "../scenes"].map(|folder| crates.join(folder)));
    let mut newest = std::time::SystemTime::UNIX_EPOCH;
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap().map(Result::unwrap) {
            let about = entry.metadata().unwrap();
            match about.is_dir() {
                true => folders.push(entry.path()),
                false => newest = newest.max(about.modified().unwrap()),
            }
        }
    }
    newest
}
