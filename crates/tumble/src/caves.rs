//! `tumble caves`: lists the shipped caves and draws calibration patterns.

use crate::args::CavesOptions;
use crate::capture::write_png;
use crate::failure::Failure;
use tumble::render::{CaveView, calibration_picture, finished_calibration_picture};
use tumble::scene::SceneFile;
use tumble::scene::cave::{resolve_cave, shipped_caves};

/// Lists the shipped caves, or draws a calibration pattern.
pub fn caves(options: &CavesOptions) -> Result<(), Failure> {
    let Some(pattern) = options.pattern else {
        for cave in shipped_caves() {
            println!("{:<12} {}", cave.name, cave.description());
        }
        return Ok(());
    };
    // clap requires all three with --pattern
    let (Some(name), Some(facet), Some(path)) = (&options.cave, &options.facet, &options.screenshot) else {
        return Err(Failure::input("--pattern needs --cave FILE, --facet NAME and --screenshot FILE"));
    };
    let cave = resolve_cave(name)?.load()?;
    let facet = cave.facet(facet)?;
    let picture = match options.finish {
        true => {
            // the place in a scene changes no pattern
            let scene = SceneFile::parse("[cave]\norigin_m = [0, 0, 0]\n", "the origin")?;
            let view = CaveView::new(cave.clone(), &scene).map_err(Failure::input)?;
            finished_calibration_picture(&view, facet, pattern)
        }
        false => calibration_picture(&cave, facet, pattern),
    };
    write_png(&picture, path)?;
    println!("picture: {}", path.display());
    Ok(())
}
