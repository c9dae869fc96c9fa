//! `<asset>`: meshes, height fields and materials.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use nalgebra::{Quaternion, Translation3, Unit};
use tumble_core::articulated::LinkMass;
use tumble_core::collide::{Pose, Quat, TriMesh, Vec3};

use super::Reader;
use super::defaults::cleaned;
use super::mesh::{self, Volume};
use super::schema;
use super::source::XmlNode;
use crate::build::mesh_files::{read_file, read_mesh_bytes, stretched};
use crate::parse::appearance::Color;
use crate::parse::bound::Bound;
use crate::xml::Element;

/// Largest number of points of a height field.
const MAX_FIELD: usize = 65_536;
/// Largest number of numbers in a list of vertices or triangles.
const MAX_NUMBERS: usize = 3_000_000;

/// The assets of a model by name.
#[derive(Default)]
pub(super) struct Assets<'a> {
    pub(super) meshes: BTreeMap<String, MeshAsset<'a>>,
    pub(super) fields: BTreeMap<String, Arc<TriMesh>>,
    pub(super) materials: BTreeMap<String, Look>,
}

/// A material: its color, the second color of a checkered texture, and gloss.
#[derive(Clone, Debug)]
pub(super) struct Look {
    pub(super) rgba: [f64; 4],
    pub(super) checker: Option<[Color; 2]>,
    pub(super) metallic: Option<f64>,
    pub(super) roughness: Option<f64>,
}

/// A mesh.
pub(super) struct MeshAsset<'a> {
    pub(super) element: Element<'a, 'a>,
    pub(super) from: MeshFrom,
    pub(super) scale: [f64; 3],
    volume: Volume,
    /// Reference pose: the frame of the mesh in the frame of its vertices.
    reference: Pose,
}

/// The vertices of a mesh.
pub(super) enum MeshFrom {
    /// A file that exists.
    File(PathBuf),
    /// Vertices in the model, with triangles if they are given.
    Inline(TriMesh),
    /// Why there is none.
    Missing(String),
}

impl MeshAsset<'_> {
    /// Returns the triangles in the frame of the mesh.
    fn triangles(&self) -> Result<TriMesh, String> {
        let mut mesh = match &self.from {
            MeshFrom::File(path) => read_file(path)?,
            MeshFrom::Inline(mesh) => mesh.clone(),
            MeshFrom::Missing(why) => return Err(why.clone()),
        };
        let back = self.reference.inverse();
        mesh.vertices.iter_mut().for_each(|v| *v = back.transform_point(&(*v).into()).coords);
        Ok(stretched(mesh, self.scale))
    }

    /// Returns the solid in the frame of the mesh: its convex hull, or if `exact` the mesh itself
    /// where it is closed.
    pub(super) fn solid(&self, exact: bool) -> Result<TriMesh, String> {
        let mut mesh = self.triangles()?;
        match exact && mesh.check_closed().is_ok() {
            true => Ok(mesh),
            false => mesh.convex_hull().map_err(|e| e.to_string()),
        }
    }

    /// Returns its mass at density 1.
    pub(super) fn mass(&self) -> Result<LinkMass, String> {
        let triangles = self.triangles()?;
        // Vertices without triangles are those of a hull.
        let points = triangles.triangles.iter().all(|[a, b, _]| a == b);
        mesh::mass(&triangles, if points { Volume::Hull } else { self.volume })
    }

    /// Returns the pose of the file's own frame in the frame of the mesh.
    pub(super) fn file_pose(&self) -> Pose {
        let back = self.reference.inverse();
        let moved = back.translation.vector.component_mul(&Vec3::from(self.scale));
        Pose::from_parts(Translation3::from(moved), back.rotation)
    }
}

impl<'a> Assets<'a> {
    pub(super) fn read(root: &XmlNode<'a>, reader: &Reader<'a>) -> Assets<'a> {
        let mut assets = Assets::default();
        let mut checkers = BTreeMap::new();
        let all = || root.all("asset").flat_map(|section| &section.children);
        for XmlNode { element, .. } in all().filter(|node| node.tag() == "texture") {
            let item = reader.classes.item(*element, 0);
            let colors = [item.numbers("rgb1"), item.numbers("rgb2")].map(|c| c.map(|c| c.map(|x| x.clamp(0.0, 1.0))));
            if let (Some("checker"), Some(name)) = (item.text("builtin"), element.text("name")) {
                checkers.insert(name.to_owned(), colors.map(|c| c.unwrap_or([0.5; 3])));
            }
        }
        for XmlNode { element, .. } in all() {
            match element.tag() {
                "mesh" => assets.add_mesh(*element, reader),
                "hfield" => assets.add_field(element, reader),
                "material" => assets.add_material(*element, reader, &checkers),
                "texture" => {}
                _ => reader.notes.add(element, format!("<{}> of <asset> is left out", cleaned(element.tag()))),
            }
        }
        assets
    }

    fn add_mesh(&mut self, element: Element<'a, 'a>, reader: &Reader<'a>) {
        schema::MESH.check(&element, &reader.notes);
        let item = reader.classes.item(element, 0);
        let scale = item.numbers("scale").unwrap_or([1.0; 3]);
        if scale.contains(&0.0) {
            element.wrong("scale", "three numbers other than 0");
        }
        let file = element.text("file").map(str::trim);
        let name = element.text("name").map(str::to_owned).or_else(|| stem(file?));
        let Some(name) = name else {
            return element.problem("has no `name`", "expected a unique name, or a `file`");
        };
        let from = match (file, element.text("vertex")) {
            (Some(file), _) => mesh_file(file, reader),
            (None, Some(_)) => inline(&element),
            (None, None) => MeshFrom::Missing("it has no `file` and no `vertex`".into()),
        };
        let quat = item.numbers::<4>("refquat").unwrap_or([1.0, 0.0, 0.0, 0.0]);
        let turn = Unit::try_new(Quaternion::new(quat[0], quat[1], quat[2], quat[3]), 1e-10);
        let moved = Vec3::from(item.numbers("refpos").unwrap_or([0.0; 3]));
        let reference = Pose::from_parts(Translation3::from(moved), turn.unwrap_or_else(Quat::identity));
        if self.meshes.contains_key(&name) {
            return element.problem("has the name of another mesh", "expected a unique name");
        }
        let volumes = [
            ("legacy", Volume::Positive),
            ("exact", Volume::Signed),
            ("convex", Volume::Hull),
            ("shell", Volume::Positive),
        ];
        if item.text("inertia") == Some("shell") {
            reader.notes.add(&element, "masses of shells are left out: the mass fills the volume");
        }
        let volume = item.word("inertia", &volumes).unwrap_or(Volume::Positive);
        self.meshes.insert(name, MeshAsset { element, from, scale, volume, reference });
    }

    fn add_field(&mut self, element: &Element<'a, 'a>, reader: &Reader<'a>) {
        schema::HFIELD.check(element, &reader.notes);
        if element.text("file").is_some() {
            return reader
                .notes
                .add(element, "height fields in files are left out, with their geoms; expected `elevation`");
        }
        let Some(name) = element.required_text("name", "a unique name") else { return };
        let count = |key: &str| {
            element.required_text(key, "a number of points")?;
            element.number(key, Bound::new(2.0, MAX_FIELD as f64, "a whole number of points, at least 2"))
        };
        let size = element
            .required_text("size", "radius x, radius y, height and depth")
            .and_then(|_| element.numbers::<4>("size", Bound::POSITIVE));
        let (Some(rows), Some(columns), Some(size)) = (count("nrow"), count("ncol"), size) else { return };
        let (rows, columns) = (rows as usize, columns as usize);
        if rows.saturating_mul(columns) > MAX_FIELD {
            return element.wrong("nrow", format_args!("at most {MAX_FIELD} points in all"));
        }
        let heights = match element.text("elevation") {
            Some(_) => element.list("elevation", rows * columns, Bound::ANY),
            None => Some(vec![0.0; rows * columns]),
        };
        let Some(heights) = heights else { return };
        if heights.len() != rows * columns {
            return element.wrong("elevation", format_args!("nrow·ncol = {} numbers", rows * columns));
        }
        self.fields.insert(name.to_owned(), Arc::new(height_field(rows, columns, size, &heights)));
    }

    fn add_material(&mut self, element: Element<'a, 'a>, reader: &Reader<'a>, checkers: &BTreeMap<String, [Color; 2]>) {
        schema::MATERIAL.check(&element, &reader.notes);
        let Some(name) = element.required_text("name", "a unique name") else { return };
        let item = reader.classes.item(element, 0);
        let part = |key: &str| item.at(key).and_then(|e| e.number(key, Bound::ANY)).filter(|x| (0.0..=1.0).contains(x));
        let look = Look {
            rgba: item.numbers("rgba").unwrap_or([1.0; 4]),
            checker: item.text("texture").and_then(|texture| checkers.get(texture).copied()),
            metallic: part("metallic"),
            roughness: part("roughness"),
        };
        self.materials.insert(name.to_owned(), look);
    }
}

/// Returns the name of an asset that has none: that of its file.
pub(super) fn stem(file: &str) -> Option<String> {
    Some(Path::new(file).file_stem()?.to_string_lossy().into_owned())
}

/// Returns the file of a mesh: in the folder of meshes.
fn mesh_file(file: &str, reader: &Reader<'_>) -> MeshFrom {
    let given = Path::new(file);
    let name = if reader.compiler.strippath { Path::new(given.file_name().unwrap_or_default()) } else { given };
    let path = reader.compiler.mesh_folder.join(name);
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
    if !["stl", "obj", "ply", "dae", "msh"].contains(&extension.as_str()) {
        return MeshFrom::Missing(format!(
            "the format '{}' is not supported; supported are .stl, .obj, .msh, .ply and .dae",
            cleaned(&extension)
        ));
    }
    if !reader.files {
        return MeshFrom::Missing("meshes in files are left out of a text".into());
    }
    match path.is_file() {
        true if extension == "msh" => read_mesh_bytes(&path)
            .and_then(|bytes| mesh::read_msh(&bytes))
            .map_or_else(|why| MeshFrom::Missing(format!("{}: {why}", path.display())), MeshFrom::Inline),
        true => MeshFrom::File(path),
        false => MeshFrom::Missing(format!("there is no file {}", path.display())),
    }
}

/// Reads `vertex` and `face`.
fn inline(element: &Element<'_, '_>) -> MeshFrom {
    let vertices = element.list("vertex", MAX_NUMBERS, Bound::ANY).unwrap_or_default();
    let triangles = element.text("face").and_then(|_| element.list("face", MAX_NUMBERS, Bound::NOT_NEGATIVE));
    if !vertices.len().is_multiple_of(3) || vertices.len() < 12 {
        element.wrong("vertex", "three numbers for each of at least four vertices");
    }
    let count = vertices.len() / 3;
    let vertices: Vec<Vec3> = vertices.chunks_exact(3).map(Vec3::from_column_slice).collect();
    let triangles = triangles.unwrap_or_default();
    if !triangles.len().is_multiple_of(3) || triangles.iter().any(|k| *k >= count as f64 || k.fract() != 0.0) {
        element.wrong(
            "face",
            format_args!("three numbers of vertices, from 0 to {}, for each triangle", count.max(1) - 1),
        );
    }
    let triangles = triangles.chunks_exact(3).map(|t| [t[0] as u32, t[1] as u32, t[2] as u32]).collect();
    MeshFrom::Inline(mesh::with_triangles(TriMesh { vertices, triangles }))
}

/// Returns the solid under a height field. The rows of `heights` go from +y to −y, columns from −x
/// to +x; they are scaled to fill the heights from 0 to `size[2]`.
fn height_field(rows: usize, columns: usize, size: [f64; 4], heights: &[f64]) -> TriMesh {
    let low = heights.iter().copied().fold(f64::INFINITY, f64::min);
    let high = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let scale = if high > low { size[2] / (high - low) } else { 0.0 };
    let place = |row: usize, column: usize, z: f64| {
        let along = |k: usize, count: usize, half: f64| half * (2.0 * k as f64 / (count - 1) as f64 - 1.0);
        Vec3::new(along(column, columns, size[0]), along(row, rows, size[1]), z)
    };
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for row in 0..rows {
        for column in 0..columns {
            let height = scale * (heights[(rows - 1 - row) * columns + column] - low);
            vertices.push(place(row, column, height));
        }
    }
    let top = vertices.len() as u32;
    (0..rows).for_each(|row| vertices.extend((0..columns).map(|column| place(row, column, -size[3]))));
    let at = |row: usize, column: usize| (row * columns + column) as u32;
    let mut square = |a: u32, b: u32, c: u32, d: u32| triangles.extend([[a, b, c], [a, c, d]]);
    for row in 0..rows - 1 {
        for column in 0..columns - 1 {
            let [a, b, c, d] = [at(row, column), at(row, column + 1), at(row + 1, column + 1), at(row + 1, column)];
            square(a, b, c, d);
            square(top + d, top + c, top + b, top + a);
        }
    }
    for k in 0..columns - 1 {
        let (a, b) = (at(0, k), at(0, k + 1));
        square(top + a, top + b, b, a);
        let (a, b) = (at(rows - 1, k + 1), at(rows - 1, k));
        square(top + a, top + b, b, a);
    }
    for k in 0..rows - 1 {
        let (a, b) = (at(k + 1, 0), at(k, 0));
        square(top + a, top + b, b, a);
        let (a, b) = (at(k, columns - 1), at(k + 1, columns - 1));
        square(top + a, top + b, b, a);
    }
    TriMesh { vertices, triangles }
}

#[cfg(test)]
mod tests {
    use super::height_field;

    #[test]
    fn a_height_field_is_a_closed_solid_of_the_right_volume() {
        // A ramp from 0 to 3 over 2×2 m above a slab of 0.5 m.
        let mut mesh = height_field(2, 3, [1.0, 1.0, 3.0, 0.5], &[0.0, 1.0, 2.0, 0.0, 1.0, 2.0]);
        mesh.check_closed().unwrap();
        assert!((mesh.signed_volume() - (2.0 * 2.0 * 0.5 + 2.0 * 2.0 * 1.5)).abs() < 1e-12);
        // The first row of the file is the far one.
        let mesh = height_field(2, 2, [1.0, 1.0, 1.0, 0.1], &[1.0, 1.0, 0.0, 0.0]);
        assert_eq!(mesh.vertices[0].z, 0.0);
        assert_eq!((mesh.vertices[2].y, mesh.vertices[2].z), (1.0, 1.0));
    }
}
