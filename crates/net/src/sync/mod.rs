//! NetSync: one server simulates, one process per facet draws, and every facet shows the same frame (thesis §IV.A.6, §IV.C).
//!
//! The server owns time and randomness; a facet builds the same world from the same scene file and only ever shows what messages say. Both sides are
//! state machines without a clock ([`ServerSession`], [`FacetSession`]); [`Server`] and [`Facet`] run them over a link ([`transport`]).
//!
//! ```
//! use std::time::Duration;
//! use tumble_core::{RigidBody, Settings, World, collide::{Pose, Shape}};
//! use tumble_net::sync::{Facet, FacetOptions, Hub, Seat, Server, ServerOptions, Task, Viewer};
//!
//! fn scene() -> World {
//!     let mut world = World::new(Settings::default()).unwrap();
//!     let ball = RigidBody::with_mass("ball", Shape::sphere(0.1).unwrap(), 1.0).unwrap();
//!     world.add(ball.at(Pose::translation(0.0, 0.0, 1.0))).unwrap();
//!     world
//! }
//!
//! let (hub, scene_hash) = (Hub::new(1), [7; 32]);
//! let link = hub.facet(0).unwrap();
//! let facet = std::thread::spawn(move || {
//!     let mut facet = Facet::new(link, FacetOptions::new("front", scene_hash, 1), scene());
//!     loop {
//!         match facet.next(Duration::from_millis(100)).unwrap() {
//!             Task::Wait(_) => {} // keep the window alive
//!             Task::Draw => {
//!                 if facet.begin().is_some() {
//!                     let _picture = (facet.world(), facet.viewer()); // draw them
//!                     facet.drawn([0; 16]).unwrap();
//!                 }
//!             }
//!             Task::Present(_) => facet.presented().unwrap(), // swap the buffers first
//!             Task::Over(_) => return facet.session().counts().shown,
//!         }
//!     }
//! });
//!
//! let mut world = scene();
//! let seats = vec![Seat { name: "front".into(), critical: true }];
//! let mut server = Server::new(hub.server(), ServerOptions::new(1, scene_hash, seats), &world);
//! server.wait_for_facets(Duration::from_secs(10)).unwrap();
//! for _ in 0..10 {
//!     world.step().unwrap();
//!     server.frame(&world, &Viewer::default()).unwrap();
//! }
//! server.end().unwrap();
//! assert_eq!(facet.join().unwrap(), 10);
//! ```
//!
//! # Messages
//!
//! [`wire`] has the frame around all of them, [`table`] the snapshot and the state, [`messages`] and [`input`] the small ones, [`quantise`] the poses with
//! their stated error. `docs/netsync.md` tells the whole.

pub mod awake;
mod drawn;
mod drive;
pub mod facet;
pub mod input;
pub mod local;
mod looks;
pub mod messages;
pub mod mirror;
pub mod publisher;
mod puppet;
pub mod quantise;
pub mod recording;
mod scene_hash;
pub mod server;
pub mod shm;
pub mod simulate;
pub mod table;
pub mod transport;
pub mod udp;
mod viewer;
pub mod wire;

pub use drive::{Facet, Server, SessionError};
pub use facet::{FacetOptions, FacetSession, Over, Task, Waiting};
pub use input::{Input, MAX_KEYS};
pub use local::Hub;
pub use messages::FacetCounts;
pub use mirror::Mirror;
pub use publisher::{PublishError, Publisher};
pub use recording::{Recorded, Replay, ReplayError, ReplayFrame, SessionRecorder};
pub use scene_hash::scene_hash;
pub use server::{FrameTimes, Pace, Seat, SeatCounts, ServerEvent, ServerOptions, ServerSession, Standing};
pub use viewer::{User, VIEWER_NAME, Viewer};
