//! All facets of a cave in one picture: screens with common edges are adjacent, as if the cave were
//! cut open and flattened.
//!
//! The first facet's screen is placed first. Then each screen, in the order of the file, is placed
//! at a common edge with one already placed (right with left, upper with lower, never rotated) if
//! it covers none. The remaining screens form a row below.

use std::collections::VecDeque;

use tumble_scene::cave::{Cave, gaps};

/// A facet's rectangle in the unfolded picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tile {
    /// Index of the facet.
    pub facet: usize,
    /// Top left corner, pixels.
    pub position_px: [u32; 2],
    /// Width and height, pixels.
    pub size_px: [u32; 2],
}

/// Screens in the plane: lower left corner and size, m; y up.
type Placed = Vec<Option<([f64; 2], [f64; 2])>>;

/// Returns the size of the picture, at most `most` pixels each way, and a tile for each screen that
/// has a facet.
pub fn unfold(cave: &Cave, most: [u32; 2]) -> ([u32; 2], Vec<Tile>) {
    let facets: Vec<usize> = (0..cave.facets.len())
        .filter(|&i| cave.facets[..i].iter().all(|f| f.screen != cave.facets[i].screen))
        .collect();
    let placed = lay(cave, &facets);
    let boxes: Vec<_> = facets.iter().filter_map(|&i| Some((i, placed[cave.facets[i].screen]?))).collect();
    let least: [f64; 2] = std::array::from_fn(|k| boxes.iter().map(|(_, (at, _))| at[k]).fold(f64::MAX, f64::min));
    let greatest: [f64; 2] =
        std::array::from_fn(|k| boxes.iter().map(|(_, (at, size))| at[k] + size[k]).fold(f64::MIN, f64::max));
    let extent: [f64; 2] = std::array::from_fn(|k| greatest[k] - least[k]);
    // the largest scale at which the rounded size fits, so that unfolding into its own size changes
    // nothing
    let fitting = |k: usize| (f64::from(most[k]) + 0.499) / extent[k];
    let per_meter = fitting(0).min(fitting(1));
    let edge = |meters: f64| (meters * per_meter).round().max(0.0) as u32;
    let whole = [0, 1].map(|k| edge(extent[k]).clamp(1, most[k].max(1)));
    let tile = |&(facet, (at, size)): &(usize, ([f64; 2], [f64; 2]))| {
        // both ends are rounded, so that neighbors meet
        let (x0, x1) = (edge(at[0] - least[0]), edge(at[0] + size[0] - least[0]));
        let (y0, y1) = (edge(greatest[1] - at[1] - size[1]), edge(greatest[1] - at[1]));
        Tile { facet, position_px: [x0, y0], size_px: [(x1 - x0).max(1), (y1 - y0).max(1)] }
    };
    (whole, boxes.iter().map(tile).collect())
}

fn lay(cave: &Cave, facets: &[usize]) -> Placed {
    let drawn: Vec<usize> = facets.iter().map(|&i| cave.facets[i].screen).collect();
    let size = |screen: usize| cave.screens[screen].size_m();
    let neighbors = gaps(&cave.screens);
    let mut placed: Placed = vec![None; cave.screens.len()];
    let mut queue = VecDeque::new();
    placed[drawn[0]] = Some(([0.0; 2], size(drawn[0])));
    queue.push_back(drawn[0]);
    while let Some(screen) = queue.pop_front() {
        let Some((at, own)) = placed[screen] else { continue };
        for gap in &neighbors {
            let (mine, other) = if gap.first.0 == screen { (gap.first, gap.second) } else { (gap.second, gap.first) };
            if mine.0 != screen || placed[other.0].is_some() || !drawn.contains(&other.0) || (mine.1 + 2) % 4 != other.1
            {
                continue;
            }
            let its = size(other.0);
            let beside = match mine.1 {
                0 => [at[0], at[1] - its[1]],
                1 => [at[0] + own[0], at[1]],
                2 => [at[0], at[1] + own[1]],
                _ => [at[0] - its[0], at[1]],
            };
            if placed.iter().flatten().all(|there| apart(there, &(beside, its))) {
                placed[other.0] = Some((beside, its));
                queue.push_back(other.0);
            }
        }
    }
    row_below(&drawn, size, &mut placed);
    placed
}

/// Places the screens without a common edge in a row with gaps.
fn row_below(drawn: &[usize], size: impl Fn(usize) -> [f64; 2], placed: &mut Placed) {
    let floor = placed.iter().flatten().map(|(at, _)| at[1]).fold(f64::MAX, f64::min);
    let mut x = placed.iter().flatten().map(|(at, _)| at[0]).fold(f64::MAX, f64::min);
    for &screen in drawn {
        if placed[screen].is_none() {
            let [wide, high] = size(screen);
            placed[screen] = Some(([x, floor - 0.1 * high - high], [wide, high]));
            x += 1.1 * wide;
        }
    }
}

/// Returns whether two boxes share no area.
fn apart((a, s): &([f64; 2], [f64; 2]), (b, t): &([f64; 2], [f64; 2])) -> bool {
    (0..2).any(|k| a[k] + s[k] <= b[k] + 1e-3 * t[k] || b[k] + t[k] <= a[k] + 1e-3 * s[k])
}
