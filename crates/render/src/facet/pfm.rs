//! Portable float maps: grids of three floats.

/// Largest side of a grid.
const MAX_SIDE: usize = 4096;
/// Largest number of nodes of a grid.
const MAX_NODES: usize = 1 << 22;

/// A grid of three floats per node.
#[derive(Clone, Debug, PartialEq)]
pub struct Pfm {
    /// Columns and rows, at least 2 each.
    pub size: [usize; 2],
    /// By rows from the bottom.
    pub values: Vec<[f32; 3]>,
}

impl Pfm {
    /// Parses the bytes of a file of kind `PF`, of either order of bytes. A side has 2 to 4096
    /// nodes, and a grid at most 4,194,304.
    ///
    /// # Errors
    /// The fault.
    pub fn parse(bytes: &[u8]) -> Result<Pfm, String> {
        let (size, little, data) = header(bytes)?;
        let float = |four: &[u8]| {
            let four = [four[0], four[1], four[2], four[3]];
            if little { f32::from_le_bytes(four) } else { f32::from_be_bytes(four) }
        };
        let values = data[..12 * size[0] * size[1]]
            .chunks_exact(12)
            .map(|node| [float(&node[..4]), float(&node[4..8]), float(&node[8..])])
            .collect();
        Ok(Pfm { size, values })
    }

    /// Writes the file, little-endian.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut out = format!("PF\n{} {}\n-1.0\n", self.size[0], self.size[1]).into_bytes();
        out.extend(self.values.iter().flatten().flat_map(|value| value.to_le_bytes()));
        out
    }
}

/// Returns the size, whether the floats are little-endian, and the floats.
fn header(bytes: &[u8]) -> Result<([usize; 2], bool, &[u8]), String> {
    let mut words = Vec::new();
    let mut at = 0;
    while words.len() < 4 {
        let start = at
            + bytes[at..]
                .iter()
                .take(64)
                .position(|b| !b.is_ascii_whitespace())
                .ok_or("the header of the PFM file is cut off")?;
        let length = bytes[start..]
            .iter()
            .take(64)
            .position(u8::is_ascii_whitespace)
            .ok_or("the header of the PFM file is cut off")?;
        words.push(
            std::str::from_utf8(&bytes[start..start + length]).map_err(|_| "the header of the PFM file is no text")?,
        );
        at = start + length;
    }
    if words[0] != "PF" {
        return Err(format!("the PFM file is of kind {}, expected PF (three floats)", words[0]));
    }
    let side = |word: &str| {
        word.parse::<usize>()
            .ok()
            .filter(|n| (2..=MAX_SIDE).contains(n))
            .ok_or_else(|| format!("the PFM grid has the side {word}, expected 2 to {MAX_SIDE}"))
    };
    let size = [side(words[1])?, side(words[2])?];
    if size[0] * size[1] > MAX_NODES {
        return Err(format!("the PFM grid has {} x {} nodes, expected at most {MAX_NODES}", size[0], size[1]));
    }
    let scale: f64 = words[3]
        .parse()
        .ok()
        .filter(|s: &f64| s.is_finite() && *s != 0.0)
        .ok_or_else(|| format!("the PFM scale is {}, expected a number", words[3]))?;
    let data = &bytes[at + 1..];
    let wanted = 12 * size[0] * size[1];
    if data.len() < wanted {
        return Err(format!("the PFM grid has {} bytes of floats, expected {wanted}", data.len()));
    }
    Ok((size, scale < 0.0, data))
}
