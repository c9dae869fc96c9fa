//! `<link>`: mass, visuals, collision shapes.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

use nalgebra::SymmetricEigen;
use tumble_core::articulated::LinkMass;
use tumble_core::collide::{Mat3, Pose, Vec3};

use super::files::{Found, find};
use super::options::{CollisionMeshes, MissingMeshes, UrdfOptions};
use super::read::Content;
use crate::notes::NoteList;
use crate::parse::appearance::Color;
use crate::parse::bound::Bound;
use crate::parse::link::{Geometry, InertiaFault, LinkShape, inertia_fault};
use crate::parse::rotation;
use crate::parse::shape::ShapeSpec;
use crate::xml::{Element, check_names, shape_name};

/// Context shared by all links of a file.
pub(crate) struct Context<'c> {
    /// The folder of the file.
    pub(crate) folder: &'c Path,
    /// The file, for messages.
    pub(crate) file: &'c str,
    pub(crate) options: &'c UrdfOptions,
    pub(crate) content: Content,
    /// Colors of the materials at the top of the file.
    pub(crate) colors: BTreeMap<String, Color>,
    pub(crate) notes: NoteList,
}

/// A link as its element describes it.
pub(crate) struct LinkElement {
    pub(crate) name: String,
    pub(crate) span: Range<usize>,
    pub(crate) mass: LinkMass,
    pub(crate) shapes: Vec<LinkShape>,
}

/// Reads `<origin xyz rpy>`, if present.
pub(crate) fn read_origin(parent: &Element<'_, '_>) -> Pose {
    let Some(origin) = parent.child("origin") else { return Pose::identity() };
    let xyz = origin.numbers("xyz", Bound::ANY).unwrap_or_default();
    let rpy = origin.numbers("rpy", Bound::ANY).unwrap_or_default();
    rotation::pose(xyz, rotation::roll_pitch_yaw(rpy))
}

/// Reads `<color rgba>` of a material; alpha is not used.
pub(crate) fn read_color(material: &Element<'_, '_>) -> Option<Color> {
    let [r, g, b, _]: [f64; 4] = material.child("color")?.numbers("rgba", Bound::ANY)?;
    Some([r, g, b].map(|x| x.clamp(0.0, 1.0)))
}

impl LinkElement {
    pub(crate) fn read(link: &Element<'_, '_>, context: &mut Context<'_>) -> Option<LinkElement> {
        let name = link.required_text("name", "a unique name")?.to_owned();
        let mass = link.child("inertial").map_or_else(LinkMass::none, |inertial| read_inertial(&inertial, context));
        let shapes = if context.content != Content::Tree { read_shapes(link, context) } else { Vec::new() };
        Some(LinkElement { name, span: link.span(), mass, shapes })
    }
}

fn read_inertial(inertial: &Element<'_, '_>, context: &mut Context<'_>) -> LinkMass {
    let origin = read_origin(inertial);
    let mass = inertial.required("mass", "<mass value=\"…\"/>, kg");
    let mass = mass.map_or(0.0, |mass| mass.required_number("value", Bound::NOT_NEGATIVE));
    let inertia =
        inertial.required("inertia", "<inertia ixx iyy izz ixy ixz iyz/>, kg·m² about the center of mass").map(|i| {
            let of = |name| i.number(name, Bound::ANY);
            let diagonal = ["ixx", "iyy", "izz"].map(|name| i.required_number(name, Bound::ANY));
            let [xy, xz, yz] = ["ixy", "ixz", "iyz"].map(|name| of(name).unwrap_or(0.0));
            let [xx, yy, zz] = diagonal;
            (i, Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz))
        });
    let mut own = Mat3::zeros();
    if let Some((element, matrix)) = inertia
        && matrix.iter().all(|x| x.is_finite())
    {
        own = mended(&element, matrix, context);
    }
    LinkMass { mass, center: Vec3::zeros(), inertia: own }.seen_from(&origin)
}

/// Returns a valid inertia. Negative principal moments, which real files have, are set to 0, with a
/// note if they are more than rounding. A moment greater than the sum of the others only makes a
/// note, since it does no harm in the equations of motion.
pub(crate) fn mended(element: &Element<'_, '_>, inertia: Mat3, context: &mut Context<'_>) -> Mat3 {
    let eigen = SymmetricEigen::new(inertia);
    let negative = eigen.eigenvalues.min() < 0.0;
    if let Some(fault) = inertia_fault(&inertia) {
        let what = match fault {
            InertiaFault::Negative(_) => "negative principal moments are set to 0",
            InertiaFault::Triangle(_) => {
                "one principal moment is greater than the sum of the others, which no rigid body has; it is used unchanged"
            }
        };
        let line = element.log.line(element.span().start);
        context.notes.add(format!("{}:{line}: {}", context.file, element.what()), what);
    }
    if !negative {
        return inertia;
    }
    let axes = eigen.eigenvectors;
    let whole = axes * Mat3::from_diagonal(&eigen.eigenvalues.map(|x| x.max(0.0))) * axes.transpose();
    0.5 * (whole + whole.transpose())
}

fn read_shapes(link: &Element<'_, '_>, context: &mut Context<'_>) -> Vec<LinkShape> {
    check_names(link.children("collision"), "a link");
    let read = |tag: &'static str, context: &mut Context<'_>| -> (Vec<LinkShape>, usize) {
        let all: Vec<_> = link.children(tag).map(|element| read_shape(&element, tag == "collision", context)).collect();
        let dropped = all.iter().filter(|shape| shape.is_none()).count();
        (all.into_iter().flatten().collect(), dropped)
    };
    let (mut collisions, _) = read("collision", context);
    let (visuals, dropped) = read("visual", context);
    if visuals.is_empty() && dropped > 0 {
        collisions.iter_mut().for_each(|shape| shape.visible = true);
    }
    collisions.extend(visuals);
    collisions
}

/// Reads a `<visual>` or `<collision>`; `None` if it is left out or wrong.
pub(super) fn read_shape(element: &Element<'_, '_>, collidable: bool, context: &mut Context<'_>) -> Option<LinkShape> {
    let pose = read_origin(element);
    let geometry = element.required("geometry", "<geometry> with a box, cylinder, sphere, capsule or mesh")?;
    let geometry = read_geometry(&geometry, collidable, context)?;
    let mut surface = context.options.surface.clone();
    if !context.options.recolor
        && let Some(color) = material_color(element, context)
    {
        surface.appearance.color = color;
    }
    let name = shape_name(element).filter(|_| collidable);
    Some(LinkShape {
        pose,
        geometry,
        mass: None,
        surface,
        collidable,
        visible: !collidable,
        name,
        one_way: None,
        sensor: false,
    })
}

fn material_color(element: &Element<'_, '_>, context: &Context<'_>) -> Option<Color> {
    let material = element.child("material")?;
    read_color(&material).or_else(|| context.colors.get(material.text("name")?).copied())
}

fn read_geometry(geometry: &Element<'_, '_>, collidable: bool, context: &mut Context<'_>) -> Option<Geometry> {
    let expected = "expected <box>, <cylinder>, <sphere>, <capsule> or <mesh>";
    let Some(form) = geometry.first() else {
        geometry.problem("is empty", expected);
        return None;
    };
    let length = |name: &str| form.required_number(name, Bound::POSITIVE);
    Some(Geometry::Shape(match form.tag() {
        "box" => {
            form.required_text("size", "three lengths, m")?;
            ShapeSpec::Box { size_m: form.numbers("size", Bound::POSITIVE)? }
        }
        "cylinder" => ShapeSpec::Cylinder { radius_m: length("radius"), length_m: length("length") },
        "sphere" => ShapeSpec::Sphere { radius_m: length("radius") },
        "capsule" => ShapeSpec::Capsule { radius_m: length("radius"), length_m: length("length") },
        "mesh" => return read_mesh(&form, collidable, context),
        other => {
            form.problem(format_args!("(<{other}>) is not a shape"), expected);
            return None;
        }
    }))
}

fn read_mesh(mesh: &Element<'_, '_>, collidable: bool, context: &mut Context<'_>) -> Option<Geometry> {
    let uri = mesh.required_text("filename", "the path of an .stl, .obj, .ply or .dae file")?;
    let scale: [f64; 3] = mesh.numbers("scale", Bound::ANY).unwrap_or([1.0; 3]);
    if scale.contains(&0.0) {
        mesh.wrong("scale", "three numbers other than 0");
        return None;
    }
    mesh_file(mesh, (uri, scale), collidable, context)
}

/// Returns the geometry of a mesh file that an element names, scaled; `None` if it is left out, with a note or a problem.
pub(crate) fn mesh_file(
    mesh: &Element<'_, '_>,
    (uri, scale): (&str, [f64; 3]),
    collidable: bool,
    context: &mut Context<'_>,
) -> Option<Geometry> {
    let place = format!("{}:{}", context.file, mesh.log.line(mesh.span().start));
    let hull = context.options.collision_meshes == CollisionMeshes::Hull;
    let required = context.options.missing_meshes == MissingMeshes::Error;
    let why = match find(uri, context.folder, context.options) {
        Found::Here(path) => return Some(Geometry::File { path, scale, place, hull, required }),
        Found::Missing(path) if collidable && required => format!("there is no file {path}"),
        Found::Missing(_) => "there is no such file".into(),
        Found::Format(format) => {
            format!("the format '{format}' is not supported; supported are .stl, .obj, .ply and .dae")
        }
    };
    if collidable && required {
        let expected = "expected an existing mesh; `packages` (--package NAME=DIR) sets folders of packages, missing_meshes = \"skip\" (--missing-meshes skip) leaves the mesh out";
        mesh.problem(format_args!("\"{uri}\" cannot be used for collision: {why}"), expected);
    } else {
        let kind = if collidable { "collision" } else { "visual" };
        context.notes.add(format!("{place}: {kind} mesh {uri}"), format!("left out: {why}"));
    }
    None
}
