//! Live stream of a recording's content: a WebSocket server that Foxglove connects to (feature
//! `live`).
//!
//! The scene goes to a viewer when it comes, poses go with every frame. Each viewer has a queue of
//! [`BACKLOG`] messages; where it is full, the oldest is dropped, so nobody who watches delays
//! anybody. Nothing that a viewer sends is read but which topics it wants.

use super::error::Result;
use super::messages::{nanoseconds, scene_update, set_transforms, transforms_for};
use super::schemas::{TOPIC_SCENE, TOPIC_TRANSFORMS};
use super::{MAX_TIME_S, RecordError};
use crate::world::{entities, names, poses};
use foxglove::messages::{FrameTransforms, SceneUpdate};
use foxglove::websocket::{ChannelView, Client, ServerListener};
use foxglove::{Channel, Context, WebSocketServer, WebSocketServerHandle};
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use tumble_core::World;

/// Most messages that wait for one viewer: about a second.
pub const BACKLOG: usize = 64;

/// A server that shows a world.
pub struct Live {
    server: Option<WebSocketServerHandle>,
    scene: Channel<SceneUpdate>,
    transforms: Channel<FrameTransforms>,
    message: FrameTransforms,
    names: Vec<String>,
    /// A new viewer needs the scene.
    wanted: Arc<Newcomers>,
    // the channels are in it
    _context: Arc<Context>,
}

#[derive(Default)]
struct Newcomers(AtomicBool);

impl ServerListener for Newcomers {
    fn on_subscribe(&self, _: Client, channel: ChannelView) {
        if channel.topic() == TOPIC_SCENE {
            self.0.store(true, Ordering::Release);
        }
    }
}

impl Live {
    /// Listens. Every machine that reaches the address can watch: there is no key.
    ///
    /// # Errors
    /// The address is taken or not this machine's.
    pub fn start(at: SocketAddr, name: &str) -> Result<Live> {
        let (context, wanted) = (Context::new(), Arc::new(Newcomers::default()));
        let server = WebSocketServer::new()
            .name(name)
            .bind(at.ip().to_string(), at.port())
            .context(&context)
            .message_backlog_size(BACKLOG)
            .listener(wanted.clone());
        let server = server
            .start_blocking()
            .map_err(|e| RecordError::input(format!("the viewers' address {at}"), e.to_string()))?;
        let (scene, transforms) =
            (context.channel_builder(TOPIC_SCENE).build(), context.channel_builder(TOPIC_TRANSFORMS).build());
        Ok(Live {
            server: Some(server),
            scene,
            transforms,
            message: FrameTransforms::default(),
            names: Vec::new(),
            wanted,
            _context: context,
        })
    }

    /// The port; that is another than was asked for where this was 0.
    pub fn port(&self) -> u16 {
        self.server.as_ref().map_or(0, WebSocketServerHandle::port)
    }

    /// How many watch.
    pub fn viewers(&self) -> usize {
        self.server.as_ref().map_or(0, WebSocketServerHandle::client_count)
    }

    /// A frame. Returns at once; where nobody watches nothing is done.
    pub fn frame(&mut self, world: &World) {
        let newcomers = self.wanted.0.swap(false, Ordering::AcqRel);
        if self.viewers() == 0 {
            // the next viewer gets all of it
            self.names.clear();
            return;
        }
        let (log_time, names) = (nanoseconds(world.time().clamp(0.0, MAX_TIME_S)), names(world));
        if newcomers || names != self.names {
            let all = entities(world);
            self.scene.log_with_time(&scene_update(log_time, &all, &self.names), log_time);
            self.message = transforms_for(&all);
            self.names = names;
        }
        set_transforms(&mut self.message, log_time, &poses(world));
        self.transforms.log_with_time(&self.message, log_time);
    }
}

impl Drop for Live {
    fn drop(&mut self) {
        if let Some(server) = self.server.take() {
            // viewers find the connection closed; nobody is waited for
            drop(server.stop());
        }
    }
}
