//! The curve as a picture: time per step over the number of boxes, both logarithmic.

use std::fmt::Write;

const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 440.0;
const LEFT: f64 = 80.0;
const RIGHT: f64 = 150.0;
const TOP: f64 = 40.0;
const BOTTOM: f64 = 60.0;

/// Returns an SVG of curves `(name, color, points)`. A point is a number of boxes and microseconds;
/// a dashed line is proportional to the boxes.
pub fn write(curves: &[(&str, &str, Vec<(f64, f64)>)]) -> String {
    let points = || curves.iter().flat_map(|c| &c.2);
    let span = |of: fn(&(f64, f64)) -> f64| {
        let (low, high) =
            points().map(of).fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), x| (low.min(x), high.max(x)));
        (low.log10().floor(), high.log10().ceil())
    };
    let (x, y) = (span(|p| p.0), span(|p| p.1));
    let place = |p: &(f64, f64)| {
        let (u, v) = ((p.0.log10() - x.0) / (x.1 - x.0), (p.1.log10() - y.0) / (y.1 - y.0));
        (LEFT + u * (WIDTH - LEFT - RIGHT), HEIGHT - BOTTOM - v * (HEIGHT - TOP - BOTTOM))
    };
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" font-family=\"sans-serif\" font-size=\"13\">\n"
    );
    svg += "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n";
    let mut line = |from: (f64, f64), to: (f64, f64), style: &str| {
        let _ = writeln!(svg, "<path d=\"M{:.1} {:.1}L{:.1} {:.1}\" {style}/>", from.0, from.1, to.0, to.1);
    };
    for power in x.0 as i32..=x.1 as i32 {
        let at = 10f64.powi(power);
        line(place(&(at, 10f64.powf(y.0))), place(&(at, 10f64.powf(y.1))), "stroke=\"#ddd\"");
    }
    for power in y.0 as i32..=y.1 as i32 {
        let at = 10f64.powi(power);
        line(place(&(10f64.powf(x.0), at)), place(&(10f64.powf(x.1), at)), "stroke=\"#ddd\"");
    }
    if let Some((n, first)) = curves.first().and_then(|c| c.2.first()) {
        let last = 10f64.powf(x.1).min(n * 10f64.powf(y.1) / first);
        line(place(&(*n, *first)), place(&(last, first * last / n)), "stroke=\"#888\" stroke-dasharray=\"5 4\"");
    }
    let mut text = |x: f64, y: f64, anchor: &str, words: &str| {
        let _ = writeln!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{words}</text>");
    };
    for power in x.0 as i32..=x.1 as i32 {
        text(place(&(10f64.powi(power), 1.0)).0, HEIGHT - BOTTOM + 20.0, "middle", &format!("{}", 10f64.powi(power)));
    }
    for power in y.0 as i32..=y.1 as i32 {
        text(LEFT - 8.0, place(&(1.0, 10f64.powi(power))).1 + 4.0, "end", &format!("{} ms", 1e-3 * 10f64.powi(power)));
    }
    text(0.5 * (LEFT + WIDTH - RIGHT), HEIGHT - 15.0, "middle", "boxes that move by 1 % of their radius per step");
    text(LEFT, TOP - 18.0, "start", "CPU time per step; dashed: proportional to the number of boxes");
    for (name, color, points) in curves {
        let path: Vec<String> = points.iter().map(|p| format!("{:.1} {:.1}", place(p).0, place(p).1)).collect();
        let _ = writeln!(svg, "<path d=\"M{}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"2\"/>", path.join("L"));
        for p in points.iter().map(place) {
            let _ = writeln!(svg, "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"3\" fill=\"{color}\"/>", p.0, p.1);
        }
        if let Some(last) = points.last().map(place) {
            let _ = writeln!(
                svg,
                "<text x=\"{:.1}\" y=\"{:.1}\" fill=\"{color}\">{name}</text>",
                last.0 + 10.0,
                last.1 + 4.0
            );
        }
    }
    svg + "</svg>\n"
}
