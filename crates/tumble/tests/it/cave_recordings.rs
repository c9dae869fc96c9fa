//! Recordings of runs in a cave, cut anywhere.

use crate::cave_place::in_place;
use crate::cave_users::place;
use crate::common::*;
use tumble::net::record::{Frame, read, recover};
use tumble::net::sync::{RecordedFrame, SessionReader};

/// Returns opcode, begin and end of each record of an MCAP file. The file has a magic of 8 bytes,
/// then records of an opcode, a length of 8 bytes, and the content.
fn records(bytes: &[u8]) -> Vec<(u8, usize, usize)> {
    let (mut at, mut out) = (8, Vec::new());
    while at + 9 <= bytes.len() - 8 {
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) as usize;
        out.push((bytes[at], at, at + 9 + length));
        at += 9 + length;
    }
    out
}

/// Returns the end of each chunk and the number of frames in it, from the message index behind it.
/// The id of the channel of states is read from the summary section.
fn chunks(bytes: &[u8]) -> Vec<(usize, usize)> {
    let u16_at = |at: usize| u16::from_le_bytes(bytes[at..at + 2].try_into().unwrap());
    let u32_at = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let all = records(bytes);
    let is_state = |begin: usize| bytes[begin + 17..begin + 17 + u32_at(begin + 13)] == *b"/tumble/state";
    let state = all
        .iter()
        .rev()
        .find(|(opcode, begin, _)| *opcode == 0x04 && is_state(*begin))
        .map(|(_, begin, _)| u16_at(begin + 9))
        .unwrap();
    let mut chunks = Vec::new();
    for (opcode, begin, end) in all {
        match opcode {
            0x06 => chunks.push((end, 0)),
            0x07 if u16_at(begin + 9) == state => chunks.last_mut().unwrap().1 += u32_at(begin + 11) / 16,
            _ => {}
        }
    }
    chunks
}

fn frames(path: &std::path::Path) -> Vec<RecordedFrame> {
    let mut replay = SessionReader::open(path).unwrap();
    std::iter::from_fn(|| replay.next_frame().unwrap()).collect()
}

#[test]
fn a_run_cut_at_every_structural_boundary_keeps_what_was_flushed() {
    let (folder, scene, cave) = place("cave-cuts");
    let file = folder.path("run.mcap");
    let args = [
        "cave",
        &scene,
        "--cave",
        &cave,
        "--no-pictures",
        "--no-realtime",
        "--duration",
        "0.7",
        "--record",
        &text(&file),
        "--quiet",
    ];
    let out = in_place(&folder, &args).output().unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let (bytes, whole) = (std::fs::read(&file).unwrap(), frames(&file));
    let chunks = chunks(&bytes);
    assert_eq!((whole.len(), chunks.iter().map(|(_, n)| n).sum::<usize>()), (71, 71));
    assert!(chunks.len() > 3, "{chunks:?}");
    let mut points: Vec<usize> = records(&bytes)
        .into_iter()
        .flat_map(|(_, begin, end)| [begin, begin + 1, begin + 9, (begin + end) / 2, end - 1])
        .collect();
    points.sort();
    points.dedup();
    let (cut, mended) = (folder.path("cut.mcap"), folder.path("mended.mcap"));
    let mut partly = 0;
    for at in points {
        let expected: usize = chunks.iter().filter(|(end, _)| *end <= at).map(|(_, n)| n).sum();
        std::fs::write(&cut, &bytes[..at]).unwrap();
        let _ = std::fs::remove_file(&mended);
        let saved = match recover(&cut, &mended) {
            Ok(report) => report.frames as usize,
            // cut so near the beginning, it is no recording yet
            Err(_) => 0,
        };
        assert_eq!(saved, expected, "cut at byte {at}");
        if saved > 0 {
            assert!(frames(&mended)[..] == whole[..saved], "cut at byte {at}");
            partly += usize::from(saved < whole.len());
        }
    }
    assert!(partly > 10, "{partly} cuts within the run");
}

#[test]
fn a_recording_without_frames_is_named_as_such() {
    let (folder, scene, cave) = place("cave-no-frames");
    let (file, cut) = (folder.path("run.mcap"), folder.path("cut.mcap"));
    let fixed = ["--no-pictures", "--no-realtime", "--quiet", "--duration", "0.3"];
    let run = |first: &[&str]| in_place(&folder, &[first, &["--cave", &cave], &fixed].concat()).output().unwrap();
    assert!(run(&["cave", &scene, "--record", &text(&file)]).status.success());
    let bytes = std::fs::read(&file).unwrap();
    // right after the first chunk, which has the scene, and within the next record
    let first = records(&bytes).into_iter().find(|(opcode, ..)| *opcode == 0x06).unwrap();
    for at in [first.2, first.2 + 3] {
        std::fs::write(&cut, &bytes[..at]).unwrap();
        for args in [&["replay", &text(&cut), &scene][..], &["cave", &scene, "--replay-input", &text(&cut)]] {
            let out = run(args);
            let wrong = String::from_utf8_lossy(&out.stderr);
            assert_eq!(out.status.code(), Some(2), "{wrong}");
            let why = format!("cut.mcap: the recording has no frame: it is cut at byte {}", first.2);
            assert!(wrong.contains(&why) && !wrong.contains("hash"), "{wrong}");
        }
    }
}

/// A world with sensors, a camera and events: the recording of a cave has them in the channels of a single run. A cave shows
/// 60 frames a second, four steps each, and its frames have the events of all steps.
#[test]
fn a_cave_records_sensors_events_and_cameras_like_a_single_run() {
    const SENSED: &str = r#"
[[body]]
name = "ground"
mode = "static"
shape = { type = "half_space" }
[[body]]
name = "ball"
shape = { type = "sphere", radius_m = 0.1 }
mass_kg = 2
position_m = [0, 0, 0.4]
restitution = 0.5
[[sensor]]
name = "felt"
type = "touch"
on = "ball"
[[sensor]]
name = "imu"
type = "accelerometer"
on = "ball"
deviation = 0.1
delay = 1
[[sensor]]
name = "eye"
type = "depth"
position_m = [0, 0, 2]
orientation_xyzw = [1, 0, 0, 0]
resolution = [4, 3]
delay = 2
"#;
    let (folder, _, cave) = place("cave-sensed");
    let scene = folder.write("sensed.toml", SENSED);
    let (single, cave_file) = (folder.path("single.mcap"), folder.path("cave.mcap"));
    let run = |args: &[&str]| {
        let out = in_place(&folder, args).output().unwrap();
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    };
    let cameras = ["--record-cameras", "--quiet", "--duration", "0.5"];
    run(&[&["run", &scene, "--record", &text(&single)][..], &cameras].concat());
    let in_cave = ["--cave", &cave, "--no-pictures", "--no-realtime", "--fps", "60", "--events"];
    run(&[&["cave", &scene, "--record", &text(&cave_file)][..], &in_cave, &cameras].concat());
    let all = |file| read(file).unwrap().map(|frame| frame.unwrap()).collect::<Vec<Frame>>();
    let (single, caves) = (all(&single), all(&cave_file));
    let steps = (single.len() - 1) / (caves.len() - 1);
    assert!(steps >= 4 && single.len() == steps * (caves.len() - 1) + 1, "{} {}", single.len(), caves.len());
    for (frame, ours) in caves.iter().enumerate() {
        let same = &single[steps * frame];
        assert_eq!((&ours.sensors, &ours.images), (&same.sensors, &same.images), "frame {frame}");
        let first = if frame == 0 { 0 } else { steps * (frame - 1) + 1 };
        let events: Vec<_> = single[first..=steps * frame].iter().flat_map(|frame| frame.events.clone()).collect();
        assert_eq!(ours.events, events, "frame {frame}");
    }
    assert!(caves.iter().any(|frame| frame.events.iter().any(|event| event.kind == "contact_end")));
    assert!(caves.iter().all(|frame| frame.sensors.len() == 2 && frame.images.len() == 1));
}
