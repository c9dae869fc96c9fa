//! Triangles of a picture's plane, with numbers at their corners, as numbers of each pixel.

/// A corner: its place in the picture, 0 to 1 from the lower left, and its numbers.
pub(super) type Corner<const N: usize> = ([f64; 2], [f64; N]);

/// Largest number of triangles of a file.
pub(super) const MAX_TRIANGLES: usize = 1 << 21;
/// Largest sum of the areas of the triangles' upright boxes, in pictures.
const MAX_COVERS: f64 = 100.0;

/// Triangles over a picture.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Patches<const N: usize> {
    /// Any triangles.
    Triangles(Vec<[Corner<N>; 3]>),
    /// Columns and rows of nodes that are spread evenly over the picture, by rows from the bottom. A
    /// cell with all of its nodes is two triangles.
    Grid([usize; 2], Vec<Option<[f32; N]>>),
}

impl<const N: usize> Patches<N> {
    /// Checks that triangles are adjacent, at least approximately, so that their work is bounded.
    pub fn triangles(triangles: Vec<[Corner<N>; 3]>) -> Result<Patches<N>, String> {
        let side = |t: &[Corner<N>; 3], k: usize| {
            let along = t.map(|(place, _)| place[k].clamp(0.0, 1.0));
            along.iter().copied().fold(0.0, f64::max) - along.iter().copied().fold(1.0, f64::min)
        };
        let covers: f64 = triangles.iter().map(|t| side(t, 0) * side(t, 1)).sum();
        if covers > MAX_COVERS {
            return Err(format!(
                "the triangles of the warp grid cover the picture {covers:.0} times; expected adjacent triangles, and at most {MAX_COVERS} times"
            ));
        }
        Ok(Patches::Triangles(triangles))
    }

    /// Wraps the nodes of a grid. `None` if no cell has all of its nodes.
    pub fn grid([w, h]: [usize; 2], nodes: Vec<Option<[f32; N]>>) -> Option<Patches<N>> {
        let cell = |i: usize| i % w + 1 < w && [i, i + 1, i + w, i + w + 1].iter().all(|&j| nodes[j].is_some());
        (0..w * (h - 1)).any(cell).then_some(Patches::Grid([w, h], nodes))
    }

    /// Interpolates the numbers linearly at the center of each pixel, by rows from the top; `None`
    /// outside the triangles. Of overlapping triangles the last one counts.
    pub fn rasterized(&self, [width, height]: [u32; 2]) -> Vec<Option<[f64; N]>> {
        let size = [width as usize, height as usize];
        let mut out = vec![None; size[0] * size[1]];
        match self {
            Patches::Triangles(triangles) => triangles.iter().for_each(|triangle| fill(&mut out, size, triangle)),
            Patches::Grid([w, h], nodes) => {
                let node = |x: usize, y: usize| -> Option<Corner<N>> {
                    let place = [x as f64 / (w - 1) as f64, y as f64 / (h - 1) as f64];
                    nodes[y * w + x].map(|numbers| (place, numbers.map(f64::from)))
                };
                for (x, y) in (0..h - 1).flat_map(|y| (0..w - 1).map(move |x| (x, y))) {
                    let corners = (node(x, y), node(x + 1, y), node(x + 1, y + 1), node(x, y + 1));
                    if let (Some(a), Some(b), Some(c), Some(d)) = corners {
                        fill(&mut out, size, &[a, b, c]);
                        fill(&mut out, size, &[a, c, d]);
                    }
                }
            }
        }
        out
    }
}

/// Fills the pixels of one triangle.
fn fill<const N: usize>(out: &mut [Option<[f64; N]>], [w, h]: [usize; 2], triangle: &[Corner<N>; 3]) {
    // corners in pixels of the target, y down
    let p = triangle.map(|(place, _)| [place[0] * w as f64, (1.0 - place[1]) * h as f64]);
    let area = cross(p[0], p[1], p[2]);
    if area.abs() < 1e-12 {
        return;
    }
    let span = |k: usize, most: usize| {
        let (low, high) =
            (p.iter().map(|c| c[k]).fold(f64::MAX, f64::min), p.iter().map(|c| c[k]).fold(f64::MIN, f64::max));
        (
            (low - 0.5).ceil().clamp(0.0, most as f64) as usize,
            ((high - 0.5).floor() + 1.0).clamp(0.0, most as f64) as usize,
        )
    };
    let ((x0, x1), (y0, y1)) = (span(0, w), span(1, h));
    for (x, y) in (y0..y1).flat_map(|y| (x0..x1).map(move |x| (x, y))) {
        let at = [x as f64 + 0.5, y as f64 + 0.5];
        let share = [cross(at, p[1], p[2]) / area, cross(p[0], at, p[2]) / area, cross(p[0], p[1], at) / area];
        if share.iter().all(|s| *s >= -1e-9) {
            out[y * w + x] = Some(std::array::from_fn(|k| (0..3).map(|i| share[i] * triangle[i].1[k]).sum()));
        }
    }
}

/// Twice the signed area of a triangle.
fn cross(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}
