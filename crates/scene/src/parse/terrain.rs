//! Convex hulls, height fields and terrain in `[meshes.NAME]`.

use std::path::{Path, PathBuf};

use toml::de::DeValue;

use crate::parse::bound::Bound;
use crate::parse::fields::Fields;
use crate::parse::mesh::{MeshSource, read_file, read_path};

/// Maximum number of points of a hull and of heights in a scene file; there may be more in files of
/// their own.
const MAX_ENTRIES: usize = 1_000_000;
const POINTS: &str = "a list of at least 4 points [x, y, z] in meters";
const HEIGHTS: &str = "a list of at least 2 rows of at least 2 heights in meters, all of the same length";

/// The points of a convex hull.
#[derive(Clone, Debug, PartialEq)]
pub enum HullPoints {
    /// Positions, meters.
    Given(Vec<[f64; 3]>),
    /// The vertices of a mesh file, which need not be closed.
    File {
        /// The path, prefixed with the folder of the scene.
        path: PathBuf,
        /// Meters per unit of the file.
        scale: f64,
    },
}

/// The heights of a height field.
#[derive(Clone, Debug, PartialEq)]
pub enum Heights {
    /// Rows along x, from the smallest y to the largest.
    Given {
        /// Meters, row after row.
        heights_m: Vec<f64>,
        /// Length of a row.
        columns: usize,
    },
    /// A gray PNG, or text with a row of numbers in each line.
    File {
        /// The path, prefixed with the folder of the scene.
        path: PathBuf,
        /// Heights of black and white, meters; unused for text.
        range_m: [f64; 2],
    },
}

/// Reads `type = "convex_hull"`.
pub(super) fn read_hull(f: &mut Fields<'_>, folder: &Path) -> Option<MeshSource> {
    let Some(value) = f.value("points_m") else {
        if f.value("file").is_none() {
            f.missing("points_m", &format!("{POINTS}, or `file`"));
            return None;
        }
        let scale = f.number_or("scale", Bound::POSITIVE, 1.0);
        return Some(MeshSource::ConvexHull(HullPoints::File { path: read_path(f, folder)?, scale }));
    };
    let items = f.list("points_m", MAX_ENTRIES, POINTS);
    if items.len() < 4 {
        f.wrong("points_m", value, POINTS);
        return None;
    }
    let problems = f.log.count();
    let points = items.into_iter().map(|item| f.as_vector("points_m", item, Bound::ANY)).collect();
    (f.log.count() == problems).then_some(MeshSource::ConvexHull(HullPoints::Given(points)))
}

/// Reads `type = "height_field"`.
pub(super) fn read_height_field(f: &mut Fields<'_>, folder: &Path) -> Option<MeshSource> {
    let size_m = f.vector("size_m", Bound::POSITIVE);
    let thickness_m = f.optional_number("thickness_m", Bound::POSITIVE);
    let heights = match f.value("heights_m") {
        Some(_) => read_rows(f)?,
        None if f.value("file").is_none() => {
            f.missing("heights_m", &format!("{HEIGHTS}, or `file`"));
            return None;
        }
        None => {
            let range_m = f.vector_or("height_range_m", Bound::ANY, [0.0, 1.0]);
            let path = read_height_path(f, folder)?;
            let is_image = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"));
            if let (false, Some(value)) = (is_image, f.value("height_range_m")) {
                f.wrong("height_range_m", value, "none: heights of a text are in meters; a .png has a range");
            }
            Heights::File { path, range_m }
        }
    };
    Some(MeshSource::HeightField { heights, size_m, thickness_m })
}

fn read_rows(f: &mut Fields<'_>) -> Option<Heights> {
    let value = f.value("heights_m")?;
    let rows = f.list("heights_m", MAX_ENTRIES, HEIGHTS);
    let columns = rows.first().and_then(|row| row.get_ref().as_array()).map_or(0, |row| row.len());
    if rows.len() < 2 || columns < 2 || rows.len() * columns > MAX_ENTRIES {
        f.wrong("heights_m", value, HEIGHTS);
        return None;
    }
    let problems = f.log.count();
    let mut heights_m = Vec::with_capacity(rows.len() * columns);
    for row in rows {
        match row.get_ref() {
            DeValue::Array(items) if items.len() == columns => {
                heights_m.extend(items.iter().map(|item| f.as_number("heights_m", item, Bound::ANY)));
            }
            _ => f.wrong("heights_m", row, format!("a row of {columns} heights, like the first one")),
        }
    }
    (f.log.count() == problems).then_some(Heights::Given { heights_m, columns })
}

/// Reads `type = "terrain"`.
pub(super) fn read_terrain(f: &mut Fields<'_>, folder: &Path) -> Option<MeshSource> {
    let scale = f.number_or("scale", Bound::POSITIVE, 1.0);
    let thickness_m = f.optional_number("thickness_m", Bound::POSITIVE);
    Some(MeshSource::Terrain { path: read_path(f, folder)?, scale, thickness_m })
}

/// Reads `type = "open_mesh"`.
pub(super) fn read_open_mesh(f: &mut Fields<'_>, folder: &Path) -> Option<MeshSource> {
    let scale = f.number_or("scale", Bound::POSITIVE, 1.0);
    let thickness_m = f.optional_number("thickness_m", Bound::POSITIVE);
    let centered = f.flag_or("centered", false);
    Some(MeshSource::OpenMesh { path: read_path(f, folder)?, scale, thickness_m, centered })
}

fn read_height_path(f: &mut Fields<'_>, folder: &Path) -> Option<PathBuf> {
    read_file(f, folder, &["png", "txt", "csv"], "the path of a .png, .txt or .csv file")
}
