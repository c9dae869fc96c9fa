//! Where the links are and how fast: forward kinematics in world axes [RBDA §4.4, §5.3].
//!
//! Every quantity of a link is in world axes and about the link's own origin, so that a child differs from its parent by a translation alone.
//! With parent `λ`, `r = p − p_λ` and the joint's own motion `ω_J = S_ω·q̇`, `v_J = S_v·q̇`:
//!
//! ```text
//! ω = ω_λ + ω_J                                   v = v_λ + ω_λ×r + v_J
//! α = α_λ + S_ω·q̈ + ω_λ×ω_J                       a = a_λ + α_λ×r + ω_λ×(ω_λ×r) + S_v·q̈ + 2ω_λ×v_J
//! ```
//!
//! `a` is the acceleration of the material point at the origin (not the spatial acceleration, from which it differs by `ω×v`).
//!
//! | symbol | meaning |
//! |---|---|
//! | `p`, `R` | origin of the link and its axes, in the world |
//! | `ω`, `v` | angular velocity; velocity of the origin |
//! | `α`, `a` | angular acceleration; acceleration of the origin |
//! | `S = [S_ω; S_v]` | motion subspace of the joint: one column per velocity number |
//! | `c`, `I` | from origin to centre of mass; inertia about the origin |

use crate::articulated::model::coordinates::{read_rotation, read_vector};
use crate::articulated::model::joint::Joint;
use crate::articulated::model::{Link, LinkFrame, Model};
use nalgebra::{ComplexField, Quaternion, Rotation3, Unit};
use tumble_collide::{Mat3, Pose, Quat, Vec3};

/// A link at one instant: world axes, about the link's origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkMotion {
    /// Pose of the link in the world.
    pub pose: Pose,
    /// Angular velocity, rad/s.
    pub angular: Vec3,
    /// Velocity of the origin, m/s.
    pub linear: Vec3,
    /// From the parent's origin (the world's for a root) to this one, metres.
    pub arm: Vec3,
    /// From the origin to the centre of mass, metres.
    pub center: Vec3,
    /// Inertia about the origin, kg·m².
    pub inertia: Mat3,
}

/// Two vectors of one link: rates of rotation and of its origin (a column of `S`, or accelerations).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rates {
    /// About the origin.
    pub angular: Vec3,
    /// Of the origin.
    pub linear: Vec3,
}

impl Rates {
    /// Neither.
    pub fn zero() -> Rates {
        Rates { angular: Vec3::zeros(), linear: Vec3::zeros() }
    }

    fn add(&mut self, other: &Rates, by: f64) {
        self.angular += other.angular * by;
        self.linear += other.linear * by;
    }
}

/// Poses, velocities and motion subspaces of all links at the position and velocity of the last [`refresh`](Self::refresh).
#[derive(Clone, Debug, PartialEq)]
pub struct Kinematics {
    links: Vec<LinkMotion>,
    columns: Vec<Rates>,
    joint_rates: Vec<Rates>,
}

impl Kinematics {
    /// Room for `model`, at its zero position and at rest.
    pub fn new(model: &Model) -> Kinematics {
        let still = LinkMotion {
            pose: Pose::identity(),
            angular: Vec3::zeros(),
            linear: Vec3::zeros(),
            arm: Vec3::zeros(),
            center: Vec3::zeros(),
            inertia: Mat3::zeros(),
        };
        let count = model.links().len();
        let mut made = Kinematics {
            links: vec![still; count],
            columns: vec![Rates::zero(); model.dof()],
            joint_rates: vec![Rates::zero(); count],
        };
        let mut zero = vec![0.0; model.positions()];
        model.write_zero(&mut zero);
        made.refresh(model, &zero, &vec![0.0; model.dof()]);
        made
    }

    /// Takes positions `q` and velocities `v` of the model that it was made for.
    pub fn refresh(&mut self, model: &Model, q: &[f64], v: &[f64]) {
        for (i, link) in model.links().iter().enumerate() {
            let pose = self.place(link, &q[link.q..]);
            self.place_columns(link, &pose);
            let moves = self.along(link, v);
            let r = pose.rotation.to_rotation_matrix().into_inner();
            let (base, angular, linear) = self.carrier(link);
            let arm = pose.translation.vector - base;
            self.joint_rates[i] = moves;
            self.links[i] = LinkMotion {
                pose,
                angular: angular + moves.angular,
                linear: linear + angular.cross(&arm) + moves.linear,
                arm,
                center: r * link.mass.center,
                inertia: r * link.mass.about_origin() * r.transpose(),
            };
        }
    }

    /// The moving links, numbered as in the model.
    pub fn links(&self) -> &[LinkMotion] {
        &self.links
    }

    /// The columns of `S`, one per velocity number: what the link that the number belongs to does, relative to its parent, at unit velocity.
    pub fn columns(&self) -> &[Rates] {
        &self.columns
    }

    /// Pose in the world of a named frame of the model.
    pub fn frame_pose(&self, frame: &LinkFrame) -> Pose {
        frame.link.map_or(frame.pose, |i| self.links[i].pose * frame.pose)
    }

    /// Accelerations of all links for given `qdd` (empty for none), with `base` added to the acceleration of everything: `−gravity` makes weights of masses.
    pub fn accelerations(&self, model: &Model, qdd: &[f64], base: &Vec3, out: &mut [Rates]) {
        for (i, link) in model.links().iter().enumerate() {
            let (own, moves) = (&self.links[i], &self.joint_rates[i]);
            let mut a = Rates { angular: Vec3::zeros(), linear: *base };
            if let Some(parent) = link.parent {
                let (turn, from) = (self.links[parent].angular, out[parent]);
                a.angular = from.angular + turn.cross(&moves.angular);
                a.linear = from.linear
                    + from.angular.cross(&own.arm)
                    + turn.cross(&(turn.cross(&own.arm) + 2.0 * moves.linear));
            }
            if !qdd.is_empty() {
                a.add(&self.along(link, qdd), 1.0);
            }
            out[i] = a;
        }
    }

    /// Accelerations of all links that their velocities alone cause: `J̇·v`, those for `qdd = 0` without gravity.
    pub fn bias_accelerations(&self, model: &Model, out: &mut [Rates]) {
        self.accelerations(model, &[], &Vec3::zeros(), out);
    }

    /// `S·rates` of one joint.
    fn along(&self, link: &Link, rates: &[f64]) -> Rates {
        let mut sum = Rates::zero();
        for k in link.v..link.v + link.joint.dof() {
            sum.add(&self.columns[k], rates[k]);
        }
        sum
    }

    /// Origin and velocities of what the link hangs on.
    fn carrier(&self, link: &Link) -> (Vec3, Vec3, Vec3) {
        link.parent.map_or((Vec3::zeros(), Vec3::zeros(), Vec3::zeros()), |i| {
            let parent = &self.links[i];
            (parent.pose.translation.vector, parent.angular, parent.linear)
        })
    }

    /// `X_W = X_λ·placement·X_J(q)`; a floating link's position is its pose in the world.
    fn place(&self, link: &Link, q: &[f64]) -> Pose {
        let joint = match link.joint {
            Joint::Fixed => Pose::identity(),
            Joint::Revolute { axis } => Pose::from_parts(Vec3::zeros().into(), about(&axis, q[0])),
            Joint::Prismatic { axis } => (axis * q[0]).into(),
            Joint::Spherical => Pose::from_parts(Vec3::zeros().into(), read_rotation(q)),
            Joint::Floating => return Pose::from_parts(read_vector(q).into(), read_rotation(&q[3..])),
        };
        let anchor = link.parent.map_or(link.placement, |i| self.links[i].pose * link.placement);
        anchor * joint
    }

    /// The joint's columns of `S`; joint axes are the link's axes seen along the joint, because a turn about an axis leaves it where it is.
    fn place_columns(&mut self, link: &Link, pose: &Pose) {
        let r: Rotation3<f64> = pose.rotation.to_rotation_matrix();
        let (mut columns, zero) = (self.columns[link.v..].iter_mut(), Vec3::zeros());
        let mut push = |angular, linear| {
            if let Some(column) = columns.next() {
                *column = Rates { angular, linear };
            }
        };
        match link.joint {
            Joint::Fixed => {}
            Joint::Revolute { axis } => push(r * axis, zero),
            Joint::Prismatic { axis } => push(zero, r * axis),
            Joint::Spherical => (0..3).for_each(|k| push(r.matrix().column(k).into(), zero)),
            Joint::Floating => {
                (0..3).for_each(|k| push(Vec3::ith(k, 1.0), zero));
                (0..3).for_each(|k| push(zero, Vec3::ith(k, 1.0)));
            }
        }
    }
}

/// Rotation by `angle` about a unit axis.
fn about(axis: &Vec3, angle: f64) -> Quat {
    let (s, c) = ComplexField::sin_cos(0.5 * angle);
    Unit::new_unchecked(Quaternion::from_parts(c, axis * s))
}
