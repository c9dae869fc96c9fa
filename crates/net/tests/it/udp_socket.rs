//! Real sockets on loopback, and the key file.

use crate::support::Scratch;
use std::time::{Duration, Instant};
use tumble_net::sync::transport::*;
use tumble_net::sync::udp::{SharedKey, Timing, UdpFacet, UdpServer};

fn until(mut so: impl FnMut() -> bool) {
    let end = Instant::now() + Duration::from_secs(20);
    while !so() {
        assert!(Instant::now() < end, "not so within 20 s");
    }
}

#[test]
fn sockets_on_loopback_carry_long_and_short_messages_both_ways() {
    let key = || Some(SharedKey::new([3; 32]));
    let mut server = UdpServer::bind(([127, 0, 0, 1], 0).into(), 2, key(), Timing::default()).unwrap();
    let address = server.address().unwrap();
    let mut facets = [0, 1].map(|facet| UdpFacet::connect(address, facet, key(), Timing::default()).unwrap());
    let mut stranger = UdpFacet::connect(address, 0, Some(SharedKey::new([4; 32])), Timing::default()).unwrap();
    let (wait, mut message) = (Duration::from_millis(10), Vec::new());
    let mut lent = Message::default();
    let mut opened = 0;
    until(|| {
        opened +=
            u8::from(server.recv(wait, &mut message).unwrap().is_some_and(|(_, event)| event == LinkEvent::Opened));
        opened == 2
    });
    for facet in &mut facets {
        until(|| facet.recv(wait, &mut lent).unwrap() == Some(LinkEvent::Opened));
    }
    let long: Vec<u8> = (0..2_000_000u32).map(|k| (k.wrapping_mul(k) >> 7) as u8).collect();
    assert_eq!(server.send_all(&[0, 1], Delivery::Reliable, &long).unwrap(), 2);
    for (k, facet) in facets.iter_mut().enumerate() {
        until(|| facet.recv(wait, &mut lent).unwrap() == Some(LinkEvent::Message));
        assert!(*lent == *long);
        assert!(facet.send(Delivery::Reliable, &[k as u8 + 1]).unwrap());
        until(|| server.recv(wait, &mut message).unwrap() == Some((k as u16, LinkEvent::Message)));
        assert_eq!(message, [k as u8 + 1]);
    }
    // The other key: no answer, no connection, and the reason is counted.
    until(|| {
        assert_eq!(stranger.recv(wait, &mut lent).unwrap(), None);
        server.unknown_peers().refused_for(Refused::Forged) > 0
    });
    assert_eq!((stranger.counters().bytes_in, stranger.counters().opened), (0, 0));
    // A facet that ends says so.
    let [first, second] = facets;
    drop(first);
    until(|| server.recv(wait, &mut message).unwrap() == Some((0, LinkEvent::Closed(Closed::ByPeer))));
    drop(server);
    let mut second = second;
    until(|| second.recv(wait, &mut lent).unwrap() == Some(LinkEvent::Closed(Closed::ByPeer)));
}

#[test]
fn without_a_key_only_loopback_is_used_and_that_is_said() {
    let server = UdpServer::bind(([127, 0, 0, 1], 0).into(), 1, None, Timing::default()).unwrap();
    assert!(server.describe().contains("no key: serves this machine only"), "{}", server.describe());
    for refused in [
        UdpServer::bind(([0, 0, 0, 0], 0).into(), 1, None, Timing::default()).err(),
        UdpFacet::connect(([192, 0, 2, 1], 7700).into(), 0, None, Timing::default()).err(),
    ] {
        let why = refused.expect("an address that is not loopback").to_string();
        assert!(why.contains("without a key only this machine's own addresses"), "{why}");
    }
}

#[cfg(unix)]
#[test]
fn a_key_file_is_checked() {
    use std::os::unix::fs::PermissionsExt;
    let scratch = Scratch::new("key");
    let path = scratch.file("cave.key");
    let read = |text: &[u8], mode| {
        let _ = std::fs::remove_file(&path); // a mode of the round before may forbid writing
        std::fs::write(&path, text).unwrap();
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(mode)).unwrap();
        SharedKey::read(&path).map_err(|why| why.to_string())
    };
    let good = "0123456789abcdefABCDEF00".repeat(3)[..64].to_owned() + "\n";
    assert!(read(good.as_bytes(), 0o600).is_ok() && read(good.as_bytes(), 0o400).is_ok());
    for (text, mode, what) in [
        (good.as_str(), 0o640, "mode 640 lets others read it; run: chmod 600"),
        ("0123", 0o600, "4 digits; expected are 64 hexadecimal digits"),
        (&good.replace('b', "g"), 0o600, "is no hexadecimal digit"),
        (&"0".repeat(64), 0o600, "all zeros"),
        (&"0".repeat(1000), 0o600, "1000 bytes long"),
    ] {
        let why = read(text.as_bytes(), mode).expect_err(what);
        assert!(why.contains(what) && why.contains("cave.key"), "{why}");
    }
    assert!(read(b"\xff\xfe", 0o600).expect_err("not text").contains("not text"));
    assert!(SharedKey::read(&scratch.file("none")).expect_err("no file").to_string().contains("none"));
    assert_eq!(format!("{:?}", SharedKey::new([5; 32])), "SharedKey(secret)");
}
