//! Whole sessions over the real links: lockstep, and a refusal that is heard.

use std::thread::JoinHandle;
use std::time::Duration;
use tumble_core::collide::{Pose, Shape};
use tumble_core::{RigidBody, Settings, World};
use tumble_net::sync::shm::{ShmFacet, ShmServer};
use tumble_net::sync::transport::{FacetLink, ServerLink};
use tumble_net::sync::udp::{SharedKey, Timing, UdpFacet, UdpServer};
use tumble_net::sync::{Facet, FacetOptions, Seat, Server, ServerOptions, Task, Viewer};

const SCENE: [u8; 32] = [7; 32];
const FACETS: u16 = 3;
const FRAMES: u64 = 60;

fn scene() -> World {
    let mut world = World::new(Settings::default()).unwrap();
    for k in 0..100 {
        let ball = RigidBody::with_mass(format!("ball {k}"), Shape::sphere(0.1).unwrap(), 1.0).unwrap();
        world.add(ball.at(Pose::translation(f64::from(k), 0.0, 1.0))).unwrap();
    }
    world
}

/// What a facet has shown, and how it ended.
fn facet(link: impl FacetLink + Send + 'static, scene_hash: [u8; 32], seed: u64) -> JoinHandle<(u64, String)> {
    std::thread::spawn(move || {
        let mut facet = Facet::new(link, FacetOptions::new(&format!("facet {seed}"), scene_hash, seed), scene());
        for _ in 0..10_000 {
            match facet.next(Duration::from_millis(50)).unwrap() {
                Task::Wait(_) => {}
                Task::Draw => {
                    if facet.begin().is_some() {
                        facet.drawn([1; 16]).unwrap();
                    }
                }
                Task::Present(_) => facet.presented().unwrap(),
                Task::Over(over) => return (facet.session().counts().shown, format!("{over:?}")),
            }
        }
        (facet.session().counts().shown, "never over".into())
    })
}

fn lockstep(link: impl ServerLink, facets: Vec<JoinHandle<(u64, String)>>) {
    let mut world = scene();
    let seats = (0..FACETS).map(|k| Seat { name: format!("facet {k}"), critical: true }).collect();
    let times = Duration::from_secs(30);
    let options = ServerOptions { ready_after: times, drop_after: times, ..ServerOptions::new(1, SCENE, seats) };
    let mut server = Server::new(link, options, &world);
    server.wait_for_facets(Duration::from_secs(20)).unwrap();
    for _ in 0..FRAMES {
        world.step().unwrap();
        server.frame(&world, &Viewer::default()).unwrap();
    }
    server.end().unwrap();
    for facet in facets {
        assert_eq!(facet.join().unwrap().0, FRAMES);
    }
    assert!((0..FACETS).all(|k| server.counts(k).0.mismatched == 0));
}

#[test]
fn a_session_over_sealed_datagrams_shows_each_frame_on_each_facet() {
    let key = || Some(SharedKey::new([9; 32]));
    let server = UdpServer::bind(([127, 0, 0, 1], 0).into(), FACETS, key(), Timing::default()).unwrap();
    let address = server.address().unwrap();
    let facets = (0..FACETS).map(|k| facet(UdpFacet::connect(address, k, key(), Timing::default()).unwrap(), SCENE, k.into())).collect();
    lockstep(server, facets);
}

#[test]
fn a_session_over_shared_memory_shows_each_frame_on_each_facet() {
    let run = format!("test-{}-session", std::process::id());
    let server = ShmServer::new(&run, FACETS).unwrap();
    let facets = (0..FACETS).map(|k| facet(ShmFacet::new(&run, k).unwrap(), SCENE, k.into())).collect();
    lockstep(server, facets);
}

/// The server closes right after it said why: what it said arrives first.
#[test]
fn a_facet_of_another_scene_hears_why_it_is_refused_on_both_links() {
    let run = format!("test-{}-refused", std::process::id());
    let udp = UdpServer::bind(([127, 0, 0, 1], 0).into(), 1, None, Timing::default()).unwrap();
    let address = udp.address().unwrap();
    let facets = [
        facet(UdpFacet::connect(address, 0, None, Timing::default()).unwrap(), [8; 32], 0),
        facet(ShmFacet::new(&run, 0).unwrap(), [8; 32], 0),
    ];
    let links: [Box<dyn FnOnce() + Send>; 2] = [Box::new(move || refuse(udp)), Box::new(move || refuse(ShmServer::new(&run, 1).unwrap()))];
    let servers = links.map(std::thread::spawn);
    for facet in facets {
        let (shown, over) = facet.join().unwrap();
        assert!(shown == 0 && over.contains(&"08".repeat(32)) && over.contains(&"07".repeat(32)), "{over}");
    }
    servers.into_iter().for_each(|server| server.join().unwrap());
}

fn refuse(link: impl ServerLink) {
    let options = ServerOptions::new(1, SCENE, vec![Seat { name: "facet 0".into(), critical: true }]);
    let mut server = Server::new(link, options, &scene());
    assert!(server.wait_for_facets(Duration::from_secs(3)).unwrap_err().to_string().contains("facet 0 did not join"));
}
