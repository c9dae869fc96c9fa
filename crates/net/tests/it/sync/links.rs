//! The same session over each link: every facet shows every frame once, and the hashes are the same
//! on all links.

use super::simulated_session::{SCENE, scene, viewer};
use super::threads::{facet, hashes, options};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;
use tumble_net::sync::shm::{ShmFacet, ShmServer};
use tumble_net::sync::transport::{FacetLink, ServerLink};
use tumble_net::sync::udp::{SharedKey, Timing, UdpFacet, UdpServer};
use tumble_net::sync::{
    EndReason, Facet, FacetCounts, FacetOptions, FacetSlot, LocalTransport, Server, ServerOptions, Task,
};

type Frames = Vec<(u64, [u8; 16], [u8; 16])>;

/// Runs 60 frames and returns the frames that each facet has shown.
fn run<S: ServerLink, F: FacetLink + Send + 'static>(server: S, facets: Vec<F>) -> Frames {
    let stop = Arc::new(AtomicBool::new(false));
    let facets: Vec<_> = facets.into_iter().enumerate().map(|(k, link)| facet(link, k as u16, &stop)).collect();
    let mut world = scene();
    let mut server = Server::new(server, options(), &world);
    server.wait_for_facets(Duration::from_secs(20)).unwrap();
    for frame in 0..60 {
        world.step().unwrap();
        assert_eq!(server.frame(&world, &viewer(frame)).unwrap(), frame);
    }
    server.end().unwrap();
    let shown: Vec<Frames> = facets
        .into_iter()
        .map(|f| f.join().unwrap())
        .map(|(shown, counts)| {
            assert_eq!(counts, FacetCounts { shown: 60, ..FacetCounts::default() });
            hashes(&shown)
        })
        .collect();
    for k in 0..3 {
        let (here, _, link) = server.counts(k);
        assert_eq!(
            (here.presented, here.late, here.missing, here.mismatched, here.dropped, here.refused),
            (60, 0, 0, 0, 0, 0)
        );
        assert_eq!(link.refused, [0; 8]);
        assert_eq!(shown[k as usize], shown[0]);
    }
    shown[0].clone()
}

#[test]
fn a_session_is_the_same_over_every_link() {
    let transport = LocalTransport::new(3);
    let local = run(transport.server(), (0..3).map(|k| transport.facet(k).unwrap()).collect());
    let key = || Some(SharedKey::new([3; 32]));
    let timing = Timing { idle_timeout: Duration::from_secs(20), ..Timing::default() };
    let server = UdpServer::bind(([127, 0, 0, 1], 0).into(), 3, key(), timing).unwrap();
    let address = server.address().unwrap();
    let udp = run(server, (0..3).map(|k| UdpFacet::connect(address, k, key(), timing).unwrap()).collect());
    let name = format!("links-{}", std::process::id());
    let shm = run(ShmServer::new(&name, 3).unwrap(), (0..3).map(|k| ShmFacet::new(&name, k).unwrap()).collect());
    assert_eq!(local.iter().map(|f| f.0).collect::<Vec<_>>(), (0..60).collect::<Vec<_>>());
    assert!(local == udp && local == shm);
}

/// Runs a facet of another scene until the server refuses it; returns the reason.
fn refused(link: impl FacetLink + Send + 'static) -> std::thread::JoinHandle<String> {
    std::thread::spawn(move || {
        let mut facet = Facet::new(link, FacetOptions::new("facet 0", [8; 32], 1), scene());
        for _ in 0..200 {
            if let Task::Ended(EndReason::Refused(why)) = facet.next(Duration::from_millis(50)).unwrap() {
                return why;
            }
        }
        "no reason arrived".into()
    })
}

fn refuse(link: impl ServerLink) {
    let options = ServerOptions::new(1, SCENE, vec![FacetSlot { name: "facet 0".into(), critical: true }]);
    let mut server = Server::new(link, options, &scene());
    assert!(server.wait_for_facets(Duration::from_secs(3)).unwrap_err().to_string().contains("facet 0 did not join"));
}

/// The server closes right after it has sent the reason, and the reason arrives first.
#[test]
fn a_refused_facet_gets_the_reason_over_both_links() {
    let run = format!("refused-{}", std::process::id());
    let udp = UdpServer::bind(([127, 0, 0, 1], 0).into(), 1, None, Timing::default()).unwrap();
    let facets = [
        refused(UdpFacet::connect(udp.address().unwrap(), 0, None, Timing::default()).unwrap()),
        refused(ShmFacet::new(&run, 0).unwrap()),
    ];
    let links: [Box<dyn FnOnce() + Send>; 2] =
        [Box::new(move || refuse(udp)), Box::new(move || refuse(ShmServer::new(&run, 1).unwrap()))];
    let servers = links.map(std::thread::spawn);
    for facet in facets {
        let why = facet.join().unwrap();
        assert!(why.contains(&"08".repeat(32)) && why.contains(&"07".repeat(32)), "{why}");
    }
    servers.into_iter().for_each(|server| server.join().unwrap());
}
