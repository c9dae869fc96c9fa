//! Joints that sliders move. While the simulation is paused, a slider sets the position of its
//! joint exactly. While it runs, the slider sets the target of a drive, so that the robot moves by
//! the same physics as everything else.
//!
//! The drives hold all joints that have sliders. They are critically damped, with the angular
//! frequency [`FREQUENCY`] for the inertia that the joint moves at that moment (the diagonal of the
//! mass matrix), within the joint's effort.

use tumble::dynamics::articulated::{ArticulatedBody, DofSettings, Drive, Kinematics, MassMatrix};
use tumble::dynamics::{ObjectId, World, WorldError};
use tumble::render::Slider;
use tumble::scene::SceneFile;

/// Angular frequency of the drives, rad/s: a joint arrives after 0.1 s, and gravity deflects one
/// that carries a weight at 1 m by g/ω² = 0.003 rad.
const FREQUENCY: f64 = 60.0;
/// Range of a joint without limits, to both sides of 0: rad for revolute joints, m for prismatic
/// ones.
const UNLIMITED: [f64; 2] = [std::f64::consts::PI, 1.0];

/// A joint with one degree of freedom that is not coupled to another joint.
pub struct SliderJoint {
    name: String,
    body: ObjectId,
    /// Index in `v` and index in `q`.
    dof_index: usize,
    position: usize,
    range: [f64; 2],
    unit: &'static str,
    /// Largest torque or force of its motor, N·m or N; infinite if the file gives none.
    effort: f64,
    /// The drive that the scene gives it.
    own: Drive,
    /// The joints coupled to it: index in `q`, multiplier and offset.
    followers: Vec<(usize, f64, f64)>,
}

/// All joints with sliders.
pub struct Joints {
    joints: Vec<SliderJoint>,
    /// The targets while drives hold the joints.
    targets: Option<Vec<f64>>,
}

impl Joints {
    /// Collects the joints of a scene's articulated bodies. There are none if the scene has loop
    /// joints, which a position set by hand would open.
    pub fn new(scene: &SceneFile, world: &World) -> Joints {
        let mut joints = Vec::new();
        let several = scene.articulated.len() > 1;
        for spec in scene.articulated.iter().filter(|_| scene.loop_joints.is_empty() && scene.mimics.is_empty()) {
            let Some(id) = world.find(&spec.name) else { continue };
            let Some(body) = world.get::<ArticulatedBody>(id) else { continue };
            let place = |link: usize| {
                let dof_index = body.dof_of(&spec.links[link].name)?;
                Some((dof_index, body.position_of(dof_index)?))
            };
            for (number, link) in spec.links.iter().enumerate().filter(|(_, link)| link.joint.mimic.is_none()) {
                let Some((dof_index, position)) = place(number) else { continue };
                let joint = &link.joint;
                let slides = matches!(joint.kind, tumble::dynamics::Joint::Prismatic { .. });
                let most = UNLIMITED[usize::from(slides)];
                let follower = |(k, link): (usize, &tumble::scene::LinkSpec)| {
                    let mimic = link.joint.mimic.filter(|mimic| mimic.link == number)?;
                    Some((place(k)?.1, mimic.multiplier, mimic.offset))
                };
                joints.push(SliderJoint {
                    name: if several { format!("{}/{}", spec.name, joint.name) } else { joint.name.clone() },
                    body: id,
                    dof_index,
                    position,
                    range: joint.dof.limits.unwrap_or([-most, most]),
                    unit: if slides { "m" } else { "rad" },
                    effort: joint.dof.effort,
                    own: joint.dof.drive.clone(),
                    followers: spec.links.iter().enumerate().filter_map(follower).collect(),
                });
            }
        }
        Joints { joints, targets: None }
    }

    /// The number of joints.
    pub fn len(&self) -> usize {
        self.joints.len()
    }

    /// Returns whether drives hold the joints.
    pub fn held(&self) -> bool {
        self.targets.is_some()
    }

    /// Returns the sliders for the world's present state.
    pub fn sliders(&self, world: &World, chosen: usize) -> Vec<Slider> {
        let slider = |(index, joint): (usize, &SliderJoint)| Slider {
            name: joint.name.clone(),
            value: joint.value(world).unwrap_or(f64::NAN),
            range: joint.range,
            unit: joint.unit,
            target: self.targets.as_ref().map(|targets| targets[index]),
            chosen: index == chosen,
        };
        self.joints.iter().enumerate().map(slider).collect()
    }

    /// Moves a joint to a fraction of its range.
    pub fn set_fraction(
        &mut self,
        world: &mut World,
        index: usize,
        share: f64,
        paused: bool,
    ) -> Result<(), WorldError> {
        let Some(joint) = self.joints.get(index) else { return Ok(()) };
        let [least, greatest] = joint.range;
        self.set(world, index, least + share.clamp(0.0, 1.0) * (greatest - least), paused)
    }

    /// Moves a joint by a fraction of its range, from its target if it is held.
    pub fn nudge(&mut self, world: &mut World, index: usize, share: f64, paused: bool) -> Result<(), WorldError> {
        let Some(joint) = self.joints.get(index) else { return Ok(()) };
        let [least, greatest] = joint.range;
        let from = self.targets.as_ref().map(|targets| targets[index]).or_else(|| joint.value(world)).unwrap_or(least);
        self.set(world, index, (from + share * (greatest - least)).clamp(least, greatest), paused)
    }

    /// Sets the position while paused. While the simulation runs, sets the target of the drive; all
    /// joints are then held.
    fn set(&mut self, world: &mut World, index: usize, value: f64, paused: bool) -> Result<(), WorldError> {
        if paused {
            self.joints[index].put(world, value)?;
        } else if !self.held() {
            self.hold(world);
        }
        if let Some(targets) = &mut self.targets {
            targets[index] = value;
            self.drive(world);
        }
        Ok(())
    }

    /// Holds all joints at their present positions.
    pub fn hold(&mut self, world: &mut World) {
        self.targets = Some(self.joints.iter().map(|joint| joint.value(world).unwrap_or(0.0)).collect());
        self.drive(world);
    }

    /// Gives the joints back the drives of the scene.
    pub fn release(&mut self, world: &mut World) {
        self.targets = None;
        self.drive(world);
    }

    /// Sets the drive of each joint: towards its target, or its own.
    fn drive(&self, world: &mut World) {
        for (index, joint) in self.joints.iter().enumerate() {
            let drive = match &self.targets {
                Some(targets) => joint.holding(world, targets[index]),
                None => joint.own.clone(),
            };
            if let Some(body) = world.get_mut::<ArticulatedBody>(joint.body) {
                let settings = DofSettings { drive, ..body.dofs()[joint.dof_index].clone() };
                // gains and targets are finite and positive; a joint that refuses them keeps its
                // drive
                let _ = body.set_dof(joint.dof_index, settings);
            }
        }
    }
}

impl SliderJoint {
    fn value(&self, world: &World) -> Option<f64> {
        world.state_of(self.body)?.get(self.position).copied()
    }

    /// Puts the joint, and the joints coupled to it, at a position and at rest.
    fn put(&self, world: &mut World, value: f64) -> Result<(), WorldError> {
        let (Some(state), Some(body)) = (world.state_of(self.body), world.get::<ArticulatedBody>(self.body)) else {
            return Err(WorldError::Stale);
        };
        let mut x = state.to_vec();
        let rates = body.model().positions();
        x[self.position] = value;
        x[rates + self.dof_index] = 0.0;
        self.followers.iter().for_each(|(position, multiplier, offset)| x[*position] = multiplier * value + offset);
        world.write_state_of(self.body, &x)
    }

    fn holding(&self, world: &World, target: f64) -> Drive {
        let inertia = self.inertia(world).filter(|m| m.is_finite() && *m > 0.0).unwrap_or(1.0);
        Drive::Position {
            stiffness: FREQUENCY * FREQUENCY * inertia,
            damping: 2.0 * FREQUENCY * inertia,
            target,
            velocity: 0.0,
            limit: self.effort,
        }
    }

    /// The inertia that the joint moves while all others are fixed, kg·m² or kg.
    fn inertia(&self, world: &World) -> Option<f64> {
        let (state, body) = (world.state_of(self.body)?, world.get::<ArticulatedBody>(self.body)?);
        let model = body.model();
        let dof = model.dof();
        let (q, v) = state.split_at(model.positions());
        let mut kinematics = Kinematics::new(model);
        kinematics.refresh(model, q, v.get(..dof)?);
        let mut matrix = vec![0.0; dof * dof];
        MassMatrix::new(model).write(model, &kinematics, &mut matrix);
        matrix.get(self.dof_index * (dof + 1)).copied()
    }
}
