//! Slider panels over a picture: for each slider a name, a value and a bar.

use crate::Image;
use crate::facet::{blank, fill_rect, font};

/// Dots of the panel: its width, its rim, the height of the title and of a slider.
const WIDTH: i64 = 180;
const RIM: i64 = 4;
const TITLE: i64 = 14;
const ROW: i64 = 24;
/// Dots from the top of a slider to its bar, and the bar's height.
const BAR_TOP: i64 = 10;
const BAR: i64 = 7;
/// Dots at both ends of the bar, for the bounds of the range.
const ENDS: i64 = 38;
/// Largest number of letters of a name.
const LETTERS: usize = 16;

const GROUND: [u8; 4] = [12, 14, 18, 190];
const CHOSEN: [u8; 4] = [52, 62, 80, 220];
const INK: [u8; 4] = [236, 238, 240, 255];
const FAINT: [u8; 4] = [176, 182, 190, 255];
const TRACK: [u8; 4] = [112, 118, 130, 255];
const HANDLE: [u8; 4] = [255, 160, 50, 255];
const TARGET: [u8; 4] = [120, 200, 255, 255];

/// A value with a slider.
#[derive(Clone, Debug, PartialEq)]
pub struct Slider {
    /// Its name; the first 16 letters are shown.
    pub name: String,
    /// The value.
    pub value: f64,
    /// Lower and upper bound.
    pub range: [f64; 2],
    /// Unit after the value, such as `rad`.
    pub unit: &'static str,
    /// A second mark on the bar: the target of a drive.
    pub target: Option<f64>,
    /// Whether keys move this slider.
    pub chosen: bool,
}

/// Layout of a column of sliders below a title. All pixels are from the panel's upper left corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SliderPanel {
    /// Pixels per dot, 1 to 8.
    pub scale: u32,
    /// Number of sliders.
    pub count: usize,
    /// Index of the first slider shown.
    pub first: usize,
    /// Number of sliders shown.
    pub shown: usize,
}

impl SliderPanel {
    /// Fits as many of `count` sliders as possible into a height, at least one. `chosen` is among
    /// them; otherwise they start at `first`.
    pub fn fitting(count: usize, chosen: usize, first: usize, scale: u32, height_px: u32) -> SliderPanel {
        let scale = scale.clamp(1, 8);
        let room = i64::from(height_px / scale) - TITLE - 2 * RIM;
        let shown = count.min((room / ROW).max(1) as usize);
        let first = first.min(chosen).max((chosen + 1).saturating_sub(shown)).min(count.saturating_sub(shown));
        SliderPanel { scale, count, first, shown }
    }

    /// Width and height, pixels.
    pub fn size_px(&self) -> [u32; 2] {
        [WIDTH, 2 * RIM + TITLE + ROW * self.shown as i64].map(|dots| dots as u32 * self.scale)
    }

    /// Returns the slider at a pixel and the fraction of its bar to the left of it, 0 to 1; also
    /// for pixels beside the bar.
    pub fn at(&self, [x, y]: [f64; 2]) -> Option<(usize, f64)> {
        let [width, height] = self.size_px();
        let scale = f64::from(self.scale);
        let row = (y / scale - (RIM + TITLE) as f64) / ROW as f64;
        let inside = (0.0..f64::from(width)).contains(&x) && y < f64::from(height) && row >= 0.0;
        let index = row as usize;
        (inside && index < self.shown).then(|| (self.first + index, self.share(x)))
    }

    /// The fraction of a bar to the left of a column of pixels, 0 to 1.
    pub fn share(&self, x: f64) -> f64 {
        let [left, right] = self.bar_px();
        ((x - left) / (right - left)).clamp(0.0, 1.0)
    }

    /// Left and right end of all bars, pixels.
    pub fn bar_px(&self) -> [f64; 2] {
        [RIM + ENDS, WIDTH - RIM - ENDS].map(|dots| (dots * i64::from(self.scale)) as f64)
    }

    /// Height of the bar of a slider, pixels from the top; `None` if it is not shown.
    pub fn middle_px(&self, index: usize) -> Option<f64> {
        let row = index.checked_sub(self.first).filter(|row| *row < self.shown)? as i64;
        Some(
            ((RIM + TITLE + ROW * row + BAR_TOP) * i64::from(self.scale)) as f64
                + 0.5 * f64::from(BAR as u32 * self.scale),
        )
    }

    /// Draws the panel with its title; `sliders` holds all sliders.
    pub fn draw(&self, title: &str, sliders: &[Slider]) -> Image {
        let [width, height] = self.size_px();
        let mut panel = Panel { image: blank(width, height, GROUND), scale: i64::from(self.scale) };
        let more = match self.shown < self.count {
            true => format!(" {}-{} of {}", self.first + 1, self.first + self.shown, self.count),
            false => String::new(),
        };
        panel.text(&format!("{title}{more}"), RIM, RIM, INK);
        for (row, slider) in sliders.iter().skip(self.first).take(self.shown).enumerate() {
            panel.slider(slider, RIM + TITLE + ROW * row as i64);
        }
        panel.image
    }
}

/// A picture that is drawn in dots.
struct Panel {
    image: Image,
    scale: i64,
}

impl Panel {
    fn text(&mut self, text: &str, x: i64, y: i64, color: [u8; 4]) {
        font::write(&mut self.image, &text.to_uppercase(), x * self.scale, y * self.scale, self.scale, color);
    }

    /// Writes text that ends at the column `x`.
    fn text_before(&mut self, text: &str, x: i64, y: i64, color: [u8; 4]) {
        self.text(text, x - font::text_width(text, 1), y, color);
    }

    fn rect(&mut self, x: i64, y: i64, w: i64, h: i64, color: [u8; 4]) {
        let s = self.scale;
        fill_rect(&mut self.image, x * s, y * s, w * s, h * s, color);
    }

    fn slider(&mut self, slider: &Slider, top: i64) {
        if slider.chosen {
            self.rect(1, top - 3, WIDTH - 2, ROW - 2, CHOSEN);
        }
        let name: String = slider.name.chars().take(LETTERS).collect();
        self.text(&name, RIM, top, INK);
        self.text_before(&format!("{:.3} {}", slider.value, slider.unit), WIDTH - RIM, top, INK);
        let bar = top + BAR_TOP;
        let [least, greatest] = slider.range;
        self.text(&format!("{least:.2}"), RIM, bar, FAINT);
        self.text_before(&format!("{greatest:.2}"), WIDTH - RIM, bar, FAINT);
        self.rect(RIM + ENDS, bar + 2, WIDTH - 2 * (RIM + ENDS), 3, TRACK);
        for (mark, width, color) in [(slider.target, 1, TARGET), (Some(slider.value), 3, HANDLE)] {
            let Some(mark) = mark.filter(|m| m.is_finite() && greatest > least) else { continue };
            let share = ((mark - least) / (greatest - least)).clamp(0.0, 1.0);
            let x = RIM + ENDS + (share * (WIDTH - 2 * (RIM + ENDS)) as f64).round() as i64;
            self.rect(x - width / 2, bar, width, BAR, color);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_on_a_bar_gives_its_slider_and_its_share() {
        let panel = SliderPanel::fitting(5, 0, 0, 2, 720);
        let [left, right] = panel.bar_px();
        for (index, share) in [(0, 0.0), (3, 0.25), (4, 1.0)] {
            let at = [left + share * (right - left), panel.middle_px(index).unwrap()];
            assert_eq!(panel.at(at), Some((index, share)));
        }
        assert_eq!(panel.at([left, -1.0]), None);
        assert_eq!(panel.at([f64::from(panel.size_px()[0]), 60.0]), None);
        assert_eq!(panel.at([left, f64::from(panel.size_px()[1])]), None);
    }

    #[test]
    fn a_low_window_shows_those_around_the_chosen_one() {
        // 24 dots per slider and 22 for title and rims: 100 dots hold 3
        let panel = SliderPanel::fitting(10, 6, 0, 1, 100);
        assert_eq!((panel.first, panel.shown), (4, 3));
        assert_eq!(panel.middle_px(3), None);
        assert_eq!(SliderPanel::fitting(10, 6, 9, 1, 100).first, 6);
        assert_eq!(SliderPanel::fitting(10, 9, 9, 1, 100).first, 7);
    }

    #[test]
    fn the_handle_stands_where_the_value_is() {
        let slider =
            |value| Slider { name: "a".into(), value, range: [-1.0, 1.0], unit: "rad", target: None, chosen: false };
        let panel = SliderPanel::fitting(1, 0, 0, 1, 100);
        let [left, right] = panel.bar_px();
        for value in [-1.0, 0.0, 0.5, 1.0] {
            let image = panel.draw("", &[slider(value)]);
            let y = panel.middle_px(0).unwrap() as u32;
            let handle: Vec<u32> = (0..image.width).filter(|x| image.pixel(*x, y) == Some(HANDLE)).collect();
            let middle = f64::from(handle.iter().sum::<u32>()) / handle.len() as f64;
            assert!((middle - (left + 0.5 * (value + 1.0) * (right - left))).abs() <= 0.5, "{value}: {handle:?}");
        }
    }
}
