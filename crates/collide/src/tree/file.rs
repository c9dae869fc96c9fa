//! The JSON file format of sphere trees, with the source mesh, the settings and the quality of the
//! tree.
//!
//! ```json
//! {
//!   "format": "tumble sphere tree", "version": 1, "name": "bunny.obj", "units": "m",
//!   "mesh": {"blake3": "…", "triangles": 6598, "diagonal": 2.4897},
//!   "settings": {"builder": "octree", "branch": 8, "depth": 3, "error": 0.01, "even": true},
//!   "stages": [{"level": 3, "stage": "leaves", "count": 402}],
//!   "quality": [{"level": 0, "spheres": 1, "coverage": 1.0, …}],
//!   "levels": [[{"c": [x, y, z], "r": R, "out": E}], [{"c": [x, y, z], "r": R, "out": E, "parent": 0}, …], …]
//! }
//! ```
//!
//! Every level represents the whole solid: a leaf above the last level is repeated in each level
//! below, as its own only child. Required are `format`, `version` and `levels`, and for each sphere
//! `c`, `r` and (except for the root) `parent`. The default of `out` is `2 r`, the most that a
//! sphere that meets the solid can extend outside. Without `mesh`, lengths are relative to the
//! diagonal of the box around the leaves. Without `settings`, the default settings apply.
//!
//! Numbers are written with enough digits to restore the same bits. Input is not trusted: the
//! reader limits sizes and requires finite numbers, parents that exist and are in order, and
//! children inside their parents.

use super::{LevelQuality, SphereNode, SphereTree, StageCount, TreeSettings};
use crate::cache::MAX_BYTES;
use crate::{TriMesh, Vec3};
use serde::{Deserialize, Serialize};
use std::fmt::Write;
use thiserror::Error;

/// Maximum number of spheres of a tree that is read.
const MAX_SPHERES: usize = 1 << 23;
/// Maximum number of levels of a tree that is read.
const MAX_LEVELS: usize = 64;
/// Maximum coordinate and radius of a sphere that is read, meters.
const MAX_COORDINATE: f64 = 1e10;
/// Excess over the parent's radius, as a fraction of it, from which a sphere is outside its parent,
/// as in [`SphereTree::check_nesting`].
const NESTING_TOLERANCE: f64 = 1e-12;
const FORMAT: &str = "tumble sphere tree";
/// Version of the format that is read and written.
const VERSION: u32 = 1;

/// A sphere tree with its origin and quality.
#[derive(Clone, Debug, PartialEq)]
pub struct TreeFile {
    /// Name of the mesh, such as its file name.
    pub name: String,
    /// The mesh of the tree.
    pub mesh: MeshId,
    /// The build settings.
    pub settings: TreeSettings,
    /// Counts of the builder's stages.
    pub stages: Vec<StageCount>,
    /// Quality of each level; may be empty.
    pub quality: Vec<LevelQuality>,
    /// The tree.
    pub tree: SphereTree,
}

/// Identifies a mesh.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeshId {
    /// BLAKE3 of the vertices' bits and the triangles, in hexadecimal.
    pub blake3: String,
    /// Number of triangles.
    pub triangles: usize,
    /// Diagonal of its bounding box, meters.
    pub diagonal: f64,
}

/// Faults of a sphere tree file.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum TreeFileError {
    /// The text is too long.
    #[error("the text has {0} bytes; at most {MAX_BYTES} are allowed")]
    TooLong(usize),
    /// Not JSON, or not the keys of a sphere tree.
    #[error("{0}")]
    Json(String),
    /// A different format or version.
    #[error("it is a \"{format}\" of version {version}; supported is \"{FORMAT}\" of version {VERSION}")]
    Format {
        /// The format in the file.
        format: String,
        /// The version in the file.
        version: u32,
    },
    /// Units other than meters.
    #[error("units are \"{0}\"; a sphere tree is in \"m\"")]
    Units(String),
    /// A count out of range.
    #[error("there are {count} {what}; expected {expected}")]
    Count {
        /// The counted items.
        what: String,
        /// The count in the file.
        count: usize,
        /// The allowed counts.
        expected: String,
    },
    /// An invalid sphere.
    #[error("sphere {sphere} of level {level}: {what}")]
    Sphere {
        /// From 0.
        level: usize,
        /// From 0.
        sphere: usize,
        /// The fault, and the allowed values.
        what: String,
    },
    /// A guarantee that the tree breaks.
    #[error("{0}")]
    Tree(String),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct JsonTree {
    format: String,
    version: u32,
    #[serde(default)]
    name: String,
    #[serde(default = "meters")]
    units: String,
    mesh: Option<MeshId>,
    #[serde(default)]
    settings: TreeSettings,
    #[serde(default)]
    stages: Vec<StageCount>,
    #[serde(default)]
    quality: Vec<LevelQuality>,
    levels: Vec<Vec<JsonSphere>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct JsonSphere {
    c: [f64; 3],
    r: f64,
    out: Option<f64>,
    #[serde(default = "no_parent")]
    parent: i64,
}

impl JsonSphere {
    /// Returns the outward error; a sphere that meets the solid extends at most its diameter
    /// outside.
    fn out(&self) -> f64 {
        self.out.unwrap_or(2.0 * self.r)
    }
}

fn meters() -> String {
    "m".into()
}

fn no_parent() -> i64 {
    -1
}

impl MeshId {
    /// Returns the identity of a mesh.
    pub fn of(mesh: &TriMesh) -> MeshId {
        let mut hash = blake3::Hasher::new();
        hash.update(&(mesh.vertices.len() as u64).to_le_bytes());
        // hashed at once: the hash is fast for large inputs
        hash.update(
            &mesh.vertices.iter().flat_map(|v| [v.x, v.y, v.z]).flat_map(f64::to_le_bytes).collect::<Vec<u8>>(),
        );
        hash.update(&mesh.triangles.as_flattened().iter().flat_map(|n| n.to_le_bytes()).collect::<Vec<u8>>());
        MeshId {
            blake3: hash.finalize().to_hex().to_string(),
            triangles: mesh.triangles.len(),
            diagonal: mesh.diagonal(),
        }
    }
}

impl TreeFile {
    /// Returns the file as text: a few lines of header, then one sphere per line.
    pub fn to_json(&self) -> String {
        let mut text = String::from("{\n");
        let mut key = |name: &str, value: String| _ = writeln!(text, "\"{name}\": {value},");
        key("format", json(FORMAT));
        key("version", json(&VERSION));
        key("name", json(&self.name));
        key("units", json("m"));
        key("mesh", json(&self.mesh));
        key("settings", json(&self.settings));
        key("stages", lines(self.stages.iter().map(json)));
        key("quality", lines(self.quality.iter().map(json)));
        let levels = self.tree.level_lists();
        let levels: Vec<String> = levels
            .iter()
            .map(|level| {
                lines(level.iter().map(|b| {
                    let [x, y, z] = [b.center.x, b.center.y, b.center.z].map(|x| json(&x));
                    let parent = b.parent.map_or(String::new(), |p| format!(",\"parent\":{p}"));
                    format!(
                        "{{\"c\":[{x},{y},{z}],\"r\":{},\"out\":{}{parent}}}",
                        json(&b.radius),
                        json(&self.tree.nodes()[b.node].outward)
                    )
                }))
            })
            .collect();
        _ = writeln!(text, "\"levels\": [{}]\n}}", levels.join(", "));
        text
    }

    /// Parses and checks a text.
    ///
    /// # Errors
    /// [`TreeFileError`] names the fault, its place and the allowed values. Whether the tree fits a
    /// mesh is not checked.
    pub fn from_json(text: &str) -> Result<TreeFile, TreeFileError> {
        if text.len() > MAX_BYTES {
            return Err(TreeFileError::TooLong(text.len()));
        }
        let text: JsonTree = serde_json::from_str(text).map_err(|e| TreeFileError::Json(e.to_string()))?;
        if (text.format.as_str(), text.version) != (FORMAT, VERSION) {
            return Err(TreeFileError::Format { format: text.format, version: text.version });
        }
        if text.units != "m" {
            return Err(TreeFileError::Units(text.units));
        }
        let tree = read_levels(&text.levels)?;
        tree.check_nesting().map_err(|e| TreeFileError::Tree(e.to_string()))?;
        let (rows, levels) = (text.quality.len(), tree.levels() as usize);
        if rows != 0 && rows != levels {
            return Err(TreeFileError::Count {
                what: "rows of `quality`".into(),
                count: rows,
                expected: format!("one for each of the {levels} levels, or none"),
            });
        }
        let mesh = text.mesh.unwrap_or_else(|| MeshId {
            blake3: String::new(),
            triangles: 0,
            diagonal: (tree.bounds().max - tree.bounds().min).norm(),
        });
        if !(mesh.diagonal > 0.0 && mesh.diagonal <= MAX_COORDINATE) {
            return Err(TreeFileError::Tree(format!(
                "`diagonal` of `mesh` is {}; expected above 0, at most {MAX_COORDINATE:e} m",
                mesh.diagonal
            )));
        }
        Ok(TreeFile {
            name: text.name,
            mesh,
            settings: text.settings,
            stages: text.stages,
            quality: text.quality,
            tree,
        })
    }
}

/// Returns the JSON of `value`, or `null` if JSON cannot represent it; a tree that was built has no
/// such number.
fn json<T: Serialize + ?Sized>(value: &T) -> String {
    serde_json::to_string(value).unwrap_or_else(|_| "null".into())
}

fn lines(items: impl Iterator<Item = String>) -> String {
    format!("[\n{}\n]", items.collect::<Vec<_>>().join(",\n"))
}

fn read_levels(levels: &[Vec<JsonSphere>]) -> Result<SphereTree, TreeFileError> {
    let count = |what: &str, count, expected: String| Err(TreeFileError::Count { what: what.into(), count, expected });
    if levels.is_empty() || levels.len() > MAX_LEVELS {
        return count("levels", levels.len(), format!("1 to {MAX_LEVELS}"));
    }
    if levels[0].len() != 1 {
        return count("spheres in level 0", levels[0].len(), "1, the root".into());
    }
    if let Some(empty) = levels.iter().position(Vec::is_empty) {
        return count(
            &format!("spheres in level {empty}"),
            0,
            "at least 1: each level represents the whole solid".into(),
        );
    }
    let spheres = levels.iter().map(Vec::len).sum();
    if spheres > MAX_SPHERES {
        return count("spheres", spheres, format!("at most {MAX_SPHERES}"));
    }
    let mut nodes: Vec<SphereNode> = Vec::with_capacity(spheres);
    // for every sphere of the level above: its node, and whether that is a leaf repeated from
    // higher up
    let mut above: Vec<(usize, bool)> = Vec::new();
    for (number, level) in levels.iter().enumerate() {
        above = read_level(number, level, &above, &mut nodes)?;
    }
    Ok(SphereTree::of_nodes(nodes))
}

fn read_level(
    number: usize,
    level: &[JsonSphere],
    above: &[(usize, bool)],
    nodes: &mut Vec<SphereNode>,
) -> Result<Vec<(usize, bool)>, TreeFileError> {
    let mut placed = Vec::with_capacity(level.len());
    for (n, sphere) in level.iter().enumerate() {
        let wrong = |what: String| TreeFileError::Sphere { level: number, sphere: n, what };
        let node = read_sphere(number, sphere).map_err(wrong)?;
        let parent = read_parent(number, n, level, above.len()).map_err(wrong)?;
        let Some((number_above, (parent, carried))) = parent.map(|p| (p, above[p])) else {
            placed.push((nodes.len(), false));
            nodes.push(node);
            continue;
        };
        let alone = [n.checked_sub(1), Some(n + 1)]
            .iter()
            .flatten()
            .all(|m| level.get(*m).is_none_or(|other| other.parent != sphere.parent));
        let of = &nodes[parent];
        let same = alone && (node.center, node.radius, node.outward) == (of.center, of.radius, of.outward);
        if same {
            placed.push((parent, true));
        } else if carried {
            return Err(wrong("its parent is a repeated leaf, which has no other children".into()));
        } else {
            let excess = (node.center - of.center).norm() + node.radius - of.radius;
            if excess > NESTING_TOLERANCE * of.radius {
                return Err(wrong(format!(
                    "it extends beyond its parent, sphere {number_above} of level {}, by {excess:e} m",
                    number - 1
                )));
            }
            let index = nodes.len();
            let of = &mut nodes[parent];
            of.first_child = if of.children == 0 { index as u32 } else { of.first_child };
            of.children += 1;
            let level = of.level + 1;
            nodes.push(SphereNode { level, ..node });
            placed.push((index, false));
        }
    }
    Ok(placed)
}

fn read_sphere(number: usize, sphere: &JsonSphere) -> Result<SphereNode, String> {
    let [x, y, z] = sphere.c;
    if let Some(bad) = sphere.c.iter().find(|x| x.is_nan() || x.abs() > MAX_COORDINATE) {
        return Err(format!("its center has the coordinate {bad}; expected at most {MAX_COORDINATE:e} m"));
    }
    for (what, value) in [("radius `r`", sphere.r), ("outward error `out`", sphere.out())] {
        if !(0.0..=MAX_COORDINATE).contains(&value) {
            return Err(format!("its {what} is {value}; expected 0 to {MAX_COORDINATE:e} m"));
        }
    }
    Ok(SphereNode {
        center: Vec3::new(x, y, z),
        radius: sphere.r,
        outward: sphere.out(),
        first_child: 0,
        children: 0,
        level: number as u32,
    })
}

/// Returns the parent's index in the level above; `None` for the root. Parents must ascend along a
/// level, so that siblings are adjacent.
fn read_parent(number: usize, n: usize, level: &[JsonSphere], above: usize) -> Result<Option<usize>, String> {
    let parent = level[n].parent;
    if number == 0 {
        return if parent == -1 { Ok(None) } else { Err(format!("its parent is {parent}; the root has none")) };
    }
    let index = usize::try_from(parent).ok().filter(|p| *p < above);
    let index = index.ok_or_else(|| format!("its parent is {parent}; expected 0 to {}", above - 1))?;
    if n > 0 && level[n - 1].parent > parent {
        return Err(format!(
            "its parent {parent} comes after {}; spheres must be ordered by parent",
            level[n - 1].parent
        ));
    }
    Ok(Some(index))
}
