//! `[[body]]` of a rigid body as it stands.

use tumble_core::collide::{ContactMode, Mat3, Pose, Shape, Vec3};
use tumble_core::{Collidable, CollisionGroup, Material, Mode, Object, ObjectId, RigidBody, Visual, VisualGeometry};

use super::Writer;
use super::shapes::is_same;
use super::surface;
use super::text::Table;
use crate::parse::appearance::AppearanceSpec;
use crate::parse::body::MODES;

impl Writer<'_> {
    /// Writes a rigid body.
    pub(super) fn body(&mut self, id: ObjectId, name: &str, body: &RigidBody) {
        let (Some(status), Some(part), Some(center)) =
            (self.world.status(id), self.world.part_state(id, 0), self.world.center_state(id))
        else {
            return;
        };
        let mut t = Table::of("name", name);
        t.put_unless("dynamic", "mode", mode(status.mode));
        t.put_pose(&body.frame_of(&part.pose));
        if status.mode != Mode::Static {
            t.put_unless(Vec3::zeros(), "velocity_m_per_s", center.velocity);
            t.put_unless(Vec3::zeros(), "angular_velocity_rad_per_s", center.angular_velocity);
        }
        t.put_unless(true, "collidable", status.collidable);
        t.put_unless(true, "enabled", status.enabled);
        t.extend(self.constants(name, body));
        self.out += &t.under("[[body]]");
    }

    /// Returns the keys that a body and a template have in common: shape, mass, surface, laws and looks.
    pub(super) fn constants(&mut self, name: &str, body: &RigidBody) -> Table {
        let mut t = Table::of("shape", self.solid(body.shape(), body, 0));
        if !body.is_fixed() {
            t.extend(mass(body));
        }
        let (contact, look) = self.surface_of(&body.material, &mut t);
        t.extend(surface::contact(&body.material, &contact));
        t.put_unless(ContactMode::Surface, "contacts", body.contact_mode);
        t.put_unless(1.0, "gravity_scale", body.gravity_scale);
        let locked: Vec<&str> = body.locked.names().collect();
        t.put_unless(Vec::new(), "locked", locked);
        t.put_unless(0.0, "linear_damping_per_s", body.linear_damping);
        t.put_unless(0.0, "angular_damping_per_s", body.angular_damping);
        t.extend(surface::groups(body.group, body.mask));
        t.put_unless(false, "sensor", body.sensor);
        body.one_way.iter().for_each(|direction| t.put("one_way", *direction));
        let templates = self.like.templates.iter().map(|template| &template.body);
        let known = self.like.bodies.iter().chain(templates).find(|spec| spec.name == name);
        known.and_then(|spec| spec.sound.as_ref()).iter().for_each(|sound| t.put("sound", *sound));
        t.extend(self.look(name, body, &look));
        t
    }

    /// Returns the shape of a part that collides, with the names and the own surfaces of its shapes.
    pub(super) fn solid(&mut self, shape: &Shape, body: &dyn Collidable, part: usize) -> Table {
        let mut tables = self.surfaces_of_parts(shape.part_count(), &body.material(part), body.shape_materials(part));
        for (n, t) in tables.iter_mut().enumerate() {
            body.shape_name(part, n).iter().for_each(|name| t.put("name", *name));
        }
        for (n, own) in body.shape_filters(part) {
            let t = &mut tables[*n];
            t.put("group", own.group.bit().trailing_zeros());
            let same = (0..64)
                .filter_map(CollisionGroup::new)
                .all(|group| body.collides_with(part, group) == (own.mask & group.bit() != 0));
            if !same {
                t.put("mask", (0..64).filter(|group| own.mask & (1 << group) != 0).collect::<Vec<u32>>());
            }
            t.put_unless(body.is_sensor(part), "sensor", own.sensor);
        }
        let whole = tables.first().cloned().filter(|_| !matches!(shape, Shape::Compound(_)));
        let mut t = self.meshes.shape_of_parts(shape, &|n| tables.get(n).cloned().unwrap_or_default());
        t.extend(whole.unwrap_or_default());
        t
    }

    /// Returns the surface keys of each part of a compound with `count` parts, as far as they differ from those of the whole.
    fn surfaces_of_parts(&self, count: usize, whole: &Material, own: &[(usize, Material)]) -> Vec<Table> {
        let mut tables = vec![Table::default(); count];
        for (n, material) in own {
            let t = &mut tables[*n];
            let base = if material.id == whole.id { *whole } else { self.surface_of(material, t).0 };
            let constants = surface::contact(material, &base);
            if t.is_empty() && constants.is_empty() {
                t.put("friction", material.friction);
            }
            t.extend(constants);
        }
        tables
    }

    /// Returns contact constants and appearance of the material that a part names, and writes its
    /// name; without one the default ones.
    pub(super) fn surface_of(&self, material: &Material, t: &mut Table) -> (Material, AppearanceSpec) {
        match self.materials.iter().find(|(id, _)| *id == material.id) {
            Some((_, spec)) => {
                t.put("material", &spec.name);
                (spec.contact, spec.appearance.clone())
            }
            None => (Material::default(), AppearanceSpec::default()),
        }
    }

    /// Returns the keys of a body's appearance, camera and light.
    fn look(&mut self, name: &str, body: &RigidBody, base: &AppearanceSpec) -> Table {
        let center = body.shape().center_of_mass();
        let mut t = Table::default();
        let visuals = body.renderable().map_or(&[][..], |r| r.visuals());
        match visuals.first() {
            None => t.put("visible", false),
            Some(visual) => {
                t.extend(surface::appearance(&visual.appearance, &center, base));
                self.note_shader(name, visual);
                if visuals.len() > 1 || !is_own_shape(visual, body) {
                    self.notes
                        .push(format!("body \"{name}\": it is drawn as its shape; its own visuals are not written"));
                }
            }
        }
        let cameras = body.camera().map_or(&[][..], |c| c.cameras());
        let lights = body.light().map_or(&[][..], |l| l.lights());
        cameras.iter().take(1).for_each(|camera| t.put("camera", surface::camera(camera, &center)));
        lights.iter().take(1).for_each(|light| t.put("light", surface::light(light, &center)));
        if cameras.len().max(lights.len()) > 1 {
            self.notes.push(format!("body \"{name}\": only its first camera and its first light are written"));
        }
        t
    }

    /// Notes a shader that is no pattern of scene files.
    pub(super) fn note_shader(&mut self, name: &str, visual: &Visual) {
        let shader = &visual.appearance.shader;
        if !surface::is_pattern(shader) {
            self.fault(format!("\"{name}\": its shader '{shader}' is no pattern of scene files"));
        }
    }
}

/// Returns the word for a mode.
pub(super) fn mode(mode: Mode) -> &'static str {
    MODES.iter().find(|(_, known)| *known == mode).map_or("", |(word, _)| *word)
}

fn is_own_shape(visual: &Visual, body: &RigidBody) -> bool {
    let own = matches!(&visual.geometry, VisualGeometry::Shape(shape) if is_same(shape, body.shape()));
    own && visual.pose == Pose::identity() && visual.stands_in_for.is_empty()
}

/// Returns mass, center of mass and inertia; the last two only if they are not those of the uniform
/// shape.
fn mass(body: &RigidBody) -> Table {
    let mut t = Table::of("mass_kg", body.mass());
    if body.center_in_part() != Vec3::zeros() {
        t.put("center_m", body.center_of_mass());
    }
    let uniform = RigidBody::fixed(body.shape().clone()).with_mass(body.mass());
    if uniform.validate().is_err() || uniform.inertia() != body.inertia() {
        t.put("inertia_kg_m2", inertia(body.inertia()));
    }
    t
}

/// Returns a symmetric matrix as `[xx, yy, zz, xy, xz, yz]`.
pub(super) fn inertia(m: &Mat3) -> [f64; 6] {
    [m.m11, m.m22, m.m33, m.m12, m.m13, m.m23]
}
