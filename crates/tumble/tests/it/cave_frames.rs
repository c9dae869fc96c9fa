//! Frames that facets of a cave write: all that are shown are written, only whole pictures have
//! their names, and two runs are not mixed.

use crate::cave_place::*;
use crate::common::*;
use rustix::process::Signal;
use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

/// Opens without waiting for another side of a pipe, and returns at once when it is full or empty.
const O_NONBLOCK: i32 = 0o4000;

/// A pipe that takes no further byte until it is read.
fn full_pipe(path: &Path) -> File {
    assert!(Command::new("mkfifo").arg(path).status().unwrap().success());
    let mut pipe = OpenOptions::new().read(true).write(true).custom_flags(O_NONBLOCK).open(path).unwrap();
    for size in [4096, 1] {
        while pipe.write(&[b' '; 4096][..size]).is_ok() {}
    }
    pipe
}

/// Returns what a pipe holds now.
fn drain(pipe: &mut File) -> String {
    let (mut text, mut bytes) = (String::new(), [0; 4096]);
    while let Ok(length @ 1..) = pipe.read(&mut bytes) {
        text += &String::from_utf8_lossy(&bytes[..length]);
    }
    text
}

/// A run of two frames whose facet `l` writes its list into a full pipe, so that both frames wait
/// to be written when the run ends.
fn run_with_slow_disk(place: &Place) -> (Process, File) {
    std::fs::create_dir_all(place.folder.path("out").join("l")).unwrap();
    let pipe = full_pipe(&place.folder.path("out").join("l").join("frames.jsonl"));
    let (out, summary) = (place.path("out"), place.path("summary.json"));
    let args = ["--no-pictures", "--duration", "0.01", "--no-realtime", "--log-dir", &out, "--overwrite"];
    let run = place.start("cave", &[&args[..], &["--summary", &summary]].concat());
    wait("the summary", || place.folder.path("summary.json").exists());
    (run, pipe)
}

#[test]
fn a_facet_that_still_writes_is_waited_for() {
    let place = Place::new("cave-slow-disk", &wall());
    let (run, mut pipe) = run_with_slow_disk(&place);
    // longer than facets without frames are waited for
    std::thread::sleep(Duration::from_secs(6));
    let mut written = String::new();
    wait("the frames", || {
        written += &drain(&mut pipe);
        written.lines().count() == 2
    });
    let (code, said, wrong) = run.end();
    assert_eq!(code, Some(0), "{wrong}");
    assert!(!wrong.contains("was killed") && !said.contains("NOT WRITTEN"), "{wrong}{said}");
    assert!(written.contains("\"frame\":0") && written.contains("\"frame\":1"), "{written}");
    let summary = json(&place.folder.path("summary.json"));
    for facet in summary["facets"].as_array().unwrap() {
        assert_eq!((&facet["written"], &facet["not_written"]), (&2.into(), &0.into()), "{facet}");
    }
    place.assert_clean();
}

#[test]
fn frames_that_are_not_written_are_counted_and_fail_the_run() {
    let place = Place::new("cave-stuck-disk", &wall());
    let (run, _pipe) = run_with_slow_disk(&place);
    let (code, said, wrong) = run.end();
    assert_eq!(code, Some(1), "{wrong}");
    assert!(wrong.contains("l (2 shown frames are not written)"), "{wrong}");
    assert!(said.contains("facet l: 2 shown, 0 not shown, 2 NOT WRITTEN"), "{said}");
    let facets = json(&place.folder.path("summary.json"))["facets"].clone();
    assert_eq!((&facets[0]["not_written"], &facets[1]["not_written"]), (&2.into(), &0.into()), "{facets}");
    place.assert_clean();
}

#[test]
fn a_killed_facet_leaves_whole_pictures_only() {
    if tumble::render::Renderer::new().is_err() {
        return crate::desktop::skip("this machine has no graphics adapter");
    }
    let place = Place::new("cave-whole", &wall().replace("[80, 60]", "[1600, 1200]"));
    let args = ["--quality", "fastest", "--frames-dir", &place.path("out"), "--offscreen"];
    let run = place.start("cave", &args);
    let names = || -> Vec<std::path::PathBuf> {
        let entries = std::fs::read_dir(place.folder.path("out").join("r")).into_iter().flatten().flatten();
        entries.map(|entry| entry.path()).collect()
    };
    let ends = |path: &Path, end: &str| path.to_str().unwrap().ends_with(end);
    wait("a whole picture, and one that is being written", || {
        let names = names();
        names.iter().any(|path| ends(path, ".png")) && names.iter().any(|path| ends(path, ".unfinished"))
    });
    signal(run.facet("r"), Signal::KILL);
    signal(run.pid(), Signal::INT);
    let _ = run.end();
    let whole: Vec<_> = names().into_iter().filter(|path| ends(path, ".png")).collect();
    assert!(!whole.is_empty());
    whole.iter().for_each(|path| drop(tumble::render::Image::read_png(path).unwrap()));
}

#[test]
fn a_second_run_is_not_mixed_with_the_first() {
    let place = Place::new("cave-mixed", &wall());
    let out = place.path("out");
    let run = |duration: &str, more: &[&str]| {
        let args = ["--no-pictures", "--no-realtime", "--log-dir", &out, "--duration", duration];
        place.start("cave", &[&args[..], more].concat()).end()
    };
    let (code, _, wrong) = run("0.1", &[]);
    assert_eq!(code, Some(0), "{wrong}");
    let first = place.log("out", "l");
    assert_eq!(numbers(&first), (0..=10).collect::<Vec<_>>());
    // pictures of an earlier run, also of a facet that this cave does not have
    std::fs::create_dir_all(place.folder.path("out").join("ceiling")).unwrap();
    let old =
        ["l/frame_000700.png", "ceiling/frame_000001.png", "ceiling/frames.jsonl", "l/.frame_000007.png.unfinished"];
    let old = old.map(|name| place.folder.path("out").join(name));
    old.iter().for_each(|path| std::fs::write(path, "old").unwrap());
    let kept = place.folder.path("out").join("l").join("notes.txt");
    std::fs::write(&kept, "mine").unwrap();
    let (code, _, wrong) = run("0.05", &[]);
    assert_eq!(code, Some(2), "{wrong}");
    assert!(wrong.contains("is of an earlier run") && wrong.contains("--overwrite"), "{wrong}");
    assert!(place.log("out", "l") == first && old.iter().all(|path| path.exists()));
    // a facet by hand refuses too
    let (code, _, wrong) = place.start("serve", &["--connect-timeout", "0.1"]).end();
    assert_eq!(code, Some(1), "{wrong}");
    let server = place.start("serve", &["--connect-timeout", "60"]);
    let (code, _, wrong) = place.start("facet", &["--facet", "l", "--no-pictures", "--log-dir", &out]).end();
    assert_eq!(code, Some(2), "{wrong}");
    assert!(wrong.contains("is of an earlier run"), "{wrong}");
    signal(server.pid(), Signal::INT);
    let _ = server.end();
    let (code, _, wrong) = run("0.05", &["--overwrite"]);
    assert_eq!(code, Some(0), "{wrong}");
    for facet in ["l", "r"] {
        assert_eq!(numbers(&place.log("out", facet)), (0..=5).collect::<Vec<_>>());
    }
    assert!(old.iter().all(|path| !path.exists()) && kept.exists());
    place.assert_clean();
}
