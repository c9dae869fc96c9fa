//! The curves as small multiples: residual over CPU time, both logarithmic, with the same axes.

use super::{Curve, SOLVERS};
use std::fmt::Write;

/// Panels in a row.
const COLUMNS: usize = 5;
/// Size of a panel, and of the space between panels.
const PANEL: [f64; 2] = [200.0, 190.0];
const GAP: [f64; 2] = [16.0, 44.0];
const LEFT: f64 = 58.0;
const TOP: f64 = 40.0;
const BOTTOM: f64 = 84.0;
/// Powers of ten at the ends of the axes: seconds, and m/s.
const TIMES: [i32; 2] = [-6, 1];
const RESIDUALS: [i32; 2] = [-17, 1];

/// Returns an SVG of the curves of all problems: title of the panel, and a curve per solver.
pub fn draw(panels: &[(String, [Curve; 5])]) -> String {
    let rows = panels.len().div_ceil(COLUMNS);
    let width = LEFT + COLUMNS as f64 * (PANEL[0] + GAP[0]);
    let height = TOP + rows as f64 * (PANEL[1] + GAP[1]) - GAP[1] + BOTTOM;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"12\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    );
    for (i, (title, curves)) in panels.iter().enumerate() {
        let (column, row) = (i % COLUMNS, i / COLUMNS);
        let corner = [LEFT + column as f64 * (PANEL[0] + GAP[0]), TOP + row as f64 * (PANEL[1] + GAP[1])];
        panel(&mut svg, corner, title, curves, column == 0);
    }
    text(&mut svg, [0.5 * width, height - 44.0], "middle", "#000", "CPU time of the solve, s");
    let middle = 0.5 * (height - BOTTOM + TOP);
    let _ = writeln!(
        svg,
        "<text x=\"14\" y=\"{middle:.1}\" text-anchor=\"middle\" transform=\"rotate(-90 14 {middle:.1})\">residual, m/s</text>"
    );
    let mut x = LEFT;
    for (name, color) in SOLVERS {
        let y = height - 16.0;
        let _ = writeln!(svg, "<path d=\"M{x:.1} {y:.1}h22\" stroke=\"{color}\" stroke-width=\"2\"/>");
        let _ = writeln!(svg, "<circle cx=\"{:.1}\" cy=\"{y:.1}\" r=\"3\" fill=\"{color}\"/>", x + 11.0);
        text(&mut svg, [x + 28.0, y + 4.0], "start", "#000", name);
        x += 60.0 + 6.8 * name.len() as f64;
    }
    svg + "</svg>\n"
}

fn panel(svg: &mut String, corner: [f64; 2], title: &str, curves: &[Curve; 5], labels: bool) {
    let [left, top] = corner;
    let along = |value: f64, [low, high]: [i32; 2]| {
        let power = value.log10().clamp(f64::from(low), f64::from(high));
        (power - f64::from(low)) / f64::from(high - low)
    };
    let place = |(time, error): (f64, f64)| {
        [left + along(time, TIMES) * PANEL[0], top + (1.0 - along(error, RESIDUALS)) * PANEL[1]]
    };
    for power in TIMES[0]..=TIMES[1] {
        let [x, _] = place((10_f64.powi(power), 1.0));
        let _ = writeln!(svg, "<path d=\"M{x:.1} {top:.1}v{}\" stroke=\"#e4e4e4\"/>", PANEL[1]);
        if power % 2 == 0 {
            text(svg, [x, top + PANEL[1] + 14.0], "middle", "#555", &format!("1e{power}"));
        }
    }
    for power in (RESIDUALS[0]..=RESIDUALS[1]).filter(|power| power.rem_euclid(3) == 0) {
        let [_, y] = place((1.0, 10_f64.powi(power)));
        // the tolerance that solves promise
        let color = if power == -9 { "#aaa" } else { "#e4e4e4" };
        let _ = writeln!(svg, "<path d=\"M{left:.1} {y:.1}h{}\" stroke=\"{color}\"/>", PANEL[0]);
        if labels {
            text(svg, [left - 5.0, y + 4.0], "end", "#555", &format!("1e{power}"));
        }
    }
    text(svg, [left, top - 7.0], "start", "#000", title);
    for (curve, (_, color)) in curves.iter().zip(SOLVERS) {
        let points: Vec<[f64; 2]> = curve.iter().map(|&p| place(p)).collect();
        let path: Vec<String> = points.iter().map(|[x, y]| format!("{x:.1} {y:.1}")).collect();
        if points.len() > 1 {
            let _ = writeln!(
                svg,
                "<path d=\"M{}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"1.8\"/>",
                path.join("L")
            );
        }
        let radius = if points.len() == 1 { 4.0 } else { 2.0 };
        for [x, y] in points {
            let _ = writeln!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\" fill=\"{color}\"/>");
        }
    }
}

fn text(svg: &mut String, at: [f64; 2], anchor: &str, color: &str, words: &str) {
    let [x, y] = at;
    let _ = writeln!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" fill=\"{color}\">{words}</text>");
}
