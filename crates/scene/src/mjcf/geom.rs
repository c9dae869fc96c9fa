//! `<geom>`: its shape, pose, mass and surface.

use std::f64::consts::PI;

use nalgebra::Translation3;
use tumble_core::articulated::LinkMass;
use tumble_core::collide::{Mat3, Pose, Shape, ShapeError, Vec3};

use super::Reader;
use super::asset::Look;
use super::compiler::turn_z_to;
use super::defaults::Item;
use super::schema;
use crate::parse::appearance::{AppearanceSpec, Pattern};
use crate::parse::bound::Bound;
use crate::xml::Element;

/// Density of a geom without its own, kg/m³.
const DENSITY: f64 = 1000.0;
/// Sliding, torsional (m) and rolling friction (m) of a geom without its own.
const FRICTION: [f64; 3] = [1.0, 0.005, 0.0001];
/// Geoms of this group and above are not drawn, as in MuJoCo's viewer.
const HIDDEN_GROUP: i64 = 3;

/// The shape of a geom. Lengths in meters; half sizes, as in MuJoCo.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Form {
    Plane,
    Sphere(f64),
    Capsule(f64, f64),
    Cylinder(f64, f64),
    Box([f64; 3]),
    Ellipsoid([f64; 3]),
    Mesh(String),
    Field(String),
}

/// A geom of a body.
pub(super) struct Geom<'a> {
    pub(super) name: Option<String>,
    pub(super) element: Element<'a, 'a>,
    /// In the frame of its body.
    pub(super) pose: Pose,
    pub(super) form: Form,
    pub(super) mass: Option<f64>,
    pub(super) density: f64,
    pub(super) group: i64,
    /// `contype` and `conaffinity`.
    pub(super) bits: [u32; 2],
    /// Sliding, torsional (m) and rolling friction (m).
    pub(super) friction: [f64; 3],
    /// `condim`: of the contact forces that it has.
    pub(super) dimensions: f64,
    pub(super) appearance: AppearanceSpec,
    pub(super) visible: bool,
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Plane,
    Sphere,
    Capsule,
    Cylinder,
    Box,
    Ellipsoid,
    Mesh,
    Field,
    Other,
}

const KINDS: &[(&str, Kind)] = &[
    ("plane", Kind::Plane),
    ("sphere", Kind::Sphere),
    ("capsule", Kind::Capsule),
    ("ellipsoid", Kind::Ellipsoid),
    ("cylinder", Kind::Cylinder),
    ("box", Kind::Box),
    ("mesh", Kind::Mesh),
    ("hfield", Kind::Field),
    ("sdf", Kind::Other),
];

/// Returns the pose of an item, and half the length of its `fromto`.
pub(super) fn placed(item: &Item<'_>, reader: &Reader<'_>) -> (Pose, Option<f64>) {
    let Some([a, b, c, x, y, z]) = item.numbers::<6>("fromto") else { return (reader.compiler.pose(item), None) };
    let (from, to) = (Vec3::new(a, b, c), Vec3::new(x, y, z));
    let along = from - to;
    let Some(direction) = along.try_normalize(1e-10) else {
        if let Some(element) = item.at("fromto") {
            element.wrong("fromto", "two points that differ: six numbers");
        }
        return (Pose::identity(), Some(1.0));
    };
    let middle = Translation3::from(0.5 * (from + to));
    (Pose::from_parts(middle, turn_z_to(&direction)), Some(0.5 * along.norm()))
}

impl<'a> Geom<'a> {
    /// Reads a geom; `None` if it is wrong or left out.
    pub(super) fn read(element: Element<'a, 'a>, class: usize, frame: &Pose, reader: &Reader<'a>) -> Option<Geom<'a>> {
        schema::GEOM.check(&element, &reader.notes);
        let item = reader.classes.item(element, class);
        let kind = item.word("type", KINDS).unwrap_or(Kind::Sphere);
        let (pose, half_length) = placed(&item, reader);
        let form = read_form(&item, kind, half_length, reader)?;
        let count = |name: &str, default: f64| item.number(name, Bound::ANY, default);
        let bits = ["contype", "conaffinity"].map(|name| {
            let bound = Bound::new(-2147483648.0, 4294967295.0, "a whole number of 32 bits");
            item.number(name, bound, 1.0) as i64 as u32
        });
        let look = read_look(&item, reader);
        let group = count("group", 0.0) as i64;
        let given = item.list("friction", 3).unwrap_or_default();
        let friction = |k: usize| given.get(k).copied().unwrap_or(FRICTION[k]).clamp(0.0, 100.0);
        let plane = form == Form::Plane;
        Some(Geom {
            name: item.name(),
            element,
            pose: frame * pose,
            form,
            mass: item.at("mass").and_then(|e| e.number("mass", Bound::NOT_NEGATIVE)),
            density: item.number("density", Bound::NOT_NEGATIVE, DENSITY),
            group,
            bits: if reader.contacts { bits } else { [0; 2] },
            friction: [0, 1, 2].map(friction),
            dimensions: count("condim", 3.0),
            appearance: appearance(&look, plane),
            visible: group < HIDDEN_GROUP && look.rgba[3] > 0.0,
        })
    }

    /// Returns whether the geom collides with anything.
    pub(super) fn collides(&self) -> bool {
        self.bits != [0; 2]
    }

    /// Returns whether the file gives it a mass or a density other than 0.
    pub(super) fn is_heavy(&self) -> bool {
        self.mass.unwrap_or(self.density) != 0.0
    }

    /// Returns the mass of the geom in the frame of its body; none for planes and height fields.
    ///
    /// # Errors
    /// The shape or its mesh is invalid.
    pub(super) fn link_mass(&self, reader: &Reader<'_>) -> Result<LinkMass, String> {
        let wrong = |e: ShapeError| e.to_string();
        let unit = match &self.form {
            Form::Plane | Form::Field(_) => return Ok(LinkMass::none()),
            Form::Ellipsoid(radii) => ellipsoid(*radii),
            Form::Mesh(name) => reader.mesh_mass(name)?,
            Form::Sphere(r) => of_shape(Shape::sphere(*r).map_err(wrong)?)?,
            Form::Capsule(r, half) => of_shape(Shape::capsule(*r, 2.0 * half).map_err(wrong)?)?,
            Form::Cylinder(r, half) => of_shape(Shape::cylinder(*r, 2.0 * half).map_err(wrong)?)?,
            Form::Box(half) => of_shape(Shape::cuboid(2.0 * Vec3::from(*half)).map_err(wrong)?)?,
        };
        let factor = self.mass.map_or(self.density, |mass| mass / unit.mass);
        if !factor.is_finite() {
            return Err("its volume is 0, so it has no mass".into());
        }
        let scaled = LinkMass { mass: unit.mass * factor, inertia: unit.inertia * factor, ..unit };
        Ok(scaled.seen_from(&self.pose))
    }
}

fn of_shape(shape: Shape) -> Result<LinkMass, String> {
    let own = shape.mass_properties(1.0).map_err(|e| e.to_string())?;
    Ok(LinkMass { mass: own.mass, center: own.center_of_mass, inertia: own.inertia })
}

/// Returns the mass of an ellipsoid of density 1: `V = 4πabc/3`, `I = m/5·(b² + c²)` and so on.
fn ellipsoid([a, b, c]: [f64; 3]) -> LinkMass {
    let mass = 4.0 / 3.0 * PI * a * b * c;
    let moments = Vec3::new(b * b + c * c, a * a + c * c, a * a + b * b) * (mass / 5.0);
    LinkMass { mass, center: Vec3::zeros(), inertia: Mat3::from_diagonal(&moments) }
}

fn read_form<'a>(item: &Item<'a>, kind: Kind, half_length: Option<f64>, reader: &Reader<'a>) -> Option<Form> {
    let element = item.own();
    if let (Some(_), Kind::Plane | Kind::Sphere | Kind::Mesh | Kind::Field | Kind::Other) = (half_length, kind) {
        element.problem("has `fromto`", "expected it for a capsule, cylinder, box or ellipsoid alone");
    }
    if item.text("mesh").is_some() && kind != Kind::Mesh {
        reader.notes.add(element, "a primitive that is fitted to a mesh is left out: the mesh itself is used");
        return read_mesh(item, reader);
    }
    // With `fromto`, the length is between its points, and the other sizes come first.
    let needed = match (kind, half_length.is_some()) {
        (Kind::Sphere, _) | (Kind::Capsule | Kind::Cylinder | Kind::Box | Kind::Ellipsoid, true) => 1,
        (Kind::Capsule | Kind::Cylinder, false) => 2,
        (Kind::Box | Kind::Ellipsoid, false) => 3,
        _ => 0,
    };
    let size = if needed > 0 { read_size(item, needed)? } else { [1.0; 3] };
    let length = half_length.unwrap_or(size[1]);
    let sizes = half_length.map_or(size, |half| [size[0], size[0], half]);
    Some(match kind {
        Kind::Plane => Form::Plane,
        Kind::Sphere => Form::Sphere(size[0]),
        Kind::Capsule => Form::Capsule(size[0], length),
        Kind::Cylinder => Form::Cylinder(size[0], length),
        Kind::Box => Form::Box(sizes),
        Kind::Ellipsoid if sizes[0] == sizes[1] && sizes[1] == sizes[2] => Form::Sphere(sizes[0]),
        Kind::Ellipsoid => Form::Ellipsoid(sizes),
        Kind::Mesh => return read_mesh(item, reader),
        Kind::Field => return read_field(item, reader),
        Kind::Other => {
            reader.notes.add(element, "geoms of type sdf are left out");
            return None;
        }
    })
}

fn read_size(item: &Item<'_>, needed: usize) -> Option<[f64; 3]> {
    let expected = format!("{needed} positive number{}, half sizes in meters", if needed == 1 { "" } else { "s" });
    let Some(element) = item.at("size") else {
        item.own().problem("has no `size`", format!("expected {expected}"));
        return None;
    };
    let size = element.list("size", 3, Bound::ANY)?;
    if size.len() < needed || size[..needed].iter().any(|x| !Bound::POSITIVE.holds(*x)) {
        element.wrong("size", expected);
        return None;
    }
    Some(std::array::from_fn(|k| size.get(k).copied().unwrap_or(0.0)))
}

fn read_mesh<'a>(item: &Item<'a>, reader: &Reader<'a>) -> Option<Form> {
    let element = item.at("mesh").unwrap_or(item.own());
    let name = element.required_text("mesh", "the name of a mesh of <asset>")?;
    if !reader.assets.meshes.contains_key(name) {
        let near = crate::parse::suggest::nearest(name, reader.assets.meshes.keys().map(String::as_str));
        element.wrong("mesh", near.map_or("the name of a mesh of <asset>".to_owned(), |n| format!("\"{n}\"")));
        return None;
    }
    Some(Form::Mesh(name.to_owned()))
}

fn read_field<'a>(item: &Item<'a>, reader: &Reader<'a>) -> Option<Form> {
    let element = item.at("hfield").unwrap_or(item.own());
    let name = element.required_text("hfield", "the name of a height field of <asset>")?;
    if !reader.assets.fields.contains_key(name) {
        match reader.skipped_fields.contains(name) {
            true => reader.notes.add(element, "the geom is left out with its height field"),
            false => element.wrong("hfield", "the name of a height field of <asset>"),
        }
        return None;
    }
    Some(Form::Field(name.to_owned()))
}

fn read_look<'a>(item: &Item<'a>, reader: &Reader<'a>) -> Look {
    let plain = Look { rgba: [0.5, 0.5, 0.5, 1.0], checker: None, metallic: None, roughness: None };
    let named = item.at("material").and_then(|element| {
        let name = element.text("material")?;
        let found = reader.assets.materials.get(name).cloned();
        if found.is_none() {
            element.wrong("material", "the name of a material of <asset>");
        }
        found
    });
    let look = named.unwrap_or(plain);
    match item.numbers("rgba") {
        Some(rgba) => Look { rgba, ..look },
        None => look,
    }
}

fn appearance(look: &Look, plane: bool) -> AppearanceSpec {
    let base = AppearanceSpec::default();
    let tint = [look.rgba[0], look.rgba[1], look.rgba[2]].map(|x| x.clamp(0.0, 1.0));
    let tinted = |color: [f64; 3]| std::array::from_fn(|k| color[k] * tint[k]);
    AppearanceSpec {
        color: look.checker.map_or(tint, |[first, _]| tinted(first)),
        second_color: look.checker.map_or(base.second_color, |[_, second]| tinted(second)),
        pattern: if look.checker.is_some() { Pattern::Checker } else { Pattern::Plain },
        pattern_scale_m: if plane { 1.0 } else { base.pattern_scale_m },
        metallic: look.metallic.unwrap_or(base.metallic),
        roughness: look.roughness.unwrap_or(base.roughness),
        ..base
    }
}
