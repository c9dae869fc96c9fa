//! `--foxglove`: streams a run to Foxglove. Without the feature `foxglove` it does nothing.

use crate::cave::args::ServeOptions;
use crate::failure::Failure;
use tumble::dynamics::World;

/// Server for viewers in Foxglove.
pub struct LiveViewers {
    #[cfg(feature = "foxglove")]
    live: Option<tumble::net::record::live::Live>,
}

#[cfg(feature = "foxglove")]
impl LiveViewers {
    /// Opens the address, if one is given.
    pub fn open(options: &ServeOptions) -> Result<LiveViewers, Failure> {
        let start = |at: std::net::SocketAddr| {
            tumble::net::record::live::Live::start(at, &options.scene.name).map_err(|e| Failure::run("viewers", e))
        };
        let live = options.foxglove.map(start).transpose()?;
        if let (Some(live), Some(at), false) = (&live, options.foxglove, options.quiet) {
            eprintln!("viewers: Foxglove at ws://{}", std::net::SocketAddr::new(at.ip(), live.port()));
        }
        Ok(LiveViewers { live })
    }

    /// Publishes a frame; returns at once.
    pub fn frame(&mut self, world: &World) {
        self.live.iter_mut().for_each(|live| live.frame(world));
    }
}

#[cfg(not(feature = "foxglove"))]
impl LiveViewers {
    pub fn open(_: &ServeOptions) -> Result<LiveViewers, Failure> {
        Ok(LiveViewers {})
    }

    pub fn frame(&mut self, _: &World) {}
}
