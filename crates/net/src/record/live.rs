//! Live stream of a recording's content: a WebSocket server that Foxglove connects to (feature
//! `live`).
//!
//! A viewer gets the scene when it connects, and poses with every frame. Each viewer has a queue of
//! [`BACKLOG`] messages. A full queue drops its oldest message, so a slow viewer does not delay the
//! simulation or other viewers. The server reads only subscriptions from viewers.

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

/// Maximum number of messages in the queue of a viewer: about a second.
pub const BACKLOG: usize = 64;

/// A server that streams a world to viewers.
pub struct Live {
    server: Option<WebSocketServerHandle>,
    scene: Channel<SceneUpdate>,
    transforms: Channel<FrameTransforms>,
    message: FrameTransforms,
    names: Vec<String>,
    /// Whether a viewer has subscribed since the last frame and needs the scene.
    wanted: Arc<Newcomers>,
    // keeps the channels registered
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
    /// Starts the server on the address. There is no key: every machine that reaches the address
    /// can watch.
    ///
    /// # Errors
    /// [`RecordError::Input`] if the address is in use or is not an address of this machine.
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

    /// Returns the port: a free one chosen by the system if `start` was given port 0.
    pub fn port(&self) -> u16 {
        self.server.as_ref().map_or(0, WebSocketServerHandle::port)
    }

    /// Returns the number of connected viewers.
    pub fn viewers(&self) -> usize {
        self.server.as_ref().map_or(0, WebSocketServerHandle::client_count)
    }

    /// Sends a frame to all viewers, without waiting. Does nothing if there is no viewer.
    pub fn frame(&mut self, world: &World) {
        let newcomers = self.wanted.0.swap(false, Ordering::AcqRel);
        if self.viewers() == 0 {
            // the next viewer needs the whole scene
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
            // closes the connections without waiting for the viewers
            drop(server.stop());
        }
    }
}
