//! Grids of warps and meshes.

use super::Light;
use tumble_render::Pfm;

/// Distance of the nodes of a warp and of a curved screen, pixels.
const STEP_PX: u32 = 8;
/// Largest number of nodes of a mesh with edges between screens.
const MAX_NODES: u64 = 1 << 20;
/// Continuation of screens in meshes, shares, so that their outer pixels have all nodes. Masks end them.
const MARGIN: f64 = 0.05;
/// Places of pictures that warps may have.
const PLACES: std::ops::RangeInclusive<f64> = -0.5..=1.5;

/// Returns the columns and rows of nodes every `step` pixels.
fn nodes([w, h]: [u32; 2], step: u32) -> [usize; 2] {
    [w, h].map(|n| n.div_ceil(step) as usize + 1)
}

/// Returns the values of the nodes of a grid, by rows from the bottom.
fn over(size: [u32; 2], [columns, rows]: [usize; 2], value: impl Fn([f64; 2]) -> [f32; 3]) -> Pfm {
    let along = |i: usize, n: usize| i as f64 / (n - 1) as f64;
    let place =
        |x: usize, y: usize| [f64::from(size[0]) * along(x, columns), f64::from(size[1]) * (1.0 - along(y, rows))];
    let values = (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y))).map(|(x, y)| value(place(x, y))).collect();
    Pfm { size: [columns, rows], values }
}

/// Returns the flat wall that a projector lights, if it lights no other.
pub(super) fn single_flat(light: &Light<'_>, size: [u32; 2]) -> Option<usize> {
    let mut found = None;
    for (x, y) in (0..=64).flat_map(|y| (0..=64).map(move |x| (x, y))) {
        let place = [f64::from(size[0]) * f64::from(x) / 64.0, f64::from(size[1]) * f64::from(y) / 64.0];
        match (light.at(place, 0.0), found) {
            (None, _) => {}
            (Some((wall, _)), None) => found = Some(wall),
            (Some((wall, _)), Some(first)) if wall != first => return None,
            _ => {}
        }
    }
    found.filter(|wall| light.fit.walls[*wall].is_flat())
}

/// Returns the part of a flat wall that is lit (lower left and upper right corner, shares of it), and the
/// places of the part's picture.
pub(super) fn warp(light: &Light<'_>, wall: usize, size: [u32; 2]) -> Option<(Part, Pfm)> {
    let grid = nodes(size, STEP_PX);
    let nothing = [f32::NAN; 3];
    let places = over(size, grid, |place| light.on(wall, place).map_or(nothing, |[s, t]| [s as f32, t as f32, 0.0]));
    let mut part = Part { wall, low: [1.0; 2], high: [0.0; 2] };
    for place in places.values.iter().filter(|p| !p[0].is_nan()) {
        for k in 0..2 {
            part.low[k] = part.low[k].min(f64::from(place[k])).max(0.0);
            part.high[k] = part.high[k].max(f64::from(place[k])).min(1.0);
        }
    }
    if (0..2).any(|k| part.high[k] - part.low[k] < 1e-3) {
        return None;
    }
    let within = |place| {
        let on: Option<[f64; 2]> = light.on(wall, place);
        let shares = on.map(|on| [0, 1].map(|k| (on[k] - part.low[k]) / (part.high[k] - part.low[k])));
        shares.filter(|s| s.iter().all(|s| PLACES.contains(s))).map_or(nothing, |[s, t]| [s as f32, t as f32, 0.0])
    };
    let warp = over(size, grid, within);
    Some((part, warp))
}

/// A part of a flat wall: shares of its picture.
pub(super) struct Part {
    pub wall: usize,
    pub low: [f64; 2],
    pub high: [f64; 2],
}

/// Returns the points that a projector lights, m; not a number beside the screens. Where screens meet within
/// the picture, nodes are as dense as pixels, as far as their number allows.
pub(super) fn points(light: &Light<'_>, size: [u32; 2]) -> Pfm {
    let one_wall = light.fit.walls.len() == 1;
    let mut step = if one_wall { STEP_PX } else { 1 };
    while nodes(size, step).iter().map(|n| *n as u64).product::<u64>() > MAX_NODES {
        step += 1;
    }
    over(size, nodes(size, step), |place| {
        light.at(place, MARGIN).map_or([f32::NAN; 3], |(_, point)| [point.x as f32, point.y as f32, point.z as f32])
    })
}
