//! The measured quality of a sphere tree as a text table, as `tumble spheretree` and Python's
//! `SphereTree.report` print it.

use super::{LevelQuality, TreeFile};
use std::fmt::Write;

/// A column: its heading in two lines, and the cell of a level.
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

impl TreeFile {
    /// Returns a table with one line per level. Lengths are percentages of the mesh's diagonal.
    /// With `verbose` the table has more columns, and the stages of the builder follow it.
    pub fn table(&self, verbose: bool) -> String {
        let columns: Vec<&Column> = SHORT.iter().chain(LONG.iter().filter(|_| verbose)).collect();
        let cells = self.quality.iter().map(|q| columns.iter().map(|c| (c.2)(self, q)).collect());
        let heads =
            [columns.iter().map(|c| c.0.to_owned()).collect(), columns.iter().map(|c| c.1.to_owned()).collect()];
        let s = self.settings;
        // the method's name as the command line takes it
        let method =
            serde_json::to_value(s.builder).ok().and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default();
        let mut text = format!(
            "{method}, branching {}, depth {}, max error {}; lengths in % of the diagonal\n",
            s.branch, s.depth, s.error
        );
        text += &align_columns(heads.into_iter().chain(cells));
        if verbose {
            for stage in &self.stages {
                _ = writeln!(text, "level {}: {} {}", stage.level, stage.count, stage.stage);
            }
        }
        text
    }
}

/// Formats rows of cells as lines of right-aligned columns, each as wide as its widest cell.
pub fn align_columns(rows: impl Iterator<Item = Vec<String>>) -> String {
    let rows: Vec<Vec<String>> = rows.collect();
    let width = |k: usize| rows.iter().filter_map(|row| row.get(k)).map(|cell| cell.chars().count()).max().unwrap_or(0);
    let line = |row: &Vec<String>| {
        row.iter().enumerate().map(|(k, cell)| format!("{cell:>wide$}", wide = width(k))).collect::<Vec<_>>().join("  ")
    };
    rows.iter().map(|row| line(row).trim_end().to_owned() + "\n").collect()
}

/// Formats a fraction as a percentage with three decimals.
fn percent(share: f64) -> String {
    format!("{:.3}", 100.0 * share)
}
