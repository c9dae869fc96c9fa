//! Tables of colors: `.cube` files ("Cube LUT Specification", Adobe, version 1.0).
//!
//! Lines of keywords (`TITLE`, `LUT_3D_SIZE n`, `DOMAIN_MIN r g b`, `DOMAIN_MAX r g b`), then `n³` lines of
//! three numbers, red fastest. Colors between the nodes are interpolated linearly in each of the three
//! axes. One-dimensional tables are refused; `gamma` and `white` of the facet do their work.

use crate::RenderError;
use std::path::Path;

/// Largest number of nodes along an edge.
const MAX_SIZE: u32 = 65;
/// Largest file, bytes.
const MAX_BYTES: u64 = 16 << 20;
/// Largest magnitude of a color.
const MAX_COLOR: f32 = 16.0;

/// Colors at the nodes of a cube.
#[derive(Clone, Debug, PartialEq)]
pub struct ColorTable {
    /// Nodes along each edge, 2 to 65.
    size: u32,
    /// Colors by node, red fastest, then green.
    colors: Vec<[f32; 3]>,
}

impl ColorTable {
    /// Reads a `.cube` file.
    ///
    /// # Errors
    /// [`RenderError::File`] with the path and the line.
    pub fn load(path: &Path) -> Result<ColorTable, RenderError> {
        let fail = |reason: String| RenderError::File { path: path.display().to_string(), reason };
        let length = std::fs::metadata(path).map_err(|e| fail(format!("the color table cannot be read: {e}")))?.len();
        if length > MAX_BYTES {
            return Err(fail(format!("the color table has {length} bytes, and at most {MAX_BYTES} are read")));
        }
        let bytes = tumble_scene::read_file(path).map_err(|e| fail(format!("the color table cannot be read: {e}")))?;
        ColorTable::parse(&bytes).map_err(fail)
    }

    /// Parses the text of a `.cube` file.
    ///
    /// # Errors
    /// The fault with its line.
    pub fn parse(bytes: &[u8]) -> Result<ColorTable, String> {
        let text =
            std::str::from_utf8(bytes).map_err(|e| format!("the color table is no text (byte {})", e.valid_up_to()))?;
        let (mut size, mut colors) = (None, Vec::new());
        for (number, line) in text.lines().enumerate() {
            let at = |what: &str| format!("line {}: {what}", number + 1);
            let mut words = line.split('#').next().unwrap_or("").split_whitespace();
            let Some(first) = words.next() else { continue };
            match first {
                "TITLE" => {}
                "LUT_3D_SIZE" => {
                    let n =
                        words.next().and_then(|word| word.parse::<u32>().ok()).filter(|n| (2..=MAX_SIZE).contains(n));
                    size = Some(n.ok_or_else(|| at(&format!("expected `LUT_3D_SIZE n` with n from 2 to {MAX_SIZE}")))?);
                }
                "LUT_1D_SIZE" => {
                    return Err(at(
                        "a one-dimensional table; expected LUT_3D_SIZE, or `gamma` and `white` in the cave file",
                    ));
                }
                "DOMAIN_MIN" | "DOMAIN_MAX" => {
                    let wanted = if first == "DOMAIN_MIN" { 0.0 } else { 1.0 };
                    if three(words) != Some([wanted; 3]) {
                        return Err(at(&format!(
                            "expected `{first} {wanted} {wanted} {wanted}`: codes go from 0 to 1"
                        )));
                    }
                }
                _ => {
                    let color = three(line.split('#').next().unwrap_or("").split_whitespace()).ok_or_else(|| {
                        at(&format!("expected a keyword, or three numbers from -{MAX_COLOR} to {MAX_COLOR}"))
                    })?;
                    let most = size.ok_or_else(|| at("a color before LUT_3D_SIZE"))?.pow(3);
                    if colors.len() as u32 >= most {
                        return Err(at(&format!("more than {most} colors, as many as LUT_3D_SIZE allows")));
                    }
                    colors.push(color);
                }
            }
        }
        let size = size.ok_or("the color table has no LUT_3D_SIZE")?;
        if colors.len() as u32 != size.pow(3) {
            return Err(format!("the color table ends after {} colors, expected {}", colors.len(), size.pow(3)));
        }
        Ok(ColorTable { size, colors })
    }

    /// Returns the color for a code of 0 to 1 each.
    pub fn color(&self, code: [f32; 3]) -> [f32; 3] {
        let n = self.size as usize;
        let at = code.map(|c| c.clamp(0.0, 1.0) * (n - 1) as f32);
        let i = at.map(|x| (x as usize).min(n - 2));
        let mut out = [0.0; 3];
        for corner in 0..8 {
            let bit = |k: usize| corner >> k & 1;
            let weight: f32 = (0..3)
                .map(|k| {
                    let f = at[k] - i[k] as f32;
                    if bit(k) == 1 { f } else { 1.0 - f }
                })
                .product();
            let node = self.colors[i[0] + bit(0) + n * (i[1] + bit(1) + n * (i[2] + bit(2)))];
            (0..3).for_each(|k| out[k] += weight * node[k]);
        }
        out
    }

    /// Nodes along each edge, and the colors, red fastest.
    pub(crate) fn nodes(&self) -> (u32, &[[f32; 3]]) {
        (self.size, &self.colors)
    }
}

fn three<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<[f32; 3]> {
    let mut number = || words.next()?.parse::<f32>().ok().filter(|x| x.abs() <= MAX_COLOR);
    let out = [number()?, number()?, number()?];
    words.next().is_none().then_some(out)
}
