//! The mass of each body: that of `<inertial>`, or of its geoms.

use nalgebra::SymmetricEigen;
use tumble_core::articulated::LinkMass;
use tumble_core::collide::{Mat3, Vec3};

use super::Reader;
use super::compiler::FromGeoms;
use super::geom::Geom;
use super::tree::Body;
use crate::parse::link::inertia_fault;

/// Returns the mass of each body in its frame.
pub(super) fn of_bodies(bodies: &[Body<'_>], reader: &Reader<'_>) -> Vec<LinkMass> {
    let compiler = &reader.compiler;
    let mut masses = vec![LinkMass::none(); bodies.len()];
    for (mass, body) in masses.iter_mut().zip(bodies).skip(1) {
        let given = given(body, reader);
        *mass = match (given, compiler.from_geoms) {
            (Some(given), _) => given,
            (None, FromGeoms::Never) => LinkMass::none(),
            (None, _) => of_geoms(body, reader),
        };
        bound(mass, reader);
    }
    if let Some(total) = compiler.total_mass {
        let sum: f64 = masses.iter().map(|mass| mass.mass).sum();
        let factor = if sum > 0.0 { total / sum } else { 1.0 };
        masses.iter_mut().for_each(|m| *m = LinkMass { mass: m.mass * factor, inertia: m.inertia * factor, ..*m });
    }
    masses
}

/// Returns the mass of `<inertial>`, if it counts. Geoms in the range of groups replace it with `inertiafromgeom="true"`.
fn given(body: &Body<'_>, reader: &Reader<'_>) -> Option<LinkMass> {
    let (element, mass) = body.inertial.as_ref()?;
    if reader.compiler.from_geoms == FromGeoms::Always {
        if heavy_geoms(body, reader).next().is_some() {
            return None;
        }
        if let Some(fault) = inertia_fault(&mass.inertia).filter(|_| !reader.compiler.balance) {
            element.problem("has an inertia that no body has", format!("expected {fault}"));
        }
    }
    Some(*mass)
}

/// Returns the geoms whose groups add mass.
fn heavy_geoms<'b, 'a>(body: &'b Body<'a>, reader: &Reader<'_>) -> impl Iterator<Item = &'b Geom<'a>> {
    let [low, high] = reader.compiler.mass_groups;
    body.geoms.iter().filter(move |geom| (low..=high).contains(&geom.group))
}

fn of_geoms(body: &Body<'_>, reader: &Reader<'_>) -> LinkMass {
    let mut sum = LinkMass::none();
    for geom in heavy_geoms(body, reader) {
        // A geom without mass needs no volume.
        if !geom.is_heavy() {
            continue;
        }
        match geom.link_mass(reader) {
            Ok(mass) => sum = sum.with(&mass),
            Err(why) => reader.notes.add(&geom.element, format!("it adds no mass: {why}")),
        }
    }
    sum
}

/// Raises mass and principal moments to their least values, and makes them those of a rigid body.
fn bound(mass: &mut LinkMass, reader: &Reader<'_>) {
    let compiler = &reader.compiler;
    mass.mass = mass.mass.max(compiler.least_mass);
    if compiler.least_inertia == 0.0 && !compiler.balance {
        return;
    }
    let eigen = SymmetricEigen::new(mass.inertia);
    let mut moments = eigen.eigenvalues.map(|x| x.max(compiler.least_inertia));
    let [a, b, c] = [moments.x, moments.y, moments.z];
    if compiler.balance && (a + b < c || a + c < b || b + c < a) {
        moments = Vec3::from_element((a + b + c) / 3.0);
    }
    let turned = eigen.eigenvectors * Mat3::from_diagonal(&moments) * eigen.eigenvectors.transpose();
    mass.inertia = 0.5 * (turned + turned.transpose());
}
