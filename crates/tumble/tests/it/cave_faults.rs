//! Caves under kill -9 and SIGSTOP: who goes on, who comes back, what is left.

use crate::cave_place::*;
use crate::common::json;
use rustix::process::Signal;

#[test]
fn the_wall_goes_on_without_a_killed_facet_which_comes_back() {
    let place = Place::new("cave-kill", &wall());
    let run = place.start("cave", &["--no-pictures", "--log-dir", &place.path("out"), "--restart", "--summary", &place.path("summary.json")]);
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
    // who was not killed missed nothing
    assert_eq!(left, (0..left.len() as u64).collect::<Vec<_>>());
    let right = place.log("out", "r");
    let left = place.log("out", "l");
    right.iter().for_each(|line| assert_eq!(line["state"], left[line["frame"].as_u64().unwrap() as usize]["state"]));
    let facets = json(&place.folder.path("summary.json"))["facets"].clone();
    assert_eq!((&facets[0]["joined"], &facets[1]["joined"], &facets[1]["mismatched"]), (&1.into(), &2.into(), &0.into()));
    place.assert_clean();
}

#[test]
fn a_frozen_facet_is_dropped_and_comes_back_when_it_goes_on() {
    let place = Place::new("cave-freeze", &wall());
    let run = place.start("cave", &["--no-pictures", "--log-dir", &place.path("out"), "--summary", &place.path("summary.json")]);
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
    assert!(wrong.contains("facet r is late") && wrong.contains("facet r is dropped; the others go on"), "{wrong}");
    let left = numbers(&place.log("out", "l"));
    assert_eq!(left, (0..left.len() as u64).collect::<Vec<_>>());
    let facets = json(&place.folder.path("summary.json"))["facets"].clone();
    assert_eq!((&facets[0]["dropped"], &facets[1]["dropped"], &facets[1]["joined"]), (&0.into(), &1.into(), &2.into()), "{wrong}");
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
    // by hand
    let server = place.start("serve", &["--quiet"]);
    let l = place.start("facet", &["--facet", "l", "--no-pictures", "--log-dir", &place.path("hand"), "--wait", "10"]);
    let r = place.start("facet", &["--facet", "r", "--no-pictures", "--log-dir", &place.path("hand"), "--wait", "60"]);
    place.wait_for("hand", "r", 5);
    place.wait_for("hand", "l", 5);
    signal(server.pid(), Signal::KILL);
    let (code, _, wrong) = l.end();
    assert_eq!(code, Some(1), "{wrong}");
    assert!(wrong.contains("facet l: has lost its server") && wrong.contains("did not come back, 10 s long"), "{wrong}");
    // Ctrl-C while it waits is no failure
    signal(r.pid(), Signal::INT);
    let (code, _, wrong) = r.end();
    assert_eq!(code, Some(0), "{wrong}");
    // what kill -9 left is taken away by the next run
    place.succeed("cave", &["--no-pictures", "--seconds", "0.1", "--quiet"]);
    place.assert_clean();
}

/// A second process is refused; one that is started in place of a killed one is let in.
#[test]
fn a_facet_is_shown_by_one_process() {
    let place = Place::new("cave-rivals", &wall());
    let server = place.start("serve", &["--summary", &place.path("summary.json")]);
    let [l, r] = ["l", "r"].map(|name| place.start("facet", &["--facet", name, "--no-pictures", "--log-dir", &place.path("out"), "--wait", "60"]));
    place.wait_for("out", "r", 5);
    let (code, _, wrong) = place.start("facet", &["--facet", "l", "--no-pictures", "--log-dir", &place.path("second"), "--wait", "60"]).end();
    assert!(code == Some(2) && wrong.contains("another process shows facet 'l' and answers"), "{code:?}: {wrong}");
    let at = *numbers(&place.log("out", "r")).last().unwrap();
    place.wait_for("out", "l", at);
    signal(l.pid(), Signal::KILL);
    let again = place.start("facet", &["--facet", "l", "--no-pictures", "--log-dir", &place.path("third"), "--wait", "60"]);
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
    // five if nobody took the other's connection before it could speak; without end if nobody was refused
    assert!((3..20).contains(&facet["joined"].as_u64().unwrap()), "{facet}");
    let logged: std::collections::BTreeSet<u64> = ["out", "second", "third"].iter().flat_map(|folder| numbers(&place.log(folder, "l"))).collect();
    let shown = frames - facet["not_shown"].as_u64().unwrap();
    assert!(shown >= logged.len() as u64 && shown <= facet["presented"].as_u64().unwrap() && said.contains("not shown"), "{shown}, {logged:?}: {said}");
    assert_eq!((&summary["facets"][1]["not_shown"], summary["facets"][1]["presented"].as_u64()), (&0.into(), Some(frames)));
}

/// Both sides say what a wrong key looks like, though no frame was ever shown.
#[test]
fn a_wrong_key_is_named() {
    use std::os::unix::fs::PermissionsExt;
    let key = |place: &Place, digit: &str| {
        let path = place.folder.write("cave.key", digit.repeat(64));
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o600)).unwrap();
    };
    let place = Place::new("cave-key", &(wall() + "transport = \"udp\"\n[security]\nkey_file = \"cave.key\"\n"));
    key(&place, "1");
    let server = place.start("serve", &["--wait", "60", "--listen", "127.0.0.1:0"]);
    // the key is read before the lock is taken, and the lock names the address last
    wait("the address", || lines(place.folder.path("run")).contains("127.0.0.1"));
    key(&place, "2");
    let (code, _, wrong) = place.start("facet", &["--facet", "l", "--no-pictures", "--wait", "1"]).end();
    assert!(code == Some(1) && wrong.contains("no server answers") && wrong.contains("another key file"), "{wrong}");
    signal(server.pid(), Signal::TERM);
    let (code, _, wrong) = server.end();
    assert!(code == Some(0) && wrong.contains("forged") && wrong.contains("another key file"), "{wrong}");
}

/// The text of all small files of a folder and of those in it.
fn lines(folder: std::path::PathBuf) -> String {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    entries.map(|e| if e.path().is_dir() { lines(e.path()) } else { std::fs::read_to_string(e.path()).unwrap_or_default() }).collect()
}
