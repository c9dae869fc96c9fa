//! NetSync: one server simulates, one process per facet draws, and all facets show the same frame
//! (thesis §IV.A.6, §IV.C).
//!
//! The server owns time and random numbers. A facet builds the same world from the same scene file
//! and shows the states of the messages. Both sides are state machines without a clock
//! ([`ServerSession`], [`FacetSession`]); [`Server`] and [`Facet`] run them over a link
//! ([`transport`]).
//!
//! ```
//! use std::time::Duration;
//! use tumble_core::{RigidBody, Settings, World, collide::{Pose, Shape}};
//! use tumble_net::sync::{Facet, FacetOptions, FacetSlot, LocalTransport, Server, ServerOptions, Task, Viewer};
//!
//! fn scene() -> World {
//!     let mut world = World::new(Settings::default()).unwrap();
//!     let ball = RigidBody::new(Shape::sphere(0.1).unwrap()).with_name("ball").with_mass(1.0);
//!     world.add(ball.with_pose(Pose::translation(0.0, 0.0, 1.0))).unwrap();
//!     world
//! }
//!
//! let (transport, scene_hash) = (LocalTransport::new(1), [7; 32]);
//! let link = transport.facet(0).unwrap();
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
//!             Task::Ended(_) => return facet.session().counts().shown,
//!         }
//!     }
//! });
//!
//! let mut world = scene();
//! let slots = vec![FacetSlot { name: "front".into(), critical: true }];
//! let mut server = Server::new(transport.server(), ServerOptions::new(1, scene_hash, slots), &world);
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
//! `wire.rs` holds the header of all messages, `table.rs` the snapshot and the state, `messages.rs`
//! and `input.rs` the small messages, `quantize.rs` the poses with the bound on their error.
//! `docs/netsync.md` describes the protocol.

mod cloud;
#[cfg(feature = "fuzzing")]
pub mod compute;
#[cfg(not(feature = "fuzzing"))]
mod compute;
mod contacts;
pub mod cpu_latency;
mod driver;
mod events;
mod facet;
mod frame_hash;
mod input;
mod local;
mod mirror;
mod pairs;
mod publisher;
mod recording;
mod render_proxy;
mod scene_hash;
mod sensors;
mod server;
pub mod shm;
mod touching;
pub mod transport;
pub mod udp;
mod viewer;
mod visuals;

// Message formats and the simulated network: public for fuzz targets and tests alone.
#[cfg(feature = "fuzzing")]
pub mod messages;
#[cfg(not(feature = "fuzzing"))]
mod messages;
#[cfg(feature = "fuzzing")]
pub mod quantize;
#[cfg(not(feature = "fuzzing"))]
mod quantize;
#[cfg(feature = "fuzzing")]
pub mod simulated_network;
#[cfg(feature = "fuzzing")]
pub mod table;
#[cfg(not(feature = "fuzzing"))]
mod table;
#[cfg(feature = "fuzzing")]
pub mod wire;
#[cfg(not(feature = "fuzzing"))]
mod wire;

pub use compute::{FrameInputs, Simulation, StateHashes};
pub use contacts::MAX_CONTACTS;
pub use driver::{Facet, Server, SessionError};
pub use events::MAX_FRAME_EVENTS;
pub use facet::{AppliedFrame, EndReason, FacetOptions, FacetSession, Task, WaitReason};
pub use input::{Input, MAX_KEYS};
pub use local::{LocalFacet, LocalServer, LocalTransport};
pub use messages::{Content, FacetCounts, FrameAck};
pub use mirror::Mirror;
pub use publisher::{PublishError, Published, Publisher};
#[cfg(feature = "fuzzing")]
pub use recording::parse_frame;
pub use recording::{FrameRecord, RecordedFrame, SessionReadError, SessionReader, SessionRecorder};
pub use scene_hash::scene_hash;
pub use server::{
    FacetSlot, FrameTimes, Membership, ServerEvent, ServerOptions, ServerSession, SlotCounts, SyncMode, ToFacets,
};
pub use viewer::{User, VIEWER_NAME, Viewer};
pub use wire::{Hash, MessageError};
