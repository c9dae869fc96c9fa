//! The summary of a run contains its measurements and counts. The test's own facets are late by a
//! known time, and packets have known faults.

use crate::cave_place::{cave_of, in_place, make_runtime};
use crate::cave_users::{SCENE, Server};
use crate::common::{Folder, json, text};
use std::net::UdpSocket;
use std::time::{Duration, Instant};
use tumble::net::sync::udp::UdpFacet;
use tumble::net::sync::{Facet, Input, Task};

const PATIENCE: Duration = Duration::from_secs(60);
/// Delay of the second facet after the first, for each frame.
const LATER: Duration = Duration::from_millis(40);

/// Draws a pending frame at once. Returns whether a frame is to be shown now.
fn is_to_present(facet: &mut Facet<UdpFacet>) -> bool {
    match facet.next(Duration::from_millis(2)).unwrap() {
        Task::Draw => {
            if facet.begin().is_some() {
                facet.drawn([0; 16]).unwrap();
            }
            false
        }
        Task::Present(_) => true,
        Task::Wait(_) => false,
        Task::Ended(why) => panic!("{why:?}"),
    }
}

#[test]
fn the_summary_has_the_delay_of_a_facet_and_the_refused_packets() {
    let folder = Folder::new("cave-figures");
    let sync = "transport = \"udp\"\nready_timeout_ms = 5000\ndrop_timeout_ms = 5000\nconnect_timeout_ms = 60000";
    let screens =
        [("f", ["[-2, 2, 0.5]", "[0, 2, 0.5]", "[-2, 2, 2.0]"]), ("g", ["[0, 2, 0.5]", "[2, 2, 0.5]", "[0, 2, 2.0]"])];
    let cave = folder.write("cave.toml", cave_of(&screens, |_| "size_px = [80, 60]".into(), sync));
    let (scene, summary) = (folder.write("scene.toml", SCENE), folder.path("summary.json"));
    make_runtime(&folder);
    let mut server = Server::start(&folder, &scene, &cave, &["--summary", &text(&summary)]);
    let mut second = server.another("g", 1, &scene);
    let (mut shown, mut ready, start) = (0, [false; 2], Instant::now());
    while shown < 12 {
        assert!(start.elapsed() < PATIENCE, "{shown} frames came");
        ready[0] |= !ready[0] && is_to_present(&mut server.facet);
        ready[1] |= !ready[1] && is_to_present(&mut second);
        if ready == [true; 2] {
            shown += 1;
            server
                .facet
                .send_input(&Input {
                    sequence: shown,
                    user: 0,
                    head: None,
                    wand: None,
                    hands: [None; 2],
                    buttons: 0,
                    keys: Vec::new(),
                })
                .unwrap();
            server.facet.presented().unwrap();
            std::thread::sleep(LATER);
            second.presented().unwrap();
            ready = [false; 2];
        }
    }
    // from unknown peers: too short for a header, longer than any datagram, of another protocol
    let stranger = UdpSocket::bind("127.0.0.1:0").unwrap();
    let wrong = [(3, 5), (2, 1300), (4, 40)];
    wrong.iter().for_each(|(times, length)| {
        (0..*times).for_each(|_| _ = stranger.send_to(&vec![0; *length], server.address).unwrap())
    });
    second.leave().unwrap();
    server.end();
    let figures = json(&summary);
    assert_eq!(figures["unknown_peers"], serde_json::json!({ "truncated": 3, "oversize": 2, "foreign": 4 }));
    let ms = |what: &str| figures[what]["p50_ms"].as_f64().unwrap();
    // an input at one frame is shown by the next, and both wait for the second facet
    let later = 1e3 * LATER.as_secs_f64();
    assert!(ms("skew") > later - 5.0 && ms("skew") <= figures["barrier"]["max_ms"].as_f64().unwrap(), "{figures}");
    assert!(
        ms("input_to_picture") > 2.0 * later - 5.0
            && ms("input_to_picture") <= 1e3 * figures["wall_s"].as_f64().unwrap(),
        "{figures}"
    );
    assert_eq!(figures["facets"][1]["refused_packets"], serde_json::json!({}));
}

/// A tracker port that other machines reach needs a list of senders: datagrams of trackers are not
/// encrypted.
#[test]
fn a_tracker_port_for_other_machines_needs_a_list_of_senders() {
    let (folder, scene, cave) = crate::cave_users::place("cave-tracker-open");
    let run = |more: &[&str]| {
        let args = ["serve", &scene, "--cave", &cave, "--connect-timeout", "0.2", "--tracker"];
        let out = in_place(&folder, &[&args, more].concat()).output().unwrap();
        (out.status.code(), String::from_utf8(out.stderr).unwrap())
    };
    let (code, said) = run(&["0.0.0.0:0"]);
    assert!(
        code == Some(2) && said.contains("reachable from other machines") && said.contains("--tracker-from"),
        "{said}"
    );
    let (code, said) = run(&["0.0.0.0:0", "--tracker-from", "10.0.0.7,10.0.0.8"]);
    assert!(code == Some(1) && said.contains("from 10.0.0.7, 10.0.0.8") && said.contains("did not join"), "{said}");
    let (code, said) = run(&["127.0.0.1:0"]);
    assert!(code == Some(1) && said.contains("from this machine"), "{said}");
}
