//! `[[articulated]]` of an articulated body as it stands, with the shapes and masses of each link, fixed ones too.

use std::collections::BTreeSet;

use tumble_core::articulated::{DofSettings, Drive, Link, LinkFrame, LinkMass};
use tumble_core::collide::{ContactMode, Pose, Shape, Vec3};
use tumble_core::{ArticulatedBody, Collider, Joint, Object, ObjectId, Visual, VisualGeometry};

use super::Writer;
use super::bodies::{self, inertia};
use super::shapes::is_same;
use super::surface;
use super::text::Table;
use crate::parse::appearance::AppearanceSpec;

/// The shapes of one link.
struct Carried<'b> {
    colliders: Vec<(usize, &'b Collider)>,
    visuals: Vec<&'b Visual>,
}

impl Writer<'_> {
    /// Writes an articulated body.
    pub(super) fn articulated(&mut self, id: ObjectId, name: &str, body: &ArticulatedBody) {
        let (model, state) = (body.model(), self.world.state_of(id).unwrap_or_default());
        let floating = model.links().iter().any(|link| link.joint == Joint::Floating);
        let mut t = Table::of("name", name);
        t.put_pose(body.base());
        t.put_unless(false, "floating", floating);
        t.put_unless(true, "self_collision", body.self_collision);
        if let Some(status) = self.world.status(id) {
            t.put_unless("dynamic", "mode", bodies::mode(status.mode));
            t.put_unless(true, "collidable", status.collidable);
            t.put_unless(true, "enabled", status.enabled);
        }
        if let Some(root) = model.links().iter().find(|link| link.joint == Joint::Floating) {
            let rates = &state[model.positions() + root.v..model.positions() + root.v + 6];
            t.put("velocity_m_per_s", &rates[3..6]);
            t.put("angular_velocity_rad_per_s", &rates[..3]);
        }
        let called = |link: Option<usize>| -> Option<&str> {
            match link {
                Some(link) => Some(model.links()[link].name.as_str()),
                None => model.frames().iter().find(|f| f.link.is_none()).map(|f| f.name.as_str()),
            }
        };
        let pairs = body.excluded_pairs().iter().filter_map(|[a, b]| Some([called(*a)?, called(*b)?]));
        t.put_unless(Vec::new(), "exclude_collisions", pairs.collect::<Vec<_>>());
        self.out += &t.under("[[articulated]]");
        let joints = self.joint_names.get(name).cloned().unwrap_or_default();
        for frame in model.frames() {
            let t = match frame.link.filter(|&k| model.links()[k].name == frame.name) {
                Some(k) => self.moving_link(body, k, state, joints.get(k)),
                None => self.fixed_link(body, frame),
            };
            self.out += &t.under("[[articulated.link]]");
        }
        for root in model.links().iter().filter(|link| link.joint == Joint::Floating) {
            let resistance = resistance(&body.dofs()[root.v]);
            if resistance != Table::default() {
                let mut t = Table::of("name", &root.name);
                t.extend(resistance);
                self.out += &t.under("[[articulated.joint]]");
            }
        }
    }

    fn moving_link(&mut self, body: &ArticulatedBody, k: usize, state: &[f64], joint: Option<&String>) -> Table {
        let (model, link) = (body.model(), &body.model().links()[k]);
        let Link { name, parent, joint: kind, placement, mass: _, q, v, armature } = link;
        let mut t = Table::of("name", name);
        parent.iter().for_each(|parent| t.put("parent", &model.links()[*parent].name));
        let placement = match kind {
            Joint::Floating => body.base().inverse() * pose_of(&state[*q..q + 7]),
            _ if parent.is_none() => body.base().inverse() * placement,
            _ => *placement,
        };
        t.put_pose(&placement);
        joint.filter(|joint| *joint != name).into_iter().for_each(|joint| t.put("joint_name", joint));
        let rates = &state[model.positions() + v..model.positions() + v + kind.dof()];
        let dof = &body.dofs()[*v];
        let own = &body.dofs()[*v..v + kind.dof()];
        let cones: Vec<(usize, f64)> = match kind {
            Joint::Spherical => (0..3).filter_map(|k| own[k].limits.map(|[_, cone]| (k, cone))).collect(),
            _ => Vec::new(),
        };
        let twists: Vec<(usize, [f64; 2])> = (0..own.len()).filter_map(|k| Some((k, own[k].twist_limits?))).collect();
        let spherical = *kind == Joint::Spherical;
        let free = |dof: &DofSettings| match spherical {
            true => DofSettings { limits: None, twist_limits: None, ..dof.clone() },
            false => dof.clone(),
        };
        let alike = own.iter().all(|other| free(other) == free(dof));
        if !alike && !spherical {
            self.fault(format!("link \"{name}\": different damping or friction of one joint's degrees of freedom"));
        }
        let axes: BTreeSet<usize> = cones.iter().map(|(k, _)| *k).chain(twists.iter().map(|(k, _)| *k)).collect();
        match kind {
            Joint::Fixed | Joint::Floating => {}
            Joint::Revolute { axis } | Joint::Prismatic { axis } => {
                let turns = matches!(kind, Joint::Revolute { .. });
                t.put("joint", if turns { "revolute" } else { "prismatic" });
                t.put("axis", *axis);
                let [start, rate, rotor] = match turns {
                    true => ["angle_rad", "rate_rad_per_s", "armature_kg_m2"],
                    false => ["displacement_m", "rate_m_per_s", "armature_kg"],
                };
                t.put_unless(0.0, start, state[*q]);
                t.put_unless(0.0, rate, rates[0]);
                t.put_unless(0.0, rotor, *armature);
                t.extend(dof_settings(dof, turns));
                for c in body.couplings().iter().filter(|c| c.dof == *v) {
                    let of = model.links().iter().position(|l| l.v == c.of).unwrap_or(0);
                    let joints = self.joint_names.get(body.name());
                    let of = joints.and_then(|names| names.get(of)).unwrap_or(&model.links()[of].name);
                    let mut mimic = Table::of("joint", of);
                    mimic.put("multiplier", c.multiplier);
                    mimic.put(if turns { "offset_rad" } else { "offset_m" }, c.offset);
                    t.put("mimic", mimic);
                }
            }
            Joint::Spherical => {
                t.put("joint", "spherical");
                t.extend(rotation(&state[*q..q + 4]));
                t.put("angular_velocity_rad_per_s", rates);
                t.put_unless(0.0, "armature_kg_m2", *armature);
                let several = axes.len() > 1;
                if let (false, Some(axis)) = (several, axes.first()) {
                    t.put("axis", [0, 1, 2].map(|k| if k == *axis { 1.0 } else { 0.0 }));
                    cones.iter().for_each(|(_, cone)| t.put("cone_rad", *cone));
                    twists.iter().for_each(|(_, limits)| t.put("twist_limits_rad", *limits));
                }
                let free: Vec<DofSettings> = own.iter().map(free).collect();
                match spherical_settings(&free.iter().collect::<Vec<_>>()).filter(|_| !several) {
                    Some(settings) => t.extend(settings),
                    None => t.put(
                        "dof",
                        (0..own.len())
                            .map(|k| {
                                let mut table = dof_settings(&free[k], true);
                                if several {
                                    own[k].limits.iter().for_each(|[_, cone]| table.put("cone_rad", *cone));
                                    own[k]
                                        .twist_limits
                                        .iter()
                                        .for_each(|limits| table.put("twist_limits_rad", *limits));
                                }
                                table
                            })
                            .collect::<Vec<Table>>(),
                    ),
                }
            }
        }
        t.extend(self.mounts(body, k));
        let shapes = self.shapes(body, name, &carried(body, name), &Pose::identity());
        t.extend(mass_of(&body.link_mass(name).unwrap_or_else(LinkMass::none), !shapes.is_empty()));
        t.extend(shapes);
        t
    }

    /// Writes a link without a joint. The first one on the base has the cameras and lights of the base.
    fn fixed_link(&mut self, body: &ArticulatedBody, frame: &LinkFrame) -> Table {
        let LinkFrame { name, link, pose, mass } = frame;
        let mut t = Table::of("name", name);
        link.iter().for_each(|link| t.put("parent", &body.model().links()[*link].name));
        t.put_pose(pose);
        t.put("joint", "fixed");
        let first = body.model().frames().iter().find(|f| f.link.is_none()).is_some_and(|f| f.name == *name);
        if first {
            t.extend(self.mounts(body, body.model().links().len()));
        }
        let shapes = self.shapes(body, name, &carried(body, name), pose);
        t.extend(mass_of(mass, !shapes.is_empty()));
        t.extend(shapes);
        t
    }

    /// Returns the first camera and the first light of a part.
    fn mounts(&mut self, body: &ArticulatedBody, part: usize) -> Table {
        let mut t = Table::default();
        let cameras = body.camera().map_or(&[][..], |c| c.cameras()).iter().filter(|c| c.part == part);
        let lights = body.light().map_or(&[][..], |l| l.lights()).iter().filter(|l| l.part == part);
        if cameras.clone().count().max(lights.clone().count()) > 1 {
            self.notes.push(format!("\"{}\": only the first camera and light of a link are written", body.name()));
        }
        cameras.take(1).for_each(|camera| t.put("camera", surface::camera(camera, &Vec3::zeros())));
        lights.take(1).for_each(|light| t.put("light", surface::light(light, &Vec3::zeros())));
        t
    }

    /// Returns the list of shapes: colliders, each with its visual if it has one, then visuals alone.
    /// `frame` is the pose of the link's frame in that of its carrier.
    fn shapes(&mut self, body: &ArticulatedBody, link: &str, carried: &Carried<'_>, frame: &Pose) -> Table {
        let mut left = carried.visuals.clone();
        let mut list = Vec::new();
        for (part, collider) in &carried.colliders {
            // the names and surfaces of shapes are read from the body below
            let Collider {
                pose,
                shape,
                material,
                contact_mode,
                group,
                mask,
                name: _,
                shape_materials: _,
                shape_filters: _,
                one_way,
                sensor,
            } = collider;
            let drawn = left.iter().position(|visual| {
                matches!(&visual.geometry, VisualGeometry::Shape(s) if is_same(s, shape)) && visual.pose == *pose
            });
            let visual = drawn.map(|k| left.remove(k));
            let mut t = self.solid(shape, body, *part);
            t.put_pose(&(frame.inverse() * pose * about_frame(shape)));
            let (contact, look) = self.surface_of(material, &mut t);
            t.extend(surface::contact(material, &contact));
            t.put_unless(ContactMode::Surface, "contacts", *contact_mode);
            t.extend(surface::groups(*group, *mask));
            one_way.iter().for_each(|direction| t.put("one_way", *direction));
            t.put_unless(false, "sensor", *sensor);
            match visual {
                Some(visual) => t.extend(self.visual_look(link, visual, &shape.center_of_mass(), &look)),
                None => t.put("visible", false),
            }
            list.push(t);
        }
        for visual in left {
            list.extend(self.visual(link, visual, frame));
        }
        let mut t = Table::default();
        t.put_unless(Vec::new(), "shapes", list);
        t
    }

    fn visual(&mut self, link: &str, visual: &Visual, frame: &Pose) -> Option<Table> {
        let (mut t, center) = match &visual.geometry {
            VisualGeometry::Shape(shape) => {
                let mut t = self.meshes.shape(shape);
                t.put("collidable", false);
                t.put_pose(&(frame.inverse() * visual.pose * about_frame(shape)));
                (t, shape.center_of_mass())
            }
            VisualGeometry::Mesh(mesh) => match mesh.triangles() {
                Ok(triangles) => {
                    let mut t = self.meshes.visual(std::sync::Arc::as_ptr(mesh).addr(), triangles);
                    t.put_pose(&(frame.inverse() * visual.pose));
                    (t, Vec3::zeros())
                }
                Err(why) => {
                    self.notes.push(format!("link \"{link}\": visual mesh {} is left out: {why}", mesh.name()));
                    return None;
                }
            },
        };
        t.extend(self.visual_look(link, visual, &center, &AppearanceSpec::default()));
        Some(t)
    }

    fn visual_look(&mut self, link: &str, visual: &Visual, center: &Vec3, base: &AppearanceSpec) -> Table {
        self.note_shader(link, visual);
        surface::appearance(&visual.appearance, center, base)
    }
}

/// Returns the mass of a link in numbers; a link with shapes would have that of water without them.
fn mass_of(mass: &LinkMass, has_shapes: bool) -> Table {
    let mut t = Table::default();
    if *mass != LinkMass::none() {
        t.put("mass_kg", mass.mass);
        t.put("center_m", mass.center);
        t.put("inertia_kg_m2", inertia(&mass.inertia));
    } else if has_shapes {
        t.put("mass_kg", 0.0);
    }
    t
}

/// Returns colliders and visuals of a link, which may be a fixed one.
fn carried<'b>(body: &'b ArticulatedBody, link: &str) -> Carried<'b> {
    let (link, first) = (body.model().frame_index(link), body.model().links().len() + 1);
    let parts = body.colliders().enumerate().map(|(k, (_, collider))| (first + k, collider));
    // a stand-in for meshes that can be read is not drawn
    let visuals = body.visuals_of_links().filter(|(of, visual)| Some(*of) == link && visual.drawn().is_some());
    Carried {
        colliders: parts.filter(|(part, _)| body.frame_of(*part) == link).collect(),
        visuals: visuals.map(|(_, visual)| visual).collect(),
    }
}

/// Returns the pose of a shape's own frame in the frame about its center of mass.
fn about_frame(shape: &Shape) -> Pose {
    Pose::from_parts((-shape.center_of_mass()).into(), nalgebra::one())
}

/// Returns damping and friction of a joint without a position.
fn resistance(dof: &DofSettings) -> Table {
    let mut t = Table::default();
    t.put_unless(0.0, "damping_n_m_s_per_rad", dof.damping);
    t.put_unless(0.0, "friction_n_m", dof.friction);
    t.put_unless(f64::INFINITY, "max_velocity_rad_per_s", dof.max_velocity);
    t
}

/// Returns the settings of all axes of a spherical joint as one table, in which rest positions and targets are vectors if they differ.
/// `None` if the axes differ in more.
pub(super) fn spherical_settings(dofs: &[&DofSettings]) -> Option<Table> {
    let level = |dof: &DofSettings| {
        let mut dof = dof.clone();
        dof.spring.iter_mut().for_each(|spring| spring.rest = 0.0);
        match &mut dof.drive {
            Drive::Position { target, velocity, .. } => [*target, *velocity] = [0.0; 2],
            Drive::Velocity { target, .. } => *target = 0.0,
            Drive::None | Drive::Playback { .. } => {}
        }
        dof
    };
    let first = level(dofs.first()?);
    dofs.iter().all(|dof| level(dof) == first).then(|| settings_of(dofs, true))
}

/// Returns the settings of one degree of freedom.
pub(super) fn dof_settings(dof: &DofSettings, turns: bool) -> Table {
    settings_of(&[dof], turns)
}

/// Returns the settings of degrees of freedom that differ in rest positions and targets alone.
fn settings_of(dofs: &[&DofSettings], turns: bool) -> Table {
    // the limits of a twist stand beside the axis of their joint
    let DofSettings { limits, twist_limits: _, damping, friction, spring, drive, max_velocity, effort } = dofs[0];
    let [at_limits, resists, dry, stiff, at_rest] = match turns {
        true => ["limits_rad", "damping_n_m_s_per_rad", "friction_n_m", "stiffness_n_m_per_rad", "rest_rad"],
        false => ["limits_m", "damping_n_s_per_m", "friction_n", "stiffness_n_per_m", "rest_m"],
    };
    let [fastest, strongest] = match turns {
        true => ["max_velocity_rad_per_s", "effort_n_m"],
        false => ["max_velocity_m_per_s", "effort_n"],
    };
    let [target, rate, most, values] = match turns {
        true => ["target_rad", "target_rad_per_s", "max_torque_n_m", "values_rad"],
        false => ["target_m", "target_m_per_s", "max_force_n", "values_m"],
    };
    let of_drive = |number: fn(&Drive) -> f64| -> Vec<f64> { dofs.iter().map(|dof| number(&dof.drive)).collect() };
    let mut t = Table::default();
    limits.iter().for_each(|limits| t.put(at_limits, *limits));
    t.put_unless(0.0, resists, *damping);
    t.put_unless(0.0, dry, *friction);
    t.put_unless(f64::INFINITY, fastest, *max_velocity);
    t.put_unless(f64::INFINITY, strongest, *effort);
    if let Some(spring) = spring {
        let mut s = Table::of(stiff, spring.stiffness);
        put_components(
            &mut s,
            at_rest,
            &dofs.iter().map(|dof| dof.spring.map_or(0.0, |spring| spring.rest)).collect::<Vec<_>>(),
        );
        t.put("spring", s);
    }
    let (mut d, limit) = match drive {
        Drive::None => return t,
        Drive::Position { stiffness, damping, limit, .. } => {
            let mut d = Table::of("type", "position");
            d.put_unless(0.0, stiff, *stiffness);
            d.put_unless(0.0, resists, *damping);
            put_components(
                &mut d,
                target,
                &of_drive(|drive| if let Drive::Position { target, .. } = drive { *target } else { 0.0 }),
            );
            let rates = of_drive(|drive| if let Drive::Position { velocity, .. } = drive { *velocity } else { 0.0 });
            if rates.iter().any(|rate| *rate != 0.0) {
                put_components(&mut d, rate, &rates);
            }
            (d, limit)
        }
        Drive::Velocity { limit, .. } => {
            let mut d = Table::of("type", "velocity");
            put_components(
                &mut d,
                rate,
                &of_drive(|drive| if let Drive::Velocity { target, .. } = drive { *target } else { 0.0 }),
            );
            (d, limit)
        }
        Drive::Playback { motion, limit } => {
            let mut d = Table::of("type", "playback");
            d.put("times_s", motion.times());
            d.put(values, motion.values());
            d.put_unless(false, "repeat", motion.repeats());
            (d, limit)
        }
    };
    // without a limit of its own a drive has the effort
    match limit.is_infinite() && effort.is_finite() {
        true => d.put(most, false),
        false => d.put_unless(*effort, most, *limit),
    }
    t.put("drive", d);
    t
}

/// Writes one number if all are the same, otherwise a vector.
fn put_components(t: &mut Table, key: &'static str, components: &[f64]) {
    match components.iter().all(|x| x.to_bits() == components[0].to_bits()) {
        true => t.put(key, components[0]),
        false => t.put(key, components),
    }
}

fn pose_of(q: &[f64]) -> Pose {
    let rotation = nalgebra::Quaternion::new(q[6], q[3], q[4], q[5]);
    Pose::from_parts(Vec3::new(q[0], q[1], q[2]).into(), nalgebra::UnitQuaternion::new_unchecked(rotation))
}

/// Returns a unit quaternion `x, y, z, w` as an axis and an angle.
fn rotation(q: &[f64]) -> Table {
    let v = Vec3::new(q[0], q[1], q[2]);
    let length = v.norm();
    let mut t = Table::default();
    if length > 1e-12 {
        let mut turn = Table::of("axis", v / length);
        turn.put("angle_deg", (2.0 * libm::atan2(length, q[3])).to_degrees());
        t.put("initial_rotation", turn);
    }
    t
}
