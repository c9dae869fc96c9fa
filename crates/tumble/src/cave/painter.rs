//! What draws a facet into memory: a thread of its own, so that the session answers the server however long a picture takes.

use super::stage::{PREVIEW, Setting, follow};
use super::stamp::stamp;
use crate::failure::Failure;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::Duration;
use tumble::dynamics::World;
use tumble::net::sync::Viewer;
use tumble::render::{CaveView, DebugDraw, DrawList, Drawing, Image, Quality, RenderError, Renderer};
use tumble::scene::cave::Facet;

/// Side of the shadow maps where it is the usual one elsewhere, as for pictures of caves.
const CAVE_SHADOWS: u32 = 4096;
/// Largest picture of an unfolded cave, pixels.
pub const PREVIEW_PX: [u32; 2] = [1280, 960];

/// A picture that is wanted.
struct Order {
    list: DrawList,
    viewer: Viewer,
    stamp: Option<u64>,
}

/// Makes draw lists here, and pictures on its thread.
pub struct Painter {
    drawing: Drawing,
    quality: Option<Quality>,
    orders: SyncSender<Order>,
    pictures: Receiver<Result<Image, RenderError>>,
}

impl Painter {
    /// For a facet; all of them unfolded where there is none.
    pub fn new(setting: &Setting, facet: Option<&Facet>, quality: Option<Quality>) -> Result<Painter, Failure> {
        let (view, facet) = (setting.view()?, facet.cloned());
        let (orders, wanted) = sync_channel::<Order>(1);
        let (done, pictures) = sync_channel(1);
        let (ready, started) = sync_channel(1);
        std::thread::Builder::new()
            .name("painter".into())
            .spawn(move || {
                let mut renderer = match Renderer::new() {
                    Ok(renderer) => renderer,
                    Err(error) => {
                        let _ = ready.send(Err(error));
                        return;
                    }
                };
                let _ = ready.send(Ok(()));
                paint(view, facet, &mut renderer, &wanted, &done);
            })
            .map_err(|e| Failure::run("drawing", e))?;
        started.recv().map_err(|e| Failure::run("drawing", e))?.map_err(|e| Failure::run("drawing", e))?;
        let mut painter = Painter { drawing: Drawing::new(&setting.scene), quality, orders, pictures };
        // the first picture takes seconds where pipelines are compiled; nobody waits for it yet
        painter.begin(&setting.world, &setting.viewer()?, None)?;
        while painter.finished(Duration::from_secs(1))?.is_none() {}
        Ok(painter)
    }

    /// Begins a picture of the world; with the frame's number in it, if it is to be stamped.
    pub fn begin(&mut self, world: &World, viewer: &Viewer, stamp: Option<u64>) -> Result<(), Failure> {
        let list = draw_list(&mut self.drawing, world, self.quality.as_ref())?;
        self.orders
            .send(Order { list, viewer: viewer.clone(), stamp })
            .map_err(|_| Failure::run("drawing", "the painter has gone"))
    }

    /// The picture, if it is finished within `timeout`.
    pub fn finished(&mut self, timeout: Duration) -> Result<Option<Image>, Failure> {
        match self.pictures.recv_timeout(timeout) {
            Ok(image) => image.map(Some).map_err(|e| Failure::run("drawing", e)),
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => Err(Failure::run("drawing", "the painter has gone")),
        }
    }
}

/// As all pictures of caves are drawn.
pub fn draw_list(drawing: &mut Drawing, world: &World, quality: Option<&Quality>) -> Result<DrawList, Failure> {
    let mut list = drawing.list(world, &DebugDraw::default()).map_err(|e| Failure::run("drawing", e))?;
    if let Some(quality) = quality {
        quality.apply(&mut list.settings);
    }
    if list.settings.shadow_map_size == Quality::default().shadow_map_size {
        list.settings.shadow_map_size = CAVE_SHADOWS;
    }
    Ok(list)
}

fn paint(
    mut view: CaveView,
    facet: Option<Facet>,
    renderer: &mut Renderer,
    wanted: &Receiver<Order>,
    done: &SyncSender<Result<Image, RenderError>>,
) {
    while let Ok(order) = wanted.recv() {
        follow(&mut view, &order.viewer);
        let mut image = match &facet {
            Some(facet) => view.draw(renderer, &order.list, facet),
            None => view.draw_unfolded(renderer, &order.list, PREVIEW_PX),
        };
        if let (Ok(image), Some(frame)) = (&mut image, order.stamp) {
            stamp(image, frame);
        }
        if done.send(image).is_err() {
            return;
        }
    }
}

/// First 16 bytes of the BLAKE3 of a picture's pixels.
pub fn image_hash(image: &Image) -> [u8; 16] {
    let mut hash = [0; 16];
    hash.copy_from_slice(&blake3::hash(&image.rgba).as_bytes()[..16]);
    hash
}

/// The seat's name, as errors and folders have it.
pub fn seat_name(facet: Option<&Facet>) -> &str {
    facet.map_or(PREVIEW, |f| &f.name)
}
