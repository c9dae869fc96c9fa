//! `tumble calibrate`: patterns of structured light, and caves of photographs of them.

use crate::args::{CalibrateAction, CalibrateOptions, SolveOptions};
use crate::atomic_file::{check_replaceable, write_file};
use crate::failure::Failure;
use std::path::Path;
use tumble::scene::cave::{Cave, resolve_cave};
use tumble::scene::read_file;
use tumble_calibrate::{Calibration, Measurement, Pattern, parse_marks, photographs};

/// Largest file of marks, bytes.
const MAX_MARKS_BYTES: u64 = 1 << 20;

/// Writes patterns, or measures a cave.
pub fn calibrate(options: &CalibrateOptions) -> Result<(), Failure> {
    match &options.action {
        CalibrateAction::Patterns { cave, output, overwrite } => patterns(cave, output, *overwrite),
        CalibrateAction::Solve(options) => solve(options),
    }
}

fn patterns(name: &str, folder: &Path, overwrite: bool) -> Result<(), Failure> {
    let cave = resolve_cave(name)?.load()?;
    let mut count = 0;
    for facet in &cave.facets {
        let folder = folder.join(&facet.name);
        create(&folder)?;
        let sequence = Pattern::sequence(facet.size_px);
        for (i, pattern) in sequence.iter().enumerate() {
            let path = folder.join(format!("{i:02}_{}.png", pattern.name()));
            check_replaceable(&path, overwrite)?;
            write_file(&path, &pattern.picture(facet).to_png().map_err(Failure::input)?)?;
        }
        count += sequence.len();
        println!("\"{}\": {} pictures in {}", facet.name, sequence.len(), folder.display());
    }
    println!("photograph {count} pictures from each place of the camera");
    Ok(())
}

fn solve(options: &SolveOptions) -> Result<(), Failure> {
    let source = resolve_cave(&options.cave)?;
    let (cave, text) = (source.load()?, source.text()?);
    let path = options.output.join("cave.toml");
    check_replaceable(&path, options.overwrite)?;
    let marks = options.marks.display().to_string();
    let marks = parse_marks(&marks_text(&options.marks)?, &marks).map_err(Failure::input)?;
    let views = photographs(&options.photos, &cave, &marks, |line| println!("{line}")).map_err(Failure::input)?;
    let eye = options.eye.as_ref().map(|name| {
        let names: Vec<&str> = views.iter().map(|view| view.name.as_str()).collect();
        let found = views.iter().position(|view| view.name == *name);
        found.ok_or_else(|| Failure::input(format!("--eye {name}: expected a view: {}", names.join(", "))))
    });
    let measured = Measurement { screens_sigma_m: 1e-3 * options.screens_mm, views };
    let made = tumble_calibrate::calibrate(&cave, &text, &measured, eye.transpose()?).map_err(Failure::input)?;
    create(&options.output)?;
    for (file, bytes) in &made.files.files {
        write_file(&options.output.join(file), bytes)?;
    }
    // the cave last: with it, everything is there
    write_file(&path, made.files.cave.as_bytes())?;
    report(&made, &cave, &measured);
    println!("cave: {}", path.display());
    Ok(())
}

/// Prints what was found.
fn report(made: &Calibration, cave: &Cave, measured: &Measurement) {
    let width = measured.views.first().map_or(0, |view| view.size_px[0]);
    println!("camera: focal length {:.1} of {width} pixels, marks {:.2} pixels", made.focal_px, made.marks_rms_px);
    for (view, [x, y, z]) in measured.views.iter().zip(&made.cameras_m) {
        println!("view \"{}\": camera at {x:.3}, {y:.3}, {z:.3} m", view.name);
    }
    for (projector, facet) in made.projectors.iter().zip(&cave.facets) {
        let ([x, y, z], q) = (projector.position_m, projector.quality);
        println!(
            "\"{}\": projector at {x:.3}, {y:.3}, {z:.3} m, throw {:.3}; {} pixels, {:.2} px from the fit, light known to {:.2} px",
            projector.facet,
            projector.focal_px / f64::from(facet.size_px[0]),
            q.pairs,
            q.rms_px,
            q.expected_px
        );
    }
    made.files.notes.iter().for_each(|note| println!("note: {note}"));
}

fn marks_text(path: &Path) -> Result<String, Failure> {
    let named = |what: String| Failure::input(format!("{}: {what}", path.display()));
    let length = std::fs::metadata(path).map_err(|e| named(format!("cannot be read: {e}")))?.len();
    if length > MAX_MARKS_BYTES {
        return Err(named(format!("has {length} bytes, and at most {MAX_MARKS_BYTES} are read")));
    }
    let bytes = read_file(path).map_err(|e| named(format!("cannot be read: {e}")))?;
    String::from_utf8(bytes).map_err(|e| named(format!("byte {} is not UTF-8", e.utf8_error().valid_up_to())))
}

fn create(folder: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(folder).map_err(|e| Failure::input(format!("{}: cannot be created: {e}", folder.display())))
}
