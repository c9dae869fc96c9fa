//! Files of marks: points of the cave and their pixels in photographs. TOML, a table for each:
//!
//! ```toml
//! [[mark]]
//! view = "left"                # folder of the photographs
//! point_m = [-1.5, 1.5, 0]     # cave axes
//! pixel = [812.5, 1201]        # from the upper left corner
//! sigma_px = 1                 # how exact the pixel is; 1 by default
//! ```

use crate::fit::Mark;
use crate::mpcdi::CalibrationError;
use serde::Deserialize;
use std::ops::RangeInclusive;

/// Largest file, bytes.
const MAX_BYTES: usize = 1 << 20;
/// Largest number of marks.
const MAX_MARKS: usize = 4096;
const SIGMA: RangeInclusive<f64> = 0.01..=100.0;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    mark: Vec<toml::Spanned<Table>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Table {
    view: String,
    point_m: [f64; 3],
    pixel: [f64; 2],
    #[serde(default = "one")]
    sigma_px: f64,
}

fn one() -> f64 {
    1.0
}

/// Reads the text of a file: marks with the names of their views.
///
/// # Errors
/// [`CalibrationError`] with the line of the fault.
pub fn parse_marks(text: &str, file: &str) -> Result<Vec<(String, Mark)>, CalibrationError> {
    let at = |byte: usize| format!("{file}:{}", 1 + text.as_bytes().iter().take(byte).filter(|b| **b == b'\n').count());
    if text.len() > MAX_BYTES {
        return Err(CalibrationError::new(file, format!("has {} bytes, and at most {MAX_BYTES} are read", text.len())));
    }
    let read: File = toml::from_str(text).map_err(|e| {
        CalibrationError::new(at(e.span().map_or(0, |span| span.start)), e.message().replace('\n', " "))
    })?;
    if read.mark.len() > MAX_MARKS {
        return Err(CalibrationError::new(file, format!("has {} marks, at most {MAX_MARKS}", read.mark.len())));
    }
    let mark = |spanned: toml::Spanned<Table>| {
        let fail = |reason: String| Err(CalibrationError::new(at(spanned.span().start), reason));
        let Table { view, point_m, pixel, sigma_px } = spanned.get_ref();
        if !point_m.iter().all(|c| c.abs() <= 1e4) {
            return fail(format!("`point_m` is {point_m:?}, expected numbers up to 10000 m"));
        }
        if !pixel.iter().all(|c| (0.0..=65536.0).contains(c)) {
            return fail(format!("`pixel` is {pixel:?}, expected a pixel of the photograph"));
        }
        if !SIGMA.contains(sigma_px) {
            return fail(format!("`sigma_px` is {sigma_px}, expected 0.01 to 100"));
        }
        Ok((view.clone(), Mark { point_m: *point_m, pixel: *pixel, sigma_px: *sigma_px }))
    };
    read.mark.into_iter().map(mark).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_have_their_line() {
        let good = "[[mark]]\nview = \"a\"\npoint_m = [0, 1.5, -2]\npixel = [10, 20.5]\n";
        let (view, mark) = parse_marks(good, "m.toml").unwrap().remove(0);
        assert_eq!(
            (view.as_str(), mark.point_m, mark.pixel, mark.sigma_px),
            ("a", [0.0, 1.5, -2.0], [10.0, 20.5], 1.0)
        );
        let said = |text: String| parse_marks(&text, "m.toml").unwrap_err().to_string();
        assert!(said(format!("{good}{}", good.replace("10,", "-10,"))).starts_with("m.toml:5: `pixel` is [-10.0"));
        assert!(said(good.replace("-2]", "nan]")).contains("`point_m` is"));
        assert!(
            said(good.replace("pixel", "pixl")).starts_with("m.toml:4: unknown field `pixl`"),
            "{}",
            said(good.replace("pixel", "pixl"))
        );
        assert!(said(format!("{good}sigma_px = 0\n")).contains("expected 0.01 to 100"));
        assert!(said("[[mark]".into()).starts_with("m.toml:1: "));
    }
}
