//! A run that is killed, or that runs out of disk space, leaves all flushed frames.

use crate::support::*;
use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};
use tumble_net::record::*;

const TARGET: &str = "TUMBLE_NET_TEST_RECORD_TO";
const FLUSH: u64 = 7;

/// The process that the test below kills: records, and reports after every frame how many frames
/// are flushed.
#[test]
#[ignore = "run by a_killed_run_keeps_what_was_flushed"]
fn child_records_until_killed() {
    let path = std::env::var_os(TARGET).expect("only the killing test runs this");
    let mut recorder = Recorder::create(path, WORLD, &entities(), options(Compression::Lz4, FLUSH as u32)).unwrap();
    for k in 0..1_000_000 {
        recorder.frame(time(k), k, &poses(k), &[], &state(k)).unwrap();
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
        let counts =
            lines.map_while(|line| line.ok()).filter_map(|line| line.strip_prefix("safe ")?.parse::<u64>().ok());
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

/// Runs in a process whose files are limited to some kilobytes by the test below.
#[test]
#[ignore = "run by a_disk_that_fills_up_in_mid_run_loses_nothing_flushed"]
fn child_records_until_refused() {
    let path = std::env::var_os(TARGET).expect("only the test of the full disk runs this");
    let mut recorder = Recorder::create(&path, WORLD, &entities(), options(Compression::None, FLUSH as u32)).unwrap();
    let refused = (0..10_000).find_map(|k| Some((k, recorder.frame(time(k), k, &poses(k), &[], &state(k)).err()?)));
    let (k, error) = refused.expect("there was room for 10,000 frames");
    assert!(error.to_string().contains("cannot write: File too large"), "{error}");
    // further frames fail again, at the next flush at the latest, and do not panic
    let is_later: Vec<bool> =
        (k + 1..k + 8).map(|k| recorder.frame(time(k), k, &poses(k), &[], &state(k)).is_ok()).collect();
    assert!(!is_later[6], "{is_later:?}");
    println!("safe {}", recorder.flushed_frames());
    assert!(recorder.finish().is_err());
}

#[test]
#[cfg(unix)]
fn a_disk_that_fills_up_in_mid_run_loses_nothing_flushed() {
    let scratch = Scratch::new("full");
    let path = scratch.file("full.mcap");
    // without the trap the limit would kill the process; with it, writing fails as on a full disk
    let output = Command::new("sh")
        .args(["-c", "trap '' XFSZ; ulimit -f 100; exec \"$0\" \"$@\""])
        .arg(std::env::current_exe().unwrap())
        .args(["--exact", "kill::child_records_until_refused", "--ignored", "--nocapture"])
        .env(TARGET, &path)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    let safe: usize = said.lines().find_map(|line| line.strip_prefix("safe ")?.parse().ok()).unwrap();
    let (frames, ending) = read_all(&path);
    assert!(matches!(ending, Ok(Ending::Cut { .. })), "ends with {ending:?}");
    assert!(frames.len() >= safe && safe > 20, "{} frames, {safe} were flushed", frames.len());
    assert_frames(&frames);
}
