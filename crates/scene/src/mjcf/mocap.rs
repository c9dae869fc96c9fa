//! `mocap` bodies as kinematic bodies, each with all bodies that are fixed to it.

use tumble_core::Mode;
use tumble_core::collide::Pose;

use super::bodies::{body_spec, joined, part};
use super::geom::{Form, Geom};
use super::scene::{Assembly, Place};
use super::shapes::make;
use super::views;
use crate::parse::body::{BodySpec, MassSpec};
use crate::parse::link::Surface;
use crate::parse::mount::Mounts;
use crate::parse::shape::{CompoundPartSpec, PartFilter, PartSurface, ShapeSpec};

/// Radius of the shape of a body without geoms, m. The shape does not collide and is not drawn.
const EMPTY_RADIUS: f64 = 0.005;

impl Assembly<'_, '_> {
    /// Returns the mocap body that a body without joints above it is part of.
    pub(super) fn mocap_of(&self, mut body: usize) -> Option<usize> {
        while self.fixed[body] && body != 0 {
            if self.bodies[body].mocap {
                return Some(body);
            }
            body = self.bodies[body].parent;
        }
        None
    }

    /// Adds the kinematic body of a mocap body.
    pub(super) fn add_mocap(&mut self, body: usize) {
        let (bodies, to_body) = (self.bodies, self.poses[body].inverse());
        let members: Vec<usize> = (body..bodies.len()).filter(|b| self.mocap_of(*b) == Some(body)).collect();
        if let [_, inside, ..] = &members[..] {
            let why = "bodies without joints below a mocap body are parts of it, without their names";
            self.reader.notes.add(&bodies[*inside].element, why);
        }
        let (mut geoms, mut mounts) = (Vec::new(), Mounts::default());
        for member in members {
            let pose = if member == body { Pose::identity() } else { to_body * self.poses[member] };
            self.places[member] = Place::Kinematic(self.scene.bodies.len(), pose);
            let seen = bodies[member].geoms.iter().filter(|geom| geom.visible || self.groups.collides(geom));
            geoms.extend(seen.map(|geom| (geom, pose * geom.pose)));
            self.mount(member, &pose, &mut mounts);
        }
        if geoms.len() > 1 || geoms.iter().any(|(_, pose)| *pose != Pose::identity()) {
            for (plane, _) in geoms.extract_if(.., |(geom, _)| geom.form == Form::Plane) {
                self.reader.notes.add(&plane.element, "a plane of a mocap body that is not all of it is left out");
            }
        }
        // the surface of a geom that collides counts, if there is one
        let mut those = geoms.iter().map(|(geom, _)| *geom);
        let first = those.clone().find(|geom| self.groups.collides(geom)).or(those.next());
        let surface = first.map_or_else(Surface::default, |geom| self.groups.surface(geom));
        let mut parts = Vec::new();
        for (geom, pose) in &geoms {
            if let Some(made) = make(geom, self.reader) {
                let shape = self.meshes.shape(made);
                parts.push(CompoundPartSpec { pose: *pose, ..self.apart(part(geom, shape), geom, &surface) });
            }
        }
        let is_empty = parts.is_empty();
        let (shape, shape_name) = match is_empty {
            true => (ShapeSpec::Sphere { radius_m: EMPTY_RADIUS }, None),
            false => joined(parts),
        };
        let name = self.taken.unique(self.name_of(body));
        let given = Some(self.masses[body]).filter(|m| m.mass > 0.0 && bodies[body].inertial.is_some());
        let spec = body_spec(name, Mode::Kinematic, shape, &self.poses[body], surface);
        self.scene.bodies.push(BodySpec {
            collidable: !is_empty && first.is_some_and(|geom| self.groups.collides(geom)),
            visible: !is_empty && geoms.iter().any(|(geom, _)| geom.visible),
            shape_name,
            mass: given.map(|m| MassSpec::Mass(m.mass)),
            center_m: given.map(|m| m.center.into()),
            inertia_kg_m2: given.map(|m| m.inertia),
            mounts,
            ..spec
        });
    }

    /// Returns a part with the surface and the groups of its geom, as far as they are not those of its body.
    fn apart(&self, part: CompoundPartSpec, geom: &Geom<'_>, body: &Surface) -> CompoundPartSpec {
        let own = self.groups.surface(geom);
        let like = (own.material, own.contact) == (body.material, body.contact);
        let surface = (!like).then_some(PartSurface { material: own.material, contact: own.contact });
        let mask = if self.groups.collides(geom) { own.mask } else { 0 };
        let filter = match (own.group, mask) == (body.group, body.mask) {
            true => PartFilter::default(),
            false => PartFilter { group: Some(own.group), mask: Some(mask), sensor: None },
        };
        CompoundPartSpec { surface, filter, ..part }
    }

    /// Adds the cameras and lights of a body to those of the kinematic body in which it has the pose `pose`.
    fn mount(&mut self, body: usize, pose: &Pose, mounts: &mut Mounts) {
        let own = &self.bodies[body];
        let mut is_full = false;
        for (_, at, mount) in views::mounts(own) {
            is_full |= mount.camera.is_some() && mounts.camera.is_some();
            is_full |= mount.light.is_some() && mounts.light.is_some();
            if let (Some(mut camera), None) = (mount.camera, &mounts.camera) {
                camera.pose = pose * at * camera.pose;
                mounts.camera = Some(camera);
            }
            if let (Some(mut light), None) = (mount.light, &mounts.light) {
                light.pose = pose * at * light.pose;
                mounts.light = Some(light);
            }
        }
        if is_full {
            self.reader.notes.add(&own.element, "cameras and lights of a mocap body after the first are left out");
        }
        for site in &own.sites {
            let why = "sites of mocap bodies are left out, except in <equality> and <sensor>";
            self.reader.notes.add(&site.element, why);
        }
    }
}
