//! Parsers of values on the command line. An error is the end of a message: the expected value.

use std::path::{Path, PathBuf};
use tumble::collide::Builder;
use tumble::render::{MAX_PIXELS, MAX_SIDE};
use tumble::scene::Solver;
use tumble::scene::urdf::{JointPositions, MAX_POSES, MissingMeshes};

fn number(text: &str, from: f64, to: f64) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(x) if (from..=to).contains(&x) => Ok(x),
        _ => Err(format!("expected a number from {from} to {to}")),
    }
}

pub fn seconds(text: &str) -> Result<f64, String> {
    number(text, 0.0, 1e6)
}

pub fn gain(text: &str) -> Result<f64, String> {
    number(text, -tumble::sound::MAX_GAIN_DB, tumble::sound::MAX_GAIN_DB)
}

pub fn time_step(text: &str) -> Result<f64, String> {
    number(text, 1e-6, 1.0)
}

pub fn rate(text: &str) -> Result<f64, String> {
    number(text, 0.01, 1000.0)
}

pub fn web_timeout(text: &str) -> Result<f64, String> {
    number(text, 1.0, 60_000.0)
}

pub fn cutoff(text: &str) -> Result<f64, String> {
    number(text, 0.01, 100.0)
}

pub(super) fn millimeters(text: &str) -> Result<f64, String> {
    number(text, 0.0, 1000.0)
}

pub fn solver(text: &str) -> Result<Solver, String> {
    let name = if text == "lcp" { "lcp_pyramid" } else { text };
    name.parse().map_err(|e: tumble::scene::UnknownName| e.to_string())
}

pub(super) fn fraction(text: &str) -> Result<f64, String> {
    number(text, 1e-4, 1.0)
}

/// Parses the names that the JSON of a tree uses.
pub(super) fn method(text: &str) -> Result<Builder, String> {
    serde_json::from_value(text.into()).map_err(|e| e.to_string().replace("variant", "method").replace('`', ""))
}

pub(super) fn folder(text: &str) -> Result<PathBuf, String> {
    if text.trim().is_empty() { Err("expected the name of a folder".into()) } else { Ok(PathBuf::from(text)) }
}

pub(super) fn package(text: &str) -> Result<(String, PathBuf), String> {
    let (name, folder) = text
        .split_once('=')
        .filter(|(name, folder)| !name.is_empty() && !folder.is_empty())
        .ok_or("expected NAME=DIR")?;
    if Path::new(folder).is_dir() {
        Ok((name.into(), folder.into()))
    } else {
        Err(format!("there is no folder {folder}"))
    }
}

/// Parses a number for all links, or `LINK=NUMBER` for one.
pub(super) fn per_link<T: std::str::FromStr<Err: std::fmt::Display>>(
    text: &str,
) -> Result<(Option<String>, T), String> {
    let (link, number) = text.rsplit_once('=').map_or((None, text), |(link, number)| (Some(link.to_owned()), number));
    Ok((link, number.trim().parse().map_err(|e| format!("{e}; expected a number, or LINK=NUMBER"))?))
}

/// Parses `zero` or `JOINT=POSITION,…`.
pub(super) fn joint_positions(text: &str) -> Result<JointPositions, String> {
    let one = |word: &str| {
        let (joint, position) = word.split_once('=').ok_or("expected zero, or JOINT=POSITION,... with rad or m")?;
        let position = position.trim().parse().map_err(|e| format!("joint {joint}: {e}"))?;
        Ok((joint.trim().to_owned(), position))
    };
    if text.trim() == "zero" { Ok(JointPositions::new()) } else { text.split(',').map(one).collect() }
}

pub(super) fn pose_count(text: &str) -> Result<usize, String> {
    let expected = || format!("expected 0 to {MAX_POSES}");
    text.parse().ok().filter(|count| *count <= MAX_POSES).ok_or_else(expected)
}

pub(super) fn missing(text: &str) -> Result<MissingMeshes, String> {
    match text {
        "error" => Ok(MissingMeshes::Error),
        "skip" => Ok(MissingMeshes::Skip),
        _ => Err("expected error or skip".into()),
    }
}

/// Parses the name of a picture: its extension must be .png, or missing.
pub(super) fn png(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match path.extension() {
        Some(ending) if !ending.eq_ignore_ascii_case("png") => {
            Err("pictures are written as PNG; expected a file that ends in .png".into())
        }
        _ => Ok(path),
    }
}

/// Parses the name of a sound: its extension must be .wav, or missing.
pub(super) fn wav(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match path.extension() {
        Some(ending) if !ending.eq_ignore_ascii_case("wav") => {
            Err("sound is written as WAV; expected a file that ends in .wav".into())
        }
        _ => Ok(path),
    }
}

pub(super) fn planner(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or(text);
    if ["yaml", "yml", "json"].contains(&ending) {
        Ok(path)
    } else {
        Err("expected yaml, json, or a file that ends in .yml, .yaml or .json".into())
    }
}

pub(super) fn size(text: &str) -> Result<(u32, u32), String> {
    let parsed = text.split_once('x').and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    let side = 1..=MAX_SIDE;
    let fits =
        |(w, h): &(u32, u32)| side.contains(w) && side.contains(h) && u64::from(*w) * u64::from(*h) <= MAX_PIXELS;
    parsed
        .filter(fits)
        .ok_or_else(|| format!("expected WIDTHxHEIGHT in pixels, each 1 to {MAX_SIDE}, together at most {MAX_PIXELS}"))
}

/// Reads three numbers with commas between them.
pub fn point(text: &str) -> Result<[f64; 3], String> {
    let numbers: Option<Vec<f64>> =
        text.split(',').map(|word| word.trim().parse().ok().filter(|x: &f64| x.abs() <= 1e6)).collect();
    numbers.and_then(|numbers| numbers.try_into().ok()).ok_or_else(|| "expected three numbers, such as 0,0,1.7".into())
}
