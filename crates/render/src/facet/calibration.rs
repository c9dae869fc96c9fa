//! Calibration pictures for projectors: grid, corners, colors, name. They are drawn in meters of
//! the screen, so that a tape measure checks them.

use super::canvas::{fill_rect, put};
use super::color_patterns;
use super::compose::{blank, combined, flipped};
use super::font::{text_width, write};
use crate::{CaveView, Image};
use std::fmt;
use std::str::FromStr;
use tumble_scene::cave::{Cave, Facet, Screen};

/// The content of a calibration picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CalibrationPattern {
    /// Lines every 0.1 m, stronger ones every 0.5 m from the middle, a circle and the diagonals:
    /// checks straightness, squareness and size.
    Grid,
    /// Marks in the corners with their position in the cave, and a frame one pixel wide at the
    /// edge: checks that nothing is cut off.
    Corners,
    /// Bars and ramps: check that projectors agree in color and brightness.
    Colors,
    /// Ramps of gray and of each color, and the darkest and brightest 32 codes in steps: check black
    /// level, transfer curve and clipping.
    Ramps,
    /// Bands of 0, 10, 25, 50 and 100 % of light: flat across projectors with blends and colors that
    /// fit.
    Blend,
    /// Lines one pixel wide in white, red, green and blue: check focus and that the three colors of a
    /// projector meet.
    Convergence,
    /// The facet's name, large, with its node, user and size: checks that the right picture is on
    /// the right screen, upright.
    Name,
}

const NAMES: [(&str, CalibrationPattern); 7] = [
    ("grid", CalibrationPattern::Grid),
    ("corners", CalibrationPattern::Corners),
    ("colors", CalibrationPattern::Colors),
    ("ramps", CalibrationPattern::Ramps),
    ("blend", CalibrationPattern::Blend),
    ("convergence", CalibrationPattern::Convergence),
    ("name", CalibrationPattern::Name),
];

impl FromStr for CalibrationPattern {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        NAMES
            .iter()
            .find(|(name, _)| *name == word)
            .map(|(_, pattern)| *pattern)
            .ok_or_else(|| "expected grid, corners, colors, ramps, blend, convergence or name".into())
    }
}

impl fmt::Display for CalibrationPattern {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(NAMES.iter().find(|(_, pattern)| pattern == self).map_or("", |(name, _)| name))
    }
}

const BLACK: [u8; 4] = [0, 0, 0, 255];
const WHITE: [u8; 4] = [255, 255, 255, 255];
const GRAY: [u8; 4] = [96, 96, 96, 255];
const DARK: [u8; 4] = [48, 48, 48, 255];
const RED: [u8; 4] = [255, 64, 48, 255];
const GREEN: [u8; 4] = [64, 220, 96, 255];
const BLUE: [u8; 4] = [80, 144, 255, 255];
const YELLOW: [u8; 4] = [255, 220, 64, 255];

/// Draws the pattern of a facet: in stereo one per eye, labeled, mirrored as the facet is, not
/// warped and not blended. `frame_sequential` has the first eye.
pub fn calibration_picture(cave: &Cave, facet: &Facet, pattern: CalibrationPattern) -> Image {
    drawn(cave, facet, pattern, facet.eyes(0), &|eye| eye)
}

/// Draws the pattern of a facet as its projector gets pictures: warped, blended and colored too.
pub fn finished_calibration_picture(view: &CaveView, facet: &Facet, pattern: CalibrationPattern) -> Image {
    drawn(view.cave(), facet, pattern, view.eyes(facet), &|eye| view.finished(eye, facet))
}

/// Returns a picture as the facet's projector gets it: in stereo for both eyes, mirrored as the facet is, not
/// warped and not blended.
pub fn as_projected(eye: &Image, facet: &Facet) -> Image {
    let eyes = facet.eyes(0).iter().map(|_| flipped(eye.clone(), facet.flip)).collect();
    combined(eyes, facet.stereo)
}

fn drawn(
    cave: &Cave,
    facet: &Facet,
    pattern: CalibrationPattern,
    sides: &[f64],
    finish: &dyn Fn(Image) -> Image,
) -> Image {
    let screen = &cave.screens[facet.screen];
    let eye = |side: &f64| flipped(finish(one_eye(cave, facet, screen, pattern, *side)), facet.flip);
    combined(sides.iter().map(eye).collect(), facet.stereo)
}

fn one_eye(cave: &Cave, facet: &Facet, screen: &Screen, pattern: CalibrationPattern, side: f64) -> Image {
    let [w, h] = facet.size_px;
    let mut image = blank(w, h, BLACK);
    match pattern {
        CalibrationPattern::Grid => grid(&mut image, screen),
        CalibrationPattern::Corners => corners(&mut image, screen),
        CalibrationPattern::Colors => colors(&mut image),
        CalibrationPattern::Ramps => color_patterns::ramps(&mut image),
        CalibrationPattern::Blend => color_patterns::bands(&mut image),
        CalibrationPattern::Convergence => color_patterns::convergence(&mut image),
        CalibrationPattern::Name => {}
    }
    caption(&mut image, cave, facet, screen, pattern, side);
    image
}

/// Lines by meters from the middle, a circle that fits, and the diagonals.
fn grid(image: &mut Image, screen: &Screen) {
    let [wide, high] = screen.size_m();
    let per_meter = [f64::from(image.width) / wide, f64::from(image.height) / high];
    let middle = [0.5 * f64::from(image.width), 0.5 * f64::from(image.height)];
    let circle = 0.48 * wide.min(high);
    for y in 0..image.height {
        for x in 0..image.width {
            let off = [f64::from(x) + 0.5 - middle[0], f64::from(y) + 0.5 - middle[1]];
            let [mx, my] = [off[0] / per_meter[0], off[1] / per_meter[1]];
            // distance in pixels from the nearest line of a spacing
            let near = |spacing: f64| {
                (0..2)
                    .map(|k| (off[k] - (off[k] / per_meter[k] / spacing).round() * spacing * per_meter[k]).abs())
                    .fold(f64::MAX, f64::min)
            };
            let (fine, coarse) = (near(0.1), near(0.5));
            let ring = (mx.hypot(my) - circle).abs() * per_meter[0].min(per_meter[1]);
            let diagonal = (off[0] * middle[1]).abs() - (off[1] * middle[0]).abs();
            let diagonal = diagonal.abs() / middle[0].hypot(middle[1]);
            let color = match () {
                _ if x == 0 || y == 0 || x + 1 == image.width || y + 1 == image.height => Some(WHITE),
                _ if off[0].abs().min(off[1].abs()) < 1.6 => Some(YELLOW),
                _ if ring < 1.2 => Some(GREEN),
                _ if coarse < 1.1 => Some(WHITE),
                _ if diagonal < 0.8 => Some(BLUE),
                _ if fine < 0.6 => Some(GRAY),
                _ => None,
            };
            if let Some(color) = color {
                put(image, x.into(), y.into(), color);
            }
        }
    }
}

/// A frame at the edge, and in each corner a mark with its position in the cave.
fn corners(image: &mut Image, screen: &Screen) {
    let (w, h) = (i64::from(image.width), i64::from(image.height));
    fill_rect(image, 0, 0, w, h, WHITE);
    fill_rect(image, 1, 1, w - 2, h - 2, DARK);
    let arm = w.min(h) / 6;
    let thick = (w.min(h) / 160).max(1);
    let scale = (w / 420).max(1);
    let named = [
        ("UPPER LEFT", screen.upper_left_m, false, false, RED),
        ("UPPER RIGHT", screen.upper_right_m(), true, false, GREEN),
        ("LOWER LEFT", screen.lower_left_m, false, true, BLUE),
        ("LOWER RIGHT", screen.lower_right_m, true, true, YELLOW),
    ];
    for (name, place, right, low, color) in named {
        fill_rect(image, if right { w - arm } else { 0 }, if low { h - thick } else { 0 }, arm, thick, color);
        fill_rect(image, if right { w - thick } else { 0 }, if low { h - arm } else { 0 }, thick, arm, color);
        // the corners of a curved screen are those of its stand-in
        let measures =
            if screen.is_flat() { format!("{:.3} {:.3} {:.3} M", place.x, place.y, place.z) } else { String::new() };
        for (line, text) in [name.to_owned(), measures].iter().enumerate() {
            let inset = 4 * thick;
            let x = if right { w - inset - text_width(text, scale) } else { inset };
            let down = inset + 10 * scale * line as i64;
            let y = if low { h - inset - 20 * scale + 10 * scale * line as i64 } else { down };
            write(image, text, x, y, scale, color);
        }
    }
}

/// Bars of the primaries, and ramps from black to full in each and in gray.
fn colors(image: &mut Image) {
    let (w, h) = (i64::from(image.width), i64::from(image.height));
    let full = |r: u8, g: u8, b: u8| [255 * r, 255 * g, 255 * b, 255];
    let bars = [
        full(1, 1, 1),
        full(1, 1, 0),
        full(0, 1, 1),
        full(0, 1, 0),
        full(1, 0, 1),
        full(1, 0, 0),
        full(0, 0, 1),
        full(0, 0, 0),
    ];
    for (i, color) in bars.iter().enumerate() {
        let (from, to) = (w * i as i64 / 8, w * (i as i64 + 1) / 8);
        fill_rect(image, from, 0, to - from, h / 3, *color);
    }
    for (row, mask) in [[1, 1, 1], [1, 0, 0], [0, 1, 0], [0, 0, 1]].iter().enumerate() {
        let (top, bottom) = (h / 3 + h * row as i64 / 6, h / 3 + h * (row as i64 + 1) / 6);
        for x in 0..w {
            // the lower half in 16 steps, so that clipping at either end is visible
            let level = (255 * x / (w - 1).max(1)) as u8;
            let step = (17 * (16 * x / w)) as u8;
            let color = |v: u8| [v * mask[0], v * mask[1], v * mask[2], 255];
            fill_rect(image, x, top, 1, (bottom - top) / 2, color(level));
            fill_rect(image, x, (top + bottom) / 2, 1, bottom - (top + bottom) / 2, color(step));
        }
    }
}

/// The facet's name in the middle, its properties below, and an arrow that points up.
fn caption(image: &mut Image, cave: &Cave, facet: &Facet, screen: &Screen, pattern: CalibrationPattern, side: f64) {
    let (w, h) = (i64::from(image.width), i64::from(image.height));
    let large = pattern == CalibrationPattern::Name;
    let name = facet.name.to_uppercase();
    let room = if large { w * 9 / 10 } else { w / 3 };
    let scale = (room / text_width(&name, 1).max(1)).clamp(1, (h / if large { 24 } else { 60 }).max(1));
    let small = (w / 420).clamp(1, 6);
    let [wide, high] = screen.size_m();
    let eye = match side {
        s if s < 0.0 => "LEFT EYE",
        s if s > 0.0 => "RIGHT EYE",
        _ => "BOTH EYES",
    };
    let node = facet.node.map_or("THIS MACHINE".to_owned(), |n| format!("NODE {}", cave.nodes[n].name.to_uppercase()));
    let mut lines = vec![
        format!("{eye}  {node}"),
        format!("{} X {} PX  {wide:.3} X {high:.3} M", facet.size_px[0], facet.size_px[1]),
        format!("USER {}", cave.users[facet.user].name.to_uppercase()),
    ];
    // a picture that is too small omits them
    lines.retain(|line| text_width(line, small) < w * 9 / 10);
    let block = text_width(&name, scale).max(lines.iter().map(|l| text_width(l, small)).max().unwrap_or(0));
    let height = 9 * scale + 10 * small * lines.len() as i64;
    let top = (h - height) / 2;
    let pad = 4 * small;
    fill_rect(
        image,
        (w - block) / 2 - pad,
        top - pad - 8 * small,
        block + 2 * pad,
        height + 2 * pad + 8 * small,
        BLACK,
    );
    for row in 0..6 * small {
        fill_rect(image, w / 2 - row / 2, top - 8 * small + row, row.max(1), 1, RED);
    }
    write(image, &name, (w - text_width(&name, scale)) / 2, top, scale, WHITE);
    for (i, line) in lines.iter().enumerate() {
        write(image, line, (w - text_width(line, small)) / 2, top + 9 * scale + 10 * small * i as i64, small, YELLOW);
    }
}
