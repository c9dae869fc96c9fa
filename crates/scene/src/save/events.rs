//! `[[template]]`, `[[event]]` and `[[sensor]]`.

use tumble_core::collide::Vec3;
use tumble_core::{
    Action, Anchor, ArticulatedBody, CameraChange, Ends, ObjectId, RigidBody, ScriptedEvent, Sensor, SensorPlace,
    Smoothness, Subject, Template, Trigger,
};

use super::Writer;
use super::joints::link_name;
use super::text::Table;

impl Writer<'_> {
    /// Returns the name of a body, or `OBJECT/LINK` of a link; `None` for an object that was removed.
    pub(super) fn part_name(&self, id: ObjectId, part: usize) -> Option<String> {
        let name = self.world.name(id)?.to_owned();
        match self.world.get::<ArticulatedBody>(id) {
            Some(body) => link_name(body, part).map(|(link, _)| format!("{name}/{link}")),
            None => Some(name),
        }
    }

    /// Writes a template by its first body.
    pub(super) fn template(&mut self, name: &str, template: &Template, enabled: bool) {
        let bodies = template.bodies();
        let Some(body) = bodies.first().and_then(|id| self.world.get::<RigidBody>(*id)) else {
            return self.fault(format!("\"{name}\", a template whose bodies were removed"));
        };
        let mut t = Table::of("name", name);
        t.put("max", bodies.len() as u32);
        t.put_unless(false, "reuse", template.reuses());
        if !enabled {
            self.fault(format!("\"{name}\", a template that is disabled, which has no effect; enable it"));
        }
        t.put_pose(&body.initial_pose);
        t.extend(self.constants(name, body));
        self.out += &t.under("[[template]]");
    }

    /// Writes an event.
    pub(super) fn event(&mut self, name: &str, event: &ScriptedEvent, enabled: bool) {
        let mut t = Table::of("name", name);
        let Some(when) = self.trigger(event.trigger()) else {
            return self.fault(format!("\"{name}\", an event of an object that was removed"));
        };
        t.put("when", when);
        let deeds: Option<Vec<Table>> = event.actions().iter().map(|action| self.action(action)).collect();
        match deeds {
            Some(deeds) => t.put("do", deeds),
            None => return self.fault(format!("\"{name}\", an event that acts on an object that was removed")),
        }
        t.put_unless(0.0, "delay_s", event.delay());
        t.put_unless(u32::MAX, "times", event.times());
        t.put_unless(true, "enabled", enabled);
        self.out += &t.under("[[event]]");
    }

    fn trigger(&self, trigger: &Trigger) -> Option<Table> {
        let one = |id: &ObjectId| self.world.name(*id).map(str::to_owned);
        let all = |ids: &[ObjectId]| ids.iter().map(one).collect::<Option<Vec<String>>>();
        let sides = |a, b: &[ObjectId]| Some(if b.is_empty() { vec![all(a)?] } else { vec![all(a)?, all(b)?] });
        Some(match trigger {
            Trigger::Time { at } => Table::of("time_s", *at),
            Trigger::Every { period, first } => {
                let mut t = Table::of("every_s", *period);
                t.put("first_s", *first);
                t
            }
            Trigger::Contact { a, b, impulse } => {
                let mut t = Table::of("contact", sides(a, b)?);
                t.put_unless(0.0, "impulse_n_s", *impulse);
                t
            }
            Trigger::Touching { a, b } => Table::of("touching", sides(a, b)?),
            Trigger::Asleep { bodies } => Table::of("asleep", all(bodies)?),
            Trigger::Awake { bodies } => Table::of("awake", all(bodies)?),
            Trigger::Parting { a, b } => Table::of("parting", sides(a, b)?),
            Trigger::Enters { sensor, bodies } | Trigger::Leaves { sensor, bodies } => {
                let key = if matches!(trigger, Trigger::Enters { .. }) { "enters" } else { "leaves" };
                let mut t = Table::of(key, one(sensor)?);
                t.put_unless(Vec::new(), "bodies", all(bodies)?);
                t
            }
            Trigger::Breaks { joint } => Table::of("broken", one(joint)?),
            Trigger::Key { key } => Table::of("key", key),
            Trigger::Fired { event } => Table::of("after", one(event)?),
        })
    }

    fn action(&self, action: &Action) -> Option<Table> {
        let name = |id: &ObjectId| self.world.name(*id).map(str::to_owned);
        let who = |body: &Subject| match body {
            Subject::Part(id, part) => self.part_name(*id, *part),
            Subject::Other => Some("other".to_owned()),
        };
        Some(match action {
            Action::Spawn { template, pose, velocity, angular_velocity, from } => {
                let mut t = Table::of("spawn", name(template)?);
                t.put_pose(pose);
                t.extend(velocities(velocity, angular_velocity));
                if let Some(from) = from {
                    t.put("from", name(from)?);
                }
                t
            }
            Action::Push { body, impulse, point } => {
                let mut t = Table::of("push", who(body)?);
                t.put("impulse_n_s", *impulse);
                point.iter().for_each(|point| t.put("point_m", *point));
                t
            }
            Action::Force { body, force, torque, duration } => {
                let mut t = Table::of("force", who(body)?);
                t.put("force_n", *force);
                t.put("torque_n_m", *torque);
                t.put("duration_s", *duration);
                t
            }
            Action::SetVelocity { body, velocity, angular_velocity } => {
                let mut t = Table::of("set_velocity", who(body)?);
                t.extend(velocities(velocity, angular_velocity));
                t
            }
            Action::Remove(body) => Table::of("remove", who(body)?),
            Action::Enable(object) => Table::of("enable", name(object)?),
            Action::Disable(object) => Table::of("disable", name(object)?),
            Action::Attach { joint, here } => {
                let mut t = Table::of("attach", name(joint)?);
                t.put_unless(false, "here", *here);
                t
            }
            Action::Recolor { body, color } => {
                let mut t = Table::of("recolor", who(body)?);
                t.put("color", *color);
                t
            }
            Action::MoveAlong { body, path } => {
                let mut t = Table::of("move_along", name(body)?);
                t.put_unless("c2", "smoothness", if path.smoothness() == Smoothness::C1 { "c1" } else { "c2" });
                let ends = match path.ends() {
                    Ends::Rest => "rest",
                    Ends::Free => "free",
                    Ends::Loop => "loop",
                };
                t.put_unless("rest", "ends", ends);
                let keyframes = path.keyframes().iter().map(|keyframe| {
                    let mut t = Table::of("time_s", keyframe.time);
                    t.put_pose(&keyframe.pose);
                    t
                });
                t.put("keyframes", keyframes.collect::<Vec<Table>>());
                t
            }
            Action::Drive { body, dof, target, .. } => {
                let (drive, k) = match self.world.get::<ArticulatedBody>(*body) {
                    Some(_) => self.link_of_dof(*body, *dof)?,
                    None => (name(body)?, *dof),
                };
                let mut t = Table::of("drive", drive);
                t.put_unless(0, "dof", k as u32);
                t.put("target", *target);
                t
            }
            Action::Camera(CameraChange::Named(name)) => Table::of("camera", name),
            Action::Camera(CameraChange::LookAt { eye, target, vertical_fov }) => {
                let mut camera = Table::of("eye_m", *eye);
                camera.put("target_m", *target);
                camera.put("vertical_fov_deg", vertical_fov.to_degrees());
                Table::of("camera", camera)
            }
            Action::Light(change) => {
                let mut t = Table::of("light", change.light as u32 + 1);
                change.intensity.iter().for_each(|intensity| t.put("intensity", *intensity));
                change.color.iter().for_each(|color| t.put("color", *color));
                t
            }
        })
    }

    /// Returns `OBJECT/LINK` of the link that a degree of freedom moves, and its number among those of the link's joint.
    fn link_of_dof(&self, id: ObjectId, dof: usize) -> Option<(String, usize)> {
        let body = self.world.get::<ArticulatedBody>(id)?;
        let link = body.model().links().iter().find(|link| (link.v..link.v + link.joint.dof()).contains(&dof))?;
        Some((format!("{}/{}", self.world.name(id)?, link.name), dof - link.v))
    }

    /// Returns `OBJECT/LINK` of the link that a degree of freedom moves.
    pub(super) fn dof_name(&self, id: ObjectId, dof: usize) -> Option<String> {
        let body = self.world.get::<ArticulatedBody>(id)?;
        let link = body.model().links().iter().find(|link| link.v == dof)?;
        Some(format!("{}/{}", self.world.name(id)?, link.name))
    }

    /// Writes a measuring sensor.
    pub(super) fn sensor(&mut self, name: &str, sensor: &Sensor, enabled: bool) {
        let kind = sensor.kind();
        let title = format!("the sensor \"{name}\"");
        let mut t = Table::of("name", name);
        t.put("type", kind.name());
        let on = match sensor.place() {
            SensorPlace::Site(Anchor { part: None, frame, .. }) => {
                t.put_pose(frame);
                None
            }
            SensorPlace::Site(anchor) => {
                let (part, frame) = self.anchor(&title, anchor);
                t.put_pose(&frame);
                part
            }
            SensorPlace::LoopJoint(joint) => self.world.name(*joint).map(str::to_owned),
            SensorPlace::Dof(id, dof) => self.dof_name(*id, *dof),
        };
        on.iter().for_each(|on| t.put("on", on));
        if let Some(reference) = sensor.reference() {
            self.anchor(&title, reference).0.iter().for_each(|part| t.put("relative_to", part));
        }
        if let Some(volume) = sensor.volume() {
            t.put("volume", self.meshes.shape(volume));
        }
        t.put_unless(f64::INFINITY, "cutoff", sensor.cutoff());
        if sensor.kind().is_camera() {
            t.put("resolution", sensor.optics().resolution);
            t.put("vertical_fov_rad", sensor.optics().vertical_fov);
        }
        let noise = sensor.noise();
        t.put_unless(0.0, "deviation", noise.deviation);
        t.put_unless(0.0, "bias_walk", noise.bias_walk);
        t.put_unless(0.0, "quantization", noise.quantization);
        t.put_unless(0, "delay", noise.delay);
        t.put_unless(0, "seed", noise.seed);
        t.put_unless(true, "enabled", enabled);
        self.out += &t.under("[[sensor]]");
    }
}

fn velocities(velocity: &Vec3, angular_velocity: &Vec3) -> Table {
    let mut t = Table::default();
    t.put_unless(Vec3::zeros(), "velocity_m_per_s", *velocity);
    t.put_unless(Vec3::zeros(), "angular_velocity_rad_per_s", *angular_velocity);
    t
}
