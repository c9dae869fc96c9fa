//! `[[cloth]]`, `[[jelly]]`, `[[particle_system]]`, `[[flock]]`, `[[body_flock]]` and `[[field]]`.
//!
//! Their tables say how they began: no key of a scene says where a node or a particle is now. The archive has that.

use tumble_behaviors::{
    Attractor, BodyFlock, Boid, Buoyancy, DragLaw, Emitter, Explosion, Flock, Grid, Panel, Panels, ParticleSettings,
    ParticleSystem, SpringMesh, Steering, Targets, Wind,
};
use tumble_core::collide::{Shape, Vec3};
use tumble_core::{Object, ObjectId};

use super::Writer;
use super::surface;
use super::text::Table;
use crate::parse::appearance::AppearanceSpec;

impl Writer<'_> {
    /// Writes a behavior. Returns false for an object of another kind.
    pub(super) fn behavior(&mut self, id: ObjectId, name: &str) -> bool {
        let world = self.world;
        if let Some(mesh) = world.get::<SpringMesh>(id) {
            self.mesh(id, name, mesh);
        } else if let Some(system) = world.get::<ParticleSystem>(id) {
            self.particles(id, name, system);
        } else if let Some(flock) = world.get::<Flock>(id) {
            self.flock(id, name, flock);
        } else if world.get::<Boid>(id).is_some() {
            let in_flock =
                |other: &ObjectId| world.get::<Flock>(*other).is_some_and(|flock| flock.boids().contains(&id));
            if !world.ids().iter().any(in_flock) {
                self.fault(format!("\"{name}\", a boid without a flock"));
            }
        } else if let Some(wind) = world.get::<Wind>(id) {
            let mut t = field(name, "wind");
            t.put_unless(Vec3::zeros(), "velocity_m_per_s", wind.velocity());
            match wind.law() {
                DragLaw::Linear { coefficient } => t.put("drag_n_s_per_m", coefficient),
                DragLaw::Quadratic { density, coefficient } => {
                    t.put("density_kg_per_m3", density);
                    t.put("drag_coefficient", coefficient);
                }
            }
            self.field(id, t, wind.targets());
        } else if let Some(attractor) = world.get::<Attractor>(id) {
            let mut t = field(name, "attractor");
            t.put_unless(Vec3::zeros(), "position_m", attractor.center());
            t.put("strength_m3_per_s2", attractor.strength());
            t.put_unless(0.0, "softening_m", attractor.softening());
            self.field(id, t, attractor.targets());
        } else if let Some(explosion) = world.get::<Explosion>(id) {
            let mut t = field(name, "explosion");
            t.put_unless(Vec3::zeros(), "position_m", explosion.center());
            t.put("impulse_n_s", explosion.impulse());
            t.put("start_s", explosion.time());
            t.put("decay_s", explosion.decay());
            self.field(id, t, explosion.targets());
        } else if let Some(fluid) = world.get::<Buoyancy>(id) {
            let mut t = field(name, "buoyancy");
            t.put_unless(Vec3::zeros(), "position_m", fluid.surface());
            t.put("density_kg_per_m3", fluid.density());
            t.put("drag_per_s", fluid.drag());
            t.put_unless(Vec3::zeros(), "current_m_per_s", fluid.current());
            self.field(id, t, fluid.targets());
        } else if let Some(panels) = world.get::<Panels>(id) {
            self.panels(id, name, panels);
        } else if let Some(flock) = world.get::<BodyFlock>(id) {
            self.body_flock(id, name, flock);
        } else {
            return false;
        }
        true
    }

    /// Returns the keys of an object that is not enabled.
    fn enabled(&mut self, id: ObjectId) -> Table {
        let mut t = Table::default();
        let status = self.world.status(id);
        t.put_unless(true, "enabled", status.is_none_or(|status| status.enabled));
        if status.is_some_and(|status| !status.collidable) {
            let name = self.world.name(id).unwrap_or_default();
            self.fault(format!("\"{name}\", which is not collidable and has no shape"));
        }
        t
    }

    /// Returns the keys of an object that is not enabled or does not collide.
    fn status(&self, id: ObjectId) -> Table {
        let mut t = Table::default();
        if let Some(status) = self.world.status(id) {
            t.put_unless(true, "collidable", status.collidable);
            t.put_unless(true, "enabled", status.enabled);
        }
        t
    }

    fn mesh(&mut self, id: ObjectId, name: &str, mesh: &SpringMesh) {
        let Some(origin) = mesh.origin() else {
            return self.fault(format!("\"{name}\", a mesh of springs that is no grid"));
        };
        let mut t = Table::of("name", name);
        let number = |n: usize| n as u32;
        let (header, mass, stiffness, damping) = match &origin.grid {
            Grid::Cloth(cloth) => {
                t.put("nodes", cloth.nodes.map(number));
                t.put("size_m", cloth.size);
                ("[[cloth]]", cloth.mass, cloth.stiffness, cloth.damping)
            }
            Grid::Jelly(jelly) => {
                t.put("nodes", jelly.nodes.map(number));
                t.put("size_m", jelly.size);
                ("[[jelly]]", jelly.mass, jelly.stiffness, jelly.damping)
            }
        };
        t.put("mass_kg", mass);
        t.put("stiffness_n_per_m", stiffness);
        t.put("damping_s", damping);
        t.put_pose(&origin.pose);
        t.put_unless(Vec3::zeros(), "velocity_m_per_s", mesh.velocity());
        if let Some(Shape::Sphere { radius }) = mesh.node_shape() {
            t.put("node_radius_m", *radius);
        }
        t.put_unless(Vec::new(), "pins", mesh.pinned_nodes().map(number).collect::<Vec<u32>>());
        t.put("implicitness", mesh.implicitness());
        let (contact, look) = self.surface_of(mesh.material(), &mut t);
        t.extend(surface::contact(mesh.material(), &contact));
        if let Some(surface) = mesh.surface() {
            t.extend(surface::appearance(&surface.appearance, &Vec3::zeros(), &look));
        }
        t.extend(self.status(id));
        self.out += &t.under(header);
    }

    fn particles(&mut self, id: ObjectId, name: &str, system: &ParticleSystem) {
        let mut t = Table::of("name", name);
        let &ParticleSettings {
            capacity,
            seed,
            mass,
            radius,
            ref material,
            gravity_scale,
            linear_drag,
            quadratic_drag,
            wind,
            collidable,
            group,
            mask,
            two_way,
        } = system.settings();
        let (contact, base) = self.surface_of(material, &mut t);
        t.extend(surface::contact(material, &contact));
        t.put("capacity", capacity as u32);
        t.put_unless(0, "seed", seed);
        t.put("mass_kg", mass);
        t.put("radius_m", radius);
        t.put_unless(1.0, "gravity_scale", gravity_scale);
        t.put_unless(0.0, "linear_drag_per_s", linear_drag);
        t.put_unless(0.0, "quadratic_drag_per_m", quadratic_drag);
        t.put_unless(Vec3::zeros(), "wind_m_per_s", wind);
        t.put_unless(true, "collidable", collidable);
        t.extend(surface::groups(group, mask));
        t.put_unless(false, "two_way", two_way);
        let look = system.look();
        look.radius.iter().for_each(|radius| t.put("drawn_radius_m", *radius));
        t.put_unless(0.0, "fade_s", look.fade);
        look.opacity.iter().for_each(|opacity| t.put("opacity", *opacity));
        t.put_unless([1.0; 2], "scale", look.scale);
        look.end_color.iter().for_each(|color| t.put("end_color", *color));
        t.extend(surface::appearance(&look.appearance, &Vec3::zeros(), &base));
        t.extend(self.enabled(id));
        self.out += &t.under("[[particle_system]]");
        for emitter in system.emitters() {
            if let Some(t) = self.emitter(name, emitter) {
                self.out += &t.under("[[particle_system.emitter]]");
            }
        }
    }

    fn emitter(&mut self, system: &str, emitter: &Emitter) -> Option<Table> {
        let &Emitter { pose, mount, radius, speed, half_angle, lifetime, burst, rate, start, end } = emitter;
        let mut t = Table::default();
        t.put_unless(Vec3::zeros(), "position_m", pose.translation.vector);
        t.put("axis", pose.rotation * Vec3::z());
        if let Some((id, part)) = mount {
            let Some(body) = self.part_name(id, part) else {
                self.fault(format!("\"{system}\": an emitter on a body that was removed"));
                return None;
            };
            t.put("body", body);
        }
        t.put_unless(0.0, "radius_m", radius);
        t.put("speed_m_per_s", speed);
        t.put("half_angle_deg", half_angle.to_degrees());
        t.put("lifetime_s", lifetime);
        t.put_unless(0, "burst", burst);
        t.put_unless(0.0, "rate_per_s", rate);
        t.put_unless(0.0, "start_s", start);
        t.put_unless(f64::INFINITY, "end_s", end);
        Some(t)
    }

    fn flock(&mut self, id: ObjectId, name: &str, flock: &Flock) {
        let mut t = steering(name, flock.steering());
        t.extend(self.enabled(id));
        self.out += &t.under("[[flock]]");
        for &id in flock.boids() {
            let (Some(boid), Some(name)) = (self.world.get::<Boid>(id), self.world.name(id)) else { continue };
            self.boid(id, name, boid);
        }
    }

    fn body_flock(&mut self, id: ObjectId, name: &str, flock: &BodyFlock) {
        let (mut t, helm) = (steering(name, flock.steering()), flock.helm());
        t.put("agility_per_s", helm.agility);
        t.put("max_angular_acceleration_rad_per_s2", helm.max_angular_acceleration);
        t.put("bank_time_s", helm.bank_time);
        t.put("up", helm.up);
        t.put_unless(Vec3::zeros(), "wind_m_per_s", helm.wind);
        let names = flock.bodies().iter().filter_map(|id| self.world.name(*id).map(str::to_owned));
        t.put("bodies", names.collect::<Vec<String>>());
        t.extend(self.enabled(id));
        self.out += &t.under("[[body_flock]]");
    }

    fn boid(&mut self, id: ObjectId, name: &str, boid: &Boid) {
        let Some(Shape::Sphere { radius }) = boid.collidable().and_then(|body| body.shape(0)) else {
            return self.fault(format!("\"{name}\", a boid that is no sphere"));
        };
        let mut t = Table::of("name", name);
        let (position, velocity) = boid.start();
        t.put_unless(Vec3::zeros(), "position_m", position);
        t.put_unless(Vec3::zeros(), "velocity_m_per_s", velocity);
        let [bank_time, roll_time] = boid.bank();
        t.put("mass_kg", boid.mass());
        t.put("radius_m", *radius);
        t.put("bank_time_s", bank_time);
        t.put("roll_time_s", roll_time);
        let visuals = boid.renderable().map_or(&[][..], |drawn| drawn.visuals());
        if let Some(visual) = visuals.first() {
            t.extend(surface::appearance(&visual.appearance, &Vec3::zeros(), &AppearanceSpec::default()));
        }
        t.extend(self.status(id));
        self.out += &t.under("[[flock.group]]");
    }

    fn field(&mut self, id: ObjectId, mut t: Table, targets: &Targets) {
        t.extend(self.enabled(id));
        if let Targets::Only(ids) = targets {
            let names = ids.iter().filter_map(|id| self.world.name(*id).map(str::to_owned));
            t.put("targets", names.collect::<Vec<String>>());
        }
        self.out += &t.under("[[field]]");
    }

    fn panels(&mut self, id: ObjectId, name: &str, panels: &Panels) {
        let mut t = field(name, "panels");
        t.extend(self.enabled(id));
        t.put("density_kg_per_m3", panels.density());
        t.put_unless(Vec3::zeros(), "wind_m_per_s", panels.wind());
        self.out += &t.under("[[field]]");
        for &Panel { id, part, point, normal, area, lift_slope, drag } in panels.panels() {
            let Some(body) = self.part_name(id, part) else {
                self.fault(format!("\"{name}\": a panel of a body that was removed"));
                continue;
            };
            let mut t = Table::of("body", body);
            t.put_unless(Vec3::zeros(), "point_m", point);
            t.put("normal", normal);
            t.put("area_m2", area);
            t.put("lift_slope", lift_slope);
            t.put("drag", drag);
            self.out += &t.under("[[field.panel]]");
        }
    }
}

fn field(name: &str, kind: &str) -> Table {
    let mut t = Table::of("name", name);
    t.put("type", kind);
    t
}

/// Returns a table with the constants of the forces of a flock.
fn steering(name: &str, s: &Steering) -> Table {
    let mut t = Table::of("name", name);
    t.put("avoidance_m2_per_s2", s.avoidance);
    t.put("matching_per_s", s.matching);
    t.put("clustering_per_s2", s.clustering);
    t.put("max_force_n", s.max_force);
    t.put("visibility_distance_m", s.visibility_distance);
    t.put("inner_visibility_distance_m", s.inner_visibility_distance);
    t.put("visibility_angle_deg", s.visibility_angle.to_degrees());
    t.put("inner_visibility_angle_deg", s.inner_visibility_angle.to_degrees());
    t.put("desired_speed_m_per_s", s.desired_speed);
    t.put("speed_rate_per_s", s.speed_rate);
    t.put("boundary_center_m", s.boundary_center);
    t.put("boundary_radius_m", s.boundary_radius);
    t.put("boundary_stiffness_n_per_m", s.boundary_stiffness);
    t
}
