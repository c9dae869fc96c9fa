//! Dense mechanics of a tree of links, straight from the definitions and slow: poses by composing
//! isometries, Jacobians by summing over the path to the root, the mass matrix as a sum over links,
//! velocity terms by numerical differentiation along the motion. Shares no code with the library's
//! sweeps.

use nalgebra::{DMatrix, DVector, Matrix3, Quaternion, Translation3, UnitQuaternion, Vector3};
use tumble_core::articulated::Link;
use tumble_core::collide::{Mat3, Pose, Vec3};
use tumble_core::{Joint, LinkMass, Model, ModelBuilder, Wrench};

/// Pseudorandom numbers, the same in every run.
pub struct Numbers(u64);

impl Numbers {
    pub fn new(seed: u64) -> Numbers {
        Numbers(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    /// Returns a number in [-1, 1).
    pub fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    pub fn below(&mut self, n: usize) -> usize {
        ((0.5 + 0.5 * self.next()) * n as f64) as usize
    }

    pub fn vector(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next())
    }

    pub fn rotation(&mut self) -> UnitQuaternion<f64> {
        UnitQuaternion::from_scaled_axis(3.0 * self.vector())
    }

    pub fn pose(&mut self, reach: f64) -> Pose {
        Pose::from_parts((reach * self.vector()).into(), self.rotation())
    }

    pub fn list(&mut self, n: usize, size: f64) -> Vec<f64> {
        (0..n).map(|_| size * self.next()).collect()
    }

    /// Returns a body of about 1 kg and 0.2 m, its mass distributed over points.
    pub fn mass(&mut self) -> LinkMass {
        let point = |n: &mut Numbers| LinkMass::point(0.2 + 0.1 * n.next(), 0.2 * n.vector());
        (0..5).map(|_| point(self)).reduce(|a, b| a.with(&b)).unwrap()
    }
}

/// The kinds of joints in a tree.
#[derive(Clone, Copy, PartialEq)]
pub enum Kinds {
    Hinges,
    All,
}

/// Returns a random tree with several roots, branches and chains.
pub fn random_tree(links: usize, kinds: Kinds, seed: u64) -> Model {
    let mut n = Numbers::new(seed);
    let mut builder = ModelBuilder::new();
    for i in 0..links {
        let parent = match n.below(8) {
            _ if i == 0 => None,
            0 => None,
            1..=4 => Some(i - 1),
            _ => Some(n.below(i)),
        };
        let joint = match n.below(6) {
            _ if kinds == Kinds::Hinges => Joint::revolute(n.vector()),
            0 => Joint::prismatic(n.vector()),
            1 => Joint::Spherical,
            2 | 3 if parent.is_none() => Joint::Floating,
            2 if i > 0 => Joint::Fixed,
            _ => Joint::revolute(n.vector()),
        };
        let placement = if joint == Joint::Floating { Pose::identity() } else { n.pose(0.3) };
        let mass = n.mass();
        builder.link(format!("link {i}"), parent, joint, placement, mass);
    }
    builder.build().unwrap()
}

/// Returns a random state: positions and velocities.
pub fn random_state(model: &Model, seed: u64) -> (Vec<f64>, Vec<f64>) {
    let mut n = Numbers::new(seed);
    let mut q = n.list(model.positions(), 2.0);
    for link in model.links() {
        if let Some(k) = link.joint.quaternion() {
            q[link.q + k..link.q + k + 4].copy_from_slice(n.rotation().coords.as_slice());
        }
    }
    let v = n.list(model.dof(), 1.0);
    (q, v)
}

/// Poses of the links.
pub fn poses(model: &Model, q: &[f64]) -> Vec<Pose> {
    let mut poses: Vec<Pose> = Vec::new();
    for link in model.links() {
        let quaternion =
            |k: usize| UnitQuaternion::from_quaternion(Quaternion::new(q[k + 3], q[k], q[k + 1], q[k + 2]));
        let k = link.q;
        let within = match link.joint {
            Joint::Revolute { axis } => {
                Pose::from_parts(Translation3::identity(), UnitQuaternion::from_scaled_axis(q[k] * axis))
            }
            Joint::Prismatic { axis } => Pose::from_parts((q[k] * axis).into(), UnitQuaternion::identity()),
            Joint::Spherical => Pose::from_parts(Translation3::identity(), quaternion(k)),
            Joint::Floating => Pose::from_parts(Translation3::new(q[k], q[k + 1], q[k + 2]), quaternion(k + 3)),
            Joint::Fixed => unreachable!(),
        };
        let outer = link.parent.map_or(Pose::identity(), |p| poses[p]);
        poses.push(if link.joint == Joint::Floating { within } else { outer * link.placement * within });
    }
    poses
}

/// `q` after moving for `h` with velocity `v`.
pub fn moved(model: &Model, q: &[f64], v: &[f64], h: f64) -> Vec<f64> {
    let mut out = q.to_vec();
    let turn = |out: &mut [f64], k: usize, w: Vec3, own: bool| {
        let old = UnitQuaternion::from_quaternion(Quaternion::new(q[k + 3], q[k], q[k + 1], q[k + 2]));
        let by = UnitQuaternion::from_scaled_axis(h * w);
        out[k..k + 4].copy_from_slice(if own { old * by } else { by * old }.coords.as_slice());
    };
    for Link { joint, q: k, v: j, .. } in model.links() {
        match joint {
            Joint::Spherical => turn(&mut out, *k, Vec3::new(v[*j], v[j + 1], v[j + 2]), true),
            Joint::Floating => {
                (0..3).for_each(|c| out[k + c] += h * v[j + 3 + c]);
                turn(&mut out, k + 3, Vec3::new(v[*j], v[j + 1], v[j + 2]), false);
            }
            _ => out[*k] += h * v[*j],
        }
    }
    out
}

/// Jacobian of `[ω; velocity of the point]` of a link; the point is given in the link's frame.
pub fn jacobian(model: &Model, poses: &[Pose], link: usize, point: &Vec3) -> DMatrix<f64> {
    let at = poses[link].transform_point(&(*point).into()).coords;
    let mut jacobian = DMatrix::zeros(6, model.dof());
    let mut next = Some(link);
    while let Some(i) = next {
        let (l, pose) = (&model.links()[i], &poses[i]);
        let arm = at - pose.translation.vector;
        let mut column = |k: usize, angular: Vec3, linear: Vec3| {
            jacobian.fixed_view_mut::<3, 1>(0, k).copy_from(&angular);
            jacobian.fixed_view_mut::<3, 1>(3, k).copy_from(&(linear + angular.cross(&arm)));
        };
        for c in 0..l.joint.dof() {
            let e = Vec3::ith(c % 3, 1.0);
            match l.joint {
                Joint::Revolute { axis } => column(l.v, pose * axis, Vec3::zeros()),
                Joint::Prismatic { axis } => column(l.v, Vec3::zeros(), pose * axis),
                Joint::Spherical => column(l.v + c, pose * e, Vec3::zeros()),
                _ if c < 3 => column(l.v + c, e, Vec3::zeros()),
                _ => column(l.v + c, Vec3::zeros(), e),
            }
        }
        next = l.parent;
    }
    jacobian
}

/// `M = Σ Jᵀ I J`.
pub fn mass_matrix(model: &Model, q: &[f64]) -> DMatrix<f64> {
    let poses = poses(model, q);
    let mut mass = DMatrix::zeros(model.dof(), model.dof());
    for (i, link) in model.links().iter().enumerate() {
        let j = jacobian(model, &poses, i, &link.mass.center);
        let r: Mat3 = poses[i].rotation.to_rotation_matrix().into_inner();
        let (turn, slide) = (j.rows(0, 3), j.rows(3, 3));
        let inertia: Matrix3<f64> = r * link.mass.inertia * r.transpose();
        mass += turn.transpose() * inertia * turn + link.mass.mass * slide.transpose() * slide;
    }
    mass
}

/// Acceleration `[α; a]` of a point of a link for `q̈ = 0`: the derivative of `J v` along the
/// motion, by central differences of sixth order.
pub fn drift(model: &Model, q: &[f64], v: &[f64], link: usize, point: &Vec3) -> DVector<f64> {
    const H: f64 = 2e-3;
    let rate = DVector::from_column_slice(v);
    let along = |k: f64| {
        let q = moved(model, q, v, k * H);
        jacobian(model, &poses(model, &q), link, point) * &rate
    };
    ((along(3.0) - along(-3.0)) / 60.0 - (along(2.0) - along(-2.0)) * 0.15 + (along(1.0) - along(-1.0)) * 0.75) / H
}

/// `c` of `M q̈ + c = τ`: velocity terms, gravity and wrenches on the links.
pub fn bias(model: &Model, q: &[f64], v: &[f64], gravity: &Vec3, wrenches: &[Wrench]) -> DVector<f64> {
    let poses = poses(model, q);
    let mut bias = DVector::zeros(model.dof());
    for (i, link) in model.links().iter().enumerate() {
        let j = jacobian(model, &poses, i, &link.mass.center);
        let a = drift(model, q, v, i, &link.mass.center);
        let r: Mat3 = poses[i].rotation.to_rotation_matrix().into_inner();
        let inertia: Matrix3<f64> = r * link.mass.inertia * r.transpose();
        let velocity = &j * DVector::from_column_slice(v);
        let omega = Vector3::new(velocity[0], velocity[1], velocity[2]);
        let torque = inertia * a.fixed_rows::<3>(0) + omega.cross(&(inertia * omega));
        let force = link.mass.mass * (a.fixed_rows::<3>(3) - gravity);
        bias += j.rows(0, 3).transpose() * torque + j.rows(3, 3).transpose() * force;
        if let Some(w) = wrenches.get(i) {
            let j = jacobian(model, &poses, i, &Vec3::zeros());
            bias -= j.rows(0, 3).transpose() * w.torque + j.rows(3, 3).transpose() * w.force;
        }
    }
    bias
}
