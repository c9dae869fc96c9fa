//! Hostile bytes: only valid messages have an effect, and no message causes unbounded growth.

use super::simulated_session::{MS, SCENE, Stage, scene, viewer};
use crate::support::Dice;
use tumble_net::sync::messages::{FacetCounts, FrameAck, Join, Refusal};
use tumble_net::sync::simulated_network::NetworkConditions;
use tumble_net::sync::table::Snapshot;
use tumble_net::sync::transport::LinkEvent;
use tumble_net::sync::wire::{HEADER_BYTES, MessageError, MessageHeader, MessageKind, message, open};
use tumble_net::sync::{
    Content, FacetOptions, FacetSession, Input, Mirror, Publisher, ServerSession, SyncMode, Viewer,
};

fn header(kind: MessageKind) -> MessageHeader {
    MessageHeader { kind, run: 1, join: 2, frame: 3, time_s: 0.5 }
}

fn slow(short: u64, long: u64) -> u64 {
    if std::env::var_os("TUMBLE_SLOW").is_some() { long } else { short }
}

/// Returns valid payloads, one per parser.
fn payloads() -> Vec<Vec<u8>> {
    let write = |f: &dyn Fn(&mut Vec<u8>)| {
        let mut out = Vec::new();
        f(&mut out);
        out
    };
    let (mut world, mut publisher) = (scene(), Publisher::new(&scene(), false, 0));
    let shape = tumble_core::collide::Shape::sphere(0.2).unwrap();
    world.add(tumble_core::RigidBody::new(shape).with_name("guest").with_mass(1.0)).unwrap();
    let published = publisher.publish(&world, &viewer(1), 3).unwrap();
    let pose = tumble_core::collide::Pose::translation(1.0, 2.0, 3.0);
    let input = Input {
        sequence: 7,
        user: 0,
        head: Some(pose),
        wand: Some(pose),
        hands: [None, Some(pose)],
        buttons: 1,
        keys: vec![4, 5],
    };
    let done =
        FrameAck { hash: [1; 16], image: [2; 16], took_us: 3, input_us: Some(4), received_us: None, completed_us: 5 };
    let join = Join { scene: SCENE, name: "front".into(), content: Content::Exact };
    vec![
        publisher.snapshot().to_vec(),
        published.state,
        write(&|out| viewer(1).write(out)),
        write(&|out| join.write(out)),
        write(&|out| done.write(out)),
        write(&|out| FacetCounts { shown: 1, ..FacetCounts::default() }.write(out)),
        write(&|out| input.write(out)),
        write(&|out| Refusal("no".into()).write(out)),
    ]
}

/// Runs every parser on the same bytes; returns whether any accepted them.
fn parse_all(bytes: &[u8], mirror: &mut Mirror) -> bool {
    let all = [
        open(bytes).is_ok(),
        Snapshot::parse(bytes).is_ok(),
        Viewer::read(bytes).is_ok(),
        Join::read(bytes).is_ok(),
        FrameAck::read(bytes).is_ok(),
        FacetCounts::read(bytes).is_ok(),
        Input::read(bytes).is_ok(),
        Refusal::read(bytes).is_ok(),
        mirror.apply_state(3, 0.0, bytes).is_ok(),
    ];
    all.contains(&true)
}

#[test]
fn what_is_written_is_read_back() {
    let pose = tumble_core::collide::Pose::translation(1.0, -2.0, 3.0);
    let mut out = Vec::new();
    let input = Input {
        sequence: u64::MAX,
        user: 3,
        head: None,
        wand: Some(pose),
        hands: [Some(pose), None],
        buttons: 5,
        keys: vec![1, 65535],
    };
    input.write(&mut out);
    assert_eq!(Input::read(&out), Ok(input));
    let bytes = message(&header(MessageKind::Input), |m| m.extend(&out));
    assert_eq!(open(&bytes), Ok((header(MessageKind::Input), &out[..])));
    assert_eq!(&bytes[..7], b"Engine\0");
    assert_eq!(
        u64::from_le_bytes(bytes[64..72].try_into().unwrap()),
        bytes.len() as u64,
        "the thesis's size: of the whole message"
    );
    let mut out = Vec::new();
    Refusal("a\nb".into()).write(&mut out);
    assert_eq!(Refusal::read(&out).unwrap().0, "a b");
}

/// Any flipped bit and any truncation is detected: the checks cover all of a message.
#[test]
fn any_damage_to_a_message_is_found() {
    let good = message(&header(MessageKind::Ready), |out| out.extend([5; 36]));
    for bit in 0..8 * good.len() {
        let mut bad = good.clone();
        bad[bit / 8] ^= 1 << (bit % 8);
        assert!(open(&bad).is_err(), "bit {bit}");
    }
    for length in 0..good.len() {
        assert!(matches!(open(&good[..length]), Err(MessageError::Truncated { .. })), "{length} bytes");
    }
    assert!(matches!(open(&[&good[..], &[0]].concat()), Err(MessageError::Oversize { .. })));
    let mut not_finite = header(MessageKind::State);
    not_finite.time_s = f64::NAN;
    assert!(matches!(open(&message(&not_finite, |_| {})), Err(MessageError::Malformed(_))));
}

/// Counts and lengths beyond the available bytes are refused without an allocation.
#[test]
fn counts_are_not_believed() {
    let huge = [&1u32.to_le_bytes()[..], &[0; 4], &u32::MAX.to_le_bytes()].concat();
    assert!(Snapshot::parse(&huge).is_err());
    let many = [&1u32.to_le_bytes()[..], &[0; 4], &100_000u32.to_le_bytes()].concat();
    assert!(Snapshot::parse(&many).is_err());
    let snapshot = &payloads()[0];
    let mut long = snapshot.clone();
    let name = u32::from_le_bytes(long[12..16].try_into().unwrap()) as usize;
    let size = 16 + name; // behind the name's length and the name
    long[size..size + 8].copy_from_slice(&u64::MAX.to_le_bytes());
    assert!(Snapshot::parse(&long).is_err());
    for length in [0, u32::MAX] {
        let mut long = snapshot.clone();
        long[12..16].copy_from_slice(&length.to_le_bytes());
        assert!(Snapshot::parse(&long).is_err(), "a name of {length} bytes");
    }
    let mut mirror = Mirror::new(scene());
    mirror.apply_snapshot(snapshot).unwrap();
    let state = &payloads()[1];
    mirror.apply_state(3, 0.0, state).unwrap();
    let before = mirror.hash();
    for (at, value) in [(4, u32::MAX), (4, 0), (8, 1), (12, u32::MAX), (12, 0x7fff_ffff), (0, 99)] {
        let mut bad = state.clone();
        bad[at..at + 4].copy_from_slice(&u32::to_le_bytes(value));
        assert!(mirror.apply_state(9, 1.0, &bad).is_err(), "{value} at {at}");
        assert!(mirror.hash() == before && mirror.frame() == 3, "nothing has changed");
    }
}

/// Random bytes, and valid messages with random damage to the payload under a valid hash: no panic,
/// and refused messages change nothing.
#[test]
fn a_million_random_packets_full_length() {
    let (mut dice, payloads) = (Dice(9), payloads());
    let mut mirror = Mirror::new(scene());
    mirror.apply_snapshot(&payloads[0]).unwrap();
    let (mut taken, count) = (0, slow(20_000, 1_000_000));
    for k in 0..count {
        let mut bytes = payloads[k as usize % payloads.len()].clone();
        match dice.below(4) {
            0 => bytes = (0..dice.below(300)).map(|_| dice.below(256) as u8).collect(),
            1 => bytes.truncate(dice.below(bytes.len() as u64 + 1) as usize),
            _ => {
                for _ in 0..1 + dice.below(4) {
                    let at = dice.below(bytes.len() as u64) as usize;
                    bytes[at] = dice.below(256) as u8;
                }
            }
        }
        let before = mirror.hash();
        let taken_now = parse_all(&bytes, &mut mirror);
        taken += u64::from(taken_now);
        assert!(taken_now || mirror.hash() == before);
        if k % 50 == 0 {
            let revision = mirror.revision();
            assert!(mirror.apply_snapshot(&bytes).is_ok() || mirror.revision() == revision);
            mirror.apply_snapshot(&payloads[0]).unwrap();
        }
    }
    assert!(taken > count / 100 && taken < count, "{taken} of {count} were still good by chance");
}

/// A running session receives valid headers with damaged payloads, and old and foreign messages.
/// The frames that are shown stay right.
#[test]
fn a_session_under_fire_stays_true() {
    let (mut stage, mut dice, payloads) =
        (Stage::new(8, NetworkConditions::PERFECT, 2, SyncMode::Lockstep), Dice(3), payloads());
    stage.run(100 * MS);
    for _ in 0..slow(2000, 50_000) {
        let payload = &payloads[dice.below(payloads.len() as u64) as usize];
        let near = stage.server.as_ref().unwrap().frame().unwrap().wrapping_add(dice.below(5)).wrapping_sub(2);
        let head = MessageHeader {
            kind: MessageKind::ALL[dice.below(MessageKind::ALL.len() as u64) as usize],
            run: 99,
            join: dice.below(3),
            frame: near,
            time_s: 0.0,
        };
        let bytes = message(&head, |out| out.extend(payload));
        let now = stage.now;
        stage.server.as_mut().unwrap().on_event(now, dice.below(3) as u16, LinkEvent::Message, &bytes);
        stage.facets[dice.below(2) as usize].session.as_mut().unwrap().on_event(
            now,
            LinkEvent::Message,
            bytes.clone().into(),
        );
        stage.tick();
    }
    stage.run(100 * MS);
    stage.assert_true();
    let counts = stage.facets[0].session.as_ref().unwrap().counts();
    assert!(counts.stale > 0 && counts.refused > 0 && counts.lost == 0, "{counts:?}");
    assert!(stage.facets[0].shown.len() > 10);
}

/// The server counts invalid messages of a joined facet by reason.
#[test]
fn refusals_are_counted_by_reason() {
    let mut server =
        ServerSession::new(Stage::new(1, NetworkConditions::PERFECT, 1, SyncMode::Lockstep).options, &scene());
    let mut facet = FacetSession::new(FacetOptions::new("facet 0", SCENE, 1), scene());
    facet.advance(MS);
    let join = facet.outgoing().remove(0).1;
    let (ours, _) = open(&join).unwrap();
    let mut shoot = |bytes: &[u8]| {
        server.on_event(MS, 0, LinkEvent::Message, bytes);
        server.counts(0).0
    };
    assert_eq!(shoot(&join).joined, 1);
    assert_eq!((shoot(&join).joined, shoot(&join).duplicate), (1, 0), "it asks again while there is no frame");
    let mut flipped = join.clone();
    flipped[HEADER_BYTES + 1] ^= 1;
    assert_eq!(shoot(&flipped).torn, 1);
    assert_eq!(shoot(&join[..HEADER_BYTES]).refused, 1);
    assert_eq!(shoot(&message(&MessageHeader { run: 1, ..ours }, |_| {})).refused, 2, "JOIN without a payload");
    assert_eq!(
        shoot(&message(&MessageHeader { kind: MessageKind::State, run: 1, ..ours }, |_| {})).refused,
        3,
        "STATE is the server's"
    );
    assert_eq!(
        shoot(&message(&MessageHeader { kind: MessageKind::Heartbeat, run: 2, ..ours }, |_| {})).stale,
        1,
        "another run"
    );
    let done = FrameAck::default();
    assert_eq!(
        shoot(&message(&MessageHeader { kind: MessageKind::Ready, run: 1, frame: 77, ..ours }, |out| done.write(out)))
            .stale,
        2,
        "a frame that never was"
    );
}
