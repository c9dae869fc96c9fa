//! First values: the camera from its marks, each projector from points that it lights.
//!
//! The focal length is tried in steps of a tenth. For each, the pose that fits best is found from triples; the
//! best of all is refined.

use super::bundle::{Mark, Observed, View, What, camera_priors, projector_priors};
use super::least_squares::{Prior, minimize};
use super::lens::{CAMERA, LENS, POSE, Pose, camera_pixel};
use super::resection::pose_of;
use crate::mpcdi::CalibrationError;
use nalgebra::{Point3, Vector3};

/// Smallest number of marks of a view.
const MIN_MARKS: usize = 4;
/// Largest distance of a mark that counts in full, as a share of the photograph's width.
const CAP: f64 = 0.05;
/// Largest root mean square distance of the marks before lenses are known well, as a share of the width.
const MAX_MISS: f64 = 0.02;
/// Number of points that a projector's pose is searched with.
const SOME: usize = 60;

/// Returns the camera, without distortion beyond the first number, and its pose in each view.
pub(super) fn camera(views: &[View]) -> Result<([f64; CAMERA], Vec<Pose>), CalibrationError> {
    let Some(first) = views.first() else {
        return Err(CalibrationError::new("the photographs", "there is no view"));
    };
    for view in views {
        let fail = |reason: String| CalibrationError::new(format!("view \"{}\"", view.name), reason);
        if view.size_px != first.size_px {
            let ([w, h], [w0, h0]) = (view.size_px, first.size_px);
            return Err(fail(format!(
                "has photographs of {w} x {h} pixels, and view \"{}\" of {w0} x {h0}; expected one camera, held the same way",
                first.name
            )));
        }
        if view.marks.len() < MIN_MARKS {
            return Err(fail(format!("has {} marks, expected at least {MIN_MARKS}", view.marks.len())));
        }
    }
    let [w, h] = first.size_px.map(f64::from);
    let mut best: Option<(f64, f64, Vec<Pose>)> = None;
    for step in 0..30 {
        let f = 0.28 * w.max(h) * 1.1f64.powi(step);
        let poses: Option<Vec<(Pose, f64)>> = views.iter().map(|view| pose(view, f, [w, h])).collect();
        let Some(poses) = poses else { continue };
        let cost: f64 = poses.iter().map(|(_, cost)| cost * f * f).sum();
        if best.as_ref().is_none_or(|(least, ..)| cost < *least) {
            best = Some((cost, f, poses.into_iter().map(|(pose, _)| pose).collect()));
        }
    }
    let (_, f, poses) = best.ok_or_else(|| {
        CalibrationError::new("the marks", "give no pose of the camera; expected points that are not in one line")
    })?;
    refined(views, f, poses, [w, h])
}

/// Returns the pose of a view for a focal length.
fn pose(view: &View, f: f64, [w, h]: [f64; 2]) -> Option<(Pose, f64)> {
    let points: Vec<Point3<f64>> = view.marks.iter().map(|mark| Point3::from(mark.point_m)).collect();
    let ray = |mark: &Mark| Vector3::new((mark.pixel[0] - 0.5 * w) / f, (mark.pixel[1] - 0.5 * h) / f, 1.0);
    let rays: Vec<Vector3<f64>> = view.marks.iter().map(ray).collect();
    pose_of(&points, &rays, CAP * w / f)
}

fn refined(
    views: &[View],
    f: f64,
    poses: Vec<Pose>,
    size: [f64; 2],
) -> Result<([f64; CAMERA], Vec<Pose>), CalibrationError> {
    let mut x = vec![f.ln(), 0.5 * size[0], 0.5 * size[1], 0.0, 0.0, 0.0, 0.0, 0.0];
    poses.iter().for_each(|pose| x.extend(pose.numbers()));
    let mut priors = camera_priors(size).to_vec();
    priors[4..].fill(Prior::Fixed);
    priors.extend(vec![Prior::Free; POSE * views.len()]);
    let of = |(i, view): (usize, &View)| {
        let unknowns: Vec<usize> = (0..CAMERA).chain(CAMERA + POSE * i..CAMERA + POSE * (i + 1)).collect();
        let term = move |mark: &Mark| Observed { unknowns: unknowns.clone(), what: What::Mark(mark.clone()) };
        view.marks.iter().map(term).collect::<Vec<_>>()
    };
    let terms: Vec<Observed> = views.iter().enumerate().flat_map(of).collect();
    minimize(&mut x, &terms, &priors);
    let poses: Vec<Pose> = (0..views.len()).map(|i| Pose::of(&x[CAMERA + POSE * i..][..POSE])).collect();
    let camera = std::array::from_fn(|k| x[k]);
    for (view, pose) in views.iter().zip(&poses) {
        check(view, pose, &camera, size[0])?;
    }
    Ok((camera, poses))
}

/// Checks that the marks of a view fit its pose.
fn check(view: &View, pose: &Pose, camera: &[f64; CAMERA], width: f64) -> Result<(), CalibrationError> {
    let miss = |mark: &Mark| {
        let seen = camera_pixel(camera, &pose.local(&Point3::from(mark.point_m)));
        seen.map_or(f64::INFINITY, |[x, y]| (x - mark.pixel[0]).hypot(y - mark.pixel[1]))
    };
    let misses: Vec<f64> = view.marks.iter().map(miss).collect();
    let rms = (misses.iter().map(|m| m * m).sum::<f64>() / misses.len() as f64).sqrt();
    if rms <= MAX_MISS * width {
        return Ok(());
    }
    let worst = (0..misses.len()).max_by(|a, b| misses[*a].total_cmp(&misses[*b])).unwrap_or(0);
    let (mark, [x, y]) = (view.marks[worst].point_m, view.marks[worst].pixel);
    Err(CalibrationError::new(
        format!("view \"{}\"", view.name),
        format!(
            "its marks do not fit each other: {rms:.0} pixels apart; the worst is {mark:?} m at pixel [{x}, {y}], {:.0} pixels off. Is a pixel at another point, or left and right exchanged?",
            misses[worst]
        ),
    ))
}

/// Returns pose and lens of a projector from points that it lights.
pub(super) fn projector(lit: &[(Point3<f64>, [f64; 2])], [w, h]: [f64; 2]) -> Option<[f64; POSE + LENS]> {
    let every = (lit.len() / SOME).max(1);
    let some: Vec<_> = lit.iter().step_by(every).copied().collect();
    let points: Vec<Point3<f64>> = some.iter().map(|(point, _)| *point).collect();
    let mut found: Vec<(f64, Vec<f64>)> = Vec::new();
    // lenses that are shifted up or down have their middle outside of the picture
    for (step, shift) in (0..16).flat_map(|step| [0.5, 0.0, 1.0, -0.3, 1.3].map(|shift| (step, shift))) {
        let f = 0.3 * w * 1.2f64.powi(step);
        let rays: Vec<Vector3<f64>> =
            some.iter().map(|(_, [x, y])| Vector3::new((x - 0.5 * w) / f, (y - shift * h) / f, 1.0)).collect();
        if let Some((pose, cost)) = pose_of(&points, &rays, CAP * w / f) {
            let mut x = pose.numbers().to_vec();
            x.extend([f.ln(), 0.0, 0.5 * w, shift * h, 0.0, 0.0]);
            found.push((cost * f * f, x));
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let unknowns: Vec<usize> = (0..POSE + LENS).collect();
    let term = |(point, place): &(Point3<f64>, [f64; 2])| Observed {
        unknowns: unknowns.clone(),
        what: What::Lit { point: *point, place: *place },
    };
    let terms: Vec<Observed> = some.iter().map(term).collect();
    let priors = projector_priors([w, h]);
    let fitted = found.into_iter().take(6).map(|(_, mut x)| (minimize(&mut x, &terms, &priors), x));
    let (_, x) = fitted.min_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(std::array::from_fn(|k| x[k]))
}
