//! Refused input: another scene, name or version, another picture, a frame that does not fit.

use super::simulated_session::*;
use tumble_net::sync::messages::FrameAck;
use tumble_net::sync::simulated_network::NetworkConditions;
use tumble_net::sync::transport::LinkEvent;
use tumble_net::sync::wire;
use tumble_net::sync::{
    EndReason, FacetOptions, FacetSession, ServerEvent, ServerOptions, ServerSession, SyncMode, Task,
};

#[test]
fn other_scenes_names_and_versions_are_refused_by_name() {
    let refusal = |options: FacetOptions, spoil: fn(&mut Vec<u8>)| {
        let mut facet = FacetSession::new(options, scene());
        let mut server =
            ServerSession::new(Stage::new(1, NetworkConditions::PERFECT, 2, SyncMode::Lockstep).options, &scene());
        facet.advance(MS);
        for (_, mut bytes) in facet.outgoing() {
            spoil(&mut bytes);
            server.on_event(MS, 1, LinkEvent::Message, &bytes);
        }
        let reason = server
            .events()
            .into_iter()
            .find_map(|e| if let ServerEvent::Refused(1, why) = e { Some(why) } else { None })
            .unwrap();
        for out in server.outgoing() {
            facet.on_event(MS, LinkEvent::Message, out.message.to_vec().into());
        }
        (reason, facet.task())
    };
    let over = |why: &str| Task::Ended(EndReason::Refused(why.to_owned()));
    let (reason, task) = refusal(FacetOptions::new("facet 1", [8; 32], 1), |_| {});
    assert!(
        reason.contains(&"07".repeat(32)) && reason.contains(&"08".repeat(32)) && reason.contains("facet 1"),
        "{reason}"
    );
    assert_eq!(task, over(&reason));
    let (reason, task) = refusal(FacetOptions::new("left", SCENE, 1), |_| {});
    assert!(reason.contains("'facet 1'") && reason.contains("'left'"), "{reason}");
    assert_eq!(task, over(&reason));
    let (reason, _) = refusal(FacetOptions::new("facet 1", SCENE, 1), |bytes| bytes[76] = 8);
    assert!(reason.contains("version 8") && reason.contains("version 10"), "{reason}");
}

/// The hash of a facet that draws something else than was sent does not match, and the wall goes
/// on.
#[test]
fn a_facet_that_draws_something_else_is_detected() {
    let base = scene();
    let mut server =
        ServerSession::new(Stage::new(1, NetworkConditions::PERFECT, 1, SyncMode::Lockstep).options, &base);
    let mut facet = FacetSession::new(FacetOptions::new("facet 0", SCENE, 1), scene());
    let (mut wrong, mut shown) = (0, 0);
    for k in 1..400u32 {
        let now = k * MS;
        facet.advance(now);
        if facet.task() == Task::Draw && facet.begin().is_some() {
            facet.drawn(now, [0; 16]);
        }
        if let Task::Present(_) = facet.task() {
            facet.presented(now);
            shown += 1;
        }
        for (_, mut bytes) in facet.outgoing() {
            let (header, payload) = wire::open(&bytes).unwrap();
            if header.kind == wire::MessageKind::Ready && header.frame.is_multiple_of(3) {
                let mut done = FrameAck::read(payload).unwrap();
                done.hash[5] ^= 1;
                bytes = wire::message(&header, |out| done.write(out));
                wrong += 1;
            }
            server.on_event(now, 0, LinkEvent::Message, &bytes);
        }
        if server.is_idle() && server.all_critical_joined() {
            server.publish(now, &base, &viewer(0)).unwrap();
        }
        server.outgoing().iter().for_each(|out| facet.on_event(now, LinkEvent::Message, out.message.to_vec().into()));
    }
    assert!(shown > 50 && wrong > 15, "{shown} {wrong}");
    let reported = server
        .events()
        .iter()
        .filter(|e| matches!(e, ServerEvent::Ready(0, frame, _, false) if frame % 3 == 0))
        .count();
    assert_eq!((server.counts(0).0.mismatched, reported), (wrong, wrong as usize));
}

/// A frame that does not fit is refused, requested again, and shown once it is right.
#[test]
fn a_frame_that_does_not_fit_is_requested_again() {
    let base = scene();
    let mut server = ServerSession::new(
        ServerOptions {
            resend_interval: None,
            ..Stage::new(1, NetworkConditions::PERFECT, 1, SyncMode::Lockstep).options
        },
        &base,
    );
    let mut facet = FacetSession::new(FacetOptions::new("facet 0", SCENE, 1), scene());
    let mut spoilt = 0;
    for k in 1..100u32 {
        let now = k * MS;
        facet.advance(now);
        if facet.task() == Task::Draw && facet.begin().is_some() {
            facet.drawn(now, [0; 16]);
        }
        if let Task::Present(_) = facet.task() {
            facet.presented(now);
        }
        facet.outgoing().iter().for_each(|(_, bytes)| server.on_event(now, 0, LinkEvent::Message, bytes));
        if server.is_idle() && server.all_critical_joined() {
            server.publish(now, &base, &viewer(0)).unwrap();
        }
        for out in server.outgoing() {
            let (header, payload) = wire::open(&out.message).unwrap();
            let spoil = header.kind == wire::MessageKind::State && header.frame == 5 && spoilt == 0;
            let bytes = if spoil {
                wire::message(&header, |out| out.extend(&payload[..payload.len() - 1]))
            } else {
                out.message.to_vec()
            };
            spoilt += u32::from(spoil);
            facet.on_event(now, LinkEvent::Message, bytes.into());
        }
    }
    let counts = facet.counts();
    assert_eq!((spoilt, counts.refused, counts.missing, server.counts(0).0.late), (1, 1, 0, 0));
    assert!(counts.shown > 20, "{counts:?}");
}
