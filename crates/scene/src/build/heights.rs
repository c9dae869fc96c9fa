//! Files of heights: gray PNG images, and text with a row of numbers in each line.

use std::path::Path;

/// Maximum number of heights of a file.
const MAX_HEIGHTS: usize = 4_194_304;
/// Maximum size of a file of heights in bytes: 256 MiB.
const MAX_HEIGHT_BYTES: usize = 1 << 28;

/// A grid of heights.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightGrid {
    /// Rows along x, from the smallest y to the largest, meters.
    pub heights_m: Vec<f64>,
    /// Length of a row.
    pub columns: usize,
}

/// Reads heights from a PNG or a text, chosen by the file's extension (`.png`, `.txt`, `.csv`).
///
/// An image is gray, with 1 to 16 bits; black is `range_m[0]` and white `range_m[1]`. It is a map seen
/// from above: its upper edge has the largest y. In a text, the first line has the smallest y; numbers
/// are meters, separated by blanks, commas or semicolons. Empty lines and those that begin with `#`
/// are left out.
///
/// # Errors
/// A sentence without the file's name. For a text it names line and value.
pub fn read_heights(path: &Path, bytes: &[u8], range_m: [f64; 2]) -> Result<HeightGrid, String> {
    if bytes.len() > MAX_HEIGHT_BYTES {
        return Err(format!("it has {} bytes; the limit is {MAX_HEIGHT_BYTES}", bytes.len()));
    }
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
    match extension.as_str() {
        "png" => of_png(bytes, range_m),
        "txt" | "csv" => of_text(bytes),
        other => Err(format!("the extension is '{other}'; supported are .png, .txt and .csv")),
    }
}

fn of_png(bytes: &[u8], [black, white]: [f64; 2]) -> Result<HeightGrid, String> {
    if !(black.is_finite() && white.is_finite()) {
        return Err(format!("the heights of black and white are {black} and {white} m; they must be finite"));
    }
    let mut decoder = png::Decoder::new(std::io::Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(|e| format!("it is no PNG: {e}"))?;
    let (columns, rows) = (reader.info().width as usize, reader.info().height as usize);
    if columns.saturating_mul(rows) > MAX_HEIGHTS {
        return Err(format!("the image is {columns} x {rows} pixels; the limit is {MAX_HEIGHTS} pixels"));
    }
    let size = reader.output_buffer_size().ok_or("the image is too large")?;
    let mut pixels = vec![0; size];
    let info = reader.next_frame(&mut pixels).map_err(|e| format!("the PNG is damaged: {e}"))?;
    let samples = info.color_type.samples();
    if samples > 2 {
        return Err("the image is in color; heights are a gray image".into());
    }
    let wide = info.bit_depth == png::BitDepth::Sixteen;
    let bytes_per_pixel = samples * if wide { 2 } else { 1 };
    let height = |pixel: &[u8]| {
        let share = match wide {
            true => f64::from(u16::from_be_bytes([pixel[0], pixel[1]])) / 65535.0,
            false => f64::from(pixel[0]) / 255.0,
        };
        black + share * (white - black)
    };
    let lines = pixels[..info.buffer_size()].chunks_exact(columns * bytes_per_pixel);
    let heights_m = lines.rev().flat_map(|line| line.chunks_exact(bytes_per_pixel)).map(height).collect();
    Ok(HeightGrid { heights_m, columns })
}

fn of_text(bytes: &[u8]) -> Result<HeightGrid, String> {
    let text =
        std::str::from_utf8(bytes).map_err(|e| format!("byte {} is not UTF-8; expected text", e.valid_up_to()))?;
    let (mut heights_m, mut columns) = (Vec::new(), None);
    let lines = text.lines().zip(1..).map(|(line, n)| (line.trim(), n));
    for (line, n) in lines.filter(|(line, _)| !(line.is_empty() || line.starts_with('#'))) {
        let before = heights_m.len();
        for word in line.split([',', ';', ' ', '\t']).filter(|word| !word.is_empty()) {
            match word.parse::<f64>().ok().filter(|height| height.is_finite()) {
                Some(height) if heights_m.len() < MAX_HEIGHTS => heights_m.push(height),
                Some(_) => return Err(format!("line {n}: more than {MAX_HEIGHTS} heights")),
                None => {
                    let word: String = word.chars().take(40).collect();
                    return Err(format!("line {n}: '{word}' is not a finite number"));
                }
            }
        }
        let count = heights_m.len() - before;
        match columns {
            Some(columns) if columns != count => {
                return Err(format!("line {n} has {count} heights, but the lines before it have {columns}"));
            }
            _ => columns = Some(count),
        }
    }
    Ok(HeightGrid { heights_m, columns: columns.unwrap_or(0) })
}
