//! `tumble view`: a scene in a window. Keys and mouse move the user, control time and pull bodies.
//!
//! Simulated time follows the clock in whole steps: the clock decides how many steps are taken, and
//! has no influence on a step. If nothing is pulled and no joint is moved, the state after n steps
//! is that of `tumble run`.

mod joints;
mod keys;
mod overlays;
mod picker;
mod presets;
mod real_time;
mod simulation_thread;
mod statistics;
mod status;
mod user;
pub mod view_mode;
mod viewer;

use crate::args::ViewOptions;
use crate::atomic_file::check_writable;
use crate::capture::write_png;
use crate::failure::Failure;
use tumble::render::{CaveView, RenderError, WindowOptions, run_window};
use tumble::scene::SceneFile;
use tumble::scene::cave::{Output, resolve_cave};
use view_mode::ViewMode;
use viewer::Viewer;

/// Default size of the window, pixels.
const DEFAULT_SIZE_PX: [u32; 2] = [1280, 720];

/// Shows a scene until the window is closed.
pub fn view(options: &ViewOptions) -> Result<(), Failure> {
    check_outputs(options)?;
    let scene = options.scene.load()?;
    let (world, notes) = scene.build().map_err(Failure::input)?;
    notes.iter().for_each(|note| eprintln!("{note}"));
    let view_mode = view_mode(&scene, options)?;
    let window = window(&view_mode, options);
    let mut viewer = Viewer::new(&scene, world, view_mode, options)?;
    run_window(&window, &mut viewer)?;
    let image = viewer.finish()?;
    match (&options.screenshot, image) {
        (Some(path), Some(image)) => write_png(&image, path),
        _ => Ok(()),
    }
}

/// Checks `--screenshot` and `--screenshot-dir` before a window opens.
fn check_outputs(options: &ViewOptions) -> Result<(), Failure> {
    if let Some(path) = &options.screenshot {
        check_writable(path).map_err(|why| Failure::input(format!("--screenshot: {why}")))?;
    }
    if !options.screenshot_dir.is_dir() {
        return Err(Failure::input(format!(
            "--screenshot-dir {}: there is no such folder",
            options.screenshot_dir.display()
        )));
    }
    Ok(())
}

fn view_mode(scene: &SceneFile, options: &ViewOptions) -> Result<ViewMode, Failure> {
    let Some(name) = &options.cave else {
        // clap requires --cave with --facet and with --preview
        return Ok(ViewMode::Camera);
    };
    let cave = resolve_cave(name)?.load()?;
    let facet = options.facet.as_ref().map(|facet| cave.facet(facet).cloned()).transpose()?;
    let view = Box::new(CaveView::new(cave, scene).map_err(Failure::input)?);
    match facet {
        Some(_) if options.size.is_some() => {
            Err(Failure::input("a facet has the size in its cave file (size_px); --size needs --preview, or no cave"))
        }
        Some(facet) => Ok(ViewMode::Facet(view, Box::new(facet))),
        None => Ok(ViewMode::Unfolded(view)),
    }
}

fn window(view_mode: &ViewMode, options: &ViewOptions) -> WindowOptions {
    let most = options.size.map_or(DEFAULT_SIZE_PX, |(w, h)| [w, h]);
    let name = &options.scene.name;
    match view_mode {
        ViewMode::Camera => WindowOptions::new(format!("tumble: {name}"), most),
        ViewMode::Unfolded(view) => {
            WindowOptions::new(format!("tumble: {name} in {}", view.cave().file), view.size_px(None, most))
        }
        ViewMode::Facet(view, facet) => {
            let title = format!("tumble: {name} on {}", facet.name);
            let position_px = match facet.output {
                Output::Window { position_px } => Some(position_px),
                Output::Offscreen => None,
            };
            WindowOptions {
                position_px,
                decorated: false,
                resizable: false,
                ..WindowOptions::new(title, view.size_px(Some(facet), most))
            }
        }
    }
}

impl From<RenderError> for Failure {
    fn from(error: RenderError) -> Failure {
        match error {
            RenderError::BadSize { .. } => Failure::input(error),
            error => Failure::run("the window", error),
        }
    }
}
