//! Recordings and summaries of runs in a cave on full disks, and files that they must not replace.

use crate::cave_place::*;
use crate::common::*;
use std::process::{Command, Stdio};
use tumble::net::sync::SessionReader;

#[test]
fn a_file_that_is_no_recording_is_not_recorded_over() {
    let place = Place::new("cave-foreign", &(wall() + "[recording]\nfile = \"thesis.tex\"\n"));
    let thesis = place.folder.write("thesis.tex", "years of work");
    let plain = place.folder.write("plain.toml", wall());
    for (cave, args) in [(&place.cave, &[][..]), (&plain, &["--record", thesis.as_str()])] {
        let fixed = ["cave", &place.scene, "--cave", cave, "--no-pictures", "--duration", "0.1", "--no-realtime"];
        let out = in_place(&place.folder, &[&fixed[..], args].concat()).output().unwrap();
        let wrong = String::from_utf8_lossy(&out.stderr);
        assert_eq!(out.status.code(), Some(2), "{wrong}");
        assert!(wrong.contains("thesis.tex: is no recording of tumble and is not overwritten"), "{wrong}");
        assert_eq!(std::fs::read_to_string(&thesis).unwrap(), "years of work");
    }
    place.assert_clean();
}

/// A limit of file sizes stands for a full disk. Frames go by UDP, because shared memory consists of
/// files too.
#[test]
fn a_full_disk_ends_the_recording_and_not_the_show() {
    let place = Place::new("cave-full-recording", &wall());
    let (record, summary) = (place.path("run.mcap"), place.path("summary.json"));
    let mut command = Command::new("sh");
    // a write beyond the limit (in 512 bytes) gives an error instead of a signal
    command.args(["-c", "trap '' XFSZ; ulimit -f 60; exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_tumble")]);
    command.args(["cave", &place.scene, "--cave", &place.cave, "--transport", "udp", "--no-pictures", "--no-realtime"]);
    command.args(["--duration", "3", "--record", &record, "--summary", &summary]);
    command.env("XDG_RUNTIME_DIR", place.folder.path("run"));
    let out = command.stdin(Stdio::null()).output().unwrap();
    let wrong = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(1), "{wrong}");
    assert!(wrong.contains("run.mcap") && wrong.contains("the recording ends here, and the run goes on"), "{wrong}");
    assert!(wrong.contains("error: recording: "), "{wrong}");
    let summary = json(&place.folder.path("summary.json"));
    assert_eq!((&summary["frames"], &summary["facets"][0]["presented"]), (&301.into(), &301.into()));
    // what was recorded is kept
    let mut reader = SessionReader::open(&record).unwrap();
    let mut frames = 0;
    while let Ok(Some(_)) = reader.next_frame() {
        frames += 1;
    }
    assert!((10..301).contains(&frames), "{frames}");
    place.assert_clean();
}

#[test]
fn a_summary_that_cannot_be_written_is_printed() {
    let place = Place::new("cave-full-summary", &wall());
    let args = ["--no-pictures", "--no-realtime", "--duration", "0.1", "--quiet", "--summary", "/dev/full"];
    let (code, _, wrong) = place.start("cave", &args).end();
    assert_eq!(code, Some(1), "{wrong}");
    let (begin, end) = (wrong.find('{').unwrap(), wrong.rfind('}').unwrap());
    let summary: serde_json::Value = serde_json::from_str(&wrong[begin..=end]).unwrap();
    assert_eq!(summary["frames"], 11);
    assert!(wrong.contains("writing /dev/full"), "{wrong}");
}
