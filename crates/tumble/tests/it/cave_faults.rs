//! Caves under kill -9 and SIGSTOP: processes that go on, processes that come back, and files that
//! are left.

use crate::cave_place::*;
use crate::common::{fail, json, text};
use rustix::process::Signal;
use std::os::unix::fs::MetadataExt;
use std::process::Command;
use std::time::Duration;

#[test]
fn the_wall_goes_on_without_a_killed_facet_which_comes_back() {
    let place = Place::new("cave-kill", &wall());
    let run = place.start(
        "cave",
        &["--no-pictures", "--log-dir", &place.path("out"), "--restart", "--summary", &place.path("summary.json")],
    );
    place.wait_for("out", "r", 5);
    signal(run.facet("r"), Signal::KILL);
    let killed_at = *numbers(&place.log("out", "l")).last().unwrap();
    place.wait_for("out", "l", killed_at + 100);
    place.wait_for("out", "r", killed_at + 100);
    signal(run.pid(), Signal::TERM);
    let (code, _, wrong) = run.end();
    assert_eq!(code, Some(0), "{wrong}");
    assert!(wrong.contains("facet r ended (killed by signal 9)"), "{wrong}");
    let left = numbers(&place.log("out", "l"));
    // the facet that was not killed missed nothing
    assert_eq!(left, (0..left.len() as u64).collect::<Vec<_>>());
    let right = place.log("out", "r");
    let left = place.log("out", "l");
    right.iter().for_each(|line| assert_eq!(line["state"], left[line["frame"].as_u64().unwrap() as usize]["state"]));
    let facets = json(&place.folder.path("summary.json"))["facets"].clone();
    assert_eq!(
        (&facets[0]["joined"], &facets[1]["joined"], &facets[1]["mismatched"]),
        (&1.into(), &2.into(), &0.into())
    );
    place.assert_clean();
}

/// The process that stands by takes the place of a killed one, and another one stands by then. Its own end harms
/// nothing.
#[test]
fn a_process_that_stands_by_takes_the_place_of_a_killed_one() {
    let place = Place::new("cave-standby", &wall());
    let run = place.start(
        "cave",
        &["--offscreen", "--quality", "fastest", "--log-dir", &place.path("out"), "--restart", "--stand-by"],
    );
    place.wait_for("out", "r", 5);
    let of = |facet: &str| -> Vec<i32> {
        run.facets().into_iter().filter(|(name, pid)| name == facet && alive(*pid)).map(|(_, pid)| pid).collect()
    };
    wait("a second process of each facet", || of("l").len() == 2 && of("r").len() == 2);
    let [first, standby] = of("r")[..] else { panic!() };
    // what stands by shows nothing, and its end is no end of a facet
    let other = of("l")[1];
    signal(other, Signal::KILL);
    signal(first, Signal::KILL);
    let killed_at = *numbers(&place.log("out", "l")).last().unwrap();
    wait("a third process", || of("r").len() == 2 && of("r")[0] == standby);
    place.wait_for("out", "r", killed_at + 20);
    place.wait_for("out", "l", killed_at + 20);
    signal(run.pid(), Signal::TERM);
    let (code, _, wrong) = run.end();
    assert_eq!(code, Some(0), "{wrong}");
    assert!(wrong.contains("facet r ended (killed by signal 9)") && !wrong.contains("facet l ended"), "{wrong}");
    assert!(!alive(standby), "it is left");
    let states: std::collections::BTreeMap<u64, serde_json::Value> =
        place.log("out", "l").iter().map(|line| (line["frame"].as_u64().unwrap(), line["state"].clone())).collect();
    let right = place.log("out", "r");
    assert!(right.iter().all(|line| states[&line["frame"].as_u64().unwrap()] == line["state"]));
    place.assert_clean();
}

#[test]
fn a_frozen_facet_is_dropped_and_comes_back_when_it_goes_on() {
    let place = Place::new("cave-freeze", &wall());
    let run = place
        .start("cave", &["--no-pictures", "--log-dir", &place.path("out"), "--summary", &place.path("summary.json")]);
    place.wait_for("out", "r", 5);
    let frozen = run.facet("r");
    signal(frozen, Signal::STOP);
    let at = *numbers(&place.log("out", "l")).last().unwrap();
    place.wait_for("out", "l", at + 150);
    signal(frozen, Signal::CONT);
    place.wait_for("out", "r", at + 150);
    signal(run.pid(), Signal::INT);
    let (code, _, wrong) = run.end();
    assert_eq!(code, Some(0), "{wrong}");
    assert!(wrong.contains("facet r is late") && wrong.contains("facet r was dropped; the others continue"), "{wrong}");
    let left = numbers(&place.log("out", "l"));
    assert_eq!(left, (0..left.len() as u64).collect::<Vec<_>>());
    let facets = json(&place.folder.path("summary.json"))["facets"].clone();
    assert_eq!(
        (&facets[0]["dropped"], &facets[1]["dropped"], &facets[1]["joined"]),
        (&0.into(), &1.into(), &2.into()),
        "{wrong}"
    );
    place.assert_clean();
}

#[test]
fn without_a_launcher_its_facets_end_and_others_wait_for_a_server_in_vain() {
    let place = Place::new("cave-orphans", &wall());
    let run = place.start("cave", &["--no-pictures", "--log-dir", &place.path("out")]);
    place.wait_for("out", "r", 5);
    let facets = run.facets();
    signal(run.pid(), Signal::KILL);
    wait("the end of all facets", || facets.iter().all(|(_, pid)| !alive(*pid)));
    drop(run);
    // the processes are started one by one, without `tumble cave`
    let server = place.start("serve", &["--quiet"]);
    let l = place.start(
        "facet",
        &["--facet", "l", "--no-pictures", "--log-dir", &place.path("hand"), "--connect-timeout", "10"],
    );
    let r = place.start(
        "facet",
        &["--facet", "r", "--no-pictures", "--log-dir", &place.path("hand"), "--connect-timeout", "60"],
    );
    place.wait_for("hand", "r", 5);
    place.wait_for("hand", "l", 5);
    signal(server.pid(), Signal::KILL);
    let (code, _, wrong) = l.end();
    assert_eq!(code, Some(1), "{wrong}");
    assert!(wrong.contains("facet l: lost its server") && wrong.contains("did not return for 10 s"), "{wrong}");
    // Ctrl-C while it waits is no failure
    signal(r.pid(), Signal::INT);
    let (code, _, wrong) = r.end();
    assert_eq!(code, Some(0), "{wrong}");
    // the next run removes the files that kill -9 left
    place.succeed("cave", &["--no-pictures", "--duration", "0.1", "--quiet"]);
    place.assert_clean();
}

/// A second process of a facet is refused; a process that replaces a killed one is accepted.
#[test]
fn a_facet_is_shown_by_one_process() {
    run_duplicates("shared_memory", 3..20);
}

/// The same over UDP, where the newest process has the connection first.
#[test]
fn a_facet_is_shown_by_one_process_over_udp() {
    run_duplicates("udp", 3..20);
}

fn run_duplicates(carrier: &str, joins: std::ops::Range<u64>) {
    let place = Place::new(&format!("cave-duplicates-{carrier}"), &wall());
    let server = place.start("serve", &["--transport", carrier, "--summary", &place.path("summary.json")]);
    let [l, r] = ["l", "r"].map(|name| {
        place.start(
            "facet",
            &["--facet", name, "--no-pictures", "--log-dir", &place.path("out"), "--connect-timeout", "60"],
        )
    });
    place.wait_for("out", "r", 5);
    let (code, _, wrong) = place
        .start(
            "facet",
            &["--facet", "l", "--no-pictures", "--log-dir", &place.path("second"), "--connect-timeout", "60"],
        )
        .end();
    assert!(code == Some(2) && wrong.contains("another process already shows facet 'l'"), "{code:?}: {wrong}");
    let at = *numbers(&place.log("out", "r")).last().unwrap();
    place.wait_for("out", "l", at);
    signal(l.pid(), Signal::KILL);
    let again = place.start(
        "facet",
        &["--facet", "l", "--no-pictures", "--log-dir", &place.path("third"), "--connect-timeout", "60"],
    );
    place.wait_for("third", "l", at + 5);
    signal(server.pid(), Signal::TERM);
    let (code, said, wrong) = server.end();
    assert_eq!(code, Some(0), "{wrong}");
    for facet in [again, r] {
        let (code, _, wrong) = facet.end();
        assert_eq!(code, Some(0), "{wrong}");
    }
    let summary = json(&place.folder.path("summary.json"));
    let (facet, frames) = (&summary["facets"][0], summary["frames"].as_u64().unwrap());
    // five if no process took the other's connection before it could answer; without end if none
    // was refused
    assert!(joins.contains(&facet["joined"].as_u64().unwrap()), "{facet}");
    let logged: std::collections::BTreeSet<u64> =
        ["out", "second", "third"].iter().flat_map(|folder| numbers(&place.log(folder, "l"))).collect();
    let shown = frames - facet["not_shown"].as_u64().unwrap();
    // the killed process may have logged a frame whose receipt it did not send
    assert!(
        shown + 1 >= logged.len() as u64 && shown <= facet["presented"].as_u64().unwrap() && said.contains("not shown"),
        "{shown}, {logged:?}: {said}"
    );
    assert_eq!(
        (&summary["facets"][1]["not_shown"], summary["facets"][1]["presented"].as_u64()),
        (&0.into(), Some(frames))
    );
}

/// A second Ctrl-C ends a run that waits for a facet without an answer, and kills the facet.
#[test]
fn a_second_signal_ends_a_run_at_once() {
    let place = Place::new("cave-forced", &wall());
    let run = place.start("cave", &["--no-pictures", "--log-dir", &place.path("out")]);
    place.wait_for("out", "r", 5);
    let facets = run.facets();
    signal(run.facet("r"), Signal::STOP);
    signal(run.pid(), Signal::INT);
    // directly after the first it would merge with it; in order it would take 3 s until the facet
    // is dropped
    std::thread::sleep(Duration::from_millis(800));
    signal(run.pid(), Signal::INT);
    let (code, said, wrong) = run.end();
    assert_eq!(code, Some(130), "{said}{wrong}");
    assert!(!wrong.contains("does not end and was killed"), "{wrong}");
    wait("the end of all facets", || facets.iter().all(|(_, pid)| !alive(*pid)));
    // the lock of the cave is free, and the next run removes the remaining files
    let locks = std::fs::read_dir(place.folder.path("run"))
        .unwrap()
        .flatten()
        .flat_map(|folder| std::fs::read_dir(folder.path()).unwrap().flatten());
    let locks: Vec<_> =
        locks.map(|file| file.file_name()).filter(|name| name.to_str().unwrap().starts_with("cave-")).collect();
    assert!(locks.is_empty(), "{locks:?}");
    place.succeed("cave", &["--no-pictures", "--duration", "0.1", "--quiet"]);
    place.assert_clean();
}

/// Kill -9 leaves the unfinished file; the next recording of that name removes it.
#[test]
fn the_next_recording_removes_the_file_of_a_killed_start() {
    let place = Place::new("cave-killed-start", &wall());
    let record = place.path("run.mcap");
    let hidden = || {
        std::fs::read_dir(place.folder.path(""))
            .unwrap()
            .flatten()
            .filter(|e| e.file_name().as_encoded_bytes().starts_with(b".run.mcap."))
            .count()
    };
    let start = || {
        let run = place.start("serve", &["--record", &record, "--connect-timeout", "60"]);
        wait("the recording", || hidden() == 1);
        run
    };
    let run = start();
    signal(run.pid(), Signal::KILL);
    let _ = run.end();
    assert_eq!(hidden(), 1);
    place.succeed("cave", &["--no-pictures", "--no-realtime", "--duration", "0.1", "--record", &record]);
    assert_eq!(hidden(), 0);
    place.assert_clean();
}

/// The files that processes of a run share are open to this user only: another user could truncate
/// one, which would crash every process that maps it. (The counter that iceoryx2 makes for all
/// users was such a file.)
#[test]
fn shared_files_are_open_to_no_other_user() {
    let place = Place::new("cave-private", &wall());
    let run = place
        .start("cave", &["--no-pictures", "--log-dir", &place.path("out"), "--summary", &place.path("summary.json")]);
    place.wait_for("out", "r", 5);
    let folder = std::fs::read_dir(place.folder.path("run"))
        .unwrap()
        .flatten()
        .map(|e| e.path())
        .find(|path| path.is_dir())
        .unwrap();
    let about = std::fs::metadata(&folder).unwrap();
    assert_eq!(about.mode() & 0o777, 0o700);
    let prefix = format!("tumble_{}_{}_", about.uid(), &blake3::hash(text(&folder).as_bytes()).to_hex()[..8]);
    let ours = |name: &str| {
        name.starts_with(&prefix) || name.starts_with(&format!("tumble_{}_", about.uid())) && name.ends_with(".wakeup")
    };
    let files: Vec<_> = std::fs::read_dir("/dev/shm")
        .unwrap()
        .flatten()
        .filter(|file| file.file_name().to_str().is_some_and(ours))
        .map(|file| file.path())
        .collect();
    // samples and services in both directions, connections of two facets, the wakeup counters
    assert!(files.len() >= 10, "{files:?}");
    for file in &files {
        // files of other tests may be gone by now, and a file under construction is even less
        // accessible
        assert!(std::fs::metadata(file).map_or(0, |about| about.mode()) & 0o077 == 0, "{}", file.display());
    }
    if about.uid() == 0 {
        for file in &files {
            let cut = Command::new("setpriv")
                .args(["--reuid", "65534", "--regid", "65534", "--clear-groups", "truncate", "-s", "0", "-c"])
                .arg(file)
                .output();
            assert!(cut.is_ok_and(|cut| !cut.status.success()) || !file.exists(), "{}", file.display());
        }
        let at = *numbers(&place.log("out", "r")).last().unwrap();
        place.wait_for("out", "r", at + 5);
    }
    signal(run.pid(), Signal::INT);
    let (code, _, wrong) = run.end();
    assert_eq!(code, Some(0), "{wrong}");
    place.assert_clean();
}

#[test]
fn an_unreachable_node_and_a_timeout_that_is_too_short_are_reported() {
    let place = Place::new("cave-nowhere", &wall());
    // not of the same family as the addresses of the server, and without a name lookup
    let nowhere = "2001:db8::1";
    let far = format!(
        "transport = \"udp\"\n[security]\nkey_file = \"cave.key\"\n[[node]]\nname = \"far\"\naddress = \"{nowhere}\"\nlaunch = [\"true\", \"{{arguments}}\"]\n"
    );
    let key = place.folder.write("cave.key", "1".repeat(64));
    std::fs::set_permissions(key, std::os::unix::fs::PermissionsExt::from_mode(0o600)).unwrap();
    let text = wall().replace("name = \"l\"\nscreen", "name = \"l\"\nnode = \"far\"\nscreen") + &far;
    assert!(text.contains("node = \"far\""));
    std::fs::write(&place.cave, text).unwrap();
    let (code, _, wrong) = place.start("cave", &["--no-pictures", "--connect-timeout", "5"]).end();
    assert_eq!(code, Some(2), "{wrong}");
    assert!(wrong.contains("node far: ") && wrong.contains(nowhere) && wrong.contains("--listen ADDR:PORT"), "{wrong}");
    place.assert_clean();
    let hasty = place.folder.write(
        "hasty.toml",
        wall()
            .replace("drop_timeout_ms = 500", "drop_timeout_ms = 2")
            .replace("ready_timeout_ms = 200", "ready_timeout_ms = 1"),
    );
    let wrong = fail(&["check", &hasty], 2);
    assert!(wrong.contains("drop_timeout_ms") && wrong.contains("100"), "{wrong}");
}

#[test]
fn a_facet_that_is_given_up_fails_the_run() {
    let place = Place::new("cave-given-up", &wall());
    let run = place.start("cave", &["--no-pictures", "--restart", "--log-dir", &place.path("out")]);
    let mut before = 0;
    // the first process, and five that are started again
    for _ in 0..6 {
        wait("frames of the facet", || place.log("out", "r").len() > before + 5);
        signal(run.facet("r"), Signal::KILL);
        before = place.log("out", "r").len();
    }
    // longer than the pause before a restart
    std::thread::sleep(Duration::from_secs(4));
    assert!(run.facets().iter().all(|(name, _)| name != "r"));
    let at = *numbers(&place.log("out", "l")).last().unwrap();
    place.wait_for("out", "l", at + 20);
    signal(run.pid(), Signal::INT);
    let (code, _, wrong) = run.end();
    assert_eq!(code, Some(1), "{wrong}");
    assert!(wrong.contains("r (given up after 5 restarts within a minute)"), "{wrong}");
    place.assert_clean();
}

/// A crash, as in a graphics driver, is a failure of the facet; a kill is not.
#[test]
fn a_facet_that_crashes_fails_the_run() {
    for (sent, code, said) in [(Signal::ABORT, 1, "r (killed by signal 6) ended by a failure"), (Signal::KILL, 0, "")] {
        let place = Place::new("cave-crash", &wall());
        let run = place.start("cave", &["--no-pictures", "--log-dir", &place.path("out")]);
        place.wait_for("out", "r", 5);
        signal(run.facet("r"), sent);
        let at = *numbers(&place.log("out", "l")).last().unwrap();
        place.wait_for("out", "l", at + 100);
        signal(run.pid(), Signal::INT);
        let (ended, _, wrong) = run.end();
        assert_eq!(ended, Some(code), "{wrong}");
        assert!(wrong.contains(said), "{wrong}");
        place.assert_clean();
    }
}

/// Both sides name a wrong key as a possible cause when no frame was shown.
#[test]
fn a_wrong_key_is_named() {
    use std::os::unix::fs::PermissionsExt;
    let key = |place: &Place, digit: &str| {
        let path = place.folder.write("cave.key", digit.repeat(64));
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o600)).unwrap();
    };
    let place = Place::new("cave-key", &(wall() + "transport = \"udp\"\n[security]\nkey_file = \"cave.key\"\n"));
    key(&place, "1");
    let server = place.start("serve", &["--connect-timeout", "60", "--listen", "127.0.0.1:0"]);
    // the key is read before the lock is taken, and the lock file gets the address last
    wait("the address", || lines(place.folder.path("run")).contains("127.0.0.1"));
    key(&place, "2");
    let (code, _, wrong) = place.start("facet", &["--facet", "l", "--no-pictures", "--connect-timeout", "1"]).end();
    assert!(code == Some(1) && wrong.contains("no server answers") && wrong.contains("another key file"), "{wrong}");
    signal(server.pid(), Signal::TERM);
    let (code, _, wrong) = server.end();
    assert!(code == Some(0) && wrong.contains("forged") && wrong.contains("another key file"), "{wrong}");
}

/// Returns the text of all small files of a folder and its subfolders.
fn lines(folder: std::path::PathBuf) -> String {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    entries
        .map(
            |e| if e.path().is_dir() { lines(e.path()) } else { std::fs::read_to_string(e.path()).unwrap_or_default() },
        )
        .collect()
}
