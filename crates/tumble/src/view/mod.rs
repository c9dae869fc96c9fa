//! `tumble view`: a scene in a window. Keys and mouse move the user, time stands and goes, bodies are pulled.
//!
//! Time goes by the clock, in whole steps: which steps are taken depends on the clock, what a step does does not. When nobody pulls, the state after n steps is
//! that of `tumble run`.

mod hand;
mod joints;
mod keys;
mod overlays;
mod pace;
mod presets;
pub mod sight;
mod simulation;
mod statistics;
mod status;
mod user;
mod viewer;

use crate::args::ViewOptions;
use crate::failure::Failure;
use crate::shots::{may_be_written, write_png};
use sight::Sight;
use tumble::render::{CaveView, RenderError, WindowOptions, run_window};
use tumble::scene::SceneFile;
use tumble::scene::cave::{Output, resolve_cave};
use viewer::Viewer;

/// Size of the window where nothing is said, pixels.
const USUAL: [u32; 2] = [1280, 720];

/// Shows a scene until the window is closed.
pub fn view(options: &ViewOptions) -> Result<(), Failure> {
    pictures_may_be_written(options)?;
    let scene = options.scene.load()?;
    let (world, notes) = scene.build().map_err(Failure::input)?;
    notes.iter().for_each(|note| eprintln!("{note}"));
    let sight = sight(&scene, options)?;
    let window = window(&sight, options);
    let mut viewer = Viewer::new(&scene, world, sight, options)?;
    run_window(&window, &mut viewer)?;
    let image = viewer.finish()?;
    match (&options.picture, image) {
        (Some(path), Some(image)) => write_png(&image, path),
        _ => Ok(()),
    }
}

/// What can be known of `--picture` and `--shots` before a window opens.
fn pictures_may_be_written(options: &ViewOptions) -> Result<(), Failure> {
    if let Some(path) = &options.picture {
        may_be_written(path).map_err(|why| Failure::input(format!("--picture {}: {why}", path.display())))?;
    }
    if !options.shots.is_dir() {
        return Err(Failure::input(format!("--shots {}: there is no such folder", options.shots.display())));
    }
    Ok(())
}

fn sight(scene: &SceneFile, options: &ViewOptions) -> Result<Sight, Failure> {
    let Some(name) = &options.cave else {
        // clap lets neither --facet nor --preview through without it
        return Ok(Sight::Camera);
    };
    let cave = resolve_cave(name)?.load()?;
    let facet = options.facet.as_ref().map(|facet| cave.facet(facet).cloned()).transpose()?;
    let view = Box::new(CaveView::new(cave, scene).map_err(Failure::input)?);
    match facet {
        Some(_) if options.size.is_some() => Err(Failure::input(
            "the cave says how large a facet is (size_px); --size goes with --preview or without a cave",
        )),
        Some(facet) => Ok(Sight::Facet(view, Box::new(facet))),
        None => Ok(Sight::Unfolded(view)),
    }
}

fn window(sight: &Sight, options: &ViewOptions) -> WindowOptions {
    let most = options.size.map_or(USUAL, |(w, h)| [w, h]);
    let name = &options.scene.name;
    match sight {
        Sight::Camera => WindowOptions::new(format!("tumble: {name}"), most),
        Sight::Unfolded(view) => {
            WindowOptions::new(format!("tumble: {name} in {}", view.cave().file), view.size_px(None, most))
        }
        Sight::Facet(view, facet) => {
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
