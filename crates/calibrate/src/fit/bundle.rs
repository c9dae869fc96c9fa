//! Bundle adjustment: one camera in several places, projectors, and walls, from pixels that see each other's
//! light.
//!
//! Each decoded pixel of a photograph gives two numbers. Its ray meets a wall, and the projector that lights
//! this point does so with the pixel that was decoded:
//!
//! ```text
//! x = c + t Rᵀ ray(q)  on the wall,     r = pixel(x) − p        q pixel of the photograph, p decoded place
//! σ² = σ_p² + (σ_q |∂p/∂q|)²
//! ```
//!
//! A mark is a point with known coordinates and its pixel: `r = pixel(x) − q` of the camera.
//!
//! | unknown | numbers | expected, standard deviation |
//! |---|---|---|
//! | camera | 8, one for all views | middle of the picture, 5 % of its width; `k` 0 ± 0.3, 0.1, 0.05; `t` 0 ± 0.01 |
//! | view | 6 | nothing |
//! | wall | 4 | the cave file, within `screens_sigma_m`; 0 keeps it there |
//! | projector | 6 + 6 | square pixels within 2 %; `p₀` 20 % of the width, the whole height; `k` 0 ± 0.1, 0.05 |
//!
//! The scale and the frame are those of walls and marks. Infinite walls leave the position along a single
//! plane, the scale of a corner and the rotation of a sphere open: these come from the marks.
//! A lens and its distance trade against each other on a single flat screen. Then the pose of a projector is
//! uncertain and its light on the screen is not.
//!
//! Source: Triggs et al., "Bundle adjustment: a modern synthesis" (2000).

use super::least_squares::{Prior, Term, covariance, derivatives, minimize};
use super::lens::{CAMERA, LENS, POSE, Pose, camera_pixel, camera_ray, lens_pixel, lens_ray};
use super::start;
use super::wall::{MOVE, Wall, nearest};
use crate::light::Decoded;
use crate::mpcdi::CalibrationError;
use nalgebra::{DMatrix, Point3, Vector3};
use tumble_scene::cave::Cave;

/// Standard deviation of a decoded place: pixels of the projector, and pixels of the photograph, by which
/// lenses differ from their formula.
const PLACE_SIGMA_PX: f64 = 0.1;
const LOOK_SIGMA_PX: f64 = 0.1;
/// Distance of the neighbors, pixels of the photograph, that a pixel is used with. Beside a missing one blur
/// mixes in what is not lit.
const REACH: usize = 2;
/// Largest number of pixels of the projector in one of the photograph. Walls that are seen at a flatter angle
/// are blurred to one side.
const COARSEST: f64 = 4.0;
/// Largest number of pixels of a projector in a view that are used.
const MAX_PAIRS: usize = 800;
/// Smallest number of decoded pixels of a projector in all views.
const MIN_PAIRS: usize = 60;
/// Strips along the edges of screens, as shares of them, whose pixels are left out, round by round: a pixel
/// may lie on the next screen.
const STRIPS: [f64; 3] = [0.03, 0.01, 0.005];
/// Largest distance of a decoded place in the second and later rounds, pixels of the projector.
const OUTLIER_PX: f64 = 2.0;

/// A point of the cave in a photograph.
#[derive(Clone, Debug, PartialEq)]
pub struct Mark {
    /// Position, m, cave axes.
    pub point_m: [f64; 3],
    /// Its pixel: to the right and down from the upper left corner, middles of pixels at ½.
    pub pixel: [f64; 2],
    /// Standard deviation of the pixel.
    pub sigma_px: f64,
}

/// Photographs from one place.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// The name for messages.
    pub name: String,
    /// Width and height of the photographs, pixels.
    pub size_px: [u32; 2],
    /// Marks, at least four.
    pub marks: Vec<Mark>,
    /// By facet; `None` for facets that were not photographed.
    pub decoded: Vec<Option<Decoded>>,
}

/// All photographs of a cave, by one camera with one zoom.
#[derive(Clone, Debug, PartialEq)]
pub struct Measurement {
    /// The places of the camera.
    pub views: Vec<View>,
    /// Standard deviation of the screens' positions in the cave file, m. 0 takes them as exact.
    pub screens_sigma_m: f64,
}

/// How well a projector is known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quality {
    /// Pixels of photographs that were used.
    pub pairs: usize,
    /// Share of the pixels that were looked at that are used; the others are farther from the fit than two pixels.
    pub agreeing: f64,
    /// Root mean square of their distances from the fit, pixels of the projector.
    pub rms_px: f64,
    /// Share of the picture in which pixels were decoded, 0 to 1.
    pub seen: f64,
    /// Expected error of the light's place on the screens from noise of places and marks, pixels, root mean
    /// square over the picture.
    pub expected_px: f64,
}

/// The result.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Fit {
    pub camera: [f64; CAMERA],
    pub views: Vec<Pose>,
    pub walls: Vec<Wall>,
    pub projectors: Vec<(Pose, [f64; LENS])>,
    /// By projector.
    pub quality: Vec<Quality>,
    /// Root mean square distance of marks, pixels of the photographs.
    pub marks_rms_px: f64,
    /// View, number in the view and distance of the worst mark, pixels.
    pub worst_mark: (usize, usize, f64),
}

/// A term with the numbers of its unknowns.
pub(super) struct Observed {
    pub unknowns: Vec<usize>,
    pub what: What,
}

/// Contents of a term.
pub(super) enum What {
    /// Unknowns: camera, view.
    Mark(Mark),
    /// Unknowns: camera, view, move of the wall, pose and lens of the projector.
    Pair { wall: Wall, pixel: [f64; 2], place: [f64; 2], sigma: f64 },
    /// Unknowns: pose and lens of a projector.
    Lit { point: Point3<f64>, place: [f64; 2] },
    /// The light of a place of the projector, seen in the picture of this pose and lens; not divided by a
    /// standard deviation. Unknowns: move of the wall, pose and lens.
    Shine { wall: Wall, place: [f64; 2], pose: Pose, lens: [f64; LENS] },
}

impl Term for Observed {
    fn unknowns(&self) -> &[usize] {
        &self.unknowns
    }

    fn residual(&self, x: &[f64]) -> Option<[f64; 2]> {
        let from = |pixel: [f64; 2], place: &[f64; 2], sigma: f64| [0, 1].map(|k| (pixel[k] - place[k]) / sigma);
        match &self.what {
            What::Mark(mark) => {
                let (camera, view) = x.split_at(CAMERA);
                let pixel = camera_pixel(camera, &Pose::of(view).local(&Point3::from(mark.point_m)))?;
                Some([0, 1].map(|k| (pixel[k] - mark.pixel[k]) / mark.sigma_px))
            }
            What::Pair { wall, pixel, place, sigma } => {
                let (camera, x) = x.split_at(CAMERA);
                let (view, x) = x.split_at(POSE);
                let (moved, x) = x.split_at(MOVE);
                let (pose, lens) = x.split_at(POSE);
                let eye = Pose::of(view);
                let ray = eye.outward(&camera_ray(camera, *pixel)?);
                let point = eye.position + ray * wall.moved(moved).hit(&eye.position, &ray)?;
                Some(from(lens_pixel(lens, &Pose::of(pose).local(&point))?, place, *sigma))
            }
            What::Lit { point, place } => {
                let (pose, lens) = x.split_at(POSE);
                Some(from(lens_pixel(lens, &Pose::of(pose).local(point))?, place, 0.2))
            }
            What::Shine { wall, place, pose, lens } => {
                let (moved, x) = x.split_at(MOVE);
                let (from, from_lens) = x.split_at(POSE);
                let from = Pose::of(from);
                let ray = from.outward(&lens_ray(from_lens, *place)?);
                let point = from.position + ray * wall.moved(moved).hit(&from.position, &ray)?;
                lens_pixel(lens, &pose.local(&point)).map(|pixel| [pixel[0] - place[0], pixel[1] - place[1]])
            }
        }
    }
}

/// Positions of the unknowns: camera, views, walls, projectors.
#[derive(Clone, Copy)]
struct Layout {
    views: usize,
    walls: usize,
    projectors: usize,
}

impl Layout {
    fn view(self, i: usize) -> usize {
        CAMERA + POSE * i
    }

    fn wall(self, i: usize) -> usize {
        self.view(self.views) + MOVE * i
    }

    fn projector(self, i: usize) -> usize {
        self.wall(self.walls) + (POSE + LENS) * i
    }

    fn size(self) -> usize {
        self.projector(self.projectors)
    }
}

/// Standard deviations of a camera with pictures of this size.
pub(super) fn camera_priors([w, h]: [f64; 2]) -> [Prior; CAMERA] {
    let about = Prior::About;
    let (k, t) = ([about(0.0, 0.3), about(0.0, 0.1), about(0.0, 0.05)], about(0.0, 0.01));
    [Prior::Free, about(0.5 * w, 0.05 * w), about(0.5 * h, 0.05 * w), k[0], k[1], k[2], t, t]
}

/// Standard deviations of a projector with pictures of this size: pose and lens.
pub(super) fn projector_priors([w, h]: [f64; 2]) -> [Prior; POSE + LENS] {
    let about = Prior::About;
    let mut out = [Prior::Free; POSE + LENS];
    out[POSE..].copy_from_slice(&[
        about((1.5 * w).ln(), 1.0),
        about(0.0, 0.02),
        about(0.5 * w, 0.2 * w),
        about(0.5 * h, h),
        about(0.0, 0.1),
        about(0.0, 0.05),
    ]);
    out
}

impl Fit {
    /// Fits everything to the photographs.
    ///
    /// # Errors
    /// [`CalibrationError`] with the view or facet and the fault.
    pub fn new(cave: &Cave, measured: &Measurement) -> Result<Fit, CalibrationError> {
        let walls = walls(cave)?;
        let size = cave.facets.iter().map(|f| f.size_px.map(f64::from)).collect::<Vec<_>>();
        let (camera, eyes) = start::camera(&measured.views)?;
        let layout = Layout { views: eyes.len(), walls: walls.len(), projectors: size.len() };
        let mut x = vec![0.0; layout.size()];
        x[..CAMERA].copy_from_slice(&camera);
        for (i, eye) in eyes.iter().enumerate() {
            x[layout.view(i)..][..POSE].copy_from_slice(&eye.numbers());
        }
        let pairs = pairs(&measured.views, &walls, layout, &x, STRIPS[0]);
        for (i, size) in size.iter().enumerate() {
            let at = layout.projector(i);
            let lit = lit(&pairs, &x, at);
            let seen: usize = measured.views.iter().map(|v| v.decoded[i].as_ref().map_or(0, Decoded::count)).sum();
            let place = format!("facet \"{}\"", cave.facets[i].name);
            if lit.len() < MIN_PAIRS {
                let reason = format!(
                    "{seen} pixels of the photographs show it, {} of them on the cave's screens; expected {MIN_PAIRS} at least{}",
                    lit.len(),
                    refusals(&measured.views, i)
                );
                return Err(CalibrationError::new(place, reason));
            }
            let start = start::projector(&lit, *size).ok_or_else(|| {
                CalibrationError::new(place, "no pose fits its pixels; are marks and corners of screens right?")
            })?;
            x[at..][..POSE + LENS].copy_from_slice(&start);
        }
        let priors = priors(measured, &walls, &size, layout);
        let (mut terms, mut looked_at) = (Vec::new(), vec![0; size.len()]);
        for (round, strip) in STRIPS.iter().enumerate() {
            terms = self::pairs(&measured.views, &walls, layout, &x, *strip);
            looked_at = count(&terms, layout);
            if round > 0 {
                terms.retain(|t| distance_px(t, &x).is_some_and(|d| d <= OUTLIER_PX));
            }
            terms.extend(marks(&measured.views, layout));
            minimize(&mut x, &terms, &priors);
        }
        let spread = covariance(&x, &terms, &priors).ok_or_else(|| {
            CalibrationError::new(
                "the photographs",
                "do not determine the projectors; add marks that are not in one line, or another view",
            )
        })?;
        let mut fit = result(measured, &walls, &size, layout, &x, &terms, &spread);
        for (quality, all) in fit.quality.iter_mut().zip(looked_at) {
            quality.agreeing = quality.pairs as f64 / all.max(1) as f64;
        }
        Ok(fit)
    }
}

/// Returns the walls of the cave's screens.
fn walls(cave: &Cave) -> Result<Vec<Wall>, CalibrationError> {
    let wall = |screen: &tumble_scene::cave::Screen| {
        Wall::of(screen).map_err(|e| CalibrationError::new(format!("screen \"{}\"", screen.name), e))
    };
    cave.screens.iter().map(wall).collect()
}

fn priors(measured: &Measurement, walls: &[Wall], sizes: &[[f64; 2]], layout: Layout) -> Vec<Prior> {
    let mut out = camera_priors(measured.views[0].size_px.map(f64::from)).to_vec();
    out.extend(vec![Prior::Free; POSE * layout.views]);
    for wall in walls {
        let sigma = measured.screens_sigma_m;
        out.extend(wall.move_sigmas(sigma).map(|s| if sigma > 0.0 { Prior::About(0.0, s) } else { Prior::Fixed }));
    }
    sizes.iter().for_each(|size| out.extend(projector_priors(*size)));
    out
}

fn marks(views: &[View], layout: Layout) -> Vec<Observed> {
    let of = |(i, view): (usize, &View)| {
        let unknowns: Vec<usize> = (0..CAMERA).chain(layout.view(i)..layout.view(i + 1)).collect();
        let term = move |mark: &Mark| Observed { unknowns: unknowns.clone(), what: What::Mark(mark.clone()) };
        view.marks.iter().map(term).collect::<Vec<_>>()
    };
    views.iter().enumerate().flat_map(of).collect()
}

/// Returns the terms of decoded pixels whose rays meet a screen, at least `strip` shares of it from its edges.
fn pairs(views: &[View], walls: &[Wall], layout: Layout, x: &[f64], strip: f64) -> Vec<Observed> {
    let mut out = Vec::new();
    let there: Vec<Wall> = walls.iter().enumerate().map(|(i, w)| w.moved(&x[layout.wall(i)..][..MOVE])).collect();
    for (v, view) in views.iter().enumerate() {
        let eye = Pose::of(&x[layout.view(v)..][..POSE]);
        for (p, decoded) in view.decoded.iter().enumerate() {
            let Some(decoded) = decoded else { continue };
            let width = decoded.size_px[0] as usize;
            // every n-th pixel of every n-th row
            let n = ((decoded.count() as f64 / MAX_PAIRS as f64).sqrt().ceil() as usize).max(1);
            for (i, place) in decoded
                .places
                .iter()
                .enumerate()
                .filter(|(i, _)| (i % width).is_multiple_of(n) && (i / width).is_multiple_of(n))
            {
                let Some(place) = place.map(|p| p.map(f64::from)) else { continue };
                let Some(coarse) = decoded.density(i, REACH).filter(|c| *c <= COARSEST) else { continue };
                let pixel = [(i % width) as f64 + 0.5, (i / width) as f64 + 0.5];
                let Some(ray) = camera_ray(&x[..CAMERA], pixel).map(|ray| eye.outward(&ray)) else { continue };
                let Some((w, _)) =
                    nearest(&there, &eye.position, &ray, 0.0).filter(|(w, point)| there[*w].holds(point, -strip))
                else {
                    continue;
                };
                let unknowns = (0..CAMERA)
                    .chain(layout.view(v)..layout.view(v + 1))
                    .chain(layout.wall(w)..layout.wall(w + 1))
                    .chain(layout.projector(p)..layout.projector(p + 1))
                    .collect();
                let sigma = PLACE_SIGMA_PX.hypot(LOOK_SIGMA_PX * coarse);
                out.push(Observed { unknowns, what: What::Pair { wall: walls[w], pixel, place, sigma } });
            }
        }
    }
    out
}

/// Returns the number of pairs of each projector.
fn count(pairs: &[Observed], layout: Layout) -> Vec<usize> {
    let mut out = vec![0; layout.projectors];
    for term in pairs {
        out[(term.unknowns[CAMERA + POSE + MOVE] - layout.projector(0)) / (POSE + LENS)] += 1;
    }
    out
}

/// Returns points on walls with the places of one projector that light them.
fn lit(pairs: &[Observed], x: &[f64], projector: usize) -> Vec<(Point3<f64>, [f64; 2])> {
    let point = |term: &Observed| {
        let What::Pair { wall, pixel, place, .. } = &term.what else { return None };
        let at = term.unknowns[CAMERA + POSE + MOVE];
        let view = term.unknowns[CAMERA];
        let (eye, moved) = (Pose::of(&x[view..][..POSE]), term.unknowns[CAMERA + POSE]);
        let ray: Vector3<f64> = eye.outward(&camera_ray(&x[..CAMERA], *pixel)?);
        let t = wall.moved(&x[moved..][..MOVE]).hit(&eye.position, &ray)?;
        (at == projector).then(|| (eye.position + ray * t, *place))
    };
    pairs.iter().filter_map(point).collect()
}

/// Returns the distance of a pair's place, or of a mark, in pixels; `None` if the ray misses.
fn distance_px(term: &Observed, x: &[f64]) -> Option<f64> {
    let local: Vec<f64> = term.unknowns.iter().map(|i| x[*i]).collect();
    let sigma = match &term.what {
        What::Mark(mark) => mark.sigma_px,
        What::Pair { sigma, .. } => *sigma,
        _ => 1.0,
    };
    term.residual(&local).map(|[a, b]| sigma * a.hypot(b))
}

fn result(
    measured: &Measurement,
    walls: &[Wall],
    sizes: &[[f64; 2]],
    layout: Layout,
    x: &[f64],
    terms: &[Observed],
    spread: &DMatrix<f64>,
) -> Fit {
    let (mut sums, mut marks) = (vec![(0usize, 0.0f64); layout.projectors], (0usize, 0.0f64));
    let (mut worst, mut number) = ((0, 0, 0.0f64), vec![0usize; layout.views]);
    for term in terms {
        let d = distance_px(term, x).unwrap_or(f64::INFINITY);
        match &term.what {
            What::Mark(_) => {
                let view = (term.unknowns[CAMERA] - CAMERA) / POSE;
                if d > worst.2 {
                    worst = (view, number[view], d);
                }
                number[view] += 1;
                marks = (marks.0 + 1, marks.1 + d * d);
            }
            _ => {
                let at = term.unknowns[CAMERA + POSE + MOVE];
                let sum = &mut sums[(at - layout.projector(0)) / (POSE + LENS)];
                *sum = (sum.0 + 1, sum.1 + d * d);
            }
        }
    }
    let moved: Vec<Wall> = walls.iter().enumerate().map(|(i, w)| w.moved(&x[layout.wall(i)..][..MOVE])).collect();
    let lens = |i: usize| -> (Pose, [f64; LENS]) {
        let all = &x[layout.projector(i)..][..POSE + LENS];
        (Pose::of(all), std::array::from_fn(|k| all[POSE + k]))
    };
    let quality = |i: usize| Quality {
        pairs: sums[i].0,
        agreeing: 1.0,
        rms_px: (sums[i].1 / (sums[i].0.max(1) as f64)).sqrt(),
        seen: seen(&measured.views, i, sizes[i]),
        expected_px: expected_px(i, (&moved, walls), lens(i), sizes[i], layout, x, spread),
    };
    Fit {
        camera: std::array::from_fn(|k| x[k]),
        views: (0..layout.views).map(|i| Pose::of(&x[layout.view(i)..][..POSE])).collect(),
        projectors: (0..layout.projectors).map(lens).collect(),
        quality: (0..layout.projectors).map(quality).collect(),
        walls: moved,
        marks_rms_px: (marks.1 / marks.0.max(1) as f64).sqrt(),
        worst_mark: worst,
    }
}

/// Returns the share of a picture, by cells of a sixteenth each way, in which pixels were decoded.
fn seen(views: &[View], projector: usize, size: [f64; 2]) -> f64 {
    let mut cells = [false; 256];
    let places = views.iter().filter_map(|v| v.decoded[projector].as_ref()).flat_map(|d| d.places.iter().flatten());
    for place in places {
        let [x, y] = [0, 1].map(|k| ((16.0 * f64::from(place[k]) / size[k]) as usize).min(15));
        cells[16 * y + x] = true;
    }
    cells.iter().filter(|seen| **seen).count() as f64 / 256.0
}

/// Propagates the covariance to the light of a grid of 5 x 5 pixels.
fn expected_px(
    projector: usize,
    (moved, walls): (&[Wall], &[Wall]),
    (pose, lens): (Pose, [f64; LENS]),
    [w, h]: [f64; 2],
    layout: Layout,
    x: &[f64],
    spread: &DMatrix<f64>,
) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for (i, j) in (0..5).flat_map(|i| (0..5).map(move |j| (i, j))) {
        let place = [w * (f64::from(i) + 0.5) / 5.0, h * (f64::from(j) + 0.5) / 5.0];
        let Some(ray) = lens_ray(&lens, place) else { continue };
        let Some((wall, _)) = nearest(moved, &pose.position, &pose.outward(&ray), 0.0) else { continue };
        let from = layout.projector(projector);
        let unknowns: Vec<usize> = (layout.wall(wall)..layout.wall(wall + 1)).chain(from..from + POSE + LENS).collect();
        let mut local: Vec<f64> = unknowns.iter().map(|i| x[*i]).collect();
        let term = Observed { unknowns, what: What::Shine { wall: walls[wall], place, pose, lens } };
        let j = derivatives(&term, &mut local, |_| false);
        for (a, row) in term.unknowns.iter().enumerate() {
            for (b, column) in term.unknowns.iter().enumerate() {
                sum += spread[(*row, *column)] * (j[a][0] * j[b][0] + j[a][1] * j[b][1]);
            }
        }
        count += 1;
    }
    (sum.max(0.0) / f64::from(count.max(1))).sqrt()
}

/// Returns the reasons for which pixels of a projector were refused, for messages.
fn refusals(views: &[View], projector: usize) -> String {
    let all: Vec<_> = views.iter().filter_map(|v| v.decoded[projector].as_ref().map(|d| d.refused)).collect();
    if all.is_empty() {
        return " (no view has photographs of it)".into();
    }
    let sum = |of: fn(&crate::light::Refused) -> usize| all.iter().map(of).sum::<usize>();
    format!(
        " (refused: {} dark, {} clipped, {} without fine stripes, {} contradictory)",
        sum(|r| r.dark),
        sum(|r| r.clipped),
        sum(|r| r.indirect),
        sum(|r| r.unsure)
    )
}
