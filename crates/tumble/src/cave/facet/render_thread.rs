//! Draws a facet into memory in a thread of its own, so that the session answers the server however
//! long a picture takes.

use super::burn_in::burn_in;
use crate::cave::run_setup::{PREVIEW, RunSetup, apply_viewer};
use crate::failure::Failure;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::Duration;
use tumble::dynamics::World;
use tumble::net::sync::Viewer;
use tumble::render::{
    CalibrationPattern, CaveView, DebugDraw, DrawList, Drawing, Image, Quality, RenderError, Renderer,
    finished_calibration_picture,
};
use tumble::scene::cave::Facet;

/// Size of shadow maps in caves instead of the default, texels; as for all pictures of caves.
const CAVE_SHADOW_MAP_PX: u32 = 4096;
/// Maximum size of the picture of an unfolded cave, pixels.
pub const PREVIEW_PX: [u32; 2] = [1280, 960];

/// Request for a picture.
struct RenderRequest {
    list: DrawList,
    viewer: Viewer,
    frame: u64,
    burn_in: bool,
    pattern: Option<CalibrationPattern>,
}

/// Makes draw lists in the calling thread and pictures in its own.
pub struct RenderThread {
    drawing: Drawing,
    quality: Option<Quality>,
    overlays: DebugDraw,
    requests: SyncSender<RenderRequest>,
    pictures: Receiver<Result<Image, RenderError>>,
    software: bool,
    adapter: String,
}

impl RenderThread {
    /// Starts the thread for a facet, or for all facets unfolded if there is none.
    pub fn new(
        setup: &RunSetup,
        facet: Option<&Facet>,
        quality: Option<Quality>,
        overlays: DebugDraw,
    ) -> Result<RenderThread, Failure> {
        let (view, facet) = (setup.view()?, facet.cloned());
        let (requests, incoming) = sync_channel::<RenderRequest>(1);
        let (done, pictures) = sync_channel(1);
        let (ready, started) = sync_channel(1);
        std::thread::Builder::new()
            .name("painter".into())
            .spawn(move || {
                let gpu = facet.as_ref().and_then(|facet| facet.display.gpu.as_deref());
                let mut renderer = match Renderer::with_adapter(gpu) {
                    Ok(renderer) => renderer,
                    Err(error) => {
                        let _ = ready.send(Err(error));
                        return;
                    }
                };
                let _ = ready.send(Ok((renderer.is_software(), renderer.adapter().to_owned())));
                render_all(view, facet, &mut renderer, &incoming, &done);
            })
            .map_err(|e| Failure::run("drawing", e))?;
        let (software, adapter) =
            started.recv().map_err(|e| Failure::run("drawing", e))?.map_err(|e| Failure::run("drawing", e))?;
        // as in windows: a software driver is slow
        let quality = quality.or(software.then(Quality::fast));
        let mut render_thread = RenderThread {
            drawing: Drawing::new(&setup.scene),
            quality,
            overlays,
            requests,
            pictures,
            software,
            adapter,
        };
        // the first picture takes seconds to compile pipelines, and nothing waits for it yet
        render_thread.begin(&setup.world, &setup.viewer()?, 0, false, None)?;
        while render_thread.finished(Duration::from_secs(1))?.is_none() {}
        Ok(render_thread)
    }

    /// Returns whether a software driver draws.
    pub fn is_software(&self) -> bool {
        self.software
    }

    /// Returns the graphics adapter: its name, kind and interface.
    pub fn adapter(&self) -> &str {
        &self.adapter
    }

    /// Starts a picture of the world, or of a calibration pattern, with the frame number in it for
    /// `burn_in`.
    pub fn begin(
        &mut self,
        world: &World,
        viewer: &Viewer,
        frame: u64,
        burn_in: bool,
        pattern: Option<CalibrationPattern>,
    ) -> Result<(), Failure> {
        let list = draw_list(&mut self.drawing, world, self.quality.as_ref(), &self.overlays)?;
        self.requests
            .send(RenderRequest { list, viewer: viewer.clone(), frame, burn_in, pattern })
            .map_err(|_| Failure::run("drawing", "the render thread has ended"))
    }

    /// Returns the picture if it is finished within `timeout`.
    pub fn finished(&mut self, timeout: Duration) -> Result<Option<Image>, Failure> {
        match self.pictures.recv_timeout(timeout) {
            Ok(image) => image.map(Some).map_err(|e| Failure::run("drawing", e)),
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => Err(Failure::run("drawing", "the render thread has ended")),
        }
    }
}

/// Makes the draw list of a picture of a cave.
pub fn draw_list(
    drawing: &mut Drawing,
    world: &World,
    quality: Option<&Quality>,
    overlays: &DebugDraw,
) -> Result<DrawList, Failure> {
    let mut list = drawing.list(world, overlays).map_err(|e| Failure::run("drawing", e))?;
    if let Some(quality) = quality {
        quality.apply(&mut list.settings);
    }
    if list.settings.shadow_map_size == Quality::default().shadow_map_size {
        list.settings.shadow_map_size = CAVE_SHADOW_MAP_PX;
    }
    Ok(list)
}

fn render_all(
    mut view: CaveView,
    facet: Option<Facet>,
    renderer: &mut Renderer,
    incoming: &Receiver<RenderRequest>,
    done: &SyncSender<Result<Image, RenderError>>,
) {
    while let Ok(request) = incoming.recv() {
        apply_viewer(&mut view, &request.viewer, request.frame);
        let mut image = match (&facet, request.pattern) {
            (Some(facet), Some(pattern)) => Ok(finished_calibration_picture(&view, facet, pattern)),
            (Some(facet), None) => view.draw(renderer, &request.list, facet),
            (None, _) => view.draw_unfolded(renderer, &request.list, PREVIEW_PX),
        };
        if let (Ok(image), true) = (&mut image, request.burn_in) {
            burn_in(image, request.frame);
        }
        if done.send(image).is_err() {
            return;
        }
    }
}

/// Returns the first 16 bytes of the BLAKE3 hash of a picture's pixels.
pub fn image_hash(image: &Image) -> [u8; 16] {
    let mut hash = [0; 16];
    hash.copy_from_slice(&blake3::hash(&image.rgba).as_bytes()[..16]);
    hash
}

/// Returns the name of the facet's slot.
pub fn slot_name(facet: Option<&Facet>) -> &str {
    facet.map_or(PREVIEW, |f| &f.name)
}
