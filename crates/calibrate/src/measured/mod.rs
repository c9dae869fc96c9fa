//! A measured cave: warps, masks and screens of projectors.
//!
//! A projector that lights a single flat screen gets the part of it that it lights as its screen, and a warp.
//! One that lights a curved screen, or several, gets a mesh with the point of each node.
//!
//! ```text
//! edge of a pixel p:    e_i = min(x, w − x, y, h − y) / ½ min(w, h)       of projector i
//! share of its light:   b_i = e_i² / Σ_j e_j²,   j all projectors that light the same point;  0 beside the screens
//! ```

mod grid;
mod masks;
mod text;

use crate::fit::{Fit, Measurement, Pose, Quality, Wall, lens_ray, nearest};
use crate::mpcdi::CalibrationError;
use crate::to_cave::CaveFiles;
use nalgebra::Point3;
use tumble_render::Blend;
use tumble_scene::cave::Cave;

/// Largest root mean square distance of a projector's pixels from the fit that is accepted, pixels.
const MAX_RMS_PX: f64 = 1.0;
/// Least share of a projector's pixels that agree with each other.
const AGREEING: f64 = 0.8;
/// Least share of a picture that is seen without a note.
const WELL_SEEN: f64 = 0.6;
/// Largest expected error without a note, pixels.
const WELL_KNOWN_PX: f64 = 0.3;
/// Largest distance of a mark without a note, in standard deviations.
const WELL_MARKED: f64 = 5.0;

/// A projector as it was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Projector {
    /// The facet.
    pub facet: String,
    /// Center of its lens, m, cave axes. Behind a screen for rear projection it is the mirror image in front.
    /// Uncertain along the line of sight if it lights a single flat screen.
    pub position_m: [f64; 3],
    /// Focal length, pixels.
    pub focal_px: f64,
    /// Middle of the lens in the picture, pixels.
    pub center_px: [f64; 2],
    /// Distortion.
    pub k: [f64; 2],
    /// How well it is known.
    pub quality: Quality,
}

/// The result of a measurement.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// `cave.toml` with its warps and masks, and `screens.toml`: the cave that was given, with its screens at
    /// the places where they were found.
    pub files: CaveFiles,
    /// By facet.
    pub projectors: Vec<Projector>,
    /// By view: the camera's position, m, cave axes.
    pub cameras_m: Vec<[f64; 3]>,
    /// Focal length of the camera, pixels.
    pub focal_px: f64,
    /// Root mean square distance of marks, pixels of the photographs.
    pub marks_rms_px: f64,
}

/// Measures a cave. `text` is its file; `eye` the number of the view that was taken from the first user's place.
///
/// # Errors
/// [`CalibrationError`] with the view or facet: photographs that show too little, marks that do not fit,
/// mirrored pictures, screens without a formula, and a fit worse than a pixel.
pub fn calibrate(
    cave: &Cave,
    text: &str,
    measured: &Measurement,
    eye: Option<usize>,
) -> Result<Calibration, CalibrationError> {
    check_handedness(cave, measured)?;
    let fit = Fit::new(cave, measured)?;
    let mut notes = Vec::new();
    for (facet, quality) in cave.facets.iter().zip(&fit.quality) {
        let place = format!("facet \"{}\"", facet.name);
        if quality.rms_px > MAX_RMS_PX {
            let reason = format!(
                "its pixels are {:.2} pixels from the fit, root mean square; expected below {MAX_RMS_PX}. Do the screens have the shape and size of the cave file, did camera or projector move?",
                quality.rms_px
            );
            return Err(CalibrationError::new(place, reason));
        }
        if quality.agreeing < AGREEING {
            let share = 100.0 * (1.0 - quality.agreeing);
            let reason = format!(
                "{share:.0} % of its pixels contradict the others; expected at most {:.0} %. Do the screens have the shape and size of the cave file, did camera or projector move?",
                100.0 * (1.0 - AGREEING)
            );
            return Err(CalibrationError::new(place, reason));
        }
        if quality.seen < WELL_SEEN {
            let share = 100.0 * quality.seen;
            notes.push(format!(
                "{place}: the photographs show {share:.0} % of its picture; the rest follows from its lens"
            ));
        }
        if quality.expected_px > WELL_KNOWN_PX {
            let px = quality.expected_px;
            notes.push(format!(
                "{place}: its light is known to {px:.2} pixels; more marks, or more exact ones, improve it"
            ));
        }
    }
    let (view, number, distance) = fit.worst_mark;
    if let Some(mark) = measured.views.get(view).and_then(|view| view.marks.get(number))
        && distance > WELL_MARKED * mark.sigma_px
    {
        notes.push(format!(
            "view \"{}\": the mark {:?} m is {distance:.1} pixels from its place; is its pixel right?",
            measured.views[view].name, mark.point_m
        ));
    }
    let mut files = CaveFiles { cave: String::new(), files: Vec::new(), notes };
    let mut table = text::Table::parse(text, cave)?;
    files.files.push(("screens.toml".into(), table.with_screens(&fit.walls).into_bytes()));
    if let Some(view) = eye.and_then(|i| fit.views.get(i)) {
        table.set_eye(view.position);
    }
    for i in 0..cave.facets.len() {
        facet(cave, &fit, i, &mut table, &mut files)?;
    }
    files.cave = table.text();
    let projector = |i: usize| {
        let (pose, lens) = &fit.projectors[i];
        Projector {
            facet: cave.facets[i].name.clone(),
            position_m: pose.position.coords.into(),
            focal_px: lens[0].exp(),
            center_px: [lens[2], lens[3]],
            k: [lens[4], lens[5]],
            quality: fit.quality[i],
        }
    };
    Ok(Calibration {
        projectors: (0..cave.facets.len()).map(projector).collect(),
        cameras_m: fit.views.iter().map(|view| view.position.coords.into()).collect(),
        focal_px: fit.camera[0].exp(),
        marks_rms_px: fit.marks_rms_px,
        files,
    })
}

/// Writes the screen, warp and mask of a facet.
fn facet(
    cave: &Cave,
    fit: &Fit,
    i: usize,
    table: &mut text::Table,
    files: &mut CaveFiles,
) -> Result<(), CalibrationError> {
    let (name, size) = (&cave.facets[i].name, cave.facets[i].size_px);
    let fail = |reason: &str| CalibrationError::new(format!("facet \"{name}\""), reason);
    let light = Light { fit, projector: i };
    match grid::single_flat(&light, size) {
        Some(wall) => {
            let (corners, warp) = grid::warp(&light, wall, size).ok_or_else(|| fail("its light misses its screen"))?;
            table.set_flat(i, name, corners);
            table.set_file(i, "warp_file", &format!("{name}_warp.pfm"));
            files.files.push((format!("{name}_warp.pfm"), warp.to_bytes()));
        }
        None => {
            let points = grid::points(&light, size);
            if points.values.iter().all(|p| p[0].is_nan()) {
                return Err(fail("its light misses the screens"));
            }
            table.set_mesh(i, name, &format!("{name}_points.pfm"));
            files.files.push((format!("{name}_points.pfm"), points.to_bytes()));
        }
    }
    let shares = masks::shares(cave, fit, i);
    if shares.iter().any(|share| *share < 1.0) {
        let shares: Vec<[f32; 3]> = shares.into_iter().map(|share| [share; 3]).collect();
        let png = Blend::png(&shares, size).map_err(|e| fail(&e.to_string()))?;
        table.set_file(i, "blend_file", &format!("{name}_blend.png"));
        files.files.push((format!("{name}_blend.png"), png));
    }
    Ok(())
}

/// The light of a projector.
struct Light<'a> {
    fit: &'a Fit,
    projector: usize,
}

impl Light<'_> {
    /// Returns the wall and the point that a place of the picture lights; the screens reach `margin` shares
    /// beyond their edges.
    fn at(&self, place: [f64; 2], margin: f64) -> Option<(usize, Point3<f64>)> {
        let (pose, lens) = self.lens();
        nearest(&self.fit.walls, &pose.position, &pose.outward(&lens_ray(lens, place)?), margin)
    }

    /// Returns the place in the picture of a screen of which a place of the projector lights a point, on the
    /// screen's plane without edges.
    fn on(&self, wall: usize, place: [f64; 2]) -> Option<[f64; 2]> {
        let (pose, lens) = self.lens();
        let ray = pose.outward(&lens_ray(lens, place)?);
        let wall: &Wall = &self.fit.walls[wall];
        Some(wall.place(&(pose.position + ray * wall.hit(&pose.position, &ray)?)))
    }

    fn lens(&self) -> (&Pose, &[f64]) {
        let (pose, lens) = &self.fit.projectors[self.projector];
        (pose, lens)
    }
}

/// Checks that pictures are not mirrored: columns and rows turn the same way in photographs and projector.
fn check_handedness(cave: &Cave, measured: &Measurement) -> Result<(), CalibrationError> {
    for (i, facet) in cave.facets.iter().enumerate() {
        let (mut right, mut wrong) = (0usize, 0usize);
        for decoded in measured.views.iter().filter_map(|view| view.decoded[i].as_ref()) {
            let width = decoded.size_px[0] as usize;
            for (at, three) in decoded.places.windows(2).enumerate() {
                let below = decoded.places.get(at + width).copied().flatten();
                let (Some(p), Some(x), Some(y)) = (three[0], three[1], below) else { continue };
                let turn = (x[0] - p[0]) * (y[1] - p[1]) - (x[1] - p[1]) * (y[0] - p[0]);
                right += usize::from(turn > 0.0);
                wrong += usize::from(turn < 0.0);
            }
        }
        if wrong > right {
            return Err(CalibrationError::new(
                format!("facet \"{}\"", facet.name),
                format!(
                    "its picture is mirrored on the screen; change its flip, which is \"{}\", so that left and right or top and bottom are exchanged, and photograph again",
                    text::flip(facet.flip)
                ),
            ));
        }
    }
    Ok(())
}
