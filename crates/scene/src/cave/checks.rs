//! Geometry of caves: what must hold of screens and eyes, and what is only worth knowing.
//!
//! ```text
//! u = lower_right − lower_left       v = upper_left − lower_left       n = u × v / |u × v|   (towards the viewer)
//! corners square:   |u·v| / (|u| |v|) ≤ 1e-3                (the cosine: one millimetre in a metre)
//! eye in front:     (e − lower_left) · n ≥ 1 mm             for the point between the eyes, and in stereo for each eye
//! pixels:           (w_px / h_px) / (|u| / |v|) = 1         within 1 %, else a note
//! gap of two edges: the largest distance of the shorter edge's ends from the longer edge
//! ```

use nalgebra::{Point3, Vector3};

use super::facet::{Facet, Stereo};
use super::parts::{Screen, User};
use super::Cave;
use crate::fields::Fields;

/// Largest cosine of a screen's corner: 1 mm in a metre.
pub const SQUARE_TOLERANCE: f64 = 1e-3;
/// Least distance of an eye in front of a screen, m.
const LEAST_DISTANCE_M: f64 = 1e-3;
/// Edges farther apart than this share of the shorter one are no neighbours.
const NEIGHBOUR_SHARE: f64 = 0.1;
/// Edges that differ in direction by more than this, as a sine, are no neighbours.
const NEIGHBOUR_SINE: f64 = 0.1;
/// Pixels may be out of square by this share before it is noted.
const ASPECT_TOLERANCE: f64 = 0.01;

/// Corners square, area positive.
pub(crate) fn screen(screen: &Screen, f: &Fields<'_>) {
    let (u, v) = (screen.across(), screen.upward());
    let (wide, high) = (u.norm(), v.norm());
    for (length, corner) in [(wide, "lower_right_m"), (high, "upper_left_m")] {
        if length < 1e-3 {
            let message = format!("{} has no area: `{corner}` is {length:.6} m from `lower_left_m`", f.what);
            f.log.report(f.span.clone(), message, "wanted three corners that are at least 1 mm apart");
            return;
        }
    }
    let cosine = u.dot(&v) / (wide * high);
    if cosine.abs() > SQUARE_TOLERANCE {
        let degrees = cosine.acos().to_degrees();
        let message = format!("{} is not square: its edges meet at {degrees:.3} degrees, {:.1} mm off in a metre", f.what, 1e3 * cosine.abs());
        f.log.report(f.span.clone(), message, "wanted a right angle at `lower_left_m`, within 1 mm in a metre");
    }
}

/// Near before far, and every eye in front of the screen.
pub(crate) fn facet(facet: &Facet, screen: &Screen, user: &User, f: &mut Fields<'_>) {
    if facet.near_m >= facet.far_m {
        let message = format!("`near_m` of {} is {}, `far_m` {}", f.what, facet.near_m, facet.far_m);
        f.log.report(f.span.clone(), message, "wanted near_m less than far_m");
    }
    let behind = facet.stereo.sides().iter().map(|side| (side, screen.distance_m(&user.eye(*side)))).find(|(_, d)| *d < LEAST_DISTANCE_M);
    if let Some((side, distance)) = behind {
        let eye = match *side {
            s if s < 0.0 => "the left eye",
            s if s > 0.0 => "the right eye",
            _ => "the eye",
        };
        let place = f.value("screen").map_or(f.span.clone(), |value| value.span());
        let message = format!("{}: {eye} of user \"{}\" is {:.3} m behind screen \"{}\"", f.what, user.name, -distance, screen.name);
        f.log.report(place, message, "wanted the eye in front; corners are named as seen by who looks at the screen, so that left and right may be swapped");
    }
}

/// What is worth knowing, in the order of the file.
pub(crate) fn notes(cave: &Cave) -> Vec<String> {
    let mut notes = Vec::new();
    for facet in &cave.facets {
        let screen = &cave.screens[facet.screen];
        let ([w, h], [wide, high]) = (facet.size_px, screen.size_m());
        let ratio = f64::from(w) / f64::from(h) / (wide / high);
        if (ratio - 1.0).abs() > ASPECT_TOLERANCE {
            let fit = (f64::from(w) * high / wide).round();
            notes.push(format!(
                "facet \"{}\": {w} x {h} pixels on {wide:.3} m x {high:.3} m are {ratio:.3} times denser across than upward; {w} x {fit} would be square (fine where the display stretches)",
                facet.name
            ));
        }
        let user = &cave.users[facet.user];
        let distance = screen.distance_m(&user.eye_m);
        if facet.near_m > distance {
            notes.push(format!("facet \"{}\": near_m {} lies behind the screen, {distance:.3} m from the eye: what is nearer is cut off", facet.name, facet.near_m));
        }
        if facet.stereo != Stereo::Mono && user.interpupillary_m == 0.0 {
            notes.push(format!("facet \"{}\" is in stereo, and interpupillary_m of user \"{}\" is 0: both eyes see the same", facet.name, user.name));
        }
    }
    for (index, screen) in cave.screens.iter().enumerate() {
        if !cave.facets.iter().any(|facet| facet.screen == index) {
            notes.push(format!("screen \"{}\" has no facet: nothing is drawn on it", screen.name));
        }
    }
    notes.extend(gaps(&cave.screens).iter().map(|gap| {
        let name = |(screen, edge): (usize, usize)| format!("{} edge of \"{}\"", EDGES[edge], cave.screens[screen].name);
        format!("{} and {}: {:.3} mm apart", name(gap.first), name(gap.second), 1e3 * gap.gap_m)
    }));
    notes
}

/// The names of the edges by number.
const EDGES: [&str; 4] = ["lower", "right", "upper", "left"];

/// Two edges of two screens that lie side by side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// Screen and edge (0 lower, 1 right, 2 upper, 3 left).
    pub first: (usize, usize),
    /// Screen and edge.
    pub second: (usize, usize),
    /// How far apart, m: the largest distance of the shorter edge's ends from the longer edge.
    pub gap_m: f64,
}

/// All pairs of edges of different screens that lie side by side, with how far apart they are.
pub fn gaps(screens: &[Screen]) -> Vec<Gap> {
    let mut out = Vec::new();
    for (i, a) in screens.iter().enumerate() {
        for (j, b) in screens.iter().enumerate().skip(i + 1) {
            for (k, first) in edges(a).iter().enumerate() {
                for (l, second) in edges(b).iter().enumerate() {
                    if let Some(gap_m) = between(first, second) {
                        out.push(Gap { first: (i, k), second: (j, l), gap_m });
                    }
                }
            }
        }
    }
    out
}

type Edge = [Point3<f64>; 2];

/// The edges in the order of [`EDGES`].
fn edges(s: &Screen) -> [Edge; 4] {
    let (ll, lr, ul, ur) = (s.lower_left_m, s.lower_right_m, s.upper_left_m, s.upper_right_m());
    [[ll, lr], [lr, ur], [ul, ur], [ll, ul]]
}

/// The gap of two edges; `None` where they are no neighbours.
fn between(a: &Edge, b: &Edge) -> Option<f64> {
    let (u, v) = (a[1] - a[0], b[1] - b[0]);
    if u.cross(&v).norm() > NEIGHBOUR_SINE * u.norm() * v.norm() {
        return None;
    }
    let (short, long) = if u.norm() <= v.norm() { (a, b) } else { (b, a) };
    let gap = short.iter().map(|p| distance(p, long)).fold(0.0, f64::max);
    (gap <= NEIGHBOUR_SHARE * (short[1] - short[0]).norm()).then_some(gap)
}

/// Distance of a point from a stretch.
fn distance(p: &Point3<f64>, [from, to]: &Edge) -> f64 {
    let along: Vector3<f64> = to - from;
    let t = ((p - from).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
    (p - (from + along * t)).norm()
}
