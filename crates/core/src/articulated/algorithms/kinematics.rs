//! Forward kinematics in world axes: poses and velocities of the links [RBDA §4.4, §5.3].
//!
//! Every quantity of a link is in world axes and about the link's own origin, so that a child
//! differs from its parent by a translation alone. With parent `λ`, `r = p − p_λ` and the joint's
//! own motion `ω_J = S_ω·q̇`, `v_J = S_v·q̇`:
//!
//! ```text
//! ω = ω_λ + ω_J                                   v = v_λ + ω_λ×r + v_J
//! α = α_λ + S_ω·q̈ + ω_λ×ω_J                       a = a_λ + α_λ×r + ω_λ×(ω_λ×r) + S_v·q̈ + 2ω_λ×v_J
//! ```
//!
//! `a` is the acceleration of the material point at the origin; the spatial acceleration differs by
//! `ω×v`.
//!
//! | symbol | meaning |
//! |---|---|
//! | `p`, `R` | origin of the link and its axes, in the world |
//! | `ω`, `v` | angular velocity; velocity of the origin |
//! | `α`, `a` | angular acceleration; acceleration of the origin |
//! | `S = [S_ω; S_v]` | motion subspace of the joint: one column per velocity number |
//! | `c`, `I` | from origin to center of mass; inertia about the origin |

use crate::articulated::model::coordinates::{read_rotation, read_vector};
use crate::articulated::model::joint::Joint;
use crate::articulated::model::{Link, LinkFrame, Model};
use nalgebra::{ComplexField, Quaternion, Rotation3, Unit};
use tumble_collide::{Mat3, Pose, Quat, Vec3};

/// Motion of a link at one instant: world axes, about the link's origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkMotion {
    /// Pose of the link in the world.
    pub pose: Pose,
    /// Angular velocity, rad/s.
    pub angular: Vec3,
    /// Velocity of the origin, m/s.
    pub linear: Vec3,
    /// From the parent's origin (the world's for a root) to this one, m.
    pub arm: Vec3,
    /// From the origin to the center of mass, m.
    pub center: Vec3,
    /// Inertia about the origin, kg·m².
    pub inertia: Mat3,
}

/// Angular and linear rates of one link: a column of `S`, or accelerations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rates {
    /// Rate of rotation.
    pub angular: Vec3,
    /// Rate of the origin.
    pub linear: Vec3,
}

impl Rates {
    /// Returns zero rates.
    pub fn zero() -> Rates {
        Rates { angular: Vec3::zeros(), linear: Vec3::zeros() }
    }

    fn add(&mut self, other: &Rates, by: f64) {
        self.angular += other.angular * by;
        self.linear += other.linear * by;
    }
}

/// Poses, velocities and motion subspaces of all links at the positions and velocities of the last
/// [`refresh`](Self::refresh).
#[derive(Clone, Debug, PartialEq)]
pub struct Kinematics {
    links: Vec<LinkMotion>,
    columns: Vec<Rates>,
    joint_rates: Vec<Rates>,
}

impl Kinematics {
    /// Allocates buffers for `model`, at its zero position and at rest.
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

    /// Sets positions `q` and velocities `v` of the model that it was made for.
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

    /// Returns the moving links, numbered as in the model.
    pub fn links(&self) -> &[LinkMotion] {
        &self.links
    }

    /// Returns the velocity of each link relative to its parent, `S·q̇`.
    pub(super) fn joint_rates(&self) -> &[Rates] {
        &self.joint_rates
    }

    /// Returns the columns of `S`, one per velocity number: the motion of its link relative to the
    /// parent at unit velocity.
    pub fn columns(&self) -> &[Rates] {
        &self.columns
    }

    /// Returns the pose in the world of a named frame of the model.
    pub fn frame_pose(&self, frame: &LinkFrame) -> Pose {
        frame.link.map_or(frame.pose, |i| self.links[i].pose * frame.pose)
    }

    /// Writes the accelerations of all links for given `qdd` (empty for none). `base` is added to
    /// every acceleration: `−gravity` turns masses into weights.
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

    /// Writes the accelerations of all links due to their velocities alone, `J̇·v`: those for `qdd
    /// = 0` without gravity.
    pub fn bias_accelerations(&self, model: &Model, out: &mut [Rates]) {
        self.accelerations(model, &[], &Vec3::zeros(), out);
    }

    /// Returns `S·rates` of one joint.
    fn along(&self, link: &Link, rates: &[f64]) -> Rates {
        let mut sum = Rates::zero();
        for k in link.v..link.v + link.joint.dof() {
            sum.add(&self.columns[k], rates[k]);
        }
        sum
    }

    /// Returns origin, angular velocity and linear velocity of the link's parent.
    fn carrier(&self, link: &Link) -> (Vec3, Vec3, Vec3) {
        link.parent.map_or((Vec3::zeros(), Vec3::zeros(), Vec3::zeros()), |i| {
            let parent = &self.links[i];
            (parent.pose.translation.vector, parent.angular, parent.linear)
        })
    }

    /// Returns `X_W = X_λ·placement·X_J(q)`; a floating link's position is its pose in the world.
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

    /// Sets the joint's columns of `S`. Joint axes equal the link's axes along the joint, because a
    /// rotation leaves its own axis fixed.
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

/// Returns the rotation by `angle` about a unit axis.
fn about(axis: &Vec3, angle: f64) -> Quat {
    let (s, c) = ComplexField::sin_cos(0.5 * angle);
    Unit::new_unchecked(Quaternion::from_parts(c, axis * s))
}
