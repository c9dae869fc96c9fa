//! Pictures of a run: a screenshot of the last frame, a series of frames in a folder, or a video.
//! The viewpoint is a camera, one facet of a cave, or the cave unfolded.

use crate::args::RunOptions;
use crate::atomic_file::write_file;
use crate::failure::Failure;
use crate::frames_folder::begin_without_list;
use crate::video::Video;
use std::path::Path;
use tumble::dynamics::World;
use tumble::render::{CaveView, DebugDraw, DrawList, Drawing, Image, Quality, RenderError, Renderer};
use tumble::scene::SceneFile;
use tumble::scene::cave::{Facet, resolve_cave};

/// Default size of a picture, pixels.
const DEFAULT_SIZE_PX: [u32; 2] = [1280, 720];
/// Factor by which shadow maps of a cave are wider, because one map serves all of its screens.
const CAVE_SHADOWS: u32 = 2;

/// Takes the pictures of one run.
pub struct Capture {
    drawing: Drawing,
    renderer: Renderer,
    source: Source,
    overlays: DebugDraw,
    quality: Quality,
    camera: Option<String>,
    frames: Option<FrameSeries>,
}

/// The viewpoint of the pictures, with the requested size in pixels.
enum Source {
    Camera([u32; 2]),
    Facet(Box<CaveView>, Box<Facet>),
    Unfolded(Box<CaveView>, [u32; 2]),
}

/// Pictures at a fixed rate of simulated time.
struct FrameSeries {
    per_second: f64,
    taken: u64,
    folder: Option<std::path::PathBuf>,
    video: Option<Video>,
}

impl Capture {
    /// Checks everything that can be wrong before the simulation starts. Returns `None` if no
    /// picture is requested, and without a graphics adapter: the run goes on then, and a message
    /// says how to get one.
    pub fn new(scene: &SceneFile, world: &World, options: &RunOptions) -> Result<Option<Capture>, Failure> {
        let source = source(scene, options)?;
        if options.screenshot.is_none() && options.frames_dir.is_none() && options.video.is_none() {
            return match source {
                Source::Camera(_) => Ok(None),
                _ => Err(Failure::input("--cave needs an output: --screenshot FILE, --frames-dir DIR or --video FILE")),
            };
        }
        if options.video.is_some() {
            Video::probe()?;
        }
        let Some(renderer) = open_renderer()? else { return Ok(None) };
        let frames = frames(&source, options)?;
        let drawing = Drawing::new(scene);
        let (overlays, quality, camera) = (options.debug_draw.0, options.quality, options.camera.clone());
        let mut capture = Capture { drawing, renderer, source, overlays, quality, camera, frames };
        // reads the textures and finds the camera
        capture.list(world).map_err(Failure::input)?;
        Ok(Some(capture))
    }

    /// Returns the draw list of the world's present state.
    fn list(&mut self, world: &World) -> Result<DrawList, String> {
        let mut list = self.drawing.list(world, &self.overlays).map_err(|e| e.to_string())?;
        self.quality.apply(&mut list.settings);
        if let Some(name) = &self.camera {
            list.look_from(world, name).map_err(|e| e.to_string())?;
        }
        Ok(list)
    }

    /// Draws the world's present state.
    pub fn take(&mut self, world: &World) -> Result<Image, Failure> {
        let failed = |e: RenderError| Failure::run("the picture", e);
        let mut list = self.list(world).map_err(|e| Failure::run("the picture", e))?;
        let renderer = &mut self.renderer;
        match &mut self.source {
            Source::Camera([w, h]) => renderer.render(&list, *w, *h),
            Source::Facet(view, facet) => {
                view.set_frame(self.frames.as_ref().map_or(0, |frames| frames.taken));
                list.settings.shadow_map_size = (CAVE_SHADOWS * list.settings.shadow_map_size).min(8192);
                view.draw(renderer, &list, facet)
            }
            Source::Unfolded(view, max_size) => {
                list.settings.shadow_map_size = (CAVE_SHADOWS * list.settings.shadow_map_size).min(8192);
                view.draw_unfolded(renderer, &list, *max_size)
            }
        }
        .map_err(failed)
    }

    /// Takes the pictures that are due; called after each frame of a run that began at the
    /// simulated time `begin`, s.
    pub fn frame(&mut self, world: &World, begin: f64) -> Result<(), Failure> {
        let due = |frames: &FrameSeries| world.time() - begin >= frames.taken as f64 / frames.per_second - 1e-9;
        if !self.frames.as_ref().is_some_and(due) {
            return Ok(());
        }
        let image = self.take(world)?;
        let Some(frames) = &mut self.frames else { return Ok(()) };
        // after a frame longer than the interval several pictures are due, all of this state
        while due(frames) {
            if let Some(folder) = &frames.folder {
                let path = folder.join(format!("frame_{:06}.png", frames.taken));
                write_png(&image, &path)?;
            }
            if let Some(video) = &mut frames.video {
                video.add(&image)?;
            }
            frames.taken += 1;
        }
        Ok(())
    }

    /// Ends the video and returns the number of frames written.
    pub fn finish_frames(&mut self) -> Result<u64, Failure> {
        let Some(frames) = &mut self.frames else { return Ok(0) };
        if let Some(video) = frames.video.take() {
            video.finish()?;
        }
        Ok(frames.taken)
    }
}

fn source(scene: &SceneFile, options: &RunOptions) -> Result<Source, Failure> {
    let size = options.size.map(|(w, h)| [w, h]);
    let Some(name) = &options.cave else {
        return match &options.facet {
            Some(_) => Err(Failure::input("--facet names a facet of a cave; it needs --cave FILE")),
            None => Ok(Source::Camera(size.unwrap_or(DEFAULT_SIZE_PX))),
        };
    };
    let cave = resolve_cave(name)?.load()?;
    let facet = options.facet.as_ref().map(|facet| cave.facet(facet).cloned()).transpose()?;
    let view = Box::new(CaveView::new(cave, scene).map_err(Failure::input)?);
    match facet {
        Some(_) if size.is_some() => Err(Failure::input(
            "a facet has the size in its cave file (size_px); --size needs an unfolded cave, or no cave",
        )),
        Some(facet) => Ok(Source::Facet(view, Box::new(facet))),
        None => Ok(Source::Unfolded(view, size.unwrap_or(DEFAULT_SIZE_PX))),
    }
}

fn frames(source: &Source, options: &RunOptions) -> Result<Option<FrameSeries>, Failure> {
    if options.frames_dir.is_none() && options.video.is_none() {
        return Ok(None);
    }
    if let Some(folder) = &options.frames_dir {
        begin_without_list(folder, options.overwrite)?;
        std::fs::create_dir_all(folder)
            .map_err(|e| Failure::input(format!("{}: cannot be created: {e}", folder.display())))?;
    }
    let size = match source {
        Source::Camera(size) => *size,
        Source::Facet(view, facet) => view.size_px(Some(facet), [0, 0]),
        Source::Unfolded(view, max_size) => view.size_px(None, *max_size),
    };
    let start = |path: &std::path::PathBuf| Video::start(path, size, options.fps);
    let video = options.video.as_ref().map(start).transpose()?;
    Ok(Some(FrameSeries { per_second: options.fps, taken: 0, folder: options.frames_dir.clone(), video }))
}

/// Opens the renderer. Returns `None` without a graphics adapter, after printing how to get one.
pub fn open_renderer() -> Result<Option<Renderer>, Failure> {
    match Renderer::new() {
        Ok(renderer) => Ok(Some(renderer)),
        Err(error @ RenderError::NoAdapter { .. }) => {
            eprintln!("no picture: {error}");
            Ok(None)
        }
        Err(error) => Err(Failure::run("the picture", error)),
    }
}

/// Writes a picture as PNG, atomically.
pub fn write_png(image: &Image, path: &Path) -> Result<(), Failure> {
    write_file(path, &image.to_png().map_err(|e| Failure::run("the picture", e))?)
}
