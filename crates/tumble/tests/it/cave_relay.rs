//! Sealed datagrams of a tracker: only those of a relay with the key move anybody.

use crate::cave_place::*;
use crate::common::*;
use rustix::process::Signal;
use std::net::UdpSocket;
use std::os::unix::fs::PermissionsExt;
use std::process::Stdio;
use std::time::Duration;

/// A head pose by the bytes of the specification (Open Sound Control 1.0).
fn pose(x: f32) -> Vec<u8> {
    let text = [&b"/tumble/user/u/head\0"[..], b",fffffff\0\0\0\0"].concat();
    let numbers = [x, 0.0, 1.5, 0.0, 0.0, 0.0, 1.0];
    [text, numbers.iter().flat_map(|x| x.to_be_bytes()).collect()].concat()
}

fn free_port() -> u16 {
    UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port()
}

fn make_key(folder: &Folder, name: &str, digit: &str) {
    let path = folder.write(name, digit.repeat(64));
    std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o600)).unwrap();
}

#[test]
fn a_sealed_tracker_hears_relays_with_the_key_alone() {
    let (at, beside) = (free_port(), free_port());
    let tables = format!("[security]\nkey_file = \"cave.key\"\n[tracker]\nsealed = true\nport = {at}\n");
    let place = Place::new("cave-relay", &(wall() + &tables));
    make_key(&place.folder, "cave.key", "1");
    make_key(&place.folder, "other.key", "2");
    let other = place.folder.write("other.toml", (wall() + &tables).replace("cave.key", "other.key"));
    let summary = place.path("summary.json");
    let run = place.start("cave", &["--no-pictures", "--log-dir", &place.path("out"), "--summary", &summary]);
    place.wait_for("out", "r", 5);
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let relay = |cave: &str| {
        let (to, listen) = (format!("127.0.0.1:{at}"), format!("127.0.0.1:{beside}"));
        let mut command = in_place(&place.folder, &["relay", "--cave", cave, "--to", &to, "--listen", &listen]);
        crate::desktop::Running(command.stdin(Stdio::null()).stderr(Stdio::null()).spawn().unwrap())
    };
    // directly, and by a relay with another key
    let forged = relay(&other);
    for k in 0..50 {
        [at, beside].iter().for_each(|port| _ = socket.send_to(&pose(0.001 * k as f32), ("127.0.0.1", *port)));
        std::thread::sleep(Duration::from_millis(20));
    }
    drop(forged);
    // by a relay with the key, which takes some time to connect
    let genuine = relay(&place.cave);
    for k in 0..150 {
        // an error is that of an earlier datagram, before the relay listened
        let _ = socket.send_to(&pose(0.001 * k as f32), ("127.0.0.1", beside));
        std::thread::sleep(Duration::from_millis(20));
    }
    signal(genuine.0.id() as i32, Signal::INT);
    signal(run.pid(), Signal::INT);
    let (code, said, wrong) = run.end();
    assert_eq!(code, Some(0), "{wrong}");
    assert!(wrong.contains("from relays with the key file"), "{wrong}");
    let tracker = json(&place.folder.path("summary.json"))["tracker"].clone();
    let (taken, datagrams) = (tracker["taken"].as_u64().unwrap(), tracker["datagrams"].as_u64().unwrap());
    // none of the 100 of the first part, most of the 150 of the second
    assert!((30..=150).contains(&taken) && taken == datagrams, "{tracker}");
    // the handshakes of the wrong relay, and the plain datagrams, which have another beginning
    assert!(tracker["dropped"]["forged"].as_u64() > Some(0), "{tracker}");
    assert!(tracker["dropped"]["foreign"].as_u64() >= Some(45), "{tracker}");
    assert!(said.contains("tracker: "), "{said}");
    place.assert_clean();
}

#[test]
fn a_relay_needs_a_key_and_a_sender() {
    let place = Place::new("cave-relay-refused", &wall());
    let to = ["--to", "127.0.0.1:1"];
    let wrong = fail(&[&["relay", "--cave", &place.cave], &to[..]].concat(), 2);
    assert!(wrong.contains("no [security] with a key_file"), "{wrong}");
    make_key(&place.folder, "cave.key", "1");
    let cave = place.folder.write("keyed.toml", wall() + "[security]\nkey_file = \"cave.key\"\n");
    let wrong = fail(&[&["relay", "--cave", &cave, "--listen", "0.0.0.0:0"], &to[..]].concat(), 2);
    assert!(wrong.contains("--from IP"), "{wrong}");
}
