//! Builds a world from a scene: shapes, meshes, bodies, joints and pairs.

use nalgebra::{Quaternion, Translation3, UnitQuaternion};
use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::solver::SolverSettings;
use tumble_core::{
    Anchor, ArticulatedBody, Drive, JointPlace, LoopJoint, LoopJointError, LoopJointKind, Material, ObjectId,
    PairMaterial, PairSide, RigidBody, Settings, ShapeFilter, Sleep, Template, Visual, World, WorldError,
};

use crate::build::appearance::{appearance, material_id};
use crate::build::articulated;
use crate::build::error::BuildError;
use crate::build::sensor::frame_of_body;
use crate::build::shapes::{self, Purpose, ShapeMaker};
use crate::notes::Notes;
use crate::parse::articulated::ArticulatedSpec;
use crate::parse::body::{BodySpec, MassSpec};
use crate::parse::file::SceneFile;
use crate::parse::loop_joint::{LoopDofSpec, LoopJointSpec, PartSpec};
use crate::parse::pair::{PairSideSpec, PairSpec};

impl SceneFile {
    /// Builds the world at time 0. Also returns notes about its meshes and robots. Sphere trees are
    /// taken from the cache that the environment names
    /// ([`TreeCache::of_environment`](tumble_core::collide::TreeCache::of_environment)) if it has
    /// them.
    ///
    /// # Errors
    /// [`BuildError`]: a mesh is unreadable or open, a body has no volume, a constant is invalid.
    pub fn build(&self) -> Result<(World, Notes), BuildError> {
        self.build_for(Purpose::Stepped)
    }

    /// Builds the same world for drawing only, as a cave facet needs it. Sphere trees and distance
    /// fields of meshes are built on first use, and overlaps of URDF links are not searched for.
    ///
    /// # Errors
    /// As [`build`](Self::build).
    pub fn build_drawn(&self) -> Result<(World, Notes), BuildError> {
        self.build_for(Purpose::Drawn)
    }

    fn build_for(&self, purpose: Purpose) -> Result<(World, Notes), BuildError> {
        let mut notes = self.notes.clone();
        if purpose == Purpose::Stepped
            && let Some(world) = self.saved_world(&mut notes).map_err(|why| self.saved_error(why))?
        {
            return Ok((world, notes));
        }
        let world = |source| BuildError::World { scene: self.file.clone(), source };
        let meshes =
            self.meshes.iter().map(|mesh| self.solid(mesh, purpose, &mut notes)).collect::<Result<Vec<_>, _>>()?;
        let mut built = World::new(self.settings()).map_err(world)?;
        built.set_stepper(self.world.stepper.new_stepper());
        built.set_solver(self.world.solver.new_solver());
        for spec in &self.bodies {
            let body = self.body(spec, &meshes)?;
            let id = built.add_boxed(Box::new(body), spec.mode).map_err(|e| self.body_error(spec, e))?;
            built.set_collidable(id, spec.collidable).map_err(world)?;
            built.set_enabled(id, spec.enabled).map_err(world)?;
        }
        let mut maker = ShapeMaker::new(&meshes, purpose);
        for spec in &self.articulated {
            self.add_articulated(spec, &mut maker, &mut built)?;
            let said = spec.notes.iter().cloned().chain(maker.notes.take());
            notes.extend(said.map(|note| format!("{}: articulated \"{}\": {note}", self.file, spec.name)));
        }
        for spec in &self.loop_joints {
            self.add_loop_joint(spec, &mut built)?;
        }
        for spec in &self.mimics {
            self.add_mimic(spec, &mut built)?;
        }
        for spec in &self.templates {
            let body = self.body(&spec.body, &meshes)?;
            let added = Template::add(&mut built, &spec.body.name, &body, spec.count, spec.reuse);
            added.map_err(|e| self.body_error(&spec.body, e))?;
        }
        for spec in &self.sensors {
            self.add_sensor(spec, &meshes, &mut built)?;
        }
        for spec in &self.pairs {
            self.add_pair(spec, &mut built).map_err(world)?;
        }
        self.add_behaviors(&mut built)?;
        // they may enable and disable all of the above
        for spec in &self.events {
            spec.add(&mut built).map_err(world)?;
        }
        Ok((built, notes))
    }

    fn add_articulated(
        &self,
        spec: &ArticulatedSpec,
        maker: &mut ShapeMaker<'_>,
        world: &mut World,
    ) -> Result<(), BuildError> {
        let wrong = |why: String| BuildError::Articulated { scene: self.file.clone(), body: spec.name.clone(), why };
        let body = articulated::body(spec, maker).map_err(wrong)?;
        let id = world.add(body).map_err(|e| wrong(e.to_string()))?;
        let set = |world: &mut World| {
            world.set_mode(id, spec.mode)?;
            world.set_collidable(id, spec.collidable)?;
            world.set_enabled(id, spec.enabled)
        };
        set(world).map_err(|e: WorldError| wrong(e.to_string()))
    }

    fn add_loop_joint(&self, spec: &LoopJointSpec, world: &mut World) -> Result<(), BuildError> {
        let (a, b) = (spec.a.and_then(|a| self.part(world, &a)), spec.b.and_then(|b| self.part(world, &b)));
        if let Some(anchors) = spec.anchors {
            let [a, b] = [(a, spec.a), (b, spec.b)].map(|(part, named)| Anchor {
                part,
                frame: named.map_or_else(Pose::identity, |named| self.frame_in_part(world, &named)),
                link: None,
            });
            let [a, b] = [(a, anchors[0]), (b, anchors[1])].map(|(a, frame)| Anchor { frame: a.frame * frame, ..a });
            let made = LoopJoint::new(spec.name.as_str(), spec.kind, a, b);
            let ground = spec.ground_m.map(Vec3::from);
            let made = made.and_then(|j| j.with_transmission(|t| (t.ground, t.references) = (ground, spec.references)));
            return self.add_joint(spec, made, world);
        }
        let place = JointPlace {
            point: Vec3::from(spec.position_m),
            second_point: spec.second_position_m.map(Vec3::from),
            axis: Vec3::from(spec.axis),
            second_axis: spec.second_axis.map(Vec3::from),
            ground: spec.ground_m.map(Vec3::from),
        };
        let made = LoopJoint::joining(spec.name.as_str(), spec.kind, world, a, b, place);
        self.add_joint(spec, made, world)
    }

    fn add_joint(
        &self,
        spec: &LoopJointSpec,
        made: Result<LoopJoint, LoopJointError>,
        world: &mut World,
    ) -> Result<(), BuildError> {
        let wrong = |why: String| BuildError::LoopJoint { scene: self.file.clone(), why };
        let joint = made.and_then(|joint| with_settings(joint, spec)).map_err(|e| wrong(e.to_string()))?;
        let id = world.add(joint).map_err(|e| wrong(e.to_string()))?;
        if let Some(angle) = spec.angle_rad {
            world.set_turn(id, angle).map_err(|e| wrong(e.to_string()))?;
        }
        world.set_enabled(id, spec.enabled).map_err(|e| wrong(e.to_string()))
    }

    /// Returns the pose of the frame of a body or link in that of its part.
    fn frame_in_part(&self, world: &World, part: &PartSpec) -> Pose {
        let in_part = match *part {
            PartSpec::Body(body) => world.find(&self.bodies[body].name).map(|id| frame_of_body(world, id)),
            PartSpec::Link(spec, link) => world.find(&self.articulated[spec].name).and_then(|id| {
                let model = world.get::<ArticulatedBody>(id)?.model();
                Some(model.frame(&self.articulated[spec].links[link].name)?.pose)
            }),
        };
        in_part.unwrap_or_else(Pose::identity)
    }

    fn saved_error(&self, why: String) -> BuildError {
        let file = self.saved.as_ref().map(|saved| saved.path.clone()).unwrap_or_default();
        BuildError::Saved { scene: self.file.clone(), file, why }
    }

    fn add_pair(&self, spec: &PairSpec, world: &mut World) -> Result<(), WorldError> {
        let [a, b] = spec.sides.map(|side| self.sides(world, side));
        let PairSpec { restitution, friction, rolling_friction, torsional_friction, collides, .. } = *spec;
        let material = PairMaterial { restitution, friction, rolling_friction, torsional_friction, collides };
        for (a, b) in a.iter().flat_map(|a| b.iter().map(move |b| (*a, *b))) {
            world.set_pair_material(a, b, material)?;
        }
        Ok(())
    }

    /// Returns one side of a pair in the world: several parts for a link with several shapes, without those of links that are fixed
    /// to it.
    fn sides(&self, world: &World, side: PairSideSpec) -> Vec<PairSide> {
        let object = |name: &str| world.find(name).map(PairSide::Object).into_iter().collect();
        match side {
            PairSideSpec::Body(body) => object(&self.bodies[body].name),
            PairSideSpec::Articulated(spec) => object(&self.articulated[spec].name),
            PairSideSpec::Material(material) => vec![PairSide::Material(material_id(Some(material)))],
            PairSideSpec::Link(spec, link) => {
                let spec = &self.articulated[spec];
                let found = world.find(&spec.name).and_then(|id| Some((id, world.get::<ArticulatedBody>(id)?)));
                let Some((id, body)) = found else { return Vec::new() };
                // the shapes of the link alone: those of fixed links have pairs of their own
                let parts = body.parts_of_link(&spec.links[link].name).unwrap_or_default();
                parts.into_iter().map(|part| PairSide::Part(id, part)).collect()
            }
        }
    }

    /// Returns the object and part number of a part in the world.
    pub(crate) fn part(&self, world: &World, part: &PartSpec) -> Option<(ObjectId, usize)> {
        match *part {
            PartSpec::Body(body) => Some((world.find(&self.bodies[body].name)?, 0)),
            PartSpec::Link(spec, link) => {
                let spec = &self.articulated[spec];
                let id = world.find(&spec.name)?;
                let model = world.get::<ArticulatedBody>(id)?.model();
                let carrier = model.frame(&spec.links[link].name)?.link;
                Some((id, carrier.unwrap_or(model.links().len())))
            }
        }
    }

    /// Returns the settings of the world.
    pub(crate) fn settings(&self) -> Settings {
        let (w, base) = (&self.world, Settings::default());
        base.with_gravity(Vec3::from(w.gravity_m_per_s2))
            .with_dt(w.dt_s)
            .with_substeps(w.substeps)
            .with_integrator(w.integrator.into())
            .with_integrator_tolerance(w.integrator_tolerance)
            .with_solver_settings(SolverSettings {
                max_sweeps: w.iterations,
                max_relaxations: w.max_relaxations,
                tolerance: w.solver_tolerance_m_per_s,
                budget: w.budget,
            })
            .with_projection_sweeps(w.projection_sweeps)
            .with_stabilize_positions(w.stabilize_positions)
            .with_recovery_speed(w.recovery_speed_m_per_s)
            .with_contact_tolerance(w.contact_tolerance_m)
            .with_drift_tolerance(w.drift_tolerance_m.unwrap_or(base.drift_tolerance.max(w.contact_tolerance_m)))
            .with_sleep(w.sleep_after_s.map(|after| Sleep { after, within: w.sleep_within_m }))
            .with_combine_friction(w.combine_friction)
            .with_combine_restitution(w.combine_restitution)
            .with_event_impulse(w.event_impulse_n_s)
            .with_max_turn(w.max_turn_rad)
            .with_threads(w.threads)
    }

    fn body(&self, spec: &BodySpec, meshes: &[Shape]) -> Result<RigidBody, BuildError> {
        let shape = shapes::make(&spec.shape, meshes).map_err(|e| self.body_error(spec, e))?;
        let body = RigidBody::fixed(shape.clone());
        let body = match spec.mass {
            Some(MassSpec::Mass(mass)) => body.with_mass(mass),
            Some(MassSpec::Density(density)) => body.with_density(density),
            Some(MassSpec::Usual) => body.with_density(shape.own_density().unwrap_or(RigidBody::DEFAULT_DENSITY)),
            None => shape.own_density().into_iter().fold(body, RigidBody::with_density),
        };
        let body = spec.inertia_kg_m2.into_iter().fold(body, RigidBody::with_inertia);
        let body = spec.center_m.into_iter().fold(body, |body, center| body.with_center_of_mass(Vec3::from(center)));
        let [x, y, z, w] = spec.orientation_xyzw;
        let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        let pose = Pose::from_parts(Translation3::from(Vec3::from(spec.position_m)), rotation);
        let material = Material { id: material_id(spec.material), ..spec.contact };
        let body = shapes::own_materials(&spec.shape).fold(body, |body, (n, own)| body.with_shape_material(n, own));
        let body = spec.shape_name.iter().fold(body, |body, name| body.with_shape_name(name));
        let mut body = body
            .with_name(&spec.name)
            .with_pose(pose)
            .with_velocity(Vec3::from(spec.velocity_m_per_s))
            .with_angular_velocity(Vec3::from(spec.angular_velocity_rad_per_s))
            .with_material(material)
            .with_contact_mode(spec.contacts)
            .with_visuals(visuals(spec, shape));
        if let Some(camera) = &spec.mounts.camera {
            body = body.with_camera(camera.clone());
        }
        if let Some(light) = &spec.mounts.light {
            body = body.with_light(light.clone());
        }
        body.linear_damping = spec.linear_damping_per_s;
        body.angular_damping = spec.angular_damping_per_s;
        (body.gravity_scale, body.locked) = (spec.gravity_scale, spec.locked);
        (body.group, body.mask, body.sensor) = (spec.group, spec.mask, spec.sensor);
        body.one_way = spec.one_way.map(Vec3::from);
        let whole = ShapeFilter { group: spec.group, mask: spec.mask, sensor: spec.sensor };
        shapes::own_filters(&spec.shape, whole).for_each(|(n, own)| body.set_shape_filter(n, Some(own)));
        Ok(body)
    }

    fn body_error(&self, spec: &BodySpec, why: impl ToString) -> BuildError {
        BuildError::Body { scene: self.file.clone(), body: spec.name.clone(), why: why.to_string() }
    }
}

fn visuals(spec: &BodySpec, shape: Shape) -> Vec<Visual> {
    if !spec.visible {
        return Vec::new();
    }
    let appearance = appearance(&spec.appearance, &shape.center_of_mass());
    vec![Visual::shape(0, Pose::identity(), shape, appearance)]
}

/// Returns a loop joint with the length, the settings and the strength of its description.
fn with_settings(joint: LoopJoint, spec: &LoopJointSpec) -> Result<LoopJoint, LoopJointError> {
    let joint = joint.with_transmission(|t| {
        (t.teeth, t.radius, t.pitch, t.ratio) = (spec.teeth, spec.radius_m, spec.pitch_m, spec.ratio);
    })?;
    let start = joint.length();
    let joint = match spec.length_m {
        Some(length) => joint.with_length(length)?,
        None => joint,
    };
    let mut joint = joint.with_breaking_force(spec.breaking_force_n)?.with_breaking_torque(spec.breaking_torque_n_m)?;
    for (k, LoopDofSpec { settings, armature, holds_start }) in spec.dofs.iter().enumerate() {
        let mut dof = settings.clone();
        if let (LoopJointKind::Spring, Some(spring)) = (spec.kind, &mut dof.spring) {
            spring.rest = joint.length();
        }
        if let (true, Drive::Position { target, .. }) = (*holds_start && spec.kind.has_length(), &mut dof.drive) {
            *target = start;
        }
        joint.set_dof_at(k, dof)?;
        joint.set_armature_at(k, *armature)?;
    }
    joint.set_cone(spec.cone_rad)?;
    joint.set_twist_limits(spec.twist_limits_rad)?;
    Ok(joint)
}
