//! `tumble mpcdi`: caves of MPCDI archives and of configurations of SGCT, and archives of caves.

use crate::args::MpcdiOptions;
use crate::atomic_file::{check_replaceable, write_file};
use crate::failure::Failure;
use std::path::Path;
use tumble::render::CaveView;
use tumble::scene::cave::resolve_cave;
use tumble::scene::{SceneFile, read_file};
use tumble_calibrate::{Mpcdi, cave_to_mpcdi, mpcdi_to_cave, sgct_to_cave};

/// Largest file that is read, bytes.
const MAX_BYTES: u64 = 512 << 20;

/// Makes a cave of an archive, or an archive of a cave.
pub fn mpcdi(options: &MpcdiOptions) -> Result<(), Failure> {
    let ending = Path::new(&options.name).extension().and_then(|ending| ending.to_str()).unwrap_or("");
    match ending.to_ascii_lowercase().as_str() {
        "mpcdi" | "xml" | "zip" | "json" => to_cave(options),
        _ => to_archive(options),
    }
}

fn to_cave(options: &MpcdiOptions) -> Result<(), Failure> {
    let (name, folder) = (&options.name, &options.output);
    let named = |what: String| Failure::input(format!("{name}: {what}"));
    let length = std::fs::metadata(name).map_err(|e| named(format!("cannot be read: {e}")))?.len();
    if length > MAX_BYTES {
        return Err(named(format!("has {length} bytes, and at most {MAX_BYTES} are read")));
    }
    let bytes = read_file(Path::new(name)).map_err(|e| named(format!("cannot be read: {e}")))?;
    let made = match name.to_ascii_lowercase().ends_with(".json") {
        true => match std::str::from_utf8(&bytes) {
            Ok(text) => sgct_to_cave(text),
            Err(e) => return Err(named(format!("byte {} is not UTF-8", e.valid_up_to()))),
        },
        false => Mpcdi::parse(&bytes).and_then(|archive| mpcdi_to_cave(&archive, options.eye)),
    };
    let made = made.map_err(|e| named(e.to_string()))?;
    let path = folder.join("cave.toml");
    check_replaceable(&path, options.overwrite)?;
    std::fs::create_dir_all(folder)
        .map_err(|e| Failure::input(format!("{}: cannot be created: {e}", folder.display())))?;
    for (file, bytes) in &made.files {
        write_file(&folder.join(file), bytes)?;
    }
    // the cave last: with it, everything is there
    write_file(&path, made.cave.as_bytes())?;
    made.notes.iter().for_each(|note| println!("{note}"));
    println!("cave: {}", path.display());
    Ok(())
}

fn to_archive(options: &MpcdiOptions) -> Result<(), Failure> {
    check_replaceable(&options.output, options.overwrite)?;
    let cave = resolve_cave(&options.name)?.load()?;
    let named = |e: &dyn std::fmt::Display| Failure::input(format!("{}: {e}", options.name));
    let scene = SceneFile::parse("[cave]\norigin_m = [0, 0, 0]\n", "the origin")?;
    let view = CaveView::new(cave, &scene).map_err(|e| named(&e))?;
    let archive = cave_to_mpcdi(&view).map_err(|e| named(&e))?;
    write_file(&options.output, &archive.to_bytes().map_err(|e| named(&e))?)?;
    archive.notes.iter().for_each(|note| println!("{note}"));
    println!("archive: {} ({} projectors, profile a3)", options.output.display(), archive.regions.len());
    Ok(())
}
