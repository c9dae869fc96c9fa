//! Pictures of a run: of its end, one after another into a folder, or as a video; by the scene's camera, one facet of a cave, or all of them.

use crate::args::RunOptions;
use crate::failure::Failure;
use crate::video::Video;
use std::path::Path;
use tumble::core::World;
use tumble::render::{CaveView, DebugDraw, DrawList, Drawing, Image, Quality, RenderError, Renderer};
use tumble::scene::SceneFile;
use tumble::scene::cave::{Facet, resolve_cave};

/// Size of a picture where nothing is said, pixels.
const USUAL: [u32; 2] = [1280, 720];
/// Shadow maps of a cave, which hold all that its screens show together, are this much wider.
const CAVE_SHADOWS: u32 = 2;

/// Takes pictures of one scene.
pub struct Shots {
    drawing: Drawing,
    renderer: Renderer,
    from: From,
    overlays: DebugDraw,
    quality: Quality,
    camera: Option<String>,
    frames: Option<Frames>,
}

/// Where pictures are taken from, with the size asked for.
enum From {
    Camera([u32; 2]),
    Facet(Box<CaveView>, Box<Facet>),
    Unfolded(Box<CaveView>, [u32; 2]),
}

/// Pictures at an even pace of simulated time.
struct Frames {
    per_second: f64,
    taken: u64,
    folder: Option<std::path::PathBuf>,
    video: Option<Video>,
}

impl Shots {
    /// Checks all that can be wrong before the simulation starts. `None` where no picture is wanted, or where there is no graphics adapter:
    /// everything else still counts then, and the message says what brings one.
    pub fn new(scene: &SceneFile, world: &World, options: &RunOptions) -> Result<Option<Shots>, Failure> {
        let from = from(scene, options)?;
        if options.picture.is_none() && options.frames_dir.is_none() && options.video.is_none() {
            return match from {
                From::Camera(_) => Ok(None),
                _ => Err(Failure::input(
                    "--cave draws pictures; say which: --picture FILE, --frames-dir DIR or --video FILE",
                )),
            };
        }
        if options.video.is_some() {
            Video::probe()?;
        }
        let renderer = match Renderer::new() {
            Ok(renderer) => renderer,
            Err(error @ RenderError::NoAdapter { .. }) => {
                eprintln!("no picture: {error}");
                return Ok(None);
            }
            Err(error) => return Err(Failure::run("the picture", error)),
        };
        let frames = frames(&from, options)?;
        let drawing = Drawing::new(scene);
        let (overlays, quality, camera) = (options.debug_draw.0, options.quality, options.camera.clone());
        let mut shots = Shots { drawing, renderer, from, overlays, quality, camera, frames };
        // textures are read and the camera is found now
        shots.list(world).map_err(Failure::input)?;
        Ok(Some(shots))
    }

    /// What is drawn of the world as it is now.
    fn list(&mut self, world: &World) -> Result<DrawList, String> {
        let mut list = self.drawing.list(world, &self.overlays).map_err(|e| e.to_string())?;
        self.quality.apply(&mut list.settings);
        if let Some(name) = &self.camera {
            list.look_from(world, name).map_err(|e| e.to_string())?;
        }
        Ok(list)
    }

    /// The world as it is now.
    pub fn take(&mut self, world: &World) -> Result<Image, Failure> {
        let failed = |e: RenderError| Failure::run("the picture", e);
        let mut list = self.list(world).map_err(|e| Failure::run("the picture", e))?;
        let renderer = &mut self.renderer;
        match &self.from {
            From::Camera([w, h]) => renderer.render(&list, *w, *h),
            From::Facet(view, facet) => {
                list.settings.shadow_map_size = (CAVE_SHADOWS * list.settings.shadow_map_size).min(8192);
                view.draw(renderer, &list, facet)
            }
            From::Unfolded(view, most) => {
                list.settings.shadow_map_size = (CAVE_SHADOWS * list.settings.shadow_map_size).min(8192);
                view.draw_unfolded(renderer, &list, *most)
            }
        }
        .map_err(failed)
    }

    /// After each frame of a run that began at the time `begin`: takes the pictures that are due.
    pub fn frame(&mut self, world: &World, begin: f64) -> Result<(), Failure> {
        let due = |frames: &Frames| world.time() - begin >= frames.taken as f64 / frames.per_second - 1e-9;
        if !self.frames.as_ref().is_some_and(due) {
            return Ok(());
        }
        let image = self.take(world)?;
        let Some(frames) = &mut self.frames else { return Ok(()) };
        // a frame longer than the pace stands for all that were due in it
        while due(frames) {
            if let Some(folder) = &frames.folder {
                let path = folder.join(format!("frame_{:06}.png", frames.taken));
                image.write_png(path).map_err(|e| Failure::run("the frames", e))?;
            }
            if let Some(video) = &mut frames.video {
                video.add(&image)?;
            }
            frames.taken += 1;
        }
        Ok(())
    }

    /// Ends the video; the number of frames written.
    pub fn finish_frames(&mut self) -> Result<u64, Failure> {
        let Some(frames) = &mut self.frames else { return Ok(0) };
        if let Some(video) = frames.video.take() {
            video.finish()?;
        }
        Ok(frames.taken)
    }
}

fn from(scene: &SceneFile, options: &RunOptions) -> Result<From, Failure> {
    let size = options.size.map(|(w, h)| [w, h]);
    let Some(name) = &options.cave else {
        return match &options.facet {
            Some(_) => Err(Failure::input("--facet names a facet of a cave; say which with --cave FILE")),
            None => Ok(From::Camera(size.unwrap_or(USUAL))),
        };
    };
    let cave = resolve_cave(name)?.load()?;
    let facet = options.facet.as_ref().map(|facet| cave.facet(facet).cloned()).transpose()?;
    let view = Box::new(CaveView::new(cave, scene).map_err(Failure::input)?);
    match facet {
        Some(_) if size.is_some() => Err(Failure::input(
            "the cave says how large a facet is (size_px); --size goes with the unfolded cave or without one",
        )),
        Some(facet) => Ok(From::Facet(view, Box::new(facet))),
        None => Ok(From::Unfolded(view, size.unwrap_or(USUAL))),
    }
}

fn frames(from: &From, options: &RunOptions) -> Result<Option<Frames>, Failure> {
    if options.frames_dir.is_none() && options.video.is_none() {
        return Ok(None);
    }
    if let Some(folder) = &options.frames_dir {
        std::fs::create_dir_all(folder)
            .map_err(|e| Failure::input(format!("{}: cannot be made: {e}", folder.display())))?;
    }
    let size = match from {
        From::Camera(size) => *size,
        From::Facet(view, facet) => view.size_px(Some(facet), [0, 0]),
        From::Unfolded(view, most) => view.size_px(None, *most),
    };
    let start = |path: &std::path::PathBuf| Video::start(path, size, options.fps);
    let video = options.video.as_ref().map(start).transpose()?;
    Ok(Some(Frames { per_second: options.fps, taken: 0, folder: options.frames_dir.clone(), video }))
}

/// Writes a picture as PNG.
pub fn write_png(image: &Image, path: &Path) -> Result<(), Failure> {
    image.write_png(path).map_err(|e| Failure::run("the picture", e))
}

/// What can be known of a file before it is written at the end.
///
/// # Errors
/// Why it cannot be written.
pub fn may_be_written(path: &Path) -> Result<(), String> {
    match path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        Some(folder) if !folder.is_dir() => Err(format!("there is no folder {}", folder.display())),
        _ if path.is_dir() => Err("it is a folder; wanted a file".into()),
        _ => Ok(()),
    }
}
