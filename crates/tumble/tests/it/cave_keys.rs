//! Runs over UDP without a key file, which only processes of this user can join.

use crate::cave_place::*;
use crate::common::*;
use rustix::process::Signal;
use std::time::{Duration, Instant};
use tumble::net::sync::transport::FacetLink;
use tumble::net::sync::transport::Message;
use tumble::net::sync::udp::{SharedKey, Timing, UdpFacet};

#[test]
fn without_a_key_file_a_run_is_closed_to_other_users() {
    let place = Place::new("cave-run-key", &wall());
    let log = place.path("out");
    let summary = place.path("summary.json");
    let server = place
        .start("serve", &["--transport", "udp", "--connect-timeout", "60", "--summary", &summary, "--duration", "1"]);
    let key = run_key(&place.folder);
    let address = run_info(&place.folder)["address"]["Udp"].as_str().unwrap().to_owned();
    // a stranger without the key gets no answer, with the key one does
    let opens = |key: Option<SharedKey>| {
        let mut link = UdpFacet::connect(address.parse().unwrap(), 0, key, Timing::default()).unwrap();
        let (start, mut message) = (Instant::now(), Message::default());
        while start.elapsed() < Duration::from_secs(2) {
            if link.recv(Duration::from_millis(50), &mut message).unwrap().is_some() {
                link.close();
                return true;
            }
        }
        false
    };
    assert!(!opens(None) && !opens(Some(SharedKey::new([7; 32]))));
    assert!(opens(Some(SharedKey::new(key))));
    // another user has another runtime folder, and cannot read this one
    let mut foreign = place.command(
        "facet",
        &["--facet", "l", "--no-pictures", "--server", &address, "--connect-timeout", "1", "--log-dir", &log],
    );
    std::fs::create_dir(place.folder.path("other")).unwrap();
    let out = foreign.env("XDG_RUNTIME_DIR", place.folder.path("other")).output().unwrap();
    let wrong = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(1), "{wrong}");
    assert!(wrong.contains("no run was in progress") && wrong.contains("by this user"), "{wrong}");
    // this user's facets find the key by themselves, with and without the address
    let by_address = place.start("facet", &["--facet", "l", "--no-pictures", "--server", &address, "--log-dir", &log]);
    let by_lock = place.start("facet", &["--facet", "r", "--no-pictures", "--log-dir", &log]);
    for process in [by_address, by_lock, server] {
        let (code, _, wrong) = process.end();
        assert_eq!(code, Some(0), "{wrong}");
    }
    assert!(json(&place.folder.path("summary.json"))["unknown_peers"]["forged"].as_u64() > Some(0));
    place.assert_clean();
}

#[test]
fn a_key_of_a_run_is_that_of_no_other_run_and_readable_by_no_other_user() {
    let place = Place::new("cave-run-keys", &wall());
    let mut keys = Vec::new();
    for _ in 0..2 {
        let server = place.start("serve", &["--transport", "udp", "--connect-timeout", "60"]);
        keys.push(run_key(&place.folder));
        let mode = |path: &std::path::Path| {
            std::os::unix::fs::PermissionsExt::mode(&std::fs::metadata(path).unwrap().permissions()) & 0o777
        };
        let lock = lock_file(&place.folder).unwrap();
        assert_eq!((mode(&lock), mode(lock.parent().unwrap())), (0o600, 0o700));
        signal(server.pid(), Signal::INT);
        assert_eq!(server.end().0, Some(0));
    }
    assert_ne!(keys[0], keys[1]);
    // shared memory needs none
    let server = place.start("serve", &["--connect-timeout", "60"]);
    wait("the address", || run_info(&place.folder)["address"]["Memory"].is_string());
    assert!(run_info(&place.folder)["key"].is_null());
    signal(server.pid(), Signal::INT);
    assert_eq!(server.end().0, Some(0));
}
