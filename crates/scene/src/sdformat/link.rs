//! `<link>`: mass, collision shapes and visuals.

use nalgebra::Isometry3;
use tumble_core::articulated::LinkMass;
use tumble_core::collide::{Mat3, Pose, Vec3};

use super::frames::Frames;
use super::value::{length, note, note_others, number, numbers};
use crate::parse::body::MassSpec;
use crate::parse::bound::Bound;
use crate::parse::link::{Geometry, LinkMassSpec, LinkShape, Surface};
use crate::parse::shape::ShapeSpec;
use crate::urdf::link::{Context, mended, mesh_file};
use crate::xml::{Element, check_names, shape_name};

/// Density of a link whose inertia is to be computed from its shapes, kg/m³.
const DENSITY: f64 = 1000.0;

/// A link as its element describes it.
pub(super) struct LinkElement<'a, 'd> {
    pub(super) name: String,
    pub(super) element: Element<'a, 'd>,
    /// In the model.
    pub(super) pose: Pose,
    /// In the axes of the link.
    pub(super) mass: LinkMassSpec,
    pub(super) shapes: Vec<LinkShape>,
    /// Planes that collide, which only static models have, with their elements.
    pub(super) planes: Vec<(Element<'a, 'd>, LinkShape)>,
}

impl<'a, 'd> LinkElement<'a, 'd> {
    pub(super) fn read(
        element: Element<'a, 'd>,
        frames: &mut Frames<'a, 'd>,
        context: &mut Context<'_>,
    ) -> Option<LinkElement<'a, 'd>> {
        let name = element.text("name")?.to_owned();
        note_others(&element, &["pose", "inertial", "collision", "visual"], &mut context.notes);
        let pose = frames.pose(&name)?;
        let mass = read_inertial(&element, &name, frames, context);
        let mut link = LinkElement { name, element, pose, mass, shapes: Vec::new(), planes: Vec::new() };
        check_names(element.children("collision"), "a link");
        for (tag, collidable) in [("collision", true), ("visual", false)] {
            for part in element.children(tag) {
                link.read_shape(part, collidable, frames, context);
            }
        }
        if !link.shapes.iter().any(|shape| shape.visible) {
            link.shapes.iter_mut().for_each(|shape| shape.visible = true);
        }
        Some(link)
    }

    fn read_shape(
        &mut self,
        part: Element<'a, 'd>,
        collidable: bool,
        frames: &mut Frames<'a, 'd>,
        context: &mut Context<'_>,
    ) {
        let read: &[&str] =
            if collidable { &["pose", "geometry", "surface"] } else { &["pose", "geometry", "material"] };
        note_others(&part, read, &mut context.notes);
        let mut pose = frames.pose_in(&part, &self.name);
        let Some(geometry) = part.required("geometry", "<geometry> with one shape") else { return };
        let Some((geometry, turned)) = read_geometry(&geometry, collidable, context) else { return };
        pose *= turned;
        let surface = read_surface(&part, context);
        let name = shape_name(&part).filter(|_| collidable);
        let visible = !collidable;
        let (one_way, sensor) = (None, false);
        let shape = LinkShape { pose, geometry, mass: None, surface, collidable, visible, name, one_way, sensor };
        if shape.geometry == Geometry::Shape(ShapeSpec::HalfSpace) {
            self.planes.push((part, shape));
        } else {
            self.shapes.push(shape);
        }
    }
}

/// Reads `<inertial>`. The format gives a link without one 1 kg and a moment of 1 kg·m² about each axis.
fn read_inertial<'a, 'd>(
    link: &Element<'a, 'd>,
    name: &str,
    frames: &mut Frames<'a, 'd>,
    context: &mut Context<'_>,
) -> LinkMassSpec {
    let unit = LinkMass { mass: 1.0, center: Vec3::zeros(), inertia: Mat3::identity() };
    let Some(inertial) = link.child("inertial") else {
        note(
            link,
            "without <inertial> it has 1 kg and 1 kg·m² about each axis, as the format says",
            &mut context.notes,
        );
        return LinkMassSpec::Given(unit);
    };
    note_others(&inertial, &["pose", "mass", "inertia", "density"], &mut context.notes);
    if matches!(inertial.text("auto"), Some("true" | "1")) {
        if inertial.child("mass").is_some() {
            return LinkMassSpec::Spread(MassSpec::Mass(number(&inertial, "mass", Bound::POSITIVE, 1.0)));
        }
        let density = number(&inertial, "density", Bound::POSITIVE, DENSITY);
        return LinkMassSpec::Spread(MassSpec::Density(density));
    }
    let mass = number(&inertial, "mass", Bound::NOT_NEGATIVE, 1.0);
    let pose = frames.pose_in(&inertial, name);
    let own = inertial.child("inertia").map_or(Mat3::identity(), |inertia| {
        note_others(&inertia, &["ixx", "iyy", "izz", "ixy", "ixz", "iyz"], &mut context.notes);
        let of = |tag, default| number(&inertia, tag, Bound::ANY, default);
        let [xx, yy, zz] = ["ixx", "iyy", "izz"].map(|tag| of(tag, 1.0));
        let [xy, xz, yz] = ["ixy", "ixz", "iyz"].map(|tag| of(tag, 0.0));
        mended(&inertia, Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz), context)
    });
    LinkMassSpec::Given(LinkMass { mass, center: Vec3::zeros(), inertia: own }.seen_from(&pose))
}

/// Reads the shape of `<geometry>`, and its pose in the frame of the element. `None` if it is left out or wrong.
fn read_geometry(geometry: &Element<'_, '_>, collidable: bool, context: &mut Context<'_>) -> Option<(Geometry, Pose)> {
    let expected = "expected <box>, <sphere>, <cylinder>, <capsule>, <cone>, <ellipsoid>, <plane> or <mesh>";
    let Some(form) = geometry.first() else {
        geometry.problem("is empty", expected);
        return None;
    };
    let three = |tag: &'static str, meaning: &str| {
        let child = form.required(tag, &format!("<{tag}>{meaning}</{tag}>"))?;
        numbers::<3>(&child, Bound::POSITIVE)
    };
    let shape = match form.tag() {
        "box" => ShapeSpec::Box { size_m: three("size", "x y z")? },
        "sphere" => ShapeSpec::Sphere { radius_m: length(&form, "radius") },
        "cylinder" => ShapeSpec::Cylinder { radius_m: length(&form, "radius"), length_m: length(&form, "length") },
        "capsule" => ShapeSpec::Capsule { radius_m: length(&form, "radius"), length_m: length(&form, "length") },
        "ellipsoid" => ShapeSpec::Ellipsoid { size_m: three("radii", "x y z")?.map(|r| 2.0 * r) },
        "plane" if !collidable => {
            note(&form, "planes that are only drawn are left out", &mut context.notes);
            return None;
        }
        "plane" => {
            let normal = form.child("normal").and_then(|normal| numbers::<3>(&normal, Bound::ANY));
            let normal = Vec3::from(normal.unwrap_or([0.0, 0.0, 1.0])).try_normalize(1e-9).unwrap_or_else(Vec3::z);
            let turn = crate::mjcf::turn_z_to(&normal);
            return Some((Geometry::Shape(ShapeSpec::HalfSpace), Isometry3::from_parts(nalgebra::one(), turn)));
        }
        "mesh" => {
            let uri = form.required("uri", "<uri>PATH</uri> of an .stl, .obj, .ply or .dae file")?;
            let scale = form.child("scale").map_or(Some([1.0; 3]), |scale| numbers::<3>(&scale, Bound::ANY))?;
            if scale.contains(&0.0) {
                form.problem("has a scale of 0", "expected three numbers other than 0");
                return None;
            }
            note_others(&form, &["uri", "scale"], &mut context.notes);
            let geometry = mesh_file(&form, (super::value::text(&uri), scale), collidable, context)?;
            return Some((geometry, Pose::identity()));
        }
        "cone" => {
            let (radius_m, height_m) = (length(&form, "radius"), length(&form, "length"));
            // its origin is halfway up, that of a shape its center of mass
            let down = Isometry3::translation(0.0, 0.0, -0.25 * height_m);
            return Some((Geometry::Shape(ShapeSpec::Cone { radius_m, height_m }), down));
        }
        tag @ ("empty" | "heightmap" | "image" | "polyline") => {
            note(&form, format!("<{tag}> shapes are left out"), &mut context.notes);
            return None;
        }
        tag => {
            form.problem(format_args!("(<{}>) is not a shape", tag.chars().take(48).collect::<String>()), expected);
            return None;
        }
    };
    Some((Geometry::Shape(shape), Pose::identity()))
}

/// Friction of a collision without `mu`, as the specification says.
const DEFAULT_MU: f64 = 1.0;

/// Reads friction and restitution of `<surface>`, and the color of `<material>`.
fn read_surface(part: &Element<'_, '_>, context: &mut Context<'_>) -> Surface {
    let mut surface = context.options.surface.clone();
    if part.tag() == "collision" && !context.options.friction_given {
        surface.contact.friction = DEFAULT_MU;
    }
    if let Some(given) = part.child("surface") {
        note_others(&given, &["friction", "bounce"], &mut context.notes);
        if let Some(bounce) = given.child("bounce") {
            note_others(&bounce, &["restitution_coefficient"], &mut context.notes);
            let own = surface.contact.restitution;
            surface.contact.restitution = number(&bounce, "restitution_coefficient", Bound::UNIT, own);
        }
        if let Some(friction) = given.child("friction") {
            note_others(&friction, &["ode"], &mut context.notes);
            if let Some(ode) = friction.child("ode") {
                note_others(&ode, &["mu", "mu2"], &mut context.notes);
                let mu = number(&ode, "mu", Bound::NOT_NEGATIVE, surface.contact.friction);
                if let Some(second) = ode.child("mu2").filter(|_| number(&ode, "mu2", Bound::NOT_NEGATIVE, mu) != mu) {
                    note(&second, "friction in a second direction is that of the first", &mut context.notes);
                }
                surface.contact.friction = mu;
            }
        }
    }
    if let Some(material) = part.child("material").filter(|_| !context.options.recolor) {
        note_others(&material, &["ambient", "diffuse", "specular", "emissive", "lighting"], &mut context.notes);
        let color = material.child("diffuse").or(material.child("ambient"));
        let color = color.filter(|color| !super::value::text(color).is_empty());
        if let Some(rgb) = color.and_then(|color| super::value::color(&color)) {
            surface.appearance.color = rgb;
        }
    }
    surface
}
