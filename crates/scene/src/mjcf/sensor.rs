//! `<sensor>`: measuring sensors.
//!
//! | MJCF | here |
//! |---|---|
//! | `accelerometer`, `gyro`, `velocimeter`, `force`, `torque`, `rangefinder` | the sensor at the site |
//! | `touch` | with the volume of the site |
//! | `framepos`, `framequat`, `framelinvel`, `frameangvel`, `frameangacc` | of sites and of `xbody`, with a reference |
//! | `jointpos`, `jointvel`, `jointactuatorfrc` | of hinges and slides |

use tumble_core::collide::Pose;
use tumble_core::{SensorKind, SensorNoise};

use super::equality::single;
use super::names::find;
use super::scene::{Assembly, Place};
use super::schema;
use super::source::XmlNode;
use crate::parse::loop_joint::PartSpec;
use crate::parse::sensor::{SensorPlaceSpec, SensorSpec};
use crate::parse::shape::ShapeSpec;
use crate::xml::Element;

const KINDS: [(&str, SensorKind); 15] = [
    ("accelerometer", SensorKind::Accelerometer),
    ("gyro", SensorKind::Gyroscope),
    ("velocimeter", SensorKind::Velocimeter),
    ("force", SensorKind::Force),
    ("torque", SensorKind::Torque),
    ("touch", SensorKind::Touch),
    ("rangefinder", SensorKind::RangeFinder),
    ("framepos", SensorKind::Position),
    ("framequat", SensorKind::Orientation),
    ("framelinvel", SensorKind::LinearVelocity),
    ("frameangvel", SensorKind::AngularVelocity),
    ("frameangacc", SensorKind::AngularAcceleration),
    ("jointpos", SensorKind::JointPosition),
    ("jointvel", SensorKind::JointVelocity),
    ("jointactuatorfrc", SensorKind::DriveForce),
];

/// Reads all sensors.
pub(super) fn read<'a>(root: &XmlNode<'a>, assembly: &mut Assembly<'_, 'a>) {
    for XmlNode { element, .. } in root.all("sensor").flat_map(|section| &section.children) {
        let notes = &assembly.reader.notes;
        let tag = super::defaults::cleaned(element.tag());
        match KINDS.iter().find(|(word, _)| *word == element.tag()) {
            None => notes.add(element, format!("sensors of type <{tag}> are left out")),
            Some((_, kind)) => {
                schema::SENSOR.check(element, notes);
                if let Some(spec) = one(element, *kind, assembly) {
                    let name = assembly.taken.unique(spec.name.clone());
                    assembly.scene.sensors.push(SensorSpec { name, ..spec });
                }
            }
        }
    }
}

fn one(element: &Element<'_, '_>, kind: SensorKind, assembly: &Assembly<'_, '_>) -> Option<SensorSpec> {
    let mut volume = None;
    let (on, site) = if kind.reads_dof() {
        let joint = single(element, "joint", assembly, false)?;
        (SensorPlaceSpec::Part(PartSpec::Link(joint.tree, joint.link)), Pose::identity())
    } else if element.text("objtype").is_some() || kind.has_reference() || kind == SensorKind::AngularAcceleration {
        let (part, pose) = frame(element, ["objtype", "objname"], assembly)?;
        (part.map_or(SensorPlaceSpec::World, SensorPlaceSpec::Part), pose)
    } else {
        let (body, k) = find(element, "site", &assembly.names.sites, false)?;
        volume = assembly.bodies[body].sites[k].volume.clone().filter(|_| kind == SensorKind::Touch);
        if kind.reads_joint() && (assembly.bodies[body].joints.is_empty() || !on_link(assembly, body)) {
            let why = "force and torque sensors on bodies without a joint are left out: fixed bodies are one link with their parents";
            assembly.reader.notes.add(element, why);
            return None;
        }
        let (part, pose) = assembly.placed(body, &assembly.bodies[body].sites[k].pose);
        if part.is_none() && kind == SensorKind::Touch {
            assembly.reader.notes.add(element, "touch sensors on fixed bodies are left out");
            return None;
        }
        (part.map_or(SensorPlaceSpec::World, SensorPlaceSpec::Part), pose)
    };
    let relative_to = match element.text("refname") {
        Some(_) => {
            let (part, pose) = frame(element, ["reftype", "refname"], assembly)?;
            if pose != Pose::identity() || part.is_none() {
                let why = "sensors with a reference that is a site or fixed are left out";
                assembly.reader.notes.add(element, why);
                return None;
            }
            part
        }
        None => None,
    };
    let cutoff = element.open_number("cutoff").filter(|cutoff| *cutoff > 0.0 && kind != SensorKind::Orientation);
    let number = assembly.scene.sensors.len();
    let name = element.text("name").map_or_else(|| format!("sensor{number}"), super::defaults::cleaned);
    let (cutoff, noise) = (cutoff.unwrap_or(f64::INFINITY), SensorNoise::default());
    Some(SensorSpec { name, kind, on, site, relative_to, volume, cutoff, noise, optics: None, enabled: true })
}

fn on_link(assembly: &Assembly<'_, '_>, body: usize) -> bool {
    matches!(assembly.places[body], Place::Link(..))
}

/// Returns the frame that two attributes name.
fn frame(
    element: &Element<'_, '_>,
    [of_type, named]: [&str; 2],
    assembly: &Assembly<'_, '_>,
) -> Option<(Option<PartSpec>, Pose)> {
    match element.text(of_type) {
        Some("site") => {
            let (body, k) = find(element, named, &assembly.names.sites, false)?;
            Some(assembly.placed(body, &assembly.bodies[body].sites[k].pose))
        }
        Some("xbody") => {
            let body = find(element, named, &assembly.names.bodies, false)?;
            if matches!(assembly.places[body], Place::Rigid(_)) {
                let why = "sensors of bodies that are one rigid body are left out; a site makes them links";
                assembly.reader.notes.add(element, why);
                return None;
            }
            Some(assembly.placed(body, &Pose::identity()))
        }
        _ => {
            assembly.reader.notes.add(element, "sensors of frames other than sites and `xbody` are left out");
            None
        }
    }
}

/// Returns the volume of a site: a word of its `type` and its `size`; a sphere of 5 mm by default. `None` for other shapes.
pub(super) fn volume(word: &str, size: &[f64]) -> Option<ShapeSpec> {
    let at = |k: usize| size.get(k).copied().filter(|x| x.is_finite() && *x > 0.0);
    let radius_m = at(0).unwrap_or(0.005);
    match word {
        "sphere" => Some(ShapeSpec::Sphere { radius_m }),
        "box" => Some(ShapeSpec::Box { size_m: [2.0 * at(0)?, 2.0 * at(1)?, 2.0 * at(2)?] }),
        "capsule" => Some(ShapeSpec::Capsule { radius_m, length_m: 2.0 * at(1)? }),
        "cylinder" => Some(ShapeSpec::Cylinder { radius_m, length_m: 2.0 * at(1)? }),
        _ => None,
    }
}
