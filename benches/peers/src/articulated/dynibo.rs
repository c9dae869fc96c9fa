//! The peer: dynibo with a URDF of the robot.

use super::robot::{Motion, Robot, base};
use dynibo::{BaseState, FloatingRobot, Frame, Twist};
use std::fmt::Write;

/// dynibo's robot with its workspace.
pub enum Dynibo {
    /// A fixed base.
    Fixed(dynibo::Robot),
    /// A floating base, at rest at the origin.
    Floating(FloatingRobot, BaseState),
}

impl Dynibo {
    /// Loads the robot through a file in the temporary directory.
    pub fn new(robot: &Robot) -> Dynibo {
        let path = std::env::temp_dir().join(format!("tumble-bench-{}-{}.urdf", std::process::id(), robot.dof()));
        std::fs::write(&path, urdf(robot)).expect("the temporary directory takes a file");
        let made = if robot.floating {
            let rest =
                BaseState::new(Frame::translation(0.0, 0.0, 0.0), Twist::zeros(), Twist::zeros()).expect("finite");
            Dynibo::Floating(FloatingRobot::from_urdf(&path).expect("a valid URDF"), rest)
        } else {
            Dynibo::Fixed(dynibo::Robot::from_urdf(&path).expect("a valid URDF"))
        };
        let _ = std::fs::remove_file(&path);
        made
    }

    /// Returns the order of its joints, as indices of parts.
    pub fn order(&self, robot: &Robot) -> Vec<usize> {
        let name = |i| match self {
            Dynibo::Fixed(r) => r.joint_name(i).map(str::to_owned).expect("a joint"),
            Dynibo::Floating(r, _) => r.joint_name(i).map(str::to_owned).expect("a joint"),
        };
        (0..robot.parts.len()).map(|i| name(i)[1..].parse().expect("joints are named j0, j1, ..")).collect()
    }

    /// Computes `q̈` from joint positions, velocities and all forces; a floating base comes first
    /// in `tau` and `qdd`, in dynibo's order.
    pub fn forward_dynamics(&mut self, q: &[f64], v: &[f64], tau: &[f64], qdd: &mut [f64]) {
        match self {
            Dynibo::Fixed(r) => r.forward_dynamics(q, v, tau, &[], qdd),
            Dynibo::Floating(r, base) => r.forward_dynamics(base, q, v, tau, &[], qdd),
        }
        .expect("not singular");
    }
}

fn urdf(robot: &Robot) -> String {
    let mut out = String::from("<robot name=\"bench\">\n<link name=\"base\">");
    let inertial = |out: &mut String, mass: f64, [x, y, z]: [f64; 3], [xx, yy, zz]: [f64; 3]| {
        let _ = write!(
            out,
            "<inertial><origin xyz=\"{x:?} {y:?} {z:?}\"/><mass value=\"{mass:?}\"/>\
             <inertia ixx=\"{xx:?}\" iyy=\"{yy:?}\" izz=\"{zz:?}\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial>"
        );
    };
    let (mass, center, moments) = base();
    inertial(&mut out, mass, center, moments);
    out += "</link>\n";
    for (i, part) in robot.parts.iter().enumerate() {
        let _ = write!(out, "<link name=\"l{i}\">");
        inertial(&mut out, part.mass, part.center, part.moments);
        let (kind, [x, y, z]) = match part.motion {
            Motion::Turns(axis) => ("revolute", axis),
            Motion::Slides(axis) => ("prismatic", axis),
        };
        let parent = part.parent.map_or("base".to_owned(), |p| format!("l{p}"));
        let ([a, b, c], [r, p, w]) = (part.at, part.turn);
        let _ = writeln!(
            out,
            "</link>\n<joint name=\"j{i}\" type=\"{kind}\"><parent link=\"{parent}\"/><child link=\"l{i}\"/>\
             <origin xyz=\"{a:?} {b:?} {c:?}\" rpy=\"{r:?} {p:?} {w:?}\"/><axis xyz=\"{x:?} {y:?} {z:?}\"/>\
             <limit lower=\"-3\" upper=\"3\" effort=\"100\" velocity=\"10\"/></joint>"
        );
    }
    out + "</robot>\n"
}
