//! Joints that sliders move. While time stands a slider sets the position of its joint, exactly; while it goes it sets the target of a drive, so that the robot
//! moves by the same physics as everything else.
//!
//! The drives hold all joints with sliders: critically damped, of [`FREQUENCY`] in proportion to the inertia that the joint moves at that moment (the
//! diagonal of the mass matrix), within the joint's effort.

use tumble::dynamics::articulated::{ArticulatedBody, DofSettings, Drive, Kinematics, MassMatrix};
use tumble::dynamics::{ObjectId, World, WorldError};
use tumble::render::Slider;
use tumble::scene::SceneFile;

/// Of the drives that hold, rad/s: a joint is there after a tenth of a second, and gravity bends one that carries a weight at 1 m by g/ω² = 0.003 rad.
const FREQUENCY: f64 = 60.0;
/// Range of a joint without limits, to both sides of 0: rad, and m for a prismatic one.
const UNLIMITED: [f64; 2] = [std::f64::consts::PI, 1.0];

/// A joint of one freedom that follows no other.
pub struct SliderJoint {
    name: String,
    body: ObjectId,
    /// Its place in `v` and in `q`.
    freedom: usize,
    position: usize,
    range: [f64; 2],
    unit: &'static str,
    /// Greatest torque or force of its motor, N·m or N; infinite where the file names none.
    effort: f64,
    /// The drive that it has by itself.
    own: Drive,
    /// The freedoms that follow it: place in `q`, multiplier and offset.
    followers: Vec<(usize, f64, f64)>,
}

/// All joints with sliders.
pub struct Joints {
    joints: Vec<SliderJoint>,
    /// Targets, while the joints are held.
    targets: Option<Vec<f64>>,
}

impl Joints {
    /// Those of a scene's articulated bodies; none where closures join anything, since they would tear.
    pub fn new(scene: &SceneFile, world: &World) -> Joints {
        let mut joints = Vec::new();
        let several = scene.articulated.len() > 1;
        for spec in scene.articulated.iter().filter(|_| scene.loop_joints.is_empty()) {
            let Some(id) = world.find(&spec.name) else { continue };
            let Some(body) = world.get::<ArticulatedBody>(id) else { continue };
            let place = |link: usize| {
                let freedom = body.dof_of(&spec.links[link].name)?;
                Some((freedom, body.position_of(freedom)?))
            };
            for (number, link) in spec.links.iter().enumerate().filter(|(_, link)| link.joint.mimic.is_none()) {
                let Some((freedom, position)) = place(number) else { continue };
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
                    freedom,
                    position,
                    range: joint.dof.limits.unwrap_or([-most, most]),
                    unit: if slides { "m" } else { "rad" },
                    effort: joint.effort.unwrap_or(f64::INFINITY),
                    own: joint.dof.drive.clone(),
                    followers: spec.links.iter().enumerate().filter_map(follower).collect(),
                });
            }
        }
        Joints { joints, targets: None }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.joints.len()
    }

    /// Whether drives hold them.
    pub fn held(&self) -> bool {
        self.targets.is_some()
    }

    /// The sliders for a world as it is.
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

    /// Moves a joint to a share of its range.
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

    /// Moves a joint by a share of its range, from its target where it is held.
    pub fn nudge(&mut self, world: &mut World, index: usize, share: f64, paused: bool) -> Result<(), WorldError> {
        let Some(joint) = self.joints.get(index) else { return Ok(()) };
        let [least, greatest] = joint.range;
        let from = self.targets.as_ref().map(|targets| targets[index]).or_else(|| joint.value(world)).unwrap_or(least);
        self.set(world, index, (from + share * (greatest - least)).clamp(least, greatest), paused)
    }

    /// The position where time stands, else the target of the drive; all are then held.
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

    /// Drives hold all joints where they are.
    pub fn hold(&mut self, world: &mut World) {
        self.targets = Some(self.joints.iter().map(|joint| joint.value(world).unwrap_or(0.0)).collect());
        self.drive(world);
    }

    /// Joints have the drives again that the scene gives them.
    pub fn release(&mut self, world: &mut World) {
        self.targets = None;
        self.drive(world);
    }

    /// Gives each joint the drive of its target, or its own.
    fn drive(&self, world: &mut World) {
        for (index, joint) in self.joints.iter().enumerate() {
            let drive = match &self.targets {
                Some(targets) => joint.holding(world, targets[index]),
                None => joint.own.clone(),
            };
            if let Some(body) = world.get_mut::<ArticulatedBody>(joint.body) {
                let freedom = DofSettings { drive, ..body.dofs()[joint.freedom].clone() };
                // gains and targets are finite and positive; a joint that refuses them keeps what it has
                let _ = body.set_dof(joint.freedom, freedom);
            }
        }
    }
}

impl SliderJoint {
    fn value(&self, world: &World) -> Option<f64> {
        world.state_of(self.body)?.get(self.position).copied()
    }

    /// Puts the joint at a position, at rest, and with it those that follow it.
    fn put(&self, world: &mut World, value: f64) -> Result<(), WorldError> {
        let (Some(state), Some(body)) = (world.state_of(self.body), world.get::<ArticulatedBody>(self.body)) else {
            return Err(WorldError::Stale);
        };
        let mut x = state.to_vec();
        let rates = body.model().positions();
        x[self.position] = value;
        x[rates + self.freedom] = 0.0;
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

    /// What the joint moves while all others stand still, kg·m² or kg.
    fn inertia(&self, world: &World) -> Option<f64> {
        let (state, body) = (world.state_of(self.body)?, world.get::<ArticulatedBody>(self.body)?);
        let model = body.model();
        let dof = model.dof();
        let (q, v) = state.split_at(model.positions());
        let mut kinematics = Kinematics::new(model);
        kinematics.refresh(model, q, v.get(..dof)?);
        let mut matrix = vec![0.0; dof * dof];
        MassMatrix::new(model).write(model, &kinematics, &mut matrix);
        matrix.get(self.freedom * (dof + 1)).copied()
    }
}
