//! Shapes as inline tables; the meshes that they name become tables and files.

use std::collections::BTreeMap;
use std::sync::Arc;

use tumble_core::collide::{Shape, TriMesh, Vec3};

use super::text::{Table, Toml};

/// A file that is written beside the scene: its name in the folder of files, and its content.
pub(super) type BesideFile = (String, Vec<u8>);

/// The meshes of a scene, each written once.
pub(super) struct Meshes {
    /// Name of the folder beside the scene.
    folder: String,
    names: BTreeMap<usize, String>,
    /// The tables `[meshes.NAME]`.
    pub(super) tables: String,
    /// The files that they name.
    pub(super) files: Vec<BesideFile>,
}

impl Meshes {
    pub(super) fn new(folder: &str) -> Meshes {
        Meshes { folder: folder.into(), names: BTreeMap::new(), tables: String::new(), files: Vec::new() }
    }

    /// Returns a shape as a table.
    pub(super) fn shape(&mut self, shape: &Shape) -> Table {
        self.shape_of_parts(shape, &|_| Table::default())
    }

    /// Returns a shape as a table, with more keys for each part of a compound. Every kind is written, so a new one
    /// is an error here.
    pub(super) fn shape_of_parts(&mut self, shape: &Shape, of_part: &dyn Fn(usize) -> Table) -> Table {
        match shape {
            Shape::HalfSpace => Table::of("type", "half_space"),
            Shape::Sphere { radius } => {
                let mut t = Table::of("type", "sphere");
                t.put("radius_m", *radius);
                t
            }
            Shape::Box { half_extents } => {
                let mut t = Table::of("type", "box");
                t.put("size_m", 2.0 * half_extents);
                t
            }
            Shape::Capsule { radius, half_length } => round("capsule", *radius, *half_length),
            Shape::Cylinder(cylinder) => round("cylinder", cylinder.radius(), cylinder.half_length()),
            Shape::Ellipsoid { half_axes } => {
                let mut t = Table::of("type", "ellipsoid");
                t.put("size_m", 2.0 * half_axes);
                t
            }
            Shape::Cone { radius, height } => {
                let mut t = Table::of("type", "cone");
                t.put("radius_m", *radius);
                t.put("height_m", *height);
                t
            }
            Shape::RoundedBox { half_extents, rounding } => {
                let mut t = Table::of("type", "box");
                t.put("size_m", 2.0 * half_extents);
                t.put("rounding_m", *rounding);
                t
            }
            Shape::RoundedCylinder { core, rounding } => {
                let mut t = round("cylinder", core.radius() + rounding, core.half_length() + rounding);
                t.put("rounding_m", *rounding);
                t
            }
            Shape::Mesh(mesh) => {
                let name =
                    self.named(Arc::as_ptr(mesh).addr(), || mesh.mesh().clone().translated(&mesh.center_of_mass()));
                let mut t = Table::of("type", "mesh");
                t.put("mesh", name);
                t
            }
            Shape::Compound(compound) => {
                let parts = compound.parts().iter().enumerate().map(|(n, part)| {
                    let mut t = self.shape(&part.shape);
                    t.put_pose(&part.pose);
                    part.density.iter().for_each(|density| t.put("density_kg_per_m3", *density));
                    t.extend(of_part(n));
                    t
                });
                let parts: Vec<Table> = parts.collect();
                let mut t = Table::of("type", "compound");
                t.put("parts", parts);
                t
            }
        }
    }

    /// Returns a mesh that is only drawn as a table.
    pub(super) fn visual(&mut self, address: usize, mesh: &TriMesh) -> Table {
        let name = match self.names.get(&address) {
            Some(name) => name.clone(),
            None => self.file(address, mesh),
        };
        let mut t = Table::of("type", "visual_mesh");
        t.put("file", format!("{}/{name}.obj", self.folder));
        t
    }

    /// Returns the name of a closed mesh.
    fn named(&mut self, address: usize, mesh: impl FnOnce() -> TriMesh) -> String {
        if let Some(name) = self.names.get(&address) {
            return name.clone();
        }
        let name = self.file(address, &mesh());
        let mut t = Table::of("type", "file");
        t.put("file", format!("{}/{name}.obj", self.folder));
        self.tables += &t.under(&format!("[meshes.{name}]"));
        name
    }

    /// Adds a file and returns its name without the extension.
    fn file(&mut self, address: usize, mesh: &TriMesh) -> String {
        let name = format!("mesh_{}", self.names.len() + 1);
        self.names.insert(address, name.clone());
        self.files.push((format!("{name}.obj"), obj(mesh)));
        name
    }
}

fn round(kind: &str, radius: f64, half_length: f64) -> Table {
    let mut t = Table::of("type", kind);
    t.put("radius_m", radius);
    t.put("length_m", 2.0 * half_length);
    t
}

/// Returns a mesh as OBJ; numbers read back to the same bits.
pub(crate) fn obj(mesh: &TriMesh) -> Vec<u8> {
    let number = |x: &f64| x.toml();
    let vertex = |v: &Vec3| format!("v {} {} {}\n", number(&v.x), number(&v.y), number(&v.z));
    let face = |t: &[u32; 3]| format!("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
    let lines: String = mesh.vertices.iter().map(vertex).chain(mesh.triangles.iter().map(face)).collect();
    lines.into_bytes()
}

/// Returns whether two shapes are the same one: shared, or primitives of the same size.
pub(crate) fn is_same(a: &Shape, b: &Shape) -> bool {
    match (a, b) {
        (Shape::Mesh(a), Shape::Mesh(b)) => Arc::ptr_eq(a, b),
        (Shape::Compound(a), Shape::Compound(b)) => Arc::ptr_eq(a, b),
        (Shape::Cylinder(a), Shape::Cylinder(b)) => (a.radius(), a.half_length()) == (b.radius(), b.half_length()),
        (Shape::HalfSpace, Shape::HalfSpace) => true,
        (Shape::Sphere { radius: a }, Shape::Sphere { radius: b }) => a == b,
        (Shape::Box { half_extents: a }, Shape::Box { half_extents: b }) => a == b,
        (Shape::Capsule { radius, half_length }, Shape::Capsule { radius: r, half_length: h }) => {
            (radius, half_length) == (r, h)
        }
        (Shape::Ellipsoid { half_axes: a }, Shape::Ellipsoid { half_axes: b }) => a == b,
        (Shape::Cone { radius, height }, Shape::Cone { radius: r, height: h }) => (radius, height) == (r, h),
        (Shape::RoundedBox { half_extents, rounding }, Shape::RoundedBox { half_extents: h, rounding: r }) => {
            (half_extents, rounding) == (h, r)
        }
        (Shape::RoundedCylinder { core: a, rounding }, Shape::RoundedCylinder { core: b, rounding: r }) => {
            (a.radius(), a.half_length(), rounding) == (b.radius(), b.half_length(), r)
        }
        _ => false,
    }
}
