//! Sessions that follow another one: they show its frames, with its hashes, and only these.

use super::simulated_session::{SCENE, scene, viewer};
use super::threads::{hashes, options};
use std::time::Duration;
use tumble_core::RigidBody;
use tumble_core::collide::Shape;
use tumble_net::sync::*;

const MS: Duration = Duration::from_millis(1);

/// Two sessions that follow a third, and a facet with a world of its own, all in one thread: the follower
/// polls before the leader, so it has to wait for it in each frame.
#[test]
fn followers_acknowledge_the_states_of_their_leader() {
    let transport = LocalTransport::new(3);
    let names = ["facet 0", "facet 1", "facet 2"];
    let of = |k: u16| (transport.facet(k).unwrap(), FacetOptions::new(names[k as usize], SCENE, u64::from(k)));
    let (link, facet_options) = of(0);
    let mut follower = Facet::following(link, facet_options, false).unwrap();
    let (link, facet_options) = of(1);
    let mut leader = Facet::new(link, facet_options, scene());
    let (link, facet_options) = of(2);
    let mut alone = Facet::new(link, facet_options, scene());
    let mut world = scene();
    let mut server = Server::new(transport.server(), options(), &world);
    let (mut applied, mut waited) = (None, 0);
    let (mut shown, mut times) = ([(); 3].map(|()| Vec::new()), [(); 3].map(|()| Vec::new()));
    let mut frame = None;
    for _ in 0..20_000 {
        // the follower first: it can begin only what the leader has applied
        if follower.next(Duration::ZERO).unwrap() == Task::Draw {
            assert!(follower.begin().is_none(), "it has no world");
            match applied.as_ref().is_some_and(|applied| follower.follow(applied)) {
                true => follower.drawn([1; 16]).unwrap(),
                false => waited += 1,
            }
        }
        if leader.next(Duration::ZERO).unwrap() == Task::Draw && leader.begin().is_some() {
            applied = leader.applied();
            leader.drawn([2; 16]).unwrap();
        }
        if alone.next(Duration::ZERO).unwrap() == Task::Draw && alone.begin().is_some() {
            alone.drawn([3; 16]).unwrap();
        }
        for (k, facet) in [&mut follower, &mut leader, &mut alone].into_iter().enumerate() {
            if let Task::Present(_) = facet.next(Duration::ZERO).unwrap() {
                facet.presented().unwrap();
                shown[k].extend(facet.session().shown());
                times[k].push(facet.session().time_s());
            }
        }
        if frame.is_none() {
            match server.wait_for_facets(MS) {
                Ok(()) => frame = Some(server.begin(&world, &viewer(0)).unwrap()),
                Err(SessionError::Missing(..)) => continue,
                Err(other) => panic!("{other}"),
            }
        }
        if server.shown(Duration::from_micros(200)).unwrap() {
            let next = frame.unwrap() + 1;
            if next == 40 {
                break;
            }
            world.step().unwrap();
            if next == 20 {
                // another table of objects
                world.add(RigidBody::new(Shape::sphere(0.3).unwrap()).with_name("guest").with_mass(1.0)).unwrap();
            }
            frame = Some(server.begin(&world, &viewer(next)).unwrap());
        }
    }
    assert_eq!(frame, Some(39));
    assert!(waited >= 40, "{waited}: the leader is polled later");
    let states = |k: usize| hashes(&shown[k]).into_iter().map(|(frame, state, _)| (frame, state)).collect::<Vec<_>>();
    assert!(states(0).iter().map(|(frame, _)| *frame).eq(0..40));
    assert_eq!(states(0), states(1));
    assert_eq!(states(0), states(2), "those of a facet with a world of its own");
    assert!(times[0].len() == 40 && times[0] == times[2], "{times:?}");
    let mut different = states(0);
    different.dedup_by_key(|(_, state)| *state);
    assert_eq!(different.len(), 40);
    assert_eq!(follower.session().counts(), FacetCounts { shown: 40, ..FacetCounts::default() });
    // a frame of another run is not followed
    let stale = applied.unwrap();
    let mut other = FacetSession::following(FacetOptions::new("x", SCENE, 9), true).unwrap();
    assert!(!other.follow(&stale) && other.applied().is_none());
}
