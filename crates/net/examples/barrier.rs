//! Measures the time of a frame from the server to all facets and back, within one process. There
//! is no network and no picture, so the remaining time is the protocol's.
//!
//! ```text
//! cargo run --release -p tumble-net --example barrier -- [BODIES] [FACETS] [FRAMES]
//! ```

use std::time::{Duration, Instant};
use tumble_core::collide::{Pose, Shape};
use tumble_core::{RigidBody, Settings, World};
use tumble_net::sync::{
    Facet, FacetOptions, FacetSlot, LocalTransport, Mirror, Publisher, Server, ServerOptions, Task, Viewer,
};

type Failure = Box<dyn std::error::Error + Send + Sync>;

fn scene(bodies: usize) -> Result<World, Failure> {
    let mut world = World::new(Settings::default())?;
    for k in 0..bodies {
        let body = RigidBody::new(Shape::sphere(0.1)?).with_name(format!("body {k}")).with_mass(1.0);
        world.add(body.with_pose(Pose::translation(k as f64 * 0.37, (k % 17) as f64, 1.0)))?;
    }
    Ok(world)
}

fn facet(transport: &LocalTransport, k: usize, bodies: usize) -> Result<(), Failure> {
    let link = transport.facet(k as u16).ok_or("at most 64 facets")?;
    let mut facet = Facet::new(link, FacetOptions::new(&format!("{k}"), [0; 32], k as u64), scene(bodies)?);
    loop {
        match facet.next(Duration::from_millis(100))? {
            Task::Wait(_) => {}
            Task::Draw if facet.begin().is_some() => facet.drawn([0; 16])?,
            Task::Draw => {}
            Task::Present(_) => facet.presented()?,
            Task::Ended(_) => return Ok(()),
        }
    }
}

/// Returns the minimum, the median and the 99th percentile.
fn percentiles(mut times: Vec<Duration>) -> String {
    times.sort();
    let at = |share: f64| times.get((times.len() as f64 * share) as usize).copied().unwrap_or_default();
    format!("least {:8.1?}  p50 {:8.1?}  p99 {:8.1?}", at(0.0), at(0.5), at(0.99))
}

fn main() -> Result<(), Failure> {
    let numbers = std::env::args().skip(1).map(|a| a.parse()).collect::<Result<Vec<usize>, _>>()?;
    let number = |k: usize, usual| numbers.get(k).copied().unwrap_or(usual);
    let (bodies, facets, frames) = (number(0, 2340), number(1, 6), number(2, 300));
    let world = scene(bodies)?;

    let (mut publisher, mut mirror) = (Publisher::new(&world, false, 0), Mirror::new(scene(bodies)?));
    let viewer = Viewer::default();
    let size = publisher.publish(&world, &viewer, 0)?.state.len();
    mirror.apply_snapshot(&publisher.snapshot())?;
    let (mut publish, mut apply, mut hash) = (Vec::new(), Vec::new(), Vec::new());
    for frame in 1..=frames as u64 {
        let clock = Instant::now();
        let published = publisher.publish(&world, &viewer, frame)?;
        publish.push(clock.elapsed());
        let clock = Instant::now();
        mirror.apply_state(frame, 0.0, &published.state)?;
        apply.push(clock.elapsed());
        let clock = Instant::now();
        if mirror.hash() != published.hash {
            return Err("the mirror shows something else".into());
        }
        hash.push(clock.elapsed());
    }
    println!("{bodies} bodies, {size} bytes of state, snapshot {} bytes", publisher.snapshot().len());
    println!("publish  {}\napply    {}\nhash     {}", percentiles(publish), percentiles(apply), percentiles(hash));

    let transport = LocalTransport::new(facets);
    let workers: Vec<_> = (0..facets)
        .map(|k| (k, transport.clone()))
        .map(|(k, transport)| std::thread::spawn(move || facet(&transport, k, bodies)))
        .collect();
    let slots = (0..facets).map(|k| FacetSlot { name: format!("{k}"), critical: true }).collect();
    let mut server = Server::new(
        transport.server(),
        ServerOptions { ready_timeout: Duration::from_secs(10), ..ServerOptions::new(1, [0; 32], slots) },
        &world,
    );
    server.wait_for_facets(Duration::from_secs(30))?;
    let mut barrier = Vec::new();
    for _ in 0..frames {
        let clock = Instant::now();
        server.frame(&world, &viewer)?;
        barrier.push(clock.elapsed());
    }
    server.end()?;
    for worker in workers {
        worker.join().map_err(|_| "a facet panicked")??;
    }
    println!("{facets} facets, {frames} frames, publish to presented by all: {}", percentiles(barrier));
    Ok(())
}
