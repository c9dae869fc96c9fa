//! Rigid bodies: static ones as geoms of the world, kinematic ones as `mocap` bodies, dynamic ones with a free joint.

use nalgebra::Translation3;
use tumble_core::articulated::LinkMass;
use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::{Collidable, Mode, Object, ObjectId, RigidBody};

use super::super::names::Taken;
use super::MjcfWriter;
use super::geoms::visual_of;
use super::xml::{Attributes, numbers, vector, wxyz};

impl MjcfWriter<'_> {
    /// Writes a rigid body.
    pub(super) fn rigid(&mut self, id: ObjectId, name: &str, body: &RigidBody) {
        let (Some(status), Some(part), Some(center)) =
            (self.world.status(id), self.world.part_state(id, 0), self.world.center_state(id))
        else {
            return;
        };
        let pose = body.frame_of(&part.pose);
        let label = self.body_label(name);
        self.names.insert((id, None), label.clone());
        if status.mode == Mode::Static {
            self.rigid_geoms(name, body, &pose, status.collidable, Some(&label));
            self.names.insert((id, None), "world".into());
            return;
        }
        let mut t = Attributes::of("name", &label);
        t.put_pose(&pose);
        match status.mode {
            Mode::Kinematic => {
                t.put("mocap", "true");
                if center.velocity != Vec3::zeros() || center.angular_velocity != Vec3::zeros() {
                    self.note(name, "velocities of kinematic bodies are left out");
                }
            }
            _ => t.put_number(0.0, "gravcomp", 1.0 - body.gravity_scale),
        }
        self.xml.open("body", &t);
        let mass = LinkMass { mass: body.mass(), center: body.center_of_mass(), inertia: *body.inertia() };
        if status.mode == Mode::Kinematic && mass.mass.is_finite() && mass.mass > 0.0 && mass.inertia.amax() > 0.0 {
            self.inertial(name, &mass);
        }
        if status.mode == Mode::Dynamic {
            let joint = self.joints.unique(name.to_string());
            self.xml.leaf("freejoint", &Attributes::of("name", joint));
            self.inertial(name, &mass);
            let (q, spin) = (pose.rotation, center.angular_velocity);
            let velocity = center.velocity - spin.cross(&(q * body.center_of_mass()));
            self.qpos.extend(pose.translation.vector.iter().chain(&[q.w, q.i, q.j, q.k]));
            self.qvel.extend(velocity.iter().chain((q.inverse() * spin).iter()));
            if body.linear_damping != 0.0 || body.angular_damping != 0.0 {
                self.note(name, "linear_damping and angular_damping are left out");
            }
            if body.locked.names().next().is_some() {
                self.note(name, "locked axes are left out");
            }
        }
        self.rigid_geoms(name, body, &Pose::identity(), status.collidable, None);
        self.joint_sites_of((id, None));
        self.xml.close();
    }

    /// Writes the shape of a body and its other visuals. `pose` is that of the body's frame.
    fn rigid_geoms(&mut self, name: &str, body: &RigidBody, pose: &Pose, collidable: bool, label: Option<&str>) {
        let mut left: Vec<_> = body.renderable().map_or(&[][..], |r| r.visuals()).iter().collect();
        let visual = visual_of(&mut left, body.shape(), &Pose::identity());
        let Some(parts) = body.collidable() else { return };
        let common = self.surface(name, parts, 0, collidable, visual.map(|visual| &visual.appearance));
        if parts.is_sensor(0) {
            self.note(name, "bodies that only report overlaps do not collide in MuJoCo, and report nothing");
        }
        self.solid(name, (parts, 0), pose, (collidable, label), &common);
        let center = Pose::from_parts(Translation3::from(body.shape().center_of_mass()), nalgebra::one());
        for visual in left.into_iter().filter(|visual| visual.drawn().is_some()) {
            let mut visual = visual.clone();
            visual.pose = pose * center * visual.pose;
            self.visual_geom(name, &visual);
        }
        if !body.camera().map_or(&[][..], |c| c.cameras()).is_empty()
            || !body.light().map_or(&[][..], |l| l.lights()).is_empty()
        {
            self.note(name, "cameras and lights are left out");
        }
    }

    /// Returns the name of a new body: the given one, or one with a number, with a note.
    pub(super) fn body_label(&mut self, name: &str) -> String {
        let label = self.bodies.unique(name.to_owned());
        self.note_rename("body", (name, name), &label);
        label
    }

    /// Notes that something has another name in the model, since names are unique there.
    pub(super) fn note_rename(&mut self, kind: &str, (subject, name): (&str, &str), label: &str) {
        if label != name {
            self.note(subject, format!("its name is taken by another {kind} of the model: it is read back as {label}"));
        }
    }

    /// Writes `<inertial>`: `mass`, center of mass and inertia about it, in the axes of the body.
    pub(super) fn inertial(&mut self, owner: &str, mass: &LinkMass) {
        let LinkMass { mass, center, inertia: i } = mass;
        if *mass <= 0.0 || i.amax() <= 0.0 {
            self.note(owner, "a body that moves has no mass or no inertia, which MuJoCo refuses");
        }
        let mut t = Attributes::of("pos", vector(center)).with("mass", numbers([*mass]));
        if [i.m12, i.m13, i.m23] == [0.0; 3] {
            t.put("diaginertia", numbers([i.m11, i.m22, i.m33]));
        } else {
            t.put("fullinertia", numbers([i.m11, i.m22, i.m33, i.m12, i.m13, i.m23]));
        }
        self.xml.leaf("inertial", &t);
    }

    /// Writes the shape of a part that collides, by the pose of its own frame, with the names and surfaces of its shapes. `label`
    /// is the name of a whole shape instead of its own.
    pub(super) fn solid(
        &mut self,
        owner: &str,
        (parts, part): (&dyn Collidable, usize),
        pose: &Pose,
        (collidable, label): (bool, Option<&str>),
        common: &Attributes,
    ) {
        let Some(shape) = parts.shape(part) else { return };
        let named = |name: Option<&str>, to: Attributes, taken: &mut Taken| match name {
            Some(name) => to.with("name", taken.unique(name.to_owned())),
            None => to,
        };
        if parts.one_way(part).is_some() {
            self.note(owner, "shapes that collide on one side only collide on all sides in MuJoCo");
        }
        let Shape::Compound(compound) = shape else {
            let own = parts.shape_name(part, 0);
            if let (Some(label), Some(own)) = (label, own.filter(|own| label.is_some_and(|label| label != *own))) {
                self.note(
                    owner,
                    format!("its geom has the name of the body, {label}, and not that of the shape, {own}"),
                );
            }
            let common = named(label.or(own), common.clone(), &mut self.shapes);
            return self.geoms(owner, pose, shape, &common);
        };
        for (n, piece) in compound.parts().iter().enumerate() {
            let own = parts.shape_materials(part).iter().find(|(shape, _)| *shape == n);
            let surface = match own.filter(|_| collidable && !parts.is_sensor(part)) {
                Some((_, material)) => common.without(&["friction", "condim"]).joined(&self.friction(owner, material)),
                None => common.clone(),
            };
            let filter = parts.shape_filters(part).iter().find(|(shape, _)| *shape == n).filter(|_| collidable);
            let surface = match filter {
                Some((_, filter)) => self.filtered(owner, filter, &surface),
                None => surface,
            };
            let common = named(parts.shape_name(part, n), surface, &mut self.shapes);
            self.geoms(owner, &(pose * piece.pose), &piece.shape, &common);
        }
    }
}

/// Adds a joint's rotation, `x y z w`, as MuJoCo's `w x y z`.
pub(super) fn put_rotation(xyzw: &[f64], out: &mut Vec<f64>) {
    out.extend([xyzw[3], xyzw[0], xyzw[1], xyzw[2]]);
}

/// Returns `relpose` of a weld.
pub(super) fn relpose(pose: &Pose) -> String {
    format!("{} {}", vector(&pose.translation.vector), wxyz(&pose.rotation))
}
