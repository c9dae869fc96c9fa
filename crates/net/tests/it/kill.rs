//! A run killed without warning leaves everything it had flushed.

use crate::support::*;
use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};
use tumble_net::record::*;

const TARGET: &str = "TUMBLE_NET_TEST_RECORD_TO";
const FLUSH: u64 = 7;

/// The victim, run by the test below in a process of its own: records and says after every frame what is safe.
#[test]
#[ignore = "run by a_killed_run_keeps_what_was_flushed"]
fn child_records_until_killed() {
    let path = std::env::var_os(TARGET).expect("only the killing test runs this");
    let mut recorder = Recorder::create(path, WORLD, &entities(), options(Compression::Lz4, FLUSH as u32)).unwrap();
    for k in 0..1_000_000 {
        recorder.frame(time(k), k, &poses(k), &state(k)).unwrap();
        println!("safe {}", recorder.flushed_frames());
    }
    panic!("nobody killed this run");
}

#[test]
fn a_killed_run_keeps_what_was_flushed() {
    let scratch = Scratch::new("kill");
    for wanted in [FLUSH, 40, 1000] {
        let path = scratch.file("killed.mcap");
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "kill::child_records_until_killed", "--ignored", "--nocapture"])
            .env(TARGET, &path)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let counts = lines.map_while(|line| line.ok()).filter_map(|line| line.strip_prefix("safe ")?.parse::<u64>().ok());
        let safe = counts.into_iter().find(|safe| *safe >= wanted).expect("the child got so far");
        child.kill().unwrap(); // SIGKILL
        child.wait().unwrap();

        let (frames, ending) = read_all(&path);
        assert!(matches!(ending, Ok(Ending::Cut { .. })), "ends with {ending:?}");
        assert!(frames.len() as u64 >= safe, "{} frames, and {safe} were flushed", frames.len());
        assert_eq!(frames.len() as u64 % FLUSH, 0, "whole flushes");
        assert_frames(&frames);

        let mended = scratch.file(&format!("mended-{wanted}.mcap"));
        let report = recover(&path, &mended).unwrap();
        assert_eq!(report.frames, frames.len() as u64);
        let (again, ending) = read_all(&mended);
        assert_eq!((again, ending.unwrap()), (frames, Ending::Complete));
    }
}
