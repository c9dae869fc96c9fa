//! Several facets in one process: the same pictures, counts and files as with a process each, kills, and
//! what is refused.

use crate::cave_place::*;
use crate::common::*;
use rustix::process::Signal;
use serde_json::Value;

pub const NAMES: [&str; 4] = ["front", "left", "right", "floor"];

/// The room, whose facets differ in what finishes their pictures, and are in these processes.
pub fn room(processes: [Option<&str>; 4]) -> String {
    let keys = ["stereo = \"side_by_side\"", "flip = \"horizontal\"", "stereo = \"rows\"", ""];
    let facet = |k: usize| {
        let left = [0, 170, 260, 350][k];
        let process = processes[k].map_or(String::new(), |name| format!("process = \"{name}\"\n"));
        format!("size_px = [80, 80]\nposition_px = [{left}, 20]\n{}\n{process}", keys[k])
    };
    let sync = "ready_timeout_ms = 2000\ndrop_timeout_ms = 2000\nconnect_timeout_ms = 60000";
    cave_of(&ROOM, facet, sync)
}

/// The frame, the state and the picture of each line, without times.
pub fn lines(log: &[Value]) -> Vec<[&Value; 4]> {
    log.iter().map(|line| ["frame", "time_s", "state", "image"].map(|key| &line[key])).collect()
}

/// Every facet has shown each frame once, in time.
pub fn assert_whole(summary: &Value, frames: u64) {
    for facet in summary["facets"].as_array().unwrap() {
        for zero in ["late", "missing", "torn", "mismatched", "dropped", "refused", "not_shown", "not_written"] {
            assert_eq!(facet[zero], 0, "{zero} of {facet}");
        }
        assert_eq!((&facet["presented"], &facet["written"]), (&frames.into(), &frames.into()), "{facet}");
    }
}

#[test]
fn facets_of_one_process_draw_the_bytes_of_single_ones() {
    if tumble::render::Renderer::new().is_err() {
        return crate::desktop::skip("this machine has no graphics adapter");
    }
    let some = [Some("walls"), None, Some("walls"), Some("walls")];
    let forms: [(&str, String, &[&str]); 3] = [
        ("group-single", room([None; 4]), &[]),
        ("group-some", room(some), &[]),
        ("group-all", room(some), &["--one-process"]),
    ];
    let places = forms.map(|(test, cave, more)| {
        let place = Place::new(test, &cave);
        let out = place.path("out");
        let args = ["--duration", "0.04", "--no-realtime", "--offscreen", "--quality", "fastest", "--burn-in"];
        let summary = place.succeed("cave", &[&args[..], &["--frames-dir", &out], more].concat());
        assert_whole(&summary, 5);
        let adapters: Vec<_> = summary["facets"].as_array().unwrap().iter().map(|f| f["adapter"].clone()).collect();
        assert!(adapters.iter().all(|adapter| adapter == &adapters[0] && adapter != ""), "{adapters:?}");
        place.assert_clean();
        place
    });
    let [single, grouped @ ..] = &places;
    for name in NAMES {
        let log = single.log("out", name);
        assert_eq!(numbers(&log), (0..5).collect::<Vec<_>>());
        for place in grouped {
            assert_eq!(lines(&place.log("out", name)), lines(&log), "{name}");
            for frame in 0..5 {
                let picture = |place: &Place| {
                    let file = place.folder.path("out").join(name).join(format!("frame_{frame:06}.png"));
                    tumble::render::Image::read_png(file).unwrap()
                };
                assert!(picture(place).rgba == picture(single).rgba, "{name}, frame {frame}");
            }
        }
    }
}

/// The group is killed between two frames of the others, which miss nothing, and all its facets are back.
#[test]
fn a_killed_process_brings_all_its_facets_back() {
    let walls = Some("walls");
    let place = Place::new("group-kill", &room([walls, walls, walls, None]));
    let (out, summary) = (place.path("out"), place.path("summary.json"));
    let args = ["--no-pictures", "--log-dir", &out, "--restart", "--summary", &summary];
    let run = place.start("cave", &args);
    place.wait_for("out", "right", 5);
    assert_eq!(run.facets().len(), 2, "{:?}", run.facets());
    signal(run.facet("front,left,right"), Signal::KILL);
    let killed_at = *numbers(&place.log("out", "floor")).last().unwrap();
    NAMES.iter().for_each(|name| place.wait_for("out", name, killed_at + 100));
    signal(run.pid(), Signal::TERM);
    let (code, _, wrong) = run.end();
    assert_eq!(code, Some(0), "{wrong}");
    assert!(wrong.contains("facets front, left, right ended (killed by signal 9)"), "{wrong}");
    let floor = place.log("out", "floor");
    assert_eq!(numbers(&floor), (0..floor.len() as u64).collect::<Vec<_>>());
    for name in NAMES {
        for line in place.log("out", name) {
            assert_eq!(line["state"], floor[line["frame"].as_u64().unwrap() as usize]["state"], "{name}");
        }
    }
    let facets = json(&place.folder.path("summary.json"))["facets"].clone();
    let joined: Vec<_> = facets.as_array().unwrap().iter().map(|facet| facet["joined"].as_u64().unwrap()).collect();
    assert_eq!(joined, [2, 2, 2, 1]);
    place.assert_clean();
}

/// Also with facets that step by themselves, over sealed datagrams: the process steps the world once, and the
/// states of all facets are those of a process each.
#[test]
fn a_process_of_several_facets_computes_the_same_states() {
    let run = |test: &str, more: &[&str]| {
        let place = Place::new(test, &room([None; 4]));
        let out = place.path("out");
        let args = ["--no-pictures", "--no-realtime", "--duration", "1", "--dt", "0.005", "--log-dir", &out];
        let summary = place.succeed("cave", &[&args[..], more].concat());
        assert_whole(&summary, 68);
        let logs = NAMES.map(|name| place.log("out", name));
        logs.iter().for_each(|log| assert_eq!(states(log), states(&logs[0])));
        place.assert_clean();
        logs[0].clone()
    };
    let everywhere = ["--compute", "everywhere", "--user-colliders", "--transport", "udp"];
    let single = run("group-states", &everywhere);
    let grouped = run("group-computes", &[&everywhere[..], &["--one-process"]].concat());
    assert_eq!(states(&grouped), states(&single));
    // poses instead
    run("group-poses", &["--one-process", "--transport", "udp"]);
}

#[test]
fn groups_that_cannot_be_are_refused() {
    let place = Place::new("group-refused", &room([None; 4]));
    let refused = |args: &[&str], why: &str| {
        let (code, _, wrong) = place.start("facet", args).end();
        assert!(code == Some(2) && wrong.contains(why), "{args:?}: {code:?} {wrong}");
    };
    refused(&["--facet", "front,ceiling", "--no-pictures"], "ceiling");
    refused(&["--facet", "front,left,front", "--no-pictures"], "front is named twice");
    refused(&["--facet", "front,left", "--web", "127.0.0.1:65535"], "no port is left for the facet left");
    let mixed = room([None; 4]).replacen("position_px = [0, 20]", "output = \"offscreen\"", 1);
    let mixed = place.folder.write("mixed.toml", mixed);
    let (cave, scene) = (&mixed, &place.scene);
    let out = in_place(&place.folder, &["facet", scene, "--cave", cave, "--facet", "left,front"]).output().unwrap();
    let wrong = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.code() == Some(2) && wrong.contains("into a window and into memory"), "{wrong}");
}
