//! tumble: the robot as a model, with one state at a time or several in lanes.

use super::robot::{Motion, Robot, base};
use tumble_collide::{Mat3, Pose, Vec3};
use tumble_core::articulated::{BatchDynamics, Dynamics, Lanes, Scratch, forward_dynamics};
use tumble_core::{Joint, LinkMass, Model, ModelBuilder};

/// Gravity as in dynibo.
pub const GRAVITY: Vec3 = Vec3::new(0.0, 0.0, -9.80665);

/// Returns the model of a robot; a floating base is link 0.
pub fn model(robot: &Robot) -> Model {
    let mut builder = ModelBuilder::new();
    let mass = |mass, center: [f64; 3], moments: [f64; 3]| LinkMass {
        mass,
        center: center.into(),
        inertia: Mat3::from_diagonal(&moments.into()),
    };
    let (weight, center, moments) = base();
    let root = robot
        .floating
        .then(|| builder.link("base", None, Joint::Floating, Pose::identity(), mass(weight, center, moments)));
    let mut numbers = Vec::new();
    for (i, part) in robot.parts.iter().enumerate() {
        let joint = match part.motion {
            Motion::Turns(axis) => Joint::revolute(axis.into()),
            Motion::Slides(axis) => Joint::prismatic(axis.into()),
        };
        let about = |axis: Vec3, angle: f64| Pose::rotation(angle * axis);
        let [r, p, w] = part.turn;
        let placement = Pose::translation(part.at[0], part.at[1], part.at[2])
            * about(Vec3::z(), w)
            * about(Vec3::y(), p)
            * about(Vec3::x(), r);
        let parent = part.parent.map_or(root, |p| Some(numbers[p]));
        numbers.push(builder.link(
            format!("l{i}"),
            parent,
            joint,
            placement,
            mass(part.mass, part.center, part.moments),
        ));
    }
    builder.build().expect("a valid model")
}

/// Forward dynamics of one state at a time.
pub struct Single {
    dynamics: Dynamics,
    head: usize,
}

impl Single {
    /// Makes the buffers for a robot.
    pub fn new(robot: &Robot) -> Single {
        Single { dynamics: Dynamics::new(&model(robot)), head: if robot.floating { 7 } else { 0 } }
    }

    /// Returns full positions and velocities from those of the joints, with the base at rest at the
    /// origin.
    pub fn state(&self, q: &[f64], v: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let (mut whole_q, mut whole_v) = (vec![0.0; self.head], vec![0.0; self.head.saturating_sub(1)]);
        if self.head > 0 {
            whole_q[6] = 1.0;
        }
        whole_q.extend(q);
        whole_v.extend(v);
        (whole_q, whole_v)
    }

    /// Computes `q̈`.
    pub fn forward_dynamics(&mut self, q: &[f64], v: &[f64], tau: &[f64], qdd: &mut [f64]) {
        forward_dynamics(&mut self.dynamics, &GRAVITY, q, v, tau, qdd).expect("the joints of the models meet inertia");
    }
}

/// The maps of an engine's step, at one state.
pub struct Maps {
    dynamics: Dynamics,
    scratch: Scratch,
    links: usize,
    y: Vec<f64>,
    out: Vec<f64>,
}

impl Maps {
    /// Makes the buffers for a robot.
    pub fn new(robot: &Robot) -> Maps {
        let dynamics = Dynamics::new(&model(robot));
        let (scratch, links, dof) = (dynamics.scratch(), dynamics.links(), dynamics.dof());
        Maps { dynamics, scratch, links, y: vec![0.0; 3 * dof], out: vec![0.0; dof] }
    }

    /// Sets the state.
    pub fn refresh(&mut self, q: &[f64], v: &[f64]) {
        self.dynamics.refresh(q, v);
    }

    /// Computes `q̈` at the state.
    pub fn accelerate(&mut self, tau: &[f64]) {
        self.dynamics.accelerate_in(&mut self.scratch, &GRAVITY, tau, &[], &mut self.out);
    }

    /// Computes the whitened velocity.
    pub fn mul_l(&mut self, v: &[f64]) {
        self.dynamics.mul_l(&mut self.scratch, v, &mut self.out);
    }

    /// Computes test impulses in three directions at the last link.
    pub fn probe(&mut self) {
        let axes = [Vec3::x(), Vec3::y(), Vec3::z()];
        self.dynamics.point_response(self.links - 1, &Vec3::new(0.1, 0.2, 0.3), &axes, 1.0, &mut self.y);
    }
}

/// Forward dynamics of `N` states at a time.
pub struct Batch<const N: usize> {
    dynamics: BatchDynamics<N>,
    q: Vec<Lanes<N>>,
    v: Vec<Lanes<N>>,
    tau: Vec<Lanes<N>>,
    /// The accelerations.
    pub qdd: Vec<Lanes<N>>,
}

impl<const N: usize> Batch<N> {
    /// Makes the buffers for a robot, with one state per lane.
    pub fn new(robot: &Robot, states: &[(Vec<f64>, Vec<f64>, Vec<f64>)]) -> Batch<N> {
        let gather = |pick: &dyn Fn(usize) -> f64| Lanes(std::array::from_fn(pick));
        let (q, v) = (states[0].0.len(), states[0].1.len());
        Batch {
            dynamics: BatchDynamics::new(&model(robot)),
            q: (0..q).map(|k| gather(&|lane| states[lane].0[k])).collect(),
            v: (0..v).map(|k| gather(&|lane| states[lane].1[k])).collect(),
            tau: (0..v).map(|k| gather(&|lane| states[lane].2[k])).collect(),
            qdd: vec![Lanes([0.0; N]); v],
        }
    }

    /// Computes `q̈` of all lanes.
    pub fn forward_dynamics(&mut self) {
        self.dynamics.forward_dynamics(&GRAVITY, &self.q, &self.v, &self.tau, &mut self.qdd).expect("the joints of the models meet inertia");
    }
}
