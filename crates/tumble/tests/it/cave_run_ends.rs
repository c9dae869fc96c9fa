//! Endings of runs in a cave under faults, and the files that they keep.

use crate::cave_place::*;
use crate::common::*;
use rustix::process::Signal;
use std::os::unix::fs::symlink;
use std::process::{Command, Stdio};
use std::time::Duration;

/// The end of a complete MCAP file.
const MAGIC: &[u8] = b"\x89MCAP0\r\n";

#[test]
fn ctrl_c_keeps_summary_and_recording_where_a_facet_does_not_answer() {
    let place = Place::new("cave-frozen-end", &wall());
    let (summary, record) = (place.path("summary.json"), place.path("run.mcap"));
    let run = place
        .start("cave", &["--no-pictures", "--log-dir", &place.path("out"), "--summary", &summary, "--record", &record]);
    place.wait_for("out", "r", 5);
    let facets = run.facets();
    signal(run.facet("r"), Signal::STOP);
    signal(run.pid(), Signal::INT);
    let (code, said, wrong) = run.end();
    assert_eq!(code, Some(0), "{wrong}");
    assert!(said.contains("facet r: ") && said.contains("recording: "), "{said}");
    assert!(wrong.contains("facet r: does not end and was killed"), "{wrong}");
    assert!(json(&place.folder.path("summary.json"))["frames"].as_u64() > Some(5));
    assert!(std::fs::read(&record).unwrap().ends_with(MAGIC));
    facets.iter().for_each(|(name, pid)| assert!(!alive(*pid), "facet {name} lives on"));
    place.assert_clean();
}

#[test]
fn a_signal_during_the_start_leaves_nothing() {
    let place = Place::new("cave-early-end", &wall());
    for ms in [30, 200, 500, 900] {
        let run = place.start("cave", &["--offscreen"]);
        std::thread::sleep(Duration::from_millis(ms));
        let facets = run.facets();
        signal(run.pid(), Signal::INT);
        let (code, _, wrong) = run.end();
        // the first signals may arrive before the command does anything
        assert!(code == Some(0) || code.is_none() && facets.is_empty(), "after {ms} ms: {code:?}, {wrong}");
        facets.iter().for_each(|(name, pid)| assert!(!alive(*pid), "facet {name} lives on"));
        place.assert_clean();
    }
}

#[test]
fn a_full_disk_is_reported_with_the_file_and_ends_the_run() {
    let place = Place::new("cave-full", &wall());
    for facet in ["l", "r"] {
        std::fs::create_dir_all(place.folder.path("out").join(facet)).unwrap();
        symlink("/dev/full", place.folder.path("out").join(facet).join("frames.jsonl")).unwrap();
    }
    let (code, _, wrong) =
        place.start("cave", &["--no-pictures", "--log-dir", &place.path("out"), "--overwrite"]).end();
    assert_eq!(code, Some(1), "{wrong}");
    for facet in ["l", "r"] {
        assert!(
            wrong.contains(&format!(
                "writing {}: ",
                place.folder.path("out").join(facet).join("frames.jsonl").display()
            )),
            "{wrong}"
        );
    }
    place.assert_clean();
}

#[test]
fn a_recording_that_is_played_or_whose_run_does_not_begin_is_not_written_over() {
    let place = Place::new("cave-kept", &wall());
    let record = place.path("run.mcap");
    place.succeed("cave", &["--no-pictures", "--no-realtime", "--duration", "0.2", "--record", &record]);
    let before = std::fs::read(&record).unwrap();
    let link = place.path("link.mcap");
    symlink(&record, &link).unwrap();
    for target in [&record, &link] {
        let (code, _, wrong) = place.start("serve", &["--replay-input", &record, "--record", target]).end();
        assert_eq!(code, Some(2), "{wrong}");
        assert!(wrong.contains("the same file"), "{wrong}");
    }
    // no facet joins
    let (code, _, wrong) = place.start("serve", &["--record", &record, "--connect-timeout", "0.3"]).end();
    assert_eq!(code, Some(1), "{wrong}");
    assert!(before == std::fs::read(&record).unwrap());
    let hidden = std::fs::read_dir(place.folder.path(""))
        .unwrap()
        .flatten()
        .filter(|e| e.file_name().as_encoded_bytes().starts_with(b"."))
        .count();
    assert_eq!(hidden, 0);
}

#[test]
fn a_facet_of_another_cave_is_not_let_in() {
    let place = Place::new("cave-other-cave", &wall());
    let server = place.start("serve", &["--connect-timeout", "60"]);
    wait("the server's lock", || {
        lock_file(&place.folder)
            .is_some_and(|file| std::fs::read_to_string(file).unwrap_or_default().contains("Memory"))
    });
    std::fs::write(&place.cave, wall().replace("[-2, 2, 2.0]", "[-2, 2, 2.2]")).unwrap();
    let (code, _, wrong) = place.start("facet", &["--facet", "r", "--no-pictures"]).end();
    assert_eq!(code, Some(2), "{wrong}");
    assert!(wrong.contains("refuses it"), "{wrong}");
    // with other times, machines and descriptions it is the same cave
    std::fs::write(&place.cave, wall().replace("drop_timeout_ms = 500", "drop_timeout_ms = 600")).unwrap();
    let facets: Vec<_> = ["l", "r"]
        .map(|f| place.start("facet", &["--facet", f, "--no-pictures", "--log-dir", &place.path("out")]))
        .into();
    place.wait_for("out", "r", 5);
    signal(server.pid(), Signal::INT);
    assert_eq!(server.end().0, Some(0));
    facets.into_iter().for_each(|facet| assert_eq!(facet.end().0, Some(0)));
    place.assert_clean();
}

#[test]
fn a_facet_with_another_texture_of_the_same_name_is_not_let_in() {
    let place = Place::new("cave-other-texture", &wall());
    let picture = |value: u8| {
        tumble::render::Image { width: 2, height: 2, rgba: vec![value; 16] }
            .write_png(place.folder.path("bark.png"))
            .unwrap()
    };
    picture(255);
    std::fs::write(&place.scene, SCENE.replace("radius_m = 0.3 }", "radius_m = 0.3 }\ntexture = \"bark.png\""))
        .unwrap();
    let server = place.start("serve", &["--connect-timeout", "60"]);
    wait("the server's lock", || {
        lock_file(&place.folder)
            .is_some_and(|file| std::fs::read_to_string(file).unwrap_or_default().contains("Memory"))
    });
    picture(128);
    let (code, _, wrong) = place.start("facet", &["--facet", "r", "--no-pictures"]).end();
    assert_eq!(code, Some(2), "{wrong}");
    assert!(wrong.contains("refuses it"), "{wrong}");
    signal(server.pid(), Signal::INT);
    assert_eq!(server.end().0, Some(0));
}

#[test]
fn facets_by_hand_find_the_server_that_was_started_again() {
    for carrier in ["shared_memory", "udp"] {
        let place = Place::new(&format!("cave-again-{carrier}"), &wall());
        let start = || place.start("serve", &["--transport", carrier]);
        let server = start();
        let facets: Vec<_> = ["l", "r"]
            .map(|f| {
                place.start(
                    "facet",
                    &["--facet", f, "--no-pictures", "--connect-timeout", "80", "--log-dir", &place.path("out")],
                )
            })
            .into();
        place.wait_for("out", "r", 5);
        signal(server.pid(), Signal::KILL);
        drop(server);
        let server = start();
        for facet in ["l", "r"] {
            wait(&format!("facet {facet} in the second run, {carrier}"), || {
                numbers(&place.log("out", facet)).iter().filter(|n| **n == 0).count() == 2
            });
        }
        signal(server.pid(), Signal::INT);
        let (code, _, wrong) = server.end();
        assert_eq!(code, Some(0), "{wrong}");
        facets.into_iter().for_each(|facet| assert_eq!(facet.end().0, Some(0)));
        place.assert_clean();
    }
}

#[test]
fn a_shipped_cave_is_one_from_every_folder() {
    let place = Place::new("cave-one", &wall());
    let start = |folder: &str| {
        let mut serve = in_place(&place.folder, &["serve", &place.scene, "--cave", "cube4", "--connect-timeout", "60"]);
        serve.current_dir(folder).stdin(Stdio::null()).stderr(Stdio::piped());
        serve
    };
    let mut first = start(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).stderr(Stdio::null()).spawn().unwrap();
    wait("the lock", || {
        lock_file(&place.folder)
            .is_some_and(|file| std::fs::read_to_string(file).unwrap_or_default().contains("Memory"))
    });
    let out = start("/").output().unwrap();
    signal(first.id() as i32, Signal::INT);
    assert!(first.wait().unwrap().success());
    let wrong = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(1), "{wrong}");
    assert!(wrong.contains("a run is already in progress"), "{wrong}");
    place.assert_clean();
}

#[test]
fn a_run_of_long_paths_has_a_name_and_is_found() {
    let place = Place::new("cave-long", &wall());
    // of bytes that are written as six characters each
    let deep = (0..6).fold(place.folder.path("deep"), |path, _| path.join("\u{1}".repeat(200)));
    std::fs::create_dir_all(&deep).unwrap();
    let (scene, cave) = (deep.join("scene.toml"), deep.join("cave.toml"));
    std::fs::write(&scene, SCENE).unwrap();
    std::fs::write(&cave, wall()).unwrap();
    let start = |what: &str, more: &[&str]| {
        let mut command = in_place(&place.folder, &[&[what, &text(&scene), "--cave", &text(&cave)], more].concat());
        command.stdin(Stdio::null()).stderr(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap()
    };
    let mut server = start("serve", &["--duration", "0.3", "--quiet"]);
    wait("the lock", || {
        lock_file(&place.folder)
            .is_some_and(|file| std::fs::read_to_string(file).unwrap_or_default().contains("Memory"))
    });
    let second = start("serve", &[]).wait_with_output().unwrap();
    let wrong = String::from_utf8_lossy(&second.stderr);
    assert!(wrong.contains(&format!("process {}", server.id())), "{wrong}");
    let facets = ["l", "r"].map(|f| start("facet", &["--facet", f, "--no-pictures"]));
    facets.into_iter().for_each(|mut facet| assert!(facet.wait().unwrap().success()));
    assert!(server.wait().unwrap().success());
    place.assert_clean();
}

#[test]
fn replacing_a_run_signals_no_other_process_with_its_number() {
    let place = Place::new("cave-bystander", &wall());
    let server = place.start("serve", &["--connect-timeout", "60"]);
    wait("the lock", || {
        lock_file(&place.folder)
            .is_some_and(|file| std::fs::read_to_string(file).unwrap_or_default().contains("Memory"))
    });
    let path = lock_file(&place.folder).unwrap();
    signal(server.pid(), Signal::KILL);
    let _ = server.end();
    // the number in the file is another process's by now, and a process that has not written yet
    // holds the lock
    let mut bystander = Command::new("sleep").arg("60").spawn().unwrap();
    let mut stale = json(&path);
    stale["pid"] = bystander.id().into();
    std::fs::write(&path, stale.to_string()).unwrap();
    let held = std::fs::File::open(&path).unwrap();
    held.lock().unwrap();
    let second = place.start("serve", &["--replace", "--connect-timeout", "0.3"]);
    std::thread::sleep(Duration::from_millis(1500));
    drop(held);
    let (code, _, wrong) = second.end();
    let ended = bystander.try_wait().unwrap();
    let _ = bystander.kill();
    let _ = bystander.wait();
    assert_eq!((code, ended), (Some(1), None), "{wrong}");
    assert!(wrong.contains("did not join within"), "{wrong}");
    place.assert_clean();
}

#[test]
fn a_run_goes_on_when_nobody_reads_its_stderr() {
    let place = Place::new("cave-unheard", &wall());
    let (summary, record) = (place.path("summary.json"), place.path("run.mcap"));
    let mut command = place.command(
        "cave",
        &["--no-pictures", "--no-realtime", "--duration", "0.3", "--summary", &summary, "--record", &record],
    );
    let mut child = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    drop((child.stdout.take(), child.stderr.take()));
    assert_eq!(child.wait().unwrap().code(), Some(0));
    assert_eq!(json(&place.folder.path("summary.json"))["frames"], 31);
    assert!(std::fs::read(&record).unwrap().ends_with(MAGIC));
    place.assert_clean();
}

#[test]
fn the_others_go_on_when_a_facet_cannot_be_started_again() {
    let place = Place::new("cave-unstartable", &wall());
    // a command whose program disappears
    let program = place.folder.path("tumble");
    std::fs::copy(env!("CARGO_BIN_EXE_tumble"), &program).unwrap();
    let mut command = Command::new(&program);
    command.args([
        "cave",
        &place.scene,
        "--cave",
        &place.cave,
        "--no-pictures",
        "--restart",
        "--log-dir",
        &place.path("out"),
    ]);
    command
        .env("XDG_RUNTIME_DIR", place.folder.path("run"))
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped());
    let child = command.spawn().unwrap();
    place.wait_for("out", "r", 5);
    std::fs::remove_file(&program).unwrap();
    let pid = child.id() as i32;
    let facets: Vec<i32> = std::fs::read_to_string(format!("/proc/{pid}/task/{pid}/children"))
        .unwrap()
        .split_whitespace()
        .map(|p| p.parse().unwrap())
        .collect();
    let right = facets.iter().find(|pid| {
        String::from_utf8_lossy(&std::fs::read(format!("/proc/{pid}/cmdline")).unwrap()).contains("--facet\0r\0")
    });
    signal(*right.unwrap(), Signal::KILL);
    let at = *numbers(&place.log("out", "l")).last().unwrap();
    place.wait_for("out", "l", at + 150);
    signal(pid, Signal::INT);
    let out = child.wait_with_output().unwrap();
    let wrong = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(0), "{wrong}");
    assert!(wrong.contains("starting facet r: "), "{wrong}");
    place.assert_clean();
}

#[test]
fn what_cannot_go_well_is_refused_before_the_start() {
    let place = Place::new("cave-refusals", &wall());
    let nowhere = place.path("nowhere/summary.json");
    for (args, word) in
        [(["--summary", &nowhere], "cannot be written"), (["--listen", "127.0.0.1:0"], "--transport udp")]
    {
        let (code, _, wrong) = place.start("serve", &args).end();
        assert_eq!(code, Some(2), "{wrong}");
        assert!(wrong.contains(args[0]) || wrong.contains(args[1]), "{wrong}");
        assert!(wrong.contains(word), "{wrong}");
    }
    // a show would otherwise end at its second scene, and each facet would complain about key and folder
    let spaced = place.folder.write("spaced", "a key with spaces in it");
    let taken = format!("{spaced}/frames");
    for args in [&["--then", "nowhere.toml"][..], &["--web", "--web-key", &spaced], &["--log-dir", &taken]] {
        let (code, _, wrong) = place.start("cave", args).end();
        assert_eq!((code, wrong.matches("error: ").count()), (Some(2), 1), "{wrong}");
        assert!(wrong.contains(args[args.len() - 1]), "{wrong}");
    }
    // the summary would replace the recording, the scene or the cave
    let recorded = place.path("run.mcap");
    for summary in [&recorded, &place.scene, &place.cave] {
        let args = ["--no-pictures", "--duration", "0.1", "--record", &recorded, "--summary", summary];
        let (code, _, wrong) = place.start("cave", &args).end();
        assert_eq!(code, Some(2), "{wrong}");
        assert!(wrong.contains(&format!("--summary {summary}: the run reads or records this file")), "{wrong}");
    }
    let (code, _, wrong) = place.start("cave", &["--no-pictures", "--sound", "127.0.0.1:0", "--duration", "0.1"]).end();
    assert!(code == Some(2) && wrong.contains("--sound 127.0.0.1:0: nothing listens at port 0"), "{wrong}");
    assert!(Command::new("mkfifo").arg(place.path("key")).status().unwrap().success());
    std::fs::write(&place.cave, wall() + "[security]\nkey_file = \"key\"\n").unwrap();
    let (code, _, wrong) = place.start("serve", &["--transport", "udp"]).end();
    assert_eq!(code, Some(2), "{wrong}");
    assert!(wrong.contains("no regular file"), "{wrong}");
    place.assert_clean();
}
