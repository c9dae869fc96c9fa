//! Geometry of caves: conditions on screens and eyes, and notes.
//!
//! ```text
//! u = lower_right − lower_left       v = upper_left − lower_left       n = u × v / |u × v|   (towards the viewer)
//! corners square:   |u·v| / (|u| |v|) ≤ 1e-3                (the cosine: one millimeter in a meter)
//! eye in front:     (e − lower_left) · n ≥ 1 mm             for the point between the eyes, and in stereo for each eye
//! pixels:           (w_px / h_px) / (|u| / |v|) = 1         within 1 %, else a note
//! gap of two edges: the largest distance of the shorter edge's ends from the longer edge
//! neighbors:        gap ≤ 0.1 of the shorter edge, sine of the angle between them ≤ 0.1
//! overlap:          of neighbors, each edge lies within the other screen: d · o_a < 0 and d · o_b > 0,
//!                   d from edge a to edge b, o the direction out of a screen across its edge
//! misaligned:       edges without a neighbor whose gap is ≤ 0.5 of the shorter edge, with a sine ≤ 0.35
//! target:           whole_px, and size_px with a rim of 48 pixels, each side ≤ 16384 and 2²⁵ pixels together
//! ```

use std::ops::Range;

use nalgebra::{Point3, Vector3};

use super::Cave;
use super::facet::{Facet, Stereo};
use super::parts::{Screen, User};
use super::surface::Surface;
use crate::parse::fields::Fields;
use crate::parse::log::Log;

/// Largest cosine between the edges of a screen's corner: 1 mm in a meter.
pub const SQUARE_TOLERANCE: f64 = 1e-3;
/// Smallest distance of an eye in front of a screen, m.
const MIN_EYE_DISTANCE_M: f64 = 1e-3;
/// Largest gap of neighboring edges, as a fraction of the shorter one.
const MAX_GAP_FRACTION: f64 = 0.1;
/// Largest sine of the angle between neighboring edges.
const MAX_ANGLE_SINE: f64 = 0.1;
/// Largest gap at which two edges without a neighbor count as misaligned, as a fraction of the
/// shorter one.
const MISALIGNED_GAP_FRACTION: f64 = 0.5;
/// Largest sine of the angle between misaligned edges.
const MISALIGNED_ANGLE_SINE: f64 = 0.35;
/// Smallest overlap of two edges, m. Less is rounding of the file's numbers.
const MIN_OVERLAP_M: f64 = 1e-6;
/// Longest side of an image, pixels: the texture size that graphics devices support.
pub const MAX_SIDE_PX: u32 = 16384;
/// Largest number of pixels of an image with rows padded to multiples of 64.
pub const MAX_PIXELS: u64 = 1 << 25;
/// Pixels that are drawn beyond each edge of an eye's image and cropped.
pub const RIM_PX: u32 = 48;
/// Deviation of the pixels' aspect ratio from 1 that makes a note.
const ASPECT_TOLERANCE: f64 = 0.01;

/// Checks that corners are square and the area is positive.
pub(crate) fn screen(screen: &Screen, f: &Fields<'_>) {
    let (u, v) = (screen.across(), screen.upward());
    let (wide, high) = (u.norm(), v.norm());
    for (length, corner) in [(wide, "lower_right_m"), (high, "upper_left_m")] {
        if length < 1e-3 {
            let message = format!("{} has no area: `{corner}` is {length:.6} m from `lower_left_m`", f.what);
            f.log.report(f.span.clone(), message, "expected three corners that are at least 1 mm apart");
            return;
        }
    }
    let cosine = u.dot(&v) / (wide * high);
    if cosine.abs() > SQUARE_TOLERANCE {
        let degrees = cosine.acos().to_degrees();
        let message = format!(
            "{} is not square: its edges meet at {degrees:.3} degrees, {:.1} mm off per meter",
            f.what,
            1e3 * cosine.abs()
        );
        f.log.report(f.span.clone(), message, "expected a right angle at `lower_left_m`, within 1 mm per meter");
    }
}

/// Checks the size of render targets: both eyes in one image, and each eye's image with its rim.
pub(crate) fn target(size_px: [u32; 2], stereo: Stereo, f: &mut Fields<'_>) {
    let fits = |[w, h]: [u32; 2]| {
        w <= MAX_SIDE_PX && h <= MAX_SIDE_PX && u64::from(w.next_multiple_of(64)) * u64::from(h) <= MAX_PIXELS
    };
    let (whole, rimmed) = (stereo.whole_px(size_px), size_px.map(|n| n + 2 * RIM_PX));
    let what = match (fits(whole), fits(rimmed)) {
        (true, true) => return,
        (false, _) if whole != size_px => format!("the image with both eyes is {} x {} pixels", whole[0], whole[1]),
        _ => format!("the image with its rim of {RIM_PX} pixels is {} x {} pixels", rimmed[0], rimmed[1]),
    };
    let place = f.value("size_px").map_or(f.span.clone(), |value| value.span());
    f.log.report(
        place,
        format!("`size_px` of {}: {what}", f.what),
        format!("expected at most {MAX_SIDE_PX} pixels per side and {MAX_PIXELS} pixels in total; divide a larger wall into several facets"),
    );
}

/// Checks that eyes change places in images of both alone.
pub(crate) fn swapped(facet: &Facet, f: &mut Fields<'_>) {
    if facet.swap_eyes && facet.stereo.sides().len() < 2 {
        let place = f.value("swap_eyes").map_or(f.span.clone(), |value| value.span());
        let message = format!("`swap_eyes` of {}: its image has one eye", f.what);
        f.log.report(place, message, "expected `stereo` with both eyes, such as \"rows\"");
    }
}

/// Checks that the facets of a process are on one node and use one adapter. `places` are those of the
/// facets' tables.
pub(crate) fn processes(cave: &Cave, log: &Log<'_>, places: &[Range<usize>]) {
    for (k, facet) in cave.facets.iter().enumerate() {
        let Some(process) = &facet.process else { continue };
        let first = cave.facets[..k].iter().find(|other| other.process == facet.process);
        let place = places.get(k).cloned().unwrap_or(0..0);
        let wrong = |what: &str, first: &Facet| {
            let message = format!(
                "facet \"{}\" is in the process \"{process}\" of facet \"{}\", which has another `{what}`",
                facet.name, first.name
            );
            log.report(place.clone(), message, format!("expected one `{what}` for all facets of a process"));
        };
        first.filter(|first| first.node != facet.node).into_iter().for_each(|first| wrong("node", first));
        first.filter(|first| first.display.gpu != facet.display.gpu).into_iter().for_each(|first| wrong("gpu", first));
    }
}

/// Checks that near is less than far and that every eye is in front of the screen.
pub(crate) fn facet(facet: &Facet, screen: &Screen, user: &User, f: &mut Fields<'_>) {
    if facet.near_m >= facet.far_m {
        let message = format!("`near_m` of {} is {} and `far_m` is {}", f.what, facet.near_m, facet.far_m);
        f.log.report(f.span.clone(), message, "expected near_m less than far_m");
    }
    let behind = facet
        .stereo
        .sides()
        .iter()
        .map(|side| (side, screen.distance_m(&user.eye(*side))))
        .find(|(_, d)| *d < MIN_EYE_DISTANCE_M);
    if let Some((side, distance)) = behind {
        let eye = match *side {
            s if s < 0.0 => "the left eye",
            s if s > 0.0 => "the right eye",
            _ => "the eye",
        };
        let place = f.value("screen").map_or(f.span.clone(), |value| value.span());
        let (how, expected) = match screen.is_flat() {
            true => (
                "behind",
                "expected the eye in front of the screen; corners are named as seen from the front, so left and right may be swapped",
            ),
            false => ("outside", "expected the eye inside the cylinder or sphere"),
        };
        let message = format!(
            "{}: {eye} of user \"{}\" is {:.3} m {how} screen \"{}\"",
            f.what, user.name, -distance, screen.name
        );
        f.log.report(place, message, expected);
    }
    if let (Surface::Mesh { .. }, Some(_)) = (&screen.surface, &facet.warp_file) {
        let message = format!("{} has a `warp_file`, and its screen \"{}\" is a mesh", f.what, screen.name);
        f.log.report(f.span.clone(), message, "expected one of them: the mesh has the place of each pixel already");
    }
}

/// Returns notes about a valid cave, in the order of the file.
pub(crate) fn notes(cave: &Cave) -> Vec<String> {
    let mut notes = Vec::new();
    for facet in &cave.facets {
        let screen = &cave.screens[facet.screen];
        let ([w, h], [wide, high]) = (facet.size_px, screen.size_m());
        let ratio = f64::from(w) / f64::from(h) / (wide / high);
        if (ratio - 1.0).abs() > ASPECT_TOLERANCE && !matches!(screen.surface, Surface::Mesh { .. }) {
            let fit = (f64::from(w) * high / wide).round();
            notes.push(format!(
                "facet \"{}\": {w} x {h} pixels on {wide:.3} m x {high:.3} m are {ratio:.3} times denser horizontally than vertically; {w} x {fit} would be square (harmless if the display stretches the image)",
                facet.name
            ));
        }
        let user = &cave.users[facet.user];
        let distance = screen.distance_m(&user.eye_m);
        if facet.near_m > distance {
            notes.push(format!("facet \"{}\": near_m {} is behind the screen, which is {distance:.3} m from the eye: nothing in front of near_m is drawn", facet.name, facet.near_m));
        }
        if facet.stereo != Stereo::Mono && user.interpupillary_m == 0.0 {
            notes.push(format!(
                "facet \"{}\" is in stereo, and interpupillary_m of user \"{}\" is 0: both eyes see the same",
                facet.name, user.name
            ));
        }
    }
    for (index, screen) in cave.screens.iter().enumerate() {
        if !cave.facets.iter().any(|facet| facet.screen == index) {
            notes.push(format!("screen \"{}\" has no facet: nothing is drawn on it", screen.name));
        }
    }
    let found = gaps(&cave.screens);
    let name = |(screen, edge): (usize, usize)| format!("{} edge of \"{}\"", EDGES[edge], cave.screens[screen].name);
    notes.extend(found.iter().map(|gap| {
        let mm = 1e3 * gap.gap_m;
        let how = if gap.overlaps { format!("overlap by {mm:.3} mm") } else { format!("{mm:.3} mm apart") };
        format!("{} and {}: {how}", name(gap.first), name(gap.second))
    }));
    notes.extend(misaligned(&cave.screens, &found).iter().map(|(first, second, gap_m, angle)| {
        format!(
            "screen \"{}\" has no neighbor along its {} edge: the nearest, the {}, is {:.0} mm and {:.1} degrees off",
            cave.screens[first.0].name,
            EDGES[first.1],
            name(*second),
            1e3 * gap_m,
            angle.to_degrees()
        )
    }));
    notes
}

/// Names of the edges by number.
const EDGES: [&str; 4] = ["lower", "right", "upper", "left"];

/// Two adjacent edges of two screens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// Screen and edge (0 lower, 1 right, 2 upper, 3 left).
    pub first: (usize, usize),
    /// Screen and edge.
    pub second: (usize, usize),
    /// Distance, m: the largest distance of the shorter edge's ends from the longer edge.
    pub gap_m: f64,
    /// Whether each edge lies within the other screen. The two screens then show the overlap twice
    /// instead of leaving a dark gap.
    pub overlaps: bool,
}

/// Returns all pairs of adjacent edges of different screens, with their gaps.
pub fn gaps(screens: &[Screen]) -> Vec<Gap> {
    let mut out = Vec::new();
    for (first, second, a, b) in pairs(screens) {
        if let Some(gap_m) = between(&a, &b, MAX_GAP_FRACTION, MAX_ANGLE_SINE) {
            let d = middle(&b) - middle(&a);
            let inside = d.dot(&outward(&screens[first.0], first.1)) < -MIN_OVERLAP_M
                && d.dot(&outward(&screens[second.0], second.1)) > MIN_OVERLAP_M;
            out.push(Gap { first, second, gap_m, overlaps: inside });
        }
    }
    out
}

/// Two misaligned edges, the gap in m and the angle in rad.
type Misaligned = ((usize, usize), (usize, usize), f64, f64);

/// Returns edges without a neighbor that have another such edge nearby, each once, with the
/// nearest.
fn misaligned(screens: &[Screen], found: &[Gap]) -> Vec<Misaligned> {
    let met = |edge: (usize, usize)| found.iter().any(|gap| gap.first == edge || gap.second == edge);
    let near = |(first, second, a, b): (_, _, Edge, Edge)| {
        let gap_m =
            between(&a, &b, MISALIGNED_GAP_FRACTION, MISALIGNED_ANGLE_SINE).filter(|_| !met(first) && !met(second))?;
        let (u, v) = (a[1] - a[0], b[1] - b[0]);
        Some((first, second, gap_m, (u.cross(&v).norm() / (u.norm() * v.norm())).min(1.0).asin()))
    };
    let mut candidates: Vec<Misaligned> = pairs(screens).into_iter().filter_map(near).collect();
    candidates.sort_by(|a, b| a.2.total_cmp(&b.2));
    let mut out: Vec<Misaligned> = Vec::new();
    for pair in candidates {
        if !out
            .iter()
            .any(|(first, second, ..)| [*first, *second].iter().any(|edge| *edge == pair.0 || *edge == pair.1))
        {
            out.push(pair);
        }
    }
    out.sort_by_key(|pair| (pair.0, pair.1));
    out
}

/// Returns all pairs of edges of different flat screens, each once, in the order of the file.
fn pairs(screens: &[Screen]) -> Vec<(Place, Place, Edge, Edge)> {
    let all: Vec<(Place, Edge)> = screens
        .iter()
        .enumerate()
        .flat_map(|(i, s)| edges(s).into_iter().enumerate().map(move |(k, edge)| ((i, k), edge)))
        .collect();
    let mut out = Vec::new();
    let flat: Vec<usize> = (0..screens.len()).filter(|&i| screens[i].is_flat()).collect();
    for (i, j) in flat.iter().enumerate().flat_map(|(k, &i)| flat[k + 1..].iter().map(move |&j| (i, j))) {
        for (first, a) in &all[4 * i..4 * i + 4] {
            out.extend(all[4 * j..4 * j + 4].iter().map(|(second, b)| (*first, *second, *a, *b)));
        }
    }
    out
}

/// Returns the direction out of a screen across one of its edges: a unit vector in its plane.
fn outward(s: &Screen, edge: usize) -> Vector3<f64> {
    [-s.upward(), s.across(), s.upward(), -s.across()][edge].normalize()
}

fn middle(edge: &Edge) -> Point3<f64> {
    nalgebra::center(&edge[0], &edge[1])
}

type Edge = [Point3<f64>; 2];

/// Number of a screen, and of one of its edges.
type Place = (usize, usize);

/// Returns the edges in the order of [`EDGES`].
fn edges(s: &Screen) -> [Edge; 4] {
    let (ll, lr, ul, ur) = (s.lower_left_m, s.lower_right_m, s.upper_left_m, s.upper_right_m());
    [[ll, lr], [lr, ur], [ul, ur], [ll, ul]]
}

/// Returns the gap of two edges; `None` if it is more than a `share` of the shorter one or their
/// directions differ by more than a `sine`.
fn between(a: &Edge, b: &Edge, share: f64, sine: f64) -> Option<f64> {
    let (u, v) = (a[1] - a[0], b[1] - b[0]);
    if u.cross(&v).norm() > sine * u.norm() * v.norm() {
        return None;
    }
    let (short, long) = if u.norm() <= v.norm() { (a, b) } else { (b, a) };
    let gap = short.iter().map(|p| distance(p, long)).fold(0.0, f64::max);
    (gap <= share * (short[1] - short[0]).norm()).then_some(gap)
}

/// Returns the distance of a point from a line segment.
fn distance(p: &Point3<f64>, [from, to]: &Edge) -> f64 {
    let along: Vector3<f64> = to - from;
    let t = ((p - from).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
    (p - (from + along * t)).norm()
}
