//! The figures of a sphere tree as lines of text: what `tumble spheretree` prints.

use std::fmt::Write;
use tumble_collide::{LevelQuality, TreeFile};

/// A column: its head in two lines, and the text of a level.
type Column = (&'static str, &'static str, fn(&TreeFile, &LevelQuality) -> String);

const SHORT: &[Column] = &[
    ("level", "", |_, q| q.level.to_string()),
    ("spheres", "", |_, q| q.spheres.to_string()),
    ("covered", "%", |_, q| format!("{:.2}", 100.0 * q.coverage)),
    ("outside", "mean %", |_, q| percent(q.protrusion_mean)),
    ("outside", "worst %", |_, q| percent(q.protrusion_max)),
    ("at most", "%", |file, q| percent(file.tree.outward_error_at(q.level) / file.mesh.diagonal)),
    ("volume", "ratio", |_, q| format!("{:.3}", q.volume_ratio)),
    ("sticking", "out", |_, q| q.nesting_broken.to_string()),
];

const LONG: &[Column] = &[
    ("outside", "95th %", |_, q| percent(q.protrusion_p95)),
    ("sphere", "mean %", |_, q| percent(q.sphere_mean)),
    ("sphere", "worst %", |_, q| percent(q.sphere_worst)),
    ("gap", "mean %", |_, q| percent(q.gap_mean)),
    ("gap", "worst %", |_, q| percent(q.gap_max)),
    ("volume", "outside", |_, q| format!("{:.3}", q.outside)),
    ("volume", "missing", |_, q| format!("{:.3}", q.missing)),
];

/// One line per level: lengths in per cent of the mesh's diagonal. A verbose one has more figures, and the builder's stages below.
pub fn table(file: &TreeFile, verbose: bool) -> String {
    let columns: Vec<&Column> = SHORT.iter().chain(LONG.iter().filter(|_| verbose)).collect();
    let cells = file.quality.iter().map(|q| columns.iter().map(|c| (c.2)(file, q)).collect());
    let heads = [columns.iter().map(|c| c.0.to_owned()).collect(), columns.iter().map(|c| c.1.to_owned()).collect()];
    let s = file.settings;
    // the method's name as it is typed
    let method = serde_json::to_value(s.builder).ok().and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default();
    let mut text =
        format!("{method}, branch {}, depth {}, error {}; lengths in % of the diagonal\n", s.branch, s.depth, s.error);
    text += &aligned(heads.into_iter().chain(cells));
    if verbose {
        for stage in &file.stages {
            _ = writeln!(text, "level {}: {} {}", stage.level, stage.count, stage.stage);
        }
    }
    text
}

/// Rows of cells, each column as wide as its widest cell, set to the right.
pub fn aligned(rows: impl Iterator<Item = Vec<String>>) -> String {
    let rows: Vec<Vec<String>> = rows.collect();
    let width = |k: usize| rows.iter().filter_map(|row| row.get(k)).map(|cell| cell.chars().count()).max().unwrap_or(0);
    let line = |row: &Vec<String>| {
        row.iter().enumerate().map(|(k, cell)| format!("{cell:>wide$}", wide = width(k))).collect::<Vec<_>>().join("  ")
    };
    rows.iter().map(|row| line(row).trim_end().to_owned() + "\n").collect()
}

/// Three digits that count.
pub fn percent(share: f64) -> String {
    format!("{:.3}", 100.0 * share)
}
