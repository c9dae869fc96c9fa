//! Python's `mcap` and `mcap-protobuf-support` read the file: other programmers' code, and the
//! schemas in the file alone.

use crate::support::*;
use std::io::Write;
use std::path::Path;
use std::process::Command;

#[test]
fn pythons_mcap_decodes_the_published_messages() {
    let scratch = Scratch::new("python");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/check_mcap.py");
    let python = std::env::var("TUMBLE_PYTHON").unwrap_or_else(|_| "python3".into());
    for compression in COMPRESSIONS {
        let path = scratch.file("a.mcap");
        record(&path, 120, options(compression, 32));
        let output = match Command::new(&python).arg(&script).arg(&path).output() {
            Ok(output) => output,
            Err(error) => return skip(&format!("{python} does not run: {error}")),
        };
        let said = [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned()).concat();
        match output.status.code() {
            Some(0) => assert!(said.contains("120 frames"), "{said}"),
            Some(77) => return skip(said.trim()),
            _ => panic!("{compression:?}: {said}"),
        }
    }
}

/// Straight to the terminal: what a passing test prints with `println!` is swallowed.
fn skip(why: &str) {
    let _ = writeln!(std::io::stderr(), "SKIPPED: check of recordings by Python: {why}");
}
