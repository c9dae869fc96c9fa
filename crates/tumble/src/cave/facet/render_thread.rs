//! Draws facets into memory in a thread of its own, so that the sessions answer the server however
//! long a picture takes. All facets of a process share device, draw list and uploads.

use super::pictures::{Picture, Pictures};
use crate::cave::run_setup::{PREVIEW, RunSetup, apply_viewer};
use crate::failure::Failure;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::Duration;
use tumble::dynamics::World;
use tumble::net::sync::Viewer;
use tumble::render::{
    CalibrationPattern, CaveView, DebugDraw, DrawList, Drawing, Image, Quality, RenderError, Renderer, Stage,
    finished_calibration_picture,
};
use tumble::scene::cave::Facet;

/// Size of shadow maps in caves instead of the default, texels; as for all pictures of caves.
const CAVE_SHADOW_MAP_PX: u32 = 4096;
/// Maximum size of the picture of an unfolded cave, pixels.
pub const PREVIEW_PX: [u32; 2] = [1280, 960];

/// The picture that a session asks for.
#[derive(Clone, Copy)]
pub struct Wanted {
    pub frame: u64,
    /// Whether it has the frame number.
    pub burn_in: bool,
    /// The calibration pattern to show instead of the scene.
    pub pattern: Option<CalibrationPattern>,
    /// Whether a window must read it back.
    pub read: bool,
}

/// Request for the pictures of a frame.
pub struct RenderRequest {
    pub list: DrawList,
    pub viewer: Viewer,
    pub wanted: Wanted,
}

/// Makes the draw lists of a cave.
pub struct ListMaker {
    drawing: Drawing,
    pub quality: Option<Quality>,
    overlays: DebugDraw,
}

impl ListMaker {
    /// Prepares the lists of a scene.
    pub fn new(setup: &RunSetup, quality: Option<Quality>, overlays: DebugDraw) -> ListMaker {
        ListMaker { drawing: Drawing::new(&setup.scene), quality, overlays }
    }

    /// Makes the draw list of a picture of a cave.
    pub fn list(&mut self, world: &World) -> Result<DrawList, Failure> {
        let mut list = self.drawing.list(world, &self.overlays).map_err(|e| Failure::run("drawing", e))?;
        if let Some(quality) = &self.quality {
            quality.apply(&mut list.settings);
        }
        if list.settings.shadow_map_size == Quality::default().shadow_map_size {
            list.settings.shadow_map_size = CAVE_SHADOW_MAP_PX;
        }
        Ok(list)
    }
}

/// Facet to draw, and the place of its pictures.
struct Canvas {
    /// `None` for all facets unfolded.
    facet: Option<Facet>,
    pictures: Pictures,
}

impl Wanted {
    /// The first picture, for which pipelines are compiled and which nobody sees.
    pub fn first() -> Wanted {
        Wanted { frame: 0, burn_in: false, pattern: None, read: false }
    }
}

/// Longest wait for the painter's end, which is a picture and the release of the device. The launcher kills a facet
/// that takes 4 s to end.
const END_TIMEOUT: Duration = Duration::from_secs(3);

/// The end of the painter, which closes the channel. When dropped, waits for it: a process that exits while a
/// thread releases its device calls functions of a driver that is unloaded meanwhile.
struct PainterEnd {
    closed: Receiver<()>,
    thread: Option<JoinHandle<()>>,
    /// All that it delivers.
    pictures: Vec<Pictures>,
}

impl Drop for PainterEnd {
    fn drop(&mut self) {
        self.pictures.iter().for_each(Pictures::abandon);
        let released = self.closed.recv_timeout(END_TIMEOUT) == Err(RecvTimeoutError::Disconnected);
        if released && let Some(thread) = self.thread.take() {
            let _ = thread.join(); // a panic of its own is already printed
        } // a device that hangs ends with the process
    }
}

/// Makes draw lists in the calling thread and pictures in its own.
pub struct RenderThread {
    lists: ListMaker,
    requests: SyncSender<RenderRequest>,
    /// Dropped after `requests`, whose end the painter waits for.
    _end: PainterEnd,
    /// Pictures of the first facet.
    pictures: Pictures,
    /// Pictures of the other facets.
    others: Vec<Pictures>,
    software: bool,
    adapter: String,
}

impl RenderThread {
    /// Starts the thread for facets with one adapter, or for all facets unfolded if there is none.
    pub fn new(
        setup: &RunSetup,
        facets: &[Facet],
        quality: Option<Quality>,
        overlays: DebugDraw,
    ) -> Result<RenderThread, Failure> {
        let view = setup.view()?;
        let gpu = facets.first().and_then(|facet| facet.display.gpu.clone());
        let shown: Vec<Option<Facet>> =
            if facets.is_empty() { vec![None] } else { facets.iter().cloned().map(Some).collect() };
        let canvases: Vec<Canvas> =
            shown.into_iter().map(|facet| Canvas { facet, pictures: Pictures::default() }).collect();
        let all: Vec<Pictures> = canvases.iter().map(|canvas| canvas.pictures.clone()).collect();
        let (requests, incoming) = sync_channel::<RenderRequest>(1);
        let (ready, started) = sync_channel(1);
        let (ends, end) = sync_channel(1);
        let thread = std::thread::Builder::new()
            .name("painter".into())
            .spawn(move || {
                let _ends: SyncSender<()> = ends; // dropped last, after all that has the device
                let canvases = canvases;
                let mut renderer = match Renderer::with_adapter(gpu.as_deref()) {
                    Ok(renderer) => renderer,
                    Err(error) => {
                        let _ = ready.send(Err(error));
                        return;
                    }
                };
                let _ = ready.send(Ok((renderer.is_software(), renderer.adapter().to_owned())));
                render_all(view, &canvases, &mut renderer, &incoming);
            })
            .map_err(|e| Failure::run("drawing", e))?;
        let end = PainterEnd { closed: end, thread: Some(thread), pictures: all.clone() };
        let (software, adapter) =
            started.recv().map_err(|e| Failure::run("drawing", e))?.map_err(|e| Failure::run("drawing", e))?;
        // as in windows: a software driver is slow
        let lists = ListMaker::new(setup, quality.or(software.then(Quality::fast)), overlays);
        let mut render_thread = RenderThread {
            lists,
            requests,
            _end: end,
            pictures: all[0].clone(), // one for each canvas, and there is at least one
            others: all[1..].to_vec(),
            software,
            adapter,
        };
        // the first pictures take seconds to compile pipelines, and nothing waits for them yet
        render_thread.begin(&setup.world, &setup.viewer()?, &Wanted::first())?;
        for pictures in &all {
            pictures.want(0);
            while pictures.take(Duration::from_secs(1))?.is_none() {}
        }
        Ok(render_thread)
    }

    /// Returns the pictures of the facets but the first.
    pub fn others(&self) -> &[Pictures] {
        &self.others
    }

    /// Returns whether a software driver draws.
    pub fn is_software(&self) -> bool {
        self.software
    }

    /// Returns the graphics adapter: its name, kind and interface.
    pub fn adapter(&self) -> &str {
        &self.adapter
    }

    /// Starts the pictures of the world, or of a calibration pattern, and asks for that of the first facet.
    pub fn begin(&mut self, world: &World, viewer: &Viewer, wanted: &Wanted) -> Result<(), Failure> {
        let list = self.lists.list(world)?;
        self.pictures.want(wanted.frame);
        self.requests
            .send(RenderRequest { list, viewer: viewer.clone(), wanted: *wanted })
            .map_err(|_| Failure::run("drawing", "the render thread has ended"))
    }

    /// Returns the picture of the first facet if it is finished within `timeout`.
    pub fn finished(&mut self, timeout: Duration) -> Result<Option<Option<Image>>, Failure> {
        self.pictures.take(timeout)
    }
}

fn render_all(mut view: CaveView, canvases: &[Canvas], renderer: &mut Renderer, incoming: &Receiver<RenderRequest>) {
    while let Ok(request) = incoming.recv() {
        let Wanted { frame, burn_in, pattern, .. } = request.wanted;
        apply_viewer(&mut view, &request.viewer, frame);
        let text = |error: RenderError| error.to_string();
        let stage = renderer.stage(&request.list).map_err(text);
        let draw = |canvas: &Canvas| {
            let stage = stage.as_ref().map_err(String::clone)?;
            draw(&view, renderer, stage, canvas.facet.as_ref(), pattern).map_err(text)
        };
        // the device draws the next picture while the last one is copied
        let drawn: Vec<_> = canvases.iter().map(draw).collect();
        for (canvas, picture) in canvases.iter().zip(drawn) {
            canvas.pictures.put(frame, burn_in, picture.and_then(|p| p.wait().map_err(text)));
        }
    }
    canvases.iter().for_each(|canvas| canvas.pictures.end());
}

/// Draws a facet, or all unfolded, and begins to copy the picture.
fn draw(
    view: &CaveView,
    renderer: &mut Renderer,
    stage: &Stage,
    facet: Option<&Facet>,
    pattern: Option<CalibrationPattern>,
) -> Result<Picture, RenderError> {
    match (facet, pattern) {
        (Some(facet), Some(pattern)) => {
            return Ok(Picture::Image(finished_calibration_picture(view, facet, pattern)));
        }
        (Some(facet), None) => view.draw_on_device(renderer, stage, facet)?,
        (None, _) => view.draw_unfolded_on_device(renderer, stage, PREVIEW_PX)?,
    }
    renderer.begin_read().map(Picture::Reading)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cave::args::CaveSceneOptions;
    use crate::cave::run_setup::Role;
    use tumble::scene::SceneFile;

    /// A process that exits while a thread still releases its device crashes in the driver now and then.
    #[test]
    fn the_painter_has_released_its_device_when_it_is_dropped() {
        if Renderer::new().is_err() {
            println!("skipped: this machine has no graphics adapter");
            return;
        }
        let scene = SceneFile::parse("[[light]]\ntype = \"directional\"\ndirection = [0, 0, -1]\n", "light").unwrap();
        let surroundings = CaveSceneOptions { cave: "cube4".into(), environment: None };
        let setup = RunSetup::load(scene, &surroundings, Role::Facet).ok().unwrap();
        let facets = &setup.cave.facets[..1];
        let thread = RenderThread::new(&setup, facets, Some(Quality::fastest()), DebugDraw::default()).ok().unwrap();
        let pictures = thread.pictures.clone();
        assert!(pictures.holders() > 1, "the painter holds them as long as the device");
        drop(thread);
        assert_eq!(pictures.holders(), 1);
    }
}
